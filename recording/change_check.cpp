// SPDX-License-Identifier: Apache-2.0
#include "recording/change_check.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace meltstage::recording {
namespace {

const char* describe(ChangeFault fault) {
  switch (fault) {
    case ChangeFault::none:
      return "no fault";
    case ChangeFault::no_such_pin:
      return "no such pin in the header";
    case ChangeFault::cycle_backwards:
      return "cycle goes backwards";
    case ChangeFault::pin_repeated:
      return "pin changes twice in the cycle";
    case ChangeFault::pin_order:
      return "pins of a cycle are not in header order";
    case ChangeFault::first_cycle_incomplete:
      return "the first cycle must state every pin";
    case ChangeFault::value_too_wide:
      return "value is wider than the pin";
    case ChangeFault::value_unchanged:
      return "pin has that value already";
  }
  return "unknown fault";
}

}  // namespace

void ChangeCheck::begin(const Header& header) {
  if (begun_) throw std::invalid_argument("vector begin: found a second one, expected one in a recording");
  recording::validate(header);
  begun_ = true;
  pins_.reserve(header.pins.size());
  for (const Pin& pin : header.pins) pins_.push_back({0, max_value(pin.width)});
}

ChangeFault ChangeCheck::judge_within_cycle(const Change& change) {
  if (next_initial_pin_ == 0) {
    if (change.pin != 0) return ChangeFault::first_cycle_incomplete;
    next_initial_pin_ = 1;
    return ChangeFault::none;
  }
  if (change.cycle < cycle_) return ChangeFault::cycle_backwards;
  if (change.cycle > cycle_) return ChangeFault::first_cycle_incomplete;
  if (change.pin == pin_) return ChangeFault::pin_repeated;
  if (change.pin < pin_) return ChangeFault::pin_order;
  if (first_cycle_complete()) {
    return pins_[change.pin].value == change.value ? ChangeFault::value_unchanged : ChangeFault::none;
  }
  if (change.pin != next_initial_pin_) return ChangeFault::first_cycle_incomplete;
  ++next_initial_pin_;
  return ChangeFault::none;
}

void ChangeCheck::fail(ChangeFault fault, const Change& change) const {
  const char* const what = pins_.empty() ? "the recording has not begun, or has ended" : describe(fault);
  throw std::invalid_argument(fmt::format("vector change: {}: cycle {}, pin index {}, value {:#x}", what,
                                          change.cycle, change.pin, change.value));
}

void ChangeCheck::require_end(std::uint64_t final_cycle) const {
  if (pins_.empty() || !first_cycle_complete()) {
    throw std::invalid_argument(
        fmt::format("vector end: {} of {} pins stated: expected all in the first cycle", next_initial_pin_,
                    pins_.size()));
  }
  if (final_cycle < cycle_ || final_cycle > kMaxCycle) {
    throw std::invalid_argument(fmt::format(
        "vector end: final cycle {}: expected {} (the last change's) to {}", final_cycle, cycle_, kMaxCycle));
  }
}

}  // namespace meltstage::recording
