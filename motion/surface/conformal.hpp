// SPDX-License-Identifier: Apache-2.0
// Printing on a surface as it is (Xu et al. 2024): the real line out of the touches, and the program that
// prints on it with five axes.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "motion/surface/five_axis.hpp"
#include "motion/surface/nurbs.hpp"
#include "motion/surface/probe.hpp"

namespace meltstage::motion {

/// Points of a real line, at most.
inline constexpr std::size_t kMostLinePoints = 2'000'000;

/// A touch that its neighbours on the same face contradict: of dust, a burr, a slipped part, or of a step of
/// the surface that is really there.
struct SuspectTouch {
  std::size_t touch = 0;  ///< index among the line's touches
  double off_mm = 0.0;    ///< its shift less what its neighbours say
};

/// A line on the real surface, dense enough to be printed as a polygon.
struct RealLine {
  std::string name;
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<Eigen::Vector3d> normals;  ///< of the surface, outwards, length 1
  std::vector<double> lengths_mm;        ///< of the polygon
  double shift_mean_mm = 0.0;            ///< real minus nominal surface along the normal, over the touches
  double shift_largest_mm = 0.0;         ///< largest absolute
  /// What the spline may be off between the touches, from leaving out every second one; with noise, its
  /// standard error added. None if no face has the five touches that this takes.
  std::optional<double> estimated_error_mm = std::nullopt;
  /// Faces of fewer touches: what the spline is off there isn't known.
  std::size_t unjudged_faces = 0;
  /// Faces too short for a touch: their shift goes from that of the face before to that of the face behind.
  std::size_t untouched_faces = 0;
  bool smoothed = false;
  /// To be measured again, rising; counted in the estimated error. Looked for on faces of seven touches and
  /// more.
  std::vector<SuspectTouch> suspects = {};
};

struct ReconstructionOptions {
  double ball_radius_mm = 1.0;  ///< effective, from a calibration on a reference sphere
  double noise_mm = 0.0;        ///< standard deviation of a touch; 0: none
  double tolerance_mm = 0.020;  ///< for which the line is rebuilt
  double step_mm = 0.1;         ///< between points of the real line
};

/// As published: the cubic NURBS through the touched points (ball's radius taken off along the nominal
/// normal), chord-length parameters, eqs. (2), (3).
/// @throws MotionError if there are fewer than two touches or not as many as points, the line has fewer than
/// two points, or the step makes more than kMostLinePoints of it.
RealLine reconstruct_as_published(const ClLine& line, const ProbeLine& points,
                                  std::span<const Eigen::Vector3d> touches,
                                  const ReconstructionOptions& options);

/// The nominal line moved along its normals by a cubic spline through the measured shifts: what the CAM
/// system knows of the line's shape needs no touch, and corners stay corners. Where the surface is folded,
/// each face has a spline of its own, and they end where they meet. The ball's radius is taken off with the
/// real line's slope. If three standard deviations of noise are more than a quarter of the tolerance, the
/// shifts are smoothed instead of interpolated.
/// @throws MotionError as above.
RealLine reconstruct(const ClLine& line, const ProbeLine& points, std::span<const Eigen::Vector3d> touches,
                     const ReconstructionOptions& options);

/// The line as the CAM system has it, for a program without compensation: its points, and others between them
/// such that no two are more than the step apart.
/// @throws MotionError if it has fewer than two points, or the step isn't positive or makes more than
/// kMostLinePoints points.
RealLine nominal_line(const ClLine& line, double step_mm = 0.1);

struct PrintProgramOptions {
  /// post: X Y Z of the machine, for controls without tool-centre-point control; control: X Y Z of the tip on
  /// the workpiece, for controls that have it switched on (G43.4, LinuxCNC's trt kinematics).
  enum class Rtcp { post, control };
  Rtcp rtcp = Rtcp::post;
  TwinRotaryTable table;
  double singular_deg = 0.5;
  double height_mm = 0.1;      ///< of the tip over the surface, along the normal
  double feed_mm_s = 5.0;      ///< of the tip along the line
  double rotary_deg_s = 30.0;  ///< largest speed of a rotary axis
  double linear_mm_s = 100.0;  ///< largest speed of a linear axis, which follows the table's turning
  double normal_acceleration_mm_s2 = 500.0;  ///< of the tip, where the line bends
  double path_error_mm = 0.001;              ///< of the tip between two blocks
  double on_delay_s = 0.05;   ///< from the valve's opening until paste flows: the head waits so long
  double off_delay_s = 0.05;  ///< from its closing until none flows: it closes so much earlier
  double retract_mm = 5.0;    ///< along the tool before and after a line
  double safe_z_mm = 80.0;    ///< of the machine between lines, above all that the table may lift
  int pressure_output = 0;    ///< digital output of the valve (M62, M63)
  Eigen::Vector3d station_offset_mm = Eigen::Vector3d::Zero();  ///< of the head on the spindle (G43.1)
};

/// One block of the program, for checks and pictures.
struct PrintMove {
  ToolPose pose;        ///< asked for
  AxesPosition axes;    ///< that does it
  double time_s = 0.0;  ///< of the way from the move before
};

/// Moves along one line: tips at the height over the surface, rotary axes solved, ways that aren't straight
/// at the tip divided until they are within the path error; each as slow as the feed, the axes and the line's
/// bend ask for.
/// @throws MotionError if the line has fewer than two points, an option is out of range, or a pose can't be
/// reached.
std::vector<PrintMove> plan_line(const RealLine& line, const PrintProgramOptions& options);

/// RS-274/NGC as LinuxCNC reads it. Feed is inverse time, so that the tip's speed is right whatever the
/// rotary axes do. Nothing is left to the control's state before.
/// @throws MotionError if there is no line, one has fewer than two points (a line without a name is then
/// "line 1" and so on), an option is out of range, or a pose can't be reached.
std::string write_print_program(std::span<const RealLine> lines, std::string_view name,
                                const PrintProgramOptions& options, std::span<const double> heights_mm = {});

}  // namespace meltstage::motion
