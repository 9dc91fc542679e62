// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/any_end.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "base/golden_section.hpp"
#include "motion/profile/check_positive.hpp"
#include "motion/profile/course.hpp"

namespace meltstage::motion {
namespace {

MotionState reflected(const MotionState& s) {
  return {-s.position_mm, -s.velocity_mm_s, -s.acceleration_mm_s2, -s.jerk_mm_s3};
}

struct Piece {
  double duration_s = 0.0, jerk_mm_s3 = 0.0;
};
using Pieces = std::array<Piece, 7>;
constexpr std::size_t kMiddle = 3;  // the piece without acceleration

double duration_of(const Pieces& pieces) {
  double sum = 0.0;
  for (const Piece& piece : pieces) sum += piece.duration_s;
  return sum;
}

/// Motions whose acceleration rises from the start's to `high`, falls to `low` and rises to the end's. The
/// change of speed ties the two together: high^2 - low^2 = c. `u` runs along that curve: it is `low` where c
/// is positive, else -high. Extremes beyond the limit stand for a time at the limit that changes the speed as
/// much.
class RiseFallRise {
 public:
  RiseFallRise(const EvenLimits& limits, double highest_mm_s, const MotionState& start,
               const MotionState& end)
      : limits_(limits),
        start_(start),
        end_(end),
        c_(limits.jerk * (end.velocity_mm_s - start.velocity_mm_s) + 0.5 * (squared(a0()) - squared(a1()))) {
    const double by_start = squared(a0()) - c_, by_end = squared(a1()) + c_;
    if (c_ >= 0.0) {
      last_ = a0() > 0.0 && by_start > 0.0 ? std::min(a1(), -std::sqrt(by_start)) : a1();
      if (a0() > 0.0 && by_start > 0.0) apart_ = {std::sqrt(by_start), a1()};
    } else {
      last_ = a1() < 0.0 && by_end > 0.0 ? -std::max(a0(), std::sqrt(by_end)) : -a0();
      if (a1() < 0.0 && by_end > 0.0) apart_ = {std::sqrt(by_end), -a0()};
    }
    first_ = std::min(last_, at_peak(highest_mm_s));
    turn_ = std::clamp(at_peak(0.0), first_, last_);
  }

  /// The fastest of them over this way, if there is any. The duration falls as u grows.
  std::optional<Pieces> over(double way_mm) const {
    const auto past = [&](double u) { return way_of(pieces_of(u, 0.0)) - way_mm; };
    std::optional<Pieces> best;
    const auto take = [&](const Pieces& pieces) {
      if (!best || duration_of(pieces) < duration_of(*best)) best = pieces;
    };
    if (only_forward()) {
      if (past(last_) > 0.0) return {};
      if (const double first = past(first_); first <= 0.0)
        return pieces_of(first_, stay_s(-first, peak_of(first_)));
      return with_rest(root_between(past, first_, last_), way_mm);
    }
    if (apart_ && apart_->low <= apart_->high)
      if (const auto u = last_crossing(past, *apart_)) take(pieces_of(*u, 0.0));
    if (const auto u = last_crossing(past, {turn_, last_})) {
      take(with_rest(*u, way_mm));
    } else if (const double first = past(first_); first <= 0.0) {
      take(pieces_of(first_, stay_s(-first, peak_of(first_))));
    } else if (past(turn_) <=
               0.0) {  // the axis moves forward at the middle: the way grows with its speed there
      take(with_rest(root_between(past, first_, turn_), way_mm));
    }
    return best;
  }

  /// The one next to this way among those at which these motions go over into the reverse ones: by rounding
  /// both may just miss it.
  Pieces next_to(double way_mm) const {
    Pieces best = pieces_of(last_, 0.0);
    if (!apart_ || apart_->low > apart_->high) return best;
    for (const double u : {apart_->low, apart_->high}) {
      const Pieces other = pieces_of(u, 0.0);
      if (std::abs(way_of(other) - way_mm) < std::abs(way_of(best) - way_mm)) best = other;
    }
    return best;
  }
  double way_of(const Pieces& pieces) const {
    MotionState now = start_;
    now.position_mm = 0.0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (i == kMiddle && pieces[i].duration_s > 0.0) now.acceleration_mm_s2 = 0.0;
      now.jerk_mm_s3 = pieces[i].jerk_mm_s3;
      now = after(now, pieces[i].duration_s);
    }
    return now.position_mm;
  }

 private:
  struct Range {
    double low, high;
  };

  /// Then the way falls as u grows.
  bool only_forward() const {
    return std::min({start_.velocity_mm_s, end_.velocity_mm_s,
                     speed_without_acceleration(start_, limits_.jerk),
                     speed_before(end_.velocity_mm_s, a1(), limits_.jerk)}) >= 0.0 &&
           !apart_;
  }
  static double squared(double x) { return x * x; }
  double a0() const { return start_.acceleration_mm_s2; }
  double a1() const { return end_.acceleration_mm_s2; }
  double high_of(double u) const { return c_ >= 0.0 ? std::sqrt(c_ + u * u) : -u; }
  double low_of(double u) const { return c_ >= 0.0 ? u : -std::sqrt(u * u - c_); }

  /// Where the speed at the middle is this one.
  double at_peak(double velocity) const {
    const double high_squared = limits_.jerk * (velocity - start_.velocity_mm_s) + 0.5 * squared(a0());
    return -std::sqrt(std::max(0.0, c_ >= 0.0 ? high_squared - c_ : high_squared));
  }
  /// The speed where the acceleration falls through zero.
  double peak_of(double u) const {
    return start_.velocity_mm_s + (squared(high_of(u)) - 0.5 * squared(a0())) / limits_.jerk;
  }
  static double stay_s(double left_mm, double velocity) { return velocity > 0.0 ? left_mm / velocity : 0.0; }

  Pieces pieces_of(double u, double stay) const {
    const double most = limits_.acceleration, jerk = limits_.jerk;
    const double high = high_of(u), low = low_of(u);
    const double top = std::clamp(high, a0(), std::max(a0(), most)),
                 bottom = std::clamp(low, std::min(a1(), -most), a1());
    const auto hold_s = [&](double beyond) {
      return std::max(0.0, squared(beyond) - squared(most)) / (jerk * most);
    };
    const bool through_zero = top >= 0.0 && bottom <= 0.0;
    const double before = through_zero ? top : std::max(0.0, top - bottom),
                 behind = through_zero ? -bottom : 0.0;
    return {{{(top - a0()) / jerk, jerk},
             {high > most ? hold_s(high) : 0.0, 0.0},
             {before / jerk, -jerk},
             {stay, 0.0},
             {behind / jerk, -jerk},
             {low < -most ? hold_s(low) : 0.0, 0.0},
             {(a1() - bottom) / jerk, jerk}}};
  }
  /// What the root leaves of the way is made at the middle, unless it is rounding: at a speed of next to
  /// nothing that would take for ever.
  Pieces with_rest(double u, double way_mm) const {
    constexpr double kRounding = 1e-10;
    const double left = way_mm - way_of(pieces_of(u, 0.0));
    const bool through_zero = high_of(u) > 0.0 && low_of(u) < 0.0;
    return pieces_of(u, through_zero && left > kRounding * std::abs(way_mm) ? stay_s(left, peak_of(u)) : 0.0);
  }

  /// Where a function is 0 that has other signs at the ends; next to it, it is below 0 if it falls.
  template <class Function>
  static double root_between(const Function& function, double low, double high) {
    if (function(low) <= function(high)) return root_of_rising(function, low, high);
    const auto reversed = [&](double x) { return function(-x); };
    return -root_of_rising(reversed, -high, -low);
  }

  /// The last place where a function is 0 that may rise and fall some times, if there is any.
  template <class Function>
  static std::optional<double> last_crossing(const Function& function, const Range& range) {
    constexpr int kParts = 10;
    std::array<double, kParts + 1> at, of;
    for (int i = 0; i <= kParts; ++i) {
      at[i] = range.low + (range.high - range.low) * i / kParts;
      of[i] = function(at[i]);
    }
    for (int i = kParts; i > 0; --i) {
      if (of[i] * of[i - 1] <= 0.0) return root_between(function, at[i - 1], at[i]);
      const int before = std::max(i - 1, 0), behind = std::min(i + 1, kParts);
      const double sign = of[i] > 0.0 ? 1.0 : -1.0;
      if (sign * of[i] > sign * of[before] || sign * of[i] > sign * of[behind]) continue;
      constexpr int kSteps = 40;
      const double least =
          least_between([&](double u) { return sign * function(u); }, at[before], at[behind], kSteps).second;
      if (sign * function(least) <= 0.0) return root_between(function, least, at[behind]);
    }
    return {};
  }

  const EvenLimits limits_;
  const MotionState start_, end_;
  const double c_;
  double first_ = 0.0;          // at the highest speed
  double last_ = 0.0;           // where a first or a last rise lasts no time
  double turn_ = 0.0;           // where the axis stands at the middle
  std::optional<Range> apart_;  // where the acceleration keeps its sign
};

double speed_before_end(const MotionState& end, double jerk) {
  return speed_before(end.velocity_mm_s, end.acceleration_mm_s2, jerk);
}

void check_end(const MotionState& end, const EvenLimits& even, double highest_mm_s) {
  constexpr double kRounded = 1.0 + 1e-12;
  const bool finite = std::abs(end.position_mm) <= kLargestMeasure && std::isfinite(end.velocity_mm_s) &&
                      std::isfinite(end.acceleration_mm_s2);
  const double speed =
      finite ? std::max(std::abs(end.velocity_mm_s), std::abs(speed_before_end(end, even.jerk))) : 0.0;
  if (!finite || std::abs(end.acceleration_mm_s2) > even.acceleration * kRounded ||
      speed > highest_mm_s * kRounded)
    throw MotionError(fmt::format(
        "motion to a state: found {} mm, {} mm/s, {} mm/s2, expected finite numbers, at most {} mm/s2, and "
        "at most {} "
        "mm/s there and before it",
        end.position_mm, end.velocity_mm_s, end.acceleration_mm_s2, even.acceleration, highest_mm_s));
}

/// Brings the state to where the limits can be kept.
void come_inside(Course& course, const EvenLimits& even, double highest_mm_s) {
  const double present = course.now.acceleration_mm_s2;
  if (std::abs(present) > even.acceleration) {
    course.append((std::abs(present) - even.acceleration) / even.jerk, -std::copysign(even.jerk, present));
    course.now.acceleration_mm_s2 = std::copysign(even.acceleration, present);
  }
  const double speed = speed_without_acceleration(course.now, even.jerk);
  if (std::abs(speed) > highest_mm_s) change_speed(course, std::copysign(highest_mm_s, speed), even);
}

}  // namespace

JerkProfile plan_to_state(const ScurveLimits& limits, const MotionState& state, const MotionState& end) {
  check_limits(limits);
  check_state(state);
  const EvenLimits even(limits);
  check_end(end, even, limits.velocity_mm_s);
  Course course(state);
  come_inside(course, even, limits.velocity_mm_s);
  const double way = end.position_mm - course.now.position_mm;
  std::optional<Pieces> best;
  if (way == 0.0 && end.velocity_mm_s == course.now.velocity_mm_s &&
      end.acceleration_mm_s2 == course.now.acceleration_mm_s2)
    best = Pieces{};
  double sign = 1.0;
  const RiseFallRise forward(even, limits.velocity_mm_s, course.now, end),
      backward(even, limits.velocity_mm_s, reflected(course.now), reflected(end));
  const auto take = [&](const Pieces& found, double side) {
    if (best && duration_of(*best) <= duration_of(found)) return;
    best = found;
    sign = side;
  };
  if (const auto found = forward.over(way)) take(*found, 1.0);
  if (const auto found = backward.over(-way)) take(*found, -1.0);
  const Pieces one = forward.next_to(way), other = backward.next_to(-way);
  const double miss = std::abs(forward.way_of(one) - way),
               other_miss = std::abs(backward.way_of(other) + way);
  constexpr double kRounding = 1e-12;
  if (!best || std::min(miss, other_miss) <= kRounding * std::abs(way))
    take(miss <= other_miss ? one : other, miss <= other_miss ? 1.0 : -1.0);
  for (std::size_t i = 0; i < best->size(); ++i) {
    // Over a long way at one speed the rounding of an acceleration would grow.
    if (i == kMiddle && (*best)[i].duration_s > 0.0) course.now.acceleration_mm_s2 = 0.0;
    course.append((*best)[i].duration_s, sign * (*best)[i].jerk_mm_s3);
  }
  course.profile.end = {end.position_mm, end.velocity_mm_s, end.acceleration_mm_s2, 0.0};
  if (end.acceleration_mm_s2 != 0.0) return course.profile;
  // Where the acceleration at the start is next to none, its change of the speed is lost in rounding above.
  const double a = even.acceleration, j = even.jerk;
  const auto to_speed = plan_evenly({limits.velocity_mm_s, a, a, j, j, j, j}, state,
                                    {end.position_mm, end.velocity_mm_s, limits.velocity_mm_s});
  return to_speed && to_speed->duration_s < course.profile.duration_s ? *to_speed : course.profile;
}

}  // namespace meltstage::motion
