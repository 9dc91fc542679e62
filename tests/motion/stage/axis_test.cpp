// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/axis.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "motion/stage/stage_model.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A machine on the servo axis: switches and index stand in a frame of the machine, the encoder counts from
/// where power came on.
class Machine {
 public:
  explicit Machine(double at_mm, const AxisControlConfig& config = config_for_tests())
      : control(config, 0.0), power_on_mm_(at_mm), axis_(model()) {}

  static AxisControlConfig config_for_tests() {
    AxisControlConfig config;
    config.travel = {0.0, 50.0};
    config.limits = asymmetric_limits(100, 1000, 1000, 5e4, 5e4);
    config.homing.search_mm = 80.0;
    config.homing.lead_mm = 5.0;
    return config;
  }

  static AxisModelConfig model() {
    AxisModelConfig config;
    config.coulomb_friction_n = 2.0;
    return config;
  }

  /// Place at which the control last saw the axis; the axis may have moved on by a count since.
  double seen_mm() const { return last_place_mm_; }
  double place_mm() const { return power_on_mm_ + axis_.encoder_mm(); }

  void cycle() {
    AxisInputs inputs;
    inputs.encoder_mm = encoder_stuck ? last_encoder_mm_ : axis_.encoder_mm();
    const double place = place_mm();
    inputs.home = home_stuck || (place <= home_mm && !home_dead);
    inputs.limit_negative = place <= home_mm - 1.0;
    inputs.limit_positive = place >= 54.0;
    inputs.emergency_stop = emergency_stop;
    const double turn = std::floor((place - index_mm) / 5.0),
                 before = std::floor((last_place_mm_ - index_mm) / 5.0);
    if (turn != before && !index_dead)
      inputs.index_mm = std::max(turn, before) * 5.0 + index_mm - power_on_mm_;
    last_place_mm_ = place;
    last_encoder_mm_ = inputs.encoder_mm;
    const AxisOutputs outputs = control.step(inputs);
    if (outputs.enabled) axis_.step(outputs.command);
    fastest_mm_s = std::max(fastest_mm_s, std::abs(outputs.command.velocity_mm_s));
    highest_mm = std::max(highest_mm, place);
    const AxisPhase now = control.phase();
    if (phases.empty() || phases.back() != now) phases.push_back(now);
  }

  void run(double time_s) {
    for (int i = 0; i < static_cast<int>(time_s / kControlCycle_s); ++i) cycle();
  }

  /// Until the axis rests; false after 30 s.
  bool run_to_rest() {
    for (int i = 0; i < static_cast<int>(30.0 / kControlCycle_s); ++i) {
      cycle();
      if (control.at_rest()) return true;
    }
    return false;
  }

  bool home() {
    cycle();  // the switches have been seen
    control.home();
    return run_to_rest() && control.homed();
  }

  AxisControl control;
  double home_mm = -0.5, index_mm = 1.5;  // places of the switch's edge and of one index
  bool home_dead = false, home_stuck = false, index_dead = false, encoder_stuck = false,
       emergency_stop = false;
  double fastest_mm_s = 0.0, highest_mm = -1e9;
  std::vector<AxisPhase> phases;

 private:
  static constexpr double kControlCycle_s = 1.25e-4;
  double power_on_mm_;
  AxisModel axis_;
  double last_place_mm_ = power_on_mm_, last_encoder_mm_ = 0.0;
};

TEST(Homing, FindsTheIndexAboveTheSwitch) {
  Machine machine(23.4);
  ASSERT_TRUE(machine.home());
  EXPECT_THAT(machine.phases,
              ::testing::ElementsAre(AxisPhase::unhomed, AxisPhase::homing_search, AxisPhase::homing_clear,
                                     AxisPhase::homing_latch, AxisPhase::homing_index, AxisPhase::ready));
  // the machine's zero is the index at place 1.5
  machine.run(0.2);
  EXPECT_NEAR(machine.control.position_mm(), machine.seen_mm() - 1.5, 1e-9);
  EXPECT_NEAR(machine.control.homing_report().index_turns, 2.0 / 5.0, 0.001);
  EXPECT_LE(machine.fastest_mm_s, 20.0 + 1e-9);
}

TEST(Homing, IsTheSameFromEverywhereAlsoOffAScatteringSwitch) {
  std::vector<double> zeros;
  for (const double from_mm : {-1.5, -0.4, 0.1, 7.0, 49.0})
    for (const double switch_mm : {-0.55, -0.45}) {
      Machine machine(from_mm);
      machine.home_mm = switch_mm;
      ASSERT_TRUE(machine.home()) << from_mm;
      zeros.push_back(machine.seen_mm() - machine.control.position_mm());
    }
  for (const double zero : zeros) EXPECT_NEAR(zero, 1.5, 1e-9);
}

TEST(Homing, TakesTheSwitchTwiceTheSecondTimeSlowly) {
  Machine machine(20.0);
  machine.control.home();
  double fastest_at_edge = 0.0;
  while (machine.control.phase() != AxisPhase::homing_latch) machine.cycle();
  machine.fastest_mm_s = 0.0;
  while (machine.control.phase() != AxisPhase::ready) machine.cycle();
  fastest_at_edge = machine.fastest_mm_s;
  EXPECT_LE(fastest_at_edge, 2.0 + 1e-9);
}

TEST(Homing, SaysWhatIsMissing) {
  const auto fault_with = [](const std::function<void(Machine&)>& change) {
    Machine machine(10.0);
    change(machine);
    machine.control.home();
    EXPECT_TRUE(machine.run_to_rest());
    EXPECT_FALSE(machine.control.homed());
    EXPECT_EQ(machine.control.phase(), AxisPhase::fault);
    return machine.control.fault();
  };
  EXPECT_EQ(fault_with([](Machine& m) { m.home_dead = true; }), AxisFault::switch_not_found);  // by the limit
  EXPECT_EQ(fault_with([](Machine& m) { m.home_mm = -500.0; }), AxisFault::switch_not_found);  // by the way
  EXPECT_EQ(fault_with([](Machine& m) { m.home_stuck = true; }), AxisFault::switch_stuck);
  EXPECT_EQ(fault_with([](Machine& m) { m.index_dead = true; }), AxisFault::index_not_found);
  EXPECT_EQ(fault_with([](Machine& m) { m.index_mm = m.home_mm + 0.2; }), AxisFault::index_near_switch);
  EXPECT_EQ(fault_with([](Machine& m) { m.index_mm = m.home_mm + 4.9; }), AxisFault::index_near_switch);
  EXPECT_EQ(fault_with([](Machine& m) { m.emergency_stop = true; }), AxisFault::emergency_stop);
}

TEST(Homing, GivenUpLeavesTheAxisUnhomed) {
  Machine machine(20.0);
  machine.control.home();
  machine.run(0.1);
  machine.control.stop();
  ASSERT_TRUE(machine.run_to_rest());
  EXPECT_EQ(machine.control.phase(), AxisPhase::unhomed);
  EXPECT_TRUE(machine.home());
}

TEST(AxisControl, GoesWhereItIsToldOnceHomed) {
  Machine machine(10.0);
  EXPECT_THAT(error_of([&] { machine.control.move_to(5.0); }), HasSubstr("\"unhomed\", expected it homed"));
  ASSERT_TRUE(machine.home());
  machine.control.move_to(30.0);
  machine.run(0.2);
  machine.control.move_to(12.5);  // another target on the way
  ASSERT_TRUE(machine.run_to_rest());
  machine.run(0.3);
  EXPECT_NEAR(machine.control.position_mm(), 12.5, 2e-4);
  EXPECT_NEAR(machine.place_mm(), 14.0, 2e-4);
  EXPECT_EQ(error_of([&] { machine.control.move_to(50.5); }),
            "move: found 50.5 mm, expected 0..50 mm (travel)");
  EXPECT_THAT(error_of([&] { machine.control.move_to(NAN); }), HasSubstr("found nan mm"));
}

TEST(Jog, EndsAtTheSoftLimit) {
  Machine machine(10.0);
  ASSERT_TRUE(machine.home());
  machine.control.jog(80.0);
  ASSERT_TRUE(machine.run_to_rest());
  machine.run(0.3);
  EXPECT_NEAR(machine.control.position_mm(), 50.0, 2e-4);
  EXPECT_LE(machine.highest_mm, 51.5 + 2e-3);
  EXPECT_EQ(machine.control.fault(), AxisFault::none);
}

TEST(Jog, IsNoFasterThanTheAxis) {
  Machine machine(10.0);
  ASSERT_TRUE(machine.home());
  machine.control.jog(1e6);
  ASSERT_TRUE(machine.run_to_rest());
  EXPECT_NEAR(machine.control.position_mm(), 50.0, 2e-4);
  EXPECT_EQ(machine.control.fault(), AxisFault::none);
}

TEST(Jog, StopsWhenTheKeyIsLetGo) {
  Machine machine(10.0);
  ASSERT_TRUE(machine.home());
  machine.control.jog(20.0);
  machine.run(0.5);
  const double released_mm = machine.control.position_mm();
  machine.control.stop();
  ASSERT_TRUE(machine.run_to_rest());
  EXPECT_EQ(machine.control.phase(), AxisPhase::ready);
  EXPECT_NEAR(machine.control.position_mm(), released_mm + 0.4, 0.2);
}

TEST(Jog, BeforeHomingEndsAtTheLimitSwitchAndOnlyLeavesIt) {
  Machine machine(30.0);
  machine.control.jog(50.0);
  ASSERT_TRUE(machine.run_to_rest());
  EXPECT_EQ(machine.control.fault(), AxisFault::limit_positive);
  EXPECT_LT(machine.highest_mm, 54.0 + 1.0);  // 50 mm/s under the stop limits
  machine.control.reset();
  machine.cycle();
  EXPECT_THAT(error_of([&] { machine.control.jog(5.0); }), HasSubstr("expected a jog away from it"));
  machine.control.jog(-5.0);
  machine.run(1.0);
  EXPECT_EQ(machine.control.phase(), AxisPhase::jogging);
  EXPECT_LT(machine.place_mm(), 53.0);
}

TEST(EmergencyStop, StopsTheAxisWithoutLosingItsPosition) {
  Machine machine(10.0);
  ASSERT_TRUE(machine.home());
  machine.control.move_to(45.0);
  machine.run(0.25);  // at 100 mm/s
  machine.emergency_stop = true;
  const double pressed_mm = machine.control.position_mm();
  ASSERT_TRUE(machine.run_to_rest());
  EXPECT_EQ(machine.control.fault(), AxisFault::emergency_stop);
  machine.run(0.2);
  EXPECT_LT(machine.control.position_mm() - pressed_mm, 1.2);  // 100 mm/s, 8000 mm/s2, 2e6 mm/s3: 0.8 mm
  EXPECT_NEAR(machine.control.position_mm(), machine.seen_mm() - 1.5, 1e-9);
  EXPECT_TRUE(machine.control.homed());
  EXPECT_THAT(error_of([&] { machine.control.reset(); }), HasSubstr("still pressed"));
  EXPECT_THAT(error_of([&] { machine.control.move_to(45.0); }),
              StartsWith("move: found the axis in phase \"fault\""));
  machine.emergency_stop = false;
  machine.cycle();
  machine.control.reset();
  machine.control.move_to(45.0);
  ASSERT_TRUE(machine.run_to_rest());
  machine.run(0.3);
  EXPECT_NEAR(machine.place_mm(), 46.5, 2e-4);
}

TEST(FollowingError, SwitchesTheDriveOffAndAsksForHoming) {
  Machine machine(10.0);
  ASSERT_TRUE(machine.home());
  machine.control.move_to(40.0);
  machine.run(0.1);
  EXPECT_EQ(machine.control.fault(), AxisFault::none);
  machine.encoder_stuck = true;
  ASSERT_TRUE(machine.run_to_rest());
  EXPECT_EQ(machine.control.fault(), AxisFault::following_error);
  EXPECT_FALSE(machine.control.homed());
  AxisInputs inputs;
  inputs.encoder_mm = 3.0;
  EXPECT_FALSE(machine.control.step(inputs).enabled);
  EXPECT_EQ(machine.control.step(inputs).command.position_mm, 3.0);
  machine.control.reset();
  EXPECT_EQ(machine.control.phase(), AxisPhase::unhomed);
}

// The stop goes on blind if the encoder's supply went with the loop.
TEST(FollowingError, IsWatchedWhileTheAxisStops) {
  Machine machine(10.0);
  ASSERT_TRUE(machine.home());
  machine.control.move_to(45.0);
  machine.run(0.25);  // at 100 mm/s
  machine.emergency_stop = true;
  machine.encoder_stuck = true;
  ASSERT_TRUE(machine.run_to_rest());
  EXPECT_EQ(machine.control.fault(), AxisFault::following_error);
  EXPECT_FALSE(machine.control.homed());
  EXPECT_FALSE(machine.control.step({}).enabled);
  machine.control.reset();
  EXPECT_EQ(machine.control.phase(), AxisPhase::unhomed);
}

TEST(FollowingError, IsAnEncoderWithoutANumber) {
  for (const double reads_mm : {std::nan(""), HUGE_VAL, -HUGE_VAL})
    for (const bool while_stopping : {false, true}) {
      AxisControl control(Machine::config_for_tests());
      control.set_homed(0.0);
      control.move_to(40.0);
      AxisInputs inputs;
      for (int i = 0; i < 2000; ++i) inputs.encoder_mm = control.step(inputs).command.position_mm;
      inputs.emergency_stop = while_stopping;
      const double before_mm = control.step(inputs).command.position_mm;
      inputs.emergency_stop = false;
      inputs.encoder_mm = reads_mm;
      const AxisOutputs out = control.step(inputs);
      EXPECT_EQ(control.fault(), AxisFault::following_error);
      EXPECT_EQ(control.phase(), AxisPhase::fault);
      EXPECT_FALSE(control.homed());
      EXPECT_FALSE(out.enabled);
      EXPECT_NEAR(out.command.position_mm, before_mm, 0.1);  // stays a number
      EXPECT_THAT(error_of([&] { control.reset(); }), StartsWith("reset: found the encoder at "));
      inputs.encoder_mm = 7.0;
      control.step(inputs);
      control.reset();
      EXPECT_EQ(control.step(inputs).command.position_mm, 7.0);
    }
}

// It is stopping already, and the first fault stays; what the switch says counts again after reset().
TEST(EmergencyStop, OntoALimitSwitchKeepsItsFault) {
  AxisControl control(Machine::config_for_tests());
  control.jog(50.0);
  AxisInputs inputs;
  for (int i = 0; i < 2000; ++i) inputs.encoder_mm = control.step(inputs).command.position_mm;
  inputs.emergency_stop = true;
  inputs.encoder_mm = control.step(inputs).command.position_mm;
  ASSERT_EQ(control.phase(), AxisPhase::stopping);
  inputs.limit_positive = true;
  while (!control.at_rest()) inputs.encoder_mm = control.step(inputs).command.position_mm;
  EXPECT_EQ(control.fault(), AxisFault::emergency_stop);
  inputs.emergency_stop = false;
  control.step(inputs);
  control.reset();
  EXPECT_THAT(error_of([&] { control.jog(5.0); }), HasSubstr("expected a jog away from it"));
}

TEST(AxisControl, ObeysItsLimitsInEveryPhase) {
  MotionState last;
  bool first = true;
  const double cycle_s = 1.25e-4;
  AxisInputs inputs;
  double encoder_mm = 0.0, encoder_before_mm = 0.0;
  AxisControl control(Machine::config_for_tests());
  control.home();
  for (int i = 0; i < 80'000; ++i) {
    inputs.encoder_mm = encoder_mm;
    inputs.home = encoder_mm < -20.0;
    inputs.index_mm.reset();
    if (encoder_mm > -18.0 && encoder_before_mm <= -18.0) inputs.index_mm = -18.0;
    if (control.phase() == AxisPhase::ready) control.move_to(i % 2 == 0 ? 40.0 : 3.0);
    const MotionState now = control.step(inputs).command;
    if (!first) {
      ASSERT_LE(std::abs(now.velocity_mm_s - last.velocity_mm_s), (1000.0 + 1e-6) * cycle_s) << i;
      ASSERT_LE(std::abs(now.acceleration_mm_s2 - last.acceleration_mm_s2), (5e4 + 1e-3) * cycle_s) << i;
      ASSERT_LE(std::abs(now.velocity_mm_s), 100.0 + 1e-9);
    }
    first = false;
    last = now;
    encoder_before_mm = encoder_mm;
    encoder_mm = now.position_mm;
  }
  EXPECT_TRUE(control.homed());
}

TEST(AxisControl, RefusesWhatCannotBe) {
  const auto message = [](const std::function<void(AxisControlConfig&)>& change) {
    AxisControlConfig config;
    change(config);
    return error_of([&] { AxisControl control(config); });
  };
  EXPECT_EQ(message([](AxisControlConfig& c) { c.homing.slow_mm_s = 0.0; }),
            "axis control: slow homing speed: found 0 mm/s, expected a finite number above 0");
  EXPECT_THAT(message([](AxisControlConfig& c) { c.homing.index_margin_share = 0.5; }),
              HasSubstr("0.5 of a turn"));
  EXPECT_THAT(message([](AxisControlConfig& c) { c.travel = {5.0, 5.0}; }), HasSubstr("travel 5..5 mm"));
  EXPECT_THAT(message([](AxisControlConfig& c) { c.travel.max_mm = INFINITY; }),
              HasSubstr("travel 0..inf mm"));
  EXPECT_THAT(message([](AxisControlConfig& c) { c.travel.min_mm = -INFINITY; }),
              HasSubstr("travel -inf..200 mm"));
  EXPECT_THAT(error_of([] { AxisControl control(Machine::config_for_tests(), NAN); }),
              HasSubstr("encoder at nan mm"));
  EXPECT_NE(message([](AxisControlConfig& c) { c.stop_limits.jerk1_mm_s3 = -1.0; }), "");
  AxisControl control({});
  EXPECT_THAT(error_of([&] { control.jog(0.0); }), HasSubstr("found 0 mm/s"));
  EXPECT_THAT(error_of([&] { control.reset(); }), HasSubstr("expected a fault"));
}

// ---- on a path of several axes ----

/// An ideal drive whose control stands homed at `at_mm`.
AxisControl coupled(double at_mm) {
  AxisControl control(Machine::config_for_tests(), at_mm);
  control.set_homed(at_mm);
  control.couple();
  return control;
}

AxisOutputs follow(
    AxisControl& control, const MotionState& command,
    const std::function<void(AxisInputs&)>& change = [](AxisInputs&) {}) {
  AxisInputs inputs;
  inputs.encoder_mm = command.position_mm;
  change(inputs);
  return control.follow(inputs, command);
}

TEST(Coordinated, FollowsThePathAndGoesOnAloneAfterwards) {
  AxisControl control = coupled(10.0);
  for (int i = 1; i <= 100; ++i) {
    const AxisOutputs out = follow(control, {10.0 + 0.01 * i, 80.0, 0.0, 0.0});
    ASSERT_EQ(out.command.position_mm, 10.0 + 0.01 * i);
    ASSERT_TRUE(out.enabled);
  }
  EXPECT_EQ(control.phase(), AxisPhase::coordinated);
  EXPECT_THAT(error_of([&] { control.decouple(); }),
              HasSubstr("at 80 mm/s, expected it coupled and at rest"));
  EXPECT_THAT(error_of([&] { control.move_to(20.0); }), HasSubstr("\"coordinated\""));
  EXPECT_THAT(error_of([&] { control.step({}); }), StartsWith("step: found the axis coupled"));
  follow(control, {11.0, 0.0, 0.0, 0.0});
  control.decouple();
  EXPECT_EQ(control.phase(), AxisPhase::ready);
  control.move_to(12.0);
  AxisInputs inputs;
  inputs.encoder_mm = 11.0;
  double last_mm = 11.0;
  while (!control.at_rest()) {
    inputs.encoder_mm = control.step(inputs).command.position_mm;
    ASSERT_LT(std::abs(inputs.encoder_mm - last_mm), 0.02);
    last_mm = inputs.encoder_mm;
  }
  EXPECT_NEAR(control.position_mm(), 12.0, 1e-6);
}

TEST(Coordinated, IsNotStoppedOnItsOwnAndKeepsTheSoftLimit) {
  AxisControl control = coupled(49.0);
  follow(control, {49.5, 50.0, 0.0, 0.0});
  EXPECT_THAT(error_of([&] { control.stop(); }), StartsWith("stop: found the axis coupled to a path"));
  EXPECT_EQ(control.phase(), AxisPhase::coordinated);
  follow(control, {50.02, 50.0, 0.0, 0.0});
  EXPECT_EQ(control.fault(), AxisFault::soft_limit);
}

TEST(Coordinated, NeedsAnAxisThatIsHomed) {
  AxisControl control(Machine::config_for_tests());
  EXPECT_THAT(error_of([&] { control.couple(); }), HasSubstr("\"unhomed\", expected it homed"));
  EXPECT_THAT(error_of([&] { control.follow({}, {}); }), HasSubstr("not coupled"));
  EXPECT_THAT(error_of([&] { control.decouple(); }), HasSubstr("expected it coupled"));
  EXPECT_THAT(error_of([&] { control.set_homed(NAN); }), HasSubstr("found nan mm"));
}

TEST(Coordinated, WatchesWhatAnAxisAloneWatches) {
  const auto fault_of = [](double at_mm, const MotionState& command,
                           const std::function<void(AxisInputs&)>& change) {
    AxisControl control = coupled(at_mm);
    follow(control, command, change);
    return control.fault();
  };
  const MotionState up{20.0, 50.0, 0.0, 0.0}, down{20.0, -50.0, 0.0, 0.0};
  EXPECT_EQ(fault_of(20.0, up, [](AxisInputs&) {}), AxisFault::none);
  EXPECT_EQ(fault_of(20.0, up, [](AxisInputs& in) { in.emergency_stop = true; }), AxisFault::emergency_stop);
  EXPECT_EQ(fault_of(20.0, up, [](AxisInputs& in) { in.limit_positive = true; }), AxisFault::limit_positive);
  EXPECT_EQ(fault_of(20.0, down, [](AxisInputs& in) { in.limit_negative = true; }),
            AxisFault::limit_negative);
  EXPECT_EQ(fault_of(20.0, down, [](AxisInputs& in) { in.limit_positive = true; }), AxisFault::none);
  EXPECT_EQ(fault_of(20.0, up, [](AxisInputs& in) { in.encoder_mm -= 0.2; }), AxisFault::following_error);
  EXPECT_EQ(fault_of(49.0, {50.02, 10.0, 0.0, 0.0}, [](AxisInputs&) {}), AxisFault::soft_limit);
  EXPECT_EQ(fault_of(1.0, {-0.02, -10.0, 0.0, 0.0}, [](AxisInputs&) {}), AxisFault::soft_limit);
}

TEST(Coordinated, WatchesTheFollowingErrorUntilThePathHasBroughtItToRest) {
  AxisControl control = coupled(10.0);
  follow(control, {12.0, 80.0, 0.0, 0.0}, [](AxisInputs& in) { in.emergency_stop = true; });
  ASSERT_EQ(control.phase(), AxisPhase::stopping);
  EXPECT_FALSE(
      follow(control, {12.3, 20.0, -1000.0, 0.0}, [](AxisInputs& in) { in.encoder_mm = 12.0; }).enabled);
  EXPECT_EQ(control.fault(), AxisFault::following_error);
  EXPECT_FALSE(control.homed());
}

TEST(Coordinated, TakesACommandWithoutANumberForAFollowingError) {
  for (const MotionState& command :
       {MotionState{NAN, 80.0, 0.0, 0.0}, {12.0, NAN, 0.0, 0.0}, {HUGE_VAL, 80.0, 0.0, 0.0}}) {
    AxisControl control = coupled(12.0);
    follow(control, command, [](AxisInputs& in) { in.encoder_mm = 12.0; });
    EXPECT_EQ(control.fault(), AxisFault::following_error);
  }
}

TEST(Coordinated, AfterAFaultThePathBringsItToRestAndThePositionStays) {
  AxisControl control = coupled(10.0);
  follow(control, {12.0, 80.0, 0.0, 0.0}, [](AxisInputs& in) { in.emergency_stop = true; });
  EXPECT_EQ(control.phase(), AxisPhase::stopping);
  EXPECT_EQ(follow(control, {12.3, 20.0, -1000.0, 0.0}).command.position_mm, 12.3);
  EXPECT_EQ(control.phase(), AxisPhase::stopping);
  follow(control, {12.4, 0.0, 0.0, 0.0});
  EXPECT_EQ(control.phase(), AxisPhase::fault);
  EXPECT_TRUE(control.homed());
  control.decouple();
  control.reset();
  EXPECT_EQ(control.phase(), AxisPhase::ready);
  EXPECT_NEAR(control.position_mm(), 12.4, 1e-12);
}

}  // namespace
}  // namespace meltstage::motion
