// SPDX-License-Identifier: Apache-2.0
#include "bindings/common/model_chip.hpp"

#include "tb/pins/chip_pins.hpp"

namespace meltstage::bindings {

void ModelChip::step(std::uint64_t clocks) {
  for (std::uint64_t clock = 0; clock < clocks; ++clock) chip.step(in);
  cycle += clocks;
}

void ModelChip::advance(std::uint64_t clocks) {
  chip::StillPins still{in};
  chip::Run run{chip, chip.outputs(in)};
  chip::advance(run, clocks, still, [](auto&&...) {});
  chip = run.chip;
  cycle += clocks;
}

std::uint64_t ModelChip::pin(std::uint32_t pin) const { return tb::pin_levels(in, chip.outputs(in)).at(pin); }

void ModelChip::set_pin(std::uint32_t pin, std::uint64_t level) {
  auto levels = tb::pin_levels(in, {});
  levels.at(pin) = level;
  in = tb::inputs_of(levels);
}

}  // namespace meltstage::bindings
