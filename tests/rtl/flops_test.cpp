// SPDX-License-Identifier: Apache-2.0
// The lockstep compares every flop of the chip: Yosys finds as many flop bits in the RTL as it looks at.
#include <gtest/gtest.h>

#include <bit>
#include <fstream>
#include <regex>
#include <string>

#include "cmodel/spec.hpp"
#include "tb/lockstep/verilated_rtl.hpp"

namespace meltstage::tb {
namespace {

struct FlopReport {
  unsigned bits = 0;        // with asynchronous reset
  std::string other_kinds;  // latches, memories, flops without reset
};

// Lines "$adff_16   205" of Yosys' `stat -width`.
FlopReport read_report() {
  std::ifstream file(FLOP_REPORT);
  const std::regex line_form(R"(\s*\$(\w*ff\w*|\w*latch\w*|mem\w*wr\w*|sr)_(\d+)\s+(\d+)\s*)");
  FlopReport report;
  std::smatch match;
  for (std::string line; std::getline(file, line);) {
    if (!std::regex_match(line, match, line_form)) continue;
    if (match[1] == "adff")
      report.bits += static_cast<unsigned>(std::stoul(match[2]) * std::stoul(match[3]));
    else
      report.other_kinds += line + '\n';
  }
  return report;
}

// MEM's words are 22 bits wide in the RTL as written; those that no value of the register needs are constant.
unsigned constant_bits() {
  unsigned bits = 0;
  for (std::size_t i = 1; i < chip::spec::kHolding.size(); ++i)
    bits += 2 * (22 - static_cast<unsigned>(std::popcount(chip::spec::kHolding[i].stored)));
  return bits;
}

TEST(Flops, LockstepComparesEveryFlopOfTheRtl) {
  EXPECT_EQ(read_report().bits, make_verilated_rtl()->flop_bits() + constant_bits());
}

TEST(Flops, EveryFlopHasAnAsynchronousReset) { EXPECT_EQ(read_report().other_kinds, ""); }

}  // namespace
}  // namespace meltstage::tb
