// SPDX-License-Identifier: Apache-2.0
// A motion under construction, segment by segment. Internal to the motion library.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "motion/profile/profile_parts.hpp"
#include "motion/profile/retarget.hpp"

namespace meltstage::motion {

/// @throws MotionError if a number of the state isn't finite.
void check_state(const MotionState& state);

/// Where a motion ends, and the highest speed on the way.
struct Goal {
  double position_mm = 0.0, velocity_mm_s = 0.0, highest_mm_s = 0.0;
};

/// Whether what is left of the way to a position is no more than rounding makes of none.
inline bool is_rounding(double left_mm, double position_mm) {
  constexpr double kRounding = 1e-12;
  return std::abs(left_mm) <= kRounding * std::abs(position_mm);
}

/// A profile under construction, and the state at its end so far.
struct Course {
  JerkProfile profile;
  MotionState now;

  explicit Course(const MotionState& state) : now{0.0, state.velocity_mm_s, state.acceleration_mm_s2, 0.0} {
    profile.starts.front() = profile.end = now;
  }

  void append(double duration_s, double jerk_mm_s3) {
    if (!(duration_s > 0.0)) return;
    now.jerk_mm_s3 = jerk_mm_s3;
    profile.durations_s[profile.segments] = duration_s;
    profile.start_times_s[profile.segments] = profile.duration_s;
    profile.starts[profile.segments] = now;
    ++profile.segments;
    profile.duration_s += duration_s;
    now = after(now, duration_s);
  }

  void append(const Scurve& curve, double sign) {
    for (std::size_t i = 0; i < curve.durations_s.size(); ++i) {
      now.velocity_mm_s = sign * curve.starts[i].velocity_mm_s;  // free of the segments' rounding before
      now.acceleration_mm_s2 = sign * curve.starts[i].acceleration_mm_s2;
      append(curve.durations_s[i], sign * curve.starts[i].jerk_mm_s3);
    }
  }

  JerkProfile ended_at(const Goal& goal) const {
    JerkProfile done = profile;
    done.end = {goal.position_mm, goal.velocity_mm_s, 0.0, 0.0};
    return done;
  }
};

/// Speed at zero acceleration from which an acceleration that grows by `jerk` comes to this state.
inline double speed_before(double velocity, double acceleration, double jerk) {
  return velocity - acceleration * std::abs(acceleration) / (2.0 * jerk);
}

/// Largest argument in low..high at which a function that rises is still not above zero.
template <typename Function>
double root_of_rising(const Function& function, double low, double high) {
  double below = function(low), above = function(high);
  if (below >= 0.0) return low;
  if (above <= 0.0) return high;
  for (int step = 0; step < 200; ++step) {
    // False position; every third step, and where rounding leaves none, the interval is halved.
    double middle = low + below / (below - above) * (high - low);
    if (step % 3 == 2 || !(middle > low && middle < high)) middle = low + 0.5 * (high - low);
    if (!(middle > low && middle < high)) break;
    const double value = function(middle);
    if (value > 0.0) {
      high = middle;
      above = value;
    } else {
      low = middle;
      below = value;
    }
    if (value == 0.0) break;
  }
  return low;
}

/// Limits that hold in both directions, whether the axis speeds up or slows down.
struct EvenLimits {
  double acceleration, jerk;

  explicit EvenLimits(const ScurveLimits& limits)
      : acceleration(std::min(limits.acceleration_mm_s2, limits.deceleration_mm_s2)),
        jerk(std::min({limits.jerk1_mm_s3, limits.jerk3_mm_s3, limits.jerk5_mm_s3, limits.jerk7_mm_s3})) {}
};

/// The speed that is left when an even jerk has taken the acceleration away.
inline double speed_without_acceleration(const MotionState& state, double jerk) {
  return speed_before(state.velocity_mm_s, -state.acceleration_mm_s2, jerk);
}

/// The fastest change to a speed of either sign, with no acceleration at its end. On the way the axis may
/// turn and the acceleration change its sign.
inline void change_speed(Course& course, double to, const EvenLimits& limits) {
  const double velocity = course.now.velocity_mm_s, acceleration = course.now.acceleration_mm_s2;
  const double side = to < speed_without_acceleration(course.now, limits.jerk) ? -1.0 : 1.0;
  const double change = side * (to - velocity), present = side * acceleration;
  // From `present` up to the peak with one jerk, down to 0 with the other: together they make the change.
  const double peak_of_two = std::sqrt(std::max(0.0, 0.5 * present * present + limits.jerk * change));
  const double peak = std::min(std::max(peak_of_two, present), limits.acceleration);
  const double hold_s = (peak_of_two * peak_of_two - peak * peak) / (limits.jerk * limits.acceleration);
  course.append((peak - present) / limits.jerk, side * limits.jerk);
  course.append(hold_s, 0.0);
  course.append(peak / limits.jerk, -side * limits.jerk);
  course.now.velocity_mm_s = to;
  course.now.acceleration_mm_s2 = 0.0;
}

/// The fastest motion within the smaller of the limits for a speed that rises and for one that falls, from a
/// state from which these can be kept; else nothing.
std::optional<JerkProfile> plan_evenly(const ScurveLimits& limits, const MotionState& state,
                                       const Goal& goal);

}  // namespace meltstage::motion
