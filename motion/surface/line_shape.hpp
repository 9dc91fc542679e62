// SPDX-License-Identifier: Apache-2.0
// The shape of a tool path's line between its points, and the faces of the surface that it runs over.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "motion/surface/cl_points.hpp"

namespace meltstage::motion {

/// The line's name in a message; "the line" if it has none.
std::string_view called(std::string_view name);

/// @throws MotionError if a line has fewer than two points.
void require_two_points(std::string_view name, std::size_t points);

/// A place on the nominal line, to be touched or printed.
struct MeasuringPoint {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double length_mm = 0.0;  ///< along the line's polygon
};

/// Where a line's direction turns by more, it has a corner.
inline constexpr double kCorner_deg = 20.0;

/// Whether the line has a corner at this point, neither its first nor its last.
bool is_corner(const ClLine& line, std::size_t point);

/// A place of the line by its polygon's length; held to its ends. Between points that sample a curve it is on
/// the curve (a cubic with the tangents of its neighbours, error O(h^4)), between points whose chord would be
/// off such a curve by more than 10 um, and next to corners, on the straight move.
MeasuringPoint place_on(const ClLine& line, std::span<const double> lengths_mm, double length_mm);

/// Where the surface under a line is folded: two faces meet.
struct Fold {
  double length_mm = 0.0;  ///< along the line's polygon
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d way_before = Eigen::Vector3d::UnitX(), way_behind = Eigen::Vector3d::UnitX();
  Eigen::Vector3d normal_before = Eigen::Vector3d::UnitZ(), normal_behind = Eigen::Vector3d::UnitZ();

  /// A valley: a ball rests on both faces.
  bool is_hollow() const;
  /// Halfway between the normals.
  Eigen::Vector3d axis() const;
  /// Cosine and tangent of half the angle between the normals.
  double half_cosine() const;
  double half_tangent() const;
  /// So close to the fold a ball would touch the other face as well.
  double shadow_mm(double ball_radius_mm) const;
};

/// The folds of a line whose axes follow from its way, by rising length. A file with tool axes says itself
/// how they turn; it has none.
std::vector<Fold> folds_of(const ClLine& line, std::span<const double> lengths_mm);

/// A probe from above touches no surface whose normal points less upwards (steeper than 87 degrees).
inline constexpr double kLeastUpward = 0.05;

/// @throws MotionError if the surface under a place faces sideways or down.
void require_facing_up(const Eigen::Vector3d& position_mm, const Eigen::Vector3d& normal);

/// @throws MotionError if a line whose axes follow from its way goes up or down a wall.
void require_no_wall(const ClLine& line);

/// Of a line whose first or last move comes steeply from above or goes there: it may be a ramp through the
/// air, where there is nothing to touch. A sentence each.
std::vector<std::string> notes_on_ramps(const ClLine& line);

/// Ends of the faces: the line's beginning, its folds, its end.
std::vector<double> face_borders_mm(std::span<const Fold> folds, double total_mm);

}  // namespace meltstage::motion
