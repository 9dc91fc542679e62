// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "motion/profile/shaping.hpp"

namespace meltstage::motion {
namespace {

std::int64_t modulo(std::int64_t value, std::int64_t divisor) {
  const std::int64_t rest = value % divisor;
  return rest < 0 ? rest + divisor : rest;
}

/// The first command pulse at or behind a whole turn of the motor from the index.
bool is_index(const AxisConfig& axis, std::int64_t pulses) {
  const std::int64_t turn = axis.encoder_pulses_per_turn * axis.gear_numerator;
  const std::int64_t from_index = pulses - mm_to_pulses(axis, axis.index_mm);
  return modulo(from_index * axis.gear_denominator, turn) < axis.gear_denominator;
}

template <typename... Values>
[[noreturn]] void fail(fmt::format_string<Values...> format, Values&&... values) {
  throw MotionError(fmt::format(format, std::forward<Values>(values)...));
}

double most_steps_per_s(const StageConfig& config) {
  return config.clock_hz / (2.0 * config.step_high_cycles);
}

void check_axis(const AxisConfig& axis, std::string_view name, const StageConfig& config) {
  if (!std::isfinite(axis.lead_mm) || axis.lead_mm <= 0.0)
    fail("axis {}: found lead {} mm, expected a finite number above 0", name, axis.lead_mm);
  if (axis.encoder_pulses_per_turn <= 0 || axis.gear_numerator <= 0 || axis.gear_denominator <= 0)
    fail("axis {}: found {} pulses a turn and gear {}/{}, expected numbers above 0", name,
         axis.encoder_pulses_per_turn, axis.gear_numerator, axis.gear_denominator);
  if (!std::isfinite(axis.travel.min_mm) || !std::isfinite(axis.travel.max_mm) ||
      axis.travel.min_mm >= axis.travel.max_mm)
    fail("axis {}: found travel {}..{} mm, expected finite ends, the smaller first", name, axis.travel.min_mm,
         axis.travel.max_mm);
  if (!std::isfinite(axis.overtravel_mm) || axis.overtravel_mm <= 0.0)
    fail("axis {}: found overtravel {} mm, expected a finite number above 0", name, axis.overtravel_mm);
  if (!std::isfinite(axis.index_mm))
    fail("axis {}: found the index at {} mm, expected a finite number", name, axis.index_mm);
  const double steps_per_s = axis.limits.velocity_mm_s / pulse_length_mm(axis);
  if (!(steps_per_s <= most_steps_per_s(config)))
    fail(
        "axis {}: {} mm/s needs {:.0f} steps/s, expected at most {:.0f} with {} high cycles of a {} Hz "
        "clock; lower the "
        "speed or the gear",
        name, axis.limits.velocity_mm_s, steps_per_s, most_steps_per_s(config), config.step_high_cycles,
        config.clock_hz);
}

/// One piece of a course, as Stage::track takes it.
void check_piece(const StageConfig& config, std::size_t axis, const Range& reach, double from_mm,
                 double to_mm, std::uint32_t cycles) {
  if (!std::isfinite(to_mm) || cycles == 0)
    fail("axis {}: found {} mm in {} cycles, expected a finite number and at least 1 cycle", kAxisNames[axis],
         to_mm, cycles);
  if (!(to_mm >= reach.min_mm && to_mm <= reach.max_mm))
    fail(
        "axis {}: found a course to {} mm, expected {:.6g}..{:.6g} mm (where a stop that begins at a limit "
        "switch "
        "ends)",
        kAxisNames[axis], to_mm, reach.min_mm, reach.max_mm);
  constexpr double kRounding = 1e-6;  // of a course at the highest speed, cut into pieces
  const double way_mm = std::abs(to_mm - from_mm);
  const double steps_per_s = way_mm / pulse_length_mm(config.axes[axis]) / cycles * config.clock_hz;
  if (!(steps_per_s <= most_steps_per_s(config) * (1.0 + kRounding)))
    fail(
        "axis {}: {} mm in {} cycles need {:.0f} steps/s, expected at most {:.0f} with {} high cycles of a "
        "{} Hz clock",
        kAxisNames[axis], way_mm, cycles, steps_per_s, most_steps_per_s(config), config.step_high_cycles,
        config.clock_hz);
}

void check_position(const StageConfig& config, const Eigen::Vector3d& position_mm) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Range& travel = config.axes[axis].travel;
    const double value_mm = position_mm[static_cast<Eigen::Index>(axis)];
    if (!(value_mm >= travel.min_mm && value_mm <= travel.max_mm))
      fail("axis {}: found position {} mm, expected {}..{} mm (travel)", kAxisNames[axis], value_mm,
           travel.min_mm, travel.max_mm);
  }
}

}  // namespace

double pulse_length_mm(const AxisConfig& axis) {
  return axis.lead_mm * static_cast<double>(axis.gear_denominator) /
         static_cast<double>(axis.encoder_pulses_per_turn * axis.gear_numerator);
}

std::int64_t mm_to_pulses(const AxisConfig& axis, double position_mm) {
  constexpr double kMost = 0x1p53;  // every whole number up to it is a double of its own
  const double pulses = position_mm *
                        static_cast<double>(axis.encoder_pulses_per_turn * axis.gear_numerator) /
                        (axis.lead_mm * static_cast<double>(axis.gear_denominator));
  if (!(std::abs(pulses) <= kMost))
    fail("pulses: found {} mm at {} mm a pulse, expected a position within 2^53 pulses", position_mm,
         pulse_length_mm(axis));
  return std::llround(pulses);
}

double pulses_to_mm(const AxisConfig& axis, std::int64_t pulses) {
  return static_cast<double>(pulses) * axis.lead_mm * static_cast<double>(axis.gear_denominator) /
         static_cast<double>(axis.encoder_pulses_per_turn * axis.gear_numerator);
}

StageMove plan_stage_move(const StageConfig& config, const Eigen::Vector3d& from_mm,
                          const Eigen::Vector3d& to_mm) {
  const Move move =
      plan_move(from_mm, to_mm, {config.axes[0].limits, config.axes[1].limits, config.axes[2].limits});
  const double length_mm = move.profile.end.position_mm;
  if (!config.quiet || length_mm == 0.0) return {move.direction, move.limits, move.profile};
  return {move.direction, move.limits,
          plan_quiet_move(move.limits, length_mm, config.quiet->band, config.quiet->tolerance_mm)};
}

Stage::Stage(const StageConfig& config, const Eigen::Vector3d& position_mm)
    : config_(config),
      commanded_mm_(position_mm),
      origin_mm_(position_mm),
      direction_(Eigen::Vector3d::Zero()) {
  if (!std::isfinite(config.clock_hz) || config.clock_hz <= 0.0)
    fail("stage clock: found {} Hz, expected a finite number above 0", config.clock_hz);
  if (config.step_high_cycles == 0) fail("step pulse: found 0 cycles, expected at least 1");
  for (std::size_t axis = 0; axis < 3; ++axis) check_axis(config.axes[axis], kAxisNames[axis], config);
  check_position(config, position_mm);
  const AxisLimits limits = {config.axes[0].limits, config.axes[1].limits, config.axes[2].limits};
  path_limits_ =
      plan_move(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), limits).limits;  // refuses bad limits
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const AxisConfig& of = config.axes[axis];
    const double beyond_mm =
        of.overtravel_mm + plan_stop(of.limits, {0.0, of.limits.velocity_mm_s, 0.0, 0.0}).end.position_mm;
    reach_[axis] = {of.travel.min_mm - beyond_mm, of.travel.max_mm + beyond_mm};
    axes_[axis].pulses = mm_to_pulses(config.axes[axis], position_mm[static_cast<Eigen::Index>(axis)]);
    axes_[axis].target_pulses = axes_[axis].pulses;
    set_position_pins(axis);
  }
}

std::uint64_t Stage::cycle_at(double time_s) const {
  return motion_start_cycle_ + static_cast<std::uint64_t>(std::ceil(time_s * config_.clock_hz));
}

void Stage::set_position_pins(std::size_t axis) {
  const AxisConfig& config = config_.axes[axis];
  AxisProgress& progress = axes_[axis];
  progress.pins.home = progress.pulses <= mm_to_pulses(config, config.travel.min_mm);
  // Not by pulses: the nearest one may lie before a switch. What double keeps of a place is less than a
  // nanometre.
  constexpr double kRounding_mm = 1e-6;
  const double at_mm = pulses_to_mm(config, progress.pulses);
  progress.pins.limit_negative = at_mm <= config.travel.min_mm - config.overtravel_mm + kRounding_mm;
  progress.pins.limit_positive = at_mm >= config.travel.max_mm + config.overtravel_mm - kRounding_mm;
  progress.pins.index = is_index(config, progress.pulses);
}

/// The next step falls due where the planned position passes the middle between two pulses.
void Stage::schedule_rise(std::size_t axis) {
  AxisProgress& progress = axes_[axis];
  progress.next_rise.reset();
  if (progress.pulses == progress.target_pulses) return;
  const double half_step = progress.target_pulses > progress.pulses ? 0.5 : -0.5;
  const FixedPulses middle = to_fixed(static_cast<double>(progress.pulses) + half_step);
  const std::uint64_t from_cycle =
      std::max(progress.earliest_rise, progress.train_start_cycle) - progress.train_start_cycle;
  progress.next_rise = progress.train_start_cycle + progress.train.cycle_reaching(middle, from_cycle);
}

void Stage::begin_profile(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction,
                          const JerkProfile& profile, const Eigen::Vector3d& target_mm,
                          std::uint64_t motion_start_cycle) {
  origin_mm_ = origin_mm;
  direction_ = direction;
  profile_ = profile;
  commanded_mm_ = target_mm;
  motion_start_cycle_ = motion_start_cycle;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    AxisProgress& progress = axes_[axis];
    const auto i = static_cast<Eigen::Index>(axis);
    const std::int64_t target = mm_to_pulses(config_.axes[axis], target_mm[i]);
    // Rounding of a stop's end must not ask for a step back.
    progress.target_pulses =
        direction[i] > 0.0 ? std::max(target, progress.pulses) : std::min(target, progress.pulses);
    if (direction[i] == 0.0) progress.target_pulses = progress.pulses;
    const double pulses_per_mm = 1.0 / pulse_length_mm(config_.axes[axis]);
    progress.train =
        PulseTrain(profile, direction[i] * pulses_per_mm, origin_mm[i] * pulses_per_mm, config_.clock_hz);
    progress.train_start_cycle = motion_start_cycle;
    schedule_rise(axis);
  }
  const std::uint64_t pulse_cycles = 2 * std::uint64_t{config_.step_high_cycles};
  end_cycle_ = std::max(cycle_at(profile.duration_s) + pulse_cycles + 2, last_edge_cycle());
}

std::uint64_t Stage::last_edge_cycle() const {
  std::uint64_t last = 0;
  for (const AxisProgress& axis : axes_)
    for (const auto& edge : {axis.next_rise, axis.next_fall, axis.next_turn})
      last = std::max(last, edge.value_or(0) + 1);
  return last;
}

std::uint64_t Stage::move_to(const Eigen::Vector3d& target_mm, std::uint64_t start_cycle) {
  if (held_) fail("move: the stage is held by an emergency stop, expected release() first");
  if (start_cycle < std::max(end_cycle_, now_))
    fail("move: found start cycle {}, expected at least {} (end of the move before)", start_cycle,
         std::max(end_cycle_, now_));
  if (const auto pending = next_event_cycle())
    fail("move: the pin change at cycle {} has not been handed over, expected run_until({}) first", *pending,
         start_cycle);
  check_position(config_, target_mm);
  const StageMove move = plan_stage_move(config_, commanded_mm_, target_mm);
  path_limits_ = move.limits;
  broken_off_.reset();
  const std::uint64_t motion_start_cycle = start_cycle + config_.dir_setup_cycles;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double component = move.direction[static_cast<Eigen::Index>(axis)];
    if (component != 0.0 && (component > 0.0) != axes_[axis].pins.dir) axes_[axis].next_turn = start_cycle;
    axes_[axis].earliest_rise = motion_start_cycle;
  }
  begin_profile(Eigen::Vector3d(commanded_mm_), move.direction, move.profile, target_mm, motion_start_cycle);
  return end_cycle_;
}

void Stage::track(std::size_t axis, double position_mm, std::uint64_t cycle, std::uint32_t cycles) {
  if (axis >= axes_.size()) fail("track: found axis {}, expected 0 to {}", axis, axes_.size() - 1);
  const auto i = static_cast<Eigen::Index>(axis);
  if (held_) fail("track: the stage is held by an emergency stop, expected release() first");
  if (moving(cycle) || cycle < now_)
    fail("track: found cycle {}, expected at least {} (end of the move before)", cycle,
         std::max(end_cycle_, now_));
  check_piece(config_, axis, reach_[axis], commanded_mm_[i], position_mm, cycles);
  AxisProgress& progress = axes_[axis];
  const double way_mm = position_mm - commanded_mm_[i];
  JerkProfile even;
  even.segments = 1;
  even.duration_s = even.durations_s[0] = static_cast<double>(cycles) / config_.clock_hz;
  even.starts[0].velocity_mm_s = std::abs(way_mm) / even.duration_s;
  even.end.position_mm = std::abs(way_mm);
  const double pulses_per_mm = 1.0 / pulse_length_mm(config_.axes[axis]);
  progress.train = PulseTrain(even, std::copysign(pulses_per_mm, way_mm), commanded_mm_[i] * pulses_per_mm,
                              config_.clock_hz);
  progress.train_start_cycle = cycle;
  progress.target_pulses = mm_to_pulses(config_.axes[axis], position_mm);
  const bool up = progress.target_pulses > progress.pulses;
  if (progress.target_pulses != progress.pulses && up != progress.pins.dir) {
    progress.next_turn = cycle;
    progress.earliest_rise = std::max(progress.earliest_rise, cycle + config_.dir_setup_cycles);
  }
  commanded_mm_[i] = position_mm;
  // What planned() says afterwards: at rest there.
  origin_mm_ = commanded_mm_;
  direction_.setZero();
  profile_ = {};
  schedule_rise(axis);
}

MotionState Stage::planned(std::size_t axis, std::uint64_t cycle) const {
  const double time_s = cycle <= motion_start_cycle_
                            ? 0.0
                            : static_cast<double>(cycle - motion_start_cycle_) / config_.clock_hz;
  const auto i = static_cast<Eigen::Index>(axis);
  const MotionState along = profile_.sample(time_s);
  const double part = direction_[i];
  return {origin_mm_[i] + part * along.position_mm, part * along.velocity_mm_s,
          part * along.acceleration_mm_s2, part * along.jerk_mm_s3};
}

std::uint64_t Stage::slow_down(std::uint64_t cycle, const char* what) {
  if (cycle < now_) fail("{}: found cycle {}, expected at least {} (now)", what, cycle, now_);
  if (const auto pending = next_event_cycle(); pending && *pending <= cycle)
    fail("{}: the pin change at cycle {} has not been handed over, expected run_until({}) first", what,
         *pending, cycle);
  if (!moving(cycle)) return cycle;
  const double time_s = cycle <= motion_start_cycle_
                            ? 0.0
                            : static_cast<double>(cycle - motion_start_cycle_) / config_.clock_hz;
  const MotionState state = profile_.sample(time_s);
  const JerkProfile stop = plan_stop(path_limits_, state);
  const Eigen::Vector3d origin_mm = origin_mm_ + state.position_mm * direction_;
  const Eigen::Vector3d target_mm = origin_mm + stop.end.position_mm * direction_;
  for (AxisProgress& axis : axes_) axis.earliest_rise = std::max(axis.earliest_rise, cycle + 1);
  begin_profile(origin_mm, direction_, stop, target_mm, std::max(cycle, motion_start_cycle_));
  return end_cycle_;
}

std::uint64_t Stage::emergency_stop(std::uint64_t cycle) {
  held_ = true;
  broken_off_.reset();
  return slow_down(cycle, "emergency stop");
}

std::uint64_t Stage::feed_hold(std::uint64_t cycle) {
  const Eigen::Vector3d target_mm = commanded_mm_;
  const bool breaks_off = moving(cycle) && !broken_off_ && !held_;
  const std::uint64_t end_cycle =
      broken_off_ || held_ ? std::max(cycle, end_cycle_) : slow_down(cycle, "feed hold");
  if (breaks_off) broken_off_ = target_mm;
  return end_cycle;
}

std::uint64_t Stage::resume(std::uint64_t start_cycle) {
  if (!broken_off_) return start_cycle;
  const Eigen::Vector3d target_mm = *broken_off_;  // a copy: move_to forgets what was broken off
  return move_to(target_mm, start_cycle);
}

std::optional<std::uint64_t> Stage::next_edge(const AxisProgress& axis) {
  std::optional<std::uint64_t> next;
  for (const auto& edge : {axis.next_turn, axis.next_fall, axis.next_rise})
    if (edge && (!next || *edge < *next)) next = edge;
  return next;
}

std::optional<std::uint64_t> Stage::next_event_cycle() const {
  std::optional<std::uint64_t> next;
  for (const AxisProgress& axis : axes_)
    if (const auto edge = next_edge(axis); edge && (!next || *edge < *next)) next = edge;
  return next;
}

void Stage::run_until(std::uint64_t cycle, const std::function<void(const StageEvent&)>& on_event) {
  for (auto next = next_event_cycle(); next && *next <= cycle; next = next_event_cycle()) {
    now_ = *next;
    for (std::size_t i = 0; i < 3; ++i) {
      AxisProgress& axis = axes_[i];
      if (next_edge(axis) != next) continue;
      if (axis.next_turn == next) {
        axis.pins.dir = !axis.pins.dir;
        axis.next_turn.reset();
      }
      if (axis.next_fall == next) {
        axis.pins.step = false;
        axis.next_fall.reset();
      }
      if (axis.next_rise == next) {
        axis.pins.step = true;
        axis.pulses += axis.target_pulses > axis.pulses ? 1 : -1;
        axis.next_fall = *next + config_.step_high_cycles;
        axis.earliest_rise = *next + 2 * std::uint64_t{config_.step_high_cycles};
        set_position_pins(i);
        schedule_rise(i);
      }
      on_event({*next, i, axis.pins});
    }
  }
  now_ = std::max(now_, cycle);
}

std::array<std::int64_t, 3> Stage::position_pulses() const {
  return {axes_[0].pulses, axes_[1].pulses, axes_[2].pulses};
}

Eigen::Vector3d Stage::position_mm() const {
  return {pulses_to_mm(config_.axes[0], axes_[0].pulses), pulses_to_mm(config_.axes[1], axes_[1].pulses),
          pulses_to_mm(config_.axes[2], axes_[2].pulses)};
}

}  // namespace meltstage::motion
