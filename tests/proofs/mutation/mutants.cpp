// SPDX-License-Identifier: Apache-2.0
// What becomes of every mutant of the RTL (mutate.py): lockstep with the model kills it, or the proof shows
// that it changes nothing; what is neither is a hole of the stimulus, or open. docs/verify/mutation.md
//
// Verdicts are kept, a line each, so that a run that was ended goes on where it was. Exit status 0 when no
// more than the wanted share is a hole or open, 1 when more or when a control fails, 2 on a wrong call.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/sha256.hpp"
#include "hls/proof/counterexample.hpp"
#include "hls/proof/refutation.hpp"
#include "lockstep_kill.hpp"
#include "tests/hls/chip_question.hpp"

namespace meltstage::tb {

// mutant_top.cpp: the RTL with the mutants of one file each.
#define MUTANT_TOP(file, make) std::unique_ptr<VerilatedRtl> make(unsigned variant, std::uint64_t& clocks);
#include "mutant_tops.inc"
#undef MUTANT_TOP

namespace {

namespace fs = std::filesystem;

constexpr unsigned kLongestRun_s = 3'600;  // far above what a survivor takes on a busy machine
// One of each kind; the random lockstep test runs them all on the chip itself.
constexpr RunLength kControl = {.trials = 100'000, .seeds = 8};

// The year and its week, for another sample each week.
std::uint64_t this_week() {
  const std::time_t now = std::time(nullptr);
  return std::stoull(fmt::format("{:%G%V}", *std::gmtime(&now)));
}

struct Options {
  std::vector<unsigned> only;  // all when empty
  std::size_t sample = 0;      // so many of them, all when 0
  std::uint64_t seed = this_week();
  std::uint64_t soon = 20'000;  // trials from any state, which most mutants do not outlive
  RunLength length;
  unsigned jobs = 1;
  double most_left = 0.5;  // percent
  fs::path folder = "out/mutants";
};

struct Mutant {
  unsigned number = 0;
  std::string file, line, branch, kind, change, text;
};

// A row a mutant, the identity last.
std::vector<Mutant> read_mutants(const fs::path& path) {
  std::ifstream file(path);
  std::vector<Mutant> list;
  for (std::string row; std::getline(file, row);) {
    std::istringstream cells(row);
    Mutant mutant;
    std::string number;
    for (std::string* cell :
         {&number, &mutant.file, &mutant.line, &mutant.branch, &mutant.kind, &mutant.change, &mutant.text})
      std::getline(cells, *cell, '\t');
    mutant.number = static_cast<unsigned>(std::stoul(number));
    list.push_back(mutant);
  }
  if (list.size() < 2)
    throw UserError(fmt::format("{}: no mutants; expected the list of mutate.py", path.string()));
  return list;
}

enum class Fate { kKilled, kEqual, kHole, kOpen };
constexpr std::array<const char*, 4> kFates = {"killed", "equal", "HOLE", "OPEN"};

struct Verdict {
  Fate fate = Fate::kOpen;
  std::string text;  // one line
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

// Told `s` or `p` when a simulation or a proof begins.
using Begins = std::function<void(char)>;

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

// ---- Processes -------------------------------------------------------------------------------------------

// A mutant is judged in a process of its own: Verilator ends the process when a design does not settle, and a
// run that hangs has to be stopped. It writes `s` or `p` when a simulation or a proof begins, its fate's
// digit, and the text.
struct Job {
  pid_t process = 0;
  int from = -1;
  const Mutant* mutant = nullptr;
};

Job start(const Mutant& mutant, const std::function<Verdict(const Begins&)>& judged) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("pipe: no file descriptors left");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork: no processes left");
  if (child == 0) {
    close(ends[0]);
    const auto tell = [&](const std::string& text) {
      if (write(ends[1], text.data(), text.size()) != static_cast<ssize_t>(text.size())) _exit(2);
    };
    const Verdict verdict = judged([&](char stage) {
      alarm(stage == 's' ? kLongestRun_s : 0);
      tell(std::string(1, stage));
    });
    tell(fmt::format("{}{}", static_cast<int>(verdict.fate), verdict.text.substr(0, 4000)));
    _exit(0);
  }
  close(ends[1]);
  return {child, ends[0], &mutant};
}

Verdict finish(const Job& job, int status) {
  std::string text;
  char buffer[4096];
  for (ssize_t got; (got = read(job.from, buffer, sizeof buffer)) > 0;)
    text.append(buffer, static_cast<std::size_t>(got));
  close(job.from);
  const std::size_t stages = text.find_first_not_of("sp");
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && stages != std::string::npos)
    return {static_cast<Fate>(text[stages] - '0'), text.substr(stages + 1)};
  if (!text.ends_with('s'))
    throw std::runtime_error(
        fmt::format("mutant {}: its proof ended with status {}", job.mutant->number, status));
  const bool hung = WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM;
  return {Fate::kKilled, hung ? fmt::format("no end within {} s", kLongestRun_s)
                              : "Verilator gave up: the design does not settle"};
}

void show_progress(std::size_t done, std::size_t all) {
  if (isatty(STDERR_FILENO)) fmt::print(stderr, "\r{}/{} mutants{}", done, all, done == all ? "\n" : "");
}

// Each of `list`, so many at once.
template <class Judge, class Take>
void judge_all(const std::vector<const Mutant*>& list, unsigned jobs, const Judge& judge, const Take& take) {
  std::vector<Job> running;
  for (std::size_t next = 0; next < list.size() || !running.empty();) {
    for (; next < list.size() && running.size() < jobs; ++next)
      running.push_back(start(
          *list[next], [&, mutant = list[next]](const Begins& begins) { return judge(*mutant, begins); }));
    int status = 0;
    const pid_t ended = wait(&status);
    const auto job =
        std::find_if(running.begin(), running.end(), [&](const Job& j) { return j.process == ended; });
    if (job == running.end()) continue;
    take(*job->mutant, finish(*job, status));
    running.erase(job);
    show_progress(next - running.size(), list.size());
  }
}

// ---- The kept verdicts -----------------------------------------------------------------------------------

// FOLDER/verdicts.tsv: number, fate, text. Those of another build of this program are begun anew.
class Verdicts {
 public:
  explicit Verdicts(const fs::path& folder) : path_(folder / "verdicts.tsv") {
    fs::create_directories(folder);
    const std::string stamp = "# " + sha256(read_file("/proc/self/exe", "this program"));
    std::ifstream kept(path_);
    std::string row;
    const bool same = static_cast<bool>(std::getline(kept, row)) && row == stamp;
    while (same && std::getline(kept, row) && !kept.eof()) {  // the last one may be cut off
      std::istringstream cells(row);
      std::string number, fate, text;
      std::getline(cells, number, '\t');
      std::getline(cells, fate, '\t');
      std::getline(cells, text, '\t');
      const auto known = std::find(kFates.begin(), kFates.end(), fate);
      list_[static_cast<unsigned>(std::stoul(number))] = {static_cast<Fate>(known - kFates.begin()), text};
    }
    kept.close();
    out_.open(path_, std::ios::trunc);
    out_ << stamp << '\n';
    for (const auto& [number, verdict] : list_) write(number, verdict);
  }

  bool has(unsigned number) const { return list_.contains(number); }
  const Verdict& of(unsigned number) const { return list_.at(number); }
  void add(unsigned number, const Verdict& verdict) {
    list_[number] = verdict;
    write(number, verdict);
  }

 private:
  void write(unsigned number, const Verdict& verdict) {
    out_ << number << '\t' << kFates[static_cast<std::size_t>(verdict.fate)] << '\t' << verdict.text
         << std::endl;
  }

  fs::path path_;
  std::map<unsigned, Verdict> list_;
  std::ofstream out_;
};

// ---- The run ---------------------------------------------------------------------------------------------

using Tally = std::array<unsigned, kFates.size()>;

void print_table(const char* title, const std::map<std::string, Tally>& rows) {
  fmt::print("\n{:<24}{:>8}{:>8}{:>8}{:>8}{:>8}\n", title, "mutants", "killed", "equal", "holes", "open");
  for (const auto& [name, tally] : rows)
    fmt::print("{:<24}{:>8}{:>8}{:>8}{:>8}{:>8}\n", name, tally[0] + tally[1] + tally[2] + tally[3], tally[0],
               tally[1], tally[2], tally[3]);
}

// In an order that the seed draws, so that a run that was ended has judged a fair sample.
std::vector<Mutant> chosen(std::vector<Mutant> mutants, const Options& options, unsigned last) {
  for (const unsigned number : options.only)
    if (number == 0 || number > last)
      throw UserError(fmt::format("--only: found {}, expected numbers from 1 to {}", number, last));
  if (!options.only.empty())
    std::erase_if(mutants, [&](const Mutant& m) {
      return std::find(options.only.begin(), options.only.end(), m.number) == options.only.end();
    });
  std::shuffle(mutants.begin(), mutants.end(), std::mt19937_64(options.seed));
  if (options.sample != 0) mutants.resize(std::min(mutants.size(), options.sample));
  return mutants;
}

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
  fmt::print("seed {}\n", options.seed);
  std::vector<Mutant> mutants = read_mutants(rtl / "mutants.tsv");
  const Mutant identity = mutants.back();
  mutants.pop_back();
  const std::vector<Mutant> all = chosen(mutants, options, identity.number - 1);
  if (!controls_survive(identity)) return 1;
  Verdicts verdicts(options.folder);
  std::vector<const Mutant*> left;
  for (const Mutant& mutant : all)
    if (!verdicts.has(mutant.number)) left.push_back(&mutant);
  std::vector<const Mutant*> survivors;
  judge_all(
      left, options.jobs,
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
        survivors, options.jobs,
        [&](const Mutant& mutant, const Begins& begins) {
          return judge_survivor(mutant, options, proof, begins);
        },
        [&](const Mutant& mutant, const Verdict& verdict) { verdicts.add(mutant.number, verdict); });
  }

  Tally total{};
  std::map<std::string, Tally> by_file, by_kind;
  for (const Mutant& mutant : all) {
    const Verdict& verdict = verdicts.of(mutant.number);
    fmt::print("{:>4} {} {} {}:{} {}: {} | {}\n", mutant.number,
               kFates[static_cast<std::size_t>(verdict.fate)], verdict.text, mutant.file, mutant.line,
               mutant.kind, mutant.change, mutant.text);
    for (Tally* tally : {&total, &by_file[mutant.file], &by_kind[mutant.kind]})
      ++(*tally)[static_cast<std::size_t>(verdict.fate)];
  }
  print_table("file", by_file);
  print_table("kind", by_kind);
  print_table("", {{"all", total}});
  const double percent =
      100.0 * (total[2] + total[3]) / static_cast<double>(std::max<std::size_t>(1, all.size()));
  fmt::print("\nholes and open: {:.2f} % of {}, wanted at most {:.2f} %\n", percent, all.size(),
             options.most_left);
  return percent <= options.most_left ? 0 : 1;
}

}  // namespace
}  // namespace meltstage::tb

int main(int argc, char** argv) {
  CLI::App cli{"What becomes of the mutants of the RTL: killed in lockstep, or proved equal", "mutants"};
  meltstage::tb::Options options;
  cli.add_option("--only", options.only, "Numbers of the mutants to judge; all without it");
  cli.add_option("--sample", options.sample, "So many of them; all without it")
      ->check(CLI::Range(1, 1'000'000));
  cli.add_option("--seed", options.seed, "Draws the sample and the order; this week's number without it");
  cli.add_option("--soon", options.soon, "Trials from any state before the proof is asked");
  cli.add_option("--trials", options.length.trials, "Trials from any state");
  cli.add_option("--seeds", options.length.seeds, "Random runs that a mutant has to survive")
      ->check(CLI::Range(0, 1'000'000));
  cli.add_option("--clocks", options.length.clocks, "Clocks of each run")
      ->check(CLI::Range(1'000, 100'000'000));
  cli.add_option("-j,--jobs", options.jobs, "Mutants at once")->check(CLI::Range(1, 1024));
  cli.add_option("--most-left", options.most_left, "Percent of holes and open ones for exit status 0")
      ->check(CLI::Range(0.0, 100.0));
  cli.add_option("--folder", options.folder, "Where verdicts are kept");
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
