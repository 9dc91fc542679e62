// SPDX-License-Identifier: Apache-2.0
// Staged self-calibration and alignment of the 3-PRP stage as published in paper 003: frame, gear ratios,
// axis skew alpha_1, attitude table; triangular interpolation and decoupled translation.
#pragma once

#include <vector>

#include "motion/align/prp.hpp"
#include "motion/align/prp_stage_model.hpp"

namespace meltstage::motion {

/// A row of the attitude table: branches 2 and 3 apart by `difference_mm` (q3 - q2), branch 1 at zero.
struct AttitudeNode {
  double difference_mm = 0.0;
  double angle_rad = 0.0;                 ///< of the platform against home, from two marks
  std::vector<Eigen::Vector2d> marks_mm;  ///< where each mark of the plate was seen
};

/// What the paper's method knows of a stage.
struct StagedCalibration {
  PrpTurns home = PrpTurns::Zero();  ///< step 1: travel along X is the camera's X from here
  std::array<double, 3> lead_mm{};   ///< step 2: R1, R2, R3
  double alpha1_rad = 0.0;           ///< step 3
  std::vector<AttitudeNode> nodes;   ///< step 4, rising difference
};

/// How the steps are made.
struct StagedOptions {
  double travel_mm = 4.0;       ///< to either side in steps 1 to 3
  int repeats = 5;              ///< of each of their measurements, averaged
  double interval_mm = 1.0;     ///< between nodes, of the difference q3 - q2 (paper: 1 mm)
  double difference_mm = 10.0;  ///< of the last node, to either side (twice the stroke)
};

/// Section 4.2, steps 1 to 4. `plate_mm` are the plate's marks, about where they stand; the first and the
/// last must be far apart, since angles come from them. At each mark the whole table is run through, as the
/// paper does, so that marks of one node don't stand still together.
/// @throws MotionError on a plate of fewer than three marks, or options that can't be.
StagedCalibration calibrate_staged(const PrpMachine& machine, const std::vector<Eigen::Vector2d>& plate_mm,
                                   const PrpGeometry& nominal, const StagedOptions& options = {});

/// Equations (10) and (11): sliders 1 and 2+3 for a move of the platform without turning it, the platform at
/// `angle_rad`. The published (10) has the wrong sign before theta and (10), (11) the factor
/// sin(alpha1) / sin(2 theta + alpha1), which belongs to another choice of angles; with them the stage misses
/// by up to 22 um on the paper's own poses.
struct Decoupled {
  double first_mm = 0.0;   ///< of branch 1
  double others_mm = 0.0;  ///< of branches 2 and 3 alike
};
Decoupled decoupled_as_printed(const Eigen::Vector2d& move_mm, double angle_rad, double alpha1_rad);
/// dq1 = dx - dy cot(theta + alpha1), dq23 = dy - dx tan(theta): reduces to (3) at alpha1 = 90 deg.
Decoupled decoupled(const Eigen::Vector2d& move_mm, double angle_rad, double alpha1_rad);

/// Shares of three corners in a point (they sum to 1): equations (8), (9) are lambda1 = (1 - b1) / b1 and
/// lambda2 = (1 - b3) / b3 of them, which fail on the triangle's edges; these don't.
/// @throws MotionError if the corners lie on a line.
Eigen::Vector3d triangle_shares(const Eigen::Vector2d& point, const Eigen::Vector2d& a,
                                const Eigen::Vector2d& b, const Eigen::Vector2d& c);

/// Section 4.3: turns that take a board's marks from where they were seen with the stage at home to where
/// they are wanted. Equation (7) picks the three nearest marks of the plate; a nearest three on a line is
/// passed over for the next that isn't.
/// @throws MotionError if marks are too few or can't be, the angle lies outside the table, or the pose is out
/// of reach.
using Decoupling = Decoupled (*)(const Eigen::Vector2d& move_mm, double angle_rad, double alpha1_rad);
PrpTurns staged_turns(const StagedCalibration& calibration, const PrpGeometry& nominal,
                      const std::vector<Eigen::Vector2d>& seen_mm,
                      const std::vector<Eigen::Vector2d>& wanted_mm, Decoupling decoupling = decoupled);

/// Interval rule, (11) of section 4.4: h < sqrt(8 eps / M), M the largest second derivative over the
/// interval.
double node_interval(double tolerance, double largest_second_derivative);

}  // namespace meltstage::motion
