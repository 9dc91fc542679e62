// SPDX-License-Identifier: Apache-2.0
// Five axes with both rotary axes in the table: where the linear and rotary axes have to be for a tool tip
// and a surface normal (tool-centre-point control, RTCP), and back.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "motion/bumps/coordinates.hpp"

namespace meltstage::motion {

/// A table that tilts about x (axis A) or y (axis B) and on it one that turns about z (axis C). The frame is
/// the workpiece's, which is the machine's when both stand at zero.
struct TwinRotaryTable {
  enum class Tilt { a, b };
  Tilt tilt = Tilt::a;
  Eigen::Vector3d tilt_centre_mm = Eigen::Vector3d::Zero();    ///< a point of the tilting axis
  Eigen::Vector3d rotary_centre_mm = Eigen::Vector3d::Zero();  ///< a point of the turning axis
  int tilt_sign = 1;  ///< 1: a positive angle turns the table right-handed; as LinuxCNC's trt kinematics; -1:
                      ///< the other way
  int rotary_sign = 1;
  Range tilt_deg{-100.0, 100.0};
  Range rotary_deg{-3600.0, 3600.0};
};

/// Positions of the machine's axes: linear in the machine's frame, rotary in degrees as programmed.
struct AxesPosition {
  Eigen::Vector3d linear_mm = Eigen::Vector3d::Zero();
  double tilt_deg = 0.0, rotary_deg = 0.0;
};

/// A tool tip on the workpiece, and the outward direction in which the tool is to stand there.
struct ToolPose {
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< a unit vector
};

/// Linear axes that hold the tip where it belongs at these rotary positions.
AxesPosition axes_at(const TwinRotaryTable& table, const Eigen::Vector3d& tip_mm, double tilt_deg,
                     double rotary_deg);

/// Tip and tool axis in the workpiece's frame.
ToolPose pose_of(const TwinRotaryTable& table, const AxesPosition& axes);

/// Rotary positions for a path, continuous along it: of both solutions at each pose the sequence with the
/// least rotary way, no turn of C by more than half a turn between neighbours, and the windings that fit the
/// limits. Where the axis is nearer to the vertical than `singular_deg`, C isn't determined and any small
/// change of the axis would turn it far: there C goes evenly from where it was to where it will be and the
/// tilt follows as well as it can within its limits, so that the tool leans from the normal by at most that
/// angle; the tip stays exact.
/// @throws MotionError if there is no pose, a number isn't finite, an axis isn't of length 1 (to 1e-6), the
/// table's limits are in disorder, or no sequence keeps the limits (the message names the pose).
std::vector<AxesPosition> solve_path(const TwinRotaryTable& table, std::span<const ToolPose> path,
                                     double singular_deg = 0.5);

}  // namespace meltstage::motion
