// SPDX-License-Identifier: Apache-2.0
// Help of a command in a person's words, and the same for programs: pages and completions are made of it.
#pragma once

#include <CLI/Formatter.hpp>
#include <CLI/Option.hpp>
#include <string>
#include <string_view>

namespace meltstage::app {

/// What stands before the call that shows how a command is used.
inline constexpr std::string_view kExample = "Example: ";

/// What an option takes: "chosen|full|none", "NUMBER", "TEXT ..."; empty for a flag.
std::string value_text(const CLI::Option& option);
/// The range that a number must be in, such as "1 to 1024" or "1 or more"; empty where it says nothing.
std::string range_text(const CLI::Option& option);

/// CLI11's own help shows numbers behind the words of a choice, and the bounds of its integers.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
};

/// The commands of `root` and below it as JSON: an array of {command, summary, example, arguments, options}.
/// An argument is {name, value, range, required, summary}, an option {names, ...} of the same.
std::string command_description(const CLI::App& root);

}  // namespace meltstage::app
