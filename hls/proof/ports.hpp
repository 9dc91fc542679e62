// SPDX-License-Identifier: Apache-2.0
// Whether C++ and RTL have the same pins and resets, before anything is asked of what is behind them.
#pragma once

#include <string>
#include <vector>

#include "hls/proof/equivalence.hpp"

namespace meltstage::hls {

/// Throws UserError by the RTL's file and line for a pin of the C++ that the RTL has not, or in another width
/// or direction; for a tied pin that is no single bit; and for flops that several pins or flops reset at
/// once, unless the C++ says so itself (hls_in_reset()).
void require_same_pins(const Circuit& model, const Rtl& rtl, const TiedPins& tied);

/// What a reader of a proof has to know of the RTL, a line each: what resets its flops, outputs and
/// flops that the C++ has not.
std::vector<std::string> notes_of(const Circuit& model, const Rtl& rtl, const TiedPins& tied);

}  // namespace meltstage::hls
