// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "app/chip/chip_chart.hpp"

namespace meltstage::app {
namespace {

constexpr int kColumns = 29;  // 20 cells beside the labels: 40 dots
constexpr int kRows = 5;      // 20 dots
constexpr int kLabels = 9;

bool has_dots(const ChartCell& cell) { return cell.glyph > 0x2800 && cell.glyph < 0x2900; }

TEST(Chart, ARisingLineGoesFromBottomLeftToTopRight) {
  const std::vector<ChartPoint> line{{0.0, 0.0}, {10.0, 100.0}};
  const ChartRows rows = draw_chart(line, {}, {0.0, 10.0, 0.0, 100.0, {}}, kColumns, kRows);
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(kRows));
  EXPECT_TRUE(has_dots(rows[kRows - 1][kLabels]));
  EXPECT_TRUE(has_dots(rows[0][kColumns - 1]));
  EXPECT_FALSE(has_dots(rows[0][kLabels]));
  EXPECT_FALSE(has_dots(rows[kRows - 1][kColumns - 1]));
  // No column without a dot.
  for (int column = kLabels; column < kColumns; ++column) {
    int cells = 0;
    for (const auto& row : rows) cells += has_dots(row[static_cast<std::size_t>(column)]) ? 1 : 0;
    EXPECT_GE(cells, 1) << column;
  }
}

TEST(Chart, EachValueStandsInItsRow) {
  for (int row = 0; row < kRows; ++row) {
    const double value = 100.0 * (1.0 - (row + 0.5) / kRows);
    const std::vector<ChartPoint> level{{0.0, value}, {10.0, value}};
    const ChartRows rows = draw_chart(level, {}, {0.0, 10.0, 0.0, 100.0, {}}, kColumns, kRows);
    for (int other = 0; other < kRows; ++other)
      EXPECT_EQ(has_dots(rows[static_cast<std::size_t>(other)][kLabels + 3]), other == row)
          << row << " " << other;
  }
}

TEST(Chart, TheCurveHidesTheReference) {
  const std::vector<ChartPoint> level{{0.0, 50.0}, {5.0, 50.0}, {10.0, 50.0}};
  std::vector<ChartPoint> dense;
  for (int i = 0; i <= 100; ++i) dense.push_back({i * 0.1, 50.0});
  const ChartScale scale{0.0, 10.0, 0.0, 100.0, {}};
  const auto inks = [](const ChartRows& rows) {
    int curve = 0;
    int reference = 0;
    for (const auto& row : rows) {
      for (const ChartCell& cell : row) {
        curve += cell.ink == Ink::curve ? 1 : 0;
        reference += cell.ink == Ink::reference ? 1 : 0;
      }
    }
    return std::pair(curve, reference);
  };
  EXPECT_EQ(inks(draw_chart({}, dense, scale, kColumns, kRows)), std::pair(0, 10));  // every other cell
  EXPECT_EQ(inks(draw_chart(level, dense, scale, kColumns, kRows)), std::pair(20, 0));
}

TEST(Chart, PointsOutsideTheScaleAreLeftOut) {
  const std::vector<ChartPoint> out{{-5.0, 50.0}, {5.0, 500.0}, {50.0, 50.0}};
  for (const auto& row : draw_chart(out, {}, {0.0, 10.0, 0.0, 100.0, {}}, kColumns, kRows))
    for (const ChartCell& cell : row) EXPECT_FALSE(has_dots(cell));
}

TEST(Chart, ScaleHoldsAllPointsAndIsNeverFlat) {
  const std::vector<ChartPoint> a{{0.0, 20.0}, {1.0, 110.0}};
  const std::vector<ChartPoint> b{{0.0, 120.0}};
  const ChartScale wide = fit_scale(a, b, 2.0);
  EXPECT_LT(wide.bottom, 20.0);
  EXPECT_GT(wide.top, 120.0);
  const ChartScale flat = fit_scale({}, b, 2.0);
  EXPECT_GE(flat.top - flat.bottom, 2.0);
  EXPECT_GT(fit_scale({}, {}, 2.0).top, 0.0);
}

TEST(Chart, CellsAsUtf8) {
  const std::vector<ChartCell> cells{{U'a', Ink::text}, {U'é', Ink::text}, {0x28FF, Ink::curve}};
  EXPECT_EQ(to_utf8(cells), "a\xC3\xA9\xE2\xA3\xBF");
}

}  // namespace
}  // namespace meltstage::app
