// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/coordinate_sources.hpp"
#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(
      data, size, [](std::string_view text) { meltstage::motion::detail::read_wafer_map("fuzz.xml", text); });
}
