// SPDX-License-Identifier: Apache-2.0
// `meltstage regress`. Reference: docs/verify/regress.md.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <thread>

#include "app/number_range.hpp"
#include "app/regress/regress_reports.hpp"
#include "app/verbs.hpp"
#include "base/error.hpp"
#include "base/folder_lock.hpp"
#include "base/output_file.hpp"
#include "base/terminal.hpp"
#include "tb/jobs/job_runners.hpp"
#include "tb/lockstep/coverage.hpp"
#include "tb/regress/failing_case.hpp"
#include "tb/regress/regression.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;

struct Settings {
  std::string suite, run;
  fs::path waves, suites, out = "out/regress", failed, folder, failures = "failures";
  std::uint64_t move_seeds = 0, amount = 300'000;
  std::size_t number = 0;
  tb::JobOptions jobs{.processes = 0, .attempts = 3};
  bool slurm = false, fresh = false;
};

std::vector<tb::Suite> suites_of(const Settings& s) {
  return s.suites.empty() ? tb::standard_suites() : tb::read_suites(s.suites);
}

// Those that have failed before come first; each run once, with the largest amount that is asked for.
tb::Suite with_failed(tb::Suite suite, const std::vector<tb::RegressRun>& failed) {
  std::vector<tb::RegressRun> runs;
  for (const auto& list : {failed, suite.runs}) {
    for (const tb::RegressRun& run : list) {
      const auto known = std::find_if(runs.begin(), runs.end(), [&](const tb::RegressRun& other) {
        return other.test == run.test && other.seed == run.seed;
      });
      if (known == runs.end())
        runs.push_back(run);
      else
        known->amount = std::max(known->amount, run.amount);
    }
  }
  suite.runs = std::move(runs);
  return suite;
}

// A line for each run that failed now and isn't there yet.
void note_failed(const fs::path& file, const RegressReport& report) {
  const std::vector<tb::RegressRun> known = tb::read_failed(file);
  std::ofstream out;
  for (const auto& result : report.verdict.results) {
    if (!result || result->good || std::find(known.begin(), known.end(), result->run) != known.end())
      continue;
    if (!out.is_open()) out.open(file, std::ios::app | std::ios::binary);
    out << fmt::format("{} {}  # {}\n", tb::name_of(result->run), result->run.amount, report.date);
  }
  if (out.is_open() && !out.flush()) throw UserError(file.string() + ": cannot be written");
}

tb::JobsDone do_runs(const Settings& s, const fs::path& folder, const tb::RegressPlan& plan,
                     const std::vector<std::size_t>& numbers) {
  const tb::Jobs jobs{.what = "run",
                      .worker = {fs::read_symlink("/proc/self/exe").string(), "regress", "job"},
                      .folder = folder,
                      .numbers = numbers,
                      .left = [&] { return tb::runs_to_do(folder, plan); }};
  tb::JobOptions options = s.jobs;
  if (options.processes == 0) options.processes = std::max(1u, std::thread::hardware_concurrency());
  ProgressLine line;
  const tb::JobProgressCall progress = [&](const tb::JobProgress& p) {
    throw_if_interrupted();
    line.show_share(fmt::format("{} runs of {}", p.total, plan.suite.name),
                    static_cast<double>(p.done) / static_cast<double>(p.total),
                    fmt::format("{} done, {}", p.done, p.detail));
  };
  return s.slurm ? tb::run_jobs_slurm(jobs, options, progress) : tb::run_jobs_here(jobs, options, progress);
}

int run_suite(const Settings& s) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<tb::Suite> suites = suites_of(s);
  const fs::path out = folder_to_write(s.out), failed = s.failed.empty() ? out / "failed.txt" : s.failed;
  const tb::Suite suite = with_failed(tb::with_seeds_moved(tb::find_suite(suites, s.suite), s.move_seeds),
                                      tb::read_failed(failed));
  const fs::path folder = out / suite.name;
  RegressReport report;
  report.plan = tb::plan_for(suite);
  report.date = fmt::format(
      "{:%FT%TZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
  catch_interrupts();
  try {
    fs::create_directories(folder);
    const FolderLock alone(folder);
    if (s.fresh || !tb::holds(folder, report.plan)) tb::begin_regression(folder, report.plan);
    const std::vector<std::size_t> numbers = tb::runs_to_do(folder, report.plan);
    report.kept = suite.runs.size() - numbers.size();
    report.workers = "none needed";
    if (!numbers.empty()) {
      tb::JobsDone done = do_runs(s, folder, report.plan, numbers);
      report.workers = std::move(done.workers);
      report.notes = std::move(done.notes);
    }
    report.verdict = tb::join_runs(folder, report.plan);
    report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    note_failed(failed, report);
    write_whole(folder / "junit.xml", junit_xml(report));
    write_whole(folder / "summary.json", summary_json(report));
    write_whole(folder / "report.html",
                regress_page(report, append_history(out / "history.jsonl", history_line(report))));
    fmt::print("{}", regress_text(report, folder));
    return report.verdict.passed() ? 0 : 1;
  } catch (const Interrupted&) {
    on_stderr("meltstage: interrupted; results so far stay, the same command goes on\n");
    return 1;
  }
}

int list_suites(const Settings& s) {
  for (const tb::Suite& suite : suites_of(s))
    fmt::print("{:<10} {:>6} runs, coverage {:<7} {}\n", suite.name, suite.runs.size(),
               suite.coverage_closed ? "closed;" : "open;", suite.about);
  fmt::print("\n");
  for (const tb::RegressTest& test : tb::regress_tests())
    fmt::print("{:<10} {}; {}\n", test.name, test.unit, test.about);
  return 0;
}

// What a closed suite has to meet.
int list_points() {
  for (const std::string& point : tb::Coverage{}.holes()) fmt::print("{}\n", point);
  return 0;
}

int run_one(const Settings& s) {
  tb::RegressRun run = tb::run_of(s.run);
  run.amount = s.amount;
  const tb::RunResult result = tb::do_run(run, s.failures);
  if (!result.good) {
    fmt::print("{}: {}\n", tb::name_of(run), result.report);
    return 1;
  }
  fmt::print("{}: good, {} clocks, {} flop values compared, {:.1f} s\n", tb::name_of(run),
             result.compared.clocks, result.compared.flop_values, result.wall_s);
  return 0;
}

// A mismatch that was made small, once more.
int run_case(const Settings& s) {
  const tb::FailingCase failing = tb::read_case(s.folder);
  const auto rtl = s.waves.empty() ? tb::make_verilated_rtl() : tb::make_traced_rtl(s.waves);
  rtl->set_assertions(false);
  const tb::CaseVerdict verdict = tb::replay(failing, *rtl);
  fmt::print("{}", tb::describe(failing));
  if (verdict.differs.empty()) {
    fmt::print("model and RTL are equal\n");
    return 0;
  }
  fmt::print("model and RTL differ after clock {} in {}\n", verdict.clock, fmt::join(verdict.differs, ", "));
  return 1;
}

// Pins of the suite's runs, a file each.
int record_suite(const Settings& s) {
  const std::vector<tb::Suite> suites = suites_of(s);
  const tb::Suite suite = tb::with_seeds_moved(tb::find_suite(suites, s.suite), s.move_seeds);
  std::vector<tb::RegressRun> runs;
  std::copy_if(suite.runs.begin(), suite.runs.end(), std::back_inserter(runs), tb::has_pins);
  if (runs.empty())
    throw UserError(fmt::format(
        "suite {}: found no run of random, expected one: the others have no pins to record", suite.name));
  const fs::path folder = folder_to_write(s.folder);
  fs::create_directories(folder);
  ProgressLine line;
  std::size_t done = 0;
  for (const tb::RegressRun& run : runs) {
    line.show_share(fmt::format("{} recordings", runs.size()),
                    static_cast<double>(done++) / static_cast<double>(runs.size()));
    const fs::path file = folder / (tb::name_of(run) + ".mvec");
    fmt::print("{}: {} clocks\n", file.string(), tb::record_from_power_up(run, file));
  }
  return 0;
}

int do_job(const Settings& s) {
  tb::end_with_parent();
  return tb::do_planned_run(s.folder, tb::read_regression(s.folder), s.number).good ? 0 : 1;
}

}  // namespace

Action add_regress_command(CLI::App& cli, const std::string&) {
  const auto s = std::make_shared<Settings>();
  CLI::App* command = cli.add_subcommand(
      "regress", "Run a suite of tests and seeds on model and RTL (docs/verify/regress.md)");
  command->require_subcommand(1);
  const auto add_suites = [&](CLI::App* verb) {
    verb->add_option("--suites", s->suites, "File of suites (TOML; default: the project's own)");
  };
  CLI::App* list = command->add_subcommand("list", "Suites and tests");
  show_example(list, "regress list");
  add_suites(list);
  CLI::App* points = command->add_subcommand(
      "points",
      "Points of the specification that a closed suite has to meet, beside flop bits and pairs of faults");
  show_example(points, "regress points");
  CLI::App* run = command->add_subcommand("run", "Run a suite, or go on with it");
  show_example(run, "regress run pr -j 2");
  run->add_option("SUITE", s->suite, "Its name")->required();
  add_suites(run);
  run->add_option("--out", s->out, "Folder of all suites' results (default: out/regress)");
  run->add_option("-j,--jobs", s->jobs.processes, "Runs at once on this machine (default: its cores)")
      ->check(whole_number_from(1, 1024));
  run->add_flag("--slurm", s->slurm, "Run in Slurm job arrays");
  run->add_option("--attempts", s->jobs.attempts, "Tries of a run whose worker is lost (default 3)")
      ->check(whole_number_from(1, 100));
  run->add_option("--seed", s->move_seeds, "Added to each seed of the suite (default 0)")
      ->check(whole_number_from(0, 1'000'000'000'000));
  run->add_option(
      "--failed", s->failed,
      "Runs that failed before: they come first, and what fails is added (default: OUT/failed.txt)");
  run->add_flag("--fresh", s->fresh, "Take no result that lies there already");
  CLI::App* one = command->add_subcommand("one", "Run one test with one seed");
  show_example(one, "regress one random.17 --amount 100000");
  one->add_option("RUN", s->run, "TEST.SEED, e.g. random.17")->required();
  one->add_option("--amount", s->amount, "Clocks or trials (default 300000)")
      ->check(whole_number_from(1, 1'000'000'000'000));
  one->add_option("--failures", s->failures, "Folder for what a mismatch leaves (default: failures)");
  CLI::App* small = command->add_subcommand("case", "Run a mismatch that was made small");
  show_example(small, "regress case failures/random.17.json --fst waves.fst");
  small->add_option("FILE", s->folder, "Case (JSON)")->required();
  small->add_option("--fst", s->waves, "Waves of the RTL to write");
  CLI::App* record = command->add_subcommand(
      "record", "Write the pins of a suite's random runs from power-up, for other simulators (.mvec)");
  show_example(record, "regress record smoke out/smoke");
  record->add_option("SUITE", s->suite, "Name of the suite")->required();
  record->add_option("DIR", s->folder, "Folder of the recordings")->required();
  record->add_option("--seed", s->move_seeds, "Added to each seed of the suite (default 0)")
      ->check(whole_number_from(0, 1'000'000'000'000));
  add_suites(record);
  CLI::App* job = command->add_subcommand("job", "Do one run of a work folder; what run starts");
  show_example(job, "regress job out/regress/pr 0");
  job->add_option("DIR", s->folder, "Work folder")->required();
  job->add_option("NUMBER", s->number, "Run, from 0")->required()->check(whole_number_from(0, 1'000'000'000));
  return [s, list, points, run, one, small, record] {
    if (*list) return list_suites(*s);
    if (*points) return list_points();
    if (*run) return run_suite(*s);
    if (*small) return run_case(*s);
    if (*record) return record_suite(*s);
    return *one ? run_one(*s) : do_job(*s);
  };
}

}  // namespace meltstage::app
