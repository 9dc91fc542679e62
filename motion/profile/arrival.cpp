// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/arrival.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/golden_section.hpp"
#include "motion/profile/check_positive.hpp"
#include "motion/profile/course.hpp"
#include "motion/profile/moving_end.hpp"
#include "motion/profile/speed_changes.hpp"

namespace meltstage::motion {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kExact = 1e-12;  // of a duration

/// Speeds with which an axis may go on for a while, next to each other, and how long the motions last that
/// do. With a speed of zero at an end the time has no bound.
struct Span {
  double from_speed, to_speed, from_s, to_s;

  double least_s() const { return std::min(from_s, to_s); }
  double most_s() const { return std::max(from_s, to_s); }
};

/// Motions that go to one speed, stay with it as long as the way takes that is left, and go on to the end's.
template <class Changes>
class Cruises {
 public:
  Cruises(Course start, const Goal& goal, const Changes& changes)
      : start_(std::move(start)), goal_(goal), changes_(changes) {
    const double most = changes_.largest(start_.now);
    if (std::abs(start_.now.acceleration_mm_s2) > most) ease(start_, most, changes_.release(start_.now));
  }

  /// With this speed; nothing where the way that is left lies behind.
  std::optional<Course> with(double speed) const {
    const double stay_s = left_mm(speed) / speed;
    if (!(stay_s >= 0.0) || !std::isfinite(stay_s)) return {};
    return staying(speed, stay_s);
  }

  std::vector<Span> spans() const {
    std::vector<Span> found;
    if (const Course stop = staying(0.0, 0.0);
        is_rounding(goal_.position_mm - stop.now.position_mm, farthest_mm(stop)))
      found.push_back({0.0, 0.0, stop.profile.duration_s, kNever});
    for (const double side : {1.0, -1.0}) {
      const std::vector<double> speeds = speeds_to_try(side);
      for (std::size_t i = 0; i + 1 < speeds.size(); ++i) add_span(speeds[i], speeds[i + 1], found);
      double slowest = speeds.back();
      for (int step = 0; step < 40 && !with(slowest); ++step) slowest *= 0.5;
      add_span(2.0 * slowest, slowest, found);
      if (const auto way = with(slowest)) found.push_back({slowest, 0.0, way->profile.duration_s, kNever});
    }
    return found;
  }

  /// The motion of a span that lasts so long.
  std::optional<Course> lasting(const Span& span, double duration_s) const {
    if (span.from_speed == 0.0) return fitting(0.0, duration_s);
    double longer = span.to_s > span.from_s ? span.to_speed : span.from_speed;
    double shorter = span.to_s > span.from_s ? span.from_speed : span.to_speed;
    for (int step = 0; step < 200; ++step) {
      const double middle = 0.5 * (longer + shorter);
      if (middle == longer || middle == shorter) break;
      if (auto way = fitting(middle, duration_s)) return way;
      const auto way = with(middle);
      if (!way) return {};
      (way->profile.duration_s < duration_s ? shorter : longer) = middle;
    }
    if (auto way = fitting(shorter, duration_s)) return way;
    return fitting(longer, duration_s);
  }

 private:
  static double farthest_mm(const Course& way) {
    double farthest = std::abs(way.now.position_mm);
    for (std::size_t i = 0; i < way.profile.segments; ++i)
      farthest = std::max(farthest, std::abs(way.profile.starts[i].position_mm));
    return farthest;
  }

  /// With this speed and of this duration, if it ends at the goal but for rounding. Of a speed next to none
  /// the way tells the stay badly, as it is rounded; the duration tells it well.
  std::optional<Course> fitting(double speed, double duration_s) const {
    const double stay_s = duration_s - staying(speed, 0.0).profile.duration_s;
    if (!(stay_s >= -kExact * duration_s)) return {};
    Course way = staying(speed, stay_s);
    if (!is_rounding(goal_.position_mm - way.now.position_mm, farthest_mm(way))) return {};
    return way;
  }

  /// The way that is left for a speed.
  double left_mm(double speed) const { return goal_.position_mm - staying(speed, 0.0).now.position_mm; }

  Course staying(double speed, double stay_s) const {
    Course way = start_;
    changes_.change(way, speed);
    way.append(stay_s, 0.0);
    changes_.change(way, goal_.velocity_mm_s);
    return way;
  }

  /// To one side, from the highest to the lowest: close where the way changes its form, at the speeds of both
  /// ends, and where the way that is left is nearest to being possible.
  std::vector<double> speeds_to_try(double side) const {
    constexpr int kEven = 16, kHalved = 20;
    std::vector<double> sizes;
    for (int i = kEven; i > 0; --i) sizes.push_back(goal_.highest_mm_s * i / kEven);
    for (int i = 1; i <= kHalved; ++i) sizes.push_back(goal_.highest_mm_s / kEven * std::pow(0.5, i));
    for (const double end : {start_.now.velocity_mm_s, goal_.velocity_mm_s})
      for (const double share : {0.5, 0.9, 0.99, 1.0, 1.01, 1.1})
        if (const double size = share * std::abs(end); size > 0.0 && size <= goal_.highest_mm_s)
          sizes.push_back(size);
    std::sort(sizes.begin(), sizes.end(), std::greater<>());
    sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
    const auto behind_mm = [&](double size) { return -side * left_mm(side * size); };
    constexpr int kSteps = 40;
    std::vector<double> between;
    for (std::size_t i = 1; i + 1 < sizes.size(); ++i) {
      const double here = behind_mm(sizes[i]);
      if (here > 0.0 && here <= behind_mm(sizes[i - 1]) && here <= behind_mm(sizes[i + 1]))
        between.push_back(least_between(behind_mm, sizes[i + 1], sizes[i - 1], kSteps).second);
    }
    sizes.insert(sizes.end(), between.begin(), between.end());
    std::sort(sizes.begin(), sizes.end(), std::greater<>());
    for (double& size : sizes) size *= side;
    return sizes;
  }

  void add_span(double one, double other, std::vector<Span>& found) const {
    std::optional<Course> from = with(one), to = with(other);
    if (!from && !to) return;
    // The last speed that is possible, where not all are.
    double& wrong = from ? other : one;
    std::optional<Course>& missing = from ? to : from;
    if (!missing) {
      double right = from ? one : other;
      for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (right + wrong);
        (with(middle) ? right : wrong) = middle;
      }
      wrong = right;
      missing = with(right);
    }
    found.push_back({one, other, from->profile.duration_s, to->profile.duration_s});
  }

  Course start_;
  Goal goal_;
  Changes changes_;
};

/// The moments at which an axis may arrive.
class Arrivals {
 public:
  Arrivals(const ScurveLimits& limits, const MotionState& state, double target_mm, double end_velocity_mm_s)
      : limits_(limits),
        fastest_(plan_to_speed(limits, state, target_mm, end_velocity_mm_s)),
        goal_{target_mm, end_velocity_mm_s, limits.velocity_mm_s},
        halting_(halting_start(state), goal_, HaltAtTurns(limits_)),
        spans_(halting_.spans()) {
    const EvenThroughout even(limits_);
    if (even.hold(state, limits.velocity_mm_s)) even_.emplace(Course(state), goal_, even);
    if (even_) even_spans_ = even_->spans();
  }
  Arrivals(const Arrivals&) = delete;
  Arrivals& operator=(const Arrivals&) = delete;

  double least_s() const { return fastest_.duration_s; }

  /// The first moment from this one on; kNever when there is none.
  double from_s(double time_s) const {
    if (time_s <= least_s()) return least_s();
    std::vector<double> starts = {time_s};
    for (const auto* spans : {&spans_, &even_spans_})
      for (const Span& span : *spans)
        if (span.least_s() > time_s) starts.push_back(span.least_s());
    std::sort(starts.begin(), starts.end());
    for (const double start_s : starts)
      for (const double behind : {0.0, 1e-9, 1e-6, 1e-3})  // at its very edge rounding may leave nothing
        if (const double later_s = start_s * (1.0 + behind); at(later_s)) return later_s;
    return kNever;
  }

  /// At rest it may also wait at the target.
  std::optional<JerkProfile> at(double time_s) const {
    if (is_now(fastest_, time_s)) return fastest_;
    std::optional<JerkProfile> found = lasting(halting_, spans_, time_s);
    if (!found && even_) found = lasting(*even_, even_spans_, time_s);
    if (!found && goal_.velocity_mm_s == 0.0 && time_s > least_s()) return fastest_;
    return found;
  }

 private:
  Course halting_start(const MotionState& state) const {
    const Course start(state), free = released(start, limits_);
    return free.now.velocity_mm_s == 0.0 ? free : start;
  }

  static bool is_now(const JerkProfile& profile, double time_s) {
    constexpr double kRounding = 1e-9;
    return std::isfinite(time_s) && std::abs(profile.duration_s - time_s) <= kRounding * time_s;
  }

  template <class Changes>
  std::optional<JerkProfile> lasting(const Cruises<Changes>& cruises, const std::vector<Span>& spans,
                                     double time_s) const {
    for (const Span& span : spans) {
      if (time_s < span.least_s() * (1.0 - kExact) || time_s > span.most_s()) continue;
      if (const auto way = cruises.lasting(span, time_s); way && is_now(way->profile, time_s))
        return way->ended_at(goal_);
    }
    return {};
  }

  ScurveLimits limits_;
  JerkProfile fastest_;
  Goal goal_;
  Cruises<HaltAtTurns> halting_;
  std::vector<Span> spans_;
  std::optional<Cruises<EvenThroughout>> even_;
  std::vector<Span> even_spans_;
};

}  // namespace

JerkProfile plan_arrival(const ScurveLimits& limits, const MotionState& state, double target_mm,
                         double end_velocity_mm_s, double duration_s) {
  if (!(duration_s >= 0.0) || !(duration_s <= kLargestMeasure))
    throw MotionError(
        fmt::format("arrival: found {} s, expected a duration from 0 to {} s", duration_s, kLargestMeasure));
  const Arrivals arrivals(limits, state, target_mm, end_velocity_mm_s);
  if (const auto found = arrivals.at(duration_s)) return *found;
  if (duration_s < arrivals.least_s())
    throw MotionError(
        fmt::format("arrival: found {} s, expected at least {} s", duration_s, arrivals.least_s()));
  const double next_s = arrivals.from_s(duration_s);
  throw MotionError(fmt::format("arrival: found {} s, expected {} s, {}", duration_s, arrivals.least_s(),
                                std::isfinite(next_s) ? fmt::format("or {} s, which is the next one", next_s)
                                                      : "as no longer one is possible"));
}

AxisStates JointMotion::sample(double time_s) const {
  AxisStates states;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const MotionState now = axes[axis].sample(time_s);
    states.position_mm[i] = from_mm[i] + now.position_mm;
    states.velocity_mm_s[i] = now.velocity_mm_s;
    states.acceleration_mm_s2[i] = now.acceleration_mm_s2;
    states.jerk_mm_s3[i] = now.jerk_mm_s3;
  }
  return states;
}

JointMotion plan_together(const AxisLimits& axes, const AxisStates& state, const Eigen::Vector3d& target_mm,
                          const Eigen::Vector3d& end_velocity_mm_s) {
  const auto arrivals_of = [&](Eigen::Index i) {
    try {
      return std::make_unique<Arrivals>(
          axes[static_cast<std::size_t>(i)],
          MotionState{0.0, state.velocity_mm_s[i], state.acceleration_mm_s2[i], 0.0},
          target_mm[i] - state.position_mm[i], end_velocity_mm_s[i]);
    } catch (const MotionError& error) {
      throw MotionError(fmt::format("axis {}: {}", i, error.what()));
    }
  };
  const std::array arrivals = {arrivals_of(0), arrivals_of(1), arrivals_of(2)};
  JointMotion motion;
  motion.from_mm = state.position_mm;
  for (const auto& axis : arrivals) motion.duration_s = std::max(motion.duration_s, axis->least_s());
  for (double before = -1.0; before != motion.duration_s && std::isfinite(motion.duration_s);) {
    before = motion.duration_s;
    for (const auto& axis : arrivals) motion.duration_s = std::max(motion.duration_s, axis->from_s(before));
  }
  for (std::size_t axis = 0; axis < arrivals.size(); ++axis) {
    const auto found = arrivals[axis]->at(motion.duration_s);
    if (!found)
      throw MotionError("three axes together: found no time that all of them can take, expected one");
    motion.axes[axis] = *found;
  }
  return motion;
}

}  // namespace meltstage::motion
