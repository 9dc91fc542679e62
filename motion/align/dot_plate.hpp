// SPDX-License-Identifier: Apache-2.0
// The glass plate of dots by which cameras are calibrated: its images, the centres of its dots to a hundredth
// of a pixel, and which dot is which.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "motion/align/planar_pose.hpp"
#include "motion/gray_image.hpp"

namespace meltstage::motion {

/// A square grid of dark dots on glass. Dots are named by column and row from the plate's middle; the plate's
/// frame has its origin in dot (0, 0). Three dots, (0, 0), (2, 0) and (0, 1), are larger and show which way
/// the plate lies.
struct DotPlate {
  int columns = 101, rows = 101;  ///< odd
  double pitch_mm = 1.0;
  double dot_mm = 0.5;       ///< diameter
  double large_share = 1.4;  ///< of the three large dots' diameter
};

/// @throws MotionError if the plate can't be: even or too few dots, dots that touch.
void check_plate(const DotPlate& plate);

/// Camera and light of a simulated image. The camera's frame has its origin in the image's middle, X to the
/// right and Y up.
struct PlateCamera {
  int width = 640, height = 480;
  double pixel_mm = 0.0123369;  ///< of the object, per pixel (paper 003, table 1)
  double blur_px = 0.8;         ///< sigma of the lens' point spread
  double bright = 200.0, dark = 50.0;
  double gradient_x = 0.0, gradient_y = 0.0;  ///< change of the light over the image, as a share
  double noise = 2.0;                         ///< sigma, of 255
};

/// A dark disc before the camera: a dot of the plate, a mark of a board.
struct Disc {
  Eigen::Vector2d at_mm;  ///< in the camera's frame
  double diameter_mm = 0.0;
};

/// An image of discs: each blurred by lens and pixel, light with a gradient, noise, eight bits.
GrayImage render(const std::vector<Disc>& discs, const PlateCamera& camera, std::uint64_t seed);

/// What stands before the camera.
struct PlateScene {
  PlanarPose plate;  ///< in the camera's frame
  bool upside_down = false;
  std::vector<Eigen::Vector2i> missing;  ///< dots that are scratched off
};

/// An image of the plate.
GrayImage render(const DotPlate& plate, const PlateCamera& camera, const PlateScene& scene,
                 std::uint64_t seed);

/// A dot found in an image; pixels to the right and down, (0, 0) is the middle of the first one.
struct DotMark {
  double x_px = 0.0, y_px = 0.0;
  double radius_px = 0.0;
  double misfit = 0.0;  ///< rms of what the model leaves, as a share of the contrast
};

/// All dark round marks that lie wholly inside the image, by rows. Blobs of a local threshold (OpenCV) give
/// the start; then a disc with a blurred edge under a sloping light is fitted to the grey values by least
/// squares (8 parameters, Gauss-Newton). That uses all there is in the edge: with noise 2/255 and contrast
/// 150 about 0.003 px at a radius of 20 px. A mark that the model fits badly (dirt, a scratch) is left out.
/// @throws MotionError if the image is smaller than 16 x 16 or its pixels don't fit its size.
std::vector<DotMark> find_dots(const GrayImage& image);

/// A mark's place in the camera's frame, in pixels: from the image's middle, to the right and up.
Eigen::Vector2d in_camera(const DotMark& mark, const GrayImage& image);

/// A dot whose place on the plate is known.
struct PlateDot {
  Eigen::Vector2i dot;    ///< column and row
  Eigen::Vector2d at_px;  ///< in the camera's frame, in pixels: from the image's middle, to the right and up
};

/// Names the dots of an image by the three large dots in it.
/// @throws MotionError if the image isn't one of the plate: fewer than four dots, all on a line, no grid, not
/// three large dots in the image, or the plate upside down.
std::vector<PlateDot> read_plate(const GrayImage& image, const DotPlate& plate);

/// Names the dots by where the plate must be to within a quarter of its pitch: for images without the large
/// dots.
/// @throws MotionError as above, or if the grid isn't where it was expected.
std::vector<PlateDot> read_plate(const GrayImage& image, const DotPlate& plate, const PlanarPose& expected,
                                 double pixel_mm);

}  // namespace meltstage::motion
