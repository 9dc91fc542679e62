// SPDX-License-Identifier: Apache-2.0
// SYSCTRL: main state machine (Xie et al. 2023, fig. 5) and time base. Twin of rtl/tc_sysctrl.sv.
#pragma once

#include <array>
#include <cstdint>

#include "flops.hpp"
#include "spec.hpp"

namespace meltstage::chip {

#define TC_SYSCTRL_FLOPS(X)                  \
  X(std::uint8_t, state_q, 5, spec::kStIdle) \
  X(std::uint8_t, served_q, 3, 7)            \
  X(std::uint16_t, ms_cnt_q, 14, 0)          \
  X(std::uint8_t, ms_q, 1, 0)                \
  X(std::uint8_t, tenth_cnt_q, 7, 0)         \
  X(std::uint8_t, tenth_q, 1, 0)             \
  X(std::uint16_t, ts_cnt_q, 11, 0)          \
  X(std::uint8_t, tick_pend_q, 1, 0)         \
  X(std::uint8_t, overrun_q, 1, 0)           \
  X(std::uint16_t, tlm_cnt_q, 16, 0)         \
  X(std::uint8_t, tlm_due_q, 1, 0)           \
  X(std::uint8_t, cmd_done_q, 1, 0)          \
  X(std::uint8_t, commit_q, 1, 0)            \
  X(std::uint8_t, tick_q, 1, 0)              \
  X(std::uint8_t, sens_start_q, 1, 0)        \
  X(std::uint8_t, tlm_start_q, 1, 0)         \
  X(std::uint8_t, algor_start_q, 1, 0)       \
  X(std::uint8_t, pwm_load_q, 1, 0)

struct SysctrlIn {
  bool test_mode = false;    // short times, for tests
  std::uint16_t ts;          // ms
  std::uint16_t tlm_period;  // 0.1 s, 0 = off
  bool cmd_valid;
  bool decoded;
  bool writes;
  bool last;
  bool pending;
  bool discarding = false;  // MEM takes no write
  bool sens_done;
  bool algor_done;
};

struct Sysctrl {
  TC_SYSCTRL_FLOPS(TC_DECLARE_FLOP)

  void step(const SysctrlIn& in);
  std::uint64_t quiet(const SysctrlIn& in) const;
  void skip(const SysctrlIn& in, std::uint64_t clocks);
  // Clocks before the one that sees the next millisecond.
  std::uint64_t clocks_to_ms(const SysctrlIn& in) const;

  bool decode() const { return state_q == spec::kStCmdDecode; }
  bool extract() const { return state_q == spec::kStExtrParam; }
  bool write() const { return state_q == spec::kStWrParam; }
  bool display() const { return state_q == spec::kStTempDisplay; }
  bool illegal() const { return !spec::state_legal(state_q); }
};

}  // namespace meltstage::chip
