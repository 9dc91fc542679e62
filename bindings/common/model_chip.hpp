// SPDX-License-Identifier: Apache-2.0
// The model as other languages hold it: with the levels that stand at its input pins.
#pragma once

#include <cstdint>

#include "cmodel/advance.hpp"

namespace meltstage::bindings {

struct ModelChip {
  chip::Chip chip{};
  chip::Inputs in{};
  std::uint64_t cycle = 0;

  /// Clock by clock.
  void step(std::uint64_t clocks);
  /// The same, but clocks in which the chip only counts are left out.
  void advance(std::uint64_t clocks);
  /// Level of a pin now. `pin`: an index into spec::kPins.
  std::uint64_t pin(std::uint32_t pin) const;
  /// `pin`: below spec::kInputPins; `level`: of the pin's width.
  void set_pin(std::uint32_t pin, std::uint64_t level);
};

}  // namespace meltstage::bindings
