// SPDX-License-Identifier: Apache-2.0
// Detectors from what a chip measured, without a chip.
#include "host/commissioning.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/rng.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::host {
namespace {

// What a relay without hysteresis finds on K exp(-D s) / (1 + tau s).
Tuning tuning_of(double degc_at_full_duty, double time_constant_s, double dead_time_s, double rise_degc) {
  double low = 0.0, high = std::numbers::pi / dead_time_s;  // of the ultimate frequency
  for (int i = 0; i < 100; ++i) {
    const double rad_per_s = (low + high) / 2.0;
    const double phase = rad_per_s * dead_time_s + std::atan(rad_per_s * time_constant_s);
    (phase < std::numbers::pi ? low : high) = rad_per_s;
  }
  return {.phase = TuningPhase::finished,
          .cycles = 0,
          .ku_per_k = std::hypot(1.0, low * time_constant_s) / degc_at_full_duty,
          .tu_s = 2.0 * std::numbers::pi / low,
          .hold_duty_percent = 100.0 * rise_degc / degc_at_full_duty};
}

TEST(Commissioning, FindsTheHeadThatTheRelayMet) {
  for (const double time_constant_s : {40.0, 300.0}) {
    for (const double dead_time_s : {2.0, 15.0}) {
      const auto head = identify_head(tuning_of(250.0, time_constant_s, dead_time_s, 85.0), 85.0);
      ASSERT_TRUE(head);
      EXPECT_NEAR(head->dead_time_s, dead_time_s, 1e-6);
      EXPECT_NEAR(head->hold_duty_per_k, 1.0 / 250.0, 1e-9);
      EXPECT_NEAR(head->rate_degc_per_s, 1.3 * 250.0 / time_constant_s, 1e-6) << "a head lags twice";
      EXPECT_NEAR(head->time_constant_s(), time_constant_s / 1.3, 1e-6);
    }
  }
}

TEST(Commissioning, FindsNoHeadWhereNoneIs) {
  const Tuning sound = tuning_of(250.0, 100.0, 5.0, 85.0);
  EXPECT_TRUE(identify_head(sound, 85.0));
  EXPECT_FALSE(identify_head(sound, 0.0)) << "T_AMB at the set-point";
  EXPECT_FALSE(identify_head(sound, -5.0));
  Tuning wrong = sound;
  wrong.ku_per_k = 1.0 / 250.0;
  EXPECT_FALSE(identify_head(wrong, 85.0)) << "as much gain at the ultimate period as at rest";
  wrong = sound;
  wrong.tu_s = 0.0;
  EXPECT_FALSE(identify_head(wrong, 85.0));
  wrong = sound;
  wrong.hold_duty_percent = 0.0;
  EXPECT_FALSE(identify_head(wrong, 85.0));
}

double value(const std::vector<Setting>& settings, const std::string& name) {
  for (const Setting& s : settings)
    if (s.reg->name == name) return s.value;
  ADD_FAILURE() << "no " << name;
  return std::nan("");
}

TEST(Commissioning, DetectorsFollowTheHead) {
  const HeadModel head{.hold_duty_per_k = 0.0045, .dead_time_s = 12.0, .rate_degc_per_s = 0.62};
  const auto settings = detector_settings(head, 0.1, 55);
  EXPECT_NEAR(value(settings, "DTDT_MAX"), 1.0 + 3 * 0.62 + 1.2, 1e-9);
  EXPECT_NEAR(value(settings, "LBA_TIME"), 30.0, 1e-9);
  EXPECT_NEAR(value(settings, "ZERO_WAIT"), 36.0, 1e-9);
  const auto ctrl = static_cast<unsigned>(value(settings, "CTRL"));
  EXPECT_EQ(ctrl & ~unsigned{chip::spec::kCtrlHeatRateMask}, 55u) << "the other bits stay";
  EXPECT_EQ(ctrl >> chip::spec::kCtrlHeatRate, std::lround(13107.2 * 0.0045 * 0.62));
}

TEST(Commissioning, DetectorsOfAnyHeadFitTheirRegistersAndAreOn) {
  for (const double scale : {1e-9, 1e-3, 1.0, 1e3, 1e9}) {
    const HeadModel head{.hold_duty_per_k = scale, .dead_time_s = scale, .rate_degc_per_s = scale};
    for (const Setting& s : detector_settings(head, scale, 0xFFFF)) {
      EXPECT_GT(to_raw(*s.reg, s.value), 0) << s.reg->name << " " << scale;
      if (s.reg->name == "CTRL") {
        EXPECT_GT(to_raw(*s.reg, s.value) >> chip::spec::kCtrlHeatRate, 0) << scale;
      }
    }
  }
}

TEST(HoldRecord, TellsNoiseFromWhatTheHeadDoes) {
  Rng rng = stream(7, "hold record");
  for (const double noise : {0.05, 0.5}) {
    for (const double swing : {0.0, 0.6}) {
      for (const double drift_per_sample : {0.0, 0.2}) {  // a head that warms up has no noise by that
        HoldRecord record;
        for (int i = 0; i < 20000; ++i) {
          const double head = swing * std::sqrt(2.0) * std::sin(i * 0.7);
          const double before = noise * rng.gaussian();
          const double now = noise * rng.gaussian();
          record.add(110.0 + head + now, now - before + drift_per_sample);
        }
        EXPECT_NEAR(record.noise_degc(), noise, 0.02 * noise);
        EXPECT_NEAR(record.swing_degc(), swing, swing > 0.0 ? 0.03 * swing : 0.25 * noise);
      }
    }
  }
  EXPECT_EQ(HoldRecord().noise_degc(), 0.0);
  EXPECT_EQ(HoldRecord().swing_degc(), 0.0);
}

}  // namespace
}  // namespace meltstage::host
