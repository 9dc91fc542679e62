// SPDX-License-Identifier: Apache-2.0
// The temperature loop: in the published form against the published table, in its own form against the
// physical bound, tuned by itself on every known plant, under load, and beside the loops that users could
// have instead. Plants, noise and definitions: docs/chip/control.md.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>

#include "bench/bench.hpp"
#include "tb/trials/loop_trial.hpp"
#include "tb/trials/peer_loops.hpp"

namespace meltstage::app {

namespace {

namespace spec = chip::spec;
using tb::LoopFigures;
using tb::LoopSetting;
using tb::LoopTrial;

constexpr std::array kSetpoints_degc{100.0, 110.0, 120.0};
constexpr tb::DropletLoad kPrinting{.begin_s = 600.0, .end_s = 900.0, .rate_hz = 200.0, .energy_j = 0.025};

// The detectors of a plant other than PH-1 are set after its tuning; until then these look away.
const std::vector<LoopSetting>& before_tuning() {
  static const std::vector<LoopSetting> settings{{spec::kRegHoldTime, 0}, {spec::kRegTMax, 2000}};
  return settings;
}

struct Worst {
  LoopFigures figures{};
  double settling_ratio = 0.0;  // to the full-power time
  void add(const LoopFigures& f, double bound_s) {
    figures.overshoot_percent = std::max(figures.overshoot_percent, f.overshoot_percent);
    figures.settling_s = std::max(figures.settling_s, f.settling_s);
    figures.steady_error_percent = std::max(figures.steady_error_percent, f.steady_error_percent);
    figures.steady_mean_percent = std::max(figures.steady_mean_percent, f.steady_mean_percent);
    figures.steady_swing_degc = std::max(figures.steady_swing_degc, f.steady_swing_degc);
    settling_ratio = std::max(settling_ratio, f.settling_s / bound_s);
  }
};

using Curve = std::function<tb::LoopCurve(const LoopTrial&)>;
Worst worst_over_setpoints(LoopTrial trial, const Curve& curve) {
  Worst worst;
  for (const double setpoint : kSetpoints_degc) {
    trial.setpoint_degc = setpoint;
    worst.add(tb::figures_of(curve(trial), setpoint), tb::full_power_time_s(trial));
  }
  return worst;
}
Curve chip_with(const std::vector<LoopSetting>& settings) {
  return [settings](const LoopTrial& trial) { return tb::run_chip(trial, settings).curve; };
}

void published_rows(std::vector<BenchRow>& rows, const BenchOptions& options) {
  const std::vector<double> setpoints =
      options.quick ? std::vector{110.0} : std::vector{100.0, 105.0, 110.0, 115.0, 120.0};
  for (std::size_t i = 0; i < setpoints.size(); ++i) {
    tell(options.progress, "published form", i, setpoints.size());
    LoopTrial trial{.setpoint_degc = setpoints[i],
                    .sensor = "MAX31855",
                    .conversion_s = 0.0,
                    .noise_degc = 0.1,
                    .seed = i + 1};
    const LoopFigures f =
        tb::figures_of(tb::run_chip(trial, tb::published_form()).curve, setpoints[i], 800.0);
    const std::string name = fmt::format("published form, {:.0f} degC", setpoints[i]);
    rows.push_back({name + ": overshoot", f.overshoot_percent, "%", 5.79, 6.93});
    rows.push_back({"  settling, 2 %", f.settling_s, "s", 320.0, 490.0});
    rows.push_back({"  steady error, largest", f.steady_error_percent, "%", 0.66, 1.00});
  }
}

void default_rows(std::vector<BenchRow>& rows) {
  for (const double setpoint : kSetpoints_degc) {
    const LoopTrial trial{.setpoint_degc = setpoint};
    const LoopFigures f = tb::figures_of(tb::run_chip(trial, {}).curve, setpoint);
    rows.push_back(
        {fmt::format("default, PH-1, {:.0f} degC: overshoot", setpoint), f.overshoot_percent, "%", {}, 0.1});
    rows.push_back({"  settling, 2 %", f.settling_s, "s", {}, {}});
    rows.push_back(
        {"  settling / full power to 98 %", f.settling_s / tb::full_power_time_s(trial), "", {}, 1.10});
    rows.push_back({"  steady error, largest", f.steady_error_percent, "%", {}, 0.02});
  }
}

struct Variant {
  const char* name;
  void (*change)(LoopTrial& trial);
};
constexpr Variant kVariants[] = {
    {"heat capacity +30 %",
     [](LoopTrial& t) { t.plant.heater_j_per_k *= 1.3, t.plant.block_j_per_k *= 1.3; }},
    {"heat capacity -30 %",
     [](LoopTrial& t) { t.plant.heater_j_per_k *= 0.7, t.plant.block_j_per_k *= 0.7; }},
    {"loss +40 %", [](LoopTrial& t) { t.plant.block_ambient_w_per_k *= 1.4; }},
    {"loss -40 %", [](LoopTrial& t) { t.plant.block_ambient_w_per_k *= 0.6; }},
    {"supply +10 %", [](LoopTrial& t) { t.supply_ratio = 1.1; }},
    {"supply -10 %", [](LoopTrial& t) { t.supply_ratio = 0.9; }},
    {"sensor lag and dead time x2",
     [](LoopTrial& t) { t.plant.sensor_lag_s *= 2.0, t.plant.transport_delay_s *= 2.0; }},
    {"ambient 15 degC", [](LoopTrial& t) { t.plant.ambient_degc = 15.0; }},
};

// A plant that needs another hold power than the one tuned for is what that detector is for.
const std::vector<LoopSetting>& untuned() {
  static const std::vector<LoopSetting> settings{{spec::kRegHoldTime, 0}};
  return settings;
}

void variant_rows(std::vector<BenchRow>& rows, const BenchOptions& options) {
  for (std::size_t i = 0; i < std::size(kVariants); ++i) {
    tell(options.progress, "other plants", i, std::size(kVariants));
    const Variant& variant = kVariants[i];
    LoopTrial trial;
    variant.change(trial);
    const Worst worst = options.quick ? [&] {
      Worst one;
      one.add(tb::figures_of(tb::run_chip(trial, untuned()).curve, trial.setpoint_degc), tb::full_power_time_s(trial));
      return one;
    }() : worst_over_setpoints(trial, chip_with(untuned()));
    rows.push_back({fmt::format("unretuned, {}: overshoot", variant.name),
                    worst.figures.overshoot_percent,
                    "%",
                    {},
                    0.5});
    rows.push_back({"  settling / full power to 98 %", worst.settling_ratio, "", {}, {}});
    rows.push_back({"  swing over 900..1200 s", worst.figures.steady_swing_degc, "degC", {}, 0.2});
    if (options.quick) break;
  }
}

void tuned_rows(std::vector<BenchRow>& rows, const BenchOptions& options) {
  for (std::size_t i = 0; i < std::size(tb::kPlants); ++i) {
    tell(options.progress, "tuning", i, std::size(tb::kPlants));
    const tb::PlantConfig& plant = tb::kPlants[i];
    LoopTrial trial{.plant = plant, .length_s = 3600.0};
    const tb::TunedLoop tuned = tb::tune_chip(trial, before_tuning());
    rows.push_back({fmt::format("autotune, {}: takes", plant.name), tuned.took_s, "s", {}, {}});
    rows.push_back({"  Ku", tuned.ku_per_k, "1/K", {}, {}});
    rows.push_back({"  Tu", tuned.tu_s, "s", {}, {}});
    const double hold =
        plant.block_ambient_w_per_k * (trial.setpoint_degc - plant.ambient_degc) / plant.power_w;
    rows.push_back({"  hold duty / that of the plant", tuned.hold_duty / hold, "", 0.97, 1.03});
    trial.length_s = 1200.0;
    const Worst worst = worst_over_setpoints(trial, chip_with(tuned.settings));
    rows.push_back({"  tuned: overshoot", worst.figures.overshoot_percent, "%", {}, 0.1});
    rows.push_back({"  tuned: settling / full power to 98 %", worst.settling_ratio, "", {}, 1.10});
    rows.push_back({"  tuned: steady error, largest", worst.figures.steady_error_percent, "%", {}, 0.02});
    if (options.quick) break;
  }
}

// FF_DROP: heat of a droplet over power times TS, in 2^-20.
int droplet_feed_forward(const tb::PlantConfig& plant, double energy_j) {
  const double ts_s = spec::kHolding[spec::kRegTs].reset / 1000.0;
  return static_cast<int>(std::lround(energy_j / (plant.power_w * ts_s) * 1048576.0));
}

double load_deviation(const tb::LoopCurve& curve, double setpoint_degc) {
  return tb::deviation_degc(curve, setpoint_degc, kPrinting.begin_s, kPrinting.end_s + 300.0);
}

void load_rows(std::vector<BenchRow>& rows) {
  const LoopTrial trial{.load = kPrinting};
  const tb::PlantIdentity id = tb::identify(trial.plant, trial.setpoint_degc);
  const double plain = load_deviation(tb::run_peer(trial, tb::plain_pi(id)), trial.setpoint_degc);
  const double alone = load_deviation(tb::run_chip(trial, {}).curve, trial.setpoint_degc);
  const int ff = droplet_feed_forward(trial.plant, kPrinting.energy_j);
  const double with =
      load_deviation(tb::run_chip(trial, {{spec::kRegFfDrop, ff}}).curve, trial.setpoint_degc);
  rows.push_back({"load of 5 W in droplets on PH-1: plain PI deviates by", plain, "degC", {}, {}});
  rows.push_back({"  this loop without feed-forward", alone, "degC", {}, {}});
  rows.push_back({"  this loop with FF_DROP on the trigger pin", with, "degC", {}, {}});
  rows.push_back({"  with FF_DROP / plain PI", with / plain, "", {}, 0.5});
}

void beside_rows(std::vector<BenchRow>& rows, const std::string& name, const Curve& curve) {
  const Worst worst = worst_over_setpoints({}, curve);
  const LoopTrial loaded{.load = kPrinting};
  rows.push_back(
      {fmt::format("beside, PH-1: {}: overshoot", name), worst.figures.overshoot_percent, "%", {}, {}});
  rows.push_back({"  settling / full power to 98 %", worst.settling_ratio, "", {}, {}});
  rows.push_back({"  steady error, largest", worst.figures.steady_error_percent, "%", {}, {}});
  rows.push_back(
      {"  deviation under load", load_deviation(curve(loaded), loaded.setpoint_degc), "degC", {}, {}});
}

// Of a run, a point a second from begin_s to end_s.
BenchCurve cut(const std::string& name, const std::vector<double>& values, double begin_s, double end_s,
               const std::function<double(double)>& drawn) {
  BenchCurve curve{name, {}, {}};
  const auto step = static_cast<std::size_t>(std::lround(1.0 / tb::kCurveStep_s));
  for (auto i = static_cast<std::size_t>(begin_s) * step; i < values.size(); i += step) {
    const double t_s = static_cast<double>(i) * tb::kCurveStep_s;
    if (t_s > end_s) break;
    curve.x.push_back(t_s);
    curve.y.push_back(std::round(drawn(values[i]) * 1e4) / 1e4);
  }
  return curve;
}

}  // namespace

std::vector<BenchChart> control_charts(const Progress& progress) {
  const LoopTrial trial{.load = kPrinting};
  BenchChart rise{"control_rise", "time since heating began, s", "temperature, degC", 20.0, 120.0, {}};
  BenchChart settle{
      "control_settle", "time since heating began, s", "temperature minus set-point, degC", -2.5, 2.5, {}};
  BenchChart load{
      "control_load", "time since heating began, s", "temperature minus set-point, degC", -2.0, 2.0, {}};
  BenchChart duty{"control_duty", "time since heating began, s", "duty, % of full power", 0.0, 105.0, {}};
  const auto draw = [&](const std::string& name, const tb::LoopCurve& run) {
    tell(progress, "charts", rise.curves.size(), 6);
    const auto deviation = [&](double degc) { return degc - trial.setpoint_degc; };
    rise.curves.push_back(cut(name, run.sensor_degc, 0.0, 450.0, [](double degc) { return degc; }));
    settle.curves.push_back(cut(name, run.sensor_degc, 100.0, 450.0, deviation));
    load.curves.push_back(cut(name, run.sensor_degc, 580.0, 1000.0, deviation));
  };
  const auto draw_duty = [&](const std::string& name, const tb::LoopCurve& run) {
    duty.curves.push_back(cut(name, run.duty, 0.0, 450.0, [](double ratio) { return 100.0 * ratio; }));
  };
  const tb::LoopCurve chip = tb::run_chip(trial, {}).curve;
  const tb::LoopCurve published = tb::run_chip(trial, tb::published_form()).curve;
  const int ff = droplet_feed_forward(trial.plant, kPrinting.energy_j);
  draw("this chip", chip);
  draw("this chip, FF_DROP", tb::run_chip(trial, {{spec::kRegFfDrop, ff}}).curve);
  draw("published form", published);
  for (const tb::PeerLoop& peer : tb::peer_loops(tb::identify(trial.plant, trial.setpoint_degc)))
    draw(peer.name, tb::run_peer(trial, peer));
  draw_duty("this chip", chip);
  draw_duty("published form", published);
  return {rise, settle, load, duty};
}

std::vector<BenchRow> bench_control(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  published_rows(rows, options);
  default_rows(rows);
  variant_rows(rows, options);
  tuned_rows(rows, options);
  load_rows(rows);
  if (options.quick) return rows;
  std::vector<std::pair<std::string, Curve>> loops{{"this chip", chip_with({})},
                                                   {"published form", chip_with(tb::published_form())}};
  for (const tb::PeerLoop& peer : tb::peer_loops(tb::identify(tb::plant_config("PH-1"), 110.0)))
    loops.emplace_back(peer.name, [peer](const LoopTrial& trial) { return tb::run_peer(trial, peer); });
  for (std::size_t i = 0; i < loops.size(); ++i) {
    tell(options.progress, "beside each other", i, loops.size());
    beside_rows(rows, loops[i].first, loops[i].second);
  }
  return rows;
}

}  // namespace meltstage::app
