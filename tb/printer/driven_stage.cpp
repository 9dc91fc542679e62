// SPDX-License-Identifier: Apache-2.0
#include "tb/printer/driven_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meltstage::tb {
namespace {

constexpr double kFastHoming_mm_s = 20.0, kSlowHoming_mm_s = 2.0;
constexpr double kWatched_s = 0.5;  // how long the models run on after a motion

// A homing speed from which the axis stops half way between home and limit switch.
double homing_speed_mm_s(const motion::AxisConfig& axis) {
  const auto way_mm = [&](double speed) {
    return motion::plan_stop(axis.limits, {0.0, speed, 0.0, 0.0}).end.position_mm;
  };
  double speed = std::min(kFastHoming_mm_s, axis.limits.velocity_mm_s);
  while (way_mm(speed) > 0.5 * axis.overtravel_mm) speed *= 0.7;
  return speed;
}

// The first index above the home switch.
double first_index_mm(const motion::AxisConfig& axis) {
  const double turns = (axis.travel.min_mm - axis.index_mm) / axis.lead_mm;
  return axis.index_mm + (std::floor(turns) + 1.0) * axis.lead_mm;
}

motion::AxisControlConfig control_config(const motion::AxisConfig& axis, double cycle_s) {
  motion::AxisControlConfig config;
  config.cycle_s = cycle_s;
  config.travel = axis.travel;
  config.limits = axis.limits;
  config.homing.fast_mm_s = homing_speed_mm_s(axis);
  config.homing.slow_mm_s = std::min(kSlowHoming_mm_s, config.homing.fast_mm_s);
  config.homing.search_mm = 1.1 * (axis.travel.max_mm - axis.travel.min_mm) + 2.0 * axis.overtravel_mm;
  config.homing.lead_mm = axis.lead_mm;
  config.homing.index_position_mm = first_index_mm(axis);
  return config;
}

// What an axis control stopped for, and what to do about it.
std::string sentence_of(std::size_t axis, motion::AxisFault fault, const motion::AxisControlConfig& config) {
  std::string sentence = fmt::format("axis {}: {}", motion::kAxisNames[axis], motion::name_of(fault));
  if (fault == motion::AxisFault::following_error)
    sentence += fmt::format(
        " beyond {:.6g} um and {:.6g} um for each mm/s: the slide is stuck, or too fast for its drive; lower "
        "stage.speed_mm_s, stage.acceleration_mm_s2 or stage.jerk_mm_s3",
        1e3 * config.following_error_mm, 1e3 * config.following_error_s);
  return sentence;
}

}  // namespace

DrivenStage::Axis DrivenStage::make_axis(std::size_t axis, const DriveConfig& drive,
                                         double power_on_mm) const {
  const motion::StageConfig& stage = stage_.config();
  const motion::AxisConfig& config = stage.axes[axis];
  const double cycle_s = seconds(servo_clocks_);
  motion::AxisModelConfig model = drive.axes[axis];
  model.servo.cycle_s = cycle_s;
  model.screw.lead_mm = config.lead_mm;
  // The encoder's zero is where power came on, unless it knows better.
  const double unknown_mm = drive.homed ? 0.0 : power_on_mm;
  Axis made{.control = motion::AxisControl(control_config(config, cycle_s), power_on_mm - unknown_mm),
            .model = motion::AxisModel(model, power_on_mm),
            .unknown_mm = unknown_mm,
            .index_mm = config.index_mm,
            .lead_mm = config.lead_mm,
            .motor_before_mm = power_on_mm,
            .head_before_mm = 0.0,
            .turns_before = std::floor((power_on_mm - config.index_mm) / config.lead_mm),
            .tracked_mm = power_on_mm,
            .jammed = false,
            .stop = {},
            .stop_from_mm = 0.0};
  made.head_before_mm = made.model.load_mm();
  if (drive.homed) made.control.set_homed(power_on_mm);
  return made;
}

DrivenStage::DrivenStage(const motion::StageConfig& stage, const DriveConfig& drive,
                         const Eigen::Vector3d& power_on_mm, std::uint32_t servo_clocks)
    : stage_(stage, power_on_mm),
      servo_clocks_(servo_clocks),
      axes_{make_axis(0, drive, power_on_mm.x()), make_axis(1, drive, power_on_mm.y()),
            make_axis(2, drive, power_on_mm.z())} {}

bool DrivenStage::homed() const {
  return std::all_of(axes_.begin(), axes_.end(), [](const Axis& axis) { return axis.control.homed(); });
}

Eigen::Vector3d DrivenStage::read_back_mm() const {
  return {axes_[0].control.position_mm(), axes_[1].control.position_mm(), axes_[2].control.position_mm()};
}

motion::AxisInputs DrivenStage::inputs_of(std::size_t i, bool emergency_loop) {
  Axis& axis = axes_[i];
  const motion::AxisPins& pins = stage_.pins(i);
  motion::AxisInputs inputs{.encoder_mm = axis.model.encoder_mm() - axis.unknown_mm,
                            .index_mm = {},
                            .home = pins.home,
                            .limit_negative = pins.limit_negative,
                            .limit_positive = pins.limit_positive,
                            .emergency_stop = emergency_loop};
  const double turns = std::floor((axis.model.motor_mm() - axis.index_mm) / axis.lead_mm);
  if (turns != axis.turns_before)
    inputs.index_mm = std::max(turns, axis.turns_before) * axis.lead_mm + axis.index_mm - axis.unknown_mm;
  axis.turns_before = turns;
  return inputs;
}

/// What an axis of a path is to do now, in the stage's frame.
motion::MotionState DrivenStage::command_of(std::size_t i, std::uint64_t cycle) const {
  const Axis& axis = axes_[i];
  if (mode_ == Mode::line) return stage_.planned(i, cycle);
  if (mode_ == Mode::fly_by_stop) {
    motion::MotionState state = axis.stop.sample(elapsed_s(cycle));
    state.position_mm += axis.stop_from_mm;
    return state;
  }
  if (i == 2) return {axis.tracked_mm, 0.0, 0.0, 0.0};
  const motion::FlyByState both = plan_.sample(elapsed_s(cycle));
  motion::MotionState state = i == 0 ? both.x : both.y;
  state.position_mm = axis.control.encoder_of(state.position_mm) + axis.unknown_mm;
  return state;
}

void DrivenStage::track(std::size_t i, double stage_mm, std::uint64_t cycle) {
  if (stage_mm == axes_[i].tracked_mm) return;
  stage_.track(i, stage_mm, cycle, servo_clocks_);
  axes_[i].tracked_mm = stage_mm;
}

void DrivenStage::tick(std::uint64_t cycle, bool emergency_loop) {
  ticked_ = cycle;
  const Eigen::Vector3d pulses_mm = stage_.position_mm();
  if (busy()) awake_until_ = cycle + static_cast<std::uint64_t>(kWatched_s * stage_.config().clock_hz);
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = axes_[i];
    const motion::AxisInputs inputs = inputs_of(i, emergency_loop);
    motion::AxisOutputs out;
    if (axis.control.coupled()) {
      motion::MotionState command = command_of(i, cycle);
      if (mode_ != Mode::line) track(i, command.position_mm, cycle);
      command.position_mm -= axis.unknown_mm;
      out = axis.control.follow(inputs, command);
    } else {
      out = axis.control.step(inputs);
      if (out.enabled && mode_ == Mode::homing) track(i, out.command.position_mm + axis.unknown_mm, cycle);
    }
    axis.motor_before_mm = axis.model.motor_mm();
    axis.head_before_mm = axis.model.load_mm();
    // The drive goes by the pulses; speed and acceleration come ahead of them over its fieldbus.
    motion::MotionState drive = out.command;
    drive.position_mm = pulses_mm[static_cast<Eigen::Index>(i)];
    if (out.enabled && !axis.jammed && cycle < awake_until_) axis.model.step(drive);
  }
  look_for_faults(cycle);
  look_for_end(cycle);
  if (mode_ == Mode::fly_by) compare(cycle);
}

void DrivenStage::look_for_faults(std::uint64_t cycle) {
  if (fault_) return;
  for (std::size_t i = 0; i < axes_.size() && !fault_; ++i)
    if (const motion::AxisFault fault = axes_[i].control.fault(); fault != motion::AxisFault::none)
      fault_ = sentence_of(i, fault, control_config(stage_.config().axes[i], seconds(servo_clocks_)));
  if (fault_) stop(cycle);
}

void DrivenStage::look_for_end(std::uint64_t cycle) {
  const auto all = [&](auto is) { return std::all_of(axes_.begin(), axes_.end(), is); };
  bool over = false;
  switch (mode_) {
    case Mode::rest:
      return;
    case Mode::homing:
      over = all([](const Axis& axis) { return axis.control.at_rest(); });
      break;
    case Mode::line:
      over = !stage_.moving(cycle);
      break;
    case Mode::fly_by:
      // The motor comes behind the plan: the comparator looks on until it rests, too.
      over = elapsed_s(cycle) > plan_.duration_s + (row_ == plan_.rows.size() ? 0.0 : kFollows_s);
      break;
    case Mode::fly_by_stop:
      over = all([&](const Axis& axis) { return elapsed_s(cycle) > axis.stop.duration_s; });
      break;
  }
  // A pulse of the last piece may still be on its way.
  if (!over || stage_.next_event_cycle()) return;
  if (mode_ == Mode::fly_by && row_ < plan_.rows.size()) give_up_row();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = axes_[i];
    if (mode_ == Mode::line) axis.tracked_mm = stage_.planned(i, cycle).position_mm;
    if (!axis.control.coupled()) continue;
    // The last command of the path was given before its end.
    axis.control.follow(inputs_of(i, false), {axis.tracked_mm - axis.unknown_mm, 0.0, 0.0, 0.0});
    axis.control.decouple();
  }
  mode_ = Mode::rest;
}

void DrivenStage::home() {
  for (Axis& axis : axes_) axis.control.home();
  mode_ = Mode::homing;
}

void DrivenStage::require_ready() const {
  for (std::size_t i = 0; i < axes_.size(); ++i)
    if (const motion::AxisPhase phase = axes_[i].control.phase(); phase != motion::AxisPhase::ready)
      throw motion::MotionError(
          fmt::format("stage: found axis {} in phase \"{}\", expected it homed, at rest and without a fault",
                      motion::kAxisNames[i], motion::name_of(phase)));
}

void DrivenStage::couple() {
  for (Axis& axis : axes_) axis.control.couple();
}

void DrivenStage::move_to(const Eigen::Vector3d& position_mm, std::uint64_t cycle) {
  require_ready();
  Eigen::Vector3d stage_mm;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    stage_mm[at] = axes_[i].control.encoder_of(position_mm[at]) + axes_[i].unknown_mm;
  }
  stage_.move_to(stage_mm, cycle + 1);
  couple();
  mode_ = Mode::line;
}

void DrivenStage::print_on_the_fly(const motion::FlyByPlan& plan, const motion::FlyByConfig& config,
                                   std::uint64_t cycle) {
  require_ready();
  couple();
  plan_ = plan;
  encoder_mm_ = config.encoder_mm;
  // From the next servo cycle on.
  plan_cycle_ = cycle + servo_clocks_;
  arm(0, 0);
  before_edge_ = false;
  missed_.clear();
  trigger_.reset();
  mode_ = Mode::fly_by;
}

void DrivenStage::stop(std::uint64_t cycle) {
  if (stopped_) return;
  stopped_ = true;
  trigger_.reset();
  if (mode_ == Mode::fly_by) {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      motion::MotionState state = command_of(i, cycle);
      axes_[i].stop_from_mm = state.position_mm;
      state.position_mm = 0.0;
      axes_[i].stop = motion::plan_stop(stage_.config().axes[i].limits, state);
    }
    plan_cycle_ = cycle;
    mode_ = Mode::fly_by_stop;
  } else if (mode_ == Mode::homing) {
    for (Axis& axis : axes_) axis.control.stop();
  } else if (mode_ == Mode::line) {
    stage_.emergency_stop(cycle);
  }
}

/// Way of the motor to where it comes to the count of a trigger; below 0 behind it.
double DrivenStage::left_to_edge_mm(const motion::Trigger& armed) const {
  const double direction = plan_.rows[row_].direction();
  const Axis& x = axes_[0];
  const double edge_mm =
      x.control.encoder_of((static_cast<double>(armed.count) - 0.5 * direction) * encoder_mm_) + x.unknown_mm;
  return direction * (edge_mm - x.model.motor_mm());
}

/// Does the encoder come to the armed count within this servo cycle? The models stand at its end already.
void DrivenStage::compare(std::uint64_t cycle) {
  if (trigger_) return;
  // A row whose end has come and gone fires no more.
  while (row_ + 1 < plan_.rows.size() && elapsed_s(cycle) >= plan_.rows[row_ + 1].start_s) give_up_row();
  if (row_ == plan_.rows.size() || cycle < plan_cycle_) return;
  const motion::FlyByRow& row = plan_.rows[row_];
  if (elapsed_s(cycle) < row.start_s) return;
  const motion::Trigger& armed = row.triggers[shot_];
  const double left_mm = left_to_edge_mm(armed);
  // A comparator fires on the way over an edge: one that the axis has behind it when the row begins is none.
  before_edge_ = before_edge_ || left_mm > 0.0;
  nearest_mm_ = std::min(nearest_mm_, std::abs(left_mm));
  if (left_mm > 0.0 || !before_edge_) return;
  const Axis& x = axes_[0];
  const double way_mm = row.direction() * (x.model.motor_mm() - x.motor_before_mm);
  const double share = way_mm > 0.0 ? std::clamp(1.0 + left_mm / way_mm, 0.0, 1.0) : 0.0;
  const double compare_clocks = kCompare_s * stage_.config().clock_hz;
  const double clocks = std::ceil(share * servo_clocks_ / compare_clocks) * compare_clocks;
  trigger_ = {cycle + std::clamp<std::uint64_t>(std::llround(clocks), 1, servo_clocks_), armed.bump};
}

void DrivenStage::arm(std::size_t row, std::size_t shot) {
  row_ = row;
  shot_ = shot;
  nearest_mm_ = std::numeric_limits<double>::infinity();
}

void DrivenStage::fired() {
  trigger_.reset();
  if (shot_ + 1 < plan_.rows[row_].triggers.size()) return arm(row_, shot_ + 1);
  before_edge_ = false;
  arm(row_ + 1, 0);
}

/// What is left of the armed row stays without droplets.
void DrivenStage::give_up_row() {
  const auto& triggers = plan_.rows[row_].triggers;
  for (; shot_ < triggers.size(); ++shot_)
    missed_.push_back(
        {triggers[shot_].bump, std::min(nearest_mm_, std::abs(left_to_edge_mm(triggers[shot_])))});
  before_edge_ = false;
  arm(row_ + 1, 0);
}

Eigen::Vector2d DrivenStage::landing_mm(std::uint64_t cycle, double latency_s, double flight_s) const {
  Eigen::Vector2d landing;
  for (std::size_t i = 0; i < 2; ++i) {
    const Axis& axis = axes_[i];
    const double way_mm = axis.model.load_mm() - axis.head_before_mm;
    const double into = static_cast<double>(cycle - ticked_) / servo_clocks_;
    const double onward = (latency_s + flight_s) / seconds(servo_clocks_);
    landing[static_cast<Eigen::Index>(i)] = axis.head_before_mm + way_mm * (into + onward);
  }
  return landing;
}

}  // namespace meltstage::tb
