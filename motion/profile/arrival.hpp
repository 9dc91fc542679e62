// SPDX-License-Identifier: Apache-2.0
// Motions that arrive at a given moment, and several axes that arrive together, from any state.
#pragma once

#include <Eigen/Core>
#include <array>

#include "motion/profile/retarget.hpp"

namespace meltstage::motion {

/// Goes to `target_mm` (counted from the state's position) and is there with `end_velocity_mm_s` and no
/// acceleration after exactly `duration_s`, from any state. The axis goes to one speed, stays with it, and
/// goes on to the end's speed, under the limits of plan_to_speed().
///
/// Not every duration is possible: an axis that moves may pass its target at once, or else has to come back
/// to it. Between both lies a gap.
/// @throws MotionError as plan_to_speed(), and for a duration that no such motion has; the message has the
/// least one.
JerkProfile plan_arrival(const ScurveLimits& limits, const MotionState& state, double target_mm,
                         double end_velocity_mm_s, double duration_s);

/// Three axes that arrive at the same moment.
struct JointMotion {
  Eigen::Vector3d from_mm = Eigen::Vector3d::Zero();
  std::array<JerkProfile, 3> axes;  ///< positions count from `from_mm`
  double duration_s = 0.0;

  /// All axes at `time_s`; outside the motion as JerkProfile::sample().
  AxisStates sample(double time_s) const;
};

/// From any state of the axes to a point that is passed with a velocity: each axis by a motion as
/// plan_arrival() makes it, in the least time that all of them have in common. The slowest axis is as fast as
/// plan_to_speed(), unless another one has a gap there.
/// @throws MotionError as plan_to_speed(), with the number of the axis, and when no time is common to all.
JointMotion plan_together(const AxisLimits& axes, const AxisStates& state, const Eigen::Vector3d& target_mm,
                          const Eigen::Vector3d& end_velocity_mm_s);

}  // namespace meltstage::motion
