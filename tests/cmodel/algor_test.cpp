// SPDX-License-Identifier: Apache-2.0
// ALGOR: the law of the paper, segments, anti-windup, derivative, limits, ramp, unit conversions.
#include "cmodel/algor.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

#include "support.hpp"

namespace meltstage::chip {
namespace {

using namespace spec;

constexpr std::uint16_t kCtrlModel = 1, kCtrlDOnPv = 2, kCtrlFf = 4, kCtrlInteger = 8, kCtrlIZero = 64;
constexpr std::uint32_t kFull = 65536;

// A loop at 200 degC set-point, running, every gain and feature off, the bands as wide as they go.
struct Loop {
  Params p = reset_params();
  Algor a;
  std::int32_t product_p = 0, product_i = 0, product_d = 0;  // of the last computation
  AlgorIn in{.params = p,
             .start = false,
             .sample_ok = true,
             .run = true,
             .at_temp = false,
             .ms = false,
             .pv = 0,
             .drop = false,
             .hold_test = false,
             .tuning = false,
             .tune_duty = 0,
             .tune_hold = 0};

  Loop() {
    set(kRegSetpoint, 2000);
    for (Reg reg : {kRegCtrl, kRegKp, kRegKiApproach, kRegKiHold, kRegKd, kRegDFilter, kRegKff}) set(reg, 0);
    set(kRegPreset, 256);
    set(kRegBandFull, 5000);
    set(kRegBandOff, 5000);
  }
  void set(Reg reg, int value) { p.value[reg] = static_cast<std::uint16_t>(value); }
  void clock() {
    a.step(in);
    in.start = in.ms = false;
    if (a.step_q == kStepProportional) product_d = a.work_q;
    if (a.step_q == kStepIntegral) product_p = a.work_q;
    if (a.step_q == kStepSegment) product_i = a.work_q;
  }
  // One computation at a temperature (1/64 degC); the duty after it.
  std::uint32_t tick(int pv, bool sample_ok = true) {
    in.pv = static_cast<std::int16_t>(pv);
    in.start = true;
    in.sample_ok = sample_ok;
    int clocks = 0;
    do {
      clock();
      ++clocks;
    } while (a.done_q == 0 && clocks < 30);
    EXPECT_EQ(clocks, sample_ok ? 19 : 1) << "clocks of one computation";
    clock();
    return a.duty_q;
  }
  // One computation at an error (1/64 degC) from 200 degC.
  std::uint32_t error(int e, bool sample_ok = true) { return tick(12800 - e, sample_ok); }
  // A droplet's trigger pulse.
  void droplets(int n) {
    for (int i = 0; i < n; ++i) {
      in.drop = true;
      clock();
      clock();
      in.drop = false;
      clock();
    }
  }
  void milliseconds(int n) {
    for (int i = 0; i < n; ++i) {
      in.ms = true;
      clock();
    }
  }
};

// ---- Eq. (2)
// --------------------------------------------------------------------------------------------------------------

TEST(Algor, PaperLawIsEquationTwoToTheBit) {
  std::mt19937 random(2023);
  auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  int compared = 0;
  for (int run = 0; run < 400; ++run) {
    Loop loop;
    const std::int64_t kp = below(1 << (1 + below(16)));
    const std::int64_t ki = below(1 << (1 + below(16)));
    const std::int64_t kd = below(1 << (1 + below(16)));
    loop.set(kRegKp, static_cast<int>(kp));
    loop.set(kRegKiApproach, static_cast<int>(ki));
    loop.set(kRegKd, static_cast<int>(kd));
    const int spread = 1 << (1 + below(12));
    std::int64_t sum = 0;
    int past = 0;
    bool first = true;
    for (int n = 0; n < 200; ++n) {
      const int e = below(spread) - (n % 3 == 0 ? spread / 2 : 0);
      const int before = first ? e : past;
      // Gains as fractions: KP 2^-6, KI 2^-14, KD 2^-3; common denominator 2^14.
      const std::int64_t integral = ki * (sum + e);
      const std::int64_t u = ((kp << 8) + (kd << 11)) * e + integral - (kd << 11) * before;
      const bool linear = integral >= 0 && integral <= std::int64_t{kFull} << 14 && u >= 0 &&
                          u >> 14 <= kFull && u <= std::int64_t{kFull} << 14 && e - before < 2048 &&
                          before - e <= 2048;
      if (!linear) continue;
      ASSERT_EQ(loop.error(e), static_cast<std::uint32_t>(u >> 14)) << "run " << run << " step " << n;
      sum += e;
      past = e;
      first = false;
      ++compared;
    }
  }
  EXPECT_GT(compared, 10000);
}

TEST(Algor, FirstStepHasNoDerivative) {
  Loop loop;
  loop.set(kRegKd, 65535);
  EXPECT_EQ(loop.error(1000), 0u);
  EXPECT_EQ(loop.product_d, 0);
}

TEST(Algor, ProductsFitTheirRegistersAtTheCorners) {
  for (int e : {-32768, 32767}) {
    Loop loop;
    loop.set(kRegSetpoint, e > 0 ? 5000 : 0);
    for (Reg reg : {kRegKp, kRegKiApproach, kRegKd}) loop.set(reg, 65535);
    loop.tick(e > 0 ? 32767 : -32768);
    loop.tick(e > 0 ? -32768 : 32767);
    EXPECT_EQ(loop.product_p, 65535LL * loop.a.e_q);
    EXPECT_EQ(loop.product_i, 65535LL * loop.a.e_q);
    EXPECT_EQ(loop.product_d, 65535LL * loop.a.delta_q);
    EXPECT_EQ(loop.a.delta_q, e > 0 ? 32767 : -32768) << "the derivative saturates";
  }
}

TEST(Algor, WholeDegreeErrorTruncatesTowardZero) {
  const int cases[][2] = {{0, 0},   {63, 0},    {64, 64},    {127, 64},   {128, 128},
                          {-63, 0}, {-64, -64}, {-127, -64}, {-128, -128}};
  for (const auto& [e, whole] : cases) {
    Loop loop;
    loop.set(kRegCtrl, kCtrlInteger);
    loop.error(e);
    EXPECT_EQ(loop.a.e_q, whole) << "error " << e;
  }
}

// ---- Segments
// -------------------------------------------------------------------------------------------------------------

TEST(Algor, FullBandBeginsAboveItsBorder) {
  for (auto [band, last] : {std::pair{180, 1152}, {1, 6}, {0, 0}}) {  // 18.0, 0.1, 0 degC in 1/64 degC, floor
    Loop loop;
    loop.set(kRegBandFull, band);
    EXPECT_EQ(loop.error(last), 0u);
    EXPECT_EQ(loop.a.segment_q, kSegPid) << band;
    EXPECT_EQ(loop.error(last + 1), kFull);
    EXPECT_EQ(loop.a.segment_q, kSegFull) << band;
  }
}

TEST(Algor, WidestFullBandIsNeverLeft) {
  Loop loop;
  loop.set(kRegBandFull, 5000);
  loop.error(32000);
  EXPECT_EQ(loop.a.segment_q, kSegPid);
}

TEST(Algor, OffBandBeginsBelowItsBorder) {
  for (auto [band, last] : {std::pair{50, 320}, {1, 6}, {0, 0}}) {
    Loop loop;
    loop.set(kRegBandOff, band);
    loop.set(kRegFfExt, 10000);
    loop.error(-last);
    EXPECT_EQ(loop.a.segment_q, kSegPid) << band;
    EXPECT_EQ(loop.a.duty_q, kFull);
    EXPECT_EQ(loop.error(-last - 1), 0u);
    EXPECT_EQ(loop.a.segment_q, kSegOff) << band;
  }
}

TEST(Algor, ModelSegmentIsFullWhereProportionalAloneExceedsTheLimit) {
  Loop loop;
  loop.set(kRegCtrl, kCtrlModel);
  loop.set(kRegKp, 64);  // 1 duty LSB for 1/64 degC
  loop.set(kRegDutyMax, 100);
  loop.error(0);
  const int limit = static_cast<int>(loop.a.duty_max_q);
  loop.error(limit);
  EXPECT_EQ(loop.a.segment_q, kSegPid);
  loop.error(limit + 1);
  EXPECT_EQ(loop.a.segment_q, kSegFull);
}

TEST(Algor, FeedForwardMovesTheModelSegments) {
  Loop loop;
  loop.set(kRegCtrl, kCtrlModel | kCtrlFf);
  loop.set(kRegKp, 64);
  loop.set(kRegKff, 128);  // 1/32 duty LSB for 1/64 degC: about 400 at 200 degC
  loop.set(kRegTAmb, 0);
  loop.set(kRegDutyMax, 100);
  loop.error(0);
  const int limit = static_cast<int>(loop.a.duty_max_q);
  auto ff = [](int e) { return (12800 - e) / 32 & ~3; };  // PRESET counts in steps of four
  int e = 0;
  while (e + 1 + ff(e + 1) <= limit) ++e;
  loop.error(e);
  EXPECT_EQ(loop.a.segment_q, kSegPid);
  loop.error(e + 1);
  EXPECT_EQ(loop.a.segment_q, kSegFull);
  e = 0;
  while (e - 1 + ff(e - 1) >= 0) --e;
  loop.error(e);
  EXPECT_EQ(loop.a.segment_q, kSegPid);
  loop.error(e - 1);
  EXPECT_EQ(loop.a.segment_q, kSegOff);
}

TEST(Algor, ModelOffNeedsFeedForward) {
  Loop loop;
  loop.set(kRegCtrl, kCtrlModel);
  loop.set(kRegKp, 65535);
  loop.error(-5000);
  EXPECT_EQ(loop.a.segment_q, kSegPid);
  EXPECT_EQ(loop.a.duty_q, 0u);
}

// ---- Integral
// -------------------------------------------------------------------------------------------------------------

TEST(Algor, IntegralStaysWithinZeroAndDutyMax) {
  Loop loop;
  loop.set(kRegKiApproach, 65535);
  loop.set(kRegDutyMax, 3000);
  for (int n = 0; n < 100; ++n) loop.error(5000);
  EXPECT_EQ(loop.a.i_q, loop.a.duty_max_q << 14);
  for (int n = 0; n < 100; ++n) loop.error(-5000);
  EXPECT_EQ(loop.a.i_q, 0u);
}

TEST(Algor, IntegralIsHeldWhileTheOutputIsAtItsLimit) {
  Loop loop;
  loop.set(kRegKiApproach, 1000);
  loop.error(100);
  const std::uint32_t before = loop.a.i_q;
  EXPECT_EQ(before, 100u * 1000u);
  loop.set(kRegKp, 65535);
  EXPECT_EQ(loop.error(100), kFull);
  EXPECT_EQ(loop.a.i_q, before);
  EXPECT_EQ(loop.a.i_held_q, 1);
}

TEST(Algor, IntegralMovesBackWhileTheOutputIsAtItsLimit) {
  Loop loop;
  loop.set(kRegKiApproach, 1000);
  loop.error(100);
  loop.set(kRegFfExt, 10000);
  EXPECT_EQ(loop.error(-10), kFull) << "the added duty alone keeps the output at its limit";
  EXPECT_EQ(loop.a.i_q, 100u * 1000u - 10u * 1000u);
  EXPECT_EQ(loop.a.i_held_q, 0);
}

TEST(Algor, IntegralIsHeldAtZeroOutputUnlessItRises) {
  Loop loop;
  loop.set(kRegKiApproach, 1000);
  loop.error(100);
  loop.set(kRegKp, 65535);
  EXPECT_EQ(loop.error(-50), 0u);
  EXPECT_EQ(loop.a.i_q, 100u * 1000u);
  EXPECT_EQ(loop.a.i_held_q, 1);
}

TEST(Algor, LoweredDutyMaxClampsTheIntegralAtOnce) {
  Loop loop;
  loop.set(kRegKiApproach, 65535);
  for (int n = 0; n < 100; ++n) loop.error(5000);
  loop.set(kRegDutyMax, 2000);
  loop.set(kRegKp, 64);
  loop.error(10);
  EXPECT_EQ(loop.a.i_q, loop.a.duty_max_q << 14);
}

TEST(Algor, FullSegmentPresetsTheIntegralToTheHoldDuty) {
  Loop loop;
  loop.set(kRegCtrl, kCtrlFf);
  loop.set(kRegKff, 4096);  // 1 duty LSB for 1/64 degC
  loop.set(kRegTAmb, 250);
  loop.set(kRegBandFull, 100);
  loop.error(1000);
  EXPECT_EQ(loop.a.i_q, (12800u - 1000u - 1600u) << 14);
  loop.set(kRegDutyMax, 100);
  loop.error(1000);
  EXPECT_EQ(loop.a.i_q, loop.a.duty_max_q << 14) << "never above DUTY_MAX";
}

TEST(Algor, FullSegmentWithoutFeedForwardHoldsTheIntegral) {
  Loop loop;
  loop.set(kRegKiApproach, 1000);
  loop.error(100);
  loop.set(kRegBandFull, 10);
  loop.error(1000);
  EXPECT_EQ(loop.a.segment_q, kSegFull);
  EXPECT_EQ(loop.a.i_q, 100u * 1000u);
}

TEST(Algor, IntegralIsZeroOutsideTheBandWhereAsked) {
  Loop loop;
  loop.set(kRegCtrl, kCtrlIZero);
  loop.set(kRegKiApproach, 1000);
  loop.error(100);
  loop.set(kRegBandFull, 10);
  loop.error(1000);
  EXPECT_EQ(loop.a.i_q, 0u);
}

TEST(Algor, KiHoldActsAtTemperature) {
  Loop loop;
  loop.set(kRegKiApproach, 100);
  loop.set(kRegKiHold, 7);
  loop.error(10);
  EXPECT_EQ(loop.product_i, 1000);
  loop.in.at_temp = true;
  loop.error(10);
  EXPECT_EQ(loop.product_i, 70);
}

// ---- Derivative
// -----------------------------------------------------------------------------------------------------------

TEST(Algor, DerivativeOnTemperatureHasNoKickAtASetPointChange) {
  for (bool on_pv : {true, false}) {
    Loop loop;
    loop.set(kRegCtrl, on_pv ? kCtrlDOnPv : 0);
    loop.set(kRegKd, 8);
    loop.error(0);
    loop.set(kRegSetpoint, 2010);  // + 1.0 degC
    loop.tick(12800);
    loop.tick(12800);
    loop.set(kRegSetpoint, 2020);
    EXPECT_EQ(loop.tick(12800), on_pv ? 0u : 64u) << on_pv;
  }
}

TEST(Algor, DerivativeOnTemperatureOpposesItsChange) {
  Loop loop;
  loop.set(kRegCtrl, kCtrlDOnPv);
  loop.set(kRegKd, 8);  // 1 duty LSB for 1/64 degC a tick
  loop.tick(12800);
  EXPECT_EQ(loop.tick(12800 - 50), 50u);
  EXPECT_EQ(loop.product_d, 50 * 16 * 8);
}

TEST(Algor, DerivativeFilterFollowsItsRecursion) {
  for (int n = 0; n <= 6; ++n) {
    Loop loop;
    loop.set(kRegCtrl, kCtrlDOnPv);
    loop.set(kRegKd, 8);
    loop.set(kRegDFilter, n);
    std::mt19937 random(static_cast<unsigned>(n));
    std::int64_t y = -12800 * 16;  // 1/1024 degC
    loop.tick(12800);
    for (int k = 0; k < 200; ++k) {
      const int pv = 12800 + static_cast<int>(random() % 1000) - 500;
      const std::int64_t past = y;
      y += (-pv * 16 - y) >> n;
      loop.tick(pv);
      ASSERT_EQ(loop.a.delta_q, y - past) << "n " << n << " step " << k;
    }
  }
}

TEST(Algor, DerivativeTermSettlesToZero) {
  Loop loop;
  loop.set(kRegCtrl, kCtrlDOnPv);
  loop.set(kRegDFilter, 6);
  loop.tick(0);
  for (int n = 0; n < 1000; ++n) loop.tick(6400);
  EXPECT_EQ(loop.a.delta_q, 0);
}

// ---- Duty
// -----------------------------------------------------------------------------------------------------------------

TEST(Algor, DutyIsLimited) {
  Loop loop;
  loop.set(kRegKp, 65535);
  loop.set(kRegDutyMax, 2500);
  EXPECT_EQ(loop.error(5000), 16384u);
  EXPECT_TRUE(loop.a.limited());
}

TEST(Algor, ZeroDutyLimitHeatsNeverAndIsNotALimit) {
  Loop loop;
  loop.set(kRegKp, 65535);
  loop.set(kRegDutyMax, 0);
  EXPECT_EQ(loop.error(5000), 0u);
  EXPECT_FALSE(loop.a.limited());
}

TEST(Algor, SlewLimitsTheRiseOnly) {
  Loop loop;
  loop.set(kRegKp, 65535);
  loop.set(kRegSlew, 1000);
  loop.error(5000);
  const std::uint32_t slew = loop.a.slew_q;
  EXPECT_NEAR(slew, 6554, 1);
  for (unsigned n = 2; n <= 9; ++n) EXPECT_EQ(loop.error(5000), n * slew);
  loop.error(5000);
  EXPECT_EQ(loop.error(5000), kFull);
  EXPECT_EQ(loop.error(-5000), 0u) << "a fall is never slowed";
}

TEST(Algor, ManualDutyIsLimitedAndSlewed) {
  Loop loop;
  loop.set(kRegMode, 1);
  loop.set(kRegManualDuty, 5000);
  loop.set(kRegSlew, 2500);
  EXPECT_EQ(loop.error(1), 16384u);
  EXPECT_NEAR(loop.error(1), 32768, 1);
  EXPECT_EQ(loop.a.segment_q, kSegNone);
  loop.set(kRegDutyMax, 1000);
  EXPECT_EQ(loop.error(1), loop.a.duty_max_q);
}

TEST(Algor, ManualKeepsNoIntegral) {
  Loop loop;
  loop.set(kRegKiApproach, 65535);
  for (int n = 0; n < 20; ++n) loop.error(1000);
  loop.set(kRegMode, 1);
  loop.clock();
  EXPECT_EQ(loop.a.i_q, 0u);
  EXPECT_EQ(loop.a.fresh_q, 1);
}

TEST(Algor, ExternalFeedForwardAddsToTheDuty) {
  Loop loop;
  loop.set(kRegKp, 64);
  loop.set(kRegFfExt, 2500);
  EXPECT_EQ(loop.error(100), 16384u + 100u);
  EXPECT_EQ(loop.error(-100), 16384u - 100u);
}

TEST(Algor, PresetIsItsShareOfTheHoldDuty) {
  for (const int share : {0, 1, 58, 128, 256}) {
    Loop loop;
    loop.set(kRegCtrl, kCtrlModel | kCtrlFf);
    loop.set(kRegKp, 65535);
    loop.set(kRegKff, 4096);
    loop.set(kRegTAmb, 0);
    loop.set(kRegPreset, share);
    loop.error(640);
    EXPECT_EQ(loop.a.segment_q, kSegFull);
    EXPECT_EQ(loop.a.i_q >> 14, (12800u - 640u) * static_cast<unsigned>(share) / 256u) << share;
  }
}

// FF_DROP is 2^-20 of the duty a droplet and control period.
TEST(Algor, EachDropletAddsItsHeatOnce) {
  Loop loop;
  loop.set(kRegFfDrop, 16 * 100);
  loop.set(kRegFfExt, 1000);
  const std::uint32_t before = loop.error(0);
  loop.droplets(3);
  EXPECT_EQ(loop.error(0), before + 300);
  EXPECT_EQ(loop.error(0), before) << "counted once";
  loop.in.drop = true;
  loop.milliseconds(50);
  EXPECT_EQ(loop.error(0), before + 100) << "a level is one droplet";
}

TEST(Algor, DropletsOfARefusedSampleCountInTheNext) {
  Loop loop;
  loop.set(kRegFfDrop, 16 * 100);
  loop.error(0);
  loop.droplets(2);
  loop.error(0, false);
  loop.droplets(1);
  EXPECT_EQ(loop.error(0), 300u);
}

TEST(Algor, DropletsSaturateAndAreForgottenWhileStopped) {
  Loop loop;
  loop.set(kRegFfDrop, 65535);
  loop.error(0);
  loop.droplets(300);
  EXPECT_EQ(loop.a.drops_q, 255);
  EXPECT_EQ(loop.error(0), kFull);
  loop.droplets(5);
  loop.in.run = false;
  loop.clock();
  EXPECT_EQ(loop.a.drops_q, 0);
}

TEST(Algor, DropletsDoNotMoveAManualDutyAndRaiseTheHoldLimit) {
  Loop loop;
  loop.set(kRegFfDrop, 16 * 100);
  loop.set(kRegHoldAdd, 0);
  loop.error(0);
  const std::uint32_t limit = loop.a.hold_q;
  loop.droplets(4);
  loop.error(0);
  EXPECT_EQ(loop.a.hold_q, limit + 400);
  loop.set(kRegMode, 1);
  loop.set(kRegManualDuty, 2500);
  const std::uint32_t manual = loop.error(0);
  loop.droplets(4);
  EXPECT_EQ(loop.error(0), manual);
}

TEST(Algor, WhileTuningTheDutyIsAtunesAndTheIntegralWaits) {
  Loop loop;
  loop.set(kRegKp, 65535);
  loop.set(kRegKiApproach, 65535);
  loop.in.tuning = true;
  loop.in.tune_duty = 50'000;
  loop.in.tune_hold = 20'000;
  EXPECT_EQ(loop.error(64), 50'000u);
  EXPECT_EQ(loop.a.i_q, 20'000u << 14);
  EXPECT_EQ(loop.a.segment_q, kSegNone);
  loop.set(kRegDutyMax, 5000);
  EXPECT_EQ(loop.error(64), loop.a.duty_max_q);
  loop.set(kRegDutyMax, 10000);
  loop.set(kRegKp, 0);
  loop.set(kRegKiApproach, 0);
  loop.in.tuning = false;
  EXPECT_EQ(loop.error(64), 20'000u) << "without a bump";
}

TEST(Algor, RefusedSampleHoldsTheDuty) {
  Loop loop;
  loop.set(kRegKp, 64);
  loop.set(kRegKiApproach, 65535);
  loop.error(1000);
  const Algor before = loop.a;
  EXPECT_EQ(loop.error(-5000, false), before.duty_q);
  EXPECT_EQ(loop.a.i_q, before.i_q);
  EXPECT_EQ(loop.a.filt_q, before.filt_q);
}

TEST(Algor, StopClearsDutyAndIntegralInOneClock) {
  Loop loop;
  loop.set(kRegKiApproach, 65535);
  for (int n = 0; n < 20; ++n) loop.error(1000);
  ASSERT_GT(loop.a.duty_q, 0u);
  loop.in.run = false;
  loop.clock();
  EXPECT_EQ(loop.a.duty_q, 0u);
  EXPECT_EQ(loop.a.i_q, 0u);
  EXPECT_EQ(loop.a.segment_q, kSegNone);
}

TEST(Algor, StoppedComputationLeavesNoDuty) {
  Loop loop;
  loop.set(kRegKp, 65535);
  loop.in.run = false;
  EXPECT_EQ(loop.error(5000), 0u);
}

// ---- Ramp
// -----------------------------------------------------------------------------------------------------------------

struct RampTime {
  int rate;  // 0.01 degC/s
  int lsb;   // 1/64 degC
  int ms;    // after which they have been climbed, exactly
};

class AlgorRamp : public testing::TestWithParam<RampTime> {};

TEST_P(AlgorRamp, ClimbsOnTheMillisecond) {
  const auto [rate, lsb, ms] = GetParam();
  for (int sign : {1, -1}) {
    Loop loop;
    loop.set(kRegSetpoint, sign > 0 ? 4000 : 0);
    loop.set(sign > 0 ? kRegRampUp : kRegRampDown, rate);
    loop.set(sign > 0 ? kRegRampDown : kRegRampUp, 7);
    loop.in.run = false;
    loop.tick(12800);
    loop.in.run = true;
    loop.tick(12800);
    loop.milliseconds(ms - 1);
    EXPECT_EQ(loop.a.sp_work_q, 12800 + sign * (lsb - 1));
    loop.milliseconds(1);
    EXPECT_EQ(loop.a.sp_work_q, 12800 + sign * lsb);
    EXPECT_TRUE(loop.a.ramping());
  }
}

// 1/64 degC takes 3125 / (2 rate) ms.
INSTANTIATE_TEST_SUITE_P(Rates, AlgorRamp,
                         testing::Values(RampTime{1, 1, 1563}, RampTime{1, 2, 3125},
                                         RampTime{100, 640, 10000}, RampTime{625, 2, 5}, RampTime{1562, 1, 2},
                                         RampTime{1562, 3124, 3125}));

TEST(AlgorRampEnds, StopsAtTheTarget) {
  Loop loop;
  loop.set(kRegRampUp, 1000);
  loop.in.run = false;
  loop.tick(12800 - 64);
  loop.in.run = true;
  loop.tick(12800 - 64);
  loop.milliseconds(1000);
  EXPECT_EQ(loop.a.sp_work_q, 12800);
  EXPECT_FALSE(loop.a.ramping());
}

TEST(AlgorRampEnds, WithoutRampTheSetPointSteps) {
  Loop loop;
  loop.tick(0);
  EXPECT_EQ(loop.a.sp_work_q, 12800);
  EXPECT_FALSE(loop.a.ramping());
}

TEST(AlgorRampEnds, StandsWhileStopped) {
  Loop loop;
  loop.set(kRegRampUp, 1000);
  loop.in.run = false;
  loop.tick(640);
  loop.milliseconds(100);
  EXPECT_EQ(loop.a.sp_work_q, 640) << "starts from the temperature";
}

// ---- Conversions
// ----------------------------------------------------------------------------------------------------------

TEST(Algor, SetPointConvertsWithinOneLsbAndReadsBackTheSame) {
  for (int tenths = 0; tenths <= 5000; ++tenths) {
    Loop loop;
    loop.set(kRegSetpoint, tenths);
    loop.tick(0);
    ASSERT_NEAR(loop.a.sp_work_q, tenths * 6.4, 1.0);
    ASSERT_EQ((loop.a.sp_work_q * 5 + 16) >> 5, tenths) << "as PARAMC shows it";
  }
}

TEST(Algor, ConversionsAreExactAtBothEnds) {
  Loop low, high;
  for (Reg reg : {kRegSetpoint, kRegDutyMax, kRegSlew, kRegFfExt}) low.set(reg, 0);
  low.set(kRegTAmb, -400);
  low.tick(0);
  EXPECT_EQ(low.a.target_q, 0);
  EXPECT_EQ(low.a.duty_max_q, 0u);
  EXPECT_EQ(low.a.slew_q, 0u);
  EXPECT_EQ(low.a.ext_q, 0u);
  EXPECT_EQ(low.a.amb_q, -2560);
  high.set(kRegSetpoint, 5000);
  high.set(kRegTAmb, 1000);
  for (Reg reg : {kRegDutyMax, kRegSlew, kRegFfExt}) high.set(reg, 10000);
  high.tick(0);
  EXPECT_EQ(high.a.target_q, 32000);
  EXPECT_EQ(high.a.duty_max_q, kFull);
  EXPECT_EQ(high.a.slew_q, kFull);
  EXPECT_EQ(high.a.ext_q, kFull);
  EXPECT_EQ(high.a.amb_q, 6400);
}

TEST(Algor, SmallestDutyLimitIsNotZero) {
  Loop loop;
  loop.set(kRegSlew, 1);
  loop.tick(0);
  EXPECT_EQ(loop.a.slew_q, 7u);  // 0.01 % = 6.55
}

TEST(Algor, HoldLimitIsTheMultipleOfTheFeedForwardAndTheAddition) {
  Loop loop;
  loop.set(kRegKff, 4096);
  loop.set(kRegTAmb, 0);
  loop.set(kRegHoldMult, 512);
  loop.set(kRegHoldAdd, 0);
  loop.tick(1000);
  EXPECT_EQ(loop.a.ff_q, 1000u);
  EXPECT_EQ(loop.a.hold_q, 2000u);
  loop.set(kRegHoldAdd, 10000);
  loop.tick(1000);
  EXPECT_EQ(loop.a.hold_q, 2000u + kFull);
  loop.set(kRegHoldMult, 65535);
  loop.set(kRegKff, 65535);
  loop.tick(32000);
  EXPECT_EQ(loop.a.hold_q, 2 * kFull);
}

// GUARD asks whether the reading follows.
TEST(Algor, TheTestOfTheReadingHoldsTheDutyToHalfOfTheHoldLimit) {
  Loop loop;
  loop.set(kRegKp, 64 * 100);
  loop.set(kRegKiApproach, 10000);
  loop.set(kRegHoldAdd, 1000);
  ASSERT_GT(loop.error(500), 50000u);
  const std::uint32_t integral = loop.a.i_q;
  const std::uint32_t half = loop.a.hold_q / 2;
  ASSERT_GT(integral, 0u);
  loop.in.hold_test = true;
  EXPECT_EQ(loop.error(500), half);
  EXPECT_EQ(loop.a.i_q, integral) << "the integral waits";
  EXPECT_EQ(loop.a.segment_q, kSegPid);
  loop.set(kRegBandFull, 10);
  EXPECT_EQ(loop.error(500), half) << "full segment";
  loop.set(kRegDutyMax, 100);
  EXPECT_EQ(loop.error(500), 655u) << "DUTY_MAX is less";
  loop.set(kRegDutyMax, 10000);
  loop.set(kRegBandFull, 5000);
  loop.set(kRegKiApproach, 0);
  EXPECT_EQ(loop.error(10), 1000u + (loop.a.i_q >> 14)) << "what the loop wants is less";
  loop.in.hold_test = false;
  EXPECT_GT(loop.error(500), 50000u);
  loop.in.hold_test = loop.in.tuning = true;
  loop.in.tune_duty = kFull;
  loop.set(kRegDutyMax, 100);
  EXPECT_EQ(loop.error(500), 655u) << "DUTY_MAX is less than a relay's duty too";
}

TEST(Algor, FeedForwardBelowAmbientIsZero) {
  Loop loop;
  loop.set(kRegKff, 65535);
  loop.set(kRegTAmb, 1000);
  loop.tick(0);
  EXPECT_EQ(loop.a.ff_q, 0u);
}

TEST(Algor, TermsSaturateInTheRegisters) {
  Loop loop;
  loop.set(kRegKp, 65535);
  loop.error(12800);
  EXPECT_EQ(loop.a.term_p(), 131071);
  loop.error(-12800);
  EXPECT_EQ(loop.a.term_p(), -131072);
}

}  // namespace
}  // namespace meltstage::chip
