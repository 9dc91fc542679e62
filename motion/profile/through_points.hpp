// SPDX-License-Identifier: Apache-2.0
// A motion through many points without a stop: straight lines whose corners are rounded, planned ahead so
// that every corner and the end are taken within the axes' limits.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "motion/profile/profile.hpp"

namespace meltstage::motion {

/// The three axes over some time; their jerk stays.
struct JerkPiece {
  double start_s = 0.0, duration_s = 0.0;
  AxisStates start;
};

struct ThroughPoints {
  std::vector<JerkPiece> pieces;  ///< one behind the other from 0
  double duration_s = 0.0;
  Eigen::Vector3d end_mm;        ///< exactly the last point
  std::vector<double> passed_s;  ///< for each point, when the motion passes it

  /// All axes at `time_s`; at rest at the first point before the motion and at the last one behind it.
  AxisStates sample(double time_s) const;
};

/// From rest at the first point to rest at the last one. At each point between, the velocity turns from the
/// line before to the line behind with an even S-curve along the difference of the two, at the same speed in
/// and out. So each axis' acceleration is a trapezoid and its jerk constant by pieces, and the motion is at
/// most `tolerance_mm` (0: a stop at each corner) from every point when it passes it; between the corners it
/// is on the lines. Each corner's speed is the highest that the tolerance, half of either line and the
/// changes of speed before and behind allow; what a slower neighbour leaves of a line is given to it. Between
/// corners plan_scurve() makes the fastest S-curve. Points on one line are passed without a corner, and a
/// point that repeats the one before adds nothing.
///
/// Never slower than with a stop at each corner; where a turn costs more than it saves, there is a stop.
/// Corners use the smaller of A and D and the least jerk of each axis, and the acceleration is zero where one
/// begins and ends. So it is for flat corners; sharp ones save little (docs/motion/profile.md).
///
/// @throws MotionError if there is no point, a coordinate isn't finite, a limit isn't positive, or the
///   tolerance is below 0.
ThroughPoints plan_through(std::span<const Eigen::Vector3d> points_mm, const AxisLimits& axes,
                           double tolerance_mm);

}  // namespace meltstage::motion
