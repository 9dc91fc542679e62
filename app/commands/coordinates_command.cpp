// SPDX-License-Identifier: Apache-2.0
// `meltstage coordinates`: what is understood of a file of bumps, before anything is printed.
// Reference: docs/start/own-bumps.md.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "app/commands/bumps_file.hpp"
#include "app/json_output.hpp"
#include "app/verbs.hpp"
#include "base/count.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;

struct CoordinatesSettings {
  BumpsFile bumps;
  fs::path picture;
  bool json = false;
};

struct Pair {
  double distance_mm = std::numeric_limits<double>::infinity();
  std::size_t row = 0, other_row = 0;  // the smaller one first
};

/// The two points that are nearest to each other, by a sweep along x; of at least two points.
Pair nearest_pair(std::vector<motion::Point> points) {
  const auto by_x = [](const motion::Point& a, const motion::Point& b) { return a.x_mm < b.x_mm; };
  const auto by_y = [](const motion::Point& a, const motion::Point& b) { return a.y_mm < b.y_mm; };
  std::sort(points.begin(), points.end(), by_x);
  std::multiset<motion::Point, decltype(by_y)> near(by_y);  // no farther behind in x than the best pair
  Pair best;
  auto oldest = points.cbegin();
  for (const motion::Point& point : points) {
    // Of equal y the first one came first, so that it is the oldest.
    for (; point.x_mm - oldest->x_mm > best.distance_mm; ++oldest) near.erase(near.lower_bound(*oldest));
    const auto last = near.upper_bound({0.0, point.y_mm + best.distance_mm});
    for (auto other = near.lower_bound({0.0, point.y_mm - best.distance_mm}); other != last; ++other) {
      const double distance_mm = std::hypot(point.x_mm - other->x_mm, point.y_mm - other->y_mm);
      if (distance_mm < best.distance_mm)
        best = {distance_mm, std::min(point.row, other->row), std::max(point.row, other->row)};
    }
    near.insert(point);
  }
  return best;
}

/// A dot for each place of the picture that holds bumps, x to the right and y up, with the first bump of the
/// file ringed.
std::string picture_of(const std::vector<motion::Point>& points, const Extent& x, const Extent& y) {
  constexpr double kPicture = 800.0, kMargin = 40.0, kDot = 2.0;
  const double longer_mm = std::max({x.size(), y.size(), 1e-6});
  const double scale = kPicture / longer_mm;  // user units per mm
  const double width = x.size() * scale + 2.0 * kMargin, height = y.size() * scale + 2.0 * kMargin;
  const auto place = [&](const motion::Point& point) {
    return std::pair{std::lround((kMargin + (point.x_mm - x.low) * scale) / kDot),
                     std::lround((height - kMargin - (point.y_mm - y.low) * scale) / kDot)};
  };
  std::set<std::pair<long, long>> dots;
  for (const motion::Point& point : points) dots.insert(place(point));
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n<title>{2} over {3:.6g} mm x {4:.6g} mm</title>\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
      "<rect x=\"{5}\" y=\"{5}\" width=\"{6:.1f}\" height=\"{7:.1f}\" fill=\"none\" stroke=\"#bbb\"/>\n"
      "<path stroke=\"#14508c\" stroke-width=\"{8}\" stroke-linecap=\"round\" d=\"",
      width, height, counted(points.size(), "bump"), x.size(), y.size(), kMargin, width - 2.0 * kMargin,
      height - 2.0 * kMargin, std::clamp(0.3 * kPicture / std::sqrt(points.size()), 2.0 * kDot, 14.0));
  for (const auto& [column, line] : dots)
    out += fmt::format("M{} {}h0", static_cast<double>(column) * kDot, static_cast<double>(line) * kDot);
  const auto [first_x, first_y] = place(points.front());
  out += fmt::format(
      "\"/>\n<circle cx=\"{}\" cy=\"{}\" r=\"7\" fill=\"none\" stroke=\"#c33\" stroke-width=\"1.5\"/>\n"
      "<g fill=\"#444\"><text x=\"{}\" y=\"{}\">x {:.6g}</text><text x=\"{}\" y=\"{}\" "
      "text-anchor=\"end\">{:.6g} mm</text>"
      "<text x=\"{}\" y=\"{}\" transform=\"rotate(-90 {} {})\">y {:.6g}</text>"
      "<text x=\"{}\" y=\"{}\" text-anchor=\"end\" transform=\"rotate(-90 {} {})\">{:.6g} "
      "mm</text></g>\n</svg>\n",
      static_cast<double>(first_x) * kDot, static_cast<double>(first_y) * kDot, kMargin, height - 14.0, x.low,
      width - kMargin, height - 14.0, x.high, 20.0, height - kMargin, 20.0, height - kMargin, y.low, 20.0,
      kMargin, 20.0, kMargin, y.high);
  return out;
}

std::string unit_of(const CoordinatesSettings& settings, const ReadBumps& bumps) {
  if (!bumps.file.unit_place.empty()) return bumps.file.unit_place;
  if (bumps.file.has_unit) return "as the format says";
  return settings.bumps.unit.empty() ? fmt::format("{:.9g} mm, as given", bumps.pitch_mm)
                                     : settings.bumps.unit + ", as given";
}

// What both the text and the JSON tell.
struct Understood {
  const ReadBumps& bumps;
  std::string file, unit;
  Extent x, y;
  std::optional<Pair> nearest;  // of two points at least
};

Understood understood_of(const CoordinatesSettings& settings, const ReadBumps& bumps) {
  const std::vector<motion::Point>& points = bumps.file.points;
  return {bumps,
          settings.bumps.path.string(),
          unit_of(settings, bumps),
          extent_of(points, &motion::Point::x_mm),
          extent_of(points, &motion::Point::y_mm),
          points.size() > 1 ? std::optional(nearest_pair(points)) : std::nullopt};
}

void tell(const Understood& u) {
  const std::vector<motion::Point>& points = u.bumps.file.points;
  fmt::print("{}: {} over {:.6g} mm x {:.6g} mm\n", escaped(u.file), counted(points.size(), "bump"),
             u.x.size(), u.y.size());
  fmt::print("unit     {}\n", u.unit);
  fmt::print("x        {:.6f} .. {:.6f} mm\n", u.x.low, u.x.high);
  fmt::print("y        {:.6f} .. {:.6f} mm\n", u.y.low, u.y.high);
  fmt::print("first    row {}: ({:.6f}, {:.6f}) mm\n", points.front().row, points.front().x_mm,
             points.front().y_mm);
  fmt::print("last     row {}: ({:.6f}, {:.6f}) mm\n", points.back().row, points.back().x_mm,
             points.back().y_mm);
  if (u.nearest)
    fmt::print("nearest  {:.6f} mm apart: rows {} and {}\n", u.nearest->distance_mm, u.nearest->row,
               u.nearest->other_row);
  fmt::print("side     {}\n", u.bumps.file.bottom ? "bottom" : "top, or not told");
  for (const motion::BumpGroup& group : u.bumps.file.groups)
    fmt::print("{:8} {}\n", escaped(group.name), counted(group.bumps, "bump"));
  for (const std::string& note : u.bumps.file.notes) fmt::print("note: {}\n", note);
}

void tell_json(const Understood& u) {
  using Json = nlohmann::ordered_json;
  Json bumps = Json::array(), groups = Json::array();
  for (const motion::Point& point : u.bumps.file.points)
    bumps.push_back({{"row", point.row}, {"x_mm", point.x_mm}, {"y_mm", point.y_mm}});
  for (const motion::BumpGroup& group : u.bumps.file.groups)
    groups.push_back({{"name", group.name}, {"bumps", group.bumps}});
  Json told = {{"file", u.file},
               {"unit", u.unit},
               {"side", u.bumps.file.bottom ? "bottom" : "top or not told"},
               {"x_mm", {u.x.low, u.x.high}},
               {"y_mm", {u.y.low, u.y.high}},
               {"nearest", nullptr},
               {"groups", groups},
               {"notes", u.bumps.file.notes},
               {"bumps", bumps}};
  if (u.nearest)
    told["nearest"] = {{"distance_mm", u.nearest->distance_mm},
                       {"rows", {u.nearest->row, u.nearest->other_row}}};
  print_json(told);
}

int tell_coordinates(const CoordinatesSettings& settings) {
  if (!settings.picture.empty()) require_other_file(settings.picture, {settings.bumps.path});
  const ReadBumps bumps = read_bumps(settings.bumps);
  const Understood understood = understood_of(settings, bumps);
  settings.json ? tell_json(understood) : tell(understood);
  if (settings.picture.empty()) return 0;
  write_whole(settings.picture, picture_of(bumps.file.points, understood.x, understood.y));
  if (!settings.json)
    fmt::print("{}: a picture of them; the first one is ringed\n", escaped(settings.picture.string()));
  return 0;
}

}  // namespace

Action add_coordinates_command(CLI::App& cli, const std::string&) {
  const auto s = std::make_shared<CoordinatesSettings>();
  CLI::App* command = cli.add_subcommand(
      "coordinates", "Tell what is understood of a file of bumps (docs/start/own-bumps.md)");
  show_example(command, "coordinates bumps.csv --picture bumps.svg");
  add_bumps_options(*command, s->bumps);
  command->add_option("--picture", s->picture, "Draw them into this file (.svg)");
  command->add_flag("--json", s->json, kJsonHelp);
  return [s] { return tell_coordinates(*s); };
}

}  // namespace meltstage::app
