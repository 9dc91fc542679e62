// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/jetting.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "motion/profile/check_positive.hpp"

namespace meltstage::motion {
namespace {

constexpr double kGolden = 0.6180339887498949;
constexpr double kSlowest_mm_s = 1.0;  // below, a row would be passed in no time worth a trigger

void check_range(std::string_view what, double low, double high) {
  if (!std::isfinite(low) || !std::isfinite(high) || low <= 0.0 || low > high)
    throw MotionError(
        fmt::format("waveform range: found {} {}..{}, expected finite numbers above 0, the smaller first",
                    what, low, high));
}

/// Measures and counts, until it may not any more.
class Tuner {
 public:
  Tuner(const WaveformRange& range, const DropletBand& band,
        const std::function<std::optional<DropletFigures>(const Waveform&)>& measure, int most)
      : range_(range), band_(band), measure_(measure), most_(most) {}

  TunedWaveform run() {
    Waveform waveform = range_.lowest;
    waveform.dwell_us = fastest_dwell_us(waveform);
    while (true) {
      tune_amplitude(waveform);
      const bool fast_enough = best_.droplet && in_velocity_band(*best_.droplet);
      if (!best_.shortfall || !fast_enough || waveform.fall_us >= range_.highest.fall_us || spent()) break;
      waveform.fall_us = std::min(1.5 * waveform.fall_us, range_.highest.fall_us);
    }
    best_.measurements = measurements_;
    return best_;
  }

 private:
  bool spent() const { return measurements_ >= most_; }
  /// The amplitude keeps enough to be found.
  int left_for_dwells() const {
    constexpr int kForAmplitude = 20;
    return std::max(0, most_ - measurements_ - kForAmplitude);
  }
  double middle_m_s() const { return 0.5 * (band_.slowest_m_s + band_.fastest_m_s); }
  bool in_velocity_band(const DropletFigures& droplet) const {
    return droplet.velocity_m_s >= band_.slowest_m_s && droplet.velocity_m_s <= band_.fastest_m_s;
  }

  std::optional<DropletFigures> look(const Waveform& waveform) {
    if (spent()) return std::nullopt;
    ++measurements_;
    return measure_(waveform);
  }

  /// Speed at an amplitude, 0 without a droplet; the droplet becomes the result.
  double judge(const Waveform& waveform) {
    best_.waveform = waveform;
    best_.droplet = look(waveform);
    best_.shortfall = best_.droplet ? why_out_of_band(band_, *best_.droplet) : "no droplet";
    return best_.droplet ? best_.droplet->velocity_m_s : 0.0;
  }

  /// Looks for droplets at seven dwells, at half the amplitude's range and at its end; then, for a resonance
  /// that is narrower than their steps, between them.
  double fastest_dwell_us(Waveform waveform) {
    constexpr int kDwells = 7;
    double step_us = (range_.highest.dwell_us - range_.lowest.dwell_us) / (kDwells - 1);
    for (const double share : {0.5, 1.0}) {
      waveform.amplitude_v =
          range_.lowest.amplitude_v + share * (range_.highest.amplitude_v - range_.lowest.amplitude_v);
      const auto found = fastest_of(waveform, range_.lowest.dwell_us, step_us, kDwells);
      if (found) return peak_us(waveform, *found, step_us);
    }
    constexpr int kHalvings = 5;
    int between = kDwells - 1;
    for (int i = 0; i < kHalvings; ++i, between *= 2) {
      const double first_us = range_.lowest.dwell_us + 0.5 * step_us;
      const auto found = fastest_of(waveform, first_us, step_us, std::min(between, left_for_dwells()));
      step_us *= 0.5;
      if (found) return peak_us(waveform, *found, step_us);
    }
    return 0.5 * (range_.lowest.dwell_us + range_.highest.dwell_us);
  }

  /// A dwell and the speed there; above 0.
  struct Heard {
    double dwell_us, speed_m_s;
  };

  std::optional<Heard> fastest_of(const Waveform& waveform, double first_us, double step_us, int count) {
    std::optional<Heard> fastest;
    for (int i = 0; i < count; ++i) {
      const double dwell_us = first_us + i * step_us;
      const double speed_m_s = speed_at(waveform, dwell_us);
      if (speed_m_s > (fastest ? fastest->speed_m_s : 0.0)) fastest = {dwell_us, speed_m_s};
    }
    return fastest;
  }

  /// 0 without a droplet; no number outside the range, which compares as neither slower nor faster.
  double speed_at(Waveform waveform, double dwell_us) {
    const double slack_us = 1e-9 * range_.highest.dwell_us;
    if (dwell_us < range_.lowest.dwell_us - slack_us || dwell_us > range_.highest.dwell_us + slack_us)
      return NAN;
    waveform.dwell_us = std::clamp(dwell_us, range_.lowest.dwell_us, range_.highest.dwell_us);
    const auto droplet = look(waveform);
    return droplet ? droplet->velocity_m_s : 0.0;
  }

  /// The step is halved around the fastest dwell until the droplets a step beside it are at least half as
  /// fast, or, at an end of the range, as long as that tells more; the peak is then the parabola's over the
  /// three.
  double peak_us(const Waveform& waveform, Heard peak, double step_us) {
    constexpr double kFinest_us = 0.5;
    double below = NAN, above = NAN;
    const auto look_beside = [&](double beside_us) {
      below = speed_at(waveform, peak.dwell_us - beside_us);
      above = speed_at(waveform, peak.dwell_us + beside_us);
    };
    if (left_for_dwells() < 2) return peak.dwell_us;
    look_beside(step_us);
    const auto flat = [&] { return below >= 0.5 * peak.speed_m_s && above >= 0.5 * peak.speed_m_s; };
    while (!flat() && step_us > kFinest_us && left_for_dwells() >= 2) {
      step_us *= 0.5;
      const double far_below = below, far_above = above;
      look_beside(step_us);
      if (below > peak.speed_m_s && !(above > below)) {
        above = peak.speed_m_s;
        peak = {peak.dwell_us - step_us, below};
        below = far_below;
      } else if (above > peak.speed_m_s) {
        below = peak.speed_m_s;
        peak = {peak.dwell_us + step_us, above};
        above = far_above;
      }
    }
    const double curvature = below - 2.0 * peak.speed_m_s + above;
    return curvature < 0.0 ? peak.dwell_us + 0.5 * (below - above) / curvature * step_us : peak.dwell_us;
  }

  /// Regula falsi with the Illinois change (Dowell & Jarratt 1971) on the velocity's distance from the band's
  /// middle.
  void tune_amplitude(Waveform& waveform) {
    double low = range_.lowest.amplitude_v, high = range_.highest.amplitude_v;
    waveform.amplitude_v = high;
    double above = judge(waveform) - middle_m_s();
    if (above < 0.0) return;  // too slow at any amplitude: that is what is reported
    double below = -middle_m_s();
    int last_side = 0;
    while (!spent() && high - low > 1e-3) {
      // Where no droplet came, the velocity says nothing of how far off the amplitude is: halve.
      const bool known = below > -middle_m_s();
      waveform.amplitude_v = known ? (low * above - high * below) / (above - below) : 0.5 * (low + high);
      const double error = judge(waveform) - middle_m_s();
      if (best_.droplet && in_velocity_band(*best_.droplet)) return;
      const int side = error < 0.0 ? -1 : 1;
      if (side < 0) {
        low = waveform.amplitude_v;
        below = error;
        if (last_side < 0) above *= 0.5;
      } else {
        high = waveform.amplitude_v;
        above = error;
        if (last_side > 0 && known) below *= 0.5;
      }
      last_side = side;
    }
  }

  const WaveformRange& range_;
  const DropletBand& band_;
  const std::function<std::optional<DropletFigures>(const Waveform&)>& measure_;
  int most_;
  int measurements_ = 0;
  TunedWaveform best_;
};

/// Ways of a ramp up to a speed and down from it.
struct Ramps {
  double up_mm, down_mm, time_s;
};

ScurveLimits at_speed(ScurveLimits limits, double speed_mm_s) {
  limits.velocity_mm_s = speed_mm_s;
  return limits;
}

Ramps ramps_at(const ScurveLimits& limits, double speed_mm_s) {
  // Long enough for a cruise: twice what the ramps could take with constant jerks alone.
  const ScurveLimits l = at_speed(limits, speed_mm_s);
  const double low_a = std::min(l.acceleration_mm_s2, l.deceleration_mm_s2);
  const double low_j = std::min({l.jerk1_mm_s3, l.jerk3_mm_s3, l.jerk5_mm_s3, l.jerk7_mm_s3});
  const double high_a = std::max(l.acceleration_mm_s2, l.deceleration_mm_s2);
  const double ramp_s = speed_mm_s / low_a + high_a / low_j + 2.0 * std::sqrt(speed_mm_s / low_j);
  const Scurve curve = plan_scurve(l, 4.0 * speed_mm_s * ramp_s);
  return {curve.starts[3].position_mm, curve.end.position_mm - curve.starts[4].position_mm,
          curve.duration_s - curve.durations_s[3]};
}

/// The speed at which a row of this length takes the least time: T(v) = ramps(v) + length / v has one
/// minimum.
double best_speed_mm_s(const ScurveLimits& limits, double length_mm, double highest_mm_s) {
  const auto time_s = [&](double speed) { return ramps_at(limits, speed).time_s + length_mm / speed; };
  double low = std::min(kSlowest_mm_s, highest_mm_s), high = highest_mm_s;
  for (int i = 0; i < 60 && high - low > 1e-9 * highest_mm_s; ++i) {
    const double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    if (time_s(a) < time_s(b))
      high = b;
    else
      low = a;
  }
  return time_s(highest_mm_s) <= time_s(0.5 * (low + high)) ? highest_mm_s : 0.5 * (low + high);
}

void not_negative(std::string_view what, double value) {
  if (!std::isfinite(value) || value < 0.0)
    throw MotionError(fmt::format("fly-by: found {} {}, expected a finite number from 0", what, value));
}

void check(const FlyByConfig& config) {
  const auto positive = [](std::string_view what, double value) {
    if (!std::isfinite(value) || value <= 0.0)
      throw MotionError(fmt::format("fly-by: found {} {}, expected a finite number above 0", what, value));
  };
  positive("droplets a second", config.droplets_per_s);
  positive("encoder count [mm]", config.encoder_mm);
  positive("row tolerance [mm]", config.row_tolerance_mm);
  not_negative("latency [s]", config.latency_s);
  not_negative("flight [s]", config.flight_s);
  not_negative("settle time [s]", config.settle_s);
  not_negative("way that the axis may be behind [mm]", config.follow_mm);
}

/// Indices of the bumps row by row, each row in order of x.
std::vector<std::vector<std::size_t>> rows_of(std::span<const Point> bumps, double tolerance_mm) {
  std::vector<std::size_t> order(bumps.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return bumps[a].y_mm < bumps[b].y_mm; });
  std::vector<std::vector<std::size_t>> rows;
  for (const std::size_t i : order) {
    if (rows.empty() || bumps[i].y_mm - bumps[rows.back().front()].y_mm >= tolerance_mm) rows.emplace_back();
    rows.back().push_back(i);
  }
  for (auto& row : rows)
    std::stable_sort(row.begin(), row.end(),
                     [&](std::size_t a, std::size_t b) { return bumps[a].x_mm < bumps[b].x_mm; });
  return rows;
}

double nearest_gap_mm(std::span<const Point> bumps, const std::vector<std::size_t>& row) {
  double gap_mm = INFINITY;
  for (std::size_t i = 1; i < row.size(); ++i) {
    gap_mm = std::min(gap_mm, bumps[row[i]].x_mm - bumps[row[i - 1]].x_mm);
    if (!(gap_mm > 0.0))
      throw MotionError(
          fmt::format("fly-by: found the bumps of rows {} and {} at one place, expected each once",
                      bumps[row[i - 1]].row, bumps[row[i]].row));
  }
  return gap_mm;
}

double row_y_mm(std::span<const Point> bumps, const std::vector<std::size_t>& row) {
  double sum = 0.0;
  for (const std::size_t i : row) sum += bumps[i].y_mm;
  return sum / static_cast<double>(row.size());
}

/// The way between two rows at full speed, either way.
Scurve way_between(const FlyByConfig& config, double from_mm, double to_mm) {
  return plan_scurve(config.x, std::abs(to_mm - from_mm));
}

/// Two rows to and fro: one turning point for both, the farther, if the row that is made longer takes no more
/// time for that than a way of its own between them would.
void join_turns(const FlyByConfig& config, FlyByRow& before, FlyByRow& row, double direction) {
  const double beyond_mm = direction * (row.from_x_mm - before.to_x_mm);
  FlyByRow& longer = beyond_mm > 0.0 ? before : row;
  if (std::abs(beyond_mm) / longer.speed_mm_s > way_between(config, before.to_x_mm, row.from_x_mm).duration_s)
    return;
  before.to_x_mm = row.from_x_mm = beyond_mm > 0.0 ? row.from_x_mm : before.to_x_mm;
}

/// Where the encoder's shown count changes to `count` when it comes from below (+1) or above (-1).
double edge_mm(std::int64_t count, double direction, double encoder_mm) {
  return (static_cast<double>(count) - 0.5 * direction) * encoder_mm;
}

}  // namespace

double duration_us(const Waveform& waveform) {
  return waveform.rise_us + waveform.dwell_us + waveform.fall_us;
}

double waveform_v(const Waveform& waveform, double time_us) {
  if (time_us <= 0.0 || time_us >= duration_us(waveform)) return 0.0;
  if (time_us < waveform.rise_us) return waveform.amplitude_v * time_us / waveform.rise_us;
  if (time_us <= waveform.rise_us + waveform.dwell_us) return waveform.amplitude_v;
  return waveform.amplitude_v * (duration_us(waveform) - time_us) / waveform.fall_us;
}

std::optional<std::string> why_out_of_band(const DropletBand& band, const DropletFigures& droplet) {
  if (!(droplet.velocity_m_s >= band.slowest_m_s && droplet.velocity_m_s <= band.fastest_m_s))
    return fmt::format("velocity {:.3f} m/s, expected {:.2f}..{:.2f} m/s", droplet.velocity_m_s,
                       band.slowest_m_s, band.fastest_m_s);
  if (droplet.satellites > band.most_satellites)
    return fmt::format("{} satellites, expected at most {}", droplet.satellites, band.most_satellites);
  if (!(droplet.roundness >= band.least_roundness))
    return fmt::format("roundness {:.3f}, expected at least {:.2f}", droplet.roundness, band.least_roundness);
  if (!(std::abs(droplet.angle_deg) <= band.largest_angle_deg))
    return fmt::format("flight {:.2f} deg off, expected at most {:.1f} deg", droplet.angle_deg,
                       band.largest_angle_deg);
  return std::nullopt;
}

TunedWaveform tune_waveform(const WaveformRange& range, const DropletBand& band,
                            const std::function<std::optional<DropletFigures>(const Waveform&)>& measure,
                            int most_measurements) {
  check_range("amplitude [V]", range.lowest.amplitude_v, range.highest.amplitude_v);
  check_range("rise [us]", range.lowest.rise_us, range.highest.rise_us);
  check_range("dwell [us]", range.lowest.dwell_us, range.highest.dwell_us);
  check_range("fall [us]", range.lowest.fall_us, range.highest.fall_us);
  if (!(band.slowest_m_s > 0.0 && band.slowest_m_s < band.fastest_m_s))
    throw MotionError(
        fmt::format("droplet band: found {}..{} m/s, expected numbers above 0, the smaller first",
                    band.slowest_m_s, band.fastest_m_s));
  return Tuner(range, band, measure, most_measurements).run();
}

std::optional<std::string> why_not_print(const PrintReadiness& readiness, const DropletBand& band) {
  if (readiness.inhibited) return "print: found the emergency stop or a fault active, expected it cleared";
  if (!readiness.homed) return "print: found an axis that isn't homed, expected all homed";
  if (!readiness.at_temperature) return "print: found the head not at temperature, expected at_temp high";
  if (!readiness.droplet) return "print: found no droplet measured, expected one of the present waveform";
  if (const auto why = why_out_of_band(band, *readiness.droplet)) return "print: found droplets with " + *why;
  return std::nullopt;
}

FlyByPlan plan_fly_by(std::span<const Point> bumps, const FlyByConfig& config) {
  check(config);
  if (bumps.empty()) throw MotionError("fly-by: found no bumps, expected at least 1");
  for (const Point& bump : bumps)
    if (!std::isfinite(bump.x_mm) || !std::isfinite(bump.y_mm))
      throw MotionError(
          fmt::format("fly-by: found the bump of row {} at ({}, {}) mm, expected finite numbers", bump.row,
                      bump.x_mm, bump.y_mm));
  FlyByPlan plan;
  const auto rows = rows_of(bumps, config.row_tolerance_mm);
  double direction = 1.0;
  for (auto order : rows) {
    // Two triggers may lie a count nearer than their bumps.
    const double gap_mm = nearest_gap_mm(bumps, order);
    const double closest_mm = std::max(gap_mm - config.encoder_mm, 0.5 * gap_mm);
    const double length_mm = bumps[order.back()].x_mm - bumps[order.front()].x_mm;
    FlyByRow row;
    row.y_mm = row_y_mm(bumps, order);
    row.speed_mm_s = best_speed_mm_s(config.x, length_mm + 2.0 * config.follow_mm,
                                     std::min(config.x.velocity_mm_s, closest_mm * config.droplets_per_s));
    if (direction < 0.0) std::reverse(order.begin(), order.end());
    const double ahead_mm = row.speed_mm_s * (config.latency_s + config.flight_s);
    for (const std::size_t i : order) {
      const double at_mm = bumps[i].x_mm - direction * ahead_mm;
      constexpr double kMostCounts = 0x1p53;
      if (!(std::abs(at_mm / config.encoder_mm) < kMostCounts))
        throw MotionError(
            fmt::format("fly-by: found {} mm in counts of {} mm, expected less than 2^53 counts", at_mm,
                        config.encoder_mm));
      const std::int64_t count = std::llround(at_mm / config.encoder_mm + 0.5 * direction);
      if (!row.triggers.empty() && row.triggers.back().count == count)
        throw MotionError(
            fmt::format("fly-by: found the bumps of rows {} and {} within one count of {} mm, at which a "
                        "comparator fires once; "
                        "expected them farther apart, or stop at each bump",
                        bumps[row.triggers.back().bump].row, bumps[i].row, config.encoder_mm));
      row.triggers.push_back({i, count, 0.0});
    }
    const Ramps ramps = ramps_at(config.x, row.speed_mm_s);
    // A count to spare at either end, so that the edges themselves lie in the cruise, and the way until the
    // last droplet leaves.
    const double spare_mm = config.encoder_mm + config.follow_mm;
    const double steady_mm = row.speed_mm_s * config.settle_s + spare_mm;
    row.from_x_mm = edge_mm(row.triggers.front().count, direction, config.encoder_mm) -
                    direction * (ramps.up_mm + steady_mm);
    row.to_x_mm = edge_mm(row.triggers.back().count, direction, config.encoder_mm) +
                  direction * (ramps.down_mm + spare_mm + row.speed_mm_s * config.latency_s);
    if (!plan.rows.empty()) join_turns(config, plan.rows.back(), row, -direction);
    plan.rows.push_back(std::move(row));
    direction = -direction;
  }
  double free_s = 0.0;  // x at rest from here on
  double x_mm = plan.rows.front().from_x_mm;
  double y_mm = plan.rows.front().y_mm, y_from_s = 0.0;
  double ready_s = 0.0;  // the head, for another droplet
  for (FlyByRow& row : plan.rows) {
    row.x = plan_scurve(at_speed(config.x, row.speed_mm_s), std::abs(row.to_x_mm - row.from_x_mm));
    const auto time_of = [&](const Trigger& trigger) {
      const double way_mm =
          std::abs(edge_mm(trigger.count, row.direction(), config.encoder_mm) - row.from_x_mm);
      return row.x.time_at(way_mm);
    };
    row.before_x_mm = x_mm;
    row.way_start_s = free_s;
    row.way = way_between(config, x_mm, row.from_x_mm);
    row.from_y_mm = y_mm;
    row.y_start_s = y_from_s;
    row.y = plan_scurve(config.y, std::abs(row.y_mm - y_mm));
    const double y_over_s = y_from_s + row.y.duration_s + config.settle_s;
    row.start_s =
        std::max(free_s + row.way.duration_s, std::max(y_over_s, ready_s) - time_of(row.triggers.front()));
    for (Trigger& trigger : row.triggers) trigger.time_s = row.start_s + time_of(trigger);
    free_s = row.start_s + row.x.duration_s;
    y_from_s = row.triggers.back().time_s + config.latency_s;
    ready_s = row.triggers.back().time_s + 1.0 / config.droplets_per_s;
    y_mm = row.y_mm;
    x_mm = row.to_x_mm;
  }
  plan.duration_s = free_s;
  return plan;
}

FlyByState FlyByPlan::sample(double time_s) const {
  if (rows.empty()) throw MotionError("fly-by: found a plan without rows, expected at least 1");
  const auto on_the_way = [](const Scurve& curve, double from_mm, double direction, double since_s) {
    // Before its start a curve keeps its speed, after its end too: both are at rest here.
    const MotionState along = curve.sample(since_s);
    return MotionState{from_mm + direction * along.position_mm, direction * along.velocity_mm_s,
                       direction * along.acceleration_mm_s2, direction * along.jerk_mm_s3};
  };
  // The rows of x and of y change at different times: the next row's step begins while x still slows down.
  const auto last = [&](auto begins_s) {
    const auto next = std::partition_point(rows.begin(), rows.end(),
                                           [&](const FlyByRow& row) { return begins_s(row) <= time_s; });
    return next == rows.begin() ? rows.begin() : std::prev(next);
  };
  const FlyByRow& in_x = *last([](const FlyByRow& row) { return row.way_start_s; });
  const FlyByRow& in_y = *last([](const FlyByRow& row) { return row.y_start_s; });
  const bool on_the_row = time_s >= in_x.start_s || in_x.way.duration_s == 0.0;
  return {
      on_the_row ? on_the_way(in_x.x, in_x.from_x_mm, in_x.direction(), time_s - in_x.start_s)
                 : on_the_way(in_x.way, in_x.before_x_mm, in_x.from_x_mm < in_x.before_x_mm ? -1.0 : 1.0,
                              time_s - in_x.way_start_s),
      on_the_way(in_y.y, in_y.from_y_mm, in_y.y_mm < in_y.from_y_mm ? -1.0 : 1.0, time_s - in_y.y_start_s)};
}

std::vector<double> landing_errors_mm(const FlyByPlan& plan, std::span<const Point> bumps,
                                      const FlyByConfig& config, double compare_s, double flight_s) {
  check(config);
  check_positive("landing: comparator's clock", compare_s, "s");
  not_negative("flight [s]", flight_s);
  constexpr double kMostTicks = 0x1p53;
  if (!(plan.duration_s / compare_s <= kMostTicks))
    throw MotionError(
        fmt::format("landing: comparator's clock: found {} s, expected at most 2^53 ticks in {} s", compare_s,
                    plan.duration_s));
  if (bumps.empty()) throw MotionError("landing: found no bumps, expected those of the plan");
  std::vector<double> errors;
  for (const FlyByRow& row : plan.rows) {
    const double over_s = row.start_s + row.x.duration_s;
    for (const Trigger& trigger : row.triggers) {
      if (trigger.bump >= bumps.size())
        throw MotionError(
            fmt::format("landing: found a trigger of bump {}, expected 0 to {}: the plan is of "
                        "other bumps",
                        trigger.bump, bumps.size() - 1));
      const auto shown = [&](double time_s) { return std::llround(row.x_mm(time_s) / config.encoder_mm); };
      // The comparator's clock runs from the plan's start; begin some ticks before the count can come.
      auto tick = static_cast<std::int64_t>(std::floor(trigger.time_s / compare_s)) - 3;
      const auto passed = [&](std::int64_t count) {
        return row.direction() > 0.0 ? count >= trigger.count : count <= trigger.count;
      };
      while (!passed(shown(static_cast<double>(tick) * compare_s))) {
        if (static_cast<double>(tick) * compare_s > over_s)
          throw MotionError(
              fmt::format("landing: the row at y {} mm never comes to count {} of {} mm, expected "
                          "the plan's encoder",
                          row.y_mm, trigger.count, config.encoder_mm));
        ++tick;
      }
      const double leaves_s = static_cast<double>(tick) * compare_s + config.latency_s;
      const double speed_mm_s = row.direction() * row.x.sample(leaves_s - row.start_s).velocity_mm_s;
      errors.push_back(row.x_mm(leaves_s) + speed_mm_s * flight_s - bumps[trigger.bump].x_mm);
    }
  }
  return errors;
}

double stop_and_go_s(std::span<const Point> bumps, const FlyByConfig& config, double pause_s) {
  not_negative("pause [s]", pause_s);
  double time_s = pause_s * static_cast<double>(bumps.size());
  for (std::size_t i = 1; i < bumps.size(); ++i)
    time_s += std::max(plan_scurve(config.x, std::abs(bumps[i].x_mm - bumps[i - 1].x_mm)).duration_s,
                       plan_scurve(config.y, std::abs(bumps[i].y_mm - bumps[i - 1].y_mm)).duration_s);
  return time_s;
}

}  // namespace meltstage::motion
