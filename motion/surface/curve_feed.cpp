// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/curve_feed.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "motion/profile/check_positive.hpp"

namespace meltstage::motion {

double feed_limit_mm_s(const Nurbs& curve, double u, const FeedLimits& limits) {
  const double bend = curve.curvature_1_mm(u);
  double speed = limits.feed_mm_s;
  if (bend > 0.0) {
    speed = std::min(speed, std::sqrt(limits.normal_acceleration_mm_s2 / bend));
    const double sagitta = limits.chord_error_mm * bend;  // of a circle of radius 1
    if (sagitta < 1.0)
      speed = std::min(speed, 2.0 / limits.cycle_s / bend * std::sqrt(sagitta * (2.0 - sagitta)));
  }
  return speed;
}

namespace {

/// A place of the curve at which the acceleration is zero.
struct Breakpoint {
  std::size_t cell;
  double speed_mm_s;
};

/// Largest speed at which the direction may turn by so much within a servo cycle.
double corner_limit_mm_s(double angle_rad, const FeedLimits& limits) {
  const double half = std::sin(0.5 * angle_rad);
  if (half <= 0.0) return limits.feed_mm_s;
  return std::min({limits.feed_mm_s, 0.5 * limits.normal_acceleration_mm_s2 * limits.cycle_s / half,
                   2.0 * limits.chord_error_mm / (limits.cycle_s * half)});
}

/// Parameters between which a curve goes nearly straight.
struct Stretch {
  double from, to;
};

/// Between the directions of two stretches; 0 where one of them has no length.
double angle_rad(const Nurbs& curve, const Stretch& a, const Stretch& b) {
  const auto way_mm = [&](const Stretch& s) {
    return Eigen::Vector3d(curve.position_mm(s.to) - curve.position_mm(s.from));
  };
  const Eigen::Vector3d before = way_mm(a), after = way_mm(b);
  return std::atan2(before.cross(after).norm(), before.dot(after));
}

class FeedPlanner {
 public:
  FeedPlanner(const Nurbs& curve, const ArcLength& length, const FeedLimits& limits) : limits_(limits) {
    const auto& knots = curve.knots();
    places_mm_.push_back(0.0);
    parameters_.push_back(0.0);
    for (std::size_t i = Nurbs::kDegree; i + Nurbs::kDegree + 1 < knots.size(); ++i) {
      const double width = knots[i + 1] - knots[i];
      if (width == 0.0) continue;
      const double span_mm = length.length_mm(knots[i + 1]) - length.length_mm(knots[i]);
      const double cells = std::clamp(std::ceil(span_mm / kCell_mm), kCellsOfSpan, kMostCellsOfSpan);
      for (double k = 1.0; k <= cells; ++k)
        add_cells(curve, length, knots[i] + width * (k - 1.0) / cells,
                  k == cells ? knots[i + 1] : knots[i] + width * k / cells, 0);
    }
    allowed_mm_s_.push_back(least_mm_s_.front());
    for (std::size_t i = 1; i < least_mm_s_.size(); ++i)
      allowed_mm_s_.push_back(std::min({least_mm_s_[i - 1], least_mm_s_[i], corner_mm_s(curve, i)}));
    allowed_mm_s_.push_back(least_mm_s_.back());
  }

  FeedPlan plan() {
    std::vector<Breakpoint> points = minima();
    while (true) {
      make_reachable(points);
      std::vector<Breakpoint> more;
      FeedPlan plan = lay_out(points, more);
      if (more.empty()) return plan;
      points.insert(points.end(), more.begin(), more.end());
      std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.cell < b.cell; });
    }
  }

 private:
  static constexpr double kCell_mm = 0.05;
  static constexpr double kOfCell = 1e-3;  // a stretch whose direction is looked at
  static constexpr double kCellsOfSpan = 8.0, kMostCellsOfSpan = 10'000.0;

  /// At a cell's border. A curve may turn at once at a knot of three, where its curvature says nothing.
  double corner_mm_s(const Nurbs& curve, std::size_t border) const {
    const double u = parameters_[border];
    return corner_limit_mm_s(angle_rad(curve, {u - kOfCell * (u - parameters_[border - 1]), u},
                                       {u, u + kOfCell * (parameters_[border + 1] - u)}),
                             limits_);
  }

  /// Adds cells of the curve, halved until the limit and the curve are nearly straight in each. The least
  /// limit of a cell is that of the parabola through its ends and middle, and once more its sag less for what
  /// isn't a parabola.
  void add_cells(const Nurbs& curve, const ArcLength& length, double from, double to, int depth) {
    constexpr double kStraight = 1e-3, kMostTurned_rad = 0.3;
    constexpr int kDeepest = 10;
    const double middle = 0.5 * (from + to);
    const double a = feed_limit_mm_s(curve, from, limits_), b = feed_limit_mm_s(curve, to, limits_);
    const double m = feed_limit_mm_s(curve, middle, limits_), sag = std::abs(m - 0.5 * (a + b));
    // On a straight line that turns back the curvature is 0 on both sides.
    const double little = kOfCell * (to - from);
    const double turned_rad = angle_rad(curve, {from, from + little}, {to - little, to});
    const bool turns = turned_rad > kMostTurned_rad;
    if ((turns || sag > kStraight * m) && depth < kDeepest) {
      add_cells(curve, length, from, middle, depth + 1);
      add_cells(curve, length, middle, to, depth + 1);
      return;
    }
    // The parabola is at most its sag below the lower end.
    places_mm_.push_back(length.length_mm(to));
    parameters_.push_back(to);
    const double least = std::max(std::min({a, b, m}) - 2.0 * sag, 0.5 * std::min({a, b, m}));
    least_mm_s_.push_back(turns ? std::min(least, corner_limit_mm_s(turned_rad, limits_)) : least);
  }

  std::vector<Breakpoint> minima() const {
    const std::size_t last = places_mm_.size() - 1;
    std::vector<Breakpoint> points{{0, 0.0}};
    for (std::size_t i = 1; i < last; ++i)
      if (allowed_mm_s_[i] < limits_.feed_mm_s && allowed_mm_s_[i] <= allowed_mm_s_[i - 1] &&
          allowed_mm_s_[i] < allowed_mm_s_[i + 1])
        points.push_back({i, allowed_mm_s_[i]});
    points.push_back({last, 0.0});
    return points;
  }

  /// Way of a ramp between two speeds, with no acceleration at its ends and one jerk: mean speed times time.
  double way_mm(double low, double high) const {
    const double a = limits_.acceleration_mm_s2, j = limits_.jerk_mm_s3, dv = high - low;
    const double time = dv >= a * a / j ? dv / a + a / j : 2.0 * std::sqrt(dv / j);
    return 0.5 * (low + high) * time;
  }

  /// No breakpoint faster than can be reached from its neighbours.
  void make_reachable(std::vector<Breakpoint>& points) const {
    const auto hold = [&](const Breakpoint& from, Breakpoint& to) {
      // A little less than the room, so that rounding doesn't make the ramp too long for it.
      const double room_mm = std::abs(places_mm_[to.cell] - places_mm_[from.cell]) * (1.0 - 1e-9);
      if (to.speed_mm_s <= from.speed_mm_s || way_mm(from.speed_mm_s, to.speed_mm_s) <= room_mm) return;
      double low = from.speed_mm_s, high = to.speed_mm_s;
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (way_mm(from.speed_mm_s, middle) <= room_mm ? low : high) = middle;
      }
      to.speed_mm_s = low;
    };
    for (std::size_t i = 1; i < points.size(); ++i) hold(points[i - 1], points[i]);
    for (std::size_t i = points.size() - 1; i > 0; --i) hold(points[i], points[i - 1]);
  }

  Scurve block(const Breakpoint& from, const Breakpoint& to, double top_mm_s) const {
    const double a = limits_.acceleration_mm_s2, j = limits_.jerk_mm_s3;
    return plan_scurve(asymmetric_limits(top_mm_s, a, a, j, j), places_mm_[to.cell] - places_mm_[from.cell],
                       from.speed_mm_s, to.speed_mm_s);
  }

  /// Largest share by which a block is above what is allowed inside it; 0 if it isn't. Its speed rises to a
  /// top and falls, so that in a cell without the top it is largest at one end.
  double excess(const Breakpoint& from, const Breakpoint& to, const Scurve& profile) const {
    double worst = 0.0;
    for (std::size_t i = from.cell + 1; i < to.cell; ++i) {
      const double time_s = profile.time_at(places_mm_[i] - places_mm_[from.cell]);
      worst = std::max(worst, profile.sample(time_s).velocity_mm_s / allowed_mm_s_[i] - 1.0);
    }
    const double top_from_mm = places_mm_[from.cell] + profile.starts[3].position_mm,
                 top_to_mm = places_mm_[from.cell] + profile.starts[4].position_mm;
    for (std::size_t i = from.cell; i < to.cell; ++i)
      if (places_mm_[i] <= top_to_mm && places_mm_[i + 1] >= top_from_mm)
        worst = std::max(worst, profile.starts[3].velocity_mm_s / least_mm_s_[i] - 1.0);
    return worst > 1e-9 ? worst : 0.0;
  }

  FeedPlan lay_out(const std::vector<Breakpoint>& points, std::vector<Breakpoint>& more) const {
    FeedPlan plan;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const Breakpoint &from = points[i], &to = points[i + 1];
      const double least = std::max(from.speed_mm_s, to.speed_mm_s);
      Scurve profile = block(from, to, limits_.feed_mm_s);
      if (excess(from, to, profile) > 0.0) {
        double low = least, high = limits_.feed_mm_s;
        for (int k = 0; k < 20; ++k) {
          const double middle = 0.5 * (low + high);
          (excess(from, to, block(from, to, middle)) > 0.0 ? high : low) = middle;
        }
        profile = block(from, to, std::max(low, 1e-9));
        if (excess(from, to, profile) > 0.0 && to.cell - from.cell > 1) {
          const std::size_t middle = (from.cell + to.cell) / 2;
          more.push_back({middle, allowed_mm_s_[middle]});
        }
      }
      plan.blocks.push_back({plan.duration_s, places_mm_[from.cell], profile});
      plan.duration_s += profile.duration_s;
    }
    return plan;
  }

  FeedLimits limits_;
  std::vector<double> places_mm_;     ///< borders of the cells
  std::vector<double> parameters_;    ///< of these
  std::vector<double> allowed_mm_s_;  ///< at the borders: the least of both cells
  std::vector<double> least_mm_s_;    ///< of each cell
};

}  // namespace

FeedPlan plan_feed(const Nurbs& curve, const ArcLength& length, const FeedLimits& limits) {
  check_positive("feed", limits.feed_mm_s, "mm/s");
  check_positive("acceleration", limits.acceleration_mm_s2, "mm/s2");
  check_positive("jerk", limits.jerk_mm_s3, "mm/s3");
  check_positive("normal acceleration", limits.normal_acceleration_mm_s2, "mm/s2");
  check_positive("chord error", limits.chord_error_mm, "mm");
  check_positive("cycle", limits.cycle_s, "s");
  return FeedPlanner(curve, length, limits).plan();
}

MotionState FeedPlan::sample(double time_s) const {
  const auto after = std::upper_bound(blocks.begin() + 1, blocks.end(), time_s,
                                      [](double t, const Block& block) { return t < block.start_s; });
  const Block& block = *(after - 1);
  MotionState state = block.profile.sample(time_s - block.start_s);
  state.position_mm += block.start_mm;
  return state;
}

}  // namespace meltstage::motion
