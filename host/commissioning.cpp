// SPDX-License-Identifier: Apache-2.0
#include "host/commissioning.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cmodel/spec.hpp"

namespace meltstage::host {

namespace spec = chip::spec;

namespace {

// A heater that warms its block through a resistance and a sensor that lags both turn the phase at the
// ultimate period. A head of the first order has only its dead time for that, so it seems slower than it is:
// on the five known heads its rise is 0.75 to 0.77 of the true one.
constexpr double kRiseOfHead = 1.3;

// Above the set-point the block of a dead sensor may come this far before the chip asks: a thermal fuse opens
// at 60, and asking takes HOLD_TIME and twice LBA_TIME.
constexpr double kHoldMargin_degc = 40.0;

constexpr double kCoarsestStep_degc = 0.25;         // of the sensor presets
constexpr double kHeatRatePer_s = 131072.0 / 10.0;  // HEAT_RATE of 1 / s

double inside(const Register& reg, double value) {
  const double low = std::max(reg.min, 1) * reg.scale;  // 0 would switch a detector off
  return std::clamp(value, low, reg.max * reg.scale);
}

}  // namespace

std::optional<HeadModel> identify_head(const Tuning& tuning, double rise_degc) {
  if (rise_degc <= 0.0 || tuning.hold_duty_percent <= 0.0 || tuning.tu_s <= 0.0) return std::nullopt;
  const double hold_duty_per_k = tuning.hold_duty_percent / 100.0 / rise_degc;
  const double ratio = tuning.ku_per_k / hold_duty_per_k;  // gain at rest over that at the ultimate period
  if (ratio <= 1.0) return std::nullopt;
  const double lag = std::sqrt(ratio * ratio - 1.0);  // ultimate frequency times time constant
  const double ultimate_rad_per_s = 2.0 * std::numbers::pi / tuning.tu_s;
  return HeadModel{.hold_duty_per_k = hold_duty_per_k,
                   .dead_time_s = (std::numbers::pi - std::atan(lag)) / ultimate_rad_per_s,
                   .rate_degc_per_s = kRiseOfHead * ultimate_rad_per_s / (lag * hold_duty_per_k)};
}

double relay_window_degc(double noise_degc) { return 8.0 * noise_degc; }

std::vector<Setting> settings_before_tuning(std::uint16_t ctrl, double lba_time_s) {
  const unsigned other_bits = ctrl & ~static_cast<unsigned>(spec::kCtrlHeatRateMask);
  return {{&find_register("CTRL"), static_cast<double>(other_bits)},
          {&find_register("LBA_TIME"), std::max(60.0, lba_time_s)},
          {&find_register("LBA_RISE"), 1.0},
          {&find_register("HOLD_TIME"), 0.0}};
}

std::vector<Setting> detector_settings(const HeadModel& head, double noise_degc, std::uint16_t ctrl) {
  constexpr unsigned kHeatRateMax = spec::kCtrlHeatRateMask >> spec::kCtrlHeatRate;
  const auto heat_rate = static_cast<unsigned>(
      std::clamp(std::round(kHeatRatePer_s / head.time_constant_s()), 1.0, double{kHeatRateMax}));
  const unsigned other_bits = ctrl & ~static_cast<unsigned>(spec::kCtrlHeatRateMask);
  std::vector<Setting> settings;
  const auto set = [&](const char* name, double value) {
    const Register& reg = find_register(name);
    settings.push_back({&reg, inside(reg, value)});
  };
  set("CTRL", other_bits | heat_rate << spec::kCtrlHeatRate);
  // Twice the largest change between two samples: the difference of two has 1.4 times the noise.
  set("DTDT_MAX", 4.0 * kCoarsestStep_degc + 3.0 * head.rate_degc_per_s + 12.0 * noise_degc);
  set("LBA_TIME", 2.5 * head.dead_time_s);
  set("LBA_RISE", 1.0);
  set("HOLD_MULT", 1.0);
  set("HOLD_ADD", 100.0 * head.hold_duty_per_k * kHoldMargin_degc);
  set("HOLD_TIME", 20.0);
  set("EXC_LIMIT", 10.0);
  set("ZERO_WAIT", 3.0 * head.dead_time_s);
  return settings;
}

void HoldRecord::add(double degc, double slope_degc) {
  if (count_++ == 0) first_degc_ = degc;
  const double above = degc - first_degc_;
  sum_degc_ += above;
  sum_squares_ += above * above;
  sum_slope_degc_ += slope_degc;
  sum_slope_squares_ += slope_degc * slope_degc;
}

double HoldRecord::noise_degc() const {
  if (count_ == 0) return 0.0;
  const double n = static_cast<double>(count_);
  const double mean = sum_slope_degc_ / n;
  return std::sqrt(std::max(0.0, sum_slope_squares_ / n - mean * mean) / 2.0);
}

double HoldRecord::swing_degc() const {
  if (count_ == 0) return 0.0;
  const double n = static_cast<double>(count_);
  const double mean = sum_degc_ / n;
  const double noise = noise_degc();
  return std::sqrt(std::max(0.0, sum_squares_ / n - mean * mean - noise * noise));
}

}  // namespace meltstage::host
