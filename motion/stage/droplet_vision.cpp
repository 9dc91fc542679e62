// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/droplet_vision.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace meltstage::motion {
namespace {

constexpr double kSmooth_px = 1.0;    // of the image in which droplets are looked for
constexpr double kNoiseFactor = 6.0;  // a droplet is darker than this many sigma of that image
constexpr double kShareOfDarkest = 0.25;
constexpr double kLeastArea_px = 6.0;  // smaller is noise
constexpr int kRim_px = 4;             // as far as an edge is blurred
constexpr double kNearlyDarkest = 0.93;
constexpr double kHoleShare = 0.05;  // of the full darkness: less is no bright middle

cv::Mat checked(const GrayImage& image) {
  if (image.width < 16 || image.height < 16 ||
      image.pixels.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
    throw MotionError(
        fmt::format("strobe image: found {} x {} with {} pixels, expected at least 16 x 16 and a byte for "
                    "each",
                    image.width, image.height, image.pixels.size()));
  const cv::Mat bytes(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data()));
  cv::Mat grey;
  bytes.convertTo(grey, CV_32F);
  return grey;
}

/// How much darker each pixel is than the background, a plane fitted to all pixels near it, and the noise
/// around it.
struct Darkness {
  cv::Mat map;
  double noise = 0.0;
};

Darkness darkness_of(const cv::Mat& grey) {
  Eigen::Vector3d plane(0.0, 0.0, 0.0);
  double deviation = INFINITY;
  for (int round = 0; round < 6; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double squares = 0.0, count = 0.0;
    for (int y = 0; y < grey.rows; ++y) {
      const float* row = grey.ptr<float>(y);
      for (int x = 0; x < grey.cols; ++x) {
        const Eigen::Vector3d at(1.0, x, y);
        const double off = row[x] - plane.dot(at);
        if (round > 0 && std::abs(off) > 3.0 * deviation) continue;
        normal += at * at.transpose();
        right += at * static_cast<double>(row[x]);
        squares += off * off;
        count += 1.0;
      }
    }
    if (count < 16.0) break;
    plane = normal.ldlt().solve(right);
    // The first round's squares are about zero, not about a plane: start wide.
    deviation = round == 0 ? 64.0 : std::max(0.3, std::sqrt(squares / count));
  }
  Darkness darkness{cv::Mat(grey.size(), CV_32F), deviation};
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x)
      darkness.map.at<float>(y, x) =
          static_cast<float>(plane.dot(Eigen::Vector3d(1.0, x, y))) - grey.at<float>(y, x);
  return darkness;
}

/// Darkness of a fully covered pixel: the mean over what is nearly as dark as the darkest twentieth in the
/// smoothed image. The cut lies some sigma of its noise below, so that noise doesn't choose the pixels; edges
/// and the bright middle fall out.
double full_darkness(const cv::Mat& darkness, const cv::Mat& smooth, const cv::Mat& inside,
                     const cv::Rect& box) {
  std::vector<std::pair<float, float>> values;  // smoothed, as it is
  for (int y = box.y; y < box.y + box.height; ++y)
    for (int x = box.x; x < box.x + box.width; ++x)
      if (inside.at<std::uint8_t>(y, x) != 0)
        values.emplace_back(smooth.at<float>(y, x), darkness.at<float>(y, x));
  const auto dark = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 20);
  std::nth_element(values.begin(), dark, values.end(),
                   [](const auto& left, const auto& right) { return left.first > right.first; });
  const double cut = kNearlyDarkest * static_cast<double>(dark->first);
  double sum = 0.0, count = 0.0;
  for (const auto& [smoothed, as_it_is] : values)
    if (static_cast<double>(smoothed) >= cut) {
      sum += static_cast<double>(as_it_is);
      count += 1.0;
    }
  return sum / count;
}

/// The smoothed droplet without its bright middle: along each row no pixel is brighter than both what lies
/// left and what lies right of it.
cv::Mat without_middle(const cv::Mat& smooth, const cv::Rect& box) {
  cv::Mat filled = smooth(box).clone();
  for (int y = 0; y < filled.rows; ++y) {
    float* row = filled.ptr<float>(y);
    std::vector<float> from_left(row, row + filled.cols);
    for (std::size_t x = 1; x < from_left.size(); ++x)
      from_left[x] = std::max(from_left[x], from_left[x - 1]);
    float from_right = row[filled.cols - 1];
    for (int x = filled.cols - 1; x >= 0; --x) {
      from_right = std::max(from_right, row[x]);
      row[x] = std::min(from_left[static_cast<std::size_t>(x)], from_right);
    }
  }
  return filled;
}

ImagedDroplet weigh(const Darkness& darkness, const cv::Mat& smooth, double smooth_noise,
                    const std::vector<cv::Point>& contour) {
  cv::Mat inside = cv::Mat::zeros(smooth.size(), CV_8U), reach;
  cv::drawContours(inside, std::vector<std::vector<cv::Point>>{contour}, 0, cv::Scalar(255), cv::FILLED);
  cv::dilate(inside, reach, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * kRim_px + 1, 2 * kRim_px + 1}));
  const cv::Rect image(0, 0, smooth.cols, smooth.rows), tight = cv::boundingRect(contour);
  const cv::Rect box =
      cv::Rect(tight.x - kRim_px, tight.y - kRim_px, tight.width + 2 * kRim_px, tight.height + 2 * kRim_px) &
      image;
  const double full = full_darkness(darkness.map, smooth, inside, tight);
  const cv::Mat filled = without_middle(smooth, box);
  const double hole = std::max(kHoleShare * full, kNoiseFactor * smooth_noise);
  double sum = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0, syy = 0.0;
  for (int y = box.y; y < box.y + box.height; ++y)
    for (int x = box.x; x < box.x + box.width; ++x) {
      if (reach.at<std::uint8_t>(y, x) == 0) continue;
      const float fill = filled.at<float>(y - box.y, x - box.x);
      const bool in_middle = static_cast<double>(fill - smooth.at<float>(y, x)) > hole;
      // Noise weighs as much below as above: nothing is clipped.
      const double cover = static_cast<double>(in_middle ? fill : darkness.map.at<float>(y, x)) / full;
      sum += cover;
      sx += cover * x;
      sy += cover * y;
      sxx += cover * x * x;
      sxy += cover * x * y;
      syy += cover * y * y;
    }
  const double cx = sx / sum, cy = sy / sum;
  return {cx, cy, sum, sxx / sum - cx * cx, sxy / sum - cx * cy, syy / sum - cy * cy};
}

}  // namespace

std::vector<ImagedDroplet> find_droplets(const GrayImage& image) {
  const cv::Mat grey = checked(image);
  const Darkness darkness = darkness_of(grey);
  cv::Mat smooth;
  cv::GaussianBlur(darkness.map, smooth, {0, 0}, kSmooth_px);
  // White noise falls by 2 sqrt(pi) sigma under a Gaussian.
  const double noise = darkness.noise / (2.0 * std::sqrt(std::numbers::pi) * kSmooth_px);
  double darkest = 0.0;
  cv::minMaxLoc(smooth, nullptr, &darkest);
  const double threshold = std::max(kNoiseFactor * noise, kShareOfDarkest * darkest);
  const cv::Mat dark = smooth > threshold;
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(dark, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<ImagedDroplet> droplets;
  for (const auto& contour : contours) {
    const cv::Rect box = cv::boundingRect(contour);
    const bool whole =
        box.x > 0 && box.y > 0 && box.x + box.width < image.width && box.y + box.height < image.height;
    if (!whole) continue;
    const ImagedDroplet droplet = weigh(darkness, smooth, noise, contour);
    if (droplet.area_px >= kLeastArea_px) droplets.push_back(droplet);
  }
  std::sort(droplets.begin(), droplets.end(),
            [](const ImagedDroplet& a, const ImagedDroplet& b) { return a.area_px > b.area_px; });
  return droplets;
}

std::optional<DropletFigures> measure_pair(const GrayImage& first, const GrayImage& second,
                                           const StrobeSetup& setup) {
  if (!(setup.pixel_um > 0.0) || !(setup.delay_s > 0.0) || !(setup.flash_s >= 0.0))
    throw MotionError(
        fmt::format("strobe: found pixel {} um, delay {} s, flash {} s, expected numbers above 0",
                    setup.pixel_um, setup.delay_s, setup.flash_s));
  if (first.width != second.width || first.height != second.height)
    throw MotionError(fmt::format("strobe pair: found {} x {} and {} x {}, expected images of one size",
                                  first.width, first.height, second.width, second.height));
  const auto early = find_droplets(first), late = find_droplets(second);
  if (early.empty() || late.empty()) return std::nullopt;
  const Eigen::Vector2d way_px(late[0].x_px - early[0].x_px, late[0].y_px - early[0].y_px);
  DropletFigures figures;
  figures.velocity_m_s = way_px.norm() * setup.pixel_um * 1e-6 / setup.delay_s;
  figures.angle_deg = std::atan2(way_px.x(), way_px.y()) * 180.0 / std::numbers::pi;
  const Eigen::Vector2d smear_px = way_px * setup.flash_s / setup.delay_s;
  double area_px = 0.0, roundness = 0.0;
  for (const ImagedDroplet& droplet : {early[0], late[0]}) {
    Eigen::Matrix2d moments;
    moments << droplet.xx_px, droplet.xy_px, droplet.xy_px, droplet.yy_px;
    moments -= smear_px * smear_px.transpose() / 12.0;
    const Eigen::Vector2d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(moments).eigenvalues();
    roundness += 0.5 * std::sqrt(std::max(0.0, axes[0]) / axes[1]);
    area_px += 0.5 * droplet.area_px;
  }
  figures.roundness = roundness;
  figures.diameter_um = 2.0 * std::sqrt(area_px / std::numbers::pi) * setup.pixel_um;
  figures.satellites = static_cast<int>(std::max(early.size(), late.size())) - 1;
  return figures;
}

}  // namespace meltstage::motion
