// SPDX-License-Identifier: Apache-2.0
// Six faults of a heated head, each under the chip, Marlin's rules and Klipper's; and healthy jobs, in which
// nothing may trip.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "bench/bench.hpp"
#include "tb/trials/protection.hpp"

namespace meltstage::app {

namespace {

using tb::FaultCase;
using tb::FaultOutcome;
using tb::HeadFault;
using tb::Protector;

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
};

std::vector<Compared> fault_cases(std::uint64_t seed) {
  std::vector<Compared> cases;
  for (const auto& [plant, degc] : {std::pair{"PH-1", 110.0}, std::pair{"E3D-like", 220.0}}) {
    for (const HeadFault fault : tb::kHeadFaults) {
      const std::string name = fmt::format("{} {}", plant, head_fault_name(fault));
      cases.push_back({{plant, degc, fault, true, seed}, name, {}, {}, {}});
      if (fault == HeadFault::switch_short)
        cases.push_back({{plant, degc, fault, false, seed}, name + ", no feedback wire", {}, {}, {}});
    }
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

}  // namespace

std::vector<BenchRow> bench_protection(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  std::vector<Compared> cases = fault_cases(options.seed);
  in_parallel(
      cases.size(),
      [&](std::size_t i) {
        Compared& c = cases[i];
        c.chip = tb::run_fault(c.what, Protector::chip);
        c.marlin = tb::run_fault(c.what, Protector::marlin);
        c.klipper = tb::run_fault(c.what, Protector::klipper);
      },
      options.progress, "faults");
  for (const Compared& c : cases) add_fault_rows(rows, c);

  const std::size_t jobs = options.quick ? 50 : 1000;
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
  rows.push_back({options.quick ? "healthy jobs (1000 without --quick)" : "healthy jobs",
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
