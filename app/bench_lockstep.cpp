// SPDX-License-Identifier: Apache-2.0
// Speed of the pair: the same recorded stimulus on RTL alone, model alone, and both in lockstep.
#include <chrono>
#include <vector>

#include "app/bench.hpp"
#include "tb/head.hpp"
#include "tb/lockstep.hpp"
#include "tb/verilated_rtl.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;

// Input pins of a heated chip in work: polled twenty times a second, 10 Hz control, 1 kHz PWM.
struct Stimulus {
  chip::Chip start;                // state of the chip before the first clock
  chip::Inputs before;             // pins of the clock before that
  std::vector<chip::Inputs> pins;  // one entry a clock
};

Stimulus record_stimulus(std::size_t clocks) {
  constexpr std::uint64_t kWarmUp = 6'000'000;
  constexpr std::uint64_t kPoll = spec::kClkHz / 20;
  tb::Head head({});
  chip::Chip chip;
  chip::Outputs out = chip.outputs({.rst_n = false});
  Stimulus stimulus;
  stimulus.pins.reserve(clocks);
  const std::uint16_t setpoint[] = {1100};
  head.host().submit(tb::write_multiple_registers(1, spec::kHoldingBase + spec::kRegSetpoint, setpoint));
  for (std::uint64_t cycle = 0; cycle < kWarmUp + clocks; ++cycle) {
    if (cycle == kWarmUp - 1'000'000)
      head.host().submit(tb::write_single_register(1, spec::kHoldingBase, spec::kCmdRun));
    if (cycle % kPoll == kPoll - 1) head.host().submit(tb::read_input_registers(1, 0, 16));
    while (head.host().take_result()) {
    }
    chip::Inputs in = head.step(cycle, out);
    in.rst_n = cycle >= 20;
    if (cycle == kWarmUp) stimulus.start = chip;
    if (cycle < kWarmUp) {
      stimulus.before = in;
    } else {
      stimulus.pins.push_back(in);
    }
    out = chip.step(in);
  }
  return stimulus;
}

template <class Step>
double clocks_per_second(const Stimulus& stimulus, Step step) {
  const auto begin = std::chrono::steady_clock::now();
  for (const chip::Inputs& in : stimulus.pins) step(in);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  return static_cast<double>(stimulus.pins.size()) / elapsed.count();
}

}  // namespace

std::vector<BenchRow> bench_lockstep(const BenchOptions& options) {
  const std::size_t clocks = options.quick ? 600'000 : 3'000'000;
  const int rounds = options.quick ? 1 : 3;
  const Stimulus stimulus = record_stimulus(clocks);

  // The best of interleaved rounds: a machine that is slow for a while slows all three.
  double rtl = 0.0;
  double model = 0.0;
  double pair = 0.0;
  unsigned flop_bits = 0;
  unsigned toggles = 0;  // uses the results, so that nothing is optimised away
  for (int round = 0; round < rounds; ++round) {
    const auto dut = tb::make_verilated_rtl();
    dut->load(stimulus.start, stimulus.before);
    flop_bits = dut->flop_bits();
    rtl = std::max(
        rtl, clocks_per_second(stimulus, [&](const chip::Inputs& in) { toggles += dut->step(in).heater; }));

    chip::Chip chip = stimulus.start;
    model = std::max(
        model, clocks_per_second(stimulus, [&](const chip::Inputs& in) { toggles += chip.step(in).heater; }));

    auto beside = tb::make_verilated_rtl();
    beside->load(stimulus.start, stimulus.before);
    tb::Lockstep lockstep(std::move(beside), stimulus.start, 0, {"bench", 0, "meltstage bench lockstep"});
    pair = std::max(pair, clocks_per_second(stimulus, [&](const chip::Inputs& in) {
                      toggles += lockstep.step(in).heater;
                    }));
    lockstep.finish();
  }
  return {
      {"Verilated RTL alone", rtl / 1e6, "Mclock/s", {}, {}},
      {"C++ model alone, every clock", model / 1e6, "Mclock/s", {}, {}},
      {"both in lockstep, every flop compared", pair / 1e6, "Mclock/s", {}, {}},
      {"flop bits compared a clock", static_cast<double>(flop_bits), "bit", 1.0, {}},
      {"lockstep / RTL alone", pair / rtl, "", 0.60, {}},
      {"model / RTL alone", model / rtl, "", 1.0, {}},
      {"clocks with the heater on (all runs)", static_cast<double>(toggles), "clock", 1.0, {}},
  };
}

}  // namespace meltstage::app
