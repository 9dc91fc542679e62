// SPDX-License-Identifier: Apache-2.0
// UARTC: serial port of the host, Modbus RTU framing and answers, telemetry. Model of rtl/tc_uartc.sv.
#pragma once

#include <cstdint>

#include "flops.hpp"
#include "spec.hpp"
#include "uart_frame.hpp"
#include "uart_rx.hpp"
#include "uart_tx.hpp"

namespace meltstage::chip {

#define TC_UARTC_FLOPS(X)                                                                         \
  X(std::uint16_t, baud_q, 13, static_cast<std::uint16_t>(spec::kHolding[spec::kRegBaud].reset))  \
  X(std::uint8_t, format_q, 2, static_cast<std::uint8_t>(spec::kHolding[spec::kRegFormat].reset)) \
  X(std::uint8_t, pause_q, 1, 0)                                                                  \
  X(std::uint8_t, address_q, 8, 1)                                                                \
  X(std::uint8_t, rsp_active_q, 1, 0)                                                             \
  X(std::uint8_t, rsp_kind_q, 3, 0)                                                               \
  X(std::uint8_t, rsp_exc_q, 8, 0)                                                                \
  X(std::uint8_t, rsp_place_q, 8, 0)                                                              \
  X(std::uint8_t, rsp_object_q, 2, 0)                                                             \
  X(std::uint8_t, rsp_have_q, 1, 0)                                                               \
  X(std::uint16_t, rsp_word_q, 16, 0)                                                             \
  X(std::uint8_t, tlm_active_q, 1, 0)                                                             \
  X(std::uint8_t, tlm_place_q, 6, 0)                                                              \
  X(std::uint8_t, tlm_have_q, 1, 0)                                                               \
  X(std::uint16_t, tlm_word_q, 16, 0)                                                             \
  X(std::uint16_t, rd_addr_q, 16, 0)                                                              \
  X(std::uint8_t, rd_rsp_q, 1, 0)                                                                 \
  X(std::uint8_t, rd_tlm_q, 1, 0)

struct UartcIn {
  std::uint8_t rx = 1;  // synchronised
  std::uint8_t cfg_address = 0;
  std::uint8_t strap = 0;
  std::uint16_t cfg_baud = 0;  // 100 Bd
  std::uint8_t cfg_format = 0;
  bool cfg_pause = false;  // the host may pause inside a frame
  bool cmd_done = false;
  std::uint8_t rsp_kind = spec::kRspNone;
  std::uint8_t rsp_exc = 0;   // exception code; with spec::kRspServerId the run indicator, 0xFF on, 0 off
  std::uint16_t rd_data = 0;  // register at rd_addr(); looked at only while reads()
  bool rd_wait = false;       // the word for the answer is not there in this clock
  bool tlm_start = false;
};

struct Uartc {
  TC_UARTC_FLOPS(TC_DECLARE_FLOP)
  UartRx rx;
  UartFrame frame;
  UartTx tx;
  UartTx tlm;

  // One rising clock edge, not in reset.
  void step(const UartcIn& in);
  std::uint64_t quiet(const UartcIn& in) const;
  void skip(const UartcIn& in, std::uint64_t clocks);

  bool tx_o() const { return tx.tx(); }
  bool de() const { return tx.busy(); }
  bool tlm_tx() const { return tlm.tx(); }
  bool cmd_valid() const { return frame.cmd_valid_q != 0; }
  bool cmd_broadcast() const { return frame.broadcast_q != 0; }
  std::uint8_t cmd_fc() const { return frame.fc_q; }
  std::uint16_t cmd_a() const { return frame.a_q; }
  std::uint16_t cmd_b() const { return frame.b_q; }
  std::uint8_t cmd_count() const { return frame.bytes_q; }
  std::uint16_t cmd_len() const { return frame.len_q; }
  std::uint16_t cmd_word(unsigned index) const { return frame.words_q[index & 15u]; }
  bool stop() const { return frame.stop_q != 0; }
  bool good() const { return frame.good_q != 0; }
  bool rsp_busy() const { return (rsp_active_q | tx.busy_q) != 0; }
  bool tlm_busy() const { return (tlm_active_q | tlm.busy_q) != 0; }
  std::uint16_t rd_addr() const { return rd_addr_q; }
  bool reads() const { return (rd_rsp_q | rd_tlm_q) != 0; }
  std::uint16_t crc_errors() const { return frame.crc_errors_q; }
  std::uint16_t char_errors() const { return frame.char_errors_q; }
  std::uint16_t messages() const { return frame.messages_q; }

 private:
  bool idle() const {
    return rx.idle() &&
           (frame.count_q | frame.cmd_valid_q | rsp_active_q | tx.busy_q | tlm_active_q | tlm.busy_q) == 0;
  }
  bool pulses() const {
    return (frame.stop_q | frame.good_q | rx.valid_q | tx.take_q | tlm.take_q | rd_rsp_q | rd_tlm_q) != 0;
  }
  void take_over(const UartcIn& in);
  bool taken_over(const UartcIn& in) const;
  UartFrameIn heard(const UartcIn& in) const;
  bool rsp_reading() const;
  bool rsp_object_end() const;
  bool rsp_last() const;
  std::uint8_t rsp_byte() const;
  bool tlm_reading() const;
  bool tlm_last() const;
  std::uint8_t tlm_byte() const;
  void step_answer(const UartcIn& in);
  void step_telemetry(const UartcIn& in);
};

}  // namespace meltstage::chip
