// SPDX-License-Identifier: Apache-2.0
// TOML files that people write: each value is asked for with its range, each key that nobody asks for is a
// mistake. A refusal is one UserError, "FILE:LINE:COLUMN: SECTION.KEY: found FOUND, expected EXPECTED".
#pragma once

#include <fmt/format.h>
#include <toml++/toml.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace meltstage {

/// The file's top table. `wanted` ("a job file (TOML)") stands in messages. Throws UserError as
/// read_toml_text() does, for what is no TOML and for a file without a key.
toml::table parse_toml(const std::filesystem::path& path, std::string_view wanted);

/// What a text of a file stands for.
template <class T>
struct Choice {
  std::string_view name;
  T value;
};

/// A table that remembers which keys were asked for. Without a table every key has its fallback.
class TomlSection {
 public:
  /// `name` stands before the keys in messages; empty for a file's top table.
  TomlSection(const std::filesystem::path& file, const toml::table* table, std::string name)
      : file_(file), table_(table), name_(std::move(name)) {}

  bool present() const { return table_ != nullptr; }
  bool has(std::string_view key) const { return present() && table_->contains(key); }

  double number(std::string_view key, double fallback, double min, double max);
  std::int64_t integer(std::string_view key, std::int64_t fallback, std::int64_t min, std::int64_t max);
  bool flag(std::string_view key, bool fallback);
  std::string text(std::string_view key, std::string_view fallback);
  std::vector<std::string> texts(std::string_view key);
  /// Rows of whole numbers, none of them empty.
  std::vector<std::vector<unsigned>> rows(std::string_view key, unsigned max);

  /// The one of `items` whose `name` is the key's text.
  template <class T, std::size_t n>
  const T& named(std::string_view key, std::string_view fallback, std::span<const T, n> items) {
    const std::string value = text(key, fallback);
    std::string names;
    for (const T& item : items) {
      if (item.name == value) return item;
      names += fmt::format("{}{}", names.empty() ? "" : ", ", item.name);
    }
    fail(key, '"' + value + '"', "one of: " + names);
  }

  /// The value that goes with the key's text, one of `choices`.
  template <class T, std::size_t n>
  T choice(std::string_view key, std::string_view fallback, const std::array<Choice<T>, n>& choices) {
    return named(key, fallback, std::span<const Choice<T>, n>(choices)).value;
  }

  /// Tables of `[[key]]`, each a section of that name.
  std::vector<TomlSection> sections(std::string_view key);
  /// The table `[key]`, or a section without one.
  TomlSection section(std::string_view key);

  /// Names the place of the key; of the section where it lacks the key.
  [[noreturn]] void fail(std::string_view key, std::string_view found, std::string_view expected) const;

  /// "FILE:LINE:COLUMN: SECTION.KEY", for a refusal when this section is gone.
  std::string place_of(std::string_view key) const;

  /// Throws UserError for the first key that nobody asked for.
  void finish() const;

 private:
  const toml::node* find(std::string_view key);
  const toml::node* node_at(std::string_view key) const;
  std::string place_of(const toml::node* node, std::string_view key) const;
  [[noreturn]] void fail_at(const toml::node* node, std::string_view key, std::string_view found,
                            std::string_view expected) const;

  std::filesystem::path file_;
  const toml::table* table_;
  std::string name_;
  std::set<std::string, std::less<>> asked_;
};

}  // namespace meltstage
