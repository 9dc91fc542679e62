// SPDX-License-Identifier: Apache-2.0
#include "tb/scenario/scenario.hpp"

#include <fmt/format.h>

#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    if (const auto parsed = meltstage::tb::parse_scenario(text); parsed.defect)
      throw meltstage::UserError(fmt::format("line {}: found {}, expected {}", parsed.defect->line,
                                             parsed.defect->found, parsed.defect->expected));
  });
}
