// SPDX-License-Identifier: Apache-2.0
// Indices that are wider than their array. Yosys makes flops of an array that a reset sets, and keeps as many
// bits of an index as the array needs: a word beyond it would be another word.
#pragma once

#include <string>

namespace meltstage::hls {

/// Looks for them in what Yosys made of the RTL: `netlist` (JSON) with such arrays as flops, `arrays` (RTLIL)
/// with them whole. Throws UserError that names file and line.
void require_narrow_indices(const std::string& netlist, const std::string& arrays);

/// The same for arrays of several dimensions, of which Yosys makes one: an index beyond its dimension would
/// be in the next row. `rtl` (RTLIL) has the sums and products that Yosys makes of such indices.
void require_narrow_dimensions(const std::string& rtl);

/// Whether the RTL has arrays of which Yosys made flops.
bool has_arrays_of_flops(const std::string& netlist);

}  // namespace meltstage::hls
