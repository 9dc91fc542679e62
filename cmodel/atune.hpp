// SPDX-License-Identifier: Apache-2.0
// ATUNE: self-tuning by a relay experiment (Astrom and Hagglund 1984). Twin of rtl/tc_atune.sv; theory and
// formulas: docs/chip/blocks/atune.md.
#pragma once

#include <cstdint>

#include "flops.hpp"

namespace meltstage::chip {

enum TunePhase : std::uint8_t {
  kTuneIdle,
  kTuneApproach,
  kTuneCycle,
  kTuneCentre,
  kTuneResults,
  kTuneCommit
};
enum TuneEnd : std::uint8_t { kTuneNever, kTuneRuns, kTuneFinished, kTuneStopped, kTuneTime };
enum TuneCalc : std::uint8_t {
  kCalcHold,
  kCalcKu,
  kCalcKp,
  kCalcKiApproach,
  kCalcKiHold,
  kCalcKd,
  kCalcKff,
  kCalcFilter
};

#define TC_ATUNE_FLOPS(X)              \
  X(std::uint8_t, phase_q, 3, 0)       \
  X(std::uint8_t, end_q, 3, 0)         \
  X(std::uint8_t, cycles_q, 3, 0)      \
  X(std::uint8_t, calc_q, 3, 0)        \
  X(std::uint8_t, on_q, 1, 0)          \
  X(std::uint8_t, stop_q, 1, 0)        \
  X(std::uint8_t, wr_q, 1, 0)          \
  X(std::uint32_t, duty_on_q, 17, 0)   \
  X(std::uint32_t, duty_off_q, 17, 0)  \
  X(std::uint32_t, hold_q, 17, 0)      \
  X(std::int32_t, filt_q, 20, 0)       \
  X(std::int16_t, max_q, 16, 0)        \
  X(std::int16_t, min_q, 16, 0)        \
  X(std::uint16_t, ticks_q, 16, 0)     \
  X(std::uint16_t, on_ticks_q, 16, 0)  \
  X(std::uint32_t, sum_ticks_q, 18, 0) \
  X(std::uint32_t, sum_on_q, 18, 0)    \
  X(std::uint32_t, sum_swing_q, 18, 0) \
  X(std::uint16_t, limit_q, 14, 0)     \
  X(std::uint16_t, ku_q, 16, 0)        \
  X(std::uint16_t, kp_q, 16, 0)        \
  X(std::uint8_t, wr_index_q, 6, 0)    \
  X(std::uint16_t, wr_data_q, 16, 0)   \
  X(std::uint8_t, md_q, 6, 0)          \
  X(std::uint64_t, acc_q, 36, 0)       \
  X(std::uint32_t, rem_q, 18, 0)

struct AtuneIn {
  bool tune;
  bool run;
  bool sample;
  bool tenth;
  bool commit;
  std::int16_t pv;
  std::int16_t sp_work;
  std::int16_t amb;
  bool ramping;
  std::uint32_t duty_max;
  std::uint16_t window;  // AT_WINDOW, 0.1 degC
};

struct Atune {
  TC_ATUNE_FLOPS(TC_DECLARE_FLOP)

  void step(const AtuneIn& in);
  // Between its events nothing counts: there is nothing to skip.
  std::uint64_t quiet(const AtuneIn& in) const;

  // Of what decides over the heater until the relay switches, for GUARD; and whether the next clock leaves it
  // as it is.
  bool parity() const;
  bool still(const AtuneIn& in) const;
  bool tuning() const { return phase_q != kTuneIdle; }
  bool wr() const { return wr_q != 0; }  // a gain for MEM, until a clock without a commit
  // Duty of the relay, UQ1.16; once the results are in the making, the hold duty.
  std::uint32_t duty() const {
    return phase_q == kTuneResults || phase_q == kTuneCommit ? hold_q : on_q != 0 ? duty_on_q : duty_off_q;
  }
  // Registers AT_STATE and AT_TU.
  std::uint16_t state() const { return static_cast<std::uint16_t>(cycles_q << 8 | end_q); }
  std::uint16_t tu() const { return static_cast<std::uint16_t>(sum_ticks_q > 0xFFFF ? 0xFFFF : sum_ticks_q); }

 private:
  struct Operands {
    std::uint32_t x, k, y;
  };
  bool searching() const { return phase_q == kTuneApproach || phase_q == kTuneCycle; }
  void take_sample(const AtuneIn& in);
  Operands operands(const AtuneIn& in) const;
  void step_arithmetic(const Operands& op);
  void end_cycle(const AtuneIn& in, std::uint64_t quotient);
  void take_result(const AtuneIn& in, std::uint64_t quotient);
  std::uint32_t mean_duty(const AtuneIn& in, std::uint64_t share) const;
};

}  // namespace meltstage::chip
