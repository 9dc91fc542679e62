// SPDX-License-Identifier: Apache-2.0
// Order in which the bumps are visited: the shortest path or tour that a bounded search finds, and a lower
// bound that says how far from the shortest of all it can be.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "motion/bumps/coordinates.hpp"
#include "motion/profile/profile.hpp"

namespace meltstage::motion {

/// Cost of a hop (dx, dy): |dx|+|dy| (bump-printing paper, section 3), max(|dx|,|dy|), the straight line, all
/// in mm; or the time in s that the stage takes for it, which is what a printer pays.
enum class Metric { manhattan, chebyshev, euclidean, time };

/// Coordinates of a path are no larger, so that no sum or square of ways overflows.
inline constexpr double kFarthestStop_mm = 1e12;

/// A place of the head, in the stage's frame.
struct Position {
  double x_mm = 0.0;
  double y_mm = 0.0;
};

/// What a hop takes under Metric::time: the S-curve of the slower axis from rest to rest, then the pause.
struct HopTimes {
  ScurveLimits x, y;
  double pause_s = 0.0;  ///< at every bump: settling and jetting, >= 0
};

enum class Tour {
  open,   ///< ends at the last bump, or at `end`
  closed  ///< returns to where it began
};

constexpr double kLongestSearch_s = 86'400.0;

struct PathTask {
  Metric metric = Metric::manhattan;
  Tour tour = Tour::open;
  std::optional<Position> start;  ///< where the head stands first; without it the path begins at any bump
  std::optional<Position> end;    ///< where it goes last; open tours only
  HopTimes times;                 ///< read under Metric::time alone
  /// Repetitions of the search from a locally disturbed tour, as a multiple of the number of bumps, >= 0;
  /// without it as many as keep ten thousand bumps within some seconds.
  std::optional<double> kicks_per_point;
  /// Seconds by the clock that the search may take, > 0, in place of the kicks; a first tour and the bound
  /// are made in any case. The order then depends on the machine.
  std::optional<double> search_s;
};

/// The visiting order as indices into the points that were given. Costs are mm, or s under Metric::time, and
/// hold the ways from the start and to the end (or back).
struct Plan {
  std::vector<std::size_t> order;
  double cost_before = 0.0;  ///< in the order of the points
  double cost_after = 0.0;   ///< in the planned order
  double lower_bound = 0.0;  ///< no order costs less

  /// How far above the cheapest order the plan can be, as a fraction of the bound; 0: proved to be the
  /// cheapest; infinite: no bound is known.
  double gap() const {
    if (cost_after <= lower_bound) return 0.0;
    return lower_bound > 0.0 ? cost_after / lower_bound - 1.0 : std::numeric_limits<double>::infinity();
  }
};

/// Length of a move in mm; not for Metric::time.
double distance_mm(double dx_mm, double dy_mm, Metric metric);

/// Cost of visiting the points in this order: mm, or s under Metric::time. The pauses are those of all
/// points.
/// @throws MotionError as plan_path, or if an index of the order is none of a point.
double path_cost(std::span<const Point> points, std::span<const std::size_t> order, const PathTask& task);

/// Told the share of the search that is done, rising to 1, which is told last, and even in time as far as
/// that can be known: a search that meets its bound ends before its time.
using PathProgress = std::function<void(double share)>;

/// Plans the order. Up to 10 points: the cheapest of all orders. A full lattice: the serpentine, where that
/// is proved to be the cheapest. Otherwise chained Lin-Kernighan on candidate edges by alpha-nearness (Lin &
/// Kernighan 1973; Applegate, Cook & Rohe 2003; Helsgaun 2000) under a falling temperature, which stops once
/// the bound is met. The bound is that of Held & Karp (1971) over all pairs of points, raised on lattices to
/// the next length that a tour can have.
///
/// The same input gives the same order, unless the search is given a time. Never dearer than the order of the
/// points. About n log n in memory of 300 bytes a point; up to `kMaxPoints`.
///
/// @throws MotionError if a coordinate isn't finite or beyond `kFarthestStop_mm`, a limit of the stage isn't
/// positive, a pause, the kicks or the
///   search's time are negative or not finite, or a closed tour is given an end.
Plan plan_path(std::span<const Point> points, const PathTask& task = {}, const PathProgress& progress = {});

/// As plan_path, for an open path from the start.
Plan plan_path(std::span<const Point> points, Metric metric, Position start);

}  // namespace meltstage::motion
