// SPDX-License-Identifier: Apache-2.0
#include "tb/trials/loop_trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "cmodel/advance.hpp"
#include "tb/pins/head.hpp"

namespace meltstage::tb {

namespace {

namespace spec = chip::spec;

constexpr double kClockHz = spec::kClkHz;
constexpr std::uint64_t kStep = spec::kClkHz / 10;
constexpr std::uint64_t kTriggerClocks = spec::kClkHz / 100'000;  // 10 us

// Power goes with the square of the voltage.
PlantConfig supplied(const LoopTrial& trial) {
  PlantConfig plant = trial.plant;
  plant.power_w *= trial.supply_ratio * trial.supply_ratio;
  return plant;
}

// The head with droplets falling from it.
class DroppingHead {
 public:
  explicit DroppingHead(const LoopTrial& trial)
      : head_({.plant = supplied(trial),
               .sensor = trial.sensor,
               .sensor_noise_degc = trial.noise_degc,
               .conversion_s = trial.conversion_s,
               .seed = trial.seed}),
        load_(trial.load) {}
  // Times of the load count from `cycle` on.
  void begin(std::uint64_t cycle) {
    if (load_.rate_hz <= 0.0) return;
    const auto at = [&](double t_s) { return cycle + static_cast<std::uint64_t>(t_s * kClockHz); };
    next_ = at(load_.begin_s);
    last_ = at(load_.end_s);
  }
  chip::Inputs step(std::uint64_t cycle, const chip::Outputs& out) {
    if (cycle >= next_) {
      head_.plant().droplet(cycle, load_.energy_j);
      head_.set_drop(true);
      low_ = cycle + kTriggerClocks;
      next_ += static_cast<std::uint64_t>(kClockHz / load_.rate_hz);
      if (next_ >= last_) next_ = kNoEvent;
    } else if (cycle >= low_) {
      head_.set_drop(false);
      low_ = kNoEvent;
    }
    return head_.step(cycle, out);
  }
  std::uint64_t next_event() const { return std::min({head_.next_event(), next_, low_}); }
  Head& head() { return head_; }

 private:
  Head head_;
  DropletLoad load_;
  std::uint64_t next_ = kNoEvent;
  std::uint64_t last_ = kNoEvent;
  std::uint64_t low_ = kNoEvent;
};

struct Rig {
  chip::Run run;
  std::unique_ptr<DroppingHead> surroundings;  // its devices know each other by address

  explicit Rig(const LoopTrial& trial) : run{}, surroundings(std::make_unique<DroppingHead>(trial)) {}
  void go(std::uint64_t until) {
    chip::advance(run, until, *surroundings, [](auto&&...) {});
  }
  void write(spec::Reg reg, int value) { run.chip.mem.preset(reg, static_cast<std::uint16_t>(value)); }
  void command(spec::Cmd word) {
    surroundings->head().host().submit(write_single_register(1, spec::kHoldingBase, word));
  }
};

std::uint16_t preset_of(const std::string& sensor) {
  const auto& all = spec::kSensorPresets;
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto& p) { return p.name == sensor; });
  return static_cast<std::uint16_t>(found - all.begin());
}

// A chip that has just been told to heat; the host only listens from here on.
Rig heating(const LoopTrial& trial, const std::vector<LoopSetting>& settings) {
  Rig rig(trial);
  for (int i = 0; i < 4; ++i) rig.run.chip.step({});  // the reset synchroniser lets go
  rig.write(spec::kRegSensType, preset_of(trial.sensor));
  rig.write(spec::kRegSetpoint, static_cast<int>(std::lround(trial.setpoint_degc * 10)));
  rig.write(spec::kRegHostWd, 0);
  rig.write(spec::kRegTAmb, static_cast<int>(std::lround(25.0 * 10)));
  for (const LoopSetting& s : settings) rig.write(s.reg, s.value);
  rig.run.out = rig.run.chip.outputs({});
  rig.surroundings->head().host().submit(
      read_input_registers(1, 0, 1));  // the first command starts the cycle
  while (rig.run.chip.guard.pv_valid_q == 0 || rig.run.cycle < 4 * kStep) rig.go(rig.run.cycle + kStep);
  rig.command(spec::kCmdClearFault);
  rig.command(spec::kCmdRun);
  while (rig.run.chip.guard.run_q == 0) {
    rig.go(rig.run.cycle + kStep / 100);
    if (rig.run.cycle > 100 * kStep) throw std::runtime_error("loop trial: the chip refuses to heat");
  }
  rig.surroundings->begin(rig.run.cycle);
  return rig;
}

void record(LoopCurve& curve, HeaterPlant& plant, std::uint64_t cycle, double duty) {
  curve.sensor_degc.push_back(plant.sensor_degc(cycle));
  curve.heater_degc.push_back(plant.heater_degc(cycle));
  curve.duty.push_back(duty);
}

void require_heating(const Rig& rig, const LoopTrial& trial) {
  if (rig.run.chip.guard.run_q != 0) return;
  throw std::runtime_error(fmt::format("loop trial: plant {}, set-point {}: heating stopped, faults {:#06x}",
                                       trial.plant.name, trial.setpoint_degc, rig.run.chip.guard.fault_q));
}

}  // namespace

const std::vector<LoopSetting>& published_form() {
  static const std::vector<LoopSetting> settings{
      {spec::kRegCtrl, spec::word_of({spec::kCtrlErrInteger, spec::kCtrlIZero})},
      {spec::kRegKp, 2048},
      {spec::kRegKiApproach, 24576},
      {spec::kRegKiHold, 24576},
      {spec::kRegKd, 0},
      {spec::kRegDFilter, 0},
      {spec::kRegBandFull, 180},
      {spec::kRegTs, 1000},
      {spec::kRegPwmPrescale, 46},
      {spec::kRegPwmPeriod, 255},
      {spec::kRegHoldTime, 0},
      {spec::kRegDtdtMax, 0}};
  return settings;
}

ChipLoop run_chip(const LoopTrial& trial, const std::vector<LoopSetting>& settings) {
  Rig rig = heating(trial, settings);
  LoopCurve curve;
  const auto samples = static_cast<std::uint64_t>(trial.length_s / kCurveStep_s);
  for (std::uint64_t i = 0; i < samples; ++i) {
    record(curve, rig.surroundings->head().plant(), rig.run.cycle, rig.run.chip.algor.duty_q / 65536.0);
    rig.go(rig.run.cycle + kStep);
    require_heating(rig, trial);
  }
  return {std::move(curve), rig.run.chip};
}

TunedLoop tune_chip(const LoopTrial& trial, const std::vector<LoopSetting>& settings) {
  Rig rig = heating(trial, settings);
  const std::uint64_t begin = rig.run.cycle;
  rig.command(spec::kCmdTune);
  const chip::Atune& atune = rig.run.chip.atune;
  while (atune.end_q != chip::kTuneFinished) {
    rig.go(rig.run.cycle + kStep);
    require_heating(rig, trial);
    if (static_cast<double>(rig.run.cycle - begin) > trial.length_s * kClockHz)
      throw std::runtime_error(fmt::format("loop trial: plant {}: autotune not finished in {} s",
                                           trial.plant.name, trial.length_s));
  }
  TunedLoop tuned{.settings = settings,
                  .ku_per_k = atune.ku_q / 65536.0,
                  .tu_s = atune.tu() / 4.0 * rig.run.chip.params()[spec::kRegTs] / 1000.0,
                  .hold_duty = atune.hold_q / 65536.0,
                  .took_s = static_cast<double>(rig.run.cycle - begin) / kClockHz};
  for (const spec::Reg reg :
       {spec::kRegKp, spec::kRegKiApproach, spec::kRegKiHold, spec::kRegKd, spec::kRegDFilter, spec::kRegKff})
    tuned.settings.push_back({reg, rig.run.chip.params()[reg]});
  return tuned;
}

LoopCurve run_peer(const LoopTrial& trial, PeerLoop peer) {
  constexpr double kTickHz = 1000.0;
  constexpr double kSensorStep_degc = 1.0 / 128.0;
  HeaterPlant plant(supplied(trial), kTickHz);
  Rng rng = stream(trial.seed, "spi_sensor");
  LoopCurve curve;
  double duty = 0.0;
  double next_drop_s = trial.load.rate_hz > 0.0 ? trial.load.begin_s : 1e300;
  double next_reading_s = 0.0;
  const auto end = static_cast<std::uint64_t>(trial.length_s * kTickHz);
  for (std::uint64_t tick = 0; tick < end; ++tick) {
    const double t_s = static_cast<double>(tick) / kTickHz;
    if (t_s >= next_reading_s) {
      next_reading_s += peer.period_s;
      const double noisy = plant.sensor_degc(tick) + trial.noise_degc * rng.gaussian();
      duty = std::clamp(
          peer.duty(std::round(noisy / kSensorStep_degc) * kSensorStep_degc, trial.setpoint_degc), 0.0, 1.0);
      // Mean power of a PWM that is fast beside the head.
      plant.set_supply_ratio(tick, std::sqrt(duty));
      plant.set_heater(tick, duty > 0.0);
    }
    if (t_s >= next_drop_s && t_s < trial.load.end_s) {
      plant.droplet(tick, trial.load.energy_j);
      next_drop_s += 1.0 / trial.load.rate_hz;
    }
    if (tick % static_cast<std::uint64_t>(kTickHz * kCurveStep_s) == 0) record(curve, plant, tick, duty);
  }
  return curve;
}

LoopFigures figures_of(const LoopCurve& curve, double setpoint_degc, double steady_begin_s) {
  LoopFigures f{};
  const auto& t = curve.sensor_degc;
  const double percent = 100.0 / setpoint_degc;
  f.overshoot_percent = std::max(0.0, (*std::max_element(t.begin(), t.end()) - setpoint_degc) * percent);
  for (std::size_t i = 0; i < t.size(); ++i)
    if (std::abs(t[i] - setpoint_degc) * percent > 2.0)
      f.settling_s = static_cast<double>(i + 1) * kCurveStep_s;
  const auto at = [&](double s) {
    return t.begin() + std::min<std::ptrdiff_t>(std::lround(s / kCurveStep_s), t.end() - t.begin());
  };
  const auto begin = at(steady_begin_s);
  const auto end = at(1200.0);
  if (begin >= end) return f;
  double sum = 0.0;
  for (auto it = begin; it != end; ++it) {
    const double error = std::abs(*it - setpoint_degc) * percent;
    f.steady_error_percent = std::max(f.steady_error_percent, error);
    sum += error;
  }
  f.steady_mean_percent = sum / static_cast<double>(end - begin);
  const auto [low, high] = std::minmax_element(begin, end);
  f.steady_swing_degc = *high - *low;
  return f;
}

double deviation_degc(const LoopCurve& curve, double setpoint_degc, double begin_s, double end_s) {
  double most = 0.0;
  for (std::size_t i = 0; i < curve.sensor_degc.size(); ++i) {
    const double t_s = static_cast<double>(i) * kCurveStep_s;
    if (t_s >= begin_s && t_s < end_s) most = std::max(most, std::abs(curve.sensor_degc[i] - setpoint_degc));
  }
  return most;
}

double full_power_time_s(const LoopTrial& trial) {
  constexpr double kTickHz = 100.0;
  HeaterPlant plant(supplied(trial), kTickHz);
  plant.set_heater(0, true);
  std::uint64_t tick = 0;
  while (plant.sensor_degc(tick) < 0.98 * trial.setpoint_degc && tick < 1'000'000) ++tick;
  return static_cast<double>(tick) / kTickHz;
}

}  // namespace meltstage::tb
