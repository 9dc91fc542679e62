// SPDX-License-Identifier: Apache-2.0
#include "pwmc.hpp"

#include <algorithm>

namespace meltstage::chip {
namespace {

constexpr std::uint8_t kMulSteps = 17;  // bits of the duty
constexpr std::uint32_t kFullDuty = 65536;

std::uint16_t legal_period(const PwmcIn& in) { return std::max<std::uint16_t>(in.period, 2); }

}  // namespace

// The product duty x period, one duty bit a clock, least significant first: add above, shift down; the last
// bit has the weight 1.
void Pwmc::step_product(const PwmcIn& in, std::uint16_t period_legal) {
  const bool drop = !in.enable && duty_q != 0;  // a stopped output forgets its duty
  if (in.load || drop || period_legal != mul_period_q) {
    if (in.load) {
      duty_q = std::min(in.duty, kFullDuty);
    } else if (drop) {
      duty_q = 0;
    }
    mul_left_q = kMulSteps;
    mul_acc_q = 0;
    mul_period_q = period_legal;
  } else if (mul_left_q != 0) {
    const bool bit = (duty_q >> (kMulSteps - mul_left_q) & 1u) != 0;
    --mul_left_q;
    const std::uint32_t sum = (mul_acc_q >> 16) + (bit ? mul_period_q : 0u);
    mul_acc_q = mul_left_q == 0 ? sum << 16 | (mul_acc_q & 0xFFFFu) : sum << 15 | (mul_acc_q & 0xFFFFu) >> 1;
  }
}

void Pwmc::start_period(const PwmcIn& in, bool mul_fresh) {
  const std::uint16_t period = mul_fresh ? mul_period_q : period_q;
  const std::uint32_t product = mul_fresh ? mul_acc_q : product_q;
  const std::int64_t min_on = std::min<std::int64_t>(in.min_on, period >> 1);
  const std::int64_t sum = (period == period_q ? std::int64_t{acc_q} : 0) + product;
  const std::int64_t whole = sum >> 16;

  std::int64_t high = whole;
  if (product == 0 || whole < min_on) {
    high = 0;
  } else if (whole > period - min_on) {
    high = in.dither || whole >= period ? period : period - min_on;  // never above the duty
  }

  running_q = 1;
  if (mul_fresh) prescale_q = in.prescale;
  period_q = period;
  product_q = product;
  high_q = static_cast<std::uint16_t>(high);
  pre_q = 0;
  count_q = 0;
  acc_q = in.dither && product != 0 ? static_cast<std::int32_t>(sum - (high << 16)) : 0;
  pwm_q = high_q != 0;
}

void Pwmc::stop() {
  running_q = 0;
  high_q = 0;
  pre_q = 0;
  count_q = 0;
  acc_q = 0;
  pwm_q = 0;
}

std::uint64_t Pwmc::quiet(const PwmcIn& in) const {
  const bool product_stands = !in.load && mul_left_q == 0 && legal_period(in) == mul_period_q;
  if (!product_stands || period_start_q != 0) return 0;
  if (!in.enable)
    return (duty_q | running_q | high_q | pre_q | count_q | pwm_q) == 0 && acc_q == 0 ? kForever : 0;
  if (running_q == 0 || pre_q > prescale_q) return 0;
  const unsigned next_edge = pwm_q != 0 && high_q < period_q ? high_q : period_q;
  if (count_q >= next_edge) return 0;
  return (next_edge - count_q) * (prescale_q + std::uint64_t{1}) - pre_q - 1;
}

void Pwmc::skip(std::uint64_t clocks) {
  if (running_q == 0) return;
  const std::uint64_t sum = pre_q + clocks;
  count_q = static_cast<std::uint16_t>(count_q + sum / (prescale_q + 1u));
  pre_q = static_cast<std::uint16_t>(sum % (prescale_q + 1u));
}

bool Pwmc::parity() const {
  return __builtin_parity(duty_q ^ mul_acc_q ^ product_q ^ static_cast<std::uint32_t>(acc_q) ^
                          (std::uint32_t{mul_period_q} ^ prescale_q ^ period_q ^ high_q)) != 0;
}

bool Pwmc::still(const PwmcIn& in) const {
  const bool period_end = pre_q >= prescale_q && count_q + 1 >= period_q;
  return in.enable && running_q != 0 && !period_end && !in.load && mul_left_q == 0 &&
         legal_period(in) == mul_period_q;
}

void Pwmc::step(const PwmcIn& in) {
  const std::uint16_t period_legal = legal_period(in);
  const bool mul_fresh = mul_left_q == 0 && period_legal == mul_period_q;
  const bool count_end = pre_q >= prescale_q;
  const bool period_end = count_end && count_q + 1 >= period_q;

  period_start_q = in.enable && (running_q != 0 ? period_end : mul_fresh && !in.load);
  if (!in.enable) {
    stop();
  } else if (period_start_q != 0) {
    start_period(in, mul_fresh);
  } else if (running_q != 0) {
    if (count_end) {
      pre_q = 0;
      ++count_q;
      pwm_q = pwm_q != 0 && count_q < high_q;  // never a second pulse
    } else {
      ++pre_q;
    }
  }
  if (in.load || !mul_fresh || !in.enable) step_product(in, period_legal);
}

}  // namespace meltstage::chip
