// SPDX-License-Identifier: Apache-2.0
#include "base/build_stamp.hpp"

namespace meltstage {

std::string version() {
  const std::string stamp = MELTSTAGE_STAMP;
  return MELTSTAGE_VERSION + (stamp.empty() ? std::string() : " (" + stamp + ")");
}
std::string rtl_sha256() { return MELTSTAGE_RTL_SHA256; }
std::string verilator_version() { return MELTSTAGE_VERILATOR; }
std::string compiler_version() { return "g++ " __VERSION__; }

}  // namespace meltstage
