// SPDX-License-Identifier: Apache-2.0
// Cubic NURBS curves: through points, evaluated, and measured along.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace meltstage::motion {

/// Position and derivatives by the curve's parameter at one place.
struct CurvePoint {
  Eigen::Vector3d position_mm, first, second, third;
};

/// A cubic NURBS curve over u in [0, 1], clamped at both ends (Xu et al. 2024, eqs. (2), (3)). It doesn't
/// change.
class Nurbs {
 public:
  static constexpr std::size_t kDegree = 3;

  /// `controls` are homogeneous: (w x, w y, w z, w) with w > 0; `knots` are four more than controls, not
  /// falling, the first four 0, the last four 1, and no inner one more than three times.
  /// @throws MotionError if they aren't.
  Nurbs(std::vector<double> knots, std::vector<Eigen::Vector4d> controls);

  /// Position at `u`; below 0 and above 1 that of the end.
  Eigen::Vector3d position_mm(double u) const;
  /// Position and derivatives at `u`, held to [0, 1]; at a knot those of the span which begins there.
  CurvePoint at(double u) const;
  /// 1 / radius of curvature at `u`; 0 where the curve stands still.
  double curvature_1_mm(double u) const;

  const std::vector<double>& knots() const { return knots_; }
  const std::vector<Eigen::Vector4d>& controls() const { return controls_; }

 private:
  std::size_t span_of(double u) const;

  std::vector<double> knots_;
  std::vector<Eigen::Vector4d> controls_;
  std::vector<std::uint32_t> first_span_;  ///< of each of equal parts of [0, 1]; one more than parts
  double parts_ = 1.0;
};

/// How the points' parameters follow from their distances d: u grows by d (chord length) or sqrt(d)
/// (centripetal, Lee 1989: closer to the polygon where distances differ much).
enum class Parameters { chord_length, centripetal };

/// What closes the equations at each end: the second and last but one points are no knots of the third
/// derivative (error O(h^4) up to the ends), or no curvature there (O(h^2)).
enum class EndCondition { not_a_knot, natural };

struct InterpolationOptions {
  Parameters parameters = Parameters::chord_length;
  EndCondition ends = EndCondition::not_a_knot;
  std::vector<double> weights = {};  ///< of the points, each > 0; none: all 1
};

/// Parameters 0..1 of the points.
/// @throws MotionError if there are fewer than two points, one isn't finite, or two in a row coincide.
std::vector<double> point_parameters(std::span<const Eigen::Vector3d> points_mm, Parameters parameters);

/// The cubic NURBS through all points, in O(n): the tangents solve a tridiagonal system, the control points
/// follow from them. Knots are the points' parameters. Two points give a line, three a parabola (or, with
/// natural ends, its cubic).
/// @throws MotionError as point_parameters(), or if weights don't fit or make a control weight not positive.
Nurbs interpolate(std::span<const Eigen::Vector3d> points_mm, const InterpolationOptions& options = {});

/// The same with given parameters, rising from 0 to 1.
Nurbs interpolate(std::span<const Eigen::Vector3d> points_mm, std::span<const double> parameters,
                  const InterpolationOptions& options = {});

/// Length along a curve, and the way back.
class ArcLength {
 public:
  explicit ArcLength(const Nurbs& curve);
  double total_mm() const { return lengths_mm_.back(); }
  double length_mm(double u) const;  ///< from the start
  /// Where the curve has this length; held to the ends. Newton's steps to the last bit but few.
  double parameter(double length_mm) const;

 private:
  double within_mm(double from, double to) const;

  const Nurbs* curve_;
  std::vector<double> borders_, lengths_mm_;
};

}  // namespace meltstage::motion
