// SPDX-License-Identifier: Apache-2.0
// Alignment before printing: board marks seen, displacement found, branches moved, result verified by the
// camera.
#pragma once

#include <functional>
#include <vector>

#include "motion/align/planar_pose.hpp"
#include "motion/align/prp.hpp"

namespace meltstage::motion {

/// The stage with a board on it.
struct AlignmentMachine {
  std::function<void(const PrpTurns&)> move_to;
  std::function<std::vector<Eigen::Vector2d>()> see_board;  ///< marks in the camera's frame, any order
};

/// Turns that displace the platform from where it stands: displaced_turns of a geometry or of a calibration.
using Displacer = std::function<PrpTurns(const PrpTurns& now, const PlanarPose& by)>;

struct AlignmentLimits {
  double place_mm = 0.005;  ///< a mark may be off by this in the end
  double board_mm = 0.05;   ///< marks may lie this far (rms) from where the board's data have them
  double capture_mm = 3.0;  ///< a mark is looked for this near to where it is wanted
  int most_moves = 3;
};

/// One look at the board.
struct AlignmentLook {
  PrpTurns turns;         ///< at which it was taken
  PlanarPose to_go;       ///< displacement that is left
  double worst_mm = 0.0;  ///< of the marks from where they are wanted
};

struct AlignmentResult {
  bool aligned = false;
  std::vector<AlignmentLook> looks;  ///< first to last: one more than moves
};

/// Whether the marks look the same, each to within about `tolerance_mm`, with the board turned over or round
/// in some way: then no camera can tell that it lies so.
bool looks_the_same_flipped(const std::vector<Eigen::Vector2d>& marks_mm, double tolerance_mm);

/// The seen mark of each wanted one: the only one within reach.
/// @throws MotionError that names the mark, if none or several are there, or a coordinate isn't finite.
std::vector<Eigen::Vector2d> match_marks(const std::vector<Eigen::Vector2d>& wanted_mm,
                                         const std::vector<Eigen::Vector2d>& seen_mm, double reach_mm);

/// Looks, moves by what is left and looks again, until every mark is within the limit or the moves are used
/// up. The first move takes all of it; the others only correct what the camera still sees.
/// @param wanted_mm marks in the camera's frame where the print expects them.
/// @throws MotionError if marks are too few, missing or mirrored, the board isn't the one described, or the
/// pose is out of reach; the stage has then not been moved by that look.
AlignmentResult align_board(const AlignmentMachine& machine, const Displacer& displaced,
                            const PrpTurns& start, const std::vector<Eigen::Vector2d>& wanted_mm,
                            const AlignmentLimits& limits = {});

}  // namespace meltstage::motion
