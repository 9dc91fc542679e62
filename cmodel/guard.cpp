// SPDX-License-Identifier: Apache-2.0
#include "guard.hpp"

#include <bit>
#include <cstdlib>

#include "algor.hpp"
#include "math.hpp"

namespace meltstage::chip {

namespace {

// 1/320 degC on both sides of a comparison: 5 x 1/64 degC, 32 x 0.1 degC.
constexpr std::int32_t of_temp(std::int32_t x) { return x * 5; }
constexpr std::int32_t of_tenths(std::int32_t x) { return x * 32; }

constexpr std::uint8_t kRateTenths = 10;  // DTDT_MAX is a change within 1 s
// So far above ambient a head without heat must cool; 1/320 degC.
constexpr std::int32_t kHotAbove = 20 * 320;

bool above_rate(const Params& p, std::int32_t change) {
  return std::abs(of_temp(change)) > of_tenths(p[spec::kRegDtdtMax]);
}

// Count of 0.1 s that stops at its top.
std::uint16_t count_up(std::uint16_t x, bool tick) {
  return tick && x != 0xFFFF ? static_cast<std::uint16_t>(x + 1) : x;
}

std::uint32_t fb_trip_clocks(const Params& p) { return std::uint32_t{p[spec::kRegFbTime]} << 4; }

std::uint8_t first_of(std::uint16_t causes) {
  return causes == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(std::countr_zero(causes) + 1);
}

constexpr std::uint16_t bit(spec::Fault fault, bool present) {
  return static_cast<std::uint16_t>(static_cast<unsigned>(present) << fault);
}

}  // namespace

bool Guard::sensor_ok(const Params& p) const {
  return pv_valid_q != 0 && !bad_limit(p) && (cause_q & bit(spec::kFaultSensorStale, true)) == 0;
}

std::uint16_t Guard::wd_left(const Params& p) const {
  const std::uint16_t limit = p[spec::kRegHostWd];
  return wd_q >= limit ? std::uint16_t{0} : static_cast<std::uint16_t>(limit - wd_q);
}

// Without a branch a flop.
bool operator==(const Guard& a, const Guard& b) {
  unsigned difference = 0;
#define TC_COMPARE_FLOP(type, name, width, reset) difference |= static_cast<unsigned>(a.name ^ b.name);
  TC_GUARD_FLOPS(TC_COMPARE_FLOP)
#undef TC_COMPARE_FLOP
  return difference == 0;
}

// Whether anything but the two fast counters moves is asked of step() itself.
std::uint64_t Guard::quiet(const GuardIn& in, const Sync::Seen& feedback) const {
  if (in.tenth || in.sens_done) return 0;
  const std::uint32_t trip = fb_trip_clocks(in.params);
  Guard next = *this;
  next.step(in);
  next.safe_cnt_q = safe_cnt_q;
  next.safe_en_q = safe_en_q;
  if (fb_q < trip) next.fb_q = fb_q;
  if (next != *this) return 0;

  const bool heater = heater_q != 0;
  if (fb_q >= trip)
    return feedback.second != feedback.first ? 1 : feedback.later != feedback.first ? 2 : kForever;
  const std::uint32_t first = heater != feedback.first ? fb_q + 1 : 0;
  if (first >= trip) return 1;
  const std::uint32_t second = heater != feedback.second ? first + 1 : 0;
  if (second >= trip) return 2;
  return heater != feedback.later ? std::uint64_t{2} + trip - second : kForever;
}

void Guard::skip(const GuardIn& in, const Sync::Seen& feedback, std::uint64_t clocks) {
  if (run_q != 0) {
    const std::uint64_t sum = safe_cnt_q + clocks;
    safe_en_q ^= static_cast<std::uint8_t>(sum / kSafeEnClocks & 1);
    safe_cnt_q = static_cast<std::uint16_t>(sum % kSafeEnClocks);
  } else {
    safe_cnt_q = 0;
    safe_en_q = 0;
  }
  if (fb_q >= fb_trip_clocks(in.params)) return;
  const bool heater = heater_q != 0;
  fb_q = heater != feedback.first ? fb_q + 1 : 0;
  if (clocks > 1) fb_q = heater != feedback.second ? fb_q + 1 : 0;
  if (clocks > 2) fb_q = heater != feedback.later ? fb_q + static_cast<std::uint32_t>(clocks - 2) : 0;
}

void Guard::step(const GuardIn& in) {
  const Params& p = in.params;
  const std::int32_t change = in.sens_pv - pv_q;
  // No head moves by DTDT_MAX in a second, or by half of that between two samples (and from the second's
  // reference, so that the way back from a single wrong sample is no jump): such a frame is refused as a bad
  // one. The one that makes BAD_MAX refused in a row is taken as it is, with the Rate cause: the jump stays,
  // so it is no noise. A sensor's first words after power-up may be anything: nothing is a jump until two
  // samples have agreed.
  const std::int32_t drift = in.sens_pv - rate_ref_q;
  const bool far = p[spec::kRegDtdtMax] != 0 &&
                   (above_rate(p, drift) || (above_rate(p, 2 * change) && above_rate(p, 2 * drift)));
  const bool jump = settled_q != 0 && far;
  const bool jump_stays = jump && bad_q + 1 >= (p[spec::kRegBadMax] & 0xF);
  const bool accept = in.sens_done && in.sens_ok && (!jump || jump_stays);
  const bool refuse = in.sens_done && !accept;
  const bool heating = run_q != 0 && !p.bit(spec::kRegMode, spec::kModeManual);
  const std::int32_t over_sp = of_temp(pv_q - in.sp_work);
  const std::int32_t window = of_tenths(p[spec::kRegAtWindow]);
  const bool in_window = std::abs(over_sp) <= window;
  const bool lba_rose = of_temp(pv_q - lba_ref_q) >= of_tenths(p[spec::kRegLbaRise]);
  const bool hold_rose = of_temp(pv_q - hold_ref_q) >= of_tenths(p[spec::kRegLbaRise]);
  const bool off_duty = in.duty == 0 || run_q == 0;
  const bool fb_trip = fb_q >= fb_trip_clocks(p);
  const bool lba_active = heating && in.limited && p[spec::kRegLbaTime] != 0;
  const bool hold_active = heating && in.segment == spec::kSegPid && p[spec::kRegKff] != 0 &&
                           p[spec::kRegHoldTime] != 0 && in.duty > in.hold_limit;
  const bool exc_active = heating && exc_armed_q != 0 && over_sp > of_tenths(p[spec::kRegExcLimit]);
  const bool zero_due = off_duty && zero_q >= p[spec::kRegZeroWait];
  const bool frozen_active = run_q != 0 && in.duty == 0 && p[spec::kRegLbaTime] != 0 &&
                             of_temp(pv_q) > of_tenths(p.s16(spec::kRegTAmb)) + kHotAbove;
  const bool rails_differ = run_q == run_nq;
  const bool upset = (watch_still_q & (watch_parity_q ^ in.watch_parity)) != 0;
  const bool zero_rose = of_temp(pv_q - zero_ref_q) >= of_tenths(p[spec::kRegZeroRise]);

  // Over-temperature acts on the sample itself, unfiltered.
  constexpr std::uint16_t kLimits = bit(spec::kFaultOverTemp, true) | bit(spec::kFaultUnderTemp, true);
  std::uint16_t cause = cause_q & kLimits;
  if (accept) {
    cause = bit(spec::kFaultOverTemp, of_temp(in.sens_pv) >= of_tenths(p.s16(spec::kRegTMax))) |
            bit(spec::kFaultUnderTemp, of_temp(in.sens_pv) < of_tenths(p.s16(spec::kRegTMin)));
  }
  const bool bad = bad_limit(p);
  cause = static_cast<std::uint16_t>(
      cause | bit(spec::kFaultSensorFault, bad && bad_dev_q != 0) |
      bit(spec::kFaultSensorFrame, bad && bad_dev_q == 0) |
      bit(spec::kFaultSensorStale,
          stale_q >= p[spec::kRegSampleTimeout] || (frozen_active && frozen_q >= p[spec::kRegLbaTime])) |
      bit(spec::kFaultRate, rate_q != 0) | bit(spec::kFaultNotHeating, lba_trip_q != 0) |
      bit(spec::kFaultHoldPower, hold_active && hold_q >= p[spec::kRegHoldTime]) |
      bit(spec::kFaultExcursion, exc_active && exc_q >= p[spec::kRegExcTime]) |
      bit(spec::kFaultZeroRise, zero_due && p[spec::kRegZeroRise] != 0 && zero_rose) |
      bit(spec::kFaultHeaterFb, p.bit(spec::kRegCtrl, spec::kCtrlFbEn) && fb_trip) |
      bit(spec::kFaultHostWatchdog, wd_armed(p) && wd_left(p) == 0) | bit(spec::kFaultParam, in.mem_bad) |
      bit(spec::kFaultState, in.state_illegal || in.overrun || rails_differ || upset) |
      bit(spec::kFaultInhibit, in.inhibit));

  const std::uint16_t latching =
      cause_q & static_cast<std::uint16_t>(run_q != 0 ? 0xFFFF : ~spec::kFaultRunOnly);
  const bool stop = in.stop || latching != 0 || fault_q != 0 || rails_differ;
  const bool running = run_q != 0;

  // Detectors, from the flops before this clock.
  lba_trip_q = lba_active && !lba_rose && lba_q >= p[spec::kRegLbaTime];
  lba_q = lba_active && !lba_rose ? count_up(lba_q, in.tenth) : 0;
  // From the lowest: a head that was cooling falls on for a while.
  if (!lba_active || lba_rose || pv_q < lba_ref_q) lba_ref_q = pv_q;
  if (!hold_active || hold_rose) {
    hold_q = 0;
    hold_ref_q = pv_q;
  } else {
    hold_q = count_up(hold_q, in.tenth);
  }
  if (!heating || in.sp_work < sp_past_q) {
    exc_armed_q = 0;
  } else if (over_sp <= window) {
    exc_armed_q = 1;
  }
  sp_past_q = in.sp_work;
  exc_q = exc_active ? count_up(exc_q, in.tenth) : 0;
  if (!off_duty) {
    zero_q = 0;
  } else if (!zero_due) {
    zero_q = count_up(zero_q, in.tenth);
  }
  if (accept && pv_valid_q == 0) {
    zero_ref_q = in.sens_pv;  // the first sample is no rise
  } else if (!zero_due || pv_q < zero_ref_q) {
    zero_ref_q = pv_q;
  }
  // Frozen: a hot head without heat cools, so its samples move.
  frozen_q = frozen_active && !(accept && change != 0) ? count_up(frozen_q, in.tenth) : 0;
  if ((heater_q != 0) == in.heater_fb) {
    fb_q = 0;
  } else if (!fb_trip) {
    fb_q = (fb_q + 1) & 0xFFFFF;
  }
  // Time since the last frame, so that a changed HOST_WD is in force at once.
  wd_q = !running || in.good_frame ? 0 : count_up(wd_q, in.tenth);
  const bool at = heating && pv_valid_q != 0 && !in.ramping && in_window;
  at_temp_q = at && at_q >= p[spec::kRegAtDwell];
  at_q = at ? count_up(at_q, in.tenth) : 0;

  // Heater permission: a fault, a stop or the emergency stop beats everything.
  const bool start = in.run && run_allowed();
  heater_q = in.pwm && running && !stop && !in.inhibit;
  if (running && !stop) {
    if (safe_cnt_q == 0x3FF) safe_en_q ^= 1;
    safe_cnt_q = (safe_cnt_q + 1) & 0x3FF;
  } else {
    safe_cnt_q = 0;
    safe_en_q = 0;
  }
  run_q = !stop && (running || start);
  run_nq = run_q ^ 1;
  if (in.clear || fault_q == 0) first_q = first_of(latching);
  fault_q = (in.clear ? 0 : fault_q) | latching;
  cause_q = cause;
  watch_parity_q = in.watch_parity;
  watch_still_q = in.watch_still;

  // Samples.
  if (accept && (settled_q == 0 || jump || rate_cnt_q >= kRateTenths)) {
    rate_ref_q =
        settled_q != 0 && !jump ? pv_q : in.sens_pv;  // not the present sample, which may be a wrong one
    rate_cnt_q = 0;
  } else if (in.tenth && rate_cnt_q < kRateTenths) {
    ++rate_cnt_q;
  }
  if (accept) {
    rate_q = jump;
    slope_q = pv_valid_q != 0 ? sat_s16(change) : std::int16_t{0};
    if (pv_valid_q != 0 && !far) settled_q = 1;
    pv_valid_q = 1;
    pv_q = in.sens_pv;
    ++samples_q;
    bad_q = 0;
    stale_q = 0;
  } else {
    stale_q = count_up(stale_q, in.tenth);
  }
  if (refuse) {
    ++sensor_errors_q;
    bad_dev_q = in.sens_dev_fault;
    if (bad_q != 0xF) ++bad_q;
  }
}

}  // namespace meltstage::chip
