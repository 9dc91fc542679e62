// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/stage_model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "motion/profile/shaping.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::StartsWith;

const ScurveLimits limits = asymmetric_limits(400, 4000, 4000, 1e6, 1e6);

/// A motor so heavy and stiff that it follows the command, without friction.
AxisModelConfig stiff_axis() {
  AxisModelConfig config;
  config.moved_mass_kg = 1000.0;
  config.load_mass_kg = 0.01;
  config.servo.force_limit_n = 1e6;
  config.servo.speed_bandwidth_hz = 300.0;
  config.coulomb_friction_n = 0.0;
  config.viscous_friction_ns_m = 0.0;
  config.encoder_mm = 1e-6;
  return config;
}

void hold(AxisModel& axis, double position_mm, double time_s) {
  const auto cycles = static_cast<int>(time_s / axis.config().servo.cycle_s);
  for (int i = 0; i < cycles; ++i) axis.step({position_mm, 0.0, 0.0, 0.0});
}

void move(AxisModel& axis, double from_mm, double to_mm) {
  const Scurve curve = plan_scurve(asymmetric_limits(100, 1000, 1000, 5e4, 5e4), std::abs(to_mm - from_mm));
  const double sign = to_mm < from_mm ? -1.0 : 1.0;
  for (double t = 0.0; t < curve.duration_s; t += axis.config().servo.cycle_s) {
    const MotionState along = curve.sample(t);
    axis.step({from_mm + sign * along.position_mm, sign * along.velocity_mm_s,
               sign * along.acceleration_mm_s2, 0.0});
  }
  hold(axis, to_mm, 1.0);
}

TEST(AxisModel, OfAStiffMotorVibratesAsTheExactResidualSays) {
  const AxisModelConfig config = stiff_axis();
  for (const double distance_mm : {3.0, 20.0, 45.0}) {
    const JerkProfile profile = plan_scurve(limits, distance_mm);
    AxisModel axis(config);
    const double cycle_s = config.servo.cycle_s;
    double largest_mm = 0.0;
    const double period_s = 1.0 / config.mode.frequency_hz;
    for (double t = 0.0; t < profile.duration_s + 1.5 * period_s; t += cycle_s) {
      axis.step(profile.sample(t));
      if (t > profile.duration_s)
        largest_mm = std::max(largest_mm, std::abs(axis.load_mm() - axis.slide_mm()));
    }
    // The envelope decays by at most half a period's damping before the first peak.
    const double envelope_mm = residual_mm(profile, config.mode);
    EXPECT_LE(largest_mm, envelope_mm * 1.02) << distance_mm;
    EXPECT_GE(largest_mm, envelope_mm * std::exp(-config.mode.damping_ratio * 3.2) * 0.98) << distance_mm;
  }
}

TEST(AxisModel, ComesToRestAtTheTarget) {
  AxisModelConfig config;
  config.coulomb_friction_n = 2.0;
  AxisModel axis(config);
  move(axis, 0.0, 12.0);
  EXPECT_NEAR(axis.encoder_mm(), 12.0, 2.0 * config.encoder_mm);
  EXPECT_NEAR(axis.load_mm(), 12.0, 3e-4);
}

TEST(AxisModel, LosesTheBacklashWhenItTurnsBack) {
  AxisModelConfig config;
  config.coulomb_friction_n = 1.0;
  config.screw.backlash_mm = 0.02;
  AxisModel axis(config);
  move(axis, 0.0, 5.0);
  const double forward_mm = axis.load_mm();
  move(axis, 5.0, 10.0);
  move(axis, 10.0, 5.0);
  EXPECT_NEAR(axis.load_mm() - forward_mm, 0.02, 2e-3);
}

TEST(AxisModel, HasTheLeadErrorOfItsScrew) {
  AxisModelConfig config;
  config.coulomb_friction_n = 1.0;
  config.screw.lead_error_share = 1e-3;
  config.screw.lead_error_mm = 0.01;
  AxisModel axis(config);
  move(axis, 0.0, 2.5);  // a quarter of the lead: the error of a turn is at its largest
  EXPECT_NEAR(axis.load_mm(), 2.5 * 1.001 + 0.01, 5e-4);
  EXPECT_NEAR(axis.encoder_mm(), 2.5, 3e-4);
}

TEST(AxisModel, ReadsWholeEncoderCounts) {
  AxisModelConfig config;
  config.encoder_mm = 0.01;
  AxisModel axis(config, 0.126);
  EXPECT_NEAR(axis.encoder_mm(), 0.13, 1e-12);
}

TEST(AxisModel, StaysPutWhileTheForceIsBelowFriction) {
  AxisModelConfig config;
  config.servo.position_bandwidth_hz = 0.0;
  config.servo.speed_bandwidth_hz = 0.0;
  const auto pushed_mm = [&](double force_n) {
    AxisModel axis(config);
    for (int i = 0; i < 4000; ++i)
      axis.step({0.0, 0.0, force_n / config.moved_mass_kg * 1e3, 0.0});  // half a second
    return axis.encoder_mm();
  };
  EXPECT_LT(pushed_mm(0.5 * config.coulomb_friction_n),
            10.0 * config.presliding_mm);  // it creeps a little as the load swings
  EXPECT_GT(pushed_mm(1.5 * config.coulomb_friction_n), 10.0);
}

TEST(AxisModel, IsTheSameForwardsAndBackwards) {
  const AxisModelConfig config;
  AxisModel up(config), down(config);
  const Scurve curve = plan_scurve(limits, 10.0);
  for (double t = 0.0; t < 0.3; t += config.servo.cycle_s) {
    const MotionState now = curve.sample(t);
    up.step(now);
    down.step({-now.position_mm, -now.velocity_mm_s, -now.acceleration_mm_s2, 0.0});
    ASSERT_NEAR(up.load_mm(), -down.load_mm(), 1e-9);
  }
}

TEST(MeasureMove, ShapingTakesTheSettlingAway) {
  const AxisModelConfig config;
  const JerkProfile rough = plan_scurve(limits, 20.0);
  const JerkProfile quiet = plan_quiet_move(limits, 20.0, {config.mode, 0.1}, 0.005);
  const MoveFigures before = measure_move(config, rough, 0.01), after = measure_move(config, quiet, 0.01);
  EXPECT_GT(before.settling_s, 0.1);
  EXPECT_EQ(after.settling_s, 0.0);
  EXPECT_LT(after.positioning_mm, 0.2 * before.positioning_mm);
}

TEST(MeasureMove, SaysTheWholeWatchWhenItNeverSettles) {
  AxisModelConfig config;
  config.screw.lead_error_share = 0.01;  // 0.2 mm off the target
  EXPECT_EQ(measure_move(config, plan_scurve(limits, 20.0), 0.01, 0.4).settling_s, 0.4);
}

TEST(AxisModel, RefusesWhatCannotBe) {
  const auto message = [](const std::function<void(AxisModelConfig&)>& change) {
    AxisModelConfig config;
    change(config);
    return error_of([&] { AxisModel axis(config); });
  };
  EXPECT_EQ(message([](AxisModelConfig& c) { c.load_mass_kg = 0.0; }),
            "axis model: load mass: found 0 kg, expected a finite number above 0");
  EXPECT_THAT(message([](AxisModelConfig& c) { c.moved_mass_kg = 2.0; }),
              StartsWith("axis model: found moved mass [kg] 2"));
  EXPECT_THAT(message([](AxisModelConfig& c) { c.mode.frequency_hz = -1.0; }),
              StartsWith("mode: found -1 Hz"));
  EXPECT_THAT(message([](AxisModelConfig& c) { c.screw.backlash_mm = NAN; }),
              StartsWith("axis model: found backlash [mm] nan"));
}

}  // namespace
}  // namespace meltstage::motion
