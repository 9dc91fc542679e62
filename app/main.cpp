// SPDX-License-Identifier: Apache-2.0
// The `meltstage` command. Exit status: 0 good, 1 the job's own verdict is bad, 2 wrong input or use.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>

#include "base/build_stamp.hpp"
#include "app/commands/chip_command.hpp"
#include "app/commands/conformal_command.hpp"
#include "app/commands/motion_files.hpp"
#include "app/commands/vectors_command.hpp"
#include "app/windows/windows.hpp"
#include "app/print/job_file.hpp"
#include "app/print/print.hpp"
#include "asic/dft/files/pattern_files.hpp"
#include "asic/dft/files/stil.hpp"
#include "base/error.hpp"
#include "base/output_file.hpp"
#include "bench/bench.hpp"
#include "host/errors.hpp"
#include "recording/text.hpp"

namespace {

using namespace meltstage;

int run_bench(const std::string& name, bool list, const app::BenchOptions& options, bool json) {
  if (list) {
    for (const app::Bench& bench : app::benches()) fmt::print("{:<12} {}\n", bench.name, bench.summary);
    return 0;
  }
  std::string known;
  for (const app::Bench& bench : app::benches()) {
    if (bench.name == name) return app::report_bench(bench, options, json);
    known += (known.empty() ? "" : ", ") + std::string(bench.name);
  }
  throw UserError(fmt::format("bench: found \"{}\", expected one of: {}", name, known));
}

// Who checks the windows; the same for every command that does.
void add_runner_options(CLI::App* command, app::RunWindowsSettings& settings, bool& slurm) {
  command
      ->add_option("-j,--jobs", settings.processes,
                   "Windows checked at once on this machine (default: its cores)")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--slurm", slurm, "Check the windows in Slurm job arrays");
  command->add_option("--attempts", settings.attempts, "Runs of a window whose worker is lost (default 3)")
      ->check(CLI::Range(1, 100));
}

// One line of what is wrong with the call. CLI11 says of a missing and of an unknown command only that one is
// required.
std::string usage_error(const CLI::App* root, const CLI::Error& error) {
  const CLI::App* command = root;
  std::string called = "meltstage";
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().back();
    called += " " + command->get_name();
  }
  const std::vector<std::string> unknown = root->remaining(true);
  std::string what = error.what();
  if (command->get_require_subcommand_min() > 0) {
    std::string known;
    for (const CLI::App* one :
         command->get_subcommands([](const CLI::App* a) { return !a->get_name().empty(); }))
      known += (known.empty() ? "" : ", ") + one->get_name();
    what = (unknown.empty() ? "no command given" : fmt::format("found \"{}\"", unknown.front())) +
           ", expected one of: " + known;
  }
  return fmt::format("{}: {}; {} --help tells more\n", called, what, called);
}

std::string command_line(int argc, char** argv) {
  std::string line = "meltstage";
  for (int i = 1; i < argc; ++i) line += std::string(" ") + argv[i];
  return line;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App cli{"Meltstage: the electronics and motion of a print head.", "meltstage"};
  cli.set_version_flag("--version", app::version());
  cli.require_subcommand(1);

  app::PrintOptions print;
  print.command = command_line(argc, argv);
  tb::RtlWindows rtl = tb::RtlWindows::chosen;
  CLI::App* print_command =
      cli.add_subcommand("print", "Print a job on the virtual printer: chip, heated head and stage");
  print_command->add_option("JOB", print.job, "Job file (TOML); reference in docs/print/jobs.md")->required();
  print_command->add_option("--out", print.out, "Folder to write (default: out/NAME of the job file)");
  CLI::Option* rtl_option =
      print_command->add_option("--rtl", rtl, "RTL beside the model: chosen windows, full job, none")
          ->transform(CLI::CheckedTransformer(
              std::map<std::string, tb::RtlWindows>{{"chosen", tb::RtlWindows::chosen},
                                                    {"full", tb::RtlWindows::full},
                                                    {"none", tb::RtlWindows::none}},
              CLI::ignore_case));
  print_command->add_flag("--vcd", print.vcd, "Write the pins as pins.vcd too");
  bool slurm = false;
  add_runner_options(print_command, print.windows, slurm);
  print_command
      ->add_option("--window-clocks", print.borders.every,
                   "With --rtl full: clocks of a window (default 12000000)")
      ->check(CLI::Range(std::uint64_t{1}, recording::max_cycle));
  print_command->add_option("--borders", print.borders.at, "Instead: first cycles of windows, with commas")
      ->delimiter(',');
  print_command->add_option("--work", print.work,
                            "With --rtl full: folder of states, stimulus and results, which then stays "
                            "(default: OUT.windows, removed when all is equal)");

  std::filesystem::path work;
  std::filesystem::path pins;
  std::size_t window = 0;
  tb::WindowBorders borders;
  app::RunWindowsSettings runner;
  CLI::App* windows_command =
      cli.add_subcommand("windows", "Check a recorded run in RTL by time windows (docs/verify/windows.md)");
  windows_command->require_subcommand(1);
  CLI::App* windows_plan = windows_command->add_subcommand("plan", "Cut a recording into windows");
  windows_plan->add_option("PINS", pins, "Recording (.mvec) that begins in reset")->required();
  windows_plan->add_option("DIR", work, "Work folder to write")->required();
  windows_plan->add_option("--window-clocks", borders.every, "Clocks of a window (default 12000000)")
      ->check(CLI::Range(std::uint64_t{1}, recording::max_cycle));
  windows_plan->add_option("--borders", borders.at, "Instead: first cycles of windows, with commas")
      ->delimiter(',');
  CLI::App* windows_run = windows_command->add_subcommand("run", "Check the windows that have no result yet");
  windows_run->add_option("DIR", work, "Work folder")->required();
  add_runner_options(windows_run, runner, slurm);
  CLI::App* windows_verdict = windows_command->add_subcommand("verdict", "Join the results");
  windows_verdict->add_option("DIR", work, "Work folder")->required();
  CLI::App* window_command = cli.add_subcommand("window", "Check one window of a work folder");
  window_command->add_option("DIR", work, "Work folder")->required();
  window_command->add_option("NUMBER", window, "Window, from 0")->required();

  app::GcodeCommand gcode;
  CLI::App* gcode_command =
      cli.add_subcommand("gcode", "Write a job as G-code for a real machine (docs/motion/stage.md)");
  gcode_command->add_option("JOB", gcode.job, "Job file (TOML), as for print")->required();
  gcode_command->add_option("--out", gcode.out, "File to write")->required();
  gcode_command->add_option("--dialect", gcode.dialect, "Control that reads it (default linuxcnc)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, motion::GcodeDialect>{
          {"linuxcnc", motion::GcodeDialect::linuxcnc}, {"grbl", motion::GcodeDialect::grbl}}));
  app::AccuracyCommand accuracy;
  CLI::App* accuracy_command =
      cli.add_subcommand("accuracy", "Evaluate a positioning test of an axis after ISO 230-2");
  accuracy_command->add_option("DEVIATIONS", accuracy.deviations, "Measured deviations (.csv)")->required();
  accuracy_command->add_option("--compensation", accuracy.compensation,
                               "Write the means as a LinuxCNC compensation file");

  std::string bench_name;
  bool bench_list = false;
  bool bench_json = false;
  app::BenchOptions bench;
  CLI::App* bench_command =
      cli.add_subcommand("bench", "Measure and print the figures of a part, with what is wanted");
  bench_command->add_option("NAME", bench_name, "Which bench; --list names them");
  bench_command->add_flag("--list", bench_list, "Name the benches");
  bench_command->add_flag("--json", bench_json, "Print JSON");
  bench_command->add_flag("--quick", bench.quick, "Shorter measurement");
  bench_command->add_option("--seed", bench.seed, "Seed of what is random (default 1)");

  const std::function<int()> chip = app::add_chip_command(cli, print.command);
  const std::function<int()> vectors_command = app::add_vectors_command(cli);
  const std::function<int()> conformal = app::add_conformal_command(cli);

  cli.failure_message(usage_error);
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int status = cli.exit(error);
    return status == 0 ? 0 : 2;
  }

  try {
    if (*print_command) {
      if (*rtl_option) print.rtl = rtl;
      if (print.out.empty()) print.out = std::filesystem::path("out") / print.job.stem();
      if (slurm) print.windows.runner = app::WindowRunner::slurm;
      for (const char* option : {"--jobs", "--slurm", "--attempts", "--window-clocks", "--borders", "--work"})
        if (print_command->count(option) != 0) print.for_full_rtl = option;
      return app::print_job(print);
    }
    if (cli.got_subcommand("chip")) return chip();
    if (*gcode_command) return app::write_gcode_file(gcode);
    if (*accuracy_command) return app::show_accuracy(accuracy);
    if (cli.got_subcommand("vectors")) return vectors_command();
    if (cli.got_subcommand("conformal")) return conformal();
    if (slurm) runner.runner = app::WindowRunner::slurm;
    if (*windows_plan) return app::plan_windows(pins, work, borders);
    if (*windows_run) return app::run_windows(work, runner);
    if (*windows_verdict) return app::join_windows(work);
    if (*window_command) return app::check_one_window(work, window);
    return run_bench(bench_name, bench_list, bench, bench_json);
  } catch (const UserError& error) {
    fmt::print(stderr, "meltstage: {}\n", error.what());
    return 2;
  } catch (const std::filesystem::filesystem_error& error) {
    fmt::print(stderr, "meltstage: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "meltstage: {}\n", error.what());
    return 1;
  }
}
