// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <string>

#include "tests/motion/profile/profile_cases.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// ---- golden values: durations of independent planners, see docs of each case ----

struct Golden {
  const char* name;
  ScurveLimits limits;
  double distance_mm, start_velocity, end_velocity, duration_ms;
};
class GoldenDurations : public ::testing::TestWithParam<Golden> {};

TEST_P(GoldenDurations, AreMet) {
  const Golden& golden = GetParam();
  const Scurve curve =
      plan_scurve(golden.limits, golden.distance_mm, golden.start_velocity, golden.end_velocity);
  EXPECT_NEAR(curve.duration_s * 1e3, golden.duration_ms, 6e-7);
}

const ScurveLimits symmetric = asymmetric_limits(400, 4000, 4000, 2e5, 2e5);
const ScurveLimits gentle_stop = asymmetric_limits(400, 4000, 3000, 4e5, 1e5);
const ScurveLimits four_jerks = {400, 4000, 3000, 4e5, 2e5, 1e5, 5e4};

INSTANTIATE_TEST_SUITE_P(Symmetric, GoldenDurations,  // equal to ruckig 0.17.3
                         ::testing::Values(Golden{"neither_a_nor_d", symmetric, 0.5, 0, 0, 43.088694},
                                           Golden{"one_millimetre", symmetric, 1, 0, 0, 54.288352},
                                           Golden{"two_millimetres", symmetric, 2, 0, 0, 68.399038},
                                           Golden{"a_and_d", symmetric, 20, 0, 0, 162.828569},
                                           Golden{"all_seven", symmetric, 100, 0, 0, 370.0}),
                         [](const auto& test) { return test.param.name; });
INSTANTIATE_TEST_SUITE_P(
    Asymmetric, GoldenDurations,
    ::testing::Values(Golden{"neither_a_nor_d", gentle_stop, 0.5, 0, 0, 44.814047},
                      Golden{"a_and_d_short", gentle_stop, 5, 0, 0, 98.951462},
                      Golden{"a_and_d", gentle_stop, 50, 0, 0, 262.349610},
                      Golden{"all_seven", gentle_stop, 200, 0, 0, 636.666667},
                      Golden{"d_alone", asymmetric_limits(400, 4000, 1000, 2e5, 2e5), 3, 0, 0, 99.797720},
                      Golden{"four_jerks_and_speeds", four_jerks, 50, 10, 5, 272.512931}),
    [](const auto& test) { return test.param.name; });

TEST(Scurve, FourJerksReachTheGoldenPeakSpeed) {
  EXPECT_NEAR(plan_scurve(four_jerks, 50, 10, 5).starts[3].velocity_mm_s, 371.450738, 1e-6);
}

// ---- segments ----

TEST(Scurve, HasTheSegmentsOfThePaperWhenNothingIsDegenerate) {
  // T1 = T3 = A/Ja, T2 = Vc/A - A/Ja, T5 = T7 = D/Jd, T6 = Vc/D - D/Jd, T4 = (S - Sacc - Sdec)/Vc.
  const Scurve curve = plan_scurve(gentle_stop, 200);
  const std::array expected = {0.01, 0.09, 0.01, 0.0, 0.03, 400.0 / 3000 - 0.03, 0.03};
  for (const std::size_t i : {0, 1, 2, 4, 5, 6})
    EXPECT_NEAR(curve.durations_s[i], expected[i], 1e-15) << "T" << i + 1;
  const double ramps_mm = 200.0 * (0.11 + 0.03 + 400.0 / 3000);
  EXPECT_NEAR(curve.durations_s[3], (200.0 - ramps_mm) / 400.0, 1e-15);
}

TEST(Scurve, LeavesOutConstantAccelerationOnAShortMove) {
  const Scurve curve = plan_scurve(symmetric, 0.5);
  EXPECT_EQ(curve.durations_s[1], 0.0);
  EXPECT_NEAR(curve.durations_s[3], 0.0, 1e-15);
  EXPECT_EQ(curve.durations_s[5], 0.0);
}

TEST(Scurve, OfNoDistanceTakesNoTime) {
  const Scurve curve = plan_scurve(symmetric, 0.0);
  EXPECT_EQ(curve.duration_s, 0.0);
  EXPECT_EQ(curve.sample(1.0).position_mm, 0.0);
}

TEST(Scurve, AtConstantSpeedIsCruiseOnly) {
  const Scurve curve = plan_scurve(symmetric, 8.0, 400.0, 400.0);
  EXPECT_NEAR(curve.duration_s, 0.02, 1e-15);
  EXPECT_NEAR(curve.durations_s[3], 0.02, 1e-15);
}

TEST(Scurve, StandsStillBeforeAndAfter) {
  const Scurve curve = plan_scurve(symmetric, 3.0);
  EXPECT_EQ(curve.sample(-1.0).position_mm, 0.0);
  EXPECT_EQ(curve.sample(curve.duration_s).position_mm, 3.0);
  EXPECT_EQ(curve.sample(1e9).position_mm, 3.0);
  EXPECT_EQ(curve.sample(1e9).velocity_mm_s, 0.0);
}

TEST(Scurve, TimeAtIsTheInverseOfTheSample) {
  const Scurve curve = plan_scurve(gentle_stop, 7.0);
  for (int i = 1; i < 1000; ++i) {
    const double position_mm = 7.0 * i / 1000.0;
    EXPECT_NEAR(curve.sample(curve.time_at(position_mm)).position_mm, position_mm, 1e-12);
  }
  EXPECT_EQ(curve.time_at(-1.0), 0.0);
  EXPECT_EQ(curve.time_at(8.0), curve.duration_s);
  EXPECT_EQ(curve.time_at(INFINITY), curve.duration_s);
  const char* const said = "profile: found position nan mm, expected a number";
  EXPECT_EQ(error_of([&] { curve.time_at(NAN); }), said);
  EXPECT_EQ(error_of([&] { JerkProfile(curve).time_at(NAN); }), said);
  EXPECT_EQ(error_of([&] { JerkProfile().time_at(NAN); }), said);
}

// ---- properties ----

TEST(ScurveProperty, TwoHundredThousandProfilesKeepLimitsContinuityAndEnd) {
  std::mt19937_64 random(20240901);
  ScurveSeen seen;
  for (int i = 0; i < 200'000; ++i) ASSERT_EQ(scurve_case(random, seen), "") << "case " << i;
  for (const std::uint64_t count :
       {seen.cruise, seen.no_cruise, seen.hold_both, seen.hold_one, seen.hold_none, seen.refused})
    EXPECT_GT(count, 1000U);
}

TEST(ScurveProperty, SymmetricProfilesLastAsLongAsTheTextbookOptimum) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 100'000; ++i) ASSERT_EQ(symmetric_case(random), "") << "case " << i;
}

TEST(ScurveProperty, RoundedToCyclesKeepsLimitsAndDistance) {
  std::mt19937_64 random(6);
  for (int i = 0; i < 50'000; ++i) ASSERT_EQ(rounded_case(random), "") << "case " << i;
}

TEST(MoveProperty, SynchronizedAxesKeepTheirLimitsAndArriveTogether) {
  std::mt19937_64 random(8);
  for (int i = 0; i < 50'000; ++i) ASSERT_EQ(synchronized_case(random), "") << "case " << i;
}

// ---- the checks themselves see what is wrong ----

TEST(ProfileChecks, SeeASpeedAnAccelerationAndAJerkAboveTheLimit) {
  const ScurveLimits limits = asymmetric_limits(400, 4000, 3000, 4e5, 1e5);
  const Scurve curve = plan_scurve(limits, 200.0);
  EXPECT_LE(violations_of(curve, limits, 200.0, 0.0, 0.0).limits, 1e-12);
  for (double ScurveLimits::*limit :
       {&ScurveLimits::velocity_mm_s, &ScurveLimits::acceleration_mm_s2, &ScurveLimits::deceleration_mm_s2,
        &ScurveLimits::jerk1_mm_s3, &ScurveLimits::jerk3_mm_s3, &ScurveLimits::jerk5_mm_s3,
        &ScurveLimits::jerk7_mm_s3}) {
    ScurveLimits lower = limits;
    lower.*limit *= 1.0 - 1e-9;
    EXPECT_GT(violations_of(curve, lower, 200.0, 0.0, 0.0).limits, 5e-10);
    EXPECT_GT(violations_of(JerkProfile(curve), lower, {}, 200.0, lower.velocity_mm_s).limits, 5e-10);
  }
}

TEST(ProfileChecks, SeeAJumpAndAWrongEnd) {
  const ScurveLimits limits = asymmetric_limits(400, 4000, 3000, 4e5, 1e5);
  const Scurve good = plan_scurve(limits, 200.0);
  Scurve jump = good, wrong_end = good;
  jump.starts[3].velocity_mm_s *= 1.0 + 1e-8;
  EXPECT_GT(violations_of(jump, limits, 200.0, 0.0, 0.0).continuity, 1e-9);
  EXPECT_GT(violations_of(JerkProfile(jump), limits, {}, 200.0, 401.0).continuity, 1e-9);
  wrong_end.end.position_mm += 1e-6;
  EXPECT_GT(violations_of(wrong_end, limits, 200.0, 0.0, 0.0).end, 1e-9);
  EXPECT_GT(violations_of(JerkProfile(wrong_end), limits, {}, 200.0, 400.0).end, 1e-9);
}

RC_GTEST_PROP(ScurveProperty, ReversedInTimeTakesAsLong, ()) {
  std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
  const auto [limits, distance_mm, start_velocity, end_velocity] = random_task(random);
  const ScurveLimits reversed = {limits.velocity_mm_s, limits.deceleration_mm_s2, limits.acceleration_mm_s2,
                                 limits.jerk7_mm_s3,   limits.jerk5_mm_s3,        limits.jerk3_mm_s3,
                                 limits.jerk1_mm_s3};
  double forward_s = 0.0, backward_s = 0.0;
  try {
    forward_s = plan_scurve(limits, distance_mm, start_velocity, end_velocity).duration_s;
    backward_s = plan_scurve(reversed, distance_mm, end_velocity, start_velocity).duration_s;
  } catch (const MotionError&) {
    RC_DISCARD("too short for the change of speed");
  }
  RC_ASSERT(std::abs(forward_s - backward_s) <= 1e-9 * forward_s);
}

TEST(Scurve, StretchedTakesTheFactorLongerToTheSameEnd) {
  const Scurve curve = plan_scurve(gentle_stop, 50.0);
  const Scurve slow = stretched(curve, 1.5);
  EXPECT_DOUBLE_EQ(slow.duration_s, 1.5 * curve.duration_s);
  EXPECT_EQ(slow.end.position_mm, 50.0);
  EXPECT_NEAR(slow.sample(0.15).position_mm, curve.sample(0.1).position_mm, 1e-12);
}

TEST(Scurve, RoundedToCyclesRefusesAMoveThatDoesNotBeginAtRest) {
  EXPECT_THAT(error_of([] { round_to_cycles(plan_scurve(gentle_stop, 50.0, 10.0, 0.0), 1e-3); }),
              StartsWith("servo cycles: found a profile from 10 to 0 mm/s"));
  EXPECT_THAT(error_of([] { round_to_cycles(plan_scurve(gentle_stop, 50.0), 0.0); }),
              StartsWith("servo cycle: found 0 s"));
  EXPECT_THAT(error_of([] { round_to_cycles(plan_scurve(gentle_stop, 50.0), 1e9); }),
              StartsWith("servo cycle: found 1000000000 s"));
}

// ---- what is refused ----

TEST(Scurve, RefusesADistanceTooShortForTheChangeOfSpeed) {
  // 400 -> 0 mm/s with D 4000 and J 2e5 takes (400/4000 + 4000/2e5) s at 200 mm/s in the mean: 24 mm.
  EXPECT_EQ(error_of([] { plan_scurve(symmetric, 23.0, 400.0, 0.0); }),
            "distance: found 23 mm, expected at least 24 mm for the change from 400 to 0 mm/s");
  EXPECT_NEAR(plan_scurve(symmetric, 24.0, 400.0, 0.0).duration_s, 0.12, 1e-12);
}

TEST(Scurve, IsStretchedByAFactorAboveZero) {
  const Scurve curve = plan_scurve(symmetric, 10.0);
  EXPECT_EQ(error_of([&] { stretched(curve, -1.0); }),
            "stretching: found factor -1, expected a number from 1e-12 to 1000000000000000");
  for (const double factor : {0.0, static_cast<double>(NAN), static_cast<double>(INFINITY)})
    EXPECT_THAT(error_of([&] { stretched(curve, factor); }), StartsWith("stretching: found factor "));
}

// Their powers left the range of a double: durations were infinite, or no numbers.
TEST(Scurve, LimitsHaveARangeInWhichEachDurationIsANumber) {
  EXPECT_EQ(error_of([] { plan_scurve(asymmetric_limits(1e300, 1, 1, 1, 1), 1); }),
            "velocity limit: found 1e+300 mm/s, expected a number from 1e-12 to 1000000000000000");
  EXPECT_THAT(error_of([] { plan_scurve(asymmetric_limits(1, 1, 1, 1e-300, 1), 1); }),
              StartsWith("jerk limit 1: found 1e-300"));
  EXPECT_THAT(error_of([] { plan_scurve(symmetric, 1e300); }), StartsWith("distance: found 1e+300 mm"));
  std::mt19937_64 random(std::random_device{}());
  std::uniform_real_distribution<double> exponent(-12.0, 15.0);
  const auto drawn = [&] { return std::pow(10.0, exponent(random)); };
  for (int i = 0; i < 20'000; ++i) {
    const ScurveLimits limits = asymmetric_limits(drawn(), drawn(), drawn(), drawn(), drawn());
    const double distance_mm = drawn();
    const double duration_s = plan_scurve(limits, distance_mm).duration_s;
    ASSERT_TRUE(std::isfinite(duration_s) && duration_s > 0.0) << distance_mm << ' ' << duration_s;
  }
}

TEST(Scurve, RefusesBadLimitsSpeedsAndDistances) {
  EXPECT_EQ(error_of([] { plan_scurve(asymmetric_limits(0, 1, 1, 1, 1), 1); }),
            "velocity limit: found 0 mm/s, expected a finite number above 0");
  EXPECT_THAT(error_of([] { plan_scurve(asymmetric_limits(1, -1, 1, 1, 1), 1); }),
              StartsWith("acceleration limit: found -1"));
  EXPECT_THAT(error_of([] { plan_scurve(asymmetric_limits(1, 1, NAN, 1, 1), 1); }),
              StartsWith("deceleration limit: found nan"));
  EXPECT_THAT(error_of([] { plan_scurve(asymmetric_limits(1, 1, 1, INFINITY, 1), 1); }),
              StartsWith("jerk limit 1: found inf"));
  EXPECT_THAT(error_of([] { plan_scurve(asymmetric_limits(1, 1, 1, 1, 0), 1); }),
              StartsWith("jerk limit 5: found 0"));
  EXPECT_EQ(error_of([] { plan_scurve(symmetric, 1.0, 401.0, 0.0); }),
            "start speed: found 401 mm/s, expected 0..400 mm/s");
  EXPECT_EQ(error_of([] { plan_scurve(symmetric, 1.0, 0.0, -1.0); }),
            "end speed: found -1 mm/s, expected 0..400 mm/s");
  EXPECT_THAT(error_of([] { plan_scurve(symmetric, -1.0); }), StartsWith("distance: found -1 mm"));
  EXPECT_THAT(error_of([] { plan_scurve(symmetric, NAN); }), StartsWith("distance: found nan mm"));
}

// ---- several axes ----

const AxisLimits unequal_axes = {asymmetric_limits(400, 4000, 3000, 2e5, 1e5),
                                 asymmetric_limits(200, 3000, 3000, 1e5, 1e5),
                                 asymmetric_limits(50, 500, 400, 5e4, 2e4)};

TEST(Move, AlongOneAxisIsThatAxisProfile) {
  const Move move = plan_move({10, 20, 30}, {10, 45, 30}, unequal_axes);
  EXPECT_DOUBLE_EQ(move.profile.duration_s, plan_scurve(unequal_axes[1], 25.0).duration_s);
}

TEST(Move, EndsExactlyAtTheTarget) {
  const Eigen::Vector3d target(13.7, -2.9, 0.1);
  const Move move = plan_move({0.3, 0.2, 0.1}, target, unequal_axes);
  EXPECT_EQ(move.sample(move.profile.duration_s).position_mm, target);
  EXPECT_EQ(move.sample(0.0).position_mm, Eigen::Vector3d(0.3, 0.2, 0.1));
}

TEST(Move, OfNoLengthTakesNoTime) {
  EXPECT_EQ(plan_move({1, 2, 3}, {1, 2, 3}, unequal_axes).profile.duration_s, 0.0);
}

TEST(Move, RefusesACoordinateThatIsNotFinite) {
  EXPECT_THAT(error_of([] { plan_move({0, 0, 0}, {NAN, 0, 0}, unequal_axes); }), HasSubstr("not finite"));
}

RC_GTEST_PROP(MoveProperty, NoAxisExceedsItsLimitsAndOneIsAtALimit, ()) {
  const auto coordinate =
      rc::gen::map(rc::gen::inRange(-200'000, 200'001), [](int um) { return um / 1000.0; });
  const Eigen::Vector3d target(*coordinate, *coordinate, *coordinate);
  RC_PRE(target.norm() > 0.0);
  const Move move = plan_move(Eigen::Vector3d::Zero(), target, unequal_axes);
  const auto below = [](double value, double limit) { return std::abs(value) <= limit * (1.0 + 1e-12); };
  double closest = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double share = std::abs(move.direction[static_cast<Eigen::Index>(axis)]);
    const ScurveLimits& limits = unequal_axes[axis];
    RC_ASSERT(below(move.limits.velocity_mm_s * share, limits.velocity_mm_s));
    RC_ASSERT(below(move.limits.jerk5_mm_s3 * share, limits.jerk5_mm_s3));
    closest = std::max(closest, move.limits.velocity_mm_s * share / limits.velocity_mm_s);
  }
  RC_ASSERT(closest >= 1.0 - 1e-12);
  for (int i = 0; i <= 50; ++i) {
    const AxisStates states = move.sample(move.profile.duration_s * i / 50.0);
    RC_ASSERT((states.position_mm.cross(target)).norm() <=
              1e-9 * target.squaredNorm());  // on the straight line
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const ScurveLimits& limits = unequal_axes[static_cast<std::size_t>(axis)];
      RC_ASSERT(below(states.velocity_mm_s[axis], limits.velocity_mm_s));
      const bool slowing = states.acceleration_mm_s2[axis] * states.velocity_mm_s[axis] < 0.0;
      RC_ASSERT(below(states.acceleration_mm_s2[axis],
                      slowing ? limits.deceleration_mm_s2 : limits.acceleration_mm_s2));
    }
  }
}

}  // namespace
}  // namespace meltstage::motion
