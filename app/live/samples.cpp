// SPDX-License-Identifier: Apache-2.0
#include "app/live/samples.hpp"

#include <fmt/format.h>

#include <cmath>

namespace meltstage::app::live {
namespace {

std::string json_number(double value) { return std::isnan(value) ? "null" : fmt::format("{:.3f}", value); }

}  // namespace

std::string sample_json(const Sample& sample) {
  return fmt::format("[{:.3f},{},{},{}]", sample.time_s, json_number(sample.temperature_degc),
                     json_number(sample.setpoint_degc), json_number(sample.duty_percent));
}

void Samples::add(const Sample& sample) {
  const std::lock_guard lock(mutex_);
  samples_.push_back(sample);
  if (samples_.size() > kMostKept) samples_.pop_front();
}

std::string Samples::json() const {
  const std::lock_guard lock(mutex_);
  std::string rows;
  for (const Sample& sample : samples_) rows += (rows.empty() ? "" : ",") + sample_json(sample);
  return "[" + rows + "]";
}

}  // namespace meltstage::app::live
