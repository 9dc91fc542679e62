// SPDX-License-Identifier: Apache-2.0
#include "hls/proof/refutation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <random>
#include <unordered_map>

namespace meltstage::hls {
namespace {

// Copies gates into a graph in which equal ones become one.
class Import {
 public:
  Import(const Aig& from, Aig& to, const std::vector<Literal>& inputs) : there_(from.nodes()) {
    for (std::size_t i = 0; i < inputs.size(); ++i) there_[from.inputs()[i] / 2] = inputs[i];
    for (std::size_t node = 1; node < from.nodes(); ++node)
      if (!from.is_input(node)) there_[node] = to.both(of(from[node].a), of(from[node].b));
  }
  Literal of(Literal literal) const { return there_[literal / 2] ^ (literal & 1); }

 private:
  std::vector<Literal> there_;
};

// What the change makes of flops and pins, against what they were: where its gates are the same nothing is
// left to ask. The unchanged sides are equal (hls.chip_is_the_rtl), so each difference breaks the
// changed question, too.
Problem difference(const Problem& proved, const Problem& changed) {
  Problem result;
  std::vector<Literal> inputs;
  for (std::size_t i = 0; i < proved.aig.inputs().size(); ++i) inputs.push_back(result.aig.input());
  const Import before(proved.aig, result.aig, inputs);
  std::unordered_map<Literal, Literal> known;  // inputs that both have, by their names
  const auto match = [&](const Bits& now, const Bits& then) {
    for (const auto& [name, literal] : now)
      if (const auto same = then.find(name); same != then.end()) known[literal] = before.of(same->second);
  };
  match(changed.state, proved.state);
  match(changed.pins, proved.pins);
  inputs.clear();
  for (const Literal input : changed.aig.inputs())
    inputs.push_back(known.contains(input) ? known.at(input) : result.aig.input());
  const Import after(changed.aig, result.aig, inputs);
  for (const auto& [name, literal] : changed.state) result.state[name] = after.of(literal);
  for (const auto& [name, literal] : changed.pins) result.pins[name] = after.of(literal);
  result.reachable = before.of(proved.reachable);
  std::map<std::pair<Kind, std::string>, const Obligation*> old;
  for (const Obligation& obligation : proved.obligations)
    old[{obligation.kind, obligation.name}] = &obligation;
  for (const Obligation& now : changed.obligations) {
    Obligation& asked = result.obligations.emplace_back(now);
    const Obligation* then = old[{now.kind, now.name}];
    if (then == nullptr)
      asked.wrong = after.of(now.wrong);
    else if (now.kind == Kind::kInvariant)
      asked.wrong = result.aig.differ(before.of(then->wrong), after.of(now.wrong));
    else
      asked.wrong = result.aig.either(result.aig.differ(before.of(then->of_model), after.of(now.of_model)),
                                      result.aig.differ(before.of(then->of_rtl), after.of(now.of_rtl)));
  }
  return result;
}

// Small ones first.
std::vector<std::size_t> touched(const Problem& difference) {
  std::vector<std::pair<std::size_t, std::size_t>> sizes;
  for (std::size_t i = 0; i < difference.obligations.size(); ++i)
    if (const Literal& wrong = difference.obligations[i].wrong; wrong != kFalse)
      sizes.emplace_back(difference.aig.cone(std::span(&wrong, 1)).size(), i);
  std::sort(sizes.begin(), sizes.end());
  std::vector<std::size_t> result;
  for (const auto& [size, number] : sizes) result.push_back(number);
  return result;
}

}  // namespace

Refutation refute(const Circuit& model, const Problem& proved, const Problem& changed) {
  const Problem asked = difference(proved, changed);
  const std::vector<std::size_t> all = touched(asked);
  const auto first_of = [&](std::span<const std::size_t> chosen,
                            const std::vector<Answer>& answers) -> std::optional<Counterexample> {
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      if (answers[i].verdict != Verdict::kBroken) continue;
      const Obligation& obligation = changed.obligations[chosen[i]];
      const std::vector<bool> example = carried_over(asked, answers[i].example, changed);
      if (is_broken(changed, obligation, example))
        return make_counterexample(model, changed, obligation, example);
    }
    return std::nullopt;
  };
  if (auto found = first_of(all, try_random_values(asked, all, 1))) return {Verdict::kBroken, found};
  constexpr std::size_t kAtOnce = 8;
  for (const int conflicts : {500, 20'000}) {
    for (std::size_t begin = 0; begin < all.size(); begin += kAtOnce) {
      const std::size_t end = std::min(begin + kAtOnce, all.size());
      const std::vector<std::size_t> some(all.begin() + static_cast<std::ptrdiff_t>(begin),
                                          all.begin() + static_cast<std::ptrdiff_t>(end));
      if (auto found = first_of(some, ask_shortly(asked, some, conflicts))) return {Verdict::kBroken, found};
    }
  }
  const std::vector<Answer> answers = prove(asked, all, {.conflicts = 200'000, .seed = 1}, {});
  if (auto found = first_of(all, answers)) return {Verdict::kBroken, found};
  const bool holds = std::all_of(answers.begin(), answers.end(),
                                 [](const Answer& answer) { return answer.verdict == Verdict::kHolds; });
  return {holds ? Verdict::kHolds : Verdict::kOpen, std::nullopt};
}

Problem with_pin(const Problem& problem, const std::string& name, unsigned bits, std::uint64_t value) {
  std::unordered_map<Literal, bool> known;
  for (unsigned i = 0; i < bits; ++i)
    known[problem.pins.at(bits == 1 ? name : fmt::format("{}[{}]", name, i))] = (value >> i & 1) != 0;
  Problem result;
  std::vector<Literal> inputs;
  for (const Literal input : problem.aig.inputs()) {
    const Literal fresh = result.aig.input();
    inputs.push_back(known.contains(input) ? result.aig.constant(known.at(input)) : fresh);
  }
  const Import gates(problem.aig, result.aig, inputs);
  for (const auto& [bit, literal] : problem.state) result.state[bit] = gates.of(literal);
  for (const auto& [bit, literal] : problem.pins) result.pins[bit] = gates.of(literal);
  result.reachable = gates.of(problem.reachable);
  for (const Obligation& asked : problem.obligations)
    result.obligations.push_back({asked.kind, asked.name, asked.block, gates.of(asked.wrong),
                                  gates.of(asked.of_model), gates.of(asked.of_rtl)});
  return result;
}

MutantCounts refute_mutants(const Circuit& model, Rtl rtl, const TiedPins& tied, unsigned count,
                            std::uint64_t seed, const Progress& progress) {
  MutantCounts counts;
  const Problem proved = make_problem(model, rtl, Products::kInGates, tied);
  std::mt19937_64 random(seed);
  for (unsigned i = 0; i < count && !rtl.gates.ands.empty(); ++i) {
    tell(progress, "changing gates of the RTL", i, count);
    Aig::And& gate = rtl.gates.ands[random() % rtl.gates.ands.size()];
    Literal& operand = random() % 2 == 0 ? gate.a : gate.b;
    operand ^= 1;
    const Verdict verdict = refute(model, proved, make_problem(model, rtl, Products::kInGates, tied)).verdict;
    operand ^= 1;
    ++(verdict == Verdict::kBroken  ? counts.refuted
       : verdict == Verdict::kHolds ? counts.equal
                                    : counts.open);
  }
  return counts;
}

}  // namespace meltstage::hls
