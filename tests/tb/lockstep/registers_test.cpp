// SPDX-License-Identifier: Apache-2.0
// The register suite, generated from the specification: every case walks spec::kHolding and spec::kInput over
// real frames, model and RTL in lockstep. The model's own page-by-page checks are in tests/cmodel.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cmodel/paramc.hpp"
#include "running_case.hpp"
#include "tb/lockstep/bench.hpp"

namespace meltstage::tb {
namespace {

std::uint16_t raw(std::int32_t value) { return static_cast<std::uint16_t>(value); }
std::uint16_t address_of(unsigned index) { return static_cast<std::uint16_t>(spec::kHoldingBase + index); }

// Registers that change the line itself or refuse what comes after; they have cases of their own.
bool changes_the_bus(unsigned index) {
  return index == spec::kRegCmd || index == spec::kRegAddress || index == spec::kRegBaud ||
         index == spec::kRegFormat || index == spec::kRegLock;
}

// SETPOINT is also held below T_MAX - 5 degC.
std::int32_t highest(unsigned index, const chip::Chip& chip) {
  const std::int32_t max = spec::kHolding[index].max;
  return index == spec::kRegSetpoint
             ? std::min<std::int32_t>(
                   max, static_cast<std::int16_t>(chip.mem.t_max_staged()) - spec::kSetpointMargin)
             : max;
}

// A chip in work, its line at rest after the first control tick.
struct Registers : ::testing::Test {
  Registers() : bench(in_lockstep(chip_with(quick()))) {
    bench.next_tick();
    // Nothing becomes active unless the test says so: a shorter line or another sensor would change the
    // test's own ground.
    EXPECT_EQ(bench.command(spec::kCmdHold).outcome, ModbusOutcome::data);
  }
  ~Registers() override { EXPECT_GT(bench.finish().flop_values, 0u); }

  std::uint16_t staged(unsigned index) { return bench.read_holding(index, 1)[0]; }
  Bench bench;
};

TEST(RegisterReset, EveryHoldingRegisterReadsItsResetValue) {
  Bench bench(in_lockstep(chip_with({})));
  for (unsigned first = 0; first < spec::kHoldingCount; first += 20) {
    const unsigned count = std::min(20u, spec::kHoldingCount - first);
    const std::vector<std::uint16_t> values = bench.read_holding(first, count);
    for (unsigned i = 0; i < count; ++i)
      EXPECT_EQ(values[i], raw(spec::kHolding[first + i].reset)) << spec::kHolding[first + i].name;
  }
}

TEST(RegisterReset, FixedInputRegistersReadTheSpecification) {
  Bench bench(in_lockstep(chip_with(quick())));
  EXPECT_EQ(bench.read_input(spec::kInDeviceId), spec::kDeviceId);
  EXPECT_EQ(bench.read_input(spec::kInVersion), spec::kVersion);
  EXPECT_EQ(bench.read_input(spec::kInMapCrc), spec::kMapCrc);
  EXPECT_EQ(bench.read_input(spec::kInPv), 0x8000) << "no sample yet";
}

TEST_F(Registers, TakeBothEndsOfTheirRange) {
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) {
    if (changes_the_bus(i)) continue;
    SCOPED_TRACE(spec::kHolding[i].name);
    for (const std::int32_t value :
         {highest(i, bench.model()), spec::kHolding[i].min, spec::kHolding[i].reset}) {
      ASSERT_EQ(bench.write(static_cast<spec::Reg>(i), raw(value)).outcome, ModbusOutcome::data) << value;
      ASSERT_EQ(staged(i), raw(value));
    }
  }
}

TEST_F(Registers, RefuseWhatIsOutsideTheirRangeAndKeepTheirValue) {
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) {
    if (i == spec::kRegLock) continue;
    SCOPED_TRACE(spec::kHolding[i].name);
    const std::int32_t low = spec::kHolding[i].is_signed ? -32768 : 0;
    const std::int32_t high = spec::kHolding[i].is_signed ? 32767 : 65535;
    const std::uint16_t before = staged(i);
    for (const std::int32_t value : {spec::kHolding[i].min - 1, highest(i, bench.model()) + 1}) {
      if (value < low || value > high) continue;
      const ModbusResult result = bench.write(static_cast<spec::Reg>(i), raw(value));
      EXPECT_EQ(result.exception_code, spec::kExcValue) << value;
      EXPECT_EQ(staged(i), before);
    }
  }
}

// Every bit of every register can be one and zero where the range allows it.
TEST_F(Registers, HoldEachBitTheirRangeAllows) {
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) {
    if (changes_the_bus(i)) continue;
    SCOPED_TRACE(spec::kHolding[i].name);
    const std::int32_t max = highest(i, bench.model());
    for (int bit = 0; bit < 16; ++bit) {
      const std::int32_t value =
          spec::kHolding[i].is_signed ? static_cast<std::int16_t>(1u << bit) : 1 << bit;
      if (value < spec::kHolding[i].min || value > max) continue;
      ASSERT_EQ(bench.write(static_cast<spec::Reg>(i), raw(value)).outcome, ModbusOutcome::data) << value;
      ASSERT_EQ(bench.model().mem.staged_q[i] & 0xFFFF, raw(value));
    }
    ASSERT_EQ(bench.write(static_cast<spec::Reg>(i), raw(spec::kHolding[i].reset)).outcome,
              ModbusOutcome::data);
  }
}

TEST_F(Registers, BeyondTheMapAreRefused) {
  for (const std::uint16_t address : {address_of(spec::kHoldingCount), std::uint16_t{0x00FF},
                                      std::uint16_t{0xFFFF}, static_cast<std::uint16_t>(spec::kInputCount)}) {
    EXPECT_EQ(bench.ask(read_holding_registers(1, address, 1)).exception_code, spec::kExcAddress) << address;
    EXPECT_EQ(bench.ask(read_input_registers(1, address, 1)).exception_code, spec::kExcAddress) << address;
    EXPECT_EQ(bench.ask(write_single_register(1, address, 0)).exception_code, spec::kExcAddress) << address;
  }
  // A block that begins inside and ends outside.
  EXPECT_EQ(bench.ask(read_holding_registers(1, address_of(spec::kHoldingCount - 1), 2)).exception_code,
            spec::kExcAddress);
  EXPECT_EQ(
      bench.ask(read_input_registers(1, static_cast<std::uint16_t>(spec::kInputCount - 1), 2)).exception_code,
      spec::kExcAddress);
  const std::uint16_t two[] = {0, 0};
  EXPECT_EQ(bench.ask(write_multiple_registers(1, address_of(spec::kHoldingCount - 1), two)).exception_code,
            spec::kExcAddress);
  // Input registers are not written.
  EXPECT_EQ(bench.ask(write_single_register(1, 0, 0)).exception_code, spec::kExcAddress);
}

TEST_F(Registers, CountsBeyondTheLimitAreRefused) {
  EXPECT_EQ(bench.ask(read_holding_registers(1, address_of(0), 0)).exception_code, spec::kExcValue);
  EXPECT_EQ(bench.ask(read_holding_registers(1, address_of(0), 33)).exception_code, spec::kExcValue);
  EXPECT_EQ(bench.ask(read_holding_registers(1, address_of(0), 32)).registers.size(), 32u);
  const std::vector<std::uint16_t> many(17, 0);
  EXPECT_EQ(bench.ask(write_multiple_registers(1, address_of(spec::kRegSetpoint), many)).exception_code,
            spec::kExcValue);
}

TEST_F(Registers, UnknownFunctionsAreRefused) {
  for (const int fc : {1, 2, 5, 7, 15, 22, 23, 65, 127}) {
    const std::uint8_t bytes[] = {1, static_cast<std::uint8_t>(fc), 1, 0, 0, 1};
    EXPECT_EQ(bench.ask(with_crc(bytes)).exception_code, spec::kExcFunction) << fc;
  }
}

TEST_F(Registers, OneBadValueRefusesTheWholeBlock) {
  const std::vector<std::uint16_t> before = bench.read_holding(spec::kRegKp, 5);
  // KP, KI_APPROACH, KI_HOLD, KD are free; D_FILTER ends at 6.
  const ModbusResult result = bench.write_block(spec::kRegKp, {1, 2, 3, 4, 7});
  EXPECT_EQ(result.exception_code, spec::kExcValue);
  EXPECT_EQ(bench.read_holding(spec::kRegKp, 5), before);
  EXPECT_EQ(bench.write_block(spec::kRegKp, {1, 2, 3, 4, 6}).outcome, ModbusOutcome::data);
  EXPECT_THAT(bench.read_holding(spec::kRegKp, 5), ::testing::ElementsAre(1, 2, 3, 4, 6));
}

TEST(RegisterCommit, BlockBecomesActiveAtOnceAtTheNextTick) {
  Bench bench(in_lockstep(chip_with(quick())));
  bench.next_tick();
  const auto active = [&](spec::Reg reg) { return bench.model().params()[reg]; };
  const std::uint16_t old_kp = active(spec::kRegKp);
  ASSERT_EQ(bench.write_block(spec::kRegKp, {11, 12, 13, 14}).outcome, ModbusOutcome::data);
  EXPECT_EQ(active(spec::kRegKp), old_kp) << "before the tick";
  EXPECT_NE(bench.read_input(spec::kInStatus) & 1u << 7, 0) << "writes pending";
  // All four in the same clock.
  bool mixed = false;
  const auto watch = [&](const chip::Chip& chip) {
    const bool first = chip.params()[spec::kRegKp] == 11;
    const bool last = chip.params()[spec::kRegKd] == 14;
    mixed |= first != last;
    return first;
  };
  bench.poke([](chip::Chip& chip) {
    chip.sysctrl.ms_cnt_q = spec::kClkHz / 1000 - 3;
    chip.sysctrl.ts_cnt_q = static_cast<std::uint16_t>(chip.params()[spec::kRegTs] - 1);
  });
  EXPECT_TRUE(bench.run_until(watch, 1000));
  EXPECT_FALSE(mixed);
  EXPECT_EQ(bench.read_input(spec::kInStatus) & 1u << 7, 0) << "nothing pending";
}

TEST(RegisterCommit, HoldKeepsFramesStagedUntilCommit) {
  Bench bench(in_lockstep(chip_with(quick())));
  bench.next_tick();
  bench.command(spec::kCmdHold);
  bench.write(spec::kRegKp, 21);
  bench.next_tick();
  bench.write(spec::kRegKd, 22);
  bench.next_tick();
  EXPECT_NE(bench.model().params()[spec::kRegKp], 21);
  EXPECT_EQ(bench.command(spec::kCmdCommit).outcome, ModbusOutcome::data);
  EXPECT_EQ(bench.write(spec::kRegKp, 5).exception_code, spec::kExcBusy) << "between the order and the tick";
  bench.next_tick();
  EXPECT_EQ(bench.model().params()[spec::kRegKp], 21);
  EXPECT_EQ(bench.model().params()[spec::kRegKd], 22);
}

TEST(RegisterCommit, DiscardForgetsStagedWrites) {
  Bench bench(in_lockstep(chip_with(quick())));
  bench.next_tick();
  const std::uint16_t kp = bench.model().params()[spec::kRegKp];
  bench.command(spec::kCmdHold);
  bench.write(spec::kRegKp, 21);
  bench.command(spec::kCmdDiscard);
  bench.next_tick();
  EXPECT_EQ(bench.model().params()[spec::kRegKp], kp);
  EXPECT_EQ(bench.read_holding(spec::kRegKp, 1)[0], kp);
}

TEST(RegisterCommit, DiscardFirstInAFrameKeepsTheWritesBehindIt) {
  Bench bench(in_lockstep(chip_with(quick())));
  bench.next_tick();
  const chip::Params before = bench.model().params();
  bench.command(spec::kCmdHold);
  bench.write(spec::kRegKp, 21);
  std::vector<std::uint16_t> frame{spec::kCmdDiscard};
  for (unsigned i = 1; i < 16; ++i) frame.push_back(before.value[i]);
  frame[spec::kRegSetpoint] = 444;
  EXPECT_EQ(bench.write_block(spec::kRegCmd, frame).outcome, ModbusOutcome::data);
  bench.next_tick();
  EXPECT_EQ(bench.model().params()[spec::kRegSetpoint], 444);
  EXPECT_EQ(bench.model().params()[spec::kRegKp], before[spec::kRegKp]);
  EXPECT_EQ(bench.read_holding(spec::kRegKp, 1)[0], before[spec::kRegKp]);
}

TEST(RegisterLock, RefusesEverythingButStopAndUnlock) {
  Bench bench(in_lockstep(chip_with(quick())));
  bench.next_tick();
  ASSERT_EQ(bench.write(spec::kRegLock, 1).outcome, ModbusOutcome::data);
  bench.next_tick();
  EXPECT_EQ(bench.write(spec::kRegKp, 1).exception_code, spec::kExcDevice);
  EXPECT_EQ(bench.command(spec::kCmdRun).exception_code, spec::kExcDevice);
  EXPECT_EQ(bench.write(spec::kRegLock, 2).exception_code, spec::kExcDevice);
  EXPECT_EQ(bench.command(spec::kCmdStop).outcome, ModbusOutcome::data);
  EXPECT_EQ(bench.write(spec::kRegLock, 0).outcome, ModbusOutcome::data);
  bench.next_tick();
  EXPECT_EQ(bench.write(spec::kRegKp, 1).outcome, ModbusOutcome::data);
}

// The line's own registers take effect once the line is idle, never in the middle of the answer.
TEST(RegisterBus, BaudFormatAndAddressChangeAfterTheAnswer) {
  struct Line {
    std::uint16_t baud, format, address;
  };
  for (const Line& line : {Line{4608, 1, 0}, Line{2304, 2, 17}, Line{5000, 3, 247}, Line{5000, 6, 1}}) {
    SCOPED_TRACE(fmt::format("baud {} format {} address {}", line.baud, line.format, line.address));
    Bench bench(in_lockstep(chip_with(quick())));
    bench.next_tick();
    ASSERT_EQ(bench.write_block(spec::kRegAddress, {line.address, line.baud, line.format}).outcome,
              ModbusOutcome::data);
    bench.next_tick();
    bench.run(
        30'000);  // the line counts as idle 3.5 characters after its last, here 1.75 ms where it says PAUSE
    EXPECT_EQ(bench.unit(), line.address == 0 ? 1 : line.address);
    EXPECT_EQ(bench.model().uartc.baud_q, line.baud);
    EXPECT_EQ(bench.model().uartc.format_q, line.format & 3);
    EXPECT_EQ(bench.model().uartc.pause_q, line.format >> 2);
    EXPECT_EQ(bench.read_input(spec::kInDeviceId), spec::kDeviceId);
  }
}

TEST(RegisterBus, StrapSetsTheAddressWhileTheRegisterIsZero) {
  for (std::uint8_t strap = 0; strap < 8; ++strap) {
    Bench bench(in_lockstep(chip_with(quick())));
    bench.world.addr_strap = strap;
    bench.run(20);
    EXPECT_EQ(bench.unit(), strap + 1);
    EXPECT_EQ(bench.read_input(spec::kInDeviceId), spec::kDeviceId);
  }
}

TEST(RegisterBus, BroadcastWritesAndStaysSilent) {
  Bench bench(in_lockstep(chip_with(quick())));
  bench.next_tick();
  const ModbusResult result = bench.ask(write_single_register(0, address_of(spec::kRegKp), 77), 20'000);
  EXPECT_NE(result.outcome, ModbusOutcome::data);
  EXPECT_EQ(bench.read_holding(spec::kRegKp, 1)[0], 77);
}

// Damaged frames change nothing and are not answered.
TEST(RegisterBus, EverySingleBitErrorOfAWriteIsIgnored) {
  Bench bench(in_lockstep(chip_with(quick())));
  bench.next_tick();
  const std::uint16_t kp = bench.model().params()[spec::kRegKp];
  for (std::size_t byte = 0; byte < 8; ++byte) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      ModbusRequest request = write_single_register(1, address_of(spec::kRegKp), 0x5A5A);
      request.frame[byte].data ^= static_cast<std::uint8_t>(1u << bit);
      const ModbusResult result = bench.ask(request, 2'000);
      EXPECT_EQ(result.outcome, ModbusOutcome::timeout) << byte << "." << bit;
      bench.run(25'000);  // the silence after which a damaged frame is forgotten
    }
  }
  EXPECT_EQ(bench.read_holding(spec::kRegKp, 1)[0], kp);
  EXPECT_GE(bench.coverage().crc_errors, 60u);
}

}  // namespace
}  // namespace meltstage::tb
