// SPDX-License-Identifier: Apache-2.0
// The `meltstage` command. Exit status: 0 good, 1 the job's own verdict is bad, 2 wrong input or use.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>

#include "app/bench.hpp"
#include "app/build_stamp.hpp"
#include "app/job_file.hpp"
#include "app/print.hpp"

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
  throw app::InputError(fmt::format("bench: found \"{}\", expected one of: {}", name, known));
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
  print_command->add_option("JOB", print.job, "Job file (TOML); reference in docs/jobs.md")->required();
  print_command->add_option("--out", print.out, "Folder to write (default: out/NAME of the job file)");
  CLI::Option* rtl_option =
      print_command->add_option("--rtl", rtl, "RTL beside the model: chosen windows, full job, none")
          ->transform(CLI::CheckedTransformer(
              std::map<std::string, tb::RtlWindows>{{"chosen", tb::RtlWindows::chosen},
                                                    {"full", tb::RtlWindows::full},
                                                    {"none", tb::RtlWindows::none}},
              CLI::ignore_case));
  print_command->add_flag("--vcd", print.vcd, "Write the pins as pins.vcd too");

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
      return app::print_job(print);
    }
    return run_bench(bench_name, bench_list, bench, bench_json);
  } catch (const app::InputError& error) {
    fmt::print(stderr, "meltstage: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "meltstage: {}\n", error.what());
    return 1;
  }
}
