// SPDX-License-Identifier: Apache-2.0
// A simulated 3-PRP alignment stage under a camera: geometric and gear errors, scatter of the stops,
// backlash, screws and guides that aren't straight, noise of the camera.
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "motion/align/prp.hpp"

namespace meltstage::motion {

/// A stage as built; its geometry is as seen from the camera's frame.
struct PrpStageConfig {
  PrpGeometry geometry;
  double actuator_sigma_mm = 0.001;   ///< scatter of each slider's stops (paper: RP 3.27 um, 1 um a branch)
  double mark_sigma_mm = 0.00025;     ///< of the camera, per coordinate: 1/50 pixel of 12.34 um
  double backlash_mm = 0.0;           ///< dead band of each branch
  double screw_wave_mm = 0.0;         ///< amplitude of the screws' cumulative lead error, a wave ...
  double screw_wavelength_mm = 12.0;  ///< ... of this length
  double guide_bow_mm = 0.0;          ///< sag of branch 1's guide at the end of its way
  std::uint64_t seed = 1;
};

/// How far a stage is from nominal: each error uniform within +- its tolerance.
struct PrpTolerances {
  double lead_share = 0.003;
  double offset_mm = 0.3, d_mm = 1.0, link_mm = 0.02;
  double angle_rad = 0.003;       ///< of beta 1..3, alpha 1, alpha 2
  double frame_origin_mm = 50.0;  ///< of the camera's frame in the stage's
  double frame_angle_rad = 0.003;
};

/// A stage drawn at random.
PrpStageConfig random_stage(const PrpGeometry& nominal, const PrpTolerances& tolerances, std::uint64_t seed);

/// What a calibration or an alignment has of the machine.
struct PrpMachine {
  std::function<void(const PrpTurns&)> move_to;
  /// Where a mark stands in the camera's frame, mm; marks are named by their place on the platform at home.
  std::function<Eigen::Vector2d(std::size_t mark)> see;
};

class PrpStageModel {
 public:
  explicit PrpStageModel(const PrpStageConfig& config);

  /// Every slider is driven to its place and stops there to within its scatter and half the backlash.
  void move_to(const PrpTurns& turns);
  /// Drives every slider beyond its place first, so that all stops are approached from below.
  void approach_from_below(const PrpTurns& turns);

  /// Every slider exactly at its place: the mean of many stops there.
  void stand_at(const PrpTurns& turns);

  /// A mark of the platform (in the platform's frame) as the camera measures it.
  Eigen::Vector2d see(const Eigen::Vector2d& on_platform_mm);

  /// The stage with a plate on it; the model must outlive the machine.
  PrpMachine with_plate(std::vector<Eigen::Vector2d> on_platform_mm);

  const PlanarPose& true_pose() const { return pose_; }
  const PrpStageConfig& config() const { return config_; }

 private:
  double noise(double sigma);
  void place(const PrpTurns& turns, double scatter_mm);

  PrpStageConfig config_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  PrpTurns commanded_ = PrpTurns::Zero();
  std::array<double, 3> lost_mm_{};  // where the slider lags behind its screw
  PlanarPose pose_;
};

}  // namespace meltstage::motion
