// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bindings/common/model_chip.hpp"
#include "bindings/python/in_turn.hpp"

namespace meltstage::python {

using HeldChip = Held<bindings::ModelChip>;

}  // namespace meltstage::python
