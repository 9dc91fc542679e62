// SPDX-License-Identifier: Apache-2.0
// Control of one axis as a state machine: homing on a switch and the encoder's index, moves, jog, soft
// limits, limit switches, following error, emergency stop. It runs once a servo cycle: switches and encoder
// in, command out.
#pragma once

#include <optional>
#include <string_view>

#include "motion/bumps/coordinates.hpp"
#include "motion/profile/profile.hpp"
#include "motion/profile/retarget.hpp"

namespace meltstage::motion {

/// Homing goes to the switch at the lower end fast, leaves it, comes back slowly, and takes as reference the
/// first index pulse above it: the switch only says which turn, so that its scatter doesn't count.
struct HomingConfig {
  double fast_mm_s = 20.0;  ///< its stopping way must fit between home and limit switch
  double slow_mm_s = 2.0;
  double search_mm = 220.0;         ///< longest way to the switch; more than the travel
  double clear_mm = 1.0;            ///< way above the switch's edge from which it is approached slowly
  double lead_mm = 10.0;            ///< of a turn: from index to index
  double index_position_mm = 0.0;   ///< position of the index in the machine's frame
  double index_margin_share = 0.1;  ///< of a turn; nearer to the switch, the next turn's index might be taken
};

struct AxisControlConfig {
  double cycle_s = 1.25e-4;
  Range travel;  ///< soft limits, once homed
  ScurveLimits limits;
  ScurveLimits stop_limits = asymmetric_limits(400, 8000, 8000, 2e6, 2e6);  ///< of a stop after a fault
  HomingConfig homing;
  double following_error_mm = 0.05;  ///< allowed at standstill
  double following_error_s = 0.002;  ///< allowed more for each mm/s of commanded speed
};

enum class AxisPhase {
  unhomed,        ///< at rest, position not known; only jog and home
  homing_search,  ///< fast towards the switch
  homing_clear,   ///< off the switch
  homing_latch,   ///< slowly back to its edge
  homing_index,   ///< slowly up to the index
  ready,          ///< at rest
  moving,
  jogging,
  coordinated,  ///< its command comes from a path of several axes
  stopping,     ///< slowing down because of a fault
  fault         ///< at rest until reset()
};

enum class AxisFault {
  none,
  emergency_stop,
  limit_negative,
  limit_positive,
  soft_limit,        ///< a coordinated command outside the travel
  following_error,   ///< or an encoder that reads no number
  switch_not_found,  ///< way or limit switch reached first
  switch_stuck,      ///< still active after the whole way off it
  index_not_found,   ///< no pulse within 1.2 turns
  index_near_switch  ///< within the margin: turn the switch or the coupling
};

std::string_view name_of(AxisPhase phase);
std::string_view name_of(AxisFault fault);

/// What the axis' electronics say at a servo cycle.
struct AxisInputs {
  double encoder_mm = 0.0;         ///< counted since power-on, zero anywhere
  std::optional<double> index_mm;  ///< encoder latched by an index pulse since the last cycle
  bool home = false;
  bool limit_negative = false;
  bool limit_positive = false;
  bool emergency_stop = false;  ///< the loop that also drives the chip's inhibit pin
};

struct AxisOutputs {
  MotionState command;  ///< in the encoder's frame
  bool enabled = true;  ///< of the drive; off after a following error, when the loop can't be trusted
};

/// Where homing found things, in the encoder's frame.
struct HomingReport {
  double switch_mm = 0.0;
  double index_mm = 0.0;
  double index_turns = 0.0;  ///< from switch to index
};

/// The axis is never without a known state: a fault stops it under its stop limits; the encoder goes on
/// counting, so that an axis which was homed still is after reset(). Only a following error, whose cause may
/// be the encoder itself, asks for homing again. It is watched until the axis rests, and takes the place of
/// the fault for which the axis is stopping; a limit switch that comes meanwhile doesn't.
class AxisControl {
 public:
  /// @throws MotionError if a value is outside its range.
  explicit AxisControl(const AxisControlConfig& config, double encoder_mm = 0.0);

  /// One servo cycle of an axis on its own.
  AxisOutputs step(const AxisInputs& inputs);

  /// One servo cycle of an axis that follows a path of several axes (the cyclic synchronous position mode of
  /// IEC 61800-7-201): `command` in the encoder's frame, watched as the axis' own are. After a fault whoever
  /// plans the path has to bring it to rest, as only he knows the line; the axis is in its fault phase once
  /// the command stands still.
  /// @throws MotionError unless couple() came before.
  AxisOutputs follow(const AxisInputs& inputs, const MotionState& command);

  /// Orders; each is refused (MotionError) in a phase or at a place that doesn't allow it.
  void home();
  void move_to(double position_mm);  ///< also while it moves or jogs: goes there without a stop in between
  /// Signed, no faster than the limits' speed whatever is asked for; ends by itself at the soft limit, or
  /// before homing after the search's way.
  void jog(double velocity_mm_s);
  void stop();      ///< under the ordinary limits; of an axis on a path, by who plans it
  void couple();    ///< from now on follow(), from where the command stands
  void decouple();  ///< at rest: from now on step() again
  void set_homed(
      double position_mm);  ///< at rest: it stands there, known from elsewhere (an absolute encoder)
  void reset();             ///< after a fault, its cause gone and the encoder reading a number

  AxisPhase phase() const { return phase_; }
  AxisFault fault() const { return fault_; }
  bool homed() const { return homed_; }
  bool at_rest() const {
    return phase_ == AxisPhase::ready || phase_ == AxisPhase::unhomed || phase_ == AxisPhase::fault;
  }
  /// Read-back in the machine's frame, by the encoder. Before homing its zero is where power came on.
  double position_mm() const { return inputs_.encoder_mm - offset_mm_; }
  /// The place in the encoder's frame of a position in the machine's.
  double encoder_of(double position_mm) const { return position_mm + offset_mm_; }
  bool coupled() const { return coupled_; }
  const HomingReport& homing_report() const { return report_; }

 private:
  bool homing() const;
  bool profile_over() const { return time_s() >= profile_.duration_s; }
  double time_s() const { return static_cast<double>(cycles_) * config_.cycle_s; }
  void go_to(double encoder_mm, double speed_mm_s);
  void slow_down(const ScurveLimits& limits);
  void fail(AxisFault fault);
  void watch();
  void go_with_the_axis();
  void hold_at(double encoder_mm);
  void advance_homing();

  AxisControlConfig config_;
  AxisInputs inputs_;
  AxisPhase phase_ = AxisPhase::unhomed;
  AxisFault fault_ = AxisFault::none;
  bool homed_ = false, enabled_ = true, coupled_ = false;
  bool found_ = false;  ///< what this phase of homing looks for; it then slows down
  double offset_mm_ = 0.0;
  HomingReport report_;
  MotionState command_;
  JerkProfile profile_;
  double origin_mm_ = 0.0;
  long cycles_ = 0;  ///< since the profile's start
};

}  // namespace meltstage::motion
