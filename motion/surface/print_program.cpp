// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/print_program.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "motion/profile/check_positive.hpp"
#include "motion/profile/profile.hpp"
#include "motion/surface/line_shape.hpp"
#include "motion/surface/rs274.hpp"

namespace meltstage::motion {

namespace {

void check_options(const PrintProgramOptions& options) {
  check_positive("height", options.height_mm, "mm");
  check_positive("feed", options.feed_mm_s, "mm/s");
  check_positive("rotary speed", options.rotary_deg_s, "deg/s");
  check_positive("linear axis speed", options.linear_mm_s, "mm/s");
  check_positive("normal acceleration", options.normal_acceleration_mm_s2, "mm/s2");
  check_positive("path error", options.path_error_mm, "mm");
  check_positive("retract", options.retract_mm, "mm");
  if (!(options.on_delay_s >= 0.0) || !(options.off_delay_s >= 0.0) || !std::isfinite(options.on_delay_s) ||
      !std::isfinite(options.off_delay_s))
    throw MotionError(fmt::format("pressure delays: found {} and {} s, expected finite numbers, 0 or more",
                                  options.on_delay_s, options.off_delay_s));
  if (!options.station_offset_mm.allFinite() || !std::isfinite(options.safe_z_mm))
    throw MotionError("station offset or safe z: found a number that isn't finite, expected finite ones");
  if (options.pressure_output < 0 || options.pressure_output > 63)
    throw MotionError(fmt::format("pressure output: found {}, expected 0..63", options.pressure_output));
}

/// Where the tip is halfway between two positions of the axes.
ToolPose halfway(const TwinRotaryTable& table, const AxesPosition& a, const AxesPosition& b) {
  return pose_of(table, {0.5 * (a.linear_mm + b.linear_mm), 0.5 * (a.tilt_deg + b.tilt_deg),
                         0.5 * (a.rotary_deg + b.rotary_deg)});
}

/// Curvature of the circle through three neighbours; 0 at the ends.
double curvature_1_mm(const std::vector<ToolPose>& path, std::size_t i) {
  if (i == 0 || i + 1 == path.size()) return 0.0;
  const Eigen::Vector3d a = path[i].tip_mm - path[i - 1].tip_mm, b = path[i + 1].tip_mm - path[i].tip_mm;
  const double sides = a.norm() * b.norm() * (a + b).norm();
  return sides > 0.0 ? 2.0 * a.cross(b).norm() / sides : 0.0;
}

/// Adds moves up to `to`, at most `feed_mm_s` fast; the straight way of the axes bends at the tip, so it is
/// halved until it doesn't.
void add_way(const PrintProgramOptions& options, double feed_mm_s, const PrintMove& from, const PrintMove& to,
             std::vector<PrintMove>& out, int depth) {
  constexpr int kDeepest = 16;
  const Eigen::Vector3d middle_mm = 0.5 * (from.pose.tip_mm + to.pose.tip_mm);
  const bool bends =
      options.rtcp == PrintProgramOptions::Rtcp::post && depth < kDeepest &&
      (halfway(options.table, from.axes, to.axes).tip_mm - middle_mm).norm() > options.path_error_mm;
  if (bends) {
    PrintMove middle;
    middle.axes = axes_at(options.table, middle_mm, 0.5 * (from.axes.tilt_deg + to.axes.tilt_deg),
                          0.5 * (from.axes.rotary_deg + to.axes.rotary_deg));
    middle.pose = {middle_mm, (from.pose.axis + to.pose.axis).normalized()};
    add_way(options, feed_mm_s, from, middle, out, depth + 1);
    add_way(options, feed_mm_s, middle, to, out, depth + 1);
    return;
  }
  out.push_back(to);
  out.back().time_s =
      std::max({(to.pose.tip_mm - from.pose.tip_mm).norm() / feed_mm_s,
                (to.axes.linear_mm - from.axes.linear_mm).cwiseAbs().maxCoeff() / options.linear_mm_s,
                std::abs(to.axes.tilt_deg - from.axes.tilt_deg) / options.rotary_deg_s,
                std::abs(to.axes.rotary_deg - from.axes.rotary_deg) / options.rotary_deg_s, 1e-6});
}

class ProgramWriter {
 public:
  explicit ProgramWriter(const PrintProgramOptions& options) : options_(options) {}

  void begin(std::string_view name, std::size_t lines) {
    const Eigen::Vector3d& station = options_.station_offset_mm;
    out_ += fmt::format("%\n({})\n({} lines, {})\nG21 G90 G94 G17 G40 G49 G54 G64 P{:.4f}\n",
                        rs274_comment(name), lines,
                        options_.rtcp == PrintProgramOptions::Rtcp::post
                            ? "X Y Z of the machine"
                            : "X Y Z of the tip: switch tool-centre-point control on",
                        options_.path_error_mm);
    out_ += fmt::format("M65 P{}\nG43.1 X{:.4f} Y{:.4f} Z{:.4f}\nG0 Z{:.4f}\n", options_.pressure_output,
                        station.x(), station.y(), station.z(), options_.safe_z_mm);
  }

  void line(const std::string& name, const std::vector<PrintMove>& moves) {
    const PrintMove& first = moves.front();
    const AxesPosition above = lifted(first), after = lifted(moves.back());
    require_below_safe_z(name, moves, above, after);
    const char tilt = tilt_letter();
    out_ += fmt::format("({})\nG0 {}{:.5f} C{:.5f}\nG0 X{:.5f} Y{:.5f}\nG0 Z{:.5f}\n", rs274_comment(name),
                        tilt, above.tilt_deg, above.rotary_deg, above.linear_mm.x(), above.linear_mm.y(),
                        above.linear_mm.z());
    out_ += fmt::format("G94 G1 {} F{:.1f}\n", words(programmed(first.axes)), 60.0 * kApproach_mm_s);
    out_ += fmt::format("M64 P{}\nG4 P{:.4f}\nG93\n", options_.pressure_output, options_.on_delay_s);
    double left_s = 0.0;
    for (std::size_t i = 1; i < moves.size(); ++i) left_s += moves[i].time_s;
    bool on = true;
    for (std::size_t i = 1; i < moves.size(); ++i) {
      // The block in which the valve has to close is divided there; M63 acts where the next one begins.
      if (on && left_s - moves[i].time_s < options_.off_delay_s) {
        const double share = std::clamp((left_s - options_.off_delay_s) / moves[i].time_s, 0.0, 1.0);
        if (share > 1e-3) block(between(moves[i - 1], moves[i], share), share * moves[i].time_s);
        out_ += fmt::format("M63 P{}\n", options_.pressure_output);
        block(moves[i].axes, (1.0 - share) * moves[i].time_s);
        on = false;
      } else {
        block(moves[i].axes, moves[i].time_s);
      }
      left_s -= moves[i].time_s;
    }
    if (on) out_ += fmt::format("M65 P{}\n", options_.pressure_output);
    out_ += fmt::format("G94\nG0 {}\nM65 P{}\nG0 Z{:.4f}\n", words(after), options_.pressure_output,
                        options_.safe_z_mm);
  }

  std::string end() {
    const auto nearest_zero_deg = [](const Range& limits) {
      return std::clamp(0.0, limits.min_mm, limits.max_mm);
    };
    out_ +=
        fmt::format("G0 {}{:g} C{:g}\nG49\nM2\n%\n", tilt_letter(), nearest_zero_deg(options_.table.tilt_deg),
                    nearest_zero_deg(options_.table.rotary_deg));
    return std::move(out_);
  }

 private:
  static constexpr double kApproach_mm_s = 10.0;

  char tilt_letter() const { return options_.table.tilt == TwinRotaryTable::Tilt::a ? 'A' : 'B'; }

  /// Between lines the head crosses the part at safe z, so whatever the table lifts has to stay below it.
  /// With RTCP the control itself lifts the machine as the table tilts, and Z is that of the tip on the
  /// workpiece.
  void require_below_safe_z(const std::string& name, const std::vector<PrintMove>& moves,
                            const AxesPosition& above, const AxesPosition& after) const {
    double highest_mm = std::max(above.linear_mm.z(), after.linear_mm.z());
    for (const PrintMove& move : moves)
      highest_mm = std::max(highest_mm, programmed(move.axes).linear_mm.z());
    require_safe_z(options_.safe_z_mm, highest_mm, fmt::format("the head prints {} there", name));
  }

  /// The axes off the surface along the tool, which stands upright in the machine.
  AxesPosition lifted(const PrintMove& move) const {
    AxesPosition out = programmed(move.axes);
    out.linear_mm += options_.retract_mm * (options_.rtcp == PrintProgramOptions::Rtcp::post
                                                ? Eigen::Vector3d::UnitZ()
                                                : pose_of(options_.table, move.axes).axis);
    return out;
  }

  /// What stands in the program: in RTCP of the control the tip.
  AxesPosition programmed(const AxesPosition& axes) const {
    if (options_.rtcp == PrintProgramOptions::Rtcp::post) return axes;
    return {pose_of(options_.table, axes).tip_mm, axes.tilt_deg, axes.rotary_deg};
  }

  AxesPosition between(const PrintMove& from, const PrintMove& to, double share) const {
    const Eigen::Vector3d tip_mm = (1.0 - share) * from.pose.tip_mm + share * to.pose.tip_mm;
    return axes_at(options_.table, tip_mm, (1.0 - share) * from.axes.tilt_deg + share * to.axes.tilt_deg,
                   (1.0 - share) * from.axes.rotary_deg + share * to.axes.rotary_deg);
  }

  /// Of a position as it is programmed.
  std::string words(const AxesPosition& at) const {
    return fmt::format("X{:.5f} Y{:.5f} Z{:.5f} {}{:.5f} C{:.5f}", at.linear_mm.x(), at.linear_mm.y(),
                       at.linear_mm.z(), tilt_letter(), at.tilt_deg, at.rotary_deg);
  }

  void block(const AxesPosition& axes, double time_s) {
    out_ += fmt::format("G1 {} F{:.4f}\n", words(programmed(axes)), 60.0 / std::max(time_s, 1e-6));
  }

  const PrintProgramOptions& options_;
  std::string out_;
};

}  // namespace

namespace {

/// `name` stands in messages.
std::vector<PrintMove> plan_named_line(std::string_view name, const RealLine& line,
                                       const PrintProgramOptions& options) {
  check_options(options);
  require_two_points(name, line.points_mm.size());
  std::vector<ToolPose> path;
  for (std::size_t i = 0; i < line.points_mm.size(); ++i)
    path.push_back({line.points_mm[i] + options.height_mm * line.normals[i], line.normals[i]});
  std::vector<AxesPosition> axes;
  try {
    axes = solve_path(options.table, path, options.singular_deg);
  } catch (const MotionError& error) {
    throw MotionError(fmt::format("{}: {}", name, error.what()));
  }
  const auto speed_at = [&](std::size_t i) {
    const double bend = curvature_1_mm(path, i);
    return bend > 0.0 ? std::min(options.feed_mm_s, std::sqrt(options.normal_acceleration_mm_s2 / bend))
                      : options.feed_mm_s;
  };
  std::vector<PrintMove> out{{path[0], axes[0], 0.0}};
  double time_s = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i)
    add_way(options, std::min(speed_at(i - 1), speed_at(i)), {path[i - 1], axes[i - 1], 0.0},
            {path[i], axes[i], 0.0}, out, 0);
  for (const PrintMove& move : out) time_s += move.time_s;
  if (time_s <= options.off_delay_s)
    throw MotionError(fmt::format(
        "{}: printed in {:.4f} s, expected longer than the valve takes to close ({} s); print slower", name,
        time_s, options.off_delay_s));
  return out;
}

}  // namespace

std::vector<PrintMove> plan_line(const RealLine& line, const PrintProgramOptions& options) {
  return plan_named_line(called(line.name), line, options);
}

std::string write_print_program(std::span<const RealLine> lines, std::string_view name,
                                const PrintProgramOptions& options, std::span<const double> heights_mm) {
  check_options(options);
  if (lines.empty()) throw MotionError("print program: found no line, expected at least one");
  if (!heights_mm.empty() && heights_mm.size() != lines.size())
    throw MotionError(
        fmt::format("heights: found {} for {} lines, expected one a line", heights_mm.size(), lines.size()));
  ProgramWriter writer(options);
  writer.begin(name, lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    PrintProgramOptions own = options;
    if (!heights_mm.empty()) own.height_mm = heights_mm[i];
    const std::string in_messages = lines[i].name.empty() ? fmt::format("line {}", i + 1) : lines[i].name;
    writer.line(lines[i].name, plan_named_line(in_messages, lines[i], own));
  }
  return writer.end();
}

}  // namespace meltstage::motion
