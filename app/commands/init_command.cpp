// SPDX-License-Identifier: Apache-2.0
// `meltstage init`: a commented job for somebody's bumps. Reference: docs/start/own-bumps.md.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "app/number_range.hpp"
#include "app/verbs.hpp"
#include "base/count.hpp"
#include "base/error.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "motion/bumps/coordinates.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, double> kUnits_mm = {
    {"m", 1000.0}, {"mm", 1.0}, {"um", 0.001}, {"inch", 25.4}, {"mil", 0.0254}};

struct InitSettings {
  fs::path bumps;
  fs::path out;
  std::string unit;                // of the file's numbers, where it says none; empty: not given
  std::optional<double> pitch_mm;  // instead: the numbers count in this
};

struct Extent {
  double low = 0.0, high = 0.0;
  double size() const { return high - low; }
};

Extent extent_of(const std::vector<motion::Point>& points, double motion::Point::*axis) {
  const auto [low, high] = std::minmax_element(
      points.begin(), points.end(),
      [axis](const motion::Point& a, const motion::Point& b) { return a.*axis < b.*axis; });
  return {(*low).*axis, (*high).*axis};
}

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

// The length of one of the file's numbers, from the options or, on a terminal, from who sits there.
double asked_pitch_mm(const InitSettings& settings) {
  if (settings.pitch_mm) return *settings.pitch_mm;
  std::string unit = settings.unit;
  if (unit.empty() && isatty(STDIN_FILENO) != 0) {
    fmt::print("{}: its numbers have no unit. Unit ({}): ", escaped(settings.bumps.string()), known_units());
    std::fflush(stdout);
    std::getline(std::cin, unit);
  }
  if (unit.empty())
    throw UserError(
        fmt::format("{}: found numbers without a unit, expected --unit {} (or --pitch-mm for grid "
                    "indices), or a row that names the columns, such as x_mm,y_mm",
                    settings.bumps.string(), known_units()));
  const auto known = kUnits_mm.find(unit);
  if (known == kUnits_mm.end())
    throw UserError(fmt::format("unit: found \"{}\", expected one of {}", unit, known_units()));
  return known->second;
}

std::string toml_text(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

// The origin that brings the middle of the bumps to the middle of the travel, in whole micrometres.
double centred(const Extent& extent, const motion::Range& travel) {
  const double middle = 0.5 * (travel.min_mm + travel.max_mm) - 0.5 * (extent.low + extent.high);
  return std::round(middle * 1000.0) / 1000.0;
}

// A job is TOML, whose texts are UTF-8, and its reader takes none with control characters.
std::string text_for_job(const std::string& name) {
  if (escaped(name) != name)
    throw UserError(
        fmt::format("{}: found a name with a control character or one that is no UTF-8, expected a name that "
                    "a job can hold; rename the file or its folder",
                    escaped(name)));
  return toml_text(name);
}

int init_job(const InitSettings& settings) {
  const fs::path job =
      settings.out.empty() ? fs::path(settings.bumps.stem().string() + ".toml") : settings.out;
  if (fs::exists(fs::symlink_status(job)))
    throw UserError(
        fmt::format("{}: is there already; give another name by --out, or remove it", job.string()));

  constexpr double kAnywhere_mm = std::numeric_limits<double>::max();  // it is placed on the stage below
  motion::CoordinateOptions options;
  options.travel = {{-kAnywhere_mm, kAnywhere_mm}, {-kAnywhere_mm, kAnywhere_mm}, {}};
  motion::CoordinateFile file = motion::read_coordinate_file(settings.bumps, options);
  if (file.has_unit && (!settings.unit.empty() || settings.pitch_mm))
    throw UserError(fmt::format("{}: says its unit itself{}; leave out --unit and --pitch-mm",
                                settings.bumps.string(),
                                file.unit_place.empty() ? "" : fmt::format(" ({})", file.unit_place)));
  if (!file.has_unit) {
    options.pitch_mm = asked_pitch_mm(settings);
    require_near_origin(file.points, options.pitch_mm, settings.bumps);
    file = motion::read_coordinate_file(settings.bumps, options);
  }

  require_near_origin(file.points, 1.0, settings.bumps);
  const Extent x = extent_of(file.points, &motion::Point::x_mm),
               y = extent_of(file.points, &motion::Point::y_mm);
  const motion::Travel travel;
  if (x.size() > travel.x.max_mm - travel.x.min_mm || y.size() > travel.y.max_mm - travel.y.min_mm)
    throw UserError(
        fmt::format("{}: found bumps over {:.6g} mm x {:.6g} mm, expected at most {:.6g} mm x {:.6g} mm; "
                    "is the unit right?",
                    settings.bumps.string(), x.size(), y.size(), travel.x.max_mm, travel.y.max_mm));

  const fs::path folder = fs::absolute(job).parent_path();
  const std::string pitch =
      file.has_unit ? "# the file says the unit of its numbers itself\n"
                    : fmt::format("pitch_mm = {}  # length of one unit of the file\n", options.pitch_mm);
  write_whole(
      job,
      fmt::format("# Made by meltstage init. Every field: docs/print/jobs.md\n"
                  "# {} over {:.6g} mm x {:.6g} mm; x to the right, y away from the operator.\n\n"
                  "[job]\nname = {}\nseed = 1                # of all that is random\n\n"
                  "[coordinates]\nfile = {}\n{}"
                  "origin_x_mm = {}      # where its (0, 0) lies on the stage: the bumps are in the middle\n"
                  "origin_y_mm = {}\n"
                  "mirror_x = false         # true: a package seen from its other side\n\n"
                  "[head]\nplant = \"E3D-like\"       # a small, fast head\nsensor = \"MAX31855\"\n\n"
                  "[temperature]\nsetpoint_degc = 60.0\nwindow_degc = 1.0        # prints within this of the "
                  "set-point\n"
                  "dwell_s = 2.0            # once it has been there for so long\n\n"
                  "[print]\ndroplet_j = 0.02         # heat that a droplet takes along\n",
                  counted(file.points.size(), "bump"), x.size(), y.size(),
                  text_for_job(settings.bumps.stem().string()),
                  text_for_job(fs::proximate(fs::absolute(settings.bumps), folder).string()), pitch,
                  centred(x, travel.x), centred(y, travel.y)));
  for (const std::string& note : file.notes) fmt::print("note: {}\n", note);
  if (settings.bumps.extension() == ".kicad_mod")
    fmt::print("note: KiCad's y points down; what lies above there lies above here\n");
  fmt::print("{}: {} over {:.6g} mm x {:.6g} mm; print it: meltstage print {}\n", escaped(job.string()),
             counted(file.points.size(), "bump"), x.size(), y.size(), escaped(job.string()));
  return 0;
}

}  // namespace

Action add_init_command(CLI::App& cli, const std::string&) {
  const auto s = std::make_shared<InitSettings>();
  CLI::App* command =
      cli.add_subcommand("init", "Write a commented job for a file of bumps (docs/start/own-bumps.md)");
  command->add_option("BUMPS", s->bumps, "File of bumps; formats in docs/motion/path.md")->required();
  command->add_option("--out", s->out, "Job to write (default: NAME.toml here)");
  CLI::Option* unit =
      command->add_option("--unit", s->unit, "Unit of numbers that have none: " + known_units());
  command->add_option("--pitch-mm", s->pitch_mm, "Instead: length of one step of grid indices, mm")
      ->check(number_from(1e-6, 1e6))
      ->excludes(unit);
  return [s] { return init_job(*s); };
}

}  // namespace meltstage::app
