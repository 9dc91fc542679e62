// SPDX-License-Identifier: Apache-2.0
// The experiment of Xu et al. 2024 rebuilt: a free-form part of 40 mm x 60 mm with nine lines, made and
// placed with errors, measured, and printed with and without compensation.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "motion/surface/conformal.hpp"
#include "motion/surface/deposition.hpp"

namespace meltstage::motion {

/// Nominal height of the part's upper face over its base; the face is 40 mm x 60 mm, a corner at (0, 0).
double trial_height_mm(double x_mm, double y_mm);

/// Its nine lines as a CAM system gives them, 32 mm from end to end and 0.1 mm from point to point, tool axes
/// normal to the face: 1-3 straight, 4-6 arcs of radius 40 mm, 7-9 free cubic NURBS (in the view from above).
std::vector<ClLine> trial_lines();

/// Printing heights of the nine lines: 0.08 mm (1, 4, 7), 0.10 mm (2, 5, 8), 0.11 mm (3, 6, 9).
std::vector<double> trial_heights_mm();

/// How a printed part departs from its model and from its place.
struct PartErrors {
  double form_mm = 0.035;          ///< standard deviation of the smooth random part
  double shortest_wave_mm = 12.0;  ///< of it; the longest is 40 mm
  double height_mm = 0.020;        ///< standard deviation of the placement's height
  double tilt_rad = 0.0010;        ///< of its tilts
  double shift_mm = 0.10;          ///< of its place in the plane
};

/// Form and placement error of a part over its face, in cosines: the sum of
/// modes_mm(i, j) cos(pi i x / 40 mm) cos(pi j y / 60 mm).
struct FaceError {
  static constexpr int kAlong = 8, kAcross = 11;
  using Modes = Eigen::Matrix<double, kAlong, kAcross>;
  Modes modes_mm = Modes::Zero();

  static Modes shapes(double x_mm, double y_mm);  ///< the cosines there
  double at_mm(double x_mm, double y_mm) const { return modes_mm.cwiseProduct(shapes(x_mm, y_mm)).sum(); }
};

/// Form and placement error of the part that stands for the paper's, fitted together with DepositionModel to
/// the paper's first group (trial_calibration.hpp).
const FaceError& paper_error();

/// A part with a given error.
RealPart make_trial_part(const FaceError& error);

/// A part with errors drawn from a seed.
RealPart make_trial_part(const PartErrors& errors, std::uint64_t seed);

/// Largest distance, across the line, of a rebuilt line from the real surface, along the rebuilt normals.
double largest_gap_error_mm(const RealLine& line, const RealPart& part);

/// Gap between tip and real surface along a printed line, at every point of it.
std::vector<double> gaps_mm(const RealLine& line, double height_mm, const RealPart& part);

enum class Compensation { none, as_published, full };

struct TrialLineResult {
  std::size_t touches = 0;
  double gap_error_mm = 0.0;  ///< largest |gap - height|
  WidthFigures width;
  double resistance_ohm = 0.0;
  DepositedLine deposited;
  std::vector<double> gaps_mm;
};

/// One run over the nine lines. `as_published`: points by the paper's chord rule (`chord_error_mm`), NURBS
/// through them, valve at the line's ends; `full`: choose_by_spline(), reconstruct(), lead and lag of the
/// pressure known to a tenth.
std::vector<TrialLineResult> run_trial(const RealPart& part, Compensation compensation,
                                       const DepositionModel& deposition, std::uint64_t seed,
                                       double chord_error_mm = 0.02);

}  // namespace meltstage::motion
