// SPDX-License-Identifier: Apache-2.0
// A simulated strobe camera at a simulated head: images of droplets with blur, smear, noise, uneven light and
// satellites, against which the measurement and the tuning of the waveform are judged.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "motion/stage/droplet_vision.hpp"

namespace meltstage::motion {

/// A droplet in flight, an ellipsoid whose long axis lies along its flight.
struct FlyingDroplet {
  double x_um = 0.0, y_um = 0.0;  ///< middle, at the flash's middle, in the image's frame
  double diameter_um = 60.0;      ///< of the circle of the same area
  double roundness = 1.0;
  double velocity_m_s = 2.0;
  double angle_deg = 0.0;
};

struct CameraConfig {
  int width = 320, height = 480;
  StrobeSetup strobe;
  double blur_px = 1.2;           ///< sigma of the lens
  double noise = 4.0;             ///< sigma, grey levels
  double background = 190.0;      ///< grey level in the middle
  double gradient = 20.0;         ///< from left to right
  double darkness = 130.0;        ///< of a droplet
  double highlight_share = 0.35;  ///< of the diameter: the bright middle
};

/// The image at a flash. The same seed gives the same noise.
GrayImage render(const std::vector<FlyingDroplet>& droplets, const CameraConfig& camera, std::uint64_t seed);

/// A head that answers its waveform: v = gain (drive - threshold) with drive = amplitude exp(-((dwell - best)
/// / width)^2); fast droplets stretch, and leave a satellite when they are faster than the fall allows.
struct JettingModel {
  double threshold_v = 38.0;
  double gain_m_s_v = 0.07;
  double best_dwell_us = 33.0;
  double dwell_width_us = 22.0;
  double diameter_um = 60.0;
  double satellite_m_s_us = 0.35;  ///< satellites above this speed for each us of fall
  double stretch_s2_m2 = 0.006;    ///< roundness = 1 / (1 + stretch v^2)
  double angle_deg = 0.4;
};

/// The droplet of a waveform, if there is one, and how many satellites follow it.
struct JettedDroplet {
  FlyingDroplet droplet;
  int satellites = 0;
};
std::optional<JettedDroplet> jet(const JettingModel& head, const Waveform& waveform);

/// What `measure_pair` makes of a strobe pair of this head; for tune_waveform.
std::optional<DropletFigures> photograph(const JettingModel& head, const Waveform& waveform,
                                         const CameraConfig& camera, std::uint64_t seed);

}  // namespace meltstage::motion
