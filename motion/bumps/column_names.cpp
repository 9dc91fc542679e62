// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/column_names.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <initializer_list>

#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

constexpr std::array<Unit, 9> kUnits = {{{"mm", 1.0},
                                         {"um", 1e-3},
                                         {"\u00b5m", 1e-3},
                                         {"\u03bcm", 1e-3},
                                         {"cm", 10.0},
                                         {"m", 1000.0},
                                         {"mil", 0.0254},
                                         {"in", 25.4},
                                         {"inch", 25.4}}};

/// Whether one of the words of a column's name is what `is_meant` looks for.
template <class IsMeant>
bool names_by_word(const Cell& cell, const IsMeant& is_meant) {
  std::string word;
  for (const char c : plain_name(cell) + ' ') {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += c;
      continue;
    }
    if (is_meant(word)) return true;
    word.clear();
  }
  return false;
}

}  // namespace

bool is_blank(const Cell& cell) {
  return !cell.number && cell.text.find_first_not_of(" \t\r\n") == std::string::npos;
}

bool begins_like_number(std::string_view text) {
  const auto first = text.find_first_not_of(" \t+-.");
  return first != std::string_view::npos && std::isdigit(static_cast<unsigned char>(text[first])) != 0;
}

std::string plain_name(const Cell& cell) {
  std::string text(trimmed(cell.text));
  if (text.starts_with('#')) text = trimmed(std::string_view(text).substr(1));
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::optional<std::size_t> behind_axis(std::string_view name, char axis) {
  std::string small(name);
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  auto start = small.find_first_not_of(kNameSeparators);
  for (const std::string_view prefix : {"pos", "mid", "center"})
    if (start != std::string::npos && std::string_view(small).substr(start).starts_with(prefix))
      start = small.find_first_not_of(" \t_-", start + prefix.size());
  if (start == std::string::npos || small[start] != axis) return std::nullopt;
  const auto word = std::min(small.find_first_not_of(" \t_-", start + 1), small.size());
  for (const std::string_view suffix : {"coordinate", "coord", "position", "pos", "location", "loc"}) {
    const std::size_t behind = word + suffix.size();
    if (std::string_view(small).substr(word).starts_with(suffix) &&
        (behind == small.size() || kNameSeparators.find(small[behind]) != std::string_view::npos))
      return behind;
  }
  if (start + 1 < small.size() && kNameSeparators.find(small[start + 1]) == std::string_view::npos)
    return std::nullopt;
  return start + 1;
}

const Unit* find_unit(std::string_view name) {
  const auto* known =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.name == name; });
  return known == kUnits.end() ? nullptr : known;
}

std::optional<Length> length_of(const Cell& cell) {
  if (cell.number) return std::nullopt;
  const std::string_view text = trimmed(cell.text);
  const auto digits = text.find_last_of("0123456789.");
  if (digits == std::string_view::npos) return std::nullopt;
  const auto value = parse_number(text.substr(0, digits + 1));
  const Unit* unit = find_unit(trimmed(text.substr(digits + 1)));
  if (!value || unit == nullptr) return std::nullopt;
  return Length{*value, unit};
}

bool names_column_of_sides(const Cell& cell) {
  constexpr std::array<std::string_view, 10> kWords = {
      "side",          "layer",     "tb",        "boardside",  "pcbside",
      "placementside", "mountside", "layername", "boardlayer", "seite"};
  const std::string name = plain_name(cell);
  if (name == "t/b" || name == "t_b" || name == "t-b") return true;
  return names_by_word(cell, [&](std::string_view word) {
    return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
  });
}

bool names_column_of_mirrors(const Cell& cell) {
  return names_by_word(cell, [](std::string_view word) { return word.starts_with("mirror"); });
}

std::optional<Side> side_by_mirror(const Cell& cell) {
  const std::string text = plain_name(cell);
  const auto is_one_of = [&](std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), text) != words.end();
  };
  if (is_one_of({"1", "yes", "y", "true", "m", "mirror", "mirrored", "ja", "j"})) return Side::bottom;
  if (is_one_of({"0", "no", "n", "false", "none", "nein", "not mirrored"})) return Side::top;
  return side_named(text);
}

}  // namespace meltstage::motion::detail
