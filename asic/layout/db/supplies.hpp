// SPDX-License-Identifier: Apache-2.0
// Whether what is there before any wire keeps apart: the metal of power and ground, of cells, pins of the
// die.
#pragma once

#include <string>
#include <vector>

#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

/// A line each: straps and rails of one supply nearer to the other's than their layer's spacing, on a
/// signal's pin, on an obstruction or on the other supply's pin of a cell, narrower than the layer's wires,
/// off the manufacturing grid, or outside the die. At most twenty of them.
std::vector<std::string> supply_faults(const Design& design, const Technology& technology);

/// A line each: pins of the die nearer to straps, to cells' metal of other nets or to each other than their
/// layer's spacing. At most twenty of them.
std::vector<std::string> die_pin_faults(const Design& design, const Technology& technology);

/// Rows are turned over in turns and cells abut, so the cells of a design have like rails at their edges, and
/// may be mirrored. Throws UserError, which names the two cells.
void require_like_rails(const Design& design, const Technology& technology);

}  // namespace meltstage::layout
