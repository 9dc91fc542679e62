// SPDX-License-Identifier: Apache-2.0
#include "motion/align/dot_plate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// One dot alone in a small image, at (x, y) px from its middle, to the right and up.
GrayImage one_dot(const PlateCamera& camera, double radius_px, double x_px, double y_px, std::uint64_t seed) {
  const double pixel_mm = camera.pixel_mm;
  return render({{{x_px * pixel_mm, y_px * pixel_mm}, 2.0 * radius_px * pixel_mm}}, camera, seed);
}

double rms_px(const PlateCamera& camera, double radius_px, int images) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> within(-0.5, 0.5);
  double squares = 0.0;
  for (int i = 0; i < images; ++i) {
    const double x = within(random), y = within(random);
    const auto marks = find_dots(one_dot(camera, radius_px, x, y, static_cast<std::uint64_t>(i)));
    EXPECT_EQ(marks.size(), 1U);
    if (marks.size() != 1) return INFINITY;
    squares += std::pow(marks[0].x_px - 0.5 * (camera.width - 1) - x, 2) +
               std::pow(marks[0].y_px - 0.5 * (camera.height - 1) + y, 2);
  }
  return std::sqrt(squares / (2.0 * images));
}

PlateCamera small_camera() {
  PlateCamera camera;
  camera.width = camera.height = 96;
  return camera;
}

TEST(DotCentres, FinerThanAHundredthOfAPixel) {
  EXPECT_LT(rms_px(small_camera(), 20.0, 100), 0.005);
  EXPECT_LT(rms_px(small_camera(), 8.0, 100), 0.008);
}

/// The same scene drawn another way, which knows nothing of the fitted edge: a sharp disc at 16 times the
/// size, blurred by a Gaussian kernel and averaged over each pixel.
GrayImage drawn_otherwise(const PlateCamera& camera, double radius_px, double x_px, double y_px,
                          std::uint64_t seed) {
  constexpr int kTimes = 16;
  cv::Mat fine(camera.height * kTimes, camera.width * kTimes, CV_32F);
  for (int row = 0; row < fine.rows; ++row)
    for (int column = 0; column < fine.cols; ++column) {
      const double dx = (column + 0.5) / kTimes - 0.5 * camera.width - x_px,
                   dy = (row + 0.5) / kTimes - 0.5 * camera.height + y_px;
      fine.at<float>(row, column) =
          static_cast<float>(std::hypot(dx, dy) < radius_px ? camera.dark : camera.bright);
    }
  cv::GaussianBlur(fine, fine, {0, 0}, camera.blur_px * kTimes);
  cv::Mat pixels;
  cv::resize(fine, pixels, {camera.width, camera.height}, 0.0, 0.0, cv::INTER_AREA);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, camera.noise);
  GrayImage image{camera.width, camera.height, {}};
  for (int row = 0; row < pixels.rows; ++row)
    for (int column = 0; column < pixels.cols; ++column)
      image.pixels.push_back(static_cast<std::uint8_t>(
          std::clamp(std::lround(pixels.at<float>(row, column) + noise(random)), 0L, 255L)));
  return image;
}

TEST(DotCentres, ImagesDrawnOtherwiseGiveTheSame) {
  const PlateCamera camera = small_camera();
  for (const auto& [radius_px, wanted_px] : {std::pair(20.0, 0.005), std::pair(8.0, 0.008)}) {
    double squares = 0.0;
    constexpr int kImages = 16;
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> within(-0.5, 0.5);
    for (int i = 0; i < kImages; ++i) {
      const double x = within(random), y = within(random);
      const auto marks = find_dots(drawn_otherwise(camera, radius_px, x, y, static_cast<std::uint64_t>(i)));
      ASSERT_EQ(marks.size(), 1U);
      squares += std::pow(marks[0].x_px - 0.5 * (camera.width - 1) - x, 2) +
                 std::pow(marks[0].y_px - 0.5 * (camera.height - 1) + y, 2);
    }
    EXPECT_LT(std::sqrt(squares / (2.0 * kImages)), wanted_px);
  }
}

TEST(DotCentres, SlopingLightDoesNotPullThem) {
  PlateCamera camera = small_camera();
  camera.noise = 0.0;
  camera.gradient_x = 0.5;
  camera.gradient_y = -0.3;
  EXPECT_LT(rms_px(camera, 20.0, 50), 0.002);
  EXPECT_LT(rms_px(camera, 8.0, 50), 0.003);
}

TEST(DotCentres, StrongNoiseIsBorne) {
  PlateCamera camera = small_camera();
  camera.noise = 6.0;
  EXPECT_LT(rms_px(camera, 20.0, 50), 0.015);
  camera.blur_px = 2.0;
  EXPECT_LT(rms_px(camera, 20.0, 50), 0.025);
}

TEST(DotCentres, OneDotInALargeImageIsFound) {
  PlateCamera camera;
  camera.gradient_x = 0.3;
  for (const double radius_px : {4.0, 12.0, 40.0, 80.0})
    EXPECT_EQ(find_dots(one_dot(camera, radius_px, 150.2, -80.4, 1)).size(), 1U) << radius_px;
  EXPECT_EQ(find_dots(render({}, camera, 1)).size(), 0U);
  camera.noise = 6.0;
  EXPECT_EQ(find_dots(one_dot(camera, 8.0, 150.2, -80.4, 1)).size(), 1U);
  EXPECT_EQ(find_dots(render({}, camera, 1)).size(), 0U);
}

TEST(DotCentres, OneThatNearlyFillsTheImageIsFound) {
  PlateCamera camera = small_camera();
  camera.gradient_x = 0.3;
  for (const double radius_px : {24.0, 32.0, 40.0})
    EXPECT_EQ(find_dots(one_dot(camera, radius_px, 0.4, 0.3, 1)).size(), 1U) << radius_px;
}

TEST(DotCentres, DirtIsNoDot) {
  const PlateCamera camera = small_camera();
  GrayImage image = one_dot(camera, 20.0, 0.3, 0.1, 1);
  const auto blot = [&](int x0, int y0, int width, int height, std::uint8_t grey) {
    for (int y = y0; y < y0 + height; ++y)
      for (int x = x0; x < x0 + width; ++x)
        image.pixels[static_cast<std::size_t>(y * image.width + x)] = grey;
  };
  blot(5, 5, 3, 30, 60);  // a scratch
  EXPECT_EQ(find_dots(image).size(), 1U);
  blot(50, 30, 12, 12, 240);  // a flake on the dot
  EXPECT_EQ(find_dots(image).size(), 0U);
}

/// Every dot that was named stands where the scene has it.
void expect_named_rightly(const std::vector<PlateDot>& dots, const DotPlate& plate, const PlateScene& scene,
                          const PlateCamera& camera) {
  for (const PlateDot& each : dots)
    EXPECT_LT(
        (moved(scene.plate, plate.pitch_mm * each.dot.cast<double>()) / camera.pixel_mm - each.at_px).norm(),
        0.05)
        << each.dot.transpose();
}

TEST(ReadPlate, NamesTheDotsWhicheverWayThePlateLies) {
  const DotPlate plate;
  const PlateCamera camera;
  for (const double degrees : {0.2, 37.0, 90.0, 181.0, -100.0}) {
    const PlateScene scene{{-0.4, 0.3, degrees * std::numbers::pi / 180.0}, false, {}};
    const auto dots = read_plate(render(plate, camera, scene, 1), plate);
    EXPECT_GE(dots.size(), 24U);
    expect_named_rightly(dots, plate, scene, camera);
  }
}

TEST(ReadPlate, MissingDotsAreLeftOut) {
  const DotPlate plate;
  const PlateCamera camera;
  const PlateScene scene{{0.1, 0.2, 0.01}, false, {{1, 0}, {-1, 1}, {-2, -1}}};
  const auto dots = read_plate(render(plate, camera, scene, 1), plate);
  EXPECT_EQ(dots.size(), 32U);
  expect_named_rightly(dots, plate, scene, camera);
}

TEST(ReadPlate, FarFromTheMiddleByWhereItMustBe) {
  const DotPlate plate;
  const PlateCamera camera;
  const PlateScene scene{{-30.1, 12.2, 0.004}, false, {}};
  const auto image = render(plate, camera, scene, 1);
  PlanarPose expected = scene.plate;
  expected.x_mm += 0.1;
  const auto dots = read_plate(image, plate, expected, 0.0125);
  EXPECT_GE(dots.size(), 28U);
  expect_named_rightly(dots, plate, scene, camera);
  expected.x_mm += 0.3;
  EXPECT_THAT(error_of([&] { read_plate(image, plate, expected, 0.0125); }),
              HasSubstr("from where it was expected"));
  EXPECT_EQ(error_of([&] { read_plate(image, plate); }),
            "plate image: found 0 large dots, expected 3; move the camera over the plate's middle");
}

TEST(ReadPlate, RefusesWhatIsNoPlate) {
  const DotPlate plate;
  const PlateCamera camera;
  const auto refusal = [&](const PlateScene& scene) {
    return error_of([&] { read_plate(render(plate, camera, scene, 1), plate); });
  };
  EXPECT_THAT(refusal({{0.1, 0.2, 0.01}, true, {}}),
              HasSubstr("mirrored, expected (0,0), (2,0), (0,1); the plate lies upside down"));
  EXPECT_THAT(refusal({{0.1, 0.2, 0.01}, false, {{2, 0}}}), StartsWith("plate image: found 2 large dots"));
  EXPECT_EQ(refusal({{500.0, 0.0, 0.0}, false, {}}), "plate image: found 0 dots, expected at least 4");
  PlateScene line{{0.1, 0.2, 0.01}, false, {}};
  for (int row = -3; row <= 3; ++row)
    for (int column = -4; column <= 4; ++column)
      if (row != 0) line.missing.emplace_back(column, row);
  EXPECT_THAT(refusal(line), HasSubstr("dots on a line, expected a grid"));
  GrayImage cut = render(plate, camera, {{0.0, 0.0, 0.0}, false, {}}, 1);
  cut.pixels.pop_back();
  EXPECT_THAT(error_of([&] { read_plate(cut, plate); }),
              StartsWith("plate image: found 640 x 480 with 307199 pixels"));
  DotPlate touching;
  touching.dot_mm = 0.9;
  EXPECT_THAT(error_of([&] { check_plate(touching); }), StartsWith("plate: found dots of 0.9 mm"));
}

}  // namespace
}  // namespace meltstage::motion
