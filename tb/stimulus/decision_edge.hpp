// SPDX-License-Identifier: Apache-2.0
// The edge of a decision: two values of a flop, one apart, from which the next clock takes different ways. A
// comparison that leaves out a bit, or takes <= for <, shows nowhere else.
#pragma once

#include <cstdint>

#include "base/rng.hpp"
#include "cmodel/chip.hpp"
#include "tb/pins/flop_table.hpp"

namespace meltstage::tb {

// Sets the bits of a flop that are flops, and what the model derives from them.
void set_flop(const Flop& flop, std::uint64_t value, chip::Chip& chip);

// A hash of what tells the way of a block in the next clock: its narrow flops after it, and which of the wide
// ones keep their value.
std::uint64_t way_of_block(const FlopBlock& block, const chip::Chip& before, const chip::Chip& after);

// Sets `flop` to a value at such an edge of a block's way, if one lies between `low` and `high`: whether
// there is one. It is found by bisection, a step of the model for each bit of the flop.
bool set_at_decision_edge(Rng& rng, const FlopBlock& block, const Flop& flop, std::uint64_t low,
                          std::uint64_t high, const chip::Inputs& in, chip::Chip& chip);

}  // namespace meltstage::tb
