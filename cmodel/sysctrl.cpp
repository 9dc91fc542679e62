// SPDX-License-Identifier: Apache-2.0
#include "sysctrl.hpp"

namespace meltstage::chip {

namespace {
constexpr std::uint16_t kMsLast = spec::kClkHz / 1000 - 1;

std::uint8_t next_state(const Sysctrl& s, const SysctrlIn& in) {
  // cmd_valid falls one clock after cmd_done_q: the command just carried out must not start again.
  const bool new_cmd = in.cmd_valid && s.cmd_done_q == 0;
  switch (s.state_q) {
    case spec::kStIdle:
      return new_cmd ? spec::kStCmdDecode : spec::kStIdle;
    case spec::kStCmdDecode:
      return !in.decoded ? spec::kStCmdDecode : in.writes ? spec::kStExtrParam : spec::kStCmdReady;
    case spec::kStExtrParam:
      return spec::kStWrParam;
    case spec::kStWrParam:
      return in.last ? spec::kStCmdReady : spec::kStExtrParam;
    case spec::kStCmdReady:
    case spec::kStCfgPwm:
      return new_cmd              ? std::uint8_t{spec::kStCmdDecode}
             : s.tick_pend_q != 0 ? std::uint8_t{spec::kStReadTemp}
                                  : s.state_q;
    case spec::kStReadTemp:
      return in.sens_done ? spec::kStTempDisplay : spec::kStReadTemp;
    case spec::kStTempDisplay:
      return spec::kStInitAlgor;
    case spec::kStInitAlgor:
      return in.algor_done ? spec::kStCfgPwm : spec::kStInitAlgor;
    default:
      return spec::kStIdle;
  }
}
}  // namespace

void Sysctrl::step(const SysctrlIn& in) {
  const std::uint8_t state_d = next_state(*this, in);
  const bool to_read = state_d == spec::kStReadTemp && state_q != spec::kStReadTemp;
  const bool to_ready = state_d == spec::kStCmdReady && state_q != spec::kStCmdReady;
  const bool ts_wrap = ms_q != 0 && ts_cnt_q + 1 >= in.ts;
  const bool on_display = display();

  // Telemetry.
  tlm_start_q = on_display && tlm_due_q != 0;
  if (in.tlm_period == 0) {
    tlm_cnt_q = 0;
    tlm_due_q = 0;
  } else {
    if (on_display) tlm_due_q = 0;
    if (tenth_q != 0) {
      const bool wrap = tlm_cnt_q + 1 >= in.tlm_period;
      tlm_cnt_q = wrap ? 0 : static_cast<std::uint16_t>(tlm_cnt_q + 1);
      if (wrap) tlm_due_q = 1;
    }
  }

  // Control tick. Before the first command nothing is due, so nothing can be late.
  overrun_q = ts_wrap && tick_pend_q != 0;
  if (ms_q != 0) ts_cnt_q = ts_wrap ? 0 : (ts_cnt_q + 1) & 0x7FF;
  if (state_q == spec::kStIdle) {
    tick_pend_q = 0;
  } else if (ts_wrap) {
    tick_pend_q = 1;
  } else if (to_read) {
    tick_pend_q = 0;
  }

  // Hand-overs.
  pwm_load_q = state_q == spec::kStInitAlgor && in.algor_done;
  algor_start_q = on_display;
  sens_start_q = tick_q;
  commit_q = to_read && in.pending;
  tick_q = to_read;
  cmd_done_q = to_ready;
  state_q = state_d;

  // Time base.
  tenth_q = ms_q != 0 && tenth_cnt_q == 99;
  if (ms_q != 0) tenth_cnt_q = tenth_cnt_q == 99 ? 0 : (tenth_cnt_q + 1) & 0x7F;
  ms_q = ms_cnt_q == kMsLast;
  ms_cnt_q = ms_cnt_q == kMsLast ? 0 : (ms_cnt_q + 1) & 0x3FFF;
}

}  // namespace meltstage::chip
