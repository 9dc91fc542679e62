// SPDX-License-Identifier: Apache-2.0
// A line chart over time for the terminal, drawn into character cells in the Unicode Braille patterns, 2 x 4
// dots each.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace meltstage::app {

enum class Ink : unsigned char { none, curve, reference, text };

struct ChartCell {
  char32_t glyph = U' ';
  Ink ink = Ink::none;
};

// Rows of cells, top row first.
using ChartRows = std::vector<std::vector<ChartCell>>;

struct ChartPoint {
  double t_s;
  double value;
};

struct ChartScale {
  double from_s, to_s;  // left and right edge
  double bottom, top;   // values of the lowest and highest dot
  std::string unit;
};

// The scale whose value range holds all points, with a margin and at least `least_range` wide.
ChartScale fit_scale(std::span<const ChartPoint> a, std::span<const ChartPoint> b, double least_range);

// `curve` as a line, `reference` dotted behind it; points outside the scale are left out. Axis labels stand
// at the left. Needs at least 12 columns and 2 rows.
ChartRows draw_chart(std::span<const ChartPoint> curve, std::span<const ChartPoint> reference,
                     const ChartScale& scale, int columns, int rows);

// Cells of a row as UTF-8.
std::string to_utf8(std::span<const ChartCell> cells);

}  // namespace meltstage::app
