// SPDX-License-Identifier: Apache-2.0
#include "tb/trials/peer_loops.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>

namespace meltstage::tb {

namespace {

struct Gains {
  double kp;  // duty per degC
  double ti_s;
  double td_s;
};
Gains ziegler_nichols(const PlantIdentity& id) { return {0.6 * id.ku_per_k, id.tu_s / 2.0, id.tu_s / 8.0}; }

// Wraps a rule with state of its own.
template <class State, class Rule>
PeerLoop loop(std::string name, double period_s, State state, Rule rule) {
  return {std::move(name), period_s,
          [state, rule](double degc, double setpoint) mutable { return rule(state, degc, setpoint); }};
}

}  // namespace

PlantIdentity identify(const PlantConfig& config, double setpoint_degc) {
  constexpr double kTickHz = 10.0;
  PlantIdentity id{};
  id.ambient_degc = config.ambient_degc;
  id.gain_k = config.power_w / config.block_ambient_w_per_k;

  HeaterPlant step(config, kTickHz);
  step.set_heater(0, true);
  double past = config.ambient_degc;
  for (std::uint64_t tick = 1; tick < 3000; ++tick) {
    const double now = step.sensor_degc(tick);
    const double rate = (now - past) * kTickHz;
    if (rate > id.rate_k_per_s) {
      id.rate_k_per_s = rate;
      id.dead_time_s = static_cast<double>(tick) / kTickHz - (now - config.ambient_degc) / rate;
    }
    past = now;
  }
  id.time_constant_s = id.gain_k / id.rate_k_per_s;

  // Relay of half width 0.5 degC; its levels are centred on the mean duty of each cycle.
  constexpr double kHalfWidth = 0.5;
  constexpr int kCycles = 10;
  HeaterPlant plant(config, kTickHz);
  double high = 1.0, low = 0.0, hottest = -1e9, coldest = 1e9, on_ticks = 0.0, ticks = 0.0;
  bool on = true;
  int cycles = -1;
  for (std::uint64_t tick = 0; cycles < kCycles && tick < 200'000; ++tick) {
    const double degc = plant.sensor_degc(tick);
    hottest = std::max(hottest, degc);
    coldest = std::min(coldest, degc);
    ++ticks;
    on_ticks += on;
    if (on && degc > setpoint_degc + kHalfWidth) on = false;
    if (!on && degc < setpoint_degc - kHalfWidth) {
      on = true;
      const double swing = (hottest - coldest) / 2.0;
      id.ku_per_k = 4.0 * (high - low) / 2.0 / (M_PI * std::sqrt(swing * swing - kHalfWidth * kHalfWidth));
      id.tu_s = ticks / kTickHz;
      const double mean = low + (high - low) * on_ticks / ticks;
      if (cycles >= 0) {
        high = std::min(1.0, 2.0 * mean);
        low = std::max(0.0, 2.0 * mean - 1.0);
      }
      ++cycles;
      hottest = -1e9;
      coldest = 1e9;
      ticks = on_ticks = 0.0;
    }
    const double duty = on ? high : low;
    plant.set_supply_ratio(tick, std::sqrt(duty));
    plant.set_heater(tick, duty > 0.0);
  }
  return id;
}

PeerLoop marlin_pid(const PlantIdentity& id) {
  struct State {
    double integral = 0.0, derivative = 0.0, past = NAN;
    bool inside = false;
  };
  constexpr double kPeriod = 0.164;
  constexpr double kBand = 10.0;
  constexpr double kSmooth = 0.95;
  const Gains g = ziegler_nichols(id);
  return loop("Marlin", kPeriod, State{}, [g](State& s, double degc, double setpoint) {
    const double error = setpoint - degc;
    const double rate = std::isnan(s.past) ? 0.0 : (degc - s.past) / kPeriod;
    s.past = degc;
    s.derivative = kSmooth * s.derivative + (1.0 - kSmooth) * g.kp * g.td_s * rate;
    if (error > kBand || error < -kBand) {
      s.inside = false;
      return error > 0.0 ? 1.0 : 0.0;
    }
    if (!s.inside) s.integral = 0.0;
    s.inside = true;
    s.integral = std::clamp(s.integral + g.kp * error * kPeriod / g.ti_s, 0.0, 1.0);
    const double duty = std::clamp(g.kp * error + s.integral - s.derivative, 0.0, 1.0);
    return std::round(duty * 127.0) / 127.0;
  });
}

PeerLoop klipper_pid(const PlantIdentity& id) {
  struct State {
    double integral = 0.0, rate = 0.0, past = NAN;
  };
  constexpr double kPeriod = 0.3;
  constexpr double kSmooth_s = 1.0;
  const Gains g = ziegler_nichols(id);
  return loop("Klipper", kPeriod, State{}, [g](State& s, double degc, double setpoint) {
    const double error = setpoint - degc;
    if (!std::isnan(s.past)) s.rate = (s.rate * (kSmooth_s - kPeriod) + (degc - s.past)) / kSmooth_s;
    s.past = degc;
    const double integral = std::clamp(s.integral + g.kp * error * kPeriod / g.ti_s, 0.0, 1.0);
    const double duty = g.kp * error + integral - g.kp * g.td_s * s.rate;
    const double bounded = std::clamp(duty, 0.0, 1.0);
    if (bounded == duty) s.integral = integral;
    return bounded;
  });
}

PeerLoop kalico_velocity_pid(const PlantIdentity& id) {
  struct State {
    double duty = 0.0, d1 = 0.0, d2 = 0.0;
    std::deque<double> past{};
  };
  constexpr double kPeriod = 0.3;
  constexpr double kReadings = 1.0 / kPeriod;  // of the smoothing
  const Gains g = ziegler_nichols(id);
  return loop("Kalico pid_v", kPeriod, State{}, [g](State& s, double degc, double setpoint) {
    s.past.push_back(degc);
    if (s.past.size() > 3) s.past.pop_front();
    if (s.past.size() < 3) return setpoint > degc ? 1.0 : 0.0;
    const double d1 = s.past[2] - s.past[1];
    const double d2 = (s.past[2] - 2.0 * s.past[1] + s.past[0]) / kPeriod;
    s.d1 = ((kReadings - 1.0) * s.d1 + d1) / kReadings;
    s.d2 = ((kReadings - 1.0) * s.d2 + d2) / kReadings;
    const double move = g.kp * (-s.d1 + (setpoint - degc) * kPeriod / g.ti_s - g.td_s * s.d2);
    s.duty = std::clamp(s.duty + move, 0.0, 1.0);
    return s.duty;
  });
}

PeerLoop reprap_model_pid(const PlantIdentity& id) {
  struct State {
    double integral = 0.0;
    std::deque<double> past{};
  };
  constexpr double kPeriod = 0.25;
  const double dead = id.dead_time_s;
  const double tau = id.time_constant_s;
  const double kp = 0.7 / (id.rate_k_per_s * dead);
  const double td = 0.7 * dead;
  const double ti_heat = std::sqrt(tau * dead);
  const double ti_hold = 1.14 * std::pow(tau, 0.25) * std::pow(dead, 0.75);
  return loop("RepRapFirmware", kPeriod, State{}, [=](State& s, double degc, double setpoint) {
    s.past.push_back(degc);
    if (s.past.size() > 5) s.past.pop_front();
    const double span_s = kPeriod * static_cast<double>(s.past.size() - 1);
    const double rate = span_s > 0.0 ? (s.past.back() - s.past.front()) / span_s : 0.0;
    const double error = setpoint - degc;
    const double hold = (setpoint - id.ambient_degc) / id.gain_k;
    const double pd = kp * (error - td * rate);
    if (pd + hold > 1.0 || pd + hold < 0.0) {
      s.integral = std::clamp(hold, 0.0, 1.0);
      return pd + hold > 1.0 ? 1.0 : 0.0;
    }
    const double ti = std::abs(error) < 3.0 ? ti_hold : ti_heat;
    s.integral = std::clamp(s.integral + kp * error * kPeriod / ti, 0.0, 1.0);
    return std::clamp(pd + s.integral, 0.0, 1.0);
  });
}

PeerLoop plain_pi(const PlantIdentity& id) {
  struct State {
    double integral = 0.0;
  };
  constexpr double kPeriod = 0.1;
  const double closed = id.dead_time_s;  // tau_c = theta
  const double kp = id.time_constant_s / (id.gain_k * (closed + id.dead_time_s));
  const double ti = std::min(id.time_constant_s, 4.0 * (closed + id.dead_time_s));
  return loop("plain PI (SIMC)", kPeriod, State{}, [=](State& s, double degc, double setpoint) {
    const double error = setpoint - degc;
    const double integral = std::clamp(s.integral + kp * error * kPeriod / ti, 0.0, 1.0);
    const double duty = kp * error + integral;
    if ((duty <= 1.0 || error < 0.0) && (duty >= 0.0 || error > 0.0)) s.integral = integral;
    return std::clamp(kp * error + s.integral, 0.0, 1.0);
  });
}

std::vector<PeerLoop> peer_loops(const PlantIdentity& id) {
  return {marlin_pid(id), klipper_pid(id), kalico_velocity_pid(id), reprap_model_pid(id), plain_pi(id)};
}

}  // namespace meltstage::tb
