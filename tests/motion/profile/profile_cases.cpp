// SPDX-License-Identifier: Apache-2.0
#include "tests/motion/profile/profile_cases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

namespace meltstage::motion {
namespace {

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

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

// Where a profile leaves its limits, jumps, or does not end at rest at the target; empty: nowhere. A segment
// in which the axis turns is looked at in two parts: what slowed it down speeds it up behind the turn.
std::string wrong_with(const JerkProfile& profile, const ScurveLimits& limits, const MotionState& from,
                       double target_mm) {
  constexpr double kRounding = 1e-9;
  const auto above = [](double found, double limit) { return found > limit * (1.0 + 1e-7); };
  const auto apart = [&](const MotionState& a, const MotionState& b) {
    return std::abs(a.position_mm - b.position_mm) > kRounding * (1.0 + std::abs(target_mm)) ||
           std::abs(a.velocity_mm_s - b.velocity_mm_s) > kRounding * limits.velocity_mm_s ||
           std::abs(a.acceleration_mm_s2 - b.acceleration_mm_s2) > kRounding * limits.acceleration_mm_s2;
  };
  MotionState now = from;
  for (std::size_t i = 0; i < profile.segments; ++i) {
    const MotionState start = profile.starts[i];
    if (apart(now, start)) return fmt::format("a jump before segment {}", i);
    const double jerk = start.jerk_mm_s3, whole_s = profile.durations_s[i];
    const auto state = [&](double time_s) {
      const auto [x, v, a, j] = start;
      return MotionState{x + time_s * (v + time_s * (a / 2 + time_s * j / 6)),
                         v + time_s * (a + time_s * j / 2), a + time_s * j, j};
    };
    // borders, turns and extremes
    std::vector<double> times{0.0, whole_s};
    const auto add = [&](double time_s) {
      if (time_s > 0.0 && time_s < whole_s) times.push_back(time_s);
    };
    if (jerk != 0.0) {
      add(-start.acceleration_mm_s2 / jerk);
      const double root = std::sqrt(std::max(
          0.0, start.acceleration_mm_s2 * start.acceleration_mm_s2 - 2.0 * jerk * start.velocity_mm_s));
      add((-start.acceleration_mm_s2 + root) / jerk);
      add((-start.acceleration_mm_s2 - root) / jerk);
    } else if (start.acceleration_mm_s2 != 0.0) {
      add(-start.velocity_mm_s / start.acceleration_mm_s2);
    }
    std::sort(times.begin(), times.end());
    for (std::size_t part = 0; part + 1 < times.size(); ++part) {
      const MotionState first = state(times[part]), last = state(times[part + 1]),
                        middle = state(0.5 * (times[part] + times[part + 1]));
      // At next to no speed its sign is rounding, and so is the turn at the end of a stop.
      if (std::abs(middle.velocity_mm_s) <= 1e-7 * limits.velocity_mm_s ||
          times[part + 1] - times[part] < 1e-9)
        continue;
      const bool speeding_up = middle.velocity_mm_s * middle.acceleration_mm_s2 > 0.0;
      const bool rises = middle.acceleration_mm_s2 * jerk > 0.0;
      const double most = speeding_up ? limits.acceleration_mm_s2 : limits.deceleration_mm_s2;
      const double most_jerk = speeding_up ? (rises ? limits.jerk1_mm_s3 : limits.jerk3_mm_s3)
                                           : (rises ? limits.jerk5_mm_s3 : limits.jerk7_mm_s3);
      for (const MotionState& end : {first, last}) {
        if (above(std::abs(end.velocity_mm_s), limits.velocity_mm_s))
          return fmt::format("speed {} in segment {}", end.velocity_mm_s, i);
        if (above(std::abs(end.acceleration_mm_s2), most))
          return fmt::format("acceleration {} in segment {}", end.acceleration_mm_s2, i);
      }
      if (above(std::abs(jerk), most_jerk)) return fmt::format("jerk {} in segment {}", jerk, i);
    }
    now = state(whole_s);
  }
  if (apart(now, {target_mm, 0.0, 0.0, 0.0}))
    return fmt::format("the end at {} mm with {} mm/s", now.position_mm, now.velocity_mm_s);
  return "";
}

// A state from which the limits can be kept, up to their edges: the speed that remains when the acceleration
// has gone, in either direction, is below the limit, and behind a turn the acceleration is.
MotionState state_inside(std::mt19937_64& random, const ScurveLimits& limits) {
  for (;;) {
    const double share = random() % 4 == 0   ? std::pow(uniform(random), 8)
                         : random() % 8 == 0 ? 1.0
                                             : uniform(random);
    const double speed = share * limits.velocity_mm_s;
    const double part = random() % 8 == 0 ? 1.0 : uniform(random);
    const double acceleration =
        random() % 2 == 0 ? part * limits.acceleration_mm_s2 : -part * limits.deceleration_mm_s2;
    const double turned =
        std::sqrt(std::max(0.0, acceleration * acceleration - 2.0 * limits.jerk7_mm_s3 * speed));
    const bool inside =
        acceleration > 0.0
            ? speed + acceleration * acceleration / (2.0 * limits.jerk3_mm_s3) <= limits.velocity_mm_s
            : turned <= limits.acceleration_mm_s2 &&
                  turned * turned / (2.0 * limits.jerk3_mm_s3) <= limits.velocity_mm_s;
    if (!inside) continue;
    const double direction = random() % 2 == 0 ? 1.0 : -1.0;
    return {0.0, direction * speed, direction * acceleration, 0.0};
  }
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

std::string any_state_case(std::mt19937_64& random, AnyStateSeen& seen) {
  const auto any = [&](double least, double most) { return least * std::pow(most / least, uniform(random)); };
  ScurveLimits limits{any(1, 1000),  any(100, 20'000), any(100, 20'000), any(1e4, 1e6),
                      any(1e4, 1e6), any(1e4, 1e6),    any(1e4, 1e6)};
  if (random() % 2 == 0) {
    limits = asymmetric_limits(limits.velocity_mm_s, limits.acceleration_mm_s2, limits.acceleration_mm_s2,
                               limits.jerk1_mm_s3, limits.jerk1_mm_s3);
    ++seen.even_limits;
  }
  const MotionState state = state_inside(random, limits);
  const double target_mm = random() % 8 == 0 ? 0.0 : (random() % 2 == 0 ? 1.0 : -1.0) * any(1e-6, 1000);
  const double speed = std::abs(state.velocity_mm_s), acceleration = state.acceleration_mm_s2;
  seen.turns_back += state.velocity_mm_s * acceleration < 0.0 &&
                     acceleration * acceleration > 2.0 * limits.jerk7_mm_s3 * speed;
  const JerkProfile profile = plan_retarget(limits, state, target_mm), stop = plan_stop(limits, state);
  std::string wrong = wrong_with(profile, limits, state, target_mm);
  if (wrong.empty()) wrong = wrong_with(stop, limits, state, stop.end.position_mm);
  if (wrong.empty()) return "";
  return fmt::format("from {} mm/s and {} mm/s2 to {} mm: {}", state.velocity_mm_s, acceleration, target_mm,
                     wrong);
}

}  // namespace meltstage::motion
