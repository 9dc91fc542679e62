// SPDX-License-Identifier: Apache-2.0
#include "app/commands/motion_files.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "app/json_output.hpp"
#include "app/print/job_plan.hpp"
#include "base/count.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"
#include "motion/stage/accuracy.hpp"
#include "motion/stage/stage.hpp"

namespace meltstage::app {

namespace {

// grbl takes its settings apart from programs; at the program's head they stand for whoever sends it.
std::string as_comments(const std::string& settings) {
  std::string text = "(made for these settings:)\n";
  std::istringstream lines(settings);
  for (std::string line; std::getline(lines, line);) text += "(" + line + ")\n";
  return text;
}

// What a job asks for and no program for another control can carry.
std::vector<std::string> left_out(const LoadedJob& loaded) {
  const tb::PrintJob& job = loaded.job;
  std::vector<std::string> notes = loaded.notes;
  if (job.fly_by) notes.emplace_back("mode fly-by isn't written: it stops at each bump");
  for (std::size_t axis = 0; axis < job.compensation.size(); ++axis)
    if (!job.compensation[axis].position_mm.empty())
      notes.push_back(
          fmt::format("deviations_{} aren't corrected here: the control has to", axis == 0 ? 'x' : 'y'));
  if (loaded.alignment) notes.emplace_back("alignment isn't written: the board lies as the bumps' file says");
  if (job.stage.quiet) notes.emplace_back("quiet isn't written: the control plans its moves itself");
  if (!job.drive.homed) notes.emplace_back("homing isn't written: home the machine first");
  return notes;
}

std::string gap_told(const motion::Plan& plan) {
  const double above_percent = most_above_cheapest_percent(plan);
  if (above_percent == 0.0) return "the cheapest";
  return above_percent > 0.0 ? fmt::format("at most {:.2g} % above the cheapest", above_percent)
                             : "of which no bound is known";
}

}  // namespace

namespace {

void print_accuracy_json(const motion::AxisAccuracy& axis, const motion::ResidualBacklash& backlash) {
  using Json = nlohmann::ordered_json;
  Json positions = Json::array();
  for (const motion::PositionAccuracy& at : axis.positions)
    positions.push_back({{"target_mm", at.target_mm},
                         {"mean_forward_um", at.mean_forward_um},
                         {"mean_reverse_um", at.mean_reverse_um},
                         {"reversal_um", at.reversal_um},
                         {"deviation_forward_um", at.deviation_forward_um},
                         {"deviation_reverse_um", at.deviation_reverse_um},
                         {"repeatability_um", at.repeatability_um}});
  const auto by_direction = [](double forward, double reverse, double both) {
    return Json{{"forward", forward}, {"reverse", reverse}, {"both", both}};
  };
  print_json(
      {{"positions", positions},
       {"accuracy_um", by_direction(axis.accuracy_forward_um, axis.accuracy_reverse_um, axis.accuracy_um)},
       {"repeatability_um",
        by_direction(axis.repeatability_forward_um, axis.repeatability_reverse_um, axis.repeatability_um)},
       {"systematic_um",
        by_direction(axis.systematic_forward_um, axis.systematic_reverse_um, axis.systematic_um)},
       {"mean_systematic_um", axis.mean_systematic_um},
       {"reversal_um", axis.reversal_um},
       {"mean_reversal_um", axis.mean_reversal_um},
       {"backlash_um", backlash.backlash_um},
       {"backlash_standard_error_um", backlash.standard_error_um}});
}

}  // namespace

int write_gcode_file(const GcodeCommand& command) {
  const LoadedJob loaded = [&] {
    ProgressLine line;
    return load_job(command.job, [&](double share) { line.show_share("planning the path", share); });
  }();
  const tb::PrintJob& job = loaded.job;
  require_other_file(command.out, loaded.inputs);
  const auto& axes = job.stage.axes;
  motion::GcodeOptions options{.dialect = command.dialect,
                               .heat_timeout_s = job.heat_timeout_s,
                               .settle_s = job.settle_s,
                               .x = axes[0].travel,
                               .y = axes[1].travel,
                               .end_mm = {},
                               .notes = left_out(loaded)};
  if (job.end_mm) options.end_mm = Eigen::Vector2d(job.end_mm->x(), job.end_mm->y());
  try {
    std::string program =
        motion::write_gcode(job.bumps, {job.start_mm.x(), job.start_mm.y()}, job.name, options);
    if (command.dialect == motion::GcodeDialect::grbl)
      program = as_comments(motion::write_grbl_settings(
                    {1.0 / motion::pulse_length_mm(axes[0]), 1.0 / motion::pulse_length_mm(axes[1]),
                     1.0 / motion::pulse_length_mm(axes[2])},
                    {axes[0].limits, axes[1].limits, axes[2].limits})) +
                program;
    write_whole(command.out, program);
  } catch (const motion::MotionError& error) {
    throw UserError(fmt::format("{}: {}", command.job.string(), error.what()));
  }
  for (const std::string& note : options.notes) fmt::print("note: {}\n", note);
  fmt::print("{}: {}; path of {:.4g} {}, {}; stops and moves take {:.4g} s\n", escaped(command.out.string()),
             counted(job.bumps.size(), "droplet"), loaded.plan.cost_after, loaded.plan_unit,
             gap_told(loaded.plan), loaded.moves_after_s);
  return 0;
}

int show_accuracy(const AccuracyCommand& command) {
  try {
    require_other_file(command.compensation, {command.deviations});
    const auto targets = motion::read_deviations(command.deviations);
    if (!command.compensation.empty()) {
      const motion::Range anywhere{targets.front().target_mm, targets.back().target_mm};
      motion::require_correctable(command.deviations.string(), targets, anywhere);
    }
    const motion::AxisAccuracy axis = motion::evaluate_accuracy(targets);
    const motion::ResidualBacklash backlash = motion::residual_backlash(targets);
    if (!command.compensation.empty())
      write_whole(command.compensation, motion::write_linuxcnc_compensation(motion::make_compensation(axis)));
    if (command.json) {
      print_accuracy_json(axis, backlash);
      return 0;
    }
    fmt::print("{:>12} {:>10} {:>10} {:>10} {:>8} {:>8} {:>10}\n", "target mm", "mean + um", "mean - um",
               "B um", "s + um", "s - um", "R um");
    for (const motion::PositionAccuracy& at : axis.positions)
      fmt::print("{:>12.4f} {:>10.3f} {:>10.3f} {:>10.3f} {:>8.3f} {:>8.3f} {:>10.3f}\n", at.target_mm,
                 at.mean_forward_um, at.mean_reverse_um, at.reversal_um, at.deviation_forward_um,
                 at.deviation_reverse_um, at.repeatability_um);
    fmt::print("\n{:<44} {:>10} {:>10} {:>10}\n", "ISO 230-2:2014, um", "forward", "reverse", "both");
    const auto row = [](const char* what, double forward, double reverse, double both) {
      fmt::print("{:<44} {:>10.3f} {:>10.3f} {:>10.3f}\n", what, forward, reverse, both);
    };
    row("positioning accuracy A", axis.accuracy_forward_um, axis.accuracy_reverse_um, axis.accuracy_um);
    row("positioning repeatability R", axis.repeatability_forward_um, axis.repeatability_reverse_um,
        axis.repeatability_um);
    row("systematic positioning error E", axis.systematic_forward_um, axis.systematic_reverse_um,
        axis.systematic_um);
    fmt::print("{:<66} {:>10.3f}\n", "mean bidirectional positioning error M", axis.mean_systematic_um);
    fmt::print("{:<66} {:>10.3f}\n", "reversal error B", axis.reversal_um);
    fmt::print("{:<66} {:>10.3f}\n", "mean reversal error", axis.mean_reversal_um);
    fmt::print("backlash by the residual method: {:.3f} um, standard error {:.3f} um\n", backlash.backlash_um,
               backlash.standard_error_um);
  } catch (const motion::MotionError& error) {
    throw UserError(error.what());
  }
  return 0;
}

}  // namespace meltstage::app
