// SPDX-License-Identifier: Apache-2.0
// The model from event to event: a heated head over the longest run of Xie et al. 2023 (490 s), against RTL
// and model on every clock; and the same run at other rates, to show what its time depends on.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/bench.hpp"
#include "bench/bench_stimulus.hpp"
#include "cmodel/advance.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/head.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;

constexpr unsigned kSensorType = 3;  // MAX31865, the preset that converts fastest
constexpr double kFirstSamples_s = 2.5;

// Rates in real time. Another clock is the same chip with its periods set to as many more clocks.
struct Rates {
  double clock_mhz = 12.0;
  double pwm_hz = 1000.0;
  double control_hz = 10.0;
};

chip::Chip chip_at(const Rates& rates) {
  chip::Chip chip;
  for (int i = 0; i < 4; ++i) chip.step({});  // the reset synchroniser lets go
  const double clock = rates.clock_mhz * 1e6 / spec::kClkHz;
  const auto set = [&](spec::Reg reg, double value) {
    chip.mem.preset(reg, static_cast<std::uint16_t>(std::lround(value)));
  };
  set(spec::kRegSensType, kSensorType);
  set(spec::kRegSetpoint, 1000);
  set(spec::kRegBaud, spec::kHolding[spec::kRegBaud].reset / clock);
  set(spec::kRegTs, 1000.0 / rates.control_hz * clock);
  set(spec::kRegPwmPeriod, rates.clock_mhz * 1e6 / rates.pwm_hz);
  set(spec::kRegSpiDiv, std::max(2.0, spec::kHolding[spec::kRegSpiDiv].reset * clock));
  set(spec::kRegTlmPeriod, 10.0 * clock);  // telemetry each second
  set(spec::kRegHoldTime, 0);
  set(spec::kRegLbaTime, 0);  // detectors whose times would change with the clock
  set(spec::kRegDtdtMax, 0);
  set(spec::kRegHostWd, 0);  // the host only listens
  return chip;
}

// The chip's surroundings, and the number of their pin changes.
struct Office {
  tb::Head head;
  std::uint64_t changes = 0;
  std::uint64_t hash = 0xcbf29ce484222325U;  // FNV-1a over them
  chip::Inputs in;
  chip::Outputs out{};

  explicit Office(double clock_hz)
      : head({.sensor = std::string(spec::kSensorPresets[kSensorType].name), .clock_hz = clock_hz}) {}
  chip::Inputs step(std::uint64_t cycle, const chip::Outputs& pins) { return head.step(cycle, pins); }
  std::uint64_t next_event() const { return head.next_event(); }
  void observe(std::uint64_t cycle, const chip::Inputs& now_in, const chip::Outputs& now_out) {
    if (now_in == in && now_out == out) return;
    in = now_in;
    out = now_out;
    ++changes;
    hash = (hash ^ cycle) * 0x100000001b3U;
  }
};

struct Skipped {
  double processor_s;
  double clocks;
  double changes;
};

enum class Walk { step, advance };

// `length_s` of a head that heats once there are samples.
Skipped run(const Rates& rates, double length_s, Walk walk, Office& office) {
  const double clock_hz = rates.clock_mhz * 1e6;
  const auto until = static_cast<std::uint64_t>(length_s * clock_hz);
  chip::Run run{.chip = chip_at(rates)};
  run.out = run.chip.outputs({});
  const auto observe = [&](auto... now) { office.observe(now...); };
  const auto go = [&](std::uint64_t end) {
    if (walk == Walk::advance)
      chip::advance(run, end, office, observe);
    else
      chip::step_until(run, end, office, observe);
  };
  const double begin = processor_s();
  office.head.host().submit(tb::read_input_registers(1, 0, 1));  // the first command starts the control cycle
  go(std::min(until, static_cast<std::uint64_t>(kFirstSamples_s * clock_hz)));
  office.head.host().submit(tb::write_single_register(1, spec::kHoldingBase, spec::kCmdClearFault));
  office.head.host().submit(tb::write_single_register(1, spec::kHoldingBase, spec::kCmdRun));
  go(until);
  if (run.chip.guard.run_q == 0)
    throw std::runtime_error(
        fmt::format("bench skip: the heater does not run, faults {:#06x}", run.chip.guard.fault_q));
  return {processor_s() - begin, static_cast<double>(until), static_cast<double>(office.changes)};
}

Skipped advanced(const Rates& rates, double length_s) {
  Office office(rates.clock_mhz * 1e6);
  return run(rates, length_s, Walk::advance, office);
}

double rtl_clocks_per_second(std::size_t clocks) {
  const Stimulus stimulus = record_stimulus(clocks);
  const auto dut = tb::make_verilated_rtl();
  dut->load(stimulus.start, stimulus.before);
  return clocks_per_second(stimulus, [&](const chip::Inputs& in) { dut->step(in); });
}

}  // namespace

std::vector<BenchRow> bench_skip(const BenchOptions& options) {
  const double length_s = options.quick ? 49.0 : 490.0;
  const double stepped_s = options.quick ? 3.0 : 5.0;
  const int rounds = options.quick ? 1 : 3;

  // The best of interleaved rounds: a machine that is slow for a while slows all.
  Skipped best{1e9, 0.0, 0.0};
  double rtl = 0.0;
  double model = 0.0;
  bool equal = true;
  for (int round = 0; round < rounds; ++round) {
    tell(options.progress, "rounds", round, rounds);
    const Skipped one = advanced({}, length_s);
    if (one.processor_s < best.processor_s) best = one;
    rtl = std::max(rtl, rtl_clocks_per_second(options.quick ? 600'000 : 3'000'000));
    Office stepped(spec::kClkHz);
    Office skipped(spec::kClkHz);
    const Skipped slow = run({}, stepped_s, Walk::step, stepped);
    run({}, stepped_s, Walk::advance, skipped);
    model = std::max(model, slow.clocks / slow.processor_s);
    equal = equal && stepped.hash == skipped.hash && stepped.changes == skipped.changes;
  }
  const double effective = best.clocks / best.processor_s;
  std::vector<BenchRow> rows = {
      {fmt::format("{:.0f} s at 12 MHz, 10 Hz control, 1 kHz PWM", length_s),
       best.clocks / 1e6,
       "Mclock",
       {},
       {}},
      {"  processor time, plant and sensor noise included",
       best.processor_s,
       "s",
       {},
       0.5 * length_s / 490.0},
      {"  pin changes", best.changes / 1e6, "M", {}, {}},
      {"effective speed", effective / 1e6, "Mclock/s", {}, {}},
      {"Verilated RTL alone", rtl / 1e6, "Mclock/s", {}, {}},
      {"model on every clock, in the same surroundings", model / 1e6, "Mclock/s", {}, {}},
      {"effective / RTL alone", effective / rtl, "", 2000.0, {}},
      {fmt::format("pin changes equal to stepping, first {:.0f} s (1 yes)", stepped_s),
       equal ? 1.0 : 0.0,
       "",
       1.0,
       {}},
  };

  // The time follows the pin changes, of which safe_en's rhythm of 1024 clocks is one, not the clocks.
  constexpr std::size_t kSweeps = 7;
  std::size_t swept = 0;
  const auto sweep = [&](const std::string& what, const Rates& rates, std::optional<double> at_most) {
    tell(options.progress, "rates", swept++, kSweeps);
    const Skipped one = advanced(rates, length_s);
    rows.push_back({what + ": processor time", one.processor_s, "s", {}, {}});
    rows.push_back({"  over that of the first row", one.processor_s / best.processor_s, "", {}, at_most});
    rows.push_back({"  pin changes over those of the first row", one.changes / best.changes, "", {}, {}});
  };
  sweep("clock 6 MHz, half the clocks", {.clock_mhz = 6.0}, {});
  sweep("clock 24 MHz, 2 times the clocks", {.clock_mhz = 24.0}, 1.6);
  sweep("clock 48 MHz, 4 times the clocks", {.clock_mhz = 48.0}, 2.5);
  for (const double hz : {250.0, 4000.0}) sweep(fmt::format("PWM {:.0f} Hz", hz), {.pwm_hz = hz}, {});
  for (const double hz : {1.0, 50.0}) sweep(fmt::format("control {:.0f} Hz", hz), {.control_hz = hz}, {});
  return rows;
}

}  // namespace meltstage::app
