// SPDX-License-Identifier: Apache-2.0
#include "algor.hpp"

#include <algorithm>

#include "math.hpp"

namespace meltstage::chip {

namespace {

// Unit conversions, UQ4.12: 0.1 degC -> 1/64 degC and 0.01 % -> 2^-16.
constexpr std::int64_t kTenthsToTemp = 26214;
constexpr std::int64_t kPercentToDuty = 26844;
// A ramp of r x 0.01 degC/s moves 1/64 degC each 3125 / (2 r) ms.
constexpr unsigned kRampModulus = 3125;

// CTRL bits.
constexpr unsigned kSegModel = 0;
constexpr unsigned kDOnPv = 1;
constexpr unsigned kFfEn = 2;
constexpr unsigned kErrInteger = 3;
constexpr unsigned kIZero = 6;

// UQ4.12 scaled result of a conversion, rounded.
constexpr std::int64_t converted(std::int64_t product) { return (product + 2048) >> 12; }

bool manual(const Params& p) { return p.bit(spec::kRegMode, 0); }

std::int32_t sat_term(std::int64_t x) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(x, -131072, 131071));
}

// 22-bit two's complement.
std::int32_t wrap22(std::int32_t x) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(x) << 10) >> 10;
}

// Error of the step; whole degrees truncated toward zero where asked, as the published controller computes.
std::int16_t error_of(std::int16_t sp, std::int16_t pv, bool integer) {
  const std::int16_t fine = sat_s16(std::int64_t{sp} - pv);
  if (!integer) return fine;
  const int rounded = fine < 0 ? fine + 63 : fine;
  return static_cast<std::int16_t>(rounded & ~63);
}

}  // namespace

std::int32_t Algor::term_p() const { return sat_term(p_q >> 6); }
std::int32_t Algor::term_i() const { return static_cast<std::int32_t>(i_q >> 14); }
std::int32_t Algor::term_d() const { return sat_term(d_q >> 7); }

void Algor::ramp(const AlgorIn& in) {
  const bool rising = target_q > sp_work_q;
  const unsigned rate = in.params[rising ? spec::kRegRampUp : spec::kRegRampDown];
  if (target_q == sp_work_q || rate == 0) return;
  const unsigned sum = (ramp_q + 2 * (rate & 0x7FF)) & 0x1FFF;
  if (sum >= kRampModulus) {
    ramp_q = static_cast<std::uint16_t>(sum - kRampModulus);
    sp_work_q = static_cast<std::int16_t>(rising ? sp_work_q + 1 : sp_work_q - 1);
  } else {
    ramp_q = static_cast<std::uint16_t>(sum);
  }
}

// Sum, segments, anti-windup: everything in 2^-14 duty LSB.
void Algor::sum(const AlgorIn& in) {
  const Params& p = in.params;
  const bool ff_en = p.bit(spec::kRegCtrl, kFfEn);
  const std::int64_t external = manual(p) ? 0 : std::int64_t{ext_q} << 14;
  const std::int64_t pd = std::int64_t{p_q} * 256 + std::int64_t{d_q} * 128 + external;
  const std::int64_t limit = std::int64_t{duty_max_q} << 14;
  const std::int64_t i_next = std::clamp<std::int64_t>(std::int64_t{i_q} + ie_q, 0, limit);
  const std::int64_t u_try = pd + i_next;
  const bool accept = !(u_try > limit && e_q >= 0) && !(u_try < 0 && e_q <= 0);

  bool full;
  bool off;
  if (p.bit(spec::kRegCtrl, kSegModel)) {
    const std::int64_t pd_ff = pd + (ff_en ? std::int64_t{ff_q} << 14 : 0);
    full = pd_ff > limit && e_q > 0;
    // Without feed-forward this rule makes a limit cycle around the set-point.
    off = ff_en && pd_ff < 0 && e_q < 0;
  } else {
    // 1/320 degC on both sides: 5 x 1/64 and 32 x 0.1.
    full = e_q * 5 > p[spec::kRegBandFull] * 32;
    off = -e_q * 5 > p[spec::kRegBandOff] * 32;
  }

  std::uint32_t i_after = i_q;
  if (full || off) {
    if (p.bit(spec::kRegCtrl, kIZero)) {
      i_after = 0;
    } else if (full && ff_en) {
      i_after = ff_q << 14;
    }
  } else if (accept) {
    i_after = static_cast<std::uint32_t>(i_next);
  }
  // A preset above DUTY_MAX, or a DUTY_MAX that has just been lowered, clamps the integral too.
  i_after = std::min(i_after, static_cast<std::uint32_t>(limit));
  const std::int64_t u_now = (pd + i_after) >> 14;
  u_q = full ? duty_max_q : off ? 0 : u_now > duty_max_q ? duty_max_q : sat_duty(u_now);
  i_held_q = i_after == i_q;
  i_q = i_after;
  segment_q = manual(p) ? kSegNone : full ? kSegFull : off ? kSegOff : kSegPid;
  fresh_q = 0;
}

// `sp`: working set-point before this clock's ramp.
void Algor::compute(const AlgorIn& in, std::int16_t sp) {
  const Params& p = in.params;
  std::uint8_t next = static_cast<std::uint8_t>(step_q + 1);
  switch (step_q) {
    case kStepIdle:
      next = in.start && in.sample_ok ? kStepSetpoint : kStepIdle;
      if (in.start && !in.sample_ok) done_q = 1;
      break;
    case kStepSetpoint: {
      const std::int16_t target = sat_s16(converted(kTenthsToTemp * p.s16(spec::kRegSetpoint)));
      const bool rising = target > (in.run ? sp : in.pv);
      if (p[rising ? spec::kRegRampUp : spec::kRegRampDown] == 0) {
        sp_work_q = target;
      } else if (!in.run) {
        sp_work_q = in.pv;
      }
      target_q = target;
      break;
    }
    case kStepDutyMax:
      duty_max_q = sat_duty(converted(kPercentToDuty * p.s16(spec::kRegDutyMax)));
      break;
    case kStepSlew:
      slew_q = sat_duty(converted(kPercentToDuty * p.s16(spec::kRegSlew)));
      break;
    case kStepAmbient:
      amb_q = sat_s16(converted(kTenthsToTemp * p.s16(spec::kRegTAmb)));
      break;
    case kStepExternal:
      ext_q = sat_duty(converted(kPercentToDuty * p.s16(manual(p) ? spec::kRegManualDuty : spec::kRegFfExt)));
      break;
    case kStepFeedForward:
      ff_q = sat_duty(std::int64_t{p[spec::kRegKff]} * sat_s16(std::int64_t{in.pv} - amb_q) >> 12);
      break;
    case kStepHold:
      // ff goes in divided by four; HOLD_MULT is UQ8.8. Above 100 % there is nothing left to tell apart.
      hold_q = sat_duty(std::int64_t{p[spec::kRegHoldMult]} * (ff_q >> 2) >> 6);
      break;
    case kStepHoldAdd:
      hold_q = hold_q + sat_duty(converted(kPercentToDuty * p.s16(spec::kRegHoldAdd)));
      break;
    case kStepError: {
      e_q = error_of(sp, in.pv, p.bit(spec::kRegCtrl, kErrInteger));
      const std::int32_t source = (p.bit(spec::kRegCtrl, kDOnPv) ? -std::int32_t{in.pv} : e_q) * 16;
      const std::int32_t filtered =
          fresh_q != 0 ? source : wrap22(filt_q + ((source - filt_q) >> (p[spec::kRegDFilter] & 7)));
      delta_q = fresh_q != 0 ? std::int16_t{0} : sat_s16(std::int64_t{filtered} - filt_q);
      filt_q = filtered;
      break;
    }
    case kStepProducts:
      // The three multipliers of fig. 6.
      p_q = static_cast<std::int32_t>(std::int64_t{p[spec::kRegKp]} * e_q);
      ie_q = static_cast<std::int32_t>(std::int64_t{p[in.at_temp ? spec::kRegKiHold : spec::kRegKiApproach]} *
                                       e_q);
      d_q = static_cast<std::int32_t>(std::int64_t{p[spec::kRegKd]} * delta_q);
      break;
    case kStepSum:
      sum(in);
      break;
    case kStepLimit: {
      const std::uint32_t wanted = manual(p) ? std::min(ext_q, duty_max_q) : u_q;
      duty_q = slew_q != 0 && wanted > duty_q + slew_q ? duty_q + slew_q : wanted;
      done_q = 1;
      next = kStepIdle;
      break;
    }
    default:
      next = kStepIdle;
      break;
  }
  step_q = next;
}

void Algor::step(const AlgorIn& in) {
  if (idle(in)) return;
  done_q = 0;
  const std::int16_t sp = sp_work_q;
  if (in.ms && in.run) ramp(in);
  compute(in, sp);  // after the ramp: a step that sets the working set-point wins

  // A stopped or manual loop keeps no history: the next automatic step starts without kick or windup.
  if (!in.run || manual(in.params)) {
    i_q = 0;
    fresh_q = 1;
  }
  if (!in.run) {
    duty_q = 0;
    segment_q = kSegNone;
  }
}

}  // namespace meltstage::chip
