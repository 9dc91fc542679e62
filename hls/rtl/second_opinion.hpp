// SPDX-License-Identifier: Apache-2.0
// Whether another reader of SystemVerilog makes the same circuit of the RTL: Icarus runs it beside the gates
// that Yosys has made, on random pins.
#pragma once

#include <cstdint>
#include <string>

#include "hls/rtl/rtl.hpp"

namespace meltstage::hls {

/// Runs at most so many clocks. Outputs are compared where the gates say 0 or 1 whatever the flops began
/// with. Throws UserError that names output and clock where both differ.
/// @return a line for a person: how many clocks were compared, or why none.
std::string compare_with_icarus(const RtlSources& sources, const Rtl& rtl, unsigned clocks,
                                std::uint64_t seed);

}  // namespace meltstage::hls
