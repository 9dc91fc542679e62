// SPDX-License-Identifier: Apache-2.0
#include "hls/proof/engines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cadical.hpp>
#include <iterator>
#include <optional>
#include <random>
#include <unordered_map>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "base/temporary_folder.hpp"
#include "hls/subprocess.hpp"

namespace meltstage::hls {

// ---- Simulation ------------------------------------------------------------------------------------------

std::vector<Pattern> simulate(const Aig& aig, const std::vector<std::uint32_t>& cone,
                              const std::vector<Pattern>& inputs) {
  std::vector<Pattern> value(aig.nodes(), 0);
  for (std::size_t i = 0; i < inputs.size(); ++i) value[aig.inputs()[i] / 2] = inputs[i];
  const auto of = [&](Literal literal) {
    return value[literal / 2] ^ ((literal & 1) != 0 ? ~Pattern{0} : 0);
  };
  for (const std::uint32_t node : cone)
    if (!aig.is_input(node)) value[node] = of(aig[node].a) & of(aig[node].b);
  return value;
}

namespace {

// Random values with many bits alike, as counters and limits meet them, and with few.
class Patterns {
 public:
  explicit Patterns(std::uint64_t seed) : random_(seed) {}
  std::vector<Pattern> draw(std::size_t inputs) {
    std::vector<Pattern> result(inputs);
    const unsigned weight = static_cast<unsigned>(random_() % 5);
    for (Pattern& pattern : result) {
      pattern = random_();
      for (unsigned i = 2; i < weight; ++i) pattern &= random_();
      if (random_() % 2 == 0) pattern = ~pattern;
      if (weight == 0) pattern = random_() % 2 == 0 ? 0 : ~Pattern{0};
    }
    return result;
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace

void find_by_simulation(const Work& work, std::uint64_t seed, std::vector<Answer>& answers) {
  constexpr int kRounds = 64;
  Patterns patterns(seed);
  const std::vector<std::uint32_t> cone = work.aig.cone(work.wrong);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Pattern> inputs = patterns.draw(work.aig.inputs().size());
    const std::vector<Pattern> value = simulate(work.aig, cone, inputs);
    for (std::size_t i = 0; i < work.wrong.size(); ++i) {
      if (answers[i].verdict != Verdict::kOpen) continue;
      const Pattern wrong = value[work.wrong[i] / 2] ^ ((work.wrong[i] & 1) != 0 ? ~Pattern{0} : 0);
      if (wrong == 0) continue;
      const int run = std::countr_zero(wrong);
      answers[i] = {Verdict::kBroken, Method::kSimulation, {}};
      for (const Pattern pattern : inputs) answers[i].example.push_back((pattern >> run & 1) != 0);
    }
  }
}

// ---- Sweeping --------------------------------------------------------------------------------------------

Work sweep(const Work& work, unsigned conflicts) {
  const TemporaryFolder folder;
  write_aiger(folder.path() / "before.aig", work.aig, work.wrong);
  const Finished abc =
      run_tool("berkeley-abc", "berkeley-abc",
               {"-q", fmt::format("&r {}; &fraig -x -C {}; &w {}", (folder.path() / "before.aig").string(),
                                  conflicts, (folder.path() / "after.aig").string())});
  if (abc.status != 0 || !std::filesystem::exists(folder.path() / "after.aig"))
    throw UserError(fmt::format("berkeley-abc: found it failing ({}), expected it to sweep the circuit",
                                line_with(abc.output, "rror")));
  const AigerFile file = read_aiger(folder.path() / "after.aig");
  if (file.inputs.size() != work.aig.inputs().size() || file.outputs.size() != work.wrong.size())
    throw UserError("berkeley-abc: found other inputs and outputs in its result than in what it was given");
  Work result;
  std::vector<Literal> known = {kFalse};
  for (std::size_t i = 0; i < file.inputs.size(); ++i) known.push_back(result.aig.input());
  const auto of = [&](std::uint32_t literal) { return known[literal / 2] ^ (literal & 1); };
  for (const Aig::And& node : file.ands) known.push_back(result.aig.both(of(node.a), of(node.b)));
  for (const AigerFile::Output& output : file.outputs) result.wrong.push_back(of(output.value));
  return result;
}

// ---- Sums of parity --------------------------------------------------------------------------------------

namespace {

// Copies a graph so that sums of the same bits become the same gates, in whatever order they were added up. A
// partial sum that nothing else uses is taken apart.
class ParitySorter {
 public:
  explicit ParitySorter(const Work& work)
      : from_(work.aig), copied_(from_.nodes(), kFalse), uses_(from_.nodes()) {
    count_uses(work.wrong);
    for (const Literal input : from_.inputs()) copied_[input / 2] = to_.input();
    for (std::uint32_t node = 1; node < from_.nodes(); ++node)
      if (uses_[node].any() && !from_.is_input(node)) copy(node);
    for (const Literal wrong : work.wrong) wrong_.push_back(got(wrong));
  }
  Work result() && { return {std::move(to_), std::move(wrong_)}; }

 private:
  // How often a node is an operand of a sum, and what else needs it.
  struct Uses {
    unsigned in_sums = 0, elsewhere = 0;
    bool any() const { return in_sums + elsewhere > 0; }
  };
  // Bits that are added up, sorted, none twice; and whether the sum is inverted.
  struct Sum {
    std::vector<Literal> terms;
    bool inverted;
  };

  void count_uses(const std::vector<Literal>& roots) {
    for (const Literal root : roots) ++uses_[root / 2].elsewhere;
    for (std::size_t i = from_.nodes(); i-- > 1;) {
      const auto node = static_cast<std::uint32_t>(i);
      if (!uses_[node].any() || from_.is_input(node)) continue;
      if (const auto operands = operands_of(node)) {
        ++uses_[operands->first / 2].in_sums;
        ++uses_[operands->second / 2].in_sums;
      } else {
        ++uses_[from_[node].a / 2].elsewhere;
        ++uses_[from_[node].b / 2].elsewhere;
      }
    }
  }

  // a and b if the node is a XOR b.
  std::optional<std::pair<Literal, Literal>> operands_of(std::uint32_t node) const {
    const auto [x, y] = from_[node];
    if ((x & y & 1) == 0 || from_.is_input(x / 2) || from_.is_input(y / 2) || x < 2 || y < 2)
      return std::nullopt;
    const auto [p, q] = from_[x / 2];
    const auto [r, s] = from_[y / 2];
    if ((r == (p ^ 1) && s == (q ^ 1)) || (r == (q ^ 1) && s == (p ^ 1))) return std::pair(p, q);
    return std::nullopt;
  }

  void copy(std::uint32_t node) {
    const auto operands = operands_of(node);
    if (!operands) {
      copied_[node] = to_.both(got(from_[node].a), got(from_[node].b));
      return;
    }
    const Sum a = sum_of(operands->first), b = sum_of(operands->second);
    Sum sum{{}, a.inverted != b.inverted};
    std::set_symmetric_difference(a.terms.begin(), a.terms.end(), b.terms.begin(), b.terms.end(),
                                  std::back_inserter(sum.terms));
    if (uses_[node].in_sums == 1 && uses_[node].elsewhere == 0) {
      partial_[node] = std::move(sum);
      return;
    }
    Literal result = sum.inverted ? kTrue : kFalse;
    for (const Literal term : sum.terms) result = to_.differ(result, term);
    copied_[node] = result;
  }

  Sum sum_of(Literal literal) const {
    const bool inverted = (literal & 1) != 0;
    if (const auto partial = partial_.find(literal / 2); partial != partial_.end())
      return {partial->second.terms, partial->second.inverted != inverted};
    const Literal term = got(literal);
    if (term < 2) return {{}, term == kTrue};
    return {{term & ~Literal{1}}, (term & 1) != 0};
  }

  Literal got(Literal literal) const { return copied_[literal / 2] ^ (literal & 1); }

  const Aig& from_;
  Aig to_;
  std::vector<Literal> copied_;
  std::vector<Uses> uses_;
  std::unordered_map<std::uint32_t, Sum> partial_;
  std::vector<Literal> wrong_;
};

}  // namespace

Work sort_parity(const Work& work) { return ParitySorter(work).result(); }

// ---- SAT -------------------------------------------------------------------------------------------------

namespace {

Answer ask(const Work& work, Literal wrong, int conflicts) {
  CaDiCaL::Solver solver;
  solver.set("quiet", 1);
  const auto of = [](Literal literal) {
    const int variable = static_cast<int>(literal / 2) + 1;
    return (literal & 1) != 0 ? -variable : variable;
  };
  const auto clause = [&](std::initializer_list<int> literals) {
    for (const int literal : literals) solver.add(literal);
    solver.add(0);
  };
  clause({-of(kFalse)});
  for (const std::uint32_t node : work.aig.cone(std::span(&wrong, 1))) {
    if (work.aig.is_input(node)) continue;
    const int y = of(2 * node), a = of(work.aig[node].a), b = of(work.aig[node].b);
    clause({-y, a});
    clause({-y, b});
    clause({y, -a, -b});
  }
  clause({of(wrong)});
  solver.limit("conflicts", conflicts);
  constexpr int kUnknown = 0, kUnsatisfiable = 20;  // as in cadical.hpp
  const int said = solver.solve();
  if (said == kUnknown) return {Verdict::kOpen, Method::kSat, {}};
  if (said == kUnsatisfiable) return {Verdict::kHolds, Method::kSat, {}};
  Answer answer{Verdict::kBroken, Method::kSat, {}};
  const int known = solver.vars();
  for (const Literal input : work.aig.inputs())
    answer.example.push_back(of(input) <= known && solver.val(of(input)) > 0);
  return answer;
}

}  // namespace

// ---- One after another -----------------------------------------------------------------------------------

std::vector<std::size_t> open_ones(const std::vector<Answer>& answers) {
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < answers.size(); ++i)
    if (answers[i].verdict == Verdict::kOpen) open.push_back(i);
  return open;
}

void settle(const Work& work, Method method, std::vector<Answer>& answers) {
  for (std::size_t i = 0; i < answers.size(); ++i)
    if (answers[i].verdict == Verdict::kOpen && work.wrong[i] == kFalse)
      answers[i] = {Verdict::kHolds, method, {}};
}

void ask_sat_solver(const Work& work, int conflicts, const Progress& progress, std::vector<Answer>& answers) {
  const std::vector<std::size_t> open = open_ones(answers);
  in_parallel(
      open.size(), [&](std::size_t i) { answers[open[i]] = ask(work, work.wrong[open[i]], conflicts); },
      progress, "asking the SAT solver");
}

void ask_engines(Work work, const EngineLimits& limits, const Progress& progress,
                 std::vector<Answer>& answers) {
  settle(work, Method::kStructure, answers);
  for (const unsigned conflicts : limits.sweeps) {
    bool any_open = false;
    for (std::size_t i = 0; i < answers.size(); ++i) {
      if (answers[i].verdict == Verdict::kOpen)
        any_open = true;
      else
        work.wrong[i] = kFalse;  // what is settled needs no more gates
    }
    if (!any_open) return;
    if (progress) progress(fmt::format("merging equal gates, {} conflicts each", conflicts), 0.0);
    work = sweep(work, conflicts);
    settle(work, Method::kSweeping, answers);
  }
  work = sort_parity(work);
  settle(work, Method::kParity, answers);
  ask_sat_solver(work, limits.conflicts, progress, answers);
}

// ---- Cases -----------------------------------------------------------------------------------------------

Work in_case(const Work& work, std::span<const std::pair<Literal, bool>> known) {
  Work result;
  std::vector<Literal> copied(work.aig.nodes(), kFalse);
  for (const Literal input : work.aig.inputs()) copied[input / 2] = result.aig.input();
  for (const auto& [input, value] : known) copied[input / 2] = result.aig.constant(value);
  const auto of = [&](Literal literal) { return copied[literal / 2] ^ (literal & 1); };
  for (const std::uint32_t node : work.aig.cone(work.wrong))
    if (!work.aig.is_input(node)) copied[node] = result.aig.both(of(work.aig[node].a), of(work.aig[node].b));
  for (const Literal wrong : work.wrong) result.wrong.push_back(of(wrong));
  return result;
}

}  // namespace meltstage::hls
