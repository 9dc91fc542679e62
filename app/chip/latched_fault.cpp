// SPDX-License-Identifier: Apache-2.0
#include "app/chip/latched_fault.hpp"

#include <array>
#include <optional>
#include <span>

#include "tb/pins/fault_sentence.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

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
  const unsigned first = word(spec::kInput[spec::kInFirstFault].name) >> 8;
  if (first == 0 || first > spec::kFaultCount) return "";
  return tb::fault_sentence(static_cast<spec::Fault>(first - 1), {input, holding, "Now"});
}

}  // namespace meltstage::app
