// SPDX-License-Identifier: Apache-2.0
// `meltstage bench`.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "app/verbs.hpp"
#include "base/error.hpp"
#include "bench/bench.hpp"

namespace meltstage::app {
namespace {

int run_bench(const std::string& name, const BenchOptions& options, bool json) {
  std::string known;
  for (const Bench& bench : benches()) {
    if (bench.name == name) return report_bench(bench, options, json);
    known += (known.empty() ? "" : ", ") + std::string(bench.name);
  }
  throw UserError(fmt::format("bench: found \"{}\", expected one of: {}", name, known));
}

int list_benches() {
  for (const Bench& bench : benches()) fmt::print("{:<12} {}\n", bench.name, bench.summary);
  return 0;
}

}  // namespace

Action add_bench_command(CLI::App& cli, const std::string&) {
  struct Settings {
    std::string name;
    bool list = false, json = false;
    BenchOptions options;
  };
  const auto s = std::make_shared<Settings>();
  CLI::App* command =
      cli.add_subcommand("bench", "Measure and print the figures of a part, with what is wanted");
  show_example(command, "bench path --seed 7");
  command->add_option("NAME", s->name, "Which bench; --list names them");
  command->add_flag("--list", s->list, "Name the benches");
  command->add_flag("--json", s->json, "Print JSON");
  command->add_flag("--quick", s->options.quick, "Shorter measurement");
  command->add_option("--seed", s->options.seed, "Seed of what is random (default 1)");
  return [s] { return s->list ? list_benches() : run_bench(s->name, s->options, s->json); };
}

}  // namespace meltstage::app
