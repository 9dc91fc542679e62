// SPDX-License-Identifier: Apache-2.0
// Time-parallel lockstep against sequential lockstep: the same recorded clocks, once as one window in one
// process, once as many windows on two processes, in turn.
#include <fmt/format.h>
#include <stdlib.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "app/windows/windows.hpp"
#include "base/temporary_folder.hpp"
#include "bench/bench.hpp"
#include "tb/jobs/job_runners.hpp"
#include "tb/pins/chip_pins.hpp"
#include "tb/pins/head.hpp"
#include "tb/windows/window_plan.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
namespace spec = chip::spec;

constexpr unsigned kProcesses = 2;

// A heated chip in work, polled twenty times a second, from reset on.
void record_run(recording::Sink& sink, std::uint64_t clocks) {
  constexpr std::uint64_t kPoll = spec::kClkHz / 20;
  tb::Head head({});
  chip::Chip chip;
  chip::Outputs out = chip.outputs({.rst_n = false});
  recording::Recorder recorder(sink, tb::chip_pin_header("meltstage bench windows"));
  const std::uint16_t setpoint[] = {1100};
  head.host().submit(tb::write_multiple_registers(1, spec::kHoldingBase + spec::kRegSetpoint, setpoint));
  head.host().submit(tb::write_single_register(1, spec::kHoldingBase, spec::kCmdRun));
  for (std::uint64_t cycle = 0; cycle < clocks; ++cycle) {
    if (cycle % kPoll == kPoll - 1) head.host().submit(tb::read_input_registers(1, 0, 16));
    while (head.host().take_result()) {
    }
    chip::Inputs in = head.step(cycle, out);
    in.rst_n = cycle >= 20;
    out.heater = out.heater && !in.inhibit;
    const auto levels = tb::pin_levels(in, out);
    for (std::uint32_t pin = 0; pin < tb::kChipPinCount; ++pin) recorder.set(pin, levels[pin]);
    recorder.commit(cycle);
    out = chip.step(in);
  }
  recorder.finish(clocks - 1);
}

tb::WindowPlan plan_run(const fs::path& folder, std::uint64_t clocks, std::uint64_t every) {
  tb::WindowPlanner planner(folder, {"bench", 1}, {every, {}});
  record_run(planner, clocks);
  return planner.publish();
}

struct Spent {
  double wall_s;
  double processor_s;  // of the workers
};

double children_s() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Checks every window. Throws when the verdict is not whole.
Spent check(const fs::path& folder, const tb::WindowPlan& plan, unsigned processes,
            const Progress& progress) {
  fs::remove_all(folder / "results");
  std::vector<std::size_t> windows;
  for (std::size_t i = 0; i < plan.windows.size(); ++i) windows.push_back(i);
  const tb::Jobs jobs{.what = "window",
                      .worker = {fs::read_symlink("/proc/self/exe").string(), "window"},
                      .folder = folder,
                      .numbers = windows,
                      .left = [&] { return tb::windows_to_run(folder, plan); }};
  const auto begin = std::chrono::steady_clock::now();
  const double before = children_s();
  tb::run_jobs_here(jobs, {.processes = processes, .attempts = 1}, [&](const tb::JobProgress& p) {
    tell(progress, fmt::format("{} windows on {} processes", p.total, processes), p.done, p.total);
  });
  const tb::JoinedWindows joined = tb::join_folder(folder, plan);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  if (!joined.whole) throw std::runtime_error("bench windows: " + joined.faults.front());
  return {elapsed.count(), children_s() - before};
}

double load_average() {
  double load = 0.0;
  return getloadavg(&load, 1) == 1 ? load : 0.0;
}

}  // namespace

std::vector<BenchRow> bench_windows(const BenchOptions& options) {
  const std::uint64_t clocks = options.quick ? 3'000'000 : 24'000'000;
  const std::uint64_t every = clocks / (options.quick ? 4 : 24);
  const int rounds = options.quick ? 1 : 3;
  const double load_before = load_average();
  const TemporaryFolder folder;
  const fs::path one = folder.path() / "one";
  const fs::path many = folder.path() / "many";
  const tb::WindowPlan one_plan = plan_run(one, clocks, clocks);
  const tb::WindowPlan many_plan = plan_run(many, clocks, every);
  constexpr double kNone = std::numeric_limits<double>::infinity();
  Spent sequential{kNone, kNone};
  Spent parallel{kNone, kNone};
  const auto keep_best = [](Spent& best, const Spent& now) {
    best.wall_s = std::min(best.wall_s, now.wall_s);
    best.processor_s = std::min(best.processor_s, now.processor_s);
  };
  for (int round = 0; round < rounds; ++round) {
    keep_best(sequential, check(one, one_plan, 1, options.progress));
    keep_best(parallel, check(many, many_plan, kProcesses, options.progress));
  }
  const double million = static_cast<double>(clocks) / 1e6;
  return {
      {"clocks of the run", million, "Mclock", {}, {}},
      {"windows", static_cast<double>(many_plan.windows.size()), "", 2.0, {}},
      {"sequential lockstep, one process", million / sequential.wall_s, "Mclock/s", {}, {}},
      {fmt::format("windows, {} processes", kProcesses), million / parallel.wall_s, "Mclock/s", {}, {}},
      {"windows / sequential, wall time", sequential.wall_s / parallel.wall_s, "", 1.8, {}},
      {"the same by processor time, two free cores",
       kProcesses * sequential.processor_s / parallel.processor_s,
       "",
       {},
       {}},
      {"490 s job at this rate",
       490.0 * spec::kClkHz / 1e6 / (million / parallel.wall_s) / 60.0,
       "min",
       {},
       {}},
      {"load of the machine before (others' work)", load_before, "", {}, {}},
  };
}

}  // namespace meltstage::app
