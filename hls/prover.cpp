// SPDX-License-Identifier: Apache-2.0
#include "hls/prover.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <map>

#include "base/parallel.hpp"
#include "hls/cases.hpp"
#include "hls/engines.hpp"

namespace meltstage::hls {
namespace {

void settle(const Work& work, Method method, std::vector<Answer>& answers) {
  for (std::size_t i = 0; i < answers.size(); ++i)
    if (answers[i].verdict == Verdict::kOpen && work.wrong[i] == kFalse)
      answers[i] = {Verdict::kHolds, method, {}};
}

Work work_for(const Problem& problem, const std::vector<std::size_t>& chosen) {
  Work work{problem.aig, {}};
  for (const std::size_t number : chosen)
    work.wrong.push_back(work.aig.both(problem.reachable, problem.obligations[number].wrong));
  return work;
}

std::vector<std::size_t> open_ones(const std::vector<Answer>& answers) {
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < answers.size(); ++i)
    if (answers[i].verdict == Verdict::kOpen) open.push_back(i);
  return open;
}

void ask_open(const Work& work, int conflicts, std::string_view step, const Progress& progress,
              std::vector<Answer>& answers) {
  const std::vector<std::size_t> open = open_ones(answers);
  in_parallel(
      open.size(), [&](std::size_t i) { answers[open[i]] = ask(work, work.wrong[open[i]], conflicts); },
      progress, step);
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
        std::vector<Answer> found = prove_by_cases(work_for(problem, asked), numbers, limits);
        for (std::size_t i = 0; i < found.size(); ++i) answers[members[group][i]] = std::move(found[i]);
      },
      progress, "case by case");
}

}  // namespace

std::vector<Answer> try_random_values(const Problem& problem, const std::vector<std::size_t>& chosen,
                                      std::uint64_t seed) {
  std::vector<Answer> answers(chosen.size());
  const Work work = work_for(problem, chosen);
  settle(work, Method::kStructure, answers);
  find_by_simulation(work, seed, answers);
  return answers;
}

std::vector<Answer> prove(const Problem& problem, const std::vector<std::size_t>& chosen,
                          const ProverLimits& limits, const Progress& progress) {
  std::vector<Answer> answers = try_random_values(problem, chosen, limits.seed);
  Work work = work_for(problem, chosen);
  // What is settled needs no more gates.
  const auto drop_settled = [&] {
    for (std::size_t i = 0; i < answers.size(); ++i)
      if (answers[i].verdict != Verdict::kOpen) work.wrong[i] = kFalse;
  };
  for (const unsigned conflicts : limits.sweeps) {
    if (open_ones(answers).empty()) return answers;
    drop_settled();
    if (progress) progress(fmt::format("merging equal gates, {} conflicts each", conflicts), 0.0);
    work = sweep(work, conflicts);
    settle(work, Method::kSweeping, answers);
  }
  drop_settled();
  work = sort_parity(work);
  settle(work, Method::kParity, answers);
  ask_open(work, limits.conflicts_of_case, "asking the SAT solver", progress, answers);
  if (open_ones(answers).empty()) return answers;
  try_cases(problem, chosen, limits, progress, answers);
  ask_open(work, limits.conflicts, "asking the SAT solver again", progress, answers);
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
    std::vector<Pattern> inputs;
    for (const bool bit : example) inputs.push_back(bit ? ~Pattern{0} : 0);
    const std::size_t tries = std::min<std::size_t>(64, unusual.size() - start);
    for (std::size_t i = 0; i < tries; ++i) inputs[unusual[start + i]] ^= Pattern{1} << i;
    const std::vector<Pattern> value = simulate(problem.aig, cone, inputs);
    const auto of = [&](Literal literal) {
      return value[literal / 2] ^ ((literal & 1) != 0 ? ~Pattern{0} : 0);
    };
    const Pattern still = of(obligation.wrong) & of(problem.reachable) &
                          (tries == 64 ? ~Pattern{0} : (Pattern{1} << tries) - 1);
    if (still == 0) {
      start += tries - 1;
      continue;
    }
    const auto first = static_cast<std::size_t>(std::countr_zero(still));
    example[unusual[start + first]] = usual[unusual[start + first]];
    start += first;
  }
  return example;
}

}  // namespace meltstage::hls
