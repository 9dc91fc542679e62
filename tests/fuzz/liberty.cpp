// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/liberty.hpp"

#include "asic/layout/db/delays.hpp"
#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    meltstage::dft::parse_liberty(text, "fuzz.lib");
    meltstage::layout::parse_delays(text, "fuzz.lib");
  });
}
