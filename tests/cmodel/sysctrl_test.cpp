// SPDX-License-Identifier: Apache-2.0
// SYSCTRL: the arcs of the specification and no other, control tick, time base, telemetry, hand-overs.
#include "cmodel/sysctrl.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace meltstage::chip {
namespace {

using Arc = std::pair<unsigned, unsigned>;
constexpr unsigned kMs = spec::kClkHz / 1000;

struct Bench {
  Sysctrl s;
  SysctrlIn in{.ts = 10,
               .tlm_period = 0,
               .cmd_valid = false,
               .decoded = true,
               .writes = false,
               .last = true,
               .pending = false,
               .sens_done = true,
               .algor_done = true};
  std::uint64_t clocks = 0;

  void clock() {
    s.step(in);
    ++clocks;
  }
  void run(std::uint64_t n) {
    for (std::uint64_t i = 0; i < n; ++i) clock();
  }
  // Clocks until `flag` is seen, from now.
  std::uint64_t until(const std::uint8_t& flag, std::uint64_t limit = 1'000'000'000) {
    const std::uint64_t begin = clocks;
    do clock();
    while (flag == 0 && clocks - begin < limit);
    return clocks - begin;
  }
  // The first command, as short as can be.
  void command() {
    in.cmd_valid = true;
    until(s.cmd_done_q);
    in.cmd_valid = false;
    clock();
  }
};

TEST(Sysctrl, TakesEveryArcOfTheSpecificationAndNoOther) {
  std::set<Arc> wanted;
  for (const spec::StateArc& arc : spec::kStateArcs) wanted.insert({arc.from, arc.to});
  std::set<Arc> taken;
  std::mt19937 random(5);
  Bench b;
  b.in.ts = 1;
  for (int i = 0; i < 1'000'000; ++i) {
    if (b.s.ms_cnt_q > 20 && random() % 16 == 0) b.s.ms_cnt_q = kMs - 2;  // a short millisecond
    const auto r = static_cast<unsigned>(random());
    b.in.cmd_valid = (r >> 12 & 63) == 0;
    b.in.decoded = (r >> 3 & 3) == 0;
    b.in.writes = (r >> 5 & 1) != 0;
    b.in.last = (r >> 6 & 1) != 0;
    b.in.sens_done = (r >> 7 & 3) == 0;
    b.in.algor_done = (r >> 9 & 3) == 0;
    const unsigned before = b.s.state_q;
    b.clock();
    if (b.s.state_q != before) taken.insert({before, b.s.state_q});
  }
  EXPECT_EQ(taken, wanted);
}

TEST(Sysctrl, IllegalStateFallsToIdleInOneClock) {
  for (unsigned code = 0; code < 32; ++code) {
    Bench b;
    b.s.state_q = static_cast<std::uint8_t>(code);
    const bool legal = spec::state_legal(static_cast<std::uint8_t>(code));
    EXPECT_EQ(b.s.illegal(), !legal) << code;
    if (legal) continue;
    b.in.cmd_valid = true;
    b.clock();
    EXPECT_EQ(b.s.state_q, spec::kStIdle) << code;
  }
}

TEST(Sysctrl, LegalStatesDifferInTwoBits) {
  for (const spec::StateInfo& a : spec::kStates) {
    for (unsigned bit = 0; bit < 5; ++bit)
      EXPECT_FALSE(spec::state_legal(static_cast<std::uint8_t>(a.code ^ 1u << bit))) << a.name;
  }
}

TEST(Sysctrl, MillisecondAndTenth) {
  Bench b;
  EXPECT_EQ(b.until(b.s.ms_q), kMs);
  EXPECT_EQ(b.until(b.s.ms_q), kMs);
  b.until(b.s.tenth_q);
  EXPECT_EQ(b.until(b.s.tenth_q), 100 * kMs);
}

TEST(Sysctrl, TestModeShortensMillisecondAndTenth) {
  Bench b;
  b.run(5 * kMs + 7000);  // beyond a short millisecond: the count runs on to its end and then is short
  b.in.test_mode = true;
  b.until(b.s.ms_q);
  EXPECT_EQ(b.until(b.s.ms_q), kMs / spec::kTestSpeedup);
  b.until(b.s.tenth_q);
  EXPECT_EQ(b.until(b.s.tenth_q), kMs / spec::kTestSpeedup);
  b.in.test_mode = false;
  b.until(b.s.tenth_q);
  EXPECT_EQ(b.until(b.s.tenth_q), 100 * kMs);
}

class SysctrlTick : public testing::TestWithParam<std::uint16_t> {};

TEST_P(SysctrlTick, ComesEveryTs) {
  Bench b;
  b.in.ts = GetParam();
  b.command();
  b.until(b.s.tick_q);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(b.until(b.s.tick_q), std::uint64_t{GetParam()} * kMs);
}

INSTANTIATE_TEST_SUITE_P(BothEnds, SysctrlTick, testing::Values(10, 11, 100, 2000));

TEST(Sysctrl, AShorterTsIsInForceAtOnce) {
  Bench b;
  b.in.ts = 2000;
  b.command();
  b.until(b.s.tick_q);
  b.run(500 * kMs);
  b.in.ts = 10;
  EXPECT_LE(b.until(b.s.tick_q), kMs + 1);
  EXPECT_EQ(b.until(b.s.tick_q), 10 * kMs);
}

TEST(Sysctrl, WaitsInIdleForTheFirstCommand) {
  Bench b;
  b.run(100 * kMs);
  EXPECT_EQ(b.s.state_q, spec::kStIdle);
  EXPECT_EQ(b.s.tick_q, 0);
}

TEST(Sysctrl, TheFirstCommandIsNeverLate) {
  // In every phase of the control period, with a long decoding.
  for (std::uint64_t phase = 0; phase < 40; ++phase) {
    Bench b;
    b.run(30 * kMs - 30 + phase);
    b.in.cmd_valid = true;
    b.in.decoded = false;
    for (int i = 0; i < 20; ++i) {
      b.clock();
      EXPECT_EQ(b.s.overrun_q, 0) << phase;
    }
    b.in.decoded = true;
    b.command();
    EXPECT_LE(b.until(b.s.tick_q), 10 * kMs);
  }
}

TEST(Sysctrl, ATickThatFindsTheWorkOfTheLastOneUndoneIsAnOverrun) {
  Bench b;
  b.command();
  b.in.sens_done = false;  // the sensor does not answer
  b.until(b.s.tick_q);
  const std::uint64_t late = b.until(b.s.overrun_q);
  EXPECT_GT(late, 9 * std::uint64_t{kMs});
  EXPECT_LE(late, 10 * std::uint64_t{kMs} + 2);
  b.clock();
  EXPECT_EQ(b.s.overrun_q, 0) << "a pulse";
}

TEST(Sysctrl, ASkippedOrRepeatedPartOfTheWorkIsSeen) {
  // What double upsets of the state could do: another legal state than the one whose turn it is.
  for (const auto& [from, to] : {std::pair{spec::kStReadTemp, spec::kStTempDisplay},
                                 {spec::kStReadTemp, spec::kStInitAlgor},
                                 {spec::kStInitAlgor, spec::kStReadTemp}}) {
    Bench b;
    b.in.sens_done = b.in.algor_done = false;
    b.command();
    b.until(b.s.tick_q);
    if (from == spec::kStInitAlgor) {
      b.in.sens_done = true;
      b.run(5);
    }
    ASSERT_EQ(b.s.state_q, from);
    b.s.state_q = to;
    b.in.sens_done = b.in.algor_done = true;
    EXPECT_LE(b.until(b.s.overrun_q), 5u) << spec::state_name(from) << " to " << spec::state_name(to);
  }
  // Left out altogether: seen at the next tick.
  Bench b;
  b.in.sens_done = false;
  b.command();
  b.until(b.s.tick_q);
  b.s.state_q = spec::kStCfgPwm;
  EXPECT_LE(b.until(b.s.overrun_q), 10 * std::uint64_t{kMs} + 2);
}

TEST(Sysctrl, ServedTicksAreNoOverrun) {
  Bench b;
  b.command();
  EXPECT_EQ(b.until(b.s.overrun_q, 1000 * kMs), 1000 * std::uint64_t{kMs});
  EXPECT_EQ(b.s.overrun_q, 0);
}

TEST(Sysctrl, CommitComesOneClockBeforeTheSensorStarts) {
  for (bool pending : {true, false}) {
    Bench b;
    b.command();
    b.in.pending = pending;
    b.until(b.s.tick_q);
    EXPECT_EQ(b.s.commit_q, pending);
    EXPECT_EQ(b.s.sens_start_q, 0);
    b.clock();
    EXPECT_EQ(b.s.commit_q, 0);
    EXPECT_EQ(b.s.sens_start_q, 1);
  }
}

TEST(Sysctrl, APeriodRunsSensorDisplayAlgorithmAndPwmInThisOrder) {
  Bench b;
  b.in.sens_done = b.in.algor_done = false;
  b.command();
  b.until(b.s.tick_q);
  b.run(50);
  EXPECT_EQ(b.s.state_q, spec::kStReadTemp);
  b.in.sens_done = true;
  b.clock();
  EXPECT_EQ(b.s.state_q, spec::kStTempDisplay);
  b.clock();
  EXPECT_EQ(b.s.state_q, spec::kStInitAlgor);
  EXPECT_EQ(b.s.algor_start_q, 1);
  b.run(50);
  EXPECT_EQ(b.s.state_q, spec::kStInitAlgor);
  b.in.algor_done = true;
  b.clock();
  EXPECT_EQ(b.s.state_q, spec::kStCfgPwm);
  EXPECT_EQ(b.s.pwm_load_q, 1);
  b.clock();
  EXPECT_EQ(b.s.pwm_load_q, 0);
}

TEST(Sysctrl, ACommandIsTakenAfterCfgPwmBeforeTheNextReading) {
  Bench b;
  b.command();
  b.until(b.s.pwm_load_q);
  b.in.cmd_valid = true;
  b.clock();
  EXPECT_EQ(b.s.state_q, spec::kStCmdDecode);
}

TEST(Sysctrl, ACommandIsCarriedOutOnce) {
  Bench b;
  b.in.cmd_valid = true;
  b.until(b.s.cmd_done_q);
  b.clock();  // cmd_valid falls only after cmd_done
  EXPECT_EQ(b.s.state_q, spec::kStCmdReady);
  b.in.cmd_valid = false;
  b.run(100);
  EXPECT_EQ(b.s.state_q, spec::kStCmdReady);
}

TEST(Sysctrl, EachParameterIsExtractedAndWritten) {
  Bench b;
  b.in.cmd_valid = b.in.writes = true;
  b.in.last = false;
  b.clock();
  std::vector<unsigned> seen;
  for (int i = 0; i < 6; ++i) {
    b.in.last = i == 5;
    b.clock();
    seen.push_back(b.s.state_q);
  }
  const std::vector<unsigned> wanted{spec::kStExtrParam, spec::kStWrParam,   spec::kStExtrParam,
                                     spec::kStWrParam,   spec::kStExtrParam, spec::kStWrParam};
  EXPECT_EQ(seen, wanted);
  b.clock();
  EXPECT_EQ(b.s.state_q, spec::kStCmdReady);
  EXPECT_EQ(b.s.cmd_done_q, 1);
}

// Control ticks between telemetry frames, TLM_PERIOD in 0.1 s.
std::vector<std::uint64_t> telemetry_ticks(std::uint16_t period, std::uint16_t ts_ms, int frames) {
  Bench b;
  b.in.ts = ts_ms;
  b.in.tlm_period = period;
  b.command();
  std::vector<std::uint64_t> between;
  std::uint64_t ticks = 0;
  while (between.size() < static_cast<std::size_t>(frames)) {
    b.clock();
    ticks += b.s.tick_q;
    if (b.s.tlm_start_q != 0) {
      between.push_back(ticks);
      ticks = 0;
    }
  }
  return between;
}

TEST(SysctrlTelemetry, ComesEveryPeriod) {
  EXPECT_EQ(telemetry_ticks(2, 100, 4), (std::vector<std::uint64_t>{2, 2, 2, 2}));
  EXPECT_EQ(telemetry_ticks(1, 10, 4), (std::vector<std::uint64_t>{10, 10, 10, 10}));
}

TEST(SysctrlTelemetry, ComesOnceEvenWhenThePeriodEndsInTempDisplay) {
  Bench b;
  b.in.tlm_period = 2;
  b.s.state_q = spec::kStTempDisplay;
  b.s.tlm_due_q = 1;
  b.s.tenth_q = 1;
  b.clock();
  EXPECT_EQ(b.s.tlm_start_q, 1);
  EXPECT_EQ(b.s.tlm_due_q, 0);
}

TEST(SysctrlTelemetry, LongestPeriodComes) {
  Bench b;
  b.in.tlm_period = 65535;
  b.s.tlm_cnt_q = 65534;
  b.s.tenth_q = 1;
  b.clock();
  EXPECT_EQ(b.s.tlm_cnt_q, 0);
  EXPECT_EQ(b.s.tlm_due_q, 1);
}

TEST(SysctrlTelemetry, IsOffAtZero) {
  Bench b;
  b.command();
  EXPECT_EQ(b.until(b.s.tlm_start_q, 500 * kMs), 500 * std::uint64_t{kMs});
  EXPECT_EQ(b.s.tlm_start_q, 0);
}

}  // namespace
}  // namespace meltstage::chip
