// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: vectors in a plane.
#pragma once

#include <Eigen/Core>

namespace meltstage::motion {

/// Area of the parallelogram of two vectors, above 0 when `b` lies counter-clockwise of `a`.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace meltstage::motion
