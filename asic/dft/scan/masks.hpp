// SPDX-License-Identifier: Apache-2.0
// The masking report of a stream: every strobe that is not made, and why.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "asic/dft/core/cycles.hpp"

namespace meltstage::dft {

/// Outputs that are not compared in so many cycles in a row, for one reason.
struct MaskedStrobes {
  std::uint64_t first_cycle = 0, cycles = 1;
  std::string label;                 ///< of the pattern, empty before the first
  std::vector<std::string> outputs;  ///< names; of an unload with the cell: "scan_o[1] (u_a.q[3])"
  std::string reason;

  std::uint64_t strobes() const { return cycles * outputs.size(); }
};

/// The masked strobes of a stream as it is, whoever wrote it. Reasons follow from where a strobe stands:
/// before the first load, while chains shift, in an unload, in a clock, or without one. A stream without
/// chains gives no reasons but that it compares nothing there. `scan_enable` is the signal that is 1 while
/// chains shift.
std::vector<MaskedStrobes> masked_strobes(const CycleStream& stream, const std::string& scan_enable);

struct MaskSummary {
  std::uint64_t masked = 0;
  std::map<std::string, std::uint64_t> reasons;  ///< strobes
};
MaskSummary summary(const std::vector<MaskedStrobes>& masked);
/// A line an entry: "cycles 12 to 20 (pattern 3): a b: reason".
std::string mask_text(const std::vector<MaskedStrobes>& masked);

}  // namespace meltstage::dft
