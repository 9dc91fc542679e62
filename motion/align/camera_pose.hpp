// SPDX-License-Identifier: Apache-2.0
// The vision measuring system of paper 003, section 3: pixel equivalent, gear ratios, angle of the camera and
// skew of the gantry that carries it, from images of a dot plate alone.
#pragma once

#include <cstdint>
#include <vector>

#include "motion/align/dot_plate.hpp"

namespace meltstage::motion {

/// A camera on a gantry of two axes (paper 003, eq. (6); (5) is misprinted, its second line must read
/// y_c = x' sin alpha_v + y' cos alpha_v). The defaults are the nominal values of its table 1.
struct CameraGantry {
  double pixel_mm = 0.0125;
  double rx_mm = 16.0, ry_mm = 40.0;  ///< way per turn of the axes' motors
  double alpha_rad = 0.0;             ///< from the camera's X to the X axis' way
  double theta_rad = 0.0;             ///< what the Y axis' way lacks of a right angle to it
};

/// Where the camera is, in its own directions, mm (eq. (6)).
Eigen::Vector2d camera_place(const CameraGantry& gantry, const Eigen::Vector2d& turns);

/// The plate seen from one place of the gantry.
struct GantryView {
  Eigen::Vector2d turns;
  std::vector<PlateDot> dots;
};

/// A gantry as identified, and the standard uncertainty of each of its numbers.
struct IdentifiedGantry {
  CameraGantry value, sigma;
  double mark_rms_px = 0.0;  ///< of the dots about the plate, in one image
  double stop_rms_mm = 0.0;  ///< of the gantry's stops about the model, per axis
};

/// As in the paper: pixel equivalent and angle of the plate are means over the images; then, from the first
/// image of a row along one axis, each further one gives a gear ratio and an angle, and the means count. Both
/// rows start at the same dot.
/// @throws MotionError if a row has fewer than two views, doesn't run along its axis only, or views can't be.
IdentifiedGantry identify_gantry_staged(const DotPlate& plate, const std::vector<GantryView>& along_x,
                                        const std::vector<GantryView>& along_y);

/// All at once: least squares of pixel equivalent and the plate's angle within the images, then of the gantry
/// over all of them. Uncertainties come from the residuals of the stops, so that scatter of the gantry is in
/// them.
/// @throws MotionError if there are fewer than four views, they don't leave one line, or views can't be.
IdentifiedGantry identify_gantry(const DotPlate& plate, const std::vector<GantryView>& views);

/// A simulated gantry over a plate.
struct GantryModel {
  CameraGantry gantry{0.0123369, 15.9972, 39.9984, 0.0325 * 3.14159265358979 / 180.0,
                      -0.0060 * 3.14159265358979 / 180.0};  ///< paper 003, table 1
  double stop_sigma_mm = 0.0003;                            ///< scatter of its stops, per axis
  PlateCamera camera;                                       ///< its pixel is the gantry's
  DotPlate plate;
  PlanarPose plate_pose{0.03, -0.05, 0.004};  ///< as the camera sees it at 0 turns
  std::uint64_t seed = 1;
};

/// Drives the gantry along X and Y over the plate by steps of a whole number of pitches of the nominal gear,
/// takes an image at each stop and reads it.
struct GantryRows {
  std::vector<GantryView> along_x, along_y;
};
GantryRows view_plate(const GantryModel& model, double reach_mm, double step_mm);

}  // namespace meltstage::motion
