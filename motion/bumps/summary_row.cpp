// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/summary_row.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>

#include "motion/bumps/column_names.hpp"

namespace meltstage::motion::detail {
namespace {

const Cell* label_of(const TableRow& row, std::size_t x, std::size_t y) {
  for (std::size_t i = 0; i < row.cells.size(); ++i)
    if (i != x && i != y && !is_blank(row.cells[i])) return &row.cells[i];
  return nullptr;
}

bool has_digit(std::string_view text) {
  return std::any_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool is_near(double a, double b) { return std::abs(a - b) <= 1e-3 * std::max(std::abs(b), 1e-3); }

}  // namespace

std::string SummaryRow::figure_of_rows_before(double x_mm, double y_mm) const {
  const auto n = static_cast<double>(rows_);
  const auto both = [&](double x, double y) { return is_near(x_mm, x) && is_near(y_mm, y); };
  if (both(x_sum_mm_, y_sum_mm_)) return "the sum of the rows above it";
  if (both(x_sum_mm_ / n, y_sum_mm_ / n)) return "the mean of the rows above it";
  if (both(n, n)) return "the count of the rows above it";
  return {};
}

/// A word for a total is unlike the other rows' labels: it has no number, or there is none.
void SummaryRow::take(const TableRow& row, std::size_t x, std::size_t y, double x_mm, double y_mm) {
  if (is_certain_) return;
  const Cell* label = label_of(row, x, y);
  const bool labelled = label != nullptr, numbered = labelled && has_digit(label->text);
  const bool calculated = row.cells[x].sums_up && row.cells[y].sums_up;
  const bool unlike_others = rows_ > 1 && (labelled ? numbered_ == rows_ && !numbered : labelled_ == rows_);
  told_.clear();
  row_ = row.row;
  const bool by_label = labelled && is_total(*label);
  is_certain_ = by_label && rows_ > 0 && !figure_of_rows_before(x_mm, y_mm).empty();
  if (by_label)
    told_ = "a row of totals";
  else if (calculated && calculated_ == 0 && rows_ > 1)
    told_ = "a formula over the rows above it";
  else if (unlike_others)
    told_ = figure_of_rows_before(x_mm, y_mm);
  x_sum_mm_ += x_mm;
  y_sum_mm_ += y_mm;
  ++rows_;
  labelled_ += labelled ? 1U : 0U;
  numbered_ += numbered ? 1U : 0U;
  calculated_ += calculated ? 1U : 0U;
}

}  // namespace meltstage::motion::detail
