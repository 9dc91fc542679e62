// SPDX-License-Identifier: Apache-2.0
// GUARD: the reading must be where the heater's heat leads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "guard_bench.hpp"

namespace meltstage::chip {
namespace {

using namespace spec;

constexpr int kLow = 5 * 65536 / 16;  // of full duty, 2^-16 / 5
constexpr int kHigh = 5 * 65536 * 3 / 32;
constexpr int kComputation = 27;  // clocks

// PH-1: 0.45 % a degree, time constant 300 s.
struct Heated : Bench {
  static constexpr double kKff = 0.0045;
  static constexpr double kTau_s = 300.0;

  Heated() {
    set(kRegHostWd, 0);
    set(kRegSampleTimeout, 65535);
    set(kRegDtdtMax, 0);
    set(kRegLbaTime, 0);
    set(kRegHoldTime, 0);
    set(kRegZeroRise, 0);
    set(kRegExcLimit, 5000);
    set(kRegTMax, 5000);
    set(kRegKff, static_cast<int>(std::lround(kKff * 4194304.0)));
    set_rate(static_cast<unsigned>(std::lround(13107.2 / kTau_s)));
    in.duty = 0;
    tenth();
    run();
  }
  void set_rate(unsigned rate) {
    set(kRegCtrl, static_cast<int>((p[kRegCtrl] & ~kCtrlHeatRateMask) | rate << kCtrlHeatRate));
  }
  unsigned rate() const { return static_cast<unsigned>(p[kRegCtrl]) >> kCtrlHeatRate; }
  void tenth() {
    in.tenth = true;
    clocks(kComputation + 3);
  }
  std::int64_t need(int pv) const {
    return (std::int64_t{p[kRegKff]} * (5 * pv - 32 * p.s16(kRegTAmb))) >> 12;
  }
  bool tripped() const { return g.fault_q != 0; }
};

// A head of the first order, as the detector knows it; the reading is 1/64 degC.
struct FirstOrder {
  double degc = 25.0;
  int after_tenth(double duty, double tau_s) {
    degc += 0.1 / tau_s * (duty / Heated::kKff - (degc - 25.0));
    return static_cast<int>(std::lround(degc * 64.0));
  }
};

// `reading(time, head)` in 1/64 degC under the duty of a heat-up and a hold; when it trips, 0.1 s; -1 never.
template <class Reading>
int trips_after(Heated& b, double head_tau_s, const Reading& reading) {
  FirstOrder head;
  for (int t = 0; t < 12000; ++t) {
    b.in.duty = t < 1200 ? 65536 : 25000;
    const int true_pv = head.after_tenth(b.in.duty / 65536.0, head_tau_s);
    b.sample(reading(t, true_pv));
    b.tenth();
    if (b.tripped()) return t;
  }
  return -1;
}

TEST(GuardHeat, NeverTripsWhereTheReadingFollows) {
  for (double head_tau_s : {200.0, 300.0, 450.0}) {
    Heated b;
    EXPECT_EQ(trips_after(b, head_tau_s, [](int, int pv) { return pv; }), -1) << head_tau_s;
  }
}

TEST(GuardHeat, TripsWhereASensorComesOffSlowly) {
  const auto comes_off = [](double seconds) {
    return [seconds](int t, int pv) {
      const double left = 1.0 - 0.4 * std::clamp((t - 6000) / (10.0 * seconds), 0.0, 1.0);
      return static_cast<int>(kRoom + left * (pv - kRoom));
    };
  };
  for (double seconds : {5.0, 15.0, 30.0, 60.0}) {
    Heated b;
    const int at = trips_after(b, 300.0, comes_off(seconds));
    EXPECT_GT(at, 6000) << seconds;
    EXPECT_LT(at, 6000 + 10 * seconds) << seconds;
    EXPECT_EQ(b.g.fault_q, mask(kFaultNotHeating));
  }
}

TEST(GuardHeat, TripsWhereTheHeaterIsOpen) {
  Heated b;
  const int at = trips_after(b, 300.0, [](int, int) { return kRoom; });
  EXPECT_NEAR(at, 275, 20);  // (1 - exp(-9 t / 300 s)) / 9 = 1/16
  EXPECT_EQ(b.g.fault_q, mask(kFaultNotHeating));
}

// A shorted switch heats although the duty is low.
TEST(GuardHeat, TripsWhereTheReadingRisesWithoutHeat) {
  Heated b;
  const int at = trips_after(
      b, 300.0, [](int t, int pv) { return t < 6000 ? pv : pv + (t - 6000) * 3; });  // 0.47 degC/s
  EXPECT_GT(at, 6000);
  EXPECT_LT(at, 7200);
  EXPECT_EQ(b.g.fault_q, mask(kFaultZeroRise));
}

TEST(GuardHeat, TripsBeyondTheBandExactly) {
  for (int sign : {1, -1}) {
    for (int beyond : {0, 1}) {
      Heated b;
      b.samples(kRoom + 3000);
      b.g.heat_seen_q = (b.need(b.g.pv_q) + sign * ((sign > 0 ? kLow : kHigh) + beyond)) * 4096;
      b.tenth();
      EXPECT_EQ(b.g.fault_q, beyond == 0 ? 0 : mask(sign > 0 ? kFaultNotHeating : kFaultZeroRise)) << sign;
    }
  }
}

TEST(GuardHeat, MovesByTheDutyThatIsLeft) {
  for (int pv : {kRoom - 1000, kRoom, kRoom + 5000}) {
    for (unsigned duty : {0u, 1u, 40000u, 65536u}) {
      Heated b;
      b.samples(pv);
      b.set_rate(0x155);
      b.in.duty = duty;
      b.g.heat_seen_q = (b.need(pv) + 1234) * 4096 + 77;
      const std::int64_t before = b.g.heat_seen_q;
      b.tenth();
      const std::int64_t left = 5 * std::int64_t{duty} - b.need(pv) - 8 * 1234;
      EXPECT_EQ(b.g.heat_seen_q, before + ((left * b.rate()) >> 5)) << pv << " " << duty;
    }
  }
}

TEST(GuardHeat, StartsFromTheReadingWhenHeatingBegins) {
  Heated b;
  b.in.stop = true;
  b.clock();
  b.g.heat_seen_q = 1;
  b.samples(kRoom + 4000);
  b.tenth();
  EXPECT_EQ(b.g.heat_seen_q, b.need(kRoom + 4000) * 4096);
  EXPECT_EQ(b.g.cause_q, 0);
}

TEST(GuardHeat, IsOffAtRateZero) {
  Heated b;
  b.set_rate(0);
  EXPECT_EQ(trips_after(b, 300.0, [](int, int) { return kRoom; }), -1);
}

// A rate that is set while heating is on, as at the end of a commissioning, starts from the reading.
TEST(GuardHeat, SwitchedOnWhileHeatingStartsFromTheReading) {
  Heated b;
  const unsigned rate = b.rate();
  b.set_rate(0);
  for (int pv = kRoom; pv < kRoom + 5000; pv += 50) {
    b.sample(pv);
    b.tenth();
  }
  b.set_rate(rate);
  b.in.duty = static_cast<std::uint32_t>(b.need(b.g.pv_q) / 5);
  for (int t = 0; t < 100; ++t) b.tenth();
  EXPECT_EQ(b.g.fault_q, 0);
}

// A register that seen is told in may change while heating is on, also in the middle of the computation.
TEST(GuardHeat, ANewKffOrAmbientStartsFromTheReading) {
  for (const Reg reg : {kRegKff, kRegTAmb}) {
    for (int clock = 0; clock <= kComputation + 3; ++clock) {
      Heated b;
      const unsigned rate = b.rate();
      b.set_rate(0);
      b.samples(kRoom + 5000);
      b.tenth();
      b.set_rate(rate);
      b.in.duty = static_cast<std::uint32_t>(b.need(b.g.pv_q) / 5);
      for (int t = 0; t < 10; ++t) b.tenth();
      b.in.tenth = true;
      b.clocks(clock);
      b.set(reg, b.p[reg] / 3);
      b.clocks(kComputation + 3);
      b.in.duty = static_cast<std::uint32_t>(b.need(b.g.pv_q) / 5);
      for (int t = 0; t < 100; ++t) b.tenth();
      EXPECT_EQ(b.g.fault_q, 0) << reg << " at clock " << clock;
      EXPECT_EQ(b.g.heat_known_q, 1);
    }
  }
}

TEST(GuardHeat, SwitchedOffLeavesNoCause) {
  Heated b;
  b.in.stop = true;
  b.clock();
  b.g.heat_low_q = b.g.heat_high_q = 1;
  b.set_rate(0);
  b.tenth();
  EXPECT_EQ(b.g.heat_step_q, 0);
  EXPECT_EQ(b.g.cause_q, 0);
}

}  // namespace
}  // namespace meltstage::chip
