// SPDX-License-Identifier: Apache-2.0
#include "app/windows/windows.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <set>
#include <thread>

#include "base/file.hpp"
#include "base/folder_lock.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"
#include "recording/text.hpp"
#include "tb/jobs/job_runners.hpp"

namespace meltstage::app {

namespace fs = std::filesystem;

namespace {

constexpr std::chrono::milliseconds kShareEvery{500};

// Parts of windows that are done, looked at now and then.
class SharesUnderWay {
 public:
  explicit SharesUnderWay(const fs::path& folder) : folder_(folder) {}
  double now() {
    const auto time = std::chrono::steady_clock::now();
    if (time >= next_) {
      sum_ = tb::shares_under_way(folder_);
      next_ = time + kShareEvery;
    }
    return sum_;
  }

 private:
  const fs::path& folder_;
  double sum_ = 0.0;
  std::chrono::steady_clock::time_point next_;
};

// Writes down how far a worker is.
class ShareWriter {
 public:
  ShareWriter(const fs::path& folder, std::size_t window) : folder_(folder), window_(window) {}
  void operator()(double share) {
    const auto time = std::chrono::steady_clock::now();
    if (time < next_) return;
    next_ = time + kShareEvery;
    tb::write_share(folder_, window_, share);
  }

 private:
  const fs::path& folder_;
  std::size_t window_;
  std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now() + kShareEvery;
};

std::string first_faults(const tb::JoinedWindows& joined) {
  constexpr std::size_t kShown = 20;
  std::string text;
  for (std::size_t i = 0; i < joined.faults.size() && i < kShown; ++i) text += joined.faults[i] + "\n";
  if (joined.faults.size() > kShown)
    text += fmt::format("... {} lines more\n", joined.faults.size() - kShown);
  return text;
}

std::string describe(const tb::JoinedWindows& joined) {
  return fmt::format(
      "windows: {} of {} equal, {} of {} clocks, {} flop values and {} pin values compared, {}", joined.equal,
      joined.windows.size(), joined.compared.clocks, joined.cycles, joined.compared.flop_values,
      joined.compared.pin_values, joined.whole ? "no gap" : "NOT a whole check");
}

}  // namespace

CheckedRun check_run(const fs::path& folder, const RunWindowsSettings& settings) {
  const auto begin = std::chrono::steady_clock::now();
  CheckedRun run{.joined = {},
                 .plan = tb::read_plan(folder),
                 .workers = "none needed",
                 .notes = {},
                 .kept = 0,
                 .wall_s = 0.0};
  const FolderLock alone(folder);
  tb::check_files(folder, run.plan);
  const std::vector<std::size_t> windows = tb::windows_to_run(folder, run.plan);
  run.kept = run.plan.windows.size() - windows.size();
  if (!windows.empty()) {
    const tb::Jobs jobs{.what = "window",
                        .worker = {fs::read_symlink("/proc/self/exe").string(), "window"},
                        .folder = folder,
                        .numbers = windows,
                        .left = [&] { return tb::windows_to_run(folder, run.plan); }};
    const tb::JobOptions options{.processes = settings.processes != 0
                                                  ? settings.processes
                                                  : std::max(1u, std::thread::hardware_concurrency()),
                                 .attempts = settings.attempts};
    ProgressLine line;
    SharesUnderWay under_way(folder);
    const tb::JobProgressCall progress = [&](const tb::JobProgress& p) {
      throw_if_interrupted();
      line.show_share(fmt::format("{} windows in RTL", p.total),
                      (static_cast<double>(p.done) + under_way.now()) / static_cast<double>(p.total),
                      fmt::format("{} done, {}", p.done, p.detail));
    };
    tb::JobsDone ran = settings.runner == WindowRunner::slurm ? tb::run_jobs_slurm(jobs, options, progress)
                                                              : tb::run_jobs_here(jobs, options, progress);
    run.workers = std::move(ran.workers);
    run.notes = std::move(ran.notes);
  }
  run.joined = tb::join_folder(folder, run.plan);
  run.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return run;
}

std::string describe(const CheckedRun& run) {
  std::string text = describe(run.joined) + fmt::format("; {:.1f} s, {}", run.wall_s, run.workers);
  if (run.kept != 0) text += fmt::format("; {} results were there already", run.kept);
  text += "\n";
  for (const std::string& note : run.notes) text += note + "\n";
  return text + first_faults(run.joined);
}

int plan_windows(const fs::path& pins, const fs::path& folder, const tb::WindowBorders& borders) {
  require_outside(folder, {pins});
  catch_interrupts();
  try {
    tb::WindowPlanner planner(folder, {pins.filename().string(), 0}, borders,
                              [](std::string_view, double) { throw_if_interrupted(); });
    recording::read_text_into(pins, planner);
    const tb::WindowPlan plan = planner.publish();
    fmt::print("{}: {} windows, {} clocks\n", escaped(folder.string()), plan.windows.size(), plan.cycles);
    return 0;
  } catch (const Interrupted&) {
    on_stderr("meltstage: interrupted; nothing written\n");
    return 1;
  }
}

int run_windows(const fs::path& folder, const RunWindowsSettings& settings) {
  catch_interrupts();
  try {
    const CheckedRun run = check_run(folder, settings);
    fmt::print("{}", describe(run));
    return run.joined.whole ? 0 : 1;
  } catch (const Interrupted&) {
    on_stderr("meltstage: interrupted; results so far stay, the same command goes on\n");
    return 1;
  }
}

int join_windows(const fs::path& folder) {
  const tb::JoinedWindows joined = tb::join_folder(folder, tb::read_plan(folder));
  fmt::print("{}\n{}", describe(joined), first_faults(joined));
  return joined.whole ? 0 : 1;
}

int check_one_window(const fs::path& folder, std::size_t window) {
  tb::end_with_parent();
  const tb::WindowPlan plan = tb::read_plan(folder);
  tb::WindowResult result;
  if (isatty(STDOUT_FILENO) == 0) {  // a worker of `windows run`, which tells the progress of all
    result = tb::check_window(folder, plan, window, ShareWriter(folder, window));
  } else {
    ProgressLine line;
    result = tb::check_window(folder, plan, window, [&](double share) {
      line.show_share(fmt::format("window {} in RTL", window), share);
    });
  }
  tb::write_result(folder, result);
  if (result.equal) {
    fmt::print("window {}: cycles {} to {} equal, {} flop values compared, {:.2f} s\n", window,
               result.first_cycle, result.last_cycle, result.compared.flop_values, result.wall_s);
    return 0;
  }
  fmt::print("window {}: {}", window, result.report);
  return 1;
}

}  // namespace meltstage::app
