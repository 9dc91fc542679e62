// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "bindings/python/in_turn.hpp"
#include "cmodel/advance.hpp"

namespace meltstage::python {

/// The model with the levels that stand at its input pins.
struct ModelChip {
  chip::Chip chip{};
  chip::Inputs in{};
  std::uint64_t cycle = 0;
};
using HeldChip = Held<ModelChip>;

}  // namespace meltstage::python
