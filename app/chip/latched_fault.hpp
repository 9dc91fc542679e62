// SPDX-License-Identifier: Apache-2.0
// The fault that a chip latched first, read over its bus.
#pragma once

#include <string>

#include "host/controller.hpp"

namespace meltstage::app {

// What happened, what is measured now, the limit and what to do next, in one line; empty when nothing is
// latched. Throws host::BusError when the chip does not answer.
std::string latched_fault(host::Controller& controller);

}  // namespace meltstage::app
