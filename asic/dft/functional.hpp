// SPDX-License-Identifier: Apache-2.0
// Grading of functional vectors: the netlist runs clock by clock without scan, 511 faulty machines beside the
// good one, and a fault is detected in the clock after which an output port differs. Only what changes is
// evaluated.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/faults.hpp"
#include "asic/dft/netlist.hpp"
#include "asic/dft/replay.hpp"

namespace meltstage::dft {

/// So many clocks with these values at the input ports (by CaptureView::input_ports; clocks: any value).
struct FunctionalStretch {
  std::uint64_t clocks = 1;
  std::vector<std::uint8_t> inputs;
  std::vector<std::uint8_t> outputs =
      {};  ///< after each of these clocks, by output port; empty: not compared
};

/// Outputs of cells (constants left out) that rise and fall in the good machine, and those that don't.
struct ToggleCoverage {
  std::size_t lines = 0, toggled = 0;
  std::vector<std::string> idle;
};

struct FunctionalGrade {
  static constexpr std::uint64_t kUndetected = ~std::uint64_t{0};
  std::vector<std::uint64_t> first_clock;  ///< by fault, the clock that shows it
  std::uint64_t clocks = 0;
  ToggleCoverage toggle;

  std::size_t detected() const;
};

/// Grades `faults`, 511 at a time, on so many threads. `view` is the capture view with nothing held; all
/// flops power up at 0 in all machines, so that vectors should begin with a reset. Flops with an asynchronous
/// reset follow it at once.
FunctionalGrade grade_functional(const CaptureView& view, const std::vector<FunctionalStretch>& stretches,
                                 const std::vector<Fault>& faults, unsigned threads);

/// Runs the vectors on the netlist and compares the outputs where the stretches have some.
ReplayResult replay_functional(const CaptureView& view, const std::vector<FunctionalStretch>& stretches);

/// `count` of `faults` drawn at random without repetition, in their order; all when there are fewer.
std::vector<Fault> sample_faults(const std::vector<Fault>& faults, std::size_t count, std::uint64_t seed);

}  // namespace meltstage::dft
