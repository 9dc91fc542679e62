// SPDX-License-Identifier: Apache-2.0
// What a person reads of a fault: what happened, what was measured, the limit that it crossed, and what to
// do.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "cmodel/spec.hpp"

namespace meltstage::tb {

// The chip's registers, raw, as they stood at the fault.
struct RegistersAtFault {
  std::function<std::uint16_t(chip::spec::In)> input;
  std::function<std::uint16_t(chip::spec::Reg)> holding;
};

// One line on the fault of this bit of FAULT, below kFaultCount; measured values, limits and advice are those
// of spec/chip.toml.
std::string fault_sentence(chip::spec::Fault fault, const RegistersAtFault& registers);

}  // namespace meltstage::tb
