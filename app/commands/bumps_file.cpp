// SPDX-License-Identifier: Apache-2.0
#include "app/commands/bumps_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <utility>

#include "app/number_range.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, double> kUnits_mm = {
    {"m", 1000.0}, {"mm", 1.0}, {"um", 0.001}, {"inch", 25.4}, {"mil", 0.0254}};

// A job's origin moves bumps by so much at the most. The points count in `unit_mm`.
void require_near_origin(const std::vector<motion::Point>& points, double unit_mm, const fs::path& bumps) {
  constexpr double kFarthest_mm = 1e6;
  for (const motion::Point& point : points)
    for (const auto& [axis, value] : {std::pair{"x", point.x_mm}, std::pair{"y", point.y_mm}})
      if (!(std::abs(value) * unit_mm <= kFarthest_mm))
        throw UserError(
            fmt::format("{}: row {}: {}: found {:.6g} mm, expected at most {:.0f} mm from the file's "
                        "origin; is the number or the unit right?",
                        bumps.string(), point.row, axis, value * unit_mm, kFarthest_mm));
}

std::string known_units() {
  std::string known;
  for (const auto& [name, mm] : kUnits_mm) known += (known.empty() ? "" : ", ") + name;
  return known;
}

bool is_drawing(const std::filesystem::path& path) {
  return path.extension() == ".dxf" || path.extension() == ".DXF";
}

// The length of one of the file's numbers, from the options or, on a terminal, from who sits there.
double asked_pitch_mm(const BumpsFile& file) {
  if (file.pitch_mm) return *file.pitch_mm;
  std::string unit = file.unit;
  if (unit.empty() && isatty(STDIN_FILENO) != 0) {
    fmt::print("{}: its numbers have no unit. Unit ({}): ", escaped(file.path.string()), known_units());
    std::fflush(stdout);
    std::getline(std::cin, unit);
  }
  if (unit.empty())
    throw UserError(
        fmt::format("{}: found numbers without a unit, expected --unit {} (or --pitch-mm for grid "
                    "indices){}",
                    file.path.string(), known_units(),
                    is_drawing(file.path) ? "" : ", or a row that names the columns, such as x_mm,y_mm"));
  const auto known = kUnits_mm.find(unit);
  if (known == kUnits_mm.end())
    throw UserError(fmt::format("unit: found \"{}\", expected one of {}", unit, known_units()));
  return known->second;
}

}  // namespace

Extent extent_of(const std::vector<motion::Point>& points, double motion::Point::*axis) {
  const auto [low, high] = std::minmax_element(
      points.begin(), points.end(),
      [axis](const motion::Point& a, const motion::Point& b) { return a.*axis < b.*axis; });
  return {(*low).*axis, (*high).*axis};
}

void add_bumps_options(CLI::App& command, BumpsFile& file) {
  command.add_option("BUMPS", file.path, "File of bumps; formats in docs/motion/path.md")->required();
  CLI::Option* unit =
      command.add_option("--unit", file.unit, "Unit of numbers that have none: " + known_units());
  command.add_option("--pitch-mm", file.pitch_mm, "Instead: length of one step of grid indices, mm")
      ->check(number_from(1e-6, 1e6))
      ->excludes(unit);
  command.add_option("--side", file.side, "Bumps of this side of the board alone: top, bottom")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, motion::Side>{{"top", motion::Side::top}, {"bottom", motion::Side::bottom}}));
  command.add_option("--only", file.only,
                     "Bumps of this tool (T1), aperture (D10), footprint (U1) or layer of a drawing alone");
}

ReadBumps read_bumps(const BumpsFile& wanted) {
  constexpr double kAnywhere_mm = std::numeric_limits<double>::max();
  motion::CoordinateOptions options;
  options.travel = {{-kAnywhere_mm, kAnywhere_mm}, {-kAnywhere_mm, kAnywhere_mm}, {}};
  options.side = wanted.side;
  options.only = wanted.only;
  motion::CoordinateFile file = motion::read_coordinate_file(wanted.path, options);
  if (file.has_unit && (!wanted.unit.empty() || wanted.pitch_mm))
    throw UserError(fmt::format("{}: says its unit itself{}; leave out --unit and --pitch-mm",
                                wanted.path.string(),
                                file.unit_place.empty() ? "" : fmt::format(" ({})", file.unit_place)));
  if (!file.has_unit) {
    options.pitch_mm = asked_pitch_mm(wanted);
    require_near_origin(file.points, options.pitch_mm, wanted.path);
    file = motion::read_coordinate_file(wanted.path, options);
  }
  require_near_origin(file.points, 1.0, wanted.path);
  return {std::move(file), options.pitch_mm};
}

}  // namespace meltstage::app
