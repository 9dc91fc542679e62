// SPDX-License-Identifier: Apache-2.0
// Bump coordinates out of a file: workbook, separated text, KiCad footprint or placement, Gerber layer,
// Excellon drill file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"

namespace meltstage::motion {

/// One bump in the stage's frame, x to the right, y away from the operator.
struct Point {
  double x_mm = 0.0;
  double y_mm = 0.0;
  std::size_t row = 0;  ///< where it came from, counted from 1: sheet row (.xls, .xlsx) or text line
};

/// Where the head may go; the ends belong to the range.
struct Range {
  double min_mm = 0.0;
  double max_mm = 200.0;
};

/// Travel of the stage; the default is the paper's bump-printing platform, 200 mm x 200 mm x 200 mm.
struct Travel {
  Range x, y, z;
};

/// A side of a board.
enum class Side { top, bottom };

/// How numbers of the file become stage positions: mirror, scale by the pitch, rotate, then shift, in this
/// order.
struct CoordinateOptions {
  double pitch_mm =
      1.0;  ///< length of one unit of the file, > 0; for files whose numbers carry no unit of their own
  double origin_x_mm = 0.0;  ///< stage position of the file's (0, 0)
  double origin_y_mm = 0.0;
  double rotation_deg = 0.0;   ///< counter-clockwise about the file's (0, 0)
  bool mirror_x = false;       ///< x becomes -x: a package or a board seen from its other side
  std::optional<Side> side{};  ///< bumps of this side alone; without it a file with bumps on both is refused
  /// Bumps of this tool of a drill file (T1), aperture of a Gerber layer (D10), footprint of a board (U1) or
  /// layer of a drawing alone; empty: all.
  std::string only{};
  Travel travel{};
};

/// A file or an option that can't be used. what() is one line: file, place, value found, what was expected.
class CoordinateError : public UserError {
 public:
  using UserError::UserError;
};

/// More bumps than this in one file are refused.
inline constexpr std::size_t kMaxPoints = 2'000'000;

/// Two bumps that are nearer than this in x and in y, the last digit of the G-code, are the same bump.
inline constexpr double kDuplicateDistance_mm = 1e-4;

/// Bumps of one tool, aperture, footprint or layer.
struct BumpGroup {
  std::string name;
  std::size_t bumps = 0;
};

/// What a file holds. `notes`: a line each on what is in it but is no bump, such as the draws of a Gerber
/// layer, on bumps of the side that isn't wanted, and on bumps of a board's bottom that aren't mirrored.
struct CoordinateFile {
  std::vector<Point> points;
  std::vector<std::string> notes;
  bool has_unit = false;     ///< the file says the unit of its numbers, so that `pitch_mm` means nothing
  std::string unit_place{};  ///< where a table says so: "row 2, column 3 (Unit): mil"; else empty
  bool bottom = false;       ///< the file says that the bumps lie on the bottom of the board
  std::vector<BumpGroup> groups{};  ///< of `points`; none for formats without such
};

/// Reads the bumps of a coordinate file in the order of the file.
///
/// The format follows from the extension (any case) and the content must fit it:
/// - `.xls`, `.xlsx`: first sheet of the workbook, numbers or text that is a number.
/// - `.csv`, `.tsv`, `.txt`, `.mnt`, `.mnb`: UTF-8, UTF-16 with a byte order mark, or Windows-1252 with
///   single letters beyond ASCII; separated by comma, semicolon or tab, or by blanks where none of these
///   occurs; LF or CRLF, quotes as in RFC 4180. `.mnb` lies on the bottom.
/// - `.kicad_mod`, `.kicad_pcb`: position of every `smd` and `thru_hole` pad that has copper, in millimetres,
///   of a footprint or of all footprints of a board. KiCad's y points down, so the sign of y is turned: what
///   lies above in KiCad lies above on the stage.
/// - `.dxf`: drawing in ASCII DXF, one bump a circle or point, blocks written out; the rest is noted.
/// - `.pos`: KiCad's placement file (plain text), one bump a footprint; footprints of one side only unless
///   `side` says which.
/// - `.gbr`, `.ger`, `.grb`, `.gbx`, `.gtp`, `.gbp`, `.gts`, `.gbs`, `.gtl`, `.gbl`, `.art`, `.pho`: Gerber
/// layer (RS-274X, X2), one bump a flash, with step and repeat and aperture
///   blocks; regions and draws are noted, clear flashes and commands that change the whole image are refused.
/// - `.drl`, `.xln`, `.exc`, `.cnc`, `.txt` with a header M48: Excellon drill file, one bump a hole; slots
/// and routing are noted.
/// - `.xml`, `.g85`: wafer map (SEMI G85), one bump a die of a bin that passes; without DeviceSizeX the
/// numbers are steps of the pitch.
///
/// A table may begin with a row that names the columns `x` and `y` in any case, each with or without a unit
/// (`x_mm`, `Y (um)`, `X [mil]`), or `PosX`, `Mid X`, `Center-X` as placement tables do; without such a row
/// the first two numeric columns of the first row are x and y. Rows without any content are skipped.
///
/// @throws UserError if the file is missing, no file or too large; CoordinateError if it is empty, of another
/// kind, ends early, holds no point or more
///   than `kMaxPoints`; if a number is missing, malformed or not finite; if two points coincide or one is out
///   of travel; if an option is out of range, or a pitch is given for a file whose numbers already have a
///   unit.
CoordinateFile read_coordinate_file(const std::filesystem::path& path, const CoordinateOptions& options = {});

/// The points of read_coordinate_file().
std::vector<Point> read_coordinates(const std::filesystem::path& path, const CoordinateOptions& options = {});

}  // namespace meltstage::motion
