// SPDX-License-Identifier: Apache-2.0
#include "asic/signoff/functional_vectors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "base/error.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/chip_pins.hpp"

namespace meltstage::app {

namespace {

constexpr char kClock[] = "clk_i";

// A signal of the stream: a bit of a pin, or the clock.
struct PinBit {
  std::uint32_t pin;
  unsigned bit;
};

std::vector<PinBit> bits_of(recording::Direction direction) {
  const auto& pins = tb::chip_pin_header("").pins;
  std::vector<PinBit> bits;
  for (std::uint32_t p = 0; p < pins.size(); ++p) {
    for (unsigned bit = 0; pins[p].direction == direction && bit < pins[p].width; ++bit)
      bits.push_back({p, bit});
  }
  return bits;
}

std::string name_of(const PinBit& bit) {
  const recording::Pin pin = tb::chip_pin_header("").pins[bit.pin];
  return pin.width == 1 ? pin.name : fmt::format("{}[{}]", pin.name, bit.bit);
}

}  // namespace

PinReplay replay_pins(const recording::Stream& stream, ReplayDevice device) {
  const auto chip_pins = tb::chip_pins_in(stream.header(), "recording");
  tb::require_operation(stream, "recording");
  chip::Chip model;
  const std::unique_ptr<tb::VerilatedRtl> rtl =
      device == ReplayDevice::rtl ? tb::make_verilated_rtl() : nullptr;
  PinReplay result;
  recording::Cursor cursor(stream);
  chip::Outputs left = model.outputs({.rst_n = false});
  for (bool more = true; more; more = cursor.step()) {
    const auto levels = tb::chip_levels(cursor.values(), chip_pins);
    const chip::Inputs in = tb::inputs_of(levels);
    const chip::Outputs recorded = tb::outputs_of(levels);
    const chip::Outputs out = tb::before_clock(left, in);
    left = rtl ? rtl->step(in) : model.step(in);
    ++result.clocks;
    result.strobes += tb::kChipPinCount - tb::kPinUartTx;
    if (out == recorded) continue;
    if (result.mismatches++ == 0)
      result.first = fmt::format("cycle {}: {}", cursor.cycle(), tb::output_difference(recorded, out));
  }
  return result;
}

dft::CycleStream chip_cycles(const recording::Stream& stream, const std::vector<FunctionalPiece>& pieces,
                             std::vector<MaskedStrobes>* masked, const std::string& name) {
  const auto chip_pins = tb::chip_pins_in(stream.header(), name);
  tb::require_operation(stream, name);
  const std::vector<PinBit> inputs = bits_of(recording::Direction::in),
                            outputs = bits_of(recording::Direction::out);
  dft::CycleStream result;
  result.title = "tc_top functional";
  result.signals.push_back({kClock, true});
  for (const PinBit& bit : inputs) result.signals.push_back({name_of(bit), true});
  for (const PinBit& bit : outputs) result.signals.push_back({name_of(bit), false});

  using Levels = std::array<std::uint64_t, tb::kChipPinCount>;
  const auto of = [&](const Levels& values, const std::vector<PinBit>& bits, const char* levels) {
    std::string text;
    for (const PinBit& bit : bits) text += levels[values[bit.pin] >> bit.bit & 1];
    return text;
  };
  std::size_t piece = 0;
  std::uint64_t at = 0;
  const auto add = [&](const std::string& states, std::uint64_t count) {
    while (count != 0) {
      std::string label;
      if (piece < pieces.size() && pieces[piece].first_cycle == at) label = pieces[piece++].requirement;
      const std::uint64_t part =
          piece < pieces.size() ? std::min(count, pieces[piece].first_cycle - at) : count;
      if (label.empty() && !result.cycles.empty() && result.cycles.back().states == states)
        result.cycles.back().count += part;
      else
        result.cycles.push_back({states, label, part});
      at += part;
      count -= part;
    }
  };
  const auto mask = [&](std::string& states, const std::vector<std::uint32_t>& pins, const char* reason) {
    MaskedStrobes entry{at, {}, reason};
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      if (std::find(pins.begin(), pins.end(), outputs[i].pin) == pins.end()) continue;
      states[1 + inputs.size() + i] = 'X';
      entry.outputs.push_back(name_of(outputs[i]));
    }
    if (masked != nullptr) masked->push_back(std::move(entry));
  };
  std::vector<std::uint32_t> every_output;
  for (const PinBit& bit : outputs) every_output.push_back(bit.pin);

  recording::Cursor cursor(stream);
  std::optional<Levels> before;
  for (bool more = true; more; more = cursor.next_event()) {
    const Levels now = tb::chip_levels(cursor.values(), chip_pins);
    const std::string driven = "P" + of(now, inputs, "01");
    const std::string states = driven + of(now, outputs, "LH");
    std::string first = states;
    if (!before)
      mask(first, every_output, "power-up: no clock and no reset has been yet");
    else if ((*before)[tb::kPinRstN] != 0 && now[tb::kPinRstN] == 0)
      mask(first, every_output, "rst_ni falls: the reset acts without the clock");
    else if ((*before)[tb::kPinInhibit] != now[tb::kPinInhibit])
      mask(first, {tb::kPinHeater}, "inhibit_i changes: it acts on heater_o without the clock");
    add(first, 1);
    const std::uint64_t end = cursor.next_event_cycle().value_or(cursor.final_cycle() + 1);
    add(states, end - cursor.cycle() - 1);
    before = now;
  }
  return result;
}

PinReplay replay_cycles_on(const dft::CycleStream& stream, ReplayDevice device, const Progress& progress) {
  dft::require_runnable(stream);
  const std::vector<PinBit> inputs = bits_of(recording::Direction::in),
                            outputs = bits_of(recording::Direction::out);
  const auto find = [&](const std::string& name, bool input) {
    for (std::size_t s = 0; s < stream.signals.size(); ++s) {
      if (stream.signals[s].name == name && stream.signals[s].is_input == input) return s;
    }
    throw UserError(fmt::format("{}: found no {} signal {}, expected every pin of the chip", stream.title,
                                input ? "input" : "output", name));
  };
  const std::size_t clock = find(kClock, true);
  std::vector<std::size_t> in_signals, out_signals;
  for (const PinBit& bit : inputs) in_signals.push_back(find(name_of(bit), true));
  for (const PinBit& bit : outputs) out_signals.push_back(find(name_of(bit), false));
  if (1 + inputs.size() + outputs.size() != stream.signals.size())
    throw UserError(fmt::format("{}: found {} signals, expected the {} of the chip", stream.title,
                                stream.signals.size(), 1 + inputs.size() + outputs.size()));
  chip::Chip model;
  const std::unique_ptr<tb::VerilatedRtl> rtl =
      device == ReplayDevice::rtl ? tb::make_verilated_rtl() : nullptr;
  chip::Inputs reset;
  reset.rst_n = false;
  auto levels = tb::pin_levels(reset, model.outputs(reset));
  PinReplay result;
  const std::uint64_t total = dft::cycle_count(stream);
  for (const dft::TestCycle& cycle : stream.cycles) {
    std::array<std::uint64_t, tb::kChipPinCount> pins{};
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (cycle.states[in_signals[i]] == '1') pins[inputs[i].pin] |= std::uint64_t{1} << inputs[i].bit;
    }
    const chip::Inputs in = tb::inputs_of(pins);
    for (std::uint64_t c = 0; c < cycle.count; ++c, ++result.clocks) {
      if (result.clocks % kTellEvery == 0) tell(progress, "replay", result.clocks, total);
      for (std::size_t i = 0; i < outputs.size(); ++i) {
        const char expected = cycle.states[out_signals[i]];
        if (expected != 'H' && expected != 'L') continue;
        ++result.strobes;
        const bool value = (levels[outputs[i].pin] >> outputs[i].bit & 1) != 0;
        if (value == (expected == 'H')) continue;
        if (result.mismatches++ == 0)
          result.first = fmt::format("cycle {}: {}: found {}, expected {}", result.clocks,
                                     name_of(outputs[i]), value ? 1 : 0, expected);
      }
      if (cycle.states[clock] == 'P') levels = tb::pin_levels(in, rtl ? rtl->step(in) : model.step(in));
    }
  }
  return result;
}

}  // namespace meltstage::app
