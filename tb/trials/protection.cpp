// SPDX-License-Identifier: Apache-2.0
#include "tb/trials/protection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "tb/trials/commissioning.hpp"
#include "tb/trials/firmware_rules.hpp"
#include "tb/trials/heated_run.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

constexpr double kTick_s = 0.1;
constexpr double kFaultAt_s = 400.0;
constexpr double kFaultOffAt_s = 60.0;
constexpr double kLatest_s = 3000.0;  // for a head that never stays in its window
constexpr double kFrozenBelow_degc = 2.0;
constexpr double kDeadBelow_degc = 1.0;
constexpr double kHalfOut = 0.6;
constexpr double kReadsLow_degc = 30.0;
constexpr double kDrift_degc_per_s = 0.1;

double round_to_tick(double time_s) { return std::round(time_s / kTick_s) * kTick_s; }

/// What a fault with an onset has come to.
void grow(HeatedRun& run, const FaultCase& what, double since_s) {
  Head& head = run.head();
  const std::uint64_t now = run.cycle();
  const double share = what.onset_s > 0.0 ? std::min(1.0, since_s / what.onset_s) : 1.0;
  switch (what.fault) {
    case HeadFault::falls_out:
      head.plant().set_sensor_coupling(now, 1.0 - share);
      break;
    case HeadFault::half_out:
      head.plant().set_sensor_coupling(now, 1.0 - share * (1.0 - kHalfOut));
      break;
    case HeadFault::reads_low:
      head.set_element_degc(head.plant().sensor_degc(now) - share * kReadsLow_degc);
      break;
    case HeadFault::drifts_down:
      head.set_element_degc(head.plant().sensor_degc(now) - since_s * kDrift_degc_per_s);
      break;
    case HeadFault::heater_half:
      head.set_supply_ratio(now, std::sqrt(1.0 - share * 0.5));  // of the power
      break;
    default:
      break;
  }
}

void strike(HeatedRun& run, const FaultCase& what) {
  Head& head = run.head();
  const std::uint64_t now = run.cycle();
  switch (what.fault) {
    case HeadFault::falls_out:
    case HeadFault::half_out:
    case HeadFault::reads_low:
    case HeadFault::drifts_down:
    case HeadFault::heater_half:
      grow(run, what, 0.0);
      break;
    case HeadFault::dead_low:
      head.set_element_degc(what.setpoint_degc - kDeadBelow_degc);
      break;
    case HeadFault::frozen_low:
      // Slow enough to be no jump; the value that stays is the last.
      for (double below = 0.0; below <= kFrozenBelow_degc; below += 0.25) {
        head.set_element_degc(what.setpoint_degc - below);
        run.until(round_to_tick(run.now_s() + 5.0 * kTick_s));
      }
      head.sensor().set_faults({.frozen = true});
      break;
    case HeadFault::heater_open:
      head.plant().set_faults(now, {.element_open = true});
      break;
    case HeadFault::switch_short:
    case HeadFault::switch_short_off:
      head.plant().set_faults(now, {.switch_shorted = true});
      break;
  }
}

// ---- Healthy jobs ----

struct Happening {
  double at_s;
  std::function<void(HeatedRun&)> act;
};

double between(Rng& rng, double low, double high) { return low + (high - low) * rng.uniform(); }

struct Job {
  PlantConfig plant;
  std::vector<HeadSetting> settings;
  double noise_degc;
  double first_degc;
  double length_s;
  unsigned noisy_frames = 0;
  std::vector<Happening> happenings;  // in order of time
};

constexpr double kJob_s = 420.0;

Job make_job(std::uint64_t seed) {
  Rng rng = stream(seed, "healthy job");
  const bool hot_end = rng.below(2) == 0;
  const PlantConfig& plain = plant_config(hot_end ? "E3D-like" : "PH-1");
  const double highest = hot_end ? 220.0 : 120.0;
  const double lowest = hot_end ? 150.0 : 60.0;

  Job job{.plant = plain,
          .settings = {},
          .noise_degc = between(rng, 0.0, 0.1),
          .first_degc = 0.0,
          .length_s = kJob_s,
          .happenings = {}};
  const double capacity = between(rng, 0.7, 1.3);
  job.plant.heater_j_per_k *= capacity;
  job.plant.block_j_per_k *= capacity;
  job.plant.block_ambient_w_per_k *= between(rng, 0.6, 1.4);
  job.plant.sensor_lag_s *= between(rng, 1.0, 2.0);
  job.plant.ambient_degc = between(rng, 15.0, 30.0);
  const double supply = between(rng, 0.9, 1.1);

  // A job that the head can do: at its set-points, printing, the supply still leaves a fifth of the power.
  const double print_w = between(rng, 0.0, 0.08) * plain.power_w;
  const double power = plain.power_w * supply * supply;
  const double reach = job.plant.ambient_degc + (0.8 * power - print_w) / job.plant.block_ambient_w_per_k;
  const double top = std::min(highest, reach);
  const auto set_point = [&] { return std::round(between(rng, std::min(lowest, top - 10.0), top)); };
  job.first_degc = set_point();
  // Put into service on another day, with another supply.
  PlantConfig then = job.plant;
  then.ambient_degc = between(rng, 18.0, 27.0);
  then.power_w *= between(rng, 0.9, 1.1);
  job.settings =
      commission({.plant = then, .sensor_noise_degc = job.noise_degc, .seed = seed}, job.first_degc, highest)
          .settings;

  const auto add = [&](double at_s, std::function<void(HeatedRun&)> act) {
    job.happenings.push_back({at_s, std::move(act)});
  };
  add(0.0, [supply](HeatedRun& run) { run.head().set_supply_ratio(run.cycle(), supply); });
  for (int i = 0; i < 2; ++i) {
    const double degc = set_point();
    add(between(rng, 60.0, kJob_s), [degc](HeatedRun& run) { run.set_point(degc); });
  }
  // Printing takes heat with every droplet; they are put together in tenths of a second.
  for (int i = 0; i < 3; ++i) {
    const double begin = between(rng, 100.0, kJob_s);
    const double end = std::min(kJob_s, begin + between(rng, 5.0, 60.0));
    const double joule = print_w * kTick_s;
    for (double t = begin; t < end; t += kTick_s)
      add(t, [joule](HeatedRun& run) { run.head().plant().droplet(run.cycle(), joule); });
  }
  for (int i = 0; i < 4; ++i) {
    const double at = between(rng, 5.0, kJob_s);
    const double length = rng.below(2) == 0 ? between(rng, 0.02, 0.3) : between(rng, 0.3, 5.0);
    const double ratio = length < 0.3 ? between(rng, 0.0, 0.9) : between(rng, 0.6, 0.95);
    add(at, [=](HeatedRun& run) { run.head().set_supply_ratio(run.cycle(), supply * ratio); });
    add(at + length, [supply](HeatedRun& run) { run.head().set_supply_ratio(run.cycle(), supply); });
  }
  // A fan, and a supply that sags, for as long as the head still holds its set-points with nine tenths of its
  // power.
  const double need = (top - job.plant.ambient_degc) * job.plant.block_ambient_w_per_k / power;
  const double spare = 0.9 / (need + print_w / power);
  if (spare > 1.5) {
    const double at = between(rng, 60.0, kJob_s);
    const double loss = between(rng, 0.0, 0.15) * job.plant.block_ambient_w_per_k;
    add(at, [loss](HeatedRun& run) { run.head().plant().set_extra_loss_w_per_k(run.cycle(), loss); });
    add(at + between(rng, 30.0, 200.0),
        [](HeatedRun& run) { run.head().plant().set_extra_loss_w_per_k(run.cycle(), 0.0); });
  } else if (spare > 1.2) {
    const double at = between(rng, 60.0, kJob_s);
    const double ratio = supply * std::sqrt(between(rng, 1.0 / spare, 1.0));
    add(at, [ratio](HeatedRun& run) { run.head().set_supply_ratio(run.cycle(), ratio); });
    add(at + between(rng, 30.0, 200.0),
        [supply](HeatedRun& run) { run.head().set_supply_ratio(run.cycle(), supply); });
  }
  // A noisy frame has some bits inverted, or all of them random.
  job.noisy_frames = static_cast<unsigned>(5 + rng.below(20));
  for (unsigned i = 0; i < job.noisy_frames; ++i) {
    const double at = between(rng, 0.0, kJob_s);
    std::uint64_t mask = rng.bits() & 0xFFFFFFFFU;
    if (rng.below(2) == 0) mask = std::uint64_t{1} << rng.below(32) | std::uint64_t{1} << rng.below(32);
    // single: the frames before and after are sound
    add(std::floor(at) + kTick_s, [mask](HeatedRun& run) { run.head().sensor().corrupt_next_frame(mask); });
  }
  std::stable_sort(job.happenings.begin(), job.happenings.end(),
                   [](const Happening& a, const Happening& b) { return a.at_s < b.at_s; });
  return job;
}

}  // namespace

std::string fault_name(const FaultCase& what) {
  const std::string within = what.onset_s > 0.0 ? fmt::format(" within {} s", what.onset_s) : "";
  switch (what.fault) {
    case HeadFault::falls_out:
      return "sensor falls out" + within;
    case HeadFault::half_out:
      return "sensor at 60 % coupling" + within;
    case HeadFault::reads_low:
      return "sensor reads 30 degC low" + within;
    case HeadFault::drifts_down:
      return "sensor drifts by -0.1 degC/s";
    case HeadFault::heater_half:
      return "half of the heater open" + within;
    case HeadFault::dead_low:
      return fmt::format("sensor dead 1 degC low, noise {} degC", what.noise_degc);
    case HeadFault::frozen_low:
      return "sensor frozen 2 degC low";
    case HeadFault::heater_open:
      return "heater open";
    case HeadFault::switch_short:
      return what.feedback ? "switch shorted" : "switch shorted, no feedback wire";
    case HeadFault::switch_short_off:
      return "switch shorted, heater off";
  }
  return "";
}

FaultCase draw_fault_case(std::uint64_t seed) {
  constexpr std::array kKinds{HeadFault::falls_out,       HeadFault::half_out,    HeadFault::reads_low,
                              HeadFault::drifts_down,     HeadFault::dead_low,    HeadFault::frozen_low,
                              HeadFault::heater_open,     HeadFault::heater_half, HeadFault::switch_short,
                              HeadFault::switch_short_off};
  constexpr std::array kOnsets_s{0.0, 10.0, 30.0, 60.0, 300.0};
  Rng rng = stream(seed, "fault case");
  PlantConfig plant = kPlants[rng.below(kPlants.size())];
  plant.power_w *= between(rng, 0.8, 1.2);
  plant.heater_j_per_k *= between(rng, 0.5, 2.0);
  plant.heater_block_w_per_k *= between(rng, 0.6, 1.6);
  plant.block_j_per_k *= between(rng, 0.5, 2.0);
  plant.block_ambient_w_per_k *= between(rng, 0.6, 1.4);
  plant.sensor_lag_s *= between(rng, 0.5, 2.0);
  plant.transport_delay_s *= between(rng, 0.5, 2.0);
  plant.ambient_degc = between(rng, 18.0, 28.0);
  const double reach = plant.ambient_degc + 0.7 * plant.power_w / plant.block_ambient_w_per_k;
  const HeadFault fault = kKinds[rng.below(kKinds.size())];
  const double onset_s = kOnsets_s[rng.below(kOnsets_s.size())];
  return {.plant = plant,
          .setpoint_degc = std::round(std::min(reach, between(rng, 60.0, 240.0))),
          .fault = fault,
          .feedback = rng.below(2) == 0,
          .seed = seed,
          .onset_s = onset_s,
          .noise_degc = between(rng, 0.0, 0.5),
          .watched_s = 600.0 + onset_s};
}

FaultOutcome run_fault(const FaultCase& what, std::vector<HeadSetting> settings, Protector protector) {
  const bool heating = what.fault != HeadFault::switch_short_off;
  const double fault_at = heating ? kFaultAt_s : kFaultOffAt_s;
  if (protector != Protector::chip) {
    for (const HeadSetting& off : detectors_off()) settings.push_back(off);
  } else if (!what.feedback) {
    for (HeadSetting& setting : settings)
      if (setting.reg == spec::kRegCtrl) setting.value &= ~(1 << spec::kCtrlFbEn);
  }

  HeatedRun run({.plant = what.plant,
                 .sensor_noise_degc = what.noise_degc,
                 .seed = what.seed,
                 .second_switch = protector == Protector::chip},
                settings);
  MarlinRule marlin(what.setpoint_degc + kOverTarget_degc);
  KlipperRule klipper(what.setpoint_degc + kOverTarget_degc);
  double rule_tripped = kNever_s;
  const auto watch = [&] {
    if (protector == Protector::chip || std::isfinite(rule_tripped)) return;
    const bool tripped = protector == Protector::marlin
                             ? marlin.see(run.now_s(), run.reading_degc(), run.set_point_degc())
                             : klipper.see(run.now_s(), run.reading_degc(), run.set_point_degc());
    if (!tripped) return;
    rule_tripped = run.now_s();
    run.head().set_inhibit(true);
  };
  if (heating) {
    run.set_point(what.setpoint_degc);
    run.start();
  }
  const auto settled = [&] { return !heating || run.chip().guard.at_temp_q != 0 || run.now_s() > kLatest_s; };
  while (run.now_s() < fault_at - kTick_s / 2.0 || !settled()) {
    run.until(round_to_tick(run.now_s() + kTick_s));
    watch();
  }
  FaultOutcome outcome{kNever_s, 0, run.heater_degc(), run.block_degc()};
  const double before = protector == Protector::chip ? run.tripped_s() : rule_tripped;
  if (std::isfinite(before))
    return {before - run.now_s(), run.faults(), outcome.heater_peak_degc, outcome.block_peak_degc};

  strike(run, what);
  const double fault_s = run.now_s();
  while (run.now_s() < fault_s + what.watched_s) {
    run.until(round_to_tick(run.now_s() + kTick_s));
    grow(run, what, run.now_s() - fault_s);
    watch();
    outcome.heater_peak_degc = std::max(outcome.heater_peak_degc, run.heater_degc());
    outcome.block_peak_degc = std::max(outcome.block_peak_degc, run.block_degc());
    if (outcome.faults == 0) outcome.faults = run.faults();
  }
  outcome.detected_s = (protector == Protector::chip ? run.tripped_s() : rule_tripped) - fault_s;
  return outcome;
}

HealthyJob run_healthy_job(std::uint64_t seed) {
  const Job job = make_job(seed);
  HeatedRun run({.plant = job.plant, .sensor_noise_degc = job.noise_degc, .seed = seed}, job.settings);
  const double max_degc = std::find_if(job.settings.begin(), job.settings.end(),
                                       [](const HeadSetting& s) { return s.reg == spec::kRegTMax; })
                              ->value /
                          10.0;
  MarlinRule marlin(max_degc);
  KlipperRule klipper(max_degc);
  HealthyJob done{};
  run.set_point(job.first_degc);
  run.start();
  const double begin = run.now_s();
  auto next = job.happenings.begin();
  while (run.now_s() - begin < job.length_s && !std::isfinite(run.tripped_s())) {
    const double tick = round_to_tick(run.now_s() + kTick_s);
    for (; next != job.happenings.end() && next->at_s + begin < tick; ++next) {
      run.until(std::max(next->at_s + begin, run.now_s()));
      next->act(run);
    }
    run.until(std::max(tick, run.now_s()));
    done.marlin_tripped = marlin.see(run.now_s(), run.reading_degc(), run.set_point_degc());
    done.klipper_tripped = klipper.see(run.now_s(), run.reading_degc(), run.set_point_degc());
  }
  done.what = fmt::format("{} {:.2f} W/K, {:.0f} J/K, lag {:.1f} s, ambient {:.0f}", job.plant.name,
                          job.plant.block_ambient_w_per_k, job.plant.block_j_per_k, job.plant.sensor_lag_s,
                          job.plant.ambient_degc);
  done.faults = run.faults();
  done.tripped_s = run.tripped_s();
  done.noisy_frames = job.noisy_frames;
  done.heat_s = run.now_s() - begin;
  return done;
}

}  // namespace meltstage::tb
