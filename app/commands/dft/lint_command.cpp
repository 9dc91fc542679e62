// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/commands/dft/inputs.hpp"
#include "app/commands/dft/subcommands.hpp"
#include "asic/dft/scan/lint.hpp"
#include "base/count.hpp"
#include "base/toml_file.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct LintInput {
  PatternInput patterns;
  fs::path tester;
};

TesterProfile tester_of(const fs::path& path) {
  constexpr std::int64_t kMostCount = 1'000'000'000'000;
  TesterProfile profile;
  if (path.empty()) return profile;
  const toml::table table = parse_toml(path, "a tester's profile (TOML)");
  TomlSection tester(path, &table, "");
  const auto time_ns = [&](const char* key, double fallback) {
    return tester.number(key, fallback, 1e-6, 1e9);
  };
  const auto count = [&](const char* key, std::uint64_t fallback) {
    return static_cast<std::uint64_t>(
        tester.integer(key, static_cast<std::int64_t>(fallback), 1, kMostCount));
  };
  profile.name = tester.text("name", profile.name);
  profile.least_period_ns = time_ns("least_period_ns", profile.least_period_ns);
  profile.edge_resolution_ns = time_ns("edge_resolution_ns", profile.edge_resolution_ns);
  profile.least_pulse_ns = time_ns("least_pulse_ns", profile.least_pulse_ns);
  profile.vector_memory = count("vector_memory", profile.vector_memory);
  profile.pins = count("pins", profile.pins);
  tester.finish();
  // A limit that nobody told would count as kept.
  for (const char* limit :
       {"least_period_ns", "edge_resolution_ns", "least_pulse_ns", "vector_memory", "pins"}) {
    if (!tester.has(limit)) tester.fail(limit, "nothing", "every limit of the tester in its profile");
  }
  return profile;
}

int lint_patterns(const LintInput& input) {
  const CycleStream stream = read_patterns(input.patterns, {});
  const std::vector<std::string> reasons = lint(stream, tester_of(input.tester));
  for (const std::string& reason : reasons) fmt::print("{}\n", reason);
  fmt::print("{} cycles in {} vectors, {} signals, {}\n", cycle_count(stream), stream.cycles.size(),
             stream.signals.size(), counted(reasons.size(), "complaint"));
  return reasons.empty() ? 0 : 1;
}

}  // namespace

Action add_lint_command(CLI::App& dft) {
  auto input = std::make_shared<LintInput>();
  CLI::App* sub = dft.add_subcommand("lint", "Read a STIL or WGL file and check it against a tester");
  sub->add_option("PATTERNS", input->patterns.patterns, "STIL file")->required();
  sub->add_option("--tester", input->tester, "Tester profile (TOML)");
  return [=] { return lint_patterns(*input); };
}

}  // namespace meltstage::app
