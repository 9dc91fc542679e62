// SPDX-License-Identifier: Apache-2.0
// One chip stepped clock by clock and its twin advanced from event to event, each in its own copy of the same
// surroundings, to which the same things happen at random stops. At each stop every flop, and every pin
// change since, must be equal.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"

namespace meltstage::tb {

// Flops whose values differ: "name stepped advanced", one a line; empty when none does.
std::string different_flops(const chip::Chip& stepped, const chip::Chip& advanced);

struct TwinCount {
  std::uint64_t clocks = 0;
  std::uint64_t stops = 0;
  std::uint64_t pin_changes = 0;
  std::uint64_t looks = 0;  // cycles in which the advanced twin's surroundings were stepped
};

// Twins differ; what() names seed, cycle and flops or the pin change.
struct TwinsDiffer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// At least `clocks` clocks of everything that follows from the seed. Throws TwinsDiffer.
TwinCount run_twins(std::uint64_t seed, std::uint64_t clocks);

}  // namespace meltstage::tb
