// SPDX-License-Identifier: Apache-2.0
#include "app/chip/chip_wire.hpp"

#include <cmath>
#include <utility>

#include "cmodel/spec.hpp"

namespace meltstage::app {

namespace {

// Frames must not run into each other. The chip tells them apart by 3.5 characters of silence. It gives up
// one that is not complete after nearly 2.5 characters, and with FORMAT.PAUSE no earlier than this time after
// what it takes for the last character, which may be one late (rtl/tc_uart_rx.sv).
constexpr double kGiveUpWithPause_s = 1.75e-3;
constexpr double kSilence_characters = 4.0;

tb::UartLine line_of(const LineSettings& settings) {
  return {chip::spec::kClkHz, baud(settings), tb::uart_format(settings.format)};
}

}  // namespace

LineSettings line_settings(const chip::Chip& chip) { return {chip.uartc.baud_q, chip.uartc.format_q}; }

double baud(const LineSettings& settings) { return settings.baud_100 * 100.0; }

std::string_view format_name(const LineSettings& settings) {
  namespace spec = chip::spec;
  return spec::kCharacters[spec::field_of(settings.format, spec::kFormatCharacterMask)].name;
}

MasterEnd::MasterEnd(const LineSettings& settings)
    : settings_(settings),
      transmitter_(line_of(settings), {}, stream(0, "master")),
      receiver_(line_of(settings)) {}

void MasterEnd::follow(const LineSettings& settings) {
  if (settings == settings_ || busy()) return;
  settings_ = settings;
  heard_ = take();
  transmitter_ = tb::UartTransmitter(line_of(settings), {}, stream(0, "master"));
  receiver_ = tb::UartReceiver(line_of(settings));
}

void MasterEnd::send(std::uint64_t cycle, std::span<const std::uint8_t> frame) {
  const tb::UartLine line = line_of(settings_);
  const std::uint64_t start = std::max(cycle, earliest_start_);
  double gap_bits = static_cast<double>(start - cycle) / line.bit_cycles();
  for (const std::uint8_t byte : frame) {
    transmitter_.send({.data = byte, .gap_bits = gap_bits});
    gap_bits = 0.0;
  }
  const double silence = std::max(kGiveUpWithPause_s * line.clock_hz + line.char_cycles(),
                                  kSilence_characters * line.char_cycles());
  earliest_start_ = start + static_cast<std::uint64_t>(
                                std::ceil(static_cast<double>(frame.size()) * line.char_cycles() + silence));
}

std::vector<std::uint8_t> MasterEnd::take() {
  std::vector<std::uint8_t> bytes = std::exchange(heard_, {});
  while (const auto byte = receiver_.take()) bytes.push_back(byte->data);
  return bytes;
}

}  // namespace meltstage::app
