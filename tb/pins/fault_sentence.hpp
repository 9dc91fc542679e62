// SPDX-License-Identifier: Apache-2.0
// What a person reads of a fault: what happened, what was measured, the limit that it crossed, and what to
// do.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "cmodel/chip.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::tb {

// The chip's registers, raw, as they stood at the fault or are read after it.
struct FaultRegisters {
  std::function<std::uint16_t(chip::spec::In)> input;
  std::function<std::uint16_t(chip::spec::Reg)> holding;
  std::string_view when = "Measured";
  std::optional<std::uint16_t> duty{};  // DUTY before the fault, which puts it to 0; none: not told
};

// Those of a model as they are now.
FaultRegisters registers_of(const chip::Chip& chip, std::string_view when);

// One line on the fault of this bit of FAULT, below kFaultCount; measured values, limits and advice are those
// of spec/chip.toml.
std::string fault_sentence(chip::spec::Fault fault, const FaultRegisters& registers);

// The same of the fault that register FIRST_FAULT names; empty when nothing is latched.
std::string latched_fault(const FaultRegisters& registers);
std::string latched_fault(const chip::Chip& chip, std::string_view when);

// "PV 110.25 degC": an input register's word in its unit.
std::string reading_text(chip::spec::In reg, std::uint16_t raw);

}  // namespace meltstage::tb
