// SPDX-License-Identifier: Apache-2.0
// A state and pins for which C++ and RTL differ, word by word, as a person reads it and a simulator runs it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "hls/proof/equivalence.hpp"
#include "hls/proof/prover.hpp"

namespace meltstage::hls {

/// A flop or pin and its value; one with a sign is that of its bits.
struct NamedValue {
  std::string name;
  std::uint64_t value;
};

struct Counterexample {
  Kind kind;
  std::string name;               // of the flop or pin that differs, or what else is broken
  std::vector<NamedValue> state;  // flops that are not as in reset
  std::vector<NamedValue> pins;   // those of both sides, and bits of the RTL alone that are high or matter
  std::uint64_t of_model;         // of a flop after the clock, of a pin in this state
  std::uint64_t of_rtl;           //
};

/// The flop or output pin of each of their bits.
std::unordered_map<std::string, std::string> words_of_bits(const Circuit& model);

/// Of a broken obligation, as few flops as possible off their reset values.
Counterexample make_counterexample(const Circuit& model, const Problem& problem, const Obligation& obligation,
                                   const std::vector<bool>& example);

/// What a person calls the two sides.
struct SideNames {
  const char* model;
  const char* rtl;
};

/// Some lines for a person, ended each.
std::string to_text(const Counterexample& example, const SideNames& names);

/// The example for another problem of the same circuits: what has no name there is 0.
std::vector<bool> carried_over(const Problem& from, const std::vector<bool>& example, const Problem& to);

/// Whether the example breaks the obligation, in a state in which the invariants hold.
bool is_broken(const Problem& problem, const Obligation& obligation, const std::vector<bool>& example);

}  // namespace meltstage::hls
