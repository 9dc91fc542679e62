// SPDX-License-Identifier: Apache-2.0
#include "app/help_text.hpp"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <regex>

namespace meltstage::app {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kNoBound = std::uint64_t{1} << 31;  // an end of the integer's type, or as good as one

// "chosen->1,full->2" or "stuck-at, transition" as words.
std::string words_of(const std::string& list) {
  static const std::regex kNumber("->[^,]*"), kComma(", *");
  return std::regex_replace(std::regex_replace(list, kNumber, ""), kComma, "|");
}

std::string kind_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  static const std::regex kChoice("value in \\{(.*?)\\}"), kOneOf("one of: (.*)");
  std::smatch part;
  if (std::regex_search(type, part, kChoice) || std::regex_search(type, part, kOneOf))
    return words_of(part[1].str());
  return type.starts_with("TEXT") ? "TEXT" : "NUMBER";
}

bool takes_many(const CLI::Option& option) {
  return option.get_expected_max() == CLI::detail::expected_max_vector_size;
}

Json described(const CLI::Option& option) {
  return {{"value", value_text(option)},
          {"range", range_text(option)},
          {"required", option.get_required()},
          {"summary", option.get_description()}};
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

void describe(const CLI::App& command, const std::string& called, Json& list) {
  Json one = {{"command", called},
              {"summary", command.get_description()},
              {"example", command.get_footer().empty() ? "" : command.get_footer().substr(kExample.size())},
              {"arguments", Json::array()},
              {"options", Json::array()}};
  for (const CLI::Option* option : command.get_options()) {
    Json entry = option->get_positional() ? Json{{"name", option->get_name(true)}}
                                          : Json{{"names", names_of(*option)}};
    entry.update(described(*option));
    one[option->get_positional() ? "arguments" : "options"].push_back(entry);
  }
  list.push_back(one);
  for (const CLI::App* below : command.get_subcommands([](const CLI::App*) { return true; }))
    describe(*below, called + " " + below->get_name(), list);
}

}  // namespace

std::string value_text(const CLI::Option& option) {
  if (option.get_type_size() == 0 || option.get_expected_max() == 0) return "";
  std::string kind = kind_of(option);
  if (takes_many(option)) return kind + " ...";
  return option.get_expected_min() > 1 ? fmt::format("{} x {}", kind, option.get_expected_min()) : kind;
}

std::string range_text(const CLI::Option& option) {
  static const std::regex kRange("(-?[0-9.e+-]+) (?:to|-) (-?[0-9.e+-]+)");
  const std::string type = option.get_type_name();
  std::smatch part;
  if (!std::regex_search(type, part, kRange)) return "";
  if (std::stod(part[2].str()) < static_cast<double>(kNoBound)) return part[1].str() + " to " + part[2].str();
  return part[1].str() == "0" ? "" : part[1].str() + " or more";
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  std::string text = value_text(*option);
  if (!text.empty()) text.insert(0, " ");
  if (option->get_required()) text += " " + get_label("REQUIRED");
  return text;
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  std::string text = option->get_description();
  if (const std::string range = range_text(*option); !range.empty()) text += "; " + range;
  if (!option->get_default_str().empty()) text += fmt::format(" (default {})", option->get_default_str());
  for (const CLI::Option* needed : option->get_needs()) text += "; needs " + needed->get_name();
  for (const CLI::Option* other : option->get_excludes()) text += "; not with " + other->get_name();
  return text;
}

std::string command_description(const CLI::App& root) {
  Json list = Json::array();
  for (const CLI::App* command : root.get_subcommands([](const CLI::App*) { return true; }))
    describe(*command, command->get_name(), list);
  return list.dump(1) + "\n";
}

}  // namespace meltstage::app
