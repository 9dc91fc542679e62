// SPDX-License-Identifier: Apache-2.0
// The stage with its drives: pulses into three servo axes, and an axis control each that reads encoder,
// switches and the emergency loop once a servo cycle, homes, watches and stops.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "motion/stage/axis.hpp"
#include "motion/stage/jetting.hpp"
#include "motion/stage/stage.hpp"
#include "motion/stage/stage_model.hpp"

namespace meltstage::tb {

struct DriveConfig {
  std::array<motion::AxisModelConfig, 3> axes;
  bool homed = true;  // when power comes on; otherwise home() first
};

// Where the encoder's counts become triggers: the comparator looks once in this time.
inline constexpr double kCompare_s = 1e-6;
// Longest that an axis takes to come to where its plan ended.
inline constexpr double kFollows_s = 0.1;

// Positions are in the machine's frame, cycles those of the stage's clock.
class DrivenStage {
 public:
  // `power_on_mm`: where the head stands when power comes on; the control knows it only if the stage is
  // homed. `servo_clocks`: of a servo cycle. Throws motion::MotionError if the configuration can't work.
  DrivenStage(const motion::StageConfig& stage, const DriveConfig& drive, const Eigen::Vector3d& power_on_mm,
              std::uint32_t servo_clocks);

  // One servo cycle; every servo_clocks, behind run_until() of that cycle.
  void tick(std::uint64_t cycle, bool emergency_loop);

  // Orders, behind tick() of the same cycle. They throw motion::MotionError if a phase or place forbids them.
  void home();
  void move_to(const Eigen::Vector3d& position_mm, std::uint64_t cycle);
  void print_on_the_fly(const motion::FlyByPlan& plan, const motion::FlyByConfig& config,
                        std::uint64_t cycle);
  void stop(std::uint64_t cycle);  // as fast as the limits allow; no order is taken any more

  bool busy() const { return mode_ != Mode::rest; }
  bool homed() const;
  // What an axis control stopped for, one sentence.
  const std::optional<std::string>& fault() const { return fault_; }
  // By the encoders.
  Eigen::Vector3d read_back_mm() const;

  // Pins, as motion::Stage has them.
  void run_until(std::uint64_t cycle, const std::function<void(const motion::StageEvent&)>& on_event) {
    stage_.run_until(cycle, on_event);
  }
  std::optional<std::uint64_t> next_event_cycle() const { return stage_.next_event_cycle(); }
  const motion::AxisPins& pins(std::size_t axis) const { return stage_.pins(axis); }

  // The comparator's next trigger, if it comes before the next servo cycle, and its bump; fired() arms the
  // one behind it.
  struct Trigger {
    std::uint64_t cycle = 0;
    std::size_t bump = 0;
  };
  const std::optional<Trigger>& next_trigger() const { return trigger_; }
  void fired();

  // A bump whose trigger never came: the axis stayed so far from the count at which the comparator fires.
  struct Missed {
    std::size_t bump = 0;
    double short_mm = 0.0;
  };
  const std::vector<Missed>& missed() const { return missed_; }

  // Where a droplet lands that leaves the head some time after `cycle` and then flies on with its speed.
  // Cycles of the present servo cycle only.
  Eigen::Vector2d landing_mm(std::uint64_t cycle, double latency_s, double flight_s) const;

  // The slide of an axis is stuck from now on.
  void jam(std::size_t axis) { axes_[axis].jammed = true; }

 private:
  enum class Mode { rest, homing, line, fly_by, fly_by_stop };

  struct Axis {
    motion::AxisControl control;
    motion::AxisModel model;
    double unknown_mm = 0.0;  // place of the encoder's zero
    double index_mm = 0.0, lead_mm = 0.0;
    double motor_before_mm = 0.0, head_before_mm = 0.0;  // at the last servo cycle
    double turns_before = 0.0;
    double tracked_mm = 0.0;
    bool jammed = false;
    motion::JerkProfile stop;
    double stop_from_mm = 0.0;
  };

  Axis make_axis(std::size_t axis, const DriveConfig& drive, double power_on_mm) const;
  motion::AxisInputs inputs_of(std::size_t axis, bool emergency_loop);
  motion::MotionState command_of(std::size_t axis, std::uint64_t cycle) const;
  void track(std::size_t axis, double stage_mm, std::uint64_t cycle);
  void require_ready() const;
  void couple();
  void look_for_faults(std::uint64_t cycle);
  void look_for_end(std::uint64_t cycle);
  void compare(std::uint64_t cycle);
  void arm(std::size_t row, std::size_t shot);
  void give_up_row();
  double left_to_edge_mm(const motion::Trigger& armed) const;
  double seconds(std::uint64_t cycles) const {
    return static_cast<double>(cycles) / stage_.config().clock_hz;
  }
  double elapsed_s(std::uint64_t cycle) const {  // of the plan
    return cycle > plan_cycle_ ? seconds(cycle - plan_cycle_) : 0.0;
  }

  motion::Stage stage_;
  std::uint32_t servo_clocks_;
  std::array<Axis, 3> axes_;
  Mode mode_ = Mode::rest;
  bool stopped_ = false;
  std::optional<std::string> fault_;
  std::uint64_t awake_until_ = 0;  // the models rest behind it
  std::uint64_t ticked_ = 0;       // cycle of the last tick

  motion::FlyByPlan plan_;
  double encoder_mm_ = 0.0;
  std::uint64_t plan_cycle_ = 0;
  std::size_t row_ = 0, shot_ = 0;  // armed
  double nearest_mm_ = 0.0;         // the axis came to the armed trigger's edge, since the row began
  bool before_edge_ = false;        // the axis was ahead of the row's first trigger, since the row began
  std::optional<Trigger> trigger_;
  std::vector<Missed> missed_;
};

}  // namespace meltstage::tb
