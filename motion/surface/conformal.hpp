// SPDX-License-Identifier: Apache-2.0
// A surface as it is (Xu et al. 2024): the real line out of the touches.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "motion/surface/nurbs.hpp"
#include "motion/surface/probe.hpp"

namespace meltstage::motion {

/// Points of a real line, at most.
inline constexpr std::size_t kMostLinePoints = 2'000'000;

/// A touch that its neighbours on the same face contradict: of dust, a burr, a slipped part, or of a step of
/// the surface that is really there.
struct SuspectTouch {
  std::size_t touch = 0;  ///< index among the line's touches
  double off_mm = 0.0;    ///< its shift less what its neighbours say
};

/// A line on the real surface, dense enough to be printed as a polygon.
struct RealLine {
  std::string name;
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<Eigen::Vector3d> normals;  ///< of the surface, outwards, length 1
  std::vector<double> lengths_mm;        ///< of the polygon
  double shift_mean_mm = 0.0;            ///< real minus nominal surface along the normal, over the touches
  double shift_largest_mm = 0.0;         ///< largest absolute
  /// What the spline may be off between the touches, from leaving out every second one; with noise, its
  /// standard error added. None if no face has the five touches that this takes.
  std::optional<double> estimated_error_mm = std::nullopt;
  /// Faces of fewer touches: what the spline is off there isn't known.
  std::size_t unjudged_faces = 0;
  /// Faces too short for a touch: their shift goes from that of the face before to that of the face behind.
  std::size_t untouched_faces = 0;
  bool smoothed = false;
  /// To be measured again, rising; counted in the estimated error. Looked for on faces of seven touches and
  /// more.
  std::vector<SuspectTouch> suspects = {};
};

struct ReconstructionOptions {
  double ball_radius_mm = 1.0;  ///< effective, from a calibration on a reference sphere
  double noise_mm = 0.0;        ///< standard deviation of a touch; 0: none
  double tolerance_mm = 0.020;  ///< for which the line is rebuilt
  double step_mm = 0.1;         ///< between points of the real line
};

/// As published: the cubic NURBS through the touched points (ball's radius taken off along the nominal
/// normal), chord-length parameters, eqs. (2), (3).
/// @throws MotionError if there are fewer than two touches or not as many as points, the line has fewer than
/// two points, or the step makes more than kMostLinePoints of it.
RealLine reconstruct_as_published(const ClLine& line, const ProbeLine& points,
                                  std::span<const Eigen::Vector3d> touches,
                                  const ReconstructionOptions& options);

/// The nominal line moved along its normals by a cubic spline through the measured shifts: what the CAM
/// system knows of the line's shape needs no touch, and corners stay corners. Where the surface is folded,
/// each face has a spline of its own, and they end where they meet. The ball's radius is taken off with the
/// real line's slope. If three standard deviations of noise are more than a quarter of the tolerance, the
/// shifts are smoothed instead of interpolated.
/// @throws MotionError as above.
RealLine reconstruct(const ClLine& line, const ProbeLine& points, std::span<const Eigen::Vector3d> touches,
                     const ReconstructionOptions& options);

/// The line as the CAM system has it, for a program without compensation: its points, and others between them
/// such that no two are more than the step apart.
/// @throws MotionError if it has fewer than two points, or the step isn't positive or makes more than
/// kMostLinePoints points.
RealLine nominal_line(const ClLine& line, double step_mm = 0.1);

}  // namespace meltstage::motion
