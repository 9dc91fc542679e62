// SPDX-License-Identifier: Apache-2.0
#include "sysctrl.hpp"

namespace meltstage::chip {

namespace {
constexpr std::uint16_t kMsClocks = spec::kClkHz / 1000;
constexpr std::uint16_t kTestMsClocks = kMsClocks / spec::kTestSpeedup;
constexpr std::uint8_t kTenthLast = 99;
// Parts of a tick's work, as served_q collects them.
constexpr std::uint8_t kSampled = 1, kShown = 2, kComputed = 4, kServed = 7;

// Clocks of a millisecond. In test mode it is shorter, and each ends a tenth of a second.
std::uint16_t ms_clocks(const SysctrlIn& in) { return in.test_mode ? kTestMsClocks : kMsClocks; }
bool tenth_last(const Sysctrl& s, const SysctrlIn& in) { return s.tenth_cnt_q == kTenthLast || in.test_mode; }

std::uint8_t next_state(const Sysctrl& s, const SysctrlIn& in) {
  // cmd_valid falls one clock after cmd_done_q: the command just carried out must not start again.
  const bool new_cmd = in.cmd_valid && s.cmd_done_q == 0;
  switch (s.state_q) {
    case spec::kStIdle:
      return new_cmd ? spec::kStCmdDecode : spec::kStIdle;
    case spec::kStCmdDecode:
      return !in.decoded ? spec::kStCmdDecode : in.writes ? spec::kStExtrParam : spec::kStCmdReady;
    case spec::kStExtrParam:
      return in.discarding ? spec::kStExtrParam : spec::kStWrParam;
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

  // Control tick. Before the first command nothing is due, so nothing can be late. All its work must be done
  // when the next tick comes, and in order.
  const bool sampled = state_q == spec::kStReadTemp && in.sens_done;
  const bool computed = state_q == spec::kStInitAlgor && in.algor_done;
  const bool disordered = (sampled && served_q != 0) || (on_display && served_q != kSampled) ||
                          (computed && served_q != (kSampled | kShown));
  overrun_q = (ts_wrap && (tick_pend_q != 0 || served_q != kServed)) || disordered;
  if (state_q == spec::kStIdle) {
    served_q = kServed;
  } else if (to_read) {
    served_q = 0;
  } else {
    served_q |= (sampled ? kSampled : 0) | (on_display ? kShown : 0) | (computed ? kComputed : 0);
  }
  if (ms_q != 0) ts_cnt_q = ts_wrap ? 0 : (ts_cnt_q + 1) & 0x7FF;
  if (state_q == spec::kStIdle) {
    tick_pend_q = 0;
  } else if (ts_wrap) {
    tick_pend_q = 1;
  } else if (to_read) {
    tick_pend_q = 0;
  }

  // Hand-overs.
  pwm_load_q = computed;
  algor_start_q = on_display;
  sens_start_q = tick_q;
  commit_q = to_read && in.pending;
  tick_q = to_read;
  cmd_done_q = to_ready;
  state_q = state_d;

  // Time base.
  const bool last = tenth_last(*this, in);
  tenth_q = ms_q != 0 && last;
  if (ms_q != 0) tenth_cnt_q = last ? 0 : (tenth_cnt_q + 1) & 0x7F;
  ms_q = ms_cnt_q == ms_clocks(in) - 1;
  ms_cnt_q = ms_q != 0 ? 0 : (ms_cnt_q + 1) & 0x3FFF;
}

std::uint64_t Sysctrl::clocks_to_ms(const SysctrlIn& in) const {
  return ms_q != 0 ? 0 : ms_clocks(in) - ms_cnt_q;
}

std::uint64_t Sysctrl::quiet(const SysctrlIn& in) const {
  const bool pulses = (tenth_q | overrun_q | cmd_done_q | commit_q | tick_q | sens_start_q | tlm_start_q |
                       algor_start_q | pwm_load_q) != 0;
  const bool settles = (state_q == spec::kStIdle && (tick_pend_q != 0 || served_q != kServed)) ||
                       (in.tlm_period == 0 && (tlm_cnt_q | tlm_due_q) != 0);
  if (pulses || settles || ms_cnt_q >= ms_clocks(in) || next_state(*this, in) != state_q) return 0;
  // Milliseconds that only count: the next one is a control tick or ends a tenth of a second.
  const int until_tick = in.ts - 1 - ts_cnt_q;
  const int until_tenth = in.test_mode ? 0 : kTenthLast - tenth_cnt_q;
  const int harmless = until_tick < until_tenth ? until_tick : until_tenth;
  return harmless <= 0 ? clocks_to_ms(in)
                       : static_cast<std::uint64_t>(harmless - (ms_q != 0 ? 1 : 0)) * ms_clocks(in) +
                             (ms_clocks(in) - ms_cnt_q);
}

void Sysctrl::skip(const SysctrlIn& in, std::uint64_t clocks) {
  const std::uint64_t sum = ms_cnt_q + clocks;
  const std::uint64_t begun = sum / ms_clocks(in);
  ms_cnt_q = static_cast<std::uint16_t>(sum % ms_clocks(in));
  const std::uint8_t seen_next = ms_cnt_q == 0 ? 1 : 0;  // clocks > 0: the last one has ended a millisecond
  const auto seen = static_cast<std::uint16_t>(begun + ms_q - seen_next);
  ms_q = seen_next;
  ts_cnt_q = (ts_cnt_q + seen) & 0x7FF;
  tenth_cnt_q = static_cast<std::uint8_t>(tenth_cnt_q + seen);
}

}  // namespace meltstage::chip
