// SPDX-License-Identifier: Apache-2.0
// Faults that latch, crossed with the state in which they do and with each other.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::tb {

class FaultCrosses {
 public:
  // A clock, not in reset.
  void observe(const chip::Chip& before, const chip::Chip& after);
  // Adds what another run has seen.
  void add(const FaultCrosses& other);
  // Names of what was not met: "fault OverTemp in state Idle", "faults OverTemp and State in one clock",
  // "fault State while OverTemp stands".
  std::vector<std::string> holes() const;

  // Bit n: fault n latched in a clock that began in this state; in the clock of this fault; while this fault
  // stood.
  std::array<std::uint16_t, chip::spec::kStates.size()> in_state{};
  std::array<std::uint16_t, chip::spec::kFaultCount> at_once{}, while_stands{};
};

}  // namespace meltstage::tb
