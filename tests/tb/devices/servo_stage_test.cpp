// SPDX-License-Identifier: Apache-2.0
#include "tb/devices/servo_stage.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace meltstage::tb {
namespace {

constexpr double kClock_hz = 1.0e6;

ServoAxisConfig axis_config() {
  return {.mm_per_pulse = 0.001,
          .travel_mm = 200.0,
          .natural_frequency_hz = 40.0,
          .damping_ratio = 0.3,
          .encoder_mm_per_count = 0.0005,
          .index_pitch_mm = 10.0,
          .index_width_mm = 0.02,
          .start_mm = 50.0};
}

// `count` pulses, one each 100 cycles; returns the cycle after the last.
std::uint64_t pulse_train(ServoAxis& axis, std::uint64_t cycle, int count, bool dir) {
  for (int i = 0; i < count; ++i, cycle += 100) {
    axis.step(cycle, true, dir);
    axis.step(cycle + 50, false, dir);
  }
  return cycle;
}

TEST(ServoAxis, CountsRisingEdgesInBothDirections) {
  ServoAxis axis(axis_config(), kClock_hz);
  const std::uint64_t cycle = pulse_train(axis, 10, 500, true);
  pulse_train(axis, cycle, 200, false);
  EXPECT_EQ(axis.pulses(), 300);
  EXPECT_NEAR(axis.commanded_mm(), 50.3, 1e-12);
}

TEST(ServoAxis, HeldStepPinIsOnePulse) {
  ServoAxis axis(axis_config(), kClock_hz);
  for (std::uint64_t cycle = 0; cycle < 1000; ++cycle) axis.step(cycle, true, true);
  EXPECT_EQ(axis.pulses(), 1);
}

class Damping : public ::testing::TestWithParam<double> {};

TEST_P(Damping, FollowsAFineRungeKutta) {
  ServoAxisConfig config = axis_config();
  config.damping_ratio = GetParam();
  ServoAxis axis(config, kClock_hz);
  const double w = 2.0 * std::numbers::pi * config.natural_frequency_hz;
  double x = 50.0;
  double v = 0.0;
  double worst_mm = 0.0;
  double largest_mm = 0.0;
  for (std::uint64_t cycle = 0; cycle < 200000; ++cycle) {
    const bool moving = cycle < 60000 || (cycle > 90000 && cycle < 130000);
    axis.step(cycle, moving && cycle % 100 < 50, cycle < 60000);
    if (cycle % 500 == 0) {
      worst_mm = std::max(
          {worst_mm, std::abs(axis.position_mm(cycle) - x), std::abs(axis.velocity_mm_s(cycle) - v) / w});
      largest_mm = std::max(largest_mm, std::abs(x - 50.0));
    }
    const double u = axis.commanded_mm();
    const double h = 1.0 / kClock_hz;
    const auto a = [&](double position, double velocity) {
      return w * w * (u - position) - 2.0 * config.damping_ratio * w * velocity;
    };
    const double v2 = v + 0.5 * h * a(x, v);
    const double a2 = a(x + 0.5 * h * v, v2);
    x += h * (v + 0.5 * h * a(x, v));
    v += h * a2;
  }
  EXPECT_LT(worst_mm, 1e-6);
  EXPECT_GT(largest_mm, 0.4);
}

INSTANTIATE_TEST_SUITE_P(Ratios, Damping, ::testing::Values(0.0, 0.05, 0.7, 1.0, 3.0));

TEST(ServoAxis, OvershootOfASinglePulseIsTheTextbookOne) {
  const ServoAxisConfig config = axis_config();
  ServoAxis axis(config, kClock_hz);
  axis.step(0, true, true);
  const double root = std::sqrt(1.0 - config.damping_ratio * config.damping_ratio);
  const double peak_s = 0.5 / (config.natural_frequency_hz * root);
  const double overshoot = std::exp(-std::numbers::pi * config.damping_ratio / root);
  const auto peak = static_cast<std::uint64_t>(std::llround(peak_s * kClock_hz));
  EXPECT_NEAR(axis.position_mm(peak), 50.0 + config.mm_per_pulse * (1.0 + overshoot), 1e-9);
}

TEST(ServoAxis, ReadingsDoNotChangeLaterReadings) {
  ServoAxis often(axis_config(), kClock_hz);
  ServoAxis seldom(axis_config(), kClock_hz);
  for (std::uint64_t cycle = 0; cycle < 50000; ++cycle) {
    often.step(cycle, cycle % 100 < 50, true);
    if (cycle % 50 == 0) seldom.step(cycle, cycle % 100 < 50, true);
    often.position_mm(cycle);
  }
  EXPECT_EQ(often.position_mm(60000), seldom.position_mm(60000));
}

TEST(ServoAxis, LimitSwitchesCloseAtBothEnds) {
  ServoAxisConfig config = axis_config();
  config.damping_ratio = 1.0;
  config.start_mm = 0.05;
  config.travel_mm = 0.2;
  ServoAxis axis(config, kClock_hz);
  EXPECT_FALSE(axis.limit_low(0));
  EXPECT_FALSE(axis.limit_high(0));
  std::uint64_t cycle = pulse_train(axis, 0, 60, false);
  EXPECT_TRUE(axis.limit_low(cycle + 1000000));
  cycle = pulse_train(axis, cycle + 1000000, 220, true);
  EXPECT_TRUE(axis.limit_high(cycle + 1000000));
  EXPECT_FALSE(axis.limit_low(cycle + 1000000));
}

TEST(ServoAxis, IndexMarksRepeatAtTheirPitch) {
  ServoAxisConfig config = axis_config();
  config.start_mm = 19.985;
  ServoAxis axis(config, kClock_hz);
  EXPECT_FALSE(axis.index(0));
  const std::uint64_t below_centre = pulse_train(axis, 0, 8, true) + 1000000;
  EXPECT_TRUE(axis.index(below_centre));
  const std::uint64_t above_centre = pulse_train(axis, below_centre, 14, true) + 1000000;
  EXPECT_TRUE(axis.index(above_centre));
  const std::uint64_t past_mark = pulse_train(axis, above_centre, 8, true) + 1000000;
  EXPECT_FALSE(axis.index(past_mark));
}

TEST(ServoAxis, EncoderCountsTheTruePosition) {
  ServoAxis axis(axis_config(), kClock_hz);
  const std::uint64_t cycle = pulse_train(axis, 0, 1000, true);
  EXPECT_LT(axis.encoder_counts(cycle), 2000);
  EXPECT_EQ(axis.encoder_counts(cycle + 2000000), 2000);
}

TEST(ServoAxis, RefusesBadValues) {
  ServoAxisConfig config = axis_config();
  config.natural_frequency_hz = 0.0;
  EXPECT_THROW(ServoAxis(config, kClock_hz), std::invalid_argument);
  ServoAxis axis(axis_config(), kClock_hz);
  axis.step(10, true, true);
  EXPECT_THROW(axis.position_mm(9), std::logic_error);
}

}  // namespace
}  // namespace meltstage::tb
