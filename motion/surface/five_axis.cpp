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

/// Of each regular pose the solution on the way that turns least in all.
std::vector<Angles> least_way(const TwinRotaryTable& table, std::span<const ToolPose> path,
                              const std::vector<std::size_t>& regular) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<std::array<Angles, 2>> both;
  std::vector<std::array<int, 2>> came_from(regular.size());
  std::array<double, 2> cost{0.0, 0.0};
  for (std::size_t r = 0; r < regular.size(); ++r) {
    both.push_back(solutions(table, path[regular[r]].axis));
    std::array<double, 2> next{kNever, kNever};
    for (int to = 0; to < 2; ++to) {
      if (!within(table.tilt_deg, both[r][to].tilt_deg)) continue;
      for (int from = 0; from < 2; ++from) {
        double way = 0.0;
        if (r == 0)
          // Of equal ways the one that starts nearer to zero, and there the first solution.
          way = 1e-6 * (std::abs(half_turn(both[0][to].rotary_deg)) + (from == to ? 0.0 : 1.0));
        else
          way = std::abs(both[r][to].tilt_deg - both[r - 1][from].tilt_deg) +
                std::abs(half_turn(both[r][to].rotary_deg - both[r - 1][from].rotary_deg));
        if (cost[from] + way < next[to]) next[to] = cost[from] + way, came_from[r][to] = from;
      }
    }
    if (next[0] == kNever && next[1] == kNever)
      throw MotionError(fmt::format(
          "pose {}: needs a tilt of {:+.3f} or {:+.3f} degrees, expected {}..{} degrees", regular[r] + 1,
          both[r][0].tilt_deg, both[r][1].tilt_deg, table.tilt_deg.min_mm, table.tilt_deg.max_mm));
    cost = next;
  }
  std::vector<Angles> out(regular.size());
  int at = cost[0] <= cost[1] ? 0 : 1;
  for (std::size_t r = regular.size(); r-- > 0;) {
    out[r] = both[r][at];
    at = came_from[r][at];
  }
  for (std::size_t r = 1; r < out.size(); ++r)
    out[r].rotary_deg = out[r - 1].rotary_deg + half_turn(out[r].rotary_deg - out[r - 1].rotary_deg);
  return out;
}

/// Whole turns that bring the path's C into its range, as near to zero as can be.
void fit_windings(const TwinRotaryTable& table, std::vector<AxesPosition>& axes) {
  const auto [low, high] = std::minmax_element(
      axes.begin(), axes.end(), [](const auto& a, const auto& b) { return a.rotary_deg < b.rotary_deg; });
  const double middle = 0.5 * (low->rotary_deg + high->rotary_deg);
  const double centre = std::clamp(0.0, table.rotary_deg.min_mm, table.rotary_deg.max_mm);
  const double nearest = std::round((centre - middle) / 360.0);
  for (int away = 0; away <= 20; ++away)
    for (const int side : {1, -1}) {
      const double turns = 360.0 * (nearest + side * away);
      if (!within(table.rotary_deg, low->rotary_deg + turns) ||
          !within(table.rotary_deg, high->rotary_deg + turns))
        continue;
      for (AxesPosition& a : axes) a.rotary_deg += turns;
      return;
    }
  throw MotionError(
      fmt::format("path: C turns over {:.3f} degrees without a stop, expected a way within {}..{} "
                  "degrees; divide the line",
                  high->rotary_deg - low->rotary_deg, table.rotary_deg.min_mm, table.rotary_deg.max_mm));
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
  const std::vector<Angles> angles = least_way(table, path, regular);
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
  fit_windings(table, out);
  for (std::size_t i = 0; i < path.size(); ++i)
    out[i] = axes_at(table, path[i].tip_mm, out[i].tilt_deg, out[i].rotary_deg);
  return out;
}

}  // namespace meltstage::motion
