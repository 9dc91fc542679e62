// SPDX-License-Identifier: Apache-2.0
#include "tb/printer/stage_replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "motion/profile/profile.hpp"
#include "motion/stage/stage.hpp"
#include "tb/devices/servo_stage.hpp"

namespace meltstage::tb {
namespace {

constexpr std::array kPinNames = {"step", "dir", "home", "limit_neg", "limit_pos", "index"};

// A stiff, well damped position loop, so that at the droplet an axis stands where its pulses say.
constexpr double kServo_hz = 60.0;
constexpr double kServoDamping = 0.7;

std::uint32_t pin_number(const recording::Header& header, const std::string& name) {
  const auto number = find_pin(header, name);
  if (!number)
    throw std::invalid_argument(
        fmt::format("stage replay: found no pin {}, expected the pins of a print job", name));
  return *number;
}

bool same(const motion::StageEvent& a, const motion::StageEvent& b) {
  return a.cycle == b.cycle && a.axis == b.axis && a.pins == b.pins;
}

// The recorded pins as stage events, up to each droplet.
class RecordedStage {
 public:
  explicit RecordedStage(const recording::Stream& stream)
      : cursor_(stream), trigger_(pin_number(stream.header(), "drop_trigger")) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t pin = 0; pin < kPinNames.size(); ++pin)
        numbers_[axis][pin] =
            pin_number(stream.header(), fmt::format("{}_{}", motion::kAxisNames[axis], kPinNames[pin]));
      last_[axis] = pins_now(axis);
    }
  }

  struct UntilDroplet {
    std::vector<motion::StageEvent> events;
    std::uint64_t droplet_cycle = 0;
    bool dropped = false;  // false: the recording ended first
  };

  UntilDroplet next() {
    UntilDroplet found;
    while (!found.dropped && cursor_.next_event()) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const motion::AxisPins now = pins_now(axis);
        if (now == last_[axis]) continue;
        last_[axis] = now;
        found.events.push_back({cursor_.cycle(), axis, now});
      }
      const bool trigger = cursor_.value(trigger_) != 0;
      found.dropped = trigger && !triggered_;
      triggered_ = trigger;
    }
    found.droplet_cycle = cursor_.cycle();
    return found;
  }

 private:
  motion::AxisPins pins_now(std::size_t axis) const {
    const auto level = [&](std::size_t pin) { return cursor_.value(numbers_[axis][pin]) != 0; };
    return {level(0), level(1), level(2), level(3), level(4), level(5)};
  }

  recording::Cursor cursor_;
  std::uint32_t trigger_;
  std::array<std::array<std::uint32_t, kPinNames.size()>, 3> numbers_{};
  std::array<motion::AxisPins, 3> last_{};
  bool triggered_ = false;
};

ServoAxis servo_axis(const motion::AxisConfig& axis, double start_mm, double clock_hz) {
  const double pulse_mm = motion::pulse_length_mm(axis);
  return ServoAxis({.mm_per_pulse = pulse_mm,
                    .travel_mm = axis.travel.max_mm - axis.travel.min_mm,
                    .natural_frequency_hz = kServo_hz,
                    .damping_ratio = kServoDamping,
                    .encoder_mm_per_count = pulse_mm,
                    .index_pitch_mm = axis.lead_mm,
                    .index_width_mm = pulse_mm,
                    .start_mm = start_mm},
                   clock_hz);
}

}  // namespace

StageReplay replay_stage(const PrintJob& job, const recording::Stream& stream) {
  if (job.fly_by || !job.drive.homed || job.power_on_mm != job.start_mm)
    throw std::invalid_argument(
        "stage replay: found a job that homes, goes to its start or prints on the fly, expected one that "
        "stops at each bump and begins at its first position");
  RecordedStage recorded(stream);
  motion::Stage generator(job.stage, job.start_mm);
  const double clock_hz = job.stage.clock_hz;
  std::vector<ServoAxis> servos;
  for (std::size_t axis = 0; axis < 3; ++axis)
    servos.push_back(
        servo_axis(job.stage.axes[axis], job.start_mm[static_cast<Eigen::Index>(axis)], clock_hz));

  StageReplay replay;
  Sent from{job.start_mm, job.start_mm};
  std::array<std::int64_t, 3> pulses = generator.position_pulses();
  std::array<bool, 3> stepping{};
  std::uint64_t free_cycle = 0;
  for (const motion::Point& bump : job.bumps) {
    const RecordedStage::UntilDroplet part = recorded.next();
    if (!part.dropped) break;
    ++replay.moves;
    const Sent to = send(job, from, {bump.x_mm, bump.y_mm, job.start_mm.z()});
    const Eigen::Vector3d& to_mm = to.commanded_mm;

    // The pins don't say when a move was asked for, but when its first edge came, and edges come at the same
    // distance from the asking wherever that is.
    std::vector<motion::StageEvent> generated;
    std::uint64_t start_cycle = free_cycle;
    if (!part.events.empty()) {
      motion::Stage probe = generator;
      probe.move_to(to_mm, free_cycle);
      const std::uint64_t first = probe.next_event_cycle().value_or(free_cycle);
      const std::uint64_t recorded_first = part.events.front().cycle;
      start_cycle = std::max(free_cycle, recorded_first - std::min(recorded_first, first - free_cycle));
    }
    free_cycle = generator.move_to(to_mm, start_cycle);
    generator.run_until(free_cycle, [&](const motion::StageEvent& event) { generated.push_back(event); });
    free_cycle = std::max(free_cycle, part.droplet_cycle);
    const std::size_t common = std::min(generated.size(), part.events.size());
    replay.generator_differences += std::max(generated.size(), part.events.size()) - common;
    for (std::size_t i = 0; i < common; ++i) {
      if (same(generated[i], part.events[i])) continue;
      ++replay.generator_differences;
      if (replay.first_difference.empty())
        replay.first_difference = fmt::format("recorded cycle {} axis {}, generated cycle {} axis {}",
                                              part.events[i].cycle, motion::kAxisNames[part.events[i].axis],
                                              generated[i].cycle, motion::kAxisNames[generated[i].axis]);
    }

    const motion::StageMove plan = motion::plan_stage_move(job.stage, from.commanded_mm, to_mm);
    const std::uint64_t motion_cycle = start_cycle + job.stage.dir_setup_cycles;
    for (const motion::StageEvent& event : part.events) {
      servos[event.axis].step(event.cycle, event.pins.step, event.pins.dir);
      const bool rises = event.pins.step && !stepping[event.axis];
      stepping[event.axis] = event.pins.step;
      if (!rises) continue;
      pulses[event.axis] += event.pins.dir ? 1 : -1;
      ++replay.steps;
      const double time_s = (static_cast<double>(event.cycle) - static_cast<double>(motion_cycle)) / clock_hz;
      const auto axis = static_cast<Eigen::Index>(event.axis);
      const double planned =
          (from.commanded_mm[axis] + plan.direction[axis] * plan.profile.sample(time_s).position_mm) /
          motion::pulse_length_mm(job.stage.axes[event.axis]);
      replay.plan_pulses =
          std::max(replay.plan_pulses, std::abs(static_cast<double>(pulses[event.axis]) - planned));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double error_mm =
          servos[axis].position_mm(part.droplet_cycle) - to_mm[static_cast<Eigen::Index>(axis)];
      replay.droplet_um = std::max(replay.droplet_um, std::abs(error_mm) * 1e3);
    }
    from = to;
  }
  return replay;
}

}  // namespace meltstage::tb
