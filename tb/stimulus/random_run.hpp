// SPDX-License-Identifier: Apache-2.0
// One random run: host traffic of every kind, sensor faults, a moving temperature, flipped parameter bits,
// resets and emergency stops at any clock. Everything follows from the seed.
#pragma once

#include <cstdint>
#include <memory>

#include "tb/lockstep/bench.hpp"

namespace meltstage::tb {

struct RandomRun {
  Coverage coverage;
  Compared compared;
  std::uint64_t stimulus_hash = 0;
};

// State in which the run of a seed begins.
chip::Chip random_start(std::uint64_t seed);

// Runs `clocks` clocks on `device`, which must stand at random_start(seed). Throws Mismatch or
// SafetyViolation.
RandomRun random_run(std::unique_ptr<Device> device, std::uint64_t seed, std::uint64_t clocks);

}  // namespace meltstage::tb
