// SPDX-License-Identifier: Apache-2.0
// The chip's pins in a recording: names, order, and the way to and from chip::Inputs and chip::Outputs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cmodel/pins.hpp"
#include "recording/stream.hpp"

namespace meltstage::tb {

// Indices into chip_pin_header's pins.
using enum chip::spec::Pin;
inline constexpr std::uint32_t kChipPinCount = chip::spec::kPins.size();

// Inputs and outputs of the chip, nothing else.
recording::Header chip_pin_header(std::string origin);

// Which of the chip's pins each pin of a recording is; none for a pin of somebody else. Throws UserError that
// begins with `name` when a pin of the chip is missing or has another width or direction, or the clock is
// another than the chip's.
std::vector<std::optional<std::uint32_t>> chip_pins_in(const recording::Header& header,
                                                       const std::string& name);
// Throws UserError that begins with `name` where the pin is scan_en_i or scan_o and not low: what runs on a
// recording knows operation alone, so it could not judge that cycle.
void require_operation(const recording::Pin& pin, std::uint64_t level, std::uint64_t cycle,
                       const std::string& name);
// The same of all changes of a recording.
void require_operation(const recording::Stream& stream, const std::string& name);
// A recording's levels in the order of the chip's pins.
std::array<std::uint64_t, kChipPinCount> chip_levels(std::span<const std::uint64_t> values,
                                                     std::span<const std::optional<std::uint32_t>> chip_pins);

chip::Inputs inputs_of(std::span<const std::uint64_t> pins);
chip::Outputs outputs_of(std::span<const std::uint64_t> pins);
// Levels of all pins in the header's order.
std::array<std::uint64_t, kChipPinCount> pin_levels(const chip::Inputs& in, const chip::Outputs& out);
// What a recording has of a cycle's outputs, all of them before its clock: `left`, those that the clock
// before left, with inhibit_i acting on the heater without a clock. A reset that falls shows a cycle later.
chip::Outputs before_clock(chip::Outputs left, const chip::Inputs& in);
// Into a recording that begins with chip_pin_header's pins, or its inputs.
void record_inputs(recording::Recorder& recorder, const chip::Inputs& in);
void record_outputs(recording::Recorder& recorder, const chip::Outputs& out);
// "heater_o recorded 1, chip 0", of the first output that differs; empty when none does.
std::string output_difference(const chip::Outputs& recorded, const chip::Outputs& chip);

}  // namespace meltstage::tb
