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
      {.fault = kFaultOverTemp,
       .name = "OverTemp",
       .settings = {setpoint, any_rate, short_pwm},
       .heating = true,
       .sound = cool,
       .broken = at_degc(155.0),
       .mend = cool,
       .cause_stays = true},
      {.fault = kFaultOverTemp,
       .name = "OverTempIdle",
       .settings = {any_rate},
       .heating = false,
       .sound = cool,
       .broken = at_degc(155.0),
       .mend = cool,
       .cause_stays = true},
      {.fault = kFaultUnderTemp,
       .name = "UnderTemp",
       .settings = {setpoint, any_rate, short_pwm, {kRegTMin, 100}},
       .heating = true,
       .sound = cool,
       .broken = at_degc(4.0),
       .mend = cool,
       .cause_stays = true},
      {.fault = kFaultSensorFault,
       .name = "SensorOpen",
       .settings = {setpoint, short_pwm},
       .heating = true,
       .sound = cool,
       .broken = sensor({.probe = ProbeFault::open}),
       .mend = sensor({}),
       .cause_stays = true},
      {.fault = kFaultSensorFault,
       .name = "SensorShortToGround",
       .settings = {setpoint, short_pwm, {kRegBadMax, 1}},
       .heating = true,
       .sound = cool,
       .broken = sensor({.probe = ProbeFault::short_to_ground}),
       .mend = sensor({}),
       .cause_stays = true},
      {.fault = kFaultSensorFault,
       .name = "SensorShortToSupply",
       .settings = {setpoint, short_pwm, {kRegBadMax, 2}},
       .heating = true,
       .sound = cool,
       .broken = sensor({.probe = ProbeFault::short_to_supply}),
       .mend = sensor({}),
       .cause_stays = true},
      {.fault = kFaultSensorFrame,
       .name = "SensorFrame",
       .settings = {setpoint, short_pwm},
       .heating = true,
       .sound = cool,
       .broken = sensor({.reserved_bits_wrong = true}),
       .mend = sensor({}),
       .cause_stays = true},
      {.fault = kFaultSensorFrame,
       .name = "SensorStuckLow",
       .settings = {setpoint, any_rate, short_pwm},
       .heating = true,
       .sound = cool,
       .broken = sensor({.miso = MisoFault::stuck_low}),
       .mend = sensor({}),
       .cause_stays = true},
      {.fault = kFaultSensorStale,
       .name = "SensorStale",
       .settings = {setpoint, short_pwm, {kRegBadMax, 15}, {kRegSampleTimeout, 1}},
       .heating = true,
       .sound = cool,
       .broken = sensor({.miso = MisoFault::absent}),
       .mend = sensor({}),
       .cause_stays = true},
      {.fault = kFaultRate,
       .name = "Rate",
       .settings = {setpoint, short_pwm},
       .heating = true,
       .sound = cool,
       .broken = at_degc(75.0),
       .mend = at_degc(75.0),
       .cause_stays = false},
      {.fault = kFaultNotHeating,
       .name = "NotHeating",
       .settings = {setpoint, short_pwm, {kRegLbaTime, 2}},
       .heating = true,
       .sound = cool,
       .broken = nothing,
       .mend = nothing,
       .cause_stays = false},
      {.fault = kFaultHoldPower,
       .name = "HoldPower",
       .settings = {setpoint,
                    any_rate,
                    short_pwm,
                    {kRegKd, 0},
                    {kRegHoldMult, 0},
                    {kRegHoldAdd, 0},
                    {kRegHoldTime, 1},
                    {kRegLbaTime, 0}},
       .heating = true,
       .sound = cool,
       .broken = at_degc(99.0),
       .mend = nothing,
       .cause_stays = false},
      {.fault = kFaultExcursion,
       .name = "Excursion",
       .settings = {setpoint, any_rate, short_pwm, {kRegExcLimit, 20}, {kRegExcTime, 1}},
       .heating = true,
       .sound = at_degc(99.5),
       .broken = at_degc(110.0),
       .mend = nothing,
       .cause_stays = false},
      {.fault = kFaultZeroRise,
       .name = "ZeroRise",
       .settings = {any_rate, {kRegZeroWait, 1}, {kRegZeroRise, 50}},
       .heating = false,
       .sound = cool,
       .broken = at_degc(70.0),
       .mend = cool,
       .cause_stays = true},
      {.fault = kFaultHeaterFb,
       .name = "SwitchOpen",
       .settings = {setpoint, short_pwm, {kRegFbTime, 4}},
       .heating = true,
       .sound = cool,
       .broken = feedback(Feedback::stuck_low),
       .mend = feedback(Feedback::follows),
       .cause_stays = false},
      {.fault = kFaultHeaterFb,
       .name = "SwitchShorted",
       .settings = {{kRegFbTime, 4}},
       .heating = false,
       .sound = cool,
       .broken = feedback(Feedback::stuck_high),
       .mend = feedback(Feedback::follows),
       .cause_stays = true},
      {.fault = kFaultHostWatchdog,
       .name = "HostWatchdog",
       .settings = {setpoint, short_pwm, {kRegHostWd, 2}},
       .heating = true,
       .sound = cool,
       .broken = nothing,
       .mend = nothing,
       .cause_stays = false},
      {.fault = kFaultParam,
       .name = "ParamActive",
       .settings = {setpoint, short_pwm},
       .heating = true,
       .sound = cool,
       .broken = flip_two_active,
       .mend = rewrite,
       .cause_stays = true},
      {.fault = kFaultParam,
       .name = "ParamStaged",
       .settings = {setpoint, short_pwm},
       .heating = true,
       .sound = cool,
       .broken = flip_two_staged,
       .mend = discard,
       .cause_stays = true},
      {.fault = kFaultState,
       .name = "StateIllegal",
       .settings = {setpoint, short_pwm},
       .heating = true,
       .sound = cool,
       .broken = illegal_state,
       .mend = nothing,
       .cause_stays = false},
      {.fault = kFaultState,
       .name = "TickLate",
       .settings = {setpoint, short_pwm},
       .heating = true,
       .sound = cool,
       .broken = late_tick,
       .mend = nothing,
       .cause_stays = false},
      {.fault = kFaultInhibit,
       .name = "Inhibit",
       .settings = {setpoint, short_pwm, no_feedback},
       .heating = true,
       .sound = cool,
       .broken = inhibit(true),
       .mend = inhibit(false),
       .cause_stays = true},
      {.fault = kFaultInhibit,
       .name = "InhibitIdle",
       .settings = {},
       .heating = false,
       .sound = cool,
       .broken = inhibit(true),
       .mend = inhibit(false),
       .cause_stays = true},
  };
}

}  // namespace

const std::vector<FaultScenario>& fault_scenarios() {
  static const std::vector<FaultScenario> list = make();
  return list;
}

}  // namespace meltstage::tb
