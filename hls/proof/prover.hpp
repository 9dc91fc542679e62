// SPDX-License-Identifier: Apache-2.0
// Whether the obligations of a problem hold, and where not, an example.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/progress.hpp"
#include "hls/proof/equivalence.hpp"

namespace meltstage::hls {

/// How an answer was found, the cheapest way first.
enum class Method {
  kStructure,   // both sides became the same gates
  kSimulation,  // random values showed a difference
  kSweeping,    // equal inner nodes were merged (ABC's fraig)
  kParity,      // sums of parity were sorted
  kSat,         // one question to a SAT solver (CaDiCaL)
  kCases        // all of these in each value of a flop or pin of few bits
};

enum class Verdict { kHolds, kBroken, kOpen };

struct Answer {
  Verdict verdict = Verdict::kOpen;
  Method method = Method::kStructure;
  std::vector<bool>
      example;  // of a broken one: a value for each input of the problem's graph, in their order
  bool needs_invariants = false;  // shown in those states alone in which they hold
};

struct EngineLimits {
  std::vector<unsigned> sweeps;  // conflicts a node that each round of sweeping may take
  int conflicts;                 // of the SAT solver, an obligation
};

struct ProverLimits {
  EngineLimits whole = {{100, 3000}, 50'000};  // before any case is tried
  EngineLimits of_case = {{100, 3000}, 2'000};
  int conflicts = 2'000'000;  // of the SAT solver, for an obligation that cases do not settle
  std::uint64_t seed = 1;     // of the random values
};

/// The same by random values alone: what they do not break stays open.
std::vector<Answer> try_random_values(const Problem& problem, const std::vector<std::size_t>& chosen,
                                      std::uint64_t seed);

/// The same by one question to the SAT solver each: finds most differences, and soon.
std::vector<Answer> ask_shortly(const Problem& problem, const std::vector<std::size_t>& chosen,
                                int conflicts);

/// Answers for `chosen` (numbers of obligations), in their order.
std::vector<Answer> prove(const Problem& problem, const std::vector<std::size_t>& chosen,
                          const ProverLimits& limits, const Progress& progress);

/// Values of all nodes for values of the inputs.
std::vector<bool> evaluate(const Aig& aig, const std::vector<bool>& inputs);

/// The example with as many inputs as possible at `usual`; the obligation stays broken.
std::vector<bool> simplest(const Problem& problem, const Obligation& obligation, std::vector<bool> example,
                           const std::vector<bool>& usual);

}  // namespace meltstage::hls
