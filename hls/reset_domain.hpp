// SPDX-License-Identifier: Apache-2.0
// Reset without a clock: the flops that a signal holds at their reset values, and what they do while it does
// not. The C++ says the reset in every next state; a flop's own reset pin has it for nothing.
#pragma once

#include <optional>
#include <vector>

#include "hls/translate.hpp"

namespace meltstage::hls {

/// For each flop of the circuit its next state while `active`, a bit, is 0; none where it does more while
/// `active` is 1 than to keep its reset value. What is found is shown: active ? reset : result is the flop's
/// next state for every state and input. Throws UserError when `active` depends on more than some single
/// bits.
std::vector<std::optional<Node>> next_out_of_reset(Circuit& circuit, Node active);

}  // namespace meltstage::hls
