// SPDX-License-Identifier: Apache-2.0
// Component positions out of KiCad's placement file (.pos): one bump at the place of every footprint.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "base/place.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

/// A word of a row, and the offsets of its begin and of what stands behind it.
struct Word {
  std::string_view text;
  std::size_t begin, end;
};

std::vector<Word> words_of(const std::filesystem::path& path, std::size_t row, std::string_view line) {
  constexpr std::size_t kMostWords = 1000;
  constexpr std::string_view kBetweenWords = " \t\f\v";
  std::vector<Word> words;
  for (std::size_t end = 0;;) {
    const std::size_t begin = line.find_first_not_of(kBetweenWords, end);
    if (begin == std::string_view::npos) return words;
    if (words.size() == kMostWords)
      fail(path, fmt::format("row {}: found more than {} words, expected Ref Val Package PosX PosY Rot Side",
                             row, kMostWords));
    end = std::min(line.find_first_of(kBetweenWords, begin), line.size());
    words.push_back({line.substr(begin, end - begin), begin, end});
  }
}

class PosFile {
 public:
  explicit PosFile(const std::filesystem::path& path) : path_(path) { result_.has_unit = true; }

  void add(const Line& line) {
    const std::string_view text = trimmed(line.text);
    if (text.empty()) return;
    if (ended_row_ != 0 && !text.starts_with('#'))
      fail(path_, fmt::format("row {}: found {}, expected nothing behind '## End' in row {}", line.number,
                              in_quotes(text), ended_row_));
    if (text.starts_with('#')) {
      read_comment(line);
      return;
    }
    if (unit_mm_ == 0.0)
      fail(path_,
           fmt::format(
               "row {}: found {} before a line '## Unit = mm, ...', expected a placement file of KiCad",
               line.number, in_quotes(text)));
    const Row row{line.number, words_of(path_, line.number, line.text)};
    require_in_columns(row);
    const Side side = side_of(row);
    result_.points.push_back({number(row, x_) * unit_mm_, number(row, y_) * unit_mm_, line.number, side});
    check_point_count(path_, result_.points.size());
  }

  RawPoints finish() && {
    if (ended_row_ == 0)
      fail(path_, "the file ends without its last line '## End', expected it; the file may be cut off");
    return std::move(result_);
  }

 private:
  /// A column by its name in the header; `behind`: it is the so-manieth from the right.
  struct Column {
    std::string name;
    std::size_t behind, begin = 0, end = 0;
  };

  struct Row {
    std::size_t number;
    std::vector<Word> words;
  };

  void read_comment(const Line& line) {
    const auto words = words_of(path_, line.number, line.text);
    if (words.size() >= 2 && words[1].text == "End" && ended_row_ == 0) ended_row_ = line.number;
    if (words[0].text == "##" && words.size() >= 4 && words[1].text == "Unit")
      read_unit(line.number, words[3]);
    if (words[0].text == "##" && words.size() >= 4 && words[1].text == "Side")
      read_side(line.number, words[3]);
    if (names_columns(words)) read_header(line.number, words);
  }

  static bool names_columns(const std::vector<Word>& words) {
    constexpr std::array<std::string_view, 4> kNames = {"Ref", "#Ref", "PosX", "PosY"};
    return !words[0].text.starts_with("##") && std::any_of(words.begin(), words.end(), [&](const Word& word) {
      return std::find(kNames.begin(), kNames.end(), word.text) != kNames.end();
    });
  }

  void read_unit(std::size_t row, const Word& word) {
    std::string_view unit = word.text;
    if (unit.ends_with(',')) unit.remove_suffix(1);
    if (unit != "mm" && unit != "inches" && unit != "in")
      fail(path_, fmt::format("row {}, column {}: found unit {}, expected mm or inches", row, word.begin + 1,
                              in_quotes(unit)));
    const double unit_mm = unit == "mm" ? 1.0 : kInch_mm;
    if (unit_row_ != 0 && unit_mm != unit_mm_)
      fail(path_, fmt::format("row {}, column {}: found unit {}, expected one unit; row {} has {}", row,
                              word.begin + 1, in_quotes(unit), unit_row_, unit_mm_ == 1.0 ? "mm" : "inches"));
    unit_mm_ = unit_mm;
    unit_row_ = row;
  }

  /// "## Side : top"; "All", "both" and "---" say nothing of the rows.
  void read_side(std::size_t row, const Word& word) {
    if (const auto side = side_named(word.text)) {
      const bool contradicts = std::any_of(result_.points.begin(), result_.points.end(),
                                           [&](const RawPoint& point) { return point.side != side; });
      if ((stated_side_ && stated_side_ != side) || contradicts)
        fail(path_, fmt::format("row {}, column {}: found side {}, expected {}, as rows before have it", row,
                                word.begin + 1, in_quotes(word.text),
                                name_of(*side == Side::top ? Side::bottom : Side::top)));
      stated_side_ = side;
    } else if (word.text != "All" && word.text != "all" && word.text != "both" && word.text != "---") {
      fail(path_, fmt::format("row {}, column {}: found side {}, expected top, bottom, both or All", row,
                              word.begin + 1, in_quotes(word.text)));
    }
  }

  /// "# Ref Val Package PosX PosY Rot Side": in this order, or in any other.
  void read_header(std::size_t row, std::vector<Word> words) {
    words[0].text.remove_prefix(1);
    if (words[0].text.empty()) words.erase(words.begin());
    std::vector<std::string> names;
    for (const Word& word : words) names.emplace_back(word.text);
    if (header_row_ != 0 || !result_.points.empty()) {
      if (names == header_) return;
      fail(path_,
           fmt::format("row {}: found other names of columns, expected them once, before the first row "
                       "of a footprint",
                       row));
    }
    header_ = names;
    header_row_ = row;
    for (Column* column : {&x_, &y_, &side_}) {
      const auto is_column = [&](const Word& word) { return word.text == column->name; };
      const auto at = std::find_if(words.begin(), words.end(), is_column);
      if (at == words.end() || std::find_if(at + 1, words.end(), is_column) != words.end())
        fail(path_,
             fmt::format("row {}: found {} of the name {}, expected one among the names of the columns", row,
                         at == words.end() ? "no column" : "two columns", column->name));
      column->behind = static_cast<std::size_t>(words.end() - at);
      column->begin = at->begin;
      column->end = at->end;
    }
  }

  /// A row has a cell for each name. A value that is empty or holds a blank makes it another number: then the
  /// cells must stand under their names, numbers to the right, as KiCad writes them.
  void require_in_columns(const Row& row) const {
    if (row.words.size() == header_.size()) return;
    for (const Column* column : {&x_, &y_, &side_}) {
      const bool there = header_row_ != 0 && column->behind <= row.words.size();
      if (there && (column == &side_ ? word_at(row, *column).begin == column->begin
                                     : word_at(row, *column).end == column->end))
        continue;
      fail(path_,
           fmt::format("row {}: found {} cells, expected {} ({}), without blanks in a cell", row.number,
                       row.words.size(), header_.size(), shown(fmt::format("{}", fmt::join(header_, " ")))));
    }
  }

  static const Word& word_at(const Row& row, const Column& column) {
    return row.words[row.words.size() - column.behind];
  }

  Side side_of(const Row& row) const {
    const Word& word = word_at(row, side_);
    const auto side = side_named(word.text);
    if (!side)
      fail(path_, fmt::format("row {}, column {} (Side): found {}, expected top or bottom", row.number,
                              word.begin + 1, in_quotes(word.text)));
    if (stated_side_ && stated_side_ != side)
      fail(path_, fmt::format("row {}, column {} (Side): found {}, expected {}, as the file's '## Side' says",
                              row.number, word.begin + 1, in_quotes(word.text), name_of(*stated_side_)));
    return *side;
  }

  double number(const Row& row, const Column& column) const {
    const Word& word = word_at(row, column);
    const auto value = parse_number(word.text);
    if (!value || !std::isfinite(*value))
      fail(path_, fmt::format("row {} ({}): found {}, expected a number such as 12.5", row.number,
                              column.name, in_quotes(word.text)));
    return *value;
  }

  const std::filesystem::path& path_;
  RawPoints result_;
  double unit_mm_ = 0.0;
  std::size_t unit_row_ = 0, header_row_ = 0, ended_row_ = 0;
  std::vector<std::string> header_ = {"Ref", "Val", "Package", "PosX", "PosY", "Rot", "Side"};
  Column x_{"PosX", 4}, y_{"PosY", 3}, side_{"Side", 1};
  std::optional<Side> stated_side_;
};

}  // namespace

RawPoints read_pos_points(const std::filesystem::path& path, std::string_view content) {
  if (const auto kind = describe_content(content); kind != "text")
    fail(path, fmt::format("found {}, expected a placement file of KiCad (.pos)", kind));
  PosFile file(path);
  for_lines(without_byte_order_mark(content), [&](const Line& line) { file.add(line); });
  return std::move(file).finish();
}

}  // namespace meltstage::motion::detail
