// SPDX-License-Identifier: Apache-2.0
// Where a board is in truth, against where the print expects it.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "motion/align/planar_pose.hpp"

namespace meltstage::tb {

struct BoardPlace {
  motion::PlanarPose off;
  std::optional<double> turned_over_x_mm;  // it lies on its face, turned over about this x first

  // Where a place of the board is that the print expects at `expected_mm`.
  Eigen::Vector2d of(Eigen::Vector2d expected_mm) const {
    if (turned_over_x_mm) expected_mm.x() = 2.0 * *turned_over_x_mm - expected_mm.x();
    return motion::moved(off, expected_mm);
  }
};

}  // namespace meltstage::tb
