// SPDX-License-Identifier: Apache-2.0
#include "tb/trials/firmware_rules.hpp"

#include <algorithm>
#include <cmath>

namespace meltstage::tb {
namespace {

namespace marlin {
constexpr double kPeriod_s = 40.0;            // THERMAL_PROTECTION_PERIOD
constexpr double kHysteresis_degc = 4.0;      // THERMAL_PROTECTION_HYSTERESIS
constexpr double kWatch_s = 20.0;             // WATCH_TEMP_PERIOD
constexpr double kWatchRise_degc = 2.0;       // WATCH_TEMP_INCREASE
constexpr double kTempHysteresis_degc = 3.0;  // TEMP_HYSTERESIS
constexpr double kMin_degc = 5.0;             // HEATER_0_MINTEMP
}  // namespace marlin

namespace klipper {
constexpr double kHysteresis_degc = 5.0;
constexpr double kMaxError_degc_s = 120.0;
constexpr double kHeatingGain_degc = 2.0;
constexpr double kCheckGain_s = 20.0;
constexpr double kSmooth_s = 1.0;
constexpr double kCheck_s = 1.0;
}  // namespace klipper

}  // namespace

void MarlinRule::watch(double time_s, double reading_degc) {
  using namespace marlin;
  const bool far =
      target_degc_ > 0.0 && reading_degc < target_degc_ - (kWatchRise_degc + kTempHysteresis_degc + 1.0);
  watch_degc_ = reading_degc + kWatchRise_degc;
  watch_at_s_ = far ? time_s + kWatch_s : kNever_s;
}

bool MarlinRule::see(double time_s, double reading_degc, double target_degc) {
  using namespace marlin;
  if (tripped_) return true;
  if (target_degc != target_degc_) {
    target_degc_ = target_degc;
    state_ = target_degc > 0.0 ? State::first_heating : State::inactive;
    watch(time_s, reading_degc);
  }
  if (reading_degc >= max_degc_ || (target_degc > 0.0 && reading_degc <= kMin_degc)) tripped_ = true;
  if (time_s >= watch_at_s_) {
    if (reading_degc < watch_degc_) tripped_ = true;
    watch(time_s, reading_degc);
  }
  if (state_ == State::first_heating && reading_degc >= target_degc) {
    state_ = State::stable;
    runaway_at_s_ = time_s + kPeriod_s;
  }
  if (state_ == State::stable) {
    if (reading_degc >= target_degc - kHysteresis_degc)
      runaway_at_s_ = time_s + kPeriod_s;
    else if (time_s >= runaway_at_s_)
      tripped_ = true;
  }
  return tripped_;
}

bool KlipperRule::see(double time_s, double reading_degc, double target_degc) {
  if (tripped_) return true;
  if (std::isnan(smoothed_degc_)) smoothed_degc_ = reading_degc;
  smoothed_degc_ += (reading_degc - smoothed_degc_) * std::min((time_s - last_s_) / klipper::kSmooth_s, 1.0);
  last_s_ = time_s;
  if (reading_degc >= max_degc_) tripped_ = true;
  if (time_s < next_check_s_) return tripped_;
  next_check_s_ = time_s + klipper::kCheck_s;
  tripped_ = tripped_ || check(time_s, target_degc);
  return tripped_;
}

bool KlipperRule::check(double time_s, double target_degc) {
  using namespace klipper;
  const double reading = smoothed_degc_;
  if (reading >= target_degc - kHysteresis_degc || target_degc <= 0.0) {
    approaching_ = starting_approach_ = false;
    if (reading <= target_degc + kHysteresis_degc) error_degc_s_ = 0.0;
    last_target_degc_ = target_degc;
    return false;
  }
  error_degc_s_ += (target_degc - kHysteresis_degc - reading) * kCheck_s;
  bool bad = false;
  if (!approaching_) {
    if (target_degc != last_target_degc_) {
      approaching_ = starting_approach_ = true;
      goal_degc_ = reading + kHeatingGain_degc;
      goal_at_s_ = time_s + kCheckGain_s;
    } else {
      bad = error_degc_s_ >= kMaxError_degc_s;
    }
  } else if (reading >= goal_degc_) {
    starting_approach_ = false;
    error_degc_s_ = 0.0;
    goal_degc_ = reading + kHeatingGain_degc;
    goal_at_s_ = time_s + kCheckGain_s;
  } else if (time_s >= goal_at_s_) {
    approaching_ = starting_approach_ = false;
  } else if (starting_approach_) {
    goal_degc_ = std::min(goal_degc_, reading + kHeatingGain_degc);
  }
  last_target_degc_ = target_degc;
  return bad;
}

}  // namespace meltstage::tb
