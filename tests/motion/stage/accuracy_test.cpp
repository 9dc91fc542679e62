// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/accuracy.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "base/temporary_folder.hpp"
#include "motion/stage/gcode.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

const std::filesystem::path kSlits =
    std::filesystem::path(MELTSTAGE_SOURCE_DIR) / "tests/motion/data/iso230_2_slits.csv";

// A measured axis; the figures were computed from its raw readings in decimal arithmetic by another program.
// (The report that the readings come from takes R = max(R forward, R reverse) and E from the reverse means
// alone; the standard doesn't.)
TEST(Accuracy, IsTheStandardsOnAMeasuredAxis) {
  const AxisAccuracy axis = evaluate_accuracy(read_deviations(kSlits));
  EXPECT_NEAR(axis.reversal_um, 4.564, 1e-6);
  EXPECT_NEAR(axis.mean_reversal_um, 0.6956, 1e-6);
  EXPECT_NEAR(axis.repeatability_forward_um, 7.502352, 1e-6);
  EXPECT_NEAR(axis.repeatability_reverse_um, 3.882515, 1e-6);
  EXPECT_NEAR(axis.repeatability_um, 8.353904, 1e-6);
  EXPECT_NEAR(axis.systematic_forward_um, 15.052, 1e-6);
  EXPECT_NEAR(axis.systematic_reverse_um, 14.852, 1e-6);
  EXPECT_NEAR(axis.systematic_um, 15.988, 1e-6);
  EXPECT_NEAR(axis.mean_systematic_um, 14.952, 1e-6);
  EXPECT_NEAR(axis.accuracy_forward_um, 18.065409, 1e-6);
  EXPECT_NEAR(axis.accuracy_reverse_um, 16.542530, 1e-6);
  EXPECT_NEAR(axis.accuracy_um, 18.571303, 1e-6);
  ASSERT_EQ(axis.positions.size(), 5u);
  const double repeatability_um[] = {5.232137, 6.275259, 8.353904, 4.179419, 2.596521};
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(axis.positions[i].repeatability_um, repeatability_um[i], 1e-6) << i;
}

TEST(Accuracy, SeesOneReadingThatIsOff) {
  auto targets = read_deviations(kSlits);
  targets[3].reverse_um[2] -= 10.0;
  const AxisAccuracy axis = evaluate_accuracy(targets);
  EXPECT_GT(axis.repeatability_reverse_um, 15.0);
  EXPECT_GT(axis.accuracy_um, 25.0);
}

TEST(Accuracy, DoesNotMindTheOrderOfTargets) {
  auto targets = read_deviations(kSlits);
  std::swap(targets[0], targets[4]);
  EXPECT_EQ(evaluate_accuracy(targets).positions.front().target_mm, 15.0);
  EXPECT_NEAR(evaluate_accuracy(targets).accuracy_um, 18.571303, 1e-6);
}

TEST(Accuracy, ResidualBacklashIsTheMeanReversalWithItsUncertainty) {
  const ResidualBacklash found = residual_backlash(read_deviations(kSlits));
  EXPECT_NEAR(found.backlash_um, -0.6956, 1e-6);
  // reversal values of the five targets: -1.966 4.566... their scatter over sqrt(5)
  EXPECT_GT(found.standard_error_um, 1.0);
  EXPECT_LT(found.standard_error_um, 1.5);
}

TEST(Accuracy, RefusesWhatCannotBeEvaluated) {
  EXPECT_EQ(error_of([] { evaluate_accuracy({}); }),
            "accuracy: found 0 target positions, expected at least 2");
  std::vector<TargetDeviations> targets = {{0.0, {1, 2}, {1, 2}}, {5.0, {1, 2}, {1}}};
  EXPECT_THAT(error_of([&] { evaluate_accuracy(targets); }),
              HasSubstr("found 2 forward and 1 reverse approaches at 5 mm"));
  targets[1].reverse_um = {1, NAN};
  EXPECT_THAT(error_of([&] { evaluate_accuracy(targets); }), HasSubstr("found deviation nan um at 5 mm"));
  targets[1] = targets[0];
  EXPECT_THAT(error_of([&] { evaluate_accuracy(targets); }), HasSubstr("found 0 mm twice"));
}

TEST(Accuracy, BlanksRoundFieldsMeanNothing) {
  const auto targets = read_deviations_text("d.csv",
                                            " # by us\n target_mm, direction ,deviation_um \n \n 1 , + , "
                                            "0.5\n1,+,0.25\n1,\t-,-1\n1,-,1\n2,+,0\n2,+,0\n2,-,0 \n2,-,0\n");
  ASSERT_EQ(targets.size(), 2U);
  EXPECT_EQ(targets[0].forward_um, (std::vector<double>{0.5, 0.25}));
  EXPECT_EQ(targets[0].reverse_um, (std::vector<double>{-1.0, 1.0}));
  EXPECT_THAT(
      error_of([] { read_deviations_text("d.csv", "target_mm,direction,deviation_um\n1, +, x1 \n"); }),
      HasSubstr("d.csv:2:7: found deviation_um \"x1\""));
}

TEST(Accuracy, NamesTheLineOfAFileThatCannotBeRead) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "deviations.csv";
  const auto error_in = [&](const std::string& text) {
    std::ofstream(file) << text;
    return error_of([&] { read_deviations(file); });
  };
  const std::string header = "target_mm,direction,deviation_um\n";
  EXPECT_THAT(error_in("x,y\n"), HasSubstr(":1:1: found header \"x,y\", expected \"target_mm,"));
  EXPECT_THAT(error_in(header + "1,+,0.5\n2,up,1\n"), HasSubstr(":3:3: found direction \"up\""));
  EXPECT_THAT(error_in(header + "1,+,0.5x\n"), HasSubstr(":2:5: found deviation_um \"0.5x\""));
  EXPECT_THAT(error_in(header + "1,+,0.5"), EndsWith("expected a line end; it may be cut off"));
  EXPECT_THAT(error_in(header + "1,+\n"), HasSubstr(":2:1: found \"1,+\", expected three fields"));
  EXPECT_THAT(error_in(header + "1,+,0.5\n"), EndsWith("found 1 target positions, expected at least 2"));
  EXPECT_THAT(error_in(""), EndsWith("found 0 target positions, expected at least 2"));
  std::filesystem::remove(file);
  EXPECT_THAT(error_of([&] { read_deviations(file); }), HasSubstr("no such file"));
}

// A screw with errors of all kinds, on a short way.
AxisModelConfig worn_axis() {
  AxisModelConfig axis;
  axis.coulomb_friction_n = 2.0;
  axis.screw = {.backlash_mm = 0.008, .lead_error_share = 150e-6, .lead_error_mm = 0.002, .lead_mm = 10.0};
  return axis;
}

TEST(Interferometer, FindsTheScrewsErrorsAsTheyWerePutIn) {
  const AxisModelConfig axis = worn_axis();
  const AccuracyTest test{.target_mm = {0.0, 12.5, 25.0, 37.5}, .runs = 2};
  const auto targets = measure_axis(axis, test, {.noise_um = 0.0});
  for (const PositionAccuracy& at : evaluate_accuracy(targets).positions) {
    const double turn = 2.0 * M_PI * at.target_mm / 10.0;
    // The model's zero is where the screw pushes downwards: forwards it lags by the play.
    EXPECT_NEAR(at.mean_forward_um, 0.15 * at.target_mm + 2.0 * std::sin(turn) - 8.0, 0.35) << at.target_mm;
    EXPECT_NEAR(at.reversal_um, -8.0, 0.35) << at.target_mm;
  }
  EXPECT_NEAR(residual_backlash(targets).backlash_um, 8.0, 0.35);
}

TEST(Interferometer, RefusesFiguresThatNoneHas) {
  const AccuracyTest test{.target_mm = {0.0, 1.0}, .runs = 1};
  for (const InterferometerConfig& instrument :
       {InterferometerConfig{.noise_um = NAN}, InterferometerConfig{.noise_um = -1.0},
        InterferometerConfig{.resolution_um = 0.0}, InterferometerConfig{.averaging_s = NAN}})
    EXPECT_THAT(error_of([&] { measure_axis(AxisModelConfig{}, test, instrument); }),
                HasSubstr("interferometer: "));
}

TEST(Interferometer, ScattersAsTheStopsDo) {
  const AccuracyTest test{.target_mm = {0.0, 1.0}, .runs = 40};
  const auto targets =
      measure_axis(AxisModelConfig{}, test,
                   {.noise_um = 0.0, .stop_forward_um = 1.0, .stop_reverse_um = 2.0, .dwell_s = 0.1});
  const AxisAccuracy axis = evaluate_accuracy(targets);
  // chi distribution, 39 degrees of freedom: 99.9 % within a third
  EXPECT_NEAR(axis.positions[0].deviation_forward_um, 1.0, 0.36);
  EXPECT_NEAR(axis.positions[0].deviation_reverse_um, 2.0, 0.72);
}

TEST(Compensation, TakesTheErrorsAwayAtPlacesThatWereNotMeasured) {
  const AxisModelConfig axis = worn_axis();
  AccuracyTest learn{.target_mm = {}, .runs = 2};
  for (int i = 0; i <= 40; ++i) learn.target_mm.push_back(i);  // ten to a turn
  const CompensationTable table = make_compensation(evaluate_accuracy(measure_axis(axis, learn, {})));
  const AccuracyTest test{.target_mm = accuracy_targets(1.0, 39.0, 5, 5.0, 3), .runs = 2};
  const AxisAccuracy before = evaluate_accuracy(measure_axis(axis, test, {.seed = 2}));
  const AxisAccuracy after = evaluate_accuracy(measure_axis(axis, test, {.seed = 2}, table));
  EXPECT_GT(before.accuracy_um, 9.0);
  EXPECT_LT(after.accuracy_um, 1.2);
  EXPECT_LT(after.reversal_um, 0.6);
  // A table without the backlash leaves it.
  CompensationTable lead_only = table;
  lead_only.reverse_mm = lead_only.forward_mm;
  EXPECT_GT(evaluate_accuracy(measure_axis(axis, test, {.seed = 2}, lead_only)).reversal_um, 7.0);
}

TEST(Compensation, SolvesForTheCommand) {
  const CompensationTable table{{0.0, 10.0}, {0.0, 0.01}, {0.02, 0.03}};
  EXPECT_NEAR(compensated_forward_mm(table, 5.0), 5.0 / 1.001, 1e-12);
  EXPECT_NEAR(compensated_reverse_mm(table, 5.0), (5.0 - 0.02) / 1.001, 1e-12);
  EXPECT_EQ(compensated_forward_mm(table, -3.0), -3.0);
  EXPECT_EQ(compensated_reverse_mm(table, 20.0), 20.0 - 0.03);
  EXPECT_EQ(compensated_forward_mm({}, 7.0), 7.0);
}

TEST(Compensation, RefusesColumnsOfUnlikeLengthOrOrder) {
  const CompensationTable no_reverse{{10.0, 90.0}, {0.1}, {}};
  const std::string unlike =
      "compensation: found 2 positions, 1 forward and 0 reverse deviations, expected as many of each";
  EXPECT_EQ(error_of([&] { compensated_reverse_mm(no_reverse, 50.0); }), unlike);
  EXPECT_EQ(error_of([&] { compensated_forward_mm(no_reverse, 50.0); }), unlike);
  EXPECT_EQ(error_of([&] { write_linuxcnc_compensation(no_reverse); }), unlike);
  EXPECT_EQ(error_of([&] { measure_axis({}, {.target_mm = {1.0, 2.0}}, {}, no_reverse); }), unlike);
  EXPECT_EQ(error_of([&] {
              compensated_forward_mm({{}, {0.1}, {0.1}}, 50.0);
            }),
            "compensation: found 0 positions, 1 forward and 1 reverse deviations, expected as many of each");
  EXPECT_EQ(error_of([&] {
              compensated_forward_mm({{90.0, 10.0}, {0.1, 0.2}, {0.0, 0.0}}, 50.0);
            }),
            "compensation: found position 10 mm behind 90 mm, expected ascending numbers");
  EXPECT_THAT(error_of([&] {
                compensated_forward_mm({{10.0, NAN}, {0.1, 0.2}, {0.0, 0.0}}, 50.0);
              }),
              HasSubstr("position nan mm"));
  EXPECT_EQ(error_of([&] {
              compensated_forward_mm({{10.0, 20.0}, {0.1, NAN}, {0.0, 0.0}}, 50.0);
            }),
            "compensation: found nan mm, expected finite numbers");
}

TEST(AccuracyTargets, LieInTheWayAndDontKeepToThePeriod) {
  const auto targets = accuracy_targets(0.0, 200.0, 11, 10.0, 1);
  ASSERT_EQ(targets.size(), 11u);
  EXPECT_GE(targets.front(), 0.0);
  EXPECT_LE(targets.back(), 200.0);
  double largest = 0.0, smallest = 10.0;
  for (const double target : targets) {
    largest = std::max(largest, std::fmod(target, 10.0));
    smallest = std::min(smallest, std::fmod(target, 10.0));
  }
  EXPECT_GT(largest - smallest, 5.0);
  EXPECT_THAT(error_of([] { accuracy_targets(0.0, 200.0, 40, 10.0, 1); }),
              HasSubstr("40 targets, period 10"));
}

}  // namespace
}  // namespace meltstage::motion
