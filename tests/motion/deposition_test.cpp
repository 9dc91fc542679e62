// SPDX-License-Identifier: Apache-2.0
#include "motion/deposition.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "motion/conformal_trial.hpp"
#include "motion/profile.hpp"

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
}

// The calibration: without compensation, the calibrated part is the paper's first group in its main figures.
TEST(Deposition, IsCalibratedOnThePapersFirstGroup) {
  const RealPart part = make_trial_part(paper_error());
  const auto lines = run_trial(part, Compensation::none, DepositionModel{}, 1);
  double resistance = 0.0, width = 0.0, spread = 0.0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    resistance += lines[i].resistance_ohm / 9.0;
    width += lines[i].width.mean_mm / 9.0;
    spread += lines[i].width.deviation_mm / 9.0;
    const bool strung = i == 1 || i == 5 || i == 8;  // lines 2, 6 and 9 in the paper
    EXPECT_EQ(lines[i].resistance_ohm > 2.0, strung) << "line " << i + 1;
  }
  EXPECT_NEAR(resistance, 2.005, 0.2);
  EXPECT_NEAR(width, 0.486, 0.05);
  EXPECT_NEAR(spread, 0.095, 0.02);
}

}  // namespace
}  // namespace meltstage::motion
