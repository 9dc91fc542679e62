// SPDX-License-Identifier: Apache-2.0
// Touching a surface: the program for the machine, the points that come back, and a simulated probe on a
// simulated part.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "motion/surface/measuring_points.hpp"

namespace meltstage::motion {

/// The points to touch on one line.
struct ProbeLine {
  std::string name;
  std::vector<MeasuringPoint> points;
};

struct ProbeProgramOptions {
  double ball_radius_mm = 1.0;
  double approach_mm = 2.0;    ///< from where, off the nominal surface, a touch begins
  double overtravel_mm = 2.0;  ///< how far beyond the nominal surface it may go; then the machine stops
  double touch_mm_min = 60.0;  ///< feed of a touch
  double safe_z_mm = 50.0;     ///< of the ball's centre between lines, in the workpiece's frame
  Eigen::Vector3d station_offset_mm = Eigen::Vector3d::Zero();  ///< of the probe on the spindle (G43.1)
  std::string points_file = "points.txt";                       ///< that the control writes (PROBEOPEN)
};

/// What a program does between lines has to go above all it does on them.
/// @throws MotionError if `highest_mm` is above safe z; `why` says what is there.
void require_safe_z(double safe_z_mm, double highest_mm, std::string_view why);

/// RS-274/NGC as LinuxCNC reads it: every point is touched once along its axis by G38.2, rotary axes at zero.
/// Programmed is the ball's centre in the workpiece's frame (G54). Nothing is left to the control's state
/// before. The control writes one row a point.
/// @throws MotionError if there is no point, an axis points down, or an option is out of range.
std::string write_probe_program(std::span<const ProbeLine> lines, std::string_view name,
                                const ProbeProgramOptions& options);

/// Whether a probe program, as write_probe_program() wrote it, touches these points with this ball. `name`
/// stands in messages. Feeds, heights between lines and the station may be others; a tool may be taken and
/// the program stopped (T, M0, M1, M5, M6, M9), and there may be more comments.
/// @throws CoordinateError if it is none, is cut off, says another ball or another place of a touch, or holds
/// any other word.
void require_probe_program(std::string_view name, std::string_view content, std::span<const ProbeLine> lines,
                           const ProbeProgramOptions& options);

/// What the control wrote: the ball's centre at each touch. `file` and `rows` say where for messages; both
/// may be empty.
struct Touches {
  std::vector<Eigen::Vector3d> points_mm;
  std::string file;
  std::vector<std::size_t> rows;
};

/// Rows of at least three numbers, separated by blanks, commas or semicolons: x, y, z of the ball's centre at
/// the touch, as PROBEOPEN writes them (nine numbers, A, B and C at zero). All have as many numbers, and each
/// has its line end. Empty rows, a byte order mark and a first row of names are skipped; a first row that
/// begins as a number does is none of names. A comma between digits is no separator beside blanks or
/// semicolons: it would be a decimal mark, and is refused.
/// @throws UserError if the file is missing; CoordinateError if it is empty or cut off, or a number is
/// malformed, not finite or beyond 1e6 mm.
Touches read_touches(const std::filesystem::path& path);
/// The same from a text; `name` stands in messages.
Touches read_touches_text(std::string_view name, std::string_view content);

/// Assigns touches to the points of the lines, in their order.
/// @throws CoordinateError, with the touches' file and row, if the number differs, or a touch is off its
/// point's axis by more than `aside_mm` or outside the way of its move.
std::vector<std::vector<Eigen::Vector3d>> assign_touches(std::span<const ProbeLine> lines,
                                                         const Touches& touches,
                                                         const ProbeProgramOptions& options,
                                                         double aside_mm = 0.1);

/// A simulated part: a surface over its own x and y, with form errors in it, as it lies on the table.
struct RealPart {
  std::function<double(double x_mm, double y_mm)> height_mm;
  Eigen::Isometry3d placement = Eigen::Isometry3d::Identity();  ///< from the part's frame to the workpiece's
};

/// Signed distance of a point in the workpiece's frame from the part's surface, positive above it.
double distance_mm(const RealPart& part, const Eigen::Vector3d& point_mm);

/// Where a straight line first meets the surface.
/// @throws MotionError if it doesn't meet it within `reach_mm` on either side of `point_mm`.
Eigen::Vector3d surface_along(const RealPart& part, const Eigen::Vector3d& point_mm,
                              const Eigen::Vector3d& axis, double reach_mm);

struct TouchProbeModel {
  double ball_radius_mm = 1.0;
  double pretravel_mm = 0.008;  ///< mean way from contact to trigger
  double lobing_mm = 0.001;     ///< its amplitude over the direction, three lobes (kinematic seat)
  double noise_mm = 0.0007;     ///< standard deviation
  double scale_mm = 0.001;      ///< resolution of the axes' scales
};

/// What a calibration on a reference sphere gives: the radius with which touches are to be reckoned.
double effective_radius_mm(const TouchProbeModel& model);

class TouchProbe {
 public:
  TouchProbe(const TouchProbeModel& model, std::uint64_t seed) : model_(model), random_(seed) {}

  /// Ball's centre as the machine reads it when the probe triggers on the way from..to.
  /// @throws MotionError if it doesn't, or touches at the start already.
  Eigen::Vector3d touch(const RealPart& part, const Eigen::Vector3d& from_mm, const Eigen::Vector3d& to_mm);

 private:
  TouchProbeModel model_;
  std::mt19937_64 random_;
};

/// Carries out a probe program's touches on a simulated part.
std::vector<Eigen::Vector3d> touch_all(const RealPart& part, std::span<const ProbeLine> lines,
                                       const ProbeProgramOptions& options, TouchProbe& probe);

}  // namespace meltstage::motion
