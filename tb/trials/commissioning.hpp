// SPDX-License-Identifier: Apache-2.0
// A head put into service with nothing but what the chip measures on it, as `meltstage chip tune` does.
#pragma once

#include <span>
#include <vector>

#include "host/commissioning.hpp"
#include "tb/trials/heated_run.hpp"

namespace meltstage::tb {

/// T_MAX, MAXTEMP, max_temp above the largest set-point.
inline constexpr double kOverTarget_degc = 15.0;

/// Settings as a host writes them, as words of the registers.
std::vector<HeadSetting> as_words(std::span<const host::Setting> settings);

/// Loop and detectors for a head that is known exactly, by the rules of docs/chip/protection.md;
/// `highest_degc`: largest set-point in use.
std::vector<HeadSetting> tuned_settings(const PlantConfig& plant, double highest_degc);

/// What the chip has measured, and the registers that follow from it.
struct Commissioned {
  host::HeadModel head;
  double noise_degc;
  double swing_degc;
  std::vector<HeadSetting> settings;  ///< gains, detectors, T_MAX and T_MIN for `highest_degc`
};

/// Self-tuning at `working_degc`, then a hold. `highest_degc`: largest set-point in use. T_AMB stays as
/// reset. Throws std::runtime_error when the chip stops heating, does not finish, or finds no head.
Commissioned commission(const HeadConfig& config, double working_degc, double highest_degc);

}  // namespace meltstage::tb
