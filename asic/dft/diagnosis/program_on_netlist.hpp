// SPDX-License-Identifier: Apache-2.0
// A file of patterns and the netlist that it is for, as a tester and a diagnosis see them.
#pragma once

#include <filesystem>
#include <string>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/cycles.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "asic/netlist/liberty.hpp"

namespace meltstage::dft {

struct ProgramOnNetlist {
  CycleStream stream;       ///< no cycle has a count
  CaptureView view;         ///< nothing held
  CaptureView captures;     ///< the ports of the test held as they are while it captures
  Captures patterns;        ///< of the stream, on `captures`
  std::string scan_enable;  ///< empty for a netlist without flops
};

/// STIL, or WGL by its ending .wgl. A scanned netlist, one without flops, or a .bench. Throws UserError for
/// what can't be read, chains that are not the netlist's, strobes that fail without a defect, and patterns
/// that are more than a load, one clock and an unload.
ProgramOnNetlist read_program(const std::filesystem::path& patterns, const std::filesystem::path& netlist,
                              const CellLibrary& library);

}  // namespace meltstage::dft
