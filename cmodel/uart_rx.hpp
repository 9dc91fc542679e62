// SPDX-License-Identifier: Apache-2.0
// Serial receiver, model of rtl/tc_uart_rx.sv.
#pragma once

#include <cstdint>

#include "flops.hpp"

namespace meltstage::chip {

#define TC_UART_RX_FLOPS(X)           \
  X(std::uint8_t, state_q, 4, 0)      \
  X(std::uint16_t, acc_q, 13, 0)      \
  X(std::uint8_t, tick_q, 4, 0)       \
  X(std::uint8_t, bit_q, 3, 0)        \
  X(std::uint8_t, high_q, 2, 0)       \
  X(std::uint8_t, shift_q, 8, 0)      \
  X(std::uint8_t, parity_bad_q, 1, 0) \
  X(std::uint8_t, valid_q, 1, 0)      \
  X(std::uint8_t, error_q, 1, 0)      \
  X(std::uint16_t, gap_q, 10, 0)      \
  X(std::uint16_t, quiet_q, 15, 0)

struct UartRx {
  // Any two codes differ in two bits; an illegal code falls back to idle.
  enum State : std::uint8_t {
    kIdle = 0b0000,
    kStart = 0b0011,
    kData = 0b0101,
    kParity = 0b0110,
    kStop = 0b1001,
    kBreak = 0b1010
  };

  TC_UART_RX_FLOPS(TC_DECLARE_FLOP)

  // An incomplete frame is given up when fewer ticks of the gap are missing.
  static constexpr std::uint16_t kGiveUpLeft = 144;

  // One clock; rx is the synchronised line, baud in 100 Bd, format as register FORMAT's, pause as its bit 2.
  void step(std::uint8_t rx, std::uint16_t baud, std::uint8_t format, bool pause);
  std::uint64_t quiet(std::uint8_t rx, std::uint16_t baud) const;
  void skip(std::uint8_t rx, std::uint16_t baud, std::uint64_t clocks);

  // 3.5 characters, less 2.5 bits, of silence since the last character's end.
  bool gap() const { return (state_q | gap_q) == 0; }
  // Nearly 2.5 characters; with pause also 1.75 ms since its stop bit.
  bool give_up() const { return (state_q | quiet_q) == 0 && gap_q < kGiveUpLeft; }
  bool idle() const { return (state_q | gap_q | quiet_q) == 0; }

 private:
  void sample(std::uint8_t rx);
  void judge(std::uint8_t level, std::uint8_t format, bool pause);
};

}  // namespace meltstage::chip
