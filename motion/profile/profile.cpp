// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "motion/profile/check_positive.hpp"
#include "motion/profile/profile_parts.hpp"

namespace meltstage::motion {
namespace {

struct Task {
  RampLimits up, down;
  double start_velocity, end_velocity, distance;
};

/// Both ramps to a peak speed, which is given by what it is above a speed no lower than either end: of peaks
/// just above that, the difference alone has the digits that the ways need.
struct Ramps {
  double peak, up_change, down_change;
  Ramp up, down;

  Ramps(const Task& task, double above, double excess)
      : peak(above + excess),
        up_change((above - task.start_velocity) + excess),
        down_change((above - task.end_velocity) + excess),
        up(ramp_by(task.start_velocity, up_change, task.up)),
        down(ramp_by(task.end_velocity, down_change, task.down)) {}
  double distance() const { return up.distance + down.distance; }
};

/// Way of a ramp that holds its acceleration: a v^2 + b v + c of its high speed v, from the formulas in
/// ramp_between.
struct FullRampWay {
  double a, b, c;

  FullRampWay(double low, const RampLimits& limits) {
    const double acceleration = limits.acceleration, turn = acceleration * limits.half_jerk_time;
    const double rise_s = acceleration * limits.inverse_rise, fall_s = acceleration * limits.inverse_fall,
                 skew_s = fall_s - rise_s;
    a = 0.5 / acceleration;
    b = 0.5 * turn + 0.25 * skew_s;
    c = 0.5 * low * (turn - low / acceleration) +
        acceleration * skew_s * ((rise_s + fall_s) / 12.0 - 0.25 * (low / acceleration + turn));
  }
};

/// Way of a ramp from rest that doesn't reach its acceleration, over v^1.5 of its high speed v.
double short_ramp_factor(const RampLimits& limits) {
  const double skew = limits.inverse_fall - limits.inverse_rise;
  return std::sqrt(limits.half_jerk_time) + skew / (6.0 * std::sqrt(limits.half_jerk_time));
}

/// Peak speed if both ramps hold their acceleration. NaN without a real root.
double peak_of_full_ramps(const Task& task) {
  const FullRampWay up(task.start_velocity, task.up), down(task.end_velocity, task.down);
  const double a = up.a + down.a, b = up.b + down.b, c = up.c + down.c - task.distance;
  return (-b + std::sqrt(b * b - 4.0 * a * c)) / (2.0 * a);
}

/// Peak speed from rest to rest if neither ramp reaches its acceleration.
double peak_of_short_ramps(const Task& task) {
  const double root = std::cbrt(task.distance / (short_ramp_factor(task.up) + short_ramp_factor(task.down)));
  return root * root;
}

/// Peak speed from rest to rest if one ramp holds its acceleration and the other doesn't reach it: the root
/// of a polynomial in w = sqrt(peak) that is convex and rises, by Newton steps from above. NaN if the root
/// isn't below `highest`.
double peak_of_mixed_ramps(const Task& task, double highest) {
  const bool up_holds = task.up.full_change < task.down.full_change;
  const FullRampWay way(0.0, up_holds ? task.up : task.down);
  const double cubic = short_ramp_factor(up_holds ? task.down : task.up), rest = way.c - task.distance;
  double w = std::sqrt(highest);
  for (int step = 0; step < 40; ++step) {
    const double excess = ((way.a * w + cubic) * w + way.b) * w * w + rest;
    const double slope = ((4.0 * way.a * w + 3.0 * cubic) * w + 2.0 * way.b) * w;
    const double change = excess / slope;
    w -= change;
    if (std::abs(change) <= 1e-15 * w) return w * w;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// Newton in w = sqrt(peak - slowest possible peak), where the function is smooth, kept inside a shrinking
/// bracket. Returns w^2.
double excess_by_newton(const Task& task, double slowest, double fastest) {
  double low = 0.0, high = std::sqrt(fastest - slowest), w = high;
  for (int step = 0; step < 200; ++step) {
    const Ramps ramps(task, slowest, w * w);
    const double error = ramps.distance() - task.distance;
    (error > 0.0 ? high : low) = w;
    const double slope = distance_slope(ramps.up, ramps.up_change, task.up) +
                         distance_slope(ramps.down, ramps.down_change, task.down);
    const double change = error / (2.0 * w * slope);
    if (std::abs(change) <= 2e-16 * w) break;
    w = w - change > low && w - change < high ? w - change : 0.5 * (low + high);
  }
  return w * w;
}

/// By how much the peak speed with which both ramps together take the whole distance is above the slowest
/// possible.
double find_excess(const Task& task, double slowest, double fastest) {
  const double both_full =
      std::max(task.start_velocity + task.up.full_change, task.end_velocity + task.down.full_change);
  if (slowest == 0.0) {
    const double one_full = std::min(task.up.full_change, task.down.full_change);
    const double short_peak = peak_of_short_ramps(task);
    if (short_peak <= one_full) return std::min(short_peak, fastest);
    double peak = peak_of_full_ramps(task);
    if (!(peak >= both_full)) peak = peak_of_mixed_ramps(task, std::min(both_full, fastest));
    if (peak >= one_full && peak <= fastest) return peak;
  } else if (both_full < fastest) {
    const double peak = peak_of_full_ramps(task);
    if (peak >= both_full && peak <= fastest) return peak - slowest;
  }
  return excess_by_newton(task, slowest, fastest);
}

void check_velocity(std::string_view what, double value, double limit) {
  if (!(value >= 0.0 && value <= limit))
    throw MotionError(fmt::format("{}: found {} mm/s, expected 0..{} mm/s", what, value, limit));
}

void check_coordinates(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm) {
  if (!from_mm.allFinite() || !to_mm.allFinite())
    throw MotionError("move: found a coordinate that is not finite, expected millimetres");
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

}  // namespace

void check_positive(std::string_view what, double value, std::string_view unit) {
  if (!std::isfinite(value) || value <= 0.0)
    throw MotionError(fmt::format("{}: found {} {}, expected a finite number above 0", what, value, unit));
  if (value < kLeastMeasure || value > kLargestMeasure)
    throw MotionError(fmt::format("{}: found {} {}, expected a number from {} to {}", what, value, unit,
                                  kLeastMeasure, kLargestMeasure));
}

void check_position(double position_mm) {
  if (std::isnan(position_mm)) throw MotionError("profile: found position nan mm, expected a number");
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
  check_position(position_mm);
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
  if (!(distance_mm >= 0.0 && distance_mm <= kLargestMeasure))
    throw MotionError(
        fmt::format("distance: found {} mm, expected a number from 0 to {}", distance_mm, kLargestMeasure));

  const Task task{{limits.acceleration_mm_s2, limits.jerk1_mm_s3, limits.jerk3_mm_s3},
                  {limits.deceleration_mm_s2, limits.jerk7_mm_s3, limits.jerk5_mm_s3},
                  start_velocity_mm_s,
                  end_velocity_mm_s,
                  distance_mm};
  if (distance_mm == 0.0 && start_velocity_mm_s == end_velocity_mm_s) {
    Scurve nothing;
    nothing.end.velocity_mm_s = end_velocity_mm_s;
    nothing.starts.fill(nothing.end);
    return nothing;
  }
  const Ramps fastest(task, limits.velocity_mm_s, 0.0);
  const double cruise_mm = distance_mm - fastest.distance();
  if (cruise_mm >= 0.0)
    return lay_out(fastest.up, cruise_mm / limits.velocity_mm_s, fastest.down, limits, distance_mm);

  const double slowest = std::max(start_velocity_mm_s, end_velocity_mm_s);
  if (slowest > 0.0) {
    const Ramps shortest(task, slowest, 0.0);
    constexpr double kRounding = 1e-12;
    if (shortest.distance() > distance_mm * (1.0 + kRounding))
      throw MotionError(fmt::format(
          "distance: found {:.9g} mm, expected at least {:.9g} mm for the change from {} to {} mm/s",
          distance_mm, shortest.distance(), start_velocity_mm_s, end_velocity_mm_s));
    if (shortest.distance() >= distance_mm)
      return lay_out(shortest.up, 0.0, shortest.down, limits, distance_mm);
  }
  const Ramps ramps(task, slowest, find_excess(task, slowest, limits.velocity_mm_s));
  const double rest_mm = std::max(0.0, distance_mm - ramps.distance());
  return lay_out(ramps.up, rest_mm / ramps.peak, ramps.down, limits, distance_mm);
}

Scurve stretched(const Scurve& curve, double factor) {
  if (!(factor >= kLeastMeasure && factor <= kLargestMeasure))
    throw MotionError(fmt::format("stretching: found factor {}, expected a number from {} to {}", factor,
                                  kLeastMeasure, kLargestMeasure));
  Scurve slow = curve;
  const double square = factor * factor;
  for (double& duration_s : slow.durations_s) duration_s *= factor;
  for (double& start_time_s : slow.start_times_s) start_time_s *= factor;
  slow.duration_s *= factor;
  const auto stretch = [&](MotionState& state) {
    state.velocity_mm_s /= factor;
    state.acceleration_mm_s2 /= square;
    state.jerk_mm_s3 /= square * factor;
  };
  for (MotionState& start : slow.starts) stretch(start);
  stretch(slow.end);
  return slow;
}

Scurve round_to_cycles(const Scurve& curve, double cycle_s) {
  check_positive("servo cycle", cycle_s, "s");
  constexpr double kLongest_s = 60.0;
  if (cycle_s > kLongest_s)
    throw MotionError(fmt::format("servo cycle: found {} s, expected {} s at most", cycle_s, kLongest_s));
  if (curve.starts.front().velocity_mm_s != 0.0 || curve.end.velocity_mm_s != 0.0)
    throw MotionError(
        fmt::format("servo cycles: found a profile from {} to {} mm/s, expected rest at both ends",
                    curve.starts.front().velocity_mm_s, curve.end.velocity_mm_s));
  std::array<double, 7> durations_s{};
  constexpr double kRounding = 1e-9;  // of a cycle: a duration that is whole but for its last bits stays
  for (std::size_t i = 0; i < 7; ++i)
    durations_s[i] = cycle_s * std::max(0.0, std::ceil(curve.durations_s[i] / cycle_s - kRounding));  // no -0
  // A ramp from rest of given durations, for a high speed of 1.
  const auto unit_ramp = [](double rise_s, double hold_s, double fall_s) {
    Ramp ramp{0.0, rise_s, hold_s, fall_s, 0.0, 0.0};
    const double area_s = 0.5 * (rise_s + fall_s) + hold_s;
    if (area_s == 0.0) return ramp;
    ramp.peak_acceleration = 1.0 / area_s;
    ramp.distance = ramp.peak_acceleration * (rise_s * rise_s / 6.0 + 0.5 * hold_s * (rise_s + hold_s) +
                                              fall_s * (0.5 * rise_s + hold_s + fall_s / 3.0));
    return ramp;
  };
  Ramp up = unit_ramp(durations_s[0], durations_s[1], durations_s[2]);
  Ramp down = unit_ramp(durations_s[6], durations_s[5], durations_s[4]);
  const double peak = curve.end.position_mm / (up.distance + durations_s[3] + down.distance);
  if (!std::isfinite(peak)) return curve;  // a move of no length
  up.peak_acceleration *= peak;
  down.peak_acceleration *= peak;
  const auto jerk = [](double acceleration, double time_s) {
    return time_s > 0.0 ? acceleration / time_s : 0.0;
  };
  return lay_out(up, durations_s[3], down,
                 {peak, up.peak_acceleration, down.peak_acceleration, jerk(up.peak_acceleration, up.rise_s),
                  jerk(up.peak_acceleration, up.fall_s), jerk(down.peak_acceleration, down.fall_s),
                  jerk(down.peak_acceleration, down.rise_s)},
                 curve.end.position_mm);
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
  constexpr std::array kMembers = {&ScurveLimits::velocity_mm_s,      &ScurveLimits::acceleration_mm_s2,
                                   &ScurveLimits::deceleration_mm_s2, &ScurveLimits::jerk1_mm_s3,
                                   &ScurveLimits::jerk3_mm_s3,        &ScurveLimits::jerk5_mm_s3,
                                   &ScurveLimits::jerk7_mm_s3};
  constexpr double kRounding = 1e-9;
  if (!(std::abs(direction.norm() - 1.0) <= kRounding))
    throw MotionError(fmt::format("direction: found a vector of length {}, expected 1", direction.norm()));
  ScurveLimits path;
  for (const auto member : kMembers) {
    path.*member = std::numeric_limits<double>::infinity();
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      const double share = std::abs(direction[static_cast<Eigen::Index>(axis)]);
      if (share > 0.0) path.*member = std::min(path.*member, axes[axis].*member / share);
    }
  }
  return path;
}

Move plan_move(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm, const AxisLimits& axes) {
  check_coordinates(from_mm, to_mm);
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

AxisStates SynchronizedMove::sample(double time_s) const {
  AxisStates states;
  for (std::size_t axis = 0; axis < profiles.size(); ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double sign = to_mm[i] < from_mm[i] ? -1.0 : 1.0;
    const MotionState along = profiles[axis].sample(time_s);
    states.position_mm[i] = time_s >= duration_s ? to_mm[i] : from_mm[i] + sign * along.position_mm;
    states.velocity_mm_s[i] = sign * along.velocity_mm_s;
    states.acceleration_mm_s2[i] = sign * along.acceleration_mm_s2;
    states.jerk_mm_s3[i] = sign * along.jerk_mm_s3;
  }
  return states;
}

SynchronizedMove plan_synchronized(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm,
                                   const AxisLimits& axes) {
  check_coordinates(from_mm, to_mm);
  SynchronizedMove move;
  move.from_mm = from_mm;
  move.to_mm = to_mm;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    move.profiles[axis] = plan_scurve(axes[axis], std::abs(to_mm[i] - from_mm[i]));
    move.duration_s = std::max(move.duration_s, move.profiles[axis].duration_s);
  }
  for (Scurve& profile : move.profiles) {
    if (profile.duration_s == 0.0 || profile.duration_s == move.duration_s) continue;
    profile = stretched(profile, move.duration_s / profile.duration_s);
    profile.duration_s = move.duration_s;
  }
  return move;
}

}  // namespace meltstage::motion
