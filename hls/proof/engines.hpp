// SPDX-License-Identifier: Apache-2.0
// Ways to answer whether bits of a graph can be 1: each one makes the question smaller, or settles it.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hls/graph/aig.hpp"
#include "hls/proof/prover.hpp"

namespace meltstage::hls {

/// A graph, its inputs in the order of the problem's, and one literal for each obligation: wrong in a state
/// that is reachable.
struct Work {
  Aig aig;
  std::vector<Literal> wrong;
};

using Pattern = std::uint64_t;  // one bit a run
inline constexpr std::size_t kRuns = 64;

/// In which runs an obligation is broken, in a state in which the invariants hold: in run i input changed[i]
/// (at most kRuns) is the other one. `cone`: of the obligation and the invariants.
Pattern broken_with_one_changed(const Problem& problem, const Obligation& obligation,
                                const std::vector<std::uint32_t>& cone, const std::vector<bool>& inputs,
                                std::span<const std::size_t> changed);

/// Values of the nodes of `cone` in 64 runs.
std::vector<Pattern> simulate(const Aig& aig, const std::vector<std::uint32_t>& cone,
                              const std::vector<Pattern>& inputs);

/// Random values for what is open.
void find_by_simulation(const Work& work, std::uint64_t seed, std::vector<Answer>& answers);

/// Inner nodes that are equal become one (ABC: &fraig), with at most so many conflicts for each.
Work sweep(const Work& work, unsigned conflicts);

/// Sums of the same bits by XOR become one, in whatever order they were added up.
Work sort_parity(const Work& work);

/// Numbers of the open answers.
std::vector<std::size_t> open_ones(const std::vector<Answer>& answers);

/// Holds what has no gates left.
void settle(const Work& work, Method method, std::vector<Answer>& answers);

/// A question to a SAT solver (CaDiCaL) for each open answer.
void ask_sat_solver(const Work& work, int conflicts, const Progress& progress, std::vector<Answer>& answers);

/// All engines but the simulation one after another, the cheapest first.
void ask_engines(Work work, const EngineLimits& limits, const Progress& progress,
                 std::vector<Answer>& answers);

/// The graph where these inputs have these values. All inputs stay, in their order.
Work in_case(const Work& work, std::span<const std::pair<Literal, bool>> known);

}  // namespace meltstage::hls
