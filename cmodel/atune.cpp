// SPDX-License-Identifier: Apache-2.0
#include "atune.hpp"

#include <algorithm>
#include <bit>

#include "spec.hpp"

namespace meltstage::chip {

namespace {

// Steps of the serial multiplier-divider: load, 18 of the product, 36 of the quotient.
constexpr unsigned kMdMultiply = 18;
constexpr unsigned kMdLast = 54;

constexpr std::uint32_t kMask17 = 0x1FFFF;
constexpr std::uint32_t kMask18 = 0x3FFFF;
constexpr std::uint64_t kMask36 = 0xFFFFFFFFFU;

// Temperature in 1/1024 degC to 1/64 degC.
std::int16_t temperature(std::int32_t filtered) { return static_cast<std::int16_t>(filtered >> 4); }

// Two's complement of 20 bits.
std::int32_t wrap20(std::int32_t x) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(x) << 12) >> 12;
}

// Low-pass of the derivative, about TU / 50: 2^n control periods.
std::uint16_t filter_of(std::uint32_t quarters) {
  const int top = std::bit_width(quarters) - 1;
  return static_cast<std::uint16_t>(std::clamp(top - 7, 0, 6));
}

// Register of each result; those without one leave the last.
constexpr std::uint8_t kWritten[8] = {spec::kRegDFilter,    spec::kRegDFilter, spec::kRegKp,
                                      spec::kRegKiApproach, spec::kRegKiHold,  spec::kRegKd,
                                      spec::kRegKff,        spec::kRegDFilter};

}  // namespace

std::uint64_t Atune::quiet(const AtuneIn& in) const {
  if (in.tune || (stop_q | wr_q) != 0) return 0;
  if (phase_q == kTuneIdle) return kForever;
  return searching() && in.run && !in.sample && !in.tenth && limit_q < spec::kTuneLimit ? kForever
         : phase_q == kTuneCommit && in.run && !in.commit                               ? kForever
                                                                                        : 0;
}

bool Atune::parity() const { return __builtin_parity(phase_q ^ on_q ^ duty_on_q ^ duty_off_q ^ hold_q) != 0; }

bool Atune::still(const AtuneIn& in) const {
  const bool computing = phase_q == kTuneCentre || phase_q == kTuneResults;
  return in.run && !in.tune && !in.sample && !in.commit && !(searching() && limit_q >= spec::kTuneLimit) &&
         !(computing && (md_q > kMdLast || calc_q == kCalcFilter));
}

// `share`: of the relay's step.
std::uint32_t Atune::mean_duty(const AtuneIn& in, std::uint64_t share) const {
  return std::min(duty_off_q + static_cast<std::uint32_t>(std::min<std::uint64_t>(share, kMask17)),
                  in.duty_max);
}

void Atune::take_sample(const AtuneIn& in) {
  // Half of AT_WINDOW: a noisy sensor needs a wide window. 1/320 degC.
  const int width = std::max(16 * in.window, 5 * spec::kTuneHysteresis);
  const int above = 5 * (in.pv - in.sp_work);
  const bool turns_off = on_q != 0 && above >= width;
  const bool turns_on = on_q == 0 && above <= -width;
  const bool relay_on = turns_on || (on_q != 0 && !turns_off);

  filt_q = wrap20(filt_q + ((in.pv * 16 - filt_q) >> 3));
  const std::int16_t temp = temperature(filt_q);
  if (turns_on || turns_off) limit_q = 0;
  on_q = relay_on;
  max_q = std::max(max_q, temp);
  min_q = std::min(min_q, temp);
  ++ticks_q;
  on_ticks_q = static_cast<std::uint16_t>(on_ticks_q + relay_on);
  if (!turns_on) return;
  if (phase_q == kTuneCycle) {
    cycles_q = (cycles_q + 1) & 7;
    phase_q = kTuneCentre;
    md_q = 0;
  } else {
    if (!in.ramping) phase_q = kTuneCycle;
    ticks_q = on_ticks_q = 0;
    max_q = min_q = temp;
  }
}

Atune::Operands Atune::operands(const AtuneIn& in) const {
  const std::uint32_t delta = (duty_on_q - duty_off_q) & kMask17;
  if (phase_q == kTuneCentre) return {delta, on_ticks_q, ticks_q};
  switch (calc_q) {
    case kCalcKu:
      return {delta, spec::kTuneKuFactor, sum_swing_q};
    case kCalcKp:
      return {delta, spec::kTuneKpFactor, sum_swing_q};
    case kCalcKiApproach:
      return {kp_q, spec::kTuneKiApproachFactor, sum_ticks_q};
    case kCalcKiHold:
      return {kp_q, spec::kTuneKiHoldFactor, sum_ticks_q};
    case kCalcKd:
      return {kp_q, sum_ticks_q, spec::kTuneKdDivisor};
    case kCalcKff: {
      const int rise = in.sp_work - in.amb;  // a set-point at ambient holds without duty
      return rise > 0 ? Operands{hold_q, 4096, static_cast<std::uint32_t>(rise)} : Operands{hold_q, 0, 1};
    }
    default:
      return {delta, sum_on_q, sum_ticks_q};
  }
}

// x k / y: shift-and-add into the upper half of acc, then restoring division out of its top.
void Atune::step_arithmetic(const Operands& op) {
  if (md_q == 0) {
    acc_q = op.k;
    rem_q = 0;
  } else if (md_q <= kMdMultiply) {
    const std::uint64_t partial = (acc_q >> 18) + ((acc_q & 1) != 0 ? op.x : 0);
    acc_q = partial << 17 | (acc_q >> 1 & kMask17);
  } else {
    const std::uint32_t rest = rem_q << 1 | static_cast<std::uint32_t>(acc_q >> 35);
    const bool fits = rest >= op.y;
    acc_q = (acc_q << 1 | fits) & kMask36;
    rem_q = (fits ? rest - op.y : rest) & kMask18;
  }
  md_q = (md_q + 1) & 0x3F;
}

// The first cycles centre the relay on their mean duty, the others are summed up.
void Atune::end_cycle(const AtuneIn& in, std::uint64_t quotient) {
  if (cycles_q <= spec::kTuneAdaptCycles) {
    hold_q = mean_duty(in, quotient);
    const std::uint32_t twice = 2 * hold_q;
    duty_on_q = std::min(twice, in.duty_max);
    duty_off_q = twice > in.duty_max ? (twice - in.duty_max) & kMask17 : 0;
  } else {
    sum_ticks_q = (sum_ticks_q + ticks_q) & kMask18;
    sum_on_q = (sum_on_q + on_ticks_q) & kMask18;
    sum_swing_q = (sum_swing_q + static_cast<std::uint16_t>(max_q - min_q)) & kMask18;
  }
  ticks_q = on_ticks_q = 0;
  max_q = min_q = temperature(filt_q);
  phase_q = cycles_q == spec::kTuneCycles ? kTuneResults : kTuneCycle;
  calc_q = kCalcHold;
  md_q = 0;
}

void Atune::take_result(const AtuneIn& in, std::uint64_t quotient) {
  const auto word = static_cast<std::uint16_t>(std::min<std::uint64_t>(quotient, 0xFFFF));
  if (calc_q == kCalcHold) hold_q = mean_duty(in, quotient);
  if (calc_q == kCalcKu) ku_q = word;
  if (calc_q == kCalcKp) kp_q = word;
  wr_q = calc_q != kCalcHold && calc_q != kCalcKu;
  wr_index_q = kWritten[calc_q];
  wr_data_q = calc_q == kCalcFilter ? filter_of(sum_ticks_q) : word;
  md_q = 0;
  if (calc_q == kCalcFilter) phase_q = kTuneCommit;
  calc_q = (calc_q + 1) & 7;
}

void Atune::step(const AtuneIn& in) {
  if (quiet(in) != 0) return;
  const std::uint8_t phase = phase_q;
  const bool writes = wr_q != 0;
  stop_q = 0;
  wr_q = writes && in.commit;
  if (searching()) {
    const bool expired = limit_q >= spec::kTuneLimit;
    if (in.tenth) limit_q = (limit_q + 1) & 0x3FFF;
    if (in.sample) take_sample(in);
    if (expired) {
      phase_q = kTuneIdle;
      end_q = kTuneTime;
      stop_q = 1;
    }
  } else if (phase == kTuneCentre || (phase == kTuneResults && !writes)) {
    const bool ready = md_q > kMdLast;
    const std::uint64_t quotient = acc_q;
    step_arithmetic(operands(in));
    if (phase == kTuneCentre && ready) end_cycle(in, quotient);
    if (phase == kTuneResults && (ready || calc_q == kCalcFilter)) take_result(in, quotient);
  } else if (phase == kTuneCommit && in.commit && !writes) {
    phase_q = kTuneIdle;
    end_q = kTuneFinished;
  }
  if (!in.run && phase != kTuneIdle) {
    phase_q = kTuneIdle;
    end_q = kTuneStopped;
    wr_q = 0;
  }
  if (in.tune && in.run && phase == kTuneIdle) {
    phase_q = kTuneApproach;
    end_q = kTuneRuns;
    cycles_q = 0;
    on_q = 1;
    duty_on_q = in.duty_max;
    duty_off_q = hold_q = 0;
    filt_q = in.pv * 16;
    sum_ticks_q = sum_on_q = sum_swing_q = 0;
    limit_q = 0;
  }
}

}  // namespace meltstage::chip
