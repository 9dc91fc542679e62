// SPDX-License-Identifier: Apache-2.0
// Fewer multipliers: products on ways that exclude each other come from one.
#pragma once

#include "hls/graph/circuit.hpp"

namespace meltstage::hls {

/// Each flop that takes one of several products, and at most one in a clock, has one multiplier, before which
/// the operands are chosen. What the circuit computes stays the same.
void share_products(Circuit& circuit);

}  // namespace meltstage::hls
