// SPDX-License-Identifier: Apache-2.0
// Where in the design the lines of a flat netlist belong, told by the names of its flops and ports; and which
// lines cannot move.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/core/capture_view.hpp"

namespace meltstage::dft {

/// By node of the view's circuit: the flop or output port that it reaches through the fewest gates, by name
/// of its register ("u_guard.wd_q[3]"); a flop is its own place. Empty where none is reached.
std::vector<std::string> places_of(const Netlist& netlist, const CaptureView& view);
/// The module of a place: what stands before the last dot, "(top)" without one.
std::string module_of(const std::string& place);

/// By node, the level that the line keeps once flops have been reset, whatever the vectors; -1 where it may
/// move: three-valued simulation with unknown inputs, from the reset states, in which a flop that may change
/// is unknown from then on, ends with that constant. Flops without reset are unknown from the start; those of
/// `held` (by input of the circuit, 1) are taken to keep their reset value, ports there to stay at 0. A proof
/// of what it calls still, not a search for all that is.
std::vector<std::int8_t> still_after_reset(const CaptureView& view,
                                           const std::vector<std::uint8_t>& held = {});

/// By node, 1 where the line leads through gates to no flop and no port but those of `unseen` (by output of
/// the circuit, 1).
std::vector<std::uint8_t> leads_only_to(const CaptureView& view, const std::vector<std::uint8_t>& unseen);

}  // namespace meltstage::dft
