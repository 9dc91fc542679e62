// SPDX-License-Identifier: Apache-2.0
// PARAMC: every function and exception, every register's range, staging, commands, register reads.
#include "cmodel/paramc.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "support.hpp"

namespace meltstage::chip {
namespace {

using namespace spec;

struct Write {
  unsigned index;
  std::uint16_t value;
  bool store;
  friend bool operator==(const Write&, const Write&) = default;
};

constexpr std::uint16_t at(Reg reg) { return static_cast<std::uint16_t>(kHoldingBase + reg); }

// PARAMC with SYSCTRL's levels and MEM's answer made by hand.
struct Bench {
  Paramc p;
  ParamcIn in{};
  Readings readings{};
  std::vector<std::uint16_t> words;
  std::vector<Write> writes;  // of the last command

  Bench() {
    in.t_max_staged = static_cast<std::uint16_t>(kHolding[kRegTMax].reset);
    in.run_allowed = true;
  }
  void clock() {
    in.cmd_word = p.word_q < words.size() ? words[p.word_q] : std::uint16_t{0xDEAD};
    p.step(in, readings);
  }
  // Decodes and carries out in.cmd; clocks of the decoding.
  int command() {
    writes.clear();
    int clocks = 0;
    in.decode = true;
    while (p.decoded_q == 0 && clocks < 100) {
      clock();
      ++clocks;
    }
    clock();
    in.decode = false;
    if (p.writes_q != 0) {
      do {
        in.extract = true;
        clock();
        in.extract = false;
        writes.push_back({p.index_q, p.value_q, p.store()});
        in.write = true;
        clock();
        in.write = false;
      } while (p.last_q == 0);
    } else {
      clock();
    }
    return clocks;
  }
  void frame(std::uint8_t fc, std::uint16_t a, std::uint16_t b, std::uint16_t len = 8,
             std::uint8_t count = 0) {
    in.cmd = {.broadcast = false, .fc = fc, .a = a, .b = b, .count = count, .len = len};
    command();
  }
  // Exception of a command that must be answered, 0: none.
  int exception() const { return p.rsp_kind_q == kRspException ? p.rsp_exc_q : 0; }
  int read(std::uint16_t a, std::uint16_t n) {
    frame(3, a, n);
    return exception();
  }
  int write(std::uint16_t a, int value) {
    frame(6, a, static_cast<std::uint16_t>(value));
    return exception();
  }
  int write(std::uint16_t a, std::vector<std::uint16_t> values) {
    words = std::move(values);
    const auto n = static_cast<unsigned>(words.size());
    frame(16, a, static_cast<std::uint16_t>(n), static_cast<std::uint16_t>(9 + 2 * n),
          static_cast<std::uint8_t>(2 * n));
    return exception();
  }
  int order(Cmd word) { return write(kHoldingBase, word); }
  void commit() {
    in.commit = true;
    clock();
    in.commit = false;
  }
};

// ---- Functions and their form
// ---------------------------------------------------------------------------------------------

TEST(ParamcFunction, ReadsAreAnswered) {
  for (std::uint8_t fc : {std::uint8_t{3}, std::uint8_t{4}}) {
    Bench b;
    b.frame(fc, 0, 24);
    EXPECT_EQ(b.p.rsp_kind_q, kRspRead);
    b.frame(fc, kHoldingBase, 32);
    EXPECT_EQ(b.p.rsp_kind_q, kRspRead);
    EXPECT_TRUE(b.writes.empty());
  }
}

TEST(ParamcFunction, SingleWriteIsEchoedAndStored) {
  Bench b;
  EXPECT_EQ(b.write(at(kRegSetpoint), 1100), 0);
  EXPECT_EQ(b.p.rsp_kind_q, kRspEcho);
  EXPECT_EQ(b.writes, (std::vector<Write>{{kRegSetpoint, 1100, true}}));
}

TEST(ParamcFunction, MultipleWriteStoresEveryWordInOrder) {
  Bench b;
  EXPECT_EQ(b.write(at(kRegSetpoint), {1100, 50, 60, 1}), 0);
  EXPECT_EQ(b.p.rsp_kind_q, kRspEcho);
  EXPECT_EQ(b.writes, (std::vector<Write>{{1, 1100, true}, {2, 50, true}, {3, 60, true}, {4, 1, true}}));
}

TEST(ParamcFunction, SixteenWordsAreTheMost) {
  std::vector<std::uint16_t> values;
  for (unsigned i = 0; i < 17; ++i) values.push_back(static_cast<std::uint16_t>(kHolding[kRegKp + i].reset));
  Bench b;
  EXPECT_EQ(b.write(at(kRegKp), values), kExcValue);
  values.pop_back();
  EXPECT_EQ(b.write(at(kRegKp), values), 0);
  EXPECT_EQ(b.writes.size(), 16u);
}

TEST(ParamcFunction, EchoServerIdAndIdentificationAreAnswered) {
  Bench b;
  b.frame(8, 0, 0x1234);
  EXPECT_EQ(b.p.rsp_kind_q, kRspEcho);
  EXPECT_TRUE(b.writes.empty());
  for (bool running : {false, true}) {
    b.in.running = running;
    b.frame(17, 0, 0, 4);
    EXPECT_EQ(b.p.rsp_kind_q, kRspServerId);
    EXPECT_EQ(b.p.rsp_exc_q, running ? 0xFF : 0);
  }
  for (unsigned code = 1; code <= 3; ++code) {
    b.frame(43, static_cast<std::uint16_t>(0x0E00 | code), 0, 7);
    EXPECT_EQ(b.p.rsp_kind_q, kRspIdStream);
  }
  for (unsigned object = 0; object < kIdentObjects.size(); ++object) {
    b.frame(43, 0x0E04, static_cast<std::uint16_t>(object << 8), 7);
    EXPECT_EQ(b.p.rsp_kind_q, kRspIdObject) << object;
  }
}

struct Refusal {
  const char* what;
  std::uint8_t fc;
  std::uint16_t a, b, len;
  std::uint8_t count;
  int exception;
};

class ParamcRefuses : public testing::TestWithParam<Refusal> {};

TEST_P(ParamcRefuses, WithTheExceptionOfTheStandard) {
  Bench b;
  const Refusal& r = GetParam();
  b.words.assign(16, 0);
  b.frame(r.fc, r.a, r.b, r.len, r.count);
  EXPECT_EQ(b.exception(), r.exception) << r.what;
  EXPECT_TRUE(b.writes.empty()) << r.what;
  EXPECT_EQ(b.p.staged_q, 0) << r.what;
}

constexpr std::uint16_t kEnd = kHoldingBase + kHoldingCount;
// Function before count before address before value.
INSTANTIATE_TEST_SUITE_P(
    Form, ParamcRefuses,
    testing::Values(
        Refusal{"unknown function", 1, 0, 1, 8, 0, 1}, Refusal{"function 0", 0, 0, 1, 8, 0, 1},
        Refusal{"function 255", 255, 0, 1, 8, 0, 1}, Refusal{"no registers", 3, 0, 0, 8, 0, 3},
        Refusal{"33 registers", 3, kHoldingBase, 33, 8, 0, 3}, Refusal{"short read", 3, 0, 1, 7, 0, 3},
        Refusal{"long read", 4, 0, 1, 9, 0, 3}, Refusal{"count before address", 3, 0x5000, 0, 8, 0, 3},
        Refusal{"gap between the spaces", 3, kInputCount, 1, 8, 0, 2},
        Refusal{"end of the inputs", 3, kInputCount - 1, 2, 8, 0, 2},
        Refusal{"end of the holdings", 3, kEnd - 1, 2, 8, 0, 2}, Refusal{"behind", 3, kEnd, 1, 8, 0, 2},
        Refusal{"wrapping address", 3, 0xFFFF, 2, 8, 0, 2}, Refusal{"write of an input", 6, 1, 0, 8, 0, 2},
        Refusal{"write behind", 6, kEnd, 0, 8, 0, 2},
        Refusal{"write at the end of addresses", 6, 0xFFFF, 0, 8, 0, 2},
        Refusal{"short write", 6, kHoldingBase + 1, 0, 7, 0, 3},
        Refusal{"address before value", 6, kEnd, 0xFFFF, 8, 0, 2},
        Refusal{"no words", 16, kHoldingBase + 1, 0, 9, 0, 3},
        Refusal{"wrong byte count", 16, kHoldingBase + 1, 2, 13, 3, 3},
        Refusal{"wrong length", 16, kHoldingBase + 1, 2, 12, 4, 3},
        Refusal{"multiple write behind", 16, kEnd - 1, 2, 13, 4, 2},
        Refusal{"multiple write of inputs", 16, 0, 2, 13, 4, 2},
        Refusal{"huge count", 16, kHoldingBase, 0x8001, 11, 2, 3}, Refusal{"diagnostic 1", 8, 1, 0, 8, 0, 1},
        Refusal{"long echo", 8, 0, 0, 10, 0, 3}, Refusal{"long server id", 17, 0, 0, 5, 0, 3},
        Refusal{"other MEI", 43, 0x0D01, 0, 7, 0, 1}, Refusal{"identification 0", 43, 0x0E00, 0, 7, 0, 3},
        Refusal{"identification 5", 43, 0x0E05, 0, 7, 0, 3},
        Refusal{"short identification", 43, 0x0E01, 0, 6, 0, 3},
        Refusal{"unknown object", 43, 0x0E04, static_cast<std::uint16_t>(kIdentObjects.size() << 8), 7, 0,
                2}));

TEST(ParamcBroadcast, IsCarriedOutAndNeverAnswered) {
  Bench b;
  b.in.cmd = {.broadcast = true, .fc = 6, .a = at(kRegKp), .b = 5, .count = 0, .len = 8};
  b.command();
  EXPECT_EQ(b.p.rsp_kind_q, kRspNone);
  EXPECT_EQ(b.writes.size(), 1u);
  b.in.cmd.fc = 3;
  b.command();
  EXPECT_EQ(b.p.rsp_kind_q, kRspNone);
  b.in.cmd.fc = 99;
  b.command();
  EXPECT_EQ(b.p.rsp_kind_q, kRspNone);
}

TEST(ParamcTime, OneClockForTheFormAndOneForEachValue) {
  Bench b;
  b.in.cmd = {.broadcast = false, .fc = 3, .a = 0, .b = 1, .count = 0, .len = 8};
  EXPECT_EQ(b.command(), 1);
  b.words.assign(16, 0);
  b.in.cmd = {.broadcast = false, .fc = 16, .a = at(kRegKp), .b = 4, .count = 8, .len = 17};
  EXPECT_EQ(b.command(), 5);
}

// ---- Ranges
// ---------------------------------------------------------------------------------------------------------------

class ParamcRange : public testing::TestWithParam<unsigned> {};

TEST_P(ParamcRange, BothEndsAreAcceptedAndTheirNeighboursRefused) {
  const unsigned reg = GetParam();
  const RegisterInfo& info = kHolding[reg];
  const auto address = static_cast<std::uint16_t>(kHoldingBase + reg);
  const std::int32_t lowest = info.is_signed ? -32768 : 0;
  const std::int32_t highest = info.is_signed ? 32767 : 65535;
  for (std::int32_t value :
       {info.min - 1, info.min, info.min + 1, info.reset, info.max - 1, info.max, info.max + 1}) {
    if (value < lowest || value > highest) continue;
    Bench b;
    b.in.t_max_staged = 5000;
    const bool beyond_t_max = reg == kRegSetpoint && value > 5000 - kSetpointMargin;
    const bool sound = value >= info.min && value <= info.max && !beyond_t_max;
    EXPECT_EQ(b.write(address, value), sound ? 0 : kExcValue) << info.name << " = " << value;
    EXPECT_EQ(b.writes.size(), sound ? 1u : 0u);
    if (sound) {
      EXPECT_EQ(b.writes[0], (Write{reg, static_cast<std::uint16_t>(value), true}));
    }
    Bench multiple;
    multiple.in.t_max_staged = 5000;
    EXPECT_EQ(multiple.write(address, std::vector{static_cast<std::uint16_t>(value)}), sound ? 0 : kExcValue)
        << info.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Registers, ParamcRange, testing::Range(1u, kHoldingCount),
                         [](const auto& reg) { return std::string(kHolding[reg.param].name); });

TEST(ParamcSetpoint, StaysBelowTMaxByTheMargin) {
  for (int t_max : {0, 30, 50, 1500, 5000}) {
    Bench b;
    b.in.t_max_staged = static_cast<std::uint16_t>(t_max);
    const int limit = t_max - kSetpointMargin;
    if (limit >= 0) {
      EXPECT_EQ(b.write(at(kRegSetpoint), limit), 0) << t_max;
    }
    EXPECT_EQ(b.write(at(kRegSetpoint), std::max(limit + 1, 0)), kExcValue) << t_max;
  }
}

TEST(ParamcMultiple, OneBadValueRefusesTheFrame) {
  for (unsigned bad = 0; bad < 4; ++bad) {
    Bench b;
    std::vector<std::uint16_t> values{1100, 50, 60, 1};
    values[bad] = 60000;
    EXPECT_EQ(b.write(at(kRegSetpoint), values), kExcValue) << bad;
    EXPECT_TRUE(b.writes.empty());
    EXPECT_EQ(b.p.staged_q, 0);
  }
}

// ---- Commands
// -------------------------------------------------------------------------------------------------------------

TEST(ParamcCommand, EachGivesItsPulseForOneClock) {
  const std::pair<Cmd, std::uint8_t Paramc::*> pulses[] = {{kCmdRun, &Paramc::run_q},
                                                           {kCmdStop, &Paramc::stop_q},
                                                           {kCmdClearFault, &Paramc::clear_q},
                                                           {kCmdDiscard, &Paramc::discard_q},
                                                           {kCmdTune, &Paramc::tune_q}};
  for (const auto& [word, flop] : pulses) {
    Bench b;
    b.in.running = true;
    const auto high = [&] { return b.p.run_q + b.p.stop_q + b.p.clear_q + b.p.discard_q + b.p.tune_q; };
    EXPECT_EQ(b.order(word), 0);
    EXPECT_EQ(b.writes, (std::vector<Write>{{kRegCmd, word, false}}));
    EXPECT_EQ(high(), 1);
    EXPECT_EQ(b.p.*flop, 1);
    b.clock();
    EXPECT_EQ(high(), 0);
    EXPECT_EQ(b.p.staged_q, 0) << "a command is no parameter";
  }
}

TEST(ParamcCommand, UnknownWordsAreRefused) {
  int accepted = 0;
  for (int word = 0; word < 65536; ++word) {
    Bench b;
    b.in.running = true;
    accepted += b.write(kHoldingBase, word) == 0;
  }
  EXPECT_EQ(accepted, 7);
}

TEST(ParamcCommand, RunIsRefusedUnlessAllowed) {
  Bench b;
  b.in.run_allowed = false;
  EXPECT_EQ(b.order(kCmdRun), kExcDevice);
  EXPECT_EQ(b.p.run_q, 0);
}

TEST(ParamcCommand, ClearIsRefusedWhileACauseIsPresent) {
  Bench b;
  b.in.cause_present = true;
  EXPECT_EQ(b.order(kCmdClearFault), kExcDevice);
  EXPECT_EQ(b.order(kCmdStop), 0);
}

TEST(ParamcTune, NeedsHeatingInAutomaticModeAndNoWritesUnderWay) {
  Bench b;
  EXPECT_EQ(b.order(kCmdTune), kExcDevice) << "not heating";
  b.in.running = true;
  b.in.manual = true;
  EXPECT_EQ(b.order(kCmdTune), kExcDevice) << "manual";
  b.in.manual = false;
  EXPECT_EQ(b.write(at(kRegKp), 1), 0);
  EXPECT_EQ(b.order(kCmdTune), kExcBusy) << "a write waits for the tick";
  b.in.commit = true;
  b.clock();
  b.in.commit = false;
  EXPECT_EQ(b.order(kCmdHold), 0);
  EXPECT_EQ(b.order(kCmdTune), kExcBusy) << "writes are held";
  EXPECT_EQ(b.order(kCmdDiscard), 0);
  b.clock();
  EXPECT_EQ(b.order(kCmdTune), 0);
  EXPECT_EQ(b.p.tune_q, 1);
}

TEST(ParamcTune, EveryWriteButStopIsBusyUntilItEnds) {
  Bench b;
  b.in.running = b.in.tuning = true;
  for (unsigned index = 1; index < kHoldingCount; ++index)
    EXPECT_EQ(b.write(at(static_cast<Reg>(index)), kHolding[index].reset), kExcBusy) << kHolding[index].name;
  for (const Cmd word : {kCmdRun, kCmdClearFault, kCmdHold, kCmdCommit, kCmdDiscard, kCmdTune})
    EXPECT_EQ(b.order(word), kExcBusy);
  EXPECT_EQ(b.order(kCmdStop), 0);
  EXPECT_EQ(b.p.stop_q, 1);
}

TEST(ParamcTune, ItsGainsAreStagedForTheTick) {
  Bench b;
  b.in.tune_wr = true;
  b.clock();
  EXPECT_TRUE(b.p.pending());
}

// ---- Lock
// -----------------------------------------------------------------------------------------------------------------

TEST(ParamcLock, RefusesAllButUnlockAndStop) {
  Bench b;
  b.in.lock = 7;
  EXPECT_EQ(b.write(at(kRegSetpoint), 500), kExcDevice);
  EXPECT_EQ(b.write(at(kRegLock), 8), kExcDevice);
  for (Cmd word : {kCmdRun, kCmdClearFault, kCmdHold, kCmdCommit, kCmdDiscard})
    EXPECT_EQ(b.order(word), kExcDevice);
  EXPECT_EQ(b.order(kCmdStop), 0);
  EXPECT_EQ(b.write(at(kRegLock), 0), 0);
  EXPECT_EQ(b.read(kHoldingBase, 1), 0);
}

TEST(ParamcLock, AnImpossibleValueIsRefusedAsSuch) {
  Bench b;
  b.in.lock = 7;
  EXPECT_EQ(b.write(at(kRegMode), 2), kExcValue);
}

// ---- Staging
// --------------------------------------------------------------------------------------------------------------

TEST(ParamcStaging, AWriteWaitsForTheTick) {
  Bench b;
  EXPECT_FALSE(b.p.pending());
  b.write(at(kRegKp), 5);
  EXPECT_TRUE(b.p.pending());
  b.commit();
  EXPECT_FALSE(b.p.pending());
}

TEST(ParamcStaging, HoldKeepsWritesUntilCommit) {
  Bench b;
  b.order(kCmdHold);
  b.write(at(kRegKp), 5);
  b.write(at(kRegKd), 6);
  EXPECT_FALSE(b.p.pending());
  EXPECT_EQ(b.order(kCmdCommit), 0);
  EXPECT_TRUE(b.p.pending());
  b.commit();
  b.write(at(kRegKp), 5);
  EXPECT_TRUE(b.p.pending()) << "the hold is over";
}

TEST(ParamcStaging, WritesAreBusyBetweenCommitAndTick) {
  Bench b;
  b.order(kCmdHold);
  b.write(at(kRegKp), 5);
  b.order(kCmdCommit);
  EXPECT_EQ(b.write(at(kRegKp), 6), kExcBusy);
  EXPECT_EQ(b.order(kCmdRun), kExcBusy);
  EXPECT_EQ(b.order(kCmdStop), 0);
  EXPECT_EQ(b.write(at(kRegMode), 2), kExcValue);
  b.commit();
  EXPECT_EQ(b.write(at(kRegKp), 6), 0);
}

TEST(ParamcStaging, CommitOfNothingIsNotBusy) {
  Bench b;
  EXPECT_EQ(b.order(kCmdCommit), 0);
  EXPECT_EQ(b.write(at(kRegKp), 6), 0);
}

TEST(ParamcStaging, DiscardDropsWritesAndHold) {
  Bench b;
  b.order(kCmdHold);
  b.write(at(kRegKp), 5);
  b.order(kCmdDiscard);
  b.clock();
  EXPECT_EQ(b.p.staged_q, 0);
  EXPECT_EQ(b.p.hold_q, 0);
}

TEST(ParamcStaging, CommandAndParametersInOneFrame) {
  Bench b;
  EXPECT_EQ(b.write(kHoldingBase, {kCmdHold, 1100}), 0);
  EXPECT_EQ(b.p.staged_q, 1);
  EXPECT_FALSE(b.p.pending());
}

// ---- Register reads
// -------------------------------------------------------------------------------------------------------

Readings some_readings() {
  Readings r{};
  r.pv_valid = true;
  r.pv = temp(110.5);
  r.slope = -3;
  r.sp_work = temp(-12.3);
  r.duty = 65536;
  r.term_p = 131071;
  r.term_i = 32768;
  r.term_d = -131072;
  r.raw = 0x12345678;
  r.samples = 65535;
  r.status = 0xFFFF;
  r.fault = 0x4001;
  r.cause = 0x0123;
  r.first_fault = 15;
  r.state = kStCfgPwm;
  r.wd_left = 7;
  r.crc_errors = 1;
  r.char_errors = 2;
  r.messages = 3;
  r.sensor_errors = 4;
  r.mem_corrected = 5;
  r.overshoot = 6;
  r.band_time = 7;
  r.band_error = 8;
  r.peak = 9;
  r.on_time = 0x000A000B;
  r.tune_state = 12;
  r.tune_ku = 13;
  r.tune_tu = 14;
  r.tune_hold = 65536 / 4;
  return r;
}

TEST(ParamcRead, EveryInputRegisterShowsItsReading) {
  Bench b;
  b.readings = some_readings();
  b.in.display = true;
  b.clock();
  auto shown = [&](In reg) { return b.p.read(reg, b.readings, 0xBEEF); };
  auto shown_s16 = [&](In reg) { return static_cast<std::int16_t>(shown(reg)); };
  EXPECT_EQ(shown(kInStatus), 0xFE7F);
  EXPECT_EQ(shown(kInPv), 1105);
  EXPECT_EQ(shown_s16(kInSpWork), -123);
  EXPECT_EQ(shown(kInDuty), 10000);
  EXPECT_EQ(shown(kInFault), 0x4001);
  EXPECT_EQ(shown(kInFirstFault), 0x0F11);
  EXPECT_EQ(shown(kInPvFine), 7072);
  EXPECT_EQ(shown_s16(kInPvSlope), -3);
  EXPECT_EQ(shown(kInTermP), 20000);
  EXPECT_EQ(shown(kInTermI), 5000);
  EXPECT_EQ(shown_s16(kInTermD), -20000);
  EXPECT_EQ(shown(kInRawH), 0x1234);
  EXPECT_EQ(shown(kInRawL), 0x5678);
  EXPECT_EQ(shown(kInSamples), 65535);
  EXPECT_EQ(shown(kInWdLeft), 7);
  EXPECT_EQ(shown(kInCause), 0x0123);
  EXPECT_EQ(shown(kInCrcErrors), 1);
  EXPECT_EQ(shown(kInCharErrors), 2);
  EXPECT_EQ(shown(kInMessages), 3);
  EXPECT_EQ(shown(kInSensorErrors), 4);
  EXPECT_EQ(shown(kInMemCorrected), 5);
  EXPECT_EQ(shown(kInDeviceId), kDeviceId);
  EXPECT_EQ(shown(kInVersion), kVersion);
  EXPECT_EQ(shown(kInMapCrc), kMapCrc);
  EXPECT_EQ(shown(kInOvershoot), 6);
  EXPECT_EQ(shown(kInBandTime), 7);
  EXPECT_EQ(shown(kInBandError), 8);
  EXPECT_EQ(shown(kInPeak), 9);
  EXPECT_EQ(shown(kInOnTimeH), 10);
  EXPECT_EQ(shown(kInOnTimeL), 11);
  EXPECT_EQ(shown(kInAtState), 12);
  EXPECT_EQ(shown(kInAtKu), 13);
  EXPECT_EQ(shown(kInAtTu), 14);
  EXPECT_EQ(shown(kInAtDuty), 2500);
  EXPECT_EQ(b.p.read(kHoldingBase + 5, b.readings, 0xBEEF), 0xBEEF) << "holding registers are MEM's";
}

TEST(ParamcRead, StatusShowsPendingAndHold) {
  Bench b;
  b.order(kCmdHold);
  EXPECT_EQ(b.p.read(kInStatus, b.readings, 0), 1u << 8);
  b.write(at(kRegKp), 5);
  EXPECT_EQ(b.p.read(kInStatus, b.readings, 0), 1u << 8 | 1u << 7);
}

TEST(ParamcRead, TemperatureIsInvalidBeforeTheFirstSample) {
  Bench b;
  EXPECT_EQ(static_cast<std::int16_t>(b.p.read(kInPv, b.readings, 0)), -32768);
}

TEST(ParamcRead, TenthsAreRoundedOverTheWholeRange) {
  for (int t = -32768; t <= 32767; ++t) {
    Paramc p;
    p.snap_valid_q = 1;
    p.snap_pv_q = static_cast<std::int16_t>(t);
    const auto shown = static_cast<std::int16_t>(p.read(kInPv, {}, 0));
    ASSERT_LE(std::abs(shown - t / 6.4), 0.5) << t;
  }
}

TEST(ParamcRead, PercentIsRoundedOverTheWholeRange) {
  for (std::uint32_t duty = 0; duty <= 65536; ++duty) {
    Paramc p;
    p.snap_duty_q = duty;
    ASSERT_LE(std::abs(p.read(kInDuty, {}, 0) - duty / 6.5536), 0.5) << duty;
  }
}

TEST(ParamcSnapshot, IsTakenInTempDisplayOnly) {
  Bench b;
  b.readings = some_readings();
  b.clock();
  EXPECT_EQ(b.p.snap_pv_q, 0);
  b.in.display = true;
  b.clock();
  EXPECT_EQ(b.p.snap_pv_q, temp(110.5));
}

TEST(ParamcSnapshot, IsHeldWhileAnAnswerIsSent) {
  Bench b;
  b.in.display = true;
  b.in.rd_busy = true;
  b.readings = some_readings();
  b.clock();
  EXPECT_EQ(b.p.snap_valid_q, 0);
  EXPECT_EQ(b.p.snap_duty_q, 0u);
  b.in.rd_busy = false;
  b.clock();
  EXPECT_EQ(b.p.snap_duty_q, 65536u);
}

}  // namespace
}  // namespace meltstage::chip
