// SPDX-License-Identifier: Apache-2.0
// GUARD: every detector at its threshold and time, and held samples.
#include <gtest/gtest.h>

#include <utility>

#include "cmodel/algor.hpp"
#include "guard_bench.hpp"

namespace meltstage::chip {
namespace {

using namespace spec;

// ---- Thresholds and times
// -------------------------------------------------------------------------------------------------

TEST(GuardOverTemp, TripsAtTheLimitExactly) {
  for (auto [t_max, trips] : {std::pair{1500, 9600}, {1501, 9607}, {0, 0}, {5000, 32000}}) {
    Bench b;
    b.set(kRegDtdtMax, 0);
    b.set(kRegTMax, t_max);
    b.sample(trips - 1);
    EXPECT_FALSE(b.cause(kFaultOverTemp)) << t_max;
    b.sample(trips);
    EXPECT_TRUE(b.cause(kFaultOverTemp)) << t_max;
  }
}

TEST(GuardUnderTemp, TripsBelowTheLimit) {
  for (auto [t_min, last] : {std::pair{0, 0}, {-400, -2560}, {-1, -6}, {1000, 6400}}) {
    Bench b;
    b.set(kRegDtdtMax, 0);
    b.set(kRegTMin, t_min);
    b.sample(last);
    EXPECT_FALSE(b.cause(kFaultUnderTemp)) << t_min;
    b.sample(last - 1);
    EXPECT_TRUE(b.cause(kFaultUnderTemp)) << t_min;
  }
}

TEST(GuardLimits, RefusedSampleDoesNotCount) {
  Bench b;
  b.in.sens_pv = 32767;
  b.refuse(false);
  EXPECT_FALSE(b.cause(kFaultOverTemp));
  EXPECT_EQ(b.g.pv_q, kRoom);
}

class GuardBadSamples : public testing::TestWithParam<bool> {};

TEST_P(GuardBadSamples, TripAtBadMaxInARow) {
  const bool dev_fault = GetParam();
  for (int bad_max : {1, 3, 15}) {
    Bench b;
    b.set(kRegBadMax, bad_max);
    for (int i = 1; i < bad_max; ++i) b.refuse(dev_fault);
    EXPECT_EQ(b.g.cause_q, 0) << bad_max;
    EXPECT_EQ(b.g.sensor_ok(b.p), true);
    b.refuse(dev_fault);
    EXPECT_EQ(b.g.cause_q, mask(dev_fault ? kFaultSensorFault : kFaultSensorFrame)) << bad_max;
    EXPECT_EQ(b.g.sensor_ok(b.p), false);
    b.sample(kRoom);
    EXPECT_EQ(b.g.cause_q, 0) << "a good sample ends the cause";
  }
}

TEST_P(GuardBadSamples, AGoodSampleBeginsTheCountAnew) {
  Bench b;
  for (int i = 0; i < 10; ++i) {
    b.refuse(GetParam());
    b.refuse(GetParam());
    b.sample(kRoom);
  }
  EXPECT_EQ(b.g.cause_q, 0);
  EXPECT_EQ(b.g.sensor_errors_q, 20);
}

INSTANTIATE_TEST_SUITE_P(Kinds, GuardBadSamples, testing::Bool());

TEST(GuardSamples, ARefusedSampleHoldsTheTemperature) {
  Bench b;
  b.sample(1700);
  b.refuse(true);
  EXPECT_EQ(b.g.pv_q, 1700);
  EXPECT_EQ(b.g.bad_q, 1);
  EXPECT_EQ(b.g.samples_q, 2);
}

TEST(GuardSamples, SlopeIsTheChangeBetweenAcceptedSamples) {
  Bench b;
  b.set(kRegDtdtMax, 0);
  EXPECT_EQ(b.g.slope_q, 0) << "the first sample";
  b.sample(kRoom + 5);
  EXPECT_EQ(b.g.slope_q, 5);
  b.refuse(true);
  b.sample(-32768);
  b.sample(32767);
  EXPECT_EQ(b.g.slope_q, 32767) << "saturated";
}

TEST(GuardStale, TripsAtTheTimeExactly) {
  for (int timeout : {1, 20, 65535}) {
    Bench b;
    b.set(kRegHostWd, 0);
    b.set(kRegSampleTimeout, timeout);
    b.tenths(timeout - 1);
    EXPECT_FALSE(b.cause(kFaultSensorStale)) << timeout;
    b.tenths(1);
    EXPECT_TRUE(b.cause(kFaultSensorStale)) << timeout;
    b.sample(kRoom);
    EXPECT_FALSE(b.cause(kFaultSensorStale)) << timeout;
  }
}

TEST(GuardRate, TripsAboveTheLimitOfASecondInBothDirections) {
  for (auto [limit, last] : {std::pair{100, 640}, {1, 6}}) {  // 10.0 degC = 640
    for (int sign : {1, -1}) {
      Bench b;
      b.set(kRegTMin, -400);
      b.set(kRegBadMax, 1);
      b.set(kRegDtdtMax, limit);
      b.sample(kRoom + sign * last / 2);
      b.sample(kRoom + sign * last);
      EXPECT_FALSE(b.cause(kFaultRate));
      b.sample(kRoom + sign * (last + 1));
      EXPECT_TRUE(b.cause(kFaultRate)) << sign * limit;
    }
  }
}

TEST(GuardRate, TripsAboveHalfTheLimitBetweenTwoSamples) {
  for (int step : {320, 321}) {
    Bench b;
    b.set(kRegBadMax, 1);
    b.set(kRegDtdtMax, 100);
    b.sample(kRoom + step);
    EXPECT_EQ(b.cause(kFaultRate), step == 321) << step;
  }
}

TEST(GuardRate, CountsFromTheBeginningOfEachSecond) {
  Bench b;
  b.set(kRegDtdtMax, 100);
  for (int i = 1; i <= 20; ++i) {  // 5 degC a second, for 20 s
    b.tenths(10);
    b.sample(kRoom + i * 320);
  }
  EXPECT_EQ(b.g.cause_q, 0);
  EXPECT_EQ(b.g.pv_q, kRoom + 20 * 320);
  b.tenths(9);  // less than a second: the same samples closer together
  b.sample(kRoom + 21 * 320);
  b.sample(kRoom + 22 * 320);
  EXPECT_EQ(b.g.pv_q, kRoom + 21 * 320) << "refused";
}

TEST(GuardRate, NothingIsAJumpUntilTwoSamplesAgree) {
  Bench b;
  b.g = Guard{};
  for (int pv : {0, +temp(90), -300, +temp(60)}) {
    b.sample(pv);
    EXPECT_EQ(b.g.pv_q, pv);
    EXPECT_EQ(b.g.cause_q & mask(kFaultRate), 0);
  }
  b.sample(temp(60) + 10);
  b.sample(temp(100));
  EXPECT_EQ(b.g.pv_q, temp(60) + 10) << "refused";
}

TEST(GuardRate, ASingleJumpIsRefusedAsABadSample) {
  Bench b;
  b.run();
  for (int i = 0; i < 10; ++i) {
    b.sample(32767);  // above T_MAX
    EXPECT_EQ(b.g.bad_q, 1);
    EXPECT_EQ(b.g.pv_q, kRoom);
    b.sample(kRoom);
    EXPECT_EQ(b.g.bad_q, 0);
  }
  EXPECT_EQ(b.g.fault_q, 0);
  EXPECT_EQ(b.g.sensor_errors_q, 10);
}

TEST(GuardRate, TheWayBackFromAWrongSampleIsNoJump) {
  for (int phase = 0; phase < 12; ++phase) {  // wherever in the second the wrong one comes
    Bench b;
    b.set(kRegDtdtMax, 100);
    for (int i = 0; i < 40; ++i) {
      b.tenths(1);
      b.sample(i == 20 + phase ? kRoom - 310 : kRoom + 16 * (i % 2));
    }
    EXPECT_EQ(b.g.sensor_errors_q, 0) << phase;
    EXPECT_EQ(b.g.cause_q, 0) << phase;
  }
}

TEST(GuardRate, AJumpThatStaysTripsAtBadMaxAndBecomesTheTemperature) {
  Bench b;
  for (int i = 1; i < 3; ++i) {
    b.sample(kRoom + 3000);
    EXPECT_EQ(b.g.cause_q, 0) << i;
  }
  b.sample(kRoom + 3000);
  EXPECT_EQ(b.g.cause_q, mask(kFaultRate));
  EXPECT_EQ(b.g.pv_q, kRoom + 3000);
  b.sample(kRoom + 3000);
  EXPECT_EQ(b.g.cause_q, 0);
}

TEST(GuardRate, AnOverTemperatureThatStaysIsOneToo) {
  Bench b;
  for (int i = 0; i < 3; ++i) b.sample(temp(150));
  EXPECT_EQ(b.g.cause_q, mask(kFaultOverTemp) | mask(kFaultRate));
}

TEST(GuardRate, IsOffAtZeroAndForTheFirstSample) {
  Bench b;
  EXPECT_FALSE(b.cause(kFaultRate)) << "0 to 25 degC";
  b.set(kRegDtdtMax, 0);
  b.sample(9000);
  EXPECT_FALSE(b.cause(kFaultRate));
}

struct NotHeating : Bench {
  NotHeating() {
    set(kRegHostWd, 0);
    set(kRegSampleTimeout, 65535);
    in.limited = true;
    run();
  }
};

TEST(GuardNotHeating, TripsAtTheEndOfTheWindow) {
  NotHeating b;
  b.tenths(359);
  EXPECT_FALSE(b.cause(kFaultNotHeating));
  b.tenths(1);
  b.clock();  // the trip has a flop of its own
  EXPECT_TRUE(b.cause(kFaultNotHeating));
}

TEST(GuardNotHeating, TheLeastRiseBeginsANewWindow) {
  for (int rise : {127, 128}) {  // LBA_RISE 2.0 degC = 128
    NotHeating b;
    b.tenths(359);
    b.samples(kRoom + rise);
    b.tenths(2);
    b.clock();
    EXPECT_EQ((b.g.fault_q & mask(kFaultNotHeating)) != 0, rise < 128) << rise;
  }
}

// A head that was cooling falls on under full power; the rise counts from there.
TEST(GuardNotHeating, CountsTheRiseFromTheLowest) {
  for (int rise : {127, 128}) {
    NotHeating b;
    b.set(kRegDtdtMax, 0);
    b.tenths(10);
    b.samples(kRoom - 300);
    b.tenths(349);
    b.samples(kRoom - 300 + rise);
    b.tenths(2);
    b.clock();
    EXPECT_EQ((b.g.fault_q & mask(kFaultNotHeating)) != 0, rise < 128) << rise;
  }
}

// A fall alone begins no new window: an open heater trips in time.
TEST(GuardNotHeating, AFallBeginsNoNewWindow) {
  NotHeating b;
  for (int i = 1; i <= 359; ++i) {
    b.sample(kRoom - i);
    b.tenths(1);
  }
  EXPECT_FALSE(b.cause(kFaultNotHeating));
  b.tenths(1);
  b.clock();
  EXPECT_TRUE(b.cause(kFaultNotHeating));
}

TEST(GuardNotHeating, IsOffAtZeroTimeBelowTheLimitAndInManual) {
  for (int which : {0, 1, 2}) {
    NotHeating b;
    if (which == 0) b.set(kRegLbaTime, 0);
    if (which == 1) b.in.limited = false;
    if (which == 2) b.set(kRegMode, 1);
    b.tenths(1000);
    EXPECT_EQ(b.g.fault_q, 0) << which;
  }
}

// Heating above the limit. Without time for a fall the test of the reading fails at once.
struct HoldPower : Bench {
  explicit HoldPower(unsigned over = 1) {
    set(kRegHostWd, 0);
    set(kRegSampleTimeout, 65535);
    set(kRegLbaTime, 0);
    in.hold_limit = 1000;
    in.duty = 1000 + over;
    run();
    samples(kRoom);
  }
};

// A trip: the test begins, and has failed in the next clock.
TEST(GuardHoldPower, TripsAboveTheLimitAtItsTime) {
  for (unsigned over : {0u, 1u}) {
    HoldPower b(over);
    b.tenths(299);
    EXPECT_EQ(b.g.hold_test_q, 0);
    b.in.tenth = true;
    b.clock();
    b.clock();
    EXPECT_EQ(b.g.hold_test_q, over);
    b.clock();
    EXPECT_EQ(b.cause(kFaultHoldPower), over == 1) << over;
  }
}

// The duty has been lowered: a fall by LBA_RISE 2 degC = 128 is awaited for twice LBA_TIME 18 s.
struct HoldTest : HoldPower {
  HoldTest() {
    set(kRegLbaTime, 180);
    set(kRegDtdtMax, 0);
    tenths(300);
    EXPECT_EQ(g.hold_test_q, 1);
    in.duty = 500;
  }
};

TEST(GuardHoldPower, AReadingThatDoesNotFallTripsAtItsTime) {
  HoldTest b;
  b.expect_trip_after(360, kFaultHoldPower);
}

// A time that can't be doubled ends at the top of its counter.
TEST(GuardHoldPower, TheTestEndsWithALongLbaTimeToo) {
  HoldTest b;
  b.set(kRegLbaTime, 40000);
  b.g.hold_q = 65534;
  b.clock();
  EXPECT_FALSE(b.cause(kFaultHoldPower));
  b.tenths(2);
  EXPECT_EQ(b.g.fault_q, mask(kFaultHoldPower));
}

// Whatever the loop's segment is meanwhile, but self-tuning.
TEST(GuardHoldPower, TheTestCountsInEachSegment) {
  for (const unsigned segment : {kSegFull, kSegPid, kSegOff}) {
    HoldTest b;
    b.in.segment = static_cast<std::uint8_t>(segment);
    b.tenths(361);
    EXPECT_EQ(b.g.fault_q, mask(kFaultHoldPower)) << segment;
  }
}

TEST(GuardHoldPower, AReadingThatFallsIsNoFault) {
  for (int fall : {127, 128}) {
    HoldTest b;
    b.tenths(100);
    b.samples(kRoom - fall);
    EXPECT_EQ(b.g.hold_test_q, fall < 128);
    b.tenths(300);
    EXPECT_EQ(b.g.fault_q, fall < 128 ? mask(kFaultHoldPower) : 0) << fall;
  }
}

// A head that was warming rises on for a while.
TEST(GuardHoldPower, CountsTheFallFromTheHighest) {
  for (int fall : {127, 128}) {
    HoldTest b;
    b.samples(kRoom + 300);
    b.samples(kRoom + 300 - fall);
    EXPECT_EQ(b.g.hold_test_q, fall < 128) << fall;
  }
}

// A load that the reading has followed is known, up to a sixteenth of full duty more and for this set-point.
TEST(GuardHoldPower, WhatHasBeenShownIsNotAskedAgain) {
  HoldTest b;
  b.samples(kRoom - 128);
  ASSERT_EQ(b.g.hold_test_q, 0);
  b.in.segment = kSegPid;
  b.in.duty = 4095;
  b.samples(kRoom - 128);
  b.tenths(1000);
  EXPECT_EQ(b.g.hold_test_q, 0);
  b.in.duty = 4096;
  b.samples(kRoom - 128);
  b.tenths(299);
  EXPECT_EQ(b.g.hold_test_q, 0);
  b.tenths(1);
  EXPECT_EQ(b.g.hold_test_q, 1);
  b.samples(kRoom - 256);
  ASSERT_EQ(b.g.hold_test_q, 0);
  b.samples(kRoom - 256);
  b.tenths(400);
  EXPECT_EQ(b.g.hold_test_q, 0);
  b.in.sp_work += 1;
  b.clock();
  b.tenths(300);
  EXPECT_EQ(b.g.hold_test_q, 1);
}

TEST(GuardHoldPower, AStopAndManualModeForgetTheLoad) {
  for (const bool stop : {true, false}) {
    HoldTest b;
    b.samples(kRoom - 128);
    ASSERT_EQ(b.g.hold_test_q, 0);
    b.in.duty = 1001;
    if (stop) {
      b.in.stop = true;
      b.clock();
      b.run();
    } else {
      b.set(kRegMode, 1);
      b.clock();
      b.set(kRegMode, 0);
    }
    b.samples(kRoom - 128);
    b.tenths(301);
    EXPECT_EQ(b.g.hold_test_q, 1) << stop;
  }
}

TEST(GuardHoldPower, AStopManualModeAndSelfTuningEndTheTest) {
  for (int which : {0, 1, 2}) {
    HoldTest b;
    if (which == 0) b.in.stop = true;
    if (which == 1) b.set(kRegMode, 1);
    if (which == 2) b.in.segment = kSegNone;
    b.clocks(2);
    EXPECT_EQ(b.g.hold_test_q, 0) << which;
    b.tenths(1000);
    EXPECT_EQ(b.g.fault_q, 0) << which;
  }
}

TEST(GuardHoldPower, IsOffWithoutKffAtZeroTimeAndOutsideTheBand) {
  for (int which : {0, 1, 2}) {
    HoldPower b;
    if (which == 0) b.set(kRegKff, 0);
    if (which == 1) b.set(kRegHoldTime, 0);
    if (which == 2) b.in.segment = kSegFull;
    b.tenths(1000);
    EXPECT_EQ(b.g.fault_q, 0) << which;
  }
}

TEST(GuardHoldPower, ARiseBeginsANewWindow) {
  for (int rise : {127, 128}) {  // LBA_RISE 2.0 degC = 128
    HoldPower b;
    b.tenths(299);
    b.samples(kRoom + rise);
    b.tenths(2);
    b.clock();
    EXPECT_EQ(b.cause(kFaultHoldPower) || b.g.fault_q != 0, rise < 128) << rise;
  }
}

// A head that was cooling falls on for a while; the rise counts from there.
TEST(GuardHoldPower, CountsTheRiseFromTheLowest) {
  for (int rise : {127, 128}) {
    HoldPower b;
    b.set(kRegDtdtMax, 0);
    b.tenths(10);
    b.samples(kRoom - 300);
    b.tenths(289);
    b.samples(kRoom - 300 + rise);
    b.tenths(2);
    b.clock();
    EXPECT_EQ((b.g.fault_q & mask(kFaultHoldPower)) != 0, rise < 128) << rise;
  }
}

// What a job needed says nothing of the next one.
TEST(GuardHoldPower, BeginsWithoutTheDutyOfTheRunBefore) {
  HoldPower b;
  b.set(kRegHoldTime, 5);
  b.in.duty = 1000;
  b.g.duty_sum_q = 16 * 65536;
  b.in.stop = true;
  b.clock();
  b.run();
  b.tenths(20);
  EXPECT_EQ(b.g.fault_q, 0);
}

// Noise makes the loop leave its segment, and the duty its limit, for single ticks.
TEST(GuardHoldPower, GoesOnCountingAfterATickAtFullPower) {
  HoldPower b;
  for (int i = 0; i < 299; ++i) {
    b.tenths(1);
    b.in.segment = kSegFull;
    b.tenths(1);
    b.in.segment = kSegPid;
  }
  EXPECT_FALSE(b.cause(kFaultHoldPower));
  b.tenths(1);
  b.clock();
  EXPECT_TRUE(b.cause(kFaultHoldPower) || b.g.fault_q != 0);
}

TEST(GuardHoldPower, NoiseOfTheReadingBeginsNoNewWindow) {
  HoldPower b;
  b.set(kRegDtdtMax, 0);
  for (int i = 0; i < 299; ++i) {
    b.tenths(1);
    b.sample(kRoom + (i % 2 == 0 ? 150 : -150));
  }
  EXPECT_FALSE(b.cause(kFaultHoldPower));
  b.tenths(1);
  b.clock();
  EXPECT_TRUE(b.cause(kFaultHoldPower) || b.g.fault_q != 0);
}

TEST(GuardHoldPower, NoiseOfTheDutyBeginsNoNewWindow) {
  HoldPower b;
  b.in.hold_limit = 10000;
  for (int i = 0; i < 600 && b.g.fault_q == 0; ++i) {
    b.tenths(1);
    b.in.duty = i % 2 == 0 ? 30000 : 0;
    b.sample(kRoom);
  }
  EXPECT_EQ(b.g.fault_q, mask(kFaultHoldPower));
}

// 20 degC above T_AMB at zero duty.
struct Frozen : Bench {
  explicit Frozen(int above = temp(20) + 1) {
    set(kRegHostWd, 0);
    set(kRegDtdtMax, 0);
    set(kRegSampleTimeout, 65535);
    set(kRegZeroRise, 0);
    in.duty = 0;
    sample(kRoom + above);
    in.run = true;
    clocks(2);
  }
  void seconds_of_samples(int tenths_count, int pv) {
    for (int i = 0; i < tenths_count; ++i) {
      tenths(1);
      sample(pv);
    }
  }
};

TEST(GuardFrozen, TripsAfterLbaTimeWithoutAMove) {
  Frozen b;
  const int pv = b.g.pv_q;
  b.seconds_of_samples(359, pv);
  EXPECT_EQ(b.g.cause_q, 0);
  b.tenths(1);
  b.clock();
  EXPECT_EQ(b.g.fault_q, mask(kFaultSensorStale));
}

TEST(GuardFrozen, AnyMoveBeginsAnew) {
  Frozen b;
  const int pv = b.g.pv_q;
  b.seconds_of_samples(350, pv);
  b.sample(pv + 1);
  b.seconds_of_samples(350, pv + 1);
  EXPECT_EQ(b.g.fault_q, 0);
}

TEST(GuardFrozen, NotInACoolHeadNorWithDutyNorStoppedNorSwitchedOff) {
  for (int which : {0, 1, 2, 3}) {
    Frozen b(which == 0 ? temp(20) : temp(20) + 1);
    if (which == 1) b.in.duty = 1;
    if (which == 2) {
      b.in.stop = true;
      b.clock();
    }
    if (which == 3) b.set(kRegLbaTime, 0);
    b.seconds_of_samples(1000, b.g.pv_q);
    EXPECT_EQ(b.g.cause_q, 0) << which;
  }
}

TEST(GuardRails, ASingleUpsetCanNotGivePermission) {
  for (bool second : {false, true}) {
    for (bool running : {false, true}) {
      Bench b;
      if (running) b.run();
      (second ? b.g.run_nq : b.g.run_q) ^= 1;
      b.clock();
      EXPECT_EQ(b.g.heater_q, 0);
      EXPECT_EQ(b.g.run_q, 0);
      b.clock();
      EXPECT_EQ(b.g.fault_q, mask(kFaultState));
    }
  }
}

struct Excursion : Bench {
  Excursion() {
    set(kRegHostWd, 0);
    set(kRegSampleTimeout, 65535);
    set(kRegDtdtMax, 0);
    in.sp_work = kRoom;
    run();
    clocks(2);
  }
};

TEST(GuardExcursion, TripsAboveTheLimitAtItsTime) {
  for (int over : {960, 961}) {  // EXC_LIMIT 15.0 degC = 960
    Excursion b;
    b.sample(kRoom + over);
    b.tenths(49);
    EXPECT_FALSE(b.cause(kFaultExcursion));
    b.tenths(1);
    EXPECT_EQ(b.cause(kFaultExcursion), over > 960) << over;
  }
}

TEST(GuardExcursion, IsNotCountedUntilALowerSetPointIsReached) {
  Excursion b;
  b.set(kRegTMin, -400);
  b.sample(kRoom + 2000);
  b.sample(kRoom);
  b.in.sp_work = kRoom - 2000;
  b.tenths(1000);
  EXPECT_EQ(b.g.fault_q, 0);
  b.sample(kRoom - 2000 + 64);  // the window's top
  b.clocks(2);
  b.sample(kRoom - 2000 + 961);
  b.tenths(50);
  b.clock();
  EXPECT_EQ(b.g.fault_q, mask(kFaultExcursion));
}

struct ZeroRise : Bench {
  ZeroRise() {
    set(kRegSampleTimeout, 65535);
    set(kRegDtdtMax, 0);
    in.duty = 0;
  }
};

TEST(GuardZeroRise, TripsAtTheRiseAfterTheWait) {
  for (int rise : {511, 512}) {  // ZERO_RISE 8.0 degC = 512
    ZeroRise b;
    b.tenths(300);
    b.sample(kRoom + rise);
    b.clock();
    EXPECT_EQ(b.cause(kFaultZeroRise), rise == 512) << rise;
  }
}

TEST(GuardZeroRise, IsNotCountedDuringTheWait) {
  ZeroRise b;
  b.tenths(299);
  b.sample(kRoom + 2000);
  b.tenths(10);
  EXPECT_FALSE(b.cause(kFaultZeroRise));
}

TEST(GuardZeroRise, CountsFromTheLowestTemperature) {
  ZeroRise b;
  b.tenths(300);
  b.sample(kRoom - 400);
  b.clock();
  b.sample(kRoom + 112);
  b.clock();
  EXPECT_TRUE(b.cause(kFaultZeroRise));
}

TEST(GuardZeroRise, IsOffAtZeroAndWhileHeating) {
  for (int which : {0, 1}) {
    ZeroRise b;
    b.set(kRegHostWd, 0);
    if (which == 0) b.set(kRegZeroRise, 0);
    if (which == 1) {
      b.in.duty = 1;
      b.run();
    }
    b.tenths(400);
    b.sample(kRoom + 2000);
    b.clock();
    EXPECT_FALSE(b.cause(kFaultZeroRise)) << which;
  }
}

TEST(GuardZeroRise, TheFirstSampleIsNoRise) {
  for (int wait : {0, 300}) {
    Bench b;
    b.g = Guard{};
    b.set(kRegZeroWait, wait);
    b.in.duty = 0;
    b.tenths(400);
    b.sample(temp(80));
    b.clocks(3);
    EXPECT_FALSE(b.cause(kFaultZeroRise)) << wait;
    EXPECT_EQ(b.g.fault_q, 0);
  }
}

TEST(GuardHeaterFb, TripsAtItsTime) {
  for (bool fb : {true, false}) {
    Bench b;
    b.feedback_follows = false;
    b.in.heater_fb = false;
    b.set(kRegFbTime, 48);
    if (!fb) {
      b.run();
      b.g.fb_q = 0;
    }
    b.in.heater_fb = fb;
    b.clocks(768);
    EXPECT_FALSE(b.cause(kFaultHeaterFb)) << fb;
    b.clock();
    EXPECT_TRUE(b.cause(kFaultHeaterFb)) << fb;
  }
}

TEST(GuardHeaterFb, AMomentOfAgreementBeginsAnew) {
  Bench b;
  b.feedback_follows = false;
  for (int i = 0; i < 10; ++i) {
    b.in.heater_fb = true;
    b.clocks(700);
    b.in.heater_fb = false;
    b.clock();
  }
  EXPECT_EQ(b.g.cause_q, 0);
}

TEST(GuardHeaterFb, IsOffWithoutFbEn) {
  Bench b;
  b.set(kRegCtrl, 0);
  b.feedback_follows = false;
  b.in.heater_fb = true;
  b.clocks(2000);
  EXPECT_EQ(b.g.cause_q, 0);
}

struct Watchdog : Bench {
  Watchdog() {
    set(kRegSampleTimeout, 65535);
    run();
  }
};

TEST(GuardWatchdog, TripsAtItsTime) {
  Watchdog b;
  b.tenths(99);
  EXPECT_EQ(b.g.wd_left(b.p), 1);
  EXPECT_EQ(b.g.fault_q, 0);
  b.tenths(1);
  b.clock();
  EXPECT_EQ(b.g.fault_q, mask(kFaultHostWatchdog));
  EXPECT_EQ(b.g.heater_q, 0);
}

TEST(GuardWatchdog, AGoodFrameBeginsAnew) {
  Watchdog b;
  for (int i = 0; i < 5; ++i) {
    b.tenths(99);
    b.in.good_frame = true;
    b.clock();
    EXPECT_EQ(b.g.wd_left(b.p), 100);
  }
  EXPECT_EQ(b.g.fault_q, 0);
}

TEST(GuardWatchdog, IsOffAtZero) {
  Watchdog b;
  b.set(kRegHostWd, 0);
  b.tenths(60000);
  EXPECT_EQ(b.g.fault_q, 0);
  EXPECT_FALSE(b.g.wd_armed(b.p));
}

TEST(GuardWatchdog, CanBeSwitchedOnWhileHeating) {
  Watchdog b;
  b.set(kRegHostWd, 0);
  b.tenths(500);
  b.in.good_frame = true;  // the frame that writes it
  b.clock();
  b.set(kRegHostWd, 10);
  b.expect_trip_after(10, kFaultHostWatchdog);
}

TEST(GuardWatchdog, AShorterTimeIsInForceAtOnce) {
  Watchdog b;
  b.set(kRegHostWd, 6000);
  b.in.good_frame = true;
  b.clock();
  b.set(kRegHostWd, 10);
  b.tenths(10);
  b.clock();
  EXPECT_EQ(b.g.fault_q, mask(kFaultHostWatchdog));
}

}  // namespace
}  // namespace meltstage::chip
