// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/moving_end.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "motion/profile/check_positive.hpp"
#include "motion/profile/course.hpp"
#include "motion/profile/speed_changes.hpp"

namespace meltstage::motion {
namespace {

/// How long a way takes that is left over at a speed.
double stay_s(double left_mm, double velocity_mm_s, const Goal& goal) {
  if (velocity_mm_s == 0.0 || is_rounding(left_mm, goal.position_mm)) return 0.0;
  return std::max(0.0, left_mm / velocity_mm_s);
}

/// To a goal beyond where the fastest change of speed ends, by letting a deceleration go a little at first;
/// nothing if that doesn't reach it. Where the axis turns later the way does not always grow with the easing:
/// the least easing that reaches the goal is the fastest.
template <class Changes>
std::optional<Course> by_easing(const Course& start, const Goal& goal, const Changes& changes) {
  const double present = start.now.acceleration_mm_s2, release = changes.release(start.now);
  if (present >= 0.0 || goal.velocity_mm_s >= speed_without_acceleration(start.now, release)) return {};
  const auto eased_to = [&](double size, double stay_s) {
    Course way = start;
    ease(way, size, release);
    way.append(stay_s, 0.0);
    changes.change(way, goal.velocity_mm_s);
    return way;
  };
  const auto past_mm = [&](double minus_size) {
    return eased_to(-minus_size, 0.0).now.position_mm - goal.position_mm;
  };
  constexpr int kParts = 32;
  double low = present;
  for (int part = 1; part <= kParts; ++part) {
    const double high = present * (kParts - part) / kParts;
    if (past_mm(high) > 0.0) {
      const double size = -root_of_rising(past_mm, low, high);
      // What rounding leaves is made at the speed of that moment.
      Course eased = start;
      ease(eased, size, release);
      return eased_to(size, stay_s(-past_mm(-size), eased.now.velocity_mm_s, goal));
    }
    low = high;
  }
  return {};
}

/// To a goal beyond where the fastest change of speed ends.
template <class Changes>
Course to_beyond(const Course& start, const Goal& goal, const Changes& changes) {
  if (const auto eased = by_easing(start, goal, changes)) return *eased;
  const auto by_speed = [&](double speed, double stay_s) {
    Course way = start;
    changes.change(way, speed);
    way.append(stay_s, 0.0);
    changes.change(way, goal.velocity_mm_s);
    return way;
  };
  const auto past_mm = [&](double speed) { return by_speed(speed, 0.0).now.position_mm - goal.position_mm; };
  const double release = changes.release(start.now);
  const double fastest = std::max(speed_without_acceleration(start.now, release), goal.velocity_mm_s);
  const double lowest = fastest <= goal.highest_mm_s ? fastest : goal.velocity_mm_s;
  if (past_mm(lowest) > 0.0) {  // by rounding: next to where the fastest change of speed ends
    Course way = start;
    ease(way, 0.0, release);
    const double speed = way.now.velocity_mm_s;
    Course end = way;
    changes.change(end, goal.velocity_mm_s);
    way.append(stay_s(goal.position_mm - end.now.position_mm, speed, goal), 0.0);
    changes.change(way, goal.velocity_mm_s);
    return way;
  }
  double speed = root_of_rising(past_mm, lowest, goal.highest_mm_s);
  // What is left, be it by rounding alone, is made at that speed; the next one above goes too far.
  if (speed < 0.0 && past_mm(speed) < 0.0) speed = std::nextafter(speed, goal.highest_mm_s);
  return by_speed(speed, stay_s(-past_mm(speed), speed, goal));
}

Course mirrored(Course course) {
  for (MotionState& start : course.profile.starts)
    start = {-start.position_mm, -start.velocity_mm_s, -start.acceleration_mm_s2, -start.jerk_mm_s3};
  course.now = {-course.now.position_mm, -course.now.velocity_mm_s, -course.now.acceleration_mm_s2,
                -course.now.jerk_mm_s3};
  return course;
}

template <class Changes>
Course planned(Course start, const Goal& goal, const Changes& changes) {
  const double most = changes.largest(start.now);
  if (std::abs(start.now.acceleration_mm_s2) > most) ease(start, most, changes.release(start.now));
  Course direct = start;
  changes.change(direct, goal.velocity_mm_s);
  if (is_rounding(goal.position_mm - direct.now.position_mm, goal.position_mm)) return direct;
  if (goal.position_mm >= direct.now.position_mm) return to_beyond(start, goal, changes);
  return mirrored(
      to_beyond(mirrored(start), {-goal.position_mm, -goal.velocity_mm_s, goal.highest_mm_s}, changes));
}

bool are_even(const ScurveLimits& limits) {
  const double jerk = limits.jerk1_mm_s3;
  return limits.acceleration_mm_s2 == limits.deceleration_mm_s2 && limits.jerk3_mm_s3 == jerk &&
         limits.jerk5_mm_s3 == jerk && limits.jerk7_mm_s3 == jerk;
}

}  // namespace

std::optional<JerkProfile> plan_evenly(const ScurveLimits& limits, const MotionState& state,
                                       const Goal& goal) {
  const EvenThroughout even(limits);
  const auto from = [&](const Course& start) -> std::optional<Course> {
    if (!even.hold(start.now, goal.highest_mm_s)) return {};
    return planned(start, goal, even);
  };
  const Course start(state);
  std::optional<Course> best = from(start);
  if (state.acceleration_mm_s2 != 0.0 && !are_even(limits)) {  // a larger jerk may take the acceleration away
    const std::optional<Course> other = from(released(start, limits));
    if (other && (!best || other->profile.duration_s < best->profile.duration_s)) best = other;
  }
  if (!best) return {};
  return best->ended_at(goal);
}

JerkProfile plan_to_speed(const ScurveLimits& limits, const MotionState& state, double target_mm,
                          double end_velocity_mm_s) {
  check_limits(limits);
  check_state(state);
  if (!(std::abs(target_mm) <= kLargestMeasure) || !(std::abs(end_velocity_mm_s) <= limits.velocity_mm_s))
    throw MotionError(fmt::format(
        "motion to a speed: found {} mm with {} mm/s, expected a finite number with {} mm/s at most",
        target_mm, end_velocity_mm_s, limits.velocity_mm_s));
  const Goal goal{target_mm, end_velocity_mm_s, limits.velocity_mm_s};
  const Course start(state), free = released(start, limits);
  JerkProfile best =
      planned(free.now.velocity_mm_s == 0.0 ? free : start, goal, HaltAtTurns(limits)).ended_at(goal);
  const auto take_faster = [&](const JerkProfile& other) {
    if (other.duration_s < best.duration_s) best = other;
  };
  if (const auto evenly = plan_evenly(limits, state, goal)) take_faster(*evenly);
  if (end_velocity_mm_s == 0.0) take_faster(plan_retarget(limits, state, target_mm));
  return best;
}

}  // namespace meltstage::motion
