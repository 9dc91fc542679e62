// SPDX-License-Identifier: Apache-2.0
// What a run on the bench has met of the specification, and what it has not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"
#include "cmodel/spec.hpp"
#include "tb/lockstep/fault_crosses.hpp"
#include "tb/lockstep/register_ends.hpp"
#include "tb/lockstep/toggles.hpp"

namespace meltstage::tb {

namespace spec = chip::spec;

// What a run has exercised, from the model's flops. Counts of clocks or events; what is seen or not stands in
// one table (coverage.cpp).
struct Coverage {
  static constexpr std::size_t kMostPoints = 64;

  std::array<std::uint64_t, 32> states{};
  std::array<std::array<std::uint64_t, 32>, 32> arcs{};
  std::array<std::uint64_t, spec::kFaultCount> latched{};
  std::array<std::uint64_t, 4> segments{};  // while heating
  std::array<std::uint64_t, 256> functions{};
  std::array<std::uint64_t, 256> wrong_lengths{};  // refused frames by function code
  std::array<std::uint64_t, 256> exceptions{};
  std::array<std::uint64_t, spec::kSensorPresets.size()> sensors{};  // accepted samples by SENS_TYPE
  std::array<bool, kMostPoints> points{};
  std::uint64_t crc_errors = 0;
  FlopToggles toggles;  // but for what a reset does
  FaultCrosses crosses;
  RegisterEnds ends;

  // Looks at the model after a clock.
  void observe(const chip::Chip& now, const chip::Inputs& in, const chip::Outputs& out);
  // Adds what another run has seen.
  void add(const Coverage& other);
  // Names of what the specification has and the run has not seen.
  std::vector<std::string> holes() const;

  // What is remembered of the clock before.
  struct Before {
    std::uint8_t state = spec::kStIdle;
    std::uint16_t fault = 0;
    std::uint16_t crc_errors = 0;
    bool reset = true;
    bool heating = false;
    bool answering = false;
    bool telemetry_due = false;
    bool sample_refused = false;
    bool heater = false;
  };

 private:
  Before before_;
};

}  // namespace meltstage::tb
