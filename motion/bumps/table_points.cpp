// SPDX-License-Identifier: Apache-2.0
// Coordinates out of tables: what columns and rows mean.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/count.hpp"
#include "base/place.hpp"
#include "motion/bumps/column_names.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/doubtful_rows.hpp"
#include "motion/bumps/properties_above.hpp"
#include "motion/bumps/side_columns.hpp"
#include "motion/bumps/summary_row.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

struct Column {
  std::size_t index = 0;
  double unit_mm = 1.0;
  bool has_unit = false;
};

std::optional<double> value_of(const Cell& cell) {
  return cell.number ? cell.number : parse_number(cell.text);
}

/// A malformed number rather than a label: nothing may be guessed from a table that begins with one.
bool looks_like_number(const Cell& cell) { return begins_like_number(cell.text); }

/// Whether a mark, comma or point, may stand between thousands rather than before decimals: three digits
/// behind each of them, and smaller numbers have none. "1,234" beside "950" is one or the other.
class ThousandsMarks {
 public:
  explicit ThousandsMarks(char mark) : mark_(mark) {}

  void take(std::size_t row, std::string_view number) {
    number = trimmed(number);
    number.remove_prefix(!number.empty() && (number[0] == '-' || number[0] == '+') ? 1 : 0);
    const auto mark = number.find(mark_);
    const auto digits = std::min(mark, number.size());
    if (mark == std::string_view::npos) {
      if (number.find_first_not_of("0123456789") != std::string_view::npos) return;
      if (digits > 3) decimals_ = true;
      if (plain_.empty() && digits <= 3) plain_ = told(row, number);
    } else if (digits >= 1 && digits <= 3 && number[0] != '0' && number.size() == mark + 4) {
      if (marked_.empty()) marked_ = told(row, number);
    } else {
      decimals_ = true;
    }
  }

  /// The first number where each has a mark that may stand between thousands; else empty.
  std::string all_marked() const { return decimals_ || !plain_.empty() ? "" : marked_; }

  /// "1,234 in row 2 and 950 in row 3"; empty where there is no doubt.
  std::string doubt() const {
    return decimals_ || marked_.empty() || plain_.empty() ? "" : fmt::format("{} and {}", marked_, plain_);
  }

 private:
  static std::string told(std::size_t row, std::string_view number) {
    return fmt::format("{} in row {}", in_quotes(number), row);
  }

  char mark_;
  bool decimals_ = false;
  std::string marked_, plain_;  // the first of each
};

class PointTable {
 public:
  explicit PointTable(const std::filesystem::path& path) : path_(path), sides_(path) {}

  void add(const TableRow& row) {
    count_cells(row);
    if (row.comment) return take_above(row);
    if (std::all_of(row.cells.begin(), row.cells.end(), is_blank)) return;
    if (!columns_known_) {
      if (is_title(row)) return;
      columns_known_ = true;
      if (take_header(row)) return;
      take_first_numbers(row);
    } else if (row_of_units_ == row.row && take_row_of_units(row)) {
      return;
    }
    if (units_) take_unit(row);
    refuse_nameless_units(row);
    const double x = number(row, x_, "x");
    const double y = number(row, y_, "y");
    note_commented_out(row);
    sides_.take(row);
    summary_.take(row, x_.index, y_.index, x, y);
    doubtful_.take(row, x_.index, y_.index);
    ends_within_row_ = row.ended ? 0 : row.row;
    if (row.hidden && hidden_++ == 0) first_hidden_ = row.row;
    result_.points.push_back({x, y, row.row});
    check_point_count(path_, result_.points.size());
  }

  RawPoints take() && {
    if (!columns_known_ && title_.row != 0) fail_unnamed(title_, "x and y");
    if (hidden_ > 0)
      result_.notes.push_back(
          hidden_ == 1
              ? fmt::format("1 row, row {}, is hidden in the sheet and holds a bump all the same",
                            first_hidden_)
              : fmt::format("{} rows, first row {}, are hidden in the sheet and hold bumps all the same",
                            hidden_, first_hidden_));
    if (unsigned_rows_ && !commented_out_.empty())
      fail(path_, commented_out_ + " at its beginning, expected a bump; take rows out that are none");
    if (const std::string doubt = commas_.doubt(); !doubt.empty())
      fail(path_,
           fmt::format(
               "found {}, expected numbers of which a comma is no mark between thousands; write points "
               "before decimals, or no marks between thousands",
               doubt));
    // Thousands of a millimetre or more would be metres; a smaller unit, or one not told, leaves a doubt.
    if (const std::string doubt = points_.doubt(); !doubt.empty() && !(x_.has_unit && x_.unit_mm >= 1.0))
      result_.notes.push_back(fmt::format(
          "the points are read as decimal marks; {} may mean that they stand between thousands", doubt));
    // Three decimals are common in millimetres, less so in smaller units.
    if (const std::string marked = points_.all_marked(); !marked.empty() && x_.has_unit && x_.unit_mm < 0.02)
      result_.notes.push_back(fmt::format(
          "the points are read as decimal marks, {} too; each number has three digits behind its point, so "
          "they may stand between thousands",
          marked));
    if (const std::string marked = commas_.all_marked(); !marked.empty())
      result_.notes.push_back(
          fmt::format("the commas are read as decimal marks, {} too; each number has three digits behind its "
                      "comma, so they may stand between thousands",
                      marked));
    if (!summary_.told().empty())
      fail(path_, fmt::format("row {}: found {}, expected a bump; leave it out, or give it a label with a "
                              "number if it is one",
                              summary_.row(), summary_.told()));
    if (ends_within_row_ != 0)
      result_.notes.push_back(
          fmt::format("row {} has no line end; if the file was cut off there, its last number is another one",
                      ends_within_row_));
    sides_.tell(result_);
    for (std::string& note : doubtful_.notes()) result_.notes.push_back(std::move(note));
    if (const std::string told = properties_.told(); !told.empty()) result_.notes.push_back(told);
    return std::move(result_);
  }

 private:
  /// The unit that a row above the table tells, in which column, and whether of all columns.
  struct TitleUnit {
    const Unit* unit = nullptr;
    TableRow row;
    std::size_t column = 0;
    bool of_all = false;
  };

  /// Who put such a sign before some of the labels wanted those bumps away. Where all have it they are
  /// numbered so.
  void note_commented_out(const TableRow& row) {
    const auto first = std::find_if_not(row.cells.begin(), row.cells.end(), is_blank);
    const std::string_view text = trimmed(first->text);
    if (!text.starts_with('#') && !text.starts_with("//") && !text.starts_with(';'))
      unsigned_rows_ = true;
    else if (commented_out_.empty())
      commented_out_ = fmt::format("row {}: found {}", row.row, in_quotes(text));
  }

  /// A row may be as wide as a spreadsheet's, but not each of millions of rows.
  void count_cells(const TableRow& row) {
    constexpr std::size_t kMostCells = 20'000'000;
    cells_ += row.cells.size();
    if (cells_ > kMostCells)
      fail(path_,
           fmt::format("row {}: found more than {} cells so far, expected at most so many; leave out what is "
                       "no coordinate",
                       row.row, kMostCells));
  }

  /// True if the row names columns; throws if it does so without both x and y.
  bool take_header(const TableRow& row) {
    const auto x = find_column(row, 'x'), y = find_column(row, 'y');
    if (x && y) {
      if (x->has_unit != y->has_unit)
        fail(path_,
             fmt::format("row {}: found a unit at one of x and y only, expected both or none", row.row));
      if (x->has_unit && x->unit_mm != y->unit_mm)
        fail(path_, fmt::format("row {}: found {} and {}, expected one unit for x and y", row.row,
                                in_quotes(row.cells[x->index].text), in_quotes(row.cells[y->index].text)));
      x_ = *x;
      y_ = *y;
      if (x_.has_unit) say_unit(place(row.row, x_.index), row.cells[x_.index].text);
      sides_.take_names(row, x_.index, y_.index);
      doubtful_.take_names(row);
      if (row.parted_by_blanks) tell_names_of_two_words(row);
      find_units(row);
      for (const std::size_t i : {x_.index + 1, y_.index + 1})
        if (i >= row.cells.size() || is_blank(row.cells[i])) nameless_.push_back(i);
      take_title_unit(row);
      row_of_units_ = row.row + 1;
      return true;
    }
    if (x || y) fail_unnamed(row, x ? "y" : "x");
    if (title_.row != 0) fail_unnamed(title_, "x and y");
    return false;
  }

  /// "Signal Name" unquoted would be two columns, and a value of two words in another one hides it.
  void tell_names_of_two_words(const TableRow& row) {
    constexpr auto kSecond =
        std::to_array<std::string_view>({"name", "number", "no", "type", "id", "side", "layer", "size"});
    for (std::size_t i = 1; i < row.cells.size(); ++i) {
      const std::string before = plain_name(row.cells[i - 1]);
      if (before == "x" || before == "y" ||
          std::find(kSecond.begin(), kSecond.end(), plain_name(row.cells[i])) == kSecond.end())
        continue;
      result_.notes.push_back(fmt::format(
          "blanks part the columns, so {} and {} are two of them; x is column {} and y column {}",
          in_quotes(row.cells[i - 1].text), in_quotes(row.cells[i].text), x_.index + 1, y_.index + 1));
      return;
    }
  }

  /// Words above the names of the columns, and perhaps a number: "Bumps, 128". A row of the table has two.
  bool is_title(const TableRow& row) {
    const auto numbers = std::count_if(row.cells.begin(), row.cells.end(),
                                       [](const Cell& c) { return value_of(c) || looks_like_number(c); });
    const bool begins_with_words = !row.cells.empty() && !is_blank(row.cells.front()) &&
                                   !value_of(row.cells.front()) && !looks_like_number(row.cells.front());
    if (numbers > 1 || (numbers == 1 && !begins_with_words)) return false;
    if (!is_sentence(row) && (find_column(row, 'x') || find_column(row, 'y'))) return false;
    if (title_.row == 0) title_ = row;
    take_above(row);
    return true;
  }

  void take_above(const TableRow& row) {
    take_axes_told(row);
    const bool side = sides_.take_above(row);
    bool unit = false;
    for (std::size_t i = 0; i < row.cells.size(); ++i) unit = read_title_unit(row, i) || unit;
    if (!side && !unit) properties_.take(row);
  }

  /// Words above the table may tell the columns in a way that isn't read.
  void take_axes_told(const TableRow& row) {
    for (const Cell& cell : row.cells) {
      const std::vector<std::string> words = words_of_name(cell);
      const auto has = [&](std::string_view axis) {
        return std::find(words.begin(), words.end(), axis) != words.end();
      };
      axes_told_ = axes_told_ || (has("x") && has("y"));
    }
  }

  /// Words in one cell, "X and Y in mm", which name no column.
  static bool is_sentence(const TableRow& row) {
    const auto used =
        std::count_if(row.cells.begin(), row.cells.end(), [](const Cell& c) { return !is_blank(c); });
    return used == 1 && !row.cells.empty() &&
           trimmed(row.cells.front().text).find_first_of(" ,/") != std::string_view::npos;
  }

  /// Whether cell `i` of the row tells one.
  bool read_title_unit(const TableRow& row, std::size_t i) {
    const auto told = unit_told(row.cells[i].text, i + 1 < row.cells.size() ? row.cells[i + 1].text : "");
    if (!told) return false;
    const Unit* unit = find_unit(told->name);
    if (unit == nullptr)
      fail(path_, fmt::format("{}: found unit {} above the columns, expected {}", place(row.row, i),
                              in_quotes(told->name), kUnitsExpected));
    if (const Unit* other = other_unit_in(row.cells[i].text, *unit))
      fail(path_, fmt::format("{}: found the units {} and {} above the columns, expected one",
                              place(row.row, i), unit->name, other->name));
    if (title_unit_.unit != nullptr && unit->mm != title_unit_.unit->mm)
      fail(path_,
           fmt::format("{}: found unit {} above the columns, expected {}, as row {} has", place(row.row, i),
                       in_quotes(told->name), title_unit_.unit->name, title_unit_.row.row));
    if (!title_unit_.of_all)
      title_unit_ = {unit, row, i + leading_separators(row.cells[i].text), told->of_all};
    return true;
  }

  /// A line of separated text stands in one cell.
  static std::size_t leading_separators(std::string_view text) {
    const std::size_t blank = text.find_first_not_of(",;\t");
    return blank == std::string_view::npos ? 0 : blank;
  }

  /// Whether the unit above the table is one of x and y: of all columns, or of theirs.
  bool is_of_x_and_y(const TitleUnit& title) const {
    if (title.of_all) return true;
    const std::size_t first = std::min(x_.index, y_.index), last = std::max(x_.index, y_.index);
    if (title.column > first) return false;
    for (std::size_t i = title.column + 1; i <= last && i < title.row.cells.size(); ++i)
      if (!is_blank(title.row.cells[i])) return false;  // the words of the columns from here on
    return true;
  }

  /// What stands above the table holds for columns without a unit of their own; another one beside it would
  /// make the scale a guess.
  void take_title_unit(const TableRow& header) {
    if (title_unit_.unit == nullptr) return;
    if (!is_of_x_and_y(title_unit_)) return properties_.add(title_unit_.row);
    for (Column* column : {&x_, &y_}) {
      if (column->has_unit && column->unit_mm != title_unit_.unit->mm)
        fail(path_, fmt::format("{}: found the unit in {}, expected {}, as row {} says",
                                place(header.row, column->index), in_quotes(header.cells[column->index].text),
                                title_unit_.unit->name, title_unit_.row.row));
      column->unit_mm = title_unit_.unit->mm;
      column->has_unit = true;
    }
    say_unit(fmt::format("row {}", title_unit_.row.row), title_unit_.unit->name);
  }

  void say_unit(std::string_view where, std::string_view text) {
    if (!result_.has_unit) result_.unit_place = fmt::format("{}: {}", where, shown(trimmed(text)));
    result_.has_unit = true;
  }

  void find_units(const TableRow& header) {
    for (std::size_t i = 0; i < header.cells.size(); ++i) {
      if (i == x_.index || i == y_.index || !names_column_of_units(header.cells[i])) continue;
      if (units_)
        fail(path_, fmt::format("{}: found a second column of units, expected one", place(header.row, i)));
      units_ = UnitColumn{i, shown(trimmed(header.cells[i].text))};
    }
  }

  /// A column of units tells that of its row, where it tells any.
  void take_unit(const TableRow& row) {
    UnitColumn& units = *units_;
    const bool empty = units.index >= row.cells.size() || is_blank(row.cells[units.index]);
    std::size_t& first = empty ? units.first_empty : units.first_row;
    if (first == 0) first = row.row;
    const auto where = [&](std::size_t at) {
      return fmt::format("row {}, column {} ({})", at, units.index + 1, units.name);
    };
    if (units.first_row != 0 && units.first_empty != 0)
      fail(path_, fmt::format("{}: found nothing, expected a unit, as row {} has one",
                              where(units.first_empty), units.first_row));
    if (empty) return;
    const Cell& cell = row.cells[units.index];
    const Unit* unit = find_unit(plain_name(cell));
    if (unit == nullptr)
      fail(path_, fmt::format("{}: found {}, expected {}; leave the column out where it tells no unit of x "
                              "and y",
                              where(row.row), in_quotes(trimmed(cell.text)), kUnitsExpected));
    for (Column* column : {&x_, &y_}) {
      if (column->has_unit && !units.tells && column->unit_mm != unit->mm)
        fail(path_, fmt::format("{}: found unit {}, expected that of {}", where(row.row),
                                in_quotes(trimmed(cell.text)), result_.unit_place));
    }
    if (!x_.has_unit) units.tells = true;
    say_unit(where(row.row), cell.text);
    for (Column* column : {&x_, &y_}) {
      column->unit_mm = unit->mm;
      column->has_unit = true;
    }
  }

  /// Behind x and y a unit of their own would stand in vain.
  void refuse_nameless_units(const TableRow& row) const {
    for (const std::size_t i : nameless_)
      if (i < row.cells.size() && !row.cells[i].number && find_unit(plain_name(row.cells[i])) != nullptr)
        fail(path_, fmt::format("{}: found {} in a column without a name, expected the name Unit above it",
                                place(row.row, i), in_quotes(trimmed(row.cells[i].text))));
  }

  /// The row below the names may hold their units: mm, [mm], (mm).
  bool take_row_of_units(const TableRow& row) {
    const auto unit_in = [&](const Column& column) -> const Unit* {
      if (column.index >= row.cells.size() || row.cells[column.index].number) return nullptr;
      const std::string text = plain_name(row.cells[column.index]);
      const bool bracketed = text.size() > 2 && (text.front() == '(' || text.front() == '[');
      return find_unit(bracketed ? std::string_view(text).substr(1, text.size() - 2)
                                 : std::string_view(text));
    };
    const Unit *of_x = unit_in(x_), *of_y = unit_in(y_);
    if (of_x == nullptr || of_y == nullptr) return false;
    if (of_x->mm != of_y->mm || (result_.has_unit && of_x->mm != x_.unit_mm))
      fail(path_, fmt::format("row {}: found the units {} and {}, expected one unit for x and y{}", row.row,
                              in_quotes(row.cells[x_.index].text), in_quotes(row.cells[y_.index].text),
                              result_.has_unit ? ", that of " + result_.unit_place : ""));
    for (Column* column : {&x_, &y_}) {
      column->unit_mm = of_x->mm;
      column->has_unit = true;
    }
    say_unit(place(row.row, x_.index), row.cells[x_.index].text);
    return true;
  }

  static std::string place(std::size_t row, std::size_t index) {
    return fmt::format("row {}, column {}", row, index + 1);
  }

  [[noreturn]] void fail_unnamed(const TableRow& row, std::string_view axes) const {
    fail(path_,
         fmt::format("row {}: no column named {}, found {}; expected a header with x and y, or numbers",
                     row.row, axes, names(row)));
  }

  static std::string names(const TableRow& row) {
    constexpr std::size_t kShown = 4;
    std::string out;
    for (std::size_t i = 0; i < std::min(row.cells.size(), kShown); ++i)
      out += (i == 0 ? "" : ", ") + in_quotes(row.cells[i].text);
    return row.cells.size() > kShown ? out + ", ..." : out;
  }

  /// The column called `axis`, alone or with a unit behind a separating sign. Beside it "X Size" and "X
  /// Error" are other columns; without it they may be meant.
  std::optional<Column> find_column(const TableRow& row, char axis) const {
    std::optional<Column> found;
    std::optional<std::pair<std::size_t, std::string>> unknown;  // the first column of no unit, and its words
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      const auto unit = unit_behind_axis(plain_name(row.cells[i]), axis);
      if (!unit) continue;
      const Unit* known = find_unit(*unit);
      if (!unit->empty() && known == nullptr) {
        if (!unknown) unknown.emplace(i, *unit);
        continue;
      }
      if (found)
        fail(path_, fmt::format("row {}, column {}: found a second column named {}, expected one", row.row,
                                i + 1, axis));
      found = Column{i, known == nullptr ? 1.0 : known->mm, known != nullptr};
    }
    if (!found && unknown)
      fail(path_, fmt::format("{}: found unit {} in the name {}, expected {}", place(row.row, unknown->first),
                              in_quotes(unknown->second), in_quotes(row.cells[unknown->first].text),
                              kUnitsExpected));
    return found;
  }

  void take_first_numbers(const TableRow& row) {
    std::vector<std::size_t> numeric;
    for (std::size_t i = 0; i < row.cells.size() && numeric.size() < 2; ++i) {
      if (value_of(row.cells[i]) || length_of(row.cells[i]))
        numeric.push_back(i);
      else if (looks_like_number(row.cells[i]))
        fail_number(row, i, numeric.empty() ? "x" : "y");
    }
    if (numeric.size() < 2) {
      // The first row broke off, or a word stands where y should be.
      for (std::size_t i = numeric.empty() ? 0 : numeric.front() + 1; i < row.cells.size(); ++i)
        if (!is_blank(row.cells[i])) fail_number(row, i, numeric.empty() ? "x" : "y");
      fail_missing(row, row.cells.size(), "y");
    }
    x_.index = numeric[0];
    y_.index = numeric[1];
    sides_.take_nameless(row, x_.index, y_.index);
    take_title_unit(row);
    const bool more = std::any_of(row.cells.begin() + static_cast<std::ptrdiff_t>(numeric[1]) + 1,
                                  row.cells.end(), [](const Cell& cell) { return value_of(cell); });
    if (more || axes_told_)
      result_.notes.push_back(fmt::format("no row names the columns: x is column {} and y column {} of {}",
                                          numeric[0] + 1, numeric[1] + 1, row.cells.size()));
  }

  double number(const TableRow& row, const Column& column, std::string_view axis) {
    if (column.index >= row.cells.size() || is_blank(row.cells[column.index]))
      fail_missing(row, column.index, axis);
    const Cell& cell = row.cells[column.index];
    if (const auto length = length_of(cell)) return length_mm(row, column, *length);
    const auto value = value_of(cell);
    if (!value) fail_number(row, column.index, axis);
    if (!std::isfinite(*value))
      fail(path_, fmt::format("row {}, column {} ({}): found {}, expected a finite number", row.row,
                              column.index + 1, axis, in_quotes(row.cells[column.index].text)));
    if (length_row_ != 0)
      fail(path_,
           fmt::format("row {}, column {} ({}): found {}, expected a unit behind the number, as row {} "
                       "has",
                       row.row, column.index + 1, axis, in_quotes(cell.text), length_row_));
    plain_number_ = true;
    commas_.take(row.row, cell.text);
    points_.take(row.row, cell.text);
    return *value * column.unit_mm;
  }

  /// Units in the cells are those of all cells, and none beside another one in the column's name.
  double length_mm(const TableRow& row, const Column& column, const Length& length) {
    if (!column.has_unit) {
      if (plain_number_)
        fail(path_,
             fmt::format("row {}, column {}: found {}, expected no unit, as the numbers before have none",
                         row.row, column.index + 1, in_quotes(row.cells[column.index].text)));
      if (length_row_ == 0) length_row_ = row.row;
      say_unit(place(row.row, column.index), row.cells[column.index].text);
    } else if (length.unit->mm != column.unit_mm) {
      fail(path_,
           fmt::format("row {}, column {}: found {}, expected the unit of its {}", row.row, column.index + 1,
                       in_quotes(row.cells[column.index].text), units_ && units_->tells ? "row" : "column"));
    }
    return length.value * length.unit->mm;
  }

  [[noreturn]] void fail_number(const TableRow& row, std::size_t index, std::string_view axis) const {
    const std::string_view text = row.cells[index].text;
    fail(path_, fmt::format("row {}, column {} ({}): found {}, expected a number such as 12.5{}", row.row,
                            index + 1, axis, in_quotes(text),
                            text.starts_with('=') ? "; a formula without its value: open the file in a "
                                                    "spreadsheet program and save it there"
                                                  : ""));
  }

  [[noreturn]] void fail_missing(const TableRow& row, std::size_t index, std::string_view axis) const {
    if (!row.ended)
      fail(path_,
           fmt::format("row {}, column {} ({}): the file ends in the middle of the row, expected a number",
                       row.row, index + 1, axis));
    fail(path_,
         fmt::format("row {}, column {} ({}): found nothing, expected a number", row.row, index + 1, axis));
  }

  const std::filesystem::path& path_;
  std::size_t cells_ = 0;
  bool columns_known_ = false;
  Column x_, y_;
  /// Tells the unit of each row, or of none; `tells`: no other place tells it.
  struct UnitColumn {
    std::size_t index = 0;
    std::string name;
    std::size_t first_row = 0, first_empty = 0;
    bool tells = false;
  };

  std::optional<UnitColumn> units_;
  std::vector<std::size_t> nameless_;  // columns behind x and y
  SideColumns sides_;
  SummaryRow summary_;
  DoubtfulRows doubtful_;
  PropertiesAbove properties_;
  ThousandsMarks commas_{','}, points_{'.'};
  bool axes_told_ = false;  // by words above the table
  bool unsigned_rows_ = false;
  std::string commented_out_;        // the first row that may be
  std::size_t ends_within_row_ = 0;  // the last one, if it has no line end
  TableRow title_;                   // the first one
  TitleUnit title_unit_;
  std::size_t row_of_units_ = 0;  // the one below the names
  std::size_t length_row_ = 0;    // the first number with a unit
  bool plain_number_ = false;
  std::size_t hidden_ = 0, first_hidden_ = 0;
  RawPoints result_;
};

RawPoints read_workbook(const std::filesystem::path& path, std::string_view content,
                        std::vector<std::string> (*read_rows)(const std::filesystem::path&, std::string_view,
                                                              const RowHandler&)) {
  PointTable table(path);
  const std::vector<std::string> others = read_rows(path, content, [&](TableRow row) {
    for (Cell& cell : row.cells) cell.text = with_plain_blanks(cell.text);
    table.add(row);
  });
  RawPoints points = std::move(table).take();
  if (!others.empty())
    points.notes.push_back(fmt::format(
        "one sheet alone is read, the first that is shown; {}{} {} cells too, to be saved as a file of {} "
        "own",
        in_quotes(others.front()),
        others.size() == 1 ? "" : fmt::format(" and {}", counted(others.size() - 1, "other sheet")),
        others.size() == 1 ? "has" : "have", others.size() == 1 ? "its" : "their"));
  return points;
}

}  // namespace

RawPoints read_text_table(const std::filesystem::path& path, std::string_view content) {
  PointTable table(path);
  const auto read_rows = is_proteus_file(content) ? read_proteus_rows : read_csv_rows;
  read_rows(path, content, [&](const TableRow& row) { table.add(row); });
  return std::move(table).take();
}

RawPoints read_xls_table(const std::filesystem::path& path, std::string_view content) {
  return read_workbook(path, content, read_xls_rows);
}

RawPoints read_xlsx_table(const std::filesystem::path& path, std::string_view content) {
  return read_workbook(path, content, read_xlsx_rows);
}

}  // namespace meltstage::motion::detail
