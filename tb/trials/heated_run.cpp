// SPDX-License-Identifier: Apache-2.0
#include "tb/trials/heated_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

constexpr std::uint64_t kTenth = spec::kClkHz / 10;
constexpr std::uint64_t kPoll = spec::kClkHz;

}  // namespace

StepResponse step_response(const PlantConfig& config) {
  constexpr double kStep_s = 0.05;
  constexpr double kLength_s = 300.0;
  const ThermalNetwork network(config, 0.0);
  const PlantDrive drive{config.power_w, config.ambient_degc, 1.0};
  PlantState state{config.ambient_degc, config.ambient_degc, config.ambient_degc};
  StepResponse best{0.0, 0.0};
  for (double t = 0.0; t < kLength_s; t += kStep_s) {
    const PlantState next = network.advance(state, drive, kStep_s);
    const double rate = (next.sensor_degc - state.sensor_degc) / kStep_s;
    if (rate > best.rate_degc_per_s) {
      const double at_s = t + kStep_s / 2.0;
      const double rise = (next.sensor_degc + state.sensor_degc) / 2.0 - config.ambient_degc;
      best = {rate, config.transport_delay_s + at_s - rise / rate};
    }
    state = next;
  }
  return best;
}

std::vector<HeadSetting> detectors_off() {
  const std::int32_t no_feedback = spec::kHolding[spec::kRegCtrl].reset & ~(1 << spec::kCtrlFbEn);
  return {{spec::kRegTMax, 5000},           {spec::kRegTMin, -400},  {spec::kRegDtdtMax, 0},
          {spec::kRegLbaTime, 0},           {spec::kRegHoldTime, 0}, {spec::kRegExcLimit, 5000},
          {spec::kRegExcTime, 65535},       {spec::kRegZeroRise, 0}, {spec::kRegHostWd, 0},
          {spec::kRegSampleTimeout, 65535}, {spec::kRegBadMax, 15},  {spec::kRegCtrl, no_feedback}};
}

HeatedRun::HeatedRun(const HeadConfig& config, std::span<const HeadSetting> settings) : head_(config) {
  constexpr double kPowerUp_s = 0.01;
  head_.set_reset(true);
  advance(4);
  head_.set_reset(false);
  advance(static_cast<std::uint64_t>(kPowerUp_s * spec::kClkHz));
  const auto* preset = std::find_if(spec::kSensorPresets.begin(), spec::kSensorPresets.end(),
                                    [&](const auto& p) { return p.name == config.sensor; });
  write(spec::kRegSensType, static_cast<std::int32_t>(preset - spec::kSensorPresets.begin()));
  for (const HeadSetting& setting : settings) write(setting.reg, setting.value);
  until(2.0);
}

void HeatedRun::advance(std::uint64_t until) {
  chip::advance(run_, until, head_,
                [&](std::uint64_t cycle, const chip::Inputs& in, const chip::Outputs& out) {
                  if (!out.fault_n && in.rst_n && !std::isfinite(tripped_s_))
                    tripped_s_ = static_cast<double>(cycle) / spec::kClkHz;
                });
}

void HeatedRun::until(double time_s) {
  const auto end = static_cast<std::uint64_t>(std::llround(time_s * spec::kClkHz));
  while (run_.cycle < end) {
    if (run_.cycle >= next_poll_ && !head_.host().busy()) {
      head_.host().submit(read_input_registers(1, 0, 16));
      next_poll_ = run_.cycle + kPoll;
    }
    advance(std::min(end, run_.cycle + kTenth));
    while (head_.host().take_result()) {
    }
  }
}

void HeatedRun::write(chip::spec::Reg reg, std::int32_t value) {
  constexpr std::uint64_t kStep = spec::kClkHz / 1000;
  while (head_.host().busy()) advance(run_.cycle + kStep);
  while (head_.host().take_result()) {
  }
  const auto address = static_cast<std::uint16_t>(spec::kHoldingBase + reg);
  head_.host().submit(write_single_register(1, address, static_cast<std::uint16_t>(value)));
  while (head_.host().busy()) advance(run_.cycle + kStep);
  const std::optional<ModbusResult> result = head_.host().take_result();
  if (!result || result->outcome != ModbusOutcome::data) {
    throw std::runtime_error(fmt::format(
        "write of {} to register {:#x} refused, exception {}, faults {:#06x}, causes {:#06x}", value, address,
        result ? result->exception_code : 0, run_.chip.guard.fault_q, run_.chip.guard.cause_q));
  }
}

void HeatedRun::set_point(double degc) {
  set_point_degc_ = degc;
  write(spec::kRegSetpoint, static_cast<std::int32_t>(std::lround(degc * 10.0)));
}

void HeatedRun::start() {
  write(spec::kRegCmd, spec::kCmdClearFault);
  write(spec::kRegCmd, spec::kCmdRun);
}

}  // namespace meltstage::tb
