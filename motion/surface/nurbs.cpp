// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/nurbs.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "motion/profile/check_positive.hpp"
#include "motion/profile/profile.hpp"

namespace meltstage::motion {

namespace {

constexpr std::size_t kDegree = Nurbs::kDegree;

/// The four basis functions that aren't zero in span `k`, by the triangle of Cox and de Boor.
std::array<double, 4> basis(const double* knots, std::size_t k, double u) {
  const double l1 = u - knots[k], l2 = u - knots[k - 1], l3 = u - knots[k - 2];
  const double r1 = knots[k + 1] - u, r2 = knots[k + 2] - u, r3 = knots[k + 3] - u;
  // All six quotients depend on knots alone, so that they overlap in the processor.
  const double q11 = 1.0 / (r1 + l1);
  const double q21 = 1.0 / (r1 + l2), q22 = 1.0 / (r2 + l1);
  const double q31 = 1.0 / (r1 + l3), q32 = 1.0 / (r2 + l2), q33 = 1.0 / (r3 + l1);
  const double a0 = r1 * q11, a1 = l1 * q11;
  const double t0 = a0 * q21, t1 = a1 * q22;
  const double b0 = r1 * t0, b1 = l2 * t0 + r2 * t1, b2 = l1 * t1;
  const double s0 = b0 * q31, s1 = b1 * q32, s2 = b2 * q33;
  return {r1 * s0, l3 * s0 + r2 * s1, l2 * s1 + r3 * s2, l1 * s2};
}

[[noreturn]] void fail(const std::string& message) { throw MotionError(message); }

void check_knots(const std::vector<double>& knots, std::size_t controls) {
  if (controls < kDegree + 1)
    fail(fmt::format("curve: found {} control points, expected at least {}", controls, kDegree + 1));
  if (knots.size() != controls + kDegree + 1)
    fail(fmt::format("curve: found {} knots for {} control points, expected {}", knots.size(), controls,
                     controls + kDegree + 1));
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const bool start = i <= kDegree, end = i >= controls;
    if ((start && knots[i] != 0.0) || (end && knots[i] != 1.0))
      fail(fmt::format("curve: knot {} is {}, expected {} (four at each end)", i, knots[i], start ? 0 : 1));
    if (!start && !(knots[i] >= knots[i - 1]))
      fail(fmt::format("curve: knot {} is {} after {}, expected no less", i, knots[i], knots[i - 1]));
    if (!start && !end && knots[i] == knots[i - kDegree])
      fail(fmt::format("curve: knot {} is {} for the fourth time, expected three at most", i, knots[i]));
  }
}

void check_controls(const std::vector<Eigen::Vector4d>& controls) {
  for (std::size_t i = 0; i < controls.size(); ++i)
    if (!controls[i].allFinite() || !(controls[i].w() > 0.0))
      fail(
          fmt::format("curve: control point {} is ({}, {}, {}) with weight {}, expected finite numbers and a "
                      "weight above 0",
                      i, controls[i].x(), controls[i].y(), controls[i].z(), controls[i].w()));
}

}  // namespace

Nurbs::Nurbs(std::vector<double> knots, std::vector<Eigen::Vector4d> controls)
    : knots_(std::move(knots)), controls_(std::move(controls)) {
  check_knots(knots_, controls_.size());
  double least_weight = controls_[0].w();
  Eigen::Array4d sum = Eigen::Array4d::Zero();
  for (const Eigen::Vector4d& control : controls_) {
    sum += control.array();
    least_weight = std::min(least_weight, control.w());
  }
  if (!(least_weight > 0.0) || !std::isfinite(sum.sum())) check_controls(controls_);
  const std::size_t parts = controls_.size() - kDegree;
  parts_ = static_cast<double>(parts);
  first_span_.resize(parts + 1);
  std::size_t span = kDegree;
  for (std::size_t i = 0; i <= parts; ++i) {
    while (span + 1 < controls_.size() && knots_[span + 1] * parts_ <= static_cast<double>(i)) ++span;
    first_span_[i] = static_cast<std::uint32_t>(span);
  }
}

std::size_t Nurbs::span_of(double u) const {
  const std::size_t part = std::min(static_cast<std::size_t>(u * parts_), first_span_.size() - 2);
  // Rounding of u * parts may name the next part at its border.
  std::size_t low = first_span_[part], high = first_span_[part + 1];
  if (u < knots_[low]) low = first_span_[part - 1];
  while (high - low > 8) {
    const std::size_t middle = (low + high) / 2;
    (knots_[middle] <= u ? low : high) = middle;
  }
  while (low + 1 < controls_.size() && knots_[low + 1] <= u) ++low;
  return low;
}

Eigen::Vector3d Nurbs::position_mm(double u) const {
  u = std::clamp(u, 0.0, 1.0);
  const std::size_t k = span_of(u);
  const auto n = basis(knots_.data(), k, u);
  const Eigen::Vector4d* p = controls_.data() + (k - kDegree);
  const Eigen::Vector4d sum = n[0] * p[0] + n[1] * p[1] + n[2] * p[2] + n[3] * p[3];
  return sum.head<3>() / sum.w();
}

CurvePoint Nurbs::at(double u) const {
  u = std::clamp(u, 0.0, 1.0);
  const std::size_t k = span_of(u);
  const double* t = knots_.data();
  const Eigen::Vector4d* p = controls_.data() + (k - kDegree);
  // Control points of the derivatives, each a curve of one degree less (Piegl & Tiller 1997, eq. (3.8)).
  std::array<Eigen::Vector4d, 3> d1;
  for (std::size_t i = 0; i < 3; ++i) d1[i] = 3.0 * (p[i + 1] - p[i]) / (t[k + 1 + i] - t[k - 2 + i]);
  std::array<Eigen::Vector4d, 2> d2;
  for (std::size_t i = 0; i < 2; ++i) d2[i] = 2.0 * (d1[i + 1] - d1[i]) / (t[k + 1 + i] - t[k - 1 + i]);
  const double width = t[k + 1] - t[k];
  const Eigen::Vector4d h3 = (d2[1] - d2[0]) / width;
  const double left = (t[k + 1] - u) / width, right = (u - t[k]) / width;
  const Eigen::Vector4d h2 = left * d2[0] + right * d2[1];
  const double w0 = (t[k + 1] - u) / (t[k + 1] - t[k - 1]), w1 = (t[k + 2] - u) / (t[k + 2] - t[k]);
  const Eigen::Vector4d h1 =
      left * (w0 * d1[0] + (1.0 - w0) * d1[1]) + right * (w1 * d1[1] + (1.0 - w1) * d1[2]);
  const auto n = basis(t, k, u);
  const Eigen::Vector4d h0 = n[0] * p[0] + n[1] * p[1] + n[2] * p[2] + n[3] * p[3];
  // Quotient rule.
  CurvePoint out;
  const double w = h0.w();
  out.position_mm = h0.head<3>() / w;
  out.first = (h1.head<3>() - h1.w() * out.position_mm) / w;
  out.second = (h2.head<3>() - 2.0 * h1.w() * out.first - h2.w() * out.position_mm) / w;
  out.third =
      (h3.head<3>() - 3.0 * h1.w() * out.second - 3.0 * h2.w() * out.first - h3.w() * out.position_mm) / w;
  return out;
}

double Nurbs::curvature_1_mm(double u) const {
  const CurvePoint here = at(u);
  const double speed = here.first.norm();
  return speed == 0.0 ? 0.0 : here.first.cross(here.second).norm() / (speed * speed * speed);
}

// ---------------------------------------------------------------- interpolation

namespace {

void check_points(std::span<const Eigen::Vector3d> points_mm) {
  if (points_mm.size() < 2)
    fail(fmt::format("curve: found {} points, expected at least 2", points_mm.size()));
}

[[noreturn]] void fail_point(std::span<const Eigen::Vector3d> points_mm, std::size_t i) {
  fail(fmt::format("point {}: found ({}, {}, {}), expected finite numbers", i + 1, points_mm[i].x(),
                   points_mm[i].y(), points_mm[i].z()));
}

/// Writes the points' parameters, as many as there are points.
void fill_parameters(std::span<const Eigen::Vector3d> points_mm, Parameters parameters, double* u) {
  check_points(points_mm);
  const std::size_t last = points_mm.size() - 1;
  double sum = 0.0;
  u[0] = 0.0;
  for (std::size_t i = 0; i < last; ++i) {
    const double distance_mm = (points_mm[i + 1] - points_mm[i]).norm();
    if (!(distance_mm > 0.0) || !std::isfinite(distance_mm)) {
      if (!points_mm[i].allFinite()) fail_point(points_mm, i);
      if (!points_mm[i + 1].allFinite()) fail_point(points_mm, i + 1);
      fail(
          fmt::format("points {} and {}: both are ({:.6g}, {:.6g}, {:.6g}) mm, expected distinct points; "
                      "remove one",
                      i + 1, i + 2, points_mm[i].x(), points_mm[i].y(), points_mm[i].z()));
    }
    sum += parameters == Parameters::centripetal ? std::sqrt(distance_mm) : distance_mm;
    u[i + 1] = sum;
  }
  const double scale = 1.0 / sum;
  for (std::size_t i = 1; i < last; ++i) u[i] *= scale;
  u[last] = 1.0;
  for (std::size_t i = 1; i <= last; ++i)
    if (!(u[i] > u[i - 1]))
      fail(fmt::format(
          "points {} and {}: too close for a curve of {:.6g} mm, expected distinct points; remove "
          "one",
          i, i + 1, sum));
}

/// Knots 0 0 0 0 u1 .. 1 1 1 1, the points' parameters with the ends four times (eq. (2)); without parameters
/// yet.
std::vector<double> empty_knots(std::size_t points) {
  std::vector<double> knots(points + 2 * kDegree);
  std::fill_n(knots.end() - kDegree, kDegree, 1.0);
  return knots;
}

/// A C2 cubic spline through points: its tangents by parameter, and from them the control points, in one
/// array.
class SplineSolver {
 public:
  SplineSolver(std::span<const Eigen::Vector3d> points_mm, const double* u,
               const InterpolationOptions& options)
      : points_(points_mm),
        weights_(options.weights),
        u_(u),
        last_(points_mm.size() - 1),
        controls_(points_mm.size() + 2) {
    if (last_ == 1) {
      tangent(0) = tangent(1) = slope(0);
    } else if (last_ == 2 && options.ends == EndCondition::not_a_knot) {
      const Eigen::Array4d bend = (slope(1) - slope(0)) / (step(0) + step(1));
      tangent(0) = slope(0) - step(0) * bend;
      tangent(1) = slope(0) + step(0) * bend;
      tangent(2) = slope(1) + step(1) * bend;
    } else {
      solve_tangents(options.ends);
    }
    to_controls();
  }

  std::vector<Eigen::Vector4d> take() { return std::move(controls_); }

 private:
  /// Homogeneous point.
  Eigen::Array4d point(std::size_t i) const {
    const Eigen::Vector3d& p = points_[i];
    const Eigen::Array4d out(p.x(), p.y(), p.z(), 1.0);
    if (weights_.empty()) return out;
    return out * weights_[i];
  }
  double step(std::size_t i) const { return u_[i + 1] - u_[i]; }
  Eigen::Array4d slope(std::size_t i) const { return (point(i + 1) - point(i)) * (1.0 / step(i)); }
  /// Tangents stand where their points' control points will.
  Eigen::ArrayWrapper<Eigen::Vector4d> tangent(std::size_t i) { return controls_[i + 1].array(); }

  /// One row of the tridiagonal system, eliminated by the row before it (Thomas).
  void row(std::size_t i, double below, double diagonal, double above, const Eigen::Array4d& right) {
    const double scale = 1.0 / (diagonal - below * upper_[i - 1]);
    upper_[i] = above * scale;
    tangent(i) = (right - below * tangent(i - 1)) * scale;
  }

  void solve_tangents(EndCondition ends) {
    upper_.resize(last_ + 1);
    Eigen::Array4d before = slope(0);
    double h = step(0);
    if (ends == EndCondition::natural) {
      upper_[0] = 0.5;
      tangent(0) = 1.5 * before;
    } else {
      const double next = step(1), both = h + next;
      upper_[0] = both / next;
      tangent(0) = ((h + 2.0 * both) * next * before + h * h * slope(1)) / (both * next);
    }
    for (std::size_t i = 1; i < last_; ++i) {
      const double next = step(i);
      const Eigen::Array4d after = slope(i);
      row(i, next, 2.0 * (h + next), h, 3.0 * (next * before + h * after));
      before = after;
      h = next;
    }
    if (ends == EndCondition::natural) {
      row(last_, 1.0, 2.0, 0.0, 3.0 * before);
    } else {
      const double a = step(last_ - 2), both = a + h;
      row(last_, both, a, 0.0, (h * h * slope(last_ - 2) + (2.0 * both + h) * a * before) / both);
    }
    for (std::size_t i = last_; i-- > 0;) tangent(i) -= upper_[i] * tangent(i + 1);
  }

  /// A control point is the blossom of a span's cubic at three neighbouring knots; of the two spans at a knot
  /// the longer is taken, from which less is extrapolated.
  void to_controls() {
    const Eigen::Array4d first = tangent(0), end = tangent(last_);
    Eigen::Array4d m_before = first, m = tangent(1);
    Eigen::Array4d y_before = point(0), y = point(1);
    double h_before = step(0);
    controls_[0] = y_before;
    controls_[1] = y_before + h_before * first / 3.0;
    for (std::size_t i = 1; i < last_; ++i) {
      const Eigen::Array4d y_after = point(i + 1), m_after = tangent(i + 1);
      const double h = step(i), both = h_before + h;
      if (h_before > h)
        tangent(i) = y - (m * both + h * m_before) / 3.0 + (y - y_before) * (h / h_before);
      else
        tangent(i) = y + (m * both + h_before * m_after) / 3.0 - (y_after - y) * (h_before / h);
      y_before = y, y = y_after, m_before = m, m = m_after, h_before = h;
    }
    controls_[last_ + 1] = point(last_) - step(last_ - 1) * end / 3.0;
    controls_[last_ + 2] = point(last_);
  }

  std::span<const Eigen::Vector3d> points_;
  std::span<const double> weights_;
  const double* u_;
  std::size_t last_;
  std::vector<Eigen::Vector4d> controls_;
  std::vector<double> upper_;  ///< of the eliminated rows, whose diagonal is 1
};

Nurbs through(std::span<const Eigen::Vector3d> points_mm, std::vector<double> knots,
              const InterpolationOptions& options) {
  const std::size_t n = points_mm.size();
  if (!options.weights.empty() && options.weights.size() != n)
    fail(fmt::format("weights: found {} for {} points, expected one a point", options.weights.size(), n));
  for (std::size_t i = 0; i < options.weights.size(); ++i)
    if (!(options.weights[i] > 0.0) || !std::isfinite(options.weights[i]))
      fail(fmt::format("weight {}: found {}, expected a finite number above 0", i + 1, options.weights[i]));
  SplineSolver solver(points_mm, knots.data() + kDegree, options);
  return {std::move(knots), solver.take()};
}

}  // namespace

std::vector<double> point_parameters(std::span<const Eigen::Vector3d> points_mm, Parameters parameters) {
  std::vector<double> u(std::max<std::size_t>(1, points_mm.size()));
  fill_parameters(points_mm, parameters, u.data());
  return u;
}

Nurbs interpolate(std::span<const Eigen::Vector3d> points_mm, const InterpolationOptions& options) {
  std::vector<double> knots = empty_knots(std::max<std::size_t>(1, points_mm.size()));
  fill_parameters(points_mm, options.parameters, knots.data() + kDegree);
  return through(points_mm, std::move(knots), options);
}

Nurbs interpolate(std::span<const Eigen::Vector3d> points_mm, std::span<const double> parameters,
                  const InterpolationOptions& options) {
  check_points(points_mm);
  if (parameters.size() != points_mm.size() || parameters.front() != 0.0 || parameters.back() != 1.0)
    fail(fmt::format("parameters: found {} for {} points, expected one a point from 0 to 1",
                     parameters.size(), points_mm.size()));
  for (std::size_t i = 1; i < parameters.size(); ++i)
    if (!(parameters[i] > parameters[i - 1]))
      fail(fmt::format("parameter {}: found {} after {}, expected more", i + 1, parameters[i],
                       parameters[i - 1]));
  for (std::size_t i = 0; i < points_mm.size(); ++i)
    if (!points_mm[i].allFinite()) fail_point(points_mm, i);
  std::vector<double> knots = empty_knots(points_mm.size());
  std::copy(parameters.begin(), parameters.end(), knots.begin() + kDegree);
  return through(points_mm, std::move(knots), options);
}

// ---------------------------------------------------------------- length

namespace {

/// Gauss-Legendre, eight places.
constexpr std::array<double, 4> kPlaces{0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                        0.9602898564975363};
constexpr std::array<double, 4> kWeights{0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                         0.1012285362903763};

double gauss_mm(const Nurbs& curve, double from, double to) {
  const double middle = 0.5 * (from + to), half = 0.5 * (to - from);
  double sum = 0.0;
  for (std::size_t i = 0; i < kPlaces.size(); ++i)
    sum += kWeights[i] * (curve.at(middle - half * kPlaces[i]).first.norm() +
                          curve.at(middle + half * kPlaces[i]).first.norm());
  return half * sum;
}

/// Adds borders until halving a part no longer changes its length.
void add_part(const Nurbs& curve, double from, double to, double whole_mm, std::vector<double>& borders,
              std::vector<double>& lengths_mm, int depth) {
  constexpr double kRelative = 1e-12;
  constexpr int kDeepest = 12;
  const double middle = 0.5 * (from + to);
  const double left_mm = gauss_mm(curve, from, middle), right_mm = gauss_mm(curve, middle, to);
  if (depth < kDeepest && std::abs(left_mm + right_mm - whole_mm) > kRelative * whole_mm) {
    add_part(curve, from, middle, left_mm, borders, lengths_mm, depth + 1);
    add_part(curve, middle, to, right_mm, borders, lengths_mm, depth + 1);
    return;
  }
  borders.push_back(to);
  lengths_mm.push_back(lengths_mm.back() + left_mm + right_mm);
}

}  // namespace

ArcLength::ArcLength(const Nurbs& curve) : curve_(&curve), borders_{0.0}, lengths_mm_{0.0} {
  const auto& knots = curve.knots();
  for (std::size_t i = kDegree; i + kDegree + 1 < knots.size(); ++i)
    if (knots[i + 1] > knots[i])
      add_part(curve, knots[i], knots[i + 1], gauss_mm(curve, knots[i], knots[i + 1]), borders_, lengths_mm_,
               0);
}

double ArcLength::within_mm(double from, double to) const { return gauss_mm(*curve_, from, to); }

double ArcLength::length_mm(double u) const {
  u = std::clamp(u, 0.0, 1.0);
  const auto after = std::upper_bound(borders_.begin() + 1, borders_.end() - 1, u);
  const auto i = static_cast<std::size_t>(after - borders_.begin()) - 1;
  return lengths_mm_[i] + within_mm(borders_[i], u);
}

double ArcLength::parameter(double length_mm) const {
  if (!(length_mm > 0.0)) return 0.0;
  if (length_mm >= total_mm()) return 1.0;
  const auto after = std::upper_bound(lengths_mm_.begin() + 1, lengths_mm_.end() - 1, length_mm);
  const auto i = static_cast<std::size_t>(after - lengths_mm_.begin()) - 1;
  const double way_mm = length_mm - lengths_mm_[i], part_mm = lengths_mm_[i + 1] - lengths_mm_[i];
  double low = borders_[i], high = borders_[i + 1];
  double u = low + (high - low) * way_mm / part_mm;
  // Newton, kept inside the part: the speed may be zero at a cusp.
  for (int step = 0; step < 50; ++step) {
    const double excess_mm = within_mm(borders_[i], u) - way_mm;
    if (std::abs(excess_mm) <= 4e-16 * total_mm()) break;
    (excess_mm > 0.0 ? high : low) = u;
    const double speed = curve_->at(u).first.norm();
    double next = speed > 0.0 ? u - excess_mm / speed : low;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == u) break;
    u = next;
  }
  return u;
}

}  // namespace meltstage::motion
