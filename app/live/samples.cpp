// SPDX-License-Identifier: Apache-2.0
#include "app/live/samples.hpp"

#include <fmt/format.h>

#include <cmath>

namespace meltstage::app::live {

void Samples::add(const Sample& sample) {
  const std::lock_guard lock(mutex_);
  samples_.push_back(sample);
  if (samples_.size() > kMostKept) samples_.pop_front();
}

std::string Samples::json() const {
  const std::lock_guard lock(mutex_);
  std::string rows;
  for (const Sample& s : samples_)
    rows += fmt::format("{}[{:.2f},{},{:.1f},{:.2f}]", rows.empty() ? "" : ",", s.time_s,
                        std::isnan(s.temperature_degc) ? "null" : fmt::format("{:.3f}", s.temperature_degc),
                        s.setpoint_degc, s.duty_percent);
  return "[" + rows + "]";
}

}  // namespace meltstage::app::live
