// SPDX-License-Identifier: Apache-2.0
// A change of one side, where both were proved equal before it: what it breaks is searched where it has
// changed gates.
#pragma once

#include <cstdint>
#include <optional>

#include "base/progress.hpp"
#include "hls/proof/counterexample.hpp"
#include "hls/proof/equivalence.hpp"
#include "hls/proof/prover.hpp"

namespace meltstage::hls {

struct Refutation {
  Verdict verdict;  // kHolds: the change changes nothing
  std::optional<Counterexample> example;
};

/// Both problems have their products in gates, and `proved` holds. An example is one of `changed` itself.
Refutation refute(const Circuit& model, const Problem& proved, const Problem& changed);

/// The problem in which a pin has one value. Of a pin of several bits each is NAME[BIT].
Problem with_pin(const Problem& problem, const std::string& name, unsigned bits, std::uint64_t value);

struct MutantCounts {
  unsigned refuted = 0;
  unsigned equal = 0;  // shown to change nothing
  unsigned open = 0;
};

/// `count` times one operand of one gate of the RTL inverted, drawn from `seed`. Both sides must be proved
/// equal as they are.
MutantCounts refute_mutants(const Circuit& model, Rtl rtl, const TiedPins& tied, unsigned count,
                            std::uint64_t seed, const Progress& progress);

}  // namespace meltstage::hls
