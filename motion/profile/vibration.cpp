// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/vibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <nlopt.hpp>
#include <numbers>

#include "motion/profile/check_positive.hpp"
#include "motion/profile/course.hpp"
#include "motion/profile/over_band.hpp"
#include "motion/profile/profile_parts.hpp"

namespace meltstage::motion {
namespace {

struct Pole {
  double natural, damped;  // rad/s
  std::complex<double> lambda;

  explicit Pole(const Mode& mode)
      : natural(2.0 * std::numbers::pi * mode.frequency_hz),
        damped(natural * std::sqrt(1.0 - mode.damping_ratio * mode.damping_ratio)),
        lambda(-mode.damping_ratio * natural, damped) {}
};

void check_window(const MorletWindow& window, double duration_s) {
  check_positive("wavelet: cycle", window.cycle_s, "s");
  constexpr double kMostCycles = 1e7;
  if (!(duration_s / window.cycle_s <= kMostCycles))
    throw MotionError(fmt::format("wavelet: found a cycle of {} s, expected at most {:g} in {} s of motion",
                                  window.cycle_s, kMostCycles, duration_s));
  if (window.cycles < 1)
    throw MotionError(fmt::format("wavelet: found {} cycles, expected at least 1", window.cycles));
  if (!std::isfinite(window.omega0) || window.omega0 < 5.0)
    throw MotionError(
        fmt::format("wavelet: found omega0 {}, expected a finite number from 5", window.omega0));
}

/// A ramp between rest and a speed whose jerks each last the least whole number of periods that its limits
/// allow.
struct MatchedRamp {
  double highest_acceleration, highest_jerk, period_s;
  double acceleration = 0.0, jerk_s = 0.0;

  MatchedRamp(double speed, double acceleration_limit, double jerk_limit, double period)
      : highest_acceleration(acceleration_limit), highest_jerk(jerk_limit), period_s(period) {
    acceleration = highest_acceleration;
    jerk_s = whole_periods(highest_acceleration / highest_jerk);
    if (acceleration * jerk_s <= speed) return;
    // The acceleration isn't reached: the jerk that falls begins where the one that rises ends.
    jerk_s = whole_periods(std::max(speed / highest_acceleration, std::sqrt(speed / highest_jerk)));
    acceleration = speed / jerk_s;
  }

  double whole_periods(double least_s) const {
    constexpr double kRounding = 1e-12;  // a jerk that was made to take one period shall
    return period_s * std::max(1.0, std::ceil(least_s / period_s * (1.0 - kRounding)));
  }

  double way_mm(double speed) const {
    return speed > 0.0 ? 0.5 * speed * (jerk_s + speed / acceleration) : 0.0;
  }

  /// The highest speed for which the jerks need a period less; 0: there is none.
  double speed_with_a_period_less() const {
    const double less_s = std::max(0.0, jerk_s - period_s);
    return less_s < 0.5 * period_s ? 0.0
                                   : std::min(highest_acceleration * less_s, highest_jerk * less_s * less_s);
  }
};

std::array<double, 5> geometric_levels(double lowest, double highest) {
  std::array<double, 5> levels{};
  for (std::size_t i = 0; i < levels.size(); ++i)
    levels[i] = lowest * std::pow(highest / lowest, static_cast<double>(i) / 4.0);
  return levels;
}

std::vector<ScurveLimits> l25(const TaguchiLevels& levels, double velocity_mm_s) {
  std::vector<ScurveLimits> rows;
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t j = 0; j < 5; ++j)
      rows.push_back(asymmetric_limits(
          velocity_mm_s, levels.acceleration_mm_s2[i], levels.deceleration_mm_s2[j],
          levels.jerk_acceleration_mm_s3[(i + j) % 5], levels.jerk_deceleration_mm_s3[(i + 2 * j) % 5]));
  return rows;
}

/// One run of COBYLA; keeps the fastest profile within the bound of all that it tries.
struct Descent {
  const OptimumSearch& search;
  double distance_mm;
  const VibrationMeasure& measure;
  double bound;
  std::optional<Scurve> best;

  Scurve curve_of(const std::vector<double>& logs) const {
    return plan_scurve(asymmetric_limits(search.highest.velocity_mm_s, std::exp(logs[0]), std::exp(logs[1]),
                                         std::exp(logs[2]), std::exp(logs[3])),
                       distance_mm);
  }

  double excess(const Scurve& curve) {
    const double over = measure(curve) / bound - 1.0;
    if (over <= 0.0 && (!best || curve.duration_s < best->duration_s)) best = curve;
    return over;
  }
};

}  // namespace

void check_mode(const Mode& mode) {
  if (!std::isfinite(mode.frequency_hz) || mode.frequency_hz <= 0.0)
    throw MotionError(fmt::format("mode: found {} Hz, expected a finite number above 0", mode.frequency_hz));
  if (!(mode.damping_ratio >= 0.0 && mode.damping_ratio < 1.0))
    throw MotionError(
        fmt::format("mode: found damping ratio {}, expected 0..1, 1 excluded", mode.damping_ratio));
}

void check_band(const ModeBand& band) {
  check_mode(band.nominal);
  if (!(band.spread >= 0.0 && band.spread < 1.0))
    throw MotionError(fmt::format("mode: found spread {}, expected 0..1, 1 excluded", band.spread));
}

std::vector<Mode> modes_of(const ModeBand& band) {
  check_band(band);
  if (band.spread == 0.0) return {band.nominal};
  std::vector<Mode> modes(kBandFrequencies, band.nominal);
  for (int i = 0; i < kBandFrequencies; ++i)
    modes[static_cast<std::size_t>(i)].frequency_hz *=
        1.0 + band.spread * (2.0 * i / (kBandFrequencies - 1) - 1.0);
  return modes;
}

double residual_mm(const JerkProfile& profile, const Mode& mode) {
  check_mode(mode);
  const Pole pole(mode);
  std::complex<double> sum = 0.0;
  double jerk = 0.0;
  for (std::size_t i = 0; i < profile.segments; ++i) {
    const double next = profile.starts[i].jerk_mm_s3;
    sum += (next - jerk) * std::exp(pole.lambda * (profile.duration_s - profile.start_times_s[i]));
    jerk = next;
  }
  sum -= jerk;
  return std::abs(sum) / (pole.natural * pole.natural * pole.damped);
}

double worst_residual_mm(const JerkProfile& profile, const ModeBand& band) {
  return largest_over(band, profile.duration_s, [&](const Mode& mode) { return residual_mm(profile, mode); })
      .value;
}

double settling_s(double residual, const Mode& mode, double tolerance_mm) {
  check_mode(mode);
  check_positive("tolerance", tolerance_mm, "mm");
  if (!std::isfinite(residual) || residual < 0.0)
    throw MotionError(fmt::format("residual: found {} mm, expected a finite number from 0", residual));
  if (residual <= tolerance_mm) return 0.0;
  const double decay = mode.damping_ratio * 2.0 * std::numbers::pi * mode.frequency_hz;
  return std::log(residual / tolerance_mm) / decay;
}

double worst_settled_s(const JerkProfile& profile, const ModeBand& band, double tolerance_mm) {
  const auto settled_s = [&](const Mode& mode) {
    return settling_s(residual_mm(profile, mode), mode, tolerance_mm);
  };
  return profile.duration_s + largest_over(band, profile.duration_s, settled_s).value;
}

double morlet_energy(const JerkProfile& profile, const Mode& mode, const MorletWindow& window) {
  check_mode(mode);
  check_window(window, profile.duration_s);
  const double scale_s = window.omega0 / (2.0 * std::numbers::pi * mode.frequency_hz);
  constexpr double kReach = 5.0;  // the wavelet's Gaussian is below 4e-6 beyond
  const auto coefficient = [&](double at_s) {
    const auto first = static_cast<int>(std::ceil(std::max(0.0, at_s - kReach * scale_s) / window.cycle_s));
    const auto last =
        static_cast<int>(std::floor(std::min(profile.duration_s, at_s + kReach * scale_s) / window.cycle_s));
    std::complex<double> sum = 0.0;
    for (int i = first; i <= last; ++i) {
      const double x = (i * window.cycle_s - at_s) / scale_s;
      sum += profile.sample(i * window.cycle_s).velocity_mm_s *
             std::exp(std::complex(-0.5 * x * x, -window.omega0 * x));
    }
    const double norm = std::pow(std::numbers::pi, -0.25) / std::sqrt(scale_s);
    return norm * window.cycle_s * std::abs(sum);
  };
  double energy = 0.0;
  for (int i = 0; i < window.cycles; ++i)
    energy += coefficient(i * window.cycle_s) + coefficient(profile.duration_s - i * window.cycle_s);
  return energy;
}

std::vector<TaguchiRow> taguchi_rows(const TaguchiLevels& levels, double velocity_mm_s, double distance_mm,
                                     const Mode& mode, const MorletWindow& window) {
  std::vector<TaguchiRow> rows;
  for (const ScurveLimits& limits : l25(levels, velocity_mm_s)) {
    const Scurve curve = plan_scurve(limits, distance_mm);
    rows.push_back({limits, curve.duration_s, morlet_energy(curve, mode, window)});
  }
  return rows;
}

double energy_quantile(const std::vector<TaguchiRow>& rows, double share) {
  if (rows.empty()) throw MotionError("energy: found no rows, expected at least one");
  if (!(share >= 0.0 && share <= 1.0))
    throw MotionError(fmt::format("energy: found a share of {}, expected 0..1", share));
  std::vector<double> energies;
  for (const TaguchiRow& row : rows) energies.push_back(row.energy);
  const auto count = static_cast<std::size_t>(share * static_cast<double>(rows.size()));
  const auto at = energies.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(count, 1) - 1);
  std::nth_element(energies.begin(), at, energies.end());
  return *at;
}

std::optional<TaguchiRow> best_row(const std::vector<TaguchiRow>& rows, double energy_limit) {
  if (std::isnan(energy_limit)) throw MotionError("energy: found a limit of nan, expected a number");
  std::optional<TaguchiRow> best;
  for (const TaguchiRow& row : rows)
    if (row.energy <= energy_limit && (!best || row.duration_s < best->duration_s)) best = row;
  return best;
}

Scurve plan_jerk_matched(const ScurveLimits& limits, double distance_mm, const Mode& mode) {
  check_limits(limits);
  check_mode(mode);
  const double period_s =
      1.0 / (mode.frequency_hz * std::sqrt(1.0 - mode.damping_ratio * mode.damping_ratio));
  if (!(distance_mm > 0.0)) return plan_scurve(limits, distance_mm);
  const auto speeding_up = [&](double speed) {
    return MatchedRamp(speed, limits.acceleration_mm_s2, std::min(limits.jerk1_mm_s3, limits.jerk3_mm_s3),
                       period_s);
  };
  const auto slowing_down = [&](double speed) {
    return MatchedRamp(speed, limits.deceleration_mm_s2, std::min(limits.jerk5_mm_s3, limits.jerk7_mm_s3),
                       period_s);
  };
  const auto at_speed = [&](double speed) {
    const MatchedRamp up = speeding_up(speed), down = slowing_down(speed);
    return plan_scurve(asymmetric_limits(speed, up.acceleration, down.acceleration,
                                         up.acceleration / up.jerk_s, down.acceleration / down.jerk_s),
                       distance_mm);
  };
  // The highest speed whose ramps fit, with what is left of the way passed at it; or a lower one, if the last
  // bit of speed costs a period more than it saves.
  const double four_jerks = 0.5 * distance_mm / period_s;
  const double highest = root_of_rising(
      [&](double speed) {
        return speeding_up(speed).way_mm(speed) + slowing_down(speed).way_mm(speed) - distance_mm;
      },
      0.0, std::min(limits.velocity_mm_s, four_jerks));
  Scurve fastest = at_speed(highest);
  for (const MatchedRamp& ramp : {speeding_up(highest), slowing_down(highest)})
    if (const double lower = ramp.speed_with_a_period_less(); lower > 0.0)
      if (const Scurve curve = at_speed(lower); curve.duration_s < fastest.duration_s) fastest = curve;
  return fastest;
}

std::optional<Scurve> optimum_profile(const OptimumSearch& search, double distance_mm,
                                      const VibrationMeasure& measure, double bound) {
  if (!(bound > 0.0))
    throw MotionError(fmt::format("optimum: found a bound of {}, expected a number above 0", bound));
  check_limits(search.lowest);
  check_limits(search.highest);
  constexpr std::array kFactors = {&ScurveLimits::acceleration_mm_s2, &ScurveLimits::deceleration_mm_s2,
                                   &ScurveLimits::jerk1_mm_s3, &ScurveLimits::jerk5_mm_s3};
  std::array<std::array<double, 5>, 4> levels{};
  std::vector<double> low, high;
  for (std::size_t i = 0; i < kFactors.size(); ++i) {
    const double lowest = search.lowest.*kFactors[i], highest = search.highest.*kFactors[i];
    if (lowest > highest)
      throw MotionError(
          fmt::format("optimum: found lowest limit {}, expected at most the highest, {}", lowest, highest));
    levels[i] = geometric_levels(lowest, highest);
    low.push_back(std::log(lowest));
    high.push_back(std::log(highest));
  }

  Descent descent{search, distance_mm, measure, bound, {}};
  nlopt::opt cobyla(nlopt::LN_COBYLA, static_cast<unsigned>(kFactors.size()));
  cobyla.set_lower_bounds(low);
  cobyla.set_upper_bounds(high);
  cobyla.set_min_objective([](const std::vector<double>& x, std::vector<double>&,
                              void* data) { return static_cast<Descent*>(data)->curve_of(x).duration_s; },
                           &descent);
  cobyla.add_inequality_constraint(
      [](const std::vector<double>& x, std::vector<double>&, void* data) {
        auto& run = *static_cast<Descent*>(data);
        return run.excess(run.curve_of(x));
      },
      &descent, 0.0);
  cobyla.set_initial_step(0.2);
  cobyla.set_xtol_rel(1e-6);
  cobyla.set_maxeval(std::max(1, search.evaluations / 25));
  for (const ScurveLimits& row :
       l25({levels[0], levels[1], levels[2], levels[3]}, search.highest.velocity_mm_s)) {
    std::vector<double> x;
    for (std::size_t i = 0; i < kFactors.size(); ++i)
      x.push_back(std::clamp(std::log(row.*kFactors[i]), low[i], high[i]));
    descent.excess(descent.curve_of(x));
    double duration_s = 0.0;
    try {
      cobyla.optimize(x, duration_s);
    } catch (const nlopt::roundoff_limited&) {  // as near as rounding allows; the best seen is kept anyway
    }
  }
  return descent.best;
}

}  // namespace meltstage::motion
