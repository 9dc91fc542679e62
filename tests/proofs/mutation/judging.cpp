// SPDX-License-Identifier: Apache-2.0
#include "judging.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <random>
#include <sstream>
#include <stdexcept>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/sha256.hpp"

namespace meltstage::tb {

namespace {

constexpr unsigned kLongestRun_s = 3'600;  // far above what a survivor takes on a busy machine
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

using Tally = std::array<unsigned, kFates.size()>;

void print_table(const char* title, const std::map<std::string, Tally>& rows) {
  fmt::print("\n{:<24}{:>8}{:>8}{:>8}{:>8}{:>8}\n", title, "mutants", "killed", "equal", "holes", "open");
  for (const auto& [name, tally] : rows)
    fmt::print("{:<24}{:>8}{:>8}{:>8}{:>8}{:>8}\n", name, tally[0] + tally[1] + tally[2] + tally[3], tally[0],
               tally[1], tally[2], tally[3]);
}

}  // namespace

// A row a mutant, the identity last.
std::vector<Mutant> read_mutants(const std::filesystem::path& path) {
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

std::uint64_t this_week() {
  const std::time_t now = std::time(nullptr);
  return std::stoull(fmt::format("{:%G%V}", *std::gmtime(&now)));
}

void add_choice(CLI::App& cli, Choice& choice) {
  cli.add_option("--only", choice.only, "Numbers of the mutants to judge; all without it");
  cli.add_option("--sample", choice.sample, "So many of them; all without it")
      ->check(CLI::Range(1, 1'000'000));
  cli.add_option("--seed", choice.seed, "Draws the sample and the order; this week's number without it");
  cli.add_option("-j,--jobs", choice.jobs, "Mutants at once")->check(CLI::Range(1, 1024));
  cli.add_option("--most-left", choice.most_left, "Percent of holes and open ones for exit status 0")
      ->check(CLI::Range(0.0, 100.0));
  cli.add_option("--folder", choice.folder, "Where verdicts are kept");
}

std::vector<Mutant> chosen(std::vector<Mutant> mutants, const Choice& choice) {
  const std::size_t last = mutants.size();
  for (const unsigned number : choice.only)
    if (number == 0 || number > last)
      throw UserError(fmt::format("--only: found {}, expected numbers from 1 to {}", number, last));
  if (!choice.only.empty())
    std::erase_if(mutants, [&](const Mutant& m) {
      return std::find(choice.only.begin(), choice.only.end(), m.number) == choice.only.end();
    });
  std::shuffle(mutants.begin(), mutants.end(), std::mt19937_64(choice.seed));
  if (choice.sample != 0) mutants.resize(std::min(mutants.size(), choice.sample));
  return mutants;
}

void judge_all(const std::vector<const Mutant*>& list, unsigned jobs,
               const std::function<Verdict(const Mutant&, const Begins&)>& judge,
               const std::function<void(const Mutant&, const Verdict&)>& take) {
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

Verdicts::Verdicts(const std::filesystem::path& folder) : path_(folder / "verdicts.tsv") {
  std::filesystem::create_directories(folder);
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

void Verdicts::add(unsigned number, const Verdict& verdict) {
  list_[number] = verdict;
  write(number, verdict);
}

void Verdicts::write(unsigned number, const Verdict& verdict) {
  out_ << number << '\t' << kFates[static_cast<std::size_t>(verdict.fate)] << '\t' << verdict.text
       << std::endl;
}

double print_verdicts(const std::vector<Mutant>& all, const Verdicts& verdicts, double most_left) {
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
  fmt::print("\nholes and open: {:.2f} % of {}, wanted at most {:.2f} %\n", percent, all.size(), most_left);
  return percent;
}

}  // namespace meltstage::tb
