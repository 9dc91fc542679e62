// SPDX-License-Identifier: Apache-2.0
#include "motion/align/alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;

void check_limits(const AlignmentLimits& limits) {
  if (!(limits.place_mm > 0.0) || !(limits.board_mm > 0.0) || !(limits.capture_mm > 0.0) ||
      limits.most_moves < 1)
    throw MotionError(
        fmt::format("alignment: found limits {} mm in place, {} mm on the board, {} mm around a mark and {} "
                    "moves, expected all above 0",
                    limits.place_mm, limits.board_mm, limits.capture_mm, limits.most_moves));
}

AlignmentLook look_at(const AlignmentMachine& machine, const PrpTurns& turns,
                      const std::vector<Vector2d>& wanted_mm, const AlignmentLimits& limits) {
  const std::vector<Vector2d> seen = match_marks(wanted_mm, machine.see_board(), limits.capture_mm);
  const PoseFit fit = fit_pose(seen, wanted_mm);
  if (fit.rms_mm > limits.board_mm)
    throw MotionError(
        fmt::format("board: found its marks {:.4f} mm (rms) from where its data have them, expected at most "
                    "{} mm; is it this board?",
                    fit.rms_mm, limits.board_mm));
  AlignmentLook look{turns, fit.pose, 0.0};
  for (std::size_t i = 0; i < seen.size(); ++i)
    look.worst_mm = std::max(look.worst_mm, (seen[i] - wanted_mm[i]).norm());
  return look;
}

}  // namespace

bool looks_the_same_flipped(const std::vector<Vector2d>& marks_mm, double reach_mm) {
  Vector2d middle = Vector2d::Zero();
  for (const auto& mark : marks_mm) middle += mark / static_cast<double>(marks_mm.size());
  const auto onto_themselves = [&](const Vector2d& signs) {
    return std::all_of(marks_mm.begin(), marks_mm.end(), [&](const Vector2d& mark) {
      const Vector2d flipped = middle + signs.cwiseProduct(mark - middle);
      return std::any_of(marks_mm.begin(), marks_mm.end(),
                         [&](const Vector2d& other) { return (other - flipped).norm() <= reach_mm; });
    });
  };
  return onto_themselves({-1.0, 1.0}) || onto_themselves({1.0, -1.0}) || onto_themselves({-1.0, -1.0});
}

std::vector<Vector2d> match_marks(const std::vector<Vector2d>& wanted_mm,
                                  const std::vector<Vector2d>& seen_mm, double reach_mm) {
  for (std::size_t i = 0; i < seen_mm.size(); ++i)
    if (!seen_mm[i].allFinite())
      throw MotionError(fmt::format("board: found mark {} of those seen at ({}, {}), expected finite numbers",
                                    i + 1, seen_mm[i].x(), seen_mm[i].y()));
  std::vector<Vector2d> matched;
  for (std::size_t i = 0; i < wanted_mm.size(); ++i) {
    std::vector<Vector2d> near;
    for (const auto& seen : seen_mm)
      if ((seen - wanted_mm[i]).norm() <= reach_mm) near.push_back(seen);
    if (near.size() != 1)
      throw MotionError(
          fmt::format("board mark {}: found {} marks within {} mm of ({:.3f}, {:.3f}) mm, expected 1; {}",
                      i + 1, near.size(), reach_mm, wanted_mm[i].x(), wanted_mm[i].y(),
                      near.empty() ? "is it dirty, or the board upside down, turned round or too far off?"
                                   : "is something else dark beside it?"));
    matched.push_back(near.front());
  }
  return matched;
}

AlignmentResult align_board(const AlignmentMachine& machine, const Displacer& displaced,
                            const PrpTurns& start, const std::vector<Vector2d>& wanted_mm,
                            const AlignmentLimits& limits) {
  check_limits(limits);
  AlignmentResult result;
  result.looks.push_back(look_at(machine, start, wanted_mm, limits));
  for (int move = 0; move < limits.most_moves && result.looks.back().worst_mm > limits.place_mm; ++move) {
    const PrpTurns turns = displaced(result.looks.back().turns, result.looks.back().to_go);
    machine.move_to(turns);
    result.looks.push_back(look_at(machine, turns, wanted_mm, limits));
  }
  result.aligned = result.looks.back().worst_mm <= limits.place_mm;
  return result;
}

}  // namespace meltstage::motion
