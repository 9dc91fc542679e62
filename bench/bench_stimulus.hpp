// SPDX-License-Identifier: Apache-2.0
// What the benches of RTL and model run on.
#pragma once

#include <cstddef>
#include <vector>

#include "cmodel/chip.hpp"

namespace meltstage::app {

// Input pins of a heated chip in work: polled twenty times a second, 10 Hz control, 1 kHz PWM.
struct Stimulus {
  chip::Chip start;                // state of the chip before the first clock
  chip::Inputs before;             // pins of the clock before that
  std::vector<chip::Inputs> pins;  // one entry a clock
};

Stimulus record_stimulus(std::size_t clocks);

// Processor time of this thread: what else the machine does counts less than with wall time.
double processor_s();

template <class Step>
double clocks_per_second(const Stimulus& stimulus, Step step) {
  const double begin = processor_s();
  for (const chip::Inputs& in : stimulus.pins) step(in);
  return static_cast<double>(stimulus.pins.size()) / (processor_s() - begin);
}

}  // namespace meltstage::app
