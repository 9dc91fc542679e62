// SPDX-License-Identifier: Apache-2.0
#include "tb/pins/fault_sentence.hpp"

#include <fmt/format.h>

#include "cmodel/fault_advice.hpp"

namespace meltstage::tb {

namespace spec = chip::spec;

namespace {

// "T_MAX 100 degC"; `Info` is InputInfo or RegisterInfo.
template <class Info>
std::string named_value(const Info& info, std::uint16_t raw) {
  const double value = (info.is_signed ? static_cast<std::int16_t>(raw) : raw) * info.scale;
  return fmt::format("{} {:.6g}{}{}", info.name, value, info.unit.empty() ? "" : " ", info.unit);
}

void append(std::string& list, const std::string& item) { list += (list.empty() ? "" : ", ") + item; }

}  // namespace

std::string reading_text(spec::In reg, std::uint16_t raw) {
  if (reg == spec::kInPv && raw == spec::kPvNone) return "PV without a reading";
  if (reg == spec::kInRawH || reg == spec::kInRawL)
    return fmt::format("{} {:#06x}", spec::kInput[reg].name, raw);
  return named_value(spec::kInput[reg], raw);
}

std::string fault_sentence(spec::Fault fault, const FaultRegisters& registers) {
  const spec::FaultInfo& info = spec::kFaults[fault];
  const spec::FaultAdvice& advice = spec::kFaultAdvice[fault];
  std::string measured, limits;
  for (const spec::In reg : advice.measured) {
    const auto raw = reg == spec::kInDuty ? registers.duty : registers.input(reg);
    if (raw) append(measured, reading_text(reg, *raw));
  }
  for (const spec::Reg reg : advice.limits)
    append(limits, named_value(spec::kHolding[reg], registers.holding(reg)));
  return fmt::format("{}: {}{}{} Next: {}", info.name, info.doc,
                     measured.empty() ? "" : fmt::format(" {}: {}.", registers.when, measured),
                     limits.empty() ? "" : " Limit: " + limits + ".", advice.next);
}

FaultRegisters registers_of(const chip::Chip& chip, std::string_view when) {
  return {[&chip](spec::In reg) { return chip.read_register(reg); },
          [&chip](spec::Reg reg) { return chip.params()[reg]; }, when};
}

std::string latched_fault(const FaultRegisters& registers) {
  const auto fault = spec::first_fault(registers.input(spec::kInFirstFault));
  return fault ? fault_sentence(*fault, registers) : "";
}

std::string latched_fault(const chip::Chip& chip, std::string_view when) {
  return latched_fault(registers_of(chip, when));
}

}  // namespace meltstage::tb
