// SPDX-License-Identifier: Apache-2.0
// Vision: centres of marks beside what OpenCV offers for them, and the camera's gantry identified from
// images.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <vector>

#include "bench/bench.hpp"
#include "bench/bench_stimulus.hpp"
#include "motion/align/camera_pose.hpp"

namespace meltstage::app {

namespace {

using Eigen::Vector2d;
using motion::GrayImage;

cv::Mat bytes_of(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

/// Marks as OpenCV's own functions give them: the peers.
Vector2d otsu_moments(const GrayImage& image) {
  cv::Mat dark;
  cv::threshold(bytes_of(image), dark, 0.0, 255.0, cv::THRESH_BINARY_INV | cv::THRESH_OTSU);
  const cv::Moments m = cv::moments(dark, true);
  return {m.m10 / m.m00, m.m01 / m.m00};
}

Vector2d otsu_ellipse(const GrayImage& image) {
  cv::Mat dark;
  cv::threshold(bytes_of(image), dark, 0.0, 255.0, cv::THRESH_BINARY_INV | cv::THRESH_OTSU);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(dark, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::size_t largest = 0;
  for (std::size_t i = 1; i < contours.size(); ++i)
    if (contours[i].size() > contours[largest].size()) largest = i;
  const cv::RotatedRect ellipse = cv::fitEllipse(contours[largest]);
  return {static_cast<double>(ellipse.center.x), static_cast<double>(ellipse.center.y)};
}

Vector2d grey_centroid(const GrayImage& image) {
  // Background off, by the mean of the image's rim; what is left weighs.
  cv::Mat grey, weight;
  bytes_of(image).convertTo(grey, CV_64F);
  const double background = 0.5 * (cv::mean(grey.row(0))[0] + cv::mean(grey.row(grey.rows - 1))[0]);
  cv::Mat dark;
  cv::threshold(bytes_of(image), dark, 0.0, 255.0, cv::THRESH_BINARY_INV | cv::THRESH_OTSU);
  cv::dilate(dark, dark, cv::Mat(), {-1, -1}, 5);
  weight = background - grey;
  weight.setTo(0.0, dark == 0);
  const cv::Moments m = cv::moments(weight);
  return {m.m10 / m.m00, m.m01 / m.m00};
}

Vector2d ours(const GrayImage& image) {
  const auto marks = motion::find_dots(image);
  return marks.size() == 1 ? Vector2d(marks[0].x_px, marks[0].y_px) : Vector2d(NAN, NAN);
}

struct MarkFinder {
  const char* name;
  Vector2d (*find)(const GrayImage&);
};
constexpr std::array<MarkFinder, 4> kFinders{{{"edge fit", ours},
                                              {"grey centroid", grey_centroid},
                                              {"Otsu, moments", otsu_moments},
                                              {"Otsu, fitEllipse", otsu_ellipse}}};

struct MarkErrors {
  double rms_px = 0.0, time_s = 0.0;  // per coordinate; of an image
};

/// One disc at random places within a pixel, `images` times.
MarkErrors errors_of(const MarkFinder& finder, double radius_px, const motion::PlateCamera& camera,
                     int images) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> within(-0.5, 0.5);
  double squares = 0.0, time_s = 0.0;
  for (int i = 0; i < images; ++i) {
    const double x = within(random), y = within(random);
    const GrayImage image =
        motion::render({{{x * camera.pixel_mm, y * camera.pixel_mm}, 2.0 * radius_px * camera.pixel_mm}},
                       camera, static_cast<std::uint64_t>(i));
    const double begin = processor_s();
    const Vector2d found = finder.find(image);
    time_s += processor_s() - begin;
    squares += (found - Vector2d(0.5 * (camera.width - 1) + x, 0.5 * (camera.height - 1) - y)).squaredNorm();
  }
  return {std::sqrt(squares / (2.0 * images)), time_s / images};
}

/// The least that any unbiased method can do (Cramer-Rao): pixels of noise s and an edge of blur b and
/// contrast C around a disc of radius r tell of the centre pi r C^2 / (2 sqrt(pi) b s^2) per square pixel.
double floor_px(double radius_px, const motion::PlateCamera& camera) {
  const double noise2 = camera.noise * camera.noise + 1.0 / 12.0;  // rounding to bytes
  const double blur = std::sqrt(camera.blur_px * camera.blur_px + 1.0 / 12.0);
  const double contrast = camera.bright - camera.dark;
  return std::sqrt(2.0 * blur * noise2 / (std::sqrt(std::numbers::pi) * radius_px * contrast * contrast));
}

void add_marks(std::vector<BenchRow>& rows, double radius_px, const motion::PlateCamera& camera,
               const std::string& light, std::optional<double> wanted_px, const BenchOptions& options) {
  const int images = options.quick ? 60 : 200;
  const auto what = fmt::format("r = {}, noise {}/255{}", radius_px, camera.noise, light);
  for (std::size_t i = 0; i < std::size(kFinders); ++i) {
    tell(options.progress, what, i, std::size(kFinders));
    const MarkFinder& finder = kFinders[i];
    const MarkErrors errors = errors_of(finder, radius_px, camera, images);
    const bool is_ours = finder.find == ours;
    rows.push_back({fmt::format("{}: {}", what, finder.name),
                    errors.rms_px,
                    "px rms",
                    {},
                    is_ours ? wanted_px : std::nullopt});
    if (is_ours) {
      rows.push_back({"  floor of any method (Cramer-Rao)", floor_px(radius_px, camera), "px rms", {}, {}});
      rows.push_back({"  time of an image", errors.time_s * 1e3, "ms", {}, {}});
    }
  }
}

void add_gantry(std::vector<BenchRow>& rows, const BenchOptions& options) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const int runs = options.quick ? 1 : 3;
  motion::CameraGantry worst{0.0, 0.0, 0.0, 0.0, 0.0}, worst_staged = worst;
  const auto take = [](motion::CameraGantry& most, const motion::CameraGantry& found,
                       const motion::CameraGantry& truth) {
    most.pixel_mm = std::max(most.pixel_mm, std::abs(found.pixel_mm - truth.pixel_mm));
    most.rx_mm = std::max(most.rx_mm, std::abs(found.rx_mm - truth.rx_mm));
    most.ry_mm = std::max(most.ry_mm, std::abs(found.ry_mm - truth.ry_mm));
    most.alpha_rad = std::max(most.alpha_rad, std::abs(found.alpha_rad - truth.alpha_rad));
    most.theta_rad = std::max(most.theta_rad, std::abs(found.theta_rad - truth.theta_rad));
  };
  double images = 0.0;
  for (int run = 0; run < runs; ++run) {
    tell(options.progress, "gantries", run, runs);
    motion::GantryModel model;
    model.camera.gradient_x = 0.3;
    model.camera.gradient_y = -0.2;
    model.seed = options.seed * 100 + static_cast<std::uint64_t>(run);
    const auto views = motion::view_plate(model, 46.0, 4.0);
    auto all = views.along_x;
    all.insert(all.end(), views.along_y.begin(), views.along_y.end());
    images = static_cast<double>(all.size());
    take(worst, motion::identify_gantry(model.plate, all).value, model.gantry);
    take(worst_staged, motion::identify_gantry_staged(model.plate, views.along_x, views.along_y).value,
         model.gantry);
  }
  // Wanted: the paper's own +-3 sigma (table 1).
  const auto add = [&](const char* what, double ours_off, double staged_off, const char* unit,
                       double wanted) {
    rows.push_back({fmt::format("{}: largest error of {}", what, runs), ours_off, unit, {}, wanted});
    rows.push_back({"  as the paper does it", staged_off, unit, {}, {}});
  };
  rows.push_back({"gantry from images of the plate: images", images, "", {}, {}});
  add("pixel equivalent", worst.pixel_mm * 1e3, worst_staged.pixel_mm * 1e3, "um/px", 0.0003);
  add("R_x", worst.rx_mm, worst_staged.rx_mm, "mm/turn", 0.0002);
  add("R_y", worst.ry_mm, worst_staged.ry_mm, "mm/turn", 0.0003);
  add("alpha_v", worst.alpha_rad / kDegree, worst_staged.alpha_rad / kDegree, "deg", 0.0029);
  add("theta_v", worst.theta_rad / kDegree, worst_staged.theta_rad / kDegree, "deg", 0.0034);
}

}  // namespace

std::vector<BenchRow> bench_vision(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  motion::PlateCamera camera;
  camera.width = camera.height = 96;
  add_marks(rows, 20.0, camera, "", 0.010, options);
  add_marks(rows, 8.0, camera, "", 0.020, options);
  camera.gradient_x = 0.3;
  camera.gradient_y = -0.2;
  add_marks(rows, 20.0, camera, ", slope", 0.010, options);
  camera.noise = 6.0;
  add_marks(rows, 20.0, camera, ", slope", {}, options);
  add_gantry(rows, options);
  return rows;
}

std::vector<BenchChart> vision_charts(const Progress& progress) {
  motion::PlateCamera camera;
  camera.width = camera.height = 128;
  BenchChart chart{"vision_marks", "radius of the mark, px", "error of its centre, px rms", 0.0, 0.03, {}};
  BenchCurve floor{"Cramer-Rao bound", {}, {}}, fit{"edge fit", {}, {}}, centroid{"grey centroid", {}, {}};
  constexpr std::size_t kRadii = 19;
  for (std::size_t i = 0; i < kRadii; ++i) {
    tell(progress, "chart", i, kRadii);
    const double radius_px = 4.0 + 2.0 * static_cast<double>(i);
    for (BenchCurve* curve : {&fit, &centroid, &floor}) curve->x.push_back(radius_px);
    fit.y.push_back(errors_of(kFinders[0], radius_px, camera, 100).rms_px);
    centroid.y.push_back(errors_of(kFinders[1], radius_px, camera, 100).rms_px);
    floor.y.push_back(floor_px(radius_px, camera));
  }
  chart.curves = {fit, centroid, floor};
  return {chart};
}

}  // namespace meltstage::app
