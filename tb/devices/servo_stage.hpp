// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace meltstage::tb {

/// One axis of the stage: a servo drive in step/direction mode and the slide it moves.
struct ServoAxisConfig {
  double mm_per_pulse;          ///< > 0; e.g. lead 10 mm over 10000 pulses a turn
  double travel_mm;             ///< limit switches close at <= 0 and >= travel
  double natural_frequency_hz;  ///< of the position loop with the slide, > 0
  double damping_ratio;         ///< >= 0
  double encoder_mm_per_count;  ///< > 0
  double index_pitch_mm;        ///< one index mark each pitch, 0 = none
  double index_width_mm;        ///< width of a mark, centred on it
  double start_mm = 0.0;        ///< true position at power-on
};

/// Servo axis reacting to step and direction pins. Position follows the pulse count as
/// x'' = w^2 (u - x) - 2 zeta w x', solved exactly between pulses for any interval. Readings do not change
/// later ones; a reading earlier than the last pulse throws std::logic_error.
class ServoAxis {
 public:
  /// Throws std::invalid_argument on a value out of its range.
  ServoAxis(const ServoAxisConfig& config, double clock_hz);

  /// Pin levels of a cycle; a rising step edge moves one pulse, direction high = positive.
  void step(std::uint64_t cycle, bool step_pin, bool dir_pin) {
    if (step_pin == step_pin_) return;
    step_pin_ = step_pin;
    if (step_pin) pulse(cycle, dir_pin);
  }

  /// Pulses up minus pulses down.
  std::int64_t pulses() const { return pulses_; }
  /// Where the pulses say the axis should be, from its position at power-on.
  double commanded_mm() const;
  double position_mm(std::uint64_t cycle) const { return now(cycle).position_mm; }
  double velocity_mm_s(std::uint64_t cycle) const { return now(cycle).velocity_mm_s; }
  /// Encoder counts from the position at power-on.
  std::int64_t encoder_counts(std::uint64_t cycle) const;
  bool limit_low(std::uint64_t cycle) const { return position_mm(cycle) <= 0.0; }
  bool limit_high(std::uint64_t cycle) const { return position_mm(cycle) >= config_.travel_mm; }
  bool index(std::uint64_t cycle) const;

 private:
  struct State {
    double position_mm;
    double velocity_mm_s;
  };
  State now(std::uint64_t cycle) const;
  void pulse(std::uint64_t cycle, bool positive);

  ServoAxisConfig config_;
  double clock_hz_;
  State state_;
  std::uint64_t cycle_ = 0;
  std::int64_t pulses_ = 0;
  bool step_pin_ = false;
};

}  // namespace meltstage::tb
