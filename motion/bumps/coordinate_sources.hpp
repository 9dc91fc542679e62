// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: the readers behind read_coordinates(), one a format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "motion/bumps/coordinates.hpp"

namespace meltstage::motion::detail {

inline constexpr double kInch_mm = 25.4;

/// Throws the CoordinateError "PATH: WHAT".
[[noreturn]] void fail(const std::filesystem::path& path, std::string_view what);

/// A coordinate pair as the file has it, before pitch, rotation and origin. `side`: the one that the file
/// says it lies on; none for a hole, and where the file tells none. `group`: its key in RawPoints::groups.
struct RawPoint {
  double x = 0.0;
  double y = 0.0;
  std::size_t row = 0;
  std::optional<Side> side = std::nullopt;
  std::uint32_t group = 0;
};

/// What a file held. `has_unit`: the numbers are millimetres already, so a pitch makes no sense;
/// `unit_place`: where a table says so, and what. `side_place`: the column whose words alone tell the sides.
/// `groups`: the names of the tools, apertures, footprints or layers that its bumps belong to, where the
/// format has such. `notes`: what it holds besides that is no bump.
struct RawPoints {
  std::vector<RawPoint> points;
  bool has_unit = false;
  std::string unit_place{};
  std::string side_place{};
  std::map<std::uint32_t, std::string> groups{};
  std::vector<std::string> notes;
};

/// A table cell: text as it stands in the file; `number` is set when the format itself says that it is one.
struct Cell {
  std::string text;
  std::optional<double> number;
  bool sums_up = false;  ///< a formula of a spreadsheet over several cells, such as SUM
};

/// One row of a table; `ended` is false for a last row of a text file that lacks its line end, `hidden` true
/// for one that its spreadsheet doesn't show; `comment`: a line at the head of a text file that begins with
/// '#'.
struct TableRow {
  std::size_t row = 0;
  std::vector<Cell> cells;
  bool ended = true;
  bool hidden = false;
  bool comment = false;
  bool parted_by_blanks = false;
};

using RowHandler = std::function<void(const TableRow&)>;

void read_csv_rows(const std::filesystem::path& path, std::string_view content, const RowHandler& handle);
/// A placement file of Proteus, whose title tells it; its rows with a row of names above them.
bool is_proteus_file(std::string_view content);
void read_proteus_rows(const std::filesystem::path& path, std::string_view content, const RowHandler& handle);
/// Rows of a workbook's first sheet; the names of other sheets that hold cells.
std::vector<std::string> read_xls_rows(const std::filesystem::path& path, std::string_view content,
                                       const RowHandler& handle);
std::vector<std::string> read_xlsx_rows(const std::filesystem::path& path, std::string_view content,
                                        const RowHandler& handle);
RawPoints read_text_table(const std::filesystem::path& path, std::string_view content);
RawPoints read_xls_table(const std::filesystem::path& path, std::string_view content);
RawPoints read_xlsx_table(const std::filesystem::path& path, std::string_view content);
RawPoints read_kicad_points(const std::filesystem::path& path, std::string_view content);
RawPoints read_kicad_board(const std::filesystem::path& path, std::string_view content);
RawPoints read_dxf_points(const std::filesystem::path& path, std::string_view content);
RawPoints read_pos_points(const std::filesystem::path& path, std::string_view content);
RawPoints read_gerber_points(const std::filesystem::path& path, std::string_view content);
RawPoints read_excellon_points(const std::filesystem::path& path, std::string_view content);
RawPoints read_ipc356_points(const std::filesystem::path& path, std::string_view content);
RawPoints read_wafer_map(const std::filesystem::path& path, std::string_view content);

/// A whole cell as a number, "." as decimal point whatever the locale; nothing if it isn't one. May be NaN or
/// infinite.
std::optional<double> parse_number(std::string_view text);

/// Text of a file made fit for a one-line message: shown() in quotes.
std::string in_quotes(std::string_view text);

/// With the letters of Latin-1, in UTF-8.
std::string in_small_letters(std::string_view text);

/// Counter-clockwise about (0, 0). Quarter turns are exact, so that a turned lattice stays a lattice.
RawPoint turned(const RawPoint& point, double angle_deg);

/// "2 draws, first in row 7, hold no bump".
std::string no_bump_note(std::size_t count, std::string_view thing, std::size_t first_row);

/// Pads that the file itself says are for something else than a bump: "2 pads, the first in row 7, are
/// fiducials by the file's own word and make bumps all the same".
struct OtherPads {
  std::string_view thing, things;  ///< pad, pads
  std::string_view one, many;      ///< a fiducial, fiducials
  std::size_t count = 0, first_row = 0;

  void add(std::size_t row) {
    if (count++ == 0) first_row = row;
  }
  void tell(RawPoints& points) const;
};

/// The side that a word of layout systems names, in any case: top, Bottom Layer, F.Cu, B.Paste, Component
/// Side, Primary, Unten, T ... Nothing for any other word.
std::optional<Side> side_named(std::string_view word);

/// The same without words that may as well mean something else: T, Component, Primary, Upper ...
std::optional<Side> side_unmistakably_named(std::string_view word);

/// "top" or "bottom".
std::string_view name_of(Side side);

/// Says of each bump without a side that it lies on this one.
void lie_on(std::vector<RawPoint>& points, Side side);

/// Throws the CoordinateError for too many points once `count` is beyond kMaxPoints.
void check_point_count(const std::filesystem::path& path, std::size_t count);

}  // namespace meltstage::motion::detail
