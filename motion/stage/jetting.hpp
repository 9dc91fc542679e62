// SPDX-License-Identifier: Apache-2.0
// Droplets on demand: the drive waveform and its tuning by what the droplets do, when a print may start, and
// printing on the fly by position-compare triggers.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "motion/bumps/coordinates.hpp"
#include "motion/profile/profile.hpp"

namespace meltstage::motion {

/// Trapezoidal pulse of the piezo drive. One pulse, one droplet.
struct Waveform {
  double amplitude_v = 60.0;
  double rise_us = 5.0;
  double dwell_us = 30.0;
  double fall_us = 5.0;
};

/// Voltage at a time after the trigger; 0 before and after the pulse.
double waveform_v(const Waveform& waveform, double time_us);
double duration_us(const Waveform& waveform);

/// A droplet as a strobe pair shows it (motion/stage/droplet_vision.hpp).
struct DropletFigures {
  double velocity_m_s = 0.0;
  double angle_deg = 0.0;  ///< of the flight against the image's vertical
  double diameter_um = 0.0;
  double roundness = 1.0;  ///< minor / major axis
  int satellites = 0;
};

/// What a droplet has to be like.
struct DropletBand {
  double slowest_m_s = 1.8, fastest_m_s = 2.2;
  double least_roundness = 0.9;
  double largest_angle_deg = 2.0;
  int most_satellites = 0;
};

/// Why a droplet isn't in the band, in a few words; nothing if it is.
std::optional<std::string> why_out_of_band(const DropletBand& band, const DropletFigures& droplet);

/// What the drive can do.
struct WaveformRange {
  Waveform lowest{10.0, 1.0, 5.0, 1.0};
  Waveform highest{150.0, 20.0, 80.0, 40.0};
};

struct TunedWaveform {
  Waveform waveform;
  std::optional<DropletFigures> droplet;  ///< of this waveform, if there was one
  int measurements = 0;
  std::optional<std::string> shortfall;  ///< why it isn't in the band; nothing: it is
};

/// Finds a waveform whose droplets are in the band, by measuring. First the dwell at which the droplet is
/// fastest (the pressure wave then meets itself in the nozzle, so that scatter of the dwell hardly counts):
/// of seven over the range, then of ever more between them while none gives a droplet and 20 measurements
/// are left for the amplitude; refined where the droplets beside it are less than half as fast;
/// then the amplitude by bracketed secant steps on the velocity, towards the band's middle; while there are
/// satellites or the droplet isn't round, a slower fall and the amplitude again. `measure` gives nothing
/// where no droplet came.
/// @throws MotionError if a range or the band can't be.
TunedWaveform tune_waveform(const WaveformRange& range, const DropletBand& band,
                            const std::function<std::optional<DropletFigures>(const Waveform&)>& measure,
                            int most_measurements = 60);

/// What has to hold before the first droplet of a print.
struct PrintReadiness {
  bool homed = false;                     ///< all axes
  bool inhibited = false;                 ///< emergency stop, or the chip's fault pin
  bool at_temperature = false;            ///< the chip's at_temp pin
  std::optional<DropletFigures> droplet;  ///< of the present waveform
};

/// Why a print may not start, one line; nothing if it may. Asked again before each droplet, it also pauses a
/// print whose head cools down.
std::optional<std::string> why_not_print(const PrintReadiness& readiness, const DropletBand& band);

/// Printing on the fly: the head passes each row of bumps at constant speed, a comparator on the encoder
/// fires.
struct FlyByConfig {
  ScurveLimits x, y;
  double droplets_per_s = 200.0;   ///< most that the head does
  double latency_s = 50e-6;        ///< from the comparator to the droplet leaving the nozzle
  double flight_s = 0.5e-3;        ///< from the nozzle to the substrate
  double encoder_mm = 1e-4;        ///< a count of the x encoder
  double settle_s = 0.0;           ///< both axes steady before the first trigger of a row
  double follow_mm = 0.015;        ///< passed before a row's first trigger and behind its last at the row's
                                   ///< speed: what the axis may stay behind its plan
  double row_tolerance_mm = 1e-3;  ///< bumps of a row differ by less in y
};

/// A comparator's entry: it fires when the encoder first shows this count.
struct Trigger {
  std::size_t bump = 0;    ///< index into the points
  std::int64_t count = 0;  ///< of the x encoder
  double time_s = 0.0;     ///< when the count comes, by the plan
};

struct FlyByRow {
  double y_mm = 0.0;
  double before_x_mm = 0.0, way_start_s = 0.0;  ///< where the row before ends, and when x leaves it
  Scurve way;                                   ///< of |from - before|, at full speed; may have no length
  double from_x_mm = 0.0, to_x_mm = 0.0;        ///< rest to rest
  double start_s = 0.0;
  double speed_mm_s = 0.0;                  ///< over all triggers
  Scurve x;                                 ///< of |to - from|
  double from_y_mm = 0.0, y_start_s = 0.0;  ///< the step to this row
  Scurve y;                                 ///< of |y - from|
  std::vector<Trigger> triggers;
  double direction() const { return to_x_mm < from_x_mm ? -1.0 : 1.0; }
  /// Head position while the row runs, clamped to its ends.
  double x_mm(double time_s) const {
    return from_x_mm + direction() * x.sample(time_s - start_s).position_mm;
  }
};

/// Both axes at one moment of a plan.
struct FlyByState {
  MotionState x, y;
};

/// Rows in order of y, to and fro. The step to the next row begins when the last droplet has left, and is
/// over before the first trigger of the next. Meanwhile x turns where the next row begins, or goes there at
/// full speed where that is sooner.
struct FlyByPlan {
  std::vector<FlyByRow> rows;
  double duration_s = 0.0;

  /// Where the head is to be; before the start and after the end it rests.
  /// @throws MotionError if there are no rows.
  FlyByState sample(double time_s) const;
};

/// Plans rows at the speed that is best for each (no faster than the nearest two bumps of a row allow the
/// head to fire). A trigger lies ahead of its bump by speed * (latency + flight).
/// @throws MotionError if there are no bumps, a number can't be, or two bumps coincide.
FlyByPlan plan_fly_by(std::span<const Point> bumps, const FlyByConfig& config);

/// Landing error of every droplet, in the order of the triggers, along x: the comparator looks at the
/// encoder's count once every `compare_s`, the droplet takes `flight_s` (which may differ from the plan's)
/// and keeps the head's speed. Not more than speed * compare_s + half a count while the flight is the plan's.
/// @throws MotionError if `compare_s` isn't above 0, `flight_s` is below 0, a number isn't finite, a trigger
/// is of no bump, or its count never comes (as with another encoder than the plan's).
std::vector<double> landing_errors_mm(const FlyByPlan& plan, std::span<const Point> bumps,
                                      const FlyByConfig& config, double compare_s, double flight_s);

/// Time of the same print with a stop at each bump, in the given order.
/// @throws MotionError as plan_scurve, or if the pause is below 0 or not finite.
double stop_and_go_s(std::span<const Point> bumps, const FlyByConfig& config, double pause_s);

}  // namespace meltstage::motion
