// SPDX-License-Identifier: Apache-2.0
// What every planned motion must keep, and random tasks that meet every combination of degenerate segments.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>

#include "motion/profile/profile.hpp"
#include "motion/profile/retarget.hpp"

namespace meltstage::motion {

/// Evenly in 0..1; the same on every machine, which std::uniform_real_distribution doesn't promise.
inline double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// Largest violation of what a profile promises, relative to the limit or the distance concerned.
struct Violations {
  double limits = 0.0, continuity = 0.0, end = 0.0;
};

/// Ends of the segments are where a profile of constant jerks has its extremes; the middles are looked at as
/// well.
inline Violations violations_of(const Scurve& curve, const ScurveLimits& limits, double distance_mm,
                                double start_velocity, double end_velocity) {
  Violations found;
  const double total_s = std::accumulate(curve.durations_s.begin(), curve.durations_s.end(), 0.0);
  const auto worse = [](double& worst, double value) {
    worst = std::isnan(value) ? 1e9 : std::max(worst, value);
  };
  const auto check_limits = [&](const MotionState& state) {
    worse(found.limits, state.velocity_mm_s / limits.velocity_mm_s - 1.0);
    worse(found.limits, -state.velocity_mm_s / limits.velocity_mm_s);
    worse(found.limits, state.acceleration_mm_s2 / limits.acceleration_mm_s2 - 1.0);
    worse(found.limits, -state.acceleration_mm_s2 / limits.deceleration_mm_s2 - 1.0);
  };
  const double scale_mm = std::max(distance_mm, 1e-6);
  const auto difference = [&](const MotionState& a, const MotionState& b) {
    return std::max({std::abs(a.position_mm - b.position_mm) / scale_mm,
                     std::abs(a.velocity_mm_s - b.velocity_mm_s) / limits.velocity_mm_s,
                     std::abs(a.acceleration_mm_s2 - b.acceleration_mm_s2) /
                         std::max(limits.acceleration_mm_s2, limits.deceleration_mm_s2)});
  };
  for (std::size_t i = 0; i < 7; ++i) {
    const MotionState& start = curve.starts[i];
    const double t = curve.durations_s[i], j = start.jerk_mm_s3, a = start.acceleration_mm_s2,
                 v = start.velocity_mm_s;
    worse(found.limits, -t);
    const MotionState stop = {start.position_mm + v * t + a * t * t / 2 + j * t * t * t / 6,
                              v + a * t + j * t * t / 2, a + j * t, j};
    check_limits(start);
    check_limits(stop);
    check_limits(curve.sample(curve.start_times_s[i] + 0.5 * t));
    worse(found.continuity, difference(stop, i == 6 ? curve.end : curve.starts[i + 1]));
  }
  const std::array jerks = {limits.jerk1_mm_s3, 0.0, limits.jerk3_mm_s3, 0.0,
                            limits.jerk5_mm_s3, 0.0, limits.jerk7_mm_s3};
  for (std::size_t i = 0; i < 7; ++i) worse(found.limits, std::abs(curve.starts[i].jerk_mm_s3) - jerks[i]);
  worse(found.end, difference(curve.sample(0.0), {0.0, start_velocity, 0.0, 0.0}));
  worse(found.end, difference(curve.sample(total_s), {distance_mm, end_velocity, 0.0, 0.0}));
  worse(found.end, std::abs(curve.duration_s - total_s));
  return found;
}

/// The same for a motion from any state to rest at `target_mm`. `speed_limit` is Vc, or the speed at the
/// start where that is above a lowered Vc.
inline Violations violations_of(const JerkProfile& profile, const ScurveLimits& limits,
                                const MotionState& state, double target_mm, double speed_limit) {
  Violations found;
  const auto worse = [](double& worst, double value) {
    worst = std::isnan(value) ? 1e9 : std::max(worst, value);
  };
  const double strongest = std::max(limits.acceleration_mm_s2, limits.deceleration_mm_s2);
  double farthest_mm = std::abs(target_mm);
  for (const MotionState& start : profile.starts)
    farthest_mm = std::max(farthest_mm, std::abs(start.position_mm));
  const auto difference = [&](const MotionState& a, const MotionState& b) {
    return std::max({std::abs(a.position_mm - b.position_mm) / std::max(farthest_mm, 1e-3),
                     std::abs(a.velocity_mm_s - b.velocity_mm_s) / speed_limit,
                     std::abs(a.acceleration_mm_s2 - b.acceleration_mm_s2) / strongest});
  };
  const auto check_limits = [&](const MotionState& now) {
    const double acceleration = now.acceleration_mm_s2;
    // At next to no speed its sign is rounding.
    const bool either = std::abs(now.velocity_mm_s) <= 1e-7 * speed_limit;
    const bool speeding_up = acceleration * now.velocity_mm_s > 0.0;
    const double limit = either        ? strongest
                         : speeding_up ? limits.acceleration_mm_s2
                                       : limits.deceleration_mm_s2;
    worse(found.limits, std::abs(now.velocity_mm_s) / speed_limit - 1.0);
    worse(found.limits, std::abs(acceleration) / limit - 1.0);
  };
  MotionState before = {0.0, state.velocity_mm_s, state.acceleration_mm_s2, 0.0};
  double time_s = 0.0;
  for (std::size_t i = 0; i < profile.segments; ++i) {
    const MotionState& start = profile.starts[i];
    const double t = profile.durations_s[i], j = start.jerk_mm_s3;
    worse(found.limits, -t);
    worse(found.continuity, difference(before, start));
    worse(found.end, std::abs(profile.start_times_s[i] - time_s));
    const double a = start.acceleration_mm_s2, v = start.velocity_mm_s;
    before = {start.position_mm + v * t + a * t * t / 2 + j * t * t * t / 6, v + a * t + j * t * t / 2,
              a + j * t, j};
    time_s += t;
    check_limits(start);
    check_limits(before);
    const MotionState middle = profile.sample(profile.start_times_s[i] + 0.5 * t);
    check_limits(middle);
    const bool speeding_up = middle.acceleration_mm_s2 * middle.velocity_mm_s > 0.0;
    const bool rising = middle.acceleration_mm_s2 * j > 0.0;
    const double limit = speeding_up ? (rising ? limits.jerk1_mm_s3 : limits.jerk3_mm_s3)
                                     : (rising ? limits.jerk5_mm_s3 : limits.jerk7_mm_s3);
    worse(found.limits, std::abs(j) / limit - 1.0);
  }
  worse(found.continuity, difference(before, {target_mm, 0.0, 0.0, 0.0}));
  worse(found.end, difference(profile.sample(profile.duration_s), {target_mm, 0.0, 0.0, 0.0}));
  worse(found.end, std::abs(profile.duration_s - time_s));
  return found;
}

struct RandomTask {
  ScurveLimits limits;
  double distance_mm, start_velocity, end_velocity;
};

/// Limits, speeds and distances over several decades, so that every combination of degenerate segments comes
/// up.
inline RandomTask random_task(std::mt19937_64& random) {
  const auto spread = [&](double low, double high) {
    return low * std::pow(high / low, static_cast<double>(random() >> 11) * 0x1p-53);
  };
  RandomTask task;
  task.limits = {spread(1, 1000),  spread(10, 2e4),  spread(10, 2e4), spread(1e2, 1e7),
                 spread(1e2, 1e7), spread(1e2, 1e7), spread(1e2, 1e7)};
  task.distance_mm = spread(1e-4, 1e4);
  const bool from_rest = random() % 2 == 0, to_rest = random() % 2 == 0;
  task.start_velocity = from_rest ? 0.0 : task.limits.velocity_mm_s * spread(1e-4, 1.0);
  task.end_velocity = to_rest ? 0.0 : task.limits.velocity_mm_s * spread(1e-4, 1.0);
  return task;
}

}  // namespace meltstage::motion
