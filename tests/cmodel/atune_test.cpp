// SPDX-License-Identifier: Apache-2.0
// ATUNE: the relay experiment on a plant whose limit cycle is known in closed form, the rule's arithmetic
// against exact integers, and every way it can end.
#include "cmodel/atune.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <random>

#include "support.hpp"

namespace meltstage::chip {
namespace {

using namespace spec;

// As a host reads them in AT_STATE.
static_assert(unsigned{kTuneNever} == kTuningNeverRan && unsigned{kTuneRuns} == kTuningRuns &&
              unsigned{kTuneFinished} == kTuningFinished && unsigned{kTuneStopped} == kTuningStopped &&
              unsigned{kTuneTime} == kTuningTimedOut);

constexpr std::uint32_t kFull = 65536;

struct Bench {
  Atune a;
  AtuneIn in{.tune = false,
             .run = true,
             .sample = false,
             .tenth = false,
             .commit = false,
             .pv = temp(25),
             .sp_work = temp(110),
             .amb = temp(25),
             .ramping = false,
             .duty_max = kFull,
             .window = 10};
  std::map<unsigned, std::uint16_t> written;  // register -> value
  bool stopped = false;

  void clock() {
    a.step(in);
    in.tune = in.sample = in.tenth = in.commit = false;
    if (a.wr_q != 0) written[a.wr_index_q] = a.wr_data_q;
    stopped = stopped || a.stop_q != 0;
  }
  void clocks(int n) {
    for (int i = 0; i < n; ++i) clock();
  }
  void start() {
    in.tune = true;
    clock();
  }
  // One control period.
  void sample(std::int16_t pv) {
    in.pv = pv;
    in.sample = true;
    clocks(100);
  }
  std::uint16_t end() const { return a.state() & 0xFF; }
};

// dT/dt = rate (u - hold), seen `delay` control periods later.
struct Integrator {
  double rate;  // degC per control period at full duty
  double hold;
  int delay;
  double degc = 100.0;
  std::deque<double> line{};

  double step(double duty) {
    line.push_back(degc);
    degc += rate * (duty - hold);
    if (static_cast<int>(line.size()) <= delay) return line.front();
    const double seen = line.front();
    line.pop_front();
    return seen;
  }
};

void experiment(Bench& bench, Integrator& plant, int periods) {
  for (int i = 0; i < periods && bench.a.phase_q != kTuneCommit; ++i) {
    bench.sample(temp(plant.step(static_cast<double>(bench.a.duty()) / kFull)));
  }
}

// A relay of half height h and half width e on an integrator of rate R with delay L: half swing e + R h L,
// period 4 (L + e / (R h)).
class AtuneIntegrator : public ::testing::TestWithParam<double> {};

TEST_P(AtuneIntegrator, FindsTheLimitCycleInClosedForm) {
  const double hold = GetParam();
  // slow beside ATUNE's low-pass of 8 control periods
  Integrator plant{.rate = 0.02, .hold = hold, .delay = 300};
  Bench bench;
  bench.start();
  experiment(bench, plant, 60'000);
  ASSERT_EQ(bench.a.phase_q, kTuneCommit);

  const double h = (bench.a.duty_on_q - bench.a.duty_off_q) / 2.0 / kFull;
  EXPECT_NEAR(h, std::min(hold, 1 - hold), 0.03) << "centred";
  const double e = kTuneHysteresis / 64.0;
  const double period = 4 * (plant.delay + e / (plant.rate * h));
  // the low-pass of 7.5 control periods rounds each corner
  const double half_swing = e + plant.rate * h * (plant.delay - 7.5 * std::log(2.0));
  const double ku = 4 * h / (M_PI * half_swing);
  EXPECT_NEAR(bench.a.hold_q / double{kFull}, hold, 0.01);
  EXPECT_NEAR(bench.a.tu() / 4.0, period, 0.03 * period);
  EXPECT_NEAR(bench.a.ku_q / double{kFull}, ku, 0.04 * ku);
  EXPECT_NEAR(bench.written.at(kRegKff) / std::exp2(22), hold / 85.0, 0.01 * hold / 85.0 + 0.01 / 85.0);
}
// The relay switches at half of AT_WINDOW, to the LSB, and at 0.5 degC in a narrower one.
TEST(Atune, SwitchesAtHalfTheWindow) {
  for (const auto& [window, half_window] : {std::pair{0, 32}, {10, 32}, {11, 36}, {30, 96}, {1000, 3200}}) {
    Bench bench;
    bench.in.window = static_cast<std::uint16_t>(window);
    bench.start();
    const auto on_after = [&](int above) {
      bench.sample(static_cast<std::int16_t>(temp(110) + above));
      return bench.a.on_q != 0;
    };
    EXPECT_TRUE(on_after(half_window - 1)) << window;
    EXPECT_FALSE(on_after(half_window)) << window;
    EXPECT_FALSE(on_after(1 - half_window)) << window;
    EXPECT_TRUE(on_after(-half_window)) << window;
  }
}

INSTANTIATE_TEST_SUITE_P(Holds, AtuneIntegrator, ::testing::Values(0.15, 0.3, 0.5, 0.7));

TEST(Atune, GainsBecomeActiveAtTheCommitAndTheLoopGoesOnAtTheHoldDuty) {
  Integrator plant{.rate = 0.1, .hold = 0.4, .delay = 60};
  Bench bench;
  bench.start();
  EXPECT_EQ(bench.end(), kTuneRuns);
  experiment(bench, plant, 20'000);
  EXPECT_EQ(bench.written.size(), 6u);
  EXPECT_EQ(bench.a.duty(), bench.a.hold_q);
  EXPECT_TRUE(bench.a.tuning());
  bench.in.commit = true;
  bench.clock();
  EXPECT_FALSE(bench.a.tuning());
  EXPECT_EQ(bench.end(), kTuneFinished);
}

// The serial arithmetic, with sums of any size: floor(x k / y), saturated.
TEST(Atune, RuleIsExactWholeNumberArithmetic) {
  std::mt19937_64 random(4);
  const auto below = [&](std::uint64_t n) { return random() % n; };
  for (int round = 0; round < 300; ++round) {
    Bench bench;
    bench.a.phase_q = kTuneResults;
    bench.a.duty_on_q = static_cast<std::uint32_t>(below(kFull + 1));
    bench.a.duty_off_q = static_cast<std::uint32_t>(below(bench.a.duty_on_q + 1));
    bench.a.sum_ticks_q =
        static_cast<std::uint32_t>(1 + below(std::uint64_t{1} << (1 + below(18)))) & 0x3FFFF;
    if (bench.a.sum_ticks_q == 0) bench.a.sum_ticks_q = 1;
    bench.a.sum_on_q = static_cast<std::uint32_t>(below(bench.a.sum_ticks_q + 1));
    bench.a.sum_swing_q = static_cast<std::uint32_t>(1 + below(std::uint64_t{1} << (1 + below(17))));
    bench.in.amb = temp(static_cast<double>(below(160)) - 40.0);
    const Atune start = bench.a;
    bench.clocks(8 * 60);
    ASSERT_EQ(bench.a.phase_q, kTuneCommit);

    const auto word = [](std::uint64_t x, std::uint64_t k, std::uint64_t y) {
      return std::min<std::uint64_t>(x * k / y, 0xFFFF);
    };
    const std::uint64_t delta = start.duty_on_q - start.duty_off_q;
    const std::uint64_t hold = start.duty_off_q + delta * start.sum_on_q / start.sum_ticks_q;
    const std::uint64_t kp = word(delta, kTuneKpFactor, start.sum_swing_q);
    const int rise = bench.in.sp_work - bench.in.amb;
    EXPECT_EQ(bench.a.hold_q, hold);
    EXPECT_EQ(bench.a.ku_q, word(delta, kTuneKuFactor, start.sum_swing_q));
    EXPECT_EQ(bench.written[kRegKp], kp);
    EXPECT_EQ(bench.written[kRegKiApproach], word(kp, kTuneKiApproachFactor, start.sum_ticks_q));
    EXPECT_EQ(bench.written[kRegKiHold], word(kp, kTuneKiHoldFactor, start.sum_ticks_q));
    EXPECT_EQ(bench.written[kRegKd], word(kp, start.sum_ticks_q, kTuneKdDivisor));
    EXPECT_EQ(bench.written[kRegKff], rise > 0 ? word(hold, 4096, static_cast<std::uint64_t>(rise)) : 0);
    EXPECT_EQ(bench.written[kRegDFilter],
              std::clamp<int>(static_cast<int>(std::log2(start.sum_ticks_q)) - 7, 0, 6));
    for (const auto& [reg, value] : bench.written) {
      EXPECT_GE(value, kHolding[reg].min) << kHolding[reg].name;
      EXPECT_LE(value, kHolding[reg].max) << kHolding[reg].name;
    }
  }
}

TEST(Atune, RelayStaysBetweenZeroAndDutyMax) {
  for (const double hold : {0.1, 0.3, 0.55}) {
    Integrator plant{.rate = 0.1, .hold = hold, .delay = 40};
    Bench bench;
    bench.in.duty_max = kFull * 6 / 10;
    bench.start();
    for (int i = 0; i < 20'000 && bench.a.phase_q != kTuneCommit; ++i) {
      bench.sample(temp(plant.step(static_cast<double>(bench.a.duty()) / kFull)));
      ASSERT_LE(bench.a.duty(), bench.in.duty_max);
    }
    EXPECT_EQ(bench.a.phase_q, kTuneCommit);
    EXPECT_NEAR(bench.a.hold_q / double{kFull}, hold, 0.02);
  }
}

TEST(Atune, NothingIsCountedWhileTheSetpointRamps) {
  Bench bench;
  bench.in.ramping = true;
  bench.start();
  for (int i = 0; i < 10; ++i) {
    bench.sample(temp(112));
    bench.sample(temp(108));
  }
  EXPECT_EQ(bench.a.phase_q, kTuneApproach);
  bench.in.ramping = false;
  bench.sample(temp(112));
  bench.sample(temp(108));
  EXPECT_EQ(bench.a.phase_q, kTuneCycle);
}

TEST(Atune, StopsInOneClockInEveryPhase) {
  for (unsigned phase = kTuneApproach; phase <= kTuneCommit; ++phase) {
    Bench bench;
    bench.a.phase_q = static_cast<std::uint8_t>(phase);
    bench.in.run = false;
    bench.clock();
    EXPECT_FALSE(bench.a.tuning());
    EXPECT_EQ(bench.end(), kTuneStopped);
    bench.clocks(500);
    EXPECT_TRUE(bench.written.empty());
  }
}

TEST(Atune, ARelayThatNeverSwitchesEndsByTimeWithTheHeaterOff) {
  Bench bench;
  bench.start();
  int tenths = 0;
  for (; !bench.stopped && tenths < 20'000; ++tenths) {
    bench.in.tenth = true;
    bench.in.sample = true;
    bench.clocks(2);
  }
  EXPECT_EQ(tenths, static_cast<int>(kTuneLimit));
  EXPECT_EQ(bench.end(), kTuneTime);
  EXPECT_FALSE(bench.a.tuning());
}

TEST(Atune, DoesNotStartWhileStopped) {
  Bench bench;
  bench.in.run = false;
  bench.start();
  EXPECT_FALSE(bench.a.tuning());
  EXPECT_EQ(bench.end(), kTuneNever);
}

}  // namespace
}  // namespace meltstage::chip
