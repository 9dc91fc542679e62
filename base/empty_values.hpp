// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/App.hpp>
#include <string>

namespace meltstage {

/// Lets a command and those below it refuse an option without a value, as `--out ""`: most often a variable
/// of a shell that was not set.
inline void refuse_empty_values(CLI::App& command) {
  for (CLI::Option* option : command.get_options())
    if (option->get_expected_max() > 0)
      option->check(
          [](const std::string& value) { return value.empty() ? "found nothing, expected a value" : ""; });
  for (CLI::App* below : command.get_subcommands([](const CLI::App*) { return true; }))
    refuse_empty_values(*below);
}

}  // namespace meltstage
