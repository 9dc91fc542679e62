// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/nurbs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "motion/surface/curve_feed.hpp"
#include "motion/surface/measuring_points.hpp"
#include "motion/surface/smoothing.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;
using Points = std::vector<Eigen::Vector3d>;

Points wander(int count, std::uint64_t seed, double step_mm = 0.3) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Points out;
  Eigen::Vector3d at(5.0, -3.0, 1.0);
  for (int i = 0; i < count; ++i) {
    at +=
        std::exp(normal(random)) * step_mm * Eigen::Vector3d(1.0, 0.3 * normal(random), 0.3 * normal(random));
    out.push_back(at);
  }
  return out;
}

double largest_error_mm(const Nurbs& curve, const Points& points, Parameters parameters) {
  const std::vector<double> u = point_parameters(points, parameters);
  double worst = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i)
    worst = std::max(worst, (curve.position_mm(u[i]) - points[i]).norm());
  return worst;
}

TEST(Interpolation, GoesThroughEveryPoint) {
  for (const int count : {2, 3, 4, 5, 17, 400, 10'000})
    for (const auto parameters : {Parameters::chord_length, Parameters::centripetal})
      for (const auto ends : {EndCondition::not_a_knot, EndCondition::natural}) {
        const Points points = wander(count, count, count > 1000 ? 0.01 : 0.3);  // within 200 mm
        const Nurbs curve = interpolate(points, {.parameters = parameters, .ends = ends});
        EXPECT_LE(largest_error_mm(curve, points, parameters), 1e-12) << count;
      }
}

TEST(Interpolation, SeesAPointThatIsMoved) {
  Points points = wander(100, 3);
  const Nurbs curve = interpolate(points);
  points[50].z() += 1e-9;
  EXPECT_GT(largest_error_mm(curve, points, Parameters::chord_length), 1e-10);
}

TEST(Interpolation, HasKnotsAndControlPointsAsInThePaper) {
  const Points points = wander(12, 1);  // l = 11, k = 3
  const Nurbs curve = interpolate(points);
  EXPECT_EQ(curve.knots().size(), 18U);     // m + 1, m = l + 2 k
  EXPECT_EQ(curve.controls().size(), 14U);  // n + 1, n = l + k - 1
  const std::vector<double> u = point_parameters(points, Parameters::chord_length);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(curve.knots()[i + 3], u[i]);
  EXPECT_EQ(curve.controls().front().head<3>(), points.front());
  EXPECT_EQ(curve.controls().back().head<3>(), points.back());
}

TEST(Interpolation, IsSmoothToTheSecondDerivative) {
  const Points points = wander(40, 7);
  const Nurbs curve = interpolate(points);
  for (const double u : point_parameters(points, Parameters::chord_length)) {
    if (u == 0.0 || u == 1.0) continue;
    const CurvePoint before = curve.at(u - 1e-10), after = curve.at(u);
    EXPECT_LT((before.first - after.first).norm(), 1e-5 * after.first.norm());
    EXPECT_LT((before.second - after.second).norm(), 1e-4 * (1.0 + after.second.norm()));
  }
}

TEST(Interpolation, RepeatsACubicWithTheseParameters) {
  const auto cubic = [](double t) {
    return Eigen::Vector3d(1.0 + 2.0 * t - t * t * t, 3.0 * t * t, t - 4.0 * t * t * t);
  };
  const std::vector<double> at{0.0, 0.1, 0.25, 0.3, 0.7, 1.0};
  Points points;
  for (const double t : at) points.push_back(cubic(t));
  const Nurbs curve = interpolate(points, at);
  for (double t = 0.0; t <= 1.0; t += 0.01) EXPECT_LT((curve.position_mm(t) - cubic(t)).norm(), 1e-13);
  const CurvePoint here = curve.at(0.4);
  EXPECT_NEAR(here.first.y(), 6.0 * 0.4, 1e-12);
  EXPECT_NEAR(here.second.y(), 6.0, 1e-11);
  EXPECT_NEAR(here.third.x(), -6.0, 1e-9);
  const Nurbs natural = interpolate(points, at, {.ends = EndCondition::natural});
  EXPECT_NEAR(natural.at(0.0).second.norm(), 0.0, 1e-11);
  EXPECT_NEAR(natural.at(1.0).second.norm(), 0.0, 1e-11);
}

TEST(Interpolation, KeepsWeights) {
  const Points points = wander(9, 2);
  std::vector<double> weights;
  for (int i = 0; i < 9; ++i) weights.push_back(1.0 + 0.3 * std::sin(i));
  const Nurbs curve = interpolate(points, {.weights = weights});
  EXPECT_LE(largest_error_mm(curve, points, Parameters::chord_length), 1e-12);
  const Nurbs plain = interpolate(points);
  EXPECT_GT((curve.position_mm(0.41) - plain.position_mm(0.41)).norm(), 1e-6);
}

// A quarter circle as two rational spans would be quadratic; raised to degree 3 it is one Bezier span.
Nurbs quarter_circle(double radius) {
  const double w = (1.0 + 2.0 * std::numbers::sqrt2 / 2.0) / 3.0, a = 2.0 * (std::numbers::sqrt2 / 2.0) / 3.0;
  const auto control = [&](double x, double y, double weight) {
    return Eigen::Vector4d(radius * x, radius * y, 0.0, weight);
  };
  return {{0, 0, 0, 0, 1, 1, 1, 1},
          {control(1, 0, 1), control(1.0 / 3.0 + a, a, w), control(a, 1.0 / 3.0 + a, w), control(0, 1, 1)}};
}

TEST(Curve, OfWeightsIsACircle) {
  const Nurbs circle = quarter_circle(40.0);
  for (double u = 0.0; u <= 1.0; u += 0.05) {
    EXPECT_NEAR(circle.position_mm(u).norm(), 40.0, 1e-12);
    EXPECT_NEAR(circle.curvature_1_mm(u), 1.0 / 40.0, 1e-12);
  }
  const ArcLength length(circle);
  EXPECT_NEAR(length.total_mm(), 20.0 * std::numbers::pi, 1e-11);
}

TEST(Curve, DerivativesAreDifferencesOfPositions) {
  const Nurbs curve = interpolate(wander(9, 2), {.weights = {1, 2, 1, 1.5, 1, 1, 2, 1, 1}});
  constexpr double kH = 1e-5;
  for (const double u : {0.11, 0.37, 0.52, 0.86}) {
    const CurvePoint here = curve.at(u), before = curve.at(u - kH), after = curve.at(u + kH);
    EXPECT_LT((here.position_mm - curve.position_mm(u)).norm(), 1e-13);
    EXPECT_LT(((after.position_mm - before.position_mm) / (2 * kH) - here.first).norm(),
              1e-5 * here.first.norm());
    EXPECT_LT(((after.first - before.first) / (2 * kH) - here.second).norm(), 1e-5 * here.second.norm());
    EXPECT_LT(((after.second - before.second) / (2 * kH) - here.third).norm(), 1e-4 * here.third.norm());
  }
}

/// De Boor's algorithm from the span that a binary search finds.
Eigen::Vector3d de_boor(const Nurbs& curve, double u) {
  const auto& knots = curve.knots();
  const auto k =
      static_cast<std::size_t>(std::upper_bound(knots.begin(), knots.end() - 4, u) - knots.begin()) - 1;
  std::array<Eigen::Vector4d, 4> d;
  for (std::size_t i = 0; i < 4; ++i) d[i] = curve.controls()[k - 3 + i];
  for (std::size_t r = 1; r <= 3; ++r)
    for (std::size_t i = 3; i >= r; --i) {
      const double low = knots[k - 3 + i], share = (u - low) / (knots[i + 1 + k - r] - low);
      d[i] = (1.0 - share) * d[i - 1] + share * d[i];
    }
  return d[3].head<3>() / d[3].w();
}

TEST(Curve, FindsItsSpanAmongUnevenKnots) {
  Points points;  // steps over seven decades
  double x = 0.0;
  for (int i = 0; i < 300; ++i) {
    x += std::pow(10.0, i % 8 - 6);
    points.emplace_back(x, std::sin(x), std::cos(3.0 * x));
  }
  const Nurbs curve = interpolate(points);
  const auto& knots = curve.knots();
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int i = 0; i < 20'000; ++i) {
    const double u = i % 2 == 0 ? uniform(random) : knots[3 + random() % 299];
    ASSERT_LT((curve.position_mm(u) - de_boor(curve, u)).norm(), 1e-9) << u;
  }
  EXPECT_EQ(curve.position_mm(-1.0), curve.position_mm(0.0));
  EXPECT_EQ(curve.position_mm(2.0), curve.position_mm(1.0));
}

TEST(ArcLength, GoesThereAndBack) {
  const Nurbs curve = interpolate(wander(60, 5));
  const ArcLength length(curve);
  const auto polygon_mm = [&](int sides) {
    double sum = 0.0;
    Eigen::Vector3d last = curve.position_mm(0.0);
    for (int i = 1; i <= sides; ++i) {
      const Eigen::Vector3d here = curve.position_mm(static_cast<double>(i) / sides);
      sum += (here - last).norm();
      last = here;
    }
    return sum;
  };
  // A polygon's length is off by the square of its step (2.7e-7 with 20,000 sides), so two of them give the
  // curve's.
  const double coarse_mm = polygon_mm(20'000), fine_mm = polygon_mm(40'000);
  EXPECT_NEAR(length.total_mm(), fine_mm + (fine_mm - coarse_mm) / 3.0, 1e-11 * fine_mm);
  for (double s = 0.0; s <= length.total_mm(); s += 0.173)
    EXPECT_NEAR(length.length_mm(length.parameter(s)), s, 1e-11 * length.total_mm());
  EXPECT_EQ(length.parameter(-1.0), 0.0);
  EXPECT_EQ(length.parameter(1e9), 1.0);
}

TEST(Feed, KeepsItsLimits) {
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    const Nurbs curve = interpolate(wander(30, seed));
    const ArcLength length(curve);
    const FeedLimits limits{.feed_mm_s = 50.0,
                            .acceleration_mm_s2 = 500.0,
                            .jerk_mm_s3 = 2e4,
                            .normal_acceleration_mm_s2 = 200.0};
    const FeedPlan plan = plan_feed(curve, length, limits);
    MotionState last = plan.sample(0.0);
    EXPECT_EQ(last.velocity_mm_s, 0.0);
    constexpr double kStep_s = 5e-4;
    for (double t = kStep_s; t < plan.duration_s; t += kStep_s) {
      const MotionState here = plan.sample(t);
      const double allowed = feed_limit_mm_s(curve, length.parameter(here.position_mm), limits);
      ASSERT_LE(here.velocity_mm_s, allowed * (1 + 1e-9)) << seed << " at " << t;
      ASSERT_LE(std::abs(here.acceleration_mm_s2), 500.0 * (1 + 1e-9));
      ASSERT_LE(std::abs(here.acceleration_mm_s2 - last.acceleration_mm_s2), 2e4 * kStep_s * (1 + 1e-6));
      ASSERT_GE(here.position_mm, last.position_mm - 1e-9);
      last = here;
    }
    const MotionState end = plan.sample(plan.duration_s);
    EXPECT_NEAR(end.position_mm, length.total_mm(), 1e-9);
    EXPECT_NEAR(end.velocity_mm_s, 0.0, 1e-9);
  }
}

// Curves so short that the top of the speed lies inside one of the cells the limit is taken over.
TEST(Feed, KeepsItsLimitsInsideACell) {
  const FeedLimits limits{
      .feed_mm_s = 50.0, .acceleration_mm_s2 = 500.0, .jerk_mm_s3 = 2e6, .normal_acceleration_mm_s2 = 50.0};
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const Nurbs curve = interpolate(wander(4, seed, 0.02));
    const ArcLength length(curve);
    const FeedPlan plan = plan_feed(curve, length, limits);
    for (int i = 1; i < 2000; ++i) {
      const MotionState here = plan.sample(plan.duration_s * i / 2000.0);
      const double allowed = feed_limit_mm_s(curve, length.parameter(here.position_mm), limits);
      ASSERT_LE(here.velocity_mm_s, allowed * (1 + 1e-9)) << seed;
    }
  }
}

TEST(Feed, OfAStraightLineIsOneSCurve) {
  const Nurbs line = interpolate(Points{{0, 0, 0}, {30, 40, 0}});
  const FeedPlan plan =
      plan_feed(line, ArcLength(line), {.feed_mm_s = 20.0, .acceleration_mm_s2 = 1000.0, .jerk_mm_s3 = 2e4});
  EXPECT_EQ(plan.blocks.size(), 1U);
  EXPECT_NEAR(plan.duration_s, plan_scurve(asymmetric_limits(20, 1000, 1000, 2e4, 2e4), 50.0).duration_s,
              1e-9);
  EXPECT_THAT(error_of([&] { plan_feed(line, ArcLength(line), {.feed_mm_s = 0.0}); }),
              HasSubstr("feed: found 0 mm/s, expected a finite number above 0"));
}

struct Noisy {
  std::vector<double> at;
  Eigen::MatrixXd truth, measured;
};

Noisy noisy(int count, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, noise);
  Noisy out{{}, Eigen::MatrixXd(count, 2), Eigen::MatrixXd(count, 2)};
  for (int i = 0; i < count; ++i) {
    out.at.push_back(0.2 * i + 0.05 * std::sin(7.0 * i));
    out.truth.row(i) << 0.1 * std::sin(0.4 * out.at.back()), 0.05 * std::cos(0.9 * out.at.back());
    for (int c = 0; c < 2; ++c) out.measured(i, c) = out.truth(i, c) + normal(random);
  }
  return out;
}

/// The smallest rms error that any amount of smoothing has on these values: Reinsch's matrix in full.
double best_error(const Noisy& data) {
  const auto n = static_cast<Eigen::Index>(data.at.size());
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(n, n - 2), r = Eigen::MatrixXd::Zero(n - 2, n - 2);
  for (Eigen::Index i = 0; i + 2 < n; ++i) {
    const double h = data.at[i + 1] - data.at[i], next = data.at[i + 2] - data.at[i + 1];
    q(i, i) = 1.0 / h, q(i + 1, i) = -1.0 / h - 1.0 / next, q(i + 2, i) = 1.0 / next;
    r(i, i) = (h + next) / 3.0;
    if (i + 3 < n) r(i, i + 1) = r(i + 1, i) = next / 6.0;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> roughness(q * r.llt().solve(q.transpose()));
  const Eigen::MatrixXd measured = roughness.eigenvectors().transpose() * data.measured,
                        truth = roughness.eigenvectors().transpose() * data.truth;
  double best = 1e9;
  for (double smoothing = 1e-6; smoothing < 1e3; smoothing *= 1.2) {
    const Eigen::ArrayXd kept = 1.0 / (1.0 + smoothing * roughness.eigenvalues().array());
    best = std::min(best, (kept.matrix().asDiagonal() * measured - truth).norm());
  }
  return best / std::sqrt(static_cast<double>(data.truth.size()));
}

/// What a servo with the limits' cycle sees of the plan: the largest change of the tip's velocity in a cycle,
/// mm/s2, and the largest distance of the curve from the chord of a cycle.
struct Ridden {
  double acceleration_mm_s2 = 0.0, chord_error_mm = 0.0;
};

Ridden ride(const Nurbs& curve, const FeedLimits& limits) {
  const ArcLength length(curve);
  const FeedPlan plan = plan_feed(curve, length, limits);
  const auto parameter = [&](double time_s) { return length.parameter(plan.sample(time_s).position_mm); };
  Ridden worst;
  Eigen::Vector3d before_mm_s = Eigen::Vector3d::Zero();
  for (double time_s = 0.0; time_s < plan.duration_s; time_s += limits.cycle_s) {
    const double from = parameter(time_s), to = parameter(time_s + limits.cycle_s);
    const Eigen::Vector3d a = curve.position_mm(from), b = curve.position_mm(to);
    const Eigen::Vector3d velocity_mm_s = (b - a) / limits.cycle_s;
    worst.acceleration_mm_s2 =
        std::max(worst.acceleration_mm_s2, (velocity_mm_s - before_mm_s).norm() / limits.cycle_s);
    before_mm_s = velocity_mm_s;
    for (int k = 1; k < 32; ++k)
      worst.chord_error_mm =
          std::max(worst.chord_error_mm,
                   distance_to_segment_mm(curve.position_mm(from + (to - from) * k / 32.0), a, b));
  }
  return worst;
}

// The curvature is 0 on both sides, and the feed was kept over the corner and over the turn.
TEST(Feed, SlowsDownWhereTheCurveTurnsAtOnce) {
  const auto at = [](double x, double y) { return Eigen::Vector4d(x, y, 0.0, 1.0); };
  const Nurbs corner(
      {0, 0, 0, 0, .5, .5, .5, 1, 1, 1, 1},
      {at(0, 0), at(10. / 3, 0), at(20. / 3, 0), at(10, 0), at(10, 10. / 3), at(10, 20. / 3), at(10, 10)});
  const auto through = [](std::vector<Eigen::Vector3d> points) { return interpolate(points); };
  const Nurbs curves[] = {corner, through({{0, 0, 0}, {10, 0, 0}, {0, 0, 0}}),
                          through({{0, 0, 0}, {5, 0, 0}, {10, 0, 0}, {5, 0, 0}, {0, 0, 0}}),
                          through({{0, 0, 0}, {5, 0, 0}, {10, 0, 0}, {4, 0, 0}}),
                          through({{0, 0, 0}, {0, 10, 0}, {0, 3, 0}, {0, 20, 0}})};
  for (const double feed_mm_s : {20.0, 100.0}) {
    FeedLimits limits;
    limits.feed_mm_s = feed_mm_s;
    for (const Nurbs& curve : curves) {
      const Ridden worst = ride(curve, limits);
      EXPECT_LE(worst.acceleration_mm_s2,
                1.5 * limits.acceleration_mm_s2);  // a turn and a brake in one cycle
      EXPECT_LE(worst.chord_error_mm, limits.chord_error_mm);
    }
  }
}

TEST(Smoothing, TakesNoiseAwayAndTellsItsError) {
  double square = 0.0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Noisy data = noisy(300, 0.01, seed);
    const double best = best_error(data);
    for (const double known : {0.01, 0.0}) {
      const SmoothedValues out = smooth(data.at, data.measured, known);
      const double error = (out.values - data.truth).norm() / std::sqrt(600.0);
      EXPECT_LT(error, 1.15 * best) << known;  // the amount is found without knowing the truth
      const double told = out.standard_error.norm() / std::sqrt(300.0);
      EXPECT_GT(error / told, 0.6) << known;
      EXPECT_LT(error / told, 1.5) << known;
      EXPECT_NEAR(out.noise, 0.01, 0.0012);
      EXPECT_GT(out.freedom, 5.0);
      EXPECT_LT(out.freedom, 100.0);
      square += error * error / 16.0;
    }
  }
  // The best amount leaves 3.5 um in the mean of draws (variance and bias of the spline for these values).
  EXPECT_LT(std::sqrt(square), 0.004);
}

/// What the smoothing spline through values at 0, 1, 2... minimises, by the matrices of its definition: the
/// hat matrix' eigenvalues are 1 / (1 + smoothing k).
class DenseSmoothing {
 public:
  explicit DenseSmoothing(const Eigen::VectorXd& y) {
    const Eigen::Index n = y.size(), m = n - 2;
    Eigen::MatrixXd q = Eigen::MatrixXd::Zero(n, m), r = Eigen::MatrixXd::Zero(m, m);
    for (Eigen::Index j = 0; j < m; ++j) {
      q.block<3, 1>(j, j) << 1.0, -2.0, 1.0;
      r(j, j) = 2.0 / 3.0;
      if (j + 1 < m) r(j, j + 1) = r(j + 1, j) = 1.0 / 6.0;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> roughness(q * r.llt().solve(q.transpose()));
    k_ = roughness.eigenvalues().cwiseMax(0.0);
    z_ = roughness.eigenvectors().transpose() * y;
  }

  /// Of the generalised cross-validation; with a known noise, of the unbiased estimate.
  double score(double log_smoothing, double noise) const {
    const Eigen::ArrayXd k = std::exp(log_smoothing) * k_.array(), off = k / (1.0 + k);
    const double mean_square = (off * z_.array()).square().mean(), free = off.mean();
    return noise > 0.0 ? mean_square - 2.0 * noise * noise * free : mean_square / (free * free);
  }
  double least_score(double noise) const {
    double least = score(-15.0, noise);
    for (double x = -15.0; x <= 24.0; x += 0.02) least = std::min(least, score(x, noise));
    return least;
  }

 private:
  Eigen::VectorXd k_, z_;
};

// Other smoothings may be best nearby alone.
TEST(Smoothing, IsTheBestOfAll) {
  const auto seed = std::random_device{}();
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (int draw = 0; draw < 3000; ++draw) {
    const int count = 10 + static_cast<int>(random() % 40);
    const double sigma = std::uniform_real_distribution(0.01, 0.1)(random);
    const double turns_rad = std::uniform_real_distribution(0.2, 2.5)(random);
    std::vector<double> at;
    Eigen::VectorXd y(count);
    for (int i = 0; i < count; ++i) {
      at.push_back(i);
      y[i] = std::sin(turns_rad * i) + sigma * normal(random);
    }
    const DenseSmoothing dense(y);
    for (const double noise : {0.0, sigma}) {
      const SmoothedValues out = smooth(at, y, noise);
      const double square = out.rms_residual * out.rms_residual, free = 1.0 - out.freedom / count;
      const double found = noise > 0.0 ? square - 2.0 * noise * noise * free : square / (free * free);
      const double least = dense.least_score(noise);
      EXPECT_LE(found, least + 1e-4 * std::abs(least))
          << "seed " << seed << " draw " << draw << " points " << count << " freedom " << out.freedom;
    }
  }
}

TEST(Smoothing, LeavesExactValuesAlone) {
  const Noisy data = noisy(300, 1e-9, 4);
  EXPECT_LT((smooth(data.at, data.measured, 1e-9).values - data.truth).cwiseAbs().maxCoeff(), 5e-9);
}

// With much noise the spline becomes the regression line, whose hat matrix is known.
TEST(Smoothing, OfNothingButNoiseIsTheRegressionLine) {
  const Noisy data = noisy(25, 0.01, 9);
  const SmoothedValues out = smooth(data.at, data.measured, 1e3);
  double mean = 0.0, square = 0.0;
  for (const double x : data.at) mean += x / 25.0;
  for (const double x : data.at) square += (x - mean) * (x - mean);
  EXPECT_NEAR(out.freedom, 2.0, 1e-4);
  for (int i = 0; i < 25; ++i)
    EXPECT_NEAR(std::pow(out.standard_error[i] / 1e3, 2),
                1.0 / 25.0 + std::pow(data.at[i] - mean, 2) / square, 1e-4);
}

TEST(Curve, RefusesWhatCannotBe) {
  const Points three{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(error_of([&] { interpolate(three); }),
            "points 2 and 3: both are (1, 0, 0) mm, expected distinct points; remove one");
  EXPECT_EQ(error_of([] { interpolate(Points{{0, 0, 0}}); }), "curve: found 1 points, expected at least 2");
  EXPECT_THAT(error_of([] {
                interpolate(Points{{0, 0, 0}, {NAN, 0, 0}, {1, 0, 0}});
              }),
              HasSubstr("point 2: found (nan, 0, 0), expected finite numbers"));
  EXPECT_THAT(error_of([] {
                interpolate(Points{{NAN, 0, 0}, {1, 0, 0}});
              }),
              HasSubstr("point 1: found (nan"));
  EXPECT_THAT(error_of([] {
                interpolate(Points{{0, 0, 0}, {1, 0, 0}}, {.weights = {1.0}});
              }),
              HasSubstr("weights: found 1 for 2 points"));
  EXPECT_THAT(error_of([] {
                interpolate(Points{{0, 0, 0}, {1, 0, 0}}, {.weights = {1.0, -1.0}});
              }),
              HasSubstr("weight 2: found -1"));
  EXPECT_THAT(error_of([] {
                Nurbs({0, 0, 0, 0, 1, 1, 1}, std::vector<Eigen::Vector4d>(4, Eigen::Vector4d::Ones()));
              }),
              HasSubstr("found 7 knots for 4 control points, expected 8"));
  EXPECT_THAT(error_of([] {
                smooth(std::vector<double>{0, 1, 1, 2}, Eigen::MatrixXd::Zero(4, 1), 0.1);
              }),
              HasSubstr("parameter 3: found 1 after 1"));
}

}  // namespace
}  // namespace meltstage::motion
