// SPDX-License-Identifier: Apache-2.0
// Which points of a line to touch: how many by eq. (1) of Xu et al. 2024, and where: by chord error as in the
// paper, evenly, or such that a spline through them holds a tolerance on the real surface.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "motion/surface/cl_points.hpp"
#include "motion/surface/line_shape.hpp"

namespace meltstage::motion {

/// Number of measuring points from the process capability K (tolerance over spread, > 1) and the confidence
/// gamma (0.5..1, both not included), eq. (1), rounded up: 1/2 ((1 + K) / (1 - K) Z_gamma)^2. It is the
/// sample that knows a standard deviation up to the factor K between its confidence limits; at least 2.
/// @throws MotionError if K or gamma is outside its range.
std::size_t measuring_point_count(double capability, double confidence);

/// Indices of the points that the paper's rule takes (section 2.2, fig. 3), first and last among them: from a
/// chosen point the chord reaches on while no point between is farther than `chord_error_mm` from it; the
/// last point before it would be is the next one chosen. This is the rule as published, each chord anew: the
/// cube of the chord's length.
/// @throws MotionError if there are fewer than two points or the error isn't positive.
std::vector<std::size_t> choose_by_chord_as_published(std::span<const Eigen::Vector3d> points_mm,
                                                      double chord_error_mm);

/// The same points in O(n log n): a tree over the points knows for each of its parts a capsule that holds it,
/// and a part is looked into only where the capsule reaches beyond the error.
std::vector<std::size_t> choose_by_chord(std::span<const Eigen::Vector3d> points_mm, double chord_error_mm);

/// `count` (>= 2) points, as even by length as the points allow; fewer if there aren't that many.
std::vector<std::size_t> choose_evenly(std::span<const Eigen::Vector3d> points_mm, std::size_t count);

struct SplineChoice {
  double tolerance_mm = 0.020;  ///< that the reconstructed line is to hold on the real surface
  /// Shortest wavelength of the form error that is to be seen. Five points a wave leave 3 % of its amplitude.
  double form_wavelength_mm = 8.0;
  /// How far beside its place the part may lie. Shifted by so much, a slope that changes shows as a shift of
  /// the surface.
  double placement_mm = 0.2;
  double ball_radius_mm = 1.0;  ///< of the probe: so close to a valley's bottom it would touch both faces
};

/// Places such that what reconstruct() does with them holds the tolerance: no gap is longer than a fifth of
/// the form wavelength, and where the surface bends they are so close that a part beside its place is seen
/// within half the tolerance. Corners (more than 20 degrees) are touched, but not where the surface is
/// folded: there each face is touched as close to the fold as ball and placement let it. A face too short for
/// that isn't touched.
/// @throws MotionError if an option isn't positive, or a line without tool axes goes up or down a wall.
std::vector<MeasuringPoint> choose_by_spline(const ClLine& line, const SplineChoice& choice);

/// The chosen points of a line with their lengths.
/// @throws MotionError if a line without tool axes goes up or down a wall.
std::vector<MeasuringPoint> measuring_points(const ClLine& line, std::span<const std::size_t> chosen);

/// Distance of a point from a straight segment.
double distance_to_segment_mm(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
                              const Eigen::Vector3d& to);

}  // namespace meltstage::motion
