// SPDX-License-Identifier: Apache-2.0
// How long logic takes: a static timing analysis of one corner, for choosing drivers. Sign-off is OpenSTA's.
#pragma once

#include <vector>

#include "asic/layout/db/delays.hpp"
#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

/// What Liberty says of a component's cell; nullptr: nothing.
const DelayCell* delay_cell_of(const Design& design, const Technology& technology, const Delays& delays,
                               int component);
/// Whether a net gets its level from this pin: a cell's output or the die's input.
bool is_driver(const Design& design, const Technology& technology, const PinRef& ref);

/// For each net the longest path through it, ns, from a flop's clock or a port to a flop or a port; 0: no
/// path. `load_pf` is what each net's driver charges. Edges keep their direction through gates; wires have no
/// resistance; the clock reaches all flops at 0.
std::vector<double> longest_paths_ns(const Design& design, const Technology& technology, const Delays& delays,
                                     const std::vector<double>& load_pf);

}  // namespace meltstage::layout
