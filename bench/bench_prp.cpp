// SPDX-License-Identifier: Apache-2.0
// The alignment stage of paper 003: accuracy before calibration, after the published staged method and after
// full least squares, each beside the floor of a perfect model.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "bench/bench.hpp"
#include "bench/bench_stimulus.hpp"
#include "motion/align/prp_staged.hpp"
#include "motion/align/prp_trials.hpp"

namespace meltstage::app {

namespace {

using motion::Aligner;
using motion::AlignmentError;
using motion::kArcsecond_rad;
using motion::PlanarPose;
using motion::PrpGeometry;
using motion::PrpStageModel;

constexpr std::size_t kViews = 60;
constexpr std::size_t kMarks = 6;
const PrpGeometry nominal;

std::vector<Eigen::Vector2d> plate() { return motion::plate_marks(11, 11, 40.0, {35.0, 35.0}); }

/// One way of knowing the stage.
struct Method {
  std::string name;
  Aligner aligner;
  motion::PrpTurns home = motion::PrpTurns::Zero();
};

/// A simulated stage, and all methods after their calibration on it.
struct Stage {
  PrpStageModel model;
  std::vector<Method> methods;
};

constexpr std::array<const char*, 5> kMethods{"nominal", "paper as printed", "paper, (10) put right",
                                              "full least squares", "floor: a perfect model"};
constexpr std::size_t kOurs = 3;

Stage calibrated_stage(const motion::PrpStageConfig& config, const std::vector<motion::PrpTurns>& poses) {
  Stage stage{PrpStageModel(config), {}};
  const auto machine = stage.model.with_plate(plate());
  const auto staged = motion::calibrate_staged(machine, plate(), nominal);
  motion::PrpCalibrationOptions options;
  options.actuator_sigma_mm = config.actuator_sigma_mm;
  options.mark_sigma_mm = config.mark_sigma_mm;
  const auto full =
      motion::calibrate_prp(plate(), motion::view_plate(machine, plate(), poses, kMarks), nominal, options);
  const auto by_stages = [staged](motion::Decoupling rule) {
    return [staged, rule](const auto& seen, const auto& wanted) {
      return motion::staged_turns(staged, nominal, seen, wanted, rule);
    };
  };
  stage.methods = {{kMethods[0], motion::align_by(nominal)},
                   {kMethods[1], by_stages(motion::decoupled_as_printed), staged.home},
                   {kMethods[2], by_stages(motion::decoupled), staged.home},
                   {kMethods[3], motion::align_by(full)},
                   {kMethods[4], motion::align_by(config.geometry)}};
  return stage;
}

/// What one method left over all stages.
struct Figures {
  double mean_worst_um = 0.0, worst_um = 0.0, worst_arcsec = 0.0, rms_arcsec = 0.0;
  std::vector<double> all_um;
};

/// What a trial is made of.
struct Trial {
  double actuator_sigma_mm = 0.001;
  int stages = 40;
  int repeats = 5;
  bool home_scatters = false;
  bool two_marks = false;        // in opposite corners of the board; otherwise one in each
  std::size_t random_poses = 0;  // per stage; the eight of table 2 if none
};

std::array<Figures, 5> try_stages(const Trial& trial, std::uint64_t seed, const Progress& progress) {
  motion::PrpCalibrationOptions options;
  options.actuator_sigma_mm = trial.actuator_sigma_mm;
  const auto calibration_poses = motion::choose_poses(kViews, nominal, options);
  std::array<Figures, 5> figures;
  std::array<double, 5> squares{};
  for (int i = 0; i < trial.stages; ++i) {
    tell(progress, fmt::format("{} stages, sliders {} um", trial.stages, trial.actuator_sigma_mm * 1e3), i,
         trial.stages);
    const std::uint64_t stage_seed = seed * 1000 + static_cast<std::uint64_t>(i);
    auto config = motion::random_stage(nominal, {}, stage_seed);
    config.actuator_sigma_mm = trial.actuator_sigma_mm;
    Stage stage = calibrated_stage(config, calibration_poses);
    const auto poses = trial.random_poses > 0
                           ? motion::random_poses(nominal, 3.5, trial.random_poses, stage_seed)
                           : motion::table2_poses();
    for (std::size_t m = 0; m < figures.size(); ++m) {
      motion::TrialSetup setup;
      setup.home = stage.methods[m].home;
      setup.repeats = trial.repeats;
      setup.home_scatters = trial.home_scatters;
      if (trial.two_marks) setup.board_mm = {setup.board_mm[0], setup.board_mm[2]};
      PrpStageModel same_noise = stage.model;  // for every method, so that only what it knows differs
      const auto errors = motion::try_poses(same_noise, poses, stage.methods[m].aligner, setup);
      const AlignmentError worst = motion::worst_of(errors);
      Figures& figure = figures[m];
      figure.mean_worst_um += worst.place_mm.norm() * 1e3 / trial.stages;
      figure.worst_um = std::max(figure.worst_um, worst.place_mm.norm() * 1e3);
      figure.worst_arcsec = std::max(figure.worst_arcsec, worst.angle_rad / kArcsecond_rad);
      for (const auto& error : errors) {
        figure.all_um.push_back(error.place_mm.norm() * 1e3);
        squares[m] += error.angle_rad * error.angle_rad;
      }
    }
  }
  for (std::size_t m = 0; m < figures.size(); ++m)
    figures[m].rms_arcsec =
        std::sqrt(squares[m] / static_cast<double>(figures[m].all_um.size())) / kArcsecond_rad;
  return figures;
}

void add_protocol(std::vector<BenchRow>& rows, const Trial& trial, const BenchOptions& options,
                  std::optional<double> wanted_um, std::optional<double> wanted_arcsec) {
  const auto figures = try_stages(trial, options.seed, options.progress);
  rows.push_back({fmt::format("table 2's poses, mean of {}, sliders {} um{}", trial.repeats,
                              trial.actuator_sigma_mm * 1e3,
                              trial.home_scatters ? ", home too" : (trial.two_marks ? ", two marks" : "")),
                  static_cast<double>(trial.stages),
                  "stages",
                  {},
                  {}});
  for (std::size_t m = 0; m < figures.size(); ++m) {
    const bool ours = m == kOurs;
    rows.push_back(
        {fmt::format("  {}: mean of stages' worst", kMethods[m]), figures[m].mean_worst_um, "um", {}, {}});
    rows.push_back({fmt::format("  {}: worst stage", kMethods[m]),
                    figures[m].worst_um,
                    "um",
                    {},
                    ours ? wanted_um : std::nullopt});
    rows.push_back({fmt::format("  {}: worst angle", kMethods[m]),
                    figures[m].worst_arcsec,
                    "arcsec",
                    {},
                    ours ? wanted_arcsec : std::nullopt});
    rows.push_back({fmt::format("  {}: rms angle", kMethods[m]), figures[m].rms_arcsec, "arcsec", {}, {}});
  }
}

void add_random_poses(std::vector<BenchRow>& rows, const BenchOptions& options) {
  const Trial trial{.stages = 40, .repeats = 1, .random_poses = options.quick ? 25U : 250U};
  const auto figures = try_stages(trial, options.seed, options.progress);
  rows.push_back({"random poses, one stop each, sliders 1 um",
                  static_cast<double>(figures[0].all_um.size()),
                  "poses",
                  {},
                  {}});
  for (std::size_t m = 0; m < figures.size(); ++m) {
    const auto label = fmt::format("  {}", kMethods[m]);
    // A single stop can't be better than its scatter: wanted of ours is at most a fifth above the floor of
    // this very run.
    rows.push_back({label + ": worst",
                    figures[m].worst_um,
                    "um",
                    {},
                    m == kOurs ? std::optional(1.2 * figures.back().worst_um) : std::nullopt});
    rows.push_back({label + ": worst angle",
                    figures[m].worst_arcsec,
                    "arcsec",
                    {},
                    m == kOurs ? std::optional(1.2 * figures.back().worst_arcsec) : std::nullopt});
  }
}

void add_kinematics(std::vector<BenchRow>& rows, std::uint64_t seed) {
  double worst = 0.0;
  for (std::uint64_t i = 0; i < 100; ++i) {
    const PrpGeometry built = motion::random_stage(nominal, {}, 100 * seed + i).geometry;
    for (const PlanarPose& pose : motion::random_poses(built, 5.0, 1000, i)) {
      const PlanarPose back = motion::prp_forward(built, motion::prp_inverse(built, pose));
      worst = std::max({worst, std::abs(back.x_mm - pose.x_mm), std::abs(back.y_mm - pose.y_mm)});
    }
  }
  rows.push_back({"forward of inverse, 10^5 poses of 100 stages", worst, "mm", {}, 1e-12});
}

void add_identification(std::vector<BenchRow>& rows, std::uint64_t seed) {
  PrpStageModel stage(motion::random_stage(nominal, {}, seed));
  const auto machine = stage.with_plate(plate());
  const auto views = motion::view_plate(machine, plate(), motion::choose_poses(kViews, nominal), kMarks);
  double best_ms = INFINITY;
  for (int i = 0; i < 10; ++i) {
    const double begin = processor_s();
    const auto found = motion::calibrate_prp(plate(), views, nominal);
    best_ms = std::min(best_ms, (processor_s() - begin) * 1e3);
    if (i > 0) continue;
    rows.push_back(
        {"full least squares, 60 poses: iterations", static_cast<double>(found.iterations), "", {}, {}});
    rows.push_back({"  misfit (1: the noise explains all)", found.misfit, "sigma", {}, {}});
    rows.push_back(
        {"  left open at the workspace's corners", found.prediction_sigma_mm * 1e3, "um", {}, 1.0});
    rows.push_back({"  pairs named that the data can't tell apart",
                    static_cast<double>(std::count_if(
                        found.warnings.begin(), found.warnings.end(),
                        [](const std::string& line) { return line.find("apart") != std::string::npos; })),
                    "",
                    {},
                    {}});
  }
  rows.push_back({"  time, residual table with it, best of 10", best_ms, "ms", {}, 5.0});
  std::vector<motion::PrpTurns> random;
  for (const PlanarPose& pose : motion::random_poses(nominal, 5.0, kViews, seed))
    random.push_back(motion::prp_inverse(nominal, pose));
  const auto by_chance =
      motion::calibrate_prp(plate(), motion::view_plate(machine, plate(), random, kMarks), nominal);
  rows.push_back(
      {"  the same from random poses: left open", by_chance.prediction_sigma_mm * 1e3, "um", {}, {}});
}

void add_residual_table(std::vector<BenchRow>& rows, std::uint64_t seed) {
  auto poses = motion::choose_poses(40, nominal);
  for (const PlanarPose& pose : motion::random_poses(nominal, 5.0, 160, seed))
    poses.push_back(motion::prp_inverse(nominal, pose));
  auto config = motion::random_stage(nominal, {}, seed);
  config.screw_wave_mm = 0.008;
  config.guide_bow_mm = 0.01;
  PrpStageModel stage(config);
  auto found = motion::calibrate_prp(
      plate(), motion::view_plate(stage.with_plate(plate()), plate(), poses, kMarks), nominal);
  const auto worst_um = [&] {
    return motion::worst_of(motion::try_poses(stage, motion::random_poses(nominal, 3.5, 200, seed + 1),
                                              motion::align_by(found), {}))
               .place_mm.norm() *
           1e3;
  };
  const double with_table = worst_um();
  found.table = {};
  const double without = worst_um();
  rows.push_back({"screws off by 8 um, guide bent: geometry alone", without, "um", {}, {}});
  rows.push_back({"  with the residual table", with_table, "um", {}, 0.5 * without});
}

/// ISO 9283: 30 cycles at each of five poses, in the middle of the board; the worst pose counts, as in the
/// paper.
void add_repeatability(std::vector<BenchRow>& rows, std::uint64_t seed) {
  motion::PrpStageConfig config;
  config.backlash_mm = 0.0035;
  config.seed = seed;
  PrpStageModel stage(config);
  const auto& board_mm = motion::TrialSetup{}.board_mm;
  const Eigen::Vector2d board_middle_mm = 0.5 * (board_mm[0] + board_mm[2]);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> turns(-2.0, 2.0);
  const auto worst_of = [&](bool one_way) {
    motion::Repeatability worst;
    const auto poses = motion::table2_poses();
    for (std::size_t p = 0; p < 5; ++p) {
      std::vector<AlignmentError> attained;
      for (int cycle = 0; cycle < 30; ++cycle) {
        const motion::PrpTurns target = motion::prp_inverse(nominal, poses[p]);
        const double a = turns(random), b = turns(random), c = turns(random);
        if (one_way) {
          stage.approach_from_below(target);
        } else {
          stage.move_to({a, b, c});
          stage.move_to(target);
        }
        attained.push_back({motion::moved(stage.true_pose(), board_middle_mm), stage.true_pose().angle_rad});
      }
      const auto each = motion::repeatability(attained);
      if (each.radius_mm > worst.radius_mm) worst = each;
    }
    return worst;
  };
  const auto one_way = worst_of(true), any_way = worst_of(false);
  rows.push_back({"ISO 9283, from one side: RP (paper 3.274)", one_way.radius_mm * 1e3, "um", {}, {}});
  rows.push_back({"  smallest circle, radius (paper 2.279)", one_way.enclosing_mm * 1e3, "um", {}, {}});
  rows.push_back({"  angle +- 3 sigma", one_way.angle_rad / kArcsecond_rad, "arcsec", {}, {}});
  rows.push_back({"ISO 9283, from all sides: RP (paper 6.343)", any_way.radius_mm * 1e3, "um", {}, {}});
  rows.push_back({"  smallest circle, radius (paper 4.852)", any_way.enclosing_mm * 1e3, "um", {}, {}});
}

}  // namespace

std::vector<BenchRow> bench_prp(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  const int stages = options.quick ? 10 : 40;
  add_kinematics(rows, options.seed);
  add_identification(rows, options.seed);
  rows.push_back({"paper, measured: before, worst of 8 poses", 161.6, "um", {}, {}});
  rows.push_back({"paper, measured: after", 12.3, "um", {}, {}});
  rows.push_back({"paper, measured: after, angle", 0.720, "arcsec", {}, {}});
  add_protocol(rows, {.actuator_sigma_mm = 0.001, .stages = stages}, options, 2.5, {});
  add_protocol(rows, {.actuator_sigma_mm = 0.0005, .stages = stages}, options, 1.2, 0.720);
  add_protocol(rows, {.actuator_sigma_mm = 0.0005, .stages = stages, .two_marks = true}, options, {}, {});
  add_protocol(rows, {.actuator_sigma_mm = 0.0005, .stages = stages, .home_scatters = true}, options, {}, {});
  add_random_poses(rows, options);
  add_residual_table(rows, options.seed);
  add_repeatability(rows, options.seed);
  return rows;
}

namespace {

/// What the data leave open at the workspace's corners, over the number of poses.
BenchChart poses_chart(const Progress& progress) {
  BenchChart chart{"prp_poses",
                   "poses that the plate was seen at",
                   "left open at the workspace's corners, um (sigma)",
                   0.0,
                   5.0,
                   {{"choose_poses", {}, {}}, {"random poses", {}, {}}}};
  PrpStageModel stage(motion::random_stage(nominal, {}, 1));
  for (std::size_t count = 8; count <= 80; count += 4) {
    tell(progress, "chart", count - 8, 80 - 8);
    std::vector<motion::PrpTurns> random;
    for (const PlanarPose& pose : motion::random_poses(nominal, 5.0, count, 1))
      random.push_back(motion::prp_inverse(nominal, pose));
    const std::array sets{motion::choose_poses(count, nominal), random};
    for (std::size_t i = 0; i < sets.size(); ++i) {
      const auto views = motion::view_plate(stage.with_plate(plate()), plate(), sets[i], kMarks);
      chart.curves[i].x.push_back(static_cast<double>(count));
      chart.curves[i].y.push_back(motion::calibrate_prp(plate(), views, nominal).prediction_sigma_mm * 1e3);
    }
  }
  return chart;
}

}  // namespace

std::vector<BenchChart> prp_charts(const Progress& progress) {
  const auto figures = try_stages({.stages = 40, .repeats = 1, .random_poses = 250}, 1, progress);
  BenchChart chart{"prp_random_poses",
                   "error of a single alignment, um",
                   "share of 10,000 random poses, %",
                   0.0,
                   100.0,
                   {}};
  for (std::size_t m = 0; m < figures.size(); ++m) {
    auto errors = figures[m].all_um;
    std::sort(errors.begin(), errors.end());
    BenchCurve curve{kMethods[m], {}, {}};
    for (double um = 0.0; um <= 10.0; um += 0.05) {
      const auto within = std::upper_bound(errors.begin(), errors.end(), um) - errors.begin();
      curve.x.push_back(um);
      curve.y.push_back(100.0 * static_cast<double>(within) / static_cast<double>(errors.size()));
    }
    chart.curves.push_back(curve);
  }
  return {chart, poses_chart(progress)};
}

}  // namespace meltstage::app
