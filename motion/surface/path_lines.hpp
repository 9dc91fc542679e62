// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: what the readers of tool paths share, one reader a format.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "motion/surface/cl_points.hpp"

namespace meltstage::motion::detail {

std::vector<ClLine> read_apt_path(std::string_view file, std::string_view content,
                                  std::optional<double> unit_mm);
std::vector<ClLine> read_gcode_path(std::string_view file, std::string_view content,
                                    std::optional<double> unit_mm);

std::string lower(std::string_view text);

/// The lines of a path as they are found; closes one when the tool leaves the surface.
class PathLines {
 public:
  explicit PathLines(std::string_view file) : file_(file) {}

  [[noreturn]] void fail(std::size_t row, std::string_view message) const;

  /// `message` ends with the argument of the call that does not fit the file.
  [[noreturn]] void fail_argument(std::size_t row, std::string_view message, std::string_view argument) const;

  /// The file has ended without the words that end a whole one.
  [[noreturn]] void fail_cut_off(std::string_view ends) const;

  /// A number of the file, finite.
  double number(std::size_t row, std::string_view text) const;

  void name_next(std::string_view name);
  void has_axes() { has_axes_ = true; }

  /// A point under the tool; `axis` of any length.
  void add(const Eigen::Vector3d& position_mm, const Eigen::Vector3d& axis, std::size_t row);

  /// The row of a line's first point, if all its points are one and the same; 0 otherwise.
  std::size_t row_of_lone_point() const { return open_.size() == 1 ? open_.front().row : 0; }

  /// The tool leaves the surface; `keep_ends`: there is no lowering or lifting in what was added. Where the
  /// file gives axes, lifts and lowerings in between end a line, too.
  void end_line(bool keep_ends);

  std::vector<ClLine> take();

 private:
  void drop_approach();
  void keep(std::vector<ClPoint> points);
  static std::size_t end_of_surface(const std::vector<ClPoint>& points, std::size_t from);
  std::size_t lowered_behind(const std::vector<ClPoint>& points, std::size_t end) const;
  std::string unique(const std::string& wanted);

  std::string_view file_;
  std::string name_;
  std::size_t count_ = 0;
  bool has_axes_ = false;
  std::vector<ClPoint> open_;
  std::vector<ClLine> lines_;
  std::set<std::string> taken_;             // names of lines
  std::map<std::string, int> last_number_;  // behind a name that stands for several lines
};

/// The unit of a file's numbers, said by the file or, where it says none, by who reads it. Not by both: one
/// of them would be wrong.
class PathUnit {
 public:
  PathUnit(const PathLines& lines, std::optional<double> given_mm) : lines_(lines), given_mm_(given_mm) {}

  void say(double mm, std::size_t row);

  /// `expected`: how a file of this kind says its unit, and where.
  double mm(std::size_t row, std::string_view expected) const;

 private:
  const PathLines& lines_;
  std::optional<double> given_mm_, said_mm_;
};

}  // namespace meltstage::motion::detail
