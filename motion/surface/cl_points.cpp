// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/cl_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/file.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_lines.hpp"
#include "motion/surface/path_lines.hpp"

namespace meltstage::motion {

namespace {

constexpr std::string_view kExpected = ".apt, .cls, .cl, .ngc, .nc, .gcode, .tap or .csv";

struct Unit {
  std::string_view name;
  double mm;
};
constexpr std::array kUnits{Unit{"mm", 1.0},       Unit{"um", 1e-3}, Unit{"\u00b5m", 1e-3},
                            Unit{"\u03bcm", 1e-3}, Unit{"cm", 10.0}, Unit{"m", 1e3},
                            Unit{"mil", 0.0254},   Unit{"in", 25.4}, Unit{"inch", 25.4}};

// ---------------------------------------------------------------- CSV

/// Columns of a table, as its first row names them or, without names, in the order x, y, z, i, j, k.
class PathTable {
 public:
  PathTable(std::string_view file, std::optional<double> unit_mm)
      : file_(file), lines_(file), unit_(lines_, unit_mm) {}

  std::vector<ClLine> read(std::string_view content) {
    detail::read_csv_rows(std::string(file_), content, [&](const detail::TableRow& row) { take(row); });
    end_line();
    return lines_.take();
  }

 private:
  static constexpr std::array<std::string_view, 7> kNames{"x", "y", "z", "i", "j", "k", "line"};
  static constexpr std::size_t kLine = 6;

  static bool is_blank(const detail::Cell& cell) { return detail::trimmed(cell.text).empty(); }

  /// In a table nothing is lowered or lifted: all of its points are of lines.
  void end_line() {
    if (const std::size_t row = lines_.row_of_lone_point(); row != 0)
      lines_.fail(row, fmt::format("found a line of one point{}, expected two or more that differ",
                                   last_name_.empty() ? "" : ", " + detail::in_quotes(last_name_)));
    lines_.end_line(true);
  }

  void take(const detail::TableRow& row) {
    if (std::all_of(row.cells.begin(), row.cells.end(), is_blank)) {
      end_line();
      return;
    }
    if (!row.ended)
      lines_.fail(row.row,
                  "the file ends in the middle of the row, expected its line end; the file may be cut off");
    // The CSV parser hands over no row for an empty line.
    if (last_row_ != 0 && row.row > last_row_ + 1) end_line();
    last_row_ = row.row;
    if (!known_) {
      known_ = true;
      const bool named =
          !row.cells.empty() && !row.cells[0].number && !detail::parse_number(row.cells[0].text);
      if (named)
        take_names(row);
      else
        take_order(row);
      if (column_[3]) lines_.has_axes();
      if (named) return;
    }
    take_point(row);
  }

  void take_order(const detail::TableRow& row) {
    const std::size_t count = row.cells.size();
    if (count != 3 && count != 6)
      lines_.fail(
          row.row,
          fmt::format("found {} columns without names, expected 3 (x, y, z) or 6 (and i, j, k)", count));
    for (std::size_t i = 0; i < count; ++i) column_[i] = i;
    take_unit(row.row);
  }

  void take_names(const detail::TableRow& row) {
    for (std::size_t i = 0; i < row.cells.size(); ++i) take_name(row, i);
    if (!column_[0] || !column_[1] || !column_[2])
      lines_.fail(row.row, "found no columns x, y and z, expected all three");
    if (column_[3].has_value() != column_[5].has_value() || column_[3].has_value() != column_[4].has_value())
      lines_.fail(row.row, "found some of the columns i, j and k, expected all three or none");
    take_unit(row.row);
  }

  /// Of an axis: i, j and k; as a normal it is nx, ny and nz.
  static std::string_view plain_name(std::string_view name) {
    constexpr std::array<std::string_view, 3> kNormal{"nx", "ny", "nz"};
    const auto* at = std::find(kNormal.begin(), kNormal.end(), name);
    return at == kNormal.end() ? name : kNames[static_cast<std::size_t>(3 + (at - kNormal.begin()))];
  }

  /// "x", "x_mm", "x (mm)", "line".
  void take_name(const detail::TableRow& row, std::size_t i) {
    constexpr std::string_view kSeparators = " \t_()[]";
    const std::string name = detail::lower(detail::trimmed(row.cells[i].text));
    const auto behind = std::min(name.find_first_of(kSeparators), name.size());
    const auto* at =
        std::find(kNames.begin(), kNames.end(), plain_name(std::string_view(name).substr(0, behind)));
    const auto which = static_cast<std::size_t>(at - kNames.begin());
    const auto unit_at = name.find_first_not_of(kSeparators, behind);
    const bool has_unit = unit_at != std::string::npos;
    std::optional<double> mm;
    if (has_unit) mm = length_unit_mm(name.substr(unit_at, name.find_last_not_of(kSeparators) + 1 - unit_at));
    if (at == kNames.end() || (has_unit && (which > 2 || !mm)))
      lines_.fail(row.row,
                  fmt::format("column {}: found name {}, expected x, y or z, alone or with a unit such as "
                              "x_mm, or i, j, k (nx, ny, nz) or line",
                              i + 1, detail::in_quotes(row.cells[i].text)));
    if (column_[which])
      lines_.fail(row.row, fmt::format("column {}: found a second column {}, expected one", i + 1, *at));
    column_[which] = i;
    if (has_unit) said_mm_[which] = mm;
  }

  void take_unit(std::size_t row) {
    const auto units =
        std::count_if(said_mm_.begin(), said_mm_.end(), [](const auto& mm) { return mm.has_value(); });
    if (units == 3) {
      unit_.say(1.0, row);  // each column by its own
      for (std::size_t axis = 0; axis < 3; ++axis) scale_mm_[axis] = *said_mm_[axis];
      return;
    }
    if (units != 0) lines_.fail(row, "found a unit at some of x, y and z, expected it at all or none");
    scale_mm_.fill(unit_.mm(row, "found x, y and z without a unit, expected names such as x_mm"));
  }

  double value(const detail::TableRow& row, std::size_t which) const {
    const std::size_t i = *column_[which];
    if (i >= row.cells.size() || is_blank(row.cells[i]))
      lines_.fail(row.row,
                  fmt::format("column {} ({}): found nothing, expected a number", i + 1, kNames[which]));
    // Where the separator isn't a comma, the reader of rows takes decimal commas.
    const detail::Cell& cell = row.cells[i];
    return cell.number ? *cell.number : lines_.number(row.row, cell.text);
  }

  void take_point(const detail::TableRow& row) {
    if (column_[kLine] && *column_[kLine] < row.cells.size()) {
      const std::string name(detail::trimmed(row.cells[*column_[kLine]].text));
      if (name != last_name_) {
        end_line();
        lines_.name_next(name);
        last_name_ = name;
      }
    }
    Eigen::Vector3d at_mm, axis = Eigen::Vector3d::UnitZ();
    for (std::size_t i = 0; i < 3; ++i) {
      at_mm[static_cast<Eigen::Index>(i)] = value(row, i) * scale_mm_[i];
      if (column_[3]) axis[static_cast<Eigen::Index>(i)] = value(row, 3 + i);
    }
    lines_.add(at_mm, axis, row.row);
  }

  std::string_view file_;
  detail::PathLines lines_;
  detail::PathUnit unit_;
  std::array<std::optional<std::size_t>, 7> column_;
  std::array<std::optional<double>, 3> said_mm_;
  std::array<double, 3> scale_mm_{1.0, 1.0, 1.0};
  bool known_ = false;
  std::string last_name_;
  std::size_t last_row_ = 0;
};

}  // namespace

ArgumentError::ArgumentError(std::string_view before, std::string_view argument, std::string_view behind)
    : CoordinateError(fmt::format("{}{}{}", before, argument, behind)),
      before_(before),
      argument_(argument),
      behind_(behind) {}

std::string ArgumentError::naming(std::string_view name) const {
  return fmt::format("{}{}{}", before_, name, behind_);
}

std::optional<double> length_unit_mm(std::string_view name) {
  const auto* at =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& unit) { return unit.name == name; });
  if (at == kUnits.end()) return std::nullopt;
  return at->mm;
}

std::vector<ClLine> read_tool_path_text(std::string_view name, std::string_view content,
                                        std::optional<double> unit_mm) {
  if (unit_mm && !(*unit_mm > 0.0 && std::isfinite(*unit_mm)))
    throw CoordinateError(
        fmt::format("{}: unit_mm: found {}, expected a finite number above 0", name, *unit_mm));
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (content.starts_with(kByteOrderMark)) content.remove_prefix(kByteOrderMark.size());
  if (content.empty())
    throw CoordinateError(fmt::format("{}: the file is empty, expected a tool path", name));
  if (const auto kind = describe_content(content); kind != "text")
    throw CoordinateError(fmt::format("{}: found {}, expected a tool path as text", name, kind));
  const std::string extension = detail::lower(std::filesystem::path(name).extension().string());
  if (extension == ".apt" || extension == ".cls" || extension == ".cl")
    return detail::read_apt_path(name, content, unit_mm);
  if (extension == ".ngc" || extension == ".nc" || extension == ".gcode" || extension == ".tap")
    return detail::read_gcode_path(name, content, unit_mm);
  if (extension == ".csv") return PathTable(name, unit_mm).read(content);
  throw CoordinateError(
      fmt::format("{}: found extension {}, expected {}", name, detail::in_quotes(extension), kExpected));
}

std::vector<ClLine> read_tool_path(const std::filesystem::path& path, std::optional<double> unit_mm) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;
  return read_tool_path_text(path.string(), read_file(path, fmt::format("a {} file", kExpected), kMostBytes),
                             unit_mm);
}

Eigen::Vector3d square_to(const Eigen::Vector3d& way) {
  // Of a wall only this is known: it faces sideways.
  constexpr double kUpright = 1e-6;
  const Eigen::Vector3d along = way.normalized();
  const Eigen::Vector3d across = Eigen::Vector3d::UnitZ() - along.z() * along;
  return across.norm() > kUpright ? across.normalized() : Eigen::Vector3d::UnitX();
}

std::vector<Eigen::Vector3d> positions_mm(const ClLine& line) {
  std::vector<Eigen::Vector3d> out(line.points.size());
  std::transform(line.points.begin(), line.points.end(), out.begin(),
                 [](const ClPoint& point) { return point.position_mm; });
  return out;
}

std::vector<double> polygon_lengths_mm(std::span<const Eigen::Vector3d> points_mm) {
  std::vector<double> out(points_mm.size());
  for (std::size_t i = 1; i < out.size(); ++i) out[i] = out[i - 1] + (points_mm[i] - points_mm[i - 1]).norm();
  return out;
}

}  // namespace meltstage::motion
