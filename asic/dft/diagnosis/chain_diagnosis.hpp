// SPDX-License-Identifier: Apache-2.0
// A broken scan chain. What has gone through all of it tells the damage: one level alone (a stuck cell),
// spoilt edges of one direction (a slow one), or garbage. All that a stuck cell lets through is one level, so
// it is among the first cells of which nothing else was ever seen (after Kundu, "On diagnosis of faults in a
// scan-chain", VTS 1993, and Guo and Venkataraman, "A technique for fault diagnosis of defects in scan
// chains", ITC 2001); what garbles changes the rate of fails. Defects there are tried on the virtual tester.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/cycles.hpp"
#include "asic/dft/diagnosis/defect.hpp"
#include "asic/dft/diagnosis/fail_log.hpp"
#include "base/progress.hpp"

namespace meltstage::dft {

/// A defect that was tried, and how far its log is the chip's, over the strobes that were looked at: failed
/// in both by failed in any, 0 to 1.
struct ChainSuspect {
  ChipDefect defect;
  double agreement = 0;
};

struct BrokenChain {
  std::size_t chain = 0;  ///< of the stream
  std::size_t cell = 0;   ///< of it, the likeliest behind or in which the defect lies
  std::vector<ChainSuspect>
      suspects;  ///< best first, those that agree at all; the same agreement: can't be told apart
};

/// The chains whose chain test fails: a load that is unloaded again without a clock between. `view`: the
/// capture view of the netlist with nothing held; lines are its circuit's. No cycle may have a count.
std::vector<BrokenChain> diagnose_chains(const CaptureView& view, const CycleStream& stream,
                                         const std::string& scan_enable, const FailLog& log,
                                         const Progress& progress = {});

/// For a chip whose chains shift and whose captures are right: lines that reset the cells that fail.
std::vector<ChainSuspect> diagnose_resets(const CaptureView& view, const CycleStream& stream,
                                          const std::string& scan_enable, const FailLog& log,
                                          const Progress& progress = {});

}  // namespace meltstage::dft
