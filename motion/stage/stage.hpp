// SPDX-License-Identifier: Apache-2.0
// The three-axis stage at its pins: step and direction out, home, limit and index back, in cycles of a given
// clock.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include "motion/bumps/coordinates.hpp"
#include "motion/profile/profile.hpp"
#include "motion/profile/pulse_train.hpp"
#include "motion/profile/retarget.hpp"
#include "motion/profile/vibration.hpp"

namespace meltstage::motion {

inline constexpr std::array<std::string_view, 3> kAxisNames = {"x", "y", "z"};

/// One axis: a servo motor on a screw.
struct AxisConfig {
  double lead_mm = 5.0;  ///< way of the nut in one turn of the screw
  std::int64_t encoder_pulses_per_turn = 100'000;
  std::int64_t gear_numerator = 1;  ///< electronic gear: command pulses per encoder pulse
  std::int64_t gear_denominator = 10;
  Range travel;
  double overtravel_mm = 1.0;  ///< the limit switches stand this far outside the travel
  double index_mm = 0.0;       ///< where an index pulse is; the others lie whole turns from it
  ScurveLimits limits;
};

/// Moves that leave no more than the tolerance of vibration in a mode of the machine
/// (motion/profile/shaping.hpp).
struct QuietMoves {
  ModeBand band;
  double tolerance_mm = 0.001;
};

/// Stage of the bump-printing paper: leads 10, 5, 5 mm, electronic gear 1/10, travel 200 mm each. The paper
/// doesn't print the encoder's resolution: 100 000 pulses a turn give command pulses of 1.0, 0.5 and 0.5 um,
/// below the screws' repeatability of 3 um.
struct StageConfig {
  std::array<AxisConfig, 3> axes = {AxisConfig{.lead_mm = 10.0, .travel = {}, .limits = {}}, AxisConfig{},
                                    AxisConfig{}};
  double clock_hz = 10e6;
  std::uint32_t step_high_cycles = 4;  ///< length of a step pulse, and the least pause behind it
  std::uint32_t dir_setup_cycles = 8;  ///< from a change of direction to the first step
  std::optional<QuietMoves> quiet;     ///< otherwise moves are as fast as the limits allow
};

/// A straight move as the stage makes it.
struct StageMove {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit vector, zero for a move of no length
  ScurveLimits limits;                                  ///< along the path
  JerkProfile profile;                                  ///< of the way along the path
};

/// @throws MotionError as plan_move and plan_quiet_move.
StageMove plan_stage_move(const StageConfig& config, const Eigen::Vector3d& from_mm,
                          const Eigen::Vector3d& to_mm);

/// Length of a command pulse: lead / (encoder pulses per turn * gear) (bump-printing paper, section 2).
double pulse_length_mm(const AxisConfig& axis);

/// The command pulse nearest to a position; halves go away from zero.
/// @throws MotionError if the position is no number or beyond 2^53 pulses.
std::int64_t mm_to_pulses(const AxisConfig& axis, double position_mm);
double pulses_to_mm(const AxisConfig& axis, std::int64_t pulses);

/// Pins of one axis.
struct AxisPins {
  bool step = false;
  bool dir = false;             ///< high: towards larger positions
  bool home = false;            ///< at or below the travel's lower end
  bool limit_negative = false;  ///< at or beyond the lower limit switch
  bool limit_positive = false;  ///< at or beyond the upper limit switch
  bool index = false;           ///< once a turn, for one encoder position that is a whole turn from index_mm

  bool operator==(const AxisPins&) const = default;
};

/// The pins of an axis that changed, at a clock cycle.
struct StageEvent {
  std::uint64_t cycle = 0;
  std::size_t axis = 0;
  AxisPins pins;
};

/// The stage as a chip's bench sees it: moves in, pin changes out, an ideal servo that follows every step.
///
/// Steps come from one PulseTrain an axis, in fixed point and from the absolute position, so nothing
/// accumulates: after a move each axis stands at mm_to_pulses(target). The cycle of a step is the first clock
/// edge at which the planned position is nearer to the next pulse than to the present one.
class Stage {
 public:
  /// @throws MotionError if the configuration can't work (no lead, no clock, a limit not above 0, a position
  /// outside of
  ///   the travel, a speed that needs more steps per second than clock and pulse length allow).
  explicit Stage(const StageConfig& config, const Eigen::Vector3d& position_mm = Eigen::Vector3d::Zero());

  /// Starts a straight move at `start_cycle`; motion begins dir_setup_cycles later.
  /// @return the first cycle at which the move is over and the pins are at rest.
  /// @throws MotionError if the target is out of travel, a move is still running at that cycle, time would
  /// run backwards,
  ///   or the stage is held by an emergency stop.
  std::uint64_t move_to(const Eigen::Vector3d& target_mm, std::uint64_t start_cycle);

  /// Feed hold: slows down along the line within the limits, as emergency_stop does, but remembers the
  /// target. Does nothing if the stage is at rest.
  /// @return the first cycle at which the stage stands still.
  /// @throws MotionError if time would run backwards, or a pin change up to `cycle` has not been handed over.
  std::uint64_t feed_hold(std::uint64_t cycle);

  /// Goes on to the target of the move that a feed hold broke off; the same rules as for move_to.
  /// @return the first cycle at which the move is over; `start_cycle` if no move was broken off.
  /// @throws MotionError as move_to.
  std::uint64_t resume(std::uint64_t start_cycle);

  /// Slows down along the line as fast as the limits allow, from the planned state at `cycle`, and keeps the
  /// position. Moves are refused until release(). Does nothing but hold if the stage is at rest.
  /// @return the first cycle at which the stage stands still.
  /// @throws MotionError as feed_hold. The stage is held all the same, but a move that runs goes on: call
  /// run_until(cycle), then emergency_stop(cycle) again.
  std::uint64_t emergency_stop(std::uint64_t cycle);
  void release() { held_ = false; }

  /// One axis follows a course that is handed over piece by piece, as homing and printing on the fly need it:
  /// from `cycle` on it goes evenly to `position_mm`, where it is `cycles` later. The pieces of a course are
  /// handed over without a gap.
  /// @throws MotionError if there is no such axis, a straight move is still running, the stage is held, the
  /// position lies farther behind a limit switch than a stop from full speed takes, or the steps would have
  /// to come faster than the clock allows.
  void track(std::size_t axis, double position_mm, std::uint64_t cycle, std::uint32_t cycles);

  /// What is planned for an axis at a cycle of the present straight move, before and after it included.
  MotionState planned(std::size_t axis, std::uint64_t cycle) const;

  /// Hands over every pin change up to and including `cycle`, in order of cycle, then axis.
  void run_until(std::uint64_t cycle, const std::function<void(const StageEvent&)>& on_event);

  /// Cycle of the next pin change, if there is one: a bench may skip the time before it.
  std::optional<std::uint64_t> next_event_cycle() const;

  bool moving(std::uint64_t cycle) const { return cycle < end_cycle_; }
  bool held() const { return held_; }
  const StageConfig& config() const { return config_; }
  const AxisPins& pins(std::size_t axis) const { return axes_[axis].pins; }

  /// Read-back of the servo after the events handed over so far.
  std::array<std::int64_t, 3> position_pulses() const;
  Eigen::Vector3d position_mm() const;

 private:
  /// Progress of one axis: next edge and what is left of the move.
  struct AxisProgress {
    std::int64_t pulses = 0;
    std::int64_t target_pulses = 0;
    std::optional<std::uint64_t> next_rise, next_fall, next_turn;
    std::uint64_t earliest_rise = 0;
    PulseTrain train;  ///< of the present motion, and when it begins
    std::uint64_t train_start_cycle = 0;
    AxisPins pins;
  };

  std::uint64_t cycle_at(double time_s) const;
  std::uint64_t slow_down(std::uint64_t cycle, const char* what);
  void schedule_rise(std::size_t axis);
  void begin_profile(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction,
                     const JerkProfile& profile, const Eigen::Vector3d& target_mm,
                     std::uint64_t motion_start_cycle);
  void set_position_pins(std::size_t axis);
  static std::optional<std::uint64_t> next_edge(const AxisProgress& axis);
  std::uint64_t last_edge_cycle() const;

  StageConfig config_;
  std::array<AxisProgress, 3> axes_;
  std::array<Range, 3> reach_;  ///< of courses: to where a stop that begins at a limit switch ends
  Eigen::Vector3d commanded_mm_;
  Eigen::Vector3d origin_mm_, direction_;
  ScurveLimits path_limits_;
  JerkProfile profile_;
  std::uint64_t motion_start_cycle_ = 0;
  std::uint64_t end_cycle_ = 0;
  std::uint64_t now_ = 0;
  std::optional<Eigen::Vector3d> broken_off_;  ///< target of the move that a feed hold stopped
  bool held_ = false;
};

}  // namespace meltstage::motion
