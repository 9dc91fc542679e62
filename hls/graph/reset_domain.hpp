// SPDX-License-Identifier: Apache-2.0
// What reset reaches. Without a clock: the flops that a signal holds at their reset values, and what they do
// while it does not. The C++ says the reset in every next state; a flop's own reset pin has it for nothing.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "hls/graph/circuit.hpp"

namespace meltstage::hls {

/// For each flop of the circuit its next state while `active`, a bit, is 0; none where it does more while
/// `active` is 1 than to keep its reset value. What is found is shown: active ? reset : result is the flop's
/// next state for every state and input. Throws UserError when `active` depends on more than some single
/// bits.
std::vector<std::optional<Node>> next_out_of_reset(Circuit& circuit, Node active);

/// Names of flops that rst_ni, low for however many clocks, does not bring to their reset values and hold
/// there. Other pins are data: nobody promises a level of theirs. Those of `at_once` have a reset pin of
/// their own; `tied_high`: rst_ni never is low. Throws UserError for an invariant that does not hold in reset
/// whatever such flops are.
std::vector<std::string> never_reset(Circuit circuit, const std::set<std::string>& at_once, bool tied_high);

}  // namespace meltstage::hls
