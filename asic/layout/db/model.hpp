// SPDX-License-Identifier: Apache-2.0
// The design as placement sees it: boxes, and nets as points on boxes.
#pragma once

#include <vector>

#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

struct ModelPin {
  int cell = -1;  ///< -1: at a fixed point, then x and y are where
  int net = 0;
  Nm x = 0;  ///< in the macro's frame
  Nm y = 0;
};

struct Model {
  std::vector<ModelPin> pins;    ///< net by net
  std::vector<int> net_start;    ///< first pin of each net; one entry more than nets
  std::vector<double> weight;    ///< by net: of its length, the clock's counts more
  std::vector<int> pin_of_cell;  ///< indices into pins, cell by cell
  std::vector<int> cell_start;
  int nets() const { return static_cast<int>(net_start.size()) - 1; }
};

/// Nets of signals with two to `most_pins` pins on cells or placed die pins.
Model make_model(const Design& design, const Technology& technology, std::size_t most_pins);

/// Middle of a pin's shapes in its macro's frame.
Point middle_of(const MacroPin& pin);

}  // namespace meltstage::layout
