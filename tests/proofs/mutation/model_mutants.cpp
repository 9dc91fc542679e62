// SPDX-License-Identifier: Apache-2.0
// What becomes of every mutant of the C++ model (mutate_model.py): steps from any state and random runs
// beside the RTL kill it, or the closed forms of idle time do against stepping. docs/verify/mutation.md
//
// Exit status 0 when no more than the wanted share is left, 1 when more or when the unchanged model does not
// survive, 2 on a wrong call.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "judging.hpp"
#include "model_mutant.hpp"
#include "tb/lockstep/bench.hpp"
#include "tb/stimulus/any_skip.hpp"
#include "tb/stimulus/any_state.hpp"
#include "tb/stimulus/random_run.hpp"

namespace meltstage::mutant {
unsigned chosen = 0;
}

namespace meltstage::tb {
namespace {

struct Length {
  std::uint64_t steps, skips;  // trials from any state
  std::uint64_t seeds;         // random runs
};
constexpr Length kSoon = {.steps = 20'000, .skips = 20'000, .seeds = 0};
constexpr Length kLong = {.steps = 1'000'000, .skips = 500'000, .seeds = 20};
constexpr Length kControl = {.steps = 100'000, .skips = 50'000, .seeds = 4};
constexpr std::uint64_t kClocks = 300'000;  // of a random run

// Idle time that the model as it is has in so many trials: a mutant that skips other stretches is seen by
// that, though it may never skip too much.
using Skipped = std::map<std::uint64_t, SkipCount>;

// What tells the present mutant from the RTL, or its idle time from its steps; nothing: it survives.
std::string killed_by(const Moments& moments, const Length& length, const Skipped& skipped) {
  const char* by = "steps from any state";
  try {
    const auto rtl = make_verilated_rtl();
    rtl->set_assertions(false);  // what the comparison finds is asked
    step_from_any_state(moments, *rtl, 1, 0, length.steps);
    by = "idle time against steps";
    const SkipCount idle = skip_from_any_state(moments, 1, length.skips);
    if (idle != skipped.at(length.skips)) throw std::runtime_error("it skips other stretches");
    by = "random runs";
    for (std::uint64_t seed = 1; seed <= length.seeds; ++seed)
      random_run(in_lockstep(random_start(seed), {"mutant", seed, ""}, {}), seed, kClocks);
  } catch (const std::exception& error) {
    const std::string report = error.what();
    return fmt::format("by {}: {}", by, report.substr(0, report.find('\n')));
  }
  return "";
}

Verdict judge(const Mutant& mutant, const Moments& moments, const Length& length, const Skipped& skipped,
              const Begins& begins) {
  begins('s');
  mutant::chosen = mutant.number;
  const std::string killer = killed_by(moments, length, skipped);
  return killer.empty() ? Verdict{Fate::kOpen, "survives"} : Verdict{Fate::kKilled, killer};
}

int run(const Choice& choice) {
  fmt::print("seed {}\n", choice.seed);
  const std::vector<Mutant> all = chosen(read_mutants(MUTANTS_LIST), choice);
  const Moments moments(1, kMomentSeeds, kMomentClocks);
  Skipped skipped;
  for (const Length& length : {kSoon, kLong, kControl})
    skipped[length.skips] = skip_from_any_state(moments, 1, length.skips);
  const std::string control = killed_by(moments, kControl, skipped);
  fmt::print("control unchanged: {}\n", control.empty() ? "survived" : "KILLED " + control);
  std::fflush(stdout);
  if (!control.empty()) return 1;
  Verdicts verdicts(choice.folder);
  for (const Length& length : {kSoon, kLong}) {
    std::vector<const Mutant*> left;
    for (const Mutant& mutant : all)
      if (!verdicts.has(mutant.number)) left.push_back(&mutant);
    judge_all(
        left, choice.jobs,
        [&](const Mutant& mutant, const Begins& begins) {
          return judge(mutant, moments, length, skipped, begins);
        },
        [&](const Mutant& mutant, const Verdict& verdict) {
          if (verdict.fate == Fate::kKilled || length.seeds != 0) verdicts.add(mutant.number, verdict);
        });
  }
  return print_verdicts(all, verdicts, choice.most_left) <= choice.most_left ? 0 : 1;
}

}  // namespace
}  // namespace meltstage::tb

int main(int argc, char** argv) {
  CLI::App cli{"What becomes of the mutants of the C++ model: killed beside the RTL, or left",
               "model_mutants"};
  meltstage::tb::Choice choice{.folder = "out/model-mutants"};
  meltstage::tb::add_choice(cli, choice);
  try {
    cli.parse(argc, argv);
    return meltstage::tb::run(choice);
  } catch (const CLI::ParseError& error) {
    return cli.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "model_mutants: {}\n", error.what());
    return 2;
  }
}
