// SPDX-License-Identifier: Apache-2.0
#include "app/chip/latched_fault.hpp"

#include <array>
#include <optional>
#include <span>

#include "tb/pins/fault_sentence.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

namespace {

std::string sentence(unsigned first, const tb::FaultRegisters& registers) {
  if (first == 0 || first > spec::kFaultCount) return "";
  return tb::fault_sentence(static_cast<spec::Fault>(first - 1), registers);
}

}  // namespace

std::string latched_fault(host::Controller& controller) {
  const auto word = [&](std::string_view name) {
    const std::array one{&host::find_register(name)};
    return controller.read(std::span<const host::Register* const>(one)).front();
  };
  const auto input = [&](spec::In reg) -> std::optional<std::uint16_t> {
    if (reg == spec::kInDuty) return std::nullopt;  // the fault put it to 0
    return word(spec::kInput[reg].name);
  };
  const auto holding = [&](spec::Reg reg) { return word(spec::kHolding[reg].name); };
  return sentence(word(spec::kInput[spec::kInFirstFault].name) >> 8, {input, holding, "Now"});
}

std::string latched_fault(const chip::Chip& chip) {
  const auto input = [&](spec::In reg) -> std::optional<std::uint16_t> {
    if (reg == spec::kInDuty) return std::nullopt;
    return chip.read_register(reg);
  };
  return sentence(chip.guard.first_q, {input, [&](spec::Reg reg) { return chip.params()[reg]; }});
}

}  // namespace meltstage::app
