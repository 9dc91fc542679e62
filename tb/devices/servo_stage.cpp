// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/servo_stage.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace meltstage::tb {
namespace {

void require(bool good, const char* field, double value, const char* expected) {
  if (good) return;
  throw std::invalid_argument(fmt::format("servo axis: {} is {}, expected {}", field, value, expected));
}

// Both solutions of y'' = -2 s y' - (s^2 + delta) y without their factor exp(-s t):
// cosine and sine over frequency, or their hyperbolic forms beyond critical damping.
struct Modes {
  double c;
  double s;
};

// `decay` = s t, so that exp(-s t) cosh(r t) cannot overflow.
Modes damped_modes(double delta, double t, double decay) {
  const double phase = std::sqrt(std::abs(delta)) * t;
  if (phase < 1e-8) return {std::exp(-decay), t * std::exp(-decay)};
  const double rate = phase / t;
  if (delta > 0.0) return {std::exp(-decay) * std::cos(phase), std::exp(-decay) * std::sin(phase) / rate};
  const double slow = 0.5 * std::exp(phase - decay);
  const double fast = 0.5 * std::exp(-phase - decay);
  return {slow + fast, (slow - fast) / rate};
}

}  // namespace

ServoAxis::ServoAxis(const ServoAxisConfig& config, double clock_hz)
    : config_(config), clock_hz_(clock_hz), state_{config.start_mm, 0.0} {
  require(clock_hz > 0.0, "clock_hz", clock_hz, "> 0");
  require(config.mm_per_pulse > 0.0, "mm_per_pulse", config.mm_per_pulse, "> 0");
  require(config.travel_mm > 0.0, "travel_mm", config.travel_mm, "> 0");
  require(config.natural_frequency_hz > 0.0, "natural_frequency_hz", config.natural_frequency_hz, "> 0");
  require(config.damping_ratio >= 0.0, "damping_ratio", config.damping_ratio, ">= 0");
  require(config.encoder_mm_per_count > 0.0, "encoder_mm_per_count", config.encoder_mm_per_count, "> 0");
  require(config.index_pitch_mm >= 0.0, "index_pitch_mm", config.index_pitch_mm, ">= 0");
  require(std::isfinite(config.start_mm), "start_mm", config.start_mm, "a finite number");
}

double ServoAxis::commanded_mm() const {
  return config_.start_mm + static_cast<double>(pulses_) * config_.mm_per_pulse;
}

ServoAxis::State ServoAxis::now(std::uint64_t cycle) const {
  if (cycle < cycle_) {
    throw std::logic_error(fmt::format("servo axis: cycle {} is before the last pulse at {}", cycle, cycle_));
  }
  const double t = static_cast<double>(cycle - cycle_) / clock_hz_;
  const double w = 2.0 * std::numbers::pi * config_.natural_frequency_hz;
  const double sigma = config_.damping_ratio * w;
  const double target = commanded_mm();
  const double error = state_.position_mm - target;
  const double velocity = state_.velocity_mm_s;
  const Modes m = damped_modes(w * w - sigma * sigma, t, sigma * t);
  return {target + error * m.c + (velocity + sigma * error) * m.s,
          velocity * m.c - (sigma * velocity + w * w * error) * m.s};
}

void ServoAxis::pulse(std::uint64_t cycle, bool positive) {
  state_ = now(cycle);
  cycle_ = cycle;
  pulses_ += positive ? 1 : -1;
}

std::int64_t ServoAxis::encoder_counts(std::uint64_t cycle) const {
  return std::llround((position_mm(cycle) - config_.start_mm) / config_.encoder_mm_per_count);
}

bool ServoAxis::index(std::uint64_t cycle) const {
  if (config_.index_pitch_mm == 0.0) return false;
  const double from_mark = std::remainder(position_mm(cycle), config_.index_pitch_mm);
  return std::abs(from_mark) <= 0.5 * config_.index_width_mm;
}

}  // namespace meltstage::tb
