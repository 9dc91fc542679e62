// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/nurbs.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "motion/profile/check_positive.hpp"

namespace meltstage::motion {

namespace {

constexpr std::size_t kDegree = 3;

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

// ---------------------------------------------------------------- smoothing

namespace {

/// The smoothing spline's system for one smoothing: (R + s Q'Q) g = Q' y, a matrix of five bands, as L D L'.
class Reinsch {
 public:
  Reinsch(const std::vector<double>& h, double smoothing) : h_(h), smoothing_(smoothing) {
    const std::size_t m = h.size() - 1;  // inner points
    d_.resize(m), l1_.resize(m), l2_.resize(m);
    for (std::size_t i = 0; i < m; ++i) {
      const auto q = column(i);
      double a = (h[i] + h[i + 1]) / 3.0 + smoothing * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
      double b = 0.0, c = 0.0;  // towards the next row and the one after it
      if (i + 1 < m) {
        const auto p = column(i + 1);
        b = h[i + 1] / 6.0 + smoothing * (q[1] * p[0] + q[2] * p[1]);
      }
      if (i + 2 < m) c = smoothing * q[2] * column(i + 2)[0];
      if (i >= 1) {
        a -= d_[i - 1] * l1_[i - 1] * l1_[i - 1];
        b -= d_[i - 1] * l1_[i - 1] * l2_[i - 1];
      }
      if (i >= 2) a -= d_[i - 2] * l2_[i - 2] * l2_[i - 2];
      d_[i] = a, l1_[i] = b / a, l2_[i] = c / a;
    }
  }

  /// y - fitted values
  Eigen::VectorXd residual(const Eigen::VectorXd& y) const {
    const std::size_t m = d_.size();
    Eigen::VectorXd g(m);
    for (std::size_t i = 0; i < m; ++i) {
      const auto q = column(i);
      g[i] = q[0] * y[i] + q[1] * y[i + 1] + q[2] * y[i + 2];
      if (i >= 1) g[i] -= l1_[i - 1] * g[i - 1];
      if (i >= 2) g[i] -= l2_[i - 2] * g[i - 2];
    }
    for (std::size_t i = m; i-- > 0;) {
      g[i] /= d_[i];
      if (i + 1 < m) g[i] -= l1_[i] * g[i + 1];
      if (i + 2 < m) g[i] -= l2_[i] * g[i + 2];
    }
    Eigen::VectorXd out = Eigen::VectorXd::Zero(y.size());
    for (std::size_t i = 0; i < m; ++i) {
      const auto q = column(i);
      for (int k = 0; k < 3; ++k) out[i + k] += smoothing_ * q[k] * g[i];
    }
    return out;
  }

  /// Diagonal of the hat matrix 1 - s Q (R + s Q'Q)^-1 Q', from the inverse's five bands.
  Eigen::VectorXd hat_diagonal() const {
    const std::size_t m = d_.size();
    std::vector<double> b0(m + 2), b1(m + 2), b2(m + 2);
    for (std::size_t i = m; i-- > 0;) {
      const double l1 = i + 1 < m ? l1_[i] : 0.0, l2 = i + 2 < m ? l2_[i] : 0.0;
      b1[i] = -l1 * b0[i + 1] - l2 * b1[i + 1];
      b2[i] = -l1 * b1[i + 1] - l2 * b0[i + 2];
      b0[i] = 1.0 / d_[i] - l1 * b1[i] - l2 * b2[i];
    }
    Eigen::VectorXd hat = Eigen::VectorXd::Ones(m + 2);
    for (std::size_t i = 0; i < m; ++i) {
      const auto q = column(i);
      for (int k = 0; k < 3; ++k) hat[i + k] -= smoothing_ * q[k] * q[k] * b0[i];
      if (i + 1 < m) {
        const auto p = column(i + 1);
        hat[i + 1] -= 2.0 * smoothing_ * q[1] * p[0] * b1[i];
        hat[i + 2] -= 2.0 * smoothing_ * q[2] * p[1] * b1[i];
      }
      if (i + 2 < m) hat[i + 2] -= 2.0 * smoothing_ * q[2] * column(i + 2)[0] * b2[i];
    }
    return hat;
  }

 private:
  /// Entries of column i of Q, in rows i, i + 1, i + 2.
  std::array<double, 3> column(std::size_t i) const {
    const double a = 1.0 / h_[i], b = 1.0 / h_[i + 1];
    return {a, -a - b, b};
  }

  const std::vector<double>& h_;
  double smoothing_;
  std::vector<double> d_, l1_, l2_;
};

/// Golden section for the least of low..high.
template <class Score>
std::pair<double, double> least_between(double low, double high, const Score& score) {
  constexpr double kGolden = 0.6180339887498949;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double score_a = score(a), score_b = score(b);
  for (int i = 0; i < 16; ++i) {
    if (score_a < score_b) {
      high = b, b = a, score_b = score_a;
      score_a = score(a = high - kGolden * (high - low));
    } else {
      low = a, a = b, score_a = score_b;
      score_b = score(b = low + kGolden * (high - low));
    }
  }
  return score_a < score_b ? std::pair(score_a, a) : std::pair(score_b, b);
}

/// The logarithm of the smoothing with the least score of all. A score may have several valleys; each one
/// that a scan shows is gone down.
template <class Score>
double best_of_all(const Score& score) {
  constexpr double kLowest = -15.0, kStep = 0.5;
  constexpr std::size_t kPlaces = 79;  // up to 24
  const auto place = [](std::size_t i) { return kLowest + kStep * static_cast<double>(i); };
  std::array<double, kPlaces> scanned;
  for (std::size_t i = 0; i < kPlaces; ++i) scanned[i] = score(place(i));
  std::pair<double, double> best(scanned[0], kLowest);
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, behind = std::min(i + 1, kPlaces - 1);
    best = std::min(best, {scanned[i], place(i)});
    if (scanned[i] <= scanned[before] && scanned[i] <= scanned[behind])
      best = std::min(best, least_between(place(before), place(behind), score));
  }
  return best.second;
}

}  // namespace

SmoothedValues smooth(std::span<const double> parameters, const Eigen::MatrixXd& measured, double noise) {
  const std::size_t n = parameters.size();
  if (n < 4 || static_cast<std::size_t>(measured.rows()) != n)
    fail(fmt::format("smoothing: found {} parameters for {} points, expected one a point and at least 4", n,
                     measured.rows()));
  if (!(noise >= 0.0) || !std::isfinite(noise))
    fail(fmt::format("smoothing: found noise {}, expected a finite number, 0 for unknown", noise));
  if (!measured.allFinite()) fail("smoothing: a measured value isn't finite, expected finite numbers");
  // Over steps of mean 1, so that the range of smoothings to search doesn't depend on units.
  std::vector<double> h(n - 1);
  const double scale = static_cast<double>(n - 1) / (parameters.back() - parameters.front());
  for (std::size_t i = 0; i + 1 < n; ++i) {
    h[i] = (parameters[i + 1] - parameters[i]) * scale;
    if (!(h[i] > 0.0))
      fail(fmt::format("parameter {}: found {} after {}, expected more", i + 2, parameters[i + 1],
                       parameters[i]));
  }
  const double count = static_cast<double>(n), columns = static_cast<double>(measured.cols());
  struct Fit {
    Eigen::MatrixXd residuals;
    Eigen::VectorXd hat;
    double score;
  };
  const auto fit = [&](double log_smoothing) {
    const Reinsch system(h, std::exp(log_smoothing));
    Fit out{Eigen::MatrixXd(measured.rows(), measured.cols()), system.hat_diagonal(), 0.0};
    for (Eigen::Index c = 0; c < measured.cols(); ++c)
      out.residuals.col(c) = system.residual(measured.col(c));
    const double mean_square = out.residuals.squaredNorm() / (count * columns);
    const double free = 1.0 - out.hat.sum() / count;
    out.score = noise > 0.0 ? mean_square - 2.0 * noise * noise * free : mean_square / (free * free);
    return out;
  };
  const Fit chosen = fit(best_of_all([&](double x) { return fit(x).score; }));
  SmoothedValues out;
  out.values = measured - chosen.residuals;
  out.freedom = chosen.hat.sum();
  const double sum = chosen.residuals.squaredNorm();
  out.rms_residual = std::sqrt(sum / (count * columns));
  out.noise = noise > 0.0 ? noise : std::sqrt(sum / (columns * (count - out.freedom)));
  out.standard_error = out.noise * chosen.hat.cwiseMax(0.0).cwiseSqrt();
  return out;
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

// ---------------------------------------------------------------- feed

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
    for (std::size_t i = kDegree; i + kDegree + 1 < knots.size(); ++i) {
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
