// SPDX-License-Identifier: Apache-2.0
// PARAMC: judges a command, hands parameters to MEM, answers register reads. Twin of rtl/tc_paramc.sv.
#pragma once

#include <array>
#include <cstdint>

#include "flops.hpp"
#include "spec.hpp"
#include "uart_line.hpp"

namespace meltstage::chip {

#define TC_PARAMC_FLOPS(X)                \
  X(std::uint8_t, decoded_q, 1, 0)        \
  X(std::uint8_t, writes_q, 1, 0)         \
  X(std::uint8_t, checking_q, 1, 0)       \
  X(std::uint8_t, last_q, 1, 0)           \
  X(std::uint8_t, rsp_kind_q, 3, 0)       \
  X(std::uint8_t, rsp_exc_q, 8, 0)        \
  X(std::uint8_t, word_q, 4, 0)           \
  X(std::uint8_t, index_q, 6, 0)          \
  X(std::uint16_t, value_q, 16, 0)        \
  X(std::uint8_t, staged_q, 1, 0)         \
  X(std::uint8_t, hold_q, 1, 0)           \
  X(std::uint8_t, ordered_q, 1, 0)        \
  X(std::uint8_t, run_q, 1, 0)            \
  X(std::uint8_t, stop_q, 1, 0)           \
  X(std::uint8_t, clear_q, 1, 0)          \
  X(std::uint8_t, discard_q, 1, 0)        \
  X(std::uint8_t, tune_q, 1, 0)           \
  X(std::uint8_t, snap_valid_q, 1, 0)     \
  X(std::int16_t, snap_pv_q, 16, 0)       \
  X(std::int16_t, snap_slope_q, 16, 0)    \
  X(std::int16_t, snap_sp_q, 16, 0)       \
  X(std::uint16_t, snap_samples_q, 16, 0) \
  X(std::uint32_t, snap_duty_q, 17, 0)    \
  X(std::int32_t, snap_p_q, 18, 0)        \
  X(std::int32_t, snap_i_q, 18, 0)        \
  X(std::int32_t, snap_d_q, 18, 0)        \
  X(std::uint32_t, snap_raw_q, 32, 0)

// A received command as UARTC holds it.
struct Command {
  bool broadcast;
  std::uint8_t fc;
  std::uint16_t a;     // bytes 2, 3
  std::uint16_t b;     // bytes 4, 5
  std::uint8_t count;  // byte 6
  std::uint16_t len;   // bytes of the frame
};

// What the input registers show; the snapshot takes the first part.
struct Readings {
  bool pv_valid;
  std::int16_t pv;       // Q9.6 degC, as the next two
  std::int16_t slope;    // of the last two samples
  std::int16_t sp_work;  // working set-point
  std::uint32_t duty;    // UQ1.16
  std::int32_t term_p;   // Q1.16, as the next two
  std::int32_t term_i;
  std::int32_t term_d;
  std::uint32_t raw;      // the sensor's frame
  std::uint16_t samples;  // accepted; wraps

  std::uint16_t status;
  std::uint16_t fault;
  std::uint16_t cause;
  std::uint8_t first_fault;
  std::uint8_t state;
  std::uint16_t wd_left;  // 0.1 s
  std::uint16_t crc_errors;
  std::uint16_t char_errors;
  std::uint16_t messages;
  std::uint16_t sensor_errors;
  std::uint16_t mem_corrected;
  std::uint16_t overshoot;   // 1/64 degC
  std::uint16_t band_time;   // 0.1 s
  std::uint16_t band_error;  // 1/64 degC
  std::uint16_t peak;        // signed, Q9.6 degC
  std::uint32_t on_time;     // of the heater, 0.1 s
  std::uint16_t tune_state;
  std::uint16_t tune_ku;
  std::uint16_t tune_tu;
  std::uint32_t tune_hold;
};

struct ParamcIn {
  bool decode;
  bool extract;
  bool write;
  bool commit;
  bool display;
  Command cmd;
  std::uint16_t cmd_word;  // word word_q of a write
  bool discarding;         // MEM takes no write: ExtrParam waits
  std::uint16_t t_max_staged;
  std::uint16_t lock;
  bool running;
  bool manual;
  bool tuning;
  bool tune_wr;
  bool run_allowed;
  bool cause_present;
  bool rd_busy;
};

struct Paramc {
  TC_PARAMC_FLOPS(TC_DECLARE_FLOP)

  // These pulses count only with their command still in hand: an upset of one flop is no command.
  bool run() const { return run_q != 0 && index_q == spec::kRegCmd && value_q == spec::kCmdRun; }
  bool tune() const { return tune_q != 0 && index_q == spec::kRegCmd && value_q == spec::kCmdTune; }

  // True when a step can change nothing but the command pulses: no command in work, no display, no commit.
  bool idle(const ParamcIn& in) const {
    return !in.decode && !in.extract && !in.write && !in.commit && !in.display && !in.tune_wr &&
           decoded_q == 0 && checking_q == 0 && (run_q | stop_q | clear_q | discard_q | tune_q) == 0;
  }
  void step(const ParamcIn& in, const Readings& readings);

  bool pending() const { return staged_q != 0 && (hold_q | discard_q) == 0; }
  bool store() const { return index_q != spec::kRegCmd; }
  // Value of a register as the host reads it; `mem` is MEM's staged word at address bits 5..0.
  std::uint16_t read(std::uint16_t address, const Readings& readings, std::uint16_t mem) const;
};

}  // namespace meltstage::chip
