// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <limits>
#include <string>

#include "base/number.hpp"

namespace meltstage {

namespace detail {

/// An option without a value, as `--out ""`: most often a variable of a shell that was not set.
inline std::string refuse_nothing(const std::string& value) {
  return value.empty() ? "found nothing, expected a value" : "";
}

/// CLI11 itself takes nan, inf and hexadecimal numbers.
inline std::string refuse_no_decimal(const std::string& value) {
  constexpr double kMost = std::numeric_limits<double>::max();
  return number_in(value, -kMost, kMost) ? "" : fmt::format("found {}, expected a decimal number", value);
}

}  // namespace detail

/// Lets a command and those below it refuse values that are never meant: none at all, and for an option that
/// takes a floating-point number what is no finite decimal one.
inline void check_option_values(CLI::App& command) {
  for (CLI::Option* option : command.get_options()) {
    if (option->get_expected_max() == 0) continue;
    if (option->get_type_name().starts_with("FLOAT")) option->check(detail::refuse_no_decimal);
    option->check(detail::refuse_nothing);
  }
  for (CLI::App* below : command.get_subcommands([](const CLI::App*) { return true; }))
    check_option_values(*below);
}

}  // namespace meltstage
