// SPDX-License-Identifier: Apache-2.0
// Vibration that a motion leaves behind in one mode of the machine: its exact residual, the Morlet energy of
// Zhang & Zhang with their Taguchi search, and limits that leave little of either.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "motion/profile/profile.hpp"
#include "motion/profile/retarget.hpp"

namespace meltstage::motion {

/// A mode of vibration: e'' + 2 zeta w e' + w^2 e = -a(t), e the deflection and a the commanded acceleration.
struct Mode {
  double frequency_hz = 38.0;   ///< undamped, > 0
  double damping_ratio = 0.05;  ///< 0..1, 1 excluded
};

/// A mode known to +-`spread` of its frequency.
struct ModeBand {
  Mode nominal;
  double spread = 0.1;  ///< 0..1, 1 excluded
};

/// @throws MotionError if a field is outside its range.
void check_mode(const Mode& mode);
void check_band(const ModeBand& band);

/// 21 frequencies of a band, ends included; one if the spread is 0.
std::vector<Mode> modes_of(const ModeBand& band);

/// Amplitude of the free vibration at the moment the motion ends (which then decays with exp(-zeta w t)):
/// |sum of jerk steps dj_k exp(lambda (T - t_k))| / (w^2 wd), lambda = -zeta w + i wd. Exact: the motion is
/// piecewise of constant jerk and the mode is linear.
/// @throws MotionError as check_mode.
double residual_mm(const JerkProfile& profile, const Mode& mode);

/// Largest residual over the band: its lobes are looked at as closely as the motion is long.
/// @throws MotionError as check_band.
double worst_residual_mm(const JerkProfile& profile, const ModeBand& band);

/// Time behind the end of the motion after which a vibration's envelope stays within the tolerance; infinite
/// for an undamped mode that doesn't.
/// @throws MotionError as check_mode, or if the residual is below 0, the tolerance isn't above 0, or one of
/// them isn't finite.
double settling_s(double residual_mm, const Mode& mode, double tolerance_mm);

/// Longest time from start to settled over the band.
/// @throws MotionError as check_band, or if the tolerance isn't above 0 and finite.
double worst_settled_s(const JerkProfile& profile, const ModeBand& band, double tolerance_mm);

// ---- Zhang & Zhang 2023 ----

/// Where and how finely the velocity is looked at.
struct MorletWindow {
  double cycle_s = 1e-3;  ///< interpolation cycle Ts, > 0
  int cycles = 26;        ///< n >= 1: cycles summed at the start and at the end (the paper: by experience)
  double omega0 = 6.0;    ///< >= 5, so that the wavelet's correction term may be left out (17)
};

/// Energy of the velocity at the mode's frequency (paper, eqs. (15)-(19)): sum of |Wf(u, s)| for u over the
/// first n cycles and the last n cycles of the motion, s = omega0 / (2 pi f), velocity in mm/s. The paper's
/// equations did not survive print; they are completed from its words.
/// @throws MotionError as check_mode, if the window is outside its ranges, or if the motion takes more than
/// ten million of its cycles.
double morlet_energy(const JerkProfile& profile, const Mode& mode, const MorletWindow& window);

/// Five levels of each factor of the orthogonal design.
struct TaguchiLevels {
  std::array<double, 5> acceleration_mm_s2, deceleration_mm_s2, jerk_acceleration_mm_s3,
      jerk_deceleration_mm_s3;
};

struct TaguchiRow {
  ScurveLimits limits;
  double duration_s = 0.0;
  double energy = 0.0;
};

/// The 25 rows of the orthogonal array L25 over A, D, Ja, Jd (columns i, j, i+j, i+2j modulo 5), each planned
/// and judged.
/// @throws MotionError as plan_scurve and morlet_energy.
std::vector<TaguchiRow> taguchi_rows(const TaguchiLevels& levels, double velocity_mm_s, double distance_mm,
                                     const Mode& mode, const MorletWindow& window);

/// Delta_max such that a share (0..1) of the rows lies at or below it; at least the least energy.
/// @throws MotionError if there are no rows, or the share is outside its range.
double energy_quantile(const std::vector<TaguchiRow>& rows, double share);

/// The fastest row whose energy is at most Delta_max; none if all are above.
/// @throws MotionError if Delta_max is no number.
std::optional<TaguchiRow> best_row(const std::vector<TaguchiRow>& rows, double energy_limit);

// ---- what users get ----

/// A move whose jerk times are one period of the mode, so that each build-up and removal of acceleration
/// leaves nothing behind (exactly, without damping). Limits are kept; a jerk limit too low for
/// one period gets a whole number of them. Where speed or distance are too small to reach A or D, the
/// acceleration is lower, so that the two jerks of a ramp follow each other.
/// @throws MotionError as plan_scurve and check_mode.
Scurve plan_jerk_matched(const ScurveLimits& limits, double distance_mm, const Mode& mode);

/// A measure of vibration that a profile must keep below a bound: residual or energy.
using VibrationMeasure = std::function<double(const JerkProfile&)>;

/// Bounds of A, D, Ja, Jd (jerks 1 and 5 count), and how many profiles are tried in all.
struct OptimumSearch {
  ScurveLimits lowest, highest;  ///< the speed limit is that of `highest`
  int evaluations = 2500;
};

/// Fastest S-curve over all of A, D, Ja, Jd whose measure is at most `bound`: COBYLA (Powell 1994, in NLopt)
/// in the limits' logarithms, from each row of an L25 design between the bounds. The best of these local
/// optima and never worse than the rows; none if nothing tried is within the bound.
/// @throws MotionError on limits or a distance that can't be planned, a lowest limit above the highest, or a
/// bound that isn't above 0.
std::optional<Scurve> optimum_profile(const OptimumSearch& search, double distance_mm,
                                      const VibrationMeasure& measure, double bound);

}  // namespace meltstage::motion
