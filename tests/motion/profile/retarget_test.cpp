// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/retarget.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "tests/motion/profile/profile_cases.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::StartsWith;

const ScurveLimits gentle_stop = asymmetric_limits(400, 4000, 3000, 4e5, 1e5);

// ---- stop ----

TEST(Stop, FromConstantSpeedIsThePlannedDeceleration) {
  const Scurve planned = plan_scurve(gentle_stop, 200.0);
  const JerkProfile stop = plan_stop(gentle_stop, {50.0, 400.0, 0.0, 0.0});
  ASSERT_EQ(stop.segments, 3U);
  for (const std::size_t i : {0, 1, 2}) EXPECT_NEAR(stop.durations_s[i], planned.durations_s[i + 4], 1e-15);
}

TEST(Stop, AtRestTakesNoTime) {
  const JerkProfile stop = plan_stop(gentle_stop, {});
  EXPECT_EQ(stop.segments, 0U);
  EXPECT_EQ(stop.sample(1.0).position_mm, 0.0);
}

TEST(Stop, BackwardsIsTheMirrorImage) {
  const JerkProfile forward = plan_stop(gentle_stop, {0.0, 300.0, 1500.0, 0.0});
  const JerkProfile backward = plan_stop(gentle_stop, {0.0, -300.0, -1500.0, 0.0});
  EXPECT_EQ(forward.duration_s, backward.duration_s);
  EXPECT_EQ(forward.end.position_mm, -backward.end.position_mm);
  EXPECT_EQ(forward.sample(0.05).velocity_mm_s, -backward.sample(0.05).velocity_mm_s);
}

TEST(StopProperty, FromAnyMomentKeepsTheLimitsAndNeverPassesTheTarget) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 100'000; ++i) ASSERT_EQ(stop_case(random), "") << "case " << i;
}

TEST(StopWithin, WithEnoughRoomIsTheOrdinaryStop) {
  const MotionState state{0.0, 200.0, 0.0, 0.0};
  const JerkProfile ordinary = plan_stop(gentle_stop, state);
  const StopWithin stop = plan_stop_within(gentle_stop, state, ordinary.end.position_mm);
  EXPECT_EQ(stop.haste, 1.0);
  EXPECT_EQ(stop.profile.duration_s, ordinary.duration_s);
}

TEST(StopWithin, UsesAllTheRoomWhenThereIsLess) {
  const MotionState state{0.0, -200.0, -500.0, 0.0};
  const double needed_mm = -plan_stop(gentle_stop, state).end.position_mm;
  for (const double share : {0.9, 0.5, 0.1, 0.01}) {
    const StopWithin stop = plan_stop_within(gentle_stop, state, share * needed_mm);
    EXPECT_GT(stop.haste, 1.0);
    EXPECT_LE(-stop.profile.end.position_mm, share * needed_mm);
    EXPECT_NEAR(-stop.profile.end.position_mm, share * needed_mm, 1e-9);
  }
}

/// The farthest that a profile comes in the direction `sign`.
double farthest_mm(const JerkProfile& profile, double sign) {
  double farthest = 0.0;
  for (int i = 0; i <= 20'000; ++i)
    farthest = std::max(farthest, sign * profile.sample(profile.duration_s * i / 20'000).position_mm);
  return farthest;
}

// What it needs is up to the turn; where it comes to rest, behind its start, is no matter.
TEST(StopWithin, OfAnAxisThatTurnsBackNeedsTheWayToTheTurn) {
  for (const double sign : {1.0, -1.0})
    for (const auto& [speed, braking] : {std::pair{1.0, 4000.0}, {20.0, 4000.0}, {5.0, 2000.0}}) {
      const MotionState state{0.0, sign * speed, -sign * braking, 0.0};
      const JerkProfile ordinary = plan_stop({}, state);
      const double needed_mm = farthest_mm(ordinary, sign);
      ASSERT_LT(needed_mm, std::abs(ordinary.end.position_mm));
      const StopWithin stop = plan_stop_within({}, state, needed_mm * (1.0 + 1e-6));
      EXPECT_EQ(stop.haste, 1.0) << sign * speed;
      EXPECT_EQ(stop.profile.end.position_mm, ordinary.end.position_mm);
      for (const double share : {0.9, 0.5, 0.1}) {
        const StopWithin hurried = plan_stop_within({}, state, share * needed_mm);
        EXPECT_GT(hurried.haste, 1.0);
        EXPECT_LE(farthest_mm(hurried.profile, sign), share * needed_mm * (1.0 + 1e-9)) << share;
      }
    }
}

TEST(StopWithin, RefusesToStopOnTheSpot) {
  EXPECT_EQ(error_of([] {
              plan_stop_within(gentle_stop, {0.0, 10.0, 0.0, 0.0}, 0.0);
            }),
            "stop: found room of 0 mm, expected at least 1e-12 mm for a moving axis");
  EXPECT_EQ(error_of([] {
              plan_stop_within(gentle_stop, {0.0, 3.0, 0.0, 0.0}, 1e-300);
            }),
            "stop: found room of 1e-300 mm, expected at least 1e-12 mm for a moving axis");
  EXPECT_THAT(
      error_of([] {
        plan_stop_within(gentle_stop, {0.0, 400.0, 0.0, 0.0}, 1e-4);
      }),
      testing::HasSubstr("stop: found room of 0.0001 mm, expected more: it takes jerks of more than"));
}

// ---- retarget ----

// A sample's acceleration may be above the limit by its last bit.
TEST(Retarget, FromASampleOfAPlanTakesWhatWasLeft) {
  const double acceleration = 4066.0268804809639;
  const ScurveLimits limits = asymmetric_limits(400.0, acceleration, acceleration, 2e5, 2e5);
  const double target_mm = 5.0608449160244078, at_s = 0.04060059686859642;
  const JerkProfile plan = plan_retarget(limits, {0.0, 169.24573039076961, 0.0, 0.0}, target_mm);
  const MotionState now = plan.sample(at_s);
  const JerkProfile again = plan_retarget(limits, {0.0, now.velocity_mm_s, now.acceleration_mm_s2, 0.0},
                                          target_mm - now.position_mm);
  EXPECT_NEAR(again.duration_s, plan.duration_s - at_s, 1e-9);
}

TEST(Retarget, FromRestIsTheOrdinaryMove) {
  EXPECT_EQ(plan_retarget(gentle_stop, {}, 30.0).duration_s, plan_scurve(gentle_stop, 30.0).duration_s);
  const JerkProfile back = plan_retarget(gentle_stop, {}, -30.0);
  EXPECT_EQ(back.end.position_mm, -30.0);
  EXPECT_LT(back.sample(0.05).velocity_mm_s, 0.0);
}

TEST(Retarget, FartherAtConstantSpeedKeepsTheSpeed) {
  const JerkProfile longer = plan_retarget(gentle_stop, {0.0, 400.0, 0.0, 0.0}, 300.0);
  EXPECT_NEAR(longer.sample(0.1).velocity_mm_s, 400.0, 1e-9);
  EXPECT_EQ(longer.end.position_mm, 300.0);
}

TEST(Retarget, BehindTheAxisTurnsAndComesBack) {
  const MotionState state{0.0, 400.0, 0.0, 0.0};
  const JerkProfile back = plan_retarget(gentle_stop, state, -20.0);
  const JerkProfile stop = plan_stop(gentle_stop, state);
  EXPECT_LT(back.duration_s,
            stop.duration_s + plan_scurve(gentle_stop, stop.end.position_mm + 20.0).duration_s);
  EXPECT_EQ(back.end.position_mm, -20.0);
  EXPECT_EQ(back.end.velocity_mm_s, 0.0);
}

TEST(RetargetProperty, ToTheOldTargetTakesWhatWasLeft) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 100'000; ++i) ASSERT_EQ(replan_case(random), "") << "case " << i;
}

TEST(RetargetProperty, TwoHundredThousandChangesOfTargetAndLimits) {
  std::mt19937_64 random(13);
  RetargetSeen seen;
  for (int i = 0; i < 200'000; ++i) ASSERT_EQ(retarget_case(random, seen), "") << "case " << i;
  for (const std::uint64_t count :
       {seen.farther, seen.nearer, seen.speeding_up, seen.slowing_down, seen.faster_than_limit})
    EXPECT_GT(count, 1000U);
}

TEST(Retarget, AlongAPathIsContinuousOverManyChanges) {
  std::mt19937_64 random(17);
  MotionState state;
  double position_mm = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double target_mm = 200.0 * uniform(random);
    const JerkProfile profile = plan_retarget(gentle_stop, state, target_mm - position_mm);
    const Violations worst =
        violations_of(profile, gentle_stop, state, target_mm - position_mm, gentle_stop.velocity_mm_s);
    ASSERT_LE(worst.continuity, 1e-9) << i;
    ASSERT_LE(worst.limits, 1e-6) << i;
    state = profile.sample(profile.duration_s * uniform(random));
    position_mm += state.position_mm;
  }
}

// Limits alike in both directions, one jerk: the case of which ruckig's paper (Berscheid and Kroeger 2021)
// has the optimum.
TEST(Retarget, TurnsWithoutAHalt) {
  const ScurveLimits even = asymmetric_limits(400, 4000, 4000, 4e5, 4e5);
  // to the point that the axis leaves at full speed: the way back with one reversal, of -A held through the
  // turn
  const JerkProfile back = plan_retarget(even, {0.0, 100.0, 0.0, 0.0}, 0.0);
  bool halted = false;
  for (std::size_t i = 1; i < back.segments; ++i)
    halted |= back.starts[i].velocity_mm_s == 0.0 && back.starts[i].acceleration_mm_s2 == 0.0;
  EXPECT_FALSE(halted);
  EXPECT_LT(back.duration_s,
            plan_stop(even, {0.0, 100.0, 0.0, 0.0}).duration_s +
                plan_scurve(even, plan_stop(even, {0.0, 100.0, 0.0, 0.0}).end.position_mm).duration_s - 5e-3);
}

TEST(Retarget, RefusesWhatIsNotFinite) {
  EXPECT_THAT(error_of([] { plan_retarget(gentle_stop, {}, NAN); }),
              StartsWith("retarget: found target nan"));
  EXPECT_THAT(error_of([] {
                plan_retarget(gentle_stop, {0.0, INFINITY, 0.0, 0.0}, 1.0);
              }),
              StartsWith("state: found 0 mm, inf mm/s"));
  EXPECT_THAT(error_of([] {
                plan_stop(gentle_stop, {NAN, 1.0, 0.0, 0.0});
              }),
              StartsWith("state: found nan mm, 1 mm/s"));
}

}  // namespace
}  // namespace meltstage::motion
