// SPDX-License-Identifier: Apache-2.0
// Lines that cannot move because words of the design are words of a code: what corrects an error stands still
// while there is none.
#pragma once

#include <cstdint>
#include <vector>

#include "asic/dft/core/circuit.hpp"

namespace meltstage::dft {

/// Inputs of the circuit (flops) whose values always have the same sum modulo 2.
using Parity = std::vector<Node>;

/// By node: the level that the line has in every state in which the sums are those of the state `legal` (by
/// input of the circuit: 0 or 1) and the inputs `held` (by input, 1) have their values of it, where CaDiCaL
/// proves that; -1 elsewhere and for nodes that are not `wanted`. A line that takes more than 20,000
/// conflicts is left at -1.
std::vector<std::int8_t> levels_under(const Circuit& circuit, const std::vector<Parity>& parities,
                                      const std::vector<std::int8_t>& legal,
                                      const std::vector<std::uint8_t>& held, const std::vector<Node>& wanted);

}  // namespace meltstage::dft
