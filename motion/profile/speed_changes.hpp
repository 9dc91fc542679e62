// SPDX-License-Identifier: Apache-2.0
// The fastest change to another speed, with the limits of each direction of motion. Internal to the motion
// library.
#pragma once

#include <algorithm>
#include <cmath>

#include "motion/profile/course.hpp"

namespace meltstage::motion {

/// Limits of one direction of motion, for the speed that rises and for the one that falls: the jerk that
/// begins the acceleration, and the one that ends it.
struct OneWay {
  double acceleration, begin, end;
};

inline OneWay rising(const ScurveLimits& limits) {
  return {limits.acceleration_mm_s2, limits.jerk1_mm_s3, limits.jerk3_mm_s3};
}
inline OneWay falling(const ScurveLimits& limits) {
  return {limits.deceleration_mm_s2, limits.jerk5_mm_s3, limits.jerk7_mm_s3};
}

/// Jerk that takes away the acceleration of a state on this side of zero.
inline double releasing_jerk(double forward, double acceleration, const ScurveLimits& limits) {
  return (forward * acceleration > 0.0 ? rising(limits) : falling(limits)).end;
}

/// Lets the acceleration, in size, go down to `size`.
inline void ease(Course& course, double size, double jerk) {
  const double present = course.now.acceleration_mm_s2;
  course.append((std::abs(present) - size) / jerk, present > 0.0 ? -jerk : jerk);
  if (std::abs(present) > size) course.now.acceleration_mm_s2 = std::copysign(size, present);
}

/// The fastest change to a speed on the same side of zero. `forward`: 1 or -1, the side.
inline void change_on_one_side(Course& course, double to, double forward, const ScurveLimits& limits) {
  const double release = releasing_jerk(forward, course.now.acceleration_mm_s2, limits);
  const double side = forward * (to - speed_without_acceleration(course.now, release)) < 0.0 ? -1.0 : 1.0;
  const OneWay way = side > 0.0 ? rising(limits) : falling(limits);
  if (side * forward * course.now.acceleration_mm_s2 < 0.0) ease(course, 0.0, release);
  const double already = std::abs(course.now.acceleration_mm_s2);
  // From `already` up to the peak with one jerk, down to 0 with the other: together they make the change.
  const double change = side * forward * (to - course.now.velocity_mm_s),
               slowness = 1.0 / way.begin + 1.0 / way.end;
  const double peak_of_two =
      std::sqrt(std::max(0.0, (2.0 * change + already * already / way.begin) / slowness));
  const double peak = std::min(std::max(peak_of_two, already), way.acceleration);
  course.append((peak - already) / way.begin, forward * side * way.begin);
  if (peak > 0.0) course.append(0.5 * (peak_of_two * peak_of_two - peak * peak) * slowness / peak, 0.0);
  course.append(peak / way.end, -forward * side * way.end);
  course.now.velocity_mm_s = to;
  course.now.acceleration_mm_s2 = 0.0;
}

inline double side_of(double velocity, double acceleration, double to) {
  if (velocity != 0.0) return std::copysign(1.0, velocity);
  return std::copysign(1.0, acceleration != 0.0 ? acceleration : to);
}

/// Changes of speed with the limits of each side, with a halt where the axis turns.
class HaltAtTurns {
 public:
  explicit HaltAtTurns(const ScurveLimits& limits) : limits_(limits) {}

  double release(const MotionState& state) const {
    return releasing_jerk(side_of(state.velocity_mm_s, state.acceleration_mm_s2, 0.0),
                          state.acceleration_mm_s2, limits_);
  }
  double largest(const MotionState& state) const {
    const double side = side_of(state.velocity_mm_s, state.acceleration_mm_s2, 0.0);
    return (side * state.acceleration_mm_s2 > 0.0 ? rising(limits_) : falling(limits_)).acceleration;
  }
  void change(Course& course, double to) const {
    const double side = side_of(course.now.velocity_mm_s, course.now.acceleration_mm_s2, to);
    if (side * to >= 0.0) return change_on_one_side(course, to, side, limits_);
    change_on_one_side(course, 0.0, side, limits_);
    change_on_one_side(course, to, -side, limits_);
  }

 private:
  const ScurveLimits& limits_;
};

/// Changes of speed within the smaller of both sides' limits, through a turn without a halt.
class EvenThroughout {
 public:
  explicit EvenThroughout(const ScurveLimits& limits) : limits_(limits) {}

  double release(const MotionState&) const { return limits_.jerk; }
  double largest(const MotionState&) const { return limits_.acceleration; }
  void change(Course& course, double to) const { change_speed(course, to, limits_); }
  /// Whether these limits hold from a state on, which may be a sample of a plan with its rounding.
  bool hold(const MotionState& state, double highest_mm_s) const {
    constexpr double kRounded = 1.0 + 1e-12;
    return std::abs(state.acceleration_mm_s2) <= limits_.acceleration * kRounded &&
           std::abs(speed_without_acceleration(state, limits_.jerk)) <= highest_mm_s * kRounded;
  }

 private:
  EvenLimits limits_;
};

/// Takes the acceleration away with the jerk of this side of zero, or goes on to where the axis turns before
/// that is done.
inline Course released(Course course, const ScurveLimits& limits) {
  const double velocity = course.now.velocity_mm_s, acceleration = course.now.acceleration_mm_s2;
  const double side = side_of(velocity, acceleration, 0.0), jerk = releasing_jerk(side, acceleration, limits);
  const double left = acceleration * acceleration - 2.0 * jerk * std::abs(velocity);
  const bool turns = side * acceleration < 0.0 && left > 0.0;
  ease(course, turns ? std::sqrt(left) : 0.0, jerk);
  if (turns) course.now.velocity_mm_s = 0.0;
  return course;
}

}  // namespace meltstage::motion
