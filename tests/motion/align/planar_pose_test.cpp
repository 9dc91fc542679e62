// SPDX-License-Identifier: Apache-2.0
#include "motion/align/planar_pose.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::vector<Vector2d> board{{0.0, 0.0}, {300.0, 0.0}, {300.0, 200.0}, {10.0, 190.0}};

std::vector<Vector2d> displaced(const std::vector<Vector2d>& marks, const PlanarPose& by) {
  std::vector<Vector2d> to;
  for (const auto& mark : marks) to.push_back(moved(by, mark));
  return to;
}

TEST(PlanarPose, ComposesAndInverts) {
  const PlanarPose a{1.0, -2.0, 0.3}, b{-4.0, 5.0, -1.1};
  const Vector2d point(7.0, 3.0);
  EXPECT_LT((moved(compose(a, b), point) - moved(a, moved(b, point))).norm(), 1e-13);
  EXPECT_LT((moved(compose(inverse_of(a), a), point) - point).norm(), 1e-13);
  EXPECT_LT((moved(compose(displacement(a, b), a), point) - moved(b, point)).norm(), 1e-13);
}

TEST(FitPose, FindsTheDisplacement) {
  const PlanarPose by{12.0, -3.0, 2.5};
  const PoseFit fit = fit_pose(board, displaced(board, by));
  EXPECT_NEAR(fit.pose.x_mm, by.x_mm, 1e-10);
  EXPECT_NEAR(fit.pose.y_mm, by.y_mm, 1e-10);
  EXPECT_NEAR(fit.pose.angle_rad, by.angle_rad, 1e-13);
  EXPECT_LT(fit.rms_mm, 1e-12);
}

TEST(FitPose, NoOtherPoseLeavesLess) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.01);
  auto seen = displaced(board, {1.0, 2.0, 0.02});
  for (auto& mark : seen) {
    const double dx = noise(random), dy = noise(random);
    mark += Vector2d(dx, dy);
  }
  const PoseFit fit = fit_pose(board, seen);
  const auto squares = [&](const PlanarPose& pose) {
    double sum = 0.0;
    for (std::size_t i = 0; i < board.size(); ++i) sum += (moved(pose, board[i]) - seen[i]).squaredNorm();
    return sum;
  };
  const double least = squares(fit.pose);
  EXPECT_NEAR(fit.rms_mm, std::sqrt(least / 8.0), 1e-12);
  for (const double step : {-1e-4, 1e-4}) {
    EXPECT_GT(squares({fit.pose.x_mm + step, fit.pose.y_mm, fit.pose.angle_rad}), least);
    EXPECT_GT(squares({fit.pose.x_mm, fit.pose.y_mm + step, fit.pose.angle_rad}), least);
    EXPECT_GT(squares({fit.pose.x_mm, fit.pose.y_mm, fit.pose.angle_rad + 0.01 * step}), least);
  }
}

TEST(FitPose, TwoMarksOrALineOfThemSuffice) {
  const std::vector<Vector2d> line{{0.0, 0.0}, {10.0, 10.0}, {30.0, 30.0}};
  EXPECT_NEAR(fit_pose(line, displaced(line, {0.0, 0.0, -0.4})).pose.angle_rad, -0.4, 1e-13);
}

TEST(FitPose, RefusesWhatCannotBe) {
  const auto refusal = [](std::vector<Vector2d> from, std::vector<Vector2d> to) {
    return error_of([&] { fit_pose(from, to); });
  };
  EXPECT_EQ(refusal({{1.0, 1.0}}, {{1.0, 1.0}}), "marks: found 1, expected at least 2");
  EXPECT_EQ(refusal(board, {{1.0, 1.0}}), "marks: found 1 seen, expected the 4 that are known");
  auto repeated = board;
  repeated[2] = repeated[0];
  EXPECT_THAT(refusal(repeated, board), StartsWith("known marks 1 and 3: found both at (0, 0) mm"));
  EXPECT_THAT(refusal(board, repeated), StartsWith("seen marks 1 and 3"));
  auto broken = board;
  broken[1].x() = NAN;
  EXPECT_THAT(refusal(board, broken), HasSubstr("mark 2: found (nan, 0), expected finite"));
  auto mirrored = board;
  for (auto& mark : mirrored) mark.x() = -mark.x();
  EXPECT_THAT(refusal(board, mirrored), HasSubstr("mirror image"));
}

}  // namespace
}  // namespace meltstage::motion
