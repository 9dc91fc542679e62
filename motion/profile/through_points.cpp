// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/through_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "motion/profile/course.hpp"
#include "motion/profile/profile_parts.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector3d;

/// A straight line, and the points that it passes between its ends.
struct Line {
  struct Point {
    std::size_t index;
    double along_mm;
  };
  Vector3d from_mm, direction;
  double length_mm = 0.0;
  std::size_t first = 0, last = 0;  // points
  std::vector<Point> passed;
  ScurveLimits limits;

  Line(std::span<const Vector3d> points, std::size_t from, std::size_t to)
      : from_mm(points[from]), direction((points[to] - points[from]).normalized()), first(from) {
    end_at(points, to);
  }
  void end_at(std::span<const Vector3d> points, std::size_t to) {
    last = to;
    length_mm = (points[to] - from_mm).norm();
  }
};

/// The way of a change of speed between corners.
double way_of_change(const ScurveLimits& limits, double from, double to) {
  return from <= to
             ? ramp_between(from, to, {limits.acceleration_mm_s2, limits.jerk1_mm_s3, limits.jerk3_mm_s3})
                   .distance
             : ramp_between(to, from, {limits.deceleration_mm_s2, limits.jerk7_mm_s3, limits.jerk5_mm_s3})
                   .distance;
}

/// A velocity that turns while its size is the same before and behind: an even S-curve along the difference.
struct Turn {
  double peak_acceleration = 0.0;
  double rise_s = 0.0, half_hold_s = 0.0;
  double reach_mm = 0.0;  ///< before the point where it begins, and behind it where it ends
  double miss_mm = 0.0;   ///< from the point in its middle
};

struct Corner {
  Vector3d change;    ///< unit vector from the direction before to the one behind
  double share;       ///< length of their difference
  EvenLimits limits;  ///< along `change`
  double speed = 0.0;

  Corner(const Line& before, const Line& behind, const AxisLimits& axes)
      : change((behind.direction - before.direction).normalized()),
        share((behind.direction - before.direction).norm()),
        limits(limits_along(axes, change)) {}

  Turn turn(double at_speed) const {
    const double half_change = 0.5 * share * at_speed;  // of the velocity, up to the middle
    Turn t;
    if (half_change == 0.0) return t;
    t.peak_acceleration = std::min(limits.acceleration, std::sqrt(2.0 * half_change * limits.jerk));
    t.rise_s = t.peak_acceleration / limits.jerk;
    const double rise = 0.5 * t.peak_acceleration * t.rise_s;
    t.half_hold_s = std::max(0.0, (half_change - rise) / t.peak_acceleration);
    t.reach_mm = at_speed * (t.rise_s + t.half_hold_s);
    t.miss_mm = t.peak_acceleration * t.rise_s * t.rise_s / 6.0 +
                t.half_hold_s * (rise + 0.5 * t.peak_acceleration * t.half_hold_s);
    return t;
  }
  double reach_mm() const { return turn(speed).reach_mm; }
};

std::vector<Line> lines_of(std::span<const Vector3d> points, const AxisLimits& axes) {
  constexpr double kStraight = 1e-9;
  std::vector<Line> lines;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const std::size_t before = lines.empty() ? 0 : lines.back().last;
    const Vector3d way = points[i] - points[before];
    const double length = way.norm();
    if (length == 0.0) {
      if (!lines.empty()) lines.back().passed.push_back({i, lines.back().length_mm});
      continue;
    }
    const bool goes_on = !lines.empty() && (way / length - lines.back().direction).norm() <= kStraight;
    if (goes_on) {
      lines.back().passed.push_back({before, lines.back().length_mm});
      lines.back().end_at(points, i);
    } else {
      lines.emplace_back(points, before, i);
    }
  }
  for (Line& line : lines) line.limits = limits_along(axes, line.direction);
  return lines;
}

class Planner {
 public:
  Planner(std::vector<Line> lines, const AxisLimits& axes, double tolerance_mm)
      : lines_(std::move(lines)), tolerance_mm_(tolerance_mm) {
    for (std::size_t i = 1; i < lines_.size(); ++i) corners_.emplace_back(lines_[i - 1], lines_[i], axes);
  }

  ThroughPoints plan(std::span<const Vector3d> points) {
    for (std::size_t k = 0; k < corners_.size(); ++k)
      corners_[k].speed = highest(k, 0.5 * lines_[k].length_mm, 0.5 * lines_[k + 1].length_mm);
    look_ahead();
    for (std::size_t k = 0; k < corners_.size(); ++k)
      corners_[k].speed =
          highest(k, lines_[k].length_mm - reach_before(k), lines_[k + 1].length_mm - reach_before(k + 2));
    look_ahead();
    for (std::size_t k = 0; k < corners_.size(); ++k) slow_down_where_faster(k);
    for (std::size_t k = corners_.size(); k-- > 0;) slow_down_where_faster(k);
    const ThroughPoints through = motion(points);
    for (Corner& corner : corners_) corner.speed = 0.0;
    const ThroughPoints with_stops = motion(points);
    return through.duration_s <= with_stops.duration_s ? through : with_stops;
  }

 private:
  double speed_at(std::size_t end) const {  // of line `end`'s beginning
    return end == 0 || end == lines_.size() ? 0.0 : corners_[end - 1].speed;
  }
  /// Of the corner at the beginning of line `end`; 0 at the ends of the motion.
  double reach_before(std::size_t end) const {
    return end == 0 || end >= lines_.size() ? 0.0 : corners_[end - 1].reach_mm();
  }

  /// The highest speed of a corner with so much room on the lines before and behind.
  double highest(std::size_t k, double room_before_mm, double room_behind_mm) const {
    const Corner& corner = corners_[k];
    const auto excess = [&](double speed) {
      const Turn turn = corner.turn(speed);
      return std::max(
          {turn.miss_mm - tolerance_mm_, turn.reach_mm - room_before_mm, turn.reach_mm - room_behind_mm});
    };
    return root_of_rising(excess, 0.0,
                          std::min(lines_[k].limits.velocity_mm_s, lines_[k + 1].limits.velocity_mm_s));
  }

  /// The highest speed of corner k that a line's change of speed from, or to, `other` at its other end
  /// allows.
  double reachable(std::size_t k, std::size_t line, double other, double other_reach_mm) const {
    const Corner& corner = corners_[k];
    const bool slows_down = line == k + 1;
    const auto excess = [&](double speed) {
      const double way = slows_down ? way_of_change(lines_[line].limits, speed, other)
                                    : way_of_change(lines_[line].limits, other, speed);
      return way + corner.turn(speed).reach_mm + other_reach_mm - lines_[line].length_mm;
    };
    if (corner.speed <= other || excess(corner.speed) <= 0.0) return corner.speed;
    return root_of_rising(excess, other, corner.speed);
  }

  void look_ahead() {
    for (std::size_t k = corners_.size(); k-- > 0;)
      corners_[k].speed = reachable(k, k + 1, speed_at(k + 2), reach_before(k + 2));
    for (std::size_t k = 0; k < corners_.size(); ++k)
      corners_[k].speed = reachable(k, k, speed_at(k), reach_before(k));
  }

  /// What is left of line `i` between its corners; shorter than its change of speed takes: nothing.
  std::optional<double> straight_mm(std::size_t i) const {
    const double length_mm = lines_[i].length_mm - reach_before(i) - reach_before(i + 1);
    constexpr double kRounding = 1e-12;
    const double needed_mm = way_of_change(lines_[i].limits, speed_at(i), speed_at(i + 1));
    if (length_mm < needed_mm - kRounding * lines_[i].length_mm) return std::nullopt;
    return std::max(length_mm, needed_mm);
  }

  Scurve straight(std::size_t i, double length_mm) const {
    return plan_scurve(lines_[i].limits, length_mm, speed_at(i), speed_at(i + 1));
  }

  /// From the corner before k to the one behind it; infinite where a line is too short.
  double time_around(std::size_t k) const {
    const std::optional<double> before = straight_mm(k), behind = straight_mm(k + 1);
    if (!before || !behind) return std::numeric_limits<double>::infinity();
    const Turn turn = corners_[k].turn(corners_[k].speed);
    return straight(k, *before).duration_s + straight(k + 1, *behind).duration_s +
           2.0 * (turn.rise_s + turn.half_hold_s);
  }

  /// A turn may cost more than it saves where one of its limits is far below those of the lines.
  void slow_down_where_faster(std::size_t k) {
    double& speed = corners_[k].speed;
    const double highest = speed;
    double best = highest, best_s = time_around(k);
    for (const double share : {0.5, 0.0}) {
      speed = share * highest;
      if (const double time_s = time_around(k); time_s < best_s) {
        best = speed;
        best_s = time_s;
      }
    }
    speed = best;
  }

  ThroughPoints motion(std::span<const Vector3d> points) const {
    ThroughPoints result;
    result.end_mm = points.back();
    result.passed_s.assign(points.size(), 0.0);
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      add_line(result, i);
      if (i < corners_.size()) add_corner(result, i);
    }
    if (!lines_.empty()) result.passed_s[lines_.back().last] = result.duration_s;
    for (std::size_t i = 0; i < lines_.size(); ++i) pass_points(result, i);
    return result;
  }

  /// When the motion passes the points within line `i`, those that lie where a corner has begun or not yet
  /// ended, too: it is beside them then.
  void pass_points(ThroughPoints& to, std::size_t i) const {
    const Line& line = lines_[i];
    for (const Line::Point& point : line.passed) {
      if (point.along_mm >= line.length_mm) {
        to.passed_s[point.index] = to.passed_s[line.last];
        continue;
      }
      double before_s = to.passed_s[line.first], behind_s = to.passed_s[line.last];
      for (double middle_s = 0.5 * (before_s + behind_s); middle_s > before_s && middle_s < behind_s;
           middle_s = 0.5 * (before_s + behind_s)) {
        const double along_mm = (to.sample(middle_s).position_mm - line.from_mm).dot(line.direction);
        (along_mm < point.along_mm ? before_s : behind_s) = middle_s;
      }
      to.passed_s[point.index] = behind_s;
    }
  }

  void add_line(ThroughPoints& to, std::size_t i) const {
    const Line& line = lines_[i];
    const double begins_mm = reach_before(i);
    const double rest_mm = lines_[i].length_mm - begins_mm - reach_before(i + 1);
    const Scurve curve = straight(i, straight_mm(i).value_or(rest_mm));
    for (std::size_t segment = 0; segment < curve.durations_s.size(); ++segment) {
      const MotionState& state = curve.starts[segment];
      append(to, curve.durations_s[segment],
             {line.from_mm + (begins_mm + state.position_mm) * line.direction,
              state.velocity_mm_s * line.direction, state.acceleration_mm_s2 * line.direction,
              state.jerk_mm_s3 * line.direction});
    }
  }

  void add_corner(ThroughPoints& to, std::size_t k) const {
    const Corner& corner = corners_[k];
    const Turn turn = corner.turn(corner.speed);
    const Line& before = lines_[k];
    const Vector3d jerk = corner.limits.jerk * corner.change, peak = turn.peak_acceleration * corner.change;
    AxisStates state{before.from_mm + (before.length_mm - turn.reach_mm) * before.direction,
                     corner.speed * before.direction, Vector3d::Zero(), jerk};
    to.passed_s[before.last] = to.duration_s + turn.rise_s + turn.half_hold_s;
    const auto add = [&](double duration_s, const Vector3d& with_jerk) {
      state.jerk_mm_s3 = with_jerk;
      append(to, duration_s, state);
      const double t = duration_s;
      state.position_mm +=
          t * (state.velocity_mm_s + t * (state.acceleration_mm_s2 / 2.0 + t * with_jerk / 6.0));
      state.velocity_mm_s += t * (state.acceleration_mm_s2 + t * with_jerk / 2.0);
      state.acceleration_mm_s2 += t * with_jerk;
    };
    add(turn.rise_s, jerk);
    state.acceleration_mm_s2 = peak;
    add(2.0 * turn.half_hold_s, Vector3d::Zero());
    add(turn.rise_s, -jerk);
  }

  static void append(ThroughPoints& to, double duration_s, const AxisStates& start) {
    if (!(duration_s > 0.0)) return;
    to.pieces.push_back({to.duration_s, duration_s, start});
    to.duration_s += duration_s;
  }

  std::vector<Line> lines_;
  std::vector<Corner> corners_;  // between one line and the next
  double tolerance_mm_;
};

}  // namespace

AxisStates ThroughPoints::sample(double time_s) const {
  check_position(time_s);
  const auto at_rest = [](const Vector3d& at) {
    return AxisStates{at, Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  };
  if (pieces.empty() || time_s >= duration_s) return at_rest(end_mm);
  if (time_s < 0.0) return at_rest(pieces.front().start.position_mm);
  const auto behind = std::upper_bound(pieces.begin(), pieces.end(), time_s,
                                       [](double t, const JerkPiece& piece) { return t < piece.start_s; });
  const JerkPiece& piece = *std::prev(behind);
  const AxisStates& from = piece.start;
  const double t = time_s - piece.start_s;
  return {from.position_mm +
              t * (from.velocity_mm_s + t * (from.acceleration_mm_s2 / 2.0 + t * from.jerk_mm_s3 / 6.0)),
          from.velocity_mm_s + t * (from.acceleration_mm_s2 + t * from.jerk_mm_s3 / 2.0),
          from.acceleration_mm_s2 + t * from.jerk_mm_s3, from.jerk_mm_s3};
}

ThroughPoints plan_through(std::span<const Vector3d> points_mm, const AxisLimits& axes, double tolerance_mm) {
  if (points_mm.empty()) throw MotionError("points: found none, expected one or more");
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    if (!points_mm[i].allFinite())
      throw MotionError(
          fmt::format("point {}: found a coordinate that isn't finite, expected finite ones", i + 1));
  }
  for (const ScurveLimits& axis : axes) check_limits(axis);
  if (!(tolerance_mm >= 0.0) || !std::isfinite(tolerance_mm))
    throw MotionError(fmt::format("tolerance: found {} mm, expected 0 or more", tolerance_mm));
  return Planner(lines_of(points_mm, axes), axes, tolerance_mm).plan(points_mm);
}

}  // namespace meltstage::motion
