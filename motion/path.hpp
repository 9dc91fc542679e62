// SPDX-License-Identifier: Apache-2.0
// Order in which the bumps are visited: a short open path from the head's position through every point.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "motion/coordinates.hpp"

namespace meltstage::motion {

/// Length of a move (dx, dy): |dx|+|dy| (bump-printing paper, section 3), max(|dx|,|dy|), or the straight
/// line.
enum class Metric { manhattan, chebyshev, euclidean };

/// Where the head stands before the first bump.
struct Start {
  double x_mm = 0.0;
  double y_mm = 0.0;
};

/// The visiting order as indices into the points that were given, and the path's length in file order and in
/// this order, each with the way from the start to the first point.
struct Plan {
  std::vector<std::size_t> order;
  double length_before_mm = 0.0;
  double length_after_mm = 0.0;
};

double distance_mm(double dx_mm, double dy_mm, Metric metric);

/// Length of the path start -> points[order[0]] -> points[order[1]] ... ; 0 for an empty order.
double path_length(std::span<const Point> points, std::span<const std::size_t> order, Metric metric,
                   Start start);

/// Plans an open path by nearest neighbour, 2-opt and Or-opt over neighbour lists with don't-look bits
/// (Bentley 1992), then the same after local segment swaps of a fixed number (iterated local search; Johnson
/// & McGeoch 1997). The same input gives the same order on every machine. Never longer than the file's own
/// order.
Plan plan_path(std::span<const Point> points, Metric metric, Start start);

}  // namespace meltstage::motion
