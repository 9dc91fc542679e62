// SPDX-License-Identifier: Apache-2.0
// What register words say, as the page takes it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/register_map.hpp"

namespace meltstage::app::live {

/// A point of the chart. What isn't there is NaN: a temperature before the first sample, all where the line
/// was lost.
struct Sample {
  double time_s;
  double temperature_degc;
  double setpoint_degc;  // working, after the ramp
  double duty_percent;
};

/// Input registers of a telemetry frame: one poll.
std::span<const host::Register* const> polled_registers();
/// All that can be read.
std::span<const host::Register* const> readable_registers();

/// Of the words of polled_registers().
Sample sample_of(double time_s, std::span<const std::uint16_t> polled);
std::string reading_json(double time_s, std::span<const std::uint16_t> polled);

/// Words of readable_registers(), by name.
class Registers {
 public:
  explicit Registers(std::vector<std::uint16_t> words) : words_(std::move(words)) {}
  std::uint16_t operator[](std::string_view name) const;
  /// {"SETPOINT": "110.0", ...}, values in their units.
  std::string json() const;
  /// A sentence for each fault that is latched, the first one first: what happened, value, limit, what to do.
  std::vector<std::string> faults() const;
  /// "SETPOINT 110.0 -> 25.0 degC" for each setting that is another than before.
  std::vector<std::string> changed_since(const Registers& before) const;

 private:
  std::vector<std::uint16_t> words_;
};

/// Whether a counter modulo 65536 has gone back: so it has begun anew.
constexpr bool went_back(std::uint16_t before, std::uint16_t now) {
  constexpr std::uint16_t kHalf = 0x8000;
  return static_cast<std::uint16_t>(now - before) >= kHalf;
}

/// What a register has, in a sentence: "SETPOINT is 80.0 degC".
std::string is_now(const host::Register& reg, std::uint16_t word);

}  // namespace meltstage::app::live
