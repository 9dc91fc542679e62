// SPDX-License-Identifier: Apache-2.0
// Changes of plan from any state: limits, continuity, end.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <string>

#include "motion/profile/any_end.hpp"
#include "motion/profile/arrival.hpp"
#include "motion/profile/moving_end.hpp"
#include "tests/motion/profile/any_state_cases.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

constexpr int kCases = 100'000;

// No two runs draw the same cases; the seed of one that fails is in its message.
std::uint64_t new_seed() { return std::random_device{}(); }

// What kCases random cases have met; the first that is wrong ends them.
template <class Seen>
Seen seen_in(std::string (*fault_of_case)(std::mt19937_64&, Seen&), int cases = kCases) {
  const std::uint64_t seed = new_seed();
  std::mt19937_64 random(seed);
  Seen seen;
  for (int i = 0; i < cases; ++i) {
    const std::string fault = fault_of_case(random, seen);
    EXPECT_EQ(fault, "") << "seed " << seed << ", case " << i;
    if (!fault.empty()) break;
  }
  return seen;
}

TEST(AnyState, TurnsBackWithinTheJerkLimit) {
  // So hard a deceleration can't be ended before the axis turns.
  const AnyState task{
      asymmetric_limits(400, 4000, 4000, 4e5, 4e5), {0.0, 1.0, -3000.0, 0.0}, {5.0, 0.0, 0.0, 0.0}};
  EXPECT_EQ(fault_of(plan_retarget(task.limits, task.state, task.target.position_mm), task), "");
}

// The least jerk would have needed ten seconds and 200 m to come to the present acceleration.
TEST(AnyState, AnAccelerationNoSlowJerkCouldHaveMadeEndsAtTheTarget) {
  for (const AnyState& task :
       {AnyState{{34.026746985900068, 19850.896559516499, 3117.0811600041498, 1088.20431610589,
                  5123148.4470472652, 419074.05734551349, 2999025.2776972293},
                 {0.0, -3.4026746985900071e-08, -10829.129776321004, 0.0},
                 {-0.073639668842909289, 0.0, 0.0, 0.0}},
        AnyState{{93.693541682994862, 8914.0266439828993, 2072.095619078807, 1444.6713725308448,
                  9214796.0793557018, 8384877.8383843023, 277454.35620108392},
                 {0.0, 0.0, 7578.8610953148345, 0.0},
                 {0.0068742408573919667, 0.0, 0.0, 0.0}}})
    EXPECT_EQ(fault_of(plan_retarget(task.limits, task.state, task.target.position_mm), task), "");
}

TEST(AnyStateProperty, KeepsTheLimitsAndEndsAtTheTarget) {
  const auto seen = seen_in(any_state_case);
  EXPECT_GT(seen.turns_back, 1000u);
  EXPECT_GT(seen.symmetric, 40'000u);
}

TEST(MovingEndProperty, KeepsTheLimitsAndNothingIsFaster) {
  const auto seen = seen_in(moving_end_case);
  EXPECT_GT(seen.goes_back, 10'000u);
  EXPECT_GT(seen.at_rest, 20'000u);
  EXPECT_GT(seen.compared, 10'000u);
}

TEST(AnyEndProperty, KeepsTheLimitsAndNothingIsFaster) {
  const auto seen = seen_in(any_end_case);
  EXPECT_GT(seen.with_acceleration, 50'000u);
  EXPECT_GT(seen.at_speed, 10'000u);
  EXPECT_GT(seen.compared, 10'000u);
}

TEST(TogetherProperty, KeepsTheLimitsAndAllAxesArriveAtOnce) {
  constexpr int kMotions = 5'000;
  const auto seen = seen_in(together_case, kMotions);
  EXPECT_GT(seen.at_once, kMotions * 97u / 100);
  EXPECT_GT(seen.passing, kMotions * 1u);
}

TEST(Together, TheSlowestAxisSetsTheTime) {
  const ScurveLimits fast = asymmetric_limits(400, 4000, 4000, 4e5, 4e5),
                     slow = asymmetric_limits(50, 500, 400, 2e4, 1e4);
  AxisStates state;
  state.position_mm = {100.0, 5.0, 0.0};
  state.velocity_mm_s = {120.0, 0.0, -30.0};
  state.acceleration_mm_s2 = {-500.0, 0.0, 100.0};
  const JointMotion motion = plan_together({fast, slow, fast}, state, {130.0, 25.0, -4.0}, {200.0, 0.0, 0.0});
  EXPECT_EQ(motion.duration_s, plan_scurve(slow, 20.0).duration_s);
  const AxisStates begin = motion.sample(0.0), end = motion.sample(motion.duration_s);
  EXPECT_EQ(begin.position_mm, state.position_mm);
  EXPECT_EQ(begin.velocity_mm_s, state.velocity_mm_s);
  EXPECT_TRUE(end.position_mm.isApprox(Eigen::Vector3d(130.0, 25.0, -4.0), 1e-9));
  EXPECT_NEAR(end.velocity_mm_s.x(), 200.0, 1e-6);
}

TEST(Arrival, IsThereAtTheMomentThatIsAsked) {
  const ScurveLimits limits = asymmetric_limits(400, 4000, 3000, 4e5, 1e5);
  const MotionState state{0.0, 60.0, 800.0, 0.0};
  for (const double duration_s : {0.3, 0.5, 2.0, 60.0}) {
    const JerkProfile motion = plan_arrival(limits, state, 25.0, 40.0, duration_s);
    EXPECT_NEAR(motion.duration_s, duration_s, 1e-9 * duration_s);
    EXPECT_EQ(fault_of(motion, {limits, state, {25.0, 40.0, 0.0, 0.0}}), "");
  }
}

// One ramp before the target it waits, and then goes.
TEST(Arrival, AnAxisThatHasNoMoreThanItsRampWaits) {
  const ScurveLimits limits;
  for (const double distance_mm : {0.2, 0.2 + 1e-9, 0.2 - 1e-9, 0.2 + 1e-10, 0.2 - 1e-10, 0.2 + 1e-6})
    for (const double duration_s : {0.5, 1.0, 30.0}) {
      const JerkProfile motion = plan_arrival(limits, {}, distance_mm, 20.0, duration_s);
      EXPECT_NEAR(motion.duration_s, duration_s, 1e-9 * duration_s);
      EXPECT_EQ(fault_of(motion, {limits, {}, {distance_mm, 20.0, 0.0, 0.0}}), "") << distance_mm;
    }
  AxisStates rest;
  rest.position_mm = rest.velocity_mm_s = rest.acceleration_mm_s2 = rest.jerk_mm_s3 = Eigen::Vector3d::Zero();
  EXPECT_DOUBLE_EQ(
      plan_together({limits, limits, limits}, rest, {0.2, 10.0, 0.0}, {20.0, 0.0, 0.0}).duration_s,
      plan_scurve(limits, 10.0).duration_s);
}

// It turns and is back with the opposite speed; at the turn it waits.
TEST(Arrival, AnAxisThatComesBackMayWaitAtTheTurn) {
  const ScurveLimits limits = asymmetric_limits(30, 325, 325, 3e5, 3e5);
  const MotionState state{0.0, -27.669347532031974, 0.0, 0.0};
  const JerkProfile motion = plan_arrival(limits, state, 0.0, 27.669347532031974, 3.0);
  EXPECT_NEAR(motion.duration_s, 3.0, 1e-9);
  EXPECT_EQ(fault_of(motion, {limits, state, {0.0, 27.669347532031974, 0.0, 0.0}}), "");
}

// What is left of the way is a nanometre, and the speed with which it is made next to none.
TEST(Arrival, ASpeedNextToNoneIsNoLessPossible) {
  const ScurveLimits limits = asymmetric_limits(500, 5000, 5000, 1e5, 1e5);
  const MotionState state{0.0, 5e-4, 0.0, 0.0};
  for (int i = 0; i < 400; ++i) {
    const double duration_s = 0.15 + 0.001 * i;
    const JerkProfile motion = plan_arrival(limits, state, -12.5, -250.0, duration_s);
    EXPECT_NEAR(motion.duration_s, duration_s, 1e-9 * duration_s);
    EXPECT_EQ(fault_of(motion, {limits, state, {-12.5, -250.0, 0.0, 0.0}}), "") << duration_s;
  }
  for (const double duration_s : {0.105, 0.11, 0.12, 0.2, 0.5})
    EXPECT_NO_THROW(plan_arrival(limits, state, -12.5, -250.0, duration_s)) << duration_s;
  const ScurveLimits turning = asymmetric_limits(100, 1000, 1000, 1e5, 1e5);
  EXPECT_NO_THROW(plan_arrival(turning, {0.0, -100.0, 0.0, 0.0}, 0.0, 100.0, 0.22));
  AxisStates moving;
  moving.position_mm = moving.acceleration_mm_s2 = moving.jerk_mm_s3 = Eigen::Vector3d::Zero();
  moving.velocity_mm_s = {5e-4, 0.0, 0.0};
  EXPECT_DOUBLE_EQ(
      plan_together({limits, limits, limits}, moving, {-12.5, 28.3, 0.0}, {-250.0, 20.0, 0.0}).duration_s,
      plan_to_speed(limits, {}, 28.3, 20.0).duration_s);
}

// Only speeds from 22.86 to 23.26 mm/s leave a way in the right direction.
TEST(Arrival, ANarrowRangeOfSpeedsIsFound) {
  const ScurveLimits limits = asymmetric_limits(75.852923549227853, 13220.246311811954, 13220.246311811954,
                                                139840.33257167501, 139840.33257167501);
  const MotionState state{0.0, -4.580084423499998, 2770.9233160324225, 0.0};
  const JerkProfile motion =
      plan_arrival(limits, state, 0.60427682851398778, 6.0564809289064172, 0.0423204109936);
  EXPECT_NEAR(motion.duration_s, 0.0423204109936, 1e-9);
}

TEST(Together, MistakesNameTheAxis) {
  AxisStates rest;
  rest.position_mm = rest.velocity_mm_s = rest.acceleration_mm_s2 = rest.jerk_mm_s3 = Eigen::Vector3d::Zero();
  const std::string text = error_of([&] { plan_together({}, rest, {1.0, 1.0, 1.0}, {0.0, 500.0, 0.0}); });
  EXPECT_EQ(text.find("axis 1: motion to a speed: found 1 mm with 500 mm/s"), 0u) << text;
}

// At 100 mm/s and with 100 mm/s2 the target 10 mm ahead is passed at once, or on the way back from 50 mm
// ahead.
TEST(Arrival, ADurationInTheGapIsRefusedWithThePossibleOnes) {
  const ScurveLimits limits = asymmetric_limits(100, 100, 100, 1e5, 1e5);
  const MotionState state{0.0, 100.0, 0.0, 0.0};
  EXPECT_NEAR(plan_arrival(limits, state, 10.0, 100.0, 0.1).duration_s, 0.1, 1e-9);
  const std::string text = error_of([&] { plan_arrival(limits, state, 10.0, 100.0, 1.0); });
  EXPECT_EQ(text.find("arrival: found 1 s, expected 0.1 s, or "), 0u) << text;
  EXPECT_EQ(error_of([&] { plan_arrival(limits, state, 10.0, 100.0, 0.05); }),
            "arrival: found 0.05 s, expected at least 0.1 s");
  const JerkProfile back = plan_arrival(limits, state, 10.0, 100.0, 20.0);
  EXPECT_NEAR(back.duration_s, 20.0, 1e-7);
}

TEST(AnyEnd, IsWhereItIsAsked) {
  const ScurveLimits limits = asymmetric_limits(400, 4000, 4000, 4e5, 4e5);
  const JerkProfile motion = plan_to_state(limits, {0.0, 50.0, -1000.0, 0.0}, {20.0, 100.0, 2000.0, 0.0});
  const MotionState end = motion.sample(motion.duration_s);
  EXPECT_EQ(end.position_mm, 20.0);
  EXPECT_EQ(end.velocity_mm_s, 100.0);
  EXPECT_EQ(end.acceleration_mm_s2, 2000.0);
  // There already.
  EXPECT_EQ(plan_to_state(limits, {0.0, 50.0, 900.0, 0.0}, {0.0, 50.0, 900.0, 0.0}).duration_s, 0.0);
}

// What the acceleration adds to the speed is less than the speed's last bit.
TEST(AnyEnd, ATinyAccelerationAtTheStartIsNoDetour) {
  const ScurveLimits limits = asymmetric_limits(4.8460087825089024, 2918.2720766558705, 2918.2720766558705,
                                                15943.83684749074, 15943.83684749074);
  const double velocity = -4.8460087776628935;
  const MotionState state{0.0, velocity, 2.9182720766558707e-06, 0.0};
  EXPECT_LT(plan_to_state(limits, state, {-1e-9, velocity, 0.0, 0.0}).duration_s, 1e-9);
}

TEST(AnyEnd, MistakesAreTold) {
  const ScurveLimits limits = asymmetric_limits(400, 4000, 4000, 4e5, 4e5);
  EXPECT_EQ(error_of([&] {
              plan_to_state(limits, {}, {1.0, 0.0, 4001.0, 0.0});
            }),
            "motion to a state: found 1 mm, 0 mm/s, 4001 mm/s2, expected finite numbers, at most 4000 mm/s2, "
            "and at "
            "most 400 mm/s there and before it");
  // Before so strong a deceleration the speed was higher.
  EXPECT_THROW(plan_to_state(limits, {}, {1.0, 390.0, -4000.0, 0.0}), MotionError);
  EXPECT_THROW(plan_to_state(limits, {}, {std::nan(""), 0.0, 0.0, 0.0}), MotionError);
  EXPECT_THROW(plan_to_state(limits, {}, {1.0, std::nan(""), 0.0, 0.0}), MotionError);
}

// The fastest change of speed ends at the target but for rounding: no way back over it.
TEST(MovingEnd, RoundingIsNoWay) {
  const ScurveLimits limits = asymmetric_limits(180.63990612413562, 14.189155484340015, 14.189155484340015,
                                                5836951.2882947195, 5836951.2882947195);
  const MotionState state{0.0, 64.277223458706203, 10.920781836169349, 0.0};
  const MotionState end{145.58894654916719, 0.00018063990612413562, 0.0, 0.0};
  const JerkProfile motion = plan_to_speed(limits, state, end.position_mm, end.velocity_mm_s);
  EXPECT_NEAR(motion.duration_s, plan_to_state(limits, state, end).duration_s, 1e-12);
}

// A way of a femtometre is one all the same, where it is as long as the motion's others.
TEST(MovingEnd, AShortWayIsNoRounding) {
  const ScurveLimits limits = asymmetric_limits(1.5084763261196805, 11.128184180633554, 11.128184180633554,
                                                165087.18657491633, 165087.18657491633);
  const MotionState state{0.0, -1.43924e-06, 0.701741, 0.0};
  constexpr double kTarget_mm = -8.7096168e-13;
  const double least_s = plan_to_state(limits, state, {kTarget_mm, 0.0, 0.0, 0.0}).duration_s;
  EXPECT_NEAR(plan_retarget(limits, state, kTarget_mm).duration_s, least_s, 1e-9);
  EXPECT_NEAR(plan_to_speed(limits, state, kTarget_mm, 0.0).duration_s, least_s, 1e-9);
}

// From 0 to 100 mm/s takes 2.5 mm; in 0.1 mm it begins with a way back.
TEST(MovingEnd, NoDistanceIsTooShort) {
  const ScurveLimits limits = asymmetric_limits(400, 4000, 4000, 2e5, 2e5);
  EXPECT_THROW(plan_scurve(limits, 0.1, 0.0, 100.0), MotionError);
  const JerkProfile run_up = plan_to_speed(limits, {}, 0.1, 100.0);
  EXPECT_LT(run_up.sample(0.25 * run_up.duration_s).position_mm, -0.1);
  EXPECT_EQ(run_up.end.position_mm, 0.1);
  EXPECT_EQ(run_up.end.velocity_mm_s, 100.0);
  // There, it is where plan_scurve is.
  EXPECT_NEAR(plan_to_speed(limits, {}, 20.0, 100.0).duration_s,
              plan_scurve(limits, 20.0, 0.0, 100.0).duration_s, 1e-12);
}

TEST(MovingEnd, MistakesAreTold) {
  const ScurveLimits limits = asymmetric_limits(400, 4000, 4000, 2e5, 2e5);
  EXPECT_EQ(error_of([&] { plan_to_speed(limits, {}, 1.0, 401.0); }),
            "motion to a speed: found 1 mm with 401 mm/s, expected a finite number with 400 mm/s at most");
  EXPECT_THROW(plan_to_speed(limits, {}, std::nan(""), 1.0), MotionError);
  EXPECT_THROW(plan_to_speed(limits, {}, 1.0, std::nan("")), MotionError);
}

}  // namespace
}  // namespace meltstage::motion
