// SPDX-License-Identifier: Apache-2.0
#include "app/functional_vectors.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <stdexcept>

#include "tb/chip_pins.hpp"
#include "tb/verilated_rtl.hpp"

namespace meltstage::app {

PinReplay replay_pins(const vectors::Stream& stream, ReplayDevice device) {
  if (stream.header().pins != tb::chip_pin_header("").pins)
    throw std::runtime_error("recording: found other pins than the chip's, expected a recording of the chip");
  chip::Chip model;
  const std::unique_ptr<tb::VerilatedRtl> rtl =
      device == ReplayDevice::rtl ? tb::make_verilated_rtl() : nullptr;
  PinReplay result;
  vectors::Cursor cursor(stream);
  for (bool more = true; more; more = cursor.step()) {
    const chip::Inputs in = tb::inputs_of(cursor.values());
    const chip::Outputs recorded = tb::outputs_of(cursor.values());
    const chip::Outputs out = rtl ? rtl->step(in) : model.step(in);
    ++result.clocks;
    result.strobes += tb::kChipPinCount - tb::kPinUartTx;
    if (out == recorded) continue;
    if (result.mismatches++ == 0)
      result.first = fmt::format("cycle {}: {}", cursor.cycle(), tb::output_difference(recorded, out));
  }
  return result;
}

std::vector<dft::FunctionalStretch> functional_stretches(const vectors::Stream& stream,
                                                         const std::vector<std::string>& input_ports,
                                                         const std::string& clock,
                                                         const std::vector<std::string>& output_ports) {
  struct Source {
    std::uint32_t pin;
    unsigned bit;
  };
  const auto sources_of = [&](const std::vector<std::string>& ports) {
    std::vector<std::optional<Source>> sources;
    for (const std::string& port : ports) {
      const std::size_t bracket = port.find('[');
      const auto pin = vectors::find_pin(stream.header(), port.substr(0, bracket));
      if (!pin && port != clock)
        throw std::runtime_error(
            fmt::format("recording: found no pin {}, expected every port of the netlist", port));
      const unsigned bit =
          bracket == std::string::npos ? 0 : static_cast<unsigned>(std::stoul(port.substr(bracket + 1)));
      sources.push_back(pin ? std::optional(Source{*pin, bit}) : std::nullopt);
    }
    return sources;
  };
  const auto inputs = sources_of(input_ports), outputs = sources_of(output_ports);
  vectors::Cursor cursor(stream);
  const auto values_of = [&](const std::vector<std::optional<Source>>& sources) {
    std::vector<std::uint8_t> values;
    for (const auto& source : sources)
      values.push_back(source && (cursor.value(source->pin) >> source->bit & 1) != 0 ? 1 : 0);
    return values;
  };
  std::vector<dft::FunctionalStretch> stretches;
  for (bool more = true; more; more = cursor.next_event()) {
    dft::FunctionalStretch stretch{
        cursor.next_event_cycle().value_or(cursor.final_cycle() + 1) - cursor.cycle(), values_of(inputs),
        values_of(outputs)};
    const bool same = !stretches.empty() && stretches.back().inputs == stretch.inputs &&
                      stretches.back().outputs == stretch.outputs;
    if (same)
      stretches.back().clocks += stretch.clocks;
    else
      stretches.push_back(std::move(stretch));
  }
  return stretches;
}

}  // namespace meltstage::app
