// SPDX-License-Identifier: Apache-2.0
// Droplets in strobe images: position, size, roundness and satellites of one image, velocity from a pair.
#pragma once

#include <optional>
#include <vector>

#include "motion/gray_image.hpp"
#include "motion/stage/jetting.hpp"

namespace meltstage::motion {

/// A droplet in an image; the frame is the pixels', y downwards.
struct ImagedDroplet {
  double x_px = 0.0, y_px = 0.0;  ///< centroid; (0, 0) is the middle of the first pixel
  double area_px = 0.0;
  double xx_px = 0.0, xy_px = 0.0, yy_px = 0.0;  ///< second central moments over the area
};

/// All droplets that lie wholly inside the image, the largest first. The background (a plane of brightness)
/// is taken off and the noise measured in it; what is darker by more than the noise and a quarter of the
/// darkest is a droplet, with its bright middle (the droplet is a lens) filled. Centroid and moments weigh
/// each pixel by its share of cover, so that they are finer than a pixel (grey moments; research: 0.02 px
/// where thresholding gives 0.05).
/// @throws MotionError if the image is smaller than 16 x 16 or its pixels don't fit its size.
std::vector<ImagedDroplet> find_droplets(const GrayImage& image);

/// Camera and strobe.
struct StrobeSetup {
  double pixel_um = 2.5;  ///< of the object
  double delay_s = 1e-4;  ///< from the first image of a pair to the second
  double flash_s = 2e-6;  ///< length of a flash, over which the droplet smears
};

/// Velocity, angle, diameter, roundness and satellites of the largest droplet. The images are of two droplets
/// at different times after their triggers (or of one, double-strobed). The smear of the flash is taken off
/// the moments: (v flash)^2 / 12 along the flight. Nothing if one image shows no whole droplet.
/// @throws MotionError if a number of the setup can't be, or the images differ in size.
std::optional<DropletFigures> measure_pair(const GrayImage& first, const GrayImage& second,
                                           const StrobeSetup& setup);

}  // namespace meltstage::motion
