// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/measuring_points.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "motion/profile/profile.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Points = std::vector<Eigen::Vector3d>;

TEST(PointCount, IsEquationOne) {
  EXPECT_EQ(measuring_point_count(1.2, 0.95), 164U);
  EXPECT_EQ(measuring_point_count(1.33, 0.95), 68U);
  EXPECT_EQ(measuring_point_count(1.5, 0.95), 34U);
  EXPECT_EQ(measuring_point_count(1.67, 0.95), 22U);
  EXPECT_EQ(measuring_point_count(2.0, 0.95), 13U);
  EXPECT_EQ(measuring_point_count(1.33, 0.975), 96U);
  EXPECT_EQ(measuring_point_count(2.0, 0.975), 18U);
}

TEST(PointCount, RefusesThePoleAndWhatLiesBelow) {
  EXPECT_EQ(error_of([] { measuring_point_count(1.0, 0.95); }),
            "process capability: found 1, expected a finite number above 1");
  EXPECT_THAT(error_of([] { measuring_point_count(0.8, 0.95); }), HasSubstr("found 0.8"));
  EXPECT_THAT(error_of([] { measuring_point_count(1.5, 0.5); }), HasSubstr("confidence: found 0.5"));
  EXPECT_THAT(error_of([] { measuring_point_count(1.000001, 0.95); }), HasSubstr("expected at most 2000000"));
}

TEST(ChordRule, FollowsThePapersSteps) {
  // C1..C6: C2 is 0.05 off C1C3 (kept on), C3 is 0.3 off C1C4: so C3 is chosen; from C3 all is straight.
  const Points points{{0, 0, 0}, {1, 0.05, 0}, {2, 0, 0}, {3, -0.9, 0}, {4, -1.8, 0}, {5, -2.7, 0}};
  EXPECT_THAT(choose_by_chord_as_published(points, 0.1), ElementsAre(0, 2, 5));
  EXPECT_THAT(choose_by_chord_as_published(points, 0.01), ElementsAre(0, 1, 2, 5));
  EXPECT_THAT(choose_by_chord_as_published(points, 10.0), ElementsAre(0, 5));
  EXPECT_THAT(choose_by_chord_as_published(Points{{0, 0, 0}, {1, 0, 0}}, 0.1), ElementsAre(0, 1));
}

TEST(ChordRule, StopsAtTheFirstChordThatIsOff) {
  // The chord to the fourth point is off, that to the fifth wouldn't be: the paper stops at the first.
  const Points points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 3, 0}, {4, 0, 0}};
  EXPECT_EQ(choose_by_chord_as_published(points, 0.5)[1], 2U);
  EXPECT_EQ(choose_by_chord(points, 0.5)[1], 2U);
}

Points random_path(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const int count = 2 + static_cast<int>(random() % 400);
  const double rough = std::pow(10.0, -4.0 * uniform(random)), bend = std::pow(10.0, -3.0 * uniform(random));
  Points out;
  Eigen::Vector3d at = Eigen::Vector3d::Zero(), way(1, 0, 0);
  for (int i = 0; i < count; ++i) {
    out.push_back(at + rough * Eigen::Vector3d(normal(random), normal(random), normal(random)));
    way = (way + bend * Eigen::Vector3d(normal(random), normal(random), normal(random))).normalized();
    at += 0.1 * way;
    if (random() % 50 == 0) way = -way;  // back along itself
  }
  return out;
}

TEST(ChordRule, FastFormChoosesTheSamePoints) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform;
  for (int i = 0; i < 400; ++i) {
    const Points points = random_path(random);
    const double error = std::pow(10.0, -3.0 * uniform(random));
    ASSERT_EQ(choose_by_chord(points, error), choose_by_chord_as_published(points, error)) << i;
  }
}

TEST(ChordRule, NoPointBetweenIsFartherThanTheError) {
  std::mt19937_64 random(12);
  for (int i = 0; i < 50; ++i) {
    const Points points = random_path(random);
    const auto chosen = choose_by_chord(points, 0.05);
    for (std::size_t k = 1; k < chosen.size(); ++k)
      for (std::size_t m = chosen[k - 1]; m <= chosen[k]; ++m)
        ASSERT_LE(distance_to_segment_mm(points[m], points[chosen[k - 1]], points[chosen[k]]), 0.05);
  }
}

TEST(EvenChoice, SpreadsByLength) {
  Points points;
  for (int i = 0; i <= 100; ++i) points.emplace_back(0.01 * i * i, 0, 0);
  const auto chosen = choose_evenly(points, 5);
  ASSERT_EQ(chosen.size(), 5U);
  for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR(points[chosen[k]].x(), 25.0 * static_cast<double>(k), 1.0);
  EXPECT_THAT(choose_evenly(Points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 50), ElementsAre(0, 1, 2));
  EXPECT_THAT(choose_evenly(Points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, SIZE_MAX), ElementsAre(0, 1, 2));
}

ClLine wavy(double amplitude_mm, double wavelength_mm) {
  ClLine line{"wavy", {}};
  for (int i = 0; i <= 300; ++i) {
    const double x = 0.1 * i, k = 2.0 * M_PI / wavelength_mm;
    line.points.push_back({{x, 0, amplitude_mm * std::sin(k * x)},
                           Eigen::Vector3d(-amplitude_mm * k * std::cos(k * x), 0, 1).normalized(),
                           0});
  }
  return line;
}

TEST(MeasuringPoints, AreThoseOfTheLine) {
  const std::vector<std::size_t> beyond{0, 301};
  EXPECT_THROW(measuring_points(wavy(0.1, 10.0), beyond), MotionError);
}

TEST(SplineChoice, KeepsItsGapAndComesCloserWhereTheSurfaceBends) {
  const auto flat = choose_by_spline(wavy(0.0, 10.0), {});
  EXPECT_EQ(flat.size(), 20U);  // 30 mm in gaps of 1.6 mm at most
  const auto bent = choose_by_spline(wavy(1.0, 3.0), {});
  EXPECT_GT(bent.size(), flat.size());
  for (std::size_t i = 1; i < bent.size(); ++i) {
    EXPECT_LE(bent[i].length_mm - bent[i - 1].length_mm, 1.6 + 1e-9);
    EXPECT_NEAR(bent[i].axis.norm(), 1.0, 1e-12);
  }
}

TEST(SplineChoice, TouchesCornersAndTheMiddleOfALongMove) {
  const ClLine line{"corner", {{{0, 0, 0}}, {{10, 0, 0}}, {{10, 7, 0}}}};
  const auto chosen = choose_by_spline(line, {});
  EXPECT_NEAR(chosen.back().length_mm, 17.0, 1e-12);
  EXPECT_TRUE(std::any_of(chosen.begin(), chosen.end(), [](const MeasuringPoint& p) {
    return (p.position_mm - Eigen::Vector3d(10, 0, 0)).norm() < 1e-9;
  }));
  for (std::size_t i = 1; i < chosen.size(); ++i)
    EXPECT_LE(chosen[i].length_mm - chosen[i - 1].length_mm, 1.6 + 1e-9);
}

// Points so dense that the rounding of the file's numbers shows as kinks.
TEST(SplineChoice, KeepsItsAxesOverRoundedNumbers) {
  std::string program = "G21 G90\nG0 X0 Y0 Z9\nG1 Z1 F9\n";
  for (int i = 1; i <= 2000; ++i)
    program += fmt::format("X{:.3f} Z{:.3f}\n", 0.01 * i, 1.5 - 0.5 * std::cos(0.003 * i));
  const ClLine line = read_tool_path_text("dense.nc", program + "G0 Z9\nM2\n").at(0);
  for (const MeasuringPoint& point : choose_by_spline(line, {})) {
    const double slope = 0.15 * std::sin(0.3 * point.position_mm.x());
    const bool at_end = point.length_mm == 0.0 || point.position_mm.x() > 19.999;
    // 1 um over 20 um, and less to go by at the ends.
    EXPECT_NEAR(point.axis.x(), -slope / std::hypot(1.0, slope), at_end ? 0.15 : 0.05)
        << point.position_mm.x();
  }
}

TEST(SplineChoice, RefusesWhatCannotBe) {
  const ClLine line = wavy(0.0, 10.0);
  EXPECT_EQ(error_of([&] { choose_by_spline(line, {.tolerance_mm = 0.0}); }),
            "chord error: found 0 mm, expected a finite number above 0");
  EXPECT_THAT(error_of([&] { choose_by_spline(line, {.form_wavelength_mm = NAN}); }),
              HasSubstr("form wavelength: found nan mm"));
  EXPECT_THAT(error_of([&] { choose_by_spline(line, {.form_wavelength_mm = 1e-9}); }),
              HasSubstr("at most 2000000"));
  EXPECT_THAT(error_of([] { choose_by_chord(Points{{0, 0, 0}}, 0.1); }), HasSubstr("found 1 points"));
}

}  // namespace
}  // namespace meltstage::motion
