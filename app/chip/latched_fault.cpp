// SPDX-License-Identifier: Apache-2.0
#include "app/chip/latched_fault.hpp"

#include <array>
#include <span>

#include "tb/pins/fault_sentence.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

std::string latched_fault(host::Controller& controller) {
  const auto word = [&](std::string_view name) {
    const std::array one{&host::find_register(name)};
    return controller.read(std::span<const host::Register* const>(one)).front();
  };
  const auto input = [&](spec::In reg) { return word(spec::kInput[reg].name); };
  const auto holding = [&](spec::Reg reg) { return word(spec::kHolding[reg].name); };
  return tb::latched_fault({input, holding, "Now"});
}

}  // namespace meltstage::app
