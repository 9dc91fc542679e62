// SPDX-License-Identifier: Apache-2.0
// Lockstep of a few clocks from states that no run reaches in its time: counters just below their limits, any
// value of any register, two events in one clock, upset flops. Model and RTL are proved equal in every state
// that holds the invariants (cmodel/invariants.hpp), so every such state is a fair one; here both are
// simulated from it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "base/rng.hpp"
#include "cmodel/chip.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/flop_table.hpp"

namespace meltstage::tb {

// A state and the pins of the clock that follows it.
struct Moment {
  chip::Chip chip;
  chip::Inputs in;
  std::size_t block = 0;                 // of flop_blocks(), in which something happens
  std::vector<unsigned> registers_read;  // holding registers on which the next state depends
  // For each block of flop_blocks() the flops, of any block, whose other values take it another way.
  std::vector<std::vector<const Flop*>> steering;
};

// Moments of random runs of the model, each just before a flag, a state or a step of a computation takes
// another value. As many are kept of a rare event as of a frequent one, and each block, each flop of it and
// each value of it is drawn as often as another.
class Moments {
 public:
  // From runs of `clocks` clocks on each of the seeds first .. first + seeds - 1.
  Moments(std::uint64_t first, std::uint64_t seeds, std::uint64_t clocks);

  const Moment& any(Rng& rng) const;
  // Events that were met.
  std::size_t events() const;

  // The holding registers that a block of flop_blocks() was seen to read in these moments.
  const std::vector<unsigned>& registers_read_by(std::size_t block) const { return read_by_[block]; }

 private:
  friend class Collector;
  void look_into(Moment& moment, std::vector<std::set<unsigned>>& read_by);

  struct Value {
    std::uint64_t value = 0, met = 0;
    std::vector<Moment> kept;
  };
  struct NarrowFlop {
    Flop flop;
    std::vector<Value> values;
  };
  std::vector<std::vector<NarrowFlop>> blocks_;  // those with an event
  std::vector<std::vector<unsigned>> read_by_;
};

// Two runs of each kind; enough that every event of the model is met.
inline constexpr std::uint64_t kMomentSeeds = 32;
inline constexpr std::uint64_t kMomentClocks = 100'000;

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
};

// Trials first .. first + count - 1 of a seed. Each takes a moment, changes flops of one block and registers,
// and steps both with restless pins. Throws Mismatch, whose report names the trial and what it had changed.
// Turns the RTL's assertions off.
TrialCount step_from_any_state(const Moments& moments, VerilatedRtl& rtl, std::uint64_t seed,
                               std::uint64_t first, std::uint64_t count);

}  // namespace meltstage::tb
