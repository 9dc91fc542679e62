// SPDX-License-Identifier: Apache-2.0
// Pieces of the functional set: counters of time run to their ends.
#include "asic/signoff/protection_steps.hpp"

namespace meltstage::app {

namespace {

class LongTimePieces : private ProtectionSteps {
 public:
  explicit LongTimePieces(PieceState& state) : ProtectionSteps(state) {}

  void record() {
    long_heating();
    long_heating_limits();
    long_zero_duty();
    long_full_duty();
    long_without_samples();
  }

 private:
  std::uint64_t long_time() const { return std::uint64_t{quick_ ? 3000U : 58000U} * kTestTenth; }

  // Counts of 0.1 s, as many at a time as can be.
  void count_while_heating() {
    start_work();
    heat_calmly(1000, 2000);
    Parameters p = now_;
    p[spec::kRegSetpoint] = 1500;
    p[spec::kRegBandFull] = p[spec::kRegBandOff] = 5000;
    p[spec::kRegCtrl] = kDither;
    p[spec::kRegKp] = 0;
    p[spec::kRegKiApproach] = p[spec::kRegKiHold] = kTopTime;
    p[spec::kRegKd] = 0;
    p[spec::kRegKff] = 1;
    p[spec::kRegHoldMult] = p[spec::kRegHoldAdd] = 0;
    p[spec::kRegTlmPeriod] = 1;
    write_range(p, spec::kRegSetpoint, spec::kRegHoldAdd);
    s_.ticks(3);  // the integral is at its top, and stays there
    p[spec::kRegKiApproach] = p[spec::kRegKiHold] = 0;
    p[spec::kRegSetpoint] = 1000;
    p[spec::kRegAtWindow] = 1000;
    p[spec::kRegAtDwell] = kTopTime;
    p[spec::kRegExcLimit] = 10;
    p[spec::kRegExcTime] = p[spec::kRegHoldTime] = kTopTime;
    p[spec::kRegHostWd] = kTopTime;
    write_range(p, spec::kRegSetpoint, spec::kRegHoldTime);
    s_.ticks(2);
    s_.set_temperature(of_tenths(1050));
    now_ = p;
    s_.run(long_time());
    expect_heating();
  }

  // To their top; telemetry shows the time left of the watchdog.
  void long_heating() {
    begin("long times: hold power, excursion, at-temperature, watchdog");
    count_while_heating();
    look();
    s_.ticks();
    look();
    if (!quick_) {
      constexpr std::uint64_t kToTheTop = 10000;  // 0.1 s
      for (std::uint64_t i = 0; i < kToTheTop && heating(); ++i) s_.run(kTestTenth);
      if (heating()) s_.fail("no detector tripped at its top");
    }
    look();
  }

  void long_heating_limits() {
    begin("long times: the limits of hold power and excursion fall below their counts");
    count_while_heating();
    look();                                                // the watchdog begins anew
    const std::uint16_t all_high = quick_ ? 3072 : 61440;  // bits that the limits then don't have
    while (heating() && s_.chip().guard.exc_q < all_high) s_.run(kTestTenth);
    expect_heating();
    set(spec::kRegLbaTime, kTopTime);
    set(spec::kRegHoldTime, 1);
    s_.ticks();
    if (s_.chip().guard.hold_test_q == 0) s_.fail("found none, expected HoldPower's test");
    look();
    set(spec::kRegExcTime, 1);
    s_.ticks();
    if (faults() != bit(spec::kFaultExcursion))
      s_.fail("found faults " + std::to_string(faults()) + ", expected Excursion");
    look();
  }

  void long_zero_duty() {
    begin("long times: rise at zero duty, frozen sample, telemetry");
    start_work();
    heat_calmly(1000, 10);
    set(spec::kRegMode, kManual);
    set(spec::kRegLbaTime, kTopTime);
    set(spec::kRegZeroWait, kTopTime);
    set(spec::kRegZeroRise, 80);
    set(spec::kRegTlmPeriod, 43690);
    s_.ticks();
    s_.run(long_time());
    expect_heating();
    look();
    set(spec::kRegZeroWait, 0);  // below its count: nothing has risen
    s_.ticks();
    expect_heating();
    set(spec::kRegLbaTime, 1);
    s_.ticks();
    if (faults() != bit(spec::kFaultSensorStale)) s_.fail("a frozen sample did not trip");
    look();
  }

  void long_full_duty() {
    begin("long times: full duty without a rise, its limit moved ahead of the count");
    start_work();
    heat_calmly(1000, 60);
    set(spec::kRegCtrl, kDither);
    set(spec::kRegBandFull, 0);
    set(spec::kRegLbaRise, 20);
    set(spec::kRegSetpoint, kSetpointTop);
    s_.ticks(2);
    set(spec::kRegLbaTime, kTopTime);
    const std::int32_t top = quick_ ? 1500 : 33000;
    for (std::int32_t count = s_.chip().guard.lba_q; count < top; count = s_.chip().guard.lba_q) {
      set(spec::kRegLbaTime, clamp_to(spec::kRegLbaTime, count + 2000 + any_size(0, 30000)));
      s_.run(1000 * kTestTenth);
      expect_heating();
    }
    set(spec::kRegLbaTime, s_.chip().guard.lba_q + 1500);
    expect_trip(spec::kFaultNotHeating, 1700);
  }

  // Nothing latches with the heater off, so limits may be anywhere.
  void long_without_samples() {
    begin("long times: no good sample, rise at zero duty, limits on either side");
    start_work();
    set(spec::kRegTs, 10);
    set(spec::kRegZeroWait, kTopTime);
    s_.ticks(2);
    s_.sensor().set(0xFFFF, 16, 0);
    constexpr unsigned kLooks = 60;
    for (unsigned i = 0; i < kLooks; ++i) {
      s_.run(long_time() / kLooks);
      const std::int32_t near = s_.chip().guard.stale_q + (one_in(2) ? 1 : -1) * any_size(1, 3000);
      const std::int32_t limit = clamp_to(spec::kRegSampleTimeout, near);
      set(spec::kRegSampleTimeout, limit);
      s_.ticks(2);
      expect_cause(spec::kFaultSensorStale, s_.chip().guard.stale_q >= limit);
      s_.read_loop();
    }
    write_all(now_ = calm());
    sample(of_tenths(1000));
  }
};

}  // namespace

void record_long_times(PieceState& state) { LongTimePieces(state).record(); }

}  // namespace meltstage::app
