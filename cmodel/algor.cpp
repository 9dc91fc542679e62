// SPDX-License-Identifier: Apache-2.0
#include "algor.hpp"

#include "algor_kernel.hpp"

namespace meltstage::chip {

// [[gnu::flatten]]: the kernel is many small functions on a view of the flops; inlined, the view costs
// nothing.

namespace {

using algor_kernel::flops_of;

// A view for reading; the kernel's views can write.
algor_kernel::Flops<PlainBits> flops_of(const Algor& algor) {
  return flops_of<PlainBits>(const_cast<Algor&>(algor));
}

}  // namespace

[[gnu::flatten]] bool Algor::ramping() const { return algor_kernel::ramping(flops_of(*this)); }
bool Algor::parity() const {
  return __builtin_parity(i_q ^ (static_cast<std::uint32_t>(filt_q) & 0x3FFFFFu) ^
                          static_cast<std::uint16_t>(sp_work_q)) != 0;
}
[[gnu::flatten]] bool Algor::limited() const { return algor_kernel::limited(flops_of(*this)); }
[[gnu::flatten]] std::int32_t Algor::term_p() const {
  return static_cast<std::int32_t>(algor_kernel::term_p(flops_of(*this)).bits);
}
[[gnu::flatten]] std::int32_t Algor::term_i() const {
  return static_cast<std::int32_t>(algor_kernel::term_i(flops_of(*this)).bits);
}
[[gnu::flatten]] std::int32_t Algor::term_d() const {
  return static_cast<std::int32_t>(algor_kernel::term_d(flops_of(*this)).bits);
}

std::uint64_t Algor::quiet(const AlgorIn& in) const {
  if (step_q != kStepIdle || done_q != 0 || in.start || in.drop != (drop_q != 0)) return 0;
  if (!in.run && drops_q != 0) return 0;
  if ((!in.run || in.params.bit(spec::kRegMode, spec::kModeManual)) && (i_q != 0 || fresh_q == 0)) return 0;
  return in.run || (duty_q == 0 && segment_q == spec::kSegNone) ? kForever : 0;
}

namespace {

algor_kernel::Pins<PlainBits, Params> pins_of(const AlgorIn& in) {
  return {.params = in.params,
          .start = in.start,
          .sample_ok = in.sample_ok,
          .run = in.run,
          .at_temp = in.at_temp,
          .ms = in.ms,
          .pv = Int<PlainBits, 16>(in.pv),
          .drop = in.drop,
          .hold_test = in.hold_test,
          .tuning = in.tuning,
          .tune_duty = Int<PlainBits, 18>(in.tune_duty),
          .tune_hold = Int<PlainBits, 18>(in.tune_hold)};
}

}  // namespace

[[gnu::flatten]] bool Algor::still(const AlgorIn& in) const {
  return algor_kernel::still(flops_of(*this), pins_of(in));
}

[[gnu::flatten]] void Algor::step(const AlgorIn& in) {
  const algor_kernel::Pins<PlainBits, Params> pins = pins_of(in);
  auto flops = flops_of<PlainBits>(*this);
  if (!algor_kernel::idle(flops, pins)) algor_kernel::clock(flops, pins);
}

}  // namespace meltstage::chip
