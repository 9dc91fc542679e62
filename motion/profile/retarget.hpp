// SPDX-License-Identifier: Apache-2.0
// Changes of plan while an axis moves: another target, other limits, a stop.
#pragma once

#include <array>
#include <cstddef>

#include "motion/profile/profile.hpp"

namespace meltstage::motion {

/// A motion in segments of constant jerk. It begins at position 0.
struct JerkProfile {
  static constexpr std::size_t kMostSegments = 32;  ///< a shaped S-curve has 31

  std::size_t segments = 0;
  std::array<double, kMostSegments> durations_s{};
  std::array<double, kMostSegments> start_times_s{};  ///< of each segment
  std::array<MotionState, kMostSegments> starts{};    ///< state at the start of each, with the jerk inside it
  MotionState end;
  double duration_s = 0.0;

  JerkProfile() = default;
  /// The same motion; segments of no duration are left out.
  JerkProfile(const Scurve& curve);  // NOLINT(google-explicit-constructor): every S-curve is such a motion

  /// State at `time_s`; at rest or at the end's speed outside, as Scurve::sample.
  MotionState sample(double time_s) const;

  /// First moment at which the position is reached, for a motion that never turns back; 0 and duration_s for
  /// positions beyond the ends.
  /// @throws MotionError if the position is no number.
  double time_at(double position_mm) const;
};

/// The fastest stop from a state under the limits: acceleration, if there is any, falls with jerk 3, then
/// the ordinary deceleration follows from wherever it already stands. Positions count from the state's.
/// The state may lie outside the limits (they may have been lowered): it is brought inside with the limits'
/// jerks. With too little speed left for the deceleration to end before it, the axis turns back and stops
/// from behind. Either direction of motion.
/// @throws MotionError if a limit isn't positive or the state isn't finite.
JerkProfile plan_stop(const ScurveLimits& limits, const MotionState& state);

/// A stop that had only so much room.
struct StopWithin {
  JerkProfile profile;
  double haste = 1.0;  ///< 1: under the limits; else D is haste^2 and the jerks are haste^3 times the limit
};

/// plan_stop if it needs no more than `room_mm` in the direction of motion, otherwise the gentlest stop that
/// does: time runs `haste` times as fast in its limits.
/// @throws MotionError as plan_stop, or if `room_mm` is below 1e-12 mm for a moving axis or takes a haste of
/// some thousand.
StopWithin plan_stop_within(const ScurveLimits& limits, const MotionState& state, double room_mm);

/// Goes to rest at `target_mm` (counted from the state's position) from any state, under limits that may be
/// new. A target beyond the point where the axis could stop is reached without a stop in between, as fast as
/// the limits allow; before that point, the axis turns and comes back: through the turn with an acceleration
/// that both A and D and all jerks allow, or with a halt there, whichever is faster. A speed above a lowered
/// limit comes down with D as plan_stop does; where the target is too near for that, it comes down in one
/// gentler deceleration that ends at the target, or stops first where that is faster.
/// @throws MotionError as plan_stop, or if the target isn't finite.
JerkProfile plan_retarget(const ScurveLimits& limits, const MotionState& state, double target_mm);

}  // namespace meltstage::motion
