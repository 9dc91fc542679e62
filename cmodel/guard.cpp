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

// Heat balance: what one step of its serial multiplication ends, and the largest differences. Its
// temperatures are duties that would hold them, in 2^-16 / 5.
constexpr std::uint8_t kHeatNeed = 17;  // KFF (16 bits) times the temperature
constexpr std::uint8_t kHeatMove = 27;  // HEAT_RATE (9 bits) times the duty that is left to heat
constexpr std::int64_t kHeatFraction = 12;
constexpr std::int64_t kHeatLow = 5 * 65536 / 16;
// A supply that is higher than in commissioning heats faster.
constexpr std::int64_t kHeatHigh = 5 * 65536 * 3 / 32;

constexpr std::int64_t sign_extended(std::int64_t x, unsigned width) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(x) << (64 - width)) >> (64 - width);
}

bool above_rate(const Params& p, std::int32_t change) {
  return std::abs(of_temp(change)) > of_tenths(p[spec::kRegDtdtMax]);
}

// Count of 0.1 s that stops at its top.
std::uint16_t count_up(std::uint16_t x, bool tick) {
  return tick && x != 0xFFFF ? static_cast<std::uint16_t>(x + 1) : x;
}

// A time, doubled as far as it goes.
std::uint16_t twice(std::uint16_t x) { return static_cast<std::uint16_t>(std::min(2 * x, 0xFFFF)); }

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

// Whether anything but the two fast counters and the heat balance's products moves is asked of step() itself.
std::uint64_t Guard::quiet(const GuardIn& in, const Sync::Seen& feedback) const {
  if (in.tenth || in.sens_done) return 0;
  const std::uint32_t trip = fb_trip_clocks(in.params);
  Guard next = *this;
  next.step(in);
  next.safe_cnt_q = safe_cnt_q;
  next.safe_en_q = safe_en_q;
  if (fb_q < trip) next.fb_q = fb_q;
  const std::uint64_t product = clocks_of_product();
  if (product > 0) {
    next.heat_step_q = heat_step_q;
    next.heat_acc_q = heat_acc_q;
  }
  if (next != *this) return 0;
  return std::min(product, clocks_to_feedback_event(feedback, trip));
}

// Clocks in which the heat balance does nothing but multiply.
std::uint64_t Guard::clocks_of_product() const {
  if (heat_step_q == 0) return kForever;
  return (heat_step_q <= kHeatNeed ? kHeatNeed : kHeatMove) - heat_step_q;
}

std::uint64_t Guard::clocks_to_feedback_event(const Sync::Seen& feedback, std::uint32_t trip) const {
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
  for (unsigned i = 0; i < kHeatMove && i < clocks && heat_step_q != 0; ++i) step_heat_balance(in);
  if (fb_q >= fb_trip_clocks(in.params)) return;
  const bool heater = heater_q != 0;
  fb_q = heater != feedback.first ? fb_q + 1 : 0;
  if (clocks > 1) fb_q = heater != feedback.second ? fb_q + 1 : 0;
  if (clocks > 2) fb_q = heater != feedback.later ? fb_q + static_cast<std::uint32_t>(clocks - 2) : 0;
}

// The phases of a clock, inline since each is called once, in every clock.

// A frame of the sensor in this clock.
struct Guard::Sample {
  std::int32_t change;  // against the last accepted sample, 1/64 degC
  bool far;             // further than a head can move
  bool jump;            // far, although samples had agreed before
  bool accept;
  bool refuse;
};

// What the detectors look at, as it stands before this clock.
struct Guard::Seen {
  bool heating;          // in automatic mode
  std::int32_t over_sp;  // temperature above the set-point, 1/320 degC
  std::int32_t window;   // AT_WINDOW, 1/320 degC
  bool off_duty;         // no heat is asked for
  bool loop_break;       // duty near its limit: the temperature must rise
  bool hold_on;          // HOLD_TIME above the hold power, or twice LBA_TIME in the test, counts
  bool hold_due;         // that time is over
  bool excursion;        // further above the set-point than allowed
  bool zero_due;         // no heat for long enough: the temperature must not rise
  bool frozen;           // a hot head without heat: its samples must move
  bool feedback_late;    // feedback has differed for FB_TIME
  bool rails_broken;     // run_q and its complement are equal
};

// No head moves by DTDT_MAX in a second, or by half of that between two samples (and from the second's
// reference, so that the way back from a single wrong sample is no jump): such a frame is refused as a bad
// one. The one that makes BAD_MAX refused in a row is taken as it is, with the Rate cause: the jump stays,
// so it is no noise. A sensor's first words after power-up may be anything: nothing is a jump until two
// samples have agreed.
inline Guard::Sample Guard::judge_sample(const GuardIn& in) const {
  const Params& p = in.params;
  const std::int32_t change = in.sens_pv - pv_q;
  const std::int32_t drift = in.sens_pv - rate_ref_q;
  const bool far = p[spec::kRegDtdtMax] != 0 &&
                   (above_rate(p, drift) || (above_rate(p, 2 * change) && above_rate(p, 2 * drift)));
  const bool jump = settled_q != 0 && far;
  const bool jump_stays = jump && bad_q + 1 >= (p[spec::kRegBadMax] & 0xF);
  const bool accept = in.sens_done && in.sens_ok && (!jump || jump_stays);
  return {.change = change, .far = far, .jump = jump, .accept = accept, .refuse = in.sens_done && !accept};
}

// Whether the time above the hold power goes on, or that of the test; self-tuning ends the test.
inline bool Guard::judges_hold(const GuardIn& in) const {
  const std::int32_t above = of_temp(mean_temp() - hold_ref_q);
  const std::int32_t move = of_tenths(in.params[spec::kRegLbaRise]);
  if (hold_test_q != 0) return in.segment != spec::kSegNone && -above < move;
  return duty_sum_q > in.hold_limit << 4 && duty_sum_q >> 16 >= hold_shown_q && above < move;
}

inline Guard::Seen Guard::look(const GuardIn& in) const {
  const Params& p = in.params;
  const bool heating = run_q != 0 && !p.bit(spec::kRegMode, spec::kModeManual);
  const std::int32_t over_sp = of_temp(pv_q - in.sp_work);
  const bool off_duty = in.duty == 0 || run_q == 0;
  const bool hold_on = heating && p[spec::kRegKff] != 0 && p[spec::kRegHoldTime] != 0 && judges_hold(in);
  return {.heating = heating,
          .over_sp = over_sp,
          .window = of_tenths(p[spec::kRegAtWindow]),
          .off_duty = off_duty,
          .loop_break = heating && in.limited && p[spec::kRegLbaTime] != 0,
          .hold_on = hold_on,
          .hold_due =
              hold_on && hold_q >= (hold_test_q != 0 ? twice(p[spec::kRegLbaTime]) : p[spec::kRegHoldTime]),
          .excursion = heating && exc_armed_q != 0 && over_sp > of_tenths(p[spec::kRegExcLimit]),
          .zero_due = off_duty && zero_q >= p[spec::kRegZeroWait],
          .frozen = run_q != 0 && in.duty == 0 && p[spec::kRegLbaTime] != 0 &&
                    of_temp(pv_q) > of_tenths(p.s16(spec::kRegTAmb)) + kHotAbove,
          .feedback_late = fb_q >= fb_trip_clocks(p),
          .rails_broken = run_q == run_nq};
}

inline std::uint16_t Guard::causes(const GuardIn& in, const Sample& sample, const Seen& seen) const {
  const Params& p = in.params;
  // The limits act on the sample itself, unfiltered.
  constexpr std::uint16_t kLimits = bit(spec::kFaultOverTemp, true) | bit(spec::kFaultUnderTemp, true);
  std::uint16_t limits = cause_q & kLimits;
  if (sample.accept) {
    limits = bit(spec::kFaultOverTemp, of_temp(in.sens_pv) >= of_tenths(p.s16(spec::kRegTMax))) |
             bit(spec::kFaultUnderTemp, of_temp(in.sens_pv) < of_tenths(p.s16(spec::kRegTMin)));
  }
  const bool bad = bad_limit(p);
  const bool zero_rose = of_temp(pv_q - zero_ref_q) >= of_tenths(p[spec::kRegZeroRise]);
  const bool upset = (watch_still_q & (watch_parity_q ^ in.watch_parity)) != 0;
  return static_cast<std::uint16_t>(
      limits | bit(spec::kFaultSensorFault, bad && bad_dev_q != 0) |
      bit(spec::kFaultSensorFrame, bad && bad_dev_q == 0) |
      bit(spec::kFaultSensorStale,
          stale_q >= p[spec::kRegSampleTimeout] || (seen.frozen && frozen_q >= p[spec::kRegLbaTime])) |
      bit(spec::kFaultRate, rate_q != 0) | bit(spec::kFaultNotHeating, lba_trip_q != 0 || heat_low_q != 0) |
      bit(spec::kFaultHoldPower, seen.hold_due && hold_test_q != 0) |
      bit(spec::kFaultExcursion, seen.excursion && exc_q >= p[spec::kRegExcTime]) |
      bit(spec::kFaultZeroRise,
          (seen.zero_due && p[spec::kRegZeroRise] != 0 && zero_rose) || heat_high_q != 0) |
      bit(spec::kFaultHeaterFb, p.bit(spec::kRegCtrl, spec::kCtrlFbEn) && seen.feedback_late) |
      bit(spec::kFaultHostWatchdog, wd_armed(p) && wd_left(p) == 0) | bit(spec::kFaultParam, in.mem_bad) |
      bit(spec::kFaultState, in.state_illegal || in.overrun || seen.rails_broken || upset) |
      bit(spec::kFaultInhibit, in.inhibit));
}

// NotHeating: the temperature must rise by LBA_RISE within LBA_TIME.
inline void Guard::step_loop_break(const GuardIn& in, const Seen& seen) {
  const Params& p = in.params;
  const std::int16_t mean = mean_temp();
  const bool rose = of_temp(mean - lba_ref_q) >= of_tenths(p[spec::kRegLbaRise]);
  lba_trip_q = seen.loop_break && !rose && lba_q >= p[spec::kRegLbaTime];
  lba_q = seen.loop_break && !rose ? count_up(lba_q, in.tenth) : 0;
  // From the lowest: a head that was cooling falls on for a while.
  if (!seen.loop_break || rose || mean < lba_ref_q) lba_ref_q = mean;
}

// HoldPower: more duty than holding needs, on average, and no rise to show for it. It may be a fan, a low
// supply, or a dead sensor: with less heat a live one falls by LBA_RISE, from its highest on.
// What it has shown so is not asked again.
inline void Guard::step_hold_power(const GuardIn& in, const Seen& seen) {
  const std::int16_t mean = mean_temp();
  const bool testing = hold_test_q != 0;
  const bool asks = seen.hold_due && !testing;
  // Noise may leave the segment for a tick.
  const bool counts = in.tenth && (testing || in.segment == spec::kSegPid);
  hold_q = seen.hold_on && !asks ? count_up(hold_q, counts) : 0;
  if (!seen.hold_on || asks || (mean < hold_ref_q) != testing) hold_ref_q = mean;
  hold_test_q = asks || (seen.hold_on && testing);
  if (!seen.heating || in.sp_work != sp_past_q) {
    hold_shown_q = 0;
  } else if (asks) {
    hold_shown_q = static_cast<std::uint8_t>(((duty_sum_q >> 16) + 1) & 0x1F);
  }
}

// Each 0.1 s the temperature to which the heat of the duty leads moves on, and is drawn to the reading with
// an eighth of the head's time constant:
//   seen += HEAT_RATE (duty + 7 need - 8 seen), need = KFF (temperature - T_AMB).
// A reading that is not where the heat went is no head's.
inline void Guard::step_heat_balance(const GuardIn& in) {
  const Params& p = in.params;
  const unsigned rate = p[spec::kRegCtrl] >> spec::kCtrlHeatRate;
  // A new KFF or T_AMB tells seen anew. It may come in the middle of a product.
  const auto set = static_cast<std::uint16_t>(p[spec::kRegKff] ^ p[spec::kRegTAmb]);
  if (heat_step_q == 0) {
    if (!in.tenth) return;
    heat_x_q = of_temp(pv_q) - of_tenths(p.s16(spec::kRegTAmb));
    heat_acc_q = 0;
    heat_step_q = 1;
    if (set != heat_set_q) heat_known_q = 0;
    heat_set_q = set;
  } else if (heat_step_q == kHeatNeed) {
    const std::int64_t need = heat_acc_q >> kHeatFraction;
    const std::int64_t seen = heat_seen_q >> kHeatFraction;
    const std::int64_t excess = seen - need;
    const bool same = set == heat_set_q;
    const bool judged =
        run_q != 0 && rate != 0 && heat_known_q != 0 && same;  // otherwise seen follows the reading
    heat_known_q = same;
    heat_set_q = set;
    heat_low_q = judged && excess > kHeatLow;
    heat_high_q = judged && -excess > kHeatHigh;
    if (!judged) heat_seen_q = sign_extended(need << kHeatFraction, 40);
    heat_x_q = static_cast<std::int32_t>(7 * need - 8 * seen + std::int64_t{5} * in.duty);
    heat_acc_q = 0;
    heat_step_q = judged ? kHeatNeed + 1 : 0;
  } else if (heat_step_q >= kHeatMove) {
    heat_seen_q = sign_extended(heat_seen_q + (heat_acc_q >> 5), 40);
    heat_step_q = 0;
  } else {
    const unsigned bit = heat_step_q < kHeatNeed ? p[spec::kRegKff] >> (16 - heat_step_q)
                                                 : rate >> (kHeatMove - 1 - heat_step_q);
    heat_acc_q = sign_extended(2 * heat_acc_q + ((bit & 1) != 0 ? heat_x_q : 0), 40);
    ++heat_step_q;
  }
}

// Armed once the temperature has been at the set-point, and until that falls.
inline void Guard::step_excursion(const GuardIn& in, const Seen& seen) {
  if (!seen.heating || in.sp_work < sp_past_q) {
    exc_armed_q = 0;
  } else if (seen.over_sp <= seen.window) {
    exc_armed_q = 1;
  }
  sp_past_q = in.sp_work;
  exc_q = seen.excursion ? count_up(exc_q, in.tenth) : 0;
}

inline void Guard::step_zero_rise(const GuardIn& in, const Sample& sample, const Seen& seen) {
  if (!seen.off_duty) {
    zero_q = 0;
  } else if (!seen.zero_due) {
    zero_q = count_up(zero_q, in.tenth);
  }
  if (sample.accept && pv_valid_q == 0) {
    zero_ref_q = in.sens_pv;  // the first sample is no rise
  } else if (!seen.zero_due || pv_q < zero_ref_q) {
    zero_ref_q = pv_q;
  }
}

inline void Guard::step_feedback(const GuardIn& in, const Seen& seen) {
  if ((heater_q != 0) == in.heater_fb) {
    fb_q = 0;
  } else if (!seen.feedback_late) {
    fb_q = (fb_q + 1) & 0xFFFFF;
  }
}

inline void Guard::step_at_temp(const GuardIn& in, const Seen& seen) {
  const bool at = seen.heating && pv_valid_q != 0 && !in.ramping && std::abs(seen.over_sp) <= seen.window;
  at_temp_q = at && at_q >= in.params[spec::kRegAtDwell];
  at_q = at ? count_up(at_q, in.tenth) : 0;
}

inline void Guard::step_detectors(const GuardIn& in, const Sample& sample, const Seen& seen) {
  step_loop_break(in, seen);
  step_hold_power(in, seen);
  step_excursion(in, seen);
  step_zero_rise(in, sample, seen);
  step_heat_balance(in);
  // A hot head without heat cools, so its samples move.
  frozen_q = seen.frozen && !(sample.accept && sample.change != 0) ? count_up(frozen_q, in.tenth) : 0;
  step_feedback(in, seen);
  // Time since the last frame, so that a changed HOST_WD is in force at once.
  wd_q = run_q == 0 || in.good_frame ? 0 : count_up(wd_q, in.tenth);
  step_at_temp(in, seen);
}

// Heater permission: a fault, a stop or the emergency stop beats everything.
inline void Guard::step_permission(const GuardIn& in, const Seen& seen, std::uint16_t cause) {
  const bool running = run_q != 0;
  const std::uint16_t latching =
      cause_q & static_cast<std::uint16_t>(running ? 0xFFFF : ~spec::kFaultRunOnly);
  const bool stop = in.stop || latching != 0 || fault_q != 0 || seen.rails_broken;
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
}

// Reference of DTDT_MAX, a second old at the most.
inline void Guard::step_rate_reference(const GuardIn& in, const Sample& sample) {
  if (sample.accept && (settled_q == 0 || sample.jump || rate_cnt_q >= kRateTenths)) {
    // Not the present sample, which may be a wrong one.
    rate_ref_q = settled_q != 0 && !sample.jump ? pv_q : in.sens_pv;
    rate_cnt_q = 0;
  } else if (in.tenth && rate_cnt_q < kRateTenths) {
    ++rate_cnt_q;
  }
}

// Sums of 16 values that forget: a single sample's noise neither trips nor hides anything.
inline void Guard::take_means(const GuardIn& in, const Sample& sample) {
  if (sample.accept) {
    temp_sum_q = pv_valid_q != 0 ? temp_sum_q + in.sens_pv - mean_temp() : in.sens_pv * 16;
    duty_sum_q += in.duty - (duty_sum_q >> 4);
  }
  if (run_q == 0) duty_sum_q = 0;
}

inline void Guard::take_sample(const GuardIn& in, const Sample& sample) {
  if (sample.accept) {
    rate_q = sample.jump;
    slope_q = pv_valid_q != 0 ? sat_s16(sample.change) : std::int16_t{0};
    if (pv_valid_q != 0 && !sample.far) settled_q = 1;
    pv_valid_q = 1;
    pv_q = in.sens_pv;
    ++samples_q;
    bad_q = 0;
    stale_q = 0;
  } else {
    stale_q = count_up(stale_q, in.tenth);
  }
  if (sample.refuse) {
    ++sensor_errors_q;
    bad_dev_q = in.sens_dev_fault;
    if (bad_q != 0xF) ++bad_q;
  }
}

// Everything is judged by the flops before this clock. Then they move: the detectors while temperature,
// permission and heater still are the old ones, the sample last.
void Guard::step(const GuardIn& in) {
  const Sample sample = judge_sample(in);
  const Seen seen = look(in);
  const std::uint16_t cause = causes(in, sample, seen);
  step_detectors(in, sample, seen);
  take_means(in, sample);
  step_permission(in, seen, cause);
  step_rate_reference(in, sample);
  take_sample(in, sample);
}

}  // namespace meltstage::chip
