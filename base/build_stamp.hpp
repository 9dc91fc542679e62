// SPDX-License-Identifier: Apache-2.0
// What this command was built from.
#pragma once

#include <string>

namespace meltstage {

std::string version();     // "0.1.0 (1a2b3c4)", the stamp only where the source was a git checkout
std::string rtl_sha256();  // of the RTL sources in compile order
std::string verilator_version();
std::string compiler_version();

}  // namespace meltstage
