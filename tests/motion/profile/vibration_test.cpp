// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/vibration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <set>
#include <string>

#include "tests/motion/profile/profile_checks.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::StartsWith;

const Mode anchor{38.0, 0.05};
const ScurveLimits trapezoid = asymmetric_limits(400, 4000, 4000, 1e9, 1e9);
const ScurveLimits symmetric = asymmetric_limits(400, 4000, 4000, 2e5, 2e5);

/// Amplitude at the end of the motion by a fine Runge-Kutta over the mode's equation.
double integrated_residual_mm(const JerkProfile& profile, const Mode& mode) {
  const double w = 2.0 * std::numbers::pi * mode.frequency_hz, z = mode.damping_ratio;
  double e = 0.0, v = 0.0;
  for (std::size_t i = 0; i < profile.segments; ++i) {
    const MotionState& start = profile.starts[i];
    const int steps = 20 + static_cast<int>(500.0 * mode.frequency_hz * profile.durations_s[i]);
    const double h = profile.durations_s[i] / steps;
    const auto rate = [&](double t, double position, double velocity) {
      return -(start.acceleration_mm_s2 + start.jerk_mm_s3 * t) - 2.0 * z * w * velocity - w * w * position;
    };
    for (int k = 0; k < steps; ++k) {
      const double t = k * h;
      const double a1 = rate(t, e, v);
      const double v2 = v + 0.5 * h * a1, a2 = rate(t + 0.5 * h, e + 0.5 * h * v, v2);
      const double v3 = v + 0.5 * h * a2, a3 = rate(t + 0.5 * h, e + 0.5 * h * v2, v3);
      const double v4 = v + h * a3, a4 = rate(t + h, e + h * v3, v4);
      e += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
      v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
  }
  const double damped = w * std::sqrt(1.0 - z * z);
  return std::hypot(e, (v + z * w * e) / damped);
}

TEST(Residual, IsThatOfAFineRungeKutta) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 300; ++i) {
    const auto spread = [&](double low, double high) {
      return low * std::pow(high / low, static_cast<double>(random() >> 11) * 0x1p-53);
    };
    const ScurveLimits limits = asymmetric_limits(spread(50, 500), spread(500, 8000), spread(500, 8000),
                                                  spread(2e4, 1e6), spread(2e4, 1e6));
    const JerkProfile profile = plan_scurve(limits, spread(0.5, 60));
    const Mode mode{spread(10, 80), 0.2 * spread(1e-3, 1.0)};
    ASSERT_NEAR(residual_mm(profile, mode), integrated_residual_mm(profile, mode), 1e-8) << i;
  }
}

// Golden values of an independent calculation over 20 mm: settling to 10 um behind the move's end.
TEST(Residual, GivesTheGoldenSettlingTimes) {
  const JerkProfile steps = plan_scurve(trapezoid, 20.0), smooth = plan_scurve(symmetric, 20.0);
  EXPECT_NEAR(steps.duration_s, 0.1414, 5e-5);
  EXPECT_NEAR(settling_s(residual_mm(steps, anchor), anchor, 0.01), 0.1991, 5e-5);
  EXPECT_NEAR(smooth.duration_s, 0.1628, 5e-5);
  EXPECT_NEAR(settling_s(residual_mm(smooth, anchor), anchor, 0.01), 0.0437, 1e-4);
}

TEST(Residual, OfAJerkTimeOfOnePeriodIsNoneWithoutDamping) {
  const Mode undamped{38.0, 0.0};
  for (const double distance_mm : {0.5, 5.0, 40.0, 150.0}) {
    const JerkProfile matched = plan_jerk_matched(trapezoid, distance_mm, undamped);
    EXPECT_LT(residual_mm(matched, undamped), 1e-10) << distance_mm;
    EXPECT_GT(residual_mm(matched, {31.0, 0.0}), 1e-4) << distance_mm;
    EXPECT_LE(violations_of(matched, trapezoid, {}, distance_mm, 400.0).limits, 1e-9) << distance_mm;
  }
}

TEST(Residual, OfALowJerkLimitTakesAWholeNumberOfPeriods) {
  const Mode undamped{38.0, 0.0};
  const ScurveLimits slow = asymmetric_limits(400, 4000, 3000, 6e4, 9e4);  // 67 and 33 ms: 3 and 2 periods
  const JerkProfile matched = plan_jerk_matched(slow, 190.0, undamped);
  EXPECT_NEAR(matched.durations_s[0], 3.0 / 38.0, 1e-12);
  EXPECT_NEAR(matched.durations_s[matched.segments - 1], 2.0 / 38.0, 1e-12);
  EXPECT_LT(residual_mm(matched, undamped), 1e-10);
}

// V is reached before A: the acceleration is as low as one period allows.
TEST(Residual, OfASlowMoveTakesNoMorePeriodsThanItNeeds) {
  const Mode undamped{38.0, 0.0};
  const double period_s = 1.0 / 38.0;
  for (const double speed_mm_s : {1.0, 10.0, 50.0, 105.0, 105.4}) {
    const ScurveLimits slow = asymmetric_limits(speed_mm_s, 4000, 4000, 1e6, 1e6);
    const JerkProfile matched = plan_jerk_matched(slow, 100.0, undamped);
    EXPECT_NEAR(matched.durations_s[0], period_s, 1e-9) << speed_mm_s;
    EXPECT_NEAR(matched.duration_s, 100.0 / speed_mm_s + 2.0 * period_s, 1e-3) << speed_mm_s;
    EXPECT_LT(residual_mm(matched, undamped), 1e-10) << speed_mm_s;
    EXPECT_LE(violations_of(matched, slow, {}, 100.0, speed_mm_s).limits, 1e-9) << speed_mm_s;
  }
}

// Shorter moves, and jerk limits that want several periods: nothing is left, no limit is exceeded, and a
// higher limit or a shorter way never takes longer.
TEST(Residual, OfAJerkMatchedMoveIsNoneUnderAnyLimitsAndItsTimeGrowsWithTheWay) {
  std::mt19937_64 random(5);
  const auto spread = [&](double low, double high) {
    return low * std::pow(high / low, static_cast<double>(random() >> 11) * 0x1p-53);
  };
  for (int i = 0; i < 2000; ++i) {
    const Mode undamped{spread(5, 100), 0.0};
    const ScurveLimits limits = asymmetric_limits(spread(1, 500), spread(100, 8000), spread(100, 8000),
                                                  spread(1e4, 1e7), spread(1e4, 1e7));
    ScurveLimits faster = limits;
    faster.velocity_mm_s *= spread(1.0, 2.0);
    double before_s = 0.0;
    for (double distance_mm = spread(0.01, 1.0); distance_mm < 200.0; distance_mm *= spread(1.0, 4.0)) {
      const JerkProfile matched = plan_jerk_matched(limits, distance_mm, undamped);
      const double scale_mm = limits.velocity_mm_s / (2.0 * std::numbers::pi * undamped.frequency_hz);
      ASSERT_LT(residual_mm(matched, undamped), 1e-7 * scale_mm) << i << ", " << distance_mm << " mm";
      ASSERT_LE(violations_of(matched, limits, {}, distance_mm, limits.velocity_mm_s).limits, 1e-9) << i;
      ASSERT_GE(matched.duration_s, before_s * (1.0 - 1e-9)) << i << ", " << distance_mm << " mm";
      ASSERT_LE(plan_jerk_matched(faster, distance_mm, undamped).duration_s,
                matched.duration_s * (1.0 + 1e-9))
          << i << ", " << distance_mm << " mm";
      before_s = matched.duration_s;
    }
  }
}

TEST(Residual, OfAJerkThatTakesJustOnePeriodTakesOne) {
  for (int i = 0; i < 1000; ++i) {
    const Mode undamped{7.0 + 0.1 * i, 0.0};
    const double jerk = 4000.0 / (1.0 / undamped.frequency_hz);
    const JerkProfile matched =
        plan_jerk_matched(asymmetric_limits(400, 4000, 4000, jerk, jerk), 190.0, undamped);
    if (4000.0 / undamped.frequency_hz > 300.0) continue;  // A isn't reached
    ASSERT_NEAR(matched.durations_s[0], 1.0 / undamped.frequency_hz, 1e-9) << undamped.frequency_hz;
  }
}

TEST(Settling, IsNoneWithinTheToleranceAndNeverWithoutDamping) {
  EXPECT_EQ(settling_s(0.01, anchor, 0.01), 0.0);
  EXPECT_EQ(settling_s(0.02, {38.0, 0.0}, 0.01), INFINITY);
  const double decay = 0.05 * 2.0 * std::numbers::pi * 38.0;
  EXPECT_NEAR(settling_s(0.01 * std::exp(1.0), anchor, 0.01), 1.0 / decay, 1e-15);
}

TEST(Band, CoversBothEndsAndTheMiddle) {
  const std::vector<Mode> modes = modes_of({anchor, 0.1});
  EXPECT_NEAR(modes.front().frequency_hz, 34.2, 1e-12);
  EXPECT_NEAR(modes[modes.size() / 2].frequency_hz, 38.0, 1e-12);
  EXPECT_NEAR(modes.back().frequency_hz, 41.8, 1e-12);
  EXPECT_EQ(modes_of({anchor, 0.0}).size(), 1U);
}

// ---- Morlet and Taguchi ----

/// (15) with (17) by a fine midpoint rule.
double wavelet(const JerkProfile& profile, const Mode& mode, double omega0, double at_s) {
  const double scale_s = omega0 / (2.0 * std::numbers::pi * mode.frequency_hz);
  std::complex<double> sum = 0.0;
  constexpr int kSteps = 200'000;
  const double h = profile.duration_s / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double t = (i + 0.5) * h, x = (t - at_s) / scale_s;
    sum += profile.sample(t).velocity_mm_s * std::exp(-0.5 * x * x) * std::polar(1.0, -omega0 * x);
  }
  return std::abs(sum) * h * std::pow(std::numbers::pi, -0.25) / std::sqrt(scale_s);
}

TEST(Morlet, IsTheSumOfTheWaveletsAtStartAndEnd) {
  const JerkProfile profile = plan_scurve(asymmetric_limits(400, 4000, 3000, 2e5, 5e4), 12.0);
  const MorletWindow window{.cycle_s = 1e-4, .cycles = 3, .omega0 = 6.0};
  double expected = 0.0;
  for (int i = 0; i < 3; ++i)
    expected += wavelet(profile, anchor, 6.0, i * 1e-4) +
                wavelet(profile, anchor, 6.0, profile.duration_s - i * 1e-4);
  EXPECT_NEAR(morlet_energy(profile, anchor, window), expected, 1e-4 * expected);
}

TEST(Morlet, IsLessForAGentlerProfile) {
  EXPECT_LT(morlet_energy(plan_scurve(asymmetric_limits(400, 4000, 4000, 1e5, 5e4), 20.0), anchor, {}),
            0.5 * morlet_energy(plan_scurve(trapezoid, 20.0), anchor, {}));
}

const TaguchiLevels levels{{2000, 2500, 3000, 3500, 4000},
                           {2000, 2400, 2800, 3200, 3600},
                           {5e4, 1e5, 1.5e5, 2e5, 2.5e5},
                           {2.5e4, 5e4, 7.5e4, 1e5, 1.25e5}};

TEST(Taguchi, IsOrthogonal) {
  const std::vector<TaguchiRow> rows = taguchi_rows(levels, 400.0, 20.0, anchor, {});
  ASSERT_EQ(rows.size(), 25U);
  const std::array factors = {&ScurveLimits::acceleration_mm_s2, &ScurveLimits::deceleration_mm_s2,
                              &ScurveLimits::jerk1_mm_s3, &ScurveLimits::jerk5_mm_s3};
  for (const auto first : factors)
    for (const auto second : factors) {
      if (first == second) continue;
      std::set<std::pair<double, double>> pairs;
      for (const TaguchiRow& row : rows) pairs.emplace(row.limits.*first, row.limits.*second);
      EXPECT_EQ(pairs.size(), 25U);
    }
}

TEST(Taguchi, TakesTheFastestRowWithinTheEnergy) {
  const std::vector<TaguchiRow> rows = taguchi_rows(levels, 400.0, 20.0, anchor, {});
  const double limit = energy_quantile(rows, 0.2);
  int within = 0;
  for (const TaguchiRow& row : rows) within += row.energy <= limit;
  EXPECT_EQ(within, 5);
  const auto best = best_row(rows, limit);
  ASSERT_TRUE(best.has_value());
  for (const TaguchiRow& row : rows) EXPECT_TRUE(row.energy > limit || row.duration_s >= best->duration_s);
  EXPECT_FALSE(best_row(rows, 0.0).has_value());
}

// ---- optimum ----

TEST(Optimum, KeepsTheEnergyBoundAndBeatsEveryTaguchiRow) {
  const std::vector<TaguchiRow> rows = taguchi_rows(levels, 400.0, 20.0, anchor, {});
  const double limit = energy_quantile(rows, 0.2);
  const OptimumSearch search{.lowest = asymmetric_limits(400, 2000, 2000, 5e4, 2.5e4),
                             .highest = asymmetric_limits(400, 4000, 3600, 2.5e5, 1.25e5),
                             .evaluations = 1500};
  const auto energy = [](const JerkProfile& profile) { return morlet_energy(profile, anchor, {}); };
  const auto best = optimum_profile(search, 20.0, energy, limit);
  ASSERT_TRUE(best.has_value());
  EXPECT_LE(energy(*best), limit);
  EXPECT_LT(best->duration_s, best_row(rows, limit)->duration_s);
  EXPECT_LE(violations_of(JerkProfile(*best), search.highest, {}, 20.0, 400.0).limits, 1e-9);
}

TEST(Optimum, UnderTheExactResidualSettlesAtOnceOverTheBand) {
  const ModeBand band{anchor, 0.1};
  const OptimumSearch search{.lowest = asymmetric_limits(400, 1500, 1500, 5e4, 5e4),
                             .highest = asymmetric_limits(400, 4000, 4000, 1e6, 1e6)};
  const auto best = optimum_profile(
      search, 20.0, [&](const JerkProfile& profile) { return worst_residual_mm(profile, band); }, 0.01);
  ASSERT_TRUE(best.has_value());
  EXPECT_LE(worst_residual_mm(*best, band), 0.01);
  EXPECT_LT(best->duration_s, worst_settled_s(plan_scurve(symmetric, 20.0), band, 0.01));
}

TEST(Optimum, SaysSoWhenNothingIsWithinTheBound) {
  const OptimumSearch search{.lowest = asymmetric_limits(400, 3900, 3900, 1e6, 1e6),
                             .highest = asymmetric_limits(400, 4000, 4000, 1.1e6, 1.1e6),
                             .evaluations = 100};
  EXPECT_FALSE(
      optimum_profile(
          search, 20.0, [](const JerkProfile& profile) { return residual_mm(profile, anchor); }, 1e-9)
          .has_value());
}

// What isn't a number or a mode must not look like a calm machine.
TEST(Vibration, OfNoModeToleranceOrWindowIsRefused) {
  const JerkProfile profile = plan_scurve(symmetric, 20.0);
  EXPECT_THAT(error_of([&] { residual_mm(profile, {0.0, 0.0}); }), StartsWith("mode: found 0 Hz"));
  EXPECT_THAT(error_of([&] { residual_mm(profile, {38.0, NAN}); }), StartsWith("mode: found damping ratio"));
  EXPECT_THAT(error_of([&] { worst_residual_mm(profile, {anchor, NAN}); }), StartsWith("mode: found spread"));
  EXPECT_EQ(error_of([&] { settling_s(0.1, anchor, -1.0); }),
            "tolerance: found -1 mm, expected a finite number above 0");
  for (const double tolerance_mm : {0.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THAT(error_of([&] { settling_s(0.1, anchor, tolerance_mm); }), StartsWith("tolerance: found"));
    EXPECT_THAT(error_of([&] {
                  worst_settled_s(profile, {anchor, 0.1}, tolerance_mm);
                }),
                StartsWith("tolerance: found"));
  }
  EXPECT_EQ(error_of([&] { settling_s(NAN, anchor, 0.01); }),
            "residual: found nan mm, expected a finite number from 0");
  EXPECT_THAT(error_of([&] { settling_s(-0.1, anchor, 0.01); }), StartsWith("residual: found -0.1 mm"));
  EXPECT_THAT(error_of([&] { settling_s(0.1, {-38.0, 0.05}, 0.01); }), StartsWith("mode: found -38 Hz"));

  for (const int cycles : {0, -5})
    EXPECT_THAT(error_of([&] {
                  morlet_energy(profile, anchor, {1e-3, cycles, 6.0});
                }),
                StartsWith("wavelet: found " + std::to_string(cycles) + " cycles"));
  for (const double cycle_s : {0.0, -1e-3, std::nan("")})
    EXPECT_THAT(error_of([&] {
                  morlet_energy(profile, anchor, {cycle_s, 26, 6.0});
                }),
                StartsWith("wavelet: cycle: found"));
  EXPECT_THAT(error_of([&] {
                morlet_energy(profile, anchor, {1e-15, 26, 6.0});
              }),
              StartsWith("wavelet: cycle: found 1e-15 s, expected a number from 1e-12"));
  for (const double omega0 : {1.0, std::nan(""), HUGE_VAL})
    EXPECT_THAT(error_of([&] {
                  morlet_energy(profile, anchor, {1e-3, 26, omega0});
                }),
                StartsWith("wavelet: found omega0"));

  const std::vector<TaguchiRow> rows = taguchi_rows(levels, 400.0, 20.0, anchor, {});
  EXPECT_THAT(error_of([&] {
                taguchi_rows(levels, 400.0, 20.0, anchor, {0.0, 26, 6.0});
              }),
              StartsWith("wavelet: cycle: found 0 s"));
  for (const double share : {2.0, -1.0, std::nan("")})
    EXPECT_THAT(error_of([&] { energy_quantile(rows, share); }), StartsWith("energy: found a share of"));
  EXPECT_THAT(error_of([&] { best_row(rows, NAN); }), StartsWith("energy: found a limit of nan"));
  const OptimumSearch search{.lowest = asymmetric_limits(400, 1500, 1500, 5e4, 5e4),
                             .highest = asymmetric_limits(400, 4000, 4000, 1e6, 1e6)};
  const auto measure = [](const JerkProfile& of) { return residual_mm(of, anchor); };
  for (const double bound : {0.0, -1.0, std::nan("")})
    EXPECT_THAT(error_of([&] { optimum_profile(search, 20.0, measure, bound); }),
                StartsWith("optimum: found a bound of"));
}

TEST(Vibration, RefusesWhatCannotBe) {
  EXPECT_THAT(error_of([] { check_mode({0.0, 0.1}); }), StartsWith("mode: found 0 Hz"));
  EXPECT_THAT(error_of([] { check_mode({NAN, 0.1}); }), StartsWith("mode: found nan Hz"));
  EXPECT_THAT(error_of([] { check_mode({38.0, 1.0}); }), StartsWith("mode: found damping ratio 1"));
  EXPECT_THAT(error_of([] { modes_of({anchor, -0.1}); }), StartsWith("mode: found spread -0.1"));
  EXPECT_THAT(error_of([] {
                optimum_profile(
                    {.lowest = trapezoid, .highest = symmetric}, 1.0, [](const JerkProfile&) { return 0.0; },
                    1.0);
              }),
              StartsWith("optimum: found lowest limit"));
}

}  // namespace
}  // namespace meltstage::motion
