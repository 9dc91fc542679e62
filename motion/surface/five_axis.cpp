// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/five_axis.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "motion/profile/profile.hpp"

namespace meltstage::motion {

namespace {

constexpr double kDeg = 180.0 / std::numbers::pi;

Eigen::Matrix3d tilt_rotation(const TwinRotaryTable& table, double tilt_deg) {
  const Eigen::Vector3d about =
      table.tilt == TwinRotaryTable::Tilt::a ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  return Eigen::AngleAxisd(table.tilt_sign * tilt_deg / kDeg, about).toRotationMatrix();
}

Eigen::Matrix3d turn_rotation(const TwinRotaryTable& table, double rotary_deg) {
  return Eigen::AngleAxisd(table.rotary_sign * rotary_deg / kDeg, Eigen::Vector3d::UnitZ())
      .toRotationMatrix();
}

struct Angles {
  double tilt_deg, rotary_deg;
};

/// Tilt that brings an axis, turned by C already, as near to the vertical as the tilt can.
double best_tilt_deg(const TwinRotaryTable& table, const Eigen::Vector3d& axis, double rotary_deg) {
  const Eigen::Vector3d turned = turn_rotation(table, rotary_deg) * axis;
  const double tilt = table.tilt == TwinRotaryTable::Tilt::a ? std::atan2(turned.y(), turned.z())
                                                             : std::atan2(-turned.x(), turned.z());
  return table.tilt_sign * tilt * kDeg;
}

/// Both solutions for an axis that isn't vertical.
std::array<Angles, 2> solutions(const TwinRotaryTable& table, const Eigen::Vector3d& axis) {
  const double turn = table.tilt == TwinRotaryTable::Tilt::a ? std::atan2(axis.x(), axis.y())
                                                             : std::atan2(-axis.y(), axis.x());
  const double rotary_deg = table.rotary_sign * turn * kDeg;
  const double tilt_deg = best_tilt_deg(table, axis, rotary_deg);
  return {Angles{tilt_deg, rotary_deg}, Angles{-tilt_deg, rotary_deg + 180.0}};
}

double half_turn(double degrees) { return std::remainder(degrees, 360.0); }

bool within(const Range& range, double value) {
  constexpr double kRounding_deg = 1e-9;
  return value >= range.min_mm - kRounding_deg && value <= range.max_mm + kRounding_deg;
}

void check_table(const TwinRotaryTable& table) {
  if (!table.tilt_centre_mm.allFinite() || !table.rotary_centre_mm.allFinite())
    throw MotionError("rotary axes' centres: found a number that isn't finite, expected finite ones");
  for (const auto& [name, sign] : {std::pair{"tilt", table.tilt_sign}, {"rotary", table.rotary_sign}})
    if (sign != 1 && sign != -1)
      throw MotionError(fmt::format("{} sign: found {}, expected 1 or -1", name, sign));
  for (const auto& [name, range] : {std::pair{"tilt", table.tilt_deg}, {"rotary", table.rotary_deg}})
    if (!(range.min_mm < range.max_mm))
      throw MotionError(fmt::format("{} limits: found {}..{} degrees, expected a lower and a higher one",
                                    name, range.min_mm, range.max_mm));
}

/// Tilt within the limits where C is led through; the tool may lean by the cone, no more.
double tilt_in_cone_deg(const TwinRotaryTable& table, const ToolPose& pose, std::size_t number,
                        double rotary_deg, double singular_deg) {
  constexpr double kRounding_deg = 1e-6;  // arccos near 1
  const double best = best_tilt_deg(table, pose.axis, rotary_deg);
  const double tilt = std::clamp(best, table.tilt_deg.min_mm, table.tilt_deg.max_mm);
  const double cosine = pose_of(table, {Eigen::Vector3d::Zero(), tilt, rotary_deg}).axis.dot(pose.axis);
  if (tilt != best && std::acos(std::clamp(cosine, -1.0, 1.0)) * kDeg > singular_deg + kRounding_deg)
    throw MotionError(fmt::format("pose {}: needs a tilt of {:+.3f} degrees, expected {}..{} degrees", number,
                                  best, table.tilt_deg.min_mm, table.tilt_deg.max_mm));
  return tilt;
}

/// A way's end at one pose: which solution, with C counted on from where the way began.
struct End {
  Angles angles;
  double way_deg;    // that axes have turned so far
  std::size_t from;  // the end at the pose before
};

double way_between_deg(const Angles& start, const Angles& solution) {
  return std::abs(solution.tilt_deg - start.tilt_deg) +
         std::abs(half_turn(solution.rotary_deg - start.rotary_deg));
}

/// The end that comes to the same angles as `end`, but for rounding; ends.end() when none does.
std::vector<End>::iterator same_end(std::vector<End>& ends, const End& end) {
  return std::find_if(ends.begin(), ends.end(), [&](const End& other) {
    return other.angles.tilt_deg == end.angles.tilt_deg &&
           std::abs(other.angles.rotary_deg - end.angles.rotary_deg) < 1.0;
  });
}

/// Turns of C from one angle to another one that a way may take. Within the cone it may turn either way
/// round, which matters where it has limits.
std::vector<double> turns_between(double from_deg, double to_deg, const Range& rotary_deg,
                                  bool through_cone) {
  const double shorter = half_turn(to_deg - from_deg);
  if (!through_cone || !std::isfinite(rotary_deg.max_mm - rotary_deg.min_mm)) return {shorter};
  return {shorter, shorter > 0.0 ? shorter - 360.0 : shorter + 360.0};
}

/// What a pose's solutions make of the ends of all ways before it; of those that come to the same angles the
/// least one. Ways that leave the range of C end. From one pose to the next a way takes the nearer solution,
/// since the other one would swing the tool aside; only where it comes through the cone C is free to turn.
std::vector<End> go_on(const Range& rotary_deg, const std::vector<End>& before,
                       const std::vector<Angles>& both, bool through_cone) {
  std::vector<End> ends;
  for (std::size_t from = 0; from < before.size(); ++from) {
    const Angles& start = before[from].angles;
    double nearest_deg = std::numeric_limits<double>::infinity();
    for (const Angles& solution : both) nearest_deg = std::min(nearest_deg, way_between_deg(start, solution));
    for (const Angles& solution : both) {
      if (!through_cone && way_between_deg(start, solution) > nearest_deg) continue;
      for (const double turn_deg :
           turns_between(start.rotary_deg, solution.rotary_deg, rotary_deg, through_cone)) {
        const End end{
            {solution.tilt_deg, start.rotary_deg + turn_deg},
            before[from].way_deg + std::abs(solution.tilt_deg - start.tilt_deg) + std::abs(turn_deg),
            from};
        if (!within(rotary_deg, end.angles.rotary_deg)) continue;
        const auto same = same_end(ends, end);
        if (same == ends.end())
          ends.push_back(end);
        else if (end.way_deg < same->way_deg)
          *same = end;
      }
    }
  }
  return ends;
}

/// The solutions of pose `pose` that the limits of the tilt allow: one or two.
std::vector<Angles> allowed_solutions(const TwinRotaryTable& table, const ToolPose& tool, std::size_t pose) {
  const std::array<Angles, 2> both = solutions(table, tool.axis);
  std::vector<Angles> allowed;
  for (const Angles& solution : both)
    if (within(table.tilt_deg, solution.tilt_deg)) allowed.push_back(solution);
  if (allowed.empty())
    throw MotionError(
        fmt::format("pose {}: needs a tilt of {:+.3f} or {:+.3f} degrees, expected {}..{} degrees", pose + 1,
                    both[0].tilt_deg, both[1].tilt_deg, table.tilt_deg.min_mm, table.tilt_deg.max_mm));
  return allowed;
}

/// Of each regular pose the solution on the way that turns least in all, of those that begin within
/// `most_turns` whole turns of C and stay in its range. None when no way stays there.
std::optional<std::vector<Angles>> least_way(const TwinRotaryTable& table, std::span<const ToolPose> path,
                                             const std::vector<std::size_t>& regular, const Range& rotary_deg,
                                             int most_turns) {
  std::vector<std::vector<End>> ends;
  for (std::size_t r = 0; r < regular.size(); ++r) {
    const std::vector<Angles> allowed = allowed_solutions(table, path[regular[r]], regular[r]);
    if (r > 0) {
      const bool through_cone = regular[r] > regular[r - 1] + 1;
      ends.push_back(go_on(rotary_deg, ends.back(), allowed, through_cone));
      continue;
    }
    ends.emplace_back();
    for (std::size_t i = 0; i < allowed.size(); ++i) {
      for (int turns = -most_turns; turns <= most_turns; ++turns) {
        const double start = half_turn(allowed[i].rotary_deg) + 360.0 * turns;
        // Of equal ways the one that starts nearer to zero, and there the first solution.
        const double preference = 1e-6 * (std::abs(start) + static_cast<double>(i));
        if (within(rotary_deg, start)) ends.back().push_back({{allowed[i].tilt_deg, start}, preference, 0});
      }
    }
  }
  std::vector<Angles> way(regular.size());
  if (way.empty()) return way;
  const auto least = std::min_element(ends.back().begin(), ends.back().end(),
                                      [](const End& a, const End& b) { return a.way_deg < b.way_deg; });
  if (least == ends.back().end()) return std::nullopt;
  auto at = static_cast<std::size_t>(least - ends.back().begin());
  for (std::size_t r = way.size(); r-- > 0;) {
    way[r] = ends[r][at].angles;
    at = ends[r][at].from;
  }
  return way;
}

constexpr int kMostTurns = 20;

/// Whole turns that bring the path's C into its range, as near to zero as can be; none when it fits nowhere.
std::optional<double> turns_to_fit(const TwinRotaryTable& table, double low_deg, double high_deg) {
  const double centre = std::clamp(0.0, table.rotary_deg.min_mm, table.rotary_deg.max_mm);
  const double nearest = std::round((centre - 0.5 * (low_deg + high_deg)) / 360.0);
  for (int away = 0; away <= kMostTurns; ++away)
    for (const int side : {1, -1}) {
      const double turns = 360.0 * (nearest + side * away);
      if (within(table.rotary_deg, low_deg + turns) && within(table.rotary_deg, high_deg + turns))
        return turns;
    }
  return std::nullopt;
}

/// The least way that the limits of C allow, as near to zero as can be.
std::vector<Angles> way_within_limits(const TwinRotaryTable& table, std::span<const ToolPose> path,
                                      const std::vector<std::size_t>& regular) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  std::vector<Angles> way = *least_way(table, path, regular, {-kAny, kAny}, 0);
  if (way.empty()) return way;
  const auto [least, most] = std::minmax_element(
      way.begin(), way.end(), [](const Angles& a, const Angles& b) { return a.rotary_deg < b.rotary_deg; });
  const double low_deg = least->rotary_deg, high_deg = most->rotary_deg;
  if (const std::optional<double> turns = turns_to_fit(table, low_deg, high_deg)) {
    for (Angles& angles : way) angles.rotary_deg += *turns;
    return way;
  }
  // Seldom, and longer: ways that begin with any turn of C, and end where they leave its range.
  if (auto other = least_way(table, path, regular, table.rotary_deg, kMostTurns)) return *other;
  throw MotionError(fmt::format(
      "path: C has no way within {}..{} degrees that goes on without a stop (the shortest one turns "
      "over {:.3f} degrees); divide the line",
      table.rotary_deg.min_mm, table.rotary_deg.max_mm, high_deg - low_deg));
}

}  // namespace

AxesPosition axes_at(const TwinRotaryTable& table, const Eigen::Vector3d& tip_mm, double tilt_deg,
                     double rotary_deg) {
  const Eigen::Vector3d turned =
      turn_rotation(table, rotary_deg) * (tip_mm - table.rotary_centre_mm) + table.rotary_centre_mm;
  return {tilt_rotation(table, tilt_deg) * (turned - table.tilt_centre_mm) + table.tilt_centre_mm, tilt_deg,
          rotary_deg};
}

ToolPose pose_of(const TwinRotaryTable& table, const AxesPosition& axes) {
  const Eigen::Matrix3d tilt = tilt_rotation(table, axes.tilt_deg),
                        turn = turn_rotation(table, axes.rotary_deg);
  const Eigen::Vector3d turned =
      tilt.transpose() * (axes.linear_mm - table.tilt_centre_mm) + table.tilt_centre_mm;
  return {turn.transpose() * (turned - table.rotary_centre_mm) + table.rotary_centre_mm,
          turn.transpose() * (tilt.transpose() * Eigen::Vector3d::UnitZ())};
}

std::vector<AxesPosition> solve_path(const TwinRotaryTable& table, std::span<const ToolPose> path,
                                     double singular_deg) {
  if (path.empty()) throw MotionError("path: found no pose, expected at least one");
  check_table(table);
  constexpr double kWidestCone_deg = 45.0;
  if (!(singular_deg >= 0.0 && singular_deg <= kWidestCone_deg))
    throw MotionError(
        fmt::format("singular cone: found {} deg, expected 0 to {}", singular_deg, kWidestCone_deg));
  std::vector<std::size_t> regular;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Eigen::Vector3d& axis = path[i].axis;
    if (!path[i].tip_mm.allFinite() || !(std::abs(axis.norm() - 1.0) < 1e-6))
      throw MotionError(fmt::format(
          "pose {}: found tip ({}, {}, {}) and axis ({}, {}, {}), expected finite numbers "
          "and an axis of length 1",
          i + 1, path[i].tip_mm.x(), path[i].tip_mm.y(), path[i].tip_mm.z(), axis.x(), axis.y(), axis.z()));
    if (std::atan2(std::hypot(axis.x(), axis.y()), axis.z()) * kDeg > singular_deg) regular.push_back(i);
  }
  const std::vector<Angles> angles = way_within_limits(table, path, regular);
  std::vector<AxesPosition> out(path.size());
  std::size_t next = 0;  // the first regular pose not before i
  for (std::size_t i = 0; i < path.size(); ++i) {
    while (next < regular.size() && regular[next] < i) ++next;
    if (next < regular.size() && regular[next] == i) {
      out[i].tilt_deg = angles[next].tilt_deg, out[i].rotary_deg = angles[next].rotary_deg;
      continue;
    }
    const bool before = next > 0, after = next < regular.size();
    if (before && after) {
      const double share =
          static_cast<double>(i - regular[next - 1]) / static_cast<double>(regular[next] - regular[next - 1]);
      out[i].rotary_deg = (1.0 - share) * angles[next - 1].rotary_deg + share * angles[next].rotary_deg;
    } else if (before || after) {
      out[i].rotary_deg = angles[before ? next - 1 : next].rotary_deg;
    } else {
      out[i].rotary_deg = std::clamp(0.0, table.rotary_deg.min_mm, table.rotary_deg.max_mm);
    }
    out[i].tilt_deg = tilt_in_cone_deg(table, path[i], i + 1, out[i].rotary_deg, singular_deg);
  }
  for (std::size_t i = 0; i < path.size(); ++i)
    out[i] = axes_at(table, path[i].tip_mm, out[i].tilt_deg, out[i].rotary_deg);
  return out;
}

}  // namespace meltstage::motion
