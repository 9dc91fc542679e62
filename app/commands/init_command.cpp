// SPDX-License-Identifier: Apache-2.0
// `meltstage init`: a commented job for somebody's bumps. Reference: docs/start/own-bumps.md.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cmath>
#include <memory>

#include "app/commands/bumps_file.hpp"
#include "app/verbs.hpp"
#include "base/count.hpp"
#include "base/error.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;

struct InitSettings {
  BumpsFile bumps;
  fs::path out;
};

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

// Lines of the job for what was chosen of the file.
std::string selection_of(const BumpsFile& bumps) {
  std::string lines;
  if (bumps.side)
    lines += fmt::format("side = \"{}\"\n", *bumps.side == motion::Side::top ? "top" : "bottom");
  if (!bumps.only.empty()) lines += fmt::format("only = {}\n", text_for_job(bumps.only));
  return lines;
}

int init_job(const InitSettings& settings) {
  const fs::path job =
      settings.out.empty() ? fs::path(settings.bumps.path.stem().string() + ".toml") : settings.out;
  const auto require_new = [&](bool is_new) {
    if (!is_new)
      throw UserError(
          fmt::format("{}: is there already; give another name by --out, or remove it", job.string()));
  };
  require_new(!fs::exists(fs::symlink_status(job)));

  const ReadBumps bumps = read_bumps(settings.bumps);
  const motion::CoordinateFile& file = bumps.file;
  const Extent x = extent_of(file.points, &motion::Point::x_mm),
               y = extent_of(file.points, &motion::Point::y_mm);
  const motion::Travel travel;
  if (x.size() > travel.x.max_mm - travel.x.min_mm || y.size() > travel.y.max_mm - travel.y.min_mm)
    throw UserError(
        fmt::format("{}: found bumps over {:.6g} mm x {:.6g} mm, expected at most {:.6g} mm x {:.6g} mm; "
                    "is the unit right?",
                    settings.bumps.path.string(), x.size(), y.size(), travel.x.max_mm, travel.y.max_mm));

  const fs::path folder = fs::absolute(job).parent_path();
  const std::string pitch =
      file.has_unit ? "# the file says the unit of its numbers itself\n"
                    : fmt::format("pitch_mm = {}  # length of one unit of the file\n", bumps.pitch_mm);
  const bool written = write_whole_new(
      job,
      fmt::format("# Made by meltstage init. Every field: docs/print/jobs.md\n"
                  "# {} over {:.6g} mm x {:.6g} mm; x to the right, y away from the operator.\n\n"
                  "[job]\nname = {}\nseed = 1                # of all that is random\n\n"
                  "[coordinates]\nfile = {}\n{}"
                  "origin_x_mm = {}      # where its (0, 0) lies on the stage: the bumps are in the middle\n"
                  "origin_y_mm = {}\n"
                  "mirror_x = false         # true: a package seen from its other side\n{}\n"
                  "[head]\nplant = \"E3D-like\"       # a small, fast head\nsensor = \"MAX31855\"\n\n"
                  "[temperature]\nsetpoint_degc = 60.0\nwindow_degc = 1.0        # prints within this of the "
                  "set-point\n"
                  "dwell_s = 2.0            # once it has been there for so long\n\n"
                  "[print]\ndroplet_j = 0.02         # heat that a droplet takes along\n",
                  counted(file.points.size(), "bump"), x.size(), y.size(),
                  text_for_job(settings.bumps.path.stem().string()),
                  text_for_job(fs::proximate(fs::absolute(settings.bumps.path), folder).string()), pitch,
                  centred(x, travel.x), centred(y, travel.y), selection_of(settings.bumps)));
  require_new(written);  // by another process meanwhile
  for (const std::string& note : file.notes) fmt::print("note: {}\n", note);
  if (settings.bumps.path.extension().string().starts_with(".kicad_"))
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
  show_example(command, "init bumps.csv --out my_job.toml");
  add_bumps_options(*command, s->bumps);
  command->add_option("--out", s->out, "Job to write (default: NAME.toml here)");
  return [s] { return init_job(*s); };
}

}  // namespace meltstage::app
