// SPDX-License-Identifier: Apache-2.0
// The fault that a chip latched first, read over its bus or from a model beside.
#pragma once

#include <string>

#include "cmodel/chip.hpp"
#include "host/controller.hpp"

namespace meltstage::app {

// What happened, what is measured now, the limit and what to do next, in one line; empty when nothing is
// latched. Throws host::BusError when the chip does not answer.
std::string latched_fault(host::Controller& controller);
// The same of a model that has just latched it.
std::string latched_fault(const chip::Chip& chip);

}  // namespace meltstage::app
