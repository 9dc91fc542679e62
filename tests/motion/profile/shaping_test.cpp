// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/shaping.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <string>

#include "tests/motion/profile/profile_checks.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::StartsWith;

const Mode anchor{38.0, 0.05};
const ScurveLimits trapezoid = asymmetric_limits(400, 4000, 4000, 1e9, 1e9);
const ScurveLimits gentle_stop = asymmetric_limits(400, 4000, 3000, 4e5, 1e5);

TEST(Shapers, HavePositiveAmplitudesThatSumToOne) {
  for (const Shaper& shaper :
       {zv_shaper(anchor), zvd_shaper(anchor), mzv_shaper(anchor), ei_shaper(anchor), Shaper{}}) {
    EXPECT_NEAR(std::accumulate(shaper.amplitudes.begin(), shaper.amplitudes.end(), 0.0), 1.0, 1e-15);
    for (std::size_t i = 0; i < shaper.impulses; ++i) EXPECT_GT(shaper.amplitudes[i], 0.0);
    EXPECT_EQ(shaper.times_s[0], 0.0);
  }
}

TEST(Shapers, ZvAndZvdLeaveNothingAtTheirMode) {
  EXPECT_LT(vibration_share(zv_shaper(anchor), anchor), 1e-14);
  EXPECT_LT(vibration_share(zvd_shaper(anchor), anchor), 1e-14);
  // Off the mode, ZV's rest grows with the error, ZVD's with its square.
  const double zv = vibration_share(zv_shaper(anchor), {38.4, 0.05});
  const double zvd = vibration_share(zvd_shaper(anchor), {38.4, 0.05});
  EXPECT_NEAR(vibration_share(zv_shaper(anchor), {38.8, 0.05}) / zv, 2.0, 0.05);
  EXPECT_NEAR(vibration_share(zvd_shaper(anchor), {38.8, 0.05}) / zvd, 4.0, 0.2);
}

TEST(Shapers, EiLeavesWhatItTolerates) {
  const Mode undamped{38.0, 0.0};
  EXPECT_NEAR(vibration_share(ei_shaper(undamped, 0.05), undamped), 0.05, 1e-12);
  EXPECT_LT(vibration_share(ei_shaper(undamped, 0.05), {36.0, 0.0}), 0.05);
}

TEST(Shapers, EiLeavesLessWithDamping) {
  for (const double damping : {0.01, 0.05, 0.2, 0.5}) {
    const Mode mode{38.0, damping};
    EXPECT_LT(vibration_share(ei_shaper(mode, 0.05), mode), 0.05) << damping;
  }
}

TEST(Shaped, IsTheSumOfDelayedMotions) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 500; ++i) {
    const RandomTask task = random_task(random);
    const JerkProfile base = plan_scurve(task.limits, task.distance_mm);
    const Mode mode{1.0 / base.duration_s * (1 + static_cast<double>(i % 7)), 0.05};
    for (const Shaper& shaper : {zv_shaper(mode), zvd_shaper(mode)}) {
      const JerkProfile sum = shaped(base, shaper);
      ASSERT_DOUBLE_EQ(sum.duration_s, base.duration_s + shaper.duration_s());
      for (int k = 0; k <= 40; ++k) {
        const double time_s = sum.duration_s * k / 40.0;
        double expected_mm = 0.0;
        for (std::size_t n = 0; n < shaper.impulses; ++n)
          expected_mm += shaper.amplitudes[n] * base.sample(time_s - shaper.times_s[n]).position_mm;
        ASSERT_NEAR(sum.sample(time_s).position_mm, expected_mm, 1e-9 * task.distance_mm) << i;
      }
      EXPECT_EQ(sum.end.position_mm, task.distance_mm);
    }
  }
}

TEST(Shaped, KeepsTheLimitsWhereAccelerationAndDecelerationAreAlike) {
  const ScurveLimits limits = asymmetric_limits(400, 4000, 4000, 2e5, 2e5);
  for (const double distance_mm : {0.3, 3.0, 30.0, 150.0}) {
    const JerkProfile sum = shaped(plan_scurve(limits, distance_mm), zvd_shaper(anchor));
    const Violations worst = violations_of(sum, limits, {}, distance_mm, 400.0);
    EXPECT_LE(worst.limits, 1e-9);
    EXPECT_LE(worst.continuity, 1e-9);
    EXPECT_LE(worst.end, 1e-9);
  }
}

TEST(Shaped, LeavesTheResidualTimesTheShare) {
  const JerkProfile base = plan_scurve(gentle_stop, 20.0);
  for (const double frequency_hz : {34.0, 38.0, 40.5}) {
    const Mode mode{frequency_hz, 0.05};
    const Shaper shaper = ei_shaper(anchor);
    EXPECT_NEAR(residual_mm(shaped(base, shaper), mode),
                residual_mm(base, mode) * vibration_share(shaper, mode), 1e-12);
  }
}

TEST(Shaped, RefusesMoreSegmentsThanAMotionHolds) {
  const JerkProfile twice = shaped(plan_scurve(gentle_stop, 200.0), zvd_shaper(anchor));
  EXPECT_THAT(error_of([&] { shaped(twice, zvd_shaper({11.0, 0.1})); }), StartsWith("shaper: 3 impulses on"));
}

TEST(Shaped, RefusesAShaperThatIsNone) {
  const JerkProfile profile = plan_scurve(gentle_stop, 20.0);
  const auto message = [&](const Shaper& shaper) {
    const std::string of_motion = error_of([&] { shaped(profile, shaper); });
    EXPECT_EQ(of_motion, error_of([&] { vibration_share(shaper, anchor); }));
    return of_motion;
  };
  EXPECT_EQ(message({2, {0.7, 0.7}, {0.0, 0.01}}),
            "shaper: found amplitudes that sum to 1.4, expected numbers from 0 that sum to 1");
  EXPECT_THAT(message({1, {0.5}, {}}), StartsWith("shaper: found amplitudes that sum to 0.5"));
  EXPECT_THAT(message({2, {1.5, -0.5}, {0.0, 0.01}}), StartsWith("shaper: found amplitude -0.5"));
  EXPECT_THAT(message({2, {NAN, 0.5}, {0.0, 0.01}}), StartsWith("shaper: found amplitude nan"));
  EXPECT_THAT(message({0, {1.0}, {}}), StartsWith("shaper: found 0 impulses, expected 1 to 4"));
  EXPECT_THAT(message({5, {1.0}, {}}), StartsWith("shaper: found 5 impulses, expected 1 to 4"));
  EXPECT_THAT(message({2, {0.5, 0.5}, {0.01, 0.02}}), StartsWith("shaper: found impulse 1 at 0.01 s"));
  EXPECT_THAT(message({3, {0.5, 0.3, 0.2}, {0.0, 0.02, 0.01}}),
              StartsWith("shaper: found impulse 3 at 0.01 s"));
  EXPECT_THAT(message({2, {0.5, 0.5}, {0.0, HUGE_VAL}}), StartsWith("shaper: found impulse 2 at inf s"));
  EXPECT_THAT(error_of([] { vibration_share({}, {0.0, 0.05}); }), StartsWith("mode: found 0 Hz"));
}

TEST(Shaped, RefusesAMotionThatDoesNotEndAtRest) {
  EXPECT_THAT(error_of([&] { shaped(plan_scurve(gentle_stop, 50.0, 0.0, 10.0), zv_shaper(anchor)); }),
              StartsWith("shaper: found a motion from 0 to 10 mm/s"));
}

// ---- the shortest shaper ----

TEST(ShortestShaper, KeepsTheToleranceOverTheWholeBandAndIsNoLongerThanZvd) {
  const ModeBand band{anchor, 0.1};
  for (int i = 0; i < 40; ++i) {
    const double distance_mm = std::pow(60.0, i / 39.0);
    const JerkProfile base = plan_scurve(trapezoid, distance_mm);
    const Shaper shaper = shortest_shaper(base, band, 0.01);
    EXPECT_LE(shaper.duration_s(), zvd_shaper(anchor).duration_s() * (1.0 + 1e-9)) << distance_mm;
    const JerkProfile quiet = shaped(base, shaper);
    for (int k = 0; k <= 400; ++k) {  // finer than the search looks
      const Mode mode{38.0 * (0.9 + 0.2 * k / 400.0), 0.05};
      ASSERT_LE(residual_mm(quiet, mode), 0.01) << distance_mm << " mm, " << mode.frequency_hz << " Hz";
    }
  }
}

// A long move has narrow lobes over the frequency: 21 frequencies step over them.
TEST(ShortestShaper, KeepsTheToleranceBetweenTheFrequenciesOfALongMove) {
  int kept = 0;
  for (const double distance_mm : {10.0, 41.5, 71.5, 150.0})
    for (const double damping : {0.01, 0.02, 0.05})
      for (const double spread : {0.1, 0.3}) {
        const ModeBand band{{38.0, damping}, spread};
        constexpr double kTolerance_mm = 0.005;
        const JerkProfile quiet = plan_quiet_move(asymmetric_limits(100.0, 4000.0, 3000.0, 2e5, 1e5),
                                                  distance_mm, band, kTolerance_mm);
        double worst_mm = 0.0;
        for (double hz = 38.0 * (1.0 - spread); hz <= 38.0 * (1.0 + spread); hz += 0.01)
          worst_mm = std::max(worst_mm, residual_mm(quiet, {hz, damping}));
        EXPECT_NEAR(worst_residual_mm(quiet, band), worst_mm, 1e-3 * worst_mm)
            << distance_mm << " " << damping << " " << spread;
        kept += worst_mm < kTolerance_mm * 1.0001 ? 1 : 0;
      }
  EXPECT_GE(kept, 22);  // of 24; a short move in a wide band may have no shaper that suffices
}

TEST(ShortestShaper, IsNoneWhereTheMotionIsQuietByItself) {
  const JerkProfile slow = plan_scurve(asymmetric_limits(400, 200, 200, 2e3, 2e3), 20.0);
  EXPECT_EQ(shortest_shaper(slow, {anchor, 0.1}, 0.01).impulses, 1U);
}

TEST(ShortestShaper, SettlesAsSoonAsItCanWhereNothingSuffices) {
  const ModeBand wide{anchor, 0.5};
  const JerkProfile base = plan_scurve(trapezoid, 20.0);
  const JerkProfile quiet = shaped(base, shortest_shaper(base, wide, 1e-4));
  EXPECT_LT(worst_settled_s(quiet, wide, 1e-4), worst_settled_s(base, wide, 1e-4));
}

TEST(ShortestShaper, RefusesAToleranceOfNothing) {
  EXPECT_THAT(error_of([] { plan_quiet_move(gentle_stop, 10.0, {}, 0.0); }),
              StartsWith("tolerance: found 0 mm"));
}

TEST(ShortestShaper, LeavesNoMoreThanAskedWhereZvdDoes) {
  const ScurveLimits limits;
  std::size_t met = 0;
  for (const Mode mode : {Mode{15.0, 0.1}, Mode{38.0, 0.05}, Mode{60.0, 0.2}})
    for (const double tolerance_mm : {0.001, 0.01, 0.05})
      for (double distance_mm = 0.05; distance_mm < 200.0; distance_mm *= 1.1) {
        const ModeBand band{mode, 0.1};
        const double zvd_mm =
            worst_residual_mm(shaped(plan_scurve(limits, distance_mm), zvd_shaper(mode)), band);
        if (zvd_mm > tolerance_mm) continue;
        ++met;
        const JerkProfile quiet = plan_quiet_move(limits, distance_mm, band, tolerance_mm);
        EXPECT_LE(worst_residual_mm(quiet, band), tolerance_mm * (1.0 + 1e-9))
            << distance_mm << " mm at " << mode.frequency_hz << " Hz, " << tolerance_mm << " mm";
      }
  EXPECT_GT(met, 200U);
}

// None of the candidates settles, and the empty one, tried first, was taken.
TEST(ShortestShaper, WithoutDampingLeavesLeastWhereTheToleranceIsTooSmall) {
  const ScurveLimits limits = asymmetric_limits(100.0, 1000.0, 1000.0, 5e4, 5e4);
  const JerkProfile profile(plan_scurve(limits, 10.0));
  for (const double spread : {0.2, 0.3}) {
    const ModeBand band{{38.0, 0.0}, spread};
    const double left_mm = worst_residual_mm(shaped(profile, shortest_shaper(profile, band, 0.001)), band);
    EXPECT_LE(left_mm, worst_residual_mm(shaped(profile, zvd_shaper(band.nominal)), band) * 1.001);
    EXPECT_LT(left_mm, 0.2 * worst_residual_mm(profile, band));
  }
}

}  // namespace
}  // namespace meltstage::motion
