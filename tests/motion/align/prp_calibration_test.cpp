// SPDX-License-Identifier: Apache-2.0
#include "motion/align/prp_calibration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "motion/align/prp_trials.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using Eigen::Vector2d;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const PrpGeometry nominal;
const auto plate = plate_marks(11, 11, 40.0, {35.0, 35.0});
constexpr std::size_t kMarks = 6;

const IdentifiedParameter& parameter(const PrpCalibration& found, const std::string& name) {
  for (const auto& each : found.parameters)
    if (each.name == name) return each;
  throw std::out_of_range(name);
}

AlignmentError worst_with(PrpStageModel& stage, const Aligner& aligner) {
  return worst_of(try_poses(stage, table2_poses(), aligner, {}));
}

TEST(Calibration, OfAQuietStageIsExact) {
  PrpCalibrationOptions quiet;  // the priors count for nothing beside such data
  quiet.actuator_sigma_mm = 1e-6;
  quiet.mark_sigma_mm = 2.5e-7;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    PrpStageConfig config = random_stage(nominal, {}, seed);
    config.actuator_sigma_mm = config.mark_sigma_mm = 0.0;
    PrpStageModel stage(config);
    const auto found = calibrate_prp(
        plate, view_plate(stage.with_plate(plate), plate, choose_poses(60, nominal), kMarks), nominal, quiet);
    for (const char* name : {"R_1", "R_2", "R_3"})
      EXPECT_NEAR(parameter(found, name).value,
                  config.geometry.lead_mm[static_cast<std::size_t>(name[2] - '1')], 1e-5);
    // What can't be told apart makes no difference: the poses are met all the same.
    EXPECT_LT(worst_with(stage, align_by(found)).place_mm.norm(), 2e-5);
    EXPECT_LT(worst_with(stage, align_by(found)).angle_rad, 0.01 * kArcsecond_rad);
    EXPECT_GT(worst_with(stage, align_by(nominal)).place_mm.norm(), 0.01);
  }
}

/// Squares of what the true geometry leaves of the sliders' places, in their sigma: the noise that was drawn.
double squares_of_truth(const PrpStageConfig& config, const std::vector<PlateView>& views) {
  double squares = 0.0;
  for (const PlateView& view : views) {
    std::vector<Vector2d> on_platform;
    for (const std::size_t mark : view.marks) on_platform.push_back(plate[mark]);
    const PrpTurns reached = prp_inverse(config.geometry, fit_pose(on_platform, view.seen_mm).pose);
    for (std::size_t i = 0; i < 3; ++i)
      squares += std::pow((reached - view.turns)[static_cast<Eigen::Index>(i)] * config.geometry.lead_mm[i] /
                              config.actuator_sigma_mm,
                          2);
  }
  return squares;
}

/// What the found geometry leaves, likewise.
double squares_of(const PrpCalibration& found, double sigma_mm) {
  double squares = 0.0;
  for (const auto& residual : found.residuals_mm) squares += residual.squaredNorm() / (sigma_mm * sigma_mm);
  return squares;
}

TEST(Calibration, UncertaintiesAreHonest) {
  // Gear ratios, d and alpha_1 over 100 stages: deviations in their own sigma have mean square 1.
  // The priors are those that the stages are drawn from: a uniform error's sigma is its tolerance over
  // sqrt 3.
  PrpCalibrationOptions options;
  const PrpTolerances drawn;
  const double share = 1.0 / std::sqrt(3.0);
  options.priors.lead_share = drawn.lead_share * share;
  options.priors.offset_mm = options.priors.d_mm = drawn.frame_origin_mm * share;
  options.priors.link_mm = drawn.link_mm * share;
  options.priors.angle_rad = std::sqrt(2.0) * drawn.angle_rad * share;  // its own and the camera's
  constexpr int kStages = 100;
  const auto poses = choose_poses(40, nominal, options);
  double squares = 0.0, count = 0.0, mean_square_misfit = 0.0, mean_taken = 0.0;
  for (std::uint64_t seed = 1; seed <= kStages; ++seed) {
    const PrpStageConfig config = random_stage(nominal, {}, seed);
    PrpStageModel stage(config);
    const auto views = view_plate(stage.with_plate(plate), plate, poses, kMarks);
    const auto found = calibrate_prp(plate, views, nominal, options);
    const auto add = [&](const char* name, double truth) {
      const auto& each = parameter(found, name);
      squares += std::pow((each.value - truth) / each.sigma, 2);
      count += 1.0;
    };
    add("R_1", config.geometry.lead_mm[0]);
    add("R_2", config.geometry.lead_mm[1]);
    add("R_3", config.geometry.lead_mm[2]);
    add("d_1", config.geometry.d_mm[0]);
    add("d_2", config.geometry.d_mm[1]);
    add("d_3", config.geometry.d_mm[2]);
    add("alpha_1", config.geometry.alpha1_rad);
    mean_square_misfit += found.misfit * found.misfit / kStages;
    // No stage ends in a local minimum: the truth never fits better by more than the priors' pull, and what
    // the fit takes of the noise is chi-squared with the 15 degrees of freedom that the data determine (above
    // 50 one time in 85,000). The misfit of a single stage is that of the noise it happened to draw.
    const double taken = squares_of_truth(config, views) - squares_of(found, config.actuator_sigma_mm);
    EXPECT_GT(taken, -2.0) << "stage " << seed;
    EXPECT_LT(taken, 50.0) << "stage " << seed;
    mean_taken += taken / kStages;
  }
  // Degrees of freedom: 105 a stage, 10,500 in all, whose mean square has sigma 0.014.
  EXPECT_NEAR(mean_square_misfit, 1.0, 0.042);
  EXPECT_NEAR(mean_taken, 15.0, 2.0);
  EXPECT_NEAR(squares / count, 1.0, 0.25);
}

TEST(Calibration, ReachesTheFloorOfAPerfectModel) {
  const auto poses = choose_poses(60, nominal);
  double ours = 0.0, floor = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const PrpStageConfig config = random_stage(nominal, {}, seed);
    PrpStageModel stage(config);
    const auto found =
        calibrate_prp(plate, view_plate(stage.with_plate(plate), plate, poses, kMarks), nominal);
    ours += worst_with(stage, align_by(found)).place_mm.norm() / 20.0;
    floor += worst_with(stage, align_by(config.geometry)).place_mm.norm() / 20.0;
  }
  EXPECT_LT(ours, 1.25 * floor);
  EXPECT_LT(ours, 0.002);
}

TEST(Calibration, SaysWhatTheDataCannotTellApart) {
  PrpStageModel stage(random_stage(nominal, {}, 1));
  const auto good = calibrate_prp(
      plate, view_plate(stage.with_plate(plate), plate, choose_poses(60, nominal), kMarks), nominal);
  EXPECT_THAT(good.warnings, Contains(HasSubstr("can't tell alpha_2 and plate angle apart")));
  EXPECT_THAT(good.warnings, Contains(HasSubstr("say nothing about l_32")));
  EXPECT_THAT(good.warnings, Not(Contains(HasSubstr("R_1"))));
  EXPECT_THAT(good.warnings, Not(Contains(HasSubstr("the poses leave"))));
  EXPECT_LT(good.prediction_sigma_mm, 0.001);

  // Poses that never turn the platform can't show where its branches are.
  std::vector<PrpTurns> straight;
  for (int i = -2; i <= 2; ++i)
    for (int j = -2; j <= 2; ++j) straight.emplace_back(i, j, j);
  const auto blind =
      calibrate_prp(plate, view_plate(stage.with_plate(plate), plate, straight, kMarks), nominal);
  EXPECT_THAT(blind.warnings, Contains(HasSubstr("the poses leave")));
  EXPECT_GT(parameter(blind, "d_1").sigma, 100.0 * parameter(good, "d_1").sigma);
}

TEST(Calibration, SaysThatTheModelMissesSomething) {
  PrpStageConfig config = random_stage(nominal, {}, 2);
  config.screw_wave_mm = 0.01;
  PrpStageModel stage(config);
  const auto found = calibrate_prp(
      plate, view_plate(stage.with_plate(plate), plate, choose_poses(60, nominal), kMarks), nominal);
  EXPECT_THAT(found.warnings, Contains(HasSubstr("times the noise given")));
}

TEST(ChoiceOfPoses, IsBetterThanChance) {
  PrpStageModel stage(random_stage(nominal, {}, 3));
  const auto sigma_with = [&](const std::vector<PrpTurns>& poses) {
    return calibrate_prp(plate, view_plate(stage.with_plate(plate), plate, poses, kMarks), nominal)
        .prediction_sigma_mm;
  };
  std::vector<PrpTurns> random;
  for (const PlanarPose& pose : random_poses(nominal, 5.0, 20, 4))
    random.push_back(prp_inverse(nominal, pose));
  EXPECT_LT(sigma_with(choose_poses(20, nominal)), 0.7 * sigma_with(random));
  EXPECT_THAT(error_of([] { choose_poses(6, nominal); }), StartsWith("choice of poses: found 6"));
}

TEST(ResidualTable, TakesWhatTheModelMissesAndLeavesNoiseAlone) {
  // Poses all over the workspace: the D-optimal ones lie at its rim.
  std::vector<PrpTurns> poses = choose_poses(40, nominal);
  for (const PlanarPose& pose : random_poses(nominal, 5.0, 160, 7))
    poses.push_back(prp_inverse(nominal, pose));
  double with_table = 0.0, without = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    PrpStageConfig config = random_stage(nominal, {}, seed);
    config.screw_wave_mm = 0.008;
    config.guide_bow_mm = 0.01;
    PrpStageModel stage(config);
    auto found = calibrate_prp(plate, view_plate(stage.with_plate(plate), plate, poses, kMarks), nominal);
    EXPECT_FALSE(found.table.empty());
    with_table += worst_with(stage, align_by(found)).place_mm.norm() / 4.0;
    found.table = {};
    without += worst_with(stage, align_by(found)).place_mm.norm() / 4.0;
  }
  EXPECT_LT(with_table, 0.4 * without);

  int tables = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    PrpStageModel stage(random_stage(nominal, {}, seed));
    const auto found = calibrate_prp(
        plate, view_plate(stage.with_plate(plate), plate, choose_poses(60, nominal), kMarks), nominal);
    tables += found.table.empty() ? 0 : 1;
  }
  EXPECT_LE(tables, 2);
}

TEST(Calibration, RefusesWhatCannotBe) {
  PrpStageModel stage(random_stage(nominal, {}, 1));
  const auto views = view_plate(stage.with_plate(plate), plate, choose_poses(10, nominal), kMarks);
  const auto refusal = [&](const std::function<void(std::vector<PlateView>&)>& spoil) {
    auto spoilt = views;
    spoil(spoilt);
    return error_of([&] { calibrate_prp(plate, spoilt, nominal); });
  };
  EXPECT_EQ(refusal([](auto& v) { v.resize(6); }), "stage calibration: found 6 poses, expected at least 7");
  EXPECT_THAT(refusal([](auto& v) { v[2].seen_mm.pop_back(); }),
              StartsWith("stage calibration, pose 3: marks: found 5 seen"));
  EXPECT_THAT(refusal([](auto& v) { v[0].marks[1] = 500; }),
              StartsWith("stage calibration, pose 1: found mark 500"));
  EXPECT_THAT(refusal([](auto& v) { v[4].seen_mm[0].x() = NAN; }),
              HasSubstr("pose 5: seen mark 1: found (nan"));
  EXPECT_THAT(refusal([](auto& v) { v[4].turns[1] = NAN; }), HasSubstr("pose 5: found turns"));
  EXPECT_THAT(refusal([](auto& v) { v[3].seen_mm[1] = v[3].seen_mm[0]; }),
              HasSubstr("pose 4: seen marks 1 and 2"));
  EXPECT_THAT(refusal([](auto& v) {
                for (auto& mark : v[1].seen_mm) mark.x() = -mark.x();
              }),
              HasSubstr("pose 2: marks: found their mirror image"));
  PrpCalibrationOptions none;
  none.actuator_sigma_mm = 0.0;
  EXPECT_THAT(error_of([&] { calibrate_prp(plate, views, nominal, none); }),
              HasSubstr("expected both above 0"));
}

}  // namespace
}  // namespace meltstage::motion
