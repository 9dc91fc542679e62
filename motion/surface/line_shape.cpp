// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/line_shape.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "motion/profile/profile.hpp"

namespace meltstage::motion {

namespace {

const double kCornerCosine = std::cos(kCorner_deg * std::numbers::pi / 180.0);

/// Tangent of the tool path by its length, at one end of the segment i..i+1: that of the parabola through
/// the point and both neighbours; across a corner or an end only the segment itself is known.
std::optional<Eigen::Vector3d> tangent_at(const ClLine& line, std::span<const double> lengths_mm,
                                          std::size_t point) {
  if (point == 0 || point + 1 == line.points.size()) return std::nullopt;
  const double before_mm = lengths_mm[point] - lengths_mm[point - 1],
               after_mm = lengths_mm[point + 1] - lengths_mm[point];
  const Eigen::Vector3d before =
      (line.points[point].position_mm - line.points[point - 1].position_mm) / before_mm;
  const Eigen::Vector3d after =
      (line.points[point + 1].position_mm - line.points[point].position_mm) / after_mm;
  if (before.dot(after) < kCornerCosine) return std::nullopt;
  return (after_mm * before + before_mm * after) / (before_mm + after_mm);
}

/// The line between a point and the one before it.
class Segment {
 public:
  Segment(const ClLine& line, std::span<const double> lengths_mm, std::size_t end)
      : from_mm_(line.points[end - 1].position_mm),
        to_mm_(line.points[end].position_mm),
        way_mm_(lengths_mm[end] - lengths_mm[end - 1]),
        chord_((to_mm_ - from_mm_) / way_mm_) {
    // Chords of a curve are off it by no more than the CAM system's tolerance; what a curve through the
    // points would be off by more is meant to be straight.
    constexpr double kLargestSag_mm = 0.010;
    const auto first = tangent_at(line, lengths_mm, end - 1), second = tangent_at(line, lengths_mm, end);
    if (!first && !second) return;
    // Cubic of Hermite; with one tangent the parabola.
    const Eigen::Vector3d m0 = first ? *first : 2.0 * chord_ - *second;
    const Eigen::Vector3d m1 = second ? *second : 2.0 * chord_ - *first;
    if (0.125 * way_mm_ * (m0 - m1).norm() > kLargestSag_mm) return;
    begin_bend_ = m0 - chord_;
    end_bend_ = m1 - chord_;
  }

  Eigen::Vector3d position_mm(double share) const {
    const double left = 1.0 - share;
    return left * from_mm_ + share * to_mm_ +
           way_mm_ * share * left * (left * begin_bend_ - share * end_bend_);
  }

  /// From the tangent at one end to that at the other: the cubic's own would swing with the rounding of the
  /// file's numbers.
  Eigen::Vector3d direction(double share) const {
    return (chord_ + (1.0 - share) * begin_bend_ + share * end_bend_).normalized();
  }

 private:
  Eigen::Vector3d from_mm_, to_mm_;
  double way_mm_;
  Eigen::Vector3d chord_;
  Eigen::Vector3d begin_bend_ = Eigen::Vector3d::Zero(), end_bend_ = Eigen::Vector3d::Zero();
};

}  // namespace

bool is_corner(const ClLine& line, std::size_t point) {
  const Eigen::Vector3d before =
      (line.points[point].position_mm - line.points[point - 1].position_mm).normalized();
  const Eigen::Vector3d after =
      (line.points[point + 1].position_mm - line.points[point].position_mm).normalized();
  return before.dot(after) < kCornerCosine;
}

MeasuringPoint place_on(const ClLine& line, std::span<const double> lengths_mm, double length_mm) {
  const auto after = std::upper_bound(lengths_mm.begin() + 1, lengths_mm.end() - 1, length_mm);
  const auto i = static_cast<std::size_t>(after - lengths_mm.begin());
  const double way_mm = lengths_mm[i] - lengths_mm[i - 1];
  const double share = std::clamp((length_mm - lengths_mm[i - 1]) / way_mm, 0.0, 1.0);
  const Segment segment(line, lengths_mm, i);
  Eigen::Vector3d axis;
  if (line.axes_by_line) {
    axis = square_to(segment.direction(share));
    if (share == 0.0 && i > 1)
      axis = (axis + square_to(Segment(line, lengths_mm, i - 1).direction(1.0))).normalized();
  } else {
    const ClPoint &a = line.points[i - 1], &b = line.points[i];
    axis = (1.0 - share) * a.axis + share * b.axis;
    axis = axis.norm() > 1e-6 ? axis.normalized() : a.axis;
  }
  return {segment.position_mm(share), axis, std::clamp(length_mm, 0.0, lengths_mm.back())};
}

bool Fold::is_hollow() const { return way_behind.dot(normal_before) > 1e-9; }

Eigen::Vector3d Fold::axis() const { return (normal_before + normal_behind).normalized(); }

double Fold::half_cosine() const { return axis().dot(normal_before); }

double Fold::half_tangent() const {
  const double cosine = half_cosine();
  return std::sqrt(std::max(0.0, 1.0 - cosine * cosine)) / cosine;
}

double Fold::shadow_mm(double ball_radius_mm) const {
  return is_hollow() ? ball_radius_mm * half_tangent() : 0.0;
}

std::vector<Fold> folds_of(const ClLine& line, std::span<const double> lengths_mm) {
  // A part 0.2 mm beside its place shows two faces that differ by less as one, within 4 um.
  constexpr double kLeast_deg = 1.0;
  static const double kLeastCosine = std::cos(kLeast_deg * std::numbers::pi / 180.0);
  std::vector<Fold> out;
  if (!line.axes_by_line) return out;
  for (std::size_t i = 1; i + 1 < line.points.size(); ++i) {
    const Eigen::Vector3d before = Segment(line, lengths_mm, i).direction(1.0),
                          behind = Segment(line, lengths_mm, i + 1).direction(0.0);
    const Eigen::Vector3d normal_before = square_to(before), normal_behind = square_to(behind);
    if (normal_before.dot(normal_behind) < kLeastCosine)
      out.push_back(
          {lengths_mm[i], line.points[i].position_mm, before, behind, normal_before, normal_behind});
  }
  return out;
}

void require_facing_up(const Eigen::Vector3d& position_mm, const Eigen::Vector3d& normal) {
  if (!(normal.z() > kLeastUpward))
    throw MotionError(fmt::format(
        "the surface at ({:.4f}, {:.4f}, {:.4f}) faces sideways or down (axis z {:.3f}), expected "
        "one that a probe from above can touch",
        position_mm.x(), position_mm.y(), position_mm.z(), normal.z()));
}

std::string_view called(std::string_view name) { return name.empty() ? "the line" : name; }

void require_two_points(std::string_view name, std::size_t points) {
  if (points < 2)
    throw MotionError(fmt::format("{}: found {} points, expected at least 2", called(name), points));
}

void require_no_wall(const ClLine& line) {
  if (!line.axes_by_line) return;
  // Less may be the rounding of a file's numbers.
  constexpr double kLeastWall_mm = 0.02;
  double wall_mm = 0.0;
  for (std::size_t i = 1; i < line.points.size(); ++i) {
    const Eigen::Vector3d way = line.points[i].position_mm - line.points[i - 1].position_mm;
    const Eigen::Vector3d normal = square_to(way);
    wall_mm = normal.z() > kLeastUpward ? 0.0 : wall_mm + way.norm();
    if (wall_mm > kLeastWall_mm)
      require_facing_up(0.5 * (line.points[i].position_mm + line.points[i - 1].position_mm), normal);
  }
}

std::vector<std::string> notes_on_ramps(const ClLine& line) {
  constexpr double kSteep = 0.5;  // sine of 30 degrees
  std::vector<std::string> out;
  const std::size_t count = line.points.size();
  const auto look = [&](std::size_t end, std::size_t near, const char* which, const char* how) {
    const Eigen::Vector3d way = line.points[end].position_mm - line.points[near].position_mm;
    const Eigen::Vector3d up = line.axes_by_line ? Eigen::Vector3d::UnitZ() : line.points[near].axis;
    if (!(way.dot(up) > kSteep * way.norm()) || !is_corner(line, near)) return;
    out.push_back(
        fmt::format("{}: its {} move (row {}) {} {:.4g} mm and is touched as a face of the part; if it "
                    "is a ramp through the air, make it a rapid move",
                    called(line.name), which, line.points[std::max(end, near)].row, how, way.dot(up)));
  };
  if (count < 3) return out;
  look(0, 1, "first", "comes down");
  look(count - 1, count - 2, "last", "goes up");
  return out;
}

std::vector<double> face_borders_mm(std::span<const Fold> folds, double total_mm) {
  std::vector<double> out{0.0};
  for (const Fold& fold : folds) out.push_back(fold.length_mm);
  out.push_back(total_mm);
  return out;
}

}  // namespace meltstage::motion
