// SPDX-License-Identifier: Apache-2.0
// Antenna rules: metal that is etched while it hangs on a gate, and on no diffusion yet, charges the gate.
// Layer by layer from below, as it is made: what is connected by then, its area over the area of the gates
// (LEF/DEF 5.8 reference, appendix "Calculating antennas").
#pragma once

#include <string>
#include <vector>

#include "asic/layout/db/design.hpp"
#include "asic/layout/db/technology.hpp"

namespace meltstage::layout {

/// Pins of one net that are connected when `layer` is made, and by it get more metal (or cuts) than the rule
/// allows.
struct AntennaFault {
  int net = 0;
  std::vector<int> pins;  ///< gates, in the order of Net::pins; the worst first
  int layer = 0;          ///< index into Technology::layers
  double ratio = 0.0;
  double limit = 0.0;
  std::vector<Rect> metal;  ///< what is connected, of all layers up to this one
};

/// Faults of all wired nets, the lowest layer of each group of pins. Areas of overlapping shapes count for
/// each shape, which errs to the safe side; wires of supplies are left out, as they hang on diffusion.
std::vector<AntennaFault> antenna_faults(const Design& design, const Technology& technology);

/// "net x: Metal3 area over gate area 412, most 200, at u1 A"
std::string antenna_text(const AntennaFault& fault, const Design& design, const Technology& technology);

/// For each fault the library's antenna cell (CLASS CORE ANTENNACELL) in place of the filler (CLASS CORE
/// SPACER) nearest to the metal that is wide enough, its pin added to the net; the rest of the filler's place
/// is filled with fillers that the design uses. Returns how many were found a place; 0 also when the library
/// has no such cell.
int insert_diodes(Design& design, const Technology& technology, const std::vector<AntennaFault>& faults);

}  // namespace meltstage::layout
