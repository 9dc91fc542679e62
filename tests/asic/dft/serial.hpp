// SPDX-License-Identifier: Apache-2.0
// The oracle of fault simulation: one pattern, one fault, every gate evaluated by its definition.
#pragma once

#include <vector>

#include "asic/dft/core/circuit.hpp"
#include "asic/dft/core/faults.hpp"
#include "asic/dft/core/patterns.hpp"

namespace meltstage::dft {

/// Every node's value, with a line stuck or (nullptr) without.
std::vector<bool> serial_values(const Circuit& circuit, const Pattern& pattern, const Fault* fault);
/// An output tells the faulty circuit from the sound one.
bool serial_detects(const Circuit& circuit, const Pattern& pattern, const Fault& fault);

}  // namespace meltstage::dft
