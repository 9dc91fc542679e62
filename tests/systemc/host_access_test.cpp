// SPDX-License-Identifier: Apache-2.0
// Zero-time access against frames on the serial line: same answers, same registers.
#include "cmodel/host_access.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "tb/devices/modbus_host.hpp"
#include "tb/devices/spi_sensors.hpp"

namespace meltstage::chip {
namespace {

using namespace spec;

constexpr std::uint16_t at(Reg reg) { return static_cast<std::uint16_t>(kHoldingBase + reg); }

std::unique_ptr<tb::SpiSensor> room_sensor() {
  tb::SpiSensorConfig config{.clock_hz = kClkHz, .source = [](std::uint64_t) { return 25.0; }};
  return tb::make_spi_sensor("MAX31855", std::move(config));
}

// A chip with a sensor at room temperature.
class Fed {
 public:
  void step(std::uint64_t cycle, bool uart_rx) {
    in_.uart_rx = uart_rx;
    in_.heater_fb = out_.heater;
    in_.spi_miso = sensor_->step(cycle, out_.spi_cs_n, out_.spi_sclk, out_.spi_mosi);
    out_ = chip.step(in_);
  }
  const Outputs& out() const { return out_; }
  void set_inhibit(bool pressed) { in_.inhibit = pressed; }

  Chip chip;

 private:
  std::unique_ptr<tb::SpiSensor> sensor_ = room_sensor();
  Inputs in_;
  Outputs out_ = chip.outputs(in_);
};

struct Access {
  bool is_read;
  std::uint16_t address;
  std::vector<std::uint16_t> values;  // read: as many as are asked for
};

// The snapshot is not renewed while an answer is sent, and only one of both sends answers; so what it is
// taken from is compared instead.
bool in_snapshot(std::uint16_t address) {
  return (address >= kInPv && address <= kInDuty) || (address >= kInPvFine && address <= kInSamples);
}
auto snapshot_source(const Chip& chip) {
  const Readings r = chip.readings();
  return std::tuple(r.pv_valid, r.pv, r.slope, r.sp_work, r.duty, r.term_p, r.term_i, r.term_d, r.raw,
                    r.samples);
}

// CfgPwm and CmdReady both wait for what comes next: a frame that had to wait for a control tick ends in
// CmdReady, an access during the tick leaves the chip to end it in CfgPwm.
std::uint16_t input(const Chip& chip, std::uint16_t address) {
  const std::uint16_t value = chip.read_register(address);
  const bool waits = address == kInFirstFault && (value & 0xFF) == kStCfgPwm;
  return waits ? static_cast<std::uint16_t>((value & 0xFF00) | kStCmdReady) : value;
}

// Two chips at the same clock: one has a host on its serial line, the other is accessed directly.
class Pair {
 public:
  void reset() {
    serial.chip = direct.chip = Chip{};
    clocks(10);
  }
  void clocks(std::uint64_t count) {
    for (; count != 0; --count) clock();
  }

  // The access by frame to one chip; to the other at the clock in which the frame has been received.
  void access(Access access, bool single) {
    submit(access, single);
    const std::uint16_t messages = serial.chip.uartc.messages();
    while (serial.chip.uartc.messages() == messages) clock();
    const Exception exception = access.is_read ? host_read(direct.chip, access.address, access.values)
                                               : host_write(direct.chip, access.address, access.values);
    while (host_.busy()) clock();
    const auto result = host_.take_result();
    ASSERT_TRUE(result.has_value());
    ASSERT_TRUE(result->outcome == tb::ModbusOutcome::data || result->outcome == tb::ModbusOutcome::exception)
        << result->problem;
    EXPECT_EQ(int{exception}, int{result->exception_code}) << describe(access);
    if (access.is_read && exception == kExcNone && access.address >= kHoldingBase) {
      EXPECT_EQ(access.values, result->registers);
    }
    ++(exception == kExcNone ? taken : refused);
  }

  // Everything that a host can see, and the active parameters.
  void expect_equal(const char* when) const {
    for (std::uint16_t i = 0; i < kInputCount; ++i)
      EXPECT_TRUE(in_snapshot(i) || input(serial.chip, i) == input(direct.chip, i))
          << when << ": " << kInput[i].name;
    EXPECT_EQ(snapshot_source(serial.chip), snapshot_source(direct.chip)) << when;
    EXPECT_EQ(serial.chip.mem.staged_q, direct.chip.mem.staged_q) << when;
    EXPECT_EQ(serial.chip.mem.active_q, direct.chip.mem.active_q) << when;
    EXPECT_EQ(serial.chip.paramc.ordered_q, direct.chip.paramc.ordered_q) << when;
  }

  static std::string describe(const Access& access) {
    std::string text = (access.is_read ? "read " : "write ") + std::to_string(access.address);
    for (const std::uint16_t value : access.values) text += ' ' + std::to_string(value);
    return text;
  }

  Fed serial;
  Fed direct;
  unsigned taken = 0;
  unsigned refused = 0;

 private:
  void clock() {
    serial.step(cycle_, host_.step(cycle_, serial.out().uart_tx));
    direct.step(cycle_, true);
    ++cycle_;
  }
  void submit(const Access& access, bool single) {
    const auto count = static_cast<std::uint16_t>(access.values.size());
    host_.submit(access.is_read ? tb::read_holding_registers(1, access.address, count)
                 : single       ? tb::write_single_register(1, access.address, access.values[0])
                                : tb::write_multiple_registers(1, access.address, access.values));
  }

  tb::ModbusHost host_{{.line = {kClkHz, 115200.0, tb::k8E1}}, stream(1, "host")};
  std::uint64_t cycle_ = 3 * kClkHz / 10;  // the sensors are past their power-up time
};

// Frames of all kinds that leave the serial line as it is.
class Frames {
 public:
  explicit Frames(unsigned seed) : random_(seed) {}

  Access next(bool locked) {
    if (locked && chance(2)) return {false, at(kRegLock), {0}};
    if (chance(12)) return {false, static_cast<std::uint16_t>(below(0x180)), {}};
    if (chance(12))
      return {false,
              static_cast<std::uint16_t>(chance(2) ? below(kHoldingBase) : at(kRegFormat) + 1 + below(64)),
              {1, 2}};
    if (chance(12)) return {false, at(kRegFormat), {0, 0}};
    const unsigned count = 1 + (chance(2) ? 0 : below(16));
    if (chance(6)) return {true, static_cast<std::uint16_t>(below(0x13F)), std::vector<std::uint16_t>(count)};
    const unsigned first = chance(3) ? 0 : below(kRegAddress - count + 1);
    Access access{false, static_cast<std::uint16_t>(kHoldingBase + first), {}};
    for (unsigned i = 0; i < count; ++i) access.values.push_back(value(first + i));
    return access;
  }
  unsigned below(unsigned end) { return std::uniform_int_distribution<unsigned>(0, end - 1)(random_); }
  bool chance(unsigned one_in) { return below(one_in) == 0; }

 private:
  std::uint16_t value(unsigned index) {
    constexpr std::uint16_t kCommands[] = {kCmdStop, kCmdRun,    kCmdClearFault,
                                           kCmdHold, kCmdCommit, kCmdDiscard};
    const RegisterInfo& info = kHolding[index];
    if (index == kRegCmd) return chance(12) ? std::uint16_t{0xA5FF} : kCommands[below(6)];
    if (chance(40)) return static_cast<std::uint16_t>(below(0x10000));
    if (index == kRegTs) return static_cast<std::uint16_t>(info.min + static_cast<int>(below(10)));
    if (index == kRegLock) return chance(4) ? 1 : 0;
    if (index == kRegSensType || chance(2)) return static_cast<std::uint16_t>(info.reset);
    return static_cast<std::uint16_t>(chance(2) ? info.min : info.max);
  }
  std::mt19937 random_;
};

// From reset, with a control tick of 10 ms.
void start_heating(Pair& pair) {
  pair.reset();
  pair.access({false, at(kRegTs), {10}}, true);
  pair.access({false, at(kRegSetpoint), {1100}}, true);
  pair.clocks(kClkHz / 10);
  pair.access({false, at(kRegCmd), {kCmdRun}}, true);
}

TEST(HostAccess, IsWhatFramesDo) {
  Pair pair;
  Frames frames(11);
  unsigned runs = 0;
  for (int i = 0; i < 250 && !testing::Test::HasFailure(); ++i) {
    if (i % 25 == 0) start_heating(pair);
    const Access access = frames.next(pair.direct.chip.params()[kRegLock] != 0);
    pair.access(access, access.values.size() == 1 && frames.chance(2));
    pair.clocks(200);
    pair.expect_equal(Pair::describe(access).c_str());
    pair.clocks(frames.below(kClkHz / 60));
    runs += pair.direct.chip.guard.run_q;
  }
  EXPECT_GT(pair.taken, 60u);
  EXPECT_GT(pair.refused, 60u);
  EXPECT_GT(runs, 0u);
}

TEST(HostAccess, ClearsAFaultAsAFrameDoes) {
  Pair pair;
  start_heating(pair);
  for (Fed* fed : {&pair.serial, &pair.direct}) fed->set_inhibit(true);
  pair.clocks(10);
  for (Fed* fed : {&pair.serial, &pair.direct}) fed->set_inhibit(false);
  pair.clocks(10);
  ASSERT_EQ(pair.direct.chip.read_register(kInFault), 1u << kFaultInhibit);
  pair.access({false, at(kRegCmd), {kCmdClearFault}}, true);
  pair.clocks(200);
  EXPECT_EQ(pair.direct.chip.read_register(kInFault), 0);
  pair.expect_equal("after ClearFault");
}

class HostAccessAlone : public testing::Test {
 protected:
  HostAccessAlone() { clocks(10); }
  void clocks(unsigned count) {
    for (; count != 0; --count) chip.step({});
  }
  Exception write(Reg reg, std::vector<std::uint16_t> values) { return host_write(chip, at(reg), values); }
  Chip chip;
};

TEST_F(HostAccessAlone, AccessWakesTheChipFromIdle) {
  ASSERT_EQ(chip.sysctrl.state_q, kStIdle);
  std::vector<std::uint16_t> out(1);
  EXPECT_EQ(host_read(chip, kInStatus, out), kExcNone);
  EXPECT_EQ(chip.sysctrl.state_q, kStCmdReady);
}

TEST_F(HostAccessAlone, AnEmptyOrTooLongAccessIsAValueError) {
  std::vector<std::uint16_t> none, many_reads(33), many_writes(17);
  EXPECT_EQ(host_read(chip, 0, none), kExcValue);
  EXPECT_EQ(host_read(chip, kHoldingBase, many_reads), kExcValue);
  EXPECT_EQ(write(kRegRampUp, none), kExcValue);
  EXPECT_EQ(write(kRegSensFrame, many_writes), kExcValue);
}

TEST_F(HostAccessAlone, ARefusedReadLeavesTheBuffer) {
  std::vector<std::uint16_t> out(2, 0xEEEE);
  EXPECT_EQ(host_read(chip, kInputCount - 1, out), kExcAddress);
  EXPECT_EQ(out, std::vector<std::uint16_t>(2, 0xEEEE));
}

TEST_F(HostAccessAlone, IsBusyWhileASerialCommandIsCarriedOut) {
  chip.sysctrl.state_q = kStCmdDecode;
  EXPECT_EQ(write(kRegSetpoint, {100}), kExcBusy);
  EXPECT_EQ(chip.read_register(at(kRegSetpoint)), 0);
}

TEST_F(HostAccessAlone, IsBusyInTheClockOfACommit) {
  chip.sysctrl.commit_q = 1;
  EXPECT_EQ(write(kRegSetpoint, {100}), kExcBusy);
}

TEST_F(HostAccessAlone, StopIsTakenWhileBusy) {
  chip.sysctrl.state_q = kStWrParam;
  EXPECT_EQ(write(kRegCmd, {kCmdStop}), kExcNone);
  EXPECT_EQ(chip.paramc.stop_q, 1);
}

TEST_F(HostAccessAlone, DiscardActsAtOnce) {
  ASSERT_EQ(write(kRegSetpoint, {100}), kExcNone);
  ASSERT_EQ(write(kRegCmd, {kCmdDiscard}), kExcNone);
  EXPECT_EQ(chip.read_register(at(kRegSetpoint)), 0);
  EXPECT_EQ(chip.read_register(kInStatus) >> kStatusWritesPending & 1, 0);
}

TEST_F(HostAccessAlone, AFrameOnItsWayKeepsItsAnswer) {
  chip.paramc.rsp_kind_q = kRspEcho;
  chip.paramc.rsp_exc_q = 0x55;
  ASSERT_EQ(write(kRegSetpoint, {9999}), kExcValue);
  EXPECT_EQ(chip.paramc.rsp_kind_q, kRspEcho);
  EXPECT_EQ(chip.paramc.rsp_exc_q, 0x55);
}

TEST_F(HostAccessAlone, InResetNothingIsAnswered) {
  Chip in_reset;
  std::vector<std::uint16_t> out(1);
  EXPECT_EQ(host_read(in_reset, kInStatus, out), kExcDevice);
  EXPECT_EQ(host_write(in_reset, at(kRegCmd), std::vector<std::uint16_t>{kCmdStop}), kExcDevice);
}

}  // namespace
}  // namespace meltstage::chip
