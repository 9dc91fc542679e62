// SPDX-License-Identifier: Apache-2.0
// Serial transmitter of whole Modbus frames, model of rtl/tc_uart_tx.sv.
#pragma once

#include <cstdint>

#include "flops.hpp"
#include "uart_line.hpp"

namespace meltstage::chip {

#define TC_UART_TX_FLOPS(X)            \
  X(std::uint8_t, busy_q, 1, 0)        \
  X(std::uint16_t, acc_q, 13, 0)       \
  X(std::uint8_t, tick_q, 4, 0)        \
  X(std::uint8_t, bits_q, 4, 0)        \
  X(std::uint16_t, shift_q, 11, 0x7FF) \
  X(std::uint8_t, next_q, 2, 0)        \
  X(std::uint16_t, crc_q, 16, 0xFFFF)  \
  X(std::uint8_t, take_q, 1, 0)

// The byte offered; data and last are looked at only in a clock in which char_ends().
struct UartTxIn {
  bool valid;
  std::uint8_t data;
  bool last;
};

struct UartTx {
  TC_UART_TX_FLOPS(TC_DECLARE_FLOP)

  // One clock; baud in 100 Bd, format as register FORMAT.
  void step(const UartTxIn& in, std::uint16_t baud, std::uint8_t format);
  // While no byte waits to be taken by an idle transmitter.
  std::uint64_t quiet(std::uint16_t baud) const;
  void skip(std::uint16_t baud, std::uint64_t clocks);

  // The next character, if any, is taken in this clock.
  bool char_ends(std::uint16_t baud) const {
    return busy_q != 0 && bits_q == 0 && tick_q == 15 && baud_step(acc_q, baud).tick;
  }
  bool tx() const { return (shift_q & 1u) != 0; }
  bool busy() const { return busy_q != 0; }
  bool take() const { return take_q != 0; }

 private:
  void next_char(const UartTxIn& in, std::uint8_t format);
};

}  // namespace meltstage::chip
