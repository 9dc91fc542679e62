// SPDX-License-Identifier: Apache-2.0
// Grading of vectors as they stand in a file: the netlist runs cycle by cycle, 511 faulty machines beside the
// good one, and a fault is detected in the cycle in which a strobe of the file fails.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/faults.hpp"
#include "asic/dft/scan/replay.hpp"
#include "base/progress.hpp"

namespace meltstage::dft {

/// Outputs of cells that rise and fall in the good machine, and those that don't; what is tied to a constant
/// is left out and counted.
struct ToggleCoverage {
  std::size_t lines = 0, toggled = 0, tied = 0;
  std::vector<std::size_t> idle;  ///< sites of the circuit
  std::vector<Node> moving;       ///< nodes of the others
};

struct FunctionalGrade {
  static constexpr std::uint64_t kUndetected = ~std::uint64_t{0};
  std::vector<std::uint64_t> first_cycle;  ///< by fault, the cycle whose strobe shows it
  std::uint64_t cycles = 0;
  std::string wrong;  ///< the first strobe that fails without a fault: "cycle 12: q_o: found 0, expected H"
  ToggleCoverage toggle;
  std::size_t set_aside = 0;  ///< faults that were not graded to the end; undetected

  std::size_t detected() const;
};

/// What all flops hold before the first cycle.
enum class PowerUp : std::uint8_t { zeros, ones };

/// Grades `faults` on so many threads, 511 beside each other; the undetected ones are put together as the
/// others fall. `view` is the capture view with nothing held; vectors should begin with a reset. Outputs are
/// compared before each cycle's clock where the stream has H or L, and nowhere else; a cycle without a pulse
/// clocks nothing. Flops with an asynchronous reset follow it at once. Inputs that the stream leaves open are
/// 0 (with_open_inputs()), as are ports of the test (test_mode_i, scan_*) that it doesn't name. What is
/// detected from one power-up state and not from the other is possibly detected (PT): it hangs on flops that
/// the fault keeps from their reset. Throws UserError when the stream's signals are not the netlist's ports.
FunctionalGrade grade_functional(const CaptureView& view, const CycleStream& stream,
                                 const std::vector<Fault>& faults, unsigned threads,
                                 PowerUp power_up = PowerUp::zeros, const Progress& progress = {});

/// Runs a stream of any length without scan; outputs are compared before each cycle's clock where it has H or
/// L. Beside each other run fillings of what is unknown: all 0, all 1 and `random_fillings` more. Unknown are
/// the states at the beginning, and in each cycle the inputs that the stream leaves open. A strobe that
/// depends on one of them is a mismatch, so that 0 mismatches mean that no unknown reaches a strobe. Strobes
/// count once.
ReplayResult replay_cycles(const CaptureView& view, const CycleStream& stream, unsigned random_fillings = 0,
                           std::uint64_t seed = 1, const Progress& progress = {});

/// `count` of `faults` drawn at random without repetition, in their order; all when there are fewer.
std::vector<Fault> sample_faults(const std::vector<Fault>& faults, std::size_t count, std::uint64_t seed);

}  // namespace meltstage::dft
