// SPDX-License-Identifier: Apache-2.0
// What is hard as a whole is easy in each case: a controller's state says which of its parts is used.
#pragma once

#include <string>
#include <vector>

#include "hls/proof/engines.hpp"
#include "hls/proof/equivalence.hpp"

namespace meltstage::hls {

/// A flop or pin of few bits: inputs of a problem's graph, the lowest bit first.
struct Number {
  std::string name;
  std::vector<Literal> bits;
};
std::vector<Number> small_numbers(const Problem& problem);

/// Answers for all obligations of `work`, in each value of the number that leaves the smallest question, and
/// again so in a case that stays open.
std::vector<Answer> prove_by_cases(const Work& work, const std::vector<Number>& numbers,
                                   const EngineLimits& limits);

}  // namespace meltstage::hls
