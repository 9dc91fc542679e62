// SPDX-License-Identifier: Apache-2.0
// Conformal printing: interpolation, measuring points on simulated surfaces, five axes, and the experiment of
// Xu et al. 2024 rebuilt.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>

#include "base/temporary_folder.hpp"
#include "bench/bench.hpp"
#include "motion/surface/conformal.hpp"
#include "motion/surface/conformal_trial.hpp"
#include "motion/surface/curve_feed.hpp"
#include "motion/surface/measuring_points.hpp"
#include "motion/surface/print_program.hpp"
#include "motion/surface/smoothing.hpp"
#include "motion/surface/trial_calibration.hpp"

namespace meltstage::app {

namespace {

using Points = std::vector<Eigen::Vector3d>;

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Processor time of the best of some rounds: others on the machine slow the rest.
template <class Action>
double best_s(int rounds, const Action& action) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < rounds; ++i) {
    const double start = processor_s();
    action();
    best = std::min(best, processor_s() - start);
  }
  return best;
}

// A line with uneven steps, 0.05 mm in the mean, over some tens of millimetres to and fro.
Points test_points(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> step(0.02, 0.08);
  Points out;
  double s = 0.0;
  for (int i = 0; i < count; ++i) {
    s += step(random);
    out.emplace_back(30.0 * std::sin(s / 30.0) + 0.02 * s, 20.0 * std::cos(s / 11.0),
                     3.0 * std::sin(s / 5.0));
  }
  return out;
}

struct Peer {
  double time_us = 0.0, error_mm = 0.0;
};

// SISL on the same points, by the program beside this one.
std::optional<Peer> run_sisl(const Points& points, int rounds) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "points";
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(points.data()),
             static_cast<std::streamsize>(points.size() * sizeof(Eigen::Vector3d)));
  const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "sisl_interpolation";
  const std::string command = fmt::format("'{}' '{}' {}", program.string(), file.string(), rounds);
  Peer peer;
  bool read = false;
  if (std::filesystem::exists(program)) {
    if (FILE* pipe = popen(command.c_str(), "r"); pipe != nullptr) {
      read = std::fscanf(pipe, "%lf %lf", &peer.time_us, &peer.error_mm) == 2;
      read = pclose(pipe) == 0 && read;
    }
  }
  return read ? std::optional(peer) : std::nullopt;
}

void add_interpolation(std::vector<BenchRow>& rows, const BenchOptions& options) {
  constexpr int kCount = 10'000;
  const int rounds = options.quick ? 30 : 200;
  const Points points = test_points(kCount, options.seed), twice = test_points(2 * kCount, options.seed);
  const motion::Nurbs curve = motion::interpolate(points);
  const std::vector<double> u = motion::point_parameters(points, motion::Parameters::chord_length);
  double error_mm = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i)
    error_mm = std::max(error_mm, (curve.position_mm(u[i]) - points[i]).norm());
  const double time_s = best_s(rounds, [&] { motion::interpolate(points); });
  const double twice_s = best_s(rounds / 2, [&] { motion::interpolate(twice); });
  rows.push_back({"interpolation, 10000 points: largest error", error_mm, "mm", {}, 1e-12});
  rows.push_back({"  processor time", time_s * 1e6, "us", {}, 500.0});
  if (const auto peer = run_sisl(points, options.quick ? 10 : 60)) {
    rows.push_back({"  SISL s1356 on the same points", peer->time_us, "us", {}, {}});
    rows.push_back({"  SISL's largest error", peer->error_mm, "mm", {}, {}});
    rows.push_back({"  SISL / ours", peer->time_us / (time_s * 1e6), "", 1.0, {}});
  } else {
    rows.push_back({"  SISL not measured (sisl_interpolation isn't there)", 0.0, "", 1.0, {}});
  }
  rows.push_back({"  20000 points / 10000 points", twice_s / time_s, "", {}, 2.6});
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<double> places(100'000);
  for (double& place : places) place = uniform(random);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const auto evaluate = [&] {
    for (const double place : places) sum += curve.position_mm(place);
  };
  const double random_s = best_s(rounds / 10, evaluate);
  std::sort(places.begin(), places.end());
  const double sorted_s = best_s(rounds / 10, evaluate);
  rows.push_back({"evaluation at random places", 1e9 * random_s / 1e5, "ns", {}, 50.0});
  rows.push_back({"  at places in order", 1e9 * sorted_s / 1e5, "ns", sum.allFinite() ? 0.0 : 1e9, 50.0});
}

// A servo's way along a free line at its planned speed: how even the speed is, and what limits it.
void add_feed(std::vector<BenchRow>& rows) {
  const motion::ClLine line = motion::trial_lines()[7];
  const Points all = positions_mm(line);
  Points some;
  for (std::size_t i = 0; i < all.size(); i += 10) some.push_back(all[i]);
  const motion::Nurbs curve = motion::interpolate(some);
  const motion::ArcLength length(curve);
  const motion::FeedLimits limits{.feed_mm_s = 60.0, .normal_acceleration_mm_s2 = 300.0};
  const motion::FeedPlan plan = plan_feed(curve, length, limits);
  double uneven = 0.0, above = 0.0, chord_mm = 0.0;
  Eigen::Vector3d last = curve.position_mm(0.0);
  double last_mm = 0.0, last_u = 0.0;
  for (double t = limits.cycle_s; t < plan.duration_s; t += limits.cycle_s) {
    const motion::MotionState state = plan.sample(t);
    const double u = length.parameter(state.position_mm);
    const Eigen::Vector3d here = curve.position_mm(u), middle = curve.position_mm(0.5 * (u + last_u));
    const double way_mm = state.position_mm - last_mm;
    // The chord is shorter than the way by what the curve bends; that is no unevenness.
    if (way_mm > 1e-3)
      uneven = std::max(uneven, std::abs(length.length_mm(u) - length.length_mm(last_u) - way_mm) / way_mm);
    above = std::max(above, state.velocity_mm_s / feed_limit_mm_s(curve, u, limits) - 1.0);
    chord_mm = std::max(chord_mm, motion::distance_to_segment_mm(middle, last, here));
    last = here, last_mm = state.position_mm, last_u = u;
  }
  rows.push_back({"feed: unevenness of the way a cycle, 60 mm/s", 100.0 * uneven, "%", {}, 1e-6});
  rows.push_back({"  speed above its limit anywhere", 100.0 * above, "%", {}, 1e-6});
  rows.push_back({"  chord error of a cycle", 1e3 * chord_mm, "um", {}, 1.0});
  rows.push_back({"  time / length at full feed", plan.duration_s / (length.total_mm() / 60.0), "", {}, {}});
}

// Three test lines, one of each shape, and a line on a flat face, whose model says nothing of where the part
// is wrong.
struct TestLine {
  motion::ClLine line;
  const char* name;
  bool flat;
};

std::vector<TestLine> test_lines() {
  const auto lines = motion::trial_lines();
  TestLine flat{lines[1], "flat", true};
  for (motion::ClPoint& point : flat.line.points) {
    point.position_mm.z() = 0.0;
    point.axis = Eigen::Vector3d::UnitZ();
  }
  return {{lines[1], "straight", false}, {lines[4], "arc", false}, {lines[7], "free", false}, flat};
}

// The parts they lie on: as machined, and as rough as a printed part, with waves as short as
// choose_by_spline() is told to expect.
struct PartKind {
  const char* name;
  motion::PartErrors errors;
};
const std::array<PartKind, 2> kPartKinds{
    {{"35 um form error, waves from 12 mm", {}},
     {"60 um form error, waves from 8 mm", {.form_mm = 0.060, .shortest_wave_mm = 8.0}}}};

motion::RealPart part_under(const TestLine& line, const motion::PartErrors& errors, std::uint64_t seed) {
  motion::RealPart part = motion::make_trial_part(errors, seed);
  if (line.flat)
    part.height_mm = [height_mm = part.height_mm](double x, double y) {
      return height_mm(x, y) - motion::trial_height_mm(x, y);
    };
  return part;
}

enum class PointRule { ours, papers, even };

motion::ProbeLine points_by(PointRule rule, const motion::ClLine& line) {
  const auto ours = choose_by_spline(line, {});
  const Points path = positions_mm(line);
  if (rule == PointRule::ours) return {line.name, ours};
  return {line.name,
          measuring_points(line, rule == PointRule::papers ? motion::choose_by_chord(path, 0.020)
                                                           : motion::choose_evenly(path, ours.size()))};
}

motion::RealLine rebuild(PointRule rule, const motion::ClLine& line, const motion::RealPart& part,
                         std::uint64_t seed) {
  const motion::TouchProbeModel model;
  const motion::ReconstructionOptions options{.ball_radius_mm = effective_radius_mm(model),
                                              .noise_mm = model.noise_mm};
  const motion::ProbeLine points = points_by(rule, line);
  motion::TouchProbe probe(model, seed);
  const Points touches = touch_all(part, {&points, 1}, {}, probe);
  return rule == PointRule::ours ? reconstruct(line, points, touches, options)
                                 : reconstruct_as_published(line, points, touches, options);
}

void add_points(std::vector<BenchRow>& rows, const BenchOptions& options) {
  const int parts = options.quick ? 4 : 40;
  const std::vector<TestLine> lines = test_lines();
  std::size_t parts_done = 0;
  for (const TestLine& test : lines) {
    const auto count = [&](PointRule rule) {
      return static_cast<double>(points_by(rule, test.line).points.size());
    };
    rows.push_back({fmt::format("{} line, 20 um: points", test.name), count(PointRule::ours), "", {}, 27.0});
    rows.push_back({"  paper's rule", count(PointRule::papers), "", {}, {}});
    for (const PartKind& kind : kPartKinds) {
      std::array<double, 3> worst_um{};
      for (int i = 0; i < parts; ++i) {
        tell(options.progress, "measuring points", parts_done++,
             lines.size() * std::size(kPartKinds) * parts);
        const std::uint64_t seed = options.seed * 1000 + i;
        const motion::RealPart part = part_under(test, kind.errors, seed);
        for (const PointRule rule : {PointRule::ours, PointRule::papers, PointRule::even}) {
          double& worst = worst_um[static_cast<std::size_t>(rule)];
          worst = std::max(worst, 1e3 * largest_gap_error_mm(rebuild(rule, test.line, part, seed), part));
        }
      }
      rows.push_back({fmt::format("  {}: worst of {} parts", kind.name, parts), worst_um[0], "um", {}, 20.0});
      rows.push_back({"    paper's rule", worst_um[1], "um", {}, {}});
      rows.push_back({"    even, as many as ours, paper's curve", worst_um[2], "um", {}, {}});
    }
  }
}

// One touch of a line wrong, by dust or a burr, or two beside each other: are they named? And are right ones
// left in peace?
void add_wrong_touches(std::vector<BenchRow>& rows, const BenchOptions& options) {
  const int parts = options.quick ? 4 : 60;
  const auto lines = motion::trial_lines();
  const motion::TouchProbeModel model;
  const motion::ReconstructionOptions rebuilt{.ball_radius_mm = effective_radius_mm(model),
                                              .noise_mm = model.noise_mm};
  for (const PartKind& kind : kPartKinds) {
    std::mt19937_64 random(options.seed);
    std::array<int, 3> named{};
    constexpr std::array<double, 3> kWrong_mm{0.15, 0.05, 0.03};
    int tried = 0, disturbed = 0, pairs = 0;
    for (int i = 0; i < parts; ++i) {
      tell(options.progress, "wrong touches", static_cast<std::size_t>(i), static_cast<std::size_t>(parts));
      const std::uint64_t seed = options.seed * 1000 + 500 + static_cast<std::uint64_t>(i);
      const motion::RealPart part = motion::make_trial_part(kind.errors, seed);
      for (const motion::ClLine& line : lines) {
        const motion::ProbeLine points{line.name, choose_by_spline(line, {})};
        motion::TouchProbe probe(model, seed);
        const Points touches = touch_all(part, {&points, 1}, {}, probe);
        disturbed += reconstruct(line, points, touches, rebuilt).suspects.empty() ? 0 : 1;
        const std::size_t wrong = random() % touches.size();
        const double sign = random() % 2 == 0 ? 1.0 : -1.0;
        for (std::size_t k = 0; k < kWrong_mm.size(); ++k) {
          Points with_wrong = touches;
          with_wrong[wrong] += sign * kWrong_mm[k] * points.points[wrong].axis;
          const auto suspects = reconstruct(line, points, with_wrong, rebuilt).suspects;
          named[k] +=
              std::any_of(suspects.begin(), suspects.end(), [&](const auto& s) { return s.touch == wrong; });
        }
        Points with_pair = touches;
        const std::size_t first = std::min(wrong, touches.size() - 2);
        for (const std::size_t k : {first, first + 1})
          with_pair[k] += sign * kWrong_mm[0] * points.points[k].axis;
        const auto suspects = reconstruct(line, points, with_pair, rebuilt).suspects;
        pairs += std::count_if(suspects.begin(), suspects.end(),
                               [&](const auto& s) { return s.touch - first < 2; }) == 2;
        ++tried;
      }
    }
    const auto share = [&](int count) { return 100.0 * count / tried; };
    rows.push_back(
        {fmt::format("{}: a touch 150 um off is named", kind.name), share(named[0]), "%", 97.0, {}});
    rows.push_back({"  two beside each other 150 um off are named", share(pairs), "%", 90.0, {}});
    rows.push_back({"  50 um off", share(named[1]), "%", {}, {}});
    rows.push_back({"  30 um off", share(named[2]), "%", {}, {}});
    rows.push_back({"  lines without a wrong one in which one is named", share(disturbed), "%", {}, 1.0});
  }
}

void add_chord(std::vector<BenchRow>& rows, const BenchOptions& options) {
  const int count = options.quick ? 20'000 : 200'000;
  // Nearly straight with roughness: the chords are long, which is what makes the published form slow.
  const auto rough = [&](int n) {
    std::mt19937_64 random(options.seed);
    std::normal_distribution<double> noise(0.0, 0.001);
    Points out;
    for (int i = 0; i < n; ++i)
      out.emplace_back(0.01 * i, 0.001 * std::sin(0.002 * i) + noise(random), noise(random));
    return out;
  };
  const Points half = rough(count / 2), full = rough(count), few = rough(2000);
  const double half_s = best_s(9, [&] { motion::choose_by_chord(half, 0.02); });
  const double full_s = best_s(9, [&] { motion::choose_by_chord(full, 0.02); });
  rows.push_back({fmt::format("chord rule, {} points", count), 1e3 * full_s, "ms", {}, {}});
  rows.push_back({"  time / that of half the points", full_s / half_s, "", {}, 2.6});
  const double published_s = best_s(1, [&] { motion::choose_by_chord_as_published(few, 0.02); });
  const double fast_s = best_s(3, [&] { motion::choose_by_chord(few, 0.02); });
  rows.push_back({"  as published / ours, 2000 points", published_s / fast_s, "", 1.0, {}});
  rows.push_back(
      {"  same points chosen",
       motion::choose_by_chord_as_published(few, 0.02) == motion::choose_by_chord(few, 0.02) ? 1.0 : 0.0,
       "",
       1.0,
       {}});
}

void add_five_axis(std::vector<BenchRow>& rows) {
  const motion::TwinRotaryTable table{.tilt_centre_mm = {0.0, 30.0, -40.0},
                                      .rotary_centre_mm = {20.0, 30.0, 0.0}};
  motion::PrintProgramOptions options;
  options.table = table;
  double round_trip = 0.0, between_mm = 0.0, lean_deg = 0.0;
  for (const motion::ClLine& line : motion::trial_lines()) {
    const auto moves = plan_line(motion::nominal_line(line), options);
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const motion::ToolPose back = pose_of(table, moves[i].axes);
      round_trip = std::max(round_trip, (back.tip_mm - moves[i].pose.tip_mm).norm());
      lean_deg = std::max(lean_deg, std::acos(std::clamp(back.axis.dot(moves[i].pose.axis), -1.0, 1.0)) *
                                        180.0 / std::numbers::pi);
      if (i == 0) continue;
      const auto &a = moves[i - 1], &b = moves[i];
      for (const double share : {0.25, 0.5, 0.75}) {
        const motion::AxesPosition at{(1.0 - share) * a.axes.linear_mm + share * b.axes.linear_mm,
                                      (1.0 - share) * a.axes.tilt_deg + share * b.axes.tilt_deg,
                                      (1.0 - share) * a.axes.rotary_deg + share * b.axes.rotary_deg};
        between_mm = std::max(between_mm, motion::distance_to_segment_mm(pose_of(table, at).tip_mm,
                                                                         a.pose.tip_mm, b.pose.tip_mm));
      }
    }
  }
  rows.push_back({"five axes: tip, there and back", round_trip, "mm", {}, 1e-12});
  rows.push_back({"  tip off its line between blocks", 1e3 * between_mm, "um", {}, 1.0});
  rows.push_back({"  tool off the normal (singular cone 0.5)", lean_deg, "deg", {}, 0.5});
}

// Noise far above what a probe has: interpolation hands it through, smoothing takes part of it away and says
// what is left. 3.68 um is what the best amount of smoothing leaves of these values in the mean of all draws.
void add_smoothing(std::vector<BenchRow>& rows, const BenchOptions& options) {
  constexpr int kCount = 200;
  constexpr double kNoise_mm = 0.010;
  const int draws = options.quick ? 10 : 100;
  std::mt19937_64 random(options.seed);
  std::normal_distribution<double> noise(0.0, kNoise_mm);
  std::vector<double> at;
  for (int i = 0; i < kCount; ++i) at.push_back(0.2 * i);
  double square = 0.0, told = 0.0, estimated_mm = 0.0;
  for (int draw = 0; draw < draws; ++draw) {
    tell(options.progress, "smoothing", draw, draws);
    Eigen::MatrixXd truth(kCount, 1), measured(kCount, 1);
    for (int i = 0; i < kCount; ++i) {
      truth(i, 0) = 0.1 * std::sin(0.4 * at[i]) + 0.05 * std::cos(0.9 * at[i]);
      measured(i, 0) = truth(i, 0) + noise(random);
    }
    const motion::SmoothedValues smoothed = motion::smooth(at, measured, kNoise_mm);
    square += (smoothed.values - truth).squaredNorm() / kCount / draws;
    told += smoothed.standard_error.squaredNorm() / kCount / draws;
    estimated_mm += motion::smooth(at, measured, 0.0).noise / draws;
  }
  rows.push_back({fmt::format("smoothing, 10 um noise on 200 touches, {} draws: rms error", draws),
                  1e3 * std::sqrt(square),
                  "um",
                  {},
                  4.0});
  rows.push_back({"  error / the error told", std::sqrt(square / told), "", 0.8, 1.25});
  rows.push_back({"  noise estimated where it isn't known", 1e3 * estimated_mm, "um", 9.5, 10.5});
}

// ---------------------------------------------------------------- experiment

using Trial = std::vector<motion::TrialLineResult>;

struct Experiment {
  Trial before, published, full;
};

Experiment run_experiment(const motion::RealPart& part, std::uint64_t seed) {
  const auto run = [&](motion::Compensation compensation) {
    return run_trial(part, compensation, motion::DepositionModel{}, seed);
  };
  return {run(motion::Compensation::none), run(motion::Compensation::as_published),
          run(motion::Compensation::full)};
}

constexpr std::uint64_t kNoiseSeed = 1;  // of probe and paste on the part that stands for the paper's

Experiment run_papers() { return run_experiment(make_trial_part(motion::paper_error()), kNoiseSeed); }

template <class Value>
double mean(const Trial& trial, const Value& value) {
  double sum = 0.0;
  for (const motion::TrialLineResult& line : trial) sum += value(line) / static_cast<double>(trial.size());
  return sum;
}

double resistance(const motion::TrialLineResult& line) { return line.resistance_ohm; }
double deviation_um(const motion::TrialLineResult& line) { return 1e3 * line.width.deviation_mm; }
double width_um(const motion::TrialLineResult& line) { return 1e3 * line.width.mean_mm; }
double gap_um(const motion::TrialLineResult& line) { return 1e3 * line.gap_error_mm; }

double worst_gap_um(const Trial& trial) {
  double worst = 0.0;
  for (const motion::TrialLineResult& line : trial) worst = std::max(worst, gap_um(line));
  return worst;
}

// Reduction of the means, %.
double reduction(const Trial& before, const Trial& after) {
  return 100.0 * (1.0 - mean(after, resistance) / mean(before, resistance));
}

// Of each line, %.
std::vector<double> reductions(const Trial& before, const Trial& after) {
  std::vector<double> out;
  for (std::size_t i = 0; i < after.size(); ++i)
    out.push_back(100.0 * (1.0 - after[i].resistance_ohm / before[i].resistance_ohm));
  return out;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value / static_cast<double>(values.size());
  return sum;
}

void add_line(std::vector<BenchRow>& rows, const Experiment& run, std::size_t i) {
  const motion::PrintedLine &first = motion::first_group()[i], &second = motion::second_group()[i];
  const auto &before = run.before[i], &papers = run.published[i], &ours = run.full[i];
  const auto told = [&](const std::string& what, double value, const char* unit) {
    rows.push_back({what, value, unit, {}, {}});
  };
  told(fmt::format("line {}: resistance before (paper {:.3f})", i + 1, first.resistance_ohm),
       before.resistance_ohm, "ohm");
  told(fmt::format("  after, paper's compensation (paper {:.3f})", second.resistance_ohm),
       papers.resistance_ohm, "ohm");
  told("  after, ours", ours.resistance_ohm, "ohm");
  told(fmt::format("  reduction, paper's compensation (paper {:.2f})",
                   100.0 * (1.0 - second.resistance_ohm / first.resistance_ohm)),
       100.0 * (1.0 - papers.resistance_ohm / before.resistance_ohm), "%");
  rows.push_back(
      {"  reduction, ours", 100.0 * (1.0 - ours.resistance_ohm / before.resistance_ohm), "%", 0.0, {}});
  told(fmt::format("  mean width before (paper {:.0f})", first.width_um), width_um(before), "um");
  told(fmt::format("  after, paper's compensation (paper {:.0f})", second.width_um), width_um(papers), "um");
  told("  after, ours", width_um(ours), "um");
  told(fmt::format("  spread of the width before (paper {:.0f})", first.deviation_um), deviation_um(before),
       "um");
  told(fmt::format("  after, paper's compensation (paper {:.0f})", second.deviation_um), deviation_um(papers),
       "um");
  rows.push_back({"  after, ours", deviation_um(ours), "um", {}, deviation_um(before)});
  told("  largest gap error before", gap_um(before), "um");
  told("  after, paper's compensation", gap_um(papers), "um");
  rows.push_back({"  after, ours", gap_um(ours), "um", {}, 20.0});
}

// The same part under other noise of probe and paste.
void add_noise_seeds(std::vector<BenchRow>& rows, const BenchOptions& options) {
  const int seeds = options.quick ? 4 : 60;
  const motion::RealPart part = make_trial_part(motion::paper_error());
  int steadier = 0, reduced = 0;
  for (int i = 0; i < seeds; ++i) {
    tell(options.progress, "noise", i, seeds);
    const std::uint64_t seed = 1'000'000 * options.seed + i;
    const Trial before = run_trial(part, motion::Compensation::none, motion::DepositionModel{}, seed);
    const Trial after = run_trial(part, motion::Compensation::full, motion::DepositionModel{}, seed);
    for (std::size_t k = 0; k < before.size(); ++k) {
      steadier += deviation_um(after[k]) < deviation_um(before[k]) ? 1 : 0;
      reduced += after[k].resistance_ohm < before[k].resistance_ohm ? 1 : 0;
    }
  }
  rows.push_back({fmt::format("this part, {} seeds of noise: lines with a lower spread, ours", seeds),
                  100.0 * steadier / (9.0 * seeds),
                  "%",
                  100.0,
                  {}});
  rows.push_back({"  lines with a lower resistance", 100.0 * reduced / (9.0 * seeds), "%", 100.0, {}});
}

// The paper's experiment: nothing in it was fitted to the paper's second group.
void add_experiment(std::vector<BenchRow>& rows) {
  const Experiment run = run_papers();
  rows.push_back(
      {"experiment, before: mean resistance (paper 2.005)", mean(run.before, resistance), "ohm", 1.98, 2.03});
  rows.push_back({"  mean width (paper 486)", mean(run.before, width_um), "um", 476.0, 496.0});
  rows.push_back(
      {"  mean spread of the width (paper 95)", mean(run.before, deviation_um), "um", 90.0, 100.0});
  rows.push_back({"  misfit of 41 figures of the first group, rms of their deviations",
                  std::sqrt(motion::assess_fit({}, motion::paper_error()).misfit / 41.0),
                  "",
                  {},
                  1.0});
  for (std::size_t i = 0; i < run.before.size(); ++i) add_line(rows, run, i);
  rows.push_back({"mean resistance after, paper's compensation (paper 0.682)",
                  mean(run.published, resistance),
                  "ohm",
                  {},
                  {}});
  rows.push_back({"  ours", mean(run.full, resistance), "ohm", {}, {}});
  const auto papers = reductions(run.before, run.published), ours = reductions(run.before, run.full);
  rows.push_back({"reduction of the means, paper's compensation (paper 65.99)",
                  reduction(run.before, run.published),
                  "%",
                  {},
                  {}});
  rows.push_back({"  ours", reduction(run.before, run.full), "%", {}, {}});
  rows.push_back(
      {"mean of nine reductions, paper's compensation (paper 43.13)", mean_of(papers), "%", {}, {}});
  rows.push_back({"  ours", mean_of(ours), "%", {}, {}});
  rows.push_back({"best reduction, paper's compensation (paper 85.75)",
                  *std::max_element(papers.begin(), papers.end()),
                  "%",
                  {},
                  {}});
  rows.push_back({"  ours", *std::max_element(ours.begin(), ours.end()), "%", {}, {}});
  rows.push_back({"worst gap error before", worst_gap_um(run.before), "um", {}, {}});
  rows.push_back({"  after, paper's compensation", worst_gap_um(run.published), "um", {}, {}});
  rows.push_back({"  after, ours", worst_gap_um(run.full), "um", {}, 20.0});
}

// Parts that nothing was fitted to, each with noise of its own: errors as drawn for the measuring points, and
// half as large, which is nearer to the part that stands for the paper's.
void add_other_parts(std::vector<BenchRow>& rows, const BenchOptions& options) {
  const int parts = options.quick ? 4 : 60;
  for (const double size : {1.0, 0.5}) {
    const motion::PartErrors drawn;
    const motion::PartErrors errors{.form_mm = size * drawn.form_mm,
                                    .shortest_wave_mm = drawn.shortest_wave_mm,
                                    .height_mm = size * drawn.height_mm,
                                    .tilt_rad = size * drawn.tilt_rad,
                                    .shift_mm = size * drawn.shift_mm};
    int steadier = 0, steadier_parts = 0, reduced = 0, reduced_parts = 0;
    double gap = 0.0, before_ohm = 0.0, after_ohm = 0.0, most = 0.0;
    for (int i = 0; i < parts; ++i) {
      tell(options.progress, fmt::format("parts of {} the error", size), i, parts);
      const std::uint64_t seed = 1'000'000 * options.seed + i;
      const motion::RealPart part = motion::make_trial_part(errors, seed);
      const Trial before = run_trial(part, motion::Compensation::none, motion::DepositionModel{}, seed);
      const Trial after = run_trial(part, motion::Compensation::full, motion::DepositionModel{}, seed);
      int steadier_here = 0, reduced_here = 0;
      for (std::size_t k = 0; k < before.size(); ++k) {
        steadier_here += deviation_um(after[k]) < deviation_um(before[k]) ? 1 : 0;
        reduced_here += after[k].resistance_ohm < before[k].resistance_ohm ? 1 : 0;
        most = std::max(most, after[k].resistance_ohm / before[k].resistance_ohm - 1.0);
      }
      steadier += steadier_here, reduced += reduced_here;
      steadier_parts += steadier_here == 9 ? 1 : 0, reduced_parts += reduced_here == 9 ? 1 : 0;
      gap = std::max(gap, worst_gap_um(after));
      before_ohm += mean(before, resistance) / parts, after_ohm += mean(after, resistance) / parts;
    }
    const auto told = [&](const std::string& what, double value) {
      rows.push_back({what, value, "%", {}, {}});
    };
    const double lines = 9.0 * parts;
    rows.push_back({fmt::format("{} other parts, form error {:.1f} um: worst gap error, ours", parts,
                                1e3 * errors.form_mm),
                    gap,
                    "um",
                    {},
                    20.0});
    rows.push_back({"  lines with a lower spread of the width", 100.0 * steadier / lines, "%", 100.0, {}});
    told("  parts with a lower spread on nine of nine", 100.0 * steadier_parts / parts);
    told("  lines with a lower resistance", 100.0 * reduced / lines);
    told("  parts with a lower resistance on nine of nine", 100.0 * reduced_parts / parts);
    told("  largest increase of a line's resistance", 100.0 * most);
    told("  reduction of the means", 100.0 * (1.0 - after_ohm / before_ohm));
  }
}

// Outline of a line as printed, seen from above; its width true to scale.
BenchCurve outline(const std::string& name, const motion::ClLine& line,
                   const motion::TrialLineResult& result) {
  BenchCurve curve{name, {}, {}};
  const std::size_t n = std::min(line.points.size(), result.deposited.widths_mm.size());
  const auto edge = [&](std::size_t i, double side) {
    const Eigen::Vector3d along =
        line.points[std::min(i + 1, n - 1)].position_mm - line.points[i == 0 ? 0 : i - 1].position_mm;
    const Eigen::Vector2d across = Eigen::Vector2d(-along.y(), along.x()).normalized();
    const double half_mm = 0.5 * side * result.deposited.widths_mm[i];
    curve.x.push_back(line.points[i].position_mm.x() + half_mm * across.x());
    curve.y.push_back(line.points[i].position_mm.y() + half_mm * across.y());
  };
  for (std::size_t i = 0; i < n; ++i) edge(i, 1.0);
  for (std::size_t i = n; i-- > 0;) edge(i, -1.0);
  return curve;
}

}  // namespace

std::vector<BenchChart> conformal_charts(const Progress& progress) {
  const Experiment run = run_papers();
  const auto lines = motion::trial_lines();
  BenchChart before{
      "conformal_before", "x, mm", "y, mm: lines as printed without compensation", 0.0, 60.0, {}};
  BenchChart after{"conformal_after", "x, mm", "y, mm: lines as printed, compensated", 0.0, 60.0, {}};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    before.curves.push_back(outline(lines[i].name, lines[i], run.before[i]));
    after.curves.push_back(outline(lines[i].name, lines[i], run.full[i]));
  }
  std::vector<BenchChart> charts{before, after};
  for (const std::size_t i : {1U, 5U, 8U}) {
    BenchChart gaps{fmt::format("conformal_gap_{}", i + 1),
                    fmt::format("along line {}, mm", i + 1),
                    "gap between head and surface, um",
                    0.0,
                    200.0,
                    {}};
    const auto add = [&](const std::string& name, const motion::TrialLineResult& line) {
      BenchCurve gap{name, line.deposited.lengths_mm, {}};
      for (const double g : line.gaps_mm) gap.y.push_back(1e3 * g);
      gaps.curves.push_back(gap);
    };
    add("ours", run.full[i]);
    add("before", run.before[i]);
    add("paper's compensation", run.published[i]);
    const double stringing_um = 1e3 * motion::DepositionModel{}.stringing_gap_mm;
    gaps.curves.push_back(
        {"stringing begins", {0.0, run.before[i].deposited.lengths_mm.back()}, {stringing_um, stringing_um}});
    charts.push_back(gaps);
  }
  // Errors of the rebuilt lines on a rough part, and where it was touched.
  constexpr std::uint64_t kPart = 1;
  const std::vector<TestLine> tests = test_lines();
  for (const TestLine& test : tests) {
    tell(progress, "charts", static_cast<std::size_t>(&test - tests.data()), tests.size());
    const motion::RealPart part = part_under(test, kPartKinds[1].errors, kPart);
    BenchChart errors{fmt::format("conformal_points_{}", test.name),
                      fmt::format("along the {} line, mm", test.name),
                      "rebuilt line off the real surface, um",
                      test.flat ? -200.0 : -20.0,
                      test.flat ? 200.0 : 20.0,
                      {}};
    for (const PointRule rule : {PointRule::ours, PointRule::papers}) {
      const std::string whose = rule == PointRule::ours ? "ours" : "paper's rule";
      const motion::RealLine real = rebuild(rule, test.line, part, kPart);
      BenchCurve error{whose, real.lengths_mm, {}}, touched{whose + ", touches", {}, {}};
      for (const double gap : gaps_mm(real, 0.0, part)) error.y.push_back(1e3 * gap);
      for (const motion::MeasuringPoint& point : points_by(rule, test.line).points) {
        touched.x.push_back(point.length_mm);
        touched.y.push_back(0.0);
      }
      errors.curves.push_back(error);
      errors.curves.push_back(touched);
    }
    charts.push_back(errors);
  }
  return charts;
}

std::vector<BenchRow> bench_conformal(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  add_interpolation(rows, options);
  add_feed(rows);
  add_points(rows, options);
  add_wrong_touches(rows, options);
  add_chord(rows, options);
  add_smoothing(rows, options);
  add_five_axis(rows);
  add_experiment(rows);
  add_noise_seeds(rows, options);
  add_other_parts(rows, options);
  return rows;
}

}  // namespace meltstage::app
