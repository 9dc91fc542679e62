// SPDX-License-Identifier: Apache-2.0
// Coordinates out of tables: rows of separated text through libcsv, and what columns and rows mean.
#include <csv.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <utility>

#include "base/file.hpp"
#include "base/place.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

bool is_blank(const Cell& cell) {
  return !cell.number && cell.text.find_first_not_of(" \t\r\n") == std::string::npos;
}

bool begins_like_number(std::string_view text) {
  const auto first = text.find_first_not_of(" \t+-.");
  return first != std::string_view::npos && std::isdigit(static_cast<unsigned char>(text[first])) != 0;
}

// ---- separated text ----

constexpr std::string_view kNameSeparators = " \t_()[]/.,:";

/// Where a column's name goes on behind the axis that it names, alone or as placement tables do: PosX, Mid X,
/// Center-X(mm). Nothing if it names another column.
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

/// The cells of a line, whichever sign separates them, without '#' and quotes around them.
template <class Visit>
void for_loose_cells(std::string_view line, const Visit& visit) {
  for (std::size_t start = 0; start <= line.size();) {
    const std::size_t end = std::min(line.find_first_of(",;\t", start), line.size());
    std::string_view cell = line.substr(start, end - start);
    cell.remove_prefix(std::min(cell.find_first_not_of("#\" "), cell.size()));
    cell = cell.substr(0, cell.find_last_not_of("\" ") + 1);
    visit(cell);
    start = end + 1;
  }
}

/// Of a line that begins with '#': names of columns behind it are a header, "# x_mm, y_mm" or "#,x,y"; all
/// else is a comment.
bool names_columns(std::string_view line) {
  bool x = false, y = false;
  for_loose_cells(line, [&](std::string_view cell) {
    x = x || behind_axis(cell, 'x');
    y = y || behind_axis(cell, 'y');
  });
  return x && y;
}

/// How much of the text is comments, and the blank lines among them, at its begin.
std::size_t leading_comments(std::string_view text) {
  std::size_t behind = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    const std::string_view line = trimmed(text.substr(at, end - at));
    if (!line.empty() && (line.front() != '#' || names_columns(line))) break;
    at = std::min(end + (text.substr(end).starts_with("\r\n") ? 2U : 1U), text.size());
    if (!line.empty()) behind = at;
  }
  return behind;
}

/// How much of the text stands above a line that names the columns and holds no number: a title, or what a
/// layout system says of its board. 0 if there is no such line.
std::size_t leading_titles(std::string_view text) {
  constexpr std::size_t kMostLines = 100;
  for (std::size_t at = 0, lines = 0; at < text.size() && lines < kMostLines; ++lines) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    const std::string_view line = text.substr(at, end - at);
    if (names_columns(line)) return at;
    bool number = false;
    for_loose_cells(line, [&](std::string_view cell) { number = number || begins_like_number(cell); });
    if (number) return 0;
    at = std::min(end + (text.substr(end).starts_with("\r\n") ? 2U : 1U), text.size());
  }
  return 0;
}

/// Tab before semicolon before comma: a decimal comma or a comma in a name must not win over a rarer sign.
char find_separator(std::string_view text) {
  const std::string_view line = text.substr(0, text.find_first_of("\r\n", text.find_first_not_of("\r\n")));
  for (const char separator : {'\t', ';'}) {
    bool inside_quotes = false;
    for (const char c : line) {
      if (c == '"') inside_quotes = !inside_quotes;
      if (c == separator && !inside_quotes) return separator;
    }
  }
  return ',';
}

/// Rows as libcsv reports them; kept until its C frames have returned, as the handler may throw.
struct CsvRows {
  std::vector<TableRow> finished;
  TableRow current;
  std::size_t line = 1;
  std::size_t inner_lines = 0;
  int last_end = 0;
};

void on_csv_field(void* text, std::size_t size, void* rows_pointer) {
  auto& rows = *static_cast<CsvRows*>(rows_pointer);
  std::string field(static_cast<const char*>(text), size);
  rows.inner_lines += static_cast<std::size_t>(std::count(field.begin(), field.end(), '\n'));
  rows.current.cells.push_back({std::move(field), std::nullopt});
}

void on_csv_row(int end, void* rows_pointer) {
  auto& rows = *static_cast<CsvRows*>(rows_pointer);
  const bool second_half_of_crlf = rows.current.cells.empty() && end == '\n' && rows.last_end == '\r';
  rows.last_end = second_half_of_crlf ? 0 : end;
  if (second_half_of_crlf) return;
  rows.current.row = rows.line;
  rows.current.ended = end != -1;
  rows.line += 1 + std::exchange(rows.inner_lines, 0);
  rows.finished.push_back(std::exchange(rows.current, {}));
}

struct CsvParser {
  csv_parser parser{};
  explicit CsvParser(char separator) {
    csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI | CSV_REPALL_NL);
    csv_set_delim(&parser, static_cast<unsigned char>(separator));
  }
  ~CsvParser() { csv_free(&parser); }
  CsvParser(const CsvParser&) = delete;
  CsvParser& operator=(const CsvParser&) = delete;
};

struct Unit {
  std::string_view name;
  double mm;
};
constexpr std::array<Unit, 9> kUnits = {{{"mm", 1.0},
                                         {"um", 1e-3},
                                         {"\u00b5m", 1e-3},
                                         {"\u03bcm", 1e-3},
                                         {"cm", 10.0},
                                         {"m", 1000.0},
                                         {"mil", 0.0254},
                                         {"in", 25.4},
                                         {"inch", 25.4}}};

const Unit* find_unit(std::string_view name) {
  const auto* known =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.name == name; });
  return known == kUnits.end() ? nullptr : known;
}

/// Where columns are not separated by commas, "12,5" is 12.5. One table has commas or points, not both: else
/// "1,234" could be either number.
class DecimalCommas {
 public:
  DecimalCommas(const std::filesystem::path& path, char separator)
      : path_(path), allowed_(separator != ',') {}

  void read(TableRow& row) {
    if (!allowed_) return;
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      std::string& text = row.cells[i].text;
      const auto mark = text.find_first_of(",.");
      if (mark == std::string::npos || !is_digits_around(text, mark)) continue;
      std::string& seen = text[mark] == ',' ? with_comma_ : with_point_;
      if (seen.empty()) seen = fmt::format("{} in row {}", in_quotes(text), row.row);
      if (!with_comma_.empty() && !with_point_.empty())
        fail(path_, fmt::format("row {}, column {}: found {} and {}, expected one decimal mark in a table",
                                row.row, i + 1, with_comma_, with_point_));
      if (text[mark] != ',') continue;
      std::string pointed = text;
      pointed[mark] = '.';
      row.cells[i].number = parse_number(pointed);
      if (!row.cells[i].number) text = pointed;  // with a unit
    }
  }

 private:
  /// An optional sign, digits, the mark, digits, and perhaps a unit.
  static bool is_digits_around(std::string_view text, std::size_t mark) {
    const auto first = text.find_first_not_of(" \t+-");
    const auto last = text.find_last_of("0123456789");
    if (first >= mark || last == std::string_view::npos || last <= mark) return false;
    const std::string_view rest = trimmed(text.substr(last + 1));
    if (!rest.empty() && find_unit(rest) == nullptr) return false;
    for (std::size_t i = first; i <= last; ++i)
      if (i != mark && std::isdigit(static_cast<unsigned char>(text[i])) == 0) return false;
    return true;
  }

  const std::filesystem::path& path_;
  bool allowed_;
  std::string with_comma_, with_point_;  // the first of each
};

/// The first row of more than a title tells how many cells a row has. One of more was separated where no cell
/// ends: its numbers would be others than those meant.
class RowWidth {
 public:
  RowWidth(const std::filesystem::path& path, char separator) : path_(path), separator_(separator) {}

  void check(const TableRow& row) {
    const auto last = std::find_if_not(row.cells.rbegin(), row.cells.rend(), is_blank);
    if (last == row.cells.rend()) return;
    const auto used = static_cast<std::size_t>(row.cells.rend() - last);
    if (first_row_ == 0 && used > 1) {
      first_row_ = row.row;
      most_ = row.cells.size();
    }
    if (first_row_ == 0 || used <= most_) return;
    const std::string_view advice = separator_ == ','
                                        ? "where a comma is the decimal mark, separate the cells by ';'"
                                        : "quote a cell that holds the separator";
    fail(path_, fmt::format("row {}: found {} cells, expected at most {}, as row {} has; {}", row.row, used,
                            most_, first_row_, advice));
  }

 private:
  const std::filesystem::path& path_;
  char separator_;
  std::size_t first_row_ = 0, most_ = 0;
};

void hand_over(const std::filesystem::path& path, CsvRows& rows, RowWidth& width, DecimalCommas& decimals,
               const RowHandler& handle) {
  const auto check_width = [&](const TableRow& row, std::size_t line) {
    if (row.cells.size() > kMostColumns)
      fail(path,
           fmt::format("row {}: found more than {} columns, expected at most so many", line, kMostColumns));
  };
  for (TableRow& row : rows.finished) {
    check_width(row, row.row);
    width.check(row);
    decimals.read(row);
    handle(row);
  }
  rows.finished.clear();
  check_width(rows.current, rows.line);
}

// ---- columns and rows ----

/// "10.5mm" or "1000 mil": the number and its unit. Nothing if it isn't both.
struct Length {
  double value = 0.0;
  const Unit* unit = nullptr;
};
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

/// In small letters, without the '#' that some write before their header.
std::string plain(const Cell& cell) {
  std::string text(trimmed(cell.text));
  if (text.starts_with('#')) text = trimmed(std::string_view(text).substr(1));
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// Whether one of the words of a column's name is what `is_meant` looks for.
template <class IsMeant>
bool names_by_word(const Cell& cell, const IsMeant& is_meant) {
  std::string word;
  for (const char c : plain(cell) + ' ') {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += c;
      continue;
    }
    if (is_meant(word)) return true;
    word.clear();
  }
  return false;
}

/// Side, Board Side, BoardSide, Layer, layer_name, T/B, TB, Seite.
bool names_column_of_sides(const Cell& cell) {
  constexpr std::array<std::string_view, 10> kWords = {
      "side",          "layer",     "tb",        "boardside",  "pcbside",
      "placementside", "mountside", "layername", "boardlayer", "seite"};
  const std::string name = plain(cell);
  if (name == "t/b" || name == "t_b" || name == "t-b") return true;
  return names_by_word(cell, [&](std::string_view word) {
    return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
  });
}

/// Mirror, Mirrored, SYM_MIRROR.
bool names_column_of_mirrors(const Cell& cell) {
  return names_by_word(cell, [](std::string_view word) { return word.starts_with("mirror"); });
}

/// The side that a cell of a column Mirror means, whose rows are on the bottom where they are mirrored.
std::optional<Side> side_by_mirror(const Cell& cell) {
  const std::string text = plain(cell);
  const auto is_one_of = [&](std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), text) != words.end();
  };
  if (is_one_of({"1", "yes", "y", "true", "m", "mirror", "mirrored", "ja", "j"})) return Side::bottom;
  if (is_one_of({"0", "no", "n", "false", "none", "nein", "not mirrored"})) return Side::top;
  return side_named(text);
}

class PointTable {
 public:
  explicit PointTable(const std::filesystem::path& path) : path_(path) {}

  void add(const TableRow& row) {
    count_cells(row);
    if (std::all_of(row.cells.begin(), row.cells.end(), is_blank)) return;
    if (!columns_known_) {
      if (is_title(row)) return;
      columns_known_ = true;
      if (take_header(row)) return;
      take_first_numbers(row);
    }
    const double x = number(row, x_, "x");
    const double y = number(row, y_, "y");
    for (SideColumn& column : side_columns_) column.check(path_, row);
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
    require_one_side();
    result_.bottom = std::any_of(side_columns_.begin(), side_columns_.end(),
                                 [](const SideColumn& column) { return column.sides.is_bottom(); });
    return std::move(result_);
  }

 private:
  /// A column that tells the side of the board, by name or by a mark for those that are mirrored.
  struct SideColumn {
    std::size_t index;
    bool mirrors;
    std::string name;
    OneSide sides;
    std::size_t first_row = 0, first_empty = 0;

    void check(const std::filesystem::path& path, const TableRow& row) {
      const bool empty = index >= row.cells.size() || is_blank(row.cells[index]);
      std::size_t& first = empty ? first_empty : first_row;
      if (first == 0) first = row.row;
      if (first_row != 0 && first_empty != 0)
        fail(path, fmt::format("row {}, column {} ({}): found nothing, expected {}, as row {} has one",
                               first_empty, index + 1, name, expected(), first_row));
      if (empty) return;
      const Cell& cell = row.cells[index];
      const auto side = mirrors ? side_by_mirror(cell) : side_named(cell.text);
      if (!side)
        fail(path, fmt::format("row {}, column {} ({}): found {}, expected {}; leave the column out where it "
                               "tells no side of a board",
                               row.row, index + 1, name, in_quotes(trimmed(cell.text)), expected()));
      sides.check(path, fmt::format("row {}", row.row), *side,
                  mirrors ? (*side == Side::top ? "top" : "bottom") : std::string_view(cell.text));
    }

    std::string_view expected() const {
      return mirrors ? "yes or no" : "top or bottom, such as TopLayer, F.Cu or Component Side";
    }
  };

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
      x_ = *x;
      y_ = *y;
      for (std::size_t i = 0; i < row.cells.size(); ++i) {
        const bool mirrors = names_column_of_mirrors(row.cells[i]);
        if (mirrors || names_column_of_sides(row.cells[i]))
          side_columns_.push_back({i, mirrors, shown(trimmed(row.cells[i].text)), {}});
      }
      take_title_unit(row);
      result_.has_unit = x_.has_unit;
      return true;
    }
    if (x || y) fail_unnamed(row, x ? "y" : "x");
    if (title_.row != 0) fail_unnamed(title_, "x and y");
    return false;
  }

  /// Words above the names of the columns. Numbers behind them would have no name.
  bool is_title(const TableRow& row) {
    const bool any_number = std::any_of(row.cells.begin(), row.cells.end(),
                                        [](const Cell& c) { return value_of(c) || looks_like_number(c); });
    if (any_number || find_column(row, 'x') || find_column(row, 'y')) return false;
    if (title_.row == 0) title_ = row;
    for (std::size_t i = 0; i < row.cells.size(); ++i) read_title_unit(row, i);
    return true;
  }

  /// Two columns may both tell the side; they must tell the same one.
  void require_one_side() const {
    const SideColumn* first = nullptr;
    for (const SideColumn& column : side_columns_) {
      if (column.first_row == 0) continue;  // empty
      if (first == nullptr) first = &column;
      if (column.sides.is_bottom() == first->sides.is_bottom()) continue;
      fail(path_, fmt::format("row {}, column {} ({}): found {}, expected {}, as column {} ({}) tells",
                              column.first_row, column.index + 1, column.name,
                              column.sides.is_bottom() ? "bottom" : "top",
                              first->sides.is_bottom() ? "bottom" : "top", first->index + 1, first->name));
    }
  }

  /// "Units used: mil" of Altium Designer, or "Units: mil", in one cell or in two. A .csv hands over its
  /// whole line.
  void read_title_unit(const TableRow& row, std::size_t i) {
    constexpr std::string_view kKeys[] = {"units used:", "units:", "unit:"}, kAround = " \t\",;";
    const auto bare = [&](const Cell& cell) {
      const std::string text = plain(cell);
      const auto first = std::min(text.find_first_not_of(kAround), text.size());
      return text.substr(first, text.find_last_not_of(kAround) + 1 - first);
    };
    const std::string text = bare(row.cells[i]);
    const auto key = std::find_if(std::begin(kKeys), std::end(kKeys),
                                  [&](std::string_view k) { return text.starts_with(k); });
    if (key == std::end(kKeys)) return;
    std::string_view name = trimmed(std::string_view(text).substr(key->size()));
    name.remove_prefix(std::min(name.find_first_not_of(kAround), name.size()));
    const std::string next = i + 1 < row.cells.size() ? bare(row.cells[i + 1]) : "";
    if (name.empty()) name = next;
    const Unit* unit = find_unit(name);
    if (unit == nullptr)
      fail(path_, fmt::format("row {}, column {}: found unit {} above the columns, expected mm, um, cm, m, "
                              "mil or in",
                              row.row, i + 1, in_quotes(name)));
    if (title_unit_ != nullptr && unit->mm != title_unit_->mm)
      fail(path_,
           fmt::format("row {}, column {}: found unit {} above the columns, expected {}, as row {} has",
                       row.row, i + 1, in_quotes(name), title_unit_->name, title_unit_row_));
    title_unit_ = unit;
    title_unit_row_ = row.row;
  }

  /// What stands above the table holds for columns without a unit of their own; another one beside it would
  /// make the scale a guess.
  void take_title_unit(const TableRow& header) {
    if (title_unit_ == nullptr) return;
    for (Column* column : {&x_, &y_}) {
      if (column->has_unit && column->unit_mm != title_unit_->mm)
        fail(path_, fmt::format("row {}, column {}: found the unit in {}, expected {}, as row "
                                "{} says",
                                header.row, column->index + 1, in_quotes(header.cells[column->index].text),
                                title_unit_->name, title_unit_row_));
      column->unit_mm = title_unit_->mm;
      column->has_unit = true;
    }
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

  /// The column called `axis`, alone or with a unit behind a separating sign.
  std::optional<Column> find_column(const TableRow& row, char axis) const {
    std::optional<Column> found;
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      const std::string name = plain(row.cells[i]);
      const auto behind = behind_axis(name, axis);
      if (!behind) continue;
      const auto unit_start = name.find_first_not_of(kNameSeparators, *behind);
      Column column{i, 1.0, unit_start != std::string::npos};
      if (column.has_unit) {
        const std::string unit =
            name.substr(unit_start, name.find_last_not_of(kNameSeparators) - unit_start + 1);
        const Unit* known = find_unit(unit);
        if (known == nullptr)
          fail(path_,
               fmt::format(
                   "row {}, column {}: found unit {} in the name {}, expected mm, um, cm, m, mil or in",
                   row.row, i + 1, in_quotes(unit), in_quotes(row.cells[i].text)));
        column.unit_mm = known->mm;
      }
      if (found)
        fail(path_, fmt::format("row {}, column {}: found a second column named {}, expected one", row.row,
                                i + 1, axis));
      found = column;
    }
    return found;
  }

  void take_first_numbers(const TableRow& row) {
    std::vector<std::size_t> numeric;
    for (std::size_t i = 0; i < row.cells.size() && numeric.size() < 2; ++i) {
      if (value_of(row.cells[i]))
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
    const bool more = std::any_of(row.cells.begin() + static_cast<std::ptrdiff_t>(numeric[1]) + 1,
                                  row.cells.end(), [](const Cell& cell) { return value_of(cell); });
    if (more)
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
      result_.has_unit = true;
    } else if (length.unit->mm != column.unit_mm) {
      fail(path_, fmt::format("row {}, column {}: found {}, expected the unit that stands above the column",
                              row.row, column.index + 1, in_quotes(row.cells[column.index].text)));
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
  std::vector<SideColumn> side_columns_;
  TableRow title_;  // the first one
  const Unit* title_unit_ = nullptr;
  std::size_t title_unit_row_ = 0;
  std::size_t length_row_ = 0;  // the first number with a unit
  bool plain_number_ = false;
  std::size_t hidden_ = 0, first_hidden_ = 0;
  RawPoints result_;
};

}  // namespace

void read_csv_rows(const std::filesystem::path& path, std::string_view content, const RowHandler& handle) {
  if (const auto kind = describe_content(content); kind != "text")
    fail(path, fmt::format("found {}, expected separated text (.csv, UTF-8)", kind));
  content = without_byte_order_mark(content);

  const std::size_t comments = leading_comments(content);
  CsvRows rows;
  for_lines(content.substr(0, comments), [&](const Line&) { ++rows.line; });
  content.remove_prefix(comments);
  const std::size_t titles = leading_titles(content);
  for_lines(content.substr(0, titles), [&](const Line& line) {
    handle({rows.line++, {{std::string(line.text), std::nullopt}}, true, false});
  });
  content.remove_prefix(titles);

  const char separator = find_separator(content);
  CsvParser csv(separator);
  RowWidth width(path, separator);
  DecimalCommas decimals(path, separator);
  constexpr std::size_t kChunk = 65536;
  while (!content.empty()) {
    const std::string_view part = content.substr(0, kChunk);
    if (csv_parse(&csv.parser, part.data(), part.size(), on_csv_field, on_csv_row, &rows) != part.size()) {
      hand_over(path, rows, width, decimals, handle);
      fail(path, fmt::format(
                     "row {}, column {}: found a quote inside a cell, expected it doubled or the cell quoted",
                     rows.line, rows.current.cells.size() + 1));
    }
    content.remove_prefix(part.size());
    hand_over(path, rows, width, decimals, handle);
  }
  if (csv_fini(&csv.parser, on_csv_field, on_csv_row, &rows) != 0)
    fail(path,
         fmt::format("row {}, column {}: the file ends inside a quoted cell, expected the closing quote",
                     rows.line, rows.current.cells.size() + 1));
  hand_over(path, rows, width, decimals, handle);
}

RawPoints read_table_points(const std::filesystem::path& path, std::string_view content,
                            void (*read_rows)(const std::filesystem::path&, std::string_view,
                                              const RowHandler&)) {
  PointTable table(path);
  read_rows(path, content, [&](const TableRow& row) { table.add(row); });
  return std::move(table).take();
}

}  // namespace meltstage::motion::detail
