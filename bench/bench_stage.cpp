// SPDX-License-Identifier: Apache-2.0
// The stage: positioning accuracy as the bump-printing paper measured it and after compensation, droplets on
// the fly, droplets in strobe images.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "bench/bench.hpp"
#include "motion/stage/accuracy.hpp"
#include "motion/stage/droplet_camera.hpp"
#include "motion/stage/jetting.hpp"

namespace meltstage::app {

namespace {

using motion::AxisModelConfig;
using motion::InterferometerConfig;

// An axis of the paper's platform. Lead error, backlash and scatter of stops are chosen so that the virtual
// interferometer reads the paper's table; what compensation leaves follows.
struct PaperAxis {
  std::string name;
  AxisModelConfig model;
  InterferometerConfig instrument;
  double accuracy_um;             // the paper's +-, twice
  double forward_um, reverse_um;  // the paper's repeatability at zero: range of four approaches
  double accuracy_after_um;       // wanted with compensation
};

// Mean range of four draws from a normal distribution of sigma 1 (control chart constant d2).
constexpr double kRangeOfFour = 2.0588;

PaperAxis paper_axis(const std::string& name, double lead_mm, double lead_error_share, double backlash_mm,
                     double accuracy_um, double forward_um, double reverse_um, double after_um) {
  PaperAxis axis{name, {}, {}, accuracy_um, forward_um, reverse_um, after_um};
  axis.model.screw = {backlash_mm, lead_error_share, 0.002, lead_mm};
  axis.model.coulomb_friction_n = 2.0;
  axis.instrument.stop_forward_um = forward_um / kRangeOfFour;
  axis.instrument.stop_reverse_um = reverse_um / kRangeOfFour;
  axis.instrument.dwell_s = 0.3;
  return axis;
}

double mean_range_of_four(const std::vector<double>& values) {
  double sum = 0.0;
  const std::size_t series = values.size() / 4;
  for (std::size_t i = 0; i < series; ++i) {
    const auto [low, high] = std::minmax_element(values.begin() + static_cast<std::ptrdiff_t>(4 * i),
                                                 values.begin() + static_cast<std::ptrdiff_t>(4 * i + 4));
    sum += *high - *low;
  }
  return sum / static_cast<double>(series);
}

void add_accuracy_rows(std::vector<BenchRow>& rows, const PaperAxis& axis, bool quick) {
  const motion::AccuracyTest test{.target_mm =
                                      motion::accuracy_targets(0.0, 200.0, 11, axis.model.screw.lead_mm, 1)};
  const auto before_targets = measure_axis(axis.model, test, axis.instrument);
  const auto before = motion::evaluate_accuracy(before_targets);
  const std::string name = axis.name + ": ";
  rows.push_back({name + fmt::format("A / 2 as found (paper +-{:.0f})", 0.5 * axis.accuracy_um),
                  0.5 * before.accuracy_um, "um", 0.45 * axis.accuracy_um, 0.55 * axis.accuracy_um});
  rows.push_back(
      {name + "backlash by the residual method less that of the screw",
       std::abs(motion::residual_backlash(before_targets).backlash_um - axis.model.screw.backlash_mm * 1e3),
       "um",
       {},
       1.0});

  motion::AccuracyTest learn{.target_mm = {}, .runs = 2};
  const double step_mm = quick ? 2.0 : 1.0;  // 5 to 10 positions a turn of the 5 mm and 10 mm screws
  for (double at_mm = 0.0; at_mm <= 200.0; at_mm += step_mm) learn.target_mm.push_back(at_mm);
  InterferometerConfig other = axis.instrument;
  other.seed = 2;
  const auto table =
      motion::make_compensation(motion::evaluate_accuracy(measure_axis(axis.model, learn, other)));
  other.seed = 3;
  const auto after = motion::evaluate_accuracy(measure_axis(axis.model, test, other, table));
  rows.push_back(
      {name + "A / 2 compensated", 0.5 * after.accuracy_um, "um", {}, 0.5 * axis.accuracy_after_um});
  rows.push_back({name + "E as found", before.systematic_um, "um", {}, {}});
  rows.push_back({name + "E compensated", after.systematic_um, "um", {}, {}});
  rows.push_back({name + "B as found", before.reversal_um, "um", {}, {}});
  rows.push_back({name + "B compensated", after.reversal_um, "um", {}, {}});
  rows.push_back({name + "R compensated", after.repeatability_um, "um", {}, {}});

  // The paper measured zero with the backlash taken out, four times from either side.
  const motion::AccuracyTest zero{.target_mm = {0.0, 1.0}, .runs = quick ? 400 : 1000};
  other.seed = 4;
  other.dwell_s = 0.15;
  const auto repeated = measure_axis(axis.model, zero, other, table);
  const auto add = [&](const char* what, double value, double paper) {
    rows.push_back({name + fmt::format("{} at zero, range of 4 (paper {:.1f})", what, paper), value, "um",
                    0.85 * paper, 1.15 * paper});
  };
  add("forward", mean_range_of_four(repeated[0].forward_um), axis.forward_um);
  add("reverse", mean_range_of_four(repeated[0].reverse_um), axis.reverse_um);
}

void add_fly_by_rows(std::vector<BenchRow>& rows) {
  std::vector<motion::Point> bumps, serpentine;
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 32; ++column) {
      bumps.push_back({0.5 * column, 0.5 * row, bumps.size() + 1});
      serpentine.push_back({0.5 * (row % 2 == 0 ? column : 31 - column), 0.5 * row, bumps.size()});
    }
  const motion::FlyByConfig config;
  const auto begin = std::chrono::steady_clock::now();
  const motion::FlyByPlan plan = plan_fly_by(bumps, config);
  const std::chrono::duration<double, std::milli> planning = std::chrono::steady_clock::now() - begin;
  rows.push_back({"32 x 32 at 0.5 mm: stop and go", stop_and_go_s(serpentine, config, 0.0), "s", {}, {}});
  rows.push_back({"32 x 32 at 0.5 mm: fly-by, 200 droplets/s", plan.duration_s, "s", {}, 8.0});
  rows.push_back({"fly-by planning", planning.count(), "ms", {}, {}});
  double worst = 0.0, fastest = 0.0;
  for (const motion::FlyByRow& row : plan.rows) fastest = std::max(fastest, row.speed_mm_s);
  for (const double error : landing_errors_mm(plan, bumps, config, 1e-6, config.flight_s))
    worst = std::max(worst, std::abs(error));
  const double bound_um = (fastest * 1e-6 + 0.5 * config.encoder_mm) * 1e3;
  rows.push_back(
      {"largest trigger error (bound v x 1 us + half a count)", worst * 1e3, "um", {}, bound_um + 1e-6});
}

void add_droplet_rows(std::vector<BenchRow>& rows, bool quick) {
  motion::CameraConfig camera;
  double worst_speed = 0.0, worst_roundness = 0.0, time_ms = 0.0;
  int pairs = 0, wrong_satellites = 0;
  for (const double speed : {0.5, 1.0, 2.0, 3.0, 4.0})
    for (const double roundness : {1.0, 0.9, 0.8})
      for (int i = 0; i < (quick ? 2 : 6); ++i) {
        motion::FlyingDroplet droplet{.x_um = 400.0 + 1.7 * i, .y_um = 300.0 + 2.3 * i, .diameter_um = 100.0};
        droplet.velocity_m_s = speed;
        droplet.roundness = roundness;
        motion::FlyingDroplet satellite = droplet;
        satellite.diameter_um = 25.0;
        satellite.y_um -= 120.0;
        std::vector<motion::FlyingDroplet> scene = {droplet};
        if (i % 2 == 1) scene.push_back(satellite);
        const auto seed = static_cast<std::uint64_t>(2 * pairs);
        const auto first = render(scene, camera, seed);
        for (auto& each : scene) each.y_um += speed * 100.0;
        const auto second = render(scene, camera, seed + 1);
        const auto begin = std::chrono::steady_clock::now();
        const auto found = measure_pair(first, second, camera.strobe);
        time_ms +=
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
        ++pairs;
        worst_speed = std::max(worst_speed, found ? std::abs(found->velocity_m_s - speed) : INFINITY);
        worst_roundness =
            std::max(worst_roundness, found ? std::abs(found->roundness - roundness) : INFINITY);
        wrong_satellites += found && found->satellites == i % 2 ? 0 : 1;
      }
  rows.push_back(
      {fmt::format("strobe pairs ({}): largest velocity error", pairs), worst_speed, "m/s", {}, 0.01});
  rows.push_back({"strobe pairs: largest roundness error", worst_roundness, "", {}, 0.03});
  rows.push_back({"strobe pairs: satellites miscounted", static_cast<double>(wrong_satellites), "", {}, 0.0});
  rows.push_back({"strobe pairs: time of one", time_ms / pairs, "ms", {}, {}});

  const motion::JettingModel head;
  std::uint64_t seed = 1000;
  const auto tuned = motion::tune_waveform(
      {}, {}, [&](const motion::Waveform& waveform) { return photograph(head, waveform, camera, ++seed); });
  const auto truth = jet(head, tuned.waveform);
  rows.push_back(
      {"waveform tuned by the images: velocity", truth ? truth->droplet.velocity_m_s : 0.0, "m/s", 1.8, 2.2});
  rows.push_back({"waveform tuned by the images: satellites",
                  truth ? static_cast<double>(truth->satellites) : NAN,
                  "",
                  {},
                  0.0});
  rows.push_back(
      {"waveform tuned by the images: pairs taken", static_cast<double>(tuned.measurements), "", {}, 60.0});
}

}  // namespace

std::vector<BenchRow> bench_stage(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  add_accuracy_rows(rows, paper_axis("X", 10.0, 68e-6, 0.008, 30.0, 2.5, 3.0, 10.0), options.quick);
  add_accuracy_rows(rows, paper_axis("Y", 5.0, 225e-6, 0.010, 60.0, 1.0, 1.0, 6.0), options.quick);
  add_fly_by_rows(rows);
  add_droplet_rows(rows, options.quick);
  return rows;
}

}  // namespace meltstage::app
