// SPDX-License-Identifier: Apache-2.0
// A print that a fault ends says what was measured, the limit that it crossed, and what to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "app/print/job_plan.hpp"
#include "tb/pins/fault_sentence.hpp"

namespace meltstage {
namespace {

namespace spec = chip::spec;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

// The shorted switch is not seen by the feedback wire, so that the temperature tells it.
constexpr auto kWithoutFeedback =
    static_cast<std::uint16_t>(spec::kHolding[spec::kRegCtrl].reset & ~(1 << spec::kCtrlFbEn));

class Nowhere final : public recording::Sink {
  void begin(const recording::Header&) override {}
  void change(const recording::Change&) override {}
  void end(std::uint64_t) override {}
};

// The verdict of the first job with what happens to its printer at 5 s, in the heat-up.
std::string verdict_after(tb::EventKind event, std::vector<tb::RegisterValue> registers = {}) {
  tb::PrintJob job = app::load_job(MELTSTAGE_SOURCE_DIR "/examples/first.toml").job;
  job.rtl = tb::RtlWindows::none;
  job.events = {{5.0, event}};
  for (tb::RegisterValue& of_job : job.registers)
    std::erase_if(registers, [&](const tb::RegisterValue& r) {
      if (r.reg == of_job.reg) of_job.value = r.value;
      return r.reg == of_job.reg;
    });
  job.registers.insert(job.registers.end(), registers.begin(), registers.end());
  Nowhere sink;
  const tb::PrintResult result = tb::run_print(job, sink, [](const tb::PrintProgress&) {});
  EXPECT_FALSE(result.good);
  return result.verdict;
}

TEST(FaultVerdict, HotterThanAllowed) {
  const std::string verdict =
      verdict_after(tb::EventKind::switch_short, {{spec::kRegTMax, 700}, {spec::kRegCtrl, kWithoutFeedback}});
  EXPECT_THAT(verdict, AllOf(HasSubstr("OverTemp: "), ContainsRegex("Measured: PV 7[0-9.]+ degC\\."),
                             HasSubstr("Limit: T_MAX 70 degC."), ContainsRegex("Next: .*raise T_MAX")));
}

TEST(FaultVerdict, BrokenSensor) {
  EXPECT_THAT(verdict_after(tb::EventKind::sensor_open),
              AllOf(HasSubstr("SensorFault: "),
                    ContainsRegex("Measured: RAW_H 0x[0-9a-f]{4}, RAW_L 0x[0-9a-f]{3}1\\."),
                    ContainsRegex("Limit: BAD_MAX [0-9]+\\."), HasSubstr("Next: Check the sensor's wires")));
}

TEST(FaultVerdict, BrokenHeater) {
  EXPECT_THAT(verdict_after(tb::EventKind::heater_open),
              AllOf(HasSubstr("NotHeating: "), ContainsRegex("Measured: PV [0-9.]+ degC, SP_WORK 60 degC"),
                    ContainsRegex("Limit: LBA_RISE [0-9.]+ degC, LBA_TIME 15 s"),
                    HasSubstr("Next: Check the heater")));
}

TEST(FaultVerdict, LostHost) {
  EXPECT_THAT(verdict_after(tb::EventKind::host_lost, {{spec::kRegHostWd, 20}}),
              AllOf(HasSubstr("HostWatchdog: "), HasSubstr("Limit: HOST_WD 2 s."),
                    HasSubstr("Next: Check the serial")));
}

TEST(FaultVerdict, EveryFaultSaysWhatToDo) {
  const tb::FaultRegisters registers{[](spec::In) { return spec::kPvNone; },
                                     [](spec::Reg) { return std::uint16_t{7}; }};
  for (unsigned bit = 0; bit < spec::kFaultCount; ++bit)
    EXPECT_THAT(tb::fault_sentence(static_cast<spec::Fault>(bit), registers),
                ContainsRegex(" Next: [A-Z].*\\.$"));
  EXPECT_THAT(tb::fault_sentence(spec::kFaultOverTemp, registers), HasSubstr("PV without a reading"));
}

}  // namespace
}  // namespace meltstage
