// SPDX-License-Identifier: Apache-2.0
#include "app/chip/chip_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace meltstage::app {

namespace {

constexpr int kLabelColumns = 9;  // " 110.0 ┤"
constexpr int kDotsAcross = 2;
constexpr int kDotsDown = 4;
constexpr char32_t kBrailleBlank = 0x2800;
// Bit of the dot at (x, y) in a cell, Unicode block U+2800.
constexpr unsigned kDot[kDotsDown][kDotsAcross] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};

struct Dot {
  int x, y;
};

class Plot {
 public:
  Plot(ChartRows& rows, const ChartScale& scale)
      : rows_(rows),
        scale_(scale),
        width_((static_cast<int>(rows.front().size()) - kLabelColumns) * kDotsAcross),
        height_(static_cast<int>(rows.size()) * kDotsDown) {}

  std::optional<Dot> place(const ChartPoint& p) const {
    const double x = (p.t_s - scale_.from_s) / (scale_.to_s - scale_.from_s) * (width_ - 1);
    const double y = (scale_.top - p.value) / (scale_.top - scale_.bottom) * (height_ - 1);
    if (!(x >= -0.5 && x <= width_ - 0.5 && y >= -0.5 && y <= height_ - 0.5)) return std::nullopt;
    return Dot{static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y))};
  }

  void set(Dot dot, Ink ink) {
    ChartCell& cell = rows_[static_cast<std::size_t>(dot.y / kDotsDown)]
                           [static_cast<std::size_t>(kLabelColumns + dot.x / kDotsAcross)];
    const char32_t dots = cell.glyph >= kBrailleBlank ? cell.glyph : kBrailleBlank;
    cell.glyph = dots | kDot[dot.y % kDotsDown][dot.x % kDotsAcross];
    if (cell.ink != Ink::curve) cell.ink = ink;
  }

  void line(Dot from, Dot to, Ink ink) {
    const int steps = std::max({std::abs(to.x - from.x), std::abs(to.y - from.y), 1});
    for (int i = 0; i <= steps; ++i) {
      const double part = static_cast<double>(i) / steps;
      set({static_cast<int>(std::lround(from.x + part * (to.x - from.x))),
           static_cast<int>(std::lround(from.y + part * (to.y - from.y)))},
          ink);
    }
  }

 private:
  ChartRows& rows_;
  const ChartScale& scale_;
  int width_;
  int height_;
};

void label(ChartRows& rows, std::size_t row, double value) {
  const std::string text = fmt::format("{:>{}.1f}", value, kLabelColumns - 2);
  for (std::size_t i = 0; i < text.size() && i < kLabelColumns - 2; ++i)
    rows[row][i] = {static_cast<char32_t>(text[i]), Ink::text};
  rows[row][kLabelColumns - 1] = {U'┤', Ink::text};
}

}  // namespace

ChartScale fit_scale(std::span<const ChartPoint> a, std::span<const ChartPoint> b, double least_range) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const auto& points : {a, b}) {
    for (const ChartPoint& p : points) {
      low = std::min(low, p.value);
      high = std::max(high, p.value);
    }
  }
  if (low > high) low = high = 0.0;
  constexpr double kMargin = 0.05;
  const double range = std::max(high - low, least_range);
  const double middle = (high + low) / 2.0;
  return {0.0, 1.0, middle - (0.5 + kMargin) * range, middle + (0.5 + kMargin) * range, {}};
}

ChartRows draw_chart(std::span<const ChartPoint> curve, std::span<const ChartPoint> reference,
                     const ChartScale& scale, int columns, int rows) {
  ChartRows chart(static_cast<std::size_t>(rows), std::vector<ChartCell>(static_cast<std::size_t>(columns)));
  for (auto& row : chart) row[kLabelColumns - 1] = {U'│', Ink::text};
  label(chart, 0, scale.top);
  label(chart, static_cast<std::size_t>(rows - 1), scale.bottom);
  if (rows >= 5) {  // the middle of the row in the middle
    const auto row = static_cast<std::size_t>(rows / 2);
    const double part = (static_cast<double>(row) + 0.5) / rows;
    label(chart, row, scale.top + part * (scale.bottom - scale.top));
  }

  Plot plot(chart, scale);
  for (const ChartPoint& p : reference) {
    const auto dot = plot.place(p);
    if (dot && dot->x % 4 == 0) plot.set(*dot, Ink::reference);
  }
  std::optional<Dot> before;
  for (const ChartPoint& p : curve) {
    const auto dot = plot.place(p);
    if (dot) plot.line(before.value_or(*dot), *dot, Ink::curve);
    before = dot;
  }
  return chart;
}

std::string to_utf8(std::span<const ChartCell> cells) {
  std::string text;
  for (const ChartCell& cell : cells) {
    const auto c = static_cast<unsigned>(cell.glyph);
    if (c < 0x80) {
      text += static_cast<char>(c);
    } else if (c < 0x800) {
      text += static_cast<char>(0xC0 | c >> 6);
      text += static_cast<char>(0x80 | (c & 0x3F));
    } else {
      text += static_cast<char>(0xE0 | c >> 12);
      text += static_cast<char>(0x80 | (c >> 6 & 0x3F));
      text += static_cast<char>(0x80 | (c & 0x3F));
    }
  }
  return text;
}

}  // namespace meltstage::app
