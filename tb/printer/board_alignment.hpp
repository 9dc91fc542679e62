// SPDX-License-Identifier: Apache-2.0
// Alignment before a print: the board lies on a virtual XY-Theta stage as somebody laid it there; a camera
// sees its marks, the stage moves it to where the print expects it, the camera looks again.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "motion/align/alignment.hpp"
#include "motion/align/dot_plate.hpp"
#include "tb/printer/board_place.hpp"

namespace meltstage::tb {

// What is known of the stage when it moves the board.
enum class StageKnowledge {
  nominal,     // its drawings
  calibrated,  // all parameters, by least squares from what its camera saw of a plate
               // (motion/prp_calibration)
};

struct BoardAlignment {
  std::vector<Eigen::Vector2d> marks_mm;  // where the print expects them, in the print's frame
  double mark_diameter_mm = 1.0;
  motion::AlignmentLimits limits{.capture_mm = 2.0};
  StageKnowledge knowledge = StageKnowledge::calibrated;

  // The virtual machine.
  motion::PlanarPose lies;                  // how the board was laid, about the middle of its marks
  bool upside_down = false;                 // turned over about the middle of its marks
  std::optional<std::size_t> missing_mark;  // one that isn't there, from 0
  double slider_sigma_mm = 0.001;           // scatter of the sliders' stops
  double camera_stop_sigma_mm = 0.0003;     // of the camera's, per axis
  motion::PlateCamera camera;
  std::uint64_t seed = 1;
};

struct AlignedBoard {
  motion::AlignmentResult result;  // as the camera saw it
  BoardPlace place;                // in truth, with what is left
};

// The step that the alignment is at, and the share 0..1 of it that is done.
using AlignmentProgress = std::function<void(std::string_view step, double share)>;

// Throws motion::MotionError, one line, if a mark isn't found, the board isn't the one described or the pose
// is out of the stage's reach. `progress` hears of each look at the board, mark by mark.
AlignedBoard align_board(const BoardAlignment& job, const AlignmentProgress& progress = {});

}  // namespace meltstage::tb
