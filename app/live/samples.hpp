// SPDX-License-Identifier: Apache-2.0
// The last samples, for whoever opens the page later.
#pragma once

#include <deque>
#include <mutex>
#include <string>

#include "app/live/reading.hpp"

namespace meltstage::app::live {

/// [time_s, temperature, set-point, duty], null for what isn't there.
std::string sample_json(const Sample& sample);

class Samples {
 public:
  /// An hour, four a second.
  static constexpr std::size_t kMostKept = 14'400;

  void add(const Sample& sample);
  /// [...] of sample_json(), oldest first.
  std::string json() const;

 private:
  mutable std::mutex mutex_;
  std::deque<Sample> samples_;
};

}  // namespace meltstage::app::live
