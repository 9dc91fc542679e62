// SPDX-License-Identifier: Apache-2.0
#include "motion/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

namespace meltstage::motion {
namespace {

/// A change of speed upwards: peak acceleration, its jerk where the acceleration rises and where it falls.
struct RampLimits {
  double acceleration, rise, fall;
};

struct Ramp {
  double low_velocity = 0.0;
  double rise_s = 0.0, hold_s = 0.0, fall_s = 0.0;
  double peak_acceleration = 0.0;
  double distance = 0.0;
  double slope = 0.0;  ///< d distance / d high speed; infinite where the speeds are equal

  double duration_s() const { return rise_s + hold_s + fall_s; }
};

/// Half of the time that building up and removing unit acceleration takes; A^2 times it is the smallest
/// change of speed that reaches A.
double jerk_time(const RampLimits& limits) { return 0.5 * (1.0 / limits.rise + 1.0 / limits.fall); }

double smallest_full_change(const RampLimits& limits) {
  return limits.acceleration * limits.acceleration * jerk_time(limits);
}

/// The ramp low -> high. A deceleration is the same ramp backwards in time (rise is then jerk 7, fall jerk
/// 5).
Ramp ramp_between(double low, double high, const RampLimits& limits) {
  const double change = high - low;
  const double half_jerk_time = jerk_time(limits);
  Ramp ramp;
  ramp.low_velocity = low;
  if (change >= smallest_full_change(limits)) {
    ramp.peak_acceleration = limits.acceleration;
    ramp.hold_s = change / limits.acceleration - limits.acceleration * half_jerk_time;
  } else {
    ramp.peak_acceleration = std::sqrt(change / half_jerk_time);
  }
  ramp.rise_s = ramp.peak_acceleration / limits.rise;
  ramp.fall_s = ramp.peak_acceleration / limits.fall;
  // Mean speed times duration, and what unequal jerks add to it.
  const double skew_s = ramp.fall_s - ramp.rise_s;
  const double skew_factor = (ramp.rise_s + ramp.fall_s) / 12.0 + ramp.hold_s / 4.0;
  ramp.distance = 0.5 * (low + high) * ramp.duration_s() + ramp.peak_acceleration * skew_s * skew_factor;
  const bool holds = change >= smallest_full_change(limits);
  const double duration_slope = holds ? 1.0 / limits.acceleration : std::sqrt(half_jerk_time / change);
  ramp.slope = 0.5 * ramp.duration_s() + 0.5 * (low + high) * duration_slope + 0.25 * skew_s;
  return ramp;
}

struct Task {
  RampLimits up, down;
  double start_velocity, end_velocity, distance;
};

double ramps_distance(const Task& task, double peak) {
  return ramp_between(task.start_velocity, peak, task.up).distance +
         ramp_between(task.end_velocity, peak, task.down).distance;
}

/// Peak speed if both ramps hold their acceleration: their distances are quadratic in it. NaN without a real
/// root.
double peak_of_full_ramps(const Task& task) {
  // distance(v) of one ramp = a v^2 + b v + c, from the formulas in ramp_between.
  const auto coefficients = [](double low, const RampLimits& limits) {
    const double acceleration = limits.acceleration, half = jerk_time(limits);
    const double rise_s = acceleration / limits.rise, fall_s = acceleration / limits.fall,
                 skew_s = fall_s - rise_s;
    return std::array{0.5 / acceleration, 0.5 * acceleration * half + 0.25 * skew_s,
                      0.5 * low * (acceleration * half - low / acceleration) +
                          acceleration * skew_s *
                              ((rise_s + fall_s) / 12.0 - 0.25 * (low / acceleration + acceleration * half))};
  };
  const auto up = coefficients(task.start_velocity, task.up),
             down = coefficients(task.end_velocity, task.down);
  const double a = up[0] + down[0], b = up[1] + down[1], c = up[2] + down[2] - task.distance;
  return (-b + std::sqrt(b * b - 4.0 * a * c)) / (2.0 * a);
}

/// Peak speed from rest to rest if no ramp holds its acceleration: each distance is a constant times v^1.5.
double peak_of_short_ramps(const Task& task) {
  const auto factor = [](const RampLimits& limits) {
    return ramp_between(0.0, 1.0, {1e300, limits.rise, limits.fall}).distance;
  };
  const double root = std::cbrt(task.distance / (factor(task.up) + factor(task.down)));
  return root * root;
}

/// Newton in w = sqrt(peak - slowest possible peak), where the function is smooth, kept inside a shrinking
/// bracket.
double peak_by_newton(const Task& task, double slowest, double fastest) {
  double low = 0.0, high = std::sqrt(fastest - slowest), w = high;
  for (int step = 0; step < 200; ++step) {
    const double peak = slowest + w * w;
    const Ramp up = ramp_between(task.start_velocity, peak, task.up);
    const Ramp down = ramp_between(task.end_velocity, peak, task.down);
    const double excess = up.distance + down.distance - task.distance;
    (excess > 0.0 ? high : low) = w;
    const double change = excess / (2.0 * w * (up.slope + down.slope));
    if (std::abs(change) <= 2e-16 * w) break;
    w = w - change > low && w - change < high ? w - change : 0.5 * (low + high);
  }
  return slowest + w * w;
}

double find_peak(const Task& task, double fastest) {
  if (ramps_distance(task, fastest) <= task.distance) return fastest;
  const double slowest = std::max(task.start_velocity, task.end_velocity);
  if (ramps_distance(task, slowest) >= task.distance) return slowest;
  const double full = std::max(task.start_velocity + smallest_full_change(task.up),
                               task.end_velocity + smallest_full_change(task.down));
  double peak = -1.0;
  if (full < fastest && ramps_distance(task, full) <= task.distance) {
    peak = peak_of_full_ramps(task);
  } else if (slowest == 0.0) {
    const double short_peak = peak_of_short_ramps(task);
    if (short_peak <= std::min(smallest_full_change(task.up), smallest_full_change(task.down)))
      peak = short_peak;
  }
  if (peak >= slowest && peak <= fastest) return peak;
  return peak_by_newton(task, slowest, fastest);
}

void check_positive(std::string_view what, double value, std::string_view unit) {
  if (!std::isfinite(value) || value <= 0.0)
    throw MotionError(fmt::format("{}: found {} {}, expected a finite number above 0", what, value, unit));
}

void check_limits(const ScurveLimits& limits) {
  check_positive("velocity limit", limits.velocity_mm_s, "mm/s");
  check_positive("acceleration limit", limits.acceleration_mm_s2, "mm/s2");
  check_positive("deceleration limit", limits.deceleration_mm_s2, "mm/s2");
  check_positive("jerk limit 1", limits.jerk1_mm_s3, "mm/s3");
  check_positive("jerk limit 3", limits.jerk3_mm_s3, "mm/s3");
  check_positive("jerk limit 5", limits.jerk5_mm_s3, "mm/s3");
  check_positive("jerk limit 7", limits.jerk7_mm_s3, "mm/s3");
}

void check_velocity(std::string_view what, double value, double limit) {
  if (!(value >= 0.0 && value <= limit))
    throw MotionError(fmt::format("{}: found {} mm/s, expected 0..{} mm/s", what, value, limit));
}

MotionState after(const MotionState& start, double time_s) {
  const auto [position, velocity, acceleration, jerk] = start;
  return {position + time_s * (velocity + time_s * (acceleration / 2.0 + time_s * jerk / 6.0)),
          velocity + time_s * (acceleration + time_s * jerk / 2.0), acceleration + time_s * jerk, jerk};
}

/// Lays out both ramps with T4 between. The deceleration is laid out backwards from the end, so that the end
/// is exact.
Scurve lay_out(const Ramp& up, double cruise_s, const Ramp& down, const ScurveLimits& limits,
               double distance) {
  Scurve curve;
  curve.durations_s = {up.rise_s, up.hold_s, up.fall_s, cruise_s, down.fall_s, down.hold_s, down.rise_s};
  const std::array jerks = {limits.jerk1_mm_s3,  0.0, -limits.jerk3_mm_s3, 0.0,
                            -limits.jerk5_mm_s3, 0.0, limits.jerk7_mm_s3};
  curve.end = {distance, down.low_velocity, 0.0, 0.0};

  MotionState state{0.0, up.low_velocity, 0.0, 0.0};
  const std::array forward_accelerations = {0.0, up.peak_acceleration, up.peak_acceleration, 0.0};
  for (std::size_t i = 0; i < 4; ++i) {
    state.acceleration_mm_s2 = forward_accelerations[i];
    state.jerk_mm_s3 = jerks[i];
    curve.starts[i] = state;
    state = after(state, curve.durations_s[i]);
  }
  state = curve.end;
  const std::array backward_accelerations = {0.0, -down.peak_acceleration, -down.peak_acceleration};
  for (std::size_t i = 7; i-- > 4;) {
    state.jerk_mm_s3 = jerks[i];
    state = after(state, -curve.durations_s[i]);
    state.acceleration_mm_s2 = backward_accelerations[i - 4];
    curve.starts[i] = state;
  }
  for (std::size_t i = 0; i < 7; ++i) {
    curve.start_times_s[i] = curve.duration_s;
    curve.duration_s += curve.durations_s[i];
  }
  return curve;
}

/// Time in a segment at which the position is reached: Newton inside a shrinking bracket, as the speed is
/// never negative.
double time_in_segment(const MotionState& start, double duration_s, double position) {
  double low = 0.0, high = duration_s, time = 0.5 * duration_s;
  for (int step = 0; step < 100; ++step) {
    const MotionState state = after(start, time);
    const double excess = state.position_mm - position;
    (excess >= 0.0 ? high : low) = time;
    const double change = excess / state.velocity_mm_s;
    if (std::abs(change) <= 1e-16 * duration_s) break;
    time = time - change > low && time - change < high ? time - change : 0.5 * (low + high);
  }
  return time;
}

}  // namespace

ScurveLimits asymmetric_limits(double velocity_mm_s, double acceleration_mm_s2, double deceleration_mm_s2,
                               double jerk_acceleration_mm_s3, double jerk_deceleration_mm_s3) {
  return {velocity_mm_s,           acceleration_mm_s2,      deceleration_mm_s2,     jerk_acceleration_mm_s3,
          jerk_acceleration_mm_s3, jerk_deceleration_mm_s3, jerk_deceleration_mm_s3};
}

MotionState Scurve::sample(double time_s) const {
  if (time_s >= duration_s) return end;
  if (!(time_s > 0.0)) time_s = 0.0;
  std::size_t segment = 0;
  while (segment < 6 && time_s >= start_times_s[segment + 1]) ++segment;
  return after(starts[segment], time_s - start_times_s[segment]);
}

double Scurve::time_at(double position_mm) const {
  if (position_mm <= 0.0) return 0.0;
  if (position_mm >= end.position_mm) return duration_s;
  std::size_t segment = 6;
  while (segment > 0 && starts[segment].position_mm >= position_mm) --segment;
  return start_times_s[segment] + time_in_segment(starts[segment], durations_s[segment], position_mm);
}

Scurve plan_scurve(const ScurveLimits& limits, double distance_mm, double start_velocity_mm_s,
                   double end_velocity_mm_s) {
  check_limits(limits);
  check_velocity("start speed", start_velocity_mm_s, limits.velocity_mm_s);
  check_velocity("end speed", end_velocity_mm_s, limits.velocity_mm_s);
  if (!std::isfinite(distance_mm) || distance_mm < 0.0)
    throw MotionError(fmt::format("distance: found {} mm, expected a finite number from 0", distance_mm));

  const Task task{{limits.acceleration_mm_s2, limits.jerk1_mm_s3, limits.jerk3_mm_s3},
                  {limits.deceleration_mm_s2, limits.jerk7_mm_s3, limits.jerk5_mm_s3},
                  start_velocity_mm_s,
                  end_velocity_mm_s,
                  distance_mm};
  const double needed_mm = ramps_distance(task, std::max(start_velocity_mm_s, end_velocity_mm_s));
  constexpr double rounding = 1e-12;
  if (needed_mm > distance_mm * (1.0 + rounding))
    throw MotionError(fmt::format(
        "distance: found {:.9g} mm, expected at least {:.9g} mm for the change from {} to {} mm/s",
        distance_mm, needed_mm, start_velocity_mm_s, end_velocity_mm_s));
  if (distance_mm == 0.0) {
    Scurve nothing;
    nothing.end.velocity_mm_s = end_velocity_mm_s;
    nothing.starts.fill(nothing.end);
    return nothing;
  }
  const double peak = find_peak(task, limits.velocity_mm_s);
  const Ramp up = ramp_between(start_velocity_mm_s, peak, task.up);
  const Ramp down = ramp_between(end_velocity_mm_s, peak, task.down);
  const double cruise_s = std::max(0.0, (distance_mm - up.distance - down.distance) / peak);
  return lay_out(up, cruise_s, down, limits, distance_mm);
}

Scurve plan_stop(const ScurveLimits& limits, const MotionState& state) {
  check_limits(limits);
  Scurve curve;
  MotionState now{0.0, state.velocity_mm_s, state.acceleration_mm_s2, 0.0};
  const auto append = [&](std::size_t segment, double duration_s, double jerk) {
    now.jerk_mm_s3 = jerk;
    curve.durations_s[segment] = duration_s;
    curve.start_times_s[segment] = curve.duration_s;
    curve.starts[segment] = now;
    curve.duration_s += duration_s;
    now = after(now, duration_s);
  };
  append(0, 0.0, 0.0);
  append(1, 0.0, 0.0);
  append(2, std::max(0.0, now.acceleration_mm_s2) / limits.jerk3_mm_s3, -limits.jerk3_mm_s3);
  append(3, 0.0, 0.0);
  now.acceleration_mm_s2 = std::min(0.0, now.acceleration_mm_s2);

  // Speed that a deceleration from zero acceleration would have had before it came to the present state.
  const double braking = -now.acceleration_mm_s2;
  const double virtual_velocity = now.velocity_mm_s + braking * braking / (2.0 * limits.jerk5_mm_s3);
  const Ramp ramp = ramp_between(0.0, std::max(0.0, virtual_velocity),
                                 {limits.deceleration_mm_s2, limits.jerk7_mm_s3, limits.jerk5_mm_s3});
  append(4, std::max(0.0, (ramp.peak_acceleration - braking) / limits.jerk5_mm_s3), -limits.jerk5_mm_s3);
  append(5, ramp.hold_s, 0.0);
  append(6, ramp.rise_s, limits.jerk7_mm_s3);
  curve.end = {now.position_mm, 0.0, 0.0, 0.0};
  return curve;
}

AxisStates Move::sample(double time_s) const {
  const MotionState along = profile.sample(time_s);
  const bool arrived = time_s >= profile.duration_s;
  const Eigen::Vector3d position_mm =
      arrived ? to_mm : Eigen::Vector3d(from_mm + along.position_mm * direction);
  return {position_mm, along.velocity_mm_s * direction, along.acceleration_mm_s2 * direction,
          along.jerk_mm_s3 * direction};
}

ScurveLimits limits_along(const AxisLimits& axes, const Eigen::Vector3d& direction) {
  constexpr std::array members = {&ScurveLimits::velocity_mm_s,      &ScurveLimits::acceleration_mm_s2,
                                  &ScurveLimits::deceleration_mm_s2, &ScurveLimits::jerk1_mm_s3,
                                  &ScurveLimits::jerk3_mm_s3,        &ScurveLimits::jerk5_mm_s3,
                                  &ScurveLimits::jerk7_mm_s3};
  ScurveLimits path;
  for (const auto member : members) {
    path.*member = std::numeric_limits<double>::infinity();
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      const double share = std::abs(direction[static_cast<Eigen::Index>(axis)]);
      if (share > 0.0) path.*member = std::min(path.*member, axes[axis].*member / share);
    }
  }
  return path;
}

Move plan_move(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm, const AxisLimits& axes) {
  if (!from_mm.allFinite() || !to_mm.allFinite())
    throw MotionError("move: found a coordinate that is not finite, expected millimetres");
  for (const ScurveLimits& axis : axes) check_limits(axis);
  Move move;
  move.from_mm = from_mm;
  move.to_mm = to_mm;
  const Eigen::Vector3d way_mm = to_mm - from_mm;
  const double distance_mm = way_mm.stableNorm();
  if (distance_mm == 0.0) return move;
  move.direction = way_mm / distance_mm;
  move.limits = limits_along(axes, move.direction);
  move.profile = plan_scurve(move.limits, distance_mm);
  return move;
}

}  // namespace meltstage::motion
