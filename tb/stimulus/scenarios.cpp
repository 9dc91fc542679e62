// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/scenarios.hpp"

namespace meltstage::tb {

namespace {

using Act = std::function<void(Bench&)>;

Act at_degc(double temperature) {
  return [=](Bench& bench) { bench.world.temperature_degc = temperature; };
}
Act sensor(SpiFaults faults) {
  return [=](Bench& bench) { bench.world.sensor = faults; };
}
Act feedback(Feedback level) {
  return [=](Bench& bench) { bench.world.feedback = level; };
}
Act inhibit(bool pressed) {
  return [=](Bench& bench) { bench.world.inhibit = pressed; };
}
void nothing(Bench&) {}

constexpr std::uint32_t kTwoFlips = 0b11;  // MEM corrects one flip and finds two

void flip_two_active(Bench& bench) {
  bench.poke([](chip::Chip& chip) { flip_active(chip, spec::kRegKp, kTwoFlips); });
}
void flip_two_staged(Bench& bench) {
  bench.poke([](chip::Chip& chip) { chip.mem.staged_q[spec::kRegKp] ^= kTwoFlips; });
}
// What a host does about it: take the sound set over.
void rewrite(Bench& bench) {
  bench.write(spec::kRegKp, static_cast<std::uint16_t>(spec::kHolding[spec::kRegKp].reset));
}
void discard(Bench& bench) { bench.write(spec::kRegCmd, spec::kCmdDiscard); }
void illegal_state(Bench& bench) {
  bench.poke([](chip::Chip& chip) { chip.sysctrl.state_q = 0b11111; });
}
// Two ticks fall due while the sensor is being read.
void late_tick(Bench& bench) {
  bench.run_until([](const chip::Chip& chip) { return chip.sysctrl.state_q == spec::kStReadTemp; }, 130'000);
  bench.poke([](chip::Chip& chip) {
    chip.sysctrl.tick_pend_q = 1;
    chip.sysctrl.ms_cnt_q = spec::kClkHz / 1000 - 2;
    chip.sysctrl.ts_cnt_q = static_cast<std::uint16_t>(chip.params()[spec::kRegTs] - 1);
  });
  bench.run(10);
}

std::vector<FaultScenario> make() {
  using namespace spec;
  const Setting setpoint{kRegSetpoint, 1000};  // 100 degC
  const Setting any_rate{kRegDtdtMax, 0};
  const Setting no_feedback{kRegCtrl, word_of({kCtrlSegModel, kCtrlDOnPv, kCtrlDither})};
  const Setting short_pwm{kRegPwmPeriod, 120};
  const Act cool = at_degc(60.0);
  return {
      {kFaultOverTemp, "OverTemp", {setpoint, any_rate, short_pwm}, true, cool, at_degc(155.0), cool, true},
      {kFaultOverTemp, "OverTempIdle", {any_rate}, false, cool, at_degc(155.0), cool, true},
      {kFaultUnderTemp,
       "UnderTemp",
       {setpoint, any_rate, short_pwm, {kRegTMin, 100}},
       true,
       cool,
       at_degc(4.0),
       cool,
       true},
      {kFaultSensorFault,
       "SensorOpen",
       {setpoint, short_pwm},
       true,
       cool,
       sensor({.probe = ProbeFault::open}),
       sensor({}),
       true},
      {kFaultSensorFault,
       "SensorShortToGround",
       {setpoint, short_pwm, {kRegBadMax, 1}},
       true,
       cool,
       sensor({.probe = ProbeFault::short_to_ground}),
       sensor({}),
       true},
      {kFaultSensorFault,
       "SensorShortToSupply",
       {setpoint, short_pwm, {kRegBadMax, 2}},
       true,
       cool,
       sensor({.probe = ProbeFault::short_to_supply}),
       sensor({}),
       true},
      {kFaultSensorFrame,
       "SensorFrame",
       {setpoint, short_pwm},
       true,
       cool,
       sensor({.reserved_bits_wrong = true}),
       sensor({}),
       true},
      {kFaultSensorFrame,
       "SensorStuckLow",
       {setpoint, any_rate, short_pwm},
       true,
       cool,
       sensor({.miso = MisoFault::stuck_low}),
       sensor({}),
       true},
      {kFaultSensorStale,
       "SensorStale",
       {setpoint, short_pwm, {kRegBadMax, 15}, {kRegSampleTimeout, 1}},
       true,
       cool,
       sensor({.miso = MisoFault::absent}),
       sensor({}),
       true},
      {kFaultRate, "Rate", {setpoint, short_pwm}, true, cool, at_degc(75.0), at_degc(75.0), false},
      {kFaultNotHeating,
       "NotHeating",
       {setpoint, short_pwm, {kRegLbaTime, 2}},
       true,
       cool,
       nothing,
       nothing,
       false},
      {kFaultHoldPower,
       "HoldPower",
       {setpoint,
        any_rate,
        short_pwm,
        {kRegKd, 0},
        {kRegHoldMult, 0},
        {kRegHoldAdd, 0},
        {kRegHoldTime, 1},
        {kRegLbaTime, 0}},
       true,
       cool,
       at_degc(99.0),
       nothing,
       false},
      {kFaultExcursion,
       "Excursion",
       {setpoint, any_rate, short_pwm, {kRegExcLimit, 20}, {kRegExcTime, 1}},
       true,
       at_degc(99.5),
       at_degc(110.0),
       nothing,
       false},
      {kFaultZeroRise,
       "ZeroRise",
       {any_rate, {kRegZeroWait, 1}, {kRegZeroRise, 50}},
       false,
       cool,
       at_degc(70.0),
       cool,
       true},
      {kFaultHeaterFb,
       "SwitchOpen",
       {setpoint, short_pwm, {kRegFbTime, 4}},
       true,
       cool,
       feedback(Feedback::stuck_low),
       feedback(Feedback::follows),
       false},
      {kFaultHeaterFb,
       "SwitchShorted",
       {{kRegFbTime, 4}},
       false,
       cool,
       feedback(Feedback::stuck_high),
       feedback(Feedback::follows),
       true},
      {kFaultHostWatchdog,
       "HostWatchdog",
       {setpoint, short_pwm, {kRegHostWd, 2}},
       true,
       cool,
       nothing,
       nothing,
       false},
      {kFaultParam, "ParamActive", {setpoint, short_pwm}, true, cool, flip_two_active, rewrite, true},
      {kFaultParam, "ParamStaged", {setpoint, short_pwm}, true, cool, flip_two_staged, discard, true},
      {kFaultState, "StateIllegal", {setpoint, short_pwm}, true, cool, illegal_state, nothing, false},
      {kFaultState, "TickLate", {setpoint, short_pwm}, true, cool, late_tick, nothing, false},
      {kFaultInhibit,
       "Inhibit",
       {setpoint, short_pwm, no_feedback},
       true,
       cool,
       inhibit(true),
       inhibit(false),
       true},
      {kFaultInhibit, "InhibitIdle", {}, false, cool, inhibit(true), inhibit(false), true},
  };
}

}  // namespace

const std::vector<FaultScenario>& fault_scenarios() {
  static const std::vector<FaultScenario> list = make();
  return list;
}

}  // namespace meltstage::tb
