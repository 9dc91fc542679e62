// SPDX-License-Identifier: Apache-2.0
// A simulated axis: servo loop, motor with encoder, screw with lead error and backlash, slide with friction,
// and a load on a flexible mode. Against it plans are judged where no machine is at hand.
#pragma once

#include "motion/profile/profile.hpp"
#include "motion/profile/retarget.hpp"
#include "motion/profile/vibration.hpp"

namespace meltstage::motion {

/// Cascaded servo: position controller P, speed controller PI, both once a cycle, with feed-forward of speed
/// and acceleration.
struct ServoConfig {
  double cycle_s = 1.25e-4;
  double position_bandwidth_hz = 25.0;
  double speed_bandwidth_hz = 100.0;
  double integral_time_s = 0.01;
  double speed_feed_forward = 1.0;         ///< share, 1: all
  double acceleration_feed_forward = 1.0;  ///< share of the force that the moved mass needs
  double force_limit_n = 500.0;
};

/// Where the screw puts the slide, against what the encoder on the motor says.
struct ScrewConfig {
  double backlash_mm = 0.0;
  double lead_error_share = 0.0;  ///< length of the way, e.g. 20e-6 for 20 um/m
  double lead_error_mm = 0.0;     ///< amplitude over each turn
  double lead_mm = 10.0;          ///< of a turn
};

struct AxisModelConfig {
  double moved_mass_kg = 8.0;  ///< all that the motor moves
  double load_mass_kg = 2.0;   ///< share of it on the flexible mode
  Mode mode;                   ///< of the load with the slide held still
  ServoConfig servo;
  ScrewConfig screw;
  double encoder_mm = 1e-4;  ///< a count
  double coulomb_friction_n = 10.0;
  double presliding_mm = 0.002;  ///< way over which friction builds up (Dahl 1968)
  double viscous_friction_ns_m = 20.0;
};

/// The axis in time. Between servo cycles the motion is integrated by Runge-Kutta steps of fixed length.
class AxisModel {
 public:
  /// @throws MotionError if a value is outside its range.
  explicit AxisModel(const AxisModelConfig& config, double position_mm = 0.0);

  /// One servo cycle towards a command.
  void step(const MotionState& command);

  double encoder_mm() const;  ///< motor, in whole counts
  double motor_mm() const { return state_.motor_m * 1e3; }
  double slide_mm() const { return slide_m_ * 1e3; }      ///< behind the screw
  double load_mm() const { return state_.load_m * 1e3; }  ///< where the head is
  const AxisModelConfig& config() const { return config_; }

 private:
  struct State {
    double motor_m, motor_m_s, load_m, load_m_s;
  };
  State rate(const State& state, double force_n) const;
  void integrate(double force_n, double time_s);
  void follow_screw(double time_s);
  double screw_m(double motor_m) const;

  AxisModelConfig config_;
  double stiffness_n_m_, damping_ns_m_;
  State state_;
  double slack_m_ = 0.0;  ///< motor's way since the screw's flank that pushes upwards, 0..backlash
  double slide_m_, slide_m_s_ = 0.0;
  double bristle_m_ = 0.0;  ///< Dahl's deflection
  double integral_n_ = 0.0;
};

/// What a move comes to on an axis.
struct MoveFigures {
  double tracking_mm = 0.0;     ///< largest |command - encoder| from start to end of the command
  double positioning_mm = 0.0;  ///< largest |load - target| after the end of the command
  double settling_s = 0.0;      ///< from there until the load stays within the band
};

/// Runs a move from rest, then watches for `watch_s`. Settling is `watch_s` where it isn't over by then.
MoveFigures measure_move(const AxisModelConfig& config, const JerkProfile& profile, double band_mm,
                         double watch_s = 1.0);

}  // namespace meltstage::motion
