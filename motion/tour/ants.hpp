// SPDX-License-Identifier: Apache-2.0
// The bump-printing paper's own path planner, an ant colony, for comparison; plan_path() is the one to use.
#pragma once

#include <cstdint>
#include <span>

#include "motion/tour/path.hpp"

namespace meltstage::motion {

/// Parameters as the paper gives them (section 3).
struct AntColony {
  double q0 = 0.9;     ///< share of steps that take the best edge, rule (1)
  double alpha = 1.0;  ///< power of the pheromone, rule (2)
  double beta = 2.0;   ///< power of 1 / distance, rule (2)
  int cycles = 500;    ///< stopping rule k < 500
  /// Rule (4) allows rho_1 = 1, which would wipe all pheromone off the best path; capped here.
  double largest_rho = 0.5;
  std::uint64_t seed = 1;
};

/// Plans by the paper's rules (1)-(4): as many ants as points, all from the first point; Manhattan distance;
/// after each cycle the best path so far is reinforced by rho/f(W) and every edge evaporates by 1 - rho, with
/// rho_k at its upper limit 1 - ln k / ln(k+1). Points in one place count as a thousandth of the least other
/// distance apart. Time is cycles x points^3 / 2 steps: 500 cycles of 256 points take some ten seconds. The
/// lower bound is 0: the ants know of none, so that gap() is infinite.
///
/// @throws MotionError if there are more than 2000 points, or a parameter is out of range.
Plan plan_path_by_ants(std::span<const Point> points, Tour tour, const AntColony& colony = {});

}  // namespace meltstage::motion
