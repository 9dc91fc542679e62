// SPDX-License-Identifier: Apache-2.0
#include "tests/motion/profile/any_state_cases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "motion/profile/any_end.hpp"
#include "motion/profile/arrival.hpp"
#include "motion/profile/moving_end.hpp"
#include "tests/motion/profile/profile_checks.hpp"

namespace meltstage::motion {
namespace {

// Rounding, in parts of the quantity's limit. A speed or an acceleration below the last has no sign.
constexpr double kAboveLimit = 1e-9, kJump = 1e-9, kNoSign = 1e-11;

MotionState after_s(const MotionState& start, double t) {
  const auto [p, v, a, j] = start;
  return {p + v * t + a * t * t / 2 + j * t * t * t / 6, v + a * t + j * t * t / 2, a + j * t, j};
}

/// What is left when the acceleration is taken away at once: the speed, and the acceleration at the turn if
/// the axis turns on the way.
struct Unavoidable {
  double velocity_mm_s, turn_acceleration_mm_s2 = 0.0;
};

Unavoidable unavoidable(const ScurveLimits& limits, const MotionState& state) {
  const double v = state.velocity_mm_s, a = state.acceleration_mm_s2, sign = a < 0.0 ? -1.0 : 1.0;
  if (v * a >= 0.0) return {v + sign * a * a / (2 * limits.jerk3_mm_s3)};
  const double square = a * a - 2 * limits.jerk7_mm_s3 * std::abs(v);
  if (square <= 0.0) return {v + sign * a * a / (2 * limits.jerk7_mm_s3)};
  return {sign * square / (2 * limits.jerk3_mm_s3), std::sqrt(square)};
}

/// Times in a segment at which the speed or the acceleration is zero, and its ends, in order.
std::vector<double> cuts_of(const MotionState& start, double duration_s) {
  const double v = start.velocity_mm_s, a = start.acceleration_mm_s2, j = start.jerk_mm_s3;
  std::vector<double> cuts = {0.0, duration_s};
  const auto cut = [&](double time_s) {
    if (time_s > 0.0 && time_s < duration_s) cuts.push_back(time_s);
  };
  if (j != 0.0) {
    cut(-a / j);
    const double square = a * a - 2 * j * v;
    if (square >= 0.0) {
      // The root without cancellation; the other from their product.
      const double sum = -(a + (a < 0.0 ? -1.0 : 1.0) * std::sqrt(square));
      cut(sum / j);
      if (sum != 0.0) cut(2 * v / sum);
    }
  } else if (a != 0.0) {
    cut(-v / a);
  }
  std::sort(cuts.begin(), cuts.end());
  return cuts;
}

/// The speed at which an axis may be anywhere within +-limit, and one of the hard cases.
double random_part(std::mt19937_64& random) {
  constexpr std::array hard = {0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0 - 1e-9, 1.0};
  const double sign = random() % 2 == 0 ? 1.0 : -1.0;
  return sign * (random() % 2 == 0 ? uniform(random) : hard[random() % hard.size()]);
}

}  // namespace

bool inside(const ScurveLimits& limits, const MotionState& state) {
  const double v = state.velocity_mm_s, a = std::abs(state.acceleration_mm_s2);
  const bool slows_down = v * state.acceleration_mm_s2 < 0.0;
  const Unavoidable left = unavoidable(limits, state);
  return std::abs(v) <= limits.velocity_mm_s && std::abs(left.velocity_mm_s) <= limits.velocity_mm_s &&
         a <= (slows_down ? limits.deceleration_mm_s2 : limits.acceleration_mm_s2) &&
         left.turn_acceleration_mm_s2 <= limits.acceleration_mm_s2;
}

AnyState random_any_state(std::mt19937_64& random, Limits kind) {
  const auto spread = [&](double low, double high) { return low * std::pow(high / low, uniform(random)); };
  AnyState task;
  task.limits = {spread(1, 1000),  spread(10, 2e4),  spread(10, 2e4), spread(1e3, 1e7),
                 spread(1e3, 1e7), spread(1e3, 1e7), spread(1e3, 1e7)};
  if (random() % 4 == 0) task.limits = {400, 4000, 3000, 4e5, 4e5, 1e5, 1e5};
  if (kind == Limits::symmetric) {
    const double a = task.limits.acceleration_mm_s2, j = task.limits.jerk1_mm_s3;
    task.limits = {task.limits.velocity_mm_s, a, a, j, j, j, j};
  }
  do {
    const double v = task.limits.velocity_mm_s * random_part(random), part = random_part(random);
    const bool slows_down = v * part < 0.0;
    const double strongest = slows_down ? task.limits.deceleration_mm_s2 : task.limits.acceleration_mm_s2;
    task.state = {0.0, v, strongest * part, 0.0};
  } while (!inside(task.limits, task.state));
  const double sign = random() % 2 == 0 ? 1.0 : -1.0;
  const double stop_mm = plan_stop(task.limits, task.state).end.position_mm;
  const std::array hard = {0.0,
                           sign * 1e-9,
                           stop_mm,
                           stop_mm + sign * 1e-9,
                           stop_mm + sign * 1e-3,
                           1e6 * sign,
                           stop_mm * (1.0 + sign * 1e-6),
                           0.5 * stop_mm};
  task.target.position_mm = random() % 2 == 0 ? sign * spread(1e-4, 1e3) : hard[random() % hard.size()];
  return task;
}

std::string fault_of(const JerkProfile& profile, const AnyState& task) {
  const auto& [limits, state, target] = task;
  const Unavoidable left = unavoidable(limits, state);
  const double speed_limit =
      std::max({limits.velocity_mm_s, std::abs(state.velocity_mm_s), std::abs(left.velocity_mm_s)});
  const double first_acceleration = std::abs(state.acceleration_mm_s2);
  const double strongest =
      std::max({limits.acceleration_mm_s2, limits.deceleration_mm_s2, first_acceleration});
  const bool slows_down = state.velocity_mm_s * state.acceleration_mm_s2 < 0.0;
  const double most_speeding =
      std::max({limits.acceleration_mm_s2, slows_down ? left.turn_acceleration_mm_s2 : first_acceleration});
  const double most_slowing = std::max(limits.deceleration_mm_s2, slows_down ? first_acceleration : 0.0);
  double farthest_mm = std::max(1e-3, std::abs(target.position_mm));
  for (std::size_t i = 0; i < profile.segments; ++i)
    for (const double cut_s : cuts_of(profile.starts[i], profile.durations_s[i]))
      farthest_mm = std::max(farthest_mm, std::abs(after_s(profile.starts[i], cut_s).position_mm));
  const auto jump = [&](const MotionState& a, const MotionState& b) {
    return !(std::abs(a.position_mm - b.position_mm) <= kJump * farthest_mm &&
             std::abs(a.velocity_mm_s - b.velocity_mm_s) <= kJump * speed_limit &&
             std::abs(a.acceleration_mm_s2 - b.acceleration_mm_s2) <= kJump * strongest);
  };
  MotionState now = {0.0, state.velocity_mm_s, state.acceleration_mm_s2, 0.0};
  double time_s = 0.0;
  for (std::size_t i = 0; i < profile.segments; ++i) {
    const MotionState& start = profile.starts[i];
    const double duration_s = profile.durations_s[i], jerk = std::abs(start.jerk_mm_s3);
    if (!(duration_s >= 0.0)) return fmt::format("segment {} lasts {} s", i, duration_s);
    if (jump(now, start)) return fmt::format("a jump before segment {}", i);
    if (std::abs(profile.start_times_s[i] - time_s) > 1e-12 * (1.0 + time_s))
      return fmt::format("segment {} begins at {} s, expected {} s", i, profile.start_times_s[i], time_s);
    const std::vector<double> cuts = cuts_of(start, duration_s);
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
      const MotionState from = after_s(start, cuts[k]), to = after_s(start, cuts[k + 1]),
                        middle = after_s(start, 0.5 * (cuts[k] + cuts[k + 1]));
      const bool any_speed = std::abs(middle.velocity_mm_s) <= kNoSign * speed_limit,
                 any_acceleration = std::abs(middle.acceleration_mm_s2) <= kNoSign * strongest;
      const bool speeds_up = middle.velocity_mm_s * middle.acceleration_mm_s2 > 0.0,
                 rises = middle.acceleration_mm_s2 * start.jerk_mm_s3 > 0.0;
      double most = 0.0, most_jerk = 0.0;
      for (const bool up : {false, true}) {
        if (up != speeds_up && !any_speed && !any_acceleration) continue;
        most = std::max(most, up ? most_speeding : most_slowing);
        for (const bool rise : {false, true})
          if (rise == rises || any_acceleration)
            most_jerk = std::max(most_jerk, up ? (rise ? limits.jerk1_mm_s3 : limits.jerk3_mm_s3)
                                               : (rise ? limits.jerk5_mm_s3 : limits.jerk7_mm_s3));
      }
      for (const MotionState& end : {from, to}) {
        if (!(std::abs(end.velocity_mm_s) <= speed_limit * (1.0 + kAboveLimit)))
          return fmt::format("segment {}: {:.17g} mm/s, expected at most {:.17g}", i, end.velocity_mm_s,
                             speed_limit);
        if (!(std::abs(end.acceleration_mm_s2) <= most * (1.0 + kAboveLimit)))
          return fmt::format("segment {}: {:.17g} mm/s2, expected at most {:.17g}", i, end.acceleration_mm_s2,
                             most);
      }
      if (!(jerk <= most_jerk * (1.0 + 1e-12)))
        return fmt::format("segment {}: {:.17g} mm/s3, expected at most {:.17g}", i, jerk, most_jerk);
    }
    now = after_s(start, duration_s);
    time_s += duration_s;
  }
  if (jump(now, target))
    return fmt::format("ends at {:.17g} mm with {:.9g} mm/s and {:.9g} mm/s2", now.position_mm,
                       now.velocity_mm_s, now.acceleration_mm_s2);
  const MotionState& end = profile.end;
  if (end.position_mm != target.position_mm || end.velocity_mm_s != target.velocity_mm_s ||
      end.acceleration_mm_s2 != target.acceleration_mm_s2)
    return "the end is not exactly the target";
  if (!(std::abs(profile.duration_s - time_s) <= 1e-12 * (1.0 + time_s)))
    return fmt::format("lasts {} s, its segments {} s", profile.duration_s, time_s);
  return "";
}

std::string text_of(const AnyState& task) {
  const auto& [l, state, target] = task;
  return fmt::format(
      "limits {{{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}}}, from {:.17g} mm/s and "
      "{:.17g} mm/s2 "
      "to {:.17g} mm, {:.17g} mm/s and {:.17g} mm/s2",
      l.velocity_mm_s, l.acceleration_mm_s2, l.deceleration_mm_s2, l.jerk1_mm_s3, l.jerk3_mm_s3,
      l.jerk5_mm_s3, l.jerk7_mm_s3, state.velocity_mm_s, state.acceleration_mm_s2, target.position_mm,
      target.velocity_mm_s, target.acceleration_mm_s2);
}

std::string any_state_case(std::mt19937_64& random, AnyStateSeen& seen) {
  const Limits kind = random() % 2 == 0 ? Limits::symmetric : Limits::asymmetric;
  const AnyState task = random_any_state(random, kind);
  const auto& [limits, state, target] = task;
  const double speed = state.velocity_mm_s, acceleration = state.acceleration_mm_s2;
  seen.symmetric += kind == Limits::symmetric;
  seen.turns_back +=
      speed * acceleration < 0.0 && acceleration * acceleration > 2.0 * limits.jerk7_mm_s3 * std::abs(speed);
  std::string fault = fault_of(plan_retarget(limits, state, target.position_mm), task);
  if (!fault.empty()) return fmt::format("{}: {}", text_of(task), fault);
  const JerkProfile stop = plan_stop(limits, state);
  fault = fault_of(stop, {limits, state, {stop.end.position_mm, 0.0, 0.0, 0.0}});
  return fault.empty() ? "" : fmt::format("{}: stop: {}", text_of(task), fault);
}

std::string any_end_case(std::mt19937_64& random, AnyEndSeen& seen) {
  AnyState task = random_any_state(random, Limits::symmetric);
  const ScurveLimits& limits = task.limits;
  const double jerk = limits.jerk1_mm_s3;
  MotionState& end = task.target;
  do {  // an end before which the speed keeps its limit
    end.velocity_mm_s = random() % 4 == 0 ? 0.0 : limits.velocity_mm_s * random_part(random);
    end.acceleration_mm_s2 = random() % 4 == 0 ? 0.0 : limits.acceleration_mm_s2 * random_part(random);
  } while (std::abs(end.velocity_mm_s - end.acceleration_mm_s2 * std::abs(end.acceleration_mm_s2) /
                                            (2.0 * jerk)) > limits.velocity_mm_s);
  const JerkProfile best = plan_to_state(limits, task.state, end);
  const std::string fault = fault_of(best, task);
  if (!fault.empty()) return fmt::format("{}: {}", text_of(task), fault);
  // A place is met to within kJump of a micrometre, and off by rounding.
  const double off_mm = kJump * 1e-3 + 1e-13 * std::abs(end.position_mm);
  const double slack_s = 4.0 * std::cbrt(off_mm / jerk);
  const auto slower = [&](double duration_s, double other_s) {
    return duration_s > other_s * (1.0 + 1e-7) + slack_s;
  };
  if (end.acceleration_mm_s2 == 0.0) {
    ++seen.at_speed;
    const double other_s = plan_to_speed(limits, task.state, end.position_mm, end.velocity_mm_s).duration_s;
    constexpr double kOfIts = 1e-5;  // next to where it could stop plan_to_speed is so much slower
    if (slower(best.duration_s, other_s) || slower(other_s, best.duration_s * (1.0 + kOfIts)))
      return fmt::format("{}: {} s, plan_to_speed {} s", text_of(task), best.duration_s, other_s);
  } else {
    ++seen.with_acceleration;
  }
  MotionState first = task.state;
  first.jerk_mm_s3 = jerk * random_part(random);
  const double step_s = best.duration_s * std::pow(10.0, -3.0 * uniform(random));
  for (const double cut_s : cuts_of(first, step_s))
    if (!inside(limits, after_s(first, cut_s))) return "";
  MotionState then = after_s(first, step_s), left = end;
  left.position_mm -= then.position_mm;
  then.position_mm = 0.0;
  ++seen.compared;
  const double by_step_s = step_s + plan_to_state(limits, then, left).duration_s;
  if (slower(best.duration_s, by_step_s))
    return fmt::format("{}: {} s, by a step of {} s with {} mm/s3 {} s", text_of(task), best.duration_s,
                       step_s, first.jerk_mm_s3, by_step_s);
  return "";
}

std::string moving_end_case(std::mt19937_64& random, MovingEndSeen& seen) {
  const Limits kind = random() % 2 == 0 ? Limits::symmetric : Limits::asymmetric;
  AnyState task = random_any_state(random, kind);
  const ScurveLimits& limits = task.limits;
  task.target.velocity_mm_s = random() % 4 == 0 ? 0.0 : limits.velocity_mm_s * random_part(random);
  const auto best_from = [&](const MotionState& state, double target_mm) {
    return plan_to_speed(limits, state, target_mm, task.target.velocity_mm_s);
  };
  const JerkProfile best = best_from(task.state, task.target.position_mm);
  const std::string fault = fault_of(best, task);
  if (!fault.empty()) return fmt::format("{}: {}", text_of(task), fault);
  for (std::size_t i = 0; i < best.segments; ++i)
    if (best.starts[i].velocity_mm_s * task.target.velocity_mm_s < 0.0) {
      ++seen.goes_back;
      break;
    }
  // A place that is off by rounding costs the time of a way back and forth over it.
  const double off_mm = 1e-13 * std::max(1e-3, std::abs(task.target.position_mm));
  const double slack_s = 4.0 * std::cbrt(off_mm / std::min({limits.jerk1_mm_s3, limits.jerk3_mm_s3,
                                                            limits.jerk5_mm_s3, limits.jerk7_mm_s3}));
  const auto slower = [&](double duration_s, double other_s) {
    return duration_s > other_s * (1.0 + 1e-7) + slack_s;
  };
  if (task.target.velocity_mm_s == 0.0) {
    ++seen.at_rest;
    const double rest_s = plan_retarget(limits, task.state, task.target.position_mm).duration_s;
    if (slower(best.duration_s, rest_s) || (kind == Limits::symmetric && slower(rest_s, best.duration_s)))
      return fmt::format("{}: {} s, plan_retarget {} s", text_of(task), best.duration_s, rest_s);
  }
  if (kind != Limits::symmetric) return "";
  MotionState first = task.state;
  first.jerk_mm_s3 = limits.jerk1_mm_s3 * random_part(random);
  const double step_s = best.duration_s * std::pow(10.0, -3.0 * uniform(random));
  for (const double cut_s : cuts_of(first, step_s))
    if (!inside(limits, after_s(first, cut_s))) return "";
  MotionState then = after_s(first, step_s);
  const double left_mm = task.target.position_mm - then.position_mm;
  then.position_mm = 0.0;
  ++seen.compared;
  const double by_step_s = step_s + best_from(then, left_mm).duration_s;
  if (slower(best.duration_s, by_step_s))
    return fmt::format("{}: {} s, by a step of {} s with {} mm/s3 {} s", text_of(task), best.duration_s,
                       step_s, first.jerk_mm_s3, by_step_s);
  return "";
}

std::string together_case(std::mt19937_64& random, TogetherSeen& seen) {
  constexpr double kRounding = 1e-9;
  std::array<AnyState, 3> tasks;
  AxisLimits limits;
  AxisStates state;
  state.position_mm = state.jerk_mm_s3 = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_mm, end_velocity_mm_s;
  double slowest_s = 0.0;
  for (std::size_t axis = 0; axis < tasks.size(); ++axis) {
    AnyState& task = tasks[axis];
    task = random_any_state(random, random() % 2 == 0 ? Limits::symmetric : Limits::asymmetric);
    if (random() % 2 == 0) task.target.velocity_mm_s = task.limits.velocity_mm_s * (2 * uniform(random) - 1);
    seen.passing += task.target.velocity_mm_s != 0.0;
    limits[axis] = task.limits;
    const auto i = static_cast<Eigen::Index>(axis);
    state.velocity_mm_s[i] = task.state.velocity_mm_s;
    state.acceleration_mm_s2[i] = task.state.acceleration_mm_s2;
    target_mm[i] = task.target.position_mm;
    end_velocity_mm_s[i] = task.target.velocity_mm_s;
    slowest_s = std::max(
        slowest_s, plan_to_speed(task.limits, task.state, target_mm[i], end_velocity_mm_s[i]).duration_s);
  }
  const JointMotion motion = plan_together(limits, state, target_mm, end_velocity_mm_s);
  seen.at_once += motion.duration_s <= slowest_s * (1.0 + kRounding);
  if (motion.duration_s < slowest_s * (1.0 - kRounding))
    return fmt::format("takes {} s, the slowest axis alone {} s", motion.duration_s, slowest_s);
  for (std::size_t axis = 0; axis < tasks.size(); ++axis) {
    const JerkProfile& profile = motion.axes[axis];
    if (const std::string fault = fault_of(profile, tasks[axis]); !fault.empty()) return fault;
    const double early_s = motion.duration_s - profile.duration_s;
    const bool may_wait = tasks[axis].target.velocity_mm_s == 0.0;
    if (early_s < -kRounding * motion.duration_s || (!may_wait && early_s > kRounding * motion.duration_s))
      return fmt::format("arrives {} s before the others: {}", early_s, text_of(tasks[axis]));
  }
  return "";
}

}  // namespace meltstage::motion
