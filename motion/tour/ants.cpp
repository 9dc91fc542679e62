// SPDX-License-Identifier: Apache-2.0
#include "motion/tour/ants.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace meltstage::motion {
namespace {

/// Square matrix over pairs of points.
class Pairs {
 public:
  Pairs(std::size_t count, double value) : count_(count), values_(count * count, value) {}
  double& operator()(std::size_t i, std::size_t j) { return values_[i * count_ + j]; }
  double operator()(std::size_t i, std::size_t j) const { return values_[i * count_ + j]; }
  std::vector<double>& all() { return values_; }

 private:
  std::size_t count_;
  std::vector<double> values_;
};

void check(std::span<const Point> points, const AntColony& colony) {
  constexpr std::size_t kMostPoints = 2000;
  if (points.size() > kMostPoints)
    throw MotionError(
        fmt::format("ants: found {} points, expected at most {}; use plan_path", points.size(), kMostPoints));
  for (const Point& point : points)
    if (!std::isfinite(point.x_mm) || !std::isfinite(point.y_mm))
      throw MotionError(fmt::format("ants: row {}: found ({}, {}) mm, expected finite coordinates", point.row,
                                    point.x_mm, point.y_mm));
  const bool good = colony.q0 >= 0.0 && colony.q0 <= 1.0 && colony.alpha >= 0.0 && colony.beta >= 0.0 &&
                    colony.cycles >= 1 && colony.largest_rho > 0.0 && colony.largest_rho < 1.0;
  if (!good)
    throw MotionError(
        "ants: found a parameter out of range, expected q0 0..1, alpha and beta >= 0, cycles >= 1, "
        "largest rho between 0 and 1");
}

class Colony {
 public:
  Colony(std::span<const Point> points, Tour tour, const AntColony& settings)
      : tour_(tour),
        settings_(settings),
        count_(points.size()),
        distance_(count_, 0.0),
        pheromone_(count_, 1.0),
        attraction_(count_, 0.0),
        random_(settings.seed) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t j = 0; j < count_; ++j) {
        distance_(i, j) =
            distance_mm(points[i].x_mm - points[j].x_mm, points[i].y_mm - points[j].y_mm, Metric::manhattan);
        if (distance_(i, j) > 0.0) least = std::min(least, distance_(i, j));
      }
    const double together = std::isfinite(least) ? 1e-3 * least : 1.0;
    visibility_.reserve(count_ * count_);
    for (const double distance : distance_.all())
      visibility_.push_back(std::pow(1.0 / std::max(distance, together), settings.beta));
  }

  std::vector<std::size_t> run() {
    std::vector<std::size_t> best(count_);
    std::iota(best.begin(), best.end(), std::size_t{0});
    double shortest = std::numeric_limits<double>::infinity();
    for (int k = 1; k <= settings_.cycles; ++k) {
      weigh();
      for (std::size_t ant = 0; ant < count_; ++ant) {
        walk();
        const double length = length_of(path_);
        if (length >= shortest) continue;
        shortest = length;
        best = path_;
      }
      reinforce(best, shortest, std::min(1.0 - std::log(k) / std::log(k + 1.0), settings_.largest_rho));
    }
    return best;
  }

 private:
  /// tau^alpha eta^beta of every edge, once a cycle.
  void weigh() {
    const std::vector<double>& tau = pheromone_.all();
    std::vector<double>& out = attraction_.all();
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = (settings_.alpha == 1.0 ? tau[i] : std::pow(tau[i], settings_.alpha)) * visibility_[i];
  }

  void walk() {
    free_.resize(count_ - 1);
    std::iota(free_.begin(), free_.end(), std::size_t{1});
    path_.assign(1, 0);
    while (!free_.empty()) {
      const std::size_t chosen = choose(path_.back());
      path_.push_back(free_[chosen]);
      free_[chosen] = free_.back();
      free_.pop_back();
    }
  }

  /// Rule (1): the best edge; rule (2): by lot, as likely as it is attractive.
  std::size_t choose(std::size_t from) {
    if (uniform_(random_) <= settings_.q0) {
      std::size_t best = 0;
      for (std::size_t k = 1; k < free_.size(); ++k)
        if (attraction_(from, free_[k]) > attraction_(from, free_[best])) best = k;
      return best;
    }
    double total = 0.0;
    for (const std::size_t to : free_) total += attraction_(from, to);
    double left = uniform_(random_) * total;
    for (std::size_t k = 0; k < free_.size(); ++k)
      if ((left -= attraction_(from, free_[k])) <= 0.0) return k;
    return free_.size() - 1;
  }

  double length_of(const std::vector<std::size_t>& path) const {
    double length = tour_ == Tour::closed ? distance_(path.back(), path.front()) : 0.0;
    for (std::size_t i = 1; i < path.size(); ++i) length += distance_(path[i - 1], path[i]);
    return length;
  }

  /// Rule (3), with rule (4)'s rho.
  void reinforce(const std::vector<std::size_t>& best, double shortest, double rho) {
    for (double& tau : pheromone_.all()) tau *= 1.0 - rho;
    const auto add = [&](std::size_t i, std::size_t j) {
      pheromone_(i, j) += rho / shortest;
      pheromone_(j, i) += rho / shortest;
    };
    for (std::size_t i = 1; i < best.size(); ++i) add(best[i - 1], best[i]);
    if (tour_ == Tour::closed) add(best.back(), best.front());
  }

  Tour tour_;
  AntColony settings_;
  std::size_t count_;
  Pairs distance_, pheromone_, attraction_;
  std::vector<double> visibility_;
  std::vector<std::size_t> free_, path_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

}  // namespace

Plan plan_path_by_ants(std::span<const Point> points, Tour tour, const AntColony& colony) {
  check(points, colony);
  PathTask task;
  task.tour = tour;
  Plan plan;
  plan.order.resize(points.size());
  std::iota(plan.order.begin(), plan.order.end(), std::size_t{0});
  plan.cost_before = plan.cost_after = path_cost(points, plan.order, task);
  if (points.size() < 3 || plan.cost_before == 0.0) return plan;
  plan.order = Colony(points, tour, colony).run();
  plan.cost_after = path_cost(points, plan.order, task);
  return plan;
}

}  // namespace meltstage::motion
