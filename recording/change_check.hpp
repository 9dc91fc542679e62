// SPDX-License-Identifier: Apache-2.0
// The order of a recording, said once for all sinks.
#pragma once

#include <cstdint>
#include <vector>

#include "recording/header.hpp"

namespace meltstage::recording {

/// Which rule of Sink a change breaks.
enum class ChangeFault {
  none,
  no_such_pin,
  cycle_backwards,
  pin_repeated,
  pin_order,
  first_cycle_incomplete,
  value_too_wide,
  value_unchanged
};

/// Holds the last value of each pin, and judges the next change against the rules of Sink.
class ChangeCheck {
 public:
  ChangeCheck() = default;
  /// A recording begins. Throws std::invalid_argument on an invalid header, and when one has begun before.
  void begin(const Header& header);

  /// Judges `change` and, when no rule is broken, takes it over.
  ChangeFault accept(const Change& change) {
    if (change.pin >= pins_.size()) return ChangeFault::no_such_pin;
    PinState& pin = pins_[change.pin];
    if (change.value > pin.max_value) return ChangeFault::value_too_wide;
    if (next_initial_pin_ == pins_.size() && change.cycle > cycle_) {
      if (pin.value == change.value) return ChangeFault::value_unchanged;
    } else if (const ChangeFault fault = judge_within_cycle(change); fault != ChangeFault::none) {
      return fault;
    }
    pin.value = change.value;
    cycle_ = change.cycle;
    pin_ = change.pin;
    return ChangeFault::none;
  }
  /// As accept(), but throws std::invalid_argument with one line.
  void require(const Change& change) {
    if (const ChangeFault fault = accept(change); fault != ChangeFault::none) fail(fault, change);
  }
  /// Throws std::invalid_argument when the recording may not end at `final_cycle`.
  void require_end(std::uint64_t final_cycle) const;
  /// From now on each change and each end is refused.
  void close() { pins_.clear(); }

  /// Pins that the first cycle has stated so far, all once it is complete.
  std::size_t initial_pins() const { return next_initial_pin_; }
  bool first_cycle_complete() const { return next_initial_pin_ == pins_.size(); }
  std::uint64_t cycle() const { return cycle_; }

 private:
  struct PinState {
    std::uint64_t value;
    std::uint64_t max_value;
  };

  ChangeFault judge_within_cycle(const Change& change);
  [[noreturn]] void fail(ChangeFault fault, const Change& change) const;

  bool begun_ = false;
  std::vector<PinState> pins_;
  std::size_t next_initial_pin_ = 0;
  std::uint64_t cycle_ = 0;
  std::uint32_t pin_ = 0;
};

}  // namespace meltstage::recording
