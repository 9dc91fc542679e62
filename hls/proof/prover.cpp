// SPDX-License-Identifier: Apache-2.0
#include "hls/proof/prover.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <span>

#include "base/parallel.hpp"
#include "hls/proof/cases.hpp"
#include "hls/proof/engines.hpp"

namespace meltstage::hls {
namespace {

// The obligations as they are, or in states alone in which the invariants hold.
Work in_every_state(const Problem& problem, const std::vector<std::size_t>& chosen) {
  Work work{problem.aig, {}};
  for (const std::size_t number : chosen) work.wrong.push_back(problem.obligations[number].wrong);
  return work;
}

Work in_reachable_states(const Problem& problem, const std::vector<std::size_t>& chosen) {
  Work work = in_every_state(problem, chosen);
  for (Literal& wrong : work.wrong) wrong = work.aig.both(problem.reachable, wrong);
  return work;
}

// What is open of `answers`, answered by `engines`: first in every state, for this needs few gates; what is
// not shown so, in reachable states.
template <class Engines>
void answer_open(const Problem& problem, const std::vector<std::size_t>& chosen, std::vector<Answer>& answers,
                 const Engines& engines) {
  for (const auto& states : {in_every_state, in_reachable_states}) {
    const std::vector<std::size_t> open = open_ones(answers);
    if (open.empty()) return;
    std::vector<std::size_t> asked;
    for (const std::size_t i : open) asked.push_back(chosen[i]);
    std::vector<Answer> found(open.size());
    engines(states(problem, asked), found);
    for (std::size_t i = 0; i < open.size(); ++i)
      if (found[i].verdict == Verdict::kHolds || states == in_reachable_states) {
        answers[open[i]] = std::move(found[i]);
        answers[open[i]].needs_invariants = states == in_reachable_states;
      }
  }
}

// The bits of a flop or pin have their cases together.
void try_cases(const Problem& problem, const std::vector<std::size_t>& chosen, const ProverLimits& limits,
               const Progress& progress, std::vector<Answer>& answers) {
  std::map<std::string, std::vector<std::size_t>> groups;
  for (const std::size_t i : open_ones(answers)) {
    const std::string& name = problem.obligations[chosen[i]].name;
    groups[name.substr(0, name.rfind('['))].push_back(i);
  }
  std::vector<std::vector<std::size_t>> members;
  for (auto& [name, group] : groups) members.push_back(std::move(group));
  const std::vector<Number> numbers = small_numbers(problem);
  in_parallel(
      members.size(),
      [&](std::size_t group) {
        std::vector<std::size_t> asked;
        for (const std::size_t i : members[group]) asked.push_back(chosen[i]);
        std::vector<Answer> found(asked.size());
        answer_open(problem, asked, found, [&](const Work& work, std::vector<Answer>& these) {
          these = prove_by_cases(work, numbers, limits.of_case);
        });
        for (std::size_t i = 0; i < found.size(); ++i) answers[members[group][i]] = std::move(found[i]);
      },
      progress, "case by case");
}

}  // namespace

std::vector<Answer> try_random_values(const Problem& problem, const std::vector<std::size_t>& chosen,
                                      std::uint64_t seed) {
  std::vector<Answer> answers(chosen.size());
  settle(in_every_state(problem, chosen), Method::kStructure, answers);
  find_by_simulation(in_reachable_states(problem, chosen), seed, answers);
  return answers;
}

std::vector<Answer> ask_shortly(const Problem& problem, const std::vector<std::size_t>& chosen,
                                int conflicts) {
  std::vector<Answer> answers(chosen.size());
  const Work work = in_reachable_states(problem, chosen);
  settle(work, Method::kStructure, answers);
  ask_sat_solver(work, conflicts, {}, answers);
  return answers;
}

std::vector<Answer> prove(const Problem& problem, const std::vector<std::size_t>& chosen,
                          const ProverLimits& limits, const Progress& progress) {
  std::vector<Answer> answers = try_random_values(problem, chosen, limits.seed);
  answer_open(problem, chosen, answers, [&](const Work& work, std::vector<Answer>& these) {
    ask_engines(work, limits.whole, progress, these);
  });
  try_cases(problem, chosen, limits, progress, answers);
  answer_open(problem, chosen, answers, [&](const Work& work, std::vector<Answer>& these) {
    ask_sat_solver(work, limits.conflicts, progress, these);
  });
  return answers;
}

std::vector<bool> evaluate(const Aig& aig, const std::vector<bool>& inputs) {
  std::vector<bool> value(aig.nodes(), false);
  for (std::size_t i = 0; i < inputs.size(); ++i) value[aig.inputs()[i] / 2] = inputs[i];
  const auto of = [&](Literal literal) { return value[literal / 2] != ((literal & 1) != 0); };
  for (std::size_t node = 1; node < aig.nodes(); ++node)
    if (!aig.is_input(node)) value[node] = of(aig[node].a) && of(aig[node].b);
  return value;
}

Pattern broken_with_one_changed(const Problem& problem, const Obligation& obligation,
                                const std::vector<std::uint32_t>& cone, const std::vector<bool>& inputs,
                                std::span<const std::size_t> changed) {
  std::vector<Pattern> patterns;
  for (const bool bit : inputs) patterns.push_back(bit ? ~Pattern{0} : 0);
  for (std::size_t i = 0; i < changed.size(); ++i) patterns[changed[i]] ^= Pattern{1} << i;
  const std::vector<Pattern> value = simulate(problem.aig, cone, patterns);
  const auto of = [&](Literal literal) {
    return value[literal / 2] ^ ((literal & 1) != 0 ? ~Pattern{0} : 0);
  };
  const Pattern asked = changed.size() == kRuns ? ~Pattern{0} : (Pattern{1} << changed.size()) - 1;
  return of(obligation.wrong) & of(problem.reachable) & asked;
}

std::vector<bool> simplest(const Problem& problem, const Obligation& obligation, std::vector<bool> example,
                           const std::vector<bool>& usual) {
  const std::array<Literal, 2> asked = {obligation.wrong, problem.reachable};
  const std::vector<std::uint32_t> cone = problem.aig.cone(asked);
  std::vector<std::size_t> number(problem.aig.nodes(), 0);
  for (std::size_t i = 0; i < problem.aig.inputs().size(); ++i) number[problem.aig.inputs()[i] / 2] = i;
  const std::vector<bool> found = example;
  example = usual;  // what the obligation does not rest on
  std::vector<std::size_t> unusual;
  for (const std::uint32_t node : cone) {
    if (!problem.aig.is_input(node)) continue;
    example[number[node]] = found[number[node]];
    if (found[number[node]] != usual[number[node]]) unusual.push_back(number[node]);
  }
  // 64 tries at once; each puts one input back.
  for (std::size_t start = 0; start < unusual.size(); ++start) {
    const auto tried = std::span(unusual).subspan(start, std::min(kRuns, unusual.size() - start));
    const Pattern still = broken_with_one_changed(problem, obligation, cone, example, tried);
    if (still == 0) {
      start += tried.size() - 1;
      continue;
    }
    const auto first = static_cast<std::size_t>(std::countr_zero(still));
    example[unusual[start + first]] = usual[unusual[start + first]];
    start += first;
  }
  return example;
}

}  // namespace meltstage::hls
