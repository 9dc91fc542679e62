// SPDX-License-Identifier: Apache-2.0
// Measuring the supply current at rest (IDDQ): where the tester stops, and what it sees there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "asic/dft/atpg/generate.hpp"
#include "asic/dft/core/faults.hpp"
#include "asic/dft/core/patterns.hpp"
#include "asic/dft/scan/scan.hpp"

namespace meltstage::dft {

/// Pseudo-stuck-at model: a fault draws current when its line has the opposite value and the change shows at
/// the output of the gate that the line feeds; no way to an output is needed.
struct IddqStops {
  std::vector<Pattern> states;        ///< in the order of choice
  std::vector<std::size_t> detected;  ///< faults seen up to and with each stop
  std::size_t faults = 0;             ///< two for every site inside the circuit
  std::size_t tied = 0;               ///< of these, stuck at a value that the line has anyway

  /// Detected by all stops / (faults - tied), 0..1.
  double coverage() const;
};

/// Picks states, each the one that shows most faults which no earlier one shows, until there are `most` or no
/// state adds a fault.
IddqStops choose_iddq_stops(const Circuit& circuit, const std::vector<Pattern>& states, std::size_t most);

/// The same, and every state is improved when it is picked: what other states need to show faults that are
/// still unseen is put into it, as long as it shows more by that. The result depends on the arguments alone.
IddqStops search_iddq_stops(const Circuit& circuit, const std::vector<Pattern>& states, std::size_t most,
                            std::uint64_t seed, const Progress& progress = {});

/// Stops of a scan design: loaded states that tests for every gate make, each with the scan enable off and
/// on, searched as above. Options: those of the tests.
IddqStops scan_iddq_stops(const ScanDesign& design, const CaptureView& view, std::size_t most,
                          const GenerateOptions& options);

/// The circuit with an output behind every gate: a test for it shows a fault at the gate that its line feeds,
/// so that generate_tests() on it makes good states to choose stops from. Same inputs, same sites.
Circuit observe_every_gate(const Circuit& circuit);

}  // namespace meltstage::dft
