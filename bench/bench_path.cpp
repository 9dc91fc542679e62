// SPDX-License-Identifier: Apache-2.0
// The path planner: the bump-printing paper's example and its ants, tours of up to 100,000 points against
// their lower bound and against the best public chained Lin-Kernighan code, and what planning in time saves.
//
// The instances are made here from a seed. Beside each tour stands what `linkern -s 1 -R n` (Concorde
// 03.12.19, Applegate, Bixby, Chvatal & Cook; n kicks for n points) finds on the same points; its licence
// forbids shipping it, so its lengths are noted with the instance.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "bench/bench.hpp"
#include "bench/bench_stimulus.hpp"
#include "motion/tour/ants.hpp"
#include "motion/tour/path.hpp"

namespace meltstage::app {

namespace {

using motion::Metric;
using motion::Plan;
using motion::Point;
using motion::Tour;

constexpr double kPitch = 100.0;  // of the lattices, in the instances' own unit

std::size_t below(std::mt19937_64& random, std::size_t count) { return random() % count; }

std::vector<Point> uniform(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = static_cast<double>(below(random, 1'000'001));
    points.push_back({x, static_cast<double>(below(random, 1'000'001)), i + 1});
  }
  return points;
}

// `count` of the places of a square lattice with about twice as many.
std::vector<Point> half_filled(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(2.0 * static_cast<double>(count))));
  std::vector<std::size_t> places(side * side);
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = i;
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    std::swap(places[i], places[i + below(random, places.size() - i)]);
    points.push_back({kPitch * static_cast<double>(places[i] % side),
                      kPitch * static_cast<double>(places[i] / side), i + 1});
  }
  return points;
}

std::vector<Point> full(std::size_t side) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < side * side; ++i)
    points.push_back({kPitch * static_cast<double>(i % side), kPitch * static_cast<double>(i / side), i + 1});
  return points;
}

// 24 ball grid arrays of 18 x 18 bumps on a panel, pitches of 0.4 to 1.27 mm mixed; in um.
std::vector<Point> panel() {
  constexpr double kPitches[] = {400.0, 500.0, 650.0, 800.0, 1000.0, 1270.0};
  constexpr std::size_t kPackages = 24, kAcross = 6, kSide = 18;
  constexpr double kSpacing = 30'000.0;
  std::mt19937_64 random(1);
  std::vector<Point> points;
  for (std::size_t k = 0; k < kPackages; ++k) {
    const double pitch = kPitches[below(random, std::size(kPitches))];
    // A board's parts stand where its layout put them, on a grid of 50 um.
    const double x0 =
        kSpacing * static_cast<double>(k % kAcross) + 50.0 * static_cast<double>(below(random, 100));
    const double y0 =
        kSpacing * static_cast<double>(k / kAcross) + 50.0 * static_cast<double>(below(random, 100));
    for (std::size_t i = 0; i < kSide * kSide; ++i)
      points.push_back({x0 + pitch * static_cast<double>(i % kSide),
                        y0 + pitch * static_cast<double>(i / kSide), points.size() + 1});
  }
  return points;
}

// The bumps of the paper's 8x8 example as examples/bumps_8x8.xls has them.
std::vector<Point> paper_example() {
  constexpr int kXy[][2] = {{1, 1}, {7, 1}, {3, 2}, {4, 2}, {6, 2}, {8, 2}, {5, 3}, {7, 3},
                            {1, 4}, {3, 4}, {4, 4}, {5, 4}, {8, 4}, {3, 5}, {5, 5}, {7, 5},
                            {2, 6}, {3, 6}, {8, 6}, {1, 7}, {2, 7}, {4, 7}, {5, 7}, {3, 8}};
  std::vector<Point> points;
  for (const auto& [x, y] : kXy)
    points.push_back({static_cast<double>(x), static_cast<double>(y), points.size() + 1});
  return points;
}

motion::PathTask task_of(Metric metric, Tour tour) {
  motion::PathTask task;
  task.metric = metric;
  task.tour = tour;
  return task;
}

struct Timed {
  Plan plan;
  double processor_s;
};

Timed timed(const std::vector<Point>& points, const motion::PathTask& task, const Progress& progress = {}) {
  const double begin = processor_s();
  Plan plan = motion::plan_path(points, task, [&](double share) {
    if (progress) progress(fmt::format("{} points", points.size()), share);
  });
  return {std::move(plan), processor_s() - begin};
}

// The fastest of some rounds, for what takes less than the clock's grain or a machine's hiccup.
double best_time_s(const std::vector<Point>& points, const motion::PathTask& task, int rounds) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < rounds; ++i) best = std::min(best, timed(points, task).processor_s);
  return best;
}

struct Instance {
  const char* name;
  std::vector<Point> points;
  double linkern;  // length of its tour with n kicks
  double within_s;
};

void add_tour(std::vector<BenchRow>& rows, const Instance& instance, const Progress& progress) {
  const Timed run = timed(instance.points, task_of(Metric::manhattan, Tour::closed), progress);
  rows.push_back({fmt::format("{}: tour", instance.name), run.plan.cost_after, "", {}, instance.linkern});
  rows.push_back(
      {"  longer than linkern's", 100.0 * (run.plan.cost_after / instance.linkern - 1.0), "%", {}, {}});
  rows.push_back({"  lower bound", run.plan.lower_bound, "", {}, {}});
  rows.push_back({"  gap", 100.0 * run.plan.gap(), "%", {}, {}});
  rows.push_back({"  processor time", run.processor_s, "s", {}, instance.within_s});
}

void add_ants(std::vector<BenchRow>& rows, bool quick) {
  const std::vector<Point> points = half_filled(256, 1);
  motion::AntColony colony;
  if (quick) colony.cycles = 50;
  const double begin = processor_s();
  const Plan ants = motion::plan_path_by_ants(points, Tour::closed, colony);
  const double ants_s = processor_s() - begin;
  motion::PathTask quick_task = task_of(Metric::manhattan, Tour::closed);
  quick_task.kicks_per_point = 1.0;
  const Timed ours = timed(points, quick_task);
  rows.push_back(
      {fmt::format("256 points, half-filled: ants, {} cycles", colony.cycles), ants.cost_after, "", {}, {}});
  rows.push_back({"  processor time", ants_s, "s", {}, {}});
  rows.push_back({"  our tour, one kick a bump", ours.plan.cost_after, "", {}, {}});
  rows.push_back(
      {"  shorter than the ants'", 100.0 * (1.0 - ours.plan.cost_after / ants.cost_after), "%", 14.0, {}});
  rows.push_back({fmt::format("  times as fast{}", quick ? " (as 50 of 500 cycles)" : ""),
                  ants_s / ours.processor_s,
                  "",
                  quick ? 10.0 : 100.0,
                  {}});
}

// Pitch 1 mm and 1e6 = 200 mm: the instances in a stage's size.
std::vector<Point> in_mm(std::vector<Point> points, double unit_mm) {
  for (Point& point : points) {
    point.x_mm *= unit_mm;
    point.y_mm *= unit_mm;
  }
  return points;
}

void add_time_metric(std::vector<BenchRow>& rows, const char* name, const std::vector<Point>& points,
                     double at_least) {
  const motion::PathTask in_time = task_of(Metric::time, Tour::closed);
  const Plan near = motion::plan_path(points, task_of(Metric::manhattan, Tour::closed));
  const Timed fast = timed(points, in_time);
  const double near_s = motion::path_cost(points, near.order, in_time);
  rows.push_back({fmt::format("{}: time of the Manhattan tour", name), near_s, "s", {}, {}});
  rows.push_back({"  planned in time", fast.plan.cost_after, "s", {}, {}});
  rows.push_back({"  lower bound", fast.plan.lower_bound, "s", {}, {}});
  rows.push_back({"  saved", 100.0 * (1.0 - fast.plan.cost_after / near_s), "%", at_least, {}});
}

}  // namespace

std::vector<BenchRow> bench_path(const BenchOptions& options) {
  std::vector<BenchRow> rows;
  const std::vector<Point> example = paper_example();
  const motion::PathTask open = task_of(Metric::manhattan, Tour::open);
  const Plan planned = motion::plan_path(example, open);
  rows.push_back({"8x8 example of the paper, 24 bumps: file order", planned.cost_before, "", {}, {}});
  constexpr int kColonies = 10;
  double best = std::numeric_limits<double>::infinity(), worst = 0.0;
  motion::AntColony colony;
  for (colony.seed = 1; colony.seed <= kColonies; ++colony.seed) {
    tell(options.progress, "ants", colony.seed - 1, kColonies);
    const double length = motion::plan_path_by_ants(example, Tour::open, colony).cost_after;
    best = std::min(best, length);
    worst = std::max(worst, length);
  }
  rows.push_back({fmt::format("  the paper's ants, best of {} seeds", kColonies), best, "", {}, 39.0});
  rows.push_back({"  worst of them", worst, "", {}, {}});
  rows.push_back({"  our path", planned.cost_after, "", {}, 39.0});
  rows.push_back({"  lower bound", planned.lower_bound, "", {}, {}});
  rows.push_back({"  processor time", 1e3 * best_time_s(example, open, 20), "ms", {}, 1.0});

  const Timed lattice = timed(full(100), task_of(Metric::manhattan, Tour::closed));
  rows.push_back({"10,000-point full lattice: gap", 100.0 * lattice.plan.gap(), "%", {}, 1e-9});
  rows.push_back({"  processor time", lattice.processor_s, "s", {}, 0.1});

  add_ants(rows, options.quick);
  add_tour(rows, {"1,024-point half-filled lattice", half_filled(1024, 1), 135'800.0, 2.0}, options.progress);
  add_tour(rows, {"1,024 points, uniform", uniform(1024, 1), 28'945'434.0, 2.0}, options.progress);
  add_time_metric(rows, "1,024-point half-filled lattice, 1 mm", in_mm(half_filled(1024, 1), 0.01), 2.5);
  add_time_metric(rows, "1,024 points, uniform on 200 mm", in_mm(uniform(1024, 1), 2e-4), 1.4);
  if (options.quick) {
    rows.push_back({"left out by --quick: tours of 7,776 to 100,000 points", 0.0, "", {}, {}});
    return rows;
  }
  add_tour(rows, {"7,776-bump panel of 24 BGAs", panel(), 6'386'060.0, 10.0}, options.progress);
  add_tour(rows, {"10,000-point half-filled lattice", half_filled(10'000, 1), 1'299'400.0, 10.0},
           options.progress);
  add_tour(rows, {"10,000 points, uniform", uniform(10'000, 1), 90'586'514.0, 10.0}, options.progress);
  const Timed large = timed(uniform(100'000, 1), task_of(Metric::manhattan, Tour::closed), options.progress);
  rows.push_back({"100,000 points, uniform: tour", large.plan.cost_after, "", {}, {}});
  rows.push_back({"  lower bound", large.plan.lower_bound, "", {}, {}});
  rows.push_back({"  gap", 100.0 * large.plan.gap(), "%", {}, 2.0});
  rows.push_back({"  processor time", large.processor_s, "s", {}, 120.0});
  return rows;
}

}  // namespace meltstage::app
