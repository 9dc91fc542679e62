// SPDX-License-Identifier: Apache-2.0
#include "tb/pins/chip_pins.hpp"

#include <fmt/format.h>

#include <utility>

#include "base/error.hpp"
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

std::vector<std::optional<std::uint32_t>> chip_pins_in(const recording::Header& header,
                                                       const std::string& name) {
  const recording::Header chip = chip_pin_header(name);
  const auto text = [](const recording::Pin& pin) {
    return fmt::format("pin {} {} of {} bits", pin.name, recording::to_string(pin.direction), pin.width);
  };
  std::vector<std::optional<std::uint32_t>> result(header.pins.size());
  for (std::uint32_t p = 0; p < kChipPinCount; ++p) {
    const recording::Pin& pin = chip.pins[p];
    const auto at = recording::find_pin(header, pin.name);
    if (!at)
      throw UserError(
          fmt::format("{}: found no {}, expected all pins of the chip; record it again", name, text(pin)));
    const recording::Pin& found = header.pins[*at];
    if (found.width != pin.width || found.direction != pin.direction)
      throw UserError(fmt::format("{}: found {}, expected {}, as the chip has it; record it again", name,
                                  text(found), text(pin)));
    result[*at] = p;
  }
  if (header.clock_hz != chip.clock_hz)
    throw UserError(fmt::format("{}: found a clock of {} Hz, expected the chip's {} Hz; record it again",
                                name, header.clock_hz, chip.clock_hz));
  return result;
}

void require_operation(const recording::Pin& pin, std::uint64_t level, std::uint64_t cycle,
                       const std::string& name) {
  if (level == 0 || (pin.name != "scan_en_i" && pin.name != "scan_o")) return;
  throw UserError(fmt::format(
      "{}: cycle {}: found {} = {:#x}, expected 0, as in operation; leave the cycles of a scan test out",
      name, cycle, pin.name, level));
}

void require_operation(const recording::Stream& stream, const std::string& name) {
  recording::ChangeReader reader(stream);
  for (recording::Change change; reader.next(change);)
    require_operation(stream.header().pins[change.pin], change.value, change.cycle, name);
}

std::array<std::uint64_t, kChipPinCount> chip_levels(
    std::span<const std::uint64_t> values, std::span<const std::optional<std::uint32_t>> chip_pins) {
  std::array<std::uint64_t, kChipPinCount> levels{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (chip_pins[i]) levels[*chip_pins[i]] = values[i];
  }
  return levels;
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
