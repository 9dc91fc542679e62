// SPDX-License-Identifier: Apache-2.0
#include "motion/tour/path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

#include "motion/tour/greedy_tour.hpp"
#include "motion/tour/lattice.hpp"
#include "motion/tour/lin_kernighan.hpp"
#include "motion/tour/path_costs.hpp"
#include "motion/tour/point_tree.hpp"
#include "motion/tour/tour_bound.hpp"

namespace meltstage::motion {
namespace {

using detail::Node;
using detail::Site;
using detail::TourRules;
using Order = std::vector<std::size_t>;

// ---- what was asked for ----

void check(std::span<const Point> points, const PathTask& task) {
  const auto check_place = [](std::string_view what, double x_mm, double y_mm) {
    if (!std::isfinite(x_mm) || !std::isfinite(y_mm))
      throw MotionError(
          fmt::format("path: {}: found ({}, {}) mm, expected finite coordinates", what, x_mm, y_mm));
    if (std::abs(x_mm) > kFarthestStop_mm || std::abs(y_mm) > kFarthestStop_mm)
      throw MotionError(fmt::format("path: {}: found ({}, {}) mm, expected coordinates within {:g} mm", what,
                                    x_mm, y_mm, kFarthestStop_mm));
  };
  if (points.size() > kMaxPoints)
    throw MotionError(fmt::format("path: found {} points, expected at most {}", points.size(), kMaxPoints));
  for (std::size_t i = 0; i < points.size(); ++i)
    check_place(fmt::format("point {} (row {})", i + 1, points[i].row), points[i].x_mm, points[i].y_mm);
  if (task.start) check_place("start", task.start->x_mm, task.start->y_mm);
  if (task.end) check_place("end", task.end->x_mm, task.end->y_mm);
  if (task.end && task.tour == Tour::closed)
    throw MotionError("path: found an end for a closed tour, which ends where it begins; leave it out");
  if (!(task.times.pause_s >= 0.0) || !std::isfinite(task.times.pause_s))
    throw MotionError(fmt::format("path: found a pause of {} s, expected 0 or more", task.times.pause_s));
  if (task.metric == Metric::time)  // these two refuse bad limits
    for (const ScurveLimits& limits : {task.times.x, task.times.y}) plan_scurve(limits, 0.0);
  const double kicks = task.kicks_per_point.value_or(0.0);
  if (!(kicks >= 0.0) || !std::isfinite(kicks))
    throw MotionError(fmt::format("path: found {} kicks a point, expected 0 or more", kicks));
  if (task.search_s && !(*task.search_s > 0.0 && *task.search_s <= kLongestSearch_s))
    throw MotionError(fmt::format("path: found a search of {} s, expected more than 0 and up to {} s",
                                  *task.search_s, kLongestSearch_s));
}

/// The sites that a tour has to visit: the points, then start and end where they are given.
struct Route {
  std::vector<Site> sites;
  std::size_t points = 0;
  bool closed = false;
  Node start = TourRules::kNone, end = TourRules::kNone;
};

Route route_of(std::span<const Point> points, const PathTask& task) {
  Route route;
  route.points = points.size();
  route.closed = task.tour == Tour::closed;
  route.sites.reserve(points.size() + 2);
  for (const Point& point : points) route.sites.push_back({point.x_mm, point.y_mm});
  const auto add = [&](const std::optional<Position>& position) {
    if (!position) return TourRules::kNone;
    route.sites.push_back({position->x_mm, position->y_mm});
    return static_cast<Node>(route.sites.size() - 1);
  };
  route.start = add(task.start);
  route.end = add(task.end);
  return route;
}

template <class Cost>
double cost_between(const Cost& cost, const Site& a, const Site& b) {
  return cost(a.x - b.x, a.y - b.y);
}

/// Cost of the route's points in this order, with the ways from the start, to the end or back.
template <class Cost>
double cost_of(const Route& route, std::span<const std::size_t> order, const Cost& cost) {
  if (order.empty()) {
    const bool moves = route.start != TourRules::kNone && route.end != TourRules::kNone;
    return moves ? cost_between(cost, route.sites[route.start], route.sites[route.end]) : 0.0;
  }
  const Site& first = route.sites[route.start != TourRules::kNone ? route.start : order.front()];
  double total = 0.0;
  Site at = first;
  for (const std::size_t i : order) {
    total += cost_between(cost, at, route.sites[i]);
    at = route.sites[i];
  }
  if (route.closed) total += cost_between(cost, at, first);
  if (route.end != TourRules::kNone) total += cost_between(cost, at, route.sites[route.end]);
  return total;
}

// ---- few points: all orders, by dynamic programming over subsets (Held & Karp 1962) ----

constexpr std::size_t kFewPoints = 10;

template <class Cost>
Order cheapest_of_all(const Route& route, const Cost& cost) {
  const std::size_t count = route.points;
  const auto site = [&](std::size_t i) { return route.sites[i]; };
  const double infinity = std::numeric_limits<double>::infinity();
  const std::size_t subsets = std::size_t{1} << count;
  std::vector<double> best(subsets * count);
  std::vector<std::size_t> before(subsets * count);
  Order cheapest;
  double least = infinity;
  // A closed tour without a start may begin anywhere, so it begins at the first point.
  const bool ring = route.closed && route.start == TourRules::kNone;
  std::fill(best.begin(), best.end(), infinity);
  std::vector<double> hops(count * count);
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < count; ++b) hops[a * count + b] = cost_between(cost, site(a), site(b));
  for (std::size_t i = 0; i < (ring ? 1 : count); ++i)
    best[(std::size_t{1} << i) * count + i] =
        route.start != TourRules::kNone ? cost_between(cost, site(route.start), site(i)) : 0.0;
  for (std::size_t set = 1; set < subsets; ++set)
    for (std::size_t last = 0; last < count; ++last) {
      const double reached = best[set * count + last];
      if (reached == infinity) continue;
      for (std::size_t next = 0; next < count; ++next) {
        if ((set >> next & 1U) != 0) continue;
        const std::size_t to = (set | std::size_t{1} << next) * count + next;
        const double total = reached + hops[last * count + next];
        if (total >= best[to]) continue;
        best[to] = total;
        before[to] = last;
      }
    }
  std::size_t end = 0;
  for (std::size_t last = 0; last < count; ++last) {
    double total = best[(subsets - 1) * count + last];
    if (route.closed) total += cost_between(cost, site(last), site(ring ? 0 : route.start));
    if (route.end != TourRules::kNone) total += cost_between(cost, site(last), site(route.end));
    if (total >= least) continue;
    least = total;
    end = last;
  }
  for (std::size_t set = subsets - 1; set != 0;) {
    cheapest.push_back(end);
    const std::size_t from = before[set * count + end];
    set &= ~(std::size_t{1} << end);
    end = from;
  }
  std::reverse(cheapest.begin(), cheapest.end());
  return cheapest;
}

// ---- bounds that need no search ----

/// What is known of all tours from where the sites lie.
struct Outlook {
  double bound = 0.0;
  double step = 0.0;  ///< costs of tours differ by whole multiples of this; 0: nothing known
  std::optional<detail::Lattice> lattice;  ///< of the points alone

  /// The least cost of a tour that isn't below `bound`.
  double raised(double bound_before) const {
    if (step == 0.0) return bound_before;
    constexpr double kRounding = 1e-6;
    return std::ceil(bound_before / step - kRounding) * step;
  }
};

template <class Cost>
Outlook look_out(const Route& route, const Cost& cost, Metric metric) {
  Outlook out;
  const auto points = std::span(route.sites).first(route.points);
  out.lattice = detail::find_lattice(points);
  const bool rectilinear = metric == Metric::manhattan;
  if (const auto all = rectilinear ? detail::find_lattice(route.sites) : std::nullopt; all) {
    if (const auto pitch = detail::common_pitch(*all)) {
      // Closed: as many steps left as right, up as down. Open between fixed ends: their parity, which the
      // smallest step between two lengths, twice the pitch, does not hit from 0; so one pitch.
      out.step = route.closed ? 2.0 * *pitch : *pitch;
      out.bound = detail::colour_bound_mm(*all, route.sites, route.closed);
    }
  }
  // On a full lattice, every hop costs at least the shorter pitch's.
  if (out.lattice && detail::is_full(*out.lattice, points) && route.points > 1) {
    const detail::Lattice& lattice = *out.lattice;
    double least = std::numeric_limits<double>::infinity();
    if (lattice.columns > 1) least = std::min(least, cost(lattice.pitch_x, 0.0));
    if (lattice.rows > 1) least = std::min(least, cost(0.0, lattice.pitch_y));
    const auto nearest_to = [&](Node node) {
      double nearest = std::numeric_limits<double>::infinity();
      if (node == TourRules::kNone) return 0.0;
      for (const Site& site : points)
        nearest = std::min(nearest, cost_between(cost, site, route.sites[node]));
      return nearest;
    };
    const bool ring = route.closed && route.start == TourRules::kNone;
    const double hops = static_cast<double>(route.points - (ring ? 0 : 1)) * least;
    const double ways =
        nearest_to(route.start) + (route.closed ? nearest_to(route.start) : nearest_to(route.end));
    out.bound = std::max(out.bound, hops + ways);
  }
  return out;
}

template <class Cost>
std::optional<Order> proved_serpentine(const Route& route, const Cost& cost, const Outlook& outlook) {
  const auto points = std::span(route.sites).first(route.points);
  if (!outlook.lattice || !detail::is_full(*outlook.lattice, points)) return std::nullopt;
  const bool ring = route.closed && route.start == TourRules::kNone;
  // A sum of many hops between rounded places differs by a little from as many times the pitch.
  constexpr double kRounding = 1e-9;
  for (Order& order : detail::serpentines(*outlook.lattice, points, ring))
    if (cost_of(route, order, cost) <= outlook.bound * (1.0 + kRounding)) return std::move(order);
  return std::nullopt;
}

// ---- the search ----

struct Effort {
  std::size_t kicks;
  std::uint64_t work;
  int ascent_steps;
  std::optional<double> search_s;
};

Effort effort_for(std::size_t count, const PathTask& task) {
  const double n = static_cast<double>(count);
  constexpr double kAscentWork = 3e7;  // sites x steps
  const int ascent_steps = static_cast<int>(std::clamp(kAscentWork / n, 20.0, 300.0));
  if (task.kicks_per_point)
    return {static_cast<std::size_t>(*task.kicks_per_point * n), UINT64_MAX, ascent_steps, {}};
  if (task.search_s) return {SIZE_MAX, UINT64_MAX, ascent_steps, task.search_s};
  // In places that are looked at: below a second for hundreds of points, below
  // ten for ten thousand; from there on the time may grow with their number only until it is most of a
  // minute.
  constexpr double kSmall = 16e3, kLarge = 5.2e3, kMostSmall = 1e7, kMost = 2.5e8;
  const double work = std::min(std::max(kLarge * n, std::min(kSmall * n, kMostSmall)), kMost);
  return {SIZE_MAX, static_cast<std::uint64_t>(work), ascent_steps, {}};
}

/// Shares of the time at which the search's stages end.
struct Stages {
  double rough, ascent, fine;
};

/// By work in places that are looked at, as measured with ten thousand to two hundred thousand random points.
Stages stages_of(std::size_t count, const Effort& effort) {
  constexpr double kRough = 55.0, kFine = 40.0, kKick = 1.2e3;
  const double n = static_cast<double>(count);
  const double step = std::min(3.7, 1.6 + 1.9e-5 * n);  // dearer the less of the graph is in the cache
  const double rough = kRough * n, ascent = step * n * effort.ascent_steps, fine = kFine * n;
  constexpr double kWorkPerSecond = 6e6;
  const double kicks =
      effort.search_s ? *effort.search_s * kWorkPerSecond
                      : std::min(static_cast<double>(effort.work), kKick * static_cast<double>(effort.kicks));
  const double all = rough + ascent + fine + kicks;
  return {rough / all, (rough + ascent) / all, (rough + ascent + fine) / all};
}

struct Found {
  Order order;
  double bound;
};

// Do most sites stand inside of full lattices, with three neighbours or more as near as the nearest? There
// many edges are equally good, and the search needs more of them to choose from.
bool mostly_in_blocks(const detail::Neighbours& near) {
  constexpr double kAsNear = 1.0 + 1e-9;
  std::size_t inside = 0;
  for (Node i = 0; i < near.size(); ++i) {
    const auto of = near.of(i);
    if (of.size() >= 3 && of[2].cost <= kAsNear * of[0].cost) ++inside;
  }
  return 2 * inside > near.size();
}

template <class Cost>
Found search(const Route& route, const Cost& cost, const Outlook& outlook, const Effort& effort,
             const PathProgress& progress) {
  const auto tell = [&](double share) {
    if (progress) progress(share);
  };
  const Stages ends = stages_of(route.points, effort);
  tell(0.0);
  const detail::PointTree tree(route.sites);
  std::vector<Node> in_tree(route.sites.size());
  for (Node i = 0; i < in_tree.size(); ++i) in_tree[tree.origin()[i]] = i;

  // An open path is a tour through the joker; between two given ends the edge that joins them takes its
  // place.
  TourRules rules;
  const auto sites = static_cast<Node>(route.sites.size());
  if (!route.closed) {
    const bool both = route.start != TourRules::kNone && route.end != TourRules::kNone;
    if (!both) rules.joker = sites;
    if (route.start != TourRules::kNone) rules.fixed_a = in_tree[route.start];
    if (route.end != TourRules::kNone) (both ? rules.fixed_b : rules.fixed_a) = in_tree[route.end];
    if (!both && rules.fixed_a != TourRules::kNone) rules.fixed_b = rules.joker;
  }
  // What the search counts besides the route: the edge between two given ends.
  const double extra = rules.joker == TourRules::kNone && rules.fixed_a != TourRules::kNone
                           ? cost_between(cost, tree.sites()[rules.fixed_a], tree.sites()[rules.fixed_b])
                           : 0.0;

  constexpr std::size_t kNearest = 7, kPerQuadrant = 2;
  const auto near = detail::Neighbours::find(tree, cost, kNearest, kPerQuadrant);
  const std::size_t candidates = mostly_in_blocks(near) ? 8 : 5;
  const std::vector<double> no_weights(route.sites.size() + 1, 0.0);
  detail::LinKernighan<Cost> rough(tree.sites(), no_weights, cost, near, rules,
                                   detail::GreedyTour<Cost>(tree, cost, near, rules).tour());
  rough.improve_everywhere();
  tell(ends.rough);

  detail::TourBound<Cost> bounds(tree, cost, rules);
  const auto proves = [&](double bound, double length) {
    return outlook.raised(std::max(bound, outlook.bound)) >= (length - extra) * (1.0 - 1e-12);
  };
  double bound = outlook.bound;
  std::vector<Node> tour(rough.tour().begin(), rough.tour().end());
  if (!proves(bound, rough.length())) {
    bound =
        std::max(bound, bounds.ascend(
                            near, tour, rough.length(), effort.ascent_steps,
                            [&](double reached) { return proves(reached, rough.length()); },
                            [&](double share) { tell(ends.rough + share * (ends.ascent - ends.rough)); }));
  }
  bound = outlook.raised(bound);
  if (!proves(bound, rough.length())) {
    const auto alpha = bounds.alpha_nearest(candidates);
    const auto weights = bounds.weights();
    detail::LinKernighan<Cost> fine(tree.sites(), weights, cost, alpha, rules, std::move(tour));
    tell(ends.ascent);
    fine.improve_everywhere();
    std::mt19937_64 random(1);
    typename detail::LinKernighan<Cost>::Budget budget{effort.kicks, effort.work, {}, {}};
    if (effort.search_s) {
      using Clock = std::chrono::steady_clock;
      budget.begin = Clock::now();
      budget.end = *budget.begin + std::chrono::duration_cast<Clock::duration>(
                                       std::chrono::duration<double>(*effort.search_s));
    }
    fine.improve_by_kicks(budget, bound + extra, random,
                          [&](double spent) { tell(ends.fine + spent * (1.0 - ends.fine)); });
    tour = {fine.tour().begin(), fine.tour().end()};
  }

  // Cut open where the path begins.
  const auto place = [&](Node node) {
    return static_cast<std::size_t>(std::find(tour.begin(), tour.end(), node) - tour.begin());
  };
  const Node start = route.start != TourRules::kNone ? in_tree[route.start] : TourRules::kNone;
  const Node end = route.end != TourRules::kNone ? in_tree[route.end] : TourRules::kNone;
  const Node cut = start != TourRules::kNone         ? start
                   : rules.joker != TourRules::kNone ? rules.joker
                                                     : tour.front();
  std::rotate(tour.begin(), tour.begin() + static_cast<std::ptrdiff_t>(place(cut)), tour.end());
  // From the start, away from what is fixed to it; to the end at the last.
  const Node last =
      start != TourRules::kNone && !route.closed ? (end != TourRules::kNone ? end : rules.joker) : end;
  if (last != TourRules::kNone && tour.back() != last) std::reverse(tour.begin() + 1, tour.end());
  Found found;
  found.bound = bound;
  found.order.reserve(route.points);
  for (const Node node : tour)
    if (node < sites && tree.origin()[node] < route.points) found.order.push_back(tree.origin()[node]);
  return found;
}

template <class Cost>
Found plan_route(const Route& route, const Cost& cost, const PathTask& task, const PathProgress& progress) {
  const Outlook outlook = look_out(route, cost, task.metric);
  if (auto order = proved_serpentine(route, cost, outlook)) {
    const double bound = cost_of(route, *order, cost);  // the outlook's but for rounding
    return {std::move(*order), bound};
  }
  return search(route, cost, outlook, effort_for(route.points, task), progress);
}

/// The exact cost of a hop.
struct TaskCost {
  const PathTask& task;
  double operator()(double dx_mm, double dy_mm) const {
    if (task.metric != Metric::time) return distance_mm(dx_mm, dy_mm, task.metric);
    return std::max(plan_scurve(task.times.x, std::abs(dx_mm)).duration_s,
                    plan_scurve(task.times.y, std::abs(dy_mm)).duration_s);
  }
};

Found plan_route(const Route& route, const PathTask& task, const PathProgress& progress) {
  if (route.points <= kFewPoints) {
    const TaskCost exact{task};
    Order order = route.points == 0 ? Order{} : cheapest_of_all(route, exact);
    const double bound = cost_of(route, order, exact);
    return {std::move(order), bound};
  }
  switch (task.metric) {
    case Metric::manhattan:
      return plan_route(route, detail::ManhattanCost{}, task, progress);
    case Metric::chebyshev:
      return plan_route(route, detail::ChebyshevCost{}, task, progress);
    case Metric::euclidean:
      return plan_route(route, detail::EuclideanCost{}, task, progress);
    case Metric::time:
      break;
  }
  // Chords of a concave curve lie below it, so the table's bound holds for the exact times.
  return plan_route(route, detail::TimeCost{detail::AxisTimes(task.times.x), detail::AxisTimes(task.times.y)},
                    task, progress);
}

double pauses_s(const Route& route, const PathTask& task) {
  return task.metric == Metric::time ? static_cast<double>(route.points) * task.times.pause_s : 0.0;
}

/// The ways along each axis add up to the box of all sites, there and back for a closed tour, and no norm of
/// a sum is larger than the sum of the norms. Exact for sites in a row, where the search's bound is weak.
double box_bound_mm(const Route& route, Metric metric) {
  if (metric == Metric::time || route.sites.empty()) return 0.0;
  const auto extent = [&](auto coordinate) {
    const auto [low, high] =
        std::minmax_element(route.sites.begin(), route.sites.end(),
                            [&](const Site& a, const Site& b) { return a.*coordinate < b.*coordinate; });
    return (*high).*coordinate - (*low).*coordinate;
  };
  const double times = route.closed ? 2.0 : 1.0;
  return distance_mm(times * extent(&Site::x), times * extent(&Site::y), metric);
}

/// Points that coincide are one place to the search: their neighbours would be nothing but each other.
class Places {
 public:
  explicit Places(std::span<const Point> points) : next_(points.size(), kNone) {
    Order by_place(points.size());
    std::iota(by_place.begin(), by_place.end(), std::size_t{0});
    const auto key = [&](std::size_t i) { return std::tuple(points[i].x_mm, points[i].y_mm, i); };
    std::sort(by_place.begin(), by_place.end(),
              [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
    std::vector<char> follows(points.size(), 0);
    for (std::size_t k = 1; k < by_place.size(); ++k) {
      const Point &before = points[by_place[k - 1]], &point = points[by_place[k]];
      if (before.x_mm != point.x_mm || before.y_mm != point.y_mm) continue;
      next_[by_place[k - 1]] = by_place[k];
      follows[by_place[k]] = 1;
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (follows[i] != 0) continue;
      firsts_.push_back(i);
      places_.push_back(points[i]);
    }
  }

  std::span<const Point> places() const { return places_; }

  /// An order of places as one of all points.
  Order of_points(const Order& order_of_places) const {
    Order out;
    for (const std::size_t place : order_of_places)
      for (std::size_t i = firsts_[place]; i != kNone; i = next_[i]) out.push_back(i);
    return out;
  }

 private:
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  Order next_;    // the next point at the same place
  Order firsts_;  // of each place
  std::vector<Point> places_;
};

}  // namespace

double distance_mm(double dx_mm, double dy_mm, Metric metric) {
  const double dx = std::abs(dx_mm), dy = std::abs(dy_mm);
  switch (metric) {
    case Metric::manhattan:
      return dx + dy;
    case Metric::chebyshev:
      return std::max(dx, dy);
    case Metric::euclidean:
    case Metric::time:
      break;
  }
  return std::sqrt(dx * dx + dy * dy);
}

double path_cost(std::span<const Point> points, std::span<const std::size_t> order, const PathTask& task) {
  check(points, task);
  for (std::size_t i = 0; i < order.size(); ++i)
    if (order[i] >= points.size())
      throw MotionError(fmt::format(
          "path: order {}: found index {}, expected {}", i + 1, order[i],
          points.empty() ? "none: there are no points" : fmt::format("0 to {}", points.size() - 1)));
  const Route route = route_of(points, task);
  return cost_of(route, order, TaskCost{task}) + pauses_s(route, task);
}

Plan plan_path(std::span<const Point> points, const PathTask& task, const PathProgress& progress) {
  check(points, task);
  const Route route = route_of(points, task);
  Plan plan;
  plan.order.resize(points.size());
  std::iota(plan.order.begin(), plan.order.end(), std::size_t{0});
  const TaskCost cost{task};
  const double pauses = pauses_s(route, task);
  plan.cost_before = plan.cost_after = cost_of(route, plan.order, cost) + pauses;
  const Places places(points);
  Found found = plan_route(route_of(places.places(), task), task, progress);
  found.order = places.of_points(found.order);
  const double planned = cost_of(route, found.order, cost) + pauses;
  if (planned < plan.cost_before) {
    plan.order = std::move(found.order);
    plan.cost_after = planned;
  }
  // Rounding of the sums may leave the bound of a proved order a hair above or below it.
  const double rounding =
      std::max(1e-12, static_cast<double>(points.size()) * std::numeric_limits<double>::epsilon());
  const double bound = std::max(found.bound, box_bound_mm(route, task.metric)) + pauses;
  plan.lower_bound = bound >= plan.cost_after * (1.0 - rounding) ? plan.cost_after : bound;
  if (progress) progress(1.0);
  return plan;
}

Plan plan_path(std::span<const Point> points, Metric metric, Position start) {
  return plan_path(points, {.metric = metric,
                            .tour = Tour::open,
                            .start = start,
                            .end = {},
                            .times = {},
                            .kicks_per_point = {},
                            .search_s = {}});
}

}  // namespace meltstage::motion
