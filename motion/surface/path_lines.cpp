// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/path_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include "base/place.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_lines.hpp"
#include "motion/surface/line_shape.hpp"

namespace meltstage::motion::detail {

namespace {

/// How far a move goes along the axis of its lower end; 0 where it goes another way. A file's numbers are
/// rounded, and its axes lean a little.
double along_axis_mm(const ClPoint& from, const ClPoint& to) {
  constexpr double kLeastCosine = 0.99, kLeast_mm = 0.02;
  const Eigen::Vector3d way = to.position_mm - from.position_mm;
  const double length_mm = way.norm();
  if (length_mm < kLeast_mm) return 0.0;
  if (way.dot(from.axis) > kLeastCosine * length_mm) return length_mm;
  return way.dot(to.axis) < -kLeastCosine * length_mm ? -length_mm : 0.0;
}

void square_axes(ClLine& line) {
  const std::vector<double> lengths = polygon_lengths_mm(positions_mm(line));
  for (std::size_t i = 0; i < lengths.size(); ++i)
    line.points[i].axis = place_on(line, lengths, lengths[i]).axis;
}

}  // namespace

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

void PathLines::fail(std::size_t row, std::string_view message) const {
  throw CoordinateError(fmt::format("{}: row {}: {}", file_, row, message));
}

void PathLines::fail_argument(std::size_t row, std::string_view message, std::string_view argument) const {
  throw ArgumentError(fmt::format("{}: row {}: {}", file_, row, message), argument, {});
}

void PathLines::fail_cut_off(std::string_view ends) const {
  throw CoordinateError(fmt::format("{}: the file ends without {}; the file may be cut off", file_, ends));
}

double PathLines::number(std::size_t row, std::string_view text) const {
  const auto value = parse_number(text);
  if (!value || !std::isfinite(*value))
    fail(row, fmt::format("found {}, expected a finite number such as 12.5", in_quotes(trimmed(text))));
  return *value;
}

void PathLines::name_next(std::string_view name) { name_ = shown(name); }

void PathLines::add(const Eigen::Vector3d& position_mm, const Eigen::Vector3d& axis, std::size_t row) {
  constexpr double kFarthest_mm = 1e6;
  if (!(position_mm.cwiseAbs().maxCoeff() <= kFarthest_mm))
    fail(row, fmt::format("found the point ({:.6g}, {:.6g}, {:.6g}) mm, expected one within {:g} mm",
                          position_mm.x(), position_mm.y(), position_mm.z(), kFarthest_mm));
  const double length = axis.norm();
  if (!(length > 1e-6) || !std::isfinite(length))
    fail(row, fmt::format("found tool axis ({:.6g}, {:.6g}, {:.6g}), expected a direction", axis.x(),
                          axis.y(), axis.z()));
  check_point_count(std::string(file_), ++count_);
  if (!open_.empty() && (open_.back().position_mm - position_mm).norm() <= kSamePoint_mm) return;
  open_.push_back({position_mm, axis / length, row});
}

void PathLines::end_line(bool keep_ends) {
  if (!keep_ends) drop_approach();
  const std::vector<ClPoint> points = std::exchange(open_, {});
  if (keep_ends || !has_axes_) return keep(points);
  for (std::size_t from = 0; from < points.size();) {
    const std::size_t end = end_of_surface(points, from);
    keep({points.begin() + static_cast<std::ptrdiff_t>(from),
          points.begin() + static_cast<std::ptrdiff_t>(end)});
    from = lowered_behind(points, end);
  }
}

void PathLines::keep(std::vector<ClPoint> points) {
  if (points.size() < 2) return;
  ClLine line{unique(name_.empty() ? fmt::format("line {}", lines_.size() + 1) : name_), std::move(points),
              !has_axes_};
  if (!has_axes_) square_axes(line);
  lines_.push_back(std::move(line));
}

/// Behind the points of one line: where the tool moves along its own axis, which no surface does, it leaves.
std::size_t PathLines::end_of_surface(const std::vector<ClPoint>& points, std::size_t from) {
  std::size_t end = from + 1;
  while (end < points.size() && along_axis_mm(points[end - 1], points[end]) == 0.0) ++end;
  return end;
}

/// The point at which a lift in front of points[end] is lowered again.
std::size_t PathLines::lowered_behind(const std::vector<ClPoint>& points, std::size_t end) const {
  if (end == points.size()) return end;
  const bool lifts = along_axis_mm(points[end - 1], points[end]) > 0.0;
  std::size_t at = end;
  while (at + 1 < points.size() && along_axis_mm(points[at], points[at + 1]) >= 0.0) ++at;
  while (at + 1 < points.size() && along_axis_mm(points[at], points[at + 1]) < 0.0) ++at;
  if (!lifts || along_axis_mm(points[at - 1], points[at]) >= 0.0)
    fail(points[end].row,
         "found a move along the tool's axis within a line, expected a lift and a lowering "
         "behind it, or none");
  return at;
}

std::vector<ClLine> PathLines::take() {
  if (lines_.empty())
    throw CoordinateError(
        fmt::format("{}: found no line, expected at least two points one after the other that are no rapid "
                    "move, lowering or "
                    "lifting",
                    file_));
  return std::move(lines_);
}

/// Leaves out the first and the last moves that run along the tool axis. What a file says of the axis may
/// lean a little; an upright one is upright, and a steep face is none of them.
void PathLines::drop_approach() {
  constexpr double kLeastCosine = 1.0 - 1e-9;
  const auto along_axis = [&](const ClPoint& near, const ClPoint& far) {
    if (has_axes_) return along_axis_mm(near, far) > 0.0;
    const Eigen::Vector3d way = far.position_mm - near.position_mm;
    return std::abs(way.dot(near.axis)) > kLeastCosine * way.norm();
  };
  std::size_t first = 0, last = open_.size();
  while (first + 1 < last && along_axis(open_[first + 1], open_[first])) ++first;
  while (last > first + 1 && along_axis(open_[last - 2], open_[last - 1])) --last;
  open_ = {open_.begin() + static_cast<std::ptrdiff_t>(first),
           open_.begin() + static_cast<std::ptrdiff_t>(last)};
}

std::string PathLines::unique(const std::string& wanted) {
  std::string name = wanted;
  for (int& i = last_number_[wanted]; !taken_.insert(name).second;) {
    i = std::max(i, 1) + 1;
    name = fmt::format("{} {}", wanted, i);
  }
  return name;
}

void PathUnit::say(double mm, std::size_t row) {
  if (given_mm_) lines_.fail_argument(row, "the file says its unit itself; leave out ", "unit_mm");
  said_mm_ = mm;
}

double PathUnit::mm(std::size_t row, std::string_view expected) const {
  if (said_mm_) return *said_mm_;
  if (!given_mm_) lines_.fail_argument(row, fmt::format("{}, or the unit by ", expected), "unit_mm");
  return *given_mm_;
}

}  // namespace meltstage::motion::detail
