// SPDX-License-Identifier: Apache-2.0
// A file of bumps as a person names it on the command line, with the unit of its numbers where it says none.
#pragma once

#include <CLI/App.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "motion/bumps/coordinates.hpp"

namespace meltstage::app {

struct BumpsFile {
  std::filesystem::path path;
  std::string unit;                  // of the file's numbers, where it says none; empty: not given
  std::optional<double> pitch_mm;    // instead: the numbers count in this
  std::optional<motion::Side> side;  // of the board, where the file has both
  std::string only;                  // tool, aperture, footprint or layer; empty: all
};

/// BUMPS, --unit, --pitch-mm, --side and --only.
void add_bumps_options(CLI::App& command, BumpsFile& file);

struct ReadBumps {
  motion::CoordinateFile file;  // in millimetres of the file's own frame, wherever that lies
  double pitch_mm = 1.0;        // what its numbers counted in; 1 where it says its unit itself
};

/// Throws UserError where the file can't be read, tells no unit and none is given (on a terminal, who sits
/// there is asked), or has bumps farther than a job can place them.
ReadBumps read_bumps(const BumpsFile& file);

struct Extent {
  double low = 0.0, high = 0.0;
  double size() const { return high - low; }
};

/// Of at least one point.
Extent extent_of(const std::vector<motion::Point>& points, double motion::Point::*axis);

}  // namespace meltstage::app
