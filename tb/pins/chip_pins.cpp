// SPDX-License-Identifier: Apache-2.0
#include "tb/pins/chip_pins.hpp"

#include <fmt/format.h>

#include <utility>

#include "cmodel/spec.hpp"

namespace meltstage::tb {

recording::Header chip_pin_header(std::string origin) {
  recording::Header header{
      .pins = {}, .clock_hz = chip::spec::kClkHz, .origin = std::move(origin), .meta = {}};
  for (const chip::spec::PinInfo& pin : chip::spec::kPins) {
    const auto direction = pin.output ? recording::Direction::out : recording::Direction::in;
    header.pins.push_back({std::string(pin.name), direction, pin.width, "chip"});
  }
  return header;
}

chip::Inputs inputs_of(std::span<const std::uint64_t> pins) {
  chip::Inputs in;
  const std::uint64_t* level = pins.data();
#define TC_TAKE(port, member, bits) in.member = static_cast<decltype(in.member)>(*level++);
  TC_INPUT_PINS(TC_TAKE)
  TC_TEST_PINS(TC_TAKE)
#undef TC_TAKE
  return in;
}

chip::Outputs outputs_of(std::span<const std::uint64_t> pins) {
  chip::Outputs out{};
  const std::uint64_t* level = pins.data() + chip::spec::kInputPins;
#define TC_TAKE(port, member, bits) out.member = *level++ != 0;
  TC_OUTPUT_PINS(TC_TAKE)
#undef TC_TAKE
  return out;
}

std::array<std::uint64_t, kChipPinCount> pin_levels(const chip::Inputs& in, const chip::Outputs& out) {
  return {
#define TC_INPUT(port, member, bits) in.member,
#define TC_OUTPUT(port, member, bits) out.member,
      TC_INPUT_PINS(TC_INPUT) TC_TEST_PINS(TC_INPUT) TC_OUTPUT_PINS(TC_OUTPUT)
#undef TC_INPUT
#undef TC_OUTPUT
  };
}

chip::Outputs before_clock(chip::Outputs left, const chip::Inputs& in) {
  left.heater = left.heater && !in.inhibit;
  return left;
}

void record_inputs(recording::Recorder& recorder, const chip::Inputs& in) {
  std::uint32_t pin = 0;
#define TC_RECORD(port, member, bits) recorder.set(pin++, in.member);
  TC_INPUT_PINS(TC_RECORD)
  TC_TEST_PINS(TC_RECORD)
#undef TC_RECORD
}

void record_outputs(recording::Recorder& recorder, const chip::Outputs& out) {
  std::uint32_t pin = chip::spec::kInputPins;
#define TC_RECORD(port, member, bits) recorder.set(pin++, out.member);
  TC_OUTPUT_PINS(TC_RECORD)
#undef TC_RECORD
}

std::string output_difference(const chip::Outputs& recorded, const chip::Outputs& chip) {
  if (recorded == chip) return "";
  const auto a = pin_levels({}, recorded);
  const auto b = pin_levels({}, chip);
  std::uint32_t pin = chip::spec::kInputPins;
  while (a[pin] == b[pin]) ++pin;
  return fmt::format("{} recorded {}, chip {}", chip::spec::kPins[pin].name, a[pin], b[pin]);
}

}  // namespace meltstage::tb
