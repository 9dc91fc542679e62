// SPDX-License-Identifier: Apache-2.0
// Runs every mutant of a build (mutate.py) in lockstep with the model: a line each, the survivors' share by
// file and by kind, the score. Exit status 0 when the score is at or above the wanted one, 1 below or when a
// control fails, 2 on a wrong call. docs/verify/mutation.md
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "Vmutants.h"
#include "Vmutants__Syms.h"
#include "Vmutants___024root.h"
#include "lockstep_kill.hpp"

namespace meltstage::tb {
namespace {

constexpr unsigned kLongestRun_s = 3'600;  // far above what a survivor takes on a busy machine
constexpr std::uint64_t kControlSeeds =
    8;  // one of each kind; the random lockstep test runs them all on the chip itself

struct Mutant {
  unsigned number = 0;
  std::string file, line, kind, change, text;
};

// A row a mutant, the identity last.
std::vector<Mutant> read_mutants(const std::string& path) {
  std::ifstream file(path);
  std::vector<Mutant> list;
  for (std::string row; std::getline(file, row);) {
    std::istringstream cells(row);
    Mutant mutant;
    std::string number;
    for (std::string* cell :
         {&number, &mutant.file, &mutant.line, &mutant.kind, &mutant.change, &mutant.text})
      std::getline(cells, *cell, '\t');
    mutant.number = static_cast<unsigned>(std::stoul(number));
    list.push_back(mutant);
  }
  if (list.size() < 2)
    throw std::runtime_error(fmt::format("{}: no mutants; expected the list of mutate.py", path));
  return list;
}

struct Verdict {
  bool killed = false;
  std::string text;
};

Verdict verdict(unsigned variant, const RunLength& length) {
  const auto kill = killed_by<Vmutants>(variant, length);
  if (!kill) return {false, "SURVIVED"};
  if (kill->seed == 0) return {true, fmt::format("killed from any state, after {} clocks", kill->clock)};
  const char* how = kill->report.starts_with("MISMATCH") ? "" : " (no mismatch: the run gave up)";
  return {true, fmt::format("killed seed {} clock {}{}", kill->seed, kill->clock, how)};
}

// In a process of its own: Verilator ends the process when a design does not settle, and a run that hangs has
// to be stopped.
Verdict verdict_apart(unsigned variant, const RunLength& length) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("pipe: no file descriptors left");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork: no processes left");
  if (child == 0) {
    close(ends[0]);
    alarm(kLongestRun_s);
    const Verdict result = verdict(variant, length);
    const bool told =
        write(ends[1], result.text.data(), result.text.size()) == static_cast<ssize_t>(result.text.size());
    _exit(told ? (result.killed ? 1 : 0) : 2);
  }
  close(ends[1]);
  std::string text;
  char buffer[256];
  for (ssize_t got; (got = read(ends[0], buffer, sizeof buffer)) > 0;)
    text.append(buffer, static_cast<std::size_t>(got));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) < 2) return {WEXITSTATUS(status) == 1, text};
  const bool hung = WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM;
  return {true, hung ? fmt::format("killed (no end within {} s)", kLongestRun_s)
                     : "killed (Verilator gave up: the design does not settle)"};
}

struct Tally {
  unsigned killed = 0, all = 0;
  double percent() const { return all == 0 ? 0.0 : 100.0 * killed / all; }
};

void print_table(const char* title, const std::map<std::string, Tally>& rows) {
  fmt::print("\n{:<24}{:>8}{:>8}{:>9}\n", title, "killed", "of", "%");
  for (const auto& [name, tally] : rows)
    fmt::print("{:<24}{:>8}{:>8}{:>9.1f}\n", name, tally.killed, tally.all, tally.percent());
}

void show_progress(std::size_t done, std::size_t all) {
  if (isatty(STDERR_FILENO)) fmt::print(stderr, "\r{}/{} mutants{}", done, all, done == all ? "\n" : "");
}

// `only`: numbers of the mutants to run, all when empty.
int run(const std::string& list, const std::vector<unsigned>& only, const RunLength& length, double wanted) {
  std::vector<Mutant> mutants = read_mutants(list);
  const Mutant identity = mutants.back();
  mutants.pop_back();
  for (const unsigned number : only) {
    if (number == 0 || number >= identity.number)
      throw std::runtime_error(
          fmt::format("--only: expected numbers of 1 .. {}, found {}", identity.number - 1, number));
  }
  if (!only.empty()) {
    std::erase_if(mutants, [&](const Mutant& m) {
      return std::find(only.begin(), only.end(), m.number) == only.end();
    });
  }
  // Neither the chip as it is nor the identity may be killed, or a kill means nothing.
  for (const unsigned control : {0u, identity.number}) {
    const Verdict result =
        verdict_apart(control, {length.trials, std::min(length.seeds, kControlSeeds), length.clocks});
    fmt::print("control {}: {}\n", control == 0 ? "unchanged" : "identity", result.text);
    std::fflush(stdout);
    if (result.killed) return 1;
  }
  Tally total;
  std::map<std::string, Tally> by_file, by_kind;
  for (const Mutant& mutant : mutants) {
    const Verdict result = verdict_apart(mutant.number, length);
    fmt::print("{:>4} {} {}:{} {}: {} | {}\n", mutant.number, result.text, mutant.file, mutant.line,
               mutant.kind, mutant.change, mutant.text);
    for (Tally* tally : {&total, &by_file[mutant.file], &by_kind[mutant.kind]}) {
      ++tally->all;
      tally->killed += result.killed;
    }
    std::fflush(stdout);
    show_progress(total.all, mutants.size());
  }
  print_table("file", by_file);
  print_table("kind", by_kind);
  fmt::print("\nscore {:.1f} % ({} of {} killed), wanted {:.1f} %\n", total.percent(), total.killed,
             total.all, wanted);
  return total.percent() >= wanted ? 0 : 1;
}

}  // namespace
}  // namespace meltstage::tb

int main(int argc, char** argv) {
  CLI::App cli{"Random mutants of the RTL against the random lockstep runs", "mutants"};
  meltstage::tb::RunLength length;
  double wanted = 0.0;
  std::vector<unsigned> only;
  cli.add_option("--only", only, "Numbers of the mutants to run; all without it");
  cli.add_option("--trials", length.trials, "Trials from any state");
  cli.add_option("--seeds", length.seeds, "Runs a mutant has to survive")->check(CLI::Range(1, 1'000'000));
  cli.add_option("--clocks", length.clocks, "Clocks of each run")->check(CLI::Range(1'000, 100'000'000));
  cli.add_option("--wanted", wanted, "Least score in percent for exit status 0")
      ->check(CLI::Range(0.0, 100.0));
  try {
    cli.parse(argc, argv);
    return meltstage::tb::run(MUTANTS_LIST, only, length, wanted);
  } catch (const CLI::ParseError& error) {
    return cli.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "mutants: {}\n", error.what());
    return 2;
  }
}
