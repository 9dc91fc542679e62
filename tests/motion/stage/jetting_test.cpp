// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/jetting.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::vector<Point> lattice(int columns, int rows, double pitch_mm) {
  std::vector<Point> bumps;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      bumps.push_back({10.0 + column * pitch_mm, 20.0 + row * pitch_mm, bumps.size() + 1});
  return bumps;
}

TEST(Waveform, IsATrapezoid) {
  const Waveform waveform{60.0, 4.0, 30.0, 8.0};
  EXPECT_EQ(duration_us(waveform), 42.0);
  EXPECT_EQ(waveform_v(waveform, -1.0), 0.0);
  EXPECT_EQ(waveform_v(waveform, 1.0), 15.0);
  EXPECT_EQ(waveform_v(waveform, 4.0), 60.0);
  EXPECT_EQ(waveform_v(waveform, 34.0), 60.0);
  EXPECT_EQ(waveform_v(waveform, 40.0), 15.0);
  EXPECT_EQ(waveform_v(waveform, 42.0), 0.0);
}

// Research 2.3: 7.84 s without any shift of the triggers; 44.1 s with a stop at each.
TEST(FlyBy, PrintsTheLatticeFiveTimesFaster) {
  const auto bumps = lattice(32, 32, 0.5);
  FlyByConfig config;
  config.latency_s = config.flight_s = 0.0;
  config.encoder_mm = 1e-6;  // a coarser one brings triggers nearer to each other than their bumps
  const FlyByPlan ideal = plan_fly_by(bumps, config);
  EXPECT_NEAR(ideal.duration_s, 7.84, 0.01);
  const FlyByPlan plan = plan_fly_by(bumps, FlyByConfig{});
  EXPECT_GT(plan.duration_s, ideal.duration_s);
  EXPECT_LT(plan.duration_s, 8.0);
  std::vector<Point> serpentine;
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 32; ++column)
      serpentine.push_back(bumps[static_cast<std::size_t>(row * 32 + (row % 2 == 0 ? column : 31 - column))]);
  EXPECT_NEAR(stop_and_go_s(serpentine, config, 0.0), 1023 * 0.043088694, 1e-3);
}

// Between the rows nothing held the limit: rows near each other, or of one bump, were printed at several
// times it.
TEST(FlyBy, NoTwoDropletsComeFasterThanTheHeadDoes) {
  for (const int columns : {1, 4}) {
    std::vector<Point> bumps;
    for (std::size_t i = 0; i < 24; ++i)
      bumps.push_back({0.5 * static_cast<double>(i % columns), 0.1 * static_cast<double>(i / columns), i});
    for (const double droplets_per_s : {10.0, 20.0, 200.0, 5000.0}) {
      FlyByConfig config;
      config.droplets_per_s = droplets_per_s;
      config.settle_s = 0.0;
      double last_s = -1.0, least_s = 1e9;
      for (const FlyByRow& row : plan_fly_by(bumps, config).rows) {
        for (const Trigger& trigger : row.triggers) {
          least_s = std::min(least_s, trigger.time_s - last_s);
          last_s = trigger.time_s;
        }
      }
      EXPECT_GE(least_s, (1.0 - 1e-9) / droplets_per_s) << columns << " columns";
    }
  }
}

// A comparator fires once at a count: one of the two droplets was missing.
TEST(FlyBy, RefusesTwoBumpsWithinACount) {
  FlyByConfig config;
  config.encoder_mm = 0.01;
  const std::vector<Point> bumps = {{10.003, 10.0, 1}, {10.0031, 10.0, 2}, {12.0, 10.0, 3}};
  EXPECT_THAT(error_of([&] { plan_fly_by(bumps, config); }),
              ::testing::HasSubstr("found the bumps of rows 1 and 2 within one count of 0.01 mm"));
}

TEST(FlyBy, LandsWithinAClockAndHalfACount) {
  const auto bumps = lattice(32, 8, 0.5);
  for (const double encoder_mm : {1e-4, 1e-3, 5e-3}) {
    FlyByConfig config;
    config.encoder_mm = encoder_mm;
    const FlyByPlan plan = plan_fly_by(bumps, config);
    const auto errors = landing_errors_mm(plan, bumps, config, 1e-6, config.flight_s);
    ASSERT_EQ(errors.size(), bumps.size());
    double worst = 0.0;
    for (const double error : errors) worst = std::max(worst, std::abs(error));
    EXPECT_LE(worst, 100.0 * 1e-6 + 0.5 * encoder_mm + 1e-9);
    EXPECT_GE(worst, 0.25 * encoder_mm);  // it isn't zero by some short cut
  }
}

TEST(FlyBy, MissesByTheTimeThatIsNotCompensated) {
  const auto bumps = lattice(8, 2, 0.5);
  const FlyByConfig config;
  const FlyByPlan plan = plan_fly_by(bumps, config);
  const auto errors = landing_errors_mm(plan, bumps, config, 1e-6, config.flight_s + 1e-4);
  const double speed = plan.rows[0].speed_mm_s;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const double direction = i < 8 ? 1.0 : -1.0;
    EXPECT_NEAR(errors[i], direction * speed * 1e-4, speed * 1e-6 + 0.5e-4 + 1e-9) << i;
  }
}

TEST(FlyBy, LandingErrorsOfWhatCannotBeAreRefused) {
  const auto bumps = lattice(8, 2, 0.5);
  const FlyByConfig config;
  const FlyByPlan plan = plan_fly_by(bumps, config);
  const auto message = [&](const FlyByConfig& with, double compare_s, double flight_s) {
    return error_of([&] { landing_errors_mm(plan, bumps, with, compare_s, flight_s); });
  };
  EXPECT_EQ(message(config, 0.0, 5e-4),
            "landing: comparator's clock: found 0 s, expected a finite number above 0");
  for (const double compare_s : {-1e-6, std::nan(""), HUGE_VAL})
    EXPECT_THAT(message(config, compare_s, 5e-4), StartsWith("landing: comparator's clock: found"));
  EXPECT_THAT(message(config, 1e-300, 5e-4), StartsWith("landing: comparator's clock: found 1e-300 s"));
  EXPECT_THAT(message(config, 1e-6, NAN), HasSubstr("nan"));
  FlyByConfig other = config;
  other.encoder_mm = NAN;
  EXPECT_THAT(message(other, 1e-6, 5e-4), HasSubstr("encoder count [mm] nan"));
  other.encoder_mm = 2.0 * config.encoder_mm;  // such counts never come
  EXPECT_THAT(message(other, 1e-6, 5e-4), HasSubstr("never comes to count"));
  EXPECT_THAT(error_of([&] { landing_errors_mm(plan, lattice(2, 2, 0.5), config, 1e-6, 5e-4); }),
              HasSubstr("of bump 4, expected 0 to 3"));
  EXPECT_THAT(error_of([] { FlyByPlan{}.sample(0.0); }), StartsWith("fly-by: found a plan without rows"));
  EXPECT_THAT(error_of([&] { stop_and_go_s(bumps, config, NAN); }), HasSubstr("pause [s] nan"));
}

RC_GTEST_PROP(FlyBy, HoldsWhatItPromisesOnAnyBumps, ()) {
  const int count = *rc::gen::inRange(1, 40);
  std::vector<Point> bumps;
  for (int i = 0; i < count; ++i) {
    const Point bump{0.25 * *rc::gen::inRange(0, 60), 0.4 * *rc::gen::inRange(0, 5),
                     static_cast<std::size_t>(i)};
    const auto same = [&](const Point& other) { return other.x_mm == bump.x_mm && other.y_mm == bump.y_mm; };
    if (std::none_of(bumps.begin(), bumps.end(), same)) bumps.push_back(bump);
  }
  FlyByConfig config;
  config.x = asymmetric_limits(300, 4000, 2500, 2e5, 1e5);
  config.encoder_mm = 5e-4;
  config.settle_s = 0.003;
  const FlyByPlan plan = plan_fly_by(bumps, config);
  std::vector<std::size_t> fired;
  double before_end_s = 0.0, before_droplet_s = -1.0, before_y = plan.rows.front().y_mm;
  for (const FlyByRow& row : plan.rows) {
    RC_ASSERT(row.start_s >= before_end_s - 1e-12);
    double last_s = -1.0;
    for (const Trigger& trigger : row.triggers) {
      fired.push_back(trigger.bump);
      const MotionState at = row.x.sample(trigger.time_s - row.start_s);
      RC_ASSERT(std::abs(at.velocity_mm_s - row.speed_mm_s) < 1e-6 * row.speed_mm_s);
      if (last_s >= 0.0)
        RC_ASSERT(trigger.time_s - last_s >
                  1.0 / config.droplets_per_s - config.encoder_mm / row.speed_mm_s - 1e-9);
      last_s = trigger.time_s;
    }
    if (before_droplet_s >= 0.0) {
      const double step_s = plan_scurve(config.y, row.y_mm - before_y).duration_s;
      RC_ASSERT(row.triggers.front().time_s >=
                before_droplet_s + config.latency_s + step_s + config.settle_s - 1e-9);
    }
    before_droplet_s = last_s;
    before_y = row.y_mm;
    before_end_s = row.start_s + row.x.duration_s;
  }
  std::sort(fired.begin(), fired.end());
  RC_ASSERT(fired.size() == bumps.size());
  RC_ASSERT(std::adjacent_find(fired.begin(), fired.end()) == fired.end());
  for (const double error : landing_errors_mm(plan, bumps, config, 1e-6, config.flight_s))
    RC_ASSERT(std::abs(error) <= 300.0 * 1e-6 + 0.5 * config.encoder_mm + 1e-9);
}

// The way to a row is no part of it: the head goes there as fast as it can.
TEST(FlyBy, WaysBetweenRowsAreMadeAtFullSpeed) {
  FlyByConfig config;
  config.x = config.y = asymmetric_limits(100, 1000, 1000, 5e4, 5e4);
  config.settle_s = 0.015;
  const std::vector<Point> two = {{0, 0, 1}, {20, 2, 2}};
  EXPECT_LT(plan_fly_by(two, config).duration_s, 0.5);
  const std::vector<Point> beside = {{0, 0, 1}, {2, 0.05, 2}};
  EXPECT_LT(plan_fly_by(beside, config).duration_s, 0.3);
  // A long row, then one bump in its middle, then a long row.
  std::vector<Point> mixed = lattice(100, 1, 0.5);
  mixed.push_back({25.1, 1.0, 101});
  for (const Point& p : lattice(100, 1, 0.5)) mixed.push_back({p.x_mm, 2.0, mixed.size() + 1});
  const double one_row_s = plan_fly_by(lattice(100, 1, 0.5), config).duration_s;
  EXPECT_LT(plan_fly_by(mixed, config).duration_s, 2.0 * one_row_s + 1.2);

  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place_mm(0.0, 20.0);
  std::vector<Point> scattered;
  for (std::size_t i = 0; i < 40; ++i) {
    const double x_mm = place_mm(random);
    scattered.push_back({x_mm, place_mm(random), i + 1});
  }
  std::vector<Point> by_row = scattered;
  std::sort(by_row.begin(), by_row.end(), [](const Point& a, const Point& b) { return a.y_mm < b.y_mm; });
  EXPECT_LT(plan_fly_by(scattered, config).duration_s, 1.5 * stop_and_go_s(by_row, config, config.settle_s));
}

TEST(FlyBy, RefusesWhatCannotBe) {
  EXPECT_EQ(error_of([] { plan_fly_by({}, FlyByConfig{}); }), "fly-by: found no bumps, expected at least 1");
  FlyByConfig fine;
  fine.encoder_mm = 1e-19;
  EXPECT_THAT(error_of([&] {
                plan_fly_by(std::vector<Point>{{50, 5}, {51, 5}}, fine);
              }),
              HasSubstr("expected less than 2^53 counts"));
  const FlyByPlan plan = plan_fly_by(lattice(3, 1, 0.5), FlyByConfig{});
  EXPECT_EQ(error_of([&] { landing_errors_mm(plan, {}, FlyByConfig{}, 1e-6, 5e-4); }),
            "landing: found no bumps, expected those of the plan");
  const std::vector<Point> twice = {{1, 1, 4}, {2, 1, 5}, {1, 1, 9}};
  EXPECT_THAT(error_of([&] { plan_fly_by(twice, FlyByConfig{}); }), HasSubstr("rows 4 and 9 at one place"));
  const std::vector<Point> nan = {{NAN, 1, 3}};
  EXPECT_THAT(error_of([&] { plan_fly_by(nan, FlyByConfig{}); }), HasSubstr("row 3 at (nan, 1) mm"));
  FlyByConfig config;
  config.droplets_per_s = 0.0;
  EXPECT_THAT(error_of([&] { plan_fly_by(lattice(2, 2, 1), config); }), HasSubstr("droplets a second 0"));
}

const DropletFigures kGood{.velocity_m_s = 2.0, .diameter_um = 60.0, .roundness = 0.98};

TEST(PrintReadiness, NeedsHeatHomingAndADropletInTheBand) {
  const DropletBand band;
  PrintReadiness ready{.homed = true, .at_temperature = true, .droplet = kGood};
  EXPECT_EQ(why_not_print(ready, band), std::nullopt);
  const auto why = [&](const std::function<void(PrintReadiness&)>& change) {
    PrintReadiness changed = ready;
    change(changed);
    return why_not_print(changed, band).value_or("");
  };
  EXPECT_EQ(why([](PrintReadiness& r) { r.at_temperature = false; }),
            "print: found the head not at temperature, expected at_temp high");
  EXPECT_THAT(why([](PrintReadiness& r) { r.homed = false; }), HasSubstr("isn't homed"));
  EXPECT_THAT(why([](PrintReadiness& r) { r.inhibited = true; }), HasSubstr("emergency stop"));
  EXPECT_THAT(why([](PrintReadiness& r) { r.droplet.reset(); }), HasSubstr("no droplet measured"));
  EXPECT_THAT(why([](PrintReadiness& r) { r.droplet->velocity_m_s = 2.5; }), HasSubstr("velocity 2.500 m/s"));
  EXPECT_THAT(why([](PrintReadiness& r) { r.droplet->velocity_m_s = NAN; }), HasSubstr("velocity nan"));
  EXPECT_THAT(why([](PrintReadiness& r) { r.droplet->roundness = 0.5; }), HasSubstr("roundness 0.500"));
  EXPECT_THAT(why([](PrintReadiness& r) { r.droplet->satellites = 2; }), HasSubstr("2 satellites"));
  EXPECT_THAT(why([](PrintReadiness& r) { r.droplet->angle_deg = -3.0; }), HasSubstr("flight -3.00 deg off"));
}

/// A head: pressure follows the amplitude, most at one dwell; a fast fall leaves satellites.
std::optional<DropletFigures> head(const Waveform& w, double threshold_v, double best_dwell_us) {
  const double drive_v = w.amplitude_v * std::exp(-std::pow((w.dwell_us - best_dwell_us) / 25.0, 2));
  if (drive_v <= threshold_v) return std::nullopt;
  DropletFigures droplet = kGood;
  droplet.velocity_m_s = 0.06 * (drive_v - threshold_v) + 0.3;
  droplet.satellites = w.fall_us < 3.0 ? 1 : 0;
  return droplet;
}

TEST(TuneWaveform, BringsTheDropletIntoTheBandAtTheBestDwell) {
  for (const double threshold_v : {15.0, 40.0, 80.0})
    for (const double dwell_us : {22.0, 35.0, 61.0}) {
      const TunedWaveform tuned =
          tune_waveform({}, {}, [&](const Waveform& w) { return head(w, threshold_v, dwell_us); });
      ASSERT_EQ(tuned.shortfall, std::nullopt) << threshold_v << " " << *tuned.shortfall;
      EXPECT_NEAR(tuned.droplet->velocity_m_s, 2.0, 0.2);
      EXPECT_EQ(tuned.droplet->satellites, 0);
      EXPECT_GE(tuned.waveform.fall_us, 3.0);
      EXPECT_NEAR(tuned.waveform.dwell_us, dwell_us, 3.0);
      EXPECT_LT(tuned.measurements, 50);
    }
}

/// Drops come at a resonance of this half width alone.
std::optional<DropletFigures> sharp_head(const Waveform& w, double threshold_v, double best_dwell_us,
                                         double half_width_us) {
  const double off = (w.dwell_us - best_dwell_us) / half_width_us;
  const double drive_v = w.amplitude_v / (1.0 + off * off);
  if (drive_v <= threshold_v) return std::nullopt;
  DropletFigures droplet = kGood;
  droplet.velocity_m_s = 0.06 * (drive_v - threshold_v) + 0.3;
  return droplet;
}

TEST(TuneWaveform, FindsAResonanceThatIsNarrowerThanItsSteps) {
  const auto seed = std::random_device{}();
  std::mt19937_64 random(seed);
  std::uniform_real_distribution dwell(6.0, 79.0), threshold(10.0, 80.0);
  for (int draw = 0; draw < 500; ++draw) {
    const double dwell_us = dwell(random), threshold_v = threshold(random);
    const TunedWaveform tuned =
        tune_waveform({}, {}, [&](const Waveform& w) { return sharp_head(w, threshold_v, dwell_us, 3.0); });
    ASSERT_EQ(tuned.shortfall, std::nullopt)
        << *tuned.shortfall << ": seed " << seed << ", " << threshold_v << " V at " << dwell_us << " us";
    EXPECT_NEAR(tuned.waveform.dwell_us, dwell_us, 1.0) << "seed " << seed << ", " << threshold_v << " V";
    EXPECT_LE(tuned.measurements, 60);
  }
}

// What is left for the amplitude isn't spent on the search for a dwell.
TEST(TuneWaveform, LooksBetweenTheDwellsWhileMeasurementsLast) {
  for (const int most : {1, 20, 33, 34, 40, 60, 100, 1000}) {
    std::vector<double> dwells_us;
    const auto tuned = tune_waveform(
        {}, {},
        [&](const Waveform& w) {
          dwells_us.push_back(w.dwell_us);
          return std::optional<DropletFigures>();
        },
        most);
    EXPECT_LE(tuned.measurements, most);
    EXPECT_EQ(tuned.shortfall, "no droplet");
    std::sort(dwells_us.begin(), dwells_us.end());
    EXPECT_GE(dwells_us.front(), 5.0);
    EXPECT_LE(dwells_us.back(), 80.0);
    const auto kinds = std::unique(dwells_us.begin(), dwells_us.end()) - dwells_us.begin();
    // Seven at two amplitudes, then between them down to a 32nd of their distance.
    EXPECT_EQ(kinds, std::min(most, 7) + std::clamp(most - 14 - 20, 0, 6 * 31)) << most;
  }
}

TEST(TuneWaveform, SaysWhatIsShort) {
  const auto none = tune_waveform({}, {}, [](const Waveform&) { return std::nullopt; });
  EXPECT_EQ(none.shortfall, "no droplet");
  const auto slow = tune_waveform({}, {}, [](const Waveform& w) { return head(w, 140.0, 35.0); });
  ASSERT_TRUE(slow.shortfall);
  EXPECT_THAT(*slow.shortfall, StartsWith("velocity 0."));
  const auto oval = tune_waveform({}, {}, [](const Waveform& w) {
    auto droplet = head(w, 40.0, 35.0);
    if (droplet) droplet->roundness = 0.7;
    return droplet;
  });
  ASSERT_TRUE(oval.shortfall);
  EXPECT_THAT(*oval.shortfall, StartsWith("roundness 0.700"));
  EXPECT_EQ(oval.waveform.fall_us, WaveformRange{}.highest.fall_us);
  EXPECT_LE(tune_waveform(
                {}, {}, [](const Waveform& w) { return head(w, 40.0, 35.0); }, 3)
                .measurements,
            3);
}

TEST(TuneWaveform, RefusesWhatCannotBe) {
  WaveformRange range;
  range.lowest.dwell_us = 100.0;
  const auto measure = [](const Waveform&) { return std::optional(kGood); };
  EXPECT_THAT(error_of([&] { tune_waveform(range, {}, measure); }), HasSubstr("dwell [us] 100..80"));
  EXPECT_THAT(error_of([&] { tune_waveform({}, {.slowest_m_s = 3.0}, measure); }),
              HasSubstr("found 3..2.2 m/s"));
}

TEST(FlyBy, CourseIsSmoothInBothAxesAndIsAtTheRowsWhenItFires) {
  FlyByConfig config;
  config.settle_s = 0.01;
  const auto bumps = lattice(6, 4, 0.7);
  const FlyByPlan plan = plan_fly_by(bumps, config);
  for (const FlyByRow& row : plan.rows)
    for (const Trigger& trigger : row.triggers) {
      const FlyByState at = plan.sample(trigger.time_s);
      EXPECT_NEAR(at.x.position_mm, row.x_mm(trigger.time_s), 1e-12);
      EXPECT_NEAR(std::abs(at.x.velocity_mm_s), row.speed_mm_s, 1e-9);
      EXPECT_EQ(at.y.position_mm, row.y_mm);
      EXPECT_EQ(at.y.velocity_mm_s, 0.0);
    }
  EXPECT_EQ(plan.sample(-1.0).x.position_mm, plan.rows.front().from_x_mm);
  EXPECT_EQ(plan.sample(plan.duration_s + 1.0).x.position_mm, plan.rows.back().to_x_mm);
  EXPECT_EQ(plan.sample(plan.duration_s + 1.0).x.velocity_mm_s, 0.0);
  const double step_s = 1e-4;
  FlyByState before = plan.sample(0.0);
  for (double time_s = step_s; time_s < plan.duration_s; time_s += step_s) {
    const FlyByState now = plan.sample(time_s);
    for (const auto& [a, b, limits] :
         {std::tuple(before.x, now.x, config.x), std::tuple(before.y, now.y, config.y)}) {
      ASSERT_LE(std::abs(b.velocity_mm_s), limits.velocity_mm_s * (1.0 + 1e-9));
      ASSERT_LE(std::abs(b.velocity_mm_s - a.velocity_mm_s), 1.01 * limits.acceleration_mm_s2 * step_s);
      ASSERT_LE(std::abs(b.position_mm - a.position_mm), limits.velocity_mm_s * step_s * 1.001);
    }
    before = now;
  }
}

// A droplet leaves so long behind its trigger that the row would else have ended.
TEST(FlyBy, ALateDropletLeavesInTheCruise) {
  const std::vector<Point> bumps{{50, 5}, {51, 5}, {59, 5}, {50, 7}, {60, 7}};
  for (const double latency_s : {5e-5, 1e-3, 5e-3, 2e-2, 0.1})
    for (const double flight_s : {5e-4, 0.1}) {
      FlyByConfig config;
      config.latency_s = latency_s;
      config.flight_s = flight_s;
      const FlyByPlan plan = plan_fly_by(bumps, config);
      for (const double error_mm : landing_errors_mm(plan, bumps, config, 1e-6, flight_s))
        EXPECT_LE(std::abs(error_mm), plan.rows[0].speed_mm_s * 1e-6 + config.encoder_mm)
            << latency_s << " s late, " << flight_s << " s of flight";
    }
}

}  // namespace
}  // namespace meltstage::motion
