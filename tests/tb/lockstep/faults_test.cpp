// SPDX-License-Identifier: Apache-2.0
// Every fault of the specification, in lockstep: raised by its cause, the heater low at once, the first fault
// kept, the clear refused while the cause stands and accepted after it. The bench itself checks on every
// clock that a cause has the heater low one clock later (SafetyViolation).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>

#include "running_case.hpp"
#include "tb/stimulus/scenarios.hpp"

namespace meltstage::tb {
namespace {

Settings with(const Settings& more) {
  Settings all = quick();
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

class Fault : public ::testing::TestWithParam<FaultScenario> {};

TEST_P(Fault, IsRaisedReportedAndCleared) {
  const FaultScenario& s = GetParam();
  const auto bit = static_cast<std::uint16_t>(1u << s.fault);
  const auto latched = [&](const chip::Chip& chip) { return (chip.guard.fault_q & bit) != 0; };
  const auto cause_gone = [&](const chip::Chip& chip) { return (chip.guard.cause_q & bit) == 0; };
  Bench bench(in_lockstep(chip_with(with(s.settings))));

  s.sound(bench);
  bench.next_tick();
  bench.next_tick();
  ASSERT_EQ(bench.model().guard.fault_q, 0) << "before the break";
  if (s.heating) {
    ASSERT_EQ(bench.command(spec::kCmdRun).outcome, ModbusOutcome::data);
    bench.next_tick();
    ASSERT_TRUE(bench.run_until([](const chip::Chip& chip) { return chip.guard.heater_q != 0; }, 20'000))
        << "never heated";
  }
  if (s.fault == spec::kFaultZeroRise) {
    for (int i = 0; i < 3; ++i) bench.next_tenth();
  }

  s.broken(bench);
  for (int i = 0; i < 20 && !latched(bench.model()); ++i) {
    bench.run_until(latched, 3'000);
    if (!latched(bench.model())) bench.next_tenth();
  }
  ASSERT_TRUE(latched(bench.model())) << "not raised";
  EXPECT_FALSE(bench.out().heater);
  EXPECT_FALSE(bench.out().fault_n);
  bench.run(2100);
  const bool safe_en = bench.out().safe_en;
  bench.run(1100);
  EXPECT_EQ(bench.out().safe_en, safe_en) << "still toggles";

  EXPECT_EQ(bench.read_input(spec::kInFault), bit) << "as the host reads it";
  EXPECT_EQ(spec::first_fault(bench.read_input(spec::kInFirstFault)), s.fault);
  EXPECT_EQ(bench.command(spec::kCmdRun).exception_code, spec::kExcDevice) << "Run with a fault latched";
  if (s.cause_stays) {
    EXPECT_EQ(bench.read_input(spec::kInCause) & bit, bit);
    const ModbusResult refused = bench.command(spec::kCmdClearFault);
    EXPECT_EQ(refused.exception_code, spec::kExcDevice) << "clear with the cause present";
    EXPECT_TRUE(latched(bench.model()));
  }

  s.mend(bench);
  for (int i = 0; i < 8 && bench.model().guard.cause_q != 0; ++i) bench.next_tick();
  ASSERT_TRUE(cause_gone(bench.model()));
  EXPECT_TRUE(latched(bench.model())) << "cleared without the host";
  EXPECT_EQ(bench.command(spec::kCmdClearFault).outcome, ModbusOutcome::data);
  EXPECT_EQ(bench.read_input(spec::kInFault), 0);
  EXPECT_EQ(spec::first_fault(bench.read_input(spec::kInFirstFault)), std::nullopt);
  EXPECT_TRUE(bench.out().fault_n);
  EXPECT_FALSE(bench.out().heater) << "heats again without a new Run";
  EXPECT_EQ(bench.command(spec::kCmdRun).outcome, ModbusOutcome::data) << "Run after the clear";
  EXPECT_GT(bench.finish().clocks, 0u);
}

INSTANTIATE_TEST_SUITE_P(Each, Fault, ::testing::ValuesIn(fault_scenarios()),
                         [](const auto& scenario) { return std::string(scenario.param.name); });

TEST(FaultScenarios, NameEveryFaultOfTheSpecification) {
  std::vector<bool> seen(spec::kFaultCount);
  for (const FaultScenario& s : fault_scenarios()) seen[s.fault] = true;
  EXPECT_THAT(seen, ::testing::Each(true));
}

// Causes that latch only while heating is on.
TEST(FaultScenarios, RunOnlyCausesDoNotLatchWhileIdle) {
  for (const FaultScenario& s : fault_scenarios()) {
    if ((spec::kFaultRunOnly >> s.fault & 1) == 0) continue;
    SCOPED_TRACE(s.name);
    Bench bench(model_alone(chip_with(with(s.settings))));
    s.sound(bench);
    bench.next_tick();
    s.broken(bench);
    for (int i = 0; i < 6; ++i) bench.next_tenth();
    EXPECT_EQ(bench.model().guard.fault_q, 0);
  }
}

TEST(FirstFault, IsNotOverwrittenByTheNext) {
  Bench bench(in_lockstep(chip_with(quick())));
  bench.next_tick();
  bench.world.inhibit = true;
  bench.run(10);
  bench.poke([](chip::Chip& chip) { chip.sysctrl.state_q = 0b11111; });
  bench.run(10);
  EXPECT_EQ(bench.read_input(spec::kInFault), 1u << spec::kFaultInhibit | 1u << spec::kFaultState);
  EXPECT_EQ(spec::first_fault(bench.read_input(spec::kInFirstFault)), spec::kFaultInhibit);
}

// The emergency stop acts without a clock.
TEST(EmergencyStop, ForcesTheHeaterLowInTheSameClock) {
  Bench bench(in_lockstep(chip_with(quick({{spec::kRegSetpoint, 1000}}))));
  bench.world.temperature_degc = 50.0;
  bench.next_tick();
  ASSERT_EQ(bench.command(spec::kCmdRun).outcome, ModbusOutcome::data);
  bench.next_tick();
  ASSERT_TRUE(bench.run_until([](const chip::Chip& chip) { return chip.guard.heater_q != 0; }, 30'000));
  bench.world.inhibit = true;
  EXPECT_FALSE(bench.clock().heater);
  EXPECT_TRUE(bench.run_until([](const chip::Chip& chip) { return chip.guard.fault_q != 0; }, 5));
}

// A single flipped bit in the parameter memory is corrected in both sets, with no fault.
TEST(ParameterFlip, OfOneBitIsCorrected) {
  constexpr std::uint32_t kActiveBits = spec::kHolding[spec::kRegKd].stored;
  constexpr std::uint32_t kStagedBits = spec::kHolding[spec::kRegKiHold].stored;
  Bench bench(in_lockstep(chip_with(quick())));
  bench.next_tick();
  for (unsigned place = 0; place < 22; ++place) {
    bench.poke([&](chip::Chip& chip) {
      flip_active(chip, spec::kRegKd, kActiveBits & 1u << place);
      chip.mem.staged_q[spec::kRegKiHold] ^= kStagedBits & 1u << place;
    });
    bench.next_tick();
    bench.run(100);
  }
  EXPECT_EQ(bench.read_input(spec::kInMemCorrected), std::popcount(kActiveBits) + std::popcount(kStagedBits));
  EXPECT_EQ(bench.model().params()[spec::kRegKd], spec::kHolding[spec::kRegKd].reset);
  EXPECT_EQ(bench.model().guard.fault_q, 0);
}

}  // namespace
}  // namespace meltstage::tb
