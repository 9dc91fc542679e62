// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/stage.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::vector<StageEvent> collect(Stage& stage, std::uint64_t until_cycle) {
  std::vector<StageEvent> events;
  stage.run_until(until_cycle, [&](const StageEvent& event) { events.push_back(event); });
  return events;
}

/// Counts steps from the pins alone, as a drive would.
class PinCounter {
 public:
  void operator()(const StageEvent& event) {
    AxisPins& before = pins_[event.axis];
    if (event.pins.step && !before.step) {
      position_[event.axis] += event.pins.dir ? 1 : -1;
      rises_[event.axis].push_back(event.cycle);
    }
    if (!event.pins.step && before.step) falls_[event.axis].push_back(event.cycle);
    if (event.pins.dir != before.dir) turns_[event.axis].push_back(event.cycle);
    before = event.pins;
  }

  std::array<AxisPins, 3> pins_{};
  std::array<std::int64_t, 3> position_{};
  std::array<std::vector<std::uint64_t>, 3> rises_, falls_, turns_;
};

// ---- pulses ----

TEST(Pulses, HaveTheLengthOfLeadAndGear) {
  const StageConfig config;
  EXPECT_DOUBLE_EQ(pulse_length_mm(config.axes[0]), 0.001);
  EXPECT_DOUBLE_EQ(pulse_length_mm(config.axes[1]), 0.0005);
  EXPECT_DOUBLE_EQ(pulse_length_mm(config.axes[2]), 0.0005);
}

TEST(Pulses, RoundToTheNearest) {
  const AxisConfig x = StageConfig{}.axes[0];
  EXPECT_EQ(mm_to_pulses(x, 1.2344), 1234);
  EXPECT_EQ(mm_to_pulses(x, 1.2346), 1235);
  EXPECT_EQ(mm_to_pulses(x, -1.2346), -1235);
}

RC_GTEST_PROP(PulsesProperty, RoundTripIsExactForAnyGear, ()) {
  AxisConfig axis;
  axis.encoder_pulses_per_turn = *rc::gen::inRange(1, 1 << 24);
  axis.gear_numerator = *rc::gen::inRange(1, 100);
  axis.gear_denominator = *rc::gen::inRange(1, 100);
  const std::int64_t pulses = *rc::gen::inRange(-100'000'000, 100'000'000);
  RC_ASSERT(mm_to_pulses(axis, pulses_to_mm(axis, pulses)) == pulses);
}

TEST(Pulses, OfNoPlaceAreRefused) {
  const AxisConfig x = StageConfig{}.axes[0];
  EXPECT_EQ(error_of([&] { mm_to_pulses(x, NAN); }),
            "pulses: found nan mm at 0.001 mm a pulse, expected a position within 2^53 pulses");
  EXPECT_THAT(error_of([&] { mm_to_pulses(x, 1e300); }), StartsWith("pulses: found 1e+300 mm"));
  EXPECT_THAT(error_of([&] { mm_to_pulses(x, -HUGE_VAL); }), StartsWith("pulses: found -inf mm"));
  EXPECT_EQ(mm_to_pulses(x, -9e12), -9'000'000'000'000'000);
}

// ---- moves ----

TEST(Stage, ArrivesAtTheTargetsPulses) {
  Stage stage{StageConfig{}};
  const Eigen::Vector3d target(1.2345, 0.3217, 0.1);
  const auto end = stage.move_to(target, 100);
  PinCounter counter;
  stage.run_until(end, std::ref(counter));
  const std::array<std::int64_t, 3> expected = {mm_to_pulses(stage.config().axes[0], 1.2345),
                                                mm_to_pulses(stage.config().axes[1], 0.3217), 200};
  EXPECT_EQ(stage.position_pulses(), expected);
  EXPECT_EQ(counter.position_, expected);
  EXPECT_LE((stage.position_mm() - target).cwiseAbs().maxCoeff(), 0.0005 + 1e-12);
}

TEST(Stage, EveryStepComesAtTheClockEdgeWhereThePlanPassesTheMiddleBetweenPulses) {
  Stage stage{StageConfig{}};
  const Eigen::Vector3d target(2.0, 0.7, 0.0);
  const Move plan = plan_move(
      Eigen::Vector3d::Zero(), target,
      {stage.config().axes[0].limits, stage.config().axes[1].limits, stage.config().axes[2].limits});
  PinCounter counter;
  const std::uint64_t start_cycle = 1000, motion_start = start_cycle + stage.config().dir_setup_cycles;
  stage.run_until(stage.move_to(target, start_cycle), std::ref(counter));
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double pulse_mm = pulse_length_mm(stage.config().axes[axis]);
    ASSERT_EQ(counter.rises_[axis].size(), axis == 0 ? 2000U : 1400U);
    for (std::size_t k = 0; k < counter.rises_[axis].size(); ++k) {
      const double middle_mm = (static_cast<double>(k) + 0.5) * pulse_mm;
      const auto i = static_cast<Eigen::Index>(axis);
      const auto position_at = [&](std::uint64_t cycle) {
        return plan.sample(static_cast<double>(cycle - motion_start) / stage.config().clock_hz)
            .position_mm[i];
      };
      ASSERT_GE(position_at(counter.rises_[axis][k]), middle_mm - 1e-12);
      ASSERT_LT(position_at(counter.rises_[axis][k] - 1), middle_mm + 1e-12);
    }
  }
}

TEST(Stage, StepPulsesKeepTheirLengthAndDirectionSetsUpBefore) {
  const StageConfig config;
  Stage stage{config};
  PinCounter counter;
  const auto end = stage.move_to({3.0, 0.0, 0.0}, 0);
  stage.run_until(end, std::ref(counter));
  const auto turned_at = end + 50;
  stage.run_until(stage.move_to({1.0, 0.0, 0.0}, turned_at), std::ref(counter));
  const auto& rises = counter.rises_[0];
  ASSERT_EQ(rises.size(), 5000U);
  ASSERT_EQ(counter.falls_[0].size(), rises.size());
  for (std::size_t i = 0; i < rises.size(); ++i) {
    EXPECT_EQ(counter.falls_[0][i], rises[i] + config.step_high_cycles);
    if (i > 0) {
      EXPECT_GE(rises[i] - rises[i - 1], 2 * config.step_high_cycles);
    }
  }
  EXPECT_EQ(counter.turns_[0], (std::vector<std::uint64_t>{0, turned_at}));
  EXPECT_GE(rises[3000], turned_at + config.dir_setup_cycles);
}

TEST(Stage, EventsComeInOrderOfCycleThenAxis) {
  Stage stage{StageConfig{}};
  const auto events = collect(stage, stage.move_to({2.0, 3.0, 1.0}, 0));
  ASSERT_GT(events.size(), 100U);
  for (std::size_t i = 1; i < events.size(); ++i)
    ASSERT_TRUE(std::pair(events[i - 1].cycle, events[i - 1].axis) <
                std::pair(events[i].cycle, events[i].axis));
}

TEST(Stage, RunningInSmallPiecesGivesTheSameEvents) {
  Stage whole{StageConfig{}}, pieces{StageConfig{}};
  const auto end = whole.move_to({0.2, 0.1, 0.0}, 7);
  pieces.move_to({0.2, 0.1, 0.0}, 7);
  const auto expected = collect(whole, end);
  std::vector<StageEvent> found;
  for (std::uint64_t cycle = 0; cycle <= end; cycle += 3)
    for (const StageEvent& event : collect(pieces, cycle)) found.push_back(event);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].cycle, expected[i].cycle);
    EXPECT_EQ(found[i].pins, expected[i].pins);
  }
}

TEST(Stage, AllAxesAtRestWhenTheMoveIsOver) {
  Stage stage{StageConfig{}};
  const auto end = stage.move_to({5.0, 2.0, 1.0}, 0);
  EXPECT_TRUE(stage.moving(end - 1));
  EXPECT_FALSE(stage.moving(end));
  stage.run_until(end, [&](const StageEvent& event) { EXPECT_LT(event.cycle, end); });
  EXPECT_EQ(stage.next_event_cycle(), std::nullopt);
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_FALSE(stage.pins(axis).step);
}

TEST(Stage, TellsTheNextEventSoThatIdleTimeCanBeSkipped) {
  Stage stage{StageConfig{}};
  EXPECT_EQ(stage.next_event_cycle(), std::nullopt);
  const auto end = stage.move_to({0.01, 0.0, 0.0}, 500);
  EXPECT_EQ(stage.next_event_cycle(), 500U);  // the direction pin
  EXPECT_EQ(collect(stage, 499).size(), 0U);
  EXPECT_EQ(collect(stage, 500).size(), 1U);
  EXPECT_GT(*stage.next_event_cycle(), 500U + stage.config().dir_setup_cycles);
  EXPECT_EQ(collect(stage, end).size(), 20U);
}

RC_GTEST_PROP(StageProperty, NothingAccumulatesOverManyMoves, ()) {
  // A gear that makes a pulse an endless fraction of a millimetre.
  StageConfig config;
  for (AxisConfig& axis : config.axes) {
    axis.encoder_pulses_per_turn = 4096;
    axis.gear_numerator = 3;
    axis.gear_denominator = 7;
  }
  Stage stage{config};
  PinCounter counter;
  std::uint64_t cycle = 0;
  const auto moves = *rc::gen::inRange(1, 30);
  for (int i = 0; i < moves; ++i) {
    const auto coordinate = rc::gen::map(rc::gen::inRange(0, 20'001), [](int um) { return um / 1000.0; });
    const Eigen::Vector3d target(*coordinate, *coordinate, *coordinate);
    cycle = stage.move_to(target, cycle);
    stage.run_until(cycle, std::ref(counter));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      RC_ASSERT(stage.position_pulses()[axis] ==
                mm_to_pulses(config.axes[axis], target[static_cast<Eigen::Index>(axis)]));
      RC_ASSERT(counter.position_[axis] == stage.position_pulses()[axis]);
    }
  }
}

// ---- switches ----

TEST(Stage, HomeIsActiveAtTheLowerEndOnly) {
  Stage stage{StageConfig{}};
  EXPECT_TRUE(stage.pins(0).home);
  stage.run_until(stage.move_to({0.001, 0.0, 0.0}, 0), [](const StageEvent&) {});
  EXPECT_FALSE(stage.pins(0).home);
  EXPECT_TRUE(stage.pins(1).home);
}

TEST(Stage, IndexComesOnceATurn) {
  Stage stage{StageConfig{}};
  int index_rises = 0;
  bool before = stage.pins(0).index;
  EXPECT_TRUE(before);
  stage.run_until(stage.move_to({35.0, 0.0, 0.0}, 0), [&](const StageEvent& event) {
    if (event.axis != 0) return;
    if (event.pins.index && !before) {
      ++index_rises;
      EXPECT_EQ(stage.position_pulses()[0] % 10'000, 0);
    }
    before = event.pins.index;
  });
  EXPECT_EQ(index_rises, 3);  // at 10, 20 and 30 mm
}

TEST(Stage, LimitSwitchesStandOutsideTheTravel) {
  StageConfig config;
  Stage at_end{config, {200.0, 200.0, 200.0}};
  EXPECT_FALSE(at_end.pins(0).limit_positive);
  EXPECT_FALSE(at_end.pins(0).home);
  config.axes[0].overtravel_mm = 1e-7;  // less than is looked at: the switches stand at the ends themselves
  EXPECT_TRUE((Stage{config, {200.0, 0.0, 0.0}}.pins(0).limit_positive));
  EXPECT_TRUE((Stage{config, {0.0, 0.0, 0.0}}.pins(0).limit_negative));
  EXPECT_FALSE((Stage{config, {0.0, 0.0, 0.0}}.pins(1).limit_negative));
}

// ---- emergency stop ----

// The switch was rounded to the nearest pulse, and stood where the last place of the travel was rounded to.
TEST(Stage, ALimitSwitchIsNotReachedInsideTheTravel) {
  StageConfig config;
  AxisConfig& axis = config.axes[0];
  axis.lead_mm = 8.0;
  axis.encoder_pulses_per_turn = 200;  // 0.04 mm
  axis.gear_numerator = axis.gear_denominator = 1;
  axis.travel = {0.0, 10.03};
  axis.overtravel_mm = 0.025;
  Stage stage(config);
  stage.run_until(stage.move_to({10.03, 0.0, 0.0}, 0), [](const StageEvent&) {});
  EXPECT_NEAR(stage.position_mm()[0], 10.04, 1e-9);
  EXPECT_FALSE(stage.pins(0).limit_positive);
}

TEST(EmergencyStop, SlowsDownWithinTheLimitsAndKeepsThePosition) {
  Stage stage{StageConfig{}};
  const auto planned_end = stage.move_to({100.0, 50.0, 0.0}, 0);
  PinCounter counter;
  const std::uint64_t stop_cycle = planned_end / 3;
  stage.run_until(stop_cycle, std::ref(counter));
  const auto at_stop = stage.position_mm();
  const auto end = stage.emergency_stop(stop_cycle);
  EXPECT_LT(end, planned_end);
  stage.run_until(end, std::ref(counter));
  EXPECT_TRUE(stage.held());
  EXPECT_EQ(stage.next_event_cycle(), std::nullopt);
  EXPECT_EQ(counter.position_, stage.position_pulses());
  EXPECT_GT(stage.position_mm().x(), at_stop.x());
  EXPECT_LT(stage.position_mm().x(), 100.0);
  EXPECT_NEAR(stage.position_mm().y() / stage.position_mm().x(), 0.5, 1e-4);  // still on the line
  for (std::size_t i = 1; i < counter.rises_[0].size(); ++i)
    ASSERT_GE(counter.rises_[0][i] - counter.rises_[0][i - 1], 2 * stage.config().step_high_cycles);
}

TEST(EmergencyStop, HoldsUntilReleasedAndTheNextMoveStillArrivesExactly) {
  Stage stage{StageConfig{}};
  const auto planned_end = stage.move_to({10.0, 0.0, 0.0}, 0);
  stage.run_until(planned_end / 2, [](const StageEvent&) {});
  const auto end = stage.emergency_stop(planned_end / 2);
  stage.run_until(end, [](const StageEvent&) {});
  EXPECT_THAT(error_of([&] { stage.move_to({0, 0, 0}, end); }), HasSubstr("held by an emergency stop"));
  stage.release();
  stage.run_until(stage.move_to({10.0, 5.0, 0.0}, end), [](const StageEvent&) {});
  EXPECT_EQ(stage.position_pulses(), (std::array<std::int64_t, 3>{10'000, 10'000, 0}));
}

TEST(EmergencyStop, AtRestHoldsAtOnce) {
  Stage stage{StageConfig{}};
  EXPECT_EQ(stage.emergency_stop(42), 42U);
  EXPECT_TRUE(stage.held());
}

// Whatever else is wrong with the call: no move begins behind an emergency stop.
TEST(EmergencyStop, HoldsAlsoWhereItCannotStop) {
  Stage stage{StageConfig{}};
  const auto planned_end = stage.move_to({50.0, 20.0, 0.0}, 0);
  EXPECT_THAT(error_of([&] { stage.emergency_stop(planned_end / 2); }),
              StartsWith("emergency stop: the pin change at cycle 0 has not been handed over"));
  EXPECT_TRUE(stage.held());
  stage.run_until(planned_end / 2, [](const StageEvent&) {});
  EXPECT_THAT(error_of([&] { stage.emergency_stop(planned_end / 4); }),
              StartsWith("emergency stop: found cycle"));
  const auto end = stage.emergency_stop(planned_end / 2);  // now it does
  EXPECT_LT(end, planned_end);
  stage.run_until(end, [](const StageEvent&) {});
  EXPECT_LT(stage.position_mm().x(), 49.5);
  EXPECT_THAT(error_of([&] { stage.move_to({0, 0, 0}, end); }), HasSubstr("held by an emergency stop"));
  stage.release();
  EXPECT_EQ(stage.resume(end), end);
}

TEST(EmergencyStop, BeforeTheFirstStepMovesNothing) {
  Stage stage{StageConfig{}};
  stage.move_to({10.0, 0.0, 0.0}, 0);
  stage.run_until(1, [](const StageEvent&) {});
  stage.run_until(stage.emergency_stop(1), [](const StageEvent&) {});
  EXPECT_EQ(stage.position_pulses()[0], 0);
}

RC_GTEST_PROP(EmergencyStopProperty, PinsAndReadBackAgreeFromAnyMoment, ()) {
  Stage stage{StageConfig{}};
  const auto coordinate = rc::gen::map(rc::gen::inRange(0, 30'001), [](int um) { return um / 1000.0; });
  const Eigen::Vector3d target(*coordinate, *coordinate, 0.0);
  const auto planned_end = stage.move_to(target, 0);
  const std::uint64_t stop_cycle =
      planned_end * static_cast<std::uint64_t>(*rc::gen::inRange(0, 1001)) / 1000;
  PinCounter counter;
  stage.run_until(stop_cycle, std::ref(counter));
  const auto end = stage.emergency_stop(stop_cycle);
  RC_ASSERT(end <= planned_end + 2);
  stage.run_until(end, std::ref(counter));
  RC_ASSERT(!stage.next_event_cycle());
  RC_ASSERT(counter.position_ == stage.position_pulses());
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    RC_ASSERT(stage.position_mm()[axis] <= target[axis] + 0.0006);
    RC_ASSERT(stage.position_mm()[axis] >= 0.0);
  }
}

// ---- feed hold ----

TEST(FeedHold, StopsOnTheLineAndResumesToTheTarget) {
  Stage stage{StageConfig{}};
  const Eigen::Vector3d target(40.0, 10.0, 0.0);
  const auto planned_end = stage.move_to(target, 0);
  PinCounter counter;
  const std::uint64_t hold_cycle = planned_end / 3;  // in time to stop short of the target
  stage.run_until(hold_cycle, std::ref(counter));
  const auto held_at = stage.feed_hold(hold_cycle);
  stage.run_until(held_at, std::ref(counter));
  EXPECT_FALSE(stage.held());
  EXPECT_FALSE(stage.moving(held_at));
  EXPECT_NEAR(stage.position_mm().y() / stage.position_mm().x(), 0.25, 1e-4);
  EXPECT_LT(stage.position_mm().x(), 40.0);
  const auto end = stage.resume(held_at + 1000);
  stage.run_until(end, std::ref(counter));
  EXPECT_EQ(stage.position_pulses(), (std::array<std::int64_t, 3>{40'000, 20'000, 0}));
  EXPECT_EQ(counter.position_, stage.position_pulses());
}

TEST(FeedHold, TwiceRemembersTheSameTarget) {
  Stage stage{StageConfig{}};
  const auto planned_end = stage.move_to({40.0, 0.0, 0.0}, 0);
  stage.run_until(planned_end / 2, [](const StageEvent&) {});
  const auto held_at = stage.feed_hold(planned_end / 2);
  stage.run_until(planned_end / 2 + 10, [](const StageEvent&) {});
  EXPECT_EQ(stage.feed_hold(planned_end / 2 + 10), held_at);
  stage.run_until(held_at, [](const StageEvent&) {});
  stage.run_until(stage.resume(held_at), [](const StageEvent&) {});
  EXPECT_EQ(stage.position_pulses()[0], 40'000);
}

TEST(FeedHold, AtRestDoesNothingAndThereIsNothingToResume) {
  Stage stage{StageConfig{}};
  EXPECT_EQ(stage.feed_hold(42), 42U);
  EXPECT_EQ(stage.resume(50), 50U);
}

TEST(FeedHold, AnEmergencyStopForgetsTheTarget) {
  Stage stage{StageConfig{}};
  const auto planned_end = stage.move_to({40.0, 0.0, 0.0}, 0);
  stage.run_until(planned_end / 2, [](const StageEvent&) {});
  const auto held_at = stage.feed_hold(planned_end / 2);
  stage.run_until(held_at, [](const StageEvent&) {});
  stage.emergency_stop(held_at);
  stage.release();
  EXPECT_EQ(stage.resume(held_at + 10), held_at + 10);
}

// ---- what is refused ----

TEST(Stage, RefusesATargetOutOfTravel) {
  Stage stage{StageConfig{}};
  EXPECT_EQ(error_of([&] {
              stage.move_to({0.0, 200.5, 0.0}, 0);
            }),
            "axis y: found position 200.5 mm, expected 0..200 mm (travel)");
  EXPECT_THAT(error_of([&] {
                stage.move_to({0.0, NAN, 0.0}, 0);
              }),
              StartsWith("axis y: found position nan mm"));
  EXPECT_EQ(stage.next_event_cycle(), std::nullopt);
}

TEST(Stage, RefusesAMoveBeforeTheLastIsOver) {
  Stage stage{StageConfig{}};
  const auto end = stage.move_to({1.0, 0.0, 0.0}, 0);
  EXPECT_THAT(error_of([&] {
                stage.move_to({2.0, 0.0, 0.0}, end - 1);
              }),
              StartsWith("move: found start cycle"));
  EXPECT_THAT(error_of([&] { stage.move_to({2.0, 0.0, 0.0}, end); }), HasSubstr("has not been handed over"));
}

TEST(Stage, RefusesAStopInThePastOrWithPinChangesLeft) {
  Stage stage{StageConfig{}};
  const auto end = stage.move_to({1.0, 0.0, 0.0}, 0);
  EXPECT_THAT(error_of([&] { stage.emergency_stop(end / 2); }), HasSubstr("has not been handed over"));
  stage.run_until(end, [](const StageEvent&) {});
  EXPECT_THAT(error_of([&] { stage.emergency_stop(end - 1); }), StartsWith("emergency stop: found cycle"));
}

TEST(Stage, RefusesAConfigurationThatCannotWork) {
  const auto message = [](const std::function<void(StageConfig&)>& change) {
    StageConfig config;
    change(config);
    return error_of([&] { Stage stage{config}; });
  };
  EXPECT_EQ(message([](StageConfig& c) { c.clock_hz = 1e6; }),
            "axis x: 400 mm/s needs 400000 steps/s, expected at most 125000 with 4 high cycles of a 1000000 "
            "Hz clock; lower "
            "the speed or the gear");
  EXPECT_THAT(message([](StageConfig& c) { c.clock_hz = 0; }), StartsWith("stage clock: found 0 Hz"));
  EXPECT_THAT(message([](StageConfig& c) { c.step_high_cycles = 0; }),
              StartsWith("step pulse: found 0 cycles"));
  EXPECT_THAT(message([](StageConfig& c) { c.axes[2].lead_mm = -5; }),
              StartsWith("axis z: found lead -5 mm"));
  EXPECT_THAT(message([](StageConfig& c) { c.axes[1].gear_denominator = 0; }),
              StartsWith("axis y: found 100000 pulses"));
  EXPECT_THAT(message([](StageConfig& c) {
                c.axes[0].travel = {5, 5};
              }),
              StartsWith("axis x: found travel 5..5 mm"));
  EXPECT_THAT(message([](StageConfig& c) { c.axes[0].overtravel_mm = 0; }),
              StartsWith("axis x: found overtravel 0 mm"));
  EXPECT_THAT(message([](StageConfig& c) { c.axes[0].limits.jerk7_mm_s3 = 0; }),
              StartsWith("jerk limit 7: found 0"));
  EXPECT_THAT(error_of([] {
                Stage stage{StageConfig{}, Eigen::Vector3d(-1, 0, 0)};
              }),
              StartsWith("axis x: found position -1"));
}

// ---- courses piece by piece ----

TEST(Track, PulsesFollowTheCourseThereAndBack) {
  Stage stage({}, {100.0, 100.0, 0.0});
  PinCounter counter;
  constexpr std::uint32_t kPiece = 1000;  // 0.1 ms
  double last_mm = 100.0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    const std::uint64_t cycle = i * kPiece;
    stage.run_until(cycle, std::ref(counter));
    ASSERT_LE(std::abs(stage.position_mm().x() - last_mm), 0.51e-3) << i;  // half a pulse at a piece's end
    last_mm = 100.0 + 2.0 * std::sin(static_cast<double>(i + 1) * 2e-3);
    stage.track(0, last_mm, cycle, kPiece);
  }
  stage.run_until(4001 * kPiece, std::ref(counter));
  EXPECT_EQ(counter.position_[0] + 100'000, stage.position_pulses()[0]);
  EXPECT_EQ(counter.position_[1], 0);
  const auto& rises = counter.rises_[0];
  ASSERT_GT(rises.size(), 5000U);
  for (std::size_t i = 1; i < rises.size(); ++i) ASSERT_GE(rises[i] - rises[i - 1], 8U);  // high and low
  EXPECT_EQ(counter.turns_[0].size(), 4U);  // up at the start, and where the sine turns
  // A straight move goes on from where the course ended.
  EXPECT_FALSE(stage.next_event_cycle());
  stage.move_to({101.0, 100.0, 0.0}, 4001 * kPiece);
  stage.run_until(4001 * kPiece + 10'000'000, std::ref(counter));
  EXPECT_EQ(stage.position_pulses()[0], 101'000);
}

TEST(Track, IsRefusedDuringAMoveAndWhenHeld) {
  Stage stage({}, {100.0, 100.0, 0.0});
  stage.move_to({110.0, 100.0, 0.0}, 0);
  EXPECT_THAT(error_of([&] { stage.track(1, 101.0, 5, 100); }), HasSubstr("end of the move before"));
  stage.run_until(10, [](const StageEvent&) {});
  stage.emergency_stop(10);
  EXPECT_THAT(error_of([&] { stage.track(1, 101.0, 50'000'000, 100); }), HasSubstr("held by an emergency"));
  Stage other({}, {100.0, 100.0, 0.0});
  EXPECT_THAT(error_of([&] { other.track(1, NAN, 5, 100); }), HasSubstr("axis y: found nan mm"));
  EXPECT_THAT(error_of([&] { other.track(1, 1.0, 5, 0); }), HasSubstr("at least 1 cycle"));
}

TEST(Track, RefusesAPlaceOrASpeedThatTheAxisHasNot) {
  Stage stage{StageConfig{}};
  EXPECT_EQ(
      error_of([&] { stage.track(1, 500.0, 0, 1'000'000); }),
      "axis y: found a course to 500 mm, expected -25..225 mm (where a stop that begins at a limit switch "
      "ends)");
  EXPECT_THAT(error_of([&] { stage.track(0, -25.1, 0, 1'000'000); }),
              StartsWith("axis x: found a course to -25.1"));
  EXPECT_EQ(
      error_of([&] { stage.track(1, 100.0, 0, 1'000'000); }),
      "axis y: 100 mm in 1000000 cycles need 2000000 steps/s, expected at most 1250000 with 4 high cycles "
      "of a 10000000 Hz clock");
  EXPECT_THAT(error_of([&] { stage.track(3, 1.0, 0, 1'000'000); }), StartsWith("track: found axis 3"));
  EXPECT_EQ(stage.next_event_cycle(), std::nullopt);
  // As fast as the steps can come, and as far as the switches allow.
  stage.track(1, 62.5, 0, 1'000'000);
  stage.run_until(1'000'100, [](const StageEvent&) {});
  EXPECT_EQ(stage.position_pulses()[1], 125'000);
  stage.track(0, -1.5, 1'000'100, 1'000'000);
  stage.run_until(2'000'200, [](const StageEvent&) {});
  EXPECT_EQ(stage.position_pulses()[0], -1500);
  EXPECT_TRUE(stage.pins(0).limit_negative);
}

TEST(Stage, PlannedIsThePlanAtAClockCycle) {
  Stage stage({}, {100.0, 100.0, 0.0});
  const std::uint64_t over = stage.move_to({103.0, 96.0, 0.0}, 1000);
  const Move plan = plan_move({100.0, 100.0, 0.0}, {103.0, 96.0, 0.0}, {});
  EXPECT_EQ(stage.planned(0, 0).position_mm, 100.0);
  const std::uint64_t middle = 1008 + 500'000;  // 50 ms behind the set-up of the directions
  const AxisStates expected = plan.sample(0.05);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    EXPECT_NEAR(stage.planned(axis, middle).position_mm, expected.position_mm[i], 1e-9);
    EXPECT_NEAR(stage.planned(axis, middle).velocity_mm_s, expected.velocity_mm_s[i], 1e-6);
    EXPECT_NEAR(stage.planned(axis, middle).acceleration_mm_s2, expected.acceleration_mm_s2[i], 1e-4);
  }
  EXPECT_NEAR(stage.planned(1, over).position_mm, 96.0, 1e-12);
  EXPECT_EQ(stage.planned(1, over).velocity_mm_s, 0.0);
}

TEST(Stage, QuietMovesArriveAtTheSamePulsesAndLeaveLittleVibration) {
  StageConfig config;
  const Mode mode{38.0, 0.05};
  config.quiet = QuietMoves{{mode, 0.1}, 0.002};
  const Eigen::Vector3d from(100, 100, 0), to(104, 103, 0);
  const StageMove quiet = plan_stage_move(config, from, to);
  EXPECT_NEAR(quiet.profile.end.position_mm, 5.0, 1e-12);
  EXPECT_LE(worst_residual_mm(quiet.profile, config.quiet->band), 0.002 * (1.0 + 1e-9));
  EXPECT_GT(worst_residual_mm(plan_stage_move({}, from, to).profile, config.quiet->band), 0.01);
  Stage stage(config, from);
  const std::uint64_t over = stage.move_to(to, 0);
  stage.run_until(over, [](const StageEvent&) {});
  EXPECT_EQ(stage.position_pulses()[0], 104'000);
  EXPECT_EQ(stage.position_pulses()[1], 206'000);
}

TEST(Stage, IndexStandsWhereItIsSet) {
  StageConfig config;
  config.axes[0].index_mm = 5.0;
  Stage at(config, {15.0, 1.0, 0.0}), off(config, {10.0, 1.0, 0.0});
  EXPECT_TRUE(at.pins(0).index);
  EXPECT_FALSE(off.pins(0).index);
  config.axes[0].index_mm = NAN;
  EXPECT_THAT(error_of([&] { Stage stage(config); }), HasSubstr("axis x: found the index at nan mm"));
}

}  // namespace
}  // namespace meltstage::motion
