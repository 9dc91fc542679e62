// SPDX-License-Identifier: Apache-2.0
#include "tb/pins/model_replay.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"

namespace meltstage::tb {

ModelReplay::ModelReplay(const recording::Stream& stream, const std::string& name)
    : chip_pins_(chip_pins_in(stream.header(), name)), cursor_(stream), end_(stream.final_cycle() + 1) {
  require_operation(stream, name);
  if (stream.first_cycle() != 0)
    throw UserError(fmt::format("{}: found a beginning at cycle {}, expected 0; record it from reset on",
                                name, stream.first_cycle()));
  if (chip_levels(cursor_.values(), chip_pins_)[kPinRstN] != 0)
    throw UserError(fmt::format(
        "{}: found reset released in cycle 0, expected it asserted; record it from reset on", name));
}

bool ModelReplay::run(std::uint64_t clocks) {
  const std::uint64_t stop = run_.cycle + std::min(clocks, end_ - run_.cycle);
  while (!mismatch_ && run_.cycle < stop) {
    if (cursor_.next_event_cycle() == run_.cycle) cursor_.next_event();
    chip::StillPins still{inputs_of(chip_levels(cursor_.values(), chip_pins_))};
    chip::advance(run_, std::min(stop, cursor_.next_event_cycle().value_or(end_)), still,
                  [this](std::uint64_t cycle, const chip::Inputs& in, const chip::Outputs& left) {
                    compare(cycle, in, left);
                  });
  }
  return !mismatch_ && run_.cycle < end_;
}

void ModelReplay::compare(std::uint64_t cycle, const chip::Inputs& in, const chip::Outputs& left) {
  if (mismatch_) return;
  const auto recorded = chip_levels(cursor_.values(), chip_pins_);
  const auto expected = pin_levels(in, before_clock(left, in));
  for (std::uint32_t pin = chip::spec::kInputPins; pin < kChipPinCount; ++pin) {
    if (recorded[pin] == expected[pin]) continue;
    mismatch_ = PinMismatch{cycle, std::string(chip::spec::kPins[pin].name), recorded[pin], expected[pin]};
    return;
  }
}

}  // namespace meltstage::tb
