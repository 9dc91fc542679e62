// SPDX-License-Identifier: Apache-2.0
// `meltstage print`.
#include "app/print/print_command.hpp"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <map>
#include <memory>

#include "app/verbs.hpp"
#include "app/windows/windows_command.hpp"
#include "base/output_file.hpp"

namespace meltstage::app {

Action add_print_command_with(CLI::App& cli, const std::string& typed, BoardAligner align) {
  struct Settings {
    PrintOptions print;
    tb::RtlWindows rtl = tb::RtlWindows::chosen;
    bool slurm = false;
  };
  const auto s = std::make_shared<Settings>();
  s->print.command = typed;
  s->print.align = align;
  CLI::App* command =
      cli.add_subcommand("print", "Print a job on the virtual printer: chip, heated head and stage");
  show_example(command, "print examples/first.toml");
  command->add_option("JOB", s->print.job, "Job file (TOML); reference in docs/print/jobs.md")->required();
  command->add_option("--out", s->print.out, "Folder to write (default: out/NAME of the job file)");
  CLI::Option* rtl_option =
      command->add_option("--rtl", s->rtl, "RTL beside the model: chosen windows (default), full job, none")
          ->transform(CLI::CheckedTransformer(
              std::map<std::string, tb::RtlWindows>{{"chosen", tb::RtlWindows::chosen},
                                                    {"full", tb::RtlWindows::full},
                                                    {"none", tb::RtlWindows::none}},
              CLI::ignore_case));
  command->add_flag("--vcd", s->print.vcd, "Write the pins as pins.vcd too");
  add_runner_options(command, s->print.windows, s->slurm);
  add_border_options(command, s->print.borders);
  command->add_option("--work", s->print.work,
                      "With --rtl full: folder of states, stimulus and results, which then stays "
                      "(default: OUT.windows, removed when all is equal)");
  return [s, command, rtl_option] {
    PrintOptions& print = s->print;
    if (*rtl_option) print.rtl = s->rtl;
    print.out = command->count("--out") != 0 ? folder_to_write(print.out) : "out" / print.job.stem();
    if (!print.work.empty()) print.work = folder_to_write(print.work);
    if (s->slurm) print.windows.runner = WindowRunner::slurm;
    for (const char* option : {"--jobs", "--slurm", "--attempts", "--window-clocks", "--borders", "--work"})
      if (command->count(option) != 0) print.for_full_rtl = option;
    return print_job(print);
  };
}

Action add_print_command(CLI::App& cli, const std::string& typed) {
  return add_print_command_with(cli, typed, nullptr);
}

}  // namespace meltstage::app
