// SPDX-License-Identifier: Apache-2.0
// `meltstage chip run`: heating on.
#pragma once

#include "host/controller.hpp"

namespace meltstage::app {

// A chip that refuses because of a fault says what it measured, the limit, and what to do. Throws
// host::BusError.
void run_chip(host::Controller& controller);

}  // namespace meltstage::app
