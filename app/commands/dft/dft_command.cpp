// SPDX-License-Identifier: Apache-2.0
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <map>
#include <string>
#include <utility>

#include "app/commands/dft/subcommands.hpp"
#include "app/verbs.hpp"

namespace meltstage::app {

namespace {

struct Subcommand {
  const char* name;
  Action (*add)(CLI::App& dft);
};

// In the order of the help.
constexpr Subcommand kSubcommands[] = {
    {"generate", add_generate_command}, {"scan", add_scan_command},
    {"grade", add_grade_command},       {"functional", add_functional_command},
    {"rules", add_rules_command},       {"lint", add_lint_command},
    {"replay", add_replay_command},     {"prove", add_prove_command},
    {"iddq", add_iddq_command},         {"check-proof", add_check_proof_command},
    {"tester", add_tester_command},     {"diagnose", add_diagnose_command},
};

}  // namespace

Action add_dft_command(CLI::App& cli, const std::string&) {
  CLI::App* command = cli.add_subcommand(
      "dft", "Scan, test patterns and sign-off vectors for a flat netlist (docs/make/test-vectors.md)");
  command->require_subcommand(1);
  std::map<std::string, Action> actions;
  for (const Subcommand& sub : kSubcommands) actions[sub.name] = sub.add(*command);
  return [=] { return actions.at(command->get_subcommands().front()->get_name())(); };
}

}  // namespace meltstage::app
