// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/diagnosis/fail_log.hpp"

#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  using namespace meltstage::dft;
  static const CycleStream kStream = [] {
    CycleStream stream;
    stream.title = "patterns";
    stream.signals = {{"in", true}, {"out", false}};
    stream.cycles = {{"0H", "", 1}, {"1L", "", 40}, {"1X", "", 1}};
    return stream;
  }();
  return meltstage::reads_or_refuses(
      data, size, [](std::string_view text) { parse_fail_log(text, "fail.log", kStream); });
}
