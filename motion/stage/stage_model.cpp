// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/stage_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "motion/profile/check_positive.hpp"

namespace meltstage::motion {
namespace {

constexpr int kStepsPerCycle = 8;

void check(bool good, std::string_view what, double value, std::string_view expected) {
  if (!good) throw MotionError(fmt::format("axis model: found {} {}, expected {}", what, value, expected));
}

void check_not_negative(std::string_view what, double value) {
  check(std::isfinite(value) && value >= 0.0, what, value, "a finite number from 0");
}

}  // namespace

AxisModel::AxisModel(const AxisModelConfig& config, double position_mm) : config_(config) {
  check_mode(config.mode);
  check_positive("axis model: load mass", config.load_mass_kg, "kg");
  check(config.moved_mass_kg > config.load_mass_kg && std::isfinite(config.moved_mass_kg), "moved mass [kg]",
        config.moved_mass_kg, "more than the load's");
  check_positive("axis model: servo cycle", config.servo.cycle_s, "s");
  check_not_negative("position bandwidth [Hz]", config.servo.position_bandwidth_hz);
  check_not_negative("speed bandwidth [Hz]", config.servo.speed_bandwidth_hz);
  check_positive("axis model: integral time", config.servo.integral_time_s, "s");
  check_positive("axis model: force limit", config.servo.force_limit_n, "N");
  check_not_negative("backlash [mm]", config.screw.backlash_mm);
  check_positive("axis model: lead", config.screw.lead_mm, "mm");
  check_positive("axis model: encoder count", config.encoder_mm, "mm");
  check_not_negative("Coulomb friction [N]", config.coulomb_friction_n);
  check_positive("axis model: presliding way", config.presliding_mm, "mm");
  check_not_negative("viscous friction [N s/m]", config.viscous_friction_ns_m);
  const double natural = 2.0 * std::numbers::pi * config.mode.frequency_hz;
  stiffness_n_m_ = config.load_mass_kg * natural * natural;
  damping_ns_m_ = 2.0 * config.mode.damping_ratio * config.load_mass_kg * natural;
  const double start_m = position_mm * 1e-3;
  slide_m_ = screw_m(start_m);
  state_ = {start_m, 0.0, slide_m_, 0.0};
}

double AxisModel::encoder_mm() const {
  return std::round(state_.motor_m * 1e3 / config_.encoder_mm) * config_.encoder_mm;
}

/// Lead error only; the backlash is the way that the motor has to go before the slide follows.
double AxisModel::screw_m(double motor_m) const {
  const ScrewConfig& screw = config_.screw;
  const double turn = 2.0 * std::numbers::pi * motor_m * 1e3 / screw.lead_mm;
  return motor_m * (1.0 + screw.lead_error_share) + screw.lead_error_mm * 1e-3 * std::sin(turn);
}

AxisModel::State AxisModel::rate(const State& state, double force_n) const {
  const double coupling_n =
      stiffness_n_m_ * (slide_m_ - state.load_m) + damping_ns_m_ * (slide_m_s_ - state.load_m_s);
  const double motor_kg = config_.moved_mass_kg - config_.load_mass_kg;
  return {state.motor_m_s, (force_n - coupling_n) / motor_kg, state.load_m_s,
          coupling_n / config_.load_mass_kg};
}

/// The slide follows the motor through lead error and play.
void AxisModel::follow_screw(double time_s) {
  const double backlash_m = config_.screw.backlash_mm * 1e-3;
  const double before_m = slide_m_;
  slack_m_ = std::clamp(slack_m_, 0.0, backlash_m);
  slide_m_ = screw_m(state_.motor_m - slack_m_);
  slide_m_s_ = (slide_m_ - before_m) / time_s;
}

void AxisModel::integrate(double force_n, double time_s) {
  // Dahl: the bristle goes to its full deflection within the presliding way.
  const double full_m = config_.presliding_mm * 1e-3;
  const double speed = state_.motor_m_s;
  const double aim_m = speed >= 0.0 ? full_m : -full_m;
  bristle_m_ = aim_m + (bristle_m_ - aim_m) * std::exp(-std::abs(speed) * time_s / full_m);
  const double friction_n =
      config_.coulomb_friction_n * bristle_m_ / full_m + config_.viscous_friction_ns_m * speed;
  const double net_n = force_n - friction_n;

  // The slide moves with the motor within the step: its play can't change the coupling faster than the step.
  const double slide_before_m = slide_m_, speed_before = slide_m_s_, motor_before_m = state_.motor_m;
  const auto rate_at = [&](const State& state) {
    const bool engaged = config_.screw.backlash_mm == 0.0;
    slide_m_ = engaged ? screw_m(state.motor_m) : slide_before_m;
    slide_m_s_ = engaged ? state.motor_m_s : speed_before;
    return rate(state, net_n);
  };
  const auto moved = [](const State& from, const State& by, double h) {
    return State{from.motor_m + h * by.motor_m, from.motor_m_s + h * by.motor_m_s,
                 from.load_m + h * by.load_m, from.load_m_s + h * by.load_m_s};
  };
  const State k1 = rate_at(state_), k2 = rate_at(moved(state_, k1, 0.5 * time_s)),
              k3 = rate_at(moved(state_, k2, 0.5 * time_s)), k4 = rate_at(moved(state_, k3, time_s));
  for (const auto& [k, weight] : {std::pair{k1, 1.0}, {k2, 2.0}, {k3, 2.0}, {k4, 1.0}})
    state_ = moved(state_, k, weight * time_s / 6.0);
  slack_m_ += state_.motor_m - motor_before_m;
  slide_m_ = slide_before_m;
  follow_screw(time_s);
}

void AxisModel::step(const MotionState& command) {
  const ServoConfig& servo = config_.servo;
  const double speed_command = command.velocity_mm_s * 1e-3,
               error_m = (command.position_mm - encoder_mm()) * 1e-3;
  const double wanted_speed = servo.speed_feed_forward * speed_command +
                              2.0 * std::numbers::pi * servo.position_bandwidth_hz * error_m;
  const double gain = 2.0 * std::numbers::pi * servo.speed_bandwidth_hz * config_.moved_mass_kg;
  const double speed_error = wanted_speed - state_.motor_m_s;
  const double force_n =
      servo.acceleration_feed_forward * config_.moved_mass_kg * command.acceleration_mm_s2 * 1e-3 +
      gain * speed_error + integral_n_;
  const double limited_n = std::clamp(force_n, -servo.force_limit_n, servo.force_limit_n);
  if (limited_n == force_n) integral_n_ += gain * speed_error * servo.cycle_s / servo.integral_time_s;
  for (int i = 0; i < kStepsPerCycle; ++i) integrate(limited_n, servo.cycle_s / kStepsPerCycle);
}

MoveFigures measure_move(const AxisModelConfig& config, const JerkProfile& profile, double band_mm,
                         double watch_s) {
  AxisModel axis(config);
  MoveFigures figures;
  const double cycle_s = config.servo.cycle_s, target_mm = profile.end.position_mm;
  const auto cycles = static_cast<int>(std::ceil((profile.duration_s + watch_s) / cycle_s));
  for (int i = 0; i < cycles; ++i) {
    const double time_s = i * cycle_s;
    const MotionState command = profile.sample(time_s);
    if (time_s <= profile.duration_s) {
      figures.tracking_mm = std::max(figures.tracking_mm, std::abs(command.position_mm - axis.encoder_mm()));
    } else {
      const double error_mm = std::abs(axis.load_mm() - target_mm);
      figures.positioning_mm = std::max(figures.positioning_mm, error_mm);
      if (error_mm > band_mm) figures.settling_s = std::min(watch_s, time_s + cycle_s - profile.duration_s);
    }
    axis.step(command);
  }
  return figures;
}

}  // namespace meltstage::motion
