// SPDX-License-Identifier: Apache-2.0
#include "tb/printer/board_alignment.hpp"

#include <fmt/format.h>

#include <random>
#include <string>

#include "motion/align/prp_calibration.hpp"
#include "motion/align/prp_trials.hpp"

namespace meltstage::tb {

namespace {

using Eigen::Vector2d;

// The print's frame has its 200 mm x 200 mm over the middle of the alignment stage.
const Vector2d kPrintOrigin_mm(135.5, 168.0);
constexpr double kFrameTolerance_mm = 2.0;  // how well a mechanic lays one frame into the other
constexpr std::size_t kCalibrationPoses = 60;
constexpr std::size_t kMarksPerPose = 6;

motion::PrpGeometry nominal_stage() { return motion::seen_from({}, kPrintOrigin_mm, 0.0); }

motion::PrpStageModel built_stage(const BoardAlignment& job) {
  motion::PrpStageConfig config =
      motion::random_stage(nominal_stage(), {.frame_origin_mm = kFrameTolerance_mm}, job.seed);
  config.actuator_sigma_mm = job.slider_sigma_mm;
  return motion::PrpStageModel(config);
}

motion::Displacer displacer(const BoardAlignment& job, motion::PrpStageModel& stage) {
  const motion::PrpGeometry nominal = nominal_stage();
  if (job.knowledge == StageKnowledge::nominal)
    return [nominal](const motion::PrpTurns& now, const motion::PlanarPose& by) {
      return motion::displaced_turns(nominal, now, by);
    };
  const auto plate = motion::plate_marks(11, 11, 40.0, {-100.0, -100.0});
  motion::PrpCalibrationOptions options;
  options.actuator_sigma_mm = job.slider_sigma_mm;
  const auto poses = motion::choose_poses(kCalibrationPoses, nominal, options);
  const auto calibration = motion::calibrate_prp(
      plate, motion::view_plate(stage.with_plate(plate), plate, poses, kMarksPerPose), nominal, options);
  return [calibration](const motion::PrpTurns& now, const motion::PlanarPose& by) {
    return motion::displaced_turns(calibration, now, by);
  };
}

// The board as it lies on the platform, and the camera that looks at it.
class LaidBoard {
 public:
  LaidBoard(const BoardAlignment& job, const motion::PrpStageModel& stage, const AlignmentProgress& progress)
      : job_(job), stage_(stage), progress_(progress), home_(stage.true_pose()), random_(job.seed + 1) {
    for (const Vector2d& mark : job.marks_mm) middle_ += mark / static_cast<double>(job.marks_mm.size());
  }

  BoardPlace place() const { return {off(), job_.upside_down ? std::optional(middle_.x()) : std::nullopt}; }

  // An image over each place where a mark is wanted; what is within reach of it counts.
  std::vector<Vector2d> seen() {
    std::vector<motion::Disc> discs;
    const BoardPlace now = place();
    for (std::size_t i = 0; i < job_.marks_mm.size(); ++i)
      if (i != job_.missing_mark) discs.push_back({now.of(job_.marks_mm[i]), job_.mark_diameter_mm});
    std::normal_distribution<double> stop(0.0, job_.camera_stop_sigma_mm);
    std::vector<Vector2d> found;
    const std::string step = fmt::format("looking at the board, look {}", ++looks_);
    std::size_t looked_at = 0;
    for (const Vector2d& wanted : job_.marks_mm) {
      if (progress_)
        progress_(step, static_cast<double>(looked_at++) / static_cast<double>(job_.marks_mm.size()));
      const double dx = stop(random_), dy = stop(random_);
      std::vector<motion::Disc> in_view = discs;
      for (motion::Disc& disc : in_view) disc.at_mm -= wanted + Vector2d(dx, dy);
      const motion::GrayImage image = motion::render(in_view, job_.camera, random_());
      for (const motion::DotMark& mark : motion::find_dots(image)) {
        const Vector2d from_wanted = job_.camera.pixel_mm * motion::in_camera(mark, image);
        if (from_wanted.norm() <= job_.limits.capture_mm) found.push_back(wanted + from_wanted);
      }
    }
    return found;
  }

 private:
  // From where the print expects a place of the board to where it is now.
  motion::PlanarPose off() const {
    const motion::PlanarPose to_middle{middle_.x(), middle_.y(), 0.0};
    const auto laid = motion::compose(to_middle, motion::compose(job_.lies, motion::inverse_of(to_middle)));
    return motion::compose(motion::displacement(home_, stage_.true_pose()), laid);
  }

  const BoardAlignment& job_;
  const motion::PrpStageModel& stage_;
  const AlignmentProgress& progress_;
  int looks_ = 0;
  motion::PlanarPose home_;
  std::mt19937_64 random_;
  Vector2d middle_ = Vector2d::Zero();
};

}  // namespace

AlignedBoard align_board(const BoardAlignment& job, const AlignmentProgress& progress) {
  motion::PrpStageModel stage = built_stage(job);
  const motion::Displacer displaced = displacer(job, stage);
  stage.approach_from_below(motion::PrpTurns::Zero());
  LaidBoard board(job, stage, progress);
  const motion::AlignmentMachine machine{
      [&](const motion::PrpTurns& turns) { stage.approach_from_below(turns); }, [&] { return board.seen(); }};
  AlignedBoard aligned;
  aligned.result =
      motion::align_board(machine, displaced, motion::PrpTurns::Zero(), job.marks_mm, job.limits);
  aligned.place = board.place();
  return aligned;
}

}  // namespace meltstage::tb
