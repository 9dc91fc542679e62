// SPDX-License-Identifier: Apache-2.0
// From any state to a point that is passed with a speed.
#pragma once

#include "motion/profile/retarget.hpp"

namespace meltstage::motion {

/// Goes to `target_mm` (counted from the state's position) and is there with `end_velocity_mm_s` (-Vc..Vc)
/// and no acceleration, from any state. No distance is too short: where the change of speed needs more way
/// than there is, the axis goes back first. The speed rises with A and jerks 1 and 3 and falls with D and
/// jerks 5 and 7, in either direction of motion; where the axis turns it either halts or keeps to the smaller
/// of both, whichever is faster. A state outside the limits is brought inside.
///
/// The motion goes to one speed, stays with it, and goes on to the end's; that speed is the root of a
/// function that has one on the side where it has to be. With A = D and equal jerks no motion within the
/// limits is faster, which the tests try by Bellman's principle; with unlike ones a faster turn may exist. At
/// an end speed of zero it is never slower than plan_retarget().
/// @throws MotionError if a limit isn't positive, a number isn't finite, or the end's speed is above Vc.
JerkProfile plan_to_speed(const ScurveLimits& limits, const MotionState& state, double target_mm,
                          double end_velocity_mm_s);

}  // namespace meltstage::motion
