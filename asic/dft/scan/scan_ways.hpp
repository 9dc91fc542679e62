// SPDX-License-Identifier: Apache-2.0
// Ways that are open while a netlist shifts: from flop to flop, through scan inputs or through logic.
#pragma once

#include <map>
#include <string>

#include "asic/dft/core/capture_view.hpp"

namespace meltstage::dft {

struct ScanOptions;

/// By flop the one whose state it takes over, not inverted, with each clock while scan enable and test mode
/// are 1 and no reset acts: shift registers, and registers whose logic the scan enable steers so. A chain
/// needs no multiplexer before these.
std::map<std::string, std::string> shifted_from(const Netlist& netlist, const CellLibrary& library,
                                                const ScanOptions& names);

}  // namespace meltstage::dft
