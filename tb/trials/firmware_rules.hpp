// SPDX-License-Identifier: Apache-2.0
// Heater protection of printer firmware, in floating point, as rules that watch a reading and a target: what
// guard is compared with. Both are given a highest temperature, at which they trip at once.
#pragma once

#include <limits>

namespace meltstage::tb {

inline constexpr double kNever_s = std::numeric_limits<double>::infinity();

/// Marlin 2.1, Marlin/src/module/temperature.cpp with Configuration.h's defaults: thermal runaway protection
/// (4 degC for 40 s once the target was reached), watch (2 degC in 20 s after a target was set), MAXTEMP,
/// MINTEMP 5 degC.
class MarlinRule {
 public:
  explicit MarlinRule(double max_degc) : max_degc_(max_degc) {}
  /// True once it has tripped; call each time a reading is ready.
  bool see(double time_s, double reading_degc, double target_degc);

 private:
  enum class State { inactive, first_heating, stable };
  void watch(double time_s, double reading_degc);

  double max_degc_;
  State state_ = State::inactive;
  double target_degc_ = 0.0;
  double runaway_at_s_ = 0.0;
  double watch_at_s_ = kNever_s;
  double watch_degc_ = 0.0;
  bool tripped_ = false;
};

/// Klipper, klippy/extras/verify_heater.py with its defaults for an extruder (hysteresis 5 degC, max_error
/// 120 degC s, heating_gain 2 degC in check_gain_time 20 s, once a second) on heaters.py's reading smoothed
/// over 1 s; max_temp.
class KlipperRule {
 public:
  explicit KlipperRule(double max_degc) : max_degc_(max_degc) {}
  bool see(double time_s, double reading_degc, double target_degc);

 private:
  bool check(double time_s, double target_degc);

  double max_degc_;
  double smoothed_degc_ = std::numeric_limits<double>::quiet_NaN();
  double last_s_ = 0.0;
  double next_check_s_ = 0.0;
  bool approaching_ = false;
  bool starting_approach_ = false;
  double last_target_degc_ = 0.0;
  double error_degc_s_ = 0.0;
  double goal_degc_ = 0.0;
  double goal_at_s_ = 0.0;
  bool tripped_ = false;
};

}  // namespace meltstage::tb
