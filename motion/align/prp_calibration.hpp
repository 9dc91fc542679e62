// SPDX-License-Identifier: Apache-2.0
// Full-parameter calibration of the 3-PRP stage from what its own camera sees: least squares over all 12
// geometric and 3 gear errors, uncertainty and identifiability, choice of poses, residual table.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "motion/align/prp.hpp"

namespace meltstage::motion {

/// Marks of the plate seen with the stage standing at one place.
struct PlateView {
  PrpTurns turns;                        ///< commanded
  std::vector<std::size_t> marks;        ///< which of the plate's
  std::vector<Eigen::Vector2d> seen_mm;  ///< where, in the camera's frame
};

/// How far each error may be from nominal, one sigma: weak knowledge that decides only what the data leave
/// open. Places are wide, since the camera's frame may lie anywhere in the stage's.
struct PrpPriors {
  double lead_share = 0.01;
  double offset_mm = 100.0, d_mm = 100.0, link_mm = 0.05;
  double angle_rad = 0.01;
  double plate_mm = 200.0, plate_rad = 0.5;  ///< of the plate on the platform
};

struct PrpCalibrationOptions {
  double actuator_sigma_mm = 0.001;  ///< scatter of a slider's stops
  double mark_sigma_mm = 0.00025;    ///< of the camera, per coordinate
  PrpPriors priors;
};

/// A parameter as identified.
struct IdentifiedParameter {
  std::string name;  ///< as in the paper: R_1, q_1, d_1, beta_1, l_32, alpha_1 ...
  std::string unit;
  double nominal = 0.0, value = 0.0;
  double sigma = 0.0;        ///< standard uncertainty
  double prior_sigma = 0.0;  ///< what it was before the data
};

/// What the sliders do beyond the model, from the residuals of the calibration: a smooth table over the three
/// sliders' places (Gaussian process with a squared-exponential kernel). Its size and length are those under
/// which the residuals are likeliest, so that bare noise leaves it empty.
class ResidualTable {
 public:
  ResidualTable() = default;  ///< corrects nothing
  /// @param travels_mm where the sliders were; @param residuals_mm what is left there;
  /// @param sigma_mm noise of a residual; @param stroke_mm scale of the places.
  ResidualTable(const std::vector<Eigen::Vector3d>& travels_mm,
                const std::vector<Eigen::Vector3d>& residuals_mm, double sigma_mm, double stroke_mm);

  /// What each slider travels beyond the model at this place, mm.
  Eigen::Vector3d at(const Eigen::Vector3d& travel_mm) const;
  bool empty() const { return nodes_.empty(); }

 private:
  struct Fit {
    double length = 1.0;  // of the strokes
    double variance_mm2 = 0.0;
  };
  std::vector<Eigen::Vector3d> nodes_;  // in strokes
  std::array<Fit, 3> fit_{};
  std::array<Eigen::VectorXd, 3> weights_;
  double stroke_mm_ = 1.0;
};

struct PrpCalibration {
  PrpGeometry geometry;                         ///< identified, in the camera's frame
  PlanarPose plate;                             ///< of the plate in the platform's frame
  ResidualTable table;                          ///< on top of the geometry
  std::vector<IdentifiedParameter> parameters;  ///< 15 of the stage, then 3 of the plate's place
  Eigen::MatrixXd correlation;                  ///< of the parameters
  std::vector<Eigen::Vector3d> residuals_mm;    ///< of the sliders at each view
  double misfit = 0.0;               ///< rms of the residuals in their sigma; 1 if the noise explains all
  double prediction_sigma_mm = 0.0;  ///< worst slider over the corners of the workspace, from the data alone
  double condition = 0.0;  ///< of the information on what the data determine, each in its prior's unit
  int iterations = 0;
  std::vector<std::string> warnings;  ///< one line each: what can't be told apart, too few poses, misfit
};

/// Least squares of all parameters over the views (Levenberg-Marquardt, Ceres). A view's marks give the
/// plate's pose in closed form; the inverse kinematics give the travel of each slider for it, and what
/// differs from the commanded one is weighed with the scatter of the sliders and the camera's noise.
/// @param plate_mm the plate's marks in its own frame, as made.
/// @throws MotionError on fewer than 7 views, marks that can't be (see fit_pose), a mark not on the plate, or
/// numbers that aren't finite: which view, what was found.
PrpCalibration calibrate_prp(const std::vector<Eigen::Vector2d>& plate_mm,
                             const std::vector<PlateView>& views, const PrpGeometry& nominal,
                             const PrpCalibrationOptions& options = {});

/// Poses for a calibration: those of a 5 x 5 x 5 grid over the strokes that together have the largest
/// determinant of information (D-optimal, greedy and then exchanged). A pose may come up more than once.
/// @throws MotionError if fewer than 7 are asked for.
std::vector<PrpTurns> choose_poses(std::size_t count, const PrpGeometry& nominal,
                                   const PrpCalibrationOptions& options = {});

/// Turns that displace the platform from where it stands, by identified geometry and residual table.
/// @throws MotionError if the new pose is out of reach.
PrpTurns displaced_turns(const PrpCalibration& calibration, const PrpTurns& now, const PlanarPose& by);

}  // namespace meltstage::motion
