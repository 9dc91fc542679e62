// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/gcode.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "motion/profile/check_positive.hpp"

namespace meltstage::motion {
namespace {

constexpr std::size_t kLongestLine = 79;         // of grbl, which has 80 characters for a line and its end
constexpr std::size_t kCompensationLines = 256;  // of LinuxCNC's table

void check_in_travel(const GcodeOptions& options, double x_mm, double y_mm, const std::string& what) {
  const auto inside = [](const Range& range, double value) {
    return value >= range.min_mm && value <= range.max_mm;
  };
  if (!inside(options.x, x_mm) || !inside(options.y, y_mm))
    throw MotionError(fmt::format("G-code: found {} at ({}, {}) mm, expected x {}..{} mm and y {}..{} mm",
                                  what, x_mm, y_mm, options.x.min_mm, options.x.max_mm, options.y.min_mm,
                                  options.y.max_mm));
}

/// A text as comments, as many lines as it takes, each begun with `label`: brackets would end a comment, and
/// one that begins with MSG or DEBUG is an order.
std::string comments(std::string_view label, std::string_view text) {
  // Brackets end a comment; grbl takes the others out of the stream wherever they stand: feed hold, status.
  constexpr std::string_view kOfTheControl = "()!?";
  const std::size_t most = kLongestLine - label.size() - 2;
  std::string lines;
  do {
    std::size_t length = std::min(text.size(), most);
    if (length < text.size())  // between two words
      if (const std::size_t blank = text.rfind(' ', length); blank != std::string_view::npos && blank > 0)
        length = blank;
    lines += fmt::format("({}", label);
    for (const char c : text.substr(0, length))
      lines += c >= ' ' && c < '~' && kOfTheControl.find(c) == std::string_view::npos ? c : '_';
    lines += ")\n";
    text.remove_prefix(length);
    if (text.starts_with(' ')) text.remove_prefix(1);
  } while (!text.empty());
  return lines;
}

/// Four decimals; what rounds to zero has no sign.
std::string number(double value) {
  const double rounded = std::round(value * 1e4) * 1e-4;
  return fmt::format("{:.4f}", rounded == 0.0 ? 0.0 : rounded);
}

/// Only the axes that change: half the length on a lattice.
std::string move_line(const Eigen::Vector2d& to_mm, const std::array<std::string, 2>& at) {
  const std::array<std::string, 2> to = {number(to_mm.x()), number(to_mm.y())};
  std::string line;
  if (to[0] != at[0]) line += " X" + to[0];
  if (to[1] != at[1]) line += " Y" + to[1];
  return line.empty() ? "" : "G0" + line + "\n";
}

struct Words {
  std::string_view before;      ///< sets the modes
  std::string wait_heat;        ///< only a heated head prints
  std::string_view fire, rest;  ///< of the droplet's output
};

Words words_of(const GcodeOptions& options) {
  if (options.dialect == GcodeDialect::grbl)
    return {"G21 G17 G90 G94\nG54\nG61\nM9\n", "(resume when the head is at temperature)\nM0\n", "M8", "M9"};
  return {"G21 G17 G90 G94\nG54 G40 G49 G80\nG61.1\nM65 P0\n",
          fmt::format("M66 P0 L3 Q{:.3f}\n"
                      "o100 if [#5399 LT 0]\n"
                      "(MSG, the head is not at temperature: nothing printed)\n"
                      "M2\n"
                      "o100 endif\n",
                      options.heat_timeout_s),
          "M64 P0", "M65 P0"};
}

}  // namespace

std::string write_gcode(std::span<const Point> bumps, const Eigen::Vector2d& start_mm, std::string_view name,
                        const GcodeOptions& options) {
  check_positive("G-code: heat timeout", options.heat_timeout_s, "s");
  check_positive("G-code: droplet pulse", options.pulse_s, "s");
  constexpr double kShortestWait_s = 1e-3;  // that its number of three decimals tells
  if (options.heat_timeout_s < kShortestWait_s)
    throw MotionError(fmt::format("G-code: heat timeout: found {} s, expected {} s at least",
                                  options.heat_timeout_s, kShortestWait_s));
  constexpr double kShortest_s = 1e-4;  // that its number of four decimals tells
  if (options.pulse_s < kShortest_s)
    throw MotionError(fmt::format("G-code: droplet pulse: found {} s, expected {} s at least",
                                  options.pulse_s, kShortest_s));
  if (!std::isfinite(options.settle_s) || options.settle_s < 0.0)
    throw MotionError(
        fmt::format("G-code: found settle time {} s, expected a finite number from 0", options.settle_s));
  if (options.settle_s > 0.0 && options.settle_s < kShortest_s)
    throw MotionError(fmt::format("G-code: settle time: found {} s, expected 0 s, or {} s at least",
                                  options.settle_s, kShortest_s));
  if (bumps.empty()) throw MotionError("G-code: found no bumps, expected at least 1");
  check_in_travel(options, start_mm.x(), start_mm.y(), "the start");
  for (const Point& bump : bumps)
    check_in_travel(options, bump.x_mm, bump.y_mm, fmt::format("the bump of row {}", bump.row));

  const Eigen::Vector2d end_mm = options.end_mm.value_or(start_mm);
  check_in_travel(options, end_mm.x(), end_mm.y(), "the end");

  const Words words = words_of(options);
  std::string program = comments("name: ", name);
  for (const std::string& note : options.notes) program += comments("note: ", note);
  program += words.before;
  program += words.wait_heat;
  program += fmt::format("G0 X{} Y{}\n", number(start_mm.x()), number(start_mm.y()));
  std::array<std::string, 2> at = {number(start_mm.x()), number(start_mm.y())};
  // The pause stands there even if it is 0: both controls end the move before it, so none fires early.
  const std::string droplet = fmt::format("G4 P{:.4f}\n{}\nG4 P{:.4f}\n{}\n", options.settle_s, words.fire,
                                          options.pulse_s, words.rest);
  for (const Point& bump : bumps) {
    program += move_line({bump.x_mm, bump.y_mm}, at);
    program += droplet;
    at = {number(bump.x_mm), number(bump.y_mm)};
  }
  program += move_line(end_mm, at);
  program += "M2\n";
  return program;
}

std::string write_linuxcnc_compensation(const CompensationTable& table) {
  check_compensation(table);
  if (table.position_mm.empty() || table.position_mm.size() > kCompensationLines)
    throw MotionError(fmt::format("compensation: found {} positions, expected 1..{} for LinuxCNC",
                                  table.position_mm.size(), kCompensationLines));
  std::string text;
  for (std::size_t i = 0; i < table.position_mm.size(); ++i)
    fmt::format_to(std::back_inserter(text), "{:.6f} {:.6f} {:.6f}\n", table.position_mm[i],
                   table.position_mm[i] + table.forward_mm[i], table.position_mm[i] + table.reverse_mm[i]);
  return text;
}

std::string write_grbl_settings(const std::array<double, 3>& pulses_per_mm, const AxisLimits& limits) {
  std::string text;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    check_positive("G-code: pulses", pulses_per_mm[axis], "a mm");
    check_positive("G-code: speed", limits[axis].velocity_mm_s, "mm/s");
    check_positive("G-code: acceleration", limits[axis].acceleration_mm_s2, "mm/s2");
    check_positive("G-code: deceleration", limits[axis].deceleration_mm_s2, "mm/s2");
    const std::array values = {pulses_per_mm[axis], limits[axis].velocity_mm_s * 60.0,
                               std::min(limits[axis].acceleration_mm_s2, limits[axis].deceleration_mm_s2)};
    for (std::size_t setting = 0; setting < values.size(); ++setting) {
      constexpr double kLeast = 0.001;  // grbl shows and keeps three decimals
      if (values[setting] < kLeast)
        throw MotionError(fmt::format("G-code: setting ${}{} of grbl: found {}, expected at least {}",
                                      10 + setting, axis, values[setting], kLeast));
      fmt::format_to(std::back_inserter(text), "${}{}={:.3f}\n", 10 + setting, axis, values[setting]);
    }
  }
  return text;
}

}  // namespace meltstage::motion
