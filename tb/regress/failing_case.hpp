// SPDX-License-Identifier: Apache-2.0
// A mismatch made small: the fewest clocks, from a state that differs from reset in as few flops as it takes.
// Every flop is compared on every clock, so what led there doesn't matter: the state of the last equal clock
// is all that a mismatch needs, unless the RTL holds something that no comparison sees.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tb/lockstep/lockstep.hpp"
#include "tb/lockstep/verilated_rtl.hpp"

namespace meltstage::tb {

struct FailingCase {
  std::string origin;                // the run that it is from
  chip::Chip state;                  // of model and RTL alike
  std::vector<chip::Inputs> inputs;  // pins before each clock; model and RTL differ after the last
  std::vector<std::string> differs;  // the flops and pins that do
};

// The smallest of the stretch's tails that fails by itself on `rtl`, whose assertions are turned off; nothing
// when none does. Flops and pins that the mismatch doesn't need stand as after reset.
std::optional<FailingCase> shrink(const FailedStretch& stretch, const std::string& origin, VerilatedRtl& rtl);

// Model and `rtl` over the case's clocks: the flops and pins that differ after the first clock in which any
// do, and that clock from 0; no names when all are equal.
struct CaseVerdict {
  std::vector<std::string> differs;
  std::size_t clock = 0;
};
CaseVerdict replay(const FailingCase& failing, VerilatedRtl& rtl);

// "2 clocks from a state that differs from reset in 5 flops", and a line for each flop and clock.
std::string describe(const FailingCase& failing);

// JSON that a person can read and change: flops and pins by name, those that stand as after reset left out.
void write_case(const std::filesystem::path& path, const FailingCase& failing);
// Throws UserError for a file that is none, or names a flop or pin that isn't there.
FailingCase read_case(const std::filesystem::path& path);

}  // namespace meltstage::tb
