// SPDX-License-Identifier: Apache-2.0
#include "motion/tour/path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <numeric>
#include <random>

#include "motion/tour/ants.hpp"
#include "motion/tour/greedy_tour.hpp"
#include "motion/tour/lin_kernighan.hpp"
#include "motion/tour/tour_bound.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage::motion {
namespace {

std::vector<Point> lattice(int columns, int rows, double pitch_mm) {
  std::vector<Point> points;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) points.push_back({x * pitch_mm, y * pitch_mm, points.size() + 1});
  return points;
}

std::vector<Point> scattered(std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back({static_cast<double>(random() % 200'000) / 1000.0,
                      static_cast<double>(random() % 200'000) / 1000.0, i});
  return points;
}

/// Each place of a lattice with probability one half.
std::vector<Point> half_lattice(int columns, int rows, unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<Point> points;
  for (const Point& point : lattice(columns, rows, 1.0))
    if (random() % 2 == 0) points.push_back(point);
  return points;
}

bool is_permutation_of_all(std::vector<std::size_t> order, std::size_t count) {
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> all(count);
  std::iota(all.begin(), all.end(), std::size_t{0});
  return order == all;
}

double cheapest_by_trying_all(std::span<const Point> points, const PathTask& task) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  double best = path_cost(points, order, task);
  while (std::next_permutation(order.begin(), order.end()))
    best = std::min(best, path_cost(points, order, task));
  return best;
}

PathTask task_of(Metric metric, Tour tour = Tour::open, std::optional<Position> start = {},
                 std::optional<Position> end = {}) {
  PathTask task;
  task.metric = metric;
  task.tour = tour;
  task.start = start;
  task.end = end;
  return task;
}

/// Every kind of tour there is.
std::vector<PathTask> all_tasks(Metric metric) {
  const Position a{10.0, 20.0}, b{150.0, 60.0};
  return {task_of(metric),
          task_of(metric, Tour::open, a),
          task_of(metric, Tour::open, {}, b),
          task_of(metric, Tour::open, a, b),
          task_of(metric, Tour::closed),
          task_of(metric, Tour::closed, a)};
}

constexpr std::array kAllMetrics = {Metric::manhattan, Metric::chebyshev, Metric::euclidean, Metric::time};

TEST(Distance, FollowsTheMetric) {
  EXPECT_EQ(distance_mm(3, -4, Metric::manhattan), 7.0);
  EXPECT_EQ(distance_mm(3, -4, Metric::chebyshev), 4.0);
  EXPECT_EQ(distance_mm(3, -4, Metric::euclidean), 5.0);
}

TEST(PathCost, CountsTheWayFromTheStartToTheEndOrBack) {
  const std::vector<Point> points = {{1, 1, 1}, {4, 5, 2}};
  const std::vector<std::size_t> there{0, 1}, back{1, 0};
  const auto metric = Metric::manhattan;
  EXPECT_EQ(path_cost(points, there, task_of(metric)), 7.0);
  EXPECT_EQ(path_cost(points, there, task_of(metric, Tour::closed)), 14.0);
  EXPECT_EQ(path_cost(points, there, task_of(metric, Tour::open, Position{})), 9.0);
  EXPECT_EQ(path_cost(points, back, task_of(metric, Tour::open, Position{})), 16.0);
  EXPECT_EQ(path_cost(points, there, task_of(metric, Tour::open, Position{}, Position{4, 6})), 10.0);
  EXPECT_EQ(path_cost(points, there, task_of(metric, Tour::closed, Position{})), 18.0);
  EXPECT_EQ(path_cost({}, {}, task_of(metric, Tour::open, Position{})), 0.0);
}

TEST(PathCost, TimeIsThatOfTheSlowerAxisAndThePauses) {
  const std::vector<Point> points = {{0, 0, 1}, {20, 5, 2}, {20, 105, 3}};
  PathTask task = task_of(Metric::time);
  task.times.y.velocity_mm_s = 100.0;
  task.times.pause_s = 0.5;
  const double expected =
      plan_scurve(task.times.x, 20.0).duration_s + plan_scurve(task.times.y, 100.0).duration_s;
  EXPECT_NEAR(path_cost(points, std::vector<std::size_t>{0, 1, 2}, task), expected + 1.5, 1e-12);
}

// The paper's figures for its 8x8 example: 73 units in file order, 39 planned (bump-printing paper, section
// 3). The paper doesn't print its bumps; examples/bumps_8x8.xls has 24 bumps with the same two figures, 39
// proved to be the optimum.
TEST(Plan, EightByEightExampleFallsFrom73To39) {
  const auto points = read_coordinates(std::string(MELTSTAGE_SOURCE_DIR) + "/examples/bumps_8x8.xls");
  const Position first{points[0].x_mm, points[0].y_mm};
  for (const PathTask& task : {task_of(Metric::manhattan), task_of(Metric::manhattan, Tour::open, first)}) {
    const Plan plan = plan_path(points, task);
    EXPECT_EQ(plan.cost_before, 73.0);
    EXPECT_EQ(plan.cost_after, 39.0);
    EXPECT_GE(plan.lower_bound, 38.0);
    EXPECT_LE(plan.lower_bound, 39.0);
  }
}

TEST(Ants, BringThePapersExampleFrom73To39) {
  const auto points = read_coordinates(std::string(MELTSTAGE_SOURCE_DIR) + "/examples/bumps_8x8.xls");
  double best = 1e9;
  for (AntColony colony; colony.seed <= 5; ++colony.seed) {  // each ends at 39 or 40
    const Plan plan = plan_path_by_ants(points, Tour::open, colony);
    EXPECT_TRUE(is_permutation_of_all(plan.order, points.size()));
    EXPECT_EQ(plan.order.front(), 0U);
    EXPECT_EQ(plan.cost_before, 73.0);
    EXPECT_LE(plan.cost_after, 41.0);
    best = std::min(best, plan.cost_after);
  }
  EXPECT_EQ(best, 39.0);
}

TEST(Ants, AreBeatenByThePlanner) {
  const auto points = scattered(100, 5);
  AntColony colony;
  colony.cycles = 50;
  EXPECT_LT(plan_path(points, task_of(Metric::manhattan, Tour::closed)).cost_after,
            0.97 * plan_path_by_ants(points, Tour::closed, colony).cost_after);
}

TEST(Ants, ProveNothing) {
  AntColony colony;
  colony.cycles = 1;
  const Plan ants = plan_path_by_ants(scattered(40, 3), Tour::open, colony);
  EXPECT_EQ(ants.lower_bound, 0.0);
  EXPECT_EQ(ants.gap(), HUGE_VAL);
  EXPECT_EQ(plan_path_by_ants({}, Tour::open).gap(), 0.0);  // nothing to visit costs nothing
  EXPECT_EQ(plan_path_by_ants(std::vector<Point>(5, Point{1, 1}), Tour::closed).gap(), 0.0);
}

TEST(Ants, BadParametersAreRefused) {
  AntColony colony;
  colony.q0 = 1.5;
  EXPECT_THROW(plan_path_by_ants(scattered(5, 1), Tour::open, colony), MotionError);
  EXPECT_THROW(plan_path_by_ants(scattered(2001, 1), Tour::open), MotionError);
}

// ---- what a plan tells ----

TEST(Gap, IsNothingWhereTheBoundIsMet) {
  for (const double pitch_mm : {0.8, 0.1, 1.0 / 3.0, 0.0254})
    for (const auto& [columns, rows] : {std::pair{20, 15}, {40, 30}, {7, 101}})
      for (const Metric metric : {Metric::manhattan, Metric::chebyshev, Metric::euclidean}) {
        const Plan plan = plan_path(lattice(columns, rows, pitch_mm), task_of(metric));
        EXPECT_EQ(plan.gap(), 0.0) << pitch_mm << ", " << columns << " x " << rows;
      }
  int met = 0;
  for (unsigned seed = 1; seed <= 20; ++seed)
    for (const Metric metric : {Metric::manhattan, Metric::euclidean}) {
      const double gap = plan_path(scattered(40, seed), task_of(metric)).gap();
      EXPECT_TRUE(gap == 0.0 || gap > 1e-12) << seed << ": " << gap;
      met += gap == 0.0;
    }
  EXPECT_GT(met, 0);
}

TEST(Gap, OfUpToTenPointsIsNothing) {
  for (const Metric metric : kAllMetrics)
    for (const PathTask& task :
         {task_of(metric), task_of(metric, Tour::open, Position{7, 9}), task_of(metric, Tour::closed)})
      for (std::size_t count = 0; count <= 10; ++count)
        EXPECT_EQ(plan_path(scattered(count, 3), task).gap(), 0.0) << count;
  PathTask through = task_of(Metric::time, Tour::open, Position{7, 9});
  through.end = Position{70, 80.3};
  EXPECT_EQ(plan_path({}, through).gap(), 0.0);
}

TEST(TimeMetric, RefusesBadLimitsHoweverFewThePoints) {
  PathTask task = task_of(Metric::time);
  task.times.y.jerk5_mm_s3 = 0.0;
  for (const std::size_t count : {0, 1, 2, 20}) {
    const auto points = scattered(count, 3);
    EXPECT_THAT(error_of([&] { plan_path(points, task); }), ::testing::StartsWith("jerk limit 5: found 0"));
    EXPECT_THAT(error_of([&] { path_cost(points, {}, task); }),
                ::testing::StartsWith("jerk limit 5: found 0"));
  }
}

TEST(PathCost, RefusesAnIndexThatIsNoPoint) {
  const auto points = scattered(5, 1);
  EXPECT_EQ(error_of([&] {
              path_cost(points, std::vector<std::size_t>{0, 100'000}, {});
            }),
            "path: order 2: found index 100000, expected 0 to 4");
  EXPECT_EQ(error_of([&] { path_cost({}, std::vector<std::size_t>{0}, {}); }),
            "path: order 1: found index 0, expected none: there are no points");
}

// ---- full lattices ----

TEST(FullLattice, IsProvedOptimalAtOnce) {
  const auto points = lattice(200, 150, 0.5);
  for (const Metric metric : kAllMetrics)
    for (const PathTask& task :
         {task_of(metric), task_of(metric, Tour::open, Position{0, 0}),
          task_of(metric, Tour::open, Position{-3, 80}), task_of(metric, Tour::closed)}) {
      const Plan plan = plan_path(points, task);
      EXPECT_TRUE(is_permutation_of_all(plan.order, points.size()));
      EXPECT_LT(plan.gap(), 1e-9);
    }
  EXPECT_NEAR(plan_path(points, task_of(Metric::manhattan, Tour::closed)).cost_after, 15'000.0, 1e-6);
}

// So many hops of 0.1 mm, none of which is exactly that long, sum up to a little more than the bound.
TEST(FullLattice, OfManyBumpsIsProvedOptimalAtOnce) {
  PathTask task = task_of(Metric::manhattan);
  task.kicks_per_point = 0.0;  // a search would not find it
  const Plan plan = plan_path(lattice(1000, 100, 0.1), task);
  EXPECT_NEAR(plan.cost_after, 9999.9, 1e-6);
  EXPECT_LT(plan.gap(), 1e-9);
}

TEST(FullLattice, OddTimesOddNeedsOneLongerHopToClose) {
  const Plan plan = plan_path(lattice(15, 11, 1.0), task_of(Metric::manhattan, Tour::closed));
  EXPECT_EQ(plan.cost_after, 166.0);  // 165 sites, 83 of one colour and 82 of the other
  EXPECT_EQ(plan.lower_bound, 166.0);
}

TEST(FullLattice, OfTwoPitchesIsPlannedAlongTheShorter) {
  std::vector<Point> points = lattice(12, 9, 1.0);
  for (Point& point : points) point.y_mm *= 3.0;
  const Plan plan = plan_path(points, task_of(Metric::manhattan));
  EXPECT_NEAR(plan.cost_after, 9 * 11 + 8 * 3, 1e-9);
  EXPECT_LE(plan.lower_bound, plan.cost_after);
}

TEST(FullLattice, WithAHoleOrATwinIsNotTakenForFull) {
  std::vector<Point> points = lattice(8, 8, 1.0);
  points.erase(points.begin() + 27);
  EXPECT_EQ(plan_path(points, task_of(Metric::manhattan)).cost_after, 62.0);
  points.push_back(points[5]);
  const Plan twin = plan_path(points, task_of(Metric::manhattan));
  EXPECT_TRUE(is_permutation_of_all(twin.order, points.size()));
  EXPECT_EQ(twin.cost_after, 62.0);
}

// A chessboard's fields of one colour: no hop is shorter than two pitches, which the colours know and a
// spanning tree over neighbouring fields does not.
TEST(Bound, ColoursOfALatticeCount) {
  std::vector<Point> points;
  for (const Point& point : lattice(8, 8, 1.0))
    if (std::lround(point.x_mm + point.y_mm) % 2 == 0) points.push_back(point);
  const Plan plan = plan_path(points, task_of(Metric::manhattan));
  EXPECT_EQ(plan.lower_bound, 62.0);
  EXPECT_EQ(plan.cost_after, 62.0);
}

// ---- all points ----

TEST(Plan, SameInputGivesSameOrder) {
  const auto points = scattered(300, 7);
  EXPECT_EQ(plan_path(points).order, plan_path(points).order);
}

TEST(Plan, NothingToVisit) {
  const Plan plan = plan_path({});
  EXPECT_TRUE(plan.order.empty());
  EXPECT_EQ(plan.cost_after, 0.0);
}

TEST(Plan, CoincidingPointsAreAllVisited) {
  const std::vector<Point> points(40, Point{3, 4, 1});
  for (const Metric metric : kAllMetrics)
    for (const PathTask& task : all_tasks(metric))
      EXPECT_TRUE(is_permutation_of_all(plan_path(points, task).order, points.size()));
}

// Each point had the others of its place for its neighbours: the search took time by the square of their
// number, and found no way between the places.
TEST(Plan, ManyPointsMayCoincide) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < 60'000; ++i)
    points.push_back({static_cast<double>(i % 20), static_cast<double>(i / 20 % 3), i});
  PathTask task;
  task.tour = Tour::closed;
  const Plan plan = plan_path(points, task);
  EXPECT_EQ(plan.cost_after, 60.0);
  EXPECT_EQ(plan.gap(), 0.0);
  std::vector<std::size_t> sorted = plan.order;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], i);
}

TEST(Plan, PointsOnALineAreVisitedAlongIt) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < 60; ++i) points.push_back({static_cast<double>(i * 37 % 60), 5.0, i + 1});
  EXPECT_EQ(plan_path(points).cost_after, 59.0);
  EXPECT_EQ(plan_path(points, task_of(Metric::euclidean, Tour::closed)).cost_after, 118.0);
}

// The bound fell behind by two thirds.
TEST(Plan, AClosedTourOfOneRowIsProved) {
  PathTask task;
  task.tour = Tour::closed;
  for (const Metric metric : {Metric::manhattan, Metric::chebyshev, Metric::euclidean}) {
    task.metric = metric;
    for (const std::size_t count : {24U, 160U}) {
      std::vector<Point> points;
      for (std::size_t i = 0; i < count; ++i) points.push_back({static_cast<double>(i * 7 % count), 5.0, i});
      const Plan plan = plan_path(points, task);
      EXPECT_DOUBLE_EQ(plan.cost_after, 2.0 * static_cast<double>(count - 1));
      EXPECT_EQ(plan.gap(), 0.0) << count;
    }
  }
}

TEST(Plan, ShortOrderOfTheFileIsKept) {
  const Plan plan = plan_path(lattice(40, 1, 1.0), Metric::manhattan, {0, 0});
  EXPECT_TRUE(std::is_sorted(plan.order.begin(), plan.order.end()));
}

TEST(Plan, StartAndEndAreKept) {
  const auto points = scattered(200, 11);
  // From beside one corner to beside the opposite one: the first and the last bump lie near them.
  const Plan plan =
      plan_path(points, task_of(Metric::euclidean, Tour::open, Position{0, 0}, Position{200, 200}));
  const Point &first = points[plan.order.front()], &last = points[plan.order.back()];
  EXPECT_LT(std::hypot(first.x_mm, first.y_mm), 60.0);
  EXPECT_LT(std::hypot(last.x_mm - 200.0, last.y_mm - 200.0), 60.0);
}

// The bound took the edge from start to end for one that a path may use.
TEST(Plan, TheBoundOfAPathBetweenTwoFarEndsIsNear) {
  std::vector<Point> points = scattered(100, 4);
  for (Point& point : points) point = {100.0 + 0.03 * point.x_mm, 100.0 + 0.03 * point.y_mm, point.row};
  for (const Position end : {Position{0, 0}, Position{0, 20}})
    for (const Metric metric : {Metric::manhattan, Metric::euclidean, Metric::time}) {
      const Plan plan = plan_path(points, task_of(metric, Tour::open, Position{0, 0}, end));
      EXPECT_LT(plan.gap(), 0.015) << end.y_mm;
    }
}

TEST(Plan, FreeEndsCostNoMoreThanFixedOnes) {
  const auto points = half_lattice(20, 20, 3);
  const double free = plan_path(points, task_of(Metric::manhattan)).cost_after;
  EXPECT_LE(free, plan_path(points, task_of(Metric::manhattan, Tour::open, Position{0, 0})).cost_after);
  EXPECT_LT(free, plan_path(points, task_of(Metric::manhattan, Tour::closed)).cost_after);
}

TEST(Plan, TimeMetricIsNoSlowerThanTheShortestPath) {
  const auto points = half_lattice(24, 24, 9);
  const PathTask in_time = task_of(Metric::time, Tour::closed);
  const Plan fast = plan_path(points, in_time);
  const Plan near = plan_path(points, task_of(Metric::manhattan, Tour::closed));
  EXPECT_LT(fast.cost_after, 0.985 * path_cost(points, near.order, in_time));
}

// Random uniform points: the shortest tour is about 0.7124 sqrt(n A) (1 + 0.33 / n) (Johnson & McGeoch 1996).
TEST(Plan, ScatteredPointsComeWithinAFewPercentOfTheBound) {
  const auto points = scattered(2000, 3);
  const Plan plan = plan_path(points, task_of(Metric::euclidean, Tour::closed));
  const double asymptotic_mm = 0.7124 * std::sqrt(2000.0 * 200.0 * 200.0) * (1.0 + 0.33 / 2000.0);
  EXPECT_LT(plan.cost_after, 1.06 * asymptotic_mm);
  EXPECT_GT(plan.cost_after, 0.97 * asymptotic_mm);
  EXPECT_LT(plan.gap(), 0.025);
}

RC_GTEST_PROP(PlanProperty, VisitsAllOnceAndReportsItsTrueCost, ()) {
  const auto count = *rc::gen::inRange<std::size_t>(0, 60);
  auto points = scattered(count, *rc::gen::arbitrary<unsigned>());
  const auto metric = *rc::gen::elementOf(std::vector<Metric>(kAllMetrics.begin(), kAllMetrics.end()));
  PathTask task = all_tasks(metric)[*rc::gen::inRange<std::size_t>(0, 6)];
  task.kicks_per_point = 5.0;
  const Plan plan = plan_path(points, task);
  RC_ASSERT(is_permutation_of_all(plan.order, count));
  RC_ASSERT(plan.cost_after == path_cost(points, plan.order, task));
  RC_ASSERT(plan.cost_after <= plan.cost_before);
  RC_ASSERT(plan.lower_bound <= plan.cost_after);
}

RC_GTEST_PROP(PlanProperty, IsTheCheapestOfAllOrdersForFewPoints, ()) {
  const auto points = scattered(*rc::gen::inRange<std::size_t>(1, 8), *rc::gen::arbitrary<unsigned>());
  const auto metric = *rc::gen::element(Metric::manhattan, Metric::chebyshev, Metric::euclidean);
  const PathTask task = all_tasks(metric)[*rc::gen::inRange<std::size_t>(0, 6)];
  RC_ASSERT(plan_path(points, task).cost_after <= cheapest_by_trying_all(points, task) + 1e-9);
}

/// Cheapest order by dynamic programming over subsets, written apart from the planner's.
double cheapest_by_subsets(std::span<const Point> points, const PathTask& task) {
  const std::size_t count = points.size();
  const auto hop = [&](double x, double y, const Point& b) {
    if (task.metric != Metric::time) return distance_mm(x - b.x_mm, y - b.y_mm, task.metric);
    return std::max(plan_scurve(task.times.x, std::abs(x - b.x_mm)).duration_s,
                    plan_scurve(task.times.y, std::abs(y - b.y_mm)).duration_s);
  };
  const double infinity = std::numeric_limits<double>::infinity();
  double least = infinity;
  // Which point comes first matters only to a ring without a start: it is tried for each.
  for (std::size_t first = 0; first < count; ++first) {
    std::vector<double> best((std::size_t{1} << count) * count, infinity);
    best[(std::size_t{1} << first) * count + first] =
        task.start ? hop(task.start->x_mm, task.start->y_mm, points[first]) : 0.0;
    for (std::size_t set = 0; set < std::size_t{1} << count; ++set)
      for (std::size_t last = 0; last < count; ++last) {
        const double now = best[set * count + last];
        if (now == infinity) continue;
        for (std::size_t next = 0; next < count; ++next)
          if ((set >> next & 1U) == 0) {
            double& to = best[(set | std::size_t{1} << next) * count + next];
            to = std::min(to, now + hop(points[last].x_mm, points[last].y_mm, points[next]));
          }
      }
    for (std::size_t last = 0; last < count; ++last) {
      double total = best[((std::size_t{1} << count) - 1) * count + last];
      if (task.tour == Tour::closed)
        total += task.start ? hop(task.start->x_mm, task.start->y_mm, points[last])
                            : hop(points[first].x_mm, points[first].y_mm, points[last]);
      if (task.end) total += hop(task.end->x_mm, task.end->y_mm, points[last]);
      least = std::min(least, total);
    }
  }
  return least;
}

// Twelve points go through the search, not through the planner's own enumeration.
RC_GTEST_PROP(PlanProperty, SearchFindsTheCheapestAndBoundHolds, ()) {
  const auto seed = *rc::gen::arbitrary<unsigned>();
  auto points = *rc::gen::inRange(0, 2) == 0 ? scattered(12, seed) : half_lattice(6, 6, seed);
  if (points.size() > 12) points.resize(12);
  RC_PRE(points.size() > 10);
  const auto metric = *rc::gen::elementOf(std::vector<Metric>(kAllMetrics.begin(), kAllMetrics.end()));
  const PathTask task = all_tasks(metric)[*rc::gen::inRange<std::size_t>(0, 6)];
  const double cheapest = cheapest_by_subsets(points, task);
  const Plan plan = plan_path(points, task);
  RC_ASSERT(plan.lower_bound <= cheapest + 1e-9);
  RC_ASSERT(plan.cost_after <= cheapest * 1.000001);
}

// An open path's two free ends are the two lightest sites, wherever these stand in their order.
TEST(Plan, BoundHoldsWhenTheFirstSiteIsHeavy) {
  const auto points = scattered(12, 18'400);
  for (const Metric metric : kAllMetrics) {
    const PathTask task = task_of(metric);
    const double cheapest = cheapest_by_subsets(points, task);
    const Plan plan = plan_path(points, task);
    EXPECT_LE(plan.lower_bound, cheapest + 1e-9);
    EXPECT_LE(plan.cost_after, cheapest * 1.000001);
  }
}

// ---- the search from inside ----

struct Searched {
  detail::PointTree tree;
  detail::ManhattanCost cost;
  detail::Neighbours near;
  detail::TourRules rules;
  std::vector<detail::Node> start;
};

Searched searched(const std::vector<Point>& points) {
  std::vector<detail::Site> sites;
  for (const Point& point : points) sites.push_back({point.x_mm, point.y_mm});
  detail::PointTree tree(sites);
  const detail::ManhattanCost cost;
  auto near = detail::Neighbours::find(tree, cost, 7, 2);
  const detail::TourRules rules;
  auto start = detail::GreedyTour<detail::ManhattanCost>(tree, cost, near, rules).tour();
  return {std::move(tree), cost, std::move(near), rules, std::move(start)};
}

double length_of(const Searched& s, std::span<const detail::Node> tour) {
  double total = 0.0;
  for (std::size_t i = 0; i < tour.size(); ++i) {
    const detail::Site &a = s.tree.sites()[tour[i]], &b = s.tree.sites()[tour[(i + 1) % tour.size()]];
    total += s.cost(a.x - b.x, a.y - b.y);
  }
  return total;
}

TEST(LinKernighan, KeepsBooksOfTheTrueLength) {
  const Searched s = searched(scattered(500, 4));
  const std::vector<double> weights(501, 0.0);
  detail::LinKernighan<detail::ManhattanCost> search(s.tree.sites(), weights, s.cost, s.near, s.rules,
                                                     s.start);
  EXPECT_NEAR(search.length(), length_of(s, s.start), 1e-6);
  search.improve_everywhere();
  EXPECT_NEAR(search.length(), length_of(s, search.tour()), 1e-6);
  std::mt19937_64 random(1);
  double before = search.length();
  for (int i = 0; i < 20; ++i) {
    search.improve_by_kicks({.kicks = 50}, 0.0, random);
    EXPECT_NEAR(search.length(), length_of(s, search.tour()), 1e-6);
    EXPECT_LE(search.length(), before + 1e-6);
    before = search.length();
  }
}

TEST(LinKernighan, ReachesTheKnownOptimumOfALattice) {
  const Searched s = searched(lattice(16, 16, 1.0));
  const std::vector<double> weights(257, 0.0);
  detail::LinKernighan<detail::ManhattanCost> search(s.tree.sites(), weights, s.cost, s.near, s.rules,
                                                     s.start);
  search.improve_everywhere();
  std::mt19937_64 random(1);
  search.improve_by_kicks({.kicks = 20'000}, 256.0, random);
  EXPECT_EQ(search.length(), 256.0);
}

TEST(TourBound, WithoutWeightsIsTheOneTreeOverAllPairs) {
  const auto points = scattered(150, 8);
  const Searched s = searched(points);
  detail::TourBound<detail::ManhattanCost> bound(s.tree, s.cost, s.rules);
  // Prim over all pairs, then each leaf's second edge.
  const auto sites = s.tree.sites();
  const auto between = [&](std::size_t a, std::size_t b) {
    return s.cost(sites[a].x - sites[b].x, sites[a].y - sites[b].y);
  };
  std::vector<double> key(sites.size(), 1e300);
  std::vector<std::size_t> parent(sites.size(), 0), degree(sites.size(), 0), link(sites.size(), 0);
  std::vector<bool> in(sites.size(), false);
  double total = 0.0;
  std::size_t at = 0;
  for (std::size_t k = 1; k < sites.size(); ++k) {
    in[at] = true;
    for (std::size_t i = 0; i < sites.size(); ++i)
      if (!in[i] && between(at, i) < key[i]) {
        key[i] = between(at, i);
        parent[i] = at;
      }
    std::size_t next = sites.size();
    for (std::size_t i = 0; i < sites.size(); ++i)
      if (!in[i] && (next == sites.size() || key[i] < key[next])) next = i;
    at = next;
    total += key[at];
    for (const auto& [i, j] : {std::pair(at, parent[at]), std::pair(parent[at], at)}) {
      ++degree[i];
      link[i] = j;
    }
  }
  double most = 0.0;
  for (std::size_t i = 0; i < sites.size(); ++i) {
    if (degree[i] != 1) continue;
    double second = 1e300;
    for (std::size_t j = 0; j < sites.size(); ++j)
      if (j != i && j != link[i]) second = std::min(second, between(i, j));
    most = std::max(most, second);
  }
  EXPECT_NEAR(bound.exact_one_tree(), total + most, 1e-9 * total);
}

TEST(TourBound, AscentRaisesItNearTheShortestTour) {
  const Searched s = searched(scattered(400, 6));
  detail::TourBound<detail::ManhattanCost> bound(s.tree, s.cost, s.rules);
  const double flat = bound.exact_one_tree();
  const double raised =
      bound.ascend(s.near, s.start, length_of(s, s.start), 200, [](double) { return false; });
  EXPECT_GT(raised, 1.05 * flat);
  EXPECT_LT(raised, length_of(s, s.start));
}

// ---- bad input ----

std::string refusal(std::span<const Point> points, const PathTask& task) {
  try {
    plan_path(points, task);
  } catch (const MotionError& error) {
    return error.what();
  }
  return "no error";
}

TEST(BadTask, IsRefusedInOneLine) {
  using ::testing::HasSubstr;
  auto points = scattered(20, 1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(points, task_of(Metric::manhattan, Tour::closed, {}, Position{})),
              HasSubstr("closed tour"));
  EXPECT_THAT(refusal(points, task_of(Metric::manhattan, Tour::open, Position{nan, 0})), HasSubstr("start"));
  PathTask task = task_of(Metric::time);
  task.times.x.velocity_mm_s = 0.0;
  EXPECT_THAT(refusal(points, task), HasSubstr("above 0"));
  task = task_of(Metric::time);
  task.times.y.jerk1_mm_s3 = -1.0;
  EXPECT_NE(refusal(points, task), "no error");
  task = task_of(Metric::time);
  task.times.pause_s = -1.0;
  EXPECT_THAT(refusal(points, task), HasSubstr("pause"));
  task = {};
  task.kicks_per_point = -1.0;
  EXPECT_THAT(refusal(points, task), HasSubstr("kicks"));
  points[3].y_mm = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal(points, {}), HasSubstr("point 4"));
  points[3].y_mm = -1e308;
  EXPECT_THAT(refusal(points, {}), HasSubstr("expected coordinates within 1e+12 mm"));
  points[3].y_mm = -1e12;
  EXPECT_EQ(refusal(points, {}), "no error");
  EXPECT_THAT(refusal(std::vector<Point>(kMaxPoints + 1), {}), HasSubstr("2000000"));
}

// The time left that is told of it then falls steadily.
TEST(PlanPath, TellsSharesOfTheTime) {
  const auto processor_s = [] { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
  const auto points = scattered(3000, 4);
  std::vector<std::pair<double, double>> told;
  const double begun_s = processor_s();
  plan_path(points, {}, [&](double share) { told.emplace_back(share, processor_s() - begun_s); });
  const double all_s = told.back().second;
  for (const auto& [share, time_s] : told) EXPECT_NEAR(share, time_s / all_s, 0.12);
}

// Told of a search, of all orders of few points, of a serpentine that needs no search, and of nothing.
TEST(PlanPath, TellsItsShareUpToTheEnd) {
  const std::vector<std::vector<Point>> all{
      {}, scattered(5, 1), lattice(20, 20, 1.0), half_lattice(12, 12, 3), scattered(2000, 2)};
  for (const auto& points : all) {
    std::vector<double> told;
    plan_path(points, {}, [&](double share) { told.push_back(share); });
    ASSERT_FALSE(told.empty()) << points.size();
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end())) << points.size();
    EXPECT_GE(told.front(), 0.0);
    EXPECT_EQ(told.back(), 1.0) << points.size();
    EXPECT_EQ(std::count(told.begin(), told.end(), 1.0), 1) << points.size();
  }
}

}  // namespace
}  // namespace meltstage::motion
