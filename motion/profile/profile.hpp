// SPDX-License-Identifier: Apache-2.0
// Velocity profile of a move: the asymmetric seven-segment S-curve of Zhang & Zhang, alone and
// along a line.
#pragma once

#include <Eigen/Core>
#include <array>

#include "base/error.hpp"

namespace meltstage::motion {

/// A move that can't be made as asked. what() is one line: the value found and what was expected.
class MotionError : public UserError {
 public:
  using UserError::UserError;
};

/// Limits of one axis or of a path, all from 1e-12 to 1e15. The jerks are those of the segments T1, T3, T5
/// and T7.
struct ScurveLimits {
  double velocity_mm_s = 400.0;        ///< Vc
  double acceleration_mm_s2 = 4000.0;  ///< A
  double deceleration_mm_s2 = 4000.0;  ///< D
  double jerk1_mm_s3 = 2e5;            ///< acceleration rises
  double jerk3_mm_s3 = 2e5;            ///< acceleration falls
  double jerk5_mm_s3 = 2e5;            ///< deceleration rises
  double jerk7_mm_s3 = 2e5;            ///< deceleration falls
};

/// Limits in the paper's form: one jerk Ja for the acceleration, one jerk Jd for the deceleration.
ScurveLimits asymmetric_limits(double velocity_mm_s, double acceleration_mm_s2, double deceleration_mm_s2,
                               double jerk_acceleration_mm_s3, double jerk_deceleration_mm_s3);

/// Position on the path and its derivatives at one moment.
struct MotionState {
  double position_mm = 0.0;
  double velocity_mm_s = 0.0;
  double acceleration_mm_s2 = 0.0;
  double jerk_mm_s3 = 0.0;
};

/// A planned profile: segments T1..T7 of constant jerk, of which any may have no duration. It begins at
/// position 0.
struct Scurve {
  std::array<double, 7> durations_s{};
  std::array<double, 7> start_times_s{};  ///< of each segment
  std::array<MotionState, 7> starts{};    ///< state at the start of each segment, with the jerk inside it
  MotionState end;                        ///< exactly the distance and the end speed that were asked for
  double duration_s = 0.0;

  /// State at `time_s`; before the start and after the end the profile stands still at its first or last
  /// position and keeps the speed there. At a segment's border the jerk is that of the segment which begins.
  MotionState sample(double time_s) const;

  /// First moment at which the position is reached; 0 and duration_s for positions beyond the ends.
  /// @throws MotionError if the position is no number.
  double time_at(double position_mm) const;
};

/// The fastest seven-segment profile over `distance_mm` (>= 0) from speed Vs to speed Ve (each 0..Vc), with
/// no acceleration at either end. Zhang & Zhang, eqs. (1)-(14), with T2, T4, T6 empty
/// where the distance or the change of speed is too small. Closed form if Vc is reached, if both A and D are
/// reached, or if neither is in a move from rest to rest; if one of them is, the peak speed of a move from
/// rest to rest is the root of one quartic, otherwise that of one increasing function.
///
/// @throws MotionError if a limit isn't positive, a speed is outside 0..Vc, or the distance is too short for
/// the change
///   of speed (the message says how much is needed).
Scurve plan_scurve(const ScurveLimits& limits, double distance_mm, double start_velocity_mm_s = 0.0,
                   double end_velocity_mm_s = 0.0);

/// The same way in `factor` (> 0) times the duration: speeds fall by factor, accelerations by factor^2,
/// jerks by factor^3.
/// @throws MotionError if the factor isn't a number from 1e-12 to 1e15.
Scurve stretched(const Scurve& curve, double factor);

/// A profile from rest to rest whose segments each last a whole number of servo cycles: none is shorter than
/// in `curve`, the distance is the same to the last bit, and speed, accelerations and jerks are not above
/// those of `curve`. A duration that is whole but for 1e-9 of a cycle counts as whole, so a segment shorter
/// than that is left out.
/// @throws MotionError if the cycle isn't above 0 and at most 60 s or the profile doesn't begin and end at
/// rest.
Scurve round_to_cycles(const Scurve& curve, double cycle_s);

/// Limits of the three axes of the stage.
using AxisLimits = std::array<ScurveLimits, 3>;

/// State of the three axes at one moment; the frame is the stage's.
struct AxisStates {
  Eigen::Vector3d position_mm, velocity_mm_s, acceleration_mm_s2, jerk_mm_s3;
};

/// A straight move whose axes start and arrive together.
struct Move {
  Eigen::Vector3d from_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit vector, zero for a move of no length
  ScurveLimits limits;                                  ///< along the path
  Scurve profile;                                       ///< of the distance along the path

  /// All axes at `time_s`; exactly `from_mm` before and `to_mm` after the move.
  AxisStates sample(double time_s) const;
};

/// A move from point to point whose axes start and arrive together, each on its own S-curve: the slowest axis
/// moves as fast as it can, the others' curves are stretched to its duration. Where the axes' limits differ
/// it is faster than the straight line of Move, and not straight.
struct SynchronizedMove {
  Eigen::Vector3d from_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_mm = Eigen::Vector3d::Zero();
  std::array<Scurve, 3> profiles;  ///< of each axis' distance, without its sign
  double duration_s = 0.0;

  /// All axes at `time_s`; exactly `from_mm` before and `to_mm` after the move.
  AxisStates sample(double time_s) const;
};

/// Limits along a unit direction under which no axis exceeds its own.
/// @throws MotionError if the direction is no unit vector.
ScurveLimits limits_along(const AxisLimits& axes, const Eigen::Vector3d& direction);

/// Plans the fastest rest-to-rest move along the line under the axes' limits.
/// @throws MotionError if a limit isn't positive or a coordinate isn't finite.
Move plan_move(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm, const AxisLimits& axes);

/// Plans the fastest rest-to-rest move from point to point under the axes' limits.
/// @throws MotionError if a limit isn't positive or a coordinate isn't finite.
SynchronizedMove plan_synchronized(const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm,
                                   const AxisLimits& axes);

}  // namespace meltstage::motion
