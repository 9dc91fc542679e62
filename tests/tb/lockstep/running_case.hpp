// SPDX-License-Identifier: Apache-2.0
// Lockstep of the running GoogleTest case: a mismatch says how to repeat it.
#pragma once

#include <memory>

#include "tb/lockstep/bench.hpp"

namespace meltstage::tb {

// Model and Verilated RTL from `start`, named after the case.
std::unique_ptr<Device> in_lockstep(const chip::Chip& start);

}  // namespace meltstage::tb
