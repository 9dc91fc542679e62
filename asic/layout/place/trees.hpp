// SPDX-License-Identifier: Apache-2.0
// Buffers: the clock's balanced tree, trees for nets with many sinks, cells that tie inputs to a constant.
#pragma once

#include <string>

#include "asic/layout/place/buffers.hpp"

namespace meltstage::layout {

struct ClockTree {
  int sinks = 0;
  int buffers = 0;
  int levels = 0;           ///< buffers and gates on the longest way
  double latency_ns = 0.0;  ///< from the port to the last flop, Elmore wires and Liberty's tables
  double skew_ns = 0.0;     ///< last flop minus first
};

/// Marks the net of the port and those behind clock gates as the clock's: placement keeps their cells
/// together, and no other tree is put into them.
void mark_clock(Design& design, const Technology& technology, const Delays& delays, const std::string& port);

/// Grows a tree from the port to the flops' clock pins, through clock gates, so that each flop gets its edge
/// at about the same time: clusters of near sinks with like latency get a buffer in their middle, and so on
/// to the port; sizes of the last buffers even out the rest. Cells must be placed (globally); the buffers are
/// placed where they belong, overlaps and all. Throws UserError.
ClockTree build_clock_tree(Design& design, const Technology& technology, const Delays& delays,
                           const std::string& port, const TreeOptions& options);

/// Sizes the buffers before flops anew, for the wires that they have where cells are now: legal sites aren't
/// quite where the tree was built. Cells that grow may overlap after it.
void balance_clock(Design& design, const Technology& technology, const Delays& delays,
                   const std::string& port, const TreeOptions& options);

/// Latency and skew of the clock as it stands, by the same model.
ClockTree measure_clock(const Design& design, const Technology& technology, const Delays& delays,
                        const std::string& port);

/// Puts trees of buffers into each net of more than `most_sinks` pins that isn't part of the clock: near
/// sinks share a buffer up to the most that one drives with edges of `most_slew_ns`, the smallest that does.
/// Returns how many buffers.
int buffer_nets(Design& design, const Technology& technology, const Delays& delays,
                const std::string& clock_port, std::size_t most_sinks, double most_slew_ns,
                const TreeOptions& options);

/// One cell `macro` with output `pin` for each input tied to the supply `use`; beside its sink. Returns how
/// many.
int add_ties(Design& design, const Technology& technology, Use use, const std::string& macro,
             const std::string& pin);

}  // namespace meltstage::layout
