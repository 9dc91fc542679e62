// SPDX-License-Identifier: Apache-2.0
// `meltstage chip tune`: commissioning. The chip's autotune, then a hold and a small step, on the real head.
#pragma once

#include "host/controller.hpp"

namespace meltstage::app {

// Heating is switched on if it is off. Prints what was found; gains and detectors are then in force, and the
// head holds its set-point. Returns the exit status: 0 finished, 1 stopped, rejected or left by Ctrl-C
// (heater off, registers as before). Throws UserError for a set-point near ambient, host::BusError for a chip
// that does not answer or refuses.
int tune_chip(host::Controller& controller);

}  // namespace meltstage::app
