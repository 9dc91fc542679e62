// SPDX-License-Identifier: Apache-2.0
// Detectors of the chip set from what self-tuning and a hold have measured on a head
// (docs/chip/protection.md).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "host/controller.hpp"

namespace meltstage::host {

/// After self-tuning a head settles for so many ultimate periods; then so many readings at least are looked
/// at.
inline constexpr double kSettlePeriods = 6.0;
inline constexpr std::size_t kReadings = 60;

/// A head as self-tuning sees it.
struct HeadModel {
  double hold_duty_per_k;  ///< duty (0..1) that holds a degree above ambient
  double dead_time_s;
  double rate_degc_per_s;  ///< steepest rise at full duty
  /// Of a head of the first order with that rise.
  double time_constant_s() const { return 1.0 / (hold_duty_per_k * rate_degc_per_s); }
};

/// The head of the first order with dead time that has this ultimate gain, ultimate period and hold duty at
/// `rise_degc` above ambient (Astrom and Hagglund 1984). Nothing when no such head exists: its gain at rest
/// would be below that at the ultimate period.
std::optional<HeadModel> identify_head(const Tuning& tuning, double rise_degc);

/// Detectors while nothing is known of a head: heat balance and hold power off, a minute at full duty for a
/// degree, or `lba_time_s` where that is longer. `ctrl`, `lba_time_s`: CTRL and LBA_TIME as they are.
std::vector<Setting> settings_before_tuning(std::uint16_t ctrl, double lba_time_s);

/// AT_WINDOW, degC, in which the relay does not switch on this noise.
double relay_window_degc(double noise_degc);

/// Registers of every detector that depends on the head: HEAT_RATE (in CTRL, whose other bits are `ctrl`),
/// DTDT_MAX, LBA_TIME, LBA_RISE, HOLD_MULT, HOLD_ADD, HOLD_TIME, EXC_LIMIT, ZERO_WAIT. Each is inside its
/// register's range. `noise_degc`: standard deviation of a sample.
std::vector<Setting> detector_settings(const HeadModel& head, double noise_degc, std::uint16_t ctrl);

/// Readings of a head that holds its set-point, or is off, taken at any moments.
class HoldRecord {
 public:
  /// `slope_degc`: change since the sample before, which the chip keeps beside each reading.
  void add(double degc, double slope_degc);
  std::size_t size() const { return count_; }
  /// Standard deviation of a sample without what the head itself does: from the slopes, about their mean. 0
  /// without a reading.
  double noise_degc() const;
  /// Standard deviation of what the head does beside that noise.
  double swing_degc() const;

 private:
  std::size_t count_ = 0;
  double first_degc_ = 0.0;
  double sum_degc_ = 0.0;
  double sum_squares_ = 0.0;
  double sum_slope_degc_ = 0.0;
  double sum_slope_squares_ = 0.0;
};

}  // namespace meltstage::host
