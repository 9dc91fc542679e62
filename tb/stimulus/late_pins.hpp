// SPDX-License-Identifier: Apache-2.0
// A synchroniser whose first flop is caught by a changing pin shows the change one clock later or not. Here
// each change of a pin that need not keep to the clock comes at random at once or a clock later, to RTL and
// model alike.
#pragma once

#include <cstdint>
#include <memory>

#include "tb/lockstep/bench.hpp"

namespace meltstage::tb {

// Steps `device` with pins that are late at random, as `seed` says. Reset, test mode and the address strap
// are not: the first acts without a clock, the others stand still.
std::unique_ptr<Device> with_late_pins(std::unique_ptr<Device> device, std::uint64_t seed);

}  // namespace meltstage::tb
