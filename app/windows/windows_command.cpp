// SPDX-License-Identifier: Apache-2.0
// `meltstage windows` and `meltstage window`. Reference: docs/verify/windows.md.
#include "app/windows/windows_command.hpp"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "app/number_range.hpp"
#include "app/verbs.hpp"
#include "recording/header.hpp"

namespace meltstage::app {

void add_runner_options(CLI::App* command, RunWindowsSettings& settings, bool& slurm) {
  command
      ->add_option("-j,--jobs", settings.processes,
                   "Windows checked at once on this machine (default: its cores)")
      ->check(whole_number_from(1, 1024));
  command->add_flag("--slurm", slurm, "Check the windows in Slurm job arrays");
  command->add_option("--attempts", settings.attempts, "Runs of a window whose worker is lost (default 3)")
      ->check(whole_number_from(1, 100));
}

void add_border_options(CLI::App* command, tb::WindowBorders& borders) {
  command
      ->add_option("--window-clocks", borders.every,
                   fmt::format("Clocks of a window (default {})", borders.every))
      ->check(whole_number_from(1, recording::kMaxCycle));
  command->add_option("--borders", borders.at, "Instead: first cycles of windows, with commas")
      ->delimiter(',')
      ->check(whole_number_from(1, recording::kMaxCycle));
}

Action add_windows_command(CLI::App& cli, const std::string&) {
  struct Settings {
    std::filesystem::path work, pins;
    tb::WindowBorders borders;
    RunWindowsSettings runner;
    bool slurm = false;
  };
  const auto s = std::make_shared<Settings>();
  CLI::App* command =
      cli.add_subcommand("windows", "Check a recorded run in RTL by time windows (docs/verify/windows.md)");
  command->require_subcommand(1);
  CLI::App* plan = command->add_subcommand("plan", "Cut a recording into windows");
  show_example(plan, "windows plan out/first/pins.mvec work");
  plan->add_option("PINS", s->pins, "Recording (.mvec) that begins in reset")->required();
  plan->add_option("DIR", s->work, "Work folder to write")->required();
  add_border_options(plan, s->borders);
  CLI::App* run = command->add_subcommand("run", "Check the windows that have no result yet");
  show_example(run, "windows run work");
  run->add_option("DIR", s->work, "Work folder")->required();
  add_runner_options(run, s->runner, s->slurm);
  CLI::App* verdict = command->add_subcommand("verdict", "Join the results");
  show_example(verdict, "windows verdict work");
  verdict->add_option("DIR", s->work, "Work folder")->required();
  return [s, plan, run] {
    if (*plan) return plan_windows(s->pins, s->work, s->borders);
    if (s->slurm) s->runner.runner = WindowRunner::slurm;
    return *run ? run_windows(s->work, s->runner) : join_windows(s->work);
  };
}

Action add_window_command(CLI::App& cli, const std::string&) {
  struct Settings {
    std::filesystem::path work;
    std::size_t window = 0;
  };
  const auto s = std::make_shared<Settings>();
  CLI::App* command = cli.add_subcommand("window", "Check one window of a work folder");
  show_example(command, "window work 0");
  command->add_option("DIR", s->work, "Work folder")->required();
  command->add_option("NUMBER", s->window, "Window, from 0")
      ->required()
      ->check(whole_number_from(0, recording::kMaxCycle));
  return [s] { return check_one_window(s->work, s->window); };
}

}  // namespace meltstage::app
