// SPDX-License-Identifier: Apache-2.0
// The velocity profile: time of a plan, against the published golden durations, the textbook's time optimum,
// and its own promises over random cases.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "bench/bench.hpp"
#include "bench/bench_stimulus.hpp"
#include "bench/klipper_look_ahead.hpp"
#include "motion/profile/arrival.hpp"
#include "motion/profile/moving_end.hpp"
#include "motion/profile/profile.hpp"
#include "motion/profile/retarget.hpp"
#include "motion/profile/through_points.hpp"

namespace meltstage::app {

namespace {

using motion::asymmetric_limits;
using motion::ScurveLimits;

double between(std::mt19937_64& random, double low, double high) {  // evenly in the logarithm
  return low * std::pow(high / low, static_cast<double>(random() >> 11) * 0x1p-53);
}

// Time of one plan: the median over batches, and the best batch, which other programs on the machine
// disturbed least.
struct PlanTime {
  double median_us, best_us;
};

template <class PlanNumber>
PlanTime time_of(int batches, PlanNumber plan_number) {
  constexpr int kBatch = 100;
  std::vector<double> times_us;
  double sum = 0.0;  // what is planned must be used, or it isn't planned
  for (int batch = 0; batch < batches; ++batch) {
    const double begin = processor_s();
    for (int i = 0; i < kBatch; ++i) sum += plan_number(batch * kBatch + i);
    times_us.push_back((processor_s() - begin) / kBatch * 1e6);
  }
  if (!(sum > 0.0)) throw motion::MotionError("bench profile: found plans of no duration");
  std::sort(times_us.begin(), times_us.end());
  return {times_us[times_us.size() / 2], times_us.front()};
}

void add_times(std::vector<BenchRow>& rows, const std::string& what, const PlanTime& time,
               std::optional<double> at_most) {
  rows.push_back({what + ", best", time.best_us, "us", {}, at_most});
  rows.push_back({"  median (other load included)", time.median_us, "us", {}, {}});
}

void add_plan_times(std::vector<BenchRow>& rows, int batches, std::uint64_t seed) {
  std::mt19937_64 random(3 * seed);
  std::vector<double> distances_mm(1 << 14);
  for (double& distance_mm : distances_mm) distance_mm = between(random, 0.01, 100.0);
  const auto distance = [&](int i) {
    return distances_mm[static_cast<std::size_t>(i) % distances_mm.size()];
  };

  const ScurveLimits symmetric = asymmetric_limits(400, 4000, 4000, 2e5, 2e5);
  const ScurveLimits asymmetric = asymmetric_limits(400, 4000, 3000, 4e5, 1e5);
  const ScurveLimits slow = asymmetric_limits(200, 2000, 2000, 1e5, 1e5);
  const motion::AxisLimits axes = {symmetric, symmetric, slow};
  const auto target = [&](int i) {
    return Eigen::Vector3d(distance(i), distance(7 * i + 1), distance(13 * i + 2));
  };
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  add_times(rows, "one axis, A = D, one jerk (ruckig 0.30)",
            time_of(batches, [&](int i) { return plan_scurve(symmetric, distance(i)).duration_s; }), 0.30);
  add_times(rows, "one axis, A != D, Ja != Jd (ruckig: none)",
            time_of(batches, [&](int i) { return plan_scurve(asymmetric, distance(i)).duration_s; }), 0.30);
  add_times(rows, "three axes on a line (ruckig 1.24)",
            time_of(batches, [&](int i) { return plan_move(origin, target(i), axes).profile.duration_s; }),
            1.0);
  add_times(rows, "three axes synchronised, each at its limits",
            time_of(batches, [&](int i) { return plan_synchronized(origin, target(i), axes).duration_s; }),
            1.0);
  add_times(rows, "another target while moving",
            time_of(batches,
                    [&](int i) {
                      const motion::MotionState state{0.0, 3.0 * distance(5 * i), 500.0, 0.0};
                      return plan_retarget(asymmetric, state, distance(i)).duration_s;
                    }),
            {});
  add_times(rows, "to a speed at the target while moving",
            time_of(batches,
                    [&](int i) {
                      const motion::MotionState state{0.0, 3.0 * distance(5 * i), 500.0, 0.0};
                      return plan_to_speed(symmetric, state, distance(i), 2.0 * distance(3 * i)).duration_s;
                    }),
            {});
  add_times(rows, "three axes together while moving",
            time_of(std::max(1, batches / 10),
                    [&](int i) {
                      motion::AxisStates state;
                      state.position_mm = state.jerk_mm_s3 = origin;
                      state.velocity_mm_s = {3.0 * distance(5 * i), -distance(3 * i), distance(11 * i)};
                      state.acceleration_mm_s2 = {500.0, -300.0, 200.0};
                      return plan_together(axes, state, target(i), origin).duration_s;
                    }),
            {});
}

struct Golden {
  ScurveLimits limits;
  double distance_mm, start_mm_s, end_mm_s, duration_ms;
};

// Durations of an independent calculation; those with A = D and one jerk equal ruckig's.
double worst_golden_us() {
  const ScurveLimits symmetric = asymmetric_limits(400, 4000, 4000, 2e5, 2e5);
  const ScurveLimits asymmetric = asymmetric_limits(400, 4000, 3000, 4e5, 1e5);
  const std::array golden = {
      Golden{symmetric, 0.5, 0, 0, 43.088694},
      Golden{symmetric, 1, 0, 0, 54.288352},
      Golden{symmetric, 2, 0, 0, 68.399038},
      Golden{symmetric, 20, 0, 0, 162.828569},
      Golden{symmetric, 100, 0, 0, 370.0},
      Golden{asymmetric, 0.5, 0, 0, 44.814047},
      Golden{asymmetric, 5, 0, 0, 98.951462},
      Golden{asymmetric, 50, 0, 0, 262.349610},
      Golden{asymmetric, 200, 0, 0, 636.666667},
      Golden{asymmetric_limits(400, 4000, 1000, 2e5, 2e5), 3, 0, 0, 99.797720},
      Golden{{400, 4000, 3000, 4e5, 2e5, 1e5, 5e4}, 50, 10, 5, 272.512931},
  };
  double worst_us = 0.0;
  for (const Golden& one : golden) {
    const double found_s = plan_scurve(one.limits, one.distance_mm, one.start_mm_s, one.end_mm_s).duration_s;
    worst_us = std::max(worst_us, std::abs(found_s * 1e6 - one.duration_ms * 1e3));
  }
  return worst_us;
}

// Biagiotti & Melchiorri 2008, section 3.4.3: duration of the time-optimal double S from rest to rest.
double textbook_duration_s(double distance, double speed, double acceleration, double jerk) {
  const double turn_s = acceleration / jerk;
  const double ramp_s =
      speed >= acceleration * turn_s ? speed / acceleration + turn_s : 2.0 * std::sqrt(speed / jerk);
  if (distance >= speed * ramp_s) return distance / speed + ramp_s;
  if (distance >= 2.0 * acceleration * turn_s * turn_s)
    return turn_s + std::sqrt(turn_s * turn_s + 4.0 * distance / acceleration);
  return 4.0 * std::cbrt(distance / (2.0 * jerk));
}

double worst_textbook_difference_s(int cases, std::uint64_t seed, const Progress& progress) {
  std::mt19937_64 random(3 * seed + 1);
  double worst_s = 0.0;
  for (int i = 0; i < cases; ++i) {
    if (i % kTellEvery == 0) tell(progress, "optimum", i, cases);
    const double speed = between(random, 10, 1000), acceleration = between(random, 100, 2e4),
                 jerk = between(random, 1e3, 1e7), distance_mm = between(random, 1e-3, 1e3);
    const double found_s =
        plan_scurve(asymmetric_limits(speed, acceleration, acceleration, jerk, jerk), distance_mm).duration_s;
    worst_s =
        std::max(worst_s, std::abs(found_s - textbook_duration_s(distance_mm, speed, acceleration, jerk)));
  }
  return worst_s;
}

ScurveLimits random_limits(std::mt19937_64& random) {
  return {between(random, 1, 1000),  between(random, 10, 2e4),  between(random, 10, 2e4),
          between(random, 1e2, 1e7), between(random, 1e2, 1e7), between(random, 1e2, 1e7),
          between(random, 1e2, 1e7)};
}

struct Promises {
  double limits = 0.0, jumps = 0.0, end = 0.0;
};

// Segments of constant jerk have their extremes at their ends.
Promises worst_of_random(int cases, std::uint64_t seed, const Progress& progress) {
  std::mt19937_64 random(3 * seed + 2);
  Promises worst;
  for (int i = 0; i < cases; ++i) {
    if (i % kTellEvery == 0) tell(progress, "promises", i, cases);
    const ScurveLimits limits = random_limits(random);
    const double distance_mm = between(random, 1e-4, 1e4);
    const motion::Scurve curve = plan_scurve(limits, distance_mm);
    const std::array jerks = {limits.jerk1_mm_s3, 0.0, limits.jerk3_mm_s3, 0.0,
                              limits.jerk5_mm_s3, 0.0, limits.jerk7_mm_s3};
    for (std::size_t k = 0; k < 7; ++k) {
      const auto [p, v, a, j] = curve.starts[k];
      const double t = curve.durations_s[k];
      const motion::MotionState& next = k < 6 ? curve.starts[k + 1] : curve.end;
      worst.limits = std::max({worst.limits, v / limits.velocity_mm_s - 1.0,
                               a / limits.acceleration_mm_s2 - 1.0, -a / limits.deceleration_mm_s2 - 1.0,
                               std::abs(j) / std::max(jerks[k], 1e-300) * (jerks[k] > 0.0) - 1.0});
      worst.jumps = std::max(
          {worst.jumps, std::abs(p + t * (v + t * (a / 2.0 + t * j / 6.0)) - next.position_mm) / distance_mm,
           std::abs(v + t * (a + t * j / 2.0) - next.velocity_mm_s) / limits.velocity_mm_s,
           std::abs(a + t * j - next.acceleration_mm_s2) /
               std::max(limits.acceleration_mm_s2, limits.deceleration_mm_s2)});
    }
    worst.end = std::max(worst.end, std::abs(curve.sample(curve.duration_s).position_mm - distance_mm));
  }
  return worst;
}

// A state inside the limits: its speed stays below the limit when the acceleration has come to zero.
motion::MotionState random_state(std::mt19937_64& random, const ScurveLimits& limits) {
  const auto share = [&] { return 2.0 * static_cast<double>(random() >> 11) * 0x1p-53 - 1.0; };
  const double speed = limits.velocity_mm_s * share(),
               least_jerk = std::min(limits.jerk3_mm_s3, limits.jerk7_mm_s3);
  const double most = std::min({limits.acceleration_mm_s2, limits.deceleration_mm_s2,
                                std::sqrt(2.0 * least_jerk * (limits.velocity_mm_s - std::abs(speed)))});
  return {0.0, speed, most * share(), 0.0};
}

// How far a motion from a state is above its limits, jumps, and misses its target with its speed. Speed rises
// with A and falls with D; a jerk may be any of the limits'.
void judge(Promises& worst, const motion::JerkProfile& profile, const ScurveLimits& limits, double target_mm,
           double end_mm_s) {
  const double most_jerk =
      std::max({limits.jerk1_mm_s3, limits.jerk3_mm_s3, limits.jerk5_mm_s3, limits.jerk7_mm_s3});
  for (std::size_t k = 0; k < profile.segments; ++k) {
    const auto [p, v, a, j] = profile.starts[k];
    const double t = profile.durations_s[k];
    const motion::MotionState& next = k + 1 < profile.segments ? profile.starts[k + 1] : profile.end;
    const double most = v * a > 0.0 ? limits.acceleration_mm_s2 : limits.deceleration_mm_s2;
    worst.limits = std::max({worst.limits, std::abs(v) / limits.velocity_mm_s - 1.0, std::abs(a) / most - 1.0,
                             std::abs(j) / most_jerk - 1.0});
    worst.jumps = std::max(
        {worst.jumps,
         std::abs(p + t * (v + t * (a / 2.0 + t * j / 6.0)) - next.position_mm) / (1.0 + std::abs(target_mm)),
         std::abs(v + t * (a + t * j / 2.0) - next.velocity_mm_s) / limits.velocity_mm_s,
         std::abs(a + t * j - next.acceleration_mm_s2) /
             std::max(limits.acceleration_mm_s2, limits.deceleration_mm_s2)});
  }
  worst.end =
      std::max({worst.end, std::abs(profile.end.position_mm - target_mm) / (1.0 + std::abs(target_mm)),
                std::abs(profile.end.velocity_mm_s - end_mm_s) / limits.velocity_mm_s});
}

void add_moving(std::vector<BenchRow>& rows, int cases, const BenchOptions& options) {
  std::mt19937_64 random(3 * options.seed + 2);
  Promises to_rest, to_speed;
  for (int i = 0; i < cases; ++i) {
    if (i % kTellEvery == 0) tell(options.progress, "moving", i, cases);
    const ScurveLimits limits = random_limits(random);
    const motion::MotionState state = random_state(random, limits);
    const double target_mm = (random() % 2 == 0 ? 1.0 : -1.0) * between(random, 1e-4, 1e4);
    const double end_mm_s = random_state(random, limits).velocity_mm_s;
    judge(to_rest, plan_retarget(limits, state, target_mm), limits, target_mm, 0.0);
    judge(to_speed, plan_to_speed(limits, state, target_mm, end_mm_s), limits, target_mm, end_mm_s);
  }
  for (const auto& [what, worst] :
       {std::pair("another target", to_rest), std::pair("to a speed", to_speed)}) {
    rows.push_back(
        {fmt::format("{} from {} states: above a limit", what, cases), worst.limits, "of it", {}, 1e-9});
    rows.push_back({"  jump between segments", worst.jumps, "of scale", {}, 1e-9});
    rows.push_back({"  off the target and its speed", worst.end, "of scale", {}, 1e-9});
  }
}

// ---- Through points without a stop ------------------------------------------------------------------------

std::vector<Eigen::Vector3d> drawn_corners(std::mt19937_64& random, std::size_t count) {
  std::vector<Eigen::Vector3d> points{{0, 0, 0}};
  while (points.size() < count) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(random() >> 11) * 0x1p-53;
    points.push_back(points.back() +
                     between(random, 0.2, 20.0) * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0));
  }
  return points;
}

std::vector<Eigen::Vector3d> circle(double radius_mm, std::size_t count) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i <= count; ++i) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    points.emplace_back(radius_mm * std::cos(angle), radius_mm * std::sin(angle), 0.0);
  }
  return points;
}

void add_through(std::vector<BenchRow>& rows, std::uint64_t seed) {
  constexpr double kTolerance_mm = 0.05;
  constexpr std::size_t kPoints = 1000;
  const ScurveLimits axis = asymmetric_limits(400, 4000, 4000, 2e5, 2e5);
  const motion::AxisLimits axes = {axis, axis, axis};
  std::mt19937_64 random(3 * seed + 5);
  const std::pair<std::string, std::vector<Eigen::Vector3d>> paths[] = {
      {fmt::format("{} drawn corners, passed within {} mm", kPoints, kTolerance_mm),
       drawn_corners(random, kPoints)},
      {fmt::format("circle of 20 mm as {} lines", 100), circle(20.0, 100)}};
  for (const auto& [what, points] : paths) {
    double stops_s = 0.0;
    for (std::size_t i = 1; i < points.size(); ++i)
      stops_s += plan_move(points[i - 1], points[i], axes).profile.duration_s;
    const double time_s = plan_through(points, axes, kTolerance_mm).duration_s;
    const double klipper_s = klipper_time_s(points, {400, 4000, kTolerance_mm});
    rows.push_back({what + ": time, of that with stops", time_s / stops_s, "", {}, 1.0});
    rows.push_back({"  of Klipper's, which has no jerk limit", time_s / klipper_s, "", {}, {}});
  }
  const std::vector<Eigen::Vector3d>& points = paths[0].second;
  const PlanTime time = time_of(3, [&](int) { return plan_through(points, axes, kTolerance_mm).duration_s; });
  rows.push_back({"  plan of a point", time.best_us / static_cast<double>(points.size()), "us", {}, 10.0});
}

}  // namespace

std::vector<BenchRow> bench_profile(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  add_plan_times(rows, options.quick ? 1000 : 10'000, options.seed);
  rows.push_back({"golden durations (11 cases), largest error", worst_golden_us(), "us", {}, 1e-3});
  const int cases = options.quick ? 100'000 : 1'000'000;
  rows.push_back({fmt::format("A = D, one jerk: off the optimum, {} cases", cases),
                  worst_textbook_difference_s(cases, options.seed, options.progress),
                  "s",
                  {},
                  1e-12});
  const Promises worst = worst_of_random(cases, options.seed, options.progress);
  rows.push_back(
      {fmt::format("random limits, {} cases: above a limit", cases), worst.limits, "of it", {}, 1e-9});
  rows.push_back({"  jump between segments", worst.jumps, "of scale", {}, 1e-9});
  rows.push_back({"  off the target", worst.end, "mm", {}, 1e-9});
  add_moving(rows, cases, options);
  add_through(rows, options.seed);
  return rows;
}

}  // namespace meltstage::app
