// SPDX-License-Identifier: Apache-2.0
#include "base/toml_file.hpp"

#include "base/error.hpp"
#include "base/place.hpp"
#include "base/toml_text.hpp"

namespace meltstage {
namespace {

// What a message shows of a value.
std::string text_of(const toml::node& node) {
  if (const auto text = node.value<std::string>()) return '"' + shown(*text) + '"';
  if (node.is_integer()) return fmt::format("{}", **node.as_integer());
  if (node.is_floating_point()) {
    const double value = **node.as_floating_point();
    return fmt::format("{}{}", value, value == std::floor(value) && std::abs(value) < 1e15 ? ".0" : "");
  }
  if (const toml::value<bool>* flag = node.as_boolean()) return **flag ? "true" : "false";
  if (node.is_array()) return "a list";
  return node.is_table() ? "a section" : "a date or time";
}

std::string from_to(auto min, auto max) { return fmt::format("{} to {}", min, max); }

}  // namespace

toml::table parse_toml(const std::filesystem::path& path, std::string_view wanted) {
  const std::string text = read_toml_text(path, wanted);
  try {
    toml::table table = toml::parse(text, path.string());
    if (table.empty()) throw UserError(fmt::format("{}: is empty, expected {}", path.string(), wanted));
    return table;
  } catch (const toml::parse_error& error) {
    throw UserError(fmt::format("{}:{}:{}: not TOML: {}", path.string(), error.source().begin.line,
                                error.source().begin.column, escaped(error.description())));
  }
}

double TomlSection::number(std::string_view key, double fallback, double min, double max) {
  const toml::node* node = find(key);
  if (node == nullptr) return fallback;
  if (!node->is_number()) fail(key, text_of(*node), "a number from " + from_to(min, max));
  const double value =
      node->is_integer() ? static_cast<double>(**node->as_integer()) : **node->as_floating_point();
  if (!(value >= min && value <= max)) fail(key, text_of(*node), from_to(min, max));
  return value;
}

std::int64_t TomlSection::integer(std::string_view key, std::int64_t fallback, std::int64_t min,
                                  std::int64_t max) {
  const toml::node* node = find(key);
  if (node == nullptr) return fallback;
  if (!node->is_integer()) fail(key, text_of(*node), "a whole number from " + from_to(min, max));
  const std::int64_t value = **node->as_integer();
  if (value < min || value > max) fail(key, fmt::format("{}", value), from_to(min, max));
  return value;
}

bool TomlSection::flag(std::string_view key, bool fallback) {
  const toml::node* node = find(key);
  if (node == nullptr) return fallback;
  if (!node->is_boolean()) fail(key, text_of(*node), "true or false");
  return **node->as_boolean();
}

std::string TomlSection::text(std::string_view key, std::string_view fallback) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::string(fallback);
  if (!node->is_string()) fail(key, text_of(*node), "a text in quotes");
  const std::string& value = **node->as_string();
  if (escaped(value) != value) fail(key, text_of(*node), "a text without control characters");
  return value;
}

std::vector<std::string> TomlSection::texts(std::string_view key) {
  std::vector<std::string> result;
  const toml::node* list = find(key);
  if (list == nullptr) return result;
  if (!list->is_array()) fail(key, text_of(*list), "a list of texts in quotes");
  for (const toml::node& node : *list->as_array()) {
    if (!node.is_string()) fail_at(&node, key, text_of(node), "a text in quotes");
    result.push_back(**node.as_string());
  }
  return result;
}

std::vector<std::vector<unsigned>> TomlSection::rows(std::string_view key, unsigned max) {
  std::vector<std::vector<unsigned>> result;
  const toml::node* list = find(key);
  if (list == nullptr) return result;
  const std::string wanted = "whole numbers from " + from_to(0, max);
  if (!list->is_array()) fail(key, text_of(*list), "lists of " + wanted);
  for (const toml::node& row : *list->as_array()) {
    if (!row.is_array()) fail_at(&row, key, text_of(row), "a list of " + wanted);
    if (row.as_array()->empty()) fail_at(&row, key, "an empty list", "a list of " + wanted);
    result.emplace_back();
    for (const toml::node& node : *row.as_array()) {
      const toml::value<std::int64_t>* value = node.as_integer();
      if (value == nullptr || **value < 0 || **value > max) fail_at(&node, key, text_of(node), wanted);
      result.back().push_back(static_cast<unsigned>(**value));
    }
  }
  return result;
}

std::vector<TomlSection> TomlSection::sections(std::string_view key) {
  std::vector<TomlSection> result;
  const toml::node* list = find(key);
  if (list == nullptr) return result;
  if (!list->is_array_of_tables()) fail(key, text_of(*list), fmt::format("sections [[{}]]", key));
  for (const toml::node& node : *list->as_array())
    result.emplace_back(file_, node.as_table(), std::string(key));
  return result;
}

TomlSection TomlSection::section(std::string_view key) {
  const toml::node* node = find(key);
  if (node != nullptr && !node->is_table()) fail(key, text_of(*node), fmt::format("a section [{}]", key));
  return {file_, node != nullptr ? node->as_table() : nullptr,
          name_.empty() ? std::string(key) : fmt::format("{}.{}", name_, key)};
}

void TomlSection::fail(std::string_view key, std::string_view found, std::string_view expected) const {
  fail_at(node_at(key), key, found, expected);
}

std::string TomlSection::place_of(std::string_view key) const { return place_of(node_at(key), key); }

void TomlSection::finish() const {
  if (table_ == nullptr) return;
  for (const auto& [key, node] : *table_) {
    if (asked_.contains(key.str())) continue;
    fail_at(&node, shown(key.str()), "an unknown key", fmt::format("one of: {}", fmt::join(asked_, ", ")));
  }
}

const toml::node* TomlSection::find(std::string_view key) {
  asked_.emplace(key);
  return table_ != nullptr ? table_->get(key) : nullptr;
}

const toml::node* TomlSection::node_at(std::string_view key) const {
  return has(key) ? table_->get(key) : table_;
}

std::string TomlSection::place_of(const toml::node* node, std::string_view key) const {
  std::string place = file_.string();
  if (node != nullptr && node->source().begin)
    place += fmt::format(":{}:{}", node->source().begin.line, node->source().begin.column);
  return fmt::format("{}: {}{}{}", place, name_, name_.empty() ? "" : ".", key);
}

void TomlSection::fail_at(const toml::node* node, std::string_view key, std::string_view found,
                          std::string_view expected) const {
  throw UserError(fmt::format("{}: found {}, expected {}", place_of(node, key), found, expected));
}

}  // namespace meltstage
