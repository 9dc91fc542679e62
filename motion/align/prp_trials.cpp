// SPDX-License-Identifier: Apache-2.0
#include "motion/align/prp_trials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

namespace meltstage::motion {

using Eigen::Vector2d;

namespace {

/// Marks far from each other: each the farthest from those chosen before.
std::vector<std::size_t> spread_marks(const std::vector<Vector2d>& plate_mm, std::size_t count) {
  std::vector<std::size_t> chosen{0};
  std::vector<double> nearest_mm(plate_mm.size(), INFINITY);
  while (chosen.size() < std::min(count, plate_mm.size())) {
    for (std::size_t i = 0; i < plate_mm.size(); ++i)
      nearest_mm[i] = std::min(nearest_mm[i], (plate_mm[i] - plate_mm[chosen.back()]).norm());
    const auto farthest = std::max_element(nearest_mm.begin(), nearest_mm.end());
    chosen.push_back(static_cast<std::size_t>(farthest - nearest_mm.begin()));
  }
  return chosen;
}

}  // namespace

std::vector<PlanarPose> table2_poses() {
  constexpr double kUm = 1e-3;
  std::vector<PlanarPose> poses;
  for (const auto& [x_um, y_um, arcsec] : std::initializer_list<std::array<double, 3>>{{1230, 1452, -681},
                                                                                       {1251, -2121, -572},
                                                                                       {-625, -1002, -325},
                                                                                       {-1610, 1321, -261},
                                                                                       {-2009, 421, 115},
                                                                                       {-921, -1373, 481},
                                                                                       {2131, -1521, 572},
                                                                                       {2010, 1275, 624}})
    poses.push_back({x_um * kUm, y_um * kUm, arcsec * kArcsecond_rad});
  return poses;
}

std::vector<PlanarPose> random_poses(const PrpGeometry& nominal, double travel_mm, std::size_t count,
                                     std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> travel(-travel_mm, travel_mm);
  std::vector<PlanarPose> poses;
  while (poses.size() < count) {
    PrpTurns turns;
    for (int i = 0; i < 3; ++i) turns[i] = travel(random) / nominal.lead_mm[static_cast<std::size_t>(i)];
    poses.push_back(prp_forward(nominal, turns));
  }
  return poses;
}

Aligner align_by(const PrpGeometry& geometry) {
  return [geometry](const std::vector<Vector2d>& seen_mm, const std::vector<Vector2d>& wanted_mm) {
    return displaced_turns(geometry, PrpTurns::Zero(), fit_pose(seen_mm, wanted_mm).pose);
  };
}

Aligner align_by(PrpCalibration calibration) {
  return [calibration = std::move(calibration)](const std::vector<Vector2d>& seen_mm,
                                                const std::vector<Vector2d>& wanted_mm) {
    return displaced_turns(calibration, PrpTurns::Zero(), fit_pose(seen_mm, wanted_mm).pose);
  };
}

std::vector<AlignmentError> try_poses(PrpStageModel& stage, const std::vector<PlanarPose>& poses,
                                      const Aligner& aligner, const TrialSetup& setup) {
  const auto see_board = [&] {
    std::vector<Vector2d> seen;
    for (const auto& mark : setup.board_mm) seen.push_back(stage.see(mark));
    return seen;
  };
  std::vector<AlignmentError> errors;
  for (const PlanarPose& pose : poses) {
    AlignmentError mean;
    for (int i = 0; i < setup.repeats; ++i) {
      if (setup.home_scatters)
        stage.approach_from_below(setup.home);
      else
        stage.stand_at(setup.home);
      const std::vector<Vector2d> seen = see_board();
      std::vector<Vector2d> wanted;
      for (const auto& mark : seen) wanted.push_back(moved(pose, mark));
      stage.approach_from_below(aligner(seen, wanted));
      const std::vector<Vector2d> attained = see_board();
      for (std::size_t j = 0; j < wanted.size(); ++j)
        mean.place_mm += (attained[j] - wanted[j]) / static_cast<double>(wanted.size());
      mean.angle_rad += fit_pose(wanted, attained).pose.angle_rad;
    }
    errors.push_back({mean.place_mm / setup.repeats, mean.angle_rad / setup.repeats});
  }
  return errors;
}

AlignmentError worst_of(const std::vector<AlignmentError>& errors) {
  AlignmentError worst;
  for (const auto& error : errors) {
    if (error.place_mm.norm() > worst.place_mm.norm()) worst.place_mm = error.place_mm;
    worst.angle_rad = std::max(worst.angle_rad, std::abs(error.angle_rad));
  }
  return worst;
}

std::vector<PlateView> view_plate(const PrpMachine& machine, const std::vector<Vector2d>& plate_mm,
                                  const std::vector<PrpTurns>& poses, std::size_t marks_per_view) {
  const std::vector<std::size_t> marks = spread_marks(plate_mm, marks_per_view);
  std::vector<PlateView> views;
  for (const PrpTurns& turns : poses) {
    machine.move_to(turns);
    PlateView view{turns, marks, {}};
    for (const std::size_t mark : marks) view.seen_mm.push_back(machine.see(mark));
    views.push_back(view);
  }
  return views;
}

std::vector<Vector2d> plate_marks(std::size_t columns, std::size_t rows, double pitch_mm,
                                  const Vector2d& first_mm) {
  std::vector<Vector2d> marks;
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < columns; ++column)
      marks.push_back(first_mm + pitch_mm * Vector2d(static_cast<double>(column), static_cast<double>(row)));
  return marks;
}

Repeatability repeatability(const std::vector<AlignmentError>& attained) {
  if (attained.size() < 2)
    throw MotionError(
        fmt::format("repeatability: found {} poses attained, expected at least 2", attained.size()));
  const auto count = static_cast<double>(attained.size());
  AlignmentError centre;
  for (const auto& each : attained) {
    centre.place_mm += each.place_mm / count;
    centre.angle_rad += each.angle_rad / count;
  }
  double mean = 0.0, squares = 0.0, angle_squares = 0.0;
  std::vector<cv::Point2f> points_um;  // floats: about the centre
  for (const auto& each : attained) {
    const Vector2d off = each.place_mm - centre.place_mm;
    mean += off.norm() / count;
    angle_squares += std::pow(each.angle_rad - centre.angle_rad, 2);
    points_um.emplace_back(static_cast<float>(off.x() * 1e3), static_cast<float>(off.y() * 1e3));
  }
  for (const auto& each : attained) squares += std::pow((each.place_mm - centre.place_mm).norm() - mean, 2);
  cv::Point2f middle;
  float radius_um = 0.0F;
  cv::minEnclosingCircle(points_um, middle, radius_um);
  return {mean + 3.0 * std::sqrt(squares / (count - 1.0)), 3.0 * std::sqrt(angle_squares / (count - 1.0)),
          static_cast<double>(radius_um) * 1e-3};
}

}  // namespace meltstage::motion
