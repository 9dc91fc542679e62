// SPDX-License-Identifier: Apache-2.0
// Model and RTL as SystemC modules side by side: every output pin equal at every clock and between clocks.
#include <gtest/gtest.h>

#include "bench.hpp"

namespace meltstage::systemc {
namespace {

using chip::spec::kClkHz;

constexpr std::uint64_t kToFirstSample = kClkHz / 10 + 10'000;  // TS after reset is 100 ms
constexpr std::uint64_t kToFirstPulse = kClkHz / 10 + 30'000;   // the next control tick and two PWM periods
constexpr unsigned kPwmPeriod = 12'000;

class Pins : public testing::Test {
 protected:
  Pins() { bench.reset(); }

  void command(std::uint16_t address, std::uint16_t value) {
    const tb::ModbusResult result = bench.ask(tb::write_single_register(1, address, value));
    ASSERT_EQ(result.outcome, tb::ModbusOutcome::data)
        << "address " << address << " exception " << int{result.exception_code} << result.problem;
  }
  // By commands on the serial line alone.
  void start_heating() {
    command(chip::spec::kHoldingBase + chip::spec::kRegSetpoint, 1100);
    bench.clocks(kToFirstSample);
    command(chip::spec::kHoldingBase + chip::spec::kRegCmd, chip::spec::kCmdRun);
  }

  Bench& bench = Bench::instance();
};

TEST_F(Pins, EqualFromCommandToHeating) {
  const tb::ModbusResult inputs = bench.ask(tb::read_input_registers(1, 0, 32));
  ASSERT_EQ(inputs.outcome, tb::ModbusOutcome::data) << inputs.problem;
  EXPECT_EQ(inputs.registers[chip::spec::kInDeviceId], chip::spec::kDeviceId);
  start_heating();
  bench.clocks(kToFirstPulse);
  EXPECT_EQ(bench.difference(), "");
  EXPECT_GT(bench.compared(), 1'000'000u);
  EXPECT_GT(bench.heater_edges(), 0u);
  EXPECT_TRUE(bench.fault_n()) << bench.model.pins.chip().read_register(chip::spec::kInFault);
}

TEST_F(Pins, EmergencyStopAndResetActWithoutAClock) {
  start_heating();
  bench.clocks(kToFirstPulse);
  for (unsigned i = 0; i < kPwmPeriod && !bench.heater(); ++i) bench.clocks(1);
  ASSERT_TRUE(bench.heater());
  bench.set_inhibit(true);
  bench.settle();
  EXPECT_FALSE(bench.heater());
  bench.set_inhibit(false);
  bench.settle();
  EXPECT_TRUE(bench.heater());
  bench.set_reset(true);
  bench.settle();
  EXPECT_FALSE(bench.heater());
  EXPECT_EQ(bench.difference(), "");
}

TEST_F(Pins, InhibitLatchesAFaultInBoth) {
  bench.set_inhibit(true);
  bench.clocks(10);
  bench.set_inhibit(false);
  bench.clocks(10);
  EXPECT_FALSE(bench.fault_n());
  EXPECT_EQ(bench.difference(), "");
}

TEST_F(Pins, AChangedModelIsNoticed) {
  bench.clocks(10);
  ASSERT_EQ(bench.difference(), "");
  bench.model.pins.chip().guard.fault_q = 1;
  bench.clocks(2);
  EXPECT_NE(bench.difference().find("fault_no model 0 RTL 1"), std::string::npos) << bench.difference();
}

}  // namespace
}  // namespace meltstage::systemc
