// SPDX-License-Identifier: Apache-2.0
#include "tests/motion/profile/profile_cases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

namespace meltstage::motion {
namespace {

std::string complaint(const Violations& worst, double limits_bound) {
  if (worst.limits <= limits_bound && worst.continuity <= 1e-9 && worst.end <= 1e-9) return "";
  return fmt::format("limits {:.3g} (<= {:.3g}), continuity {:.3g}, end {:.3g} (<= 1e-9)", worst.limits,
                     limits_bound, worst.continuity, worst.end);
}

/// So near to rest, a braking state is mostly rounding, and with it the jerk that ends it.
bool is_rounding(const MotionState& state, const ScurveLimits& limits) {
  return state.acceleration_mm_s2 < 0.0 && state.velocity_mm_s < 1e-9 * limits.velocity_mm_s;
}

/// Duration of the time-optimal double S from rest to rest, written independently of the planner: Biagiotti &
/// Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, section 3.4.3.
double textbook_duration_s(double distance, double speed, double acceleration, double jerk) {
  const auto half_s = [&](double peak) {
    return peak * jerk >= acceleration * acceleration ? peak / acceleration + acceleration / jerk
                                                      : 2.0 * std::sqrt(peak / jerk);
  };
  const double cruise_s = distance / speed - half_s(speed);
  if (cruise_s >= 0.0) return 2.0 * half_s(speed) + cruise_s;
  const double turn_s = acceleration / jerk;
  if (distance >= 2.0 * acceleration * turn_s * turn_s)
    return turn_s + std::sqrt(turn_s * turn_s + 4.0 * distance / acceleration);
  return 4.0 * std::cbrt(distance / (2.0 * jerk));
}

}  // namespace

std::string scurve_case(std::mt19937_64& random, ScurveSeen& seen) {
  const auto [limits, distance_mm, start_velocity, end_velocity] = random_task(random);
  Scurve curve;
  try {
    curve = plan_scurve(limits, distance_mm, start_velocity, end_velocity);
  } catch (const MotionError& error) {
    ++seen.refused;
    return std::string_view(error.what()).starts_with("distance: found ") ? "" : error.what();
  }
  const std::string wrong =
      complaint(violations_of(curve, limits, distance_mm, start_velocity, end_velocity), 1e-12);
  if (!wrong.empty()) return wrong;
  const double peak = curve.starts[3].velocity_mm_s;
  const bool at_limit = peak >= limits.velocity_mm_s * (1.0 - 1e-12);
  ++(at_limit ? seen.cruise : seen.no_cruise);
  const int holds = (curve.durations_s[1] > 0.0) + (curve.durations_s[5] > 0.0);
  ++(holds == 2 ? seen.hold_both : holds == 1 ? seen.hold_one : seen.hold_none);
  if (at_limit || curve.durations_s[3] * peak <= 1e-9 * distance_mm) return "";
  return fmt::format("{:.3g} s at {:.9g} mm/s, below the limit", curve.durations_s[3], peak);
}

std::string symmetric_case(std::mt19937_64& random) {
  const RandomTask task = random_task(random);
  const double speed = task.limits.velocity_mm_s, acceleration = task.limits.acceleration_mm_s2,
               jerk = task.limits.jerk1_mm_s3;
  const double found_s =
      plan_scurve(asymmetric_limits(speed, acceleration, acceleration, jerk, jerk), task.distance_mm)
          .duration_s;
  const double expected_s = textbook_duration_s(task.distance_mm, speed, acceleration, jerk);
  if (std::abs(found_s - expected_s) <= 1e-12 * std::max(1.0, expected_s)) return "";
  return fmt::format("duration {:.17g} s, textbook {:.17g} s", found_s, expected_s);
}

std::string rounded_case(std::mt19937_64& random) {
  const RandomTask task = random_task(random);
  const double cycle_s = 1e-3 * std::pow(10.0, 2.0 * uniform(random) - 1.0);
  const Scurve exact = plan_scurve(task.limits, task.distance_mm);
  const Scurve rounded = round_to_cycles(exact, cycle_s);
  for (const double duration_s : rounded.durations_s) {
    const double cycles = duration_s / cycle_s;
    if (std::abs(cycles - std::round(cycles)) > 1e-6 * std::max(1.0, cycles))
      return fmt::format("a segment of {} cycles", cycles);
  }
  // A ramp that was one cycle's fraction may end with less jerk than asked: only the upper bounds are
  // promised.
  std::string wrong = complaint(
      violations_of(JerkProfile(rounded), task.limits, {}, task.distance_mm, task.limits.velocity_mm_s),
      1e-8);
  if (wrong.empty() && rounded.end.position_mm != task.distance_mm) wrong = "another distance";
  if (wrong.empty() && rounded.duration_s > exact.duration_s + 7.0 * cycle_s)
    wrong = "more than 7 cycles longer";
  return wrong;
}

std::string synchronized_case(std::mt19937_64& random) {
  AxisLimits axes;
  Eigen::Vector3d to_mm;
  double slowest_s = 0.0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const RandomTask task = random_task(random);
    axes[static_cast<std::size_t>(axis)] = task.limits;
    to_mm[axis] = random() % 4 == 0 ? 0.0 : (random() % 2 == 0 ? 1.0 : -1.0) * task.distance_mm;
    slowest_s = std::max(slowest_s, plan_scurve(task.limits, std::abs(to_mm[axis])).duration_s);
  }
  const SynchronizedMove move = plan_synchronized(Eigen::Vector3d::Zero(), to_mm, axes);
  if (move.duration_s != slowest_s)
    return fmt::format("duration {} s, slowest axis alone {} s", move.duration_s, slowest_s);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double distance_mm = std::abs(to_mm[static_cast<Eigen::Index>(axis)]);
    if (distance_mm == 0.0) continue;
    // The stretched times are rounded each; their sum may differ in the last bits.
    const std::string wrong = complaint(violations_of(JerkProfile(move.profiles[axis]), axes[axis], {},
                                                      distance_mm, axes[axis].velocity_mm_s),
                                        1e-9);
    if (!wrong.empty()) return fmt::format("axis {}: {}", axis, wrong);
  }
  if (move.sample(move.duration_s).position_mm != to_mm) return "not at the target";
  return "";
}

std::string stop_case(std::mt19937_64& random) {
  const RandomTask task = random_task(random);
  const Scurve curve = plan_scurve(task.limits, task.distance_mm);
  const double time_s = curve.duration_s * uniform(random);
  const MotionState state = curve.sample(time_s);
  if (is_rounding(state, task.limits)) return "";
  const JerkProfile stop = plan_stop(task.limits, state);
  if (state.position_mm + stop.end.position_mm > task.distance_mm * (1.0 + 1e-9)) return "passes the target";
  if (time_s + stop.duration_s > curve.duration_s * (1.0 + 1e-6)) return "stops later than the plan";
  return complaint(violations_of(stop, task.limits, state, stop.end.position_mm, task.limits.velocity_mm_s),
                   1e-6);
}

std::string replan_case(std::mt19937_64& random) {
  const RandomTask task = random_task(random);
  const Scurve curve = plan_scurve(task.limits, task.distance_mm);
  const double time_s = curve.duration_s * uniform(random);
  const MotionState state = curve.sample(time_s);
  const double left_mm = task.distance_mm - state.position_mm;
  if (left_mm < 1e-6 * task.distance_mm) return "";  // so near to the end, a state is mostly rounding
  // While it brakes, rounding puts the stopping point a little before or behind the target.
  const double stop_mm = plan_stop(task.limits, state).end.position_mm;
  if (std::abs(stop_mm - left_mm) <= 1e-9 * task.distance_mm) return "";
  const double found_s = plan_retarget(task.limits, state, left_mm).duration_s;
  if (std::abs(found_s - (curve.duration_s - time_s)) <= 1e-6 * curve.duration_s) return "";
  return fmt::format("{:.9g} s to the old target, {:.9g} s were left", found_s, curve.duration_s - time_s);
}

std::string retarget_case(std::mt19937_64& random, RetargetSeen& seen) {
  const RandomTask task = random_task(random);
  const Scurve curve = plan_scurve(task.limits, task.distance_mm);
  MotionState state = curve.sample(curve.duration_s * uniform(random));
  if (is_rounding(state, task.limits)) return "";
  ScurveLimits limits = task.limits;
  if (random() % 2 == 0) limits.velocity_mm_s *= 0.1 + 0.9 * uniform(random);
  const double stop_mm = plan_stop(limits, state).end.position_mm;
  const double rising = std::max(0.0, state.acceleration_mm_s2);
  const double speed_limit =
      std::max(limits.velocity_mm_s, state.velocity_mm_s + rising * rising / (2.0 * limits.jerk3_mm_s3));
  double target_mm = stop_mm + task.distance_mm * (2.0 * uniform(random) - 0.8);
  ++(target_mm > stop_mm ? seen.farther : seen.nearer);
  ++(state.acceleration_mm_s2 > 0.0 ? seen.speeding_up : seen.slowing_down);
  seen.faster_than_limit += speed_limit > limits.velocity_mm_s * (1.0 + 1e-9);
  const double stopping_s =
      plan_stop(limits, state).duration_s + plan_scurve(limits, std::abs(target_mm - stop_mm)).duration_s;
  if (random() % 2 == 0) {
    target_mm = -target_mm;
    state.velocity_mm_s = -state.velocity_mm_s;
    state.acceleration_mm_s2 = -state.acceleration_mm_s2;
  }
  const JerkProfile profile = plan_retarget(limits, state, target_mm);
  if (profile.duration_s > stopping_s * (1.0 + 1e-9))
    return fmt::format("{:.9g} s, with a stop in between {:.9g} s", profile.duration_s, stopping_s);
  return complaint(violations_of(profile, limits, state, target_mm, speed_limit), 1e-6);
}

}  // namespace meltstage::motion
