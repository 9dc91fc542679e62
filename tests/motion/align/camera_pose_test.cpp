// SPDX-License-Identifier: Apache-2.0
#include "motion/align/camera_pose.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kDegree = std::numbers::pi / 180.0;
const DotPlate plate;

/// What a perfect reader would give of a scene: no image, noise in the dots and the stops.
GantryView view_at(const CameraGantry& gantry, const PlanarPose& plate_pose, const Vector2d& turns,
                   double noise_px, double stop_mm, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double sx = stop_mm * normal(random), sy = stop_mm * normal(random);
  const Vector2d place = camera_place(gantry, turns) + Vector2d(sx, sy);
  const Vector2d middle = moved(inverse_of(plate_pose), place) / plate.pitch_mm;
  GantryView view{turns, {}};
  for (int row = -2; row <= 2; ++row)
    for (int column = -3; column <= 3; ++column) {
      const Eigen::Vector2i dot = middle.array().round().cast<int>().matrix() + Eigen::Vector2i(column, row);
      const double nx = noise_px * normal(random), ny = noise_px * normal(random);
      view.dots.push_back(
          {dot, (moved(plate_pose, plate.pitch_mm * dot.cast<double>()) - place) / gantry.pixel_mm +
                    Vector2d(nx, ny)});
    }
  return view;
}

GantryRows rows_of(const CameraGantry& gantry, double noise_px, double stop_mm, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  GantryRows rows;
  for (int i = -12; i <= 12; ++i) {
    rows.along_x.push_back(
        view_at(gantry, {0.2, -0.1, 0.01}, {4.0 * i / 16.0, 0.0}, noise_px, stop_mm, random));
    rows.along_y.push_back(
        view_at(gantry, {0.2, -0.1, 0.01}, {0.0, 4.0 * i / 40.0}, noise_px, stop_mm, random));
  }
  return rows;
}

std::vector<GantryView> both(const GantryRows& rows) {
  auto all = rows.along_x;
  all.insert(all.end(), rows.along_y.begin(), rows.along_y.end());
  return all;
}

const CameraGantry crooked{0.0123369, 15.9972, 39.9984, 0.4 * kDegree, -0.3 * kDegree};

TEST(CameraPlace, IsThePapersEquation6) {
  // (4) and (5) one after the other, (5) with its misprint put right.
  const Vector2d turns(1.3, -0.7);
  const double xs = crooked.rx_mm * turns.x(), ys = crooked.ry_mm * turns.y();
  const double x = xs - ys * std::sin(crooked.theta_rad), y = ys * std::cos(crooked.theta_rad);
  const Vector2d wanted(x * std::cos(crooked.alpha_rad) - y * std::sin(crooked.alpha_rad),
                        x * std::sin(crooked.alpha_rad) + y * std::cos(crooked.alpha_rad));
  EXPECT_LT((camera_place(crooked, turns) - wanted).norm(), 1e-12);
}

void expect_near(const CameraGantry& found, const CameraGantry& truth, double relative, double angle_rad) {
  EXPECT_NEAR(found.pixel_mm / truth.pixel_mm, 1.0, relative);
  EXPECT_NEAR(found.rx_mm / truth.rx_mm, 1.0, relative);
  EXPECT_NEAR(found.ry_mm / truth.ry_mm, 1.0, relative);
  EXPECT_NEAR(found.alpha_rad, truth.alpha_rad, angle_rad);
  EXPECT_NEAR(found.theta_rad, truth.theta_rad, angle_rad);
}

TEST(Gantry, ExactWithoutNoise) {
  const GantryRows rows = rows_of(crooked, 0.0, 0.0, 1);
  expect_near(identify_gantry_staged(plate, rows.along_x, rows.along_y).value, crooked, 1e-11, 1e-11);
  expect_near(identify_gantry(plate, both(rows)).value, crooked, 1e-11, 1e-11);
}

TEST(Gantry, UncertaintiesAreHonestAndSmallerThanThePapersMethod) {
  Eigen::Array<double, 5, 1> ours = Eigen::Array<double, 5, 1>::Zero(), in_sigma = ours, staged = ours;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    const GantryRows rows = rows_of(crooked, 0.01, 3e-4, static_cast<std::uint64_t>(run));
    const auto numbers = [](const CameraGantry& g) {
      return Eigen::Array<double, 5, 1>(g.pixel_mm, g.rx_mm, g.ry_mm, g.alpha_rad, g.theta_rad);
    };
    const auto found = identify_gantry(plate, both(rows));
    const auto published = identify_gantry_staged(plate, rows.along_x, rows.along_y);
    const Eigen::Array<double, 5, 1> off = numbers(found.value) - numbers(crooked);
    ours += off.square() / kRuns;
    in_sigma += (off / numbers(found.sigma)).square() / kRuns;
    staged += (numbers(published.value) - numbers(crooked)).square() / kRuns;
  }
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(in_sigma[i], 1.0, 0.35) << i;
  for (int i = 1; i < 5; ++i) EXPECT_LT(ours[i], 0.5 * staged[i]) << i;
}

TEST(Gantry, FromImagesAloneWithinThePapersUncertainty) {
  GantryModel model;
  model.camera.gradient_x = 0.3;
  model.camera.gradient_y = -0.2;
  const GantryRows rows = view_plate(model, 45.0, 10.0);
  const CameraGantry found = identify_gantry(plate, both(rows)).value;
  EXPECT_NEAR(found.pixel_mm, model.gantry.pixel_mm, 3e-7);
  EXPECT_NEAR(found.rx_mm, model.gantry.rx_mm, 2e-4);
  EXPECT_NEAR(found.ry_mm, model.gantry.ry_mm, 3e-4);
  EXPECT_NEAR(found.alpha_rad, model.gantry.alpha_rad, 0.0029 * kDegree);
  EXPECT_NEAR(found.theta_rad, model.gantry.theta_rad, 0.0034 * kDegree);
  EXPECT_GT(std::abs(CameraGantry{}.rx_mm - model.gantry.rx_mm), 2e-4);  // nominal wouldn't do
}

TEST(Gantry, RefusesWhatCannotBe) {
  const GantryRows rows = rows_of(crooked, 0.0, 0.0, 1);
  EXPECT_THAT(error_of([&] { identify_gantry(plate, rows.along_x); }),
              HasSubstr("on one line of the gantry"));
  EXPECT_EQ(error_of([&] { identify_gantry(plate, {rows.along_x[0]}); }),
            "camera calibration: found 1 views, expected at least 4");
  auto few = both(rows);
  few[3].dots.resize(2);
  EXPECT_THAT(error_of([&] { identify_gantry(plate, few); }),
              HasSubstr("view 4: found 2 dots, expected at least 4"));
  auto broken = both(rows);
  broken[5].dots[0].at_px.x() = NAN;
  EXPECT_THAT(error_of([&] { identify_gantry(plate, broken); }), HasSubstr("view 6: found dot"));
  EXPECT_THAT(error_of([&] { identify_gantry_staged(plate, rows.along_y, rows.along_y); }),
              StartsWith("camera calibration along X, view 2: found a move by 0,"));
  EXPECT_THAT(error_of([&] { identify_gantry_staged(plate, {rows.along_x[0]}, rows.along_y); }),
              HasSubstr("found 1 views, expected at least 2"));
}

}  // namespace
}  // namespace meltstage::motion
