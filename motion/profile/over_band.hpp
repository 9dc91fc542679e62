// SPDX-License-Identifier: Apache-2.0
// Where in a band of frequencies a figure of a motion is largest. Internal to the motion library.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numbers>
#include <vector>

#include "motion/profile/vibration.hpp"

namespace meltstage::motion {

inline constexpr int kBandFrequencies = 21;  ///< that are looked at in any band

struct AtMode {
  Mode mode;
  double value = 0.0;
};

/// The mode of the band at which `figure(mode)`, of a motion of this duration, is largest. Over the frequency
/// it has lobes as wide as the inverse of the time that the mode remembers. Each is looked at eight times,
/// and the highest ones closely.
template <class Figure>
AtMode largest_over(const ModeBand& band, double duration_s, const Figure& figure) {
  check_band(band);
  if (band.spread == 0.0) return {band.nominal, figure(band.nominal)};
  constexpr double kPerLobe = 8.0, kMemories = 8.0, kMost = 1e5;
  const double low_hz = band.nominal.frequency_hz * (1.0 - band.spread),
               high_hz = band.nominal.frequency_hz * (1.0 + band.spread);
  const double decay = band.nominal.damping_ratio * 2.0 * std::numbers::pi * low_hz;
  const double remembered_s = decay > 0.0 ? std::min(duration_s, kMemories / decay) : duration_s;
  const int parts = static_cast<int>(
      std::clamp(kPerLobe * (high_hz - low_hz) * remembered_s, kBandFrequencies - 1.0, kMost));
  const auto at = [&](double frequency_hz) {
    const Mode mode{frequency_hz, band.nominal.damping_ratio};
    return AtMode{mode, figure(mode)};
  };
  const double step_hz = (high_hz - low_hz) / parts;
  std::vector<AtMode> looked;
  for (int i = 0; i <= parts; ++i) looked.push_back(at(low_hz + i * step_hz));
  const auto less = [](const AtMode& a, const AtMode& b) { return a.value < b.value; };
  AtMode largest = *std::max_element(looked.begin(), looked.end(), less);
  constexpr double kNear = 0.9;  // a lobe's top is at most so much above what was looked at
  for (std::size_t i = 0; i < looked.size(); ++i) {
    const AtMode &before = looked[i == 0 ? 0 : i - 1], &behind = looked[std::min(i + 1, looked.size() - 1)];
    if (looked[i].value < std::max({before.value, behind.value, kNear * largest.value})) continue;
    double low = before.mode.frequency_hz, high = behind.mode.frequency_hz;
    constexpr int kThirds = 24;
    for (int third = 0; third < kThirds; ++third) {
      const AtMode left = at(low + (high - low) / 3.0), right = at(high - (high - low) / 3.0);
      (left.value < right.value ? low : high) = (left.value < right.value ? left : right).mode.frequency_hz;
    }
    largest = std::max(largest, at(0.5 * (low + high)), less);
  }
  return largest;
}

}  // namespace meltstage::motion
