// SPDX-License-Identifier: Apache-2.0
// The program that prints on real lines with five axes (Xu et al. 2024).
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "motion/surface/conformal.hpp"
#include "motion/surface/five_axis.hpp"

namespace meltstage::motion {

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
