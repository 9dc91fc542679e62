// SPDX-License-Identifier: Apache-2.0
// Golden section.
#pragma once

#include <utility>

namespace meltstage {

/// The least value of a function that falls and then rises between `low` and `high`, and where it is. Each
/// step is a call, and leaves 0.618 of the range.
template <class Function>
std::pair<double, double> least_between(const Function& function, double low, double high, int steps) {
  constexpr double kGolden = 0.6180339887498949;
  double left = high - kGolden * (high - low), right = low + kGolden * (high - low);
  double at_left = function(left), at_right = function(right);
  for (int step = 0; step < steps; ++step) {
    if (at_left < at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - kGolden * (high - low);
      at_left = function(left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + kGolden * (high - low);
      at_right = function(right);
    }
  }
  return at_left < at_right ? std::pair(at_left, left) : std::pair(at_right, right);
}

}  // namespace meltstage
