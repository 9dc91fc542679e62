// SPDX-License-Identifier: Apache-2.0
// Rigid poses and displacements in the plane, and the one that takes a set of marks to where they were seen.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "motion/profile/profile.hpp"  // MotionError

namespace meltstage::motion {

/// Where a rigid body is, or how it was displaced: M1 = R(angle) M0 + (x, y) (paper 003, eq. (2)); the angle
/// counts counter-clockwise.
struct PlanarPose {
  double x_mm = 0.0, y_mm = 0.0;
  double angle_rad = 0.0;
};

constexpr double kArcsecond_rad = 3.14159265358979323846 / (180.0 * 3600.0);

/// R(angle) point + (x, y).
Eigen::Vector2d moved(const PlanarPose& pose, const Eigen::Vector2d& point_mm);

/// First `second`, then `first`: moved(compose(a, b), p) = moved(a, moved(b, p)).
PlanarPose compose(const PlanarPose& first, const PlanarPose& second);

/// compose(inverse_of(a), a) displaces nothing.
PlanarPose inverse_of(const PlanarPose& pose);

/// The displacement, in the fixed frame, that takes a body from one pose to the other.
PlanarPose displacement(const PlanarPose& from, const PlanarPose& to);

/// A pose found from marks.
struct PoseFit {
  PlanarPose pose;
  double rms_mm = 0.0;               ///< of what is left at the marks, over both coordinates
  std::vector<double> distances_mm;  ///< what is left at each mark
};

/// The least-squares rigid displacement that takes `from_mm` to `to_mm`, mark by mark (closed form, paper
/// 003, eq. (2)).
/// @throws MotionError if fewer than two marks are given, the numbers differ, a coordinate isn't finite, two
/// marks stand at one place, or a mirror image fits better than the marks themselves.
PoseFit fit_pose(const std::vector<Eigen::Vector2d>& from_mm, const std::vector<Eigen::Vector2d>& to_mm);

}  // namespace meltstage::motion
