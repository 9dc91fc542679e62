// SPDX-License-Identifier: Apache-2.0
// Ways that are open while a netlist shifts: from flop to flop, through scan inputs or through logic.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "asic/dft/core/capture_view.hpp"

namespace meltstage::dft {

struct ScanOptions;

/// The one input of a gate that is not constant while the others let it pass; -1 when there is none.
std::int32_t open_pin(const Circuit& circuit, const std::vector<std::int8_t>& constant, Node node);

/// By flop the one whose state it takes over, not inverted, with each clock while scan enable and test mode
/// are 1 and no reset acts: shift registers, and registers whose logic the scan enable steers so. A chain
/// needs no multiplexer before these.
std::map<std::string, std::string> shifted_from(const Netlist& netlist, const CellLibrary& library,
                                                const ScanOptions& names);

}  // namespace meltstage::dft
