// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/files/stil.hpp"

#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    constexpr std::size_t kMostFuzzed = 1000;  // cycles: an input takes milliseconds
    meltstage::dft::parse_stil(text, "fuzz.stil", kMostFuzzed);
  });
}
