// SPDX-License-Identifier: Apache-2.0
// Placement of standard cells: floorplan, global placement, legal sites, improvement on half-perimeter
// wirelength.
#pragma once

#include <string>
#include <vector>

#include "asic/layout/db/design.hpp"
#include "base/progress.hpp"

namespace meltstage::layout {

struct Floorplan {
  double utilization = 0.7;  ///< area of the cells over that of the rows, above 0 and at most 1
  Nm margin = 0;             ///< from the die's edge to the rows, at least; rounded up to sites and rows
};

/// Sets die (lower left corner at 0, 0; about square), rows and tracks. Throws UserError when the technology
/// has no site or layers.
void make_floorplan(Design& design, const Technology& technology, const Floorplan& floorplan);

struct GlobalPlacement {
  double density = 0.9;  ///< highest share of a region that cells may take, at least the utilization
  int iterations = 60;   ///< at most
  std::size_t ignored_pins = 200;  ///< nets of more pins have no wirelength (they become trees later)
  double usable_tracks = 0.7;      ///< GuideOptions::usable, where cells are to get more room
  int crowding_rounds = 6;         ///< of giving room to cells where wires are crowded, at most
  Progress progress{};             ///< told in each iteration
};

/// Where cells want to be, overlaps and all: a quadratic model of wirelength (bound-to-bound: Spindler,
/// Schlichtmann, Johannes, Kraftwerk2, IEEE TCAD 27 no. 8, 2008) that is pulled towards a spread copy of
/// itself (Kim, Lee, Markov, SimPL, IEEE TCAD 31 no. 1, 2012). Die pins go to the edge, evenly spaced, in the
/// order that suits the nets. Where global routing finds more wires than tracks, cells are given more room
/// (Component::padding) until wires fit or the rows are full (Hsu, Chang et al., Ripple 2.0, DAC 2013, do
/// alike).
void place_globally(Design& design, const Technology& technology, const GlobalPlacement& options);

/// Moves each cell to sites of a row, without overlap, as near as may be (Spindler et al.,
/// Abacus, ISPD 2008). Throws UserError when the rows are too small.
void legalize(Design& design, const Technology& technology);

/// Shortens the wires of a legal placement: moves and swaps towards each cell's best region, orders of three
/// neighbours, mirrored cells (Pan, Viswanathan, Chu, FastDP, ICCAD 2005). It stays legal.
void improve(Design& design, const Technology& technology, int passes, const Progress& progress = {});

/// Fills each gap of each row with cells of class CORE SPACER whose name starts with `prefix`, widest first.
/// Throws UserError when a gap can't be filled.
void add_fillers(Design& design, const Technology& technology, const std::string& prefix);

struct PowerGrid {
  std::string layer;  ///< of the vertical straps
  Nm width = 0;       ///< of a strap
  Nm pitch = 0;       ///< from one pair of straps to the next
};

/// Rails along the rows and straps across them, joined by stacks of vias of the library's rules; each net's
/// straps end in die pins.
void add_power_grid(Design& design, const Technology& technology, const PowerGrid& grid);

/// Half of the perimeter of each net's box, summed over nets of signals with two or more placed pins.
Nm wirelength(const Design& design, const Technology& technology);

struct PlacementFault {
  int component = 0;
  std::string text;  ///< with the component's name
};

/// What is wrong with a placement: a cell unplaced, outside the die, off its row or site, turned wrongly or
/// overlapping another. Rows hold macros of class CORE and ENDCAP.
std::vector<PlacementFault> placement_faults(const Design& design, const Technology& technology);
/// Their texts.
std::vector<std::string> placement_errors(const Design& design, const Technology& technology);

/// Area of the rows, nm2.
double core_area(const Design& design, const Technology& technology);

/// Area of the cells over that of the rows.
double utilization(const Design& design, const Technology& technology);

}  // namespace meltstage::layout
