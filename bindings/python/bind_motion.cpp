// SPDX-License-Identifier: Apache-2.0
// Bumps, their order, and motions.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bindings/python/parts.hpp"
#include "bindings/python/without_gil.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/profile/any_end.hpp"
#include "motion/profile/arrival.hpp"
#include "motion/profile/moving_end.hpp"
#include "motion/profile/profile.hpp"
#include "motion/profile/retarget.hpp"
#include "motion/profile/through_points.hpp"
#include "motion/tour/path.hpp"

namespace meltstage::python {

namespace py = pybind11;
using namespace motion;

namespace {

constexpr std::uint64_t kSamplesOfSlice = 200'000;
constexpr std::chrono::milliseconds kLookEvery{50};

using Numbers = py::array_t<double, py::array::c_style>;
using Vector = std::array<double, 3>;
using LimitNumbers = std::array<double, 7>;  // in the order of ScurveLimits
using StateNumbers = std::array<double, 3>;  // position, velocity, acceleration

ScurveLimits limits_of(const LimitNumbers& n) { return {n[0], n[1], n[2], n[3], n[4], n[5], n[6]}; }

AxisLimits limits_of(const std::array<LimitNumbers, 3>& axes) {
  return {limits_of(axes[0]), limits_of(axes[1]), limits_of(axes[2])};
}

MotionState state_of(const StateNumbers& n) { return {n[0], n[1], n[2]}; }

Eigen::Vector3d vector_of(const Vector& v) { return {v[0], v[1], v[2]}; }

std::vector<Point> points_of(const Numbers& points_mm) {
  const auto from = points_mm.unchecked<2>();
  if (from.shape(1) != 2) throw std::invalid_argument("points: expected two columns");
  std::vector<Point> points(static_cast<std::size_t>(from.shape(0)));
  for (py::ssize_t i = 0; i < from.shape(0); ++i) {
    Point& point = points[static_cast<std::size_t>(i)];
    point = {from(i, 0), from(i, 1), static_cast<std::size_t>(i) + 1};
  }
  return points;
}

// ---- Bumps ----

using Travels = std::array<std::array<double, 2>, 2>;

py::tuple read_bumps(const std::string& path, double pitch_mm, std::array<double, 2> origin_mm,
                     double rotation_deg, bool mirror_x, std::optional<bool> bottom, const std::string& only,
                     const Travels& travel_mm) {
  CoordinateOptions options;
  options.pitch_mm = pitch_mm;
  options.origin_x_mm = origin_mm[0];
  options.origin_y_mm = origin_mm[1];
  options.rotation_deg = rotation_deg;
  options.mirror_x = mirror_x;
  if (bottom) options.side = *bottom ? Side::bottom : Side::top;
  options.only = only;
  options.travel.x = {travel_mm[0][0], travel_mm[0][1]};
  options.travel.y = {travel_mm[1][0], travel_mm[1][1]};
  CoordinateFile file;
  {
    const Released released;
    file = read_coordinate_file(path, options);
  }
  const auto count = static_cast<py::ssize_t>(file.points.size());
  Numbers points({count, py::ssize_t{2}});
  py::array_t<std::int64_t> rows(count);
  auto point = points.mutable_unchecked<2>();
  auto row = rows.mutable_unchecked<1>();
  for (py::ssize_t i = 0; i < count; ++i) {
    const Point& from = file.points[static_cast<std::size_t>(i)];
    point(i, 0) = from.x_mm;
    point(i, 1) = from.y_mm;
    row(i) = static_cast<std::int64_t>(from.row);
  }
  return py::make_tuple(points, rows, file.notes);
}

// ---- The order ----

std::optional<Position> position_of(const std::optional<std::array<double, 2>>& place) {
  if (!place) return std::nullopt;
  return Position{(*place)[0], (*place)[1]};
}

py::tuple plan_tour(const Numbers& points_mm, int metric, bool closed,
                    const std::optional<std::array<double, 2>>& start_mm,
                    const std::optional<std::array<double, 2>>& end_mm,
                    const std::array<LimitNumbers, 2>& limits, double pause_s,
                    std::optional<double> kicks_per_point, std::optional<double> search_s) {
  const std::vector<Point> points = points_of(points_mm);
  PathTask task;
  task.metric = std::array{Metric::manhattan, Metric::chebyshev, Metric::euclidean, Metric::time}.at(
      static_cast<std::size_t>(metric));
  task.tour = closed ? Tour::closed : Tour::open;
  task.start = position_of(start_mm);
  task.end = position_of(end_mm);
  task.times = {limits_of(limits[0]), limits_of(limits[1]), pause_s};
  task.kicks_per_point = kicks_per_point;
  task.search_s = search_s;
  Plan plan;
  {
    const Released released;
    auto next_look = std::chrono::steady_clock::now() + kLookEvery;
    plan = plan_path(points, task, [&](double) {
      if (const auto now = std::chrono::steady_clock::now(); now >= next_look) {
        next_look = now + kLookEvery;
        look_at_signals_from_outside();
      }
    });
  }
  py::array_t<std::int64_t> order(static_cast<py::ssize_t>(plan.order.size()));
  std::copy(plan.order.begin(), plan.order.end(), order.mutable_data());
  return py::make_tuple(order, plan.cost_before, plan.cost_after, plan.lower_bound, plan.gap());
}

// ---- Motions ----

// A row a time: position, velocity, acceleration, jerk.
Numbers sample(const JerkProfile& profile, const Numbers& times_s) {
  const auto time = times_s.unchecked<1>();
  Numbers states({time.shape(0), py::ssize_t{4}});
  auto state = states.mutable_unchecked<2>();
  in_parts(static_cast<std::uint64_t>(time.shape(0)), kSamplesOfSlice,
           [&](std::uint64_t begin, std::uint64_t end) {
             for (auto i = static_cast<py::ssize_t>(begin); i < static_cast<py::ssize_t>(end); ++i) {
               const MotionState at = profile.sample(time(i));
               state(i, 0) = at.position_mm;
               state(i, 1) = at.velocity_mm_s;
               state(i, 2) = at.acceleration_mm_s2;
               state(i, 3) = at.jerk_mm_s3;
             }
           });
  return states;
}

Numbers times_at(const JerkProfile& profile, const Numbers& positions_mm) {
  const auto position = positions_mm.unchecked<1>();
  Numbers times(position.shape(0));
  auto time = times.mutable_unchecked<1>();
  in_parts(static_cast<std::uint64_t>(position.shape(0)), kSamplesOfSlice / 10,
           [&](std::uint64_t begin, std::uint64_t end) {
             for (auto i = static_cast<py::ssize_t>(begin); i < static_cast<py::ssize_t>(end); ++i)
               time(i) = profile.time_at(position(i));
           });
  return times;
}

// A row a segment: start, duration, position, velocity, acceleration, jerk.
Numbers segments(const JerkProfile& profile) {
  Numbers table({static_cast<py::ssize_t>(profile.segments), py::ssize_t{6}});
  auto cell = table.mutable_unchecked<2>();
  for (std::size_t i = 0; i < profile.segments; ++i) {
    const MotionState& start = profile.starts[i];
    py::ssize_t column = 0;
    for (const double value : {profile.start_times_s[i], profile.durations_s[i], start.position_mm,
                               start.velocity_mm_s, start.acceleration_mm_s2, start.jerk_mm_s3})
      cell(static_cast<py::ssize_t>(i), column++) = value;
  }
  return table;
}

// Three axes, planned one way or another.
struct AxesMotion {
  double duration_s = 0.0;
  std::vector<double> passed_s;  // of a motion through points
  std::function<AxisStates(double time_s)> at;
};

template <class Planned>
AxesMotion axes_motion(Planned planned, double duration_s, std::vector<double> passed_s = {}) {
  const auto kept = std::make_shared<const Planned>(std::move(planned));
  return {duration_s, std::move(passed_s), [kept](double time_s) { return kept->sample(time_s); }};
}

// Position, velocity, acceleration and jerk, for each a row a time and a column an axis.
Numbers sample_axes(const AxesMotion& motion, const Numbers& times_s) {
  const auto time = times_s.unchecked<1>();
  Numbers states({py::ssize_t{4}, time.shape(0), py::ssize_t{3}});
  auto state = states.mutable_unchecked<3>();
  in_parts(static_cast<std::uint64_t>(time.shape(0)), kSamplesOfSlice / 10,
           [&](std::uint64_t begin, std::uint64_t end) {
             for (auto i = static_cast<py::ssize_t>(begin); i < static_cast<py::ssize_t>(end); ++i) {
               const AxisStates at = motion.at(time(i));
               for (py::ssize_t axis = 0; axis < 3; ++axis) {
                 state(0, i, axis) = at.position_mm[axis];
                 state(1, i, axis) = at.velocity_mm_s[axis];
                 state(2, i, axis) = at.acceleration_mm_s2[axis];
                 state(3, i, axis) = at.jerk_mm_s3[axis];
               }
             }
           });
  return states;
}

AxesMotion through_points(const Numbers& points_mm, const std::array<LimitNumbers, 3>& limits,
                          double tolerance_mm) {
  const auto from = points_mm.unchecked<2>();
  if (from.shape(1) != 3) throw std::invalid_argument("points: expected three columns");
  std::vector<Eigen::Vector3d> points;
  for (py::ssize_t i = 0; i < from.shape(0); ++i) points.emplace_back(from(i, 0), from(i, 1), from(i, 2));
  const Released released;
  ThroughPoints planned = plan_through(points, limits_of(limits), tolerance_mm);
  const double duration_s = planned.duration_s;
  std::vector<double> passed_s = planned.passed_s;
  return axes_motion(std::move(planned), duration_s, std::move(passed_s));
}

AxesMotion together(const std::array<LimitNumbers, 3>& limits, const std::array<Vector, 3>& state,
                    const Vector& target_mm, const Vector& end_velocity_mm_s) {
  const AxisStates now{vector_of(state[0]), vector_of(state[1]), vector_of(state[2]),
                       Eigen::Vector3d::Zero()};
  JointMotion planned =
      plan_together(limits_of(limits), now, vector_of(target_mm), vector_of(end_velocity_mm_s));
  const double duration_s = planned.duration_s;
  return axes_motion(std::move(planned), duration_s);
}

AxesMotion line(const std::array<LimitNumbers, 3>& limits, const Vector& from_mm, const Vector& to_mm) {
  Move planned = plan_move(vector_of(from_mm), vector_of(to_mm), limits_of(limits));
  const double duration_s = planned.profile.duration_s;
  return axes_motion(std::move(planned), duration_s);
}

void bind_tour(py::module_& module) {
  module.attr("MOST_POINTS") = kMaxPoints;
  module.def("read_bumps", read_bumps, py::arg("path"), py::arg("pitch_mm"), py::arg("origin_mm"),
             py::arg("rotation_deg"), py::arg("mirror_x"), py::arg("bottom"), py::arg("only"),
             py::arg("travel_mm"));
  module.def("plan_tour", plan_tour, py::arg("points_mm"), py::arg("metric"), py::arg("closed"),
             py::arg("start_mm"), py::arg("end_mm"), py::arg("limits"), py::arg("pause_s"),
             py::arg("kicks_per_point"), py::arg("search_s"));
}

void bind_profiles(py::module_& module) {
  py::class_<JerkProfile>(module, "Profile")
      .def_readonly("duration_s", &JerkProfile::duration_s)
      .def("sample", sample, py::arg("times_s"))
      .def("times_at", times_at, py::arg("positions_mm"))
      .def("segments", segments);
  module.def(
      "plan_scurve",
      [](const LimitNumbers& limits, double distance_mm, double start_mm_s, double end_mm_s) {
        return JerkProfile(plan_scurve(limits_of(limits), distance_mm, start_mm_s, end_mm_s));
      },
      py::arg("limits"), py::arg("distance_mm"), py::arg("start_velocity_mm_s"),
      py::arg("end_velocity_mm_s"));
  module.def(
      "plan_to_state",
      [](const LimitNumbers& limits, const StateNumbers& state, const StateNumbers& end) {
        return plan_to_state(limits_of(limits), state_of(state), state_of(end));
      },
      py::arg("limits"), py::arg("state"), py::arg("end"));
  module.def(
      "plan_to_speed",
      [](const LimitNumbers& limits, const StateNumbers& state, double target_mm, double end_mm_s) {
        return plan_to_speed(limits_of(limits), state_of(state), target_mm, end_mm_s);
      },
      py::arg("limits"), py::arg("state"), py::arg("target_mm"), py::arg("end_velocity_mm_s"));
  module.def(
      "plan_arrival",
      [](const LimitNumbers& limits, const StateNumbers& state, double target_mm, double end_mm_s,
         double duration_s) {
        return plan_arrival(limits_of(limits), state_of(state), target_mm, end_mm_s, duration_s);
      },
      py::arg("limits"), py::arg("state"), py::arg("target_mm"), py::arg("end_velocity_mm_s"),
      py::arg("duration_s"));
  module.def(
      "plan_stop",
      [](const LimitNumbers& limits, const StateNumbers& state) {
        return plan_stop(limits_of(limits), state_of(state));
      },
      py::arg("limits"), py::arg("state"));
}

void bind_axes(py::module_& module) {
  py::class_<AxesMotion>(module, "AxesMotion")
      .def_readonly("duration_s", &AxesMotion::duration_s)
      .def_property_readonly("passed_s",
                             [](const AxesMotion& motion) {
                               return Numbers(static_cast<py::ssize_t>(motion.passed_s.size()),
                                              motion.passed_s.data());
                             })
      .def("sample", sample_axes, py::arg("times_s"));
  module.def("plan_through", through_points, py::arg("points_mm"), py::arg("limits"),
             py::arg("tolerance_mm"));
  module.def("plan_together", together, py::arg("limits"), py::arg("state"), py::arg("target_mm"),
             py::arg("end_velocity_mm_s"));
  module.def("plan_line", line, py::arg("limits"), py::arg("from_mm"), py::arg("to_mm"));
}

}  // namespace

void bind_motion(py::module_& module) {
  bind_tour(module);
  bind_profiles(module);
  bind_axes(module);
}

}  // namespace meltstage::python
