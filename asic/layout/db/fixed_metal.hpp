// SPDX-License-Identifier: Apache-2.0
// Metal that is there before any wire, of supplies, cells and pins of the die, and whether it keeps apart.
#pragma once

#include <string>
#include <vector>

#include "asic/layout/db/design.hpp"
#include "asic/layout/db/shape_index.hpp"

namespace meltstage::layout {

/// That of supplies and cells, obstructions too.
std::vector<Shape> fixed_shapes(const Design& design, const Technology& technology);

/// The same of one layer. Where metal is so wide that it asks for more than the layer's least spacing, it
/// counts as so much larger.
ShapeIndex fixed_metal_on(int layer, const Design& design, const Technology& technology);

/// A line each: straps and rails of one supply nearer to the other's than their layer's spacing, on a
/// signal's pin, on an obstruction or on the other supply's pin of a cell, narrower than the layer's wires,
/// off the manufacturing grid, or outside the die. At most twenty of them.
std::vector<std::string> supply_faults(const Design& design, const Technology& technology);

/// A line each: pins of the die nearer to straps, to cells' metal of other nets or to each other than their
/// layer's spacing. At most twenty of them.
std::vector<std::string> die_pin_faults(const Design& design, const Technology& technology);

}  // namespace meltstage::layout
