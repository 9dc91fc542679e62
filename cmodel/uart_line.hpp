// SPDX-License-Identifier: Apache-2.0
// What receiver and transmitter of the serial lines share (rtl/tc_uart_pkg.sv is the twin).
#pragma once

#include <bit>
#include <cstdint>

#include "flops.hpp"
#include "spec.hpp"

namespace meltstage::chip {

// Ticks of a sixteenth bit: an accumulator gains BAUD (baud rate / 100) each clock and wraps at clock / 1600;
// a wrap is a tick. So their mean rate is exact at every baud rate.
struct BaudStep {
  bool tick;
  std::uint16_t acc;  // of the next clock
};
inline constexpr unsigned kBaudModulus = spec::kClkHz / (16 * 100);
constexpr BaudStep baud_step(std::uint16_t acc, std::uint16_t baud) {
  const unsigned sum = acc + baud;
  return {sum >= kBaudModulus,
          static_cast<std::uint16_t>((sum < kBaudModulus ? sum : sum - kBaudModulus) & 0x1FFFu)};
}

// After an upset the accumulator may be where no closed form has it: it goes clock by clock.
constexpr bool ticks_evenly(std::uint16_t acc, std::uint16_t baud) {
  return acc < kBaudModulus && baud < kBaudModulus;
}

// Clocks before the one that brings the n-th tick from now, n > 0.
constexpr std::uint64_t clocks_to_tick(std::uint16_t acc, std::uint16_t baud, unsigned n) {
  if (!ticks_evenly(acc, baud)) return 0;
  if (baud == 0) return kForever;
  return (n * kBaudModulus - acc - 1) / baud;
}

// The same steps at once.
struct BaudRun {
  std::uint64_t ticks;
  std::uint16_t acc;
};
constexpr BaudRun baud_run(std::uint16_t acc, std::uint16_t baud, std::uint64_t clocks) {
  const std::uint64_t sum = acc + baud * clocks;
  return {sum / kBaudModulus, static_cast<std::uint16_t>(sum % kBaudModulus)};
}

constexpr bool has_parity(std::uint8_t format) {
  return format == spec::kFormat8E1 || format == spec::kFormat8O1;
}

// The bit after the data: parity, or the mark of a stop bit.
constexpr std::uint8_t ninth_bit(std::uint8_t format, std::uint8_t data) {
  const auto odd = static_cast<std::uint8_t>(std::popcount(data) & 1);
  if (format == spec::kFormat8E1) return odd;
  if (format == spec::kFormat8O1) return odd ^ 1u;
  return 1;
}

// Bits of a character, start and stop bits included.
constexpr std::uint8_t char_bits(std::uint8_t format) { return format == spec::kFormat8N1 ? 10 : 11; }

}  // namespace meltstage::chip
