// SPDX-License-Identifier: Apache-2.0
// PWMC, pulse-width modulation; twin of rtl/tc_pwmc.sv, theory of operation in docs/chip/blocks/pwmc.md.
#pragma once

#include <cstdint>

#include "flops.hpp"
#include "spec.hpp"

namespace meltstage::chip {

#define TC_PWMC_FLOPS(X)                                                                                    \
  X(std::uint32_t, duty_q, 17, 0)                                                                           \
  X(std::uint8_t, mul_left_q, 5, 0)                                                                         \
  X(std::uint32_t, mul_acc_q, 32, 0)                                                                        \
  X(std::uint16_t, mul_period_q, 16, static_cast<std::uint16_t>(spec::kHolding[spec::kRegPwmPeriod].reset)) \
  X(std::uint8_t, running_q, 1, 0)                                                                          \
  X(std::uint16_t, prescale_q, 16, static_cast<std::uint16_t>(spec::kHolding[spec::kRegPwmPrescale].reset)) \
  X(std::uint16_t, period_q, 16, static_cast<std::uint16_t>(spec::kHolding[spec::kRegPwmPeriod].reset))     \
  X(std::uint32_t, product_q, 32, 0)                                                                        \
  X(std::uint16_t, high_q, 16, 0)                                                                           \
  X(std::uint16_t, pre_q, 16, 0)                                                                            \
  X(std::uint16_t, count_q, 16, 0)                                                                          \
  X(std::int32_t, acc_q, 32, 0)                                                                             \
  X(std::uint8_t, pwm_q, 1, 0)                                                                              \
  X(std::uint8_t, period_start_q, 1, 0)

struct PwmcIn {
  std::uint16_t prescale = 0;  // clocks a count, less one
  std::uint16_t period = 0;    // counts; 0 and 1 count as 2
  std::uint16_t min_on = 0;    // counts
  bool dither = false;
  bool enable = false;
  std::uint32_t duty = 0;  // UQ1.16; above 65536 counts as 65536
  bool load = false;
};

struct Pwmc {
  TC_PWMC_FLOPS(TC_DECLARE_FLOP)

  // One rising clock edge, not in reset.
  void step(const PwmcIn& in);
  std::uint64_t quiet(const PwmcIn& in) const;
  void skip(std::uint64_t clocks);

  bool pwm() const { return pwm_q != 0; }
  // Parity of what lasts for a PWM period or a control tick, and whether the next clock leaves it as it is.
  bool parity() const;
  bool still(const PwmcIn& in) const;
  bool period_start() const { return period_start_q != 0; }

 private:
  void step_product(const PwmcIn& in, std::uint16_t period_legal);
  void start_period(const PwmcIn& in, bool mul_fresh);
  void stop();
};

}  // namespace meltstage::chip
