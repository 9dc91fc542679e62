// SPDX-License-Identifier: Apache-2.0
// A print as a program for other machine controls: RS-274/NGC as LinuxCNC reads it, and the dialect of
// grbl 1.1.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "motion/bumps/coordinates.hpp"
#include "motion/profile/profile.hpp"
#include "motion/stage/accuracy.hpp"

namespace meltstage::motion {

/// - linuxcnc: the droplet is digital output 0 (M64/M65), and the program itself waits for the head: digital
///   input 0 high is "at temperature" (M66), with an end of the program if it doesn't come.
/// - grbl: version 1.1; the droplet is the flood coolant pin (M8/M9), and the program pauses (M0) until
/// whoever
///   sends it knows the head is at temperature. Lines stay below grbl's 80 characters.
enum class GcodeDialect { linuxcnc, grbl };

struct GcodeOptions {
  GcodeDialect dialect = GcodeDialect::linuxcnc;
  double heat_timeout_s = 600.0;  ///< longest wait for the temperature
  double settle_s = 0.015;        ///< pause at a bump before its droplet: 0, or 0.0001 at least
  double pulse_s = 0.001;         ///< length of the droplet's output; the waveform starts at its rising edge
  Range x, y;                     ///< travel of the machine
  std::optional<Eigen::Vector2d> end_mm{};  ///< where the head goes in the end; nothing: back to the start
  std::vector<std::string> notes{};         ///< what the program doesn't do, as comments at its head
};

/// A stop-and-go program that visits the bumps in their order, fires once at each and goes to its end.
/// Absolute millimetres, four decimals (0.1 um); nothing is left to the control's state before:
/// plane, units, distance mode, feed mode and exact stop are set.
/// @throws MotionError if there are no bumps, a bump, the start or the end is out of travel, or an option is
/// out of range.
std::string write_gcode(std::span<const Point> bumps, const Eigen::Vector2d& start_mm, std::string_view name,
                        const GcodeOptions& options);

/// Compensation file of a LinuxCNC joint (COMP_FILE_TYPE 0: nominal, actual forwards, actual backwards; at
/// most 256 lines).
/// @throws MotionError as check_compensation, or if the table is empty or longer.
std::string write_linuxcnc_compensation(const CompensationTable& table);

/// The settings with which grbl moves as the limits say (steps a mm, mm/min, mm/s2); grbl has one
/// acceleration an axis and no jerk limit, so A and D give their smaller.
/// @throws MotionError if a number isn't above 0.
std::string write_grbl_settings(const std::array<double, 3>& pulses_per_mm, const AxisLimits& limits);

}  // namespace meltstage::motion
