// SPDX-License-Identifier: Apache-2.0
// The word that a register holds of a value, or why it holds none.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <string>

namespace meltstage::host {

/// Digits behind the point that tell two neighbouring values apart; one more for a step that is no power of
/// ten.
inline int decimals(double scale) {
  int digits = 0;
  double step = scale;
  for (; digits < 8 && step < 0.999; step *= 10.0) ++digits;
  return std::abs(step - std::round(step)) > 1e-9 ? digits + 1 : digits;
}

struct RegisterWord {
  std::uint16_t word = 0;
  std::string expected{};  ///< instead of the value; empty when the register can hold it
};

/// The value in the register's unit, rounded to the nearest LSB. Rounding is no answer where it makes
/// something else of the value: of a bit field or count with a fraction, of a value that becomes 0, which
/// often means off, and of a baud rate that a receiver would not follow. `Info` has unit, scale, min and max,
/// as chip::spec::RegisterInfo.
template <class Info>
RegisterWord register_word(const Info& info, double value) {
  constexpr double kBaudError = 0.025;
  const std::string unit = info.unit.empty() ? std::string() : " " + std::string(info.unit);
  const double raw = std::round(value / info.scale);
  if (!(raw >= info.min && raw <= info.max)) {  // false for NaN too
    const int digits = decimals(info.scale);
    return {0, fmt::format("{:.{}f} to {:.{}f}{}", info.min * info.scale, digits, info.max * info.scale,
                           digits, unit)};
  }
  const double whole = raw * info.scale;
  if (info.unit.empty() && info.scale == 1.0 && value != raw) return {0, "a whole number"};
  if (raw == 0.0 && value != 0.0)
    return {0, fmt::format("0, or {:.6g}{} at least: the register would hold 0", info.scale, unit)};
  if (info.unit == "Bd" && std::abs(value - whole) > kBaudError * value)
    return {0, fmt::format("a rate within 2.5 % of a multiple of {:g} Bd; the nearest is {:g}", info.scale,
                           whole)};
  return {static_cast<std::uint16_t>(static_cast<std::int32_t>(raw))};
}

}  // namespace meltstage::host
