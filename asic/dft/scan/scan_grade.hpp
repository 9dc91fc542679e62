// SPDX-License-Identifier: Apache-2.0
// What the strobes of a file with scan show of each fault. A capture is judged by itself, in the capture
// view, where the fault can disturb neither shifting nor reset; every other fault runs through the whole
// file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/cycles.hpp"
#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/faults.hpp"
#include "asic/dft/scan/scan.hpp"
#include "base/progress.hpp"

namespace meltstage::dft {

/// A fault as the netlist has it: a stuck line, and flops whose clock stands still with it.
struct Defect {
  Fault line;                        ///< none where its node is kNoNode
  std::vector<std::size_t> stopped;  ///< flops of the view
};

/// By defect, the first cycle by which a strobe of the stream has failed, whatever the flops hold at first
/// and whatever the stream leaves open; kNotShown for none, and for what
/// a long stream would show late at a cost of hours. Of these unknowns all 0 and all 1 are tried, and fifty
/// drawn ways more where the flops differ still when both have failed: a fault that only one start in very
/// many hides may count as found.
inline constexpr std::uint64_t kNotShown = ~std::uint64_t{0};
std::vector<std::uint64_t> shown_by_stream(const CaptureView& view, const CycleStream& stream,
                                           const std::vector<Defect>& defects, const Progress& progress = {});

/// The classes of all faults of a scanned netlist. `of_class` says of each equivalence class what captures
/// alone tell: DS where one of the stream's shows it, UT, UR, AU where it is known that none can. DI is what
/// no capture shows, but shifting or the reset test does; NO what the strobes miss. `design` names ports and
/// chains. `all_by_stream`: every fault runs through the file, for streams that are more than load, one
/// clock, unload.
std::vector<FaultClass> scan_classes(const CaptureView& view, const ScanDesign& design, const FaultList& list,
                                     const std::vector<FaultClass>& of_class, const CycleStream& stream,
                                     bool all_by_stream = false, const Progress& progress = {});

/// Whether the stream is captures alone: between two loads one clock at the most, right behind a load that
/// fills the chains, without a reset; outputs but the chains' are compared there alone.
bool is_captures_alone(const CaptureView& view, const ScanDesign& design, const CycleStream& stream);

}  // namespace meltstage::dft
