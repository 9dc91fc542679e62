// SPDX-License-Identifier: Apache-2.0
// GUARD: latching, the way to heater off, safe_en, at temperature.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <string>

#include "guard_bench.hpp"

namespace meltstage::chip {
namespace {

using namespace spec;

// ---- Latching
// -------------------------------------------------------------------------------------------------------------

class GuardFaults : public testing::TestWithParam<unsigned> {};

TEST_P(GuardFaults, LatchWhileRunningAndOnlyThenWhereSo) {
  const auto bit = static_cast<std::uint16_t>(1u << GetParam());
  for (bool running : {false, true}) {
    Bench b;
    if (running) b.run();
    b.g.cause_q = bit;
    b.clock();
    const bool latches = running || (kFaultRunOnly & bit) == 0;
    EXPECT_EQ(b.g.fault_q, latches ? bit : 0) << running;
    EXPECT_EQ(b.g.heater_q, 0);
    EXPECT_EQ(b.g.first_q, latches ? GetParam() + 1 : 0u);
    EXPECT_EQ(b.g.run_q, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(All, GuardFaults, testing::Range(0u, kFaultCount));

struct Trip {
  const char* name;
  Fault fault;
  std::function<void(Bench&)> cause;  // set for one clock
};

class GuardTrips : public testing::TestWithParam<Trip> {};

TEST_P(GuardTrips, HeaterIsOffTwoClocksAfterTheCause) {
  Bench b;
  b.run();
  GetParam().cause(b);
  b.clock();
  b.clock();
  EXPECT_EQ(b.g.heater_q, 0);
  EXPECT_EQ(b.g.fault_q, mask(GetParam().fault));
  EXPECT_EQ(b.g.run_q, 0);
}

TEST_P(GuardTrips, StayUntilCleared) {
  Bench b;
  b.run();
  GetParam().cause(b);
  b.clock();
  b.in.inhibit = b.in.mem_bad = b.in.state_illegal = false;
  b.sample(kRoom);
  b.clocks(5000);
  EXPECT_EQ(b.g.fault_q & mask(GetParam().fault), mask(GetParam().fault));
  EXPECT_EQ(b.g.heater_q, 0);
  b.in.run = true;
  b.clock();
  EXPECT_EQ(b.g.run_q, 0) << "no run command before the clear";
  b.in.clear = true;
  b.clock();
  EXPECT_EQ(b.g.fault_q, 0);
  EXPECT_EQ(b.g.first_q, 0);
  b.clocks(10);
  EXPECT_EQ(b.g.run_q, 0) << "a clear does not start the heater";
  b.run();
}

INSTANTIATE_TEST_SUITE_P(
    Causes, GuardTrips,
    testing::Values(Trip{"OverTemp", kFaultOverTemp,
                         [](Bench& b) {
                           b.set(kRegTMax, 255);
                           b.in.sens_done = b.in.sens_ok = true;
                           b.in.sens_pv = 26 * 64;
                         }},
                    Trip{"Param", kFaultParam, [](Bench& b) { b.in.mem_bad = true; }},
                    Trip{"IllegalState", kFaultState, [](Bench& b) { b.in.state_illegal = true; }},
                    Trip{"Overrun", kFaultState, [](Bench& b) { b.in.overrun = true; }},
                    Trip{"Inhibit", kFaultInhibit, [](Bench& b) { b.in.inhibit = true; }}),
    [](const auto& trip) { return std::string(trip.param.name); });

TEST(GuardFirstFault, IsKeptWhenOthersFollow) {
  Bench b;
  b.g.cause_q = mask(kFaultInhibit);
  b.clock();
  b.g.cause_q = mask(kFaultOverTemp);
  b.clock();
  EXPECT_EQ(b.g.fault_q, mask(kFaultInhibit) | mask(kFaultOverTemp));
  EXPECT_EQ(b.g.first_q, kFaultInhibit + 1);
}

TEST(GuardFirstFault, IsTheLowestOfSeveralAtOnce) {
  Bench b;
  b.g.cause_q = mask(kFaultParam) | mask(kFaultHeaterFb);
  b.clock();
  EXPECT_EQ(b.g.first_q, kFaultHeaterFb + 1);
}

TEST(GuardClear, KeepsWhatIsStillPresent) {
  Bench b;
  b.in.inhibit = true;
  b.clocks(3);
  b.in.clear = true;
  b.clock();
  EXPECT_EQ(b.g.fault_q, mask(kFaultInhibit));
  EXPECT_EQ(b.g.first_q, kFaultInhibit + 1);
}

// ---- Permission
// -----------------------------------------------------------------------------------------------------------

TEST(GuardRun, NeedsASampleNoCauseAndNoFault) {
  Bench no_sample;
  no_sample.g = Guard{};
  EXPECT_FALSE(no_sample.g.run_allowed());
  no_sample.in.run = true;
  no_sample.clocks(2);
  EXPECT_EQ(no_sample.g.run_q, 0);
  Bench cause;
  cause.g.cause_q = mask(kFaultUnderTemp);
  EXPECT_FALSE(cause.g.run_allowed());
  Bench fault;
  fault.g.fault_q = mask(kFaultUnderTemp);
  EXPECT_FALSE(fault.g.run_allowed());
}

TEST(GuardRun, StopTurnsOffInTheNextClock) {
  Bench b;
  b.run();
  b.in.stop = b.in.run = true;
  b.clock();
  EXPECT_EQ(b.g.heater_q, 0);
  EXPECT_EQ(b.g.run_q, 0);
}

TEST(GuardRun, InhibitTurnsOffInTheNextClock) {
  Bench b;
  b.run();
  b.in.inhibit = true;
  b.clock();
  EXPECT_EQ(b.g.heater_q, 0);
}

TEST(GuardRun, HeaterFollowsThePulses) {
  Bench b;
  b.run();
  b.in.pwm = false;
  b.clock();
  EXPECT_EQ(b.g.heater_q, 0);
  b.in.pwm = true;
  b.clock();
  EXPECT_EQ(b.g.heater_q, 1);
}

TEST(GuardSafeEn, TogglesEvery1024ClocksWhileRunning) {
  Bench b;
  b.in.run = true;
  b.clock();
  for (int half = 0; half < 4; ++half) {
    EXPECT_EQ(b.g.safe_en_q, half % 2);
    b.clocks(1023);
    EXPECT_EQ(b.g.safe_en_q, half % 2);
    b.clock();
  }
  b.clocks(1024);
  ASSERT_EQ(b.g.safe_en_q, 1);
  b.in.stop = true;
  b.clock();
  EXPECT_EQ(b.g.safe_en_q, 0);
  b.clocks(5000);
  EXPECT_EQ(b.g.safe_en_q, 0);
}

// ---- At temperature
// -------------------------------------------------------------------------------------------------------

struct AtTemp : Bench {
  AtTemp() {
    set(kRegHostWd, 0);
    set(kRegSampleTimeout, 65535);
    in.sp_work = kRoom;
    run();
  }
};

TEST(GuardAtTemp, WindowIsInclusiveOnBothSides) {
  for (int off : {64, 65, -64, -65}) {  // AT_WINDOW 1.0 degC = 64
    AtTemp b;
    b.sample(kRoom + off);
    b.tenths(60);
    EXPECT_EQ(b.g.at_temp_q, off * off == 64 * 64) << off;
  }
}

TEST(GuardAtTemp, RisesAfterTheDwellAndFallsAtOnce) {
  AtTemp b;
  b.sample(kRoom + 100);
  b.sample(kRoom);
  b.tenths(49);
  EXPECT_EQ(b.g.at_temp_q, 0);
  b.tenths(1);
  EXPECT_EQ(b.g.at_temp_q, 1);
  b.sample(kRoom + 65);
  EXPECT_EQ(b.g.at_temp_q, 0);
}

TEST(GuardAtTemp, NotWhileRampingStoppedOrManual) {
  for (int which : {0, 1, 2}) {
    AtTemp b;
    b.tenths(51);
    ASSERT_EQ(b.g.at_temp_q, 1);
    if (which == 0) b.in.ramping = true;
    if (which == 1) b.in.stop = true;
    if (which == 2) b.set(kRegMode, 1);
    b.clocks(2);
    EXPECT_EQ(b.g.at_temp_q, 0) << which;
  }
}

}  // namespace
}  // namespace meltstage::chip
