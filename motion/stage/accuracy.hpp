// SPDX-License-Identifier: Apache-2.0
// Positioning accuracy of an axis: what a laser interferometer measures, its evaluation after ISO 230-2, the
// backlash by the residual method, and the tables that compensate lead error and backlash.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "motion/bumps/coordinates.hpp"
#include "motion/profile/profile.hpp"
#include "motion/stage/stage_model.hpp"

namespace meltstage::motion {

/// Deviations (actual minus target position) at one target position, one of each approach. Forward: the axis
/// came from smaller positions.
struct TargetDeviations {
  double target_mm = 0.0;
  std::vector<double> forward_um, reverse_um;
  std::size_t line = 0;  ///< of the file, its first; 0: of no file
};

/// The standard's figures at one target position.
struct PositionAccuracy {
  double target_mm = 0.0;
  double mean_forward_um = 0.0, mean_reverse_um = 0.0;
  double mean_um = 0.0;                                           ///< of both directions
  double reversal_um = 0.0;                                       ///< B_i, forward minus reverse
  double deviation_forward_um = 0.0, deviation_reverse_um = 0.0;  ///< estimators s of the standard deviation
  double repeatability_forward_um = 0.0, repeatability_reverse_um = 0.0;  ///< 4 s
  double repeatability_um = 0.0;  ///< R_i = max(2 s forward + 2 s reverse + |B_i|, 4 s forward, 4 s reverse)
};

/// The standard's figures of the axis (ISO 230-2:2014, clause 4; coverage factor 2).
struct AxisAccuracy {
  std::vector<PositionAccuracy> positions;
  double reversal_um = 0.0;                                               ///< B, largest |B_i|
  double mean_reversal_um = 0.0;                                          ///< mean of B_i with their signs
  double repeatability_forward_um = 0.0, repeatability_reverse_um = 0.0;  ///< R of one direction
  double repeatability_um = 0.0;                                          ///< R, both directions
  double systematic_forward_um = 0.0, systematic_reverse_um = 0.0;        ///< E of one direction
  double systematic_um = 0.0;                                             ///< E, both directions
  double mean_systematic_um = 0.0;                                        ///< M, range of the mean deviations
  double accuracy_forward_um = 0.0, accuracy_reverse_um = 0.0;            ///< A of one direction
  double accuracy_um = 0.0;                                               ///< A, both directions
};

/// Evaluates a test after ISO 230-2. The standard asks for five runs in each direction and, on axes up to
/// 2 m, for at least five target positions a metre and five in all; what was measured is evaluated whatever
/// its size, from two positions and two runs in each direction on.
/// @throws MotionError if there is less, or a number isn't finite, or a target comes twice.
AxisAccuracy evaluate_accuracy(std::span<const TargetDeviations> targets);

/// Backlash by the residual method: the mean course of both directions (lead error) is taken off, and what
/// remains of the reverse approaches lies this far above what remains of the forward ones.
struct ResidualBacklash {
  double backlash_um = 0.0;        ///< mean over the targets of reverse minus forward
  double standard_error_um = 0.0;  ///< of that mean, from the scatter of the targets
};
/// @throws MotionError as evaluate_accuracy.
ResidualBacklash residual_backlash(std::span<const TargetDeviations> targets);

/// Reads a test from separated text with the header `target_mm,direction,deviation_um`, a row an approach,
/// direction `+` (forward) or `-` (reverse), rows in any order; lines that begin with # are skipped. A byte
/// order mark may stand first; LF, CRLF and CR end a line. Positions lie within 1e6 mm, deviations within 1e9
/// um.
/// @throws UserError if the file can't be read; MotionError with file, line, column, value and what was
///   expected.
std::vector<TargetDeviations> read_deviations(const std::filesystem::path& path);
/// The same from a text; `name` stands in messages.
std::vector<TargetDeviations> read_deviations_text(std::string_view name, std::string_view content);

/// What a table may correct. @throws MotionError with file (`name`), line and column for a target out of the
/// axis' travel, and where the mean deviation of a direction changes by more than a tenth of the way between
/// two targets: no screw does, and commands would not follow each other as their targets do.
void require_correctable(std::string_view name, std::span<const TargetDeviations> targets,
                         const Range& travel);

/// Deviations of an axis at commanded positions for each direction of approach, linear in between, constant
/// outside. Empty: nothing is corrected.
struct CompensationTable {
  std::vector<double> position_mm;             ///< ascending
  std::vector<double> forward_mm, reverse_mm;  ///< actual minus commanded
};

/// The table of a test's means.
/// @throws MotionError as evaluate_accuracy.
CompensationTable make_compensation(const AxisAccuracy& accuracy);

/// @throws MotionError if the columns are of unlike length, or the positions don't ascend.
void check_compensation(const CompensationTable& table);

/// What to command so that the axis stands at `target_mm` when it arrives from below (`forward`) or above.
/// The deviations must change by less than the way on which they do (require_correctable()).
/// @throws MotionError as check_compensation.
double compensated_forward_mm(const CompensationTable& table, double target_mm);
double compensated_reverse_mm(const CompensationTable& table, double target_mm);

/// The instrument, and what no model of an axis has: scatter of its stops.
struct InterferometerConfig {
  double noise_um = 0.05;        ///< sigma of a reading
  double resolution_um = 0.001;  ///< of a reading
  double stop_forward_um = 0.0;  ///< sigma of where the axis stops, approached from below
  double stop_reverse_um = 0.0;  ///< the same from above
  double dwell_s = 0.4;          ///< from the end of the command to the end of the reading
  double averaging_s = 0.05;     ///< readings over this time make one
  std::uint64_t seed = 1;
};

/// A test on the simulated axis after the standard test cycle (ISO 230-2, figure 1): up through all targets,
/// beyond the last, down through all, beyond the first, `runs` times.
struct AccuracyTest {
  std::vector<double> target_mm;  ///< ascending
  int runs = 5;
  double overrun_mm = 2.0;  ///< way beyond the ends at which the axis turns; more than its backlash
  /// Gentle: a servo that overshoots its stop turns back within the play, and part of the backlash hides.
  ScurveLimits limits = asymmetric_limits(50, 200, 200, 2e3, 2e3);
};

/// Target positions after the standard: evenly spaced over the way, each moved by a random part of
/// `period_mm` so that a periodic error is seen at all its phases.
std::vector<double> accuracy_targets(double from_mm, double to_mm, int count, double period_mm,
                                     std::uint64_t seed);

/// Runs the test on the model with the commands corrected by `table`.
/// @throws MotionError if there are no targets or runs, or the targets don't ascend.
std::vector<TargetDeviations> measure_axis(const AxisModelConfig& axis, const AccuracyTest& test,
                                           const InterferometerConfig& instrument,
                                           const CompensationTable& table = {});

}  // namespace meltstage::motion
