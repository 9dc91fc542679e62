// SPDX-License-Identifier: Apache-2.0
#include "motion/align/prp.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "motion/align/prp_trials.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;
using ::testing::StartsWith;

const PrpGeometry nominal;

/// Paper 003, eq. (3), as printed.
Eigen::Vector3d printed_inverse(const PlanarPose& pose) {
  const double t = std::tan(pose.angle_rad);
  return {pose.x_mm + (pose.y_mm - 268.0) * t, pose.y_mm + (39.5 - pose.x_mm) * t,
          pose.y_mm + (431.5 - pose.x_mm) * t};
}

/// Paper 003, eq. (4), as printed.
PlanarPose printed_forward(const Eigen::Vector3d& q) {
  const double d1 = 268.0, d2 = 39.5, d23 = 431.5 - 39.5, d = q[2] - q[1], below = d23 * d23 + d * d;
  return {(q[0] * d23 * d23 - q[1] * d23 * d + d1 * d23 * d + d2 * d * d) / below,
          (q[0] * d23 * d + q[1] * d23 * d23 + d1 * d * d - d2 * d23 * d) / below, std::atan(d / d23)};
}

TEST(Prp, NominalIsThePapersEquations) {
  for (const PlanarPose& pose : random_poses(nominal, 5.0, 1000, 1)) {
    const PrpTurns turns = prp_inverse(nominal, pose);
    EXPECT_LT((2.0 * turns - printed_inverse(pose)).norm(), 1e-12);
    const PlanarPose forward = prp_forward(nominal, turns), printed = printed_forward(2.0 * turns);
    EXPECT_NEAR(forward.x_mm, printed.x_mm, 1e-12);
    EXPECT_NEAR(forward.y_mm, printed.y_mm, 1e-12);
    EXPECT_NEAR(forward.angle_rad, printed.angle_rad, 1e-15);
  }
}

TEST(Prp, RoundTripWithAllErrors) {
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const PrpGeometry built = random_stage(nominal, {}, seed).geometry;
    for (const PlanarPose& pose : random_poses(built, 5.0, 100, seed)) {
      const PlanarPose back = prp_forward(built, prp_inverse(built, pose));
      worst = std::max({worst, std::abs(back.x_mm - pose.x_mm), std::abs(back.y_mm - pose.y_mm),
                        100.0 * std::abs(back.angle_rad - pose.angle_rad)});
    }
  }
  EXPECT_LT(worst, 1e-12);
}

TEST(Prp, JacobianIsTheDifferenceQuotient) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const PrpGeometry built = random_stage(nominal, {}, seed).geometry;
    const PrpTurns at(0.7, -1.9, 1.3);
    const Eigen::Matrix3d jacobian = prp_jacobian(built, at);
    for (int i = 0; i < 3; ++i) {
      PrpTurns low = at, high = at;
      low[i] -= 1e-4;
      high[i] += 1e-4;
      const PlanarPose a = prp_forward(built, low), b = prp_forward(built, high);
      EXPECT_NEAR(jacobian(0, i), (b.x_mm - a.x_mm) / 2e-4, 1e-7);
      EXPECT_NEAR(jacobian(1, i), (b.y_mm - a.y_mm) / 2e-4, 1e-7);
      EXPECT_NEAR(jacobian(2, i), (b.angle_rad - a.angle_rad) / 2e-4, 1e-10);
    }
  }
}

TEST(Prp, AnotherFrameSeesTheSameStage) {
  const Vector2d origin(31.0, -12.0);
  const double angle = 0.02;
  const PrpGeometry built = random_stage(nominal, {}, 5).geometry;
  const PrpGeometry seen = seen_from(built, origin, angle);
  const PlanarPose frame{origin.x(), origin.y(), angle};
  for (const PlanarPose& pose : random_poses(built, 5.0, 50, 2)) {
    const PlanarPose in_frame = compose(inverse_of(frame), pose);
    const PlanarPose found = prp_forward(seen, prp_inverse(built, pose));
    EXPECT_NEAR(found.x_mm, in_frame.x_mm, 1e-10);
    EXPECT_NEAR(found.y_mm, in_frame.y_mm, 1e-10);
    EXPECT_NEAR(found.angle_rad, in_frame.angle_rad, 1e-13);
  }
}

TEST(Prp, EveryErrorIsFelt) {
  // Fifteen errors, none of which leaves the pose as it was.
  const PrpTurns at(1.1, -0.8, 1.7);
  const PlanarPose pose = prp_forward(nominal, at);
  std::vector<PrpGeometry> built(15, nominal);
  for (std::size_t i = 0; i < 3; ++i) {
    built[i].lead_mm[i] += 0.006;
    built[3 + i].offset_mm[i] += 0.3;
    built[6 + i].d_mm[i] += 1.0;
    built[9 + i].beta_rad[i] += 0.003;
  }
  built[12].link_mm = 0.02;
  built[13].alpha1_rad += 0.003;
  built[14].alpha2_rad += 0.003;
  for (const PrpGeometry& geometry : built) {
    const PlanarPose other = prp_forward(geometry, at);
    const double off = std::hypot(other.x_mm - pose.x_mm, other.y_mm - pose.y_mm) +
                       268.0 * std::abs(other.angle_rad - pose.angle_rad);
    EXPECT_GT(off, 5e-5);  // the betas are the smallest: they count with the travel only
  }
}

TEST(Prp, RefusesWhatCannotBe) {
  EXPECT_EQ(error_of([] {
              displaced_turns(nominal, PrpTurns::Zero(), {6.0, 0.0, 0.0});
            }),
            "stage pose out of reach: branch 1 would travel 6.0000 mm, expected at most +-5 mm; turn or move "
            "the board "
            "less");
  EXPECT_THAT(error_of([] {
                prp_inverse(nominal, {NAN, 0.0, 0.0});
              }),
              StartsWith("stage pose: found (nan mm"));
  EXPECT_THAT(error_of([] {
                prp_forward(nominal, {0.0, INFINITY, 0.0});
              }),
              StartsWith("stage motors: found 0, inf, 0 turns"));
  for (const double lead_mm : {0.0, -2.0, double(NAN), double(INFINITY)}) {
    PrpGeometry still;
    still.lead_mm[1] = lead_mm;
    const std::string said = fmt::format(
        "stage geometry: lead of branch 2: found {} mm, expected a finite number above 0", lead_mm);
    EXPECT_EQ(error_of([&] { prp_inverse(still, {}); }), said);
    EXPECT_EQ(error_of([&] { prp_forward(still, PrpTurns::Zero()); }), said);
    EXPECT_EQ(error_of([&] { prp_jacobian(still, PrpTurns::Zero()); }), said);
    EXPECT_EQ(error_of([&] { check_stroke(still, PrpTurns::Zero()); }), said);
    EXPECT_EQ(error_of([&] { seen_from(still, {0.0, 0.0}, 0.1); }), said);
  }
  PrpGeometry along;  // branch 1 slides along its own guide
  along.alpha1_rad = 0.0;
  EXPECT_THAT(error_of([&] {
                prp_inverse(along, {1.0, 1.0, 0.0});
              }),
              StartsWith("stage geometry: found turns of"));
  along.beta_rad[1] = NAN;
  EXPECT_THAT(error_of([&] {
                prp_inverse(along, {1.0, 1.0, 0.1});
              }),
              StartsWith("stage geometry: found turns of"));
  PrpGeometry broken;
  broken.link_mm = 500.0;
  EXPECT_THAT(error_of([&] { prp_forward(broken, PrpTurns::Zero()); }),
              StartsWith("stage geometry: found links"));
}

TEST(StageModel, ScattersAsToldAndLagsByItsBacklash) {
  PrpStageConfig config;
  config.mark_sigma_mm = 0.0;
  config.backlash_mm = 0.004;
  PrpStageModel stage(config);
  std::vector<double> below, above;
  for (int i = 0; i < 2000; ++i) {
    stage.move_to(PrpTurns::Constant(-0.2));
    stage.move_to(PrpTurns::Zero());
    below.push_back(stage.true_pose().x_mm);
    stage.move_to(PrpTurns::Constant(0.2));
    stage.move_to(PrpTurns::Zero());
    above.push_back(stage.true_pose().x_mm);
  }
  const auto mean = [](const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  };
  EXPECT_NEAR(mean(above) - mean(below), 0.004, 2e-4);
}

TEST(Repeatability, IsThatOfIso9283) {
  // Four poses on a circle of 2 um: all at one distance, so that RP is that distance.
  const std::vector<AlignmentError> cross{
      {{0.002, 0.0}, 1e-6}, {{0.0, 0.002}, -1e-6}, {{-0.002, 0.0}, 1e-6}, {{0.0, -0.002}, -1e-6}};
  const Repeatability found = repeatability(cross);
  EXPECT_NEAR(found.radius_mm, 0.002, 1e-12);
  EXPECT_NEAR(found.enclosing_mm, 0.002, 1e-6);
  EXPECT_NEAR(found.angle_rad, 3.0 * std::sqrt(4.0 / 3.0) * 1e-6, 1e-12);
  EXPECT_EQ(error_of([&] { repeatability({cross[0]}); }),
            "repeatability: found 1 poses attained, expected at least 2");
}

}  // namespace
}  // namespace meltstage::motion
