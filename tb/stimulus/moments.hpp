// SPDX-License-Identifier: Apache-2.0
// Moments of the model's random runs, from which steps from any state are drawn.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "base/rng.hpp"
#include "cmodel/chip.hpp"
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
// another value. As many are kept of a rare event as of a
// frequent one, and each block, each flop of it and each value of it is drawn as often as another.
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

  // Moments before a flop takes one value, each of them as likely to be kept.
  struct Event {
    std::uint64_t value = 0, met = 0;
    std::vector<Moment> kept;
  };
  struct Watched {
    const Flop* flop = nullptr;
    std::vector<Event> events;
  };
  std::vector<std::vector<Watched>> blocks_;
  std::vector<std::vector<unsigned>> read_by_;
};

// Two runs of each kind; enough that every event of the model is met.
inline constexpr std::uint64_t kMomentSeeds = 32;
inline constexpr std::uint64_t kMomentClocks = 100'000;

}  // namespace meltstage::tb
