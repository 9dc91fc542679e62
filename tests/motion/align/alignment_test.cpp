// SPDX-License-Identifier: Apache-2.0
#include "motion/align/alignment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "motion/align/prp_trials.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const PrpGeometry nominal;
const std::vector<Vector2d> board{{85.0, 135.0}, {385.0, 135.0}, {385.0, 335.0}, {120.0, 335.0}};

/// A board that lies a little off on a simulated stage.
struct Bench {
  PrpStageModel stage;
  PlanarPose lies;
  int moves = 0;
  std::vector<Vector2d> marks = board;

  explicit Bench(std::uint64_t seed, const PlanarPose& off = {0.8, -1.1, 0.002})
      : stage(random_stage(nominal, {.frame_origin_mm = 20.0}, seed)), lies(off) {}

  AlignmentMachine machine() {
    return {[this](const PrpTurns& turns) {
              ++moves;
              stage.approach_from_below(turns);
            },
            [this] {
              std::vector<Vector2d> seen;
              // The camera's frame lies somewhere else: the board is wanted where the platform has it at
              // home.
              for (const auto& mark : marks) seen.push_back(stage.see(moved(lies, mark)));
              return seen;
            }};
  }
  std::vector<Vector2d> wanted() const {
    const PlanarPose home = prp_forward(stage.config().geometry, PrpTurns::Zero());
    std::vector<Vector2d> places;
    for (const auto& mark : board) places.push_back(moved(home, mark));
    return places;
  }
};

Displacer by_geometry(const PrpGeometry& geometry) {
  return [geometry](const PrpTurns& now, const PlanarPose& by) { return displaced_turns(geometry, now, by); };
}

TEST(Alignment, OneMoveWithTheRightGeometry) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Bench bench(seed);
    const auto result = align_board(bench.machine(), by_geometry(bench.stage.config().geometry),
                                    PrpTurns::Zero(), bench.wanted());
    EXPECT_TRUE(result.aligned);
    EXPECT_EQ(bench.moves, 1);
    ASSERT_EQ(result.looks.size(), 2U);
    EXPECT_GT(result.looks.front().worst_mm, 1.0);
    EXPECT_LT(result.looks.back().worst_mm, 0.005);
  }
}

TEST(Alignment, TheCameraCorrectsAWrongGeometry) {
  int moves = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Bench bench(seed);
    EXPECT_TRUE(align_board(bench.machine(), by_geometry(nominal), PrpTurns::Zero(), bench.wanted()).aligned);
    moves += bench.moves;
  }
  EXPECT_GT(moves, 10);
}

TEST(Alignment, SaysWhenItDidNotGetThere) {
  Bench bench(1);
  AlignmentLimits limits;
  limits.place_mm = 1e-5;  // far below the sliders' scatter
  const auto result =
      align_board(bench.machine(), by_geometry(nominal), PrpTurns::Zero(), bench.wanted(), limits);
  EXPECT_FALSE(result.aligned);
  EXPECT_EQ(bench.moves, 3);
}

TEST(Alignment, KnowsMarksThatDoNotTellWhichWayTheBoardLies) {
  const Vector2d a(0.0, 0.0), b(40.0, 0.0), c(40.0, 30.0), d(0.0, 30.0);
  const auto turned = [](std::vector<Vector2d> marks, double angle_rad) {
    for (Vector2d& mark : marks) mark = Eigen::Rotation2D<double>(angle_rad) * mark;
    return marks;
  };
  // However the board is placed: the flips were looked for over the stage's axes alone.
  for (const double angle_rad : {0.0, 0.3, 0.7853981633974483, 2.5}) {
    const auto same = [&](const std::vector<Vector2d>& marks) {
      return looks_the_same_flipped(turned(marks, angle_rad), 0.05);
    };
    EXPECT_TRUE(same({a, c}));
    EXPECT_TRUE(same({a, b}));
    EXPECT_TRUE(same({a, b, c, d}));
    EXPECT_TRUE(same({a, b, c + Vector2d(0.04, 0.0), d}));              // within the tolerance
    EXPECT_TRUE(same({a, b, Vector2d(20.0, 30.0)}));                    // over its height
    EXPECT_TRUE(same({a, Vector2d(40.0, 0.0), Vector2d(40.0, 40.0)}));  // over its diagonal
    EXPECT_TRUE(same({a, b, Vector2d(20.0, 20.0 * std::sqrt(3.0))}));
    EXPECT_FALSE(same({a, b, c}));
    EXPECT_FALSE(same({a, b, Vector2d(40.0, 33.0)}));
    EXPECT_FALSE(same({a, b, c, d + Vector2d(9.0, 0.0)}));
    EXPECT_FALSE(same({a, b, c + Vector2d(1.0, 0.0), d}));
  }
}

TEST(Alignment, RefusesWhatCannotBeAndDoesNotMove) {
  const auto refusal = [](const std::function<void(Bench&)>& spoil,
                          const PlanarPose& lies = {0.8, -1.1, 0.002}) {
    Bench bench(1, lies);
    spoil(bench);
    const std::string line = error_of(
        [&] { align_board(bench.machine(), by_geometry(nominal), PrpTurns::Zero(), bench.wanted()); });
    EXPECT_EQ(bench.moves, 0);
    return line;
  };
  EXPECT_THAT(refusal([](Bench& b) { b.marks.pop_back(); }),
              StartsWith("board mark 4: found 0 marks within 3 mm"));
  EXPECT_THAT(refusal([](Bench& b) { b.marks.push_back(board[0] + Vector2d(0.5, 0.0)); }),
              StartsWith("board mark 1: found 2 marks within 3 mm"));
  EXPECT_THAT(refusal([](Bench& b) { b.marks[2].x() += 1.0; }), HasSubstr("is it this board?"));
  EXPECT_THAT(refusal([](Bench& b) { b.marks[0].x() = NAN; }), HasSubstr("expected finite numbers"));
  EXPECT_THAT(refusal([](Bench&) {}, {0.0, 0.0, 0.02}),
              StartsWith("board mark"));  // beyond where marks are looked for

  Bench far(1, {2.5, 0.0, 0.0});
  far.machine().move_to(PrpTurns(-1.5, 0.0, 0.0));
  far.moves = 0;
  EXPECT_EQ(error_of([&] {
              AlignmentLimits wide;
              wide.capture_mm = 20.0;
              std::vector<Vector2d> wanted = far.wanted();
              for (auto& mark : wanted) mark.x() += 9.0;
              align_board(far.machine(), by_geometry(nominal), PrpTurns(-1.5, 0.0, 0.0), wanted, wide);
            }).substr(0, 39),
            "stage pose out of reach: branch 1 would");
  EXPECT_EQ(far.moves, 0);
}

}  // namespace
}  // namespace meltstage::motion
