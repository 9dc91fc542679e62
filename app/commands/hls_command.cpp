// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <llvm/IR/LLVMContext.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <chrono>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>

#include "app/verbs.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/terminal.hpp"
#include "hls/cpp/compile.hpp"
#include "hls/cpp/translate.hpp"
#include "hls/graph/names.hpp"
#include "hls/graph/reset_domain.hpp"
#include "hls/graph/sharing.hpp"
#include "hls/graph/verilog.hpp"
#include "hls/proof/counterexample.hpp"
#include "hls/proof/equivalence.hpp"
#include "hls/proof/ports.hpp"
#include "hls/proof/prover.hpp"
#include "hls/proof/refutation.hpp"
#include "hls/rtl/rtl.hpp"
#include "hls/rtl/second_opinion.hpp"
#include "hls/rtl/solver_formats.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Options {
  hls::Sources sources;
  std::string module = "circuit";
  fs::path out;
  fs::path rtl;
  std::string top;
  std::vector<std::string> blocks;
  std::vector<std::string> tied;
  std::vector<std::string> other_options;
  hls::ProverLimits limits;
  std::size_t examples = 3;
  unsigned simulated_clocks = 200;
  unsigned mutants = 0;
};

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

hls::Circuit circuit_of(const hls::Sources& sources, hls::Undefined undefined) {
  llvm::LLVMContext context;
  return hls::translate(*hls::compile(sources, undefined, context));
}

/// None: SystemVerilog.
std::optional<hls::SolverFormat> format_of(const fs::path& out) {
  const std::string ending = out.extension().string();
  if (ending == ".aig") return hls::SolverFormat::kAiger;
  if (ending == ".btor" || ending == ".btor2") return hls::SolverFormat::kBtor2;
  if (ending == ".sv" || ending == ".v") return std::nullopt;
  throw UserError(fmt::format(
      "--out: found '{}', expected a file *.sv or *.v, *.aig (AIGER) or *.btor (BTOR2)", out.string()));
}

int translate(const Options& o) {
  require_other_file(o.out, o.sources.files);
  if (!hls::is_identifier(o.module))
    throw UserError(fmt::format(
        "--module: found '{}', expected letters, digits and _, and no word of Verilog", o.module));
  const auto format = format_of(o.out);
  hls::Circuit circuit = circuit_of(o.sources, hls::Undefined::kIsLeft);
  unsigned bits = 0;
  for (const hls::Flop& flop : circuit.flops) bits += flop.field.kept.countPopulation();
  const std::string told = fmt::format("{}: {} flops of {} bits, {} operations\n", o.out.string(),
                                       circuit.flops.size(), bits, circuit.graph.size());
  std::ostringstream text;
  hls::share_products(circuit);
  hls::write_verilog(std::move(circuit), o.module, text);
  write_whole(o.out, format ? hls::for_solvers(*format, text.str(), o.module) : text.str());
  fmt::print("{}", told);
  return 0;
}

hls::TiedPins tied_pins(const Options& o) {
  hls::TiedPins pins;
  for (const std::string& word : o.tied) {
    const std::size_t equals = word.find('=');
    const std::string value = equals == std::string::npos ? "" : word.substr(equals + 1);
    if (value != "0" && value != "1")
      throw UserError(fmt::format("--tie: found '{}', expected PIN=0 or PIN=1, a bit each", word));
    const auto [pin, is_new] = pins.emplace(word.substr(0, equals), value == "1");
    if (!is_new) throw UserError(fmt::format("--tie: found {} twice, expected one value a pin", pin->first));
  }
  return pins;
}

// ---- The table of blocks ---------------------------------------------------------------------------------

constexpr std::size_t kMethods = 6;
struct Row {
  std::size_t bits = 0, invariants = 0, broken = 0, open = 0;
  std::array<std::size_t, kMethods> by{};
};

void print_table(const hls::Problem& problem, const std::vector<std::size_t>& chosen,
                 const std::vector<hls::Answer>& answers) {
  std::map<std::string, Row> rows;
  Row sum;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    for (Row* row : {&rows[problem.obligations[chosen[i]].block], &sum}) {
      ++row->bits;
      if (answers[i].verdict == hls::Verdict::kBroken) ++row->broken;
      if (answers[i].verdict == hls::Verdict::kOpen) ++row->open;
      if (answers[i].verdict != hls::Verdict::kHolds) continue;
      ++row->by[static_cast<std::size_t>(answers[i].method)];
      if (answers[i].needs_invariants) ++row->invariants;
    }
  }
  constexpr const char* kLine = "{:<18} {:>6} {:>10} {:>9} {:>7} {:>5} {:>6} {:>11} {:>7} {:>5}\n";
  fmt::print(fmt::runtime(kLine), "", "bits", "structure", "sweeping", "parity", "SAT", "cases", "invariants",
             "broken", "open");
  const auto line = [&](const std::string& name, const Row& row) {
    const auto by = [&](hls::Method method) { return row.by[static_cast<std::size_t>(method)]; };
    fmt::print(fmt::runtime(kLine), name, row.bits, by(hls::Method::kStructure), by(hls::Method::kSweeping),
               by(hls::Method::kParity), by(hls::Method::kSat), by(hls::Method::kCases), row.invariants,
               row.broken, row.open);
  };
  for (const auto& [name, row] : rows) line(name, row);
  line("in all", sum);
}

constexpr const char* kInvariants = "invariants";  // the block of their obligations

// Products were any function so far: an answer is broken only if it is so with real multiplication.
class Examples {
 public:
  Examples(const hls::Circuit& model, const hls::Rtl& rtl, const hls::TiedPins& tied, const Options& options)
      : model_(model), rtl_(rtl), tied_(tied), options_(options) {}

  // Says of each broken answer whether it is: by its own example, or by random values. What stays in doubt is
  // open where another one is broken, and proved anew where none is.
  void check(const hls::Problem& problem, const std::vector<std::size_t>& chosen,
             std::vector<hls::Answer>& answers) {
    if (rtl_.products.empty()) return;
    std::vector<std::size_t> asked;  // of chosen
    for (std::size_t i = 0; i < chosen.size(); ++i)
      if (answers[i].verdict == hls::Verdict::kBroken) asked.push_back(i);
    if (asked.empty()) return;
    gates_ = hls::make_problem(model_, rtl_, hls::Products::kInGates, tied_);
    // what add_promises() has added is made of gates already
    std::erase_if(asked, [&](std::size_t i) { return chosen[i] >= gates_->obligations.size(); });
    std::vector<std::size_t> numbers;
    for (const std::size_t i : asked) numbers.push_back(chosen[i]);
    const std::vector<hls::Answer> drawn = hls::try_random_values(*gates_, numbers, options_.limits.seed);
    std::vector<std::size_t> doubtful;
    for (std::size_t k = 0; k < asked.size(); ++k) {
      hls::Answer& answer = answers[asked[k]];
      std::vector<bool> carried = hls::carried_over(problem, answer.example, *gates_);
      if (hls::is_broken(*gates_, gates_->obligations[numbers[k]], carried))
        answer.example = std::move(carried);
      else if (drawn[k].verdict != hls::Verdict::kOpen)
        answer = drawn[k];
      else
        doubtful.push_back(asked[k]);
    }
    for (const std::size_t i : doubtful) answers[i] = {};
    const bool refuted = std::any_of(answers.begin(), answers.end(), [](const hls::Answer& answer) {
      return answer.verdict == hls::Verdict::kBroken;
    });
    for (const std::size_t i : doubtful)
      if (!refuted) answers[i] = hls::prove(*gates_, {chosen[i]}, options_.limits, {}).front();
  }

  // Of a broken answer that was checked.
  hls::Counterexample of(const hls::Problem& problem, std::size_t number, const hls::Answer& answer) const {
    const hls::Problem& shown = gates_ && number < gates_->obligations.size() ? *gates_ : problem;
    return hls::make_counterexample(model_, shown, shown.obligations[number], answer.example);
  }

 private:
  const hls::Circuit& model_;
  const hls::Rtl& rtl_;
  const hls::TiedPins& tied_;
  const Options& options_;
  std::optional<hls::Problem> gates_;
};

// Obligations of these blocks and of the instances in them; of all when none is named. The invariants are
// asked with any block: what is shown of it holds only in the states in which they do.
std::vector<std::size_t> choose(const hls::Problem& problem, const std::vector<std::string>& blocks) {
  std::vector<std::size_t> chosen;
  const auto add = [&](const std::string& block) {
    const std::size_t before = chosen.size();
    for (std::size_t i = 0; i < problem.obligations.size(); ++i)
      if (const std::string& of = problem.obligations[i].block; of == block || of.starts_with(block + "."))
        chosen.push_back(i);
    if (chosen.size() != before) return;
    std::set<std::string> known;
    for (const hls::Obligation& obligation : problem.obligations) known.insert(obligation.block);
    throw UserError(
        fmt::format("--block: found no block {}, expected one of {}", block, fmt::join(known, ", ")));
  };
  std::vector<std::string> wanted = blocks;
  const bool has_invariants =
      std::any_of(problem.obligations.begin(), problem.obligations.end(),
                  [](const hls::Obligation& o) { return o.kind == hls::Kind::kInvariant; });
  if (!blocks.empty() && has_invariants &&
      std::find(blocks.begin(), blocks.end(), kInvariants) == blocks.end())
    wanted.emplace_back(kInvariants);
  for (const std::string& block : wanted) add(block);
  std::sort(chosen.begin(), chosen.end());  // a block that was named twice, or in another one
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  if (blocks.empty())
    for (std::size_t i = 0; i < problem.obligations.size(); ++i) chosen.push_back(i);
  return chosen;
}

struct Verdicts {
  std::size_t broken = 0;
  std::size_t open = 0;
  std::size_t with_invariants = 0;

  bool proved() const { return broken == 0 && open == 0; }
  const char* word() const { return proved() ? "proved" : broken > 0 ? "refuted" : "not decided"; }
  std::string states() const {
    return with_invariants == 0
               ? "for every state and input"
               : fmt::format("for every state and input, {} of them where the invariants hold",
                             with_invariants);
  }
};

// Counts, and names some that are open.
Verdicts print_open(const hls::Problem& problem, const std::vector<std::size_t>& chosen,
                    const std::vector<hls::Answer>& answers, std::size_t most) {
  Verdicts verdicts;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (answers[i].verdict == hls::Verdict::kBroken) ++verdicts.broken;
    if (answers[i].verdict == hls::Verdict::kHolds && answers[i].needs_invariants) ++verdicts.with_invariants;
    if (answers[i].verdict != hls::Verdict::kOpen) continue;
    if (++verdicts.open <= most) fmt::print("open: {}\n", problem.obligations[chosen[i]].name);
  }
  return verdicts;
}

// Names of flops and pins that differ, too, and had no example.
void print_others_broken(const hls::Circuit& model, const hls::Problem& problem,
                         const std::vector<std::size_t>& chosen, const std::vector<hls::Answer>& answers,
                         const std::set<std::string>& shown) {
  constexpr std::size_t kMost = 100;
  const auto words = hls::words_of_bits(model);
  std::set<std::string> others;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const hls::Obligation& obligation = problem.obligations[chosen[i]];
    const auto word = words.find(obligation.name);
    if (answers[i].verdict == hls::Verdict::kBroken && word != words.end() && !shown.contains(word->second))
      others.insert(word->second);
  }
  if (others.empty()) return;
  std::vector<std::string> first;
  for (const std::string& name : others)
    if (first.size() < kMost) first.push_back(name);
  fmt::print("differ, too (--examples shows more): {}{}\n", fmt::join(first, " "),
             others.size() > kMost ? fmt::format(" and {} others", others.size() - kMost) : "");
}

bool all_mutants_decided(const Options& o, const hls::Circuit& model, const hls::Rtl& rtl,
                         const hls::TiedPins& tied) {
  ProgressLine line;
  const auto begin = Clock::now();
  const hls::MutantCounts counts =
      hls::refute_mutants(model, rtl, tied, o.mutants, o.limits.seed, shown_on(line));
  line.clear();
  fmt::print(
      "mutants (one gate of the RTL inverted, seed {}): {} refuted, {} change nothing, {} not decided; "
      "{:.0f} s\n",
      o.limits.seed, counts.refuted, counts.equal, counts.open, seconds_since(begin));
  return counts.open == 0;
}

int prove(const Options& o) {
  ProgressLine line;
  const Progress progress = shown_on(line);
  const auto begin = Clock::now();
  const hls::TiedPins tied = tied_pins(o);
  line.show("reading the C++ and the RTL");
  const hls::RtlSources rtl_sources = hls::read_file_list(o.rtl, o.top);
  std::future<hls::Rtl> reading = std::async(std::launch::async, hls::read_rtl, rtl_sources);
  const hls::Circuit model = circuit_of(o.sources, hls::Undefined::kIsLeft);
  const hls::Rtl rtl = reading.get();
  const std::string opinion = hls::compare_with_icarus(rtl_sources, rtl, o.simulated_clocks, o.limits.seed);
  const double read_s = seconds_since(begin);
  hls::require_same_pins(model, rtl, tied);
  const std::vector<std::string> notes = hls::notes_of(model, rtl, tied);
  hls::Problem problem = hls::make_problem(model, rtl, hls::Products::kNamed, tied);
  if (o.blocks.empty() || std::find(o.blocks.begin(), o.blocks.end(), "promises") != o.blocks.end()) {
    line.show("translating what the C++ promises");
    hls::add_promises(problem, circuit_of(o.sources, hls::Undefined::kTraps));
  }
  const std::vector<std::size_t> chosen = choose(problem, o.blocks);
  std::vector<hls::Answer> answers = hls::prove(problem, chosen, o.limits, progress);
  Examples examples(model, rtl, tied, o);
  examples.check(problem, chosen, answers);
  line.clear();
  print_table(problem, chosen, answers);
  for (const std::string& note : notes) fmt::print("{}\n", note);
  fmt::print("{}\n", opinion);
  for (const hls::Invariant& invariant : model.invariants) fmt::print("invariant: {}\n", invariant.name);
  const Verdicts verdicts = print_open(problem, chosen, answers, o.examples);
  std::set<std::string> shown;
  for (std::size_t i = 0; i < chosen.size() && shown.size() < o.examples; ++i) {
    if (answers[i].verdict != hls::Verdict::kBroken) continue;
    const hls::Counterexample example = examples.of(problem, chosen[i], answers[i]);
    if (shown.insert(example.name).second) fmt::print("{}", hls::to_text(example, {"C++", "RTL"}));
  }
  print_others_broken(model, problem, chosen, answers, shown);
  fmt::print("{}: {} of {} bits equal {}{}{}; {:.0f} s, of that {:.0f} s to read both\n", verdicts.word(),
             chosen.size() - verdicts.broken - verdicts.open, chosen.size(), verdicts.states(),
             o.tied.empty() ? "" : " with ", fmt::join(o.tied, " "), seconds_since(begin), read_s);
  return verdicts.proved() && (o.mutants == 0 || all_mutants_decided(o, model, rtl, tied)) ? 0 : 1;
}

// Two ways to write the same: the second one has other options of the compiler.
int compare(const Options& o) {
  ProgressLine line;
  const auto begin = Clock::now();
  line.show("translating the C++");
  const hls::Circuit one = circuit_of(o.sources, hls::Undefined::kIsLeft);
  hls::Sources second = o.sources;
  second.options.insert(second.options.end(), o.other_options.begin(), o.other_options.end());
  const hls::Circuit other = circuit_of(second, hls::Undefined::kIsLeft);
  const hls::Problem problem = hls::make_problem(one, other);
  const std::vector<std::size_t> chosen = choose(problem, o.blocks);
  const std::vector<hls::Answer> answers = hls::prove(problem, chosen, o.limits, shown_on(line));
  line.clear();
  print_table(problem, chosen, answers);
  for (const hls::Invariant& invariant : one.invariants) fmt::print("invariant: {}\n", invariant.name);
  const Verdicts verdicts = print_open(problem, chosen, answers, o.examples);
  std::size_t shown = 0;
  for (std::size_t i = 0; i < chosen.size() && shown < o.examples; ++i) {
    if (answers[i].verdict != hls::Verdict::kBroken) continue;
    fmt::print("{}", hls::to_text(hls::make_counterexample(one, problem, problem.obligations[chosen[i]],
                                                           answers[i].example),
                                  {"first way", "second way"}));
    ++shown;
  }
  fmt::print("{}: {} of {} bits equal {}{}; {:.0f} s\n", verdicts.word(),
             chosen.size() - verdicts.broken - verdicts.open, chosen.size(), verdicts.states(),
             verdicts.with_invariants == 0 ? "" : ", as prove shows of them", seconds_since(begin));
  return verdicts.proved() ? 0 : 1;
}

// The bits of flops that never switch, whatever the state.
int list_still(const Options& o) {
  ProgressLine line;
  const auto begin = Clock::now();
  line.show("translating the C++");
  const hls::Circuit model = circuit_of(o.sources, hls::Undefined::kIsLeft);
  hls::never_reset(model, {}, false);  // refuses an invariant that does not hold in reset
  const hls::Problem problem = hls::make_switches(model, tied_pins(o));
  const std::vector<std::size_t> chosen = choose(problem, o.blocks);
  const std::vector<hls::Answer> answers = hls::prove(problem, chosen, o.limits, shown_on(line));
  line.clear();
  std::size_t switches = 0, possible = 0, never = 0, open = 0;
  bool invariants_hold = true;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const hls::Obligation& asked = problem.obligations[chosen[i]];
    const hls::Verdict verdict = answers[i].verdict;
    if (asked.kind == hls::Kind::kInvariant) {
      invariants_hold = invariants_hold && verdict == hls::Verdict::kHolds;
      fmt::print("invariant: {}{}\n", asked.name,
                 verdict == hls::Verdict::kHolds ? "" : ", which is not shown to hold");
      continue;
    }
    ++switches;
    possible += verdict == hls::Verdict::kBroken;
    never += verdict == hls::Verdict::kHolds;
    open += verdict == hls::Verdict::kOpen;
    if (verdict == hls::Verdict::kHolds)
      fmt::print("{}{}\n", asked.name, answers[i].needs_invariants ? ", where the invariants hold" : "");
    if (verdict == hls::Verdict::kOpen && open <= o.examples) fmt::print("{}: not decided\n", asked.name);
  }
  fmt::print(
      "{} bits of flops: {} rises and falls have a state that shows them, {} never happen{}{}, {} not "
      "decided; "
      "{:.0f} s\n",
      switches / 2, possible, never, o.tied.empty() ? "" : " with ", fmt::join(o.tied, " "), open,
      seconds_since(begin));
  return open == 0 && invariants_hold ? 0 : 1;
}

void add_sources(CLI::App* command, Options& o) {
  command->add_option("FILES", o.sources.files, "C++ files of the function and all that it calls")
      ->required();
  command->add_option("--option", o.sources.options, "Option of the compiler, such as --option=-Iinclude");
}

}  // namespace

Action add_hls_command(CLI::App& cli, const std::string&) {
  auto o = std::make_shared<Options>();
  auto action = std::make_shared<Action>();
  CLI::App* hls = cli.add_subcommand(
      "hls",
      "A pure C++ function as a circuit, and the proof that RTL is the same one (docs/verify/proof.md)");
  hls->require_subcommand(1);

  CLI::App* to_verilog = hls->add_subcommand("translate", "The function as SystemVerilog, AIGER or BTOR2");
  show_example(to_verilog,
               "hls translate examples/hls/debounce.cpp --option=-I. --module debounce --out debounce.sv");
  add_sources(to_verilog, *o);
  to_verilog->add_option("--out", o->out, "File to write: *.sv or *.v, *.aig (AIGER) or *.btor (BTOR2)")
      ->required();
  to_verilog->add_option("--module", o->module, "Name of the module")->capture_default_str();
  to_verilog->callback([o, action] { *action = [o] { return translate(*o); }; });

  CLI::App* proof =
      hls->add_subcommand("prove", "Whether RTL is the same circuit, for every state and input");
  show_example(
      proof, "hls prove examples/hls/debounce.cpp --option=-I. --rtl examples/hls/debounce.f --top debounce");
  add_sources(proof, *o);
  proof->add_option("--rtl", o->rtl, "List of the RTL's files: a file or +incdir+FOLDER a line")->required();
  proof->add_option("--top", o->top, "Its top module")->required();
  proof->add_option("--block", o->blocks,
                    "These blocks alone: instance paths such as u_guard, pins, invariants or promises");
  proof->add_option("--tie", o->tied, "PIN=0 or PIN=1: compare with this value of a pin alone");
  proof->add_option("--conflicts", o->limits.conflicts, "Of the SAT solver, for one bit")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  proof->add_option("--seed", o->limits.seed, "Of the random values and mutants")->capture_default_str();
  proof
      ->add_option("--simulate", o->simulated_clocks,
                   "Clocks for which Icarus runs the RTL beside Yosys' gates")
      ->capture_default_str()
      ->check(CLI::Range(0, 1'000'000));
  proof->add_option("--examples", o->examples, "Counterexamples shown at most")->capture_default_str();
  proof->add_option(
      "--mutants", o->mutants,
      "When all is proved: invert an operand of so many gates of the RTL, one at a time, and refute each");
  proof->callback([o, action] { *action = [o] { return prove(*o); }; });

  CLI::App* still = hls->add_subcommand(
      "still", "Bits of flops that never rise or never fall, whatever the state and the pins");
  show_example(still, "hls still examples/hls/debounce.cpp --option=-I.");
  add_sources(still, *o);
  still->add_option("--block", o->blocks, "These blocks alone: instance paths such as u_guard");
  still->add_option("--tie", o->tied, "PIN=0 or PIN=1: in clocks with this value of a pin alone");
  still->add_option("--conflicts", o->limits.conflicts, "Of the SAT solver, for one bit")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  still->add_option("--seed", o->limits.seed, "Of the random values")->capture_default_str();
  still->add_option("--examples", o->examples, "Bits named at most that are not decided")
      ->capture_default_str();
  still->callback([o, action] { *action = [o] { return list_still(*o); }; });

  CLI::App* ways = hls->add_subcommand(
      "compare", "Whether two ways to write the function are one, for every state and input");
  show_example(ways, "hls compare filter.cpp --option=-I. --other=-DSIMPLE");
  add_sources(ways, *o);
  ways->add_option("--other", o->other_options,
                   "Option of the compiler for the second way alone, such as --other=-DSLOWLY")
      ->required();
  ways->add_option("--block", o->blocks, "These blocks alone: instance paths such as u_guard, or pins");
  ways->add_option("--conflicts", o->limits.conflicts, "Of the SAT solver, for one bit")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  ways->add_option("--seed", o->limits.seed, "Of the random values")->capture_default_str();
  ways->add_option("--examples", o->examples, "Counterexamples shown at most")->capture_default_str();
  ways->callback([o, action] { *action = [o] { return compare(*o); }; });

  return [action] { return (*action)(); };
}

}  // namespace meltstage::app
