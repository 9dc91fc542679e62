// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/retarget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "motion/profile/check_positive.hpp"
#include "motion/profile/course.hpp"
#include "motion/profile/profile_parts.hpp"

namespace meltstage::motion {
namespace {

RampLimits speeding_up(const ScurveLimits& limits) {
  return {limits.acceleration_mm_s2, limits.jerk1_mm_s3, limits.jerk3_mm_s3};
}

RampLimits slowing_down(const ScurveLimits& limits) {
  return {limits.deceleration_mm_s2, limits.jerk7_mm_s3, limits.jerk5_mm_s3};
}

/// Takes the acceleration, which is above zero, away.
void end_acceleration(Course& course, const ScurveLimits& limits) {
  course.append(course.now.acceleration_mm_s2 / limits.jerk3_mm_s3, -limits.jerk3_mm_s3);
  course.now.acceleration_mm_s2 = 0.0;
}

/// The axis is slowing down so hard that it turns back before jerk 7 has ended the deceleration.
bool turns_back(const MotionState& state, const ScurveLimits& limits) {
  constexpr double kRounding = 1e-9;  // on the last segment of a stop the two sides are equal
  const double braking = -state.acceleration_mm_s2;
  return braking > 0.0 &&
         braking * braking > 2.0 * limits.jerk7_mm_s3 * state.velocity_mm_s * (1.0 + kRounding);
}

/// The way to the turn of such a state.
Course to_the_turn(Course course, const ScurveLimits& limits) {
  const double braking = -course.now.acceleration_mm_s2, jerk = limits.jerk7_mm_s3;
  const double at_the_turn = std::sqrt(braking * braking - 2.0 * jerk * course.now.velocity_mm_s);
  course.append((braking - at_the_turn) / jerk, jerk);
  course.now.velocity_mm_s = 0.0;
  course.now.acceleration_mm_s2 = -at_the_turn;
  return course;
}

/// Ordinary deceleration to rest from the present deceleration, of a forward motion that does not turn back.
void stop_forward(Course& course, const ScurveLimits& limits) {
  if (course.now.acceleration_mm_s2 > 0.0) end_acceleration(course, limits);
  const double excess = -course.now.acceleration_mm_s2 - limits.deceleration_mm_s2;
  course.append(excess / limits.jerk7_mm_s3, limits.jerk7_mm_s3);
  const double braking = -course.now.acceleration_mm_s2;
  const double speed = speed_before(course.now.velocity_mm_s, -braking, limits.jerk5_mm_s3);
  const Ramp ramp = ramp_between(0.0, std::max(0.0, speed), slowing_down(limits));
  course.append((ramp.peak_acceleration - braking) / limits.jerk5_mm_s3, -limits.jerk5_mm_s3);
  course.append(ramp.hold_s, 0.0);
  course.append(ramp.rise_s, limits.jerk7_mm_s3);
  course.now.velocity_mm_s = course.now.acceleration_mm_s2 = 0.0;
}

Course stopped(Course course, const ScurveLimits& limits) {
  stop_forward(course, limits);
  return course;
}

/// The deceleration eases to `braking` before the stop.
Course eased_stop(Course course, const ScurveLimits& limits, double braking) {
  course.append((-course.now.acceleration_mm_s2 - braking) / limits.jerk7_mm_s3, limits.jerk7_mm_s3);
  course.now.acceleration_mm_s2 = -braking;
  stop_forward(course, limits);
  return course;
}

Course stop_and_go_on(Course course, const ScurveLimits& limits, double target_mm) {
  stop_forward(course, limits);
  course.append(plan_scurve(limits, target_mm - course.now.position_mm), 1.0);
  return course;
}

/// Slows down to the speed limit from above, goes on with it and stops at the target; if the target is too
/// near, in one gentler deceleration.
Course slow_down(Course course, const ScurveLimits& limits, double target_mm) {
  if (course.now.acceleration_mm_s2 > 0.0) end_acceleration(course, limits);
  const double excess = -course.now.acceleration_mm_s2 - limits.deceleration_mm_s2;
  course.append(excess / limits.jerk7_mm_s3, limits.jerk7_mm_s3);
  const double braking = -course.now.acceleration_mm_s2;
  const RampLimits down = slowing_down(limits);
  const Course before = course;

  const double speed = speed_before(course.now.velocity_mm_s, -braking, limits.jerk5_mm_s3);
  const Ramp to_limit = ramp_between(std::min(limits.velocity_mm_s, speed), speed, down);
  course.append((to_limit.peak_acceleration - braking) / limits.jerk5_mm_s3, -limits.jerk5_mm_s3);
  course.append(to_limit.hold_s, 0.0);
  course.append(to_limit.rise_s, limits.jerk7_mm_s3);
  course.now.velocity_mm_s = limits.velocity_mm_s;
  course.now.acceleration_mm_s2 = 0.0;
  const Ramp to_rest = ramp_between(0.0, limits.velocity_mm_s, down);
  const double cruise_mm = target_mm - course.now.position_mm - to_rest.distance;
  if (cruise_mm >= 0.0) {
    course.append(cruise_mm / limits.velocity_mm_s, 0.0);
    stop_forward(course, limits);
    return course;
  }

  course = before;
  course.append(braking / limits.jerk7_mm_s3, limits.jerk7_mm_s3);
  course.now.acceleration_mm_s2 = 0.0;
  const double way_mm = target_mm - course.now.position_mm, start_speed = course.now.velocity_mm_s;
  const auto gentle = [&](double share) {
    return ramp_between(0.0, start_speed,
                        {share * limits.deceleration_mm_s2, limits.jerk7_mm_s3, limits.jerk5_mm_s3});
  };
  // The way shrinks as the deceleration grows; half a millionth of D would stop later than any travel.
  const Ramp ramp = gentle(-root_of_rising(
      [&](double minus_share) { return gentle(-minus_share).distance - way_mm; }, -1.0, -5e-7));
  course.append(ramp.fall_s, -limits.jerk5_mm_s3);
  course.append(ramp.hold_s, 0.0);
  course.append(ramp.rise_s, limits.jerk7_mm_s3);
  return course;
}

Course from_above_the_limit(const Course& course, const ScurveLimits& limits, double target_mm) {
  const Course slower = slow_down(course, limits, target_mm),
               stop_first = stop_and_go_on(course, limits, target_mm);
  return slower.profile.duration_s <= stop_first.profile.duration_s ? slower : stop_first;
}

/// A present acceleration >= 0 that grows, stays and is taken away, and the way it takes.
struct SpeedUp {
  double rise_s, hold_s, fall_s, way_mm;
};

/// The fastest way to come to rest of acceleration at a speed that is `gain` above the least possible one.
/// Only what is still to come is computed: beside a high speed, or a long rise before, it would be lost in
/// rounding.
SpeedUp speed_up_by(const MotionState& state, double gain, const RampLimits& ramp) {
  const auto [position, velocity, acceleration, jerk] = state;
  const double square = acceleration * acceleration,
               free_peak = std::sqrt(square + gain / ramp.half_jerk_time);
  double peak = free_peak,
         growth = gain > 0.0 ? gain / ramp.half_jerk_time / (free_peak + acceleration) : 0.0, hold_s = 0.0;
  if (free_peak > ramp.acceleration) {
    peak = std::max(ramp.acceleration, acceleration);
    growth = peak - acceleration;
    hold_s = (gain - (peak + acceleration) * growth * ramp.half_jerk_time) / peak;
  }
  const double rise_s = growth * ramp.inverse_rise, fall_s = peak * ramp.inverse_fall;
  const double least_speed = velocity + 0.5 * square * ramp.inverse_fall;
  const double risen = velocity + 0.5 * rise_s * (acceleration + peak);
  const double rise_mm = rise_s * (velocity + rise_s * (2.0 * acceleration + peak) / 6.0),
               hold_mm = hold_s * (risen + 0.5 * hold_s * peak),
               fall_mm = fall_s * (least_speed + gain - fall_s * peak / 6.0);
  return {rise_s, hold_s, fall_s, rise_mm + hold_mm + fall_mm};
}

/// To rest at a target beyond the stopping point, of a forward motion.
Course go_on(Course course, const ScurveLimits& limits, double target_mm) {
  constexpr double kRounding = 1e-12;  // a profile under the same limits ends its acceleration at Vc
  const double above_limit = limits.velocity_mm_s * (1.0 + kRounding);
  const double braking = -course.now.acceleration_mm_s2;
  if (braking > 0.0) {
    const Course released = eased_stop(course, limits, 0.0);
    if (released.now.position_mm >= target_mm) {
      const double minus_ease = root_of_rising(
          [&](double minus_braking) {
            return eased_stop(course, limits, -minus_braking).now.position_mm - target_mm;
          },
          -braking, 0.0);
      return eased_stop(course, limits, -minus_ease);
    }
    if (speed_before(course.now.velocity_mm_s, braking, limits.jerk7_mm_s3) > above_limit)
      return from_above_the_limit(course, limits, target_mm);
    course.append(braking / limits.jerk7_mm_s3, limits.jerk7_mm_s3);
    course.now.acceleration_mm_s2 = 0.0;
  }

  const double excess = course.now.acceleration_mm_s2 - limits.acceleration_mm_s2;
  course.append(excess / limits.jerk3_mm_s3, -limits.jerk3_mm_s3);
  const MotionState from = course.now;
  const auto [position, velocity, acceleration, jerk] = from;
  const double lowest = velocity + acceleration * acceleration / (2.0 * limits.jerk3_mm_s3);
  if (lowest > above_limit) return from_above_the_limit(course, limits, target_mm);
  const RampLimits up_limits = speeding_up(limits), down_limits = slowing_down(limits);
  const double way_mm = target_mm - position;
  const auto up_by = [&](double gain) { return speed_up_by(from, gain, up_limits); };
  const auto down_from = [&](double peak) { return ramp_by(0.0, peak, down_limits); };
  const auto ways_mm = [&](double gain) { return up_by(gain).way_mm + down_from(lowest + gain).distance; };
  const double gain = root_of_rising([&](double by) { return ways_mm(by) - way_mm; }, 0.0,
                                     std::max(0.0, limits.velocity_mm_s - lowest));
  const double peak = lowest + gain;
  const SpeedUp up = up_by(gain);
  const Ramp down = down_from(peak);
  course.append(up.rise_s, limits.jerk1_mm_s3);
  course.append(up.hold_s, 0.0);
  course.append(up.fall_s, -limits.jerk3_mm_s3);
  course.now.velocity_mm_s = peak;
  course.now.acceleration_mm_s2 = 0.0;
  course.append((way_mm - ways_mm(gain)) / peak, 0.0);
  course.append(down.fall_s, -limits.jerk5_mm_s3);
  course.append(down.hold_s, 0.0);
  course.append(down.rise_s, limits.jerk7_mm_s3);
  return course;
}

MotionState mirrored(const MotionState& state) {
  return {-state.position_mm, -state.velocity_mm_s, -state.acceleration_mm_s2, -state.jerk_mm_s3};
}

JerkProfile mirrored(JerkProfile profile) {
  for (MotionState& start : profile.starts) start = mirrored(start);
  profile.end = mirrored(profile.end);
  return profile;
}

/// The course, then a profile that begins at its end.
JerkProfile joined(const Course& course, const JerkProfile& next) {
  JerkProfile whole = course.profile;
  for (std::size_t i = 0; i < next.segments; ++i, ++whole.segments) {
    whole.durations_s[whole.segments] = next.durations_s[i];
    whole.start_times_s[whole.segments] = course.profile.duration_s + next.start_times_s[i];
    whole.starts[whole.segments] = next.starts[i];
    whole.starts[whole.segments].position_mm += course.now.position_mm;
  }
  whole.duration_s += next.duration_s;
  whole.end = next.end;
  whole.end.position_mm += course.now.position_mm;
  return whole;
}

bool moves_backward(const MotionState& state) {
  return state.velocity_mm_s < 0.0 || (state.velocity_mm_s == 0.0 && state.acceleration_mm_s2 < 0.0);
}

}  // namespace

void check_state(const MotionState& state) {
  if (std::abs(state.position_mm) <= kLargestMeasure && std::abs(state.velocity_mm_s) <= kLargestMeasure &&
      std::abs(state.acceleration_mm_s2) <= kLargestMeasure)
    return;
  throw MotionError(fmt::format("state: found {} mm, {} mm/s and {} mm/s2, expected finite numbers up to {}",
                                state.position_mm, state.velocity_mm_s, state.acceleration_mm_s2,
                                kLargestMeasure));
}

JerkProfile::JerkProfile(const Scurve& curve) : end(curve.end), duration_s(curve.duration_s) {
  starts.front() = curve.starts.front();
  for (std::size_t i = 0; i < curve.durations_s.size(); ++i) {
    if (curve.durations_s[i] == 0.0) continue;
    durations_s[segments] = curve.durations_s[i];
    start_times_s[segments] = curve.start_times_s[i];
    starts[segments++] = curve.starts[i];
  }
}

MotionState JerkProfile::sample(double time_s) const {
  if (time_s >= duration_s) return end;
  if (!(time_s > 0.0)) time_s = 0.0;
  std::size_t segment = 0;
  while (segment + 1 < segments && time_s >= start_times_s[segment + 1]) ++segment;
  return after(starts[segment], time_s - start_times_s[segment]);
}

double JerkProfile::time_at(double position_mm) const {
  check_position(position_mm);
  if (position_mm <= 0.0 || segments == 0) return 0.0;
  if (position_mm >= end.position_mm) return duration_s;
  std::size_t segment = segments - 1;
  while (segment > 0 && starts[segment].position_mm >= position_mm) --segment;
  return start_times_s[segment] + time_in_segment(starts[segment], durations_s[segment], position_mm);
}

JerkProfile plan_stop(const ScurveLimits& limits, const MotionState& state) {
  check_limits(limits);
  check_state(state);
  if (moves_backward(state)) return mirrored(plan_stop(limits, mirrored(state)));
  if (turns_back(state, limits)) {
    const Course turn = to_the_turn(Course(state), limits);
    return joined(turn, mirrored(plan_stop(limits, mirrored(turn.now))));
  }
  const Course course = stopped(Course(state), limits);
  return course.ended_at({course.now.position_mm});
}

namespace {

double most_of(const ScurveLimits& limits) {
  return std::max({limits.jerk3_mm_s3, limits.jerk5_mm_s3, limits.jerk7_mm_s3, limits.deceleration_mm_s2});
}

}  // namespace

StopWithin plan_stop_within(const ScurveLimits& limits, const MotionState& state, double room_mm) {
  const auto hurried = [&](double haste) {
    ScurveLimits more = limits;
    const double square = haste * haste, cube = square * haste;
    more.deceleration_mm_s2 *= square;
    for (double* jerk : {&more.jerk3_mm_s3, &more.jerk5_mm_s3, &more.jerk7_mm_s3}) *jerk *= cube;
    return more;
  };
  // An axis that turns back comes no farther than to the turn.
  const auto way_mm = [&](const ScurveLimits& under) {
    const MotionState forward = moves_backward(state) ? mirrored(state) : state;
    return turns_back(forward, under) ? to_the_turn(Course(forward), under).now.position_mm
                                      : std::abs(plan_stop(under, state).end.position_mm);
  };
  const auto needed_mm = [&](double haste) { return way_mm(hurried(haste)); };
  StopWithin stop{plan_stop(limits, state), 1.0};
  if (way_mm(limits) <= room_mm || stop.profile.segments == 0) return stop;
  if (!(room_mm >= kLeastMeasure))
    throw MotionError(fmt::format("stop: found room of {} mm, expected at least {} mm for a moving axis",
                                  room_mm, kLeastMeasure));
  double enough = 2.0;
  for (; needed_mm(enough) > room_mm; enough *= 2.0) {
    constexpr double kMostHaste = 1e3;
    if (enough > kMostHaste || most_of(hurried(2.0 * enough)) > kLargestMeasure)
      throw MotionError(
          fmt::format("stop: found room of {} mm, expected more: it takes jerks of more than {:.3g} "
                      "mm/s3 to stop within it",
                      room_mm, most_of(hurried(enough))));
  }
  stop.haste = -root_of_rising([&](double minus_haste) { return needed_mm(-minus_haste) - room_mm; }, -enough,
                               -0.5 * enough);
  stop.profile = plan_stop(hurried(stop.haste), state);
  return stop;
}

JerkProfile plan_retarget(const ScurveLimits& limits, const MotionState& state, double target_mm) {
  check_limits(limits);
  check_state(state);
  if (!(std::abs(target_mm) <= kLargestMeasure))
    throw MotionError(fmt::format("retarget: found target {} mm, expected a finite number up to {}",
                                  target_mm, kLargestMeasure));
  if (state.velocity_mm_s == 0.0 && state.acceleration_mm_s2 == 0.0) {
    const Scurve curve = plan_scurve(limits, std::abs(target_mm));
    return target_mm < 0.0 ? mirrored(JerkProfile(curve)) : JerkProfile(curve);
  }
  if (moves_backward(state)) return mirrored(plan_retarget(limits, mirrored(state), -target_mm));

  const Course start(state);
  if (turns_back(state, limits)) {
    const Course turn = to_the_turn(start, limits);
    const double left_mm = target_mm - turn.now.position_mm;
    JerkProfile profile = joined(turn, mirrored(plan_retarget(limits, mirrored(turn.now), -left_mm)));
    profile.end.position_mm = target_mm;
    // A target behind the turn may want more of the deceleration, not less.
    const auto evenly = plan_evenly(limits, state, {target_mm, 0.0, limits.velocity_mm_s});
    return evenly && evenly->duration_s < profile.duration_s ? *evenly : profile;
  }
  Course stop = stopped(start, limits);
  const double beyond_mm = target_mm - stop.now.position_mm;
  if (is_rounding(beyond_mm, target_mm)) return stop.ended_at({target_mm});
  if (beyond_mm > 0.0) return go_on(start, limits, target_mm).ended_at({target_mm});
  stop.append(plan_scurve(limits, -beyond_mm), -1.0);
  const auto through = plan_evenly(limits, state, {target_mm, 0.0, limits.velocity_mm_s});
  return through && through->duration_s < stop.profile.duration_s ? *through : stop.ended_at({target_mm});
}

}  // namespace meltstage::motion
