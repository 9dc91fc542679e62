// SPDX-License-Identifier: Apache-2.0
// A temperature loop on a heated head, from cold, with its figures of merit: the chip, or another
// controller's rule on the same plant, sensor and noise.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"
#include "tb/devices/heater.hpp"

namespace meltstage::tb {

/// Droplets that take heat out of the block at a steady rate.
struct DropletLoad {
  double begin_s = 0.0;
  double end_s = 0.0;
  double rate_hz = 0.0;  ///< 0: none
  double energy_j = 0.0;
};

/// One run. Times count from the moment heating begins.
struct LoopTrial {
  PlantConfig plant = plant_config("PH-1");
  double supply_ratio = 1.0;  ///< supply voltage over nominal
  double setpoint_degc = 110.0;
  std::string sensor = "ADT7320";  ///< part, as in the spec's presets
  double conversion_s = 0.1;       ///< between two readings
  double noise_degc = 0.05;        ///< sigma, before the sensor's own steps
  std::uint64_t seed = 1;
  double length_s = 1200.0;
  DropletLoad load{};
};

/// Every 0.1 s from the start of heating.
struct LoopCurve {
  std::vector<double> sensor_degc;  ///< what the sensing element has, without noise and steps
  std::vector<double> heater_degc;
  std::vector<double> duty;  ///< 0..1
};
inline constexpr double kCurveStep_s = 0.1;

/// Register and value, as a host would write them before RUN.
struct LoopSetting {
  chip::spec::Reg reg;
  int value;
};

/// The published controller in this chip: Xie et al. 2023, figs. 6 and 7, with whole-degree errors. Full
/// power more than 18 degC below, then u = 8 e + 3/8 sum e in eighths of a bit of an 8-bit duty, once a
/// second.
const std::vector<LoopSetting>& published_form();

struct ChipLoop {
  LoopCurve curve;
  chip::Chip chip;  ///< as the run left it
};
/// The whole chip (model, from event to event). Throws std::runtime_error when it stops heating before the
/// end.
ChipLoop run_chip(const LoopTrial& trial, const std::vector<LoopSetting>& settings);

/// Autotune on the plant at the trial's set-point; the gains that it leaves. Throws std::runtime_error when
/// it does not finish within trial.length_s.
struct TunedLoop {
  std::vector<LoopSetting> settings;
  double ku_per_k;
  double tu_s;
  double hold_duty;
  double took_s;
};
TunedLoop tune_chip(const LoopTrial& trial, const std::vector<LoopSetting>& settings);

/// A controller's rule: called each `period_s` with the temperature read; gives the duty, 0..1.
struct PeerLoop {
  std::string name;
  double period_s;
  std::function<double(double degc, double setpoint_degc)> duty;
};
LoopCurve run_peer(const LoopTrial& trial, PeerLoop peer);

/// Figures of a curve; errors in percent of the set-point in degC, as in Xie et al. 2023, table 1.
struct LoopFigures {
  double overshoot_percent;
  double settling_s;            ///< last time outside 2 % of the set-point
  double steady_error_percent;  ///< largest, from steady_begin_s to 1200 s
  double steady_mean_percent;   ///< mean of its size there
  double steady_swing_degc;     ///< highest minus lowest there
};
LoopFigures figures_of(const LoopCurve& curve, double setpoint_degc, double steady_begin_s = 900.0);
/// Largest distance from the set-point over begin_s..end_s.
double deviation_degc(const LoopCurve& curve, double setpoint_degc, double begin_s, double end_s);
/// Time that full power needs to 98 % of the set-point: no loop can settle sooner.
double full_power_time_s(const LoopTrial& trial);

}  // namespace meltstage::tb
