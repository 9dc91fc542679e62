// SPDX-License-Identifier: Apache-2.0
#include "motion/align/dot_plate.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;

constexpr double kLeastArea_px = 20.0;
constexpr double kRim_px = 6.0;          // of light around a dot that is fitted with it
constexpr double kLeastContrast = 12.0;  // of 255
constexpr double kWorstMisfit = 0.08;    // of the contrast; a clean dot stays at the noise, 0.01 to 0.04
constexpr double kSurelyDark = 0.25;     // of the range from the darkest to the brightest
constexpr double kLargeFrom = 1.2;       // a dot this many times the median radius is a large one
constexpr std::size_t kFewestDots = 4;

// ---- images ----

double edge_cover(double beyond_px, double blur_px) {
  return 0.5 * std::erfc(beyond_px / (std::numbers::sqrt2 * blur_px));
}

/// Takes the share of `cover` that a dot has in each pixel: mean over 2 x 2 Gauss points of the blurred edge.
/// The dot stays symmetrical about its centre to the last bit that matters.
void draw_dot(cv::Mat& cover, const Vector2d& centre_px, double radius_px, double blur_px) {
  constexpr std::array<double, 2> kGauss{-0.28867513459481287, 0.28867513459481287};
  const double reach = radius_px + 6.0 * blur_px + 1.0;
  const int left = std::max(0, static_cast<int>(std::floor(centre_px.x() - reach)));
  const int right = std::min(cover.cols - 1, static_cast<int>(std::ceil(centre_px.x() + reach)));
  const int top = std::max(0, static_cast<int>(std::floor(centre_px.y() - reach)));
  const int bottom = std::min(cover.rows - 1, static_cast<int>(std::ceil(centre_px.y() + reach)));
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x) {
      double share = 0.0;
      for (const double dy : kGauss)
        for (const double dx : kGauss)
          share += 0.25 * edge_cover(std::hypot(x + dx - centre_px.x(), y + dy - centre_px.y()) - radius_px,
                                     blur_px);
      cover.at<double>(y, x) += share;
    }
}

bool is_large(const Vector2i& dot) {
  return dot == Vector2i(0, 0) || dot == Vector2i(2, 0) || dot == Vector2i(0, 1);
}

// ---- finding dots ----

cv::Mat checked(const GrayImage& image) {
  if (image.width < 16 || image.height < 16 ||
      image.pixels.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
    throw MotionError(fmt::format(
        "plate image: found {} x {} with {} pixels, expected at least 16 x 16 and a byte for each",
        image.width, image.height, image.pixels.size()));
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

/// Grey values below and above which so many pixels lie as the smallest dot has: one dot in a large image
/// counts.
std::pair<double, double> grey_range(const cv::Mat& bytes) {
  std::array<int, 256> histogram{};
  for (int y = 0; y < bytes.rows; ++y)
    for (int x = 0; x < bytes.cols; ++x) ++histogram[bytes.at<std::uint8_t>(y, x)];
  const int tail = static_cast<int>(kLeastArea_px);
  int low = 0, high = 255;
  for (int sum = histogram[0]; sum < tail; sum += histogram[static_cast<std::size_t>(low)]) ++low;
  for (int sum = histogram[255]; sum < tail; sum += histogram[static_cast<std::size_t>(high)]) --high;
  return {low, high};
}

/// The disc with a blurred edge: centre, radius, blur, light in the centre and its slopes, share of it that
/// the dot lets through.
struct DotModel {
  double x, y, radius, blur, light, slope_x, slope_y, dark_share;
};

/// Sums of the least squares of one Gauss-Newton step.
struct Step {
  Eigen::Matrix<double, 8, 1> change;
  double squares = 0.0, count = 0.0;
};

/// The pixels that are fitted: the same in every step, so that the steps come to rest.
struct Window {
  double x, y, reach;
};

Step gauss_newton(const cv::Mat& bytes, const DotModel& model, const Window& window) {
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> right = Eigen::Matrix<double, 8, 1>::Zero(), by;
  Step step;
  const int left = std::max(0, static_cast<int>(std::ceil(window.x - window.reach)));
  const int end = std::min(bytes.cols - 1, static_cast<int>(std::floor(window.x + window.reach)));
  const int top = std::max(0, static_cast<int>(std::ceil(window.y - window.reach)));
  const int bottom = std::min(bytes.rows - 1, static_cast<int>(std::floor(window.y + window.reach)));
  const double density = 1.0 / (std::sqrt(2.0 * std::numbers::pi) * model.blur);
  for (int row = top; row <= bottom; ++row)
    for (int column = left; column <= end; ++column) {
      if (std::hypot(column - window.x, row - window.y) > window.reach) continue;
      const double dx = column - model.x, dy = row - model.y, distance = std::hypot(dx, dy);
      const double beyond = (distance - model.radius) / model.blur;
      const double cover = edge_cover(beyond * model.blur, model.blur);
      const double slope = density * std::exp(-0.5 * beyond * beyond);  // -d cover / d distance
      const double light = model.light + model.slope_x * dx + model.slope_y * dy;
      const double seen = 1.0 - (1.0 - model.dark_share) * cover;
      const double by_cover = -light * (1.0 - model.dark_share);
      const double ux = distance > 1e-9 ? dx / distance : 0.0, uy = distance > 1e-9 ? dy / distance : 0.0;
      by << by_cover * slope * ux - model.slope_x * seen, by_cover * slope * uy - model.slope_y * seen,
          by_cover * slope, by_cover * slope * beyond, seen, seen * dx, seen * dy, light * cover;
      const double off = bytes.at<std::uint8_t>(row, column) - light * seen;
      normal.selfadjointView<Eigen::Lower>().rankUpdate(by);
      right += off * by;
      step.squares += off * off;
      step.count += 1.0;
    }
  step.change = normal.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  return step;
}

/// A blob, refined; nothing if it isn't a clean dot wholly inside the image.
std::optional<DotMark> refine(const cv::Mat& bytes, const Vector2d& centre_px, double area_px, double bright,
                              double dark) {
  const double radius = std::sqrt(area_px / std::numbers::pi);
  DotModel model{centre_px.x(), centre_px.y(), radius, 1.0, bright, 0.0, 0.0, dark / bright};
  const Window window{centre_px.x(), centre_px.y(), radius + kRim_px};
  constexpr int kMostSteps = 12;
  for (int i = 0; i < kMostSteps; ++i) {
    const Step step = gauss_newton(bytes, model, window);
    if (!step.change.allFinite()) return std::nullopt;
    model.x += step.change[0];
    model.y += step.change[1];
    model.radius += step.change[2];
    model.blur = std::max(0.2, model.blur + std::clamp(step.change[3], -0.4, 0.4));
    model.light += step.change[4];
    model.slope_x += step.change[5];
    model.slope_y += step.change[6];
    model.dark_share += step.change[7];
    const bool lost = std::abs(model.x - centre_px.x()) > 2.0 || std::abs(model.y - centre_px.y()) > 2.0 ||
                      model.radius < 0.6 * radius || model.radius > 1.5 * radius || model.blur > radius;
    if (lost) return std::nullopt;
    if (step.change.head<3>().norm() > 2e-4) continue;
    const double contrast = model.light * (1.0 - model.dark_share);
    const double misfit = std::sqrt(step.squares / std::max(1.0, step.count - 8.0)) / contrast;
    if (!(contrast > kLeastContrast) || misfit > std::max(kWorstMisfit, 8.0 / contrast)) return std::nullopt;
    return DotMark{model.x, model.y, model.radius, misfit};
  }
  return std::nullopt;
}

// ---- naming dots ----

/// Grid coordinates of marks in an arbitrary one of its directions: the first axis is `column_px`, the second
/// is it turned by +90 degrees.
struct Grid {
  Vector2d origin_px, column_px;

  Vector2d place(const Vector2d& at_px) const {
    const Vector2d off = at_px - origin_px;
    return Vector2d(column_px.dot(off), column_px.x() * off.y() - column_px.y() * off.x()) /
           column_px.squaredNorm();
  }
  Vector2i cell(const Vector2d& at_px) const { return place(at_px).array().round().cast<int>(); }
};

std::vector<Vector2d> places(const GrayImage& image, const std::vector<DotMark>& marks) {
  if (marks.size() < kFewestDots)
    throw MotionError(
        fmt::format("plate image: found {} dots, expected at least {}", marks.size(), kFewestDots));
  std::vector<Vector2d> at;
  for (const DotMark& mark : marks) at.push_back(in_camera(mark, image));
  Vector2d centre = Vector2d::Zero();
  for (const auto& each : at) centre += each / static_cast<double>(at.size());
  Eigen::Matrix2d moment = Eigen::Matrix2d::Zero();
  for (const auto& each : at) moment += (each - centre) * (each - centre).transpose();
  if (moment.determinant() < 1e-4 * moment.trace() * moment.trace())
    throw MotionError(fmt::format("plate image: found {} dots on a line, expected a grid", marks.size()));
  return at;
}

/// The grid through the dots: the shortest way between two of them, then refined over all.
Grid find_grid(const std::vector<Vector2d>& at) {
  Grid grid{at[0], at[1] - at[0]};
  for (std::size_t i = 0; i < at.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if ((at[i] - at[j]).squaredNorm() < grid.column_px.squaredNorm()) grid = {at[j], at[i] - at[j]};
  // Similarity between cells and places, in closed form (complex regression).
  for (int round = 0; round < 2; ++round) {
    Vector2d mean_cell = Vector2d::Zero(), mean_at = Vector2d::Zero();
    for (const auto& each : at) {
      mean_cell += grid.cell(each).cast<double>() / static_cast<double>(at.size());
      mean_at += each / static_cast<double>(at.size());
    }
    double dot = 0.0, cross = 0.0, squares = 0.0;
    for (const auto& each : at) {
      const Vector2d cell = grid.cell(each).cast<double>() - mean_cell, off = each - mean_at;
      dot += cell.dot(off);
      cross += cell.x() * off.y() - cell.y() * off.x();
      squares += cell.squaredNorm();
    }
    const Vector2d column(dot / squares, cross / squares);
    const Vector2d row(-column.y(), column.x());
    grid = {mean_at - mean_cell.x() * column - mean_cell.y() * row, column};
  }
  for (const auto& each : at) {
    const Vector2d off = grid.place(each) - grid.cell(each).cast<double>();
    if (off.norm() > 0.2)
      throw MotionError(fmt::format(
          "plate image: found a dot {:.2f} of the pitch beside the grid, expected the dots on a square grid",
          off.norm()));
  }
  return grid;
}

/// Turns a cell by quarter turns.
Vector2i quarter_turned(Vector2i cell, int quarters) {
  for (int i = 0; i < quarters; ++i) cell = Vector2i(-cell.y(), cell.x());
  return cell;
}

std::vector<PlateDot> named(const std::vector<Vector2d>& at, const Grid& grid, const Vector2i& origin,
                            int quarters, const DotPlate& plate) {
  std::vector<PlateDot> dots;
  for (const auto& each : at) {
    const Vector2i dot = quarter_turned(grid.cell(each) - origin, quarters);
    const bool same =
        std::any_of(dots.begin(), dots.end(), [&](const PlateDot& other) { return other.dot == dot; });
    if (same || std::abs(dot.x()) > plate.columns / 2 || std::abs(dot.y()) > plate.rows / 2)
      throw MotionError(fmt::format(
          "plate image: found {} dot ({}, {}), expected each once and columns within +-{}, rows within +-{}",
          same ? "a second" : "a", dot.x(), dot.y(), plate.columns / 2, plate.rows / 2));
    dots.push_back({dot, each});
  }
  return dots;
}

}  // namespace

void check_plate(const DotPlate& plate) {
  if (plate.columns < 5 || plate.rows < 3 || plate.columns % 2 == 0 || plate.rows % 2 == 0)
    throw MotionError(fmt::format("plate: found {} x {} dots, expected odd numbers, at least 5 x 3",
                                  plate.columns, plate.rows));
  if (!(plate.dot_mm > 0.0) || !(plate.large_share >= 1.3) ||
      !(0.5 * plate.dot_mm * (1.0 + plate.large_share) < plate.pitch_mm))
    throw MotionError(fmt::format(
        "plate: found dots of {} mm ({} times that for the large ones) every {} mm, expected dots that "
        "don't touch and large ones of at least 1.3 times",
        plate.dot_mm, plate.large_share, plate.pitch_mm));
}

GrayImage render(const DotPlate& plate, const PlateCamera& camera, const PlateScene& scene,
                 std::uint64_t seed) {
  check_plate(plate);
  std::vector<Disc> discs;
  for (int row = -plate.rows / 2; row <= plate.rows / 2; ++row)
    for (int column = -plate.columns / 2; column <= plate.columns / 2; ++column) {
      const Vector2i dot(column, row);
      if (std::find(scene.missing.begin(), scene.missing.end(), dot) != scene.missing.end()) continue;
      const Vector2d on_plate = plate.pitch_mm * Vector2d(scene.upside_down ? -column : column, row);
      discs.push_back(
          {moved(scene.plate, on_plate), plate.dot_mm * (is_large(dot) ? plate.large_share : 1.0)});
    }
  return render(discs, camera, seed);
}

GrayImage render(const std::vector<Disc>& discs, const PlateCamera& camera, std::uint64_t seed) {
  cv::Mat cover = cv::Mat::zeros(camera.height, camera.width, CV_64F);
  for (const Disc& disc : discs) {
    const Vector2d at = disc.at_mm / camera.pixel_mm;
    draw_dot(cover, {0.5 * (camera.width - 1) + at.x(), 0.5 * (camera.height - 1) - at.y()},
             0.5 * disc.diameter_mm / camera.pixel_mm, camera.blur_px);
  }
  cv::Mat noise(cover.size(), CV_64F);
  cv::RNG random(seed * 0x9E3779B97F4A7C15U + 1U);
  random.fill(noise, cv::RNG::NORMAL, 0.0, camera.noise);
  GrayImage image{camera.width, camera.height, {}};
  image.pixels.resize(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  auto pixel = image.pixels.begin();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const double light = 1.0 + camera.gradient_x * (x / (camera.width - 1.0) - 0.5) +
                           camera.gradient_y * (y / (camera.height - 1.0) - 0.5);
      const double grey = light * (camera.bright - (camera.bright - camera.dark) * cover.at<double>(y, x));
      *pixel++ = static_cast<std::uint8_t>(std::clamp(std::lround(grey + noise.at<double>(y, x)), 0L, 255L));
    }
  return image;
}

std::vector<DotMark> find_dots(const GrayImage& image) {
  const cv::Mat bytes = checked(image);
  cv::Mat smooth, dark, labels, stats, centres;
  cv::GaussianBlur(bytes, smooth, {0, 0}, 1.0);
  const auto [low, high] = grey_range(smooth);
  if (high - low < kLeastContrast) return {};
  // Darker than the surroundings by a tenth of the range: a gradient of the light doesn't matter.
  const int block = std::max(15, std::min(image.width, image.height) / 3) | 1;
  cv::adaptiveThreshold(smooth, dark, 255.0, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY_INV, block,
                        0.1 * (high - low));
  // What is dark in any light counts too: large dots would otherwise have a hole where they fill the block.
  dark |= smooth < low + kSurelyDark * (high - low);
  const int blobs = cv::connectedComponentsWithStats(dark, labels, stats, centres, 8);
  std::vector<DotMark> marks;
  for (int blob = 1; blob < blobs; ++blob) {
    const int x = stats.at<int>(blob, cv::CC_STAT_LEFT), y = stats.at<int>(blob, cv::CC_STAT_TOP);
    const int width = stats.at<int>(blob, cv::CC_STAT_WIDTH),
              height = stats.at<int>(blob, cv::CC_STAT_HEIGHT);
    const double area = stats.at<int>(blob, cv::CC_STAT_AREA);
    const bool whole = x > 1 && y > 1 && x + width < image.width - 1 && y + height < image.height - 1;
    const bool round = std::abs(width - height) <= 2 + 0.15 * std::max(width, height) &&
                       area > 0.65 * width * height && area < 0.95 * width * height;
    if (!whole || !round || area < kLeastArea_px) continue;
    const auto mark =
        refine(bytes, {centres.at<double>(blob, 0), centres.at<double>(blob, 1)}, area, high, low);
    if (mark) marks.push_back(*mark);
  }
  return marks;
}

Vector2d in_camera(const DotMark& mark, const GrayImage& image) {
  return {mark.x_px - 0.5 * (image.width - 1), 0.5 * (image.height - 1) - mark.y_px};
}

std::vector<PlateDot> read_plate(const GrayImage& image, const DotPlate& plate) {
  check_plate(plate);
  const std::vector<DotMark> marks = find_dots(image);
  const std::vector<Vector2d> at = places(image, marks);
  const Grid grid = find_grid(at);
  std::vector<double> radii;
  for (const DotMark& mark : marks) radii.push_back(mark.radius_px);
  std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2), radii.end());
  const double median = radii[radii.size() / 2];
  std::vector<Vector2i> large;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i].radius_px > kLargeFrom * median) large.push_back(grid.cell(at[i]));
  if (large.size() != 3)
    throw MotionError(
        fmt::format("plate image: found {} large dots, expected 3; move the camera over the plate's middle",
                    large.size()));
  for (const Vector2i& origin : large)
    for (const Vector2i& second : large)
      for (const Vector2i& third : large)
        for (int quarters = 0; quarters < 4; ++quarters) {
          if (quarter_turned(second - origin, quarters) != Vector2i(2, 0)) continue;
          const Vector2i side = quarter_turned(third - origin, quarters);
          if (side == Vector2i(0, 1)) return named(at, grid, origin, quarters, plate);
          if (side == Vector2i(0, -1))
            throw MotionError(
                "plate image: found the large dots mirrored, expected (0,0), (2,0), (0,1); the plate lies "
                "upside down, "
                "or an axis of the camera is reversed");
        }
  throw MotionError(
      "plate image: found 3 large dots elsewhere than at (0,0), (2,0), (0,1); is it another plate?");
}

std::vector<PlateDot> read_plate(const GrayImage& image, const DotPlate& plate, const PlanarPose& expected,
                                 double pixel_mm) {
  check_plate(plate);
  const std::vector<Vector2d> at = places(image, find_dots(image));
  const Grid grid = find_grid(at);
  const PlanarPose to_plate = inverse_of(expected);
  // Quarter turns between the grid's first axis and the plate's columns.
  const double turn = std::atan2(grid.column_px.y(), grid.column_px.x()) - expected.angle_rad;
  const int quarters = ((static_cast<int>(std::lround(turn / (0.5 * std::numbers::pi))) % 4) + 4) % 4;
  const Vector2d first = moved(to_plate, at[0] * pixel_mm) / plate.pitch_mm;
  const Vector2i first_dot = first.array().round().cast<int>();
  if ((first - first_dot.cast<double>()).cwiseAbs().maxCoeff() > 0.25)
    throw MotionError(
        fmt::format("plate image: found the grid ({:.2f}, {:.2f}) of a pitch from where it was expected, "
                    "expected within a quarter",
                    first.x() - first_dot.x(), first.y() - first_dot.y()));
  const Vector2i origin = grid.cell(at[0]) - quarter_turned(first_dot, (4 - quarters) % 4);
  return named(at, grid, origin, quarters, plate);
}

}  // namespace meltstage::motion
