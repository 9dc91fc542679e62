// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: what the lines above a table say besides units and sides.
#pragma once

#include <cstddef>
#include <string>

#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {

/// Only units and sides are read there. Another property, "Scale: 2", or a word of how the table lies,
/// "mirrored", may change what its numbers mean, so the reader tells that it was not read.
class PropertiesAbove {
 public:
  /// A line above the table that tells neither a unit nor a side.
  void take(const TableRow& row);
  /// One that tells a unit which is not that of x and y.
  void add(const TableRow& row);

  /// The first of them, and how many follow; empty without one.
  std::string told() const;

 private:
  std::size_t count_ = 0, first_row_ = 0;
  std::string first_;
};

}  // namespace meltstage::motion::detail
