// SPDX-License-Identifier: Apache-2.0
#include "motion/align/prp_staged.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "motion/align/cross.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;

/// Twice the area of a triangle over the square of its longest side: below, it is a line.
constexpr double kFlat = 1e-6;

bool on_a_line(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const double longest = std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
  return std::abs(cross(b - a, c - a)) <= kFlat * longest;
}

void check_options(const std::vector<Vector2d>& plate_mm, const StagedOptions& options) {
  if (plate_mm.size() < 3)
    throw MotionError(fmt::format("plate: found {} marks, expected at least 3", plate_mm.size()));
  if (!(options.travel_mm > 0.0) || options.repeats < 1 || !(options.interval_mm > 0.0) ||
      !(options.difference_mm >= options.interval_mm))
    throw MotionError(fmt::format(
        "staged calibration: found travel {} mm, {} repeats, interval {} mm up to {} mm, expected numbers "
        "above 0 and an interval within its range",
        options.travel_mm, options.repeats, options.interval_mm, options.difference_mm));
}

/// The steps on one machine; `known` grows with them.
struct Steps {
  const PrpMachine& machine;
  const std::vector<Vector2d>& plate_mm;
  const PrpGeometry& nominal;
  const StagedOptions& options;
  StagedCalibration known;

  /// Sliders at these places, by the lead known so far, from the home known so far.
  void go(double q1_mm, double q2_mm, double q3_mm) const {
    machine.move_to(known.home +
                    PrpTurns(q1_mm / known.lead_mm[0], q2_mm / known.lead_mm[1], q3_mm / known.lead_mm[2]));
  }

  double base_mm() const { return nominal.d_mm[2] - nominal.d_mm[1]; }

  double angle_seen() const {
    const Vector2d way = machine.see(plate_mm.size() - 1) - machine.see(0);
    return std::atan2(way.y(), way.x());
  }

  /// Mean way of mark 1 from one end of a travel to the other.
  Vector2d way_seen(const Vector2d& from_q1_q23, const Vector2d& to_q1_q23) const {
    Vector2d sum = Vector2d::Zero();
    for (int i = 0; i < options.repeats; ++i) {
      go(from_q1_q23.x(), from_q1_q23.y(), from_q1_q23.y());
      sum -= machine.see(0);
      go(to_q1_q23.x(), to_q1_q23.y(), to_q1_q23.y());
      sum += machine.see(0);
    }
    return sum / options.repeats;
  }

  Vector2d way_along_x() const { return way_seen({-options.travel_mm, 0.0}, {options.travel_mm, 0.0}); }
  Vector2d way_along_y() const { return way_seen({0.0, -options.travel_mm}, {0.0, options.travel_mm}); }

  /// Step 1: branch 3's home is shifted until travel along X runs along the camera's X.
  void lay_frame() {
    for (int i = 0; i < 3; ++i) {
      const Vector2d way = way_along_x();
      known.home[2] -= way.y() / way.x() * base_mm() / known.lead_mm[2];
    }
  }

  /// Step 2: R1 from travel along X; R3 such that the platform doesn't swing when 2 and 3 run together; then
  /// both from travel along Y.
  void gear_ratios() {
    const double nominal_way_mm = 2.0 * options.travel_mm;
    known.lead_mm[0] *= way_along_x().x() / nominal_way_mm;
    double swing_rad = 0.0;
    for (int i = 0; i < options.repeats; ++i) {
      go(0.0, -options.travel_mm, -options.travel_mm);
      swing_rad -= angle_seen();
      go(0.0, options.travel_mm, options.travel_mm);
      swing_rad += angle_seen();
    }
    known.lead_mm[2] *= 1.0 + swing_rad / options.repeats * base_mm() / nominal_way_mm;
    const double share = way_along_y().y() / nominal_way_mm;
    known.lead_mm[1] *= share;
    known.lead_mm[2] *= share;
  }

  /// Step 3: branch 1 stands still, so the platform slides along its guide.
  void axis_skew() {
    const Vector2d way = way_along_y();
    known.alpha1_rad = std::atan2(way.y(), way.x());
  }

  /// Step 4.
  void attitude_table() {
    const int last = static_cast<int>(std::floor(options.difference_mm / options.interval_mm + 1e-9));
    for (int i = -last; i <= last; ++i) known.nodes.push_back({i * options.interval_mm, 0.0, {}});
    for (std::size_t mark = 0; mark < plate_mm.size(); ++mark)
      for (auto& node : known.nodes) {
        go(0.0, -0.5 * node.difference_mm, 0.5 * node.difference_mm);
        node.marks_mm.push_back(machine.see(mark));
      }
    const auto angle = [](const AttitudeNode& node) {
      const Vector2d way = node.marks_mm.back() - node.marks_mm.front();
      return std::atan2(way.y(), way.x());
    };
    const double at_home = angle(known.nodes[static_cast<std::size_t>(last)]);
    for (auto& node : known.nodes)
      node.angle_rad = std::remainder(angle(node) - at_home, 2.0 * std::numbers::pi);
  }
};

/// A place in the table: between node `lower` and the next, `share` of the way.
struct TablePlace {
  std::size_t lower = 0;
  double share = 0.0;
};

TablePlace place_of(const StagedCalibration& calibration, double angle_rad) {
  const auto& nodes = calibration.nodes;
  if (!(angle_rad >= nodes.front().angle_rad && angle_rad <= nodes.back().angle_rad))
    throw MotionError(
        fmt::format("board: found turned by {:.1f} arcsec, expected {:.1f} to {:.1f} (the "
                    "attitude table's range)",
                    angle_rad / kArcsecond_rad, nodes.front().angle_rad / kArcsecond_rad,
                    nodes.back().angle_rad / kArcsecond_rad));
  std::size_t upper = 1;
  while (upper + 1 < nodes.size() && nodes[upper].angle_rad < angle_rad) ++upper;
  const double low = nodes[upper - 1].angle_rad, high = nodes[upper].angle_rad;
  return {upper - 1, (angle_rad - low) / (high - low)};
}

/// Where a mark of the board stands after the turn, equations (7) to (9).
Vector2d turned_mark(const StagedCalibration& calibration, const TablePlace& place, const Vector2d& mark_mm) {
  const auto& home = calibration.nodes[calibration.nodes.size() / 2].marks_mm;
  std::vector<std::size_t> nearest(home.size());
  std::iota(nearest.begin(), nearest.end(), std::size_t{0});
  const std::size_t looked_at = std::min<std::size_t>(home.size(), 16);
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(looked_at), nearest.end(),
                    [&](std::size_t a, std::size_t b) {
                      return (home[a] - mark_mm).squaredNorm() < (home[b] - mark_mm).squaredNorm();
                    });
  std::size_t third = 2;
  while (third < looked_at && on_a_line(home[nearest[0]], home[nearest[1]], home[nearest[third]])) ++third;
  if (third == looked_at)
    throw MotionError("plate: found the marks nearest to the board's on one line, expected a grid");
  const std::array<std::size_t, 3> corner{nearest[0], nearest[1], nearest[third]};
  const Eigen::Vector3d share = triangle_shares(mark_mm, home[corner[0]], home[corner[1]], home[corner[2]]);
  Vector2d turned = Vector2d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector2d low = calibration.nodes[place.lower].marks_mm[corner[i]];
    const Vector2d high = calibration.nodes[place.lower + 1].marks_mm[corner[i]];
    turned += share[static_cast<int>(i)] * (low + place.share * (high - low));
  }
  return turned;
}

}  // namespace

StagedCalibration calibrate_staged(const PrpMachine& machine, const std::vector<Vector2d>& plate_mm,
                                   const PrpGeometry& nominal, const StagedOptions& options) {
  check_options(plate_mm, options);
  Steps steps{machine, plate_mm, nominal, options, {}};
  steps.known.lead_mm = nominal.lead_mm;
  steps.lay_frame();
  steps.gear_ratios();
  steps.lay_frame();  // new ratios, new home
  steps.axis_skew();
  steps.attitude_table();
  return steps.known;
}

Decoupled decoupled_as_printed(const Vector2d& move_mm, double angle_rad, double alpha1_rad) {
  const double factor = std::sin(alpha1_rad) / std::sin(2.0 * angle_rad + alpha1_rad);
  return {(move_mm.x() + move_mm.y() / std::tan(angle_rad + alpha1_rad)) * factor,
          (move_mm.y() - move_mm.x() * std::tan(angle_rad)) * factor};
}

Decoupled decoupled(const Vector2d& move_mm, double angle_rad, double alpha1_rad) {
  return {move_mm.x() - move_mm.y() / std::tan(angle_rad + alpha1_rad),
          move_mm.y() - move_mm.x() * std::tan(angle_rad)};
}

Eigen::Vector3d triangle_shares(const Vector2d& point, const Vector2d& a, const Vector2d& b,
                                const Vector2d& c) {
  if (on_a_line(a, b, c))
    throw MotionError(
        fmt::format("triangle: found corners ({}, {}), ({}, {}), ({}, {}) on a line, expected an area", a.x(),
                    a.y(), b.x(), b.y(), c.x(), c.y()));
  const double area = cross(b - a, c - a);
  const double first = cross(b - point, c - point) / area, second = cross(c - point, a - point) / area;
  return {first, second, 1.0 - first - second};
}

PrpTurns staged_turns(const StagedCalibration& calibration, const PrpGeometry& nominal,
                      const std::vector<Vector2d>& seen_mm, const std::vector<Vector2d>& wanted_mm,
                      Decoupling decoupling) {
  const PoseFit fit = fit_pose(seen_mm, wanted_mm);
  const TablePlace place = place_of(calibration, fit.pose.angle_rad);
  Vector2d move_mm = Vector2d::Zero();
  for (std::size_t i = 0; i < seen_mm.size(); ++i)
    move_mm += wanted_mm[i] - turned_mark(calibration, place, seen_mm[i]);
  move_mm /= static_cast<double>(seen_mm.size());
  const Decoupled shift = decoupling(move_mm, fit.pose.angle_rad, calibration.alpha1_rad);
  const double low = calibration.nodes[place.lower].difference_mm;
  const double high = calibration.nodes[place.lower + 1].difference_mm;
  const double half_mm = 0.5 * (low + place.share * (high - low));
  const PrpTurns turns(shift.first_mm / calibration.lead_mm[0],
                       (shift.others_mm - half_mm) / calibration.lead_mm[1],
                       (shift.others_mm + half_mm) / calibration.lead_mm[2]);
  check_stroke(nominal, turns);
  return calibration.home + turns;
}

double node_interval(double tolerance, double largest_second_derivative) {
  if (!(tolerance > 0.0) || !(largest_second_derivative > 0.0))
    throw MotionError(
        fmt::format("interval rule: found tolerance {} and second derivative {}, expected both above 0",
                    tolerance, largest_second_derivative));
  return std::sqrt(8.0 * tolerance / largest_second_derivative);
}

}  // namespace meltstage::motion
