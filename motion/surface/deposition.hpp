// SPDX-License-Identifier: Apache-2.0
// What a pneumatic dispensing head leaves behind: width, section and resistance of a line from the gap
// between head and surface. Calibrated on the uncompensated lines of Xu et al. 2024 (tables 1 and 2, first
// group).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace meltstage::motion {

/// A bead of silver paste. The flow leaves through the nozzle and the slit under it in series, so that the
/// section falls as the gap closes; what is there is pressed as flat as the gap, so the line is wide
/// (piling). Above a gap at which the paste no longer reaches the surface unstretched it is drawn thin
/// (stringing).
struct DepositionModel {
  double section_mm2 = 0.0511741;     ///< flow of the free nozzle / speed
  double slit_gap_mm = 0.0393073;     ///< gap whose slit resists as much as the nozzle
  double stringing_gap_mm = 0.12512;  ///< gap above which the paste is stretched
  double stringing_mm = 0.00255522;   ///< further gap that takes the section to 1/e
  double least_share = 0.00452238;    ///< of the section that stringing leaves
  double thinning = 0.212833;         ///< stretched width goes with this power of the section
  double resistivity_ohm_mm = 0.000925969;
  double least_gap_mm = 0.02;  ///< a head that meets the surface pushes it this far away
  /// The valve: more flows in the first millimetres (pressure surge) and the last (residual pressure), where
  /// lead and lag of the pressure don't allow for it.
  double end_excess = 0.433595;       ///< of the section, at the very end
  double end_mm = 1.91749;            ///< falls to 1/e over this way
  double width_noise_mm = 0.0191066;  ///< standard deviation of what a gap doesn't explain
};

struct DepositedLine {
  std::vector<double> lengths_mm, widths_mm, sections_mm2;
  double resistance_ohm = 0.0;
};

/// Deposits a line. `gaps_mm` at `lengths_mm` (rising, two or more); `surge` is the share of the valve's end
/// excess that the program leaves: 1 without lead and lag.
/// @throws MotionError if sizes differ or a number isn't finite.
DepositedLine deposit(const DepositionModel& model, std::span<const double> lengths_mm,
                      std::span<const double> gaps_mm, double surge, std::uint64_t seed);

/// Mean and standard deviation of the widths measured every millimetre, as the paper's experiment does (32 on
/// 32 mm).
struct WidthFigures {
  double mean_mm = 0.0, deviation_mm = 0.0;
};
/// At `count` places evenly along the line; each takes the width of the line's next point.
/// @throws MotionError if there are no points, not as many widths, or fewer than 2 places.
WidthFigures measure_widths(const DepositedLine& line, int count = 32);

}  // namespace meltstage::motion
