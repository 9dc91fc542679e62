// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: rows of a table whose own words say that no bump is wanted there.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {

/// Such rows are bumps all the same, as nobody knows what the word was meant for; a note tells them.
class DoubtfulRows {
 public:
  /// The row that names the columns.
  void take_names(const TableRow& names);
  /// A row that holds a bump, with its coordinates in the columns `x` and `y`.
  void take(const TableRow& row, std::size_t x, std::size_t y);

  std::vector<std::string> notes() const;

 private:
  struct Kind {
    std::size_t count = 0, first_row = 0;
    std::string first_word;
    void add(std::size_t row, const std::string& word);
  };
  std::vector<std::size_t> populated_, left_out_;  // columns that answer with yes or no
  Kind unpopulated_, mark_, outline_;
};

}  // namespace meltstage::motion::detail
