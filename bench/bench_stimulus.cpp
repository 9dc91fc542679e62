// SPDX-License-Identifier: Apache-2.0
#include "bench/bench_stimulus.hpp"

#include <time.h>

#include "tb/pins/head.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

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

}  // namespace meltstage::app
