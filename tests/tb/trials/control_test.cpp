// SPDX-License-Identifier: Apache-2.0
// The temperature loop in short: what `meltstage bench control` measures on every plant, here on one or two.
#include <gtest/gtest.h>

#include <cmath>

#include "tb/trials/loop_trial.hpp"
#include "tb/trials/peer_loops.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

TEST(Control, DefaultGainsReachTheBoundWithoutOvershoot) {
  const LoopTrial trial{};
  const ChipLoop loop = run_chip(trial, {});
  const LoopFigures f = figures_of(loop.curve, trial.setpoint_degc);
  EXPECT_LE(f.overshoot_percent, 0.1);
  EXPECT_LE(f.settling_s, 1.10 * full_power_time_s(trial));
  EXPECT_LE(f.steady_error_percent, 0.02);

  // The chip's own figures say the same, noise and steps of its sensor included.
  const chip::Quality& q = loop.chip.quality;
  EXPECT_LE(q.over_q / 64.0, 0.001 * trial.setpoint_degc + 5 * trial.noise_degc);
  EXPECT_LE(q.error_q / 64.0, 1.0);
  const auto last_outside_s = [&](double window_degc) {
    double last = 0.0;
    for (std::size_t i = 0; i < loop.curve.sensor_degc.size(); ++i)
      if (std::abs(loop.curve.sensor_degc[i] - trial.setpoint_degc) > window_degc)
        last = static_cast<double>(i + 1) * kCurveStep_s;
    return last;
  };
  EXPECT_GE(q.band_q / 10.0, last_outside_s(1.2));  // AT_WINDOW is 1 degC; the reading has noise
  EXPECT_LE(q.band_q / 10.0, last_outside_s(0.8));
  double on_s = 0.0;
  for (const double duty : loop.curve.duty) on_s += duty * kCurveStep_s;
  EXPECT_NEAR(q.on_q / 10.0, on_s, 1.0);
}

TEST(Control, AFullPresetOvershoots) {
  const LoopTrial trial{.length_s = 400.0};
  const LoopCurve curve = run_chip(trial, {{spec::kRegPreset, 256}}).curve;
  EXPECT_GT(figures_of(curve, trial.setpoint_degc).overshoot_percent, 0.1);
}

TEST(Control, PublishedFormIsWhatWasPublished) {
  const LoopTrial trial{.sensor = "MAX31855", .conversion_s = 0.0, .noise_degc = 0.1};
  const LoopFigures f = figures_of(run_chip(trial, published_form()).curve, trial.setpoint_degc, 800.0);
  EXPECT_GE(f.overshoot_percent, 5.79);  // Xie et al. 2023, table 1
  EXPECT_LE(f.overshoot_percent, 6.93);
  EXPECT_GE(f.settling_s, 320.0);
  EXPECT_LE(f.settling_s, 490.0);
  EXPECT_GE(f.steady_error_percent, 0.66);
  EXPECT_LE(f.steady_error_percent, 1.00);
}

TEST(Control, AutotuneMakesAnUnknownPlantMeetTheSameBounds) {
  LoopTrial trial{.plant = plant_config("E3D-like"), .length_s = 1200.0};
  const TunedLoop tuned = tune_chip(trial, {{spec::kRegHoldTime, 0}, {spec::kRegTMax, 2000}});
  const PlantIdentity id = identify(trial.plant, trial.setpoint_degc);
  EXPECT_NEAR(tuned.tu_s, id.tu_s, 0.05 * id.tu_s);
  EXPECT_NEAR(tuned.ku_per_k, id.ku_per_k, 0.08 * id.ku_per_k);
  const LoopFigures f = figures_of(run_chip(trial, tuned.settings).curve, trial.setpoint_degc);
  EXPECT_LE(f.overshoot_percent, 0.1);
  EXPECT_LE(f.settling_s, 1.10 * full_power_time_s(trial));
  EXPECT_LE(f.steady_error_percent, 0.02);
}

TEST(Control, DropletFeedForwardHalvesThePlainLoopsDeviation) {
  const LoopTrial trial{.length_s = 900.0,
                        .load = {.begin_s = 400.0, .end_s = 600.0, .rate_hz = 200.0, .energy_j = 0.025}};
  const auto deviation = [&](const LoopCurve& curve) {
    return deviation_degc(curve, trial.setpoint_degc, 400.0, 900.0);
  };
  const PlantIdentity id = identify(trial.plant, trial.setpoint_degc);
  const double plain = deviation(run_peer(trial, plain_pi(id)));
  EXPECT_LE(deviation(run_chip(trial, {{spec::kRegFfDrop, 4369}}).curve), 0.5 * plain);
  EXPECT_GT(deviation(run_chip(trial, {}).curve), 0.5 * plain) << "without feed-forward";
}

}  // namespace
}  // namespace meltstage::tb
