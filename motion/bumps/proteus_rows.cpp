// SPDX-License-Identifier: Apache-2.0
// Rows of a placement file of Labcenter Proteus (.pkp). Its columns have no names: below a title and remarks
// each row has Part ID, Value, Package, perhaps a stock code, Layer, Rotation, X and Y.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "motion/bumps/column_names.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

constexpr std::string_view kExpected =
    "Part ID, Value, Package, Layer, Rotation, X and Y of a placement file of Proteus, perhaps with a stock "
    "code before the layer";

TableRow row_of(std::size_t number, const std::vector<std::string>& texts) {
  TableRow row{.row = number, .cells = {}};
  for (const std::string& text : texts) row.cells.push_back({text, std::nullopt});
  return row;
}

bool names(const TableRow& row, char axis) {
  return std::any_of(row.cells.begin(), row.cells.end(), [&](const Cell& cell) {
    const auto unit = unit_behind_axis(plain_name(cell), axis);
    return unit && (unit->empty() || find_unit(*unit) != nullptr);
  });
}

bool names_both(const TableRow& row) { return names(row, 'x') && names(row, 'y'); }

/// What stands above the first bump.
struct Head {
  std::size_t first_row = 0;  ///< of the bumps; 0: none begins with a quote
  TableRow names;             ///< "Fields: Part ID, Value, Package, Layer, Rotation, X, Y"
  TableRow unit;              ///< "Units: Rotation - degrees, X, Y - thou"
};

Head head_of(std::string_view content) {
  Head head;
  for_lines(content, [&](const Line& line) {
    const std::string_view text = trimmed(line.text);
    if (head.first_row != 0) return;
    if (text.starts_with('"')) {
      head.first_row = line.number;
      return;
    }
    if (in_small_letters(text).starts_with("unit"))
      head.unit =
          row_of(line.number, {fmt::format("Units: {}", text.substr(text.find_last_of(" \t:-") + 1))});
    std::vector<std::string> cells;
    for (std::size_t at = 0; at <= text.size();) {
      const std::size_t end = std::min(text.find(',', at), text.size());
      cells.emplace_back(trimmed(text.substr(at, end - at)));
      at = end + 1;
    }
    if (TableRow row = row_of(line.number, cells); names_both(row)) head.names = std::move(row);
  });
  return head;
}

/// The names of the columns, by what stands above the first bump or by the place of its side.
TableRow names_for(const std::filesystem::path& path, const TableRow& bump, const Head& head) {
  const std::size_t cells = bump.cells.size();
  if (head.names.cells.size() == cells) return head.names;
  constexpr std::array<std::string_view, 8> kNames = {"Part ID", "Value",    "Package", "Stock code",
                                                      "Layer",   "Rotation", "X",       "Y"};
  constexpr std::size_t kBehindPackage = 3, kFromLayer = 4;
  const bool has_code = cells == kNames.size(), fits = has_code || cells + 1 == kNames.size();
  if (!head.names.cells.empty() || !fits || !side_named(bump.cells[cells - kFromLayer].text)) {
    std::string found;
    for (std::size_t i = 0; i < std::min(cells, kFromLayer); ++i)
      found += (i == 0 ? "" : ", ") + in_quotes(bump.cells[i].text);
    fail(path, fmt::format("row {}: found {}{}, expected {}", bump.row, found,
                           cells > kFromLayer ? ", ..." : "", kExpected));
  }
  std::vector<std::string> texts(kNames.begin(), kNames.end());
  if (!has_code) texts.erase(texts.begin() + kBehindPackage);
  return row_of(bump.row - 1, texts);
}

}  // namespace

bool is_proteus_file(std::string_view content) {
  const std::string_view text = trimmed(without_byte_order_mark(content).substr(0, 100));
  return in_small_letters(text).starts_with("labcenter proteus pick and place file");
}

void read_proteus_rows(const std::filesystem::path& path, std::string_view content,
                       const RowHandler& handle) {
  const Head head = head_of(content);
  if (head.first_row == 0)
    fail(path, fmt::format("found no row that begins with a quote, expected {}", kExpected));
  // Remarks may hold any number of commas; without them rows keep their numbers.
  std::string bumps(head.first_row - 1, '\n');
  for_lines(content, [&](const Line& line) {
    if (line.number == head.first_row) bumps += content.substr(line.text.data() - content.data());
  });
  if (!head.unit.cells.empty()) handle(head.unit);
  bool named = false;
  read_csv_rows(path, bumps, [&](const TableRow& row) {
    if (!named && std::all_of(row.cells.begin(), row.cells.end(), is_blank)) return;
    if (!named && !names_both(row)) handle(names_for(path, row, head));
    named = true;
    handle(row);
  });
}

}  // namespace meltstage::motion::detail
