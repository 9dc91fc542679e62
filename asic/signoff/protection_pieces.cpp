// SPDX-License-Identifier: Apache-2.0
// Pieces of the functional set: every fault of GUARD, right at its limit and at times of any size.
#include "asic/signoff/protection_steps.hpp"

namespace meltstage::app {

namespace {

class ProtectionPieces : private ProtectionSteps {
 public:
  explicit ProtectionPieces(PieceState& state) : ProtectionSteps(state) {}

  void record() {
    limits_of_temperature();
    bad_samples();
    not_heating();
    hold_power();
    excursion();
    frozen();
    stale();
    host_watchdog();
    heater_feedback();
    other_faults();
    limits_of_any_size();
  }

 private:
  // Limits of temperature, rate and rise right at the sample, on either side; heater off, each cause for
  // itself.
  void limits_of_temperature() {
    begin("protection: over- and under-temperature, rate, rise at zero duty, right at the limit");
    start_work();
    set(spec::kRegTs, 240);
    s_.ticks(2);
    for (unsigned i = 0; i < often(110, 30); ++i) {
      const chip::Guard& guard = s_.chip().guard;
      Parameters p = now_;
      std::int32_t pv = any_temperature(-390, 4900);
      const auto side = [&] { return static_cast<std::int32_t>(below(2)); };
      if (one_in(2))
        pv = (in_range(spec::kRegTMax) * kPerSixtyFourth + kPerTenthDegc - 1) / kPerTenthDegc - side();
      if (one_in(3)) pv = in_range(spec::kRegTMin) * kPerSixtyFourth / kPerTenthDegc + side();
      if (one_in(2)) pv = guard.pv_q + (one_in(2) ? 1 : -1) * any_size(1, 8000);
      pv = to_sensor(pv);
      p[spec::kRegTMax] = clamp_to(spec::kRegTMax, reached(pv) + side());
      p[spec::kRegTMin] = clamp_to(spec::kRegTMin, reached(pv) + side());
      const std::int32_t step = pv - guard.pv_q, drift = pv - guard.rate_ref_q;
      const std::int32_t change = std::max(std::abs(drift), 2 * std::min(std::abs(step), std::abs(drift)));
      p[spec::kRegDtdtMax] = one_in(4) ? 0 : clamp_to(spec::kRegDtdtMax, passed(change) + side());
      p[spec::kRegBadMax] = 1;
      p[spec::kRegZeroRise] =
          one_in(4) ? 0 : clamp_to(spec::kRegZeroRise, reached(pv - guard.zero_ref_q) + side());
      p[spec::kRegZeroWait] = one_in(4) ? in_range(spec::kRegZeroWait) : any_size(0, 300);
      const bool hot = pv * kPerTenthDegc >= p[spec::kRegTMax] * kPerSixtyFourth;
      const bool cold = pv * kPerTenthDegc < p[spec::kRegTMin] * kPerSixtyFourth;
      const bool rate = guard.settled_q != 0 && p[spec::kRegDtdtMax] != 0 &&
                        change * kPerTenthDegc > p[spec::kRegDtdtMax] * kPerSixtyFourth;
      write_range(p, spec::kRegTMax, spec::kRegSampleTimeout);
      sample(static_cast<std::int16_t>(pv));
      expect_cause(spec::kFaultOverTemp, hot);
      expect_cause(spec::kFaultUnderTemp, cold);
      expect_cause(spec::kFaultRate, rate);
      s_.read_loop();
    }
    write_all(now_ = calm());
    sample(of_tenths(250));
    s_.ticks(2);
    s_.command(spec::kCmdClearFault);
  }

  // Bad samples of both kinds, one fewer than BAD_MAX and as many.
  void bad_samples() {
    begin("protection: bad samples in a row");
    start_work();
    set(spec::kRegTs, 30);
    for (std::int32_t most = 1; most <= 15; most += quick_ ? 7 : 2) {
      for (const bool device : {false, true}) {
        sample(of_tenths(250));
        s_.command(spec::kCmdClearFault);
        set(spec::kRegBadMax, most);
        set(spec::kRegSensFaultMask, device ? 1 : 0);
        s_.ticks();
        heat();
        for (std::int32_t count = most - 1; count <= most; ++count) {
          s_.sensor().set(device ? 0x0C35 : 0xFFFF, 16, 0);
          s_.ticks(static_cast<unsigned>(count));
          const unsigned fault = device ? spec::kFaultSensorFault : spec::kFaultSensorFrame;
          if (count == most && faults() != bit(fault)) s_.fail("bad samples did not trip");
          if (count < most) expect_heating();
          sample(of_tenths(250));
        }
        s_.read_loop();
      }
    }
  }

  // Full duty without a rise, with a rise too small, with one that is enough and starts the time again.
  void not_heating() {
    begin("protection: NotHeating, times and rises of any size");
    start_work();
    for (unsigned i = 0; i < often(12, 3); ++i) {
      heat_calmly(1000, 20);
      set(spec::kRegCtrl, kDither);
      set(spec::kRegBandFull, 0);
      set(spec::kRegDutyMax, 100 + static_cast<std::int32_t>(below(9900)));
      set(spec::kRegSetpoint, kSetpointTop);
      const std::int32_t time = any_size(700, 2500), rise = any_size(1, 20000);
      const std::int32_t from = any_temperature(-390, 1000);
      set(spec::kRegLbaRise, clamp_to(spec::kRegLbaRise, reached(rise) + (i % 2 == 0 ? 1 : 0)));
      sample(to_sensor(from));
      await_means();
      set(spec::kRegLbaTime, time);
      s_.ticks(4);
      expect_heating();
      sample(to_sensor(from + rise));
      await_means();
      expect_trip(spec::kFaultNotHeating, static_cast<std::uint64_t>(time) + 4);
    }
  }

  // Duty just above the hold power begins the test of the reading, as much below does not. A reading that
  // then falls by LBA_RISE, from its highest on, is no fault, one that falls a little less is.
  void hold_power() {
    begin("protection: HoldPower, right at the limit, times of any size");
    start_work();
    for (unsigned i = 0; i < often(16, 5); ++i) {
      heat_calmly(1000, 20);
      Parameters p = now_;
      const std::int16_t pv = any_temperature(300, 3500);
      std::int32_t add = -1;
      while (add < 0 || add > 10000) {
        p[spec::kRegSetpoint] = std::min<std::int32_t>(in_range(spec::kRegSetpoint), kSetpointTop);
        p[spec::kRegKp] = in_range(spec::kRegKp);
        p[spec::kRegKiApproach] = p[spec::kRegKiHold] = p[spec::kRegKd] = 0;
        p[spec::kRegCtrl] = kDither;
        p[spec::kRegBandFull] = p[spec::kRegBandOff] = 5000;
        p[spec::kRegKff] = any_size(1, 4000);
        p[spec::kRegTAmb] = in_range(spec::kRegTAmb);
        p[spec::kRegHoldMult] = in_range(spec::kRegHoldMult);
        p[spec::kRegHoldAdd] = 0;
        const chip::Algor result = computed(p, pv);
        if (result.segment_q != chip::spec::kSegPid || result.duty_q <= result.hold_q) continue;
        // The largest addition that the duty still exceeds.
        add = 10000;
        while (add >= 0) {
          p[spec::kRegHoldAdd] = add;
          if (computed(p, pv).hold_q < result.duty_q) break;
          --add;
        }
      }
      const bool trips = i % 3 != 0;
      p[spec::kRegHoldAdd] = trips ? add : std::min(add + 1, 10000);
      p[spec::kRegHoldTime] = any_size(1, 1500);
      const std::int32_t fall = any_size(1, 2000);
      const bool falls = i % 2 == 0;
      p[spec::kRegLbaRise] = clamp_to(spec::kRegLbaRise, reached(fall) + (falls ? 0 : 1));
      p[spec::kRegLbaTime] = kTopTime;  // the duty may be at its limit
      const bool above = computed(p, pv).hold_q < computed(p, pv).duty_q;
      s_.set_temperature(pv);
      s_.command(spec::kCmdHold);
      write_range(p, spec::kRegSetpoint, spec::kRegHoldTime);
      s_.command(spec::kCmdCommit);
      s_.ticks();
      await_means();
      if (above) {
        await_test(static_cast<std::uint64_t>(p[spec::kRegHoldTime]) + 200);
        set(spec::kRegHoldTime, kTopTime);  // no second test
        s_.read_loop();
        sample(static_cast<std::int16_t>(pv - fall));
        await_means();
        if (fall * kPerTenthDegc >= p[spec::kRegLbaRise] * kPerSixtyFourth) {
          expect_heating();
          if (s_.chip().guard.hold_test_q != 0)
            s_.fail("found HoldPower's test, expected its end after the fall");
        } else {
          const std::int32_t time = one_in(3) ? 0 : any_size(1, 800);
          set(spec::kRegLbaTime, time);
          expect_trip(spec::kFaultHoldPower, 2 * static_cast<std::uint64_t>(time) + 4);
        }
      } else {
        s_.run(static_cast<std::uint64_t>(p[spec::kRegHoldTime] + 200) * kTestTenth);
        expect_heating();
        s_.read_loop();
      }
    }
  }

  // Above the set-point by the limit or a little less; inside the window or just outside.
  void excursion() {
    begin("protection: Excursion and at-temperature, right at the limit, times of any size");
    start_work();
    for (unsigned i = 0; i < often(12, 5); ++i) {
      const std::int32_t setpoint = 300 + 5 * static_cast<std::int32_t>(below(600));  // whole 1/64 degC
      heat_calmly(setpoint, 100);
      const std::int32_t over = any_size(40, 6000), time = any_size(1, 1200), dwell = any_size(1, 1200);
      const bool trips = i % 3 != 0, inside = one_in(2);
      set(spec::kRegTlmPeriod, 1);
      const std::int32_t window[] = {clamp_to(spec::kRegAtWindow, passed(over) + (inside ? 1 : 0)), dwell};
      s_.write(spec::kRegAtWindow, window);
      set(spec::kRegSetpoint, setpoint);
      s_.ticks(2);  // armed at the set-point
      const std::int32_t limit[] = {clamp_to(spec::kRegExcLimit, passed(over) + (trips ? 0 : 1)), time};
      s_.write(spec::kRegExcLimit, limit);
      s_.ticks();
      sample(to_sensor(of_tenths(setpoint) + over));
      look();
      const bool above = over * kPerTenthDegc > limit[0] * kPerSixtyFourth;
      if (above) {
        expect_trip(spec::kFaultExcursion, static_cast<std::uint64_t>(time) + 4);
      } else {
        s_.run(static_cast<std::uint64_t>(std::max(time, dwell) + 4) * kTestTenth);
        expect_heating();
        // Below the set-point by as much: at temperature or not, but no excursion.
        sample(to_sensor(of_tenths(setpoint) - over));
        s_.run(static_cast<std::uint64_t>(dwell + 4) * kTestTenth);
        expect_heating();
      }
      look();
    }
  }

  // A hot head at zero duty whose samples don't move, 20 degC above ambient or a little less.
  void frozen() {
    begin("protection: SensorStale by a frozen sample, right at the limit, times of any size");
    start_work();
    for (unsigned i = 0; i < often(10, 4); ++i) {
      heat_calmly(1000, 100);
      set(spec::kRegMode, kManual);
      const std::int32_t ambient = in_range(spec::kRegTAmb), time = any_size(1, 1500);
      const bool trips = i % 3 != 0;
      const std::int32_t hot = (ambient + 200) * kPerSixtyFourth / kPerTenthDegc;
      const std::int16_t pv = to_sensor(trips ? hot + 1 : hot - 1);
      const bool active = pv * kPerTenthDegc > (ambient + 200) * kPerSixtyFourth;
      sample(pv);
      set(spec::kRegTAmb, ambient);
      s_.ticks(2);
      set(spec::kRegLbaTime, time);
      s_.ticks();
      if (active) {
        expect_trip(spec::kFaultSensorStale, static_cast<std::uint64_t>(time) + 4);
      } else {
        s_.run(static_cast<std::uint64_t>(time + 4) * kTestTenth);
        expect_heating();
      }
    }
  }

  // The first sample behind SAMPLE_TIMEOUT or in time.
  void stale() {
    begin("protection: SensorStale, times of any size");
    start_work();
    for (unsigned i = 0; i < often(10, 4); ++i) {
      heat_calmly(1000, 60);
      const std::int32_t ts = any_size(60, 1500);
      const bool trips = i % 2 == 0;
      const std::int32_t values[] = {ts};
      s_.write(spec::kRegTs, values);
      set(spec::kRegSampleTimeout, trips ? ts - 3 : ts + 3);
      s_.ticks(2);
      if (trips) {
        if (faults() != bit(spec::kFaultSensorStale)) s_.fail("no stale sample");
      } else {
        expect_heating();
      }
      s_.read_loop();
      set(spec::kRegSampleTimeout, kTopTime);
      s_.ticks();
    }
  }

  // Telemetry shows the time left; the heater goes off with the last tenth.
  void host_watchdog() {
    begin("protection: HostWatchdog, times of any size");
    start_work();
    for (unsigned i = 0; i < often(8, 4); ++i) {
      heat_calmly(1000, 90);
      set(spec::kRegTlmPeriod, 1);
      const std::int32_t time = any_size(500, 3000);
      set(spec::kRegHostWd, time);
      s_.run(static_cast<std::uint64_t>(time) * 3 / 4 * kTestTenth);
      expect_heating();
      s_.ask(tb::diagnostic_echo(s_.address(), 0x5A5A));
      s_.run(static_cast<std::uint64_t>(time) * 3 / 4 * kTestTenth);
      expect_heating();
      expect_trip(spec::kFaultHostWatchdog, static_cast<std::uint64_t>(time));
      s_.command(spec::kCmdClearFault);
    }
  }

  // The switch stays on for as long as FB_TIME, or a clock less.
  void heater_feedback() {
    begin("protection: HeaterFb, times of any size");
    start_work();
    set(spec::kRegCtrl, kCalmCtrl | spec::word_of({spec::kCtrlFbEn}));
    s_.ticks(2);
    for (unsigned i = 0; i < often(10, 4); ++i) {
      constexpr std::uint64_t kFeedbackStep = 16;  // clocks
      const std::int32_t time = i == 0 ? (quick_ ? 5000 : 40000) : any_size(1, 3000);
      set(spec::kRegFbTime, time);
      s_.ticks(2);
      for (const std::uint64_t clocks : {kFeedbackStep * static_cast<std::uint64_t>(time) - 1,
                                         kFeedbackStep * static_cast<std::uint64_t>(time) + 1}) {
        s_.hold_feedback(true);
        s_.run(clocks);
        s_.free_feedback();
        s_.run(20);
      }
      if (faults() != bit(spec::kFaultHeaterFb)) s_.fail("HeaterFb did not trip");
      s_.read_loop();
      s_.command(spec::kCmdClearFault);
    }
    set(spec::kRegCtrl, kCalmCtrl);
  }

  // The other causes: emergency stop, a control period too short for its work, a rise at zero duty while
  // heating.
  void other_faults() {
    begin("protection: Inhibit, State, ZeroRise");
    start_work();
    heat();
    s_.set_inhibit(true);
    s_.run(1000);
    s_.refused(write_request(spec::kRegCmd, spec::kCmdClearFault), spec::kExcDevice);
    s_.refused(write_request(spec::kRegCmd, spec::kCmdRun), spec::kExcDevice);
    s_.set_inhibit(false);
    s_.run(100);
    look();
    heat_calmly(500, 10);
    set(spec::kRegSpiDiv, 255);
    expect_trip(spec::kFaultState, 2000);
    for (unsigned i = 0; i < often(6, 2); ++i) {
      heat_calmly(500, 100);
      set(spec::kRegMode, kManual);
      set(spec::kRegManualDuty, 100);  // starts the time at zero duty again
      s_.ticks(2);
      set(spec::kRegManualDuty, 0);
      s_.ticks(2);
      const std::int32_t rise = any_size(40, 8000);
      const std::int32_t values[] = {clamp_to(spec::kRegZeroRise, reached(rise)), any_size(1, 400)};
      s_.write(spec::kRegZeroRise, values);
      s_.run(static_cast<std::uint64_t>(values[1] + 200) * kTestTenth);
      expect_heating();
      sample(to_sensor(of_tenths(500) + rise - 7));
      expect_heating();
      sample(to_sensor(of_tenths(500) + rise));
      expect_trip(spec::kFaultZeroRise, 200);
    }
  }

  // Detectors with limits and temperatures of any size; which of them trips is left to chance.
  void limits_of_any_size() {
    begin("protection: limits of any size");
    start_work();
    for (unsigned i = 0; i < often(10, 8); ++i) {
      Parameters p = calm();
      p[spec::kRegTs] = 60;
      p[spec::kRegSetpoint] = static_cast<std::int32_t>(below(kSetpointTop));
      p[spec::kRegAtWindow] = in_range(spec::kRegAtWindow);
      p[spec::kRegAtDwell] = below(2) != 0 ? 0 : in_range(spec::kRegAtDwell);
      p[spec::kRegMode] = one_in(4) ? kManual : 0;
      p[spec::kRegManualDuty] = one_in(2) ? 0 : 10000;
      for (std::uint16_t reg = spec::kRegTMax; reg <= spec::kRegSampleTimeout; ++reg) {
        if (one_in(2)) p[reg] = in_range(reg);
      }
      p[spec::kRegTMax] = std::max<std::int32_t>(p[spec::kRegTMax], p[spec::kRegSetpoint] + 50);
      p[spec::kRegHostWd] = in_range(spec::kRegHostWd);
      write_all(calm());
      s_.set_temperature(any_temperature(-390, 4900));
      s_.ticks(2);
      if (causes() == 0) {
        s_.command(spec::kCmdClearFault);
        s_.command(spec::kCmdRun);
      }
      write_range(p, spec::kRegSetpoint, spec::kRegHoldMult);
      write_range(p, spec::kRegHoldAdd, spec::kRegSampleTimeout);
      for (unsigned n = 0; n < 4; ++n) {
        sample(any_temperature(-390, 4900));
        s_.read_loop();
      }
      look();
    }
    write_all(now_ = calm());
  }
};

}  // namespace

void record_protection(PieceState& state) { ProtectionPieces(state).record(); }

}  // namespace meltstage::app
