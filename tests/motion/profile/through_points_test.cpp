// SPDX-License-Identifier: Apache-2.0
// Motions through drawn points, checked piece by piece from the state at its start alone.
#include "motion/profile/through_points.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/rng.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;
using testing::ThrowsMessage;

AxisStates at_end_of(const JerkPiece& piece) {
  const AxisStates& s = piece.start;
  const double t = piece.duration_s;
  return {s.position_mm + t * (s.velocity_mm_s + t * (s.acceleration_mm_s2 / 2 + t * s.jerk_mm_s3 / 6)),
          s.velocity_mm_s + t * (s.acceleration_mm_s2 + t * s.jerk_mm_s3 / 2),
          s.acceleration_mm_s2 + t * s.jerk_mm_s3, s.jerk_mm_s3};
}

// Largest part of a limit that an axis uses.
double largest_use(const ThroughPoints& motion, const AxisLimits& axes) {
  double use = 0.0;
  for (const JerkPiece& piece : motion.pieces) {
    const AxisStates end = at_end_of(piece);
    for (Eigen::Index i = 0; i < 3; ++i) {
      const ScurveLimits& l = axes[static_cast<std::size_t>(i)];
      const double a0 = piece.start.acceleration_mm_s2[i], a1 = end.acceleration_mm_s2[i],
                   j = piece.start.jerk_mm_s3[i];
      double v = std::max(std::abs(piece.start.velocity_mm_s[i]), std::abs(end.velocity_mm_s[i]));
      if (a0 * a1 < 0.0) v = std::max(v, std::abs(piece.start.velocity_mm_s[i] - a0 * a0 / (2.0 * j)));
      // The limits of a speed that rises or falls, as in the middle of the piece.
      const AxisStates middle = at_end_of({0.0, piece.duration_s / 2, piece.start});
      const double sign = middle.velocity_mm_s[i] < 0.0 ? -1.0 : 1.0;
      const bool rises = sign * middle.acceleration_mm_s2[i] >= 0.0;
      const double most_a = rises ? l.acceleration_mm_s2 : l.deceleration_mm_s2;
      const double most_j = rises ? (sign * j > 0 ? l.jerk1_mm_s3 : l.jerk3_mm_s3)
                                  : (sign * j > 0 ? l.jerk7_mm_s3 : l.jerk5_mm_s3);
      use = std::max(
          {use, v / l.velocity_mm_s, std::abs(a0) / most_a, std::abs(a1) / most_a, std::abs(j) / most_j});
    }
  }
  return use;
}

// Largest jump between pieces, as a part of what an axis may do.
double largest_jump(const ThroughPoints& motion, const AxisLimits& axes) {
  double jump = 0.0;
  for (std::size_t k = 0; k < motion.pieces.size(); ++k) {
    const AxisStates end = at_end_of(motion.pieces[k]);
    const bool is_last = k + 1 == motion.pieces.size();
    const AxisStates next =
        is_last ? AxisStates{motion.end_mm, Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()}
                : motion.pieces[k + 1].start;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const ScurveLimits& l = axes[static_cast<std::size_t>(i)];
      jump =
          std::max({jump, std::abs(end.position_mm[i] - next.position_mm[i]) / 100.0,
                    std::abs(end.velocity_mm_s[i] - next.velocity_mm_s[i]) / l.velocity_mm_s,
                    std::abs(end.acceleration_mm_s2[i] - next.acceleration_mm_s2[i]) / l.acceleration_mm_s2});
    }
  }
  return jump;
}

double log_uniform(Rng& rng, double low, double high) {
  return low * std::pow(high / low, static_cast<double>(rng.bits() >> 11) * 0x1p-53);
}

struct Case {
  std::vector<Vector3d> points;
  AxisLimits axes;
  double tolerance_mm;
};

Case drawn(Rng& rng) {
  Case c;
  const double size = log_uniform(rng, 0.01, 300.0);
  const std::uint64_t kind = rng.below(4);
  Vector3d at = Vector3d::Zero();
  for (std::uint64_t n = 1 + rng.below(30); n > 0; --n) {
    const auto draw = [&] { return size * (static_cast<double>(rng.below(2001)) / 1000.0 - 1.0); };
    if (kind == 0)  // anywhere
      at = {draw(), draw(), draw()};
    else if (kind == 1)  // steps of any length
      at += log_uniform(rng, 1e-4, 1.0) * Vector3d{draw(), draw(), 0.0};
    else if (kind == 2)  // along axes, back too, and the same point again
      at[static_cast<Eigen::Index>(rng.below(2))] += size * static_cast<double>(rng.below(3)) - size;
    else  // nearly straight
      at += Vector3d{size, draw() * 1e-3, 0.0};
    c.points.push_back(at);
  }
  for (ScurveLimits& l : c.axes) {
    l = {log_uniform(rng, 1, 1000), log_uniform(rng, 10, 2e4), log_uniform(rng, 10, 2e4), 0, 0, 0, 0};
    for (double* jerk : {&l.jerk1_mm_s3, &l.jerk3_mm_s3, &l.jerk5_mm_s3, &l.jerk7_mm_s3})
      *jerk = log_uniform(rng, 1e3, 1e6);
  }
  c.tolerance_mm = rng.below(8) == 0 ? 0.0 : log_uniform(rng, 1e-4, 10.0);
  return c;
}

TEST(ThroughPoints, DrawnMotionsKeepLimitsAndTolerance) {
  const std::uint64_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed, "through points");
  std::size_t corners_passed = 0;
  for (int n = 0; n < 20'000 && !HasFailure(); ++n) {
    const Case c = drawn(rng);
    const ThroughPoints motion = plan_through(c.points, c.axes, c.tolerance_mm);
    EXPECT_LE(largest_use(motion, c.axes), 1.0 + 1e-7) << n;
    EXPECT_LE(largest_jump(motion, c.axes), 1e-7) << n;
    ASSERT_EQ(motion.passed_s.size(), c.points.size());
    EXPECT_TRUE(std::is_sorted(motion.passed_s.begin(), motion.passed_s.end())) << n;
    for (std::size_t i = 0; i < c.points.size(); ++i) {
      const AxisStates passed = motion.sample(motion.passed_s[i]);
      EXPECT_LE((passed.position_mm - c.points[i]).norm(), c.tolerance_mm * (1 + 1e-9) + 1e-7)
          << n << ' ' << i;
      corners_passed += passed.velocity_mm_s.norm() > 0.0 ? 1U : 0U;
    }
    double stops_s = 0.0;
    for (std::size_t i = 1; i < c.points.size(); ++i)
      stops_s += plan_move(c.points[i - 1], c.points[i], c.axes).profile.duration_s;
    EXPECT_LE(motion.duration_s, stops_s * (1 + 1e-9)) << n;
    EXPECT_EQ((motion.sample(0.0).position_mm - c.points.front()).norm(), 0.0);
    EXPECT_EQ(motion.sample(motion.duration_s).position_mm, c.points.back());
  }
  EXPECT_GT(corners_passed, 50'000u);
}

TEST(ThroughPoints, TwoPointsAreTheFastestMove) {
  const AxisLimits axes{asymmetric_limits(400, 4000, 3000, 4e5, 1e5), {}, {}};
  const std::vector<Vector3d> points{{1, 2, 3}, {31, 2, 43}};
  EXPECT_NEAR(plan_through(points, axes, 0.1).duration_s,
              plan_move(points[0], points[1], axes).profile.duration_s, 1e-12);
}

// Points on a line cost nothing, at a tolerance of 0 too; a corner is a stop then.
TEST(ThroughPoints, PointsOnALineArePassed) {
  const AxisLimits axes;
  const std::vector<Vector3d> points{{0, 0, 0}, {10, 0, 0}, {10, 0, 0}, {25, 0, 0}, {40, 0, 0}, {40, 0, 0}};
  const ThroughPoints motion = plan_through(points, axes, 0.0);
  EXPECT_NEAR(motion.duration_s, plan_move(points.front(), points.back(), axes).profile.duration_s, 1e-12);
  EXPECT_EQ(motion.passed_s[1], motion.passed_s[2]);
  EXPECT_EQ(motion.passed_s[5], motion.duration_s);
  const std::vector<Vector3d> corner{{0, 0, 0}, {10, 0, 0}, {10, 10, 0}};
  EXPECT_NEAR(plan_through(corner, axes, 0.0).duration_s,
              2 * plan_move(corner[0], corner[1], axes).profile.duration_s, 1e-9);
  const std::vector<Vector3d> flat{{0, 0, 0}, {10, 0, 0}, {20, 1, 0}};
  EXPECT_LT(plan_through(flat, axes, 0.1).duration_s, plan_through(flat, axes, 0.01).duration_s);
  EXPECT_LT(plan_through(flat, axes, 0.01).duration_s, plan_through(flat, axes, 0.0).duration_s);
}

// A zigzag of short lines is no reason to stop: the speed is kept over all of them.
TEST(ThroughPoints, ManyPointsAreFasterThanStops) {
  std::vector<Vector3d> points;
  double stops_s = 0.0;
  const AxisLimits axes;
  for (int i = 0; i <= 200; ++i) points.emplace_back(0.5 * i, i % 2 == 0 ? 0.0 : 0.05, 0.0);
  for (std::size_t i = 1; i < points.size(); ++i)
    stops_s += plan_move(points[i - 1], points[i], axes).profile.duration_s;
  EXPECT_LT(plan_through(points, axes, 0.02).duration_s, 0.35 * stops_s);
}

TEST(ThroughPoints, WrongInputIsOneLine) {
  const std::vector<Vector3d> points{{0, 0, 0}, {NAN, 0, 0}};
  const auto refused = [](std::span<const Vector3d> p, double tolerance, const char* said) {
    EXPECT_THAT([&] { plan_through(p, {}, tolerance); }, ThrowsMessage<MotionError>(HasSubstr(said)));
  };
  refused({}, 0.1, "points: found none");
  refused(points, 0.1, "point 2: found a coordinate that isn't finite");
  refused({points.data(), 1}, -0.1, "tolerance: found -0.1 mm, expected 0 or more");
}

}  // namespace
}  // namespace meltstage::motion
