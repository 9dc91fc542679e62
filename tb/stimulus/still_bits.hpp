// SPDX-License-Identifier: Apache-2.0
// Flop bits that have not switched both ways yet, and states from which they may: a clock in which a flop
// takes another value is kept, and used again from just before a carry into the bit. As fuzzers do, what has
// been reached leads to what has not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/rng.hpp"
#include "cmodel/chip.hpp"
#include "tb/lockstep/toggles.hpp"
#include "tb/stimulus/moments.hpp"

namespace meltstage::tb {

// A bit of a flop, and a moment before the flop takes another value, from which the bit may switch.
struct Aim {
  const Flop* flop = nullptr;
  unsigned bit = 0;
  Moment moment;

  bool switches() const;
};

class StillBits {
 public:
  StillBits();

  // A clock of a trial.
  void observe(const chip::Chip& before, const chip::Inputs& in, const chip::Chip& after);
  // At a still bit as often as at any other: a carry comes to it, or a load over a value that has it already
  // or has it not. None where the flop was not seen to change.
  std::optional<Aim> aim(Rng& rng) const;
  // It has not switched in the direction in which it would from there.
  bool is_still(const Aim& aim) const;

  const FlopToggles& toggles() const { return toggles_; }

 private:
  // Some of the last clocks in which a flop took another value.
  struct Lately {
    std::uint64_t met = 0;
    std::vector<Moment> moments;
  };

  const Flop& any_flop(Rng& rng) const;
  std::optional<Moment> any_lately(Rng& rng, const Flop& flop, bool grows) const;

  FlopToggles toggles_;
  std::vector<std::array<Lately, 2>> lately_;  // by Flop::place; smaller, larger values
};

}  // namespace meltstage::tb
