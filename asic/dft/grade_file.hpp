// SPDX-License-Identifier: Apache-2.0
// What a file's patterns detect on a netlist: faults that make one of the file's own strobes fail.
#pragma once

#include <filesystem>
#include <vector>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/cycles.hpp"
#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/faults.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "base/progress.hpp"

namespace meltstage::dft {

struct GradedFile {
  Circuit circuit;
  FaultList list;
  std::vector<FaultClass> reported;  ///< by fault: DS, DI, NO; UT for pins that nothing reads
  Grade graded;                      ///< by class: captures, or cycles of a netlist without flops
  std::size_t patterns = 0;
};

/// Stuck-at faults of a netlist without flops, or of a scanned one with a stream that has chains. Throws
/// UserError, also when a strobe fails without a fault: what the file expects isn't this netlist's.
GradedFile grade_file(const std::filesystem::path& netlist, const CellLibrary& library,
                      const CycleStream& stream, const Progress& progress = {});

/// A netlist without flops, or a .bench with its flops cut open, as a view: the names of its ports are those
/// that `generate` writes. An output has the name of the line that it shows; one that is taken already gets
/// _out behind it.
CaptureView plain_view(Circuit circuit);

/// A netlist without flops: each cycle is a capture. What the stream leaves open is at `open`. No cycle may
/// have a count.
Captures captures_of_cycles(const CaptureView& view, const CycleStream& stream, bool open);

/// As a replay runs it: a .bench by plain_view(), else the capture view with nothing held.
CaptureView view_to_replay(const std::filesystem::path& netlist, const CellLibrary& library);

}  // namespace meltstage::dft
