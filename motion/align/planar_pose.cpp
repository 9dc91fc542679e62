// SPDX-License-Identifier: Apache-2.0
#include "motion/align/planar_pose.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

namespace meltstage::motion {
namespace {

/// Marks nearer than this share of their spread stand at one place.
constexpr double kSamePlace = 1e-6;
/// Off their common line by less than this share of their spread, marks can't show a mirror image.
constexpr double kOnALine = 1e-3;

Eigen::Vector2d centre_of(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const auto& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

void check_marks(const std::vector<Eigen::Vector2d>& points, const char* which) {
  double spread = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite())
      throw MotionError(fmt::format("{} mark {}: found ({}, {}), expected finite coordinates", which, i + 1,
                                    points[i].x(), points[i].y()));
    spread = std::max(spread, (points[i] - points[0]).norm());
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if ((points[i] - points[j]).norm() <= kSamePlace * spread)
        throw MotionError(
            fmt::format("{} marks {} and {}: found both at ({:.6g}, {:.6g}) mm, expected marks apart", which,
                        j + 1, i + 1, points[i].x(), points[i].y()));
}

/// Twice the area's moment against the square of the spread: 0 on a line.
double flatness(const std::vector<Eigen::Vector2d>& points) {
  const Eigen::Vector2d centre = centre_of(points);
  Eigen::Matrix2d moment = Eigen::Matrix2d::Zero();
  for (const auto& point : points) moment += (point - centre) * (point - centre).transpose();
  return std::sqrt(std::max(0.0, moment.determinant())) / moment.trace();
}

}  // namespace

Eigen::Vector2d moved(const PlanarPose& pose, const Eigen::Vector2d& point_mm) {
  const double c = std::cos(pose.angle_rad), s = std::sin(pose.angle_rad);
  return {c * point_mm.x() - s * point_mm.y() + pose.x_mm, s * point_mm.x() + c * point_mm.y() + pose.y_mm};
}

PlanarPose compose(const PlanarPose& first, const PlanarPose& second) {
  const Eigen::Vector2d origin = moved(first, {second.x_mm, second.y_mm});
  return {origin.x(), origin.y(), first.angle_rad + second.angle_rad};
}

PlanarPose inverse_of(const PlanarPose& pose) {
  const PlanarPose turned_back{0.0, 0.0, -pose.angle_rad};
  const Eigen::Vector2d origin = moved(turned_back, {-pose.x_mm, -pose.y_mm});
  return {origin.x(), origin.y(), -pose.angle_rad};
}

PlanarPose displacement(const PlanarPose& from, const PlanarPose& to) {
  return compose(to, inverse_of(from));
}

PoseFit fit_pose(const std::vector<Eigen::Vector2d>& from_mm, const std::vector<Eigen::Vector2d>& to_mm) {
  if (from_mm.size() != to_mm.size())
    throw MotionError(
        fmt::format("marks: found {} seen, expected the {} that are known", to_mm.size(), from_mm.size()));
  if (from_mm.size() < 2)
    throw MotionError(fmt::format("marks: found {}, expected at least 2", from_mm.size()));
  check_marks(from_mm, "known");
  check_marks(to_mm, "seen");
  const Eigen::Vector2d from_centre = centre_of(from_mm), to_centre = centre_of(to_mm);
  double dot = 0.0, cross = 0.0, mirror_dot = 0.0, mirror_cross = 0.0;
  for (std::size_t i = 0; i < from_mm.size(); ++i) {
    const Eigen::Vector2d a = from_mm[i] - from_centre, b = to_mm[i] - to_centre;
    dot += a.dot(b);
    cross += a.x() * b.y() - a.y() * b.x();
    mirror_dot += a.x() * b.x() - a.y() * b.y();
    mirror_cross += a.x() * b.y() + a.y() * b.x();
  }
  // The larger the correlation, the smaller the squares that are left. Marks on a line are their own mirror
  // image.
  if (flatness(from_mm) > kOnALine && std::hypot(mirror_dot, mirror_cross) > std::hypot(dot, cross))
    throw MotionError(
        "marks: found their mirror image, expected them as known; is the board or the plate upside down, or "
        "an axis of the camera reversed?");
  PoseFit fit;
  fit.pose.angle_rad = std::atan2(cross, dot);
  const Eigen::Vector2d origin = to_centre - moved({0.0, 0.0, fit.pose.angle_rad}, from_centre);
  fit.pose.x_mm = origin.x();
  fit.pose.y_mm = origin.y();
  double squares = 0.0;
  for (std::size_t i = 0; i < from_mm.size(); ++i) {
    fit.distances_mm.push_back((moved(fit.pose, from_mm[i]) - to_mm[i]).norm());
    squares += fit.distances_mm.back() * fit.distances_mm.back();
  }
  fit.rms_mm = std::sqrt(squares / (2.0 * static_cast<double>(from_mm.size())));
  return fit;
}

}  // namespace meltstage::motion
