// SPDX-License-Identifier: Apache-2.0
// Speed of the pair: the same recorded stimulus on RTL alone, model alone, and both in lockstep.
#include <algorithm>
#include <vector>

#include "bench/bench.hpp"
#include "bench/bench_stimulus.hpp"
#include "tb/lockstep/lockstep.hpp"
#include "tb/lockstep/verilated_rtl.hpp"

namespace meltstage::app {

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
    tell(options.progress, "rounds", round, rounds);
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
