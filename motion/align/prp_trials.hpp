// SPDX-License-Identifier: Apache-2.0
// Trials of an alignment stage: paper 003's protocol (eight poses, mean of five), random poses, and
// repeatability after ISO 9283.
#pragma once

#include <functional>
#include <vector>

#include "motion/align/prp_calibration.hpp"
#include "motion/align/prp_stage_model.hpp"

namespace meltstage::motion {

/// The eight nominal poses of paper 003, table 2.
std::vector<PlanarPose> table2_poses();

/// Poses whose sliders (of the nominal geometry) lie uniformly within +-`travel_mm`.
std::vector<PlanarPose> random_poses(const PrpGeometry& nominal, double travel_mm, std::size_t count,
                                     std::uint64_t seed);

/// Turns that take a board's marks from where they were seen, the stage at home, to where they are wanted.
using Aligner = std::function<PrpTurns(const std::vector<Eigen::Vector2d>& seen_mm,
                                       const std::vector<Eigen::Vector2d>& wanted_mm)>;

/// By a geometry alone: nominal, or (the floor of any method) the true one.
Aligner align_by(const PrpGeometry& geometry);
Aligner align_by(PrpCalibration calibration);

/// What is left after an alignment: at the middle of the board's marks, as the camera sees it.
struct AlignmentError {
  Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();
  double angle_rad = 0.0;
};

struct TrialSetup {
  /// Marks in the platform's frame: a board with one in each corner.
  std::vector<Eigen::Vector2d> board_mm{{85.0, 135.0}, {385.0, 135.0}, {385.0, 335.0}, {85.0, 335.0}};
  PrpTurns home = PrpTurns::Zero();
  int repeats = 5;             ///< of each pose, averaged
  bool home_scatters = false;  ///< else the home stop is what the scatter of the others is counted from
};

/// Paper 003, section 5.2: the board is seen at home, aligned to the pose, seen again; mean over the repeats.
std::vector<AlignmentError> try_poses(PrpStageModel& stage, const std::vector<PlanarPose>& poses,
                                      const Aligner& aligner, const TrialSetup& setup);

/// Largest distance, mm, and largest angle, rad.
AlignmentError worst_of(const std::vector<AlignmentError>& errors);

/// Sees `marks_per_view` marks of the plate at each pose, spread over it.
std::vector<PlateView> view_plate(const PrpMachine& machine, const std::vector<Eigen::Vector2d>& plate_mm,
                                  const std::vector<PrpTurns>& poses, std::size_t marks_per_view);

/// Marks of a plate over the platform: `columns` x `rows`, `pitch_mm` apart.
std::vector<Eigen::Vector2d> plate_marks(std::size_t columns, std::size_t rows, double pitch_mm,
                                         const Eigen::Vector2d& first_mm);

/// Repeatability of attained poses.
struct Repeatability {
  double radius_mm = 0.0;     ///< RP = mean + 3 sigma of the distances from the barycentre (ISO 9283, 7.2)
  double angle_rad = 0.0;     ///< +- 3 sigma
  double enclosing_mm = 0.0;  ///< radius of the smallest circle around all
};

/// @throws MotionError if there are fewer than two.
Repeatability repeatability(const std::vector<AlignmentError>& attained);

}  // namespace meltstage::motion
