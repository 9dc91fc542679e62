// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "bindings/c/handles.hpp"
#include "bindings/c/status.hpp"
#include "motion/profile/any_end.hpp"
#include "motion/profile/arrival.hpp"
#include "motion/profile/profile.hpp"

using namespace meltstage;
using namespace meltstage::motion;
using c::guarded;
using c::required;

namespace {

ScurveLimits limits_of(const ms_limits* limits) {
  const ms_limits& l = required(limits, "limits");
  return {l.velocity_mm_s, l.acceleration_mm_s2, l.deceleration_mm_s2, l.jerk1_mm_s3,
          l.jerk3_mm_s3,   l.jerk5_mm_s3,        l.jerk7_mm_s3};
}

// As a motion counts it: its positions begin at `from_mm`.
MotionState state_of(const ms_motion_state& state, double from_mm) {
  return {.position_mm = state.position_mm - from_mm,
          .velocity_mm_s = state.velocity_mm_s,
          .acceleration_mm_s2 = state.acceleration_mm_s2};
}

std::optional<Position> position_of(const double* place_mm) {
  if (place_mm == nullptr) return std::nullopt;
  return Position{place_mm[0], place_mm[1]};
}

Metric metric_of(ms_metric metric) {
  switch (metric) {
    case MS_MANHATTAN:
      return Metric::manhattan;
    case MS_CHEBYSHEV:
      return Metric::chebyshev;
    case MS_EUCLIDEAN:
      return Metric::euclidean;
  }
  throw UserError(fmt::format("metric: found {}, expected 0 to 2", static_cast<int>(metric)));
}

}  // namespace

extern "C" {

ms_limits ms_default_limits(void) {
  const ScurveLimits l;
  return {l.velocity_mm_s, l.acceleration_mm_s2, l.deceleration_mm_s2, l.jerk1_mm_s3,
          l.jerk3_mm_s3,   l.jerk5_mm_s3,        l.jerk7_mm_s3};
}

ms_status ms_profile_scurve(const ms_limits* limits, double distance_mm, double start_velocity_mm_s,
                            double end_velocity_mm_s, ms_profile** profile) {
  return guarded([&] {
    ms_profile*& made = required(profile, "profile");
    made =
        new ms_profile{plan_scurve(limits_of(limits), distance_mm, start_velocity_mm_s, end_velocity_mm_s)};
  });
}

ms_status ms_profile_to_state(const ms_limits* limits, const ms_motion_state* state,
                              const ms_motion_state* end, ms_profile** profile) {
  return guarded([&] {
    ms_profile*& made = required(profile, "profile");
    const double from_mm = required(state, "state").position_mm;
    made = new ms_profile{
        plan_to_state(limits_of(limits), state_of(*state, from_mm), state_of(required(end, "end"), from_mm)),
        from_mm};
  });
}

ms_status ms_profile_arrival(const ms_limits* limits, const ms_motion_state* state, double target_mm,
                             double end_velocity_mm_s, double duration_s, ms_profile** profile) {
  return guarded([&] {
    ms_profile*& made = required(profile, "profile");
    const double from_mm = required(state, "state").position_mm;
    made = new ms_profile{plan_arrival(limits_of(limits), state_of(*state, from_mm), target_mm - from_mm,
                                       end_velocity_mm_s, duration_s),
                          from_mm};
  });
}

void ms_profile_free(ms_profile* profile) { delete profile; }

ms_status ms_profile_duration(const ms_profile* profile, double* duration_s) {
  return guarded(
      [&] { required(duration_s, "duration_s") = required(profile, "profile").profile.duration_s; });
}

ms_status ms_profile_sample(const ms_profile* profile, const double* times_s, size_t count,
                            ms_motion_state* states) {
  return guarded([&] {
    const ms_profile& found = required(profile, "profile");
    if (count == 0) return;
    required(times_s, "times_s");
    required(states, "states");
    for (std::size_t i = 0; i < count; ++i) c::number("times_s", times_s[i]);
    for (std::size_t i = 0; i < count; ++i) {
      const MotionState at = found.profile.sample(times_s[i]);
      states[i] = {at.position_mm + found.from_mm, at.velocity_mm_s, at.acceleration_mm_s2, at.jerk_mm_s3};
    }
  });
}

ms_status ms_tour_plan(const double* points_mm, size_t count, ms_metric metric, int closed,
                       const double* start_mm, const double* end_mm, ms_tour** tour) {
  return guarded([&] {
    ms_tour*& made = required(tour, "tour");
    if (count > kMaxPoints)
      throw UserError(fmt::format("count: found {} points, expected {} at most", count, kMaxPoints));
    if (count != 0) required(points_mm, "points_mm");
    std::vector<Point> points(count);
    for (std::size_t i = 0; i < count; ++i) points[i] = {points_mm[2 * i], points_mm[2 * i + 1], i + 1};
    PathTask task;
    task.metric = metric_of(metric);
    task.tour = closed != 0 ? Tour::closed : Tour::open;
    task.start = position_of(start_mm);
    task.end = position_of(end_mm);
    made = new ms_tour{plan_path(points, task)};
  });
}

void ms_tour_free(ms_tour* tour) { delete tour; }

ms_status ms_tour_order(const ms_tour* tour, const size_t** order, size_t* count) {
  return guarded([&] {
    const std::vector<std::size_t>& found = required(tour, "tour").plan.order;
    const size_t*& out = required(order, "order");
    required(count, "count") = found.size();
    out = found.data();
  });
}

ms_status ms_tour_length(const ms_tour* tour, double* before_mm, double* planned_mm, double* bound_mm) {
  return guarded([&] {
    const Plan& plan = required(tour, "tour").plan;
    if (before_mm != nullptr) *before_mm = plan.cost_before;
    if (planned_mm != nullptr) *planned_mm = plan.cost_after;
    if (bound_mm != nullptr) *bound_mm = plan.lower_bound;
  });
}

}  // extern "C"
