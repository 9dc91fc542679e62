// SPDX-License-Identifier: Apache-2.0
// skip() of the model against step() from any state: counters near their limits, any register value, upset
// flops.
#pragma once

#include <cstdint>

#include "base/rng.hpp"
#include "tb/stimulus/any_state.hpp"

namespace meltstage::tb {

// What the trials have reached.
struct SkipCount {
  std::uint64_t skipped = 0;  // stretches
  std::uint64_t whole = 0;    // of those, to their very end
  std::uint64_t clocks = 0;

  friend bool operator==(const SkipCount&, const SkipCount&) = default;
};

// Of a stretch of `quiet` clocks: all of it, just less, or any part, as often short as long. What is longer
// than two milliseconds is skipped in part, and most of it in a small one: each clock is stepped as well.
std::uint64_t part_of(Rng& rng, std::uint64_t quiet);

// `count` trials of a seed. Throws Mismatch, whose report names the trial.
SkipCount skip_from_any_state(const Moments& moments, std::uint64_t seed, std::uint64_t count);

}  // namespace meltstage::tb
