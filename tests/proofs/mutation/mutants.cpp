// SPDX-License-Identifier: Apache-2.0
// What becomes of every mutant of the RTL (mutate.py): lockstep with the model kills it, or the proof shows
// that it changes nothing; what is neither is a hole of the stimulus, or open. docs/verify/mutation.md
//
// Verdicts are kept, a line each, so that a run that was ended goes on where it was. Exit status 0 when no
// more than the wanted share is a hole or open, 1 when more or when a control fails, 2 on a wrong call.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "hls/proof/counterexample.hpp"
#include "hls/proof/refutation.hpp"
#include "judging.hpp"
#include "lockstep_kill.hpp"
#include "tests/hls/chip_question.hpp"

namespace meltstage::tb {

// mutant_top.cpp: the RTL with the mutants of one file each.
#define MUTANT_TOP(file, make) std::unique_ptr<VerilatedRtl> make(unsigned variant, std::uint64_t& clocks);
#include "mutant_tops.inc"
#undef MUTANT_TOP

namespace {

namespace fs = std::filesystem;

// One of each kind; the random lockstep test runs them all on the chip itself.
constexpr RunLength kControl = {.trials = 100'000, .seeds = 8};

struct Options {
  Choice choice{.folder = "out/mutants"};
  std::uint64_t soon = 400'000;  // trials from any state, which most mutants do not outlive
  RunLength length;
};

// ---- The proof -------------------------------------------------------------------------------------------

// Mutants of reset branches are read one by one: Yosys takes them only when they are chosen for good.
class Proof {
 public:
  Proof(const std::vector<const Mutant*>& asked, fs::path rtl)
      : rtl_(std::move(rtl)), model_(tests::model_in(MELTSTAGE_SOURCE_DIR)) {
    for (const Mutant* mutant : asked)
      if (mutant->branch == "logic") by_pin_.insert(mutant->number);
    all_ = tests::question(model_, tests::variants_in(rtl_, [&](unsigned number) {
                             return by_pin_.contains(number) ? std::nullopt : std::optional(false);
                           }));
    proved_ = by_pin(0);
  }

  hls::Refutation ask(unsigned number) const {
    return hls::refute(model_, proved_, by_pin_.contains(number) ? by_pin(number) : read_alone(number));
  }

 private:
  hls::Problem by_pin(unsigned number) const {
    return hls::with_pin(all_, tests::kChoice, tests::kChoiceBits, number);
  }
  hls::Problem read_alone(unsigned number) const {
    return tests::question(model_, tests::variants_in(rtl_, [&](unsigned other) { return other == number; }));
  }

  fs::path rtl_;
  std::set<unsigned> by_pin_;
  hls::Circuit model_;
  hls::Problem all_, proved_;
};

// ---- The RTL with a file's mutants -----------------------------------------------------------------------

MakeVariant make_of(const std::string& file) {
#define MUTANT_TOP(name, make) {name, make},
  static const std::map<std::string, MakeVariant> kTops = {
#include "mutant_tops.inc"
  };
#undef MUTANT_TOP
  return kTops.at(file);
}

// ---- A mutant's fate -------------------------------------------------------------------------------------

std::string killer(const Kill& kill) {
  if (kill.seed == 0) return fmt::format("from any state, after {} clocks", kill.clock);
  const char* how = kill.report.starts_with("MISMATCH") ? "" : " (no mismatch: the run gave up)";
  return fmt::format("seed {} clock {}{}", kill.seed, kill.clock, how);
}

std::string difference(const hls::Refutation& refutation) {
  std::string text = hls::to_text(*refutation.example, {"C++", "mutant"});
  std::replace(text.begin(), text.end(), '\n', ';');
  return text;
}

// Most are killed in a moment.
Verdict judge_soon(const Mutant& mutant, const Options& options, const Begins& begins) {
  begins('s');
  if (const auto kill = killed_by(make_of(mutant.file), mutant.number, {.trials = options.soon, .seeds = 0}))
    return {Fate::kKilled, killer(*kill)};
  return {Fate::kOpen, "outlives the first steps"};
}

// What is equal need not run for long.
Verdict judge_survivor(const Mutant& mutant, const Options& options, const Proof& proof,
                       const Begins& begins) {
  begins('p');
  const hls::Refutation refutation = proof.ask(mutant.number);
  if (refutation.verdict == hls::Verdict::kHolds) return {Fate::kEqual, "proved: it changes nothing"};
  begins('s');
  if (const auto kill = killed_by(make_of(mutant.file), mutant.number, options.length))
    return {Fate::kKilled, killer(*kill)};
  if (refutation.verdict == hls::Verdict::kOpen) return {Fate::kOpen, "neither killed nor proved equal"};
  return {Fate::kHole, "the proof refutes it: " + difference(refutation)};
}

// ---- The run ---------------------------------------------------------------------------------------------

// Neither the chip as it is nor the identity may be killed, or a kill means nothing.
bool controls_survive(const Mutant& identity) {
  for (const unsigned control : {0u, identity.number}) {
    const auto kill = killed_by(make_of(identity.file), control, kControl);
    fmt::print("control {}: {}\n", control == 0 ? "unchanged" : "identity",
               kill ? "KILLED " + killer(*kill) : "survived");
    std::fflush(stdout);
    if (kill) return false;
  }
  return true;
}

int run(const Options& options) {
  const fs::path rtl = MUTANTS_RTL;
  fmt::print("seed {}\n", options.choice.seed);
  std::vector<Mutant> mutants = read_mutants(rtl / "mutants.tsv");
  const Mutant identity = mutants.back();
  mutants.pop_back();
  const std::vector<Mutant> all = chosen(mutants, options.choice);
  if (!controls_survive(identity)) return 1;
  Verdicts verdicts(options.choice.folder);
  std::vector<const Mutant*> left;
  for (const Mutant& mutant : all)
    if (!verdicts.has(mutant.number)) left.push_back(&mutant);
  std::vector<const Mutant*> survivors;
  judge_all(
      left, options.choice.jobs,
      [&](const Mutant& mutant, const Begins& begins) { return judge_soon(mutant, options, begins); },
      [&](const Mutant& mutant, const Verdict& verdict) {
        if (verdict.fate == Fate::kKilled)
          verdicts.add(mutant.number, verdict);
        else
          survivors.push_back(&mutant);
      });
  if (!survivors.empty()) {
    const Proof proof(survivors, rtl);
    judge_all(
        survivors, options.choice.jobs,
        [&](const Mutant& mutant, const Begins& begins) {
          return judge_survivor(mutant, options, proof, begins);
        },
        [&](const Mutant& mutant, const Verdict& verdict) { verdicts.add(mutant.number, verdict); });
  }

  return print_verdicts(all, verdicts, options.choice.most_left) <= options.choice.most_left ? 0 : 1;
}

}  // namespace
}  // namespace meltstage::tb

int main(int argc, char** argv) {
  CLI::App cli{"What becomes of the mutants of the RTL: killed in lockstep, or proved equal", "mutants"};
  meltstage::tb::Options options;
  meltstage::tb::add_choice(cli, options.choice);
  cli.add_option("--soon", options.soon, "Trials from any state before the proof is asked");
  cli.add_option("--trials", options.length.trials, "Trials from any state");
  cli.add_option("--seeds", options.length.seeds, "Random runs that a mutant has to survive")
      ->check(CLI::Range(0, 1'000'000));
  cli.add_option("--clocks", options.length.clocks, "Clocks of each run")
      ->check(CLI::Range(1'000, 100'000'000));
  try {
    cli.parse(argc, argv);
    return meltstage::tb::run(options);
  } catch (const CLI::ParseError& error) {
    return cli.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "mutants: {}\n", error.what());
    return 2;
  }
}
