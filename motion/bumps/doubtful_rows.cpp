// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/doubtful_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "motion/bumps/column_names.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

bool is_among(std::string_view word, const auto& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::string joined(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); }

bool says_left_out(const std::string& words) {
  constexpr auto kWords = std::to_array<std::string_view>({"dnp",
                                                           "dni",
                                                           "dnf",
                                                           "do not populate",
                                                           "do not place",
                                                           "do not fit",
                                                           "do not install",
                                                           "depopulated",
                                                           "depop",
                                                           "unpopulated",
                                                           "not populated",
                                                           "nopop",
                                                           "no pop",
                                                           "not fitted",
                                                           "not placed",
                                                           "not mounted",
                                                           "unplaced",
                                                           "unfitted",
                                                           "deleted",
                                                           "removed",
                                                           "skip",
                                                           "skipped",
                                                           "exclude",
                                                           "excluded",
                                                           "omit",
                                                           "omitted",
                                                           "ignore",
                                                           "ignored",
                                                           "unused",
                                                           "not used",
                                                           "nicht best\u00fcckt",
                                                           "unbest\u00fcckt",
                                                           "entf\u00e4llt"});
  return is_among(words, kWords);
}

bool names_a_mark(const std::string& words) {
  constexpr auto kWords =
      std::to_array<std::string_view>({"fiducial", "fiducials", "fid", "local fiducial", "global fiducial",
                                       "fiducial mark", "alignment mark", "mark", "passermarke"});
  return is_among(words, kWords);
}

bool asks_whether_populated(const std::string& name) {
  constexpr auto kNames = std::to_array<std::string_view>(
      {"populate", "populated", "fitted", "fit", "place", "placed", "mount", "mounted", "stuff", "stuffed",
       "assemble", "assembled", "best\u00fcckt", "best\u00fccken"});
  return is_among(name, kNames);
}

/// "Die edge LL", "Origin", "Board size": what lies around the bumps.
bool names_an_outline(const std::vector<std::string>& words) {
  constexpr auto kOutline = std::to_array<std::string_view>(
      {"origin", "outline", "edge", "corner", "size", "boundary", "contour", "keepout", "dimensions",
       "center", "centre", "ursprung", "umriss", "ecke", "kante", "kontur", "mitte", "nullpunkt"});
  constexpr auto kBeside = std::to_array<std::string_view>(
      {"die",    "chip",   "board", "package", "wafer", "substrate", "of",     "the", "ll", "ur",    "ul",
       "lr",     "lower",  "upper", "left",    "right", "top",       "bottom", "x",   "y",  "array", "grid",
       "design", "street", "mm",    "um",      "min",   "max",       "1",      "2",   "3",  "4"});
  return std::any_of(words.begin(), words.end(), [&](const auto& w) { return is_among(w, kOutline); }) &&
         std::all_of(words.begin(), words.end(),
                     [&](const auto& w) { return is_among(w, kOutline) || is_among(w, kBeside); });
}

bool is_yes(const std::string& word) {
  constexpr auto kYes = std::to_array<std::string_view>({"yes", "y", "true", "1", "x", "ja"});
  return is_among(word, kYes);
}

bool is_no(const std::string& word) {
  constexpr auto kNo = std::to_array<std::string_view>({"no", "n", "false", "0", "nein"});
  return is_among(word, kNo);
}

bool holds(const std::vector<std::size_t>& columns, std::size_t column) {
  return std::find(columns.begin(), columns.end(), column) != columns.end();
}

std::string rows_told(std::size_t count, std::size_t first_row) {
  return count == 1 ? fmt::format("1 row, row {},", first_row)
                    : fmt::format("{} rows, first row {},", count, first_row);
}

}  // namespace

void DoubtfulRows::Kind::add(std::size_t row, const std::string& word) {
  if (count++ != 0) return;
  first_row = row;
  first_word = word;
}

void DoubtfulRows::take_names(const TableRow& names) {
  for (std::size_t i = 0; i < names.cells.size(); ++i) {
    const std::string name = joined(words_of_name(names.cells[i]));
    if (says_left_out(name)) left_out_.push_back(i);
    if (asks_whether_populated(name)) populated_.push_back(i);
  }
}

void DoubtfulRows::take(const TableRow& row, std::size_t x, std::size_t y) {
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    const Cell& cell = row.cells[i];
    if (i == x || i == y || is_blank(cell)) continue;
    const std::vector<std::string> words = words_of_name(cell);
    const std::string text = joined(words);
    if (says_left_out(text) || (holds(populated_, i) && is_no(text)) || (holds(left_out_, i) && is_yes(text)))
      return unpopulated_.add(row.row, cell.text);
    if (names_a_mark(text)) return mark_.add(row.row, cell.text);
    if (names_an_outline(words)) return outline_.add(row.row, cell.text);
  }
}

std::vector<std::string> DoubtfulRows::notes() const {
  std::vector<std::string> notes;
  const auto tell = [&](const Kind& kind, std::string_view meaning) {
    if (kind.count == 0) return;
    notes.push_back(fmt::format("{} {} {}, which may mean {}, and {} all the same",
                                rows_told(kind.count, kind.first_row), kind.count == 1 ? "says" : "say",
                                in_quotes(trimmed(kind.first_word)), meaning,
                                kind.count == 1 ? "makes a bump" : "make bumps"));
  };
  tell(unpopulated_, "that no bump is wanted there");
  tell(mark_, "a mark for alignment");
  tell(outline_, "the outline or the origin");
  return notes;
}

}  // namespace meltstage::motion::detail
