// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "motion/surface/probe.hpp"
#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  using meltstage::motion::ProbeLine;
  static const std::array lines{
      ProbeLine{"A", {{{0.0, 0.0, 0.0}}, {{1.0, 0.0, 0.5}}}}};  // the corpus touches these
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    meltstage::motion::require_probe_program("fuzz.ngc", text, lines, {});
  });
}
