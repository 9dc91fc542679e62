// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/commands/dft/inputs.hpp"
#include "app/commands/dft/subcommands.hpp"
#include "asic/dft/files/tester_profile.hpp"
#include "asic/dft/scan/lint.hpp"
#include "base/count.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct LintInput {
  PatternInput patterns;
  fs::path tester;
};

int lint_patterns(const LintInput& input) {
  const CycleStream stream = read_patterns(input.patterns, {});
  const TesterProfile tester = input.tester.empty() ? TesterProfile{} : read_tester_profile(input.tester);
  const std::vector<std::string> reasons = lint(stream, tester);
  for (const std::string& reason : reasons) fmt::print("{}\n", reason);
  fmt::print("{} cycles in {} vectors, {} signals, {}\n", cycle_count(stream), stream.cycles.size(),
             stream.signals.size(), counted(reasons.size(), "complaint"));
  return reasons.empty() ? 0 : 1;
}

}  // namespace

Action add_lint_command(CLI::App& dft) {
  auto input = std::make_shared<LintInput>();
  CLI::App* sub = dft.add_subcommand("lint", "Read a STIL or WGL file and check it against a tester");
  show_example(sub, "dft lint patterns.stil --tester tester.toml");
  sub->add_option("PATTERNS", input->patterns.patterns, "STIL file")->required();
  sub->add_option("--tester", input->tester, "Tester profile (TOML)");
  return [=] { return lint_patterns(*input); };
}

}  // namespace meltstage::app
