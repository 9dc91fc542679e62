// SPDX-License-Identifier: Apache-2.0
// The deposition model and the part of the experiment of Xu et al. 2024, fitted to what the paper tells of
// its first group of lines, printed without compensation. Nothing here knows the second group.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>

#include "motion/surface/conformal_trial.hpp"

namespace meltstage::motion {

/// A row of tables 1 and 2.
struct PrintedLine {
  double width_um, deviation_um;  ///< mean and standard deviation of 32 widths
  double resistance_ohm;
};

/// Lines 1..9 without compensation (first group) and with the paper's (second group).
const std::array<PrintedLine, 9>& first_group();
const std::array<PrintedLine, 9>& second_group();

/// What is fitted.
struct TrialFit {
  DepositionModel deposition;
  FaceError error;
  /// Sum of squares: misfits of the first group, each over its standard deviation, and departures of the
  /// fitted numbers from what was assumed of them before, likewise.
  double objective = 0.0;
  double misfit = 0.0;  ///< of it, that of the first group
};

/// Objective and misfit at given numbers.
TrialFit assess_fit(const DepositionModel& deposition, const FaceError& error);

/// A place to start from, drawn from what is assumed before.
TrialFit draw_start(std::uint64_t seed);

/// The most probable numbers near `start` (Levenberg-Marquardt). Fitted to: ln resistance (standard deviation
/// 2 %), mean (10 um) and standard deviation (5 um) of the widths of nine lines; where the paper saw
/// stringing (section 3.3: line 2 at 5-8 and 17-19 mm, line 6 at 14-18, line 9 at 11-13 and 29-31) the least
/// width is 150 um (30 um), elsewhere it is not below 250 um (30 um). Assumed before: form and placement
/// error of 45 um rms, smooth over 14 mm; the deposition model's numbers log-normal (trial_calibration.cpp).
/// `progress` hears the share of the iterations that are done; few fits need them all.
TrialFit fit_first_group(const TrialFit& start, int iterations,
                         const std::function<void(double share)>& progress = {});

}  // namespace meltstage::motion
