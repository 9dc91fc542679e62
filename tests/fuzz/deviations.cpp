// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/accuracy.hpp"
#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    const auto targets = meltstage::motion::read_deviations_text("fuzz.csv", text);
    meltstage::motion::evaluate_accuracy(targets);
  });
}
