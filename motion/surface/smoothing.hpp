// SPDX-License-Identifier: Apache-2.0
// Values close to noisy ones: a natural cubic smoothing spline.
#pragma once

#include <Eigen/Core>
#include <span>

namespace meltstage::motion {

/// A smoothing spline's values, and what is known of their error.
struct SmoothedValues {
  Eigen::MatrixXd values;  ///< as the measured ones: a row a point, a column a coordinate
  Eigen::VectorXd
      standard_error;         ///< of each row's coordinates: noise times root of the hat matrix' diagonal
  double noise = 0.0;         ///< given, or estimated from the residuals
  double freedom = 0.0;       ///< trace of the hat matrix: number of points (interpolation) down to 2
  double rms_residual = 0.0;  ///< measured against smoothed
};

/// Natural cubic smoothing spline (Reinsch 1967) through values at rising parameters, the same smoothing for
/// every column. With a known noise (standard deviation of a coordinate, > 0) the smoothing minimises the
/// unbiased estimate of the error (Craven & Wahba 1979); with noise 0 the generalised cross-validation does.
/// Of several valleys the deepest is taken. O(n) for each smoothing tried; the diagonal by Hutchinson & de
/// Hoog 1985.
/// @throws MotionError if there are fewer than 4 points, parameters don't rise, or something isn't finite.
SmoothedValues smooth(std::span<const double> parameters, const Eigen::MatrixXd& measured, double noise);

}  // namespace meltstage::motion
