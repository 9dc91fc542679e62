// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/shaping.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>
#include <vector>

#include "base/golden_section.hpp"
#include "motion/profile/over_band.hpp"
#include "motion/profile/profile_parts.hpp"

namespace meltstage::motion {
namespace {

double damped_period_s(const Mode& mode) {
  return 1.0 / (mode.frequency_hz * std::sqrt(1.0 - mode.damping_ratio * mode.damping_ratio));
}

/// Decay of the mode over half a damped period.
double half_period_decay(const Mode& mode) {
  return std::exp(-mode.damping_ratio * std::numbers::pi /
                  std::sqrt(1.0 - mode.damping_ratio * mode.damping_ratio));
}

Shaper normalized(std::initializer_list<double> amplitudes, std::initializer_list<double> times_s) {
  Shaper shaper;
  shaper.impulses = amplitudes.size();
  std::copy(amplitudes.begin(), amplitudes.end(), shaper.amplitudes.begin());
  std::copy(times_s.begin(), times_s.end(), shaper.times_s.begin());
  double sum = 0.0;
  for (const double amplitude : amplitudes) sum += amplitude;
  for (double& amplitude : shaper.amplitudes) amplitude /= sum;
  return shaper;
}

/// @throws MotionError unless the shaper keeps what a Shaper promises.
void check_shaper(const Shaper& shaper) {
  if (shaper.impulses < 1 || shaper.impulses > Shaper::kMostImpulses)
    throw MotionError(
        fmt::format("shaper: found {} impulses, expected 1 to {}", shaper.impulses, Shaper::kMostImpulses));
  double sum = 0.0, before_s = 0.0;
  for (std::size_t i = 0; i < shaper.impulses; ++i) {
    const double amplitude = shaper.amplitudes[i], time_s = shaper.times_s[i];
    if (!std::isfinite(amplitude) || amplitude < 0.0)
      throw MotionError(
          fmt::format("shaper: found amplitude {}, expected numbers from 0 that sum to 1", amplitude));
    if (!std::isfinite(time_s) || time_s < before_s || (i == 0 && time_s != 0.0))
      throw MotionError(
          fmt::format("shaper: found impulse {} at {} s, expected the first at 0 s and none before another",
                      i + 1, time_s));
    sum += amplitude;
    before_s = time_s;
  }
  constexpr double kRounding = 1e-9;
  if (std::abs(sum - 1.0) > kRounding)
    throw MotionError(
        fmt::format("shaper: found amplitudes that sum to {}, expected numbers from 0 that sum to 1", sum));
}

/// State at `time_s` by the segment that holds `inside_s`; at rest before the start and after the end.
MotionState state_in_segment(const JerkProfile& profile, double time_s, double inside_s) {
  if (inside_s <= 0.0) return {profile.starts.front().position_mm, 0.0, 0.0, 0.0};
  if (inside_s >= profile.duration_s) return {profile.end.position_mm, 0.0, 0.0, 0.0};
  std::size_t segment = 0;
  while (segment + 1 < profile.segments && inside_s >= profile.start_times_s[segment + 1]) ++segment;
  return after(profile.starts[segment], std::max(0.0, time_s - profile.start_times_s[segment]));
}

/// What a motion leaves in one mode of the band.
struct Rest {
  std::complex<double> lambda;
  double decay_s = 0.0;  ///< 1 / (zeta w)
  double residual_mm = 0.0;
};

std::complex<double> pole(const Mode& mode) {
  const double natural = 2.0 * std::numbers::pi * mode.frequency_hz;
  return {-mode.damping_ratio * natural, natural * std::sqrt(1.0 - mode.damping_ratio * mode.damping_ratio)};
}

/// Three impulses at a spacing, the middle one with the share `middle`; the outer two are as a step's
/// ring-down would want them. All three are as they cancel best at the centre of the band.
struct Triple {
  double spacing_s = 0.0, middle = 0.0;

  std::array<double, 3> amplitudes(double centre_decay) const {
    const double later = centre_decay * centre_decay;  // of one spacing, twice
    return {(1.0 - middle) / (1.0 + later), middle, (1.0 - middle) * later / (1.0 + later)};
  }
};

/// The search for shortest_shaper.
class TripleSearch {
 public:
  TripleSearch(const JerkProfile& profile, const ModeBand& band, double tolerance_mm)
      : centre_(band.nominal), tolerance_mm_(kKeptBack * tolerance_mm) {
    for (const Mode& mode : modes_of(band)) look_at(mode, motion::residual_mm(profile, mode));
  }

  void look_at(const Mode& mode, double residual_mm) {
    const std::complex<double> lambda = pole(mode);
    rests_.push_back({lambda, -1.0 / lambda.real(), residual_mm});
  }

  /// The shortest one that leaves less than the tolerance at what has been looked at; where none does, the
  /// one that settles first.
  Triple find() const {
    if (residual({}) <= 1.0) return {};
    constexpr int kSteps = 128;
    const double step_s = 0.5 * damped_period_s(centre_) / kSteps;
    // Without damping none of them settles: then the one that leaves least.
    const auto rank = [&](const Triple& triple) { return std::pair(settled_s(triple), residual(triple)); };
    Triple best;
    for (int i = 1; i <= kSteps; ++i) {
      const Triple triple = best_at(i * step_s);
      if (residual(triple) > 1.0) {
        if (rank(triple) < rank(best)) best = triple;
        continue;
      }
      double low = triple.spacing_s - step_s, high = triple.spacing_s;
      for (int halving = 0; halving < 12; ++halving) {
        const double middle = 0.5 * (low + high);
        (residual(best_at(middle)) <= 1.0 ? high : low) = middle;
      }
      return best_at(high);
    }
    return best;
  }

  /// Largest residual over the band, in tolerances.
  double residual(const Triple& triple) const {
    const double decay = centre_decay(triple.spacing_s);
    const auto [first, second, third] = triple.amplitudes(decay);
    double worst = 0.0;
    for (const Rest& rest : rests_) {
      const std::complex<double> turn = std::exp(rest.lambda * triple.spacing_s);
      worst = std::max(worst, rest.residual_mm * std::abs((first * turn + second) * turn + third));
    }
    return worst / tolerance_mm_;
  }

  /// Spacing's best middle share. The residual of each frequency is convex in it, and so is their largest.
  Triple best_at(double spacing_s) const {
    constexpr int kSteps = 24;
    const auto residual_of = [&](double share) { return residual({spacing_s, share}); };
    return {spacing_s, least_between(residual_of, 0.0, 1.0, kSteps).second};
  }

  /// Longest time from the motion's own end to settled over the band.
  double settled_s(const Triple& triple) const {
    const double over = residual(triple);
    // The slowest decay of the band, a little more than the exact worst.
    double slowest_s = 0.0;
    for (const Rest& rest : rests_) slowest_s = std::max(slowest_s, rest.decay_s);
    return 2.0 * triple.spacing_s + (over > 1.0 ? slowest_s * std::log(over) : 0.0);
  }

  Shaper shaper(const Triple& triple) const {
    const auto [first, second, third] = triple.amplitudes(centre_decay(triple.spacing_s));
    return normalized({first, second, third}, {0.0, triple.spacing_s, 2.0 * triple.spacing_s});
  }

 private:
  double centre_decay(double spacing_s) const { return std::exp(pole(centre_).real() * spacing_s); }

  static constexpr double kKeptBack = 0.99;  // for the frequencies between those looked at

  Mode centre_;
  double tolerance_mm_;
  std::vector<Rest> rests_;
};

}  // namespace

Shaper zv_shaper(const Mode& mode) {
  check_mode(mode);
  return normalized({1.0, half_period_decay(mode)}, {0.0, 0.5 * damped_period_s(mode)});
}

Shaper zvd_shaper(const Mode& mode) {
  check_mode(mode);
  const double decay = half_period_decay(mode), period_s = damped_period_s(mode);
  return normalized({1.0, 2.0 * decay, decay * decay}, {0.0, 0.5 * period_s, period_s});
}

Shaper mzv_shaper(const Mode& mode) {
  check_mode(mode);
  const double decay = std::pow(half_period_decay(mode), 0.75), period_s = damped_period_s(mode);
  const double outer = 1.0 - std::numbers::sqrt2 / 2.0;
  return normalized({outer, (std::numbers::sqrt2 - 1.0) * decay, outer * decay * decay},
                    {0.0, 0.375 * period_s, 0.75 * period_s});
}

Shaper ei_shaper(const Mode& mode, double tolerated) {
  check_mode(mode);
  if (!(tolerated >= 0.0 && tolerated < 1.0))
    throw MotionError(
        fmt::format("EI shaper: found tolerated vibration {}, expected 0..1, 1 excluded", tolerated));
  const double decay = half_period_decay(mode), period_s = damped_period_s(mode);
  return normalized(
      {0.25 * (1.0 + tolerated), 0.5 * (1.0 - tolerated) * decay, 0.25 * (1.0 + tolerated) * decay * decay},
      {0.0, 0.5 * period_s, period_s});
}

double vibration_share(const Shaper& shaper, const Mode& mode) {
  check_shaper(shaper);
  check_mode(mode);
  const std::complex<double> lambda = pole(mode);
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < shaper.impulses; ++i)
    sum += shaper.amplitudes[i] * std::exp(lambda * (shaper.duration_s() - shaper.times_s[i]));
  return std::abs(sum);
}

JerkProfile shaped(const JerkProfile& profile, const Shaper& shaper) {
  check_shaper(shaper);
  if (profile.segments == 0 || shaper.impulses == 1) return profile;
  if (profile.starts.front().velocity_mm_s != 0.0 || profile.end.velocity_mm_s != 0.0)
    throw MotionError(fmt::format("shaper: found a motion from {} to {} mm/s, expected rest at both ends",
                                  profile.starts.front().velocity_mm_s, profile.end.velocity_mm_s));
  std::vector<double> borders_s;
  for (std::size_t i = 0; i < shaper.impulses; ++i) {
    for (std::size_t k = 0; k < profile.segments; ++k)
      borders_s.push_back(shaper.times_s[i] + profile.start_times_s[k]);
    borders_s.push_back(shaper.times_s[i] + profile.duration_s);
  }
  std::sort(borders_s.begin(), borders_s.end());

  // Each state comes from the motion itself, so that no rounding adds up from segment to segment; and from
  // that segment of it in which the middle lies, as a border is not exact.
  const auto start_of = [&](double border_s, double middle_s) {
    MotionState sum;
    for (std::size_t i = 0; i < shaper.impulses; ++i) {
      const MotionState own =
          state_in_segment(profile, border_s - shaper.times_s[i], middle_s - shaper.times_s[i]);
      sum.position_mm += shaper.amplitudes[i] * own.position_mm;
      sum.velocity_mm_s += shaper.amplitudes[i] * own.velocity_mm_s;
      sum.acceleration_mm_s2 += shaper.amplitudes[i] * own.acceleration_mm_s2;
      sum.jerk_mm_s3 += shaper.amplitudes[i] * own.jerk_mm_s3;
    }
    return sum;
  };
  JerkProfile sum;
  sum.duration_s = profile.duration_s + shaper.duration_s();
  sum.end = profile.end;
  constexpr double kShortest_s = 1e-15;  // two borders that are one but for rounding
  for (std::size_t i = 0; i + 1 < borders_s.size(); ++i) {
    const double length_s = borders_s[i + 1] - borders_s[i];
    if (length_s <= kShortest_s) continue;
    if (sum.segments == JerkProfile::kMostSegments)
      throw MotionError(
          fmt::format("shaper: {} impulses on {} segments, expected at most {} segments together",
                      shaper.impulses, profile.segments, JerkProfile::kMostSegments));
    sum.start_times_s[sum.segments] = borders_s[i];
    sum.durations_s[sum.segments] = length_s;
    sum.starts[sum.segments++] = start_of(borders_s[i], 0.5 * (borders_s[i] + borders_s[i + 1]));
  }
  return sum;
}

Shaper shortest_shaper(const JerkProfile& profile, const ModeBand& band, double tolerance_mm) {
  if (!(tolerance_mm > 0.0) || !std::isfinite(tolerance_mm))
    throw MotionError(fmt::format("tolerance: found {} mm, expected a finite number above 0", tolerance_mm));
  TripleSearch search(profile, band, tolerance_mm);
  // What it leaves between the frequencies looked at is looked at, too, until that is within the tolerance.
  constexpr int kMostRounds = 100;
  for (int round = 0;; ++round) {
    const Triple triple = search.find();
    const Shaper shaper = triple.spacing_s == 0.0 ? Shaper{} : search.shaper(triple);
    const auto left_mm = [&](const Mode& mode) {
      return residual_mm(profile, mode) * vibration_share(shaper, mode);
    };
    const AtMode worst = largest_over(band, profile.duration_s + shaper.duration_s(), left_mm);
    if (worst.value <= tolerance_mm || search.residual(triple) > 1.0 || round == kMostRounds) return shaper;
    search.look_at(worst.mode, residual_mm(profile, worst.mode));
  }
}

JerkProfile plan_quiet_move(const ScurveLimits& limits, double distance_mm, const ModeBand& band,
                            double tolerance_mm) {
  const JerkProfile fastest = plan_scurve(limits, distance_mm);
  return shaped(fastest, shortest_shaper(fastest, band, tolerance_mm));
}

}  // namespace meltstage::motion
