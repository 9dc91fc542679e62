// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdint>

#include "cmodel/guard.hpp"
#include "support.hpp"

namespace meltstage::chip {

inline constexpr std::uint16_t mask(spec::Fault fault) { return static_cast<std::uint16_t>(1u << fault); }
inline constexpr int kRoom = 25 * 64;

// A guard with reset parameters, a sample of 25 degC, heater wanted on all the time, and feedback that
// follows.
struct Bench {
  Params p = reset_params();
  Guard g;
  GuardIn in{.params = p,
             .tenth = false,
             .sens_done = false,
             .sens_ok = false,
             .sens_dev_fault = false,
             .sens_pv = 0,
             .duty = 1000,
             .hold_limit = 70000,
             .limited = false,
             .segment = spec::kSegPid,
             .sp_work = temp(100),
             .ramping = false,
             .pwm = true,
             .run = false,
             .stop = false,
             .clear = false,
             .good_frame = false,
             .mem_bad = false,
             .state_illegal = false,
             .overrun = false,
             .watch_parity = 0,
             .watch_still = 0,
             .inhibit = false,
             .heater_fb = false};
  bool feedback_follows = true;

  Bench() {
    sample(kRoom);
    g.settled_q = 1;
  }
  void set(spec::Reg reg, int value) { p.value[reg] = static_cast<std::uint16_t>(value); }
  void clock() {
    if (feedback_follows) in.heater_fb = g.heater_q != 0;
    g.step(in);
    in.tenth = in.sens_done = in.run = in.stop = in.clear = in.good_frame = in.overrun = false;
  }
  void clocks(int n) {
    for (int i = 0; i < n; ++i) clock();
  }
  // Pulses of 0.1 s, two clocks each.
  void tenths(int n) {
    for (int i = 0; i < n; ++i) {
      in.tenth = true;
      clock();
      clock();
    }
  }
  // No cause before so many of them; then this fault alone is latched.
  void expect_trip_after(int pulses, spec::Fault fault) {
    tenths(pulses - 1);
    EXPECT_EQ(g.cause_q, 0);
    tenths(1);
    clock();
    EXPECT_EQ(g.fault_q, mask(fault));
  }
  void sample(int pv) {
    in.sens_done = in.sens_ok = true;
    in.sens_pv = static_cast<std::int16_t>(pv);
    clock();
    clock();
  }
  // So many samples that the means are there.
  void samples(int pv) {
    for (int i = 0; i < 250; ++i) sample(pv);
  }
  void refuse(bool dev_fault) {
    in.sens_done = true;
    in.sens_ok = false;
    in.sens_dev_fault = dev_fault;
    clock();
    clock();
  }
  void run() {
    in.run = true;
    clock();
    ASSERT_EQ(g.run_q, 1);
    clock();
    ASSERT_EQ(g.heater_q, 1);
  }
  bool cause(spec::Fault fault) const { return (g.cause_q & mask(fault)) != 0; }
};

}  // namespace meltstage::chip
