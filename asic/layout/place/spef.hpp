// SPDX-License-Identifier: Apache-2.0
// Wires as they may be expected from a placement: each net a shortest tree between its pins, as resistances
// and capacitances.
#pragma once

#include <string>

#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

/// A name as SPEF writes it: a backslash before each character but letters, digits and the underscore.
/// Without it readers take a bracket for a bus and miss nets like "words_q[14]_15".
std::string spef_name(const std::string& name);

/// SPEF (IEEE 1481) of all nets of signals, with the wire of buffers.hpp's wire_model.
std::string spef_text(const Design& design, const Technology& technology);

}  // namespace meltstage::layout
