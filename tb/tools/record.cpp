// SPDX-License-Identifier: Apache-2.0
// record short|long FILE.mvec: runs the chip's model among its devices and writes what its pins did.
// short: reset, one command, its answer. long: from reset through every kind of
// command, heating, faults and stops.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

#include "tb/lockstep/bench.hpp"
#include "tb/lockstep/pin_recording.hpp"

namespace meltstage::tb {
namespace {

constexpr std::uint64_t kTick = spec::kClkHz / 100;  // control period of 10 ms

void must(bool condition, std::string_view what) {
  if (!condition)
    throw std::logic_error(fmt::format("record: the scenario no longer reaches its aim: {}", what));
}

void reset(Bench& bench) {
  bench.world.addr_strap = 2;
  bench.world.reset = true;
  bench.run(20);
  bench.world.reset = false;
  bench.run(100);
}

// While the reset control period of 100 ms passes: settings for quick work, every kind of request, refusals.
void talk(Bench& bench) {
  const std::uint8_t unit = bench.unit();
  bench.write(spec::kRegSetpoint, 300);
  bench.write_block(spec::kRegMode, {spec::word_of({spec::kModeManual}), 3000, 0, 20, 1});
  bench.write(spec::kRegTs, 10);
  bench.write(spec::kRegSensType, 3);  // MAX31865
  bench.write(spec::kRegBadMax, 1);
  bench.write(spec::kRegDtdtMax, 0);
  bench.write(spec::kRegFbTime, 2);
  bench.write_block(spec::kRegSpiDiv, {2, 0, 400, 0, 0, 5000, 0});
  must(bench.write(spec::kRegBaud, 5001).exception_code == spec::kExcValue,
       "a value above its range is refused");
  must(bench.write(spec::kRegSetpoint, 1451).exception_code == spec::kExcValue,
       "a set-point above T_MAX is refused");
  must(bench.write(spec::kRegTs, 9).exception_code == spec::kExcValue, "a value below its range is refused");
  must(bench.command(spec::kCmdRun).exception_code == spec::kExcDevice, "RUN without a sample is refused");
  bench.read_holding(0, 32);
  bench.read_holding(32, spec::kHoldingCount - 32);
  bench.ask(read_holding_registers(unit, spec::kHoldingBase + spec::kHoldingCount, 1));
  bench.ask(diagnostic_echo(unit, 0xA53C));
  bench.ask(report_server_id(unit));
  bench.ask(read_device_identification(unit, 1, 0));
  ModbusRequest spoilt = read_input_registers(unit, 0, 1);
  spoilt.frame.back().data ^= 1;
  bench.ask(spoilt);
  bench.ask(read_input_registers(static_cast<std::uint8_t>(unit + 1), 0, 1));
  must(bench.run_until([](const chip::Chip& chip) { return chip.uartc.baud_q == 5000; }, 1'300'000),
       "new settings are active");
  must(bench.run_until([](const chip::Chip& chip) { return chip.guard.pv_valid_q != 0; }, 3 * kTick),
       "first sample");
}

// Clears what is latched once its cause is gone, and heats again.
void heat(Bench& bench) {
  must(bench.run_until([](const chip::Chip& chip) { return chip.guard.cause_q == 0; }, 3 * kTick),
       "causes go");
  bench.command(spec::kCmdClearFault);
  bench.command(spec::kCmdRun);
  must(bench.model().guard.run_q != 0, "heating");
  must(bench.run_until([](const chip::Chip& chip) { return chip.guard.heater_q != 0; }, 3 * kTick),
       "heater on");
}

void expect_fault(Bench& bench, spec::Fault fault) {
  must(bench.run_until([&](const chip::Chip& chip) { return (chip.guard.fault_q >> fault & 1) != 0; },
                       3 * kTick),
       fmt::format("fault {} latches", int{fault}));
  bench.run(2'000);
  bench.read_input(0, 24);
}

void control(Bench& bench) {
  bench.world.temperature_degc = 28.0;
  heat(bench);
  bench.run(kTick);
  bench.write(spec::kRegMode, 0);
  for (const double degc : {28.5, 29.5, 30.5}) {
    bench.world.temperature_degc = degc;
    bench.run(kTick);
    bench.read_input(0, 24);
  }
  bench.world.temperature_degc = 28.0;
  bench.run(kTick);
  bench.command(spec::kCmdStop);
  bench.run(1'000);
}

void fail(Bench& bench) {
  heat(bench);
  bench.world.sensor.probe = ProbeFault::open;
  expect_fault(bench, spec::kFaultSensorFault);
  must(bench.command(spec::kCmdRun).exception_code == spec::kExcDevice, "RUN with a fault is refused");
  bench.world.sensor = {};

  heat(bench);
  bench.world.inhibit = true;
  bench.run(50);
  bench.world.inhibit = false;
  expect_fault(bench, spec::kFaultInhibit);

  heat(bench);
  bench.world.feedback = Feedback::stuck_high;
  expect_fault(bench, spec::kFaultHeaterFb);
  bench.world.feedback = Feedback::follows;

  // Trips inside a pulse, so that the pulse's end shows the clock in which the heater is turned off.
  heat(bench);
  bench.world.feedback = Feedback::stuck_low;
  expect_fault(bench, spec::kFaultHeaterFb);
  bench.world.feedback = Feedback::follows;

  heat(bench);
  bench.world.temperature_degc = 160.0;
  expect_fault(bench, spec::kFaultOverTemp);
  bench.world.temperature_degc = 28.0;
}

// The time base's 0.1 s: telemetry, then the host watchdog.
void wait_for_tenth(Bench& bench) {
  heat(bench);
  must(bench.run_until([](const chip::Chip& chip) { return chip.sysctrl.tenth_q != 0; }, 1'300'000),
       "0.1 s have passed");
  bench.run(kTick + 40'000);
  bench.read_input(0, 24);
  bench.world.reset = true;
  bench.run(10);
  bench.world.reset = false;
  bench.run(1'000);
}

void record(std::string_view length, const std::filesystem::path& path) {
  Bench bench(std::make_unique<PinRecording>(path, fmt::format("record {}", length)),
              "MAX31865");  // its set-up write moves spi_mosi_o
  reset(bench);
  if (length == "long") {
    talk(bench);
    control(bench);
    fail(bench);
    wait_for_tenth(bench);
  } else {
    bench.read_input(spec::kInDeviceId, 3);
  }
  bench.finish();
  fmt::print("{}: {} clocks\n", path.string(), bench.cycle());
}

}  // namespace
}  // namespace meltstage::tb

int main(int argc, char** argv) {
  const std::string_view length = argc == 3 ? argv[1] : "";
  if (length != "short" && length != "long") {
    fmt::print(stderr, "record: expected 'short FILE' or 'long FILE'\n");
    return 2;
  }
  try {
    meltstage::tb::record(length, argv[2]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
