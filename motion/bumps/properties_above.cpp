// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/properties_above.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "base/count.hpp"
#include "motion/bumps/column_names.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

bool begins_one_of(std::string_view word, const auto& stems) {
  return std::any_of(stems.begin(), stems.end(),
                     [&](std::string_view stem) { return word.starts_with(stem); });
}

/// Words of how a table lies or is scaled, in English, German, French, Spanish and Italian.
bool tells_geometry(const std::vector<std::string>& words) {
  constexpr std::array<std::string_view, 29> kStems = {
      "mirror",  "flip",   "scal",      "axis",       "axes",    "rotat",        "offset",   "origin",
      "shrink",  "invert", "swap",      "gespiegelt", "spiegel", "ma\u00dfstab", "massstab", "achse",
      "gedreht", "dreh",   "nullpunkt", "versatz",    "miroir",  "\u00e9chelle", "echelle",  "axe",
      "espejo",  "escala", "specchi",   "scala",      "asse"};
  return std::any_of(words.begin(), words.end(),
                     [&](const std::string& word) { return begins_one_of(word, kStems); });
}

/// "inch", "tenths of mm", "METRIC": perhaps how long the numbers are.
bool tells_length(const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(), [](const std::string& word) {
    return word == "metric" || word == "imperial" || unit_in_sentence(word) != nullptr;
  });
}

/// What a layout system says of a file and its maker.
bool tells_of_the_file(const std::vector<std::string>& words) {
  constexpr std::array<std::string_view, 27> kStems = {
      "date",   "datum", "time",    "zeit",    "file",    "datei",   "project", "projekt", "projet",
      "author", "autor", "revis",   "version", "variant", "title",   "titel",   "board",   "name",
      "custom", "kunde", "company", "firma",   "program", "generat", "creat",   "export",  "erstellt"};
  return !words.empty() && begins_one_of(words.front(), kStems);
}

/// "Scale: 2", "scale = 2", and "Scale" and "2" in two cells.
bool is_property(const TableRow& row) {
  const auto used =
      std::count_if(row.cells.begin(), row.cells.end(), [](const Cell& cell) { return !is_blank(cell); });
  if (used > 1) return true;
  return std::any_of(row.cells.begin(), row.cells.end(), [](const Cell& cell) {
    const std::string_view text = trimmed(cell.text);
    const auto sign = text.find_first_of(":=,;\t");
    return sign != std::string_view::npos && sign > 0 && sign + 1 < text.size();
  });
}

std::string text_of(const TableRow& row) {
  std::string text;
  for (const Cell& cell : row.cells)
    if (!is_blank(cell)) text += (text.empty() ? "" : " ") + std::string(trimmed(cell.text));
  const std::size_t first = std::min(text.find_first_not_of(",;\t "), text.size());
  return text.substr(first, text.find_last_not_of(",;\t ") + 1 - first);
}

}  // namespace

void PropertiesAbove::take(const TableRow& row) {
  const std::vector<std::string> words = words_of_name({text_of(row), std::nullopt});
  if (tells_geometry(words) || tells_length(words) || (is_property(row) && !tells_of_the_file(words)))
    add(row);
}

void PropertiesAbove::add(const TableRow& row) {
  if (count_++ > 0) return;
  first_row_ = row.row;
  first_ = text_of(row);
}

std::string PropertiesAbove::told() const {
  if (count_ == 0) return "";
  return fmt::format("row {} says {}, which is not read{}; above a table only a unit and a side are",
                     first_row_, in_quotes(first_),
                     count_ == 1 ? "" : fmt::format(", nor {}", counted(count_ - 1, "other such row")));
}

}  // namespace meltstage::motion::detail
