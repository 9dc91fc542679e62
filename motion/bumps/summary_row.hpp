// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: whether the last row of a table, or one whose label and figures say so, sums up
// those above it rather than being a bump.
#pragma once

#include <cstddef>
#include <string>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {

class SummaryRow {
 public:
  /// The next bump of a table: its coordinates, and the first cell beside them that isn't blank.
  void take(const TableRow& row, std::size_t x, std::size_t y, double x_mm, double y_mm);

  /// What the row is, such as "the sum of the rows above it"; empty where there is none of the kind.
  const std::string& told() const { return told_; }
  std::size_t row() const { return row_; }

 private:
  std::string figure_of_rows_before(double x_mm, double y_mm) const;

  std::size_t rows_ = 0, labelled_ = 0, numbered_ = 0, calculated_ = 0;
  double x_sum_mm_ = 0.0, y_sum_mm_ = 0.0;
  bool is_certain_ = false;  // by label and figures, so that it may stand anywhere
  std::string told_;
  std::size_t row_ = 0;
};

}  // namespace meltstage::motion::detail
