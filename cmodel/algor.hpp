// SPDX-License-Identifier: Apache-2.0
// ALGOR: segmented fixed-point PID (Xie et al. 2023, eq. 2, figs. 6 and 7). Twin of rtl/tc_algor.sv. Its
// arithmetic stands in algor_kernel.hpp, over any number type.
#pragma once

#include <array>
#include <cstdint>

#include "flops.hpp"
#include "params.hpp"

namespace meltstage::chip {

// Steps of one computation, a clock each.
enum AlgorStep : std::uint8_t {
  kStepIdle,
  kStepAmbient,
  kStepSetpoint,
  kStepDutyMax,
  kStepFeedForward,
  kStepHoldAdd,
  kStepHold,
  kStepPreset,
  kStepExternal,
  kStepDrops,
  kStepSlew,
  kStepDerivative,
  kStepProportional,
  kStepIntegral,
  kStepSegment,
  kStepAntiWindup,
  kStepClamp,
  kStepOutput,
  kStepLimit,
};

#define TC_ALGOR_FLOPS(X)             \
  X(std::uint8_t, step_q, 5, 0)       \
  X(std::uint8_t, done_q, 1, 0)       \
  X(std::uint8_t, fresh_q, 1, 1)      \
  X(std::uint8_t, i_held_q, 1, 0)     \
  X(std::uint8_t, full_q, 1, 0)       \
  X(std::uint8_t, off_q, 1, 0)        \
  X(std::uint8_t, segment_q, 2, 0)    \
  X(std::uint8_t, drop_q, 1, 0)       \
  X(std::uint8_t, drops_q, 8, 0)      \
  X(std::int16_t, target_q, 16, 0)    \
  X(std::int16_t, sp_work_q, 16, 0)   \
  X(std::int16_t, amb_q, 16, 0)       \
  X(std::int16_t, e_q, 16, 0)         \
  X(std::int16_t, delta_q, 16, 0)     \
  X(std::uint16_t, ramp_q, 13, 0)     \
  X(std::uint32_t, duty_max_q, 17, 0) \
  X(std::uint32_t, slew_q, 17, 0)     \
  X(std::uint32_t, ext_q, 17, 0)      \
  X(std::uint32_t, ff_q, 17, 0)       \
  X(std::uint32_t, duty_q, 17, 0)     \
  X(std::uint32_t, hold_q, 18, 0)     \
  X(std::int32_t, term_p_q, 18, 0)    \
  X(std::int32_t, term_d_q, 18, 0)    \
  X(std::int32_t, filt_q, 22, 0)      \
  X(std::int32_t, work_q, 32, 0)      \
  X(std::int64_t, pd_q, 34, 0)        \
  X(std::uint32_t, i_q, 32, 0)

struct AlgorIn {
  const Params& params;
  bool start;
  bool sample_ok;
  bool run;
  bool at_temp;
  bool ms;
  std::int16_t pv;  // Q9.6
  bool drop;        // droplet trigger
  bool hold_test;   // GUARD tests the reading: less duty, and the integral waits
  bool tuning;
  std::uint32_t tune_duty;  // UQ1.16
  std::uint32_t tune_hold;
};

struct Algor {
  TC_ALGOR_FLOPS(TC_DECLARE_FLOP)

  void step(const AlgorIn& in);
  // Nothing counts between two computations but the ramp: there is nothing to skip.
  std::uint64_t quiet(const AlgorIn& in) const;

  // A millisecond moves the working set-point.
  bool ramps(const AlgorIn& in) const { return in.run && ramping(); }
  bool ramping() const;
  bool limited() const;
  // Parity of what one computation hands to the next, and whether the next clock leaves it as it is.
  bool parity() const;
  bool still(const AlgorIn& in) const;
  std::int32_t term_p() const;  // Q1.16, saturated
  std::int32_t term_i() const;
  std::int32_t term_d() const;
};

}  // namespace meltstage::chip
