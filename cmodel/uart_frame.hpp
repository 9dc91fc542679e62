// SPDX-License-Identifier: Apache-2.0
// Modbus RTU framing of what the receiver hears, model of rtl/tc_uart_frame.sv.
#pragma once

#include <array>
#include <cstdint>

#include "flops.hpp"

namespace meltstage::chip {

#define TC_UART_FRAME_FLOPS(X)           \
  X(std::uint16_t, count_q, 9, 0)        \
  X(std::uint16_t, crc_q, 16, 0xFFFF)    \
  X(std::uint8_t, bad_q, 1, 0)           \
  X(std::uint8_t, skip_q, 1, 0)          \
  X(std::uint8_t, match_q, 1, 0)         \
  X(std::uint8_t, stop_like_q, 1, 0)     \
  X(std::uint8_t, broadcast_q, 1, 0)     \
  X(std::uint8_t, fc_q, 8, 0)            \
  X(std::uint16_t, a_q, 16, 0)           \
  X(std::uint16_t, b_q, 16, 0)           \
  X(std::uint8_t, bytes_q, 8, 0)         \
  X(std::uint16_t, len_q, 9, 0)          \
  X(std::uint8_t, cmd_valid_q, 1, 0)     \
  X(std::uint8_t, stop_q, 1, 0)          \
  X(std::uint8_t, good_q, 1, 0)          \
  X(std::uint16_t, crc_errors_q, 16, 0)  \
  X(std::uint16_t, char_errors_q, 16, 0) \
  X(std::uint16_t, messages_q, 16, 0)

#define TC_UART_FRAME_ARRAYS(X) X(std::uint16_t, words_q, 16, 16)

struct UartFrameIn {
  bool valid;  // the receiver's character
  std::uint8_t data;
  bool error;
  bool gap;
  bool give_up;
  std::uint8_t address;
  bool busy;  // an answer is being sent
  bool cmd_done;
};

struct UartFrame {
  TC_UART_FRAME_FLOPS(TC_DECLARE_FLOP)
  TC_UART_FRAME_ARRAYS(TC_DECLARE_ARRAY)

  void step(const UartFrameIn& in);

  bool open() const { return count_q != 0; }
  // The frame ends in the next clock: a sound one with the gap, any other when it is given up.
  bool judges(const UartFrameIn& in) const { return open() && (good() ? in.gap : in.give_up); }

 private:
  bool bad() const;
  bool good() const;
  void add_byte(const UartFrameIn& in);
  void store(std::uint8_t data);
  void judge();
};

}  // namespace meltstage::chip
