// SPDX-License-Identifier: Apache-2.0
// From any state to any state.
#pragma once

#include "motion/profile/retarget.hpp"

namespace meltstage::motion {

/// Goes to the end's position (counted from the state's) and is there with the end's speed and acceleration.
/// It keeps to the smaller of A and D and to the least of the four jerks, in either direction of motion;
/// within these no motion is faster. A state outside the limits is brought inside first.
///
/// The acceleration rises, falls and rises again, or the reverse, with no acceleration in between while the
/// speed is at its limit (Berscheid & Kroeger, "Jerk-limited Real-time Trajectory Generation with Arbitrary
/// Target States", 2021). Of both extremes of the acceleration the speeds at the ends leave one to choose:
/// the way is a function of it.
/// @throws MotionError if a limit isn't positive, a number isn't finite, or the end can't be reached within
/// the
///   limits: its acceleration is above A or D, or its speed, or the one before it, is above Vc.
JerkProfile plan_to_state(const ScurveLimits& limits, const MotionState& state, const MotionState& end);

}  // namespace meltstage::motion
