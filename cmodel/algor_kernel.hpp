// SPDX-License-Identifier: Apache-2.0
// ALGOR's arithmetic, one clock of it, over any number type of exact_int.hpp: all flops, pins and parameters
// in, all next flops and outputs out. Algor::step runs it on plain integers, tests/proofs/kernel/ on a
// solver's bit-vectors (equal to rtl/tc_algor.sv for every state and input), tests/systemc/ on SystemC's
// fixed-width types.
//
// Law: eq. (2) of Xie et al. 2023, u(n) = (Kp + Kd) e(n) + Ki sum e(k) - Kd e(n-1), as P + I + D with
// P = Kp e, I += Ki e, D = Kd (d(n) - d(n-1)), segments (fig. 7). One multiplier, where fig. 6 has three side
// by side: a step multiplies what it is called after and takes the product of the step before it (work_q).
#pragma once

#include <cstdint>

#include "algor.hpp"
#include "exact_int.hpp"
#include "math.hpp"
#include "params.hpp"

namespace meltstage::chip::algor_kernel {

// The flops where they are kept: q.e_q() reads, q.e_q = x writes.
#define TC_ALGOR_VIEW(type, name, width, reset) Flop<B, type, width> name;
#define TC_ALGOR_BIND(type, name, width, reset) .name = Flop<B, type, width>(state.name),
template <class B>
struct Flops {
  TC_ALGOR_FLOPS(TC_ALGOR_VIEW)
};
// `State` has a member of type B::Stored<type, width> for each flop, under its name.
template <class B, class State>
Flops<B> flops_of(State& state) {
  return {TC_ALGOR_FLOPS(TC_ALGOR_BIND)};
}
#undef TC_ALGOR_VIEW
#undef TC_ALGOR_BIND

// The pins; `Params` is indexed by spec::Reg and gives a register as a B::Stored<std::uint16_t, 16>.
template <class B, class Params>
struct Pins {
  using Bool = typename B::Bool;
  const Params& params;
  Bool start;
  Bool sample_ok;
  Bool run;
  Bool at_temp;
  Bool ms;
  Int<B, 16> pv;   // Q9.6
  Bool drop;       // droplet trigger
  Bool hold_test;  // GUARD tests the reading
  Bool tuning;
  Int<B, 18> tune_duty;  // UQ1.16, as the next
  Int<B, 18> tune_hold;

  Int<B, 17> u16(spec::Reg reg) const { return Int<B, 17>(B::template load<std::uint16_t, 16>(params[reg])); }
  Int<B, 16> s16(spec::Reg reg) const { return wrap<16>(u16(reg)); }
  template <std::int64_t I>
  Bool bit(spec::Reg reg, Const<I> index) const {
    return wrap_u<1>(u16(reg) >> index) != 0_k;
  }

  Bool manual() const { return bit(spec::kRegMode, Const<spec::kModeManual>{}); }
  Bool seg_model() const { return bit(spec::kRegCtrl, Const<spec::kCtrlSegModel>{}); }
  Bool d_on_pv() const { return bit(spec::kRegCtrl, Const<spec::kCtrlDOnPv>{}); }
  Bool ff_en() const { return bit(spec::kRegCtrl, Const<spec::kCtrlFfEn>{}); }
  Bool err_integer() const { return bit(spec::kRegCtrl, Const<spec::kCtrlErrInteger>{}); }
  Bool i_zero() const { return bit(spec::kRegCtrl, Const<spec::kCtrlIZero>{}); }
};

// if (condition) body(); body works on q.
template <class B, class Body>
void when(Flops<B>& q, const typename B::Bool& condition, const Body& body) {
  B::choose(q, condition, body, [] {});
}

// ---- Narrowing and multiplying ----

// A term as the host reads it, Q1.16.
template <class B, int W>
Int<B, 18> sat_term(const Int<B, W>& x) {
  return clamp<-131072, 131071>(x);
}

// The multiplier: a gain of 16 bits without sign, a term of 16 bits with sign; the product waits in work_q.
template <class B>
void multiply(Flops<B>& q, const Int<B, 17>& gain, const Int<B, 16>& term) {
  q.work_q = wrap<32>(Int<B, 33>(gain * term));
}

// Unit conversions by a factor in UQ4.12: 0.1 degC -> 1/64 degC and 0.01 % -> 2^-16,
template <class B>
void multiply_tenths(Flops<B>& q, const Int<B, 16>& tenths) {
  multiply<B>(q, 26214_k, tenths);
}
template <class B>
void multiply_percent(Flops<B>& q, const Int<B, 16>& percent) {
  multiply<B>(q, 26844_k, percent);
}
// and their results, rounded.
template <class B>
Int<B, 16> temperature(const Int<B, 32>& work) {
  return sat_s16((work + 2048_k) >> 12_k);
}
template <class B>
Int<B, 18> duty(const Int<B, 32>& work) {
  return sat_duty((work + 2048_k) >> 12_k);
}
// Share of the feed-forward, which goes in divided by four: HOLD_MULT is UQ8.8, PRESET UQ0.8. Above 100 %
// there is nothing left to tell apart.
template <class B>
void multiply_share(Flops<B>& q, const Int<B, 17>& share) {
  multiply<B>(q, share, q.ff_q() >> 2_k);
}
template <class B>
Int<B, 18> share(const Int<B, 32>& work) {
  return sat_duty(work >> 6_k);
}

// ---- Set-point ----

// A ramp of r x 0.01 degC/s moves 1/64 degC each 3125 / (2 r) ms.
template <class B, class In>
void ramp(Flops<B>& q, const In& in) {
  const auto target = q.target_q();
  const auto sp = q.sp_work_q();
  const auto rising = target > sp;
  const auto rate = select(rising, in.u16(spec::kRegRampUp), in.u16(spec::kRegRampDown));
  const auto sum = wrap_u<13>(q.ramp_q() + (wrap_u<11>(rate) << 1_k));
  when(q, in.ms && in.run && target != sp && rate != 0_k, [&] {
    B::choose(
        q, sum >= 3125_k,
        [&] {
          q.ramp_q = wrap_u<13>(sum - 3125_k);
          q.sp_work_q = wrap<16>(select(rising, sp + 1_k, sp - 1_k));
        },
        [&] { q.ramp_q = sum; });
  });
}

// `sp`: working set-point before this clock's ramp. Rate 0 is a step; a stopped loop follows the temperature.
template <class B, class In>
void take_setpoint(Flops<B>& q, const In& in, const Int<B, 16>& sp, const Int<B, 16>& target) {
  const auto rising = target > select(in.run, sp, in.pv);
  const auto rate = select(rising, in.u16(spec::kRegRampUp), in.u16(spec::kRegRampDown));
  q.target_q = target;
  when(q, rate == 0_k || !in.run, [&] { q.sp_work_q = select(rate == 0_k, target, in.pv); });
}

// ---- Error and derivative ----

template <class B, class In>
void take_error(Flops<B>& q, const In& in, const Int<B, 16>& sp) {
  const auto fine = sat_s16(sp - in.pv);
  // Whole degrees, truncated toward zero, as the published controller computes.
  const auto whole = wrap<16>((select(fine < 0_k, fine + 63_k, fine) >> 6_k) << 6_k);
  const auto e = select(in.err_integer(), whole, fine);
  q.e_q = e;
}

// d: the error or the negated temperature behind a first-order low-pass, 1/1024 degC.
template <class B, class In>
void take_derivative(Flops<B>& q, const In& in) {
  const auto source = select(in.d_on_pv(), -in.pv, q.e_q()) << 4_k;
  const auto fresh = q.fresh_q() != 0_k;
  const auto past = q.filt_q();
  const auto step = (source - past) >> wrap_u<3>(in.u16(spec::kRegDFilter));
  q.delta_q = select(fresh, 0_k, sat_s16(step));
  q.filt_q = select(fresh, Int<B, 22>(source), wrap<22>(past + step));
}

// ---- Sum, segments, anti-windup: pd_q in 2^-7 duty LSB, the integral in 2^-14 ----

template <class B, class In>
void take_d(Flops<B>& q, const In& in, const Int<B, 32>& product) {
  q.term_d_q = sat_term(product >> 7_k);
  q.pd_q = wrap<34>(select(in.manual(), 0_k, q.ext_q() << 7_k) + product);
}
template <class B>
void take_p(Flops<B>& q, const Int<B, 32>& product) {
  q.term_p_q = sat_term(product >> 6_k);
  q.pd_q = wrap<34>(q.pd_q() + (product << 1_k));
}

// The segment, by bands in 1/320 degC (5 x 1/64 and 32 x 0.1) or by what P + D + feed-forward alone give; and
// the integral after its step.
template <class B, class In>
void take_segment(Flops<B>& q, const In& in, const Int<B, 32>& product) {
  const auto e = q.e_q();
  const auto band_full = e * 5_k > in.u16(spec::kRegBandFull) << 5_k;
  const auto band_off = -(e * 5_k) > in.u16(spec::kRegBandOff) << 5_k;
  const auto pd_ff = q.pd_q() + select(in.ff_en(), q.ff_q() << 7_k, 0_k);
  const auto model_full = pd_ff > q.duty_max_q() << 7_k && e > 0_k;
  // Without feed-forward this rule makes a limit cycle around the set-point.
  const auto model_off = in.ff_en() && pd_ff < 0_k && e < 0_k;
  q.full_q = (in.seg_model() && model_full) || (!in.seg_model() && band_full);
  q.off_q = (in.seg_model() && model_off) || (!in.seg_model() && band_off);

  const auto limit = q.duty_max_q() << 14_k;
  const auto i_sum = q.i_q() + product;
  q.work_q = wrap<32>(select(i_sum < 0_k, 0_k, select(i_sum > limit, limit, i_sum)));
}

// I takes its step only where that does not drive the output further into its limit, and not in GUARD's test.
// While ATUNE drives, the integral waits at its hold duty.
template <class B, class In>
void take_integral(Flops<B>& q, const In& in, const Int<B, 32>& i_next) {
  const auto e = q.e_q();
  const auto i = q.i_q();
  const auto feed_forward = q.ff_q() << 14_k;
  const auto u_try = (q.pd_q() << 7_k) + i_next;
  const auto accept =
      !in.hold_test && !(u_try > q.duty_max_q() << 14_k && e >= 0_k) && !(u_try < 0_k && e <= 0_k);
  const auto full = q.full_q() != 0_k;
  const auto off = q.off_q() != 0_k;
  const auto i_outside = select(in.i_zero(), 0_k, select(full && in.ff_en(), feed_forward, i));
  const auto i_inside = select(accept, i_next, i);
  q.work_q = wrap<32>(select(in.tuning, in.tune_hold << 14_k, select(full || off, i_outside, i_inside)));
}

// A preset above DUTY_MAX, or a DUTY_MAX that has just been lowered, clamps the integral too.
template <class B>
void clamp_integral(Flops<B>& q, const Int<B, 33>& i_wanted) {
  const auto limit = q.duty_max_q() << 14_k;
  const auto i_after = wrap_u<32>(select(i_wanted > limit, limit, i_wanted));
  q.i_held_q = i_after == q.i_q();
  q.i_q = i_after;
}

template <class B, class In>
void take_output(Flops<B>& q, const In& in) {
  const auto duty_max = q.duty_max_q();
  const auto full = q.full_q() != 0_k;
  const auto off = q.off_q() != 0_k;
  const auto u = ((q.pd_q() << 7_k) + q.i_q()) >> 14_k;
  const auto u_limited = select(u > duty_max, duty_max, sat_duty(u));
  q.work_q = wrap<32>(select(full, duty_max, select(off, 0_k, u_limited)));
  const auto segment = select(full, Const<spec::kSegFull>{},
                              select(off, Const<spec::kSegOff>{}, Int<B, 3>(Const<spec::kSegPid>{})));
  q.segment_q = select(in.manual() || in.tuning, Const<spec::kSegNone>{}, segment);
  q.fresh_q = 0_k;
}

// Each droplet since the last computation adds FF_DROP, 2^-20, to the external feed-forward. A load that is
// announced needs power: no reason to trip.
template <class B, class In>
void take_drops(Flops<B>& q, const In& in, const Int<B, 32>& product) {
  const auto ext = select(in.manual(), q.ext_q(), sat_duty(q.ext_q() + (product >> 4_k)));
  q.ext_q = ext;
  q.hold_q = wrap_u<18>(q.hold_q() + ext);
}

// In GUARD's test the duty is at most half of the hold power. The rise of the duty, never its fall, is held
// to SLEW.
template <class B, class In>
void take_duty(Flops<B>& q, const In& in, const Int<B, 18>& output) {
  const auto duty_max = q.duty_max_q();
  const auto commanded = select(in.tuning, in.tune_duty, select(in.manual(), q.ext_q(), output));
  const auto test_max = q.hold_q() >> 1_k;
  const auto most = select(in.hold_test && test_max < duty_max, wrap_u<17>(test_max), duty_max);
  const auto wanted = select(commanded > most, most, commanded);
  const auto highest = q.duty_q() + q.slew_q();
  q.duty_q = select(q.slew_q() != 0_k && wanted > highest, wrap_u<17>(highest), wanted);
  q.done_q = 1_k;
}

// ---- One clock ----

template <AlgorStep At, AlgorStep Next, class Body>
struct Case {
  const Body& body;
};
// In step `At`: body(), and go on to step `Next`.
template <AlgorStep At, AlgorStep Next, class Body>
Case<At, Next, Body> on(const Body& body) {
  return {body};
}
template <class B>
void one_of(Flops<B>& q, const Int<B, 6>&) {
  q.step_q = Const<kStepIdle>{};
}
template <class B, AlgorStep At, AlgorStep Next, class Body, class... Others>
void one_of(Flops<B>& q, const Int<B, 6>& step, const Case<At, Next, Body>& first, const Others&... others) {
  B::choose(
      q, step == Const<At>{},
      [&] {
        q.step_q = Const<Next>{};
        first.body();
      },
      [&] { one_of(q, step, others...); });
}

template <class B, class In>
void clock(Flops<B>& q, const In& in) {
  const auto sp = q.sp_work_q();
  const auto dropped = in.drop && q.drop_q() == 0_k;
  const auto drops = q.drops_q();
  const auto work = q.work_q();
  q.done_q = 0_k;
  q.drop_q = in.drop;
  when(q, dropped && drops != 255_k, [&] { q.drops_q = wrap_u<8>(drops + 1_k); });
  ramp(q, in);
  // After the ramp: a step that sets the working set-point wins.
  one_of(q, q.step_q(), on<kStepIdle, kStepIdle>([&] {
           when(q, in.start && in.sample_ok, [&] { q.step_q = Const<kStepAmbient>{}; });
           q.done_q = in.start && !in.sample_ok;
         }),
         on<kStepAmbient, kStepSetpoint>([&] { multiply_tenths(q, in.s16(spec::kRegTAmb)); }),
         on<kStepSetpoint, kStepDutyMax>([&] {
           q.amb_q = temperature(work);
           multiply_tenths(q, in.s16(spec::kRegSetpoint));
         }),
         on<kStepDutyMax, kStepFeedForward>([&] {
           take_setpoint(q, in, sp, temperature(work));
           q.delta_q = sat_s16(in.pv - q.amb_q());
           multiply_percent(q, in.s16(spec::kRegDutyMax));
         }),
         on<kStepFeedForward, kStepHoldAdd>([&] {
           q.duty_max_q = duty(work);
           multiply<B>(q, in.u16(spec::kRegKff), q.delta_q());
         }),
         on<kStepHoldAdd, kStepHold>([&] {
           q.ff_q = sat_duty(work >> 12_k);
           multiply_percent(q, in.s16(spec::kRegHoldAdd));
         }),
         on<kStepHold, kStepPreset>([&] {
           q.hold_q = duty(work);
           multiply_share(q, in.u16(spec::kRegHoldMult));
         }),
         on<kStepPreset, kStepExternal>([&] {
           q.hold_q = wrap_u<18>(q.hold_q() + share(work));
           multiply_share(q, in.u16(spec::kRegPreset));
         }),
         on<kStepExternal, kStepDrops>([&] {
           q.ff_q = share(work);
           take_error(q, in, sp);
           multiply_percent(q, select(in.manual(), in.s16(spec::kRegManualDuty), in.s16(spec::kRegFfExt)));
         }),
         on<kStepDrops, kStepSlew>([&] {
           q.ext_q = duty(work);
           take_derivative(q, in);
           multiply<B>(q, in.u16(spec::kRegFfDrop), wrap<16>(drops));
           q.drops_q = 0_k;
           when(q, dropped, [&] { q.drops_q = 1_k; });
         }),
         on<kStepSlew, kStepDerivative>([&] {
           take_drops(q, in, work);
           multiply_percent(q, in.s16(spec::kRegSlew));
         }),
         on<kStepDerivative, kStepProportional>([&] {
           q.slew_q = duty(work);
           multiply<B>(q, in.u16(spec::kRegKd), q.delta_q());
         }),
         on<kStepProportional, kStepIntegral>([&] {
           take_d(q, in, work);
           multiply<B>(q, in.u16(spec::kRegKp), q.e_q());
         }),
         on<kStepIntegral, kStepSegment>([&] {
           take_p(q, work);
           multiply<B>(q, select(in.at_temp, in.u16(spec::kRegKiHold), in.u16(spec::kRegKiApproach)),
                       q.e_q());
         }),
         on<kStepSegment, kStepAntiWindup>([&] { take_segment(q, in, work); }),
         on<kStepAntiWindup, kStepClamp>([&] { take_integral(q, in, work); }),
         on<kStepClamp, kStepOutput>([&] { clamp_integral(q, wrap_u<32>(work)); }),
         on<kStepOutput, kStepLimit>([&] { take_output(q, in); }),
         on<kStepLimit, kStepIdle>([&] { take_duty(q, in, wrap_u<17>(work)); }));

  // A stopped or manual loop keeps no history: the next automatic step starts without kick or windup.
  when(q, !in.run || in.manual(), [&] {
    q.i_q = 0_k;
    q.fresh_q = 1_k;
  });
  when(q, !in.run, [&] {
    q.drops_q = 0_k;
    q.duty_q = 0_k;
    q.segment_q = Const<spec::kSegNone>{};
  });
}

// A clock then changes nothing (proved in tests/proofs/kernel/).
template <class B, class In>
typename B::Bool idle(const Flops<B>& q, const In& in) {
  return q.step_q() == Const<kStepIdle>{} && !in.start && q.done_q() == 0_k && in.run && !in.ms &&
         in.u16(spec::kRegMode) == 0_k && in.drop == (q.drop_q() != 0_k);
}

// ---- Outputs that are not flops ----

// What one computation hands to the next (integral, filter, working set-point) stays as it is.
template <class B, class In>
typename B::Bool still(const Flops<B>& q, const In& in) {
  return q.step_q() == Const<kStepIdle>{} && !in.start && q.done_q() == 0_k && in.run && !in.manual() &&
         !(in.ms && q.sp_work_q() != q.target_q());
}

template <class B>
typename B::Bool ramping(const Flops<B>& q) {
  return q.sp_work_q() != q.target_q();
}
template <class B>
typename B::Bool limited(const Flops<B>& q) {
  // The integral may stop just short of the limit.
  return q.duty_q() + (q.duty_max_q() >> 4_k) >= q.duty_max_q() && q.duty_q() != 0_k;
}
template <class B>
Int<B, 18> term_p(const Flops<B>& q) {
  return q.term_p_q();
}
template <class B>
Int<B, 18> term_i(const Flops<B>& q) {
  return wrap_u<17>(q.i_q() >> 14_k);
}
template <class B>
Int<B, 18> term_d(const Flops<B>& q) {
  return q.term_d_q();
}

}  // namespace meltstage::chip::algor_kernel
