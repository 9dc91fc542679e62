// SPDX-License-Identifier: Apache-2.0
// Kinematics of the XY-Theta alignment stage (3-PRP planar parallel mechanism) of paper 003 with all of its
// geometric and gear errors.
#pragma once

#include <Eigen/Core>
#include <array>
#include <numbers>

#include "motion/align/planar_pose.hpp"

namespace meltstage::motion {

/// What the stage is made of: three motors push sliders, a link of constant length joins each slider to a
/// guide of the platform. Branch 1 moves along X, branches 2 and 3 along Y. Frame O-XY: X passes through the
/// middle of branch 2's stroke, Y through that of branch 1 (paper 003, figs. 3 and 5). The defaults are the
/// paper's nominal values; the 12 geometric and 3 gear errors are what a real stage's differ from them by.
struct PrpGeometry {
  std::array<double, 3> lead_mm{2.0, 2.0, 2.0};    ///< R: travel of the slider per turn of the motor
  std::array<double, 3> offset_mm{0.0, 0.0, 0.0};  ///< q0: slider's place at 0 turns
  std::array<double, 3> d_mm{268.0, 39.5, 431.5};  ///< y of branch 1, x of branches 2 and 3
  std::array<double, 3> beta_rad{0.0, 0.0, 0.0};   ///< of the slider's way against X, Y, Y
  double link_mm = 0.0;                            ///< l3 - l2: guide of branch 3 above that of branch 2
  double alpha1_rad = 0.5 * std::numbers::pi;      ///< from the guide of 2 and 3 to the guide of branch 1
  double alpha2_rad = 0.0;                         ///< from the platform's own X to the guide of 2 and 3
  double stroke_mm = 5.0;                          ///< largest travel to either side
};

/// Turns of the motors 1, 2, 3 from home.
using PrpTurns = Eigen::Vector3d;

/// Turns for a pose of the platform, closed form. With the nominal geometry this is paper 003, eq. (3),
/// divided by the lead. Not limited by the stroke.
/// @throws MotionError if a number isn't finite, a lead isn't positive, or a slider's way runs along its
/// guide.
PrpTurns prp_inverse(const PrpGeometry& geometry, const PlanarPose& pose);

/// Pose of the platform at these turns, closed form: the angle from branches 2 and 3, the place from two
/// lines. With the nominal geometry this is paper 003, eq. (4).
/// @throws MotionError if a number isn't finite, a lead isn't positive, or the guides can't meet.
PlanarPose prp_forward(const PrpGeometry& geometry, const PrpTurns& turns);

/// d(x, y, angle) / d(turns) in mm and rad per turn. Never singular unless the guides are parallel.
Eigen::Matrix3d prp_jacobian(const PrpGeometry& geometry, const PrpTurns& turns);

/// @throws MotionError that names the branch, if a motor would leave its stroke or a lead isn't positive.
void check_stroke(const PrpGeometry& geometry, const PrpTurns& turns);

/// Turns that displace the platform from where it stands (in the fixed frame): forward, displace, inverse.
/// @throws MotionError if the new pose is out of reach.
PrpTurns displaced_turns(const PrpGeometry& geometry, const PrpTurns& now, const PlanarPose& by);

/// The geometry seen from a frame whose origin lies at `origin_mm` and whose X is turned by `angle_rad`, both
/// as seen from O: the camera's, which nobody can lay exactly into the stage's.
PrpGeometry seen_from(const PrpGeometry& geometry, const Eigen::Vector2d& origin_mm, double angle_rad);

}  // namespace meltstage::motion
