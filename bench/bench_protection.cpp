// SPDX-License-Identifier: Apache-2.0
// Faults of a heated head, each under the chip, Marlin's rules and Klipper's; and healthy jobs, in which
// nothing may trip.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "bench/bench.hpp"
#include "tb/trials/commissioning.hpp"
#include "tb/trials/protection.hpp"

namespace meltstage::app {

namespace {

using tb::FaultCase;
using tb::FaultOutcome;
using tb::HeadFault;
using tb::Protector;

// Block above the set-point: a thermal fuse with that margin would have opened.
constexpr double kFuseMargin_degc = 60.0;

struct Compared {
  FaultCase what;
  std::string name;
  FaultOutcome chip;
  FaultOutcome marlin;
  FaultOutcome klipper;

  // Detected, and earlier than the better rule or at a lower peak of the heater.
  bool better() const {
    const double first = std::min(marlin.detected_s, klipper.detected_s);
    const double lowest = std::min(marlin.heater_peak_degc, klipper.heater_peak_degc);
    return chip.detected_s >= 0.0 && std::isfinite(chip.detected_s) &&
           (chip.detected_s < first || chip.heater_peak_degc < lowest);
  }
  // Later than a rule, and the block hotter; a rule that tripped on the healthy head has not seen the fault.
  bool behind() const {
    const auto beaten_by = [&](const FaultOutcome& rule) {
      return rule.detected_s >= 0.0 && rule.detected_s < chip.detected_s &&
             rule.block_peak_degc < chip.block_peak_degc - 0.5;
    };
    return beaten_by(marlin) || beaten_by(klipper);
  }
  double block_above_degc() const { return chip.block_peak_degc - what.setpoint_degc; }
};

// The case on a head that was put into service just before.
void run_case(Compared& c) {
  const auto settings =
      tb::commission({.plant = c.what.plant, .sensor_noise_degc = c.what.noise_degc, .seed = c.what.seed},
                     c.what.setpoint_degc, c.what.setpoint_degc)
          .settings;
  c.chip = tb::run_fault(c.what, settings, Protector::chip);
  c.marlin = tb::run_fault(c.what, settings, Protector::marlin);
  c.klipper = tb::run_fault(c.what, settings, Protector::klipper);
}

std::vector<Compared> fault_cases(std::uint64_t seed) {
  std::vector<Compared> cases;
  for (const auto& [plant, degc] : {std::pair{"PH-1", 110.0}, std::pair{"E3D-like", 220.0}}) {
    const FaultCase sudden{
        .plant = tb::plant_config(plant), .setpoint_degc = degc, .fault = HeadFault::falls_out, .seed = seed};
    const auto add = [&](
                         HeadFault fault, const std::function<void(FaultCase&)>& change = [](FaultCase&) {}) {
      FaultCase what = sudden;
      what.fault = fault;
      change(what);
      cases.push_back({what, fmt::format("{} {}", plant, tb::fault_name(what)), {}, {}, {}});
    };
    add(HeadFault::falls_out);
    add(HeadFault::half_out);
    for (const double onset_s : {15.0, 30.0, 60.0, 300.0})
      add(HeadFault::half_out, [&](FaultCase& what) { what.onset_s = onset_s; });
    for (const double noise_degc : {0.0, 0.2, 0.3})
      add(HeadFault::dead_low, [&](FaultCase& what) { what.noise_degc = noise_degc; });
    add(HeadFault::frozen_low);
    add(HeadFault::heater_open);
    add(HeadFault::switch_short);
    add(HeadFault::switch_short, [](FaultCase& what) { what.feedback = false; });
    add(HeadFault::switch_short_off);
  }
  return cases;
}

void add_fault_rows(std::vector<BenchRow>& rows, const Compared& c) {
  rows.push_back({c.name + ": chip trips after", c.chip.detected_s, "s", {}, {}});
  rows.push_back({"  Marlin", c.marlin.detected_s, "s", {}, {}});
  rows.push_back({"  Klipper", c.klipper.detected_s, "s", {}, {}});
  rows.push_back({"  heater peak, chip", c.chip.heater_peak_degc, "degC", {}, {}});
  rows.push_back({"  heater peak, Marlin", c.marlin.heater_peak_degc, "degC", {}, {}});
  rows.push_back({"  heater peak, Klipper", c.klipper.heater_peak_degc, "degC", {}, {}});
  rows.push_back({"  block peak, chip", c.chip.block_peak_degc, "degC", {}, {}});
  rows.push_back({"  earlier or cooler than both (1 yes)", c.better() ? 1.0 : 0.0, "", 1.0, {}});
}

void add_drawn_faults(std::vector<BenchRow>& rows, const BenchOptions& options) {
  const std::size_t drawn = options.quick ? 4 : 100;
  std::vector<std::optional<Compared>> ran(drawn);  // none: autotune found no head
  in_parallel(
      drawn,
      [&](std::size_t i) {
        const FaultCase what = tb::draw_fault_case(options.seed + i);
        Compared c{what,
                   fmt::format("case {}: {} at {:.0f} degC, noise {:.2f} degC, {}", options.seed + i,
                               what.plant.name, what.setpoint_degc, what.noise_degc, tb::fault_name(what)),
                   {},
                   {},
                   {}};
        try {
          run_case(c);
          ran[i] = c;
        } catch (const std::runtime_error&) {  // counted below
        }
      },
      options.progress, "drawn faults");
  std::vector<Compared> cases;
  for (const auto& c : ran)
    if (c) cases.push_back(*c);

  const auto is_hot = [](const Compared& c) { return c.block_above_degc() > kFuseMargin_degc; };
  const auto is_behind = [](const Compared& c) { return c.behind(); };
  const auto is_early = [](const FaultOutcome& outcome) { return outcome.detected_s < 0.0; };
  for (const Compared& c : cases) {
    if (!is_hot(c) && !is_behind(c) && !is_early(c.chip)) continue;
    rows.push_back({c.name + ": chip trips after", c.chip.detected_s, "s", {}, {}});
    rows.push_back({"  Marlin", c.marlin.detected_s, "s", {}, {}});
    rows.push_back({"  Klipper", c.klipper.detected_s, "s", {}, {}});
    rows.push_back({"  block above set-point, chip", c.block_above_degc(), "degC", {}, {}});
  }
  double hottest_degc = 0.0;
  for (const Compared& c : cases) hottest_degc = std::max(hottest_degc, c.block_above_degc());
  const auto add_count = [&](const char* what, const auto& is) {
    rows.push_back({what, static_cast<double>(std::count_if(cases.begin(), cases.end(), is)), "", {}, {}});
  };
  rows.push_back({options.quick ? "drawn faults (100 without --quick)" : "drawn faults",
                  static_cast<double>(drawn),
                  "",
                  {},
                  {}});
  rows.push_back({"  autotune found no head", static_cast<double>(drawn - cases.size()), "", {}, {}});
  rows.push_back({"  block above set-point, highest", hottest_degc, "degC", {}, {}});
  add_count("  block above set-point + 60 degC", is_hot);
  add_count("  later than a rule and hotter", is_behind);
  add_count("  not seen within the run", [](const Compared& c) { return std::isinf(c.chip.detected_s); });
  add_count("  chip tripped before the fault", [&](const Compared& c) { return is_early(c.chip); });
  add_count("  Marlin's rules before the fault", [&](const Compared& c) { return is_early(c.marlin); });
  add_count("  Klipper's before the fault", [&](const Compared& c) { return is_early(c.klipper); });
}

}  // namespace

std::vector<BenchRow> bench_protection(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  std::vector<Compared> cases = fault_cases(options.seed);
  in_parallel(
      cases.size(), [&](std::size_t i) { run_case(cases[i]); }, options.progress, "faults");
  for (const Compared& c : cases) add_fault_rows(rows, c);
  add_drawn_faults(rows, options);

  const std::size_t jobs = options.quick ? 20 : 500;
  std::vector<tb::HealthyJob> done(jobs);
  in_parallel(
      jobs, [&](std::size_t i) { done[i] = tb::run_healthy_job(options.seed + i); }, options.progress,
      "healthy jobs");
  double hours = 0.0;
  double noisy = 0.0;
  const auto count = [&](auto tripped) {
    return static_cast<double>(std::count_if(done.begin(), done.end(), tripped));
  };
  for (const tb::HealthyJob& job : done) {
    hours += job.heat_s / 3600.0;
    noisy += job.noisy_frames;
    if (std::isfinite(job.tripped_s)) {
      rows.push_back({fmt::format("false trip, job {}: {}, faults {:#06x}, after",
                                  options.seed + (&job - done.data()), job.what, job.faults),
                      job.tripped_s,
                      "s",
                      {},
                      {}});
    }
  }
  rows.push_back({options.quick ? "healthy jobs (500 without --quick)" : "healthy jobs",
                  static_cast<double>(jobs),
                  "",
                  {},
                  {}});
  rows.push_back({"  heated for", hours, "h", {}, {}});
  rows.push_back({"  noisy frames in them", noisy, "", {}, {}});
  rows.push_back({"  stopped by the chip",
                  count([](const auto& j) { return std::isfinite(j.tripped_s); }),
                  "",
                  {},
                  0.0});
  rows.push_back({"  Marlin's rules on the same readings",
                  count([](const auto& j) { return j.marlin_tripped; }),
                  "",
                  {},
                  {}});
  rows.push_back({"  Klipper's", count([](const auto& j) { return j.klipper_tripped; }), "", {}, {}});
  return rows;
}

}  // namespace meltstage::app
