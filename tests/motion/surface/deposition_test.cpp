// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/deposition.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "motion/profile/profile.hpp"
#include "motion/surface/conformal_trial.hpp"
#include "motion/surface/trial_calibration.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

DepositedLine at_gap(double gap_mm, double surge = 0.0) {
  std::vector<double> lengths, gaps;
  for (int i = 0; i <= 320; ++i) lengths.push_back(0.1 * i), gaps.push_back(gap_mm);
  return deposit(DepositionModel{}, lengths, gaps, surge, 1);
}

TEST(Deposition, PilesUpBelowAndStringsAbove) {
  const double nominal_um = measure_widths(at_gap(0.10)).mean_mm, nominal_ohm = at_gap(0.10).resistance_ohm;
  EXPECT_GT(measure_widths(at_gap(0.06)).mean_mm, 1.1 * nominal_um);
  EXPECT_LT(measure_widths(at_gap(0.18)).mean_mm, 0.6 * nominal_um);
  EXPECT_GT(at_gap(0.18).resistance_ohm, 5.0 * nominal_ohm);
  EXPECT_GT(at_gap(0.03).resistance_ohm, nominal_ohm);  // the slit lets less through
}

TEST(Deposition, SurgeWidensBothEnds) {
  const DepositedLine line = at_gap(0.10, 1.0);
  EXPECT_GT(line.sections_mm2.front(), 1.1 * line.sections_mm2[160]);
  EXPECT_GT(line.sections_mm2.back(), 1.1 * line.sections_mm2[160]);
  EXPECT_GT(measure_widths(line).deviation_mm, measure_widths(at_gap(0.10)).deviation_mm);
}

TEST(Deposition, WidthsAreMeasuredEveryMillimetre) {
  DepositedLine line;
  for (int i = 0; i <= 320; ++i) {
    line.lengths_mm.push_back(0.1 * i);
    line.widths_mm.push_back(0.4 + 0.1 * std::floor(0.1 * i + 1e-9));
  }
  const WidthFigures figures = measure_widths(line);
  EXPECT_NEAR(figures.mean_mm, 0.4 + 0.1 * 15.5, 1e-9);
  EXPECT_NEAR(figures.deviation_mm, 0.1 * std::sqrt(32.0 * 33.0 / 12.0), 1e-9);
}

TEST(Deposition, RefusesWhatCannotBe) {
  EXPECT_THROW(deposit({}, std::vector<double>{0, 1}, std::vector<double>{0.1}, 0.0, 1), MotionError);
  EXPECT_THROW(deposit({}, std::vector<double>{0, 1}, std::vector<double>{0.1, NAN}, 0.0, 1), MotionError);
  const std::vector<double> gaps{0.1, 0.1};
  EXPECT_THROW(deposit({}, std::vector<double>{1, 0}, gaps, 0.0, 1), MotionError);
  EXPECT_THROW(deposit({}, std::vector<double>{0, 1}, gaps, NAN, 1), MotionError);
  EXPECT_THROW(measure_widths({}, 5), MotionError);
  EXPECT_EQ(error_of([] {
              measure_widths({{0.0, 1.0}, {0.1}, {}, 0.0}, 5);
            }),
            "widths: found 1 widths at 2 places, expected one a place");
  EXPECT_THROW(measure_widths(deposit({}, std::vector<double>{0, 1}, gaps, 0.0, 1), 1), MotionError);
}

// Without compensation the part that stands for the paper's is its first group.
TEST(Calibration, IsThePapersFirstGroup) {
  const RealPart part = make_trial_part(paper_error());
  DepositionModel steady;
  steady.width_noise_mm = 0.0;
  const auto lines = run_trial(part, Compensation::none, steady, 1);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const PrintedLine& paper = first_group()[i];
    EXPECT_NEAR(lines[i].resistance_ohm, paper.resistance_ohm, 0.04 * paper.resistance_ohm) << i + 1;
    EXPECT_NEAR(1e3 * lines[i].width.mean_mm, paper.width_um, 20.0) << i + 1;
    EXPECT_NEAR(1e3 * std::hypot(lines[i].width.deviation_mm, DepositionModel{}.width_noise_mm),
                paper.deviation_um, 10.0)
        << i + 1;
  }
  EXPECT_LT(std::sqrt(assess_fit({}, paper_error()).misfit / 41.0), 1.0);
}

TEST(Calibration, StoredNumbersAreWhereTheFitStands) {
  const TrialFit stored = assess_fit({}, paper_error());
  EXPECT_GT(fit_first_group(stored, 3).objective, stored.objective - 0.05);
  DepositionModel other;
  other.resistivity_ohm_mm *= 1.05;
  const TrialFit moved = assess_fit(other, paper_error());
  EXPECT_GT(moved.objective, stored.objective + 5.0);
  EXPECT_NEAR(fit_first_group(moved, 12).objective, stored.objective, 0.5);  // and finds its way back
  EXPECT_GT(draw_start(1).objective, 100.0 * stored.objective);
}

TEST(Calibration, FaceErrorIsItsCosines) {
  FaceError error;
  error.modes_mm(2, 3) = 0.01;
  EXPECT_NEAR(error.at_mm(7.0, 11.0), 0.01 * std::cos(M_PI * 2 * 7 / 40) * std::cos(M_PI * 3 * 11 / 60),
              1e-15);
  EXPECT_NEAR(make_trial_part(error).height_mm(7.0, 11.0) - trial_height_mm(7.0, 11.0),
              error.at_mm(7.0, 11.0), 1e-12);
}

// What the issue asks of compensation on that part: nine of nine.
TEST(Calibration, CompensationHelpsEveryLine) {
  const RealPart part = make_trial_part(paper_error());
  const auto before = run_trial(part, Compensation::none, {}, 1),
             after = run_trial(part, Compensation::full, {}, 1);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT(after[i].resistance_ohm, before[i].resistance_ohm) << i + 1;
    EXPECT_LT(after[i].width.deviation_mm, before[i].width.deviation_mm) << i + 1;
    EXPECT_LT(after[i].gap_error_mm, 0.020) << i + 1;
  }
}

}  // namespace
}  // namespace meltstage::motion
