// SPDX-License-Identifier: Apache-2.0
// GUARD: accepts samples, watches for faults, decides whether the heater may be on. Twin of rtl/tc_guard.sv.
#pragma once

#include <array>
#include <cstdint>

#include "flops.hpp"
#include "params.hpp"
#include "sync.hpp"

namespace meltstage::chip {

#define TC_GUARD_FLOPS(X)                  \
  X(std::uint8_t, run_q, 1, 0)             \
  X(std::uint8_t, run_nq, 1, 1)            \
  X(std::uint8_t, heater_q, 1, 0)          \
  X(std::uint8_t, safe_en_q, 1, 0)         \
  X(std::uint16_t, safe_cnt_q, 10, 0)      \
  X(std::uint16_t, cause_q, 15, 0)         \
  X(std::uint16_t, fault_q, 15, 0)         \
  X(std::uint8_t, first_q, 4, 0)           \
  X(std::uint8_t, watch_parity_q, 2, 0)    \
  X(std::uint8_t, watch_still_q, 2, 0)     \
  X(std::uint8_t, pv_valid_q, 1, 0)        \
  X(std::uint8_t, bad_dev_q, 1, 0)         \
  X(std::uint8_t, settled_q, 1, 0)         \
  X(std::int16_t, pv_q, 16, 0)             \
  X(std::int16_t, slope_q, 16, 0)          \
  X(std::uint16_t, samples_q, 16, 0)       \
  X(std::uint16_t, sensor_errors_q, 16, 0) \
  X(std::uint16_t, stale_q, 16, 0)         \
  X(std::uint8_t, bad_q, 4, 0)             \
  X(std::int16_t, rate_ref_q, 16, 0)       \
  X(std::uint8_t, rate_cnt_q, 4, 0)        \
  X(std::int16_t, lba_ref_q, 16, 0)        \
  X(std::int16_t, hold_ref_q, 16, 0)       \
  X(std::int16_t, zero_ref_q, 16, 0)       \
  X(std::int16_t, sp_past_q, 16, 0)        \
  X(std::uint16_t, lba_q, 16, 0)           \
  X(std::uint16_t, hold_q, 16, 0)          \
  X(std::uint8_t, hold_test_q, 1, 0)       \
  X(std::uint8_t, hold_shown_q, 5, 0)      \
  X(std::uint16_t, exc_q, 16, 0)           \
  X(std::uint16_t, zero_q, 16, 0)          \
  X(std::uint16_t, frozen_q, 16, 0)        \
  X(std::uint16_t, wd_q, 16, 0)            \
  X(std::uint16_t, at_q, 16, 0)            \
  X(std::uint32_t, fb_q, 20, 0)            \
  X(std::uint8_t, exc_armed_q, 1, 0)       \
  X(std::uint8_t, rate_q, 1, 0)            \
  X(std::uint8_t, lba_trip_q, 1, 0)        \
  X(std::int32_t, temp_sum_q, 20, 0)       \
  X(std::uint32_t, duty_sum_q, 21, 0)      \
  X(std::uint8_t, heat_step_q, 5, 0)       \
  X(std::int32_t, heat_x_q, 32, 0)         \
  X(std::int64_t, heat_acc_q, 40, 0)       \
  X(std::int64_t, heat_seen_q, 40, 0)      \
  X(std::uint16_t, heat_set_q, 16, 0)      \
  X(std::uint8_t, heat_known_q, 1, 0)      \
  X(std::uint8_t, heat_low_q, 1, 0)        \
  X(std::uint8_t, heat_high_q, 1, 0)       \
  X(std::uint8_t, at_temp_q, 1, 0)

struct GuardIn {
  const Params& params;
  bool tenth;
  bool sens_done;
  bool sens_ok;
  bool sens_dev_fault;
  std::int16_t sens_pv;      // Q9.6 degC
  std::uint32_t duty;        // UQ1.16
  std::uint32_t hold_limit;  // hold power, UQ2.16
  bool limited;
  std::uint8_t segment;  // spec::kSeg*
  std::int16_t sp_work;  // working set-point, Q9.6 degC
  bool ramping;
  bool pwm;
  bool run;  // pulses
  bool stop;
  bool clear;
  bool good_frame;
  bool mem_bad;
  bool state_illegal;
  bool overrun;
  std::uint8_t watch_parity;  // of flops that decide over the heater for longer than a control tick: ALGOR
                              // with ATUNE, PWMC
  std::uint8_t watch_still;   // and whether the next clock leaves them as they are
  bool inhibit;
  bool heater_fb;
};

// Clocks between two edges of safe_en_o while heating is permitted.
inline constexpr unsigned kSafeEnClocks = 1024;

struct Guard {
  TC_GUARD_FLOPS(TC_DECLARE_FLOP)

  friend bool operator==(const Guard& a, const Guard& b);

  void step(const GuardIn& in);

  // heater_fb alone may change meanwhile, as `feedback` says.
  std::uint64_t quiet(const GuardIn& in, const Sync::Seen& feedback) const;
  void skip(const GuardIn& in, const Sync::Seen& feedback, std::uint64_t clocks);
  // Clock in which safe_en_o moves next, from 1; kForever when it stands.
  std::uint64_t clocks_to_safe_edge() const { return run_q != 0 ? kSafeEnClocks - safe_cnt_q : kForever; }

  bool bad_limit(const Params& p) const { return bad_q >= (p[spec::kRegBadMax] & 0xF); }
  bool run_allowed() const { return fault_q == 0 && cause_q == 0 && pv_valid_q != 0; }
  bool sensor_ok(const Params& p) const;
  bool wd_armed(const Params& p) const { return run_q != 0 && p[spec::kRegHostWd] != 0; }
  // Time left of the host watchdog, 0.1 s.
  std::uint16_t wd_left(const Params& p) const;
  bool permitted() const { return run_q != 0 && fault_q == 0; }

  // Of the last accepted samples, in which noise is small; 1/64 degC.
  std::int16_t mean_temp() const { return static_cast<std::int16_t>(temp_sum_q >> 4); }

 private:
  std::uint64_t clocks_of_product() const;
  std::uint64_t clocks_to_feedback_event(const Sync::Seen& feedback, std::uint32_t trip) const;
  struct Sample;
  struct Seen;
  Sample judge_sample(const GuardIn& in) const;
  bool judges_hold(const GuardIn& in) const;
  Seen look(const GuardIn& in) const;
  std::uint16_t causes(const GuardIn& in, const Sample& sample, const Seen& seen) const;
  void step_loop_break(const GuardIn& in, const Seen& seen);
  void step_hold_power(const GuardIn& in, const Seen& seen);
  void step_excursion(const GuardIn& in, const Seen& seen);
  void step_zero_rise(const GuardIn& in, const Sample& sample, const Seen& seen);
  void step_heat_balance(const GuardIn& in);
  void step_feedback(const GuardIn& in, const Seen& seen);
  void step_at_temp(const GuardIn& in, const Seen& seen);
  void step_detectors(const GuardIn& in, const Sample& sample, const Seen& seen);
  void step_permission(const GuardIn& in, const Seen& seen, std::uint16_t cause);
  void step_rate_reference(const GuardIn& in, const Sample& sample);
  void take_means(const GuardIn& in, const Sample& sample);
  void take_sample(const GuardIn& in, const Sample& sample);
};

}  // namespace meltstage::chip
