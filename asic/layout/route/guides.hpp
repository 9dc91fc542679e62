// SPDX-License-Identifier: Apache-2.0
// Global routing: which regions of the die each net's wires should run through, so that no region's tracks
// are asked for too often.
#pragma once

#include <functional>
#include <vector>

#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

/// Square regions, row by row from the lower left.
struct RegionGrid {
  Nm size = 1;
  int columns = 1;
  int rows = 1;

  int regions() const { return columns * rows; }
  int column_of(Nm x) const { return static_cast<int>(std::clamp<Nm>(x / size, 0, columns - 1)); }
  int row_of(Nm y) const { return static_cast<int>(std::clamp<Nm>(y / size, 0, rows - 1)); }
  int region(int column, int row) const { return row * columns + column; }
  int region_of(Point p) const { return region(column_of(p.x), row_of(p.y)); }
};

struct GuideOptions {
  int tracks = 15;  ///< of the upper vertical layer along a region's side
  double usable =
      0.7;  ///< share of the tracks between two regions that wires may take; the rest is for vias and pins
  double tracks_a_pin = 0.3;         ///< of each direction that a pin takes in its region
  std::size_t ignored_pins = 1'000;  ///< nets of more pins have no guide
  int rounds = 12;                   ///< of rerouting what crosses crowded borders
};

struct Guides {
  RegionGrid grid;
  std::vector<std::vector<int>> regions;  ///< a net each (Design::nets), sorted; empty: anywhere
  std::vector<float> crowding;  ///< a region each: what is wanted of what is usable, the worse direction
  double overflow = 0.0;        ///< tracks wanted beyond what is usable, summed over borders
};

/// Layers with the tracks of the second and third routing layer, from the second on.
std::vector<int> track_layers(const Technology& technology);

/// A*, net by net, with negotiated congestion (McMurchie and Ebeling, PathFinder, FPGA 1995) between regions.
/// Cells must have places.
Guides route_globally(const Design& design, const Technology& technology, const GuideOptions& options);

}  // namespace meltstage::layout
