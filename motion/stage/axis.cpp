// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "motion/profile/check_positive.hpp"

namespace meltstage::motion {
namespace {

constexpr double kSoftLimit_mm = 0.01;  // a coordinated command may be off by homing's scatter
constexpr double kIndexTurns = 1.2;     // a whole turn has an index; the rest is for the stop

void check(const AxisControlConfig& config) {
  const HomingConfig& homing = config.homing;
  check_positive("axis control: cycle", config.cycle_s, "s");
  check_positive("axis control: homing speed", homing.fast_mm_s, "mm/s");
  check_positive("axis control: slow homing speed", homing.slow_mm_s, "mm/s");
  check_positive("axis control: homing way", homing.search_mm, "mm");
  check_positive("axis control: way off the switch", homing.clear_mm, "mm");
  check_positive("axis control: lead", homing.lead_mm, "mm");
  check_positive("axis control: following error", config.following_error_mm, "mm");
  if (!std::isfinite(config.following_error_s) || config.following_error_s < 0.0)
    throw MotionError(
        fmt::format("axis control: found following error [s] {}, expected a finite number from 0",
                    config.following_error_s));
  if (!(homing.index_margin_share >= 0.0 && homing.index_margin_share < 0.5))
    throw MotionError(fmt::format("axis control: found index margin {} of a turn, expected 0..0.5",
                                  homing.index_margin_share));
  if (!std::isfinite(homing.index_position_mm) || !std::isfinite(config.travel.min_mm) ||
      !std::isfinite(config.travel.max_mm) || !(config.travel.min_mm < config.travel.max_mm))
    throw MotionError(
        fmt::format("axis control: found travel {}..{} mm and index at {} mm, expected finite numbers, "
                    "the smaller end first",
                    config.travel.min_mm, config.travel.max_mm, homing.index_position_mm));
  plan_scurve(config.limits, 1.0);  // these two refuse bad limits
  plan_scurve(config.stop_limits, 1.0);
}

}  // namespace

std::string_view name_of(AxisPhase phase) {
  switch (phase) {
    case AxisPhase::unhomed:
      return "unhomed";
    case AxisPhase::homing_search:
      return "homing: search";
    case AxisPhase::homing_clear:
      return "homing: clear";
    case AxisPhase::homing_latch:
      return "homing: latch";
    case AxisPhase::homing_index:
      return "homing: index";
    case AxisPhase::ready:
      return "ready";
    case AxisPhase::moving:
      return "moving";
    case AxisPhase::jogging:
      return "jogging";
    case AxisPhase::coordinated:
      return "coordinated";
    case AxisPhase::stopping:
      return "stopping";
    case AxisPhase::fault:
      return "fault";
  }
  return "?";
}

std::string_view name_of(AxisFault fault) {
  switch (fault) {
    case AxisFault::none:
      return "none";
    case AxisFault::emergency_stop:
      return "emergency stop";
    case AxisFault::limit_negative:
      return "negative limit switch";
    case AxisFault::limit_positive:
      return "positive limit switch";
    case AxisFault::soft_limit:
      return "soft limit";
    case AxisFault::following_error:
      return "following error";
    case AxisFault::switch_not_found:
      return "home switch not found";
    case AxisFault::switch_stuck:
      return "home switch stuck";
    case AxisFault::index_not_found:
      return "index not found";
    case AxisFault::index_near_switch:
      return "index too near to the home switch";
  }
  return "?";
}

AxisControl::AxisControl(const AxisControlConfig& config, double encoder_mm)
    : config_(config), offset_mm_(encoder_mm) {
  check(config);
  if (!std::isfinite(encoder_mm))
    throw MotionError(
        fmt::format("axis control: found encoder at {} mm, expected a finite number", encoder_mm));
  inputs_.encoder_mm = encoder_mm;
  command_.position_mm = encoder_mm;
  origin_mm_ = encoder_mm;
}

bool AxisControl::homing() const {
  return phase_ == AxisPhase::homing_search || phase_ == AxisPhase::homing_clear ||
         phase_ == AxisPhase::homing_latch || phase_ == AxisPhase::homing_index;
}

void AxisControl::go_to(double encoder_mm, double speed_mm_s) {
  ScurveLimits limits = config_.limits;
  limits.velocity_mm_s = std::min(limits.velocity_mm_s, speed_mm_s);
  MotionState from = command_;
  from.position_mm = 0.0;
  profile_ = plan_retarget(limits, from, encoder_mm - command_.position_mm);
  origin_mm_ = command_.position_mm;
  cycles_ = 0;
}

void AxisControl::slow_down(const ScurveLimits& limits) {
  MotionState from = command_;
  from.position_mm = 0.0;
  profile_ = plan_stop(limits, from);
  origin_mm_ = command_.position_mm;
  cycles_ = 0;
}

void AxisControl::fail(AxisFault fault) {
  fault_ = fault;
  if (homing()) homed_ = false;
  phase_ = AxisPhase::stopping;
  if (!coupled_) slow_down(config_.stop_limits);
}

/// Faults of this cycle; one at a time, the first stays. Only a following error follows another: a stop is no
/// stop if the axis doesn't go with it.
void AxisControl::watch() {
  if (phase_ == AxisPhase::fault) return;
  const double allowed_mm =
      config_.following_error_mm + config_.following_error_s * std::abs(command_.velocity_mm_s);
  // Not "above": what isn't a number is no place where the axis could be.
  if (!(std::abs(command_.position_mm - inputs_.encoder_mm) <= allowed_mm)) {
    fault_ = AxisFault::following_error;
    phase_ = AxisPhase::fault;
    homed_ = enabled_ = false;
  } else if (phase_ == AxisPhase::stopping) {
    return;
  } else if (inputs_.emergency_stop) {
    fail(AxisFault::emergency_stop);
  } else if (inputs_.limit_negative && command_.velocity_mm_s < 0.0) {
    fail(homing() ? AxisFault::switch_not_found : AxisFault::limit_negative);
  } else if (inputs_.limit_positive && command_.velocity_mm_s > 0.0) {
    fail(phase_ == AxisPhase::homing_clear ? AxisFault::switch_stuck : AxisFault::limit_positive);
  } else if (phase_ == AxisPhase::coordinated) {
    const double at_mm = command_.position_mm - offset_mm_;
    if (!(at_mm >= config_.travel.min_mm - kSoftLimit_mm && at_mm <= config_.travel.max_mm + kSoftLimit_mm))
      fail(AxisFault::soft_limit);
  }
}

/// Each phase looks for its mark, slows down when it is found, and the next begins at rest.
void AxisControl::advance_homing() {
  const HomingConfig& homing = config_.homing;
  const bool ended = profile_over();
  switch (phase_) {
    case AxisPhase::homing_search:
      if (!found_ && inputs_.home) {
        found_ = true;
        slow_down(config_.limits);
      } else if (ended && found_) {
        found_ = false;
        phase_ = AxisPhase::homing_clear;
        go_to(command_.position_mm + homing.search_mm, homing.fast_mm_s);
      } else if (ended) {
        fail(AxisFault::switch_not_found);
      }
      break;
    case AxisPhase::homing_clear:
      if (!found_ && !inputs_.home) {
        found_ = true;
        go_to(inputs_.encoder_mm + homing.clear_mm, homing.fast_mm_s);
      } else if (ended && found_) {
        found_ = false;
        phase_ = AxisPhase::homing_latch;
        go_to(command_.position_mm - 2.0 * homing.clear_mm, homing.slow_mm_s);
      } else if (ended) {
        fail(AxisFault::switch_stuck);
      }
      break;
    case AxisPhase::homing_latch:
      if (!found_ && inputs_.home) {
        found_ = true;
        report_.switch_mm = inputs_.encoder_mm;
        slow_down(config_.limits);
      } else if (ended && found_) {
        found_ = false;
        phase_ = AxisPhase::homing_index;
        go_to(report_.switch_mm + kIndexTurns * homing.lead_mm, homing.slow_mm_s);
      } else if (ended) {
        fail(AxisFault::switch_not_found);
      }
      break;
    case AxisPhase::homing_index:
      if (!found_ && inputs_.index_mm && *inputs_.index_mm >= report_.switch_mm) {
        found_ = true;
        report_.index_mm = *inputs_.index_mm;
        report_.index_turns = (report_.index_mm - report_.switch_mm) / homing.lead_mm;
        slow_down(config_.limits);
      } else if (ended && found_) {
        const double margin = homing.index_margin_share;
        if (report_.index_turns < margin || report_.index_turns > 1.0 - margin) {
          fail(AxisFault::index_near_switch);
        } else {
          offset_mm_ = report_.index_mm - homing.index_position_mm;
          homed_ = true;
          phase_ = AxisPhase::ready;
        }
      } else if (ended) {
        fail(AxisFault::index_not_found);
      }
      break;
    default:
      break;
  }
}

/// The drive is off: the command follows, so that nothing jumps when it comes on again.
void AxisControl::go_with_the_axis() {
  const double last_mm = std::isfinite(command_.position_mm) ? command_.position_mm : origin_mm_;
  command_ = {std::isfinite(inputs_.encoder_mm) ? inputs_.encoder_mm : last_mm, 0.0, 0.0, 0.0};
}

AxisOutputs AxisControl::step(const AxisInputs& inputs) {
  if (coupled_)
    throw MotionError("step: found the axis coupled to a path, expected follow(), or decouple() before");
  inputs_ = inputs;
  if (!enabled_) {
    go_with_the_axis();
    return {command_, false};
  }
  if (!profile_over()) ++cycles_;
  command_ = profile_.sample(time_s());
  command_.position_mm += origin_mm_;
  watch();
  if (!enabled_) return step(inputs);
  if (homing()) {
    advance_homing();
  } else if (profile_over()) {
    if (phase_ == AxisPhase::stopping) phase_ = AxisPhase::fault;
    if (phase_ == AxisPhase::moving || phase_ == AxisPhase::jogging)
      phase_ = homed_ ? AxisPhase::ready : AxisPhase::unhomed;
  }
  return {command_, enabled_};
}

AxisOutputs AxisControl::follow(const AxisInputs& inputs, const MotionState& command) {
  if (!coupled_) throw MotionError("follow: found the axis not coupled to a path, expected couple() before");
  inputs_ = inputs;
  if (enabled_) {
    command_ = command;
    watch();
  }
  if (!enabled_) go_with_the_axis();
  const bool stands = command_.velocity_mm_s == 0.0 && command_.acceleration_mm_s2 == 0.0;
  if (phase_ == AxisPhase::stopping && stands) phase_ = AxisPhase::fault;
  return {command_, enabled_};
}

void AxisControl::hold_at(double encoder_mm) {
  command_ = {encoder_mm, 0.0, 0.0, 0.0};
  origin_mm_ = encoder_mm;
  profile_ = {};
  cycles_ = 0;
}

void AxisControl::couple() {
  if (phase_ != AxisPhase::ready)
    throw MotionError(
        fmt::format("couple: found the axis in phase \"{}\", expected it homed, at rest and without a fault",
                    name_of(phase_)));
  coupled_ = true;
  phase_ = AxisPhase::coordinated;
}

void AxisControl::decouple() {
  if (!coupled_ || command_.velocity_mm_s != 0.0 || phase_ == AxisPhase::stopping)
    throw MotionError(
        fmt::format("decouple: found the axis in phase \"{}\" at {} mm/s, expected it coupled "
                    "and at rest",
                    name_of(phase_), command_.velocity_mm_s));
  coupled_ = false;
  if (phase_ == AxisPhase::coordinated) phase_ = AxisPhase::ready;
  hold_at(command_.position_mm);
}

void AxisControl::set_homed(double position_mm) {
  if (phase_ != AxisPhase::ready && phase_ != AxisPhase::unhomed)
    throw MotionError(fmt::format(
        "position: found the axis in phase \"{}\", expected it at rest without a fault", name_of(phase_)));
  if (!std::isfinite(position_mm))
    throw MotionError(fmt::format("position: found {} mm, expected a finite number", position_mm));
  offset_mm_ = inputs_.encoder_mm - position_mm;
  homed_ = true;
  phase_ = AxisPhase::ready;
}

void AxisControl::home() {
  if (phase_ != AxisPhase::ready && phase_ != AxisPhase::unhomed)
    throw MotionError(fmt::format("home: found the axis in phase \"{}\", expected it at rest without a fault",
                                  name_of(phase_)));
  homed_ = found_ = false;
  report_ = {};
  phase_ = inputs_.home ? AxisPhase::homing_clear : AxisPhase::homing_search;
  const double way_mm = inputs_.home ? config_.homing.search_mm : -config_.homing.search_mm;
  go_to(command_.position_mm + way_mm, config_.homing.fast_mm_s);
}

void AxisControl::move_to(double position_mm) {
  if (phase_ != AxisPhase::ready && phase_ != AxisPhase::moving && phase_ != AxisPhase::jogging)
    throw MotionError(fmt::format(
        "move: found the axis in phase \"{}\", expected it homed and without a fault", name_of(phase_)));
  if (!homed_) throw MotionError("move: found the axis not homed, expected home() first");
  if (!(position_mm >= config_.travel.min_mm && position_mm <= config_.travel.max_mm))
    throw MotionError(fmt::format("move: found {} mm, expected {}..{} mm (travel)", position_mm,
                                  config_.travel.min_mm, config_.travel.max_mm));
  phase_ = AxisPhase::moving;
  go_to(position_mm + offset_mm_, config_.limits.velocity_mm_s);
}

void AxisControl::jog(double velocity_mm_s) {
  if (phase_ != AxisPhase::ready && phase_ != AxisPhase::unhomed && phase_ != AxisPhase::jogging)
    throw MotionError(fmt::format("jog: found the axis in phase \"{}\", expected it at rest without a fault",
                                  name_of(phase_)));
  if (!std::isfinite(velocity_mm_s) || velocity_mm_s == 0.0)
    throw MotionError(fmt::format("jog: found {} mm/s, expected a finite number but 0", velocity_mm_s));
  const bool up = velocity_mm_s > 0.0;
  if (up ? inputs_.limit_positive : inputs_.limit_negative)
    throw MotionError(fmt::format("jog: found the {} active, expected a jog away from it",
                                  name_of(up ? AxisFault::limit_positive : AxisFault::limit_negative)));
  double target_mm = command_.position_mm + (up ? config_.homing.search_mm : -config_.homing.search_mm);
  if (homed_) target_mm = offset_mm_ + (up ? config_.travel.max_mm : config_.travel.min_mm);
  if (up ? target_mm < command_.position_mm : target_mm > command_.position_mm)
    throw MotionError(fmt::format("jog: found the axis at {} mm, expected a jog back into {}..{} mm (travel)",
                                  position_mm(), config_.travel.min_mm, config_.travel.max_mm));
  phase_ = AxisPhase::jogging;
  go_to(target_mm, std::abs(velocity_mm_s));
}

void AxisControl::stop() {
  // Its own stop would leave the line and the watch over the travel; whoever plans the path knows both.
  if (coupled_)
    throw MotionError(
        "stop: found the axis coupled to a path, expected the path to bring it to rest, or decouple() "
        "before");
  if (phase_ == AxisPhase::stopping || at_rest()) return;
  phase_ = AxisPhase::jogging;  // comes to rest as a jog does; homing is given up
  slow_down(config_.limits);
}

void AxisControl::reset() {
  if (phase_ != AxisPhase::fault)
    throw MotionError(
        fmt::format("reset: found the axis in phase \"{}\", expected a fault, at rest", name_of(phase_)));
  if (inputs_.emergency_stop)
    throw MotionError("reset: found the emergency stop still pressed, expected it released");
  if (!std::isfinite(inputs_.encoder_mm))
    throw MotionError(
        fmt::format("reset: found the encoder at {} mm, expected a finite number", inputs_.encoder_mm));
  fault_ = AxisFault::none;
  enabled_ = true;
  coupled_ = false;
  hold_at(inputs_.encoder_mm);
  phase_ = homed_ ? AxisPhase::ready : AxisPhase::unhomed;
}

}  // namespace meltstage::motion
