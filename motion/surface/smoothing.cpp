// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/smoothing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/golden_section.hpp"
#include "motion/profile/profile.hpp"

namespace meltstage::motion {

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

/// The logarithm of the smoothing with the least score of all. A score may have several valleys; each one
/// that a scan shows is gone down.
template <class Score>
double best_of_all(const Score& score) {
  constexpr double kLowest = -15.0, kStep = 0.5;
  constexpr int kNarrowed = 16;
  constexpr std::size_t kScanned = 79;  // up to 24
  const auto place = [](std::size_t i) { return kLowest + kStep * static_cast<double>(i); };
  std::array<double, kScanned> scanned;
  for (std::size_t i = 0; i < kScanned; ++i) scanned[i] = score(place(i));
  std::pair<double, double> best(scanned[0], kLowest);
  for (std::size_t i = 0; i < kScanned; ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, behind = std::min(i + 1, kScanned - 1);
    best = std::min(best, {scanned[i], place(i)});
    if (scanned[i] <= scanned[before] && scanned[i] <= scanned[behind])
      best = std::min(best, least_between(score, place(before), place(behind), kNarrowed));
  }
  return best.second;
}

}  // namespace

SmoothedValues smooth(std::span<const double> parameters, const Eigen::MatrixXd& measured, double noise) {
  const std::size_t n = parameters.size();
  if (n < 4 || static_cast<std::size_t>(measured.rows()) != n)
    throw MotionError(
        fmt::format("smoothing: found {} parameters for {} points, expected one a point and at least 4", n,
                    measured.rows()));
  if (!(noise >= 0.0) || !std::isfinite(noise))
    throw MotionError(
        fmt::format("smoothing: found noise {}, expected a finite number, 0 for unknown", noise));
  if (!measured.allFinite())
    throw MotionError("smoothing: a measured value isn't finite, expected finite numbers");
  // Over steps of mean 1, so that the range of smoothings to search doesn't depend on units.
  std::vector<double> h(n - 1);
  const double scale = static_cast<double>(n - 1) / (parameters.back() - parameters.front());
  for (std::size_t i = 0; i + 1 < n; ++i) {
    h[i] = (parameters[i + 1] - parameters[i]) * scale;
    if (!(h[i] > 0.0))
      throw MotionError(fmt::format("parameter {}: found {} after {}, expected more", i + 2,
                                    parameters[i + 1], parameters[i]));
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

}  // namespace meltstage::motion
