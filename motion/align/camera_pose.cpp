// SPDX-License-Identifier: Apache-2.0
#include "motion/align/camera_pose.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "motion/align/cross.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;

Vector2d on_plate(const DotPlate& plate, const PlateDot& dot) {
  return plate.pitch_mm * dot.dot.cast<double>();
}

void check_view(const GantryView& view, std::size_t number) {
  if (!view.turns.allFinite())
    throw MotionError(fmt::format("camera calibration, view {}: found turns {}, {}, expected finite numbers",
                                  number, view.turns.x(), view.turns.y()));
  if (view.dots.size() < 4)
    throw MotionError(fmt::format("camera calibration, view {}: found {} dots, expected at least 4", number,
                                  view.dots.size()));
  for (const PlateDot& dot : view.dots)
    if (!dot.at_px.allFinite())
      throw MotionError(
          fmt::format("camera calibration, view {}: found dot ({}, {}) at {}, {} px, expected finite numbers",
                      number, dot.dot.x(), dot.dot.y(), dot.at_px.x(), dot.at_px.y()));
}

/// Scale and angle of the plate in an image or several, from dots about each image's mean.
struct Scale {
  double dot = 0.0, cross = 0.0, squares_px = 0.0, squares_mm = 0.0, degrees = -2.0;

  void add(const DotPlate& plate, const GantryView& view) {
    Vector2d mean_px = Vector2d::Zero(), mean_mm = Vector2d::Zero();
    const auto count = static_cast<double>(view.dots.size());
    for (const PlateDot& each : view.dots) {
      mean_px += each.at_px / count;
      mean_mm += on_plate(plate, each) / count;
    }
    for (const PlateDot& each : view.dots) {
      const Vector2d px = each.at_px - mean_px, mm = on_plate(plate, each) - mean_mm;
      dot += mm.dot(px);
      cross += motion::cross(mm, px);
      squares_px += px.squaredNorm();
      squares_mm += mm.squaredNorm();
    }
    degrees += 2.0 * (count - 1.0);
  }
  /// Regression of pixels on the plate's exact places.
  double pixel_mm() const { return squares_mm / std::hypot(dot, cross); }
  double angle_rad() const { return std::atan2(cross, dot); }
  double rms_px() const {
    return std::sqrt(std::max(0.0, squares_px - (dot * dot + cross * cross) / squares_mm) / degrees);
  }
  /// Of the angle, and relative of the scale.
  double angle_sigma() const { return rms_px() * pixel_mm() / std::sqrt(squares_mm); }

 private:
  static double cross_of(const Vector2d& a, const Vector2d& b) { return motion::cross(a, b); }
};

/// Camera's place, up to a constant, by what one view shows: plate as it lies less what is seen of it.
Vector2d place_seen(const DotPlate& plate, const GantryView& view, const Scale& scale) {
  Vector2d sum = Vector2d::Zero();
  for (const PlateDot& each : view.dots)
    sum += moved({0.0, 0.0, scale.angle_rad()}, on_plate(plate, each)) - scale.pixel_mm() * each.at_px;
  return sum / static_cast<double>(view.dots.size());
}

struct MeanOf {
  double sum = 0.0, squares = 0.0, count = 0.0;
  void add(double value) {
    sum += value;
    squares += value * value;
    count += 1.0;
  }
  double mean() const { return sum / count; }
  double sigma() const {
    return count > 1.0 ? std::sqrt(std::max(0.0, squares / count - mean() * mean()) / (count - 1.0)) : 0.0;
  }
};

/// Gear ratio and direction from each further view of a row against its first.
struct RowResult {
  MeanOf ratio_mm, angle_rad;  // angle against the axis' nominal direction
};

RowResult along_axis(const DotPlate& plate, const std::vector<GantryView>& row, int axis,
                     const Scale& scale) {
  if (row.size() < 2)
    throw MotionError(fmt::format("camera calibration along {}: found {} views, expected at least 2",
                                  axis == 0 ? "X" : "Y", row.size()));
  RowResult result;
  const Vector2d first = place_seen(plate, row[0], scale);
  for (std::size_t k = 1; k < row.size(); ++k) {
    const Vector2d turns = row[k].turns - row[0].turns;
    if (turns[axis] == 0.0 || turns[1 - axis] != 0.0)
      throw MotionError(
          fmt::format("camera calibration along {}, view {}: found a move by {}, {} turns, expected one "
                      "along this axis alone",
                      axis == 0 ? "X" : "Y", k + 1, turns.x(), turns.y()));
    const Vector2d way = (place_seen(plate, row[k], scale) - first) / turns[axis];
    result.ratio_mm.add(way.norm());
    result.angle_rad.add(axis == 0 ? std::atan2(way.y(), way.x()) : std::atan2(-way.x(), way.y()));
  }
  return result;
}

}  // namespace

Vector2d camera_place(const CameraGantry& gantry, const Vector2d& turns) {
  const double x = gantry.rx_mm * turns.x(), y = gantry.ry_mm * turns.y();
  const double skewed = gantry.alpha_rad + gantry.theta_rad;
  return {std::cos(gantry.alpha_rad) * x - std::sin(skewed) * y,
          std::sin(gantry.alpha_rad) * x + std::cos(skewed) * y};
}

IdentifiedGantry identify_gantry_staged(const DotPlate& plate, const std::vector<GantryView>& along_x,
                                        const std::vector<GantryView>& along_y) {
  check_plate(plate);
  MeanOf pixel, angle, rms;
  Scale mean;
  std::size_t number = 0;
  for (const auto* row : {&along_x, &along_y})
    for (const GantryView& view : *row) {
      check_view(view, ++number);
      Scale scale;
      scale.add(plate, view);
      mean.add(plate, view);
      pixel.add(scale.pixel_mm());
      angle.add(scale.angle_rad());
      rms.add(scale.rms_px());
    }
  const RowResult x = along_axis(plate, along_x, 0, mean), y = along_axis(plate, along_y, 1, mean);
  IdentifiedGantry found;
  found.value = {pixel.mean(), x.ratio_mm.mean(), y.ratio_mm.mean(), x.angle_rad.mean(),
                 y.angle_rad.mean() - x.angle_rad.mean()};
  found.sigma = {pixel.sigma(), x.ratio_mm.sigma(), y.ratio_mm.sigma(),
                 std::hypot(x.angle_rad.sigma(), angle.sigma()),
                 std::hypot(x.angle_rad.sigma(), y.angle_rad.sigma())};
  found.mark_rms_px = rms.mean();
  return found;
}

IdentifiedGantry identify_gantry(const DotPlate& plate, const std::vector<GantryView>& views) {
  check_plate(plate);
  if (views.size() < 4)
    throw MotionError(fmt::format("camera calibration: found {} views, expected at least 4", views.size()));
  Scale scale;
  for (std::size_t k = 0; k < views.size(); ++k) {
    check_view(views[k], k + 1);
    scale.add(plate, views[k]);
  }
  // place = ratios * turns + constant, both coordinates with the same normal equations.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  std::vector<Vector2d> places;
  for (const GantryView& view : views) {
    places.push_back(place_seen(plate, view, scale));
    const Eigen::Vector3d row(view.turns.x(), view.turns.y(), 1.0);
    normal += row * row.transpose();
    right += row * places.back().transpose();
  }
  const auto count = static_cast<double>(views.size());
  const Vector2d mean(normal(0, 2) / count, normal(1, 2) / count);
  const Eigen::Matrix2d spread = normal.topLeftCorner<2, 2>() / count - mean * mean.transpose();
  if (!(spread.determinant() > 1e-8 * spread.trace() * spread.trace()))
    throw MotionError(
        "camera calibration: found all views on one line of the gantry, expected moves along X and along Y");
  const Eigen::Matrix3d inverse = normal.inverse();
  const Eigen::Matrix<double, 3, 2> found = inverse * right;
  double squares = 0.0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const Eigen::Vector3d row(views[k].turns.x(), views[k].turns.y(), 1.0);
    squares += (places[k] - found.transpose() * row).squaredNorm();
  }
  IdentifiedGantry result;
  result.stop_rms_mm = std::sqrt(squares / (2.0 * count - 6.0 > 0.0 ? 2.0 * count - 6.0 : 2.0));
  result.mark_rms_px = scale.rms_px();
  const Vector2d x = found.row(0), y = found.row(1);
  result.value = {scale.pixel_mm(), x.norm(), y.norm(), std::atan2(x.y(), x.x()), 0.0};
  result.value.theta_rad = std::atan2(-y.x(), y.y()) - result.value.alpha_rad;
  const double x_sigma = result.stop_rms_mm * std::sqrt(inverse(0, 0)),
               y_sigma = result.stop_rms_mm * std::sqrt(inverse(1, 1));
  const double alpha_sigma = x_sigma / x.norm(), beta_sigma = y_sigma / y.norm();
  result.sigma = {scale.pixel_mm() * scale.angle_sigma(), x_sigma, y_sigma,
                  std::hypot(alpha_sigma, scale.angle_sigma()), std::hypot(alpha_sigma, beta_sigma)};
  return result;
}

GantryRows view_plate(const GantryModel& model, double reach_mm, double step_mm) {
  std::mt19937_64 random(model.seed);
  std::normal_distribution<double> stop(0.0, model.stop_sigma_mm);
  const CameraGantry nominal;
  PlateCamera camera = model.camera;
  camera.pixel_mm = model.gantry.pixel_mm;
  // Where the plate lies, to begin with, is read off an image over its middle.
  const auto image_at = [&](const Vector2d& turns) {
    const double dx = stop(random), dy = stop(random);
    const Vector2d place = camera_place(model.gantry, turns) + Vector2d(dx, dy);
    PlateScene scene{model.plate_pose, false, {}};
    scene.plate.x_mm -= place.x();
    scene.plate.y_mm -= place.y();
    return render(model.plate, camera, scene, random());
  };
  const GantryView middle{Vector2d::Zero(), read_plate(image_at(Vector2d::Zero()), model.plate)};
  Scale scale;
  scale.add(model.plate, middle);
  const Vector2d origin = -place_seen(model.plate, middle, scale);
  const auto view_at = [&](const Vector2d& turns) {
    const Vector2d place = camera_place(nominal, turns);
    const PlanarPose expected{origin.x() - place.x(), origin.y() - place.y(), scale.angle_rad()};
    return GantryView{turns, read_plate(image_at(turns), model.plate, expected, nominal.pixel_mm)};
  };
  GantryRows rows;
  for (double at_mm = -reach_mm; at_mm <= reach_mm + 1e-9; at_mm += step_mm) {
    rows.along_x.push_back(view_at({at_mm / nominal.rx_mm, 0.0}));
    rows.along_y.push_back(view_at({0.0, at_mm / nominal.ry_mm}));
  }
  return rows;
}

}  // namespace meltstage::motion
