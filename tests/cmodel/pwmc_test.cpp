// SPDX-License-Identifier: Apache-2.0
// PWMC: period, duty and its mean, shortest pulse, take-over of new values, enable.
#include "cmodel/pwmc.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <type_traits>
#include <vector>

namespace meltstage::chip {
namespace {

constexpr std::uint32_t kFull = 65536;
constexpr std::uint16_t kPrescalers[] = {0, 1, 6};
constexpr std::uint16_t kPeriods[] = {2, 3, 100};
constexpr unsigned kProductClocks = 17;  // after the clock of the load

struct Random {
  std::mt19937 engine;
  explicit Random(unsigned seed) : engine(seed) {}
  std::uint32_t operator()() { return static_cast<std::uint32_t>(engine()); }
};

// A block that runs with these values, its product ready and its first period not yet begun.
struct Bench {
  PwmcIn in;
  Pwmc pwmc;

  Bench(std::uint16_t period, std::uint32_t duty, std::uint16_t prescale = 0, std::uint16_t min_on = 0,
        bool dither = true)
      : in{.prescale = prescale, .period = period, .min_on = min_on, .dither = dither} {
    in.enable = true;  // a stopped output forgets its duty
    load(duty);
    clocks(kProductClocks);
  }
  void clock() {
    pwmc.step(in);
    in.load = false;
  }
  void clocks(unsigned n) {
    for (unsigned i = 0; i < n; ++i) clock();
  }
  void load(std::uint32_t duty) {
    in.duty = duty;
    in.load = true;
    clock();
  }
};

struct Period {
  unsigned clocks = 0;
  unsigned high = 0;   // clocks
  unsigned rises = 0;  // inside the period, its first clock aside
};

// The whole period that begins at the next period_start.
Period next_period(Bench& bench) {
  do bench.clock();
  while (!bench.pwmc.period_start());
  Period p;
  Pwmc ahead = bench.pwmc;  // look on without moving the bench past the next start
  PwmcIn in = bench.in;
  bool last = ahead.pwm();
  do {
    ++p.clocks;
    p.high += ahead.pwm() ? 1 : 0;
    p.rises += ahead.pwm() && !last ? 1 : 0;
    last = ahead.pwm();
    ahead.step(in);
  } while (!ahead.period_start());
  return p;
}

TEST(Pwmc, ResetIsLowAndStaysLowWithoutEnable) {
  Pwmc pwmc;
  EXPECT_FALSE(pwmc.pwm());
  PwmcIn in{.period = 10, .duty = kFull, .load = true};
  for (int i = 0; i < 100; ++i) {
    pwmc.step(in);
    ASSERT_FALSE(pwmc.pwm());
    ASSERT_FALSE(pwmc.period_start());
  }
}

TEST(Pwmc, PeriodHasPeriodTimesPrescaleClocksAndOnePulseAtItsStart) {
  for (const std::uint16_t prescale : kPrescalers) {
    for (const std::uint16_t period : kPeriods) {
      for (unsigned high = 0; high <= period; ++high) {
        Bench bench(period, (high * kFull + period - 1) / period, prescale);
        const Period p = next_period(bench);
        ASSERT_EQ(p.clocks, period * (prescale + 1u));
        ASSERT_EQ(p.high, high * (prescale + 1u)) << "period " << period;
        ASSERT_EQ(p.rises, 0u);
        ASSERT_EQ(bench.pwmc.pwm(), high != 0);
      }
    }
  }
}

TEST(Pwmc, LongestPeriodAndPrescaler) {
  Bench longest(65535, kFull / 2);
  const Period p = next_period(longest);
  EXPECT_EQ(p.clocks, 65535u);
  EXPECT_EQ(p.high, 32767u);
  Bench slow(2, kFull / 2, 65535);
  const Period q = next_period(slow);
  EXPECT_EQ(q.clocks, 131072u);
  EXPECT_EQ(q.high, 65536u);
}

TEST(Pwmc, ProductIsExact) {
  Random random(7);
  for (int i = 0; i < 2000; ++i) {
    const auto period = static_cast<std::uint16_t>(2 + random() % 65534);
    const std::uint32_t duty = random() % (kFull + 1);
    Bench bench(period, duty);
    ASSERT_EQ(bench.pwmc.mul_left_q, 0);
    ASSERT_EQ(bench.pwmc.mul_acc_q, static_cast<std::uint64_t>(duty) * period);
  }
  Bench largest(65535, kFull);
  EXPECT_EQ(largest.pwmc.mul_acc_q, 0xFFFF0000u);
}

TEST(Pwmc, FullDutyIsConstantlyHighAndZeroConstantlyLow) {
  Bench full(7, kFull);
  full.clock();
  for (int i = 0; i < 200; ++i, full.clock()) ASSERT_TRUE(full.pwmc.pwm());
  Bench zero(7, 0);
  zero.clock();
  for (int i = 0; i < 200; ++i, zero.clock()) ASSERT_FALSE(zero.pwmc.pwm());
}

TEST(Pwmc, ValuesBeyondTheirRangeCountAsTheBound) {
  Bench duty(10, 0x1FFFF);
  EXPECT_EQ(next_period(duty).high, 10u);
  Bench period(0, kFull / 2);
  EXPECT_EQ(next_period(period).clocks, 2u);
}

TEST(Pwmc, DitherMakesTheMeanExact) {
  for (const std::uint16_t period : {std::uint16_t{2}, std::uint16_t{10}, std::uint16_t{999}}) {
    for (const std::uint32_t duty : {1u, 777u, 21845u, 65535u}) {
      Bench bench(period, duty);
      // After 65536 periods the sum of the products has no fraction.
      std::uint64_t high = 0;
      const unsigned periods = 65536;
      bench.clock();
      for (std::uint64_t i = 0; i < std::uint64_t{periods} * period; ++i, bench.clock())
        high += bench.pwmc.pwm() ? 1u : 0u;
      EXPECT_EQ(high, std::uint64_t{duty} * period) << period << ' ' << duty;
    }
  }
}

TEST(Pwmc, WithoutDitherTheFractionIsDropped) {
  Bench bench(10, kFull * 39 / 100, 0, 0, false);
  for (int i = 0; i < 50; ++i) ASSERT_EQ(next_period(bench).high, 3u);
}

TEST(Pwmc, ShortPulsesAndGapsAreSuppressedAndMadeUpLater) {
  for (const std::uint32_t percent : {3u, 7u, 50u, 93u, 97u, 99u}) {
    const std::uint32_t duty = kFull * percent / 100;
    Bench bench(100, duty, 0, 20);
    std::uint64_t high = 0;
    const int periods = 1000;
    for (int i = 0; i < periods; ++i) {
      const Period p = next_period(bench);
      ASSERT_TRUE(p.high == 0 || p.high >= 20) << p.high;
      ASSERT_TRUE(p.high == 100 || 100 - p.high >= 20) << p.high;
      high += p.high;
    }
    EXPECT_NEAR(static_cast<double>(high), static_cast<double>(duty) / kFull * 100 * periods, 20.0);
  }
}

TEST(Pwmc, ShortestPulseIsLimitedToHalfAPeriod) {
  Bench bench(10, kFull / 2, 0, 32767);
  for (int i = 0; i < 20; ++i) ASSERT_EQ(next_period(bench).high, 5u);
}

TEST(Pwmc, ShortestPulseWithoutDitherRoundsDown) {
  Bench low(100, kFull * 19 / 100, 0, 20, false);
  EXPECT_EQ(next_period(low).high, 0u);
  Bench high(100, kFull * 82 / 100, 0, 20, false);
  EXPECT_EQ(next_period(high).high, 80u);
  Bench full(100, kFull, 0, 20, false);
  EXPECT_EQ(next_period(full).high, 100u);
}

TEST(Pwmc, DutyChangesOnlyAtAPeriodsEnd) {
  Bench bench(100, kFull / 4);
  next_period(bench);
  bench.clocks(10);
  bench.load(kFull / 2);
  unsigned clocks = 12;  // clocks 0..11 of the period are past
  for (; !bench.pwmc.period_start(); ++clocks) {
    ASSERT_EQ(bench.pwmc.pwm(), clocks - 1 < 25);
    bench.clock();
  }
  EXPECT_EQ(clocks, 101u);
  EXPECT_EQ(bench.pwmc.high_q, 50);
}

TEST(Pwmc, UnfinishedProductRepeatsTheOldPeriod) {
  Bench bench(100, kFull / 4);
  next_period(bench);
  bench.clocks(90);
  bench.load(kFull / 2);
  EXPECT_EQ(next_period(bench).high, 25u);
  EXPECT_EQ(next_period(bench).high, 50u);
}

TEST(Pwmc, PeriodPrescalerAndDutyChangeTogether) {
  Bench bench(100, kFull / 4);
  next_period(bench);
  bench.clocks(85);
  bench.in.period = 40;  // its product is not ready at the end of this period
  bench.in.prescale = 2;
  const Period old = next_period(bench);
  EXPECT_EQ(old.clocks, 100u);
  EXPECT_EQ(old.high, 25u);
  const Period fresh = next_period(bench);
  EXPECT_EQ(fresh.clocks, 120u);
  EXPECT_EQ(fresh.high, 30u);
}

TEST(Pwmc, NewPeriodLengthStartsWithNothingCarried) {
  Bench bench(60000, kFull / 3, 0, 30000);  // carries 20000 counts after its first period
  next_period(bench);
  ASSERT_GT(bench.pwmc.acc_q >> 16, 10000);
  bench.in.period = 10;
  next_period(bench);
  EXPECT_EQ(bench.pwmc.period_q, 10);
  EXPECT_EQ(bench.pwmc.high_q, 0);
  EXPECT_LT(bench.pwmc.acc_q >> 16, 5);
}

TEST(Pwmc, ZeroDutyIsLowWhateverWasCarried) {
  Bench bench(1000, kFull / 3, 0, 500);
  next_period(bench);
  ASSERT_GT(bench.pwmc.acc_q, 0);
  bench.in.min_on = 0;
  bench.load(0);
  EXPECT_EQ(next_period(bench).high, 0u);
  EXPECT_EQ(bench.pwmc.acc_q, 0);
}

TEST(Pwmc, CarryStaysBelowHalfAPeriod) {
  Random random(11);
  Bench bench(50, 1000, 0, 25);
  for (int i = 0; i < 300000; ++i) {
    if (random() % 20 == 0) bench.load(random() % (kFull + 1));
    if (random() % 500 == 0) bench.in.min_on = static_cast<std::uint16_t>(random() % 40);
    if (random() % 2000 == 0) bench.in.period = static_cast<std::uint16_t>(random() % 80);
    bench.clock();
    const std::int64_t half = std::int64_t{bench.pwmc.period_q / 2} << 16;
    ASSERT_LT(bench.pwmc.acc_q, half);
    ASSERT_GT(bench.pwmc.acc_q, -half);
  }
}

TEST(Pwmc, EnableLowStopsAtTheNextClock) {
  for (unsigned when = 0; when < 40; ++when) {
    Bench bench(20, kFull / 2);
    bench.clocks(1 + when);
    bench.in.enable = false;
    bench.clock();
    EXPECT_FALSE(bench.pwmc.pwm());
    EXPECT_EQ(bench.pwmc.acc_q, 0);
    bench.in.enable = true;
    bench.load(kFull / 4);
    for (unsigned i = 0; i < kProductClocks; ++i, bench.clock())
      ASSERT_FALSE(bench.pwmc.pwm()) << "the old duty is forgotten";
    bench.clock();
    EXPECT_TRUE(bench.pwmc.period_start());
    EXPECT_EQ(bench.pwmc.high_q, 5);
  }
}

TEST(Pwmc, EnableWaitsForTheProductInsteadOfUsingAnOldDuty) {
  Bench bench(20, kFull);
  bench.clocks(5);
  bench.in.enable = false;
  bench.clock();
  bench.in.enable = true;
  bench.load(0);
  for (int i = 0; i < 100; ++i, bench.clock()) ASSERT_FALSE(bench.pwmc.pwm());
}

TEST(Pwmc, StateIsTriviallyCopyable) { EXPECT_TRUE(std::is_trivially_copyable_v<Pwmc>); }

}  // namespace
}  // namespace meltstage::chip
