// SPDX-License-Identifier: Apache-2.0
// Time of a path after Klipper's look-ahead (klippy/toolhead.py): speed at a corner from the junction
// deviation and from the length of the lines beside it, constant acceleration on the lines. It has no limit
// of the jerk, and the velocity jumps at each corner.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace meltstage::app {

struct KlipperLimits {
  double velocity_mm_s, acceleration_mm_s2, junction_deviation_mm;
};

inline double klipper_time_s(std::span<const Eigen::Vector3d> points_mm, const KlipperLimits& limits) {
  const double a = limits.acceleration_mm_s2, v2 = limits.velocity_mm_s * limits.velocity_mm_s;
  const std::size_t lines = points_mm.size() - 1;
  const auto way = [&](std::size_t i) { return Eigen::Vector3d(points_mm[i + 1] - points_mm[i]); };
  std::vector<double> at2(lines + 1, 0.0);  // squared speed at each point
  for (std::size_t i = 1; i < lines; ++i) {
    const double cosine = -way(i - 1).normalized().dot(way(i).normalized());
    if (cosine > 0.999999) continue;
    at2[i] = v2;
    if (cosine < -0.999999) continue;
    const double sine_half = std::sqrt(0.5 * (1.0 - cosine)), cosine_half = std::sqrt(0.5 * (1.0 + cosine));
    const double shorter = std::min(way(i - 1).norm(), way(i).norm());
    at2[i] = std::min({v2, limits.junction_deviation_mm * a * sine_half / (1.0 - sine_half),
                       0.25 * sine_half / cosine_half * shorter * a});
  }
  for (std::size_t i = lines; i-- > 0;) at2[i] = std::min(at2[i], at2[i + 1] + 2.0 * a * way(i).norm());
  for (std::size_t i = 0; i < lines; ++i) at2[i + 1] = std::min(at2[i + 1], at2[i] + 2.0 * a * way(i).norm());
  double time_s = 0.0;
  for (std::size_t i = 0; i < lines; ++i) {
    const double length = way(i).norm();
    const double peak2 = std::min(v2, 0.5 * (at2[i] + at2[i + 1]) + a * length);
    const double from = std::sqrt(at2[i]), peak = std::sqrt(peak2), to = std::sqrt(at2[i + 1]);
    const double cruise_mm = length - (2.0 * peak2 - at2[i] - at2[i + 1]) / (2.0 * a);
    time_s += (2.0 * peak - from - to) / a + std::max(0.0, cruise_mm) / peak;
  }
  return time_s;
}

}  // namespace meltstage::app
