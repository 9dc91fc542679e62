// SPDX-License-Identifier: Apache-2.0
// What every profile is put together from: segments of constant jerk, and the change of speed under an
// acceleration limit and two jerks. Internal to the motion library.
#pragma once

#include <cmath>

#include "motion/profile/profile.hpp"

namespace meltstage::motion {

/// @throws MotionError naming the limit that isn't positive and finite.
void check_limits(const ScurveLimits& limits);

/// @throws MotionError if a position that is asked for is no number.
void check_position(double position_mm);

/// State `time_s` behind a state whose jerk stays.
inline MotionState after(const MotionState& start, double time_s) {
  const auto [position, velocity, acceleration, jerk] = start;
  return {position + time_s * (velocity + time_s * (acceleration / 2.0 + time_s * jerk / 6.0)),
          velocity + time_s * (acceleration + time_s * jerk / 2.0), acceleration + time_s * jerk, jerk};
}

/// Time in a segment at which a position is reached; the speed must not change its sign in it.
double time_in_segment(const MotionState& start, double duration_s, double position);

/// Limits of a ramp from a low speed to a high one. A deceleration is the same ramp backwards in time, so
/// that its rise is then jerk 7 and its fall jerk 5.
struct RampLimits {
  double acceleration;
  double inverse_rise, inverse_fall;  ///< of the jerks
  double half_jerk_time;              ///< A^2 times it is the smallest change of speed that reaches A
  double full_change;                 ///< that change

  RampLimits(double peak, double rise, double fall)
      : acceleration(peak),
        inverse_rise(1.0 / rise),
        inverse_fall(1.0 / fall),
        half_jerk_time(0.5 * (inverse_rise + inverse_fall)),
        full_change(peak * peak * half_jerk_time) {}
};

/// Durations and acceleration of a ramp, and the way it takes.
struct Ramp {
  double low_velocity = 0.0;
  double rise_s = 0.0, hold_s = 0.0, fall_s = 0.0;
  double peak_acceleration = 0.0;
  double distance = 0.0;

  double duration_s() const { return rise_s + hold_s + fall_s; }
};

/// The fastest ramp from a low speed (which may be below zero) by a change >= 0.
inline Ramp ramp_by(double low, double change, const RampLimits& limits) {
  const double high = low + change;
  Ramp ramp;
  ramp.low_velocity = low;
  if (change >= limits.full_change) {
    ramp.peak_acceleration = limits.acceleration;
    ramp.hold_s = (change - limits.full_change) / limits.acceleration;
  } else {
    ramp.peak_acceleration = std::sqrt(change / limits.half_jerk_time);
  }
  ramp.rise_s = ramp.peak_acceleration * limits.inverse_rise;
  ramp.fall_s = ramp.peak_acceleration * limits.inverse_fall;
  // Mean speed times duration, and what unequal jerks add to it.
  const double skew_s = ramp.fall_s - ramp.rise_s;
  const double skew_factor = (ramp.rise_s + ramp.fall_s) / 12.0 + ramp.hold_s / 4.0;
  ramp.distance = 0.5 * (low + high) * ramp.duration_s() + ramp.peak_acceleration * skew_s * skew_factor;
  return ramp;
}

inline Ramp ramp_between(double low, double high, const RampLimits& limits) {
  return ramp_by(low, high - low, limits);
}

/// d distance / d change of a ramp; infinite for a change of 0.
inline double distance_slope(const Ramp& ramp, double change, const RampLimits& limits) {
  const double duration_slope =
      change >= limits.full_change ? 1.0 / limits.acceleration : std::sqrt(limits.half_jerk_time / change);
  return 0.5 * ramp.duration_s() + (ramp.low_velocity + 0.5 * change) * duration_slope +
         0.25 * (ramp.fall_s - ramp.rise_s);
}

}  // namespace meltstage::motion
