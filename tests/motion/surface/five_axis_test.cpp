// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/five_axis.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "motion/profile/profile.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;
using Tilt = TwinRotaryTable::Tilt;
constexpr double kDeg = 180.0 / M_PI;

Eigen::Vector3d leaning(double lean_deg, double towards_deg) {
  const double a = lean_deg / kDeg, b = towards_deg / kDeg;
  return {std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)};
}

TwinRotaryTable table_of(Tilt tilt, int sign = 1) {
  return {.tilt = tilt,
          .tilt_centre_mm = {3, -2, -40},
          .rotary_centre_mm = {20, 30, 5},
          .tilt_sign = sign,
          .rotary_sign = sign};
}

TEST(TwinRotary, GoesThereAndBack) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const Tilt tilt : {Tilt::a, Tilt::b})
    for (const int sign : {1, -1}) {
      const TwinRotaryTable table = table_of(tilt, sign);
      double worst_mm = 0.0, worst_axis = 0.0;
      for (int i = 0; i < 20'000; ++i) {
        const ToolPose pose{50.0 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random)),
                            leaning(89.0 * std::abs(uniform(random)), 180.0 * uniform(random))};
        const AxesPosition axes = solve_path(table, {&pose, 1}, 1e-6).front();
        const ToolPose back = pose_of(table, axes);
        worst_mm = std::max(worst_mm, (back.tip_mm - pose.tip_mm).norm());
        worst_axis = std::max(worst_axis, (back.axis - pose.axis).norm());
      }
      EXPECT_LE(worst_mm, 1e-12);
      EXPECT_LE(worst_axis, 1e-12);
    }
}

// LinuxCNC's xyzac-trt and xyzbc-trt written out: rotation point r on the turning axis, the tilting axis off
// it by an offset; a positive angle turns the table right-handed.
TEST(TwinRotary, IsThatOfLinuxCnc) {
  const double t = 25.0 / kDeg, c = 130.0 / kDeg;
  const Eigen::Vector3d r(20, 30, 5), q = Eigen::Vector3d(7, 8, 9) - r;
  const double x = std::cos(c) * q.x() - std::sin(c) * q.y(), y = std::sin(c) * q.x() + std::cos(c) * q.y();
  const double d = -11.0, dz = -40.0;  // offsets
  const TwinRotaryTable ac{.tilt_centre_mm = r + Eigen::Vector3d(0, d, dz), .rotary_centre_mm = r};
  EXPECT_LT((axes_at(ac, q + r, 25.0, 130.0).linear_mm -
             (r + Eigen::Vector3d(x, std::cos(t) * (y - d) - std::sin(t) * (q.z() - dz) + d,
                                  std::sin(t) * (y - d) + std::cos(t) * (q.z() - dz) + dz)))
                .norm(),
            1e-13);
  const TwinRotaryTable bc{
      .tilt = Tilt::b, .tilt_centre_mm = r + Eigen::Vector3d(d, 0, dz), .rotary_centre_mm = r};
  EXPECT_LT((axes_at(bc, q + r, 25.0, 130.0).linear_mm -
             (r + Eigen::Vector3d(std::cos(t) * (x - d) + std::sin(t) * (q.z() - dz) + d, y,
                                  -std::sin(t) * (x - d) + std::cos(t) * (q.z() - dz) + dz)))
                .norm(),
            1e-13);
}

std::vector<ToolPose> round_the_pole(double lean_deg, double from_deg, double to_deg, int count) {
  std::vector<ToolPose> path;
  for (int i = 0; i < count; ++i)
    path.push_back({{0.1 * i, 0, 0}, leaning(lean_deg, from_deg + (to_deg - from_deg) * i / (count - 1))});
  return path;
}

TEST(TwinRotary, TurnsOnPastHalfATurn) {
  const auto axes = solve_path(table_of(Tilt::a), round_the_pole(20.0, 0.0, 720.0, 300));
  for (std::size_t i = 1; i < axes.size(); ++i)
    ASSERT_NEAR(std::abs(axes[i].rotary_deg - axes[i - 1].rotary_deg), 720.0 / 299.0, 1e-9);
  EXPECT_NEAR(std::abs(axes.back().rotary_deg - axes.front().rotary_deg), 720.0, 1e-9);
}

TEST(TwinRotary, GoesOverThePoleWithoutTurning) {
  std::vector<ToolPose> path;
  for (int i = -50; i <= 50; ++i)
    path.push_back({{0.1 * i, 0, 0}, leaning(std::abs(i) * 0.2, i < 0 ? 30 : 210)});
  const auto axes = solve_path(table_of(Tilt::a), path);
  for (std::size_t i = 1; i < axes.size(); ++i) {
    ASSERT_NEAR(axes[i].rotary_deg, axes[0].rotary_deg, 1e-9) << i;
    ASSERT_LT(std::abs(axes[i].tilt_deg - axes[i - 1].tilt_deg), 0.21) << i;
  }
}

TEST(TwinRotary, IsLedThroughNearThePole) {
  // The normal passes the vertical at 0.2 degrees and comes out a quarter turn on: C goes evenly, the tool
  // leans by less than the cone.
  std::vector<ToolPose> path;
  for (int i = -100; i <= 100; ++i) {
    const Eigen::Vector3d n(0.001 * std::max(i, 0) + 0.002, 0.001 * std::max(-i, 0) + 0.002, 1.0);
    path.push_back({{0.1 * i, 0, 0}, n.normalized()});
  }
  const TwinRotaryTable table = table_of(Tilt::a);
  const auto axes = solve_path(table, path, 0.5);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const ToolPose back = pose_of(table, axes[i]);
    ASSERT_LT((back.tip_mm - path[i].tip_mm).norm(), 1e-12);
    ASSERT_LT(std::acos(std::min(1.0, back.axis.dot(path[i].axis))) * kDeg, 0.5);
    if (i > 0) {
      ASSERT_LT(std::abs(axes[i].rotary_deg - axes[i - 1].rotary_deg), 6.0) << i;
    }
  }
  // Without the cone C would jump here.
  double jump = 0.0;
  const auto plain = solve_path(table, path, 0.0);
  for (std::size_t i = 1; i < plain.size(); ++i)
    jump = std::max(jump, std::abs(plain[i].rotary_deg - plain[i - 1].rotary_deg));
  EXPECT_GT(jump, 10.0);
}

TEST(TwinRotary, TakesTheSolutionThatItsLimitsAllow) {
  TwinRotaryTable table = table_of(Tilt::a);
  table.tilt_deg = {-5.0, 100.0};
  for (const auto& axes : solve_path(table, round_the_pole(20.0, 0.0, 360.0, 100)))
    EXPECT_GT(axes.tilt_deg, 0.0);
  table.tilt_deg = {-100.0, 5.0};
  for (const auto& axes : solve_path(table, round_the_pole(20.0, 0.0, 360.0, 100)))
    EXPECT_LT(axes.tilt_deg, 0.0);
  table.rotary_deg = {-200.0, 200.0};
  for (const auto& axes : solve_path(table, round_the_pole(20.0, 100.0, 400.0, 100))) {
    EXPECT_LE(std::abs(axes.rotary_deg), 200.0 + 1e-6);
  }
}

// A way that turns on by 188 degrees fits into -180..180 for most of its starts, by one of both solutions.
TEST(TwinRotary, TakesTheOtherSolutionWhereTheLimitsOfCAskForIt) {
  const TwinRotaryTable wide = table_of(Tilt::a);
  TwinRotaryTable table = wide;
  table.rotary_deg = {-180.0, 180.0};
  int fitting = 0, refused = 0;
  for (int from = 1; from < 360; from += 3) {
    const auto path = round_the_pole(20.0, from, from + 188.0, 60);
    const auto least = solve_path(wide, path);
    const double low = std::min(least.front().rotary_deg, least.back().rotary_deg);
    bool fits = false;
    for (int half_turns = -6; half_turns <= 6; ++half_turns)
      fits |= low + 180.0 * half_turns >= -180.0 && low + 188.0 + 180.0 * half_turns <= 180.0;
    ++(fits ? fitting : refused);
    if (!fits) {
      EXPECT_THAT(error_of([&] { solve_path(table, path); }), HasSubstr("no way within -180..180")) << from;
      continue;
    }
    const auto axes = solve_path(table, path);
    for (std::size_t i = 0; i < axes.size(); ++i) {
      ASSERT_LE(std::abs(axes[i].rotary_deg), 180.0 + 1e-9) << from;
      const ToolPose back = pose_of(table, axes[i]);
      ASSERT_LT((back.axis - path[i].axis).norm(), 1e-9) << from;
      ASSERT_LT((back.tip_mm - path[i].tip_mm).norm(), 1e-9) << from;
      if (i > 0) {
        ASSERT_LT(std::abs(axes[i].rotary_deg - axes[i - 1].rotary_deg), 4.0) << from;
      }
    }
  }
  EXPECT_GT(fitting, 100);
  EXPECT_GT(refused, 0);
}

// Within the cone C may turn either way round: here by 190 degrees back, since 170 more or the other solution
// would leave its range.
TEST(TwinRotary, TurnsTheLongerWayThroughTheConeWhereTheLimitsOfCAskForIt) {
  TwinRotaryTable table = table_of(Tilt::a);
  std::vector<ToolPose> path = round_the_pole(20.0, 0.0, 200.0, 100);
  for (double lean_deg = 20.0; lean_deg > 0.0; lean_deg -= 0.125)
    path.push_back({{0, 0, 0}, leaning(lean_deg, 200.0)});
  for (double lean_deg = 0.0; lean_deg < 20.0; lean_deg += 0.125)
    path.push_back({{0, 0, 0}, leaning(lean_deg, 370.0)});
  for (const ToolPose& pose : round_the_pole(20.0, 370.0, 570.0, 100)) path.push_back(pose);
  table.rotary_deg = {-180.0, 180.0};
  const auto axes = solve_path(table, path);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    ASSERT_LE(std::abs(axes[i].rotary_deg), 180.0 + 1e-9) << i;
    ASSERT_LT((pose_of(table, axes[i]).axis - path[i].axis).norm() * kDeg, 0.5 + 1e-6) << i;
  }
  table.rotary_deg = {-100.0, 100.0};
  EXPECT_THAT(error_of([&] { solve_path(table, path); }), HasSubstr("no way within -100..100"));
}

// Near the vertical C is free, but the tilt isn't: it stays within its limits, and the tool within the cone.
TEST(TwinRotary, KeepsItsLimitsWithinTheCone) {
  const auto leaning_path = [](double lean_deg) {
    std::vector<ToolPose> path;
    for (int i = 0; i < 5; ++i) path.push_back({{0.1 * i, 0, 0}, leaning(lean_deg, 90)});
    return path;
  };
  TwinRotaryTable table = table_of(Tilt::a);
  for (const auto& [low, high, lean] : {std::array{10.0, 20.0, 0.0}, {1.0, 2.0, 0.3}, {-20.0, -1.0, 0.0}}) {
    table.tilt_deg = {low, high};
    EXPECT_THAT(error_of([&, lean = lean] { solve_path(table, leaning_path(lean)); }),
                HasSubstr("pose 1: needs a tilt of"))
        << low;
  }
  for (const auto& [low, high, lean] :
       {std::array{-0.1, 0.1, 0.3}, {0.4, 20.0, 0.3}, {0.0, 100.0, 0.3}, {-100.0, 0.0, 0.3}}) {
    table.tilt_deg = {low, high};
    for (const AxesPosition& axes : solve_path(table, leaning_path(lean))) {
      EXPECT_GE(axes.tilt_deg, low);
      EXPECT_LE(axes.tilt_deg, high);
      EXPECT_LE(std::acos(std::min(1.0, pose_of(table, axes).axis.dot(leaning(lean, 90)))) * kDeg,
                0.5 + 1e-9);
    }
  }
  // Where C is free all along, it stands where its limits have it.
  table = table_of(Tilt::a);
  table.rotary_deg = {30.0, 60.0};
  for (const AxesPosition& axes : solve_path(table, leaning_path(0.3))) EXPECT_EQ(axes.rotary_deg, 30.0);
}

TEST(TwinRotary, SaysWhatItCannotReach) {
  TwinRotaryTable table = table_of(Tilt::a);
  table.tilt_deg = {-10.0, 10.0};
  EXPECT_EQ(error_of([&] { solve_path(table, round_the_pole(20.0, 0.0, 10.0, 3)); }),
            "pose 1: needs a tilt of +20.000 or -20.000 degrees, expected -10..10 degrees");
  table = table_of(Tilt::a);
  table.rotary_deg = {-180.0, 180.0};
  EXPECT_THAT(error_of([&] { solve_path(table, round_the_pole(20.0, 0.0, 720.0, 300)); }),
              HasSubstr("path: C has no way within -180..180 degrees that goes on without a stop (the "
                        "shortest one turns over "
                        "720.000 degrees)"));
  const ToolPose bad{{NAN, 0, 0}, Eigen::Vector3d::UnitZ()};
  EXPECT_THAT(error_of([&] { solve_path(table, {&bad, 1}); }), HasSubstr("pose 1: found tip (nan"));
  const ToolPose flat{{0, 0, 0}, Eigen::Vector3d::Zero()};
  EXPECT_THAT(error_of([&] { solve_path(table, {&flat, 1}); }), HasSubstr("an axis of length 1"));
  const ToolPose upright{{0, 0, 0}, Eigen::Vector3d::UnitZ()};
  for (const double cone_deg : {static_cast<double>(NAN), static_cast<double>(INFINITY), 90.0, -1.0})
    EXPECT_THAT(error_of([&] {
                  solve_path(table, {&upright, 1}, cone_deg);
                }),
                HasSubstr("singular cone: found"));
  table.tilt_sign = 0;
  EXPECT_EQ(error_of([&] { solve_path(table, {&upright, 1}); }), "tilt sign: found 0, expected 1 or -1");
}

}  // namespace
}  // namespace meltstage::motion
