// SPDX-License-Identifier: Apache-2.0
// Both ends of every holding register's range written over the bus, and one beyond each, in an order of the
// seed. The chip holds its settings, so that none acts on the line or the sensor: from any state does that.
#pragma once

#include <cstdint>
#include <memory>

#include "tb/lockstep/bench.hpp"

namespace meltstage::tb {

struct EndWrites {
  Coverage coverage;
  Compared compared;
};

// State in which it begins.
chip::Chip end_writes_start();

// Writes all ends `passes` times. Throws Mismatch or SafetyViolation; std::runtime_error when an end is not
// taken and read back, or what lies beyond one not refused.
EndWrites write_register_ends(std::unique_ptr<Device> device, std::uint64_t seed, std::uint64_t passes);

}  // namespace meltstage::tb
