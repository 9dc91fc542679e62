// SPDX-License-Identifier: Apache-2.0
// Rows of separated text (.csv), through libcsv.
#include <csv.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "base/file.hpp"
#include "motion/bumps/column_names.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_encoding.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

constexpr std::string_view kSeparatingSigns = ",;\t", kBlank = " ";

/// What may separate the cells of a text: blanks where no sign does. "Cap, ceramic" in quotes separates none.
std::string_view possible_separators(std::string_view text) {
  bool inside_quotes = false;
  for (const char c : text) {
    if (c == '"') inside_quotes = !inside_quotes;
    if (c == '\n' || c == '\r') inside_quotes = false;
    if (!inside_quotes && kSeparatingSigns.find(c) != std::string_view::npos) return kSeparatingSigns;
  }
  return kBlank;
}

/// The cells of a line, whichever of the separators stands between them, without '#' and quotes around them.
template <class Visit>
void for_loose_cells(std::string_view line, std::string_view separators, const Visit& visit) {
  for (std::size_t start = 0; start <= line.size();) {
    const std::size_t end = std::min(line.find_first_of(separators, start), line.size());
    std::string_view cell = line.substr(start, end - start);
    cell.remove_prefix(std::min(cell.find_first_not_of("#\" "), cell.size()));
    cell = cell.substr(0, cell.find_last_not_of("\" ") + 1);
    visit(cell);
    start = end + 1;
  }
}

/// Of a line that begins with '#': names of columns behind it are a header, "# x_mm, y_mm" or "#,x,y"; all
/// else is a comment.
bool names_columns(std::string_view line, std::string_view separators) {
  bool x = false, y = false;
  const auto names = [](std::string_view cell, char axis) {
    const auto unit = unit_behind_axis(cell, axis);
    return unit && (unit->empty() || unit->find(' ') == std::string::npos);
  };
  for_loose_cells(line, separators, [&](std::string_view cell) {
    x = x || names(cell, 'x');
    y = y || names(cell, 'y');
  });
  return x && y;
}

/// How much of the text is comments, and the blank lines among them, at its begin.
std::size_t leading_comments(std::string_view text, std::string_view separators) {
  std::size_t behind = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    const std::string_view line = trimmed(text.substr(at, end - at));
    if (!line.empty() && (line.front() != '#' || names_columns(line, separators))) break;
    at = std::min(end + (text.substr(end).starts_with("\r\n") ? 2U : 1U), text.size());
    if (!line.empty()) behind = at;
  }
  return behind;
}

/// How much of the text stands above a line that names the columns and holds no number: a title, or what a
/// layout system says of its board. 0 if there is no such line.
std::size_t leading_titles(std::string_view text, std::string_view separators) {
  constexpr std::size_t kMostLines = 100;
  constexpr unsigned kMostNumbers = 1;  // "Date;2024-01-02"; a row of a table has two
  for (std::size_t at = 0, lines = 0; at < text.size() && lines < kMostLines; ++lines) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    const std::string_view line = text.substr(at, end - at);
    if (names_columns(line, separators)) return at;
    unsigned numbers = 0;
    for_loose_cells(line, separators,
                    [&](std::string_view cell) { numbers += begins_like_number(cell) ? 1 : 0; });
    if (numbers > kMostNumbers) return 0;
    at = std::min(end + (text.substr(end).starts_with("\r\n") ? 2U : 1U), text.size());
  }
  return 0;
}

/// Of the first line, with its end.
std::size_t line_length(std::string_view text) {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  return std::min(end + (text.substr(end).starts_with("\r\n") ? 2U : 1U), text.size());
}

/// A line below names that begin with '#', which begins so, too, and holds no number.
bool is_remark(std::string_view text, std::string_view separators) {
  if (!text.starts_with('#')) return false;
  bool number = false;
  for_loose_cells(text.substr(0, text.find_first_of("\r\n")), separators,
                  [&](std::string_view cell) { number = number || begins_like_number(cell); });
  return !number;
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

/// With one blank for each run of them, and none at the ends of a line. Quoted cells stay as they are.
std::string with_single_blanks(std::string_view text) {
  std::string out;
  bool inside_quotes = false, pending = false;
  for (const char c : text) {
    if (c == '"') inside_quotes = !inside_quotes;
    const bool ends_line = c == '\n' || c == '\r';
    if (c == ' ' && !inside_quotes) {
      pending = !out.empty() && out.back() != '\n' && out.back() != '\r';
      continue;
    }
    if (pending && !ends_line) out += ' ';
    pending = false;
    out += c;
  }
  return out;
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
/// ends: its numbers would be others than those meant. Where blanks separate, so would be those of one with
/// less.
class RowWidth {
 public:
  RowWidth(const std::filesystem::path& path, char separator) : path_(path), separator_(separator) {}

  char separator() const { return separator_; }

  void check(const TableRow& row) {
    const auto last = std::find_if_not(row.cells.rbegin(), row.cells.rend(), is_blank);
    if (last == row.cells.rend()) return;
    const auto used = static_cast<std::size_t>(row.cells.rend() - last);
    if (first_row_ == 0 && used > 1) {
      first_row_ = row.row;
      most_ = row.cells.size();
    }
    if (first_row_ == 0) return;
    if (separator_ == ' ' && row.cells.size() < most_)
      fail(path_,
           fmt::format(
               "row {}: found {} cells, expected {}, as row {} has; where blanks separate, no cell can "
               "be empty: quote it; a remark begins with '#'",
               row.row, row.cells.size(), most_, first_row_));
    const std::size_t found = splits_numbers(row) ? row.cells.size() : used;
    if (found <= most_) return;
    const std::string_view advice =
        separator_ == ','
            ? "where a comma is the decimal mark, separate the cells by ';'; lines above the table begin "
              "with '#', and each row has as many commas"
            : "quote a cell that holds the separator";
    fail(path_, fmt::format("row {}: found {} cells, expected at most {}, as row {} has; {}", row.row, found,
                            most_, first_row_, advice));
  }

 private:
  /// An empty cell or two more than the first row has, where no number has a point: "1,5,," may be 1.5.
  bool splits_numbers(const TableRow& row) const {
    if (separator_ != ',' || row.cells.size() <= most_ || row.cells.size() > most_ + 2) return false;
    return std::none_of(row.cells.begin(), row.cells.end(), [](const Cell& cell) {
      return begins_like_number(cell.text) && cell.text.find('.') != std::string::npos;
    });
  }

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
    for (Cell& cell : row.cells) cell.text = with_plain_blanks(cell.text);
    row.parted_by_blanks = width.separator() == ' ';
    width.check(row);
    decimals.read(row);
    handle(row);
  }
  rows.finished.clear();
  check_width(rows.current, rows.line);
}

}  // namespace

void read_csv_rows(const std::filesystem::path& path, std::string_view content, const RowHandler& handle) {
  const auto require_text = [&](std::string_view kind) {
    if (kind != "text") fail(path, fmt::format("found {}, expected separated text (.csv)", kind));
  };
  if (const std::string_view kind = describe_content(content); kind != "UTF-16 text") require_text(kind);
  const std::optional<std::string> utf8 = converted_to_utf8(path, content);
  if (utf8) content = *utf8;
  require_text(describe_content(content));
  content = without_byte_order_mark(content);
  if (content.ends_with('\x1A')) content.remove_suffix(1);  // the end of a file of DOS

  const std::string_view separators = possible_separators(content);
  const std::size_t comments = leading_comments(content, separators);
  CsvRows rows;
  for_lines(content.substr(0, comments), [&](const Line& line) {
    if (!trimmed(line.text).empty())
      handle({rows.line, {{with_plain_blanks(line.text), std::nullopt}}, true, false, true});
    ++rows.line;
  });
  content.remove_prefix(comments);
  const std::size_t titles = leading_titles(content, separators);
  for_lines(content.substr(0, titles), [&](const Line& line) {
    handle({rows.line++, {{with_plain_blanks(line.text), std::nullopt}}, true, false, false});
  });
  content.remove_prefix(titles);

  const char separator = separators == kBlank ? ' ' : find_separator(content);
  // "# x_mm y_mm": the sign is no cell.
  if (separator == ' ' && content.starts_with('#')) content.remove_prefix(1);
  const std::string blanks = separator == ' ' ? with_single_blanks(content) : "";
  if (separator == ' ') content = blanks;
  CsvParser csv(separator);
  RowWidth width(path, separator);
  DecimalCommas decimals(path, separator);
  const auto parse = [&](std::string_view text) {
    constexpr std::size_t kChunk = 65536;
    for (; !text.empty(); text.remove_prefix(std::min(kChunk, text.size()))) {
      const std::string_view part = text.substr(0, kChunk);
      if (csv_parse(&csv.parser, part.data(), part.size(), on_csv_field, on_csv_row, &rows) != part.size()) {
        hand_over(path, rows, width, decimals, handle);
        fail(path,
             fmt::format("row {}, column {}: found a quote inside a cell, expected it doubled or the cell "
                         "quoted",
                         rows.line, rows.current.cells.size() + 1));
      }
      hand_over(path, rows, width, decimals, handle);
    }
  };
  if (content.starts_with('#')) {
    const std::size_t names = line_length(content);
    parse(content.substr(0, names));
    content.remove_prefix(names);
    for (; is_remark(content, separators); content.remove_prefix(line_length(content))) {
      const std::string_view line = content.substr(0, content.find_first_of("\r\n"));
      handle({rows.line++, {{with_plain_blanks(line), std::nullopt}}, true, false, true});
    }
  }
  parse(content);
  if (csv_fini(&csv.parser, on_csv_field, on_csv_row, &rows) != 0)
    fail(path,
         fmt::format("row {}, column {}: the file ends inside a quoted cell, expected the closing quote",
                     rows.line, rows.current.cells.size() + 1));
  hand_over(path, rows, width, decimals, handle);
}

}  // namespace meltstage::motion::detail
