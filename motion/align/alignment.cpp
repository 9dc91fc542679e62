// SPDX-License-Identifier: Apache-2.0
#include "motion/align/alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

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

/// Whether a rigid copy of the plane, mirrored or not, brings each mark onto one of its own.
class Copies {
 public:
  Copies(const std::vector<Vector2d>& marks_mm, double tolerance_mm) : tolerance_mm_(tolerance_mm) {
    for (const auto& mark : marks_mm) marks_.emplace_back(mark.x(), mark.y());
  }

  /// Besides the copy that moves nothing.
  bool any() const {
    const std::size_t far = farthest_from_first();
    const double length = std::abs(marks_[far] - marks_[0]);
    for (std::size_t a = 0; a < marks_.size(); ++a)
      for (std::size_t b = 0; b < marks_.size(); ++b) {
        if (a == b || std::abs(std::abs(marks_[b] - marks_[a]) - length) > 2.0 * tolerance_mm_) continue;
        const bool moves = a != 0 || b != far;
        if (fits(far, a, b, true) || (moves && fits(far, a, b, false))) return true;
      }
    return false;
  }

 private:
  using Place = std::complex<double>;

  std::size_t farthest_from_first() const {
    const auto nearer = [&](const Place& p, const Place& q) {
      return std::abs(p - marks_[0]) < std::abs(q - marks_[0]);
    };
    return static_cast<std::size_t>(std::max_element(marks_.begin(), marks_.end(), nearer) - marks_.begin());
  }

  /// The first mark goes to `a`, the one far from it towards `b`.
  bool fits(std::size_t far, std::size_t a, std::size_t b, bool mirrored) const {
    const auto off_first = [&](const Place& p) {
      return mirrored ? std::conj(p - marks_[0]) : p - marks_[0];
    };
    const Place turn = (marks_[b] - marks_[a]) / off_first(marks_[far]);
    std::vector<char> taken(marks_.size(), 0);
    return std::all_of(marks_.begin(), marks_.end(), [&](const Place& mark) {
      const Place copy = marks_[a] + turn / std::abs(turn) * off_first(mark);
      for (std::size_t i = 0; i < marks_.size(); ++i)
        if (taken[i] == 0 && std::abs(marks_[i] - copy) <= 2.0 * tolerance_mm_) return taken[i] = 1, true;
      return false;
    });
  }

  double tolerance_mm_;
  std::vector<Place> marks_;
};

}  // namespace

bool looks_the_same_flipped(const std::vector<Vector2d>& marks_mm, double tolerance_mm) {
  return marks_mm.size() < 2 || Copies(marks_mm, tolerance_mm).any();
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
