// SPDX-License-Identifier: Apache-2.0
// Lockstep of a few clocks from states that no run reaches in its time: counters just below their limits, any
// value of any register, two events in one clock, upset flops. Model and RTL are proved equal in every state
// that holds the invariants (cmodel/invariants.hpp), so every such state is a fair one; here both are
// simulated from it.
#pragma once

#include <cstdint>

#include "base/rng.hpp"
#include "cmodel/chip.hpp"
#include "tb/lockstep/fault_crosses.hpp"
#include "tb/lockstep/toggles.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/stimulus/moments.hpp"

namespace meltstage::tb {

// One of the moments with flops of some blocks and registers changed; an invariant may no longer hold in it.
Moment any_moment(Rng& rng, const Moments& moments);

// Changes flops of one block of a moment, few of them or all.
void change_one_block(Rng& rng, const Moments& moments, Moment& moment);

bool holds_invariants(const chip::Chip& chip);

// What the trials have reached.
struct TrialCount {
  std::uint64_t compared = 0;  // trials
  std::uint64_t clocks = 0;
  std::uint64_t refused = 0;  // states without an invariant: not compared
  FlopToggles toggles;        // but for what a reset does
  FaultCrosses crosses;
};

// Trials first .. first + count - 1 of a seed. Each takes a moment, changes flops of one block and registers,
// and steps both with restless pins. Throws Mismatch, whose report names the trial and what it had changed.
// Turns the RTL's assertions off.
TrialCount step_from_any_state(const Moments& moments, VerilatedRtl& rtl, std::uint64_t seed,
                               std::uint64_t first, std::uint64_t count);

}  // namespace meltstage::tb
