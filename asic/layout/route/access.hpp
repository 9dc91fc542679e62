// SPDX-License-Identifier: Apache-2.0
// Where a net gets at a cell's pin: a via from the pin's metal to the lowest routed layer (vertical tracks),
// off the tracks when the pin is, and the metal from there to a crossing of tracks. One way a pin, chosen so
// that no two of them are too near to each other.
#pragma once

#include <string>
#include <vector>

#include "asic/layout/db/geometry.hpp"
#include "asic/layout/db/technology.hpp"
#include "asic/layout/route/maze.hpp"

namespace meltstage::layout {

/// What the lowest two metals allow.
struct AccessRules {
  int lower = 0;          ///< layer of the pins
  int upper = 0;          ///< lowest routed layer
  std::vector<int> vias;  ///< candidates, index into Technology::vias
  Rect upper_pad;         ///< metal on the upper layer that any via on a crossing has, around the crossing
  Nm upper_wire = 0;
  Nm upper_spacing = 0;
  Nm upper_area_nm2 = 0;
  Nm lower_spacing = 0;
  Nm cut_spacing = 0;
  Nm grid = 1;
};

struct AccessPin {
  std::vector<Rect> metal;        ///< on the lower layer
  std::vector<Rect> upper_metal;  ///< on the upper layer: no obstruction for the pin itself
};

/// A cell, all in its die's frame.
struct AccessCell {
  std::string kind;  ///< cells of one kind have the same shapes around the outline's lower left corner
  Rect outline;
  std::vector<AccessPin> pins;
  std::vector<Rect> other_metal;         ///< lower layer: supplies and what is no pin
  std::vector<Rect> upper_obstructions;  ///< of the cell or beside it: supplies, cells' metal
};

struct Access {
  int via = -1;  ///< index into Technology::vias; -1: none found
  Point at;
  int ix = 0, iy = 0;       ///< the crossing that the upper metal reaches
  std::vector<Rect> metal;  ///< on the upper layer, besides the via's own
  bool crowded = false;     ///< too near to another pin's
};

AccessRules access_rules(const Technology& technology, int lower, int upper, const Rect& upper_pad);

/// A cell's pins each, in the order of cells and pins.
std::vector<std::vector<Access>> choose_access(const Technology& technology, const AccessRules& rules,
                                               const Grid& grid, const std::vector<AccessCell>& cells);

}  // namespace meltstage::layout
