// SPDX-License-Identifier: Apache-2.0
// Vibration that moves leave behind: on the anchor plant (38 Hz, damping 0.05, +-10 %), and on a servo axis
// that reproduces the table of Zhang & Zhang 2023.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "bench/bench.hpp"
#include "motion/profile/profile.hpp"
#include "motion/profile/shaping.hpp"
#include "motion/profile/vibration.hpp"
#include "motion/stage/stage_model.hpp"

namespace meltstage::app {

namespace {

using motion::asymmetric_limits;
using motion::JerkProfile;
using motion::ScurveLimits;

constexpr double kTolerance_mm = 0.010;
const motion::ModeBand kAnchor{{38.0, 0.05}, 0.10};

// Stepping acceleration, as near as a jerk of 1e9 mm/s3 (4 us) comes to it.
const ScurveLimits kTrapezoid = asymmetric_limits(400, 4000, 4000, 1e9, 1e9);

ScurveLimits s_curve(double jerk_mm_s3) { return asymmetric_limits(400, 4000, 4000, jerk_mm_s3, jerk_mm_s3); }

// The design of the paper's search over its A, D, Ja, Jd; it doesn't print the levels.
constexpr motion::TaguchiLevels kLevels{{2000, 2500, 3000, 3500, 4000},
                                        {2000, 2500, 3000, 3500, 4000},
                                        {50e3, 100e3, 150e3, 200e3, 250e3},
                                        {25e3, 50e3, 75e3, 100e3, 125e3}};
constexpr double kEnergyShare = 0.2;  // Delta_max lets this share of the 25 rows through

motion::Scurve as_published(double distance_mm, const motion::Mode& mode) {
  const auto rows = motion::taguchi_rows(kLevels, 400.0, distance_mm, mode, {});
  return plan_scurve(best_row(rows, energy_quantile(rows, kEnergyShare)).value().limits, distance_mm);
}

// Under the same Delta_max as the paper's search, over all A, D, Ja, Jd between its levels.
motion::Scurve energy_optimum(double distance_mm) {
  const auto rows = motion::taguchi_rows(kLevels, 400.0, distance_mm, kAnchor.nominal, {});
  const motion::OptimumSearch search{.lowest = asymmetric_limits(400, 2000, 2000, 50e3, 25e3),
                                     .highest = asymmetric_limits(400, 4000, 4000, 250e3, 125e3),
                                     .evaluations = 500};
  const auto energy = [](const JerkProfile& profile) {
    return motion::morlet_energy(profile, kAnchor.nominal, {});
  };
  return optimum_profile(search, distance_mm, energy, energy_quantile(rows, kEnergyShare)).value();
}

motion::Scurve residual_optimum(double distance_mm) {
  const motion::OptimumSearch search{.lowest = asymmetric_limits(400, 1500, 1500, 5e4, 5e4),
                                     .highest = asymmetric_limits(400, 4000, 4000, 1e6, 1e6)};
  const auto worst = [](const JerkProfile& profile) { return motion::worst_residual_mm(profile, kAnchor); };
  return optimum_profile(search, distance_mm, worst, kTolerance_mm).value();
}

struct Fleet {
  double moved_ms = 0.0, settled_ms = 0.0;              // means
  double residual_um = 0.0, nominal_settling_ms = 0.0;  // largest
};

using Planner = std::function<JerkProfile(double)>;

// Moves of 1 to 60 mm, evenly in the logarithm.
Fleet run(const std::string& what, const Planner& plan, int moves, const Progress& progress) {
  Fleet fleet;
  for (int i = 0; i < moves; ++i) {
    tell(progress, what, i, moves);
    const JerkProfile profile = plan(std::pow(60.0, static_cast<double>(i) / (moves - 1)));
    fleet.moved_ms += profile.duration_s * 1e3 / moves;
    fleet.settled_ms += worst_settled_s(profile, kAnchor, kTolerance_mm) * 1e3 / moves;
    fleet.residual_um = std::max(fleet.residual_um, worst_residual_mm(profile, kAnchor) * 1e3);
    const double nominal_mm = residual_mm(profile, kAnchor.nominal);
    fleet.nominal_settling_ms =
        std::max(fleet.nominal_settling_ms, settling_s(nominal_mm, kAnchor.nominal, kTolerance_mm) * 1e3);
  }
  return fleet;
}

void add_anchor_rows(std::vector<BenchRow>& rows, int moves, const Progress& progress) {
  const motion::Mode& mode = kAnchor.nominal;
  const auto add = [&](const std::string& what, const Planner& plan) {
    const Fleet fleet = run(what, plan, moves, progress);
    rows.push_back({what, fleet.settled_ms, "ms", {}, {}});
    return fleet;
  };
  rows.push_back(
      {"anchor plant, worst of +-10 %: moves of 1..60 mm", static_cast<double>(moves), "", {}, {}});
  add("move + settle, trapezoid (336)", [](double s) { return plan_scurve(kTrapezoid, s); });
  add("  symmetric S, J 2e5 (241)", [](double s) { return plan_scurve(s_curve(2e5), s); });
  add("  Taguchi + Morlet as published (191)", [&](double s) { return as_published(s, mode); });
  add("  optimum of A, D, Ja, Jd, the same energy", energy_optimum);
  add("  jerk times of one period", [&](double s) { return plan_jerk_matched(kTrapezoid, s, mode); });
  add("  symmetric S, J 2e5, through ZV (142)",
      [&](double s) { return shaped(plan_scurve(s_curve(2e5), s), zv_shaper(mode)); });
  add("  trapezoid through ZV",
      [&](double s) { return shaped(plan_scurve(kTrapezoid, s), zv_shaper(mode)); });
  add("  trapezoid through EI (133)",
      [&](double s) { return shaped(plan_scurve(kTrapezoid, s), ei_shaper(mode)); });
  add("  trapezoid through ZVD (132.5, best known)",
      [&](double s) { return shaped(plan_scurve(kTrapezoid, s), zvd_shaper(mode)); });
  add("  optimum of A, D, Ja, Jd, exact residual (138)", residual_optimum);
  add("  S, J 1e6, through the move's shortest shaper",
      [](double s) { return plan_quiet_move(s_curve(1e6), s, kAnchor, kTolerance_mm); });
  const Fleet quiet = add("  trapezoid through the move's shortest shaper",
                          [](double s) { return plan_quiet_move(kTrapezoid, s, kAnchor, kTolerance_mm); });
  rows.back().at_most = 132.0;
  rows.push_back({"    largest residual", quiet.residual_um, "um", {}, kTolerance_mm * 1e3});
  rows.push_back({"    largest settling at the nominal mode", quiet.nominal_settling_ms, "ms", {}, 0.0});
}

// The machine of the paper: 400 mm/s, 4000 mm/s2, linear motors (no screw, little friction). Mode, servo
// bandwidths and the jerk before are chosen so that the row before is the paper's; all else follows.
motion::AxisModelConfig flip_chip_axis() {
  motion::AxisModelConfig axis;
  axis.mode = {38.0, 0.06};
  axis.servo.position_bandwidth_hz = 25.0;
  axis.servo.speed_bandwidth_hz = 58.0;
  axis.coulomb_friction_n = 1.0;
  axis.viscous_friction_ns_m = 5.0;
  return axis;
}

void add_paper_rows(std::vector<BenchRow>& rows) {
  constexpr double kDistance_mm = 40.0, kJerkBefore_mm_s3 = 1e6, kQuiet_mm = 0.005;
  const motion::AxisModelConfig axis = flip_chip_axis();
  struct Wanted {
    std::optional<double> at_least, at_most;
  };
  const auto add = [&](const std::string& what, const JerkProfile& profile, Wanted tracking, Wanted settling,
                       Wanted positioning) {
    const motion::MoveFigures figures = measure_move(axis, profile, kTolerance_mm);
    const auto row = [&](const char* name, double value, const char* unit, const Wanted& wanted) {
      rows.push_back({what + name, value, unit, wanted.at_least, wanted.at_most});
    };
    row(": tracking", figures.tracking_mm * 1e3, "um", tracking);
    row(": settling", figures.settling_s * 1e3, "ms", settling);
    row(": positioning", figures.positioning_mm * 1e3, "um", positioning);
    row(": move + settle", (profile.duration_s + figures.settling_s) * 1e3, "ms", {});
  };
  const JerkProfile before = plan_scurve(s_curve(kJerkBefore_mm_s3), kDistance_mm);
  add("servo axis, paper before (15, 100, 70)", before, {13.5, 16.5}, {90.0, 110.0}, {63.0, 77.0});
  add("servo axis, paper after (1.5, 15, 10)", as_published(kDistance_mm, axis.mode), {{}, 1.5}, {{}, 15.0},
      {{}, 10.0});
  const auto quiet = [&](double jerk_mm_s3) {
    return plan_quiet_move(s_curve(jerk_mm_s3), kDistance_mm, {axis.mode, 0.1}, kQuiet_mm);
  };
  add("servo axis, shortest shaper, J 1e6", quiet(kJerkBefore_mm_s3), {}, {{}, 0.0}, {{}, 10.0});
  add("servo axis, shortest shaper, J 1e5", quiet(1e5), {{}, 1.5}, {{}, 0.0}, {{}, 10.0});
}

}  // namespace

std::vector<BenchRow> bench_vibration(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  add_anchor_rows(rows, options.quick ? 20 : 60, options.progress);
  add_paper_rows(rows);
  return rows;
}

}  // namespace meltstage::app
