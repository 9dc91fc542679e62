// SPDX-License-Identifier: Apache-2.0
#include "app/print/job_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "base/count.hpp"
#include "base/error.hpp"

namespace meltstage::app {

namespace {

// Rows of the bumps at constant speed. The head's errors are compensated in the plan: Y as it comes from
// below, X in the count at which the comparator fires.
tb::FlyBy plan_fly_by(const tb::PrintJob& job, const motion::FlyByConfig& config) {
  tb::FlyBy fly_by{config, {}};
  std::vector<motion::Point> bumps = job.bumps;
  const motion::CompensationTable &x = job.compensation[0], &y = job.compensation[1];
  if (!y.position_mm.empty())
    for (motion::Point& bump : bumps) bump.y_mm = motion::compensated_forward_mm(y, bump.y_mm);
  fly_by.plan = motion::plan_fly_by(bumps, config);
  for (motion::FlyByRow& row : fly_by.plan.rows) {
    for (const double turn_mm : {row.from_x_mm, row.to_x_mm}) {
      const motion::Range& travel = job.stage.axes[0].travel;
      if (!(turn_mm >= travel.min_mm && turn_mm <= travel.max_mm))
        throw motion::MotionError(fmt::format(
            "print on the fly: found a row at y {:.3f} mm that turns at x {:.3f} mm, expected {}..{} mm "
            "(travel); move the origin, lower the speed or stop at each bump",
            row.y_mm, turn_mm, travel.min_mm, travel.max_mm));
    }
    if (x.position_mm.empty()) continue;
    for (motion::Trigger& trigger : row.triggers) {
      const double bump_mm = bumps[trigger.bump].x_mm;
      const double command_mm = row.direction() > 0.0 ? motion::compensated_forward_mm(x, bump_mm)
                                                      : motion::compensated_reverse_mm(x, bump_mm);
      trigger.count += std::llround((command_mm - bump_mm) / config.encoder_mm);
    }
  }
  return fly_by;
}

// The bumps in the order in which the rows pass them.
void print_in_rows(LoadedJob& loaded, const motion::PathTask& task) {
  std::vector<motion::Point> bumps;
  std::vector<std::size_t> order;
  for (motion::FlyByRow& row : loaded.job.fly_by->plan.rows)
    for (motion::Trigger& trigger : row.triggers) {
      bumps.push_back(loaded.job.bumps[trigger.bump]);
      order.push_back(loaded.plan.order[trigger.bump]);
      trigger.bump = bumps.size() - 1;
    }
  loaded.job.bumps = std::move(bumps);
  loaded.plan.order = std::move(order);
  loaded.plan.cost_after = motion::path_cost(loaded.bumps_in_file_order, loaded.plan.order, task);
}

// From the start over all rows to the end.
double rows_s(const tb::PrintJob& job) {
  const motion::FlyByPlan& plan = job.fly_by->plan;
  const motion::FlyByRow &first = plan.rows.front(), &last = plan.rows.back();
  const auto way_s = [&](const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm) {
    return motion::plan_stage_move(job.stage, from_mm, to_mm).profile.duration_s;
  };
  const double z_mm = job.start_mm.z();
  const double end_s = job.end_mm ? way_s({last.to_x_mm, last.y_mm, z_mm}, *job.end_mm) : 0.0;
  return way_s(job.start_mm, {first.from_x_mm, first.y_mm, z_mm}) + plan.duration_s + end_s;
}

// What the stage can do, and how its axes are corrected.
void prepare_stage(JobDescription& parsed) {
  try {
    const motion::Stage probe(parsed.job.stage, parsed.job.start_mm);
  } catch (const motion::MotionError& error) {
    throw UserError(fmt::format("{}: [stage]: {}", parsed.file.string(), error.what()));
  }
  try {
    for (std::size_t i = 0; i < parsed.deviations.size(); ++i)
      if (parsed.deviations[i])
        parsed.job.compensation[i] =
            motion::make_compensation(motion::evaluate_accuracy(*parsed.deviations[i]));
  } catch (const motion::MotionError& error) {
    throw UserError(error.what());
  }
}

// Beyond its first and last target a table goes on as it is there; where no bump is between them, it is
// another table or another place.
void require_measured_at_bumps(JobDescription& parsed) {
  for (std::size_t axis = 0; axis < parsed.deviations.size(); ++axis) {
    if (!parsed.deviations[axis] || parsed.bumps_in_file_order.empty()) continue;
    const double first_mm = parsed.deviations[axis]->front().target_mm,
                 last_mm = parsed.deviations[axis]->back().target_mm;
    const char name = axis == 0 ? 'x' : 'y';
    double least_mm = INFINITY, most_mm = -INFINITY;
    std::size_t beyond = 0, first_row = 0;
    for (const motion::Point& bump : parsed.bumps_in_file_order) {
      const double at_mm = axis == 0 ? bump.x_mm : bump.y_mm;
      least_mm = std::min(least_mm, at_mm);
      most_mm = std::max(most_mm, at_mm);
      if ((at_mm < first_mm || at_mm > last_mm) && beyond++ == 0) first_row = bump.row;
    }
    if (beyond == parsed.bumps_in_file_order.size())
      throw UserError(
          fmt::format("{}: stage.deviations_{}: found targets from {:.6g} to {:.6g} mm, expected some where "
                      "the bumps are, "
                      "{:.6g} to {:.6g} mm on the stage",
                      parsed.file.string(), name, first_mm, last_mm, least_mm, most_mm));
    if (beyond > 0)
      parsed.notes.push_back(fmt::format(
          "deviations_{}: {} of {}, the first that of row {}, lie beyond the targets ({:.6g} to {:.6g} mm), "
          "where the outermost target's deviation is taken",
          name, beyond, counted(parsed.bumps_in_file_order.size(), "bump"), first_row, first_mm, last_mm));
  }
}

// A corrected axis is sent beside its bump, which may be beyond the end of its travel.
void require_in_travel(const tb::PrintJob& job, const tb::Sent& sent, const std::string& what,
                       const std::filesystem::path& file) {
  for (std::size_t axis = 0; axis < job.compensation.size(); ++axis) {
    const auto at = static_cast<Eigen::Index>(axis);
    const motion::Range& travel = job.stage.axes[axis].travel;
    if (!(sent.commanded_mm[at] >= travel.min_mm && sent.commanded_mm[at] <= travel.max_mm))
      throw UserError(fmt::format(
          "{}: stage.deviations_{}: found {}, where the corrected axis is sent to {:.4f} mm, expected {} to "
          "{} "
          "mm (travel); move the origin",
          file.string(), axis == 0 ? 'x' : 'y', what, sent.commanded_mm[at], travel.min_mm, travel.max_mm));
  }
}

void require_in_travel(const tb::PrintJob& job, const std::filesystem::path& file) {
  tb::Sent at = tb::send(job, {job.power_on_mm, job.power_on_mm}, job.start_mm);
  require_in_travel(job, at, "the start", file);
  for (const motion::Point& bump : job.bumps) {
    at = tb::send(job, at, {bump.x_mm, bump.y_mm, job.start_mm.z()});
    require_in_travel(job, at, fmt::format("the bump of row {}", bump.row), file);
  }
  if (job.end_mm) require_in_travel(job, tb::send(job, at, *job.end_mm), "the end", file);
}

// What a move leaves of the machine's vibration. Equal ways leave the same.
class VibrationLeft {
 public:
  explicit VibrationLeft(const motion::StageConfig& stage) : stage_(stage) {}

  double mm(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm) {
    const Eigen::Vector3d way_mm = to_mm - from_mm;
    const auto nm = [&](Eigen::Index axis) { return std::llround(1e6 * way_mm[axis]); };
    const auto [known, is_new] = left_mm_.try_emplace({nm(0), nm(1)}, 0.0);
    if (is_new)
      known->second = motion::worst_residual_mm(motion::plan_stage_move(stage_, from_mm, to_mm).profile,
                                                stage_.quiet->band);
    return known->second;
  }

 private:
  const motion::StageConfig& stage_;
  std::map<std::pair<long long, long long>, double> left_mm_;
};

// Some moves can't be made as quiet as the job asks for: too little time for too wide a band.
void require_quiet(const tb::PrintJob& job, const std::string& place) {
  constexpr double kRounding = 1e-6;
  if (!job.stage.quiet || job.fly_by) return;
  VibrationLeft left(job.stage);
  tb::Sent at{job.start_mm, job.start_mm};
  double most_mm = 0.0;
  std::size_t row = 0;
  for (const motion::Point& bump : job.bumps) {
    const tb::Sent next = tb::send(job, at, {bump.x_mm, bump.y_mm, job.start_mm.z()});
    const double left_mm = left.mm(at.commanded_mm, next.commanded_mm);
    if (left_mm > most_mm) row = bump.row;
    most_mm = std::max(most_mm, left_mm);
    at = next;
  }
  if (most_mm > job.stage.quiet->tolerance_mm * (1.0 + kRounding))
    throw UserError(
        fmt::format("{}: found {:.6g}, expected at least {:.3g}, which the move to the bump of row {} "
                    "leaves; raise it, or "
                    "lower stage.mode_spread, stage.acceleration_mm_s2 or stage.jerk_mm_s3",
                    place, 1e3 * job.stage.quiet->tolerance_mm, std::ceil(1e6 * most_mm) * 1e-3, row));
}

}  // namespace

double most_above_cheapest_percent(const motion::Plan& plan) {
  constexpr double kRounding = 1e-8;
  if (!std::isfinite(plan.gap())) return std::numeric_limits<double>::quiet_NaN();
  return plan.gap() < kRounding ? 0.0 : 100.0 * plan.gap();
}

LoadedJob plan_job(JobDescription parsed, const motion::PathProgress& progress) {
  prepare_stage(parsed);
  require_measured_at_bumps(parsed);
  LoadedJob loaded;
  loaded.plan_unit = parsed.task.metric == motion::Metric::time ? "s" : "mm";
  loaded.job = std::move(parsed.job);
  loaded.plan_metric = std::move(parsed.plan_metric);
  loaded.bumps_in_file_order = std::move(parsed.bumps_in_file_order);
  loaded.coordinates = std::move(parsed.coordinates);
  loaded.inputs = std::move(parsed.inputs);
  loaded.notes = std::move(parsed.notes);
  loaded.alignment = std::move(parsed.alignment);
  tb::PrintJob& job = loaded.job;
  try {
    loaded.plan = motion::plan_path(loaded.bumps_in_file_order, parsed.task, progress);
  } catch (const motion::MotionError& error) {
    throw UserError(fmt::format("{}: {}", parsed.file.string(), error.what()));
  }
  motion::PathTask in_time = parsed.task;
  in_time.metric = motion::Metric::time;
  std::vector<std::size_t> file_order(loaded.bumps_in_file_order.size());
  std::iota(file_order.begin(), file_order.end(), std::size_t{0});
  loaded.moves_before_s = motion::path_cost(loaded.bumps_in_file_order, file_order, in_time);
  loaded.moves_after_s = motion::path_cost(loaded.bumps_in_file_order, loaded.plan.order, in_time);
  for (const std::size_t i : loaded.plan.order) job.bumps.push_back(loaded.bumps_in_file_order[i]);
  if (parsed.task.end)
    job.end_mm = Eigen::Vector3d(parsed.task.end->x_mm, parsed.task.end->y_mm, job.start_mm.z());
  if (parsed.task.tour == motion::Tour::closed) {
    const bool from_stage = parsed.task.start.has_value();
    const motion::Point& first = job.bumps.front();
    job.end_mm = from_stage ? job.start_mm : Eigen::Vector3d(first.x_mm, first.y_mm, job.start_mm.z());
  }
  if (parsed.fly_by) {
    try {
      job.fly_by = plan_fly_by(job, *parsed.fly_by);
      print_in_rows(loaded, parsed.task);
      loaded.rows_s = rows_s(job);
    } catch (const motion::MotionError& error) {
      throw UserError(fmt::format("{}: {}", parsed.file.string(), error.what()));
    }
  }
  if (!job.fly_by) require_in_travel(job, parsed.file);
  try {
    require_quiet(job, parsed.quiet_place);
  } catch (const motion::MotionError& error) {
    throw UserError(fmt::format("{}: {}", parsed.file.string(), error.what()));
  }
  return loaded;
}

LoadedJob load_job(const std::filesystem::path& path, const motion::PathProgress& progress) {
  return plan_job(parse_job(path), progress);
}

}  // namespace meltstage::app
