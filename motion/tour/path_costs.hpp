// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: the cost of a hop as a function of |dx| and |dy|, one type a metric, so that the
// planner's inner loops are compiled for each. Every cost grows with |dx| and with |dy| and keeps the
// triangle inequality, which the neighbour search and the lower bound rely on.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "motion/profile/profile.hpp"

namespace meltstage::motion::detail {

/// A place in the plane, mm.
struct Site {
  double x = 0.0;
  double y = 0.0;
};

struct ManhattanCost {
  double operator()(double dx, double dy) const { return std::abs(dx) + std::abs(dy); }
};

struct ChebyshevCost {
  double operator()(double dx, double dy) const { return std::max(std::abs(dx), std::abs(dy)); }
};

struct EuclideanCost {
  double operator()(double dx, double dy) const { return std::sqrt(dx * dx + dy * dy); }
};

/// Duration of a rest-to-rest move of one axis over a distance, interpolated in a table of 256 steps an
/// octave: a few parts in 10^7 from the closed form, at a fiftieth of its time.
class AxisTimes {
 public:
  explicit AxisTimes(const ScurveLimits& limits) {
    knots_s_.reserve(kLastKey - kFirstKey + 2);
    for (std::uint64_t key = kFirstKey; key <= kLastKey + 1; ++key)
      knots_s_.push_back(plan_scurve(limits, distance_of(key)).duration_s);
  }

  double operator()(double distance_mm) const {
    if (distance_mm == 0.0) return 0.0;
    const std::uint64_t key =
        std::clamp(std::bit_cast<std::uint64_t>(distance_mm) >> kShift, kFirstKey, kLastKey);
    const double low_mm = distance_of(key), high_mm = distance_of(key + 1);
    const double low_s = knots_s_[key - kFirstKey], high_s = knots_s_[key - kFirstKey + 1];
    return low_s + (high_s - low_s) * (distance_mm - low_mm) / (high_mm - low_mm);
  }

 private:
  // A key is the exponent and the first eight bits of the mantissa; distances from 2^-20 to 2^20 mm.
  static constexpr unsigned kShift = 44;
  static constexpr std::uint64_t kFirstKey = std::bit_cast<std::uint64_t>(0x1p-20) >> kShift;
  static constexpr std::uint64_t kLastKey = (std::bit_cast<std::uint64_t>(0x1p20) >> kShift) - 1;
  static double distance_of(std::uint64_t key) { return std::bit_cast<double>(key << kShift); }

  std::vector<double> knots_s_;
};

/// Time of a hop: that of the slower axis. What every hop takes besides (settling, jetting) changes no order.
struct TimeCost {
  AxisTimes x, y;
  double operator()(double dx, double dy) const { return std::max(x(std::abs(dx)), y(std::abs(dy))); }
};

}  // namespace meltstage::motion::detail
