// SPDX-License-Identifier: Apache-2.0
// Cutter-location points: the lines that a CAM system laid on the model of a surface, out of its tool path.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "motion/bumps/coordinates.hpp"

namespace meltstage::motion {

/// One point of the tool path in the workpiece's frame.
struct ClPoint {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< from the surface towards the tool, length 1
  std::size_t row = 0;                              ///< line of the file, from 1
};

/// A line to be printed without interruption, two points at least, neighbours distinct.
struct ClLine {
  std::string name;
  std::vector<ClPoint> points;
  /// The file has no tool axes: between the points too, the axis is square_to() the line, and where two faces
  /// meet it lies halfway between them at the point alone.
  bool axes_by_line = false;
};

/// The upright axis made square to a way.
Eigen::Vector3d square_to(const Eigen::Vector3d& way);

/// A file and an argument of the call don't fit each other. what() names the argument as it is called here.
class ArgumentError : public CoordinateError {
 public:
  ArgumentError(std::string_view before, std::string_view argument, std::string_view behind);

  /// The argument's name here, and the message with the name that it has for whoever gives it.
  const std::string& argument() const { return argument_; }
  std::string naming(std::string_view name) const;

 private:
  std::string before_, argument_, behind_;
};

/// Two neighbouring points closer than this are one point.
inline constexpr double kSamePoint_mm = 1e-9;

/// Millimetres of a unit by its name (mm, um, cm, m, mil, in, inch); nothing if it is none of these.
std::optional<double> length_unit_mm(std::string_view name);

/// Reads the lines of a tool path; the extension (any case) says which kind.
/// - `.apt`, `.cls`, `.cl`: GOTO/x,y,z[,i,j,k], FROM/, GODLTA/dx,dy,dz, UNITS/MM|INCH, RAPID, MULTAX, PARTNO,
///   `TOOL PATH/name`, `$` at a line's end (goes on), `$$` (comment), FINI at its end (END-OF-PATH in a
///   .cls). A RAPID move belongs to no line. Under MULTAX each GOTO has its tool axis. Statements without
///   motion are passed over; motion other than GOTO (CIRCLE, CYCLE, GOFWD) and other frames (TRANS, TRACUT,
///   COPY) are refused.
/// - `.ngc`, `.nc`, `.gcode`, `.tap`: G0, G1, G20, G21, G90, G91, comments and words that move nothing; A, B,
/// C
///   have to be 0. Any other word is refused. G0 or G1 and X, Y and Z are said before a line begins. G0
///   belongs to no line. Where pressure is switched (M62/M64 and M63/M65), a line is what is moved under
///   pressure. M2, M30 or % ends the program.
/// - `.csv`: columns x, y, z and, if wanted, i, j, k (tool axis) and line (any text, a new one begins a
/// line),
///   named in the first row, x, y and z with their unit (x_mm), i, j, k or nx, ny, nz; without names x, y, z,
///   i, j, k in this order. An empty row ends a line too.
///
/// `unit_mm` is the length of one of the file's units, for files that don't say it.
///
/// Where a line begins or ends with moves along the tool axis (lowering, lifting), they are left out; one
/// that is nothing else is no line. Points that coincide with their neighbour are left out. A path without
/// tool axes gets upright ones, made square to the line; the slope across it isn't known then.
///
/// @throws CoordinateError if the file is missing, empty, of another kind or ends early; if a statement can't
///   be understood, a number is malformed or not finite, an axis has no length; if the unit is said by nobody
///   or twice; if there is no line or more than kMaxPoints points.
std::vector<ClLine> read_tool_path(const std::filesystem::path& path,
                                   std::optional<double> unit_mm = std::nullopt);

/// The same from text; `name` stands in messages and its extension decides.
std::vector<ClLine> read_tool_path_text(std::string_view name, std::string_view content,
                                        std::optional<double> unit_mm = std::nullopt);

/// The positions alone.
std::vector<Eigen::Vector3d> positions_mm(const ClLine& line);

/// Distances along the polygon of points from its first.
std::vector<double> polygon_lengths_mm(std::span<const Eigen::Vector3d> points_mm);

}  // namespace meltstage::motion
