// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/coordinates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/count.hpp"
#include "base/file.hpp"
#include "base/place.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion {
namespace {

struct Rotation {
  double cosine, sine;
};

/// Quarter turns are exact, so that a turned lattice stays a lattice.
Rotation rotation(double angle_deg) {
  const double turned_deg = std::remainder(angle_deg, 360.0);
  if (turned_deg == 0.0) return {1.0, 0.0};
  if (turned_deg == 90.0) return {0.0, 1.0};
  if (turned_deg == -90.0) return {0.0, -1.0};
  if (std::abs(turned_deg) == 180.0) return {-1.0, 0.0};
  const double angle_rad = turned_deg * std::numbers::pi / 180.0;
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

}  // namespace

namespace detail {

void fail(const std::filesystem::path& path, std::string_view what) {
  throw CoordinateError(fmt::format("{}: {}", path.string(), what));
}

std::optional<double> parse_number(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n\f\v";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return std::nullopt;
  text = text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::string no_bump_note(std::size_t count, std::string_view thing, std::size_t first_row) {
  return fmt::format("{}, {}in row {}, {} no bump", counted(count, thing), count == 1 ? "" : "first ",
                     first_row, count == 1 ? "holds" : "hold");
}

std::string in_quotes(std::string_view text) { return "'" + shown(text) + "'"; }

namespace {

/// In small letters, without the marks that layout systems write between words.
std::string plain(std::string_view word) {
  constexpr std::string_view kMarks = " \t_-./()";
  std::string small;
  for (const char c : word)
    if (kMarks.find(c) == std::string_view::npos)
      small += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return small;
}

constexpr std::array<std::string_view, 30> kTopWords = {
    "top",       "t",         "toplayer",  "topside",     "topcopper",
    "toppaste",  "topmask",   "topsolder", "topsilk",     "topoverlay",
    "front",     "frontside", "f",         "fcu",         "fpaste",
    "fmask",     "fsilks",    "ffab",      "component",   "componentside",
    "comp",      "compside",  "primary",   "primaryside", "upper",
    "upperside", "oben",      "oberseite", "topseite",    "best\u00fcckungsseite"};
constexpr std::array<std::string_view, 32> kBottomWords = {
    "bottom",        "bot",           "b",           "bottomlayer", "botlayer",     "bottomside",
    "botside",       "bottomcopper",  "bottompaste", "bottommask",  "bottomsolder", "bottomsilk",
    "bottomoverlay", "back",          "backside",    "bcu",         "bpaste",       "bmask",
    "bsilks",        "bfab",          "solder",      "solderside",  "sold",         "soldside",
    "secondary",     "secondaryside", "lower",       "lowerside",   "unten",        "unterseite",
    "bottomseite",   "l\u00f6tseite"};

}  // namespace

std::optional<Side> side_named(std::string_view word) {
  const std::string text = plain(word);
  if (std::find(kTopWords.begin(), kTopWords.end(), text) != kTopWords.end()) return Side::top;
  if (std::find(kBottomWords.begin(), kBottomWords.end(), text) != kBottomWords.end()) return Side::bottom;
  return std::nullopt;
}

void OneSide::check(const std::filesystem::path& path, std::string_view place, Side side,
                    std::string_view word) {
  if (!side_) {
    side_ = side;
    first_ = trimmed(word);
  }
  if (side == *side_) return;
  throw CoordinateError(
      fmt::format("{}: {}: found side {} behind bumps of side {}, expected one side; export them apart",
                  path.string(), place, in_quotes(trimmed(word)), in_quotes(first_)));
}

bool OneSide::is_bottom() const { return side_ == Side::bottom; }

RawPoint turned(const RawPoint& point, double angle_deg) {
  const Rotation turn = rotation(angle_deg);
  return {turn.cosine * point.x - turn.sine * point.y, turn.sine * point.x + turn.cosine * point.y,
          point.row};
}

void check_point_count(const std::filesystem::path& path, std::size_t count) {
  if (count > kMaxPoints)
    throw CoordinateError(fmt::format("{}: found more than {} points, expected at most that; split the file",
                                      path.string(), kMaxPoints));
}

}  // namespace detail

namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;

std::string read_content(const std::filesystem::path& path) {
  std::string content = read_file(path, "a file with coordinates, such as bumps.csv", kMostBytes);
  if (content.empty())
    throw CoordinateError(fmt::format("{}: the file is empty, expected coordinates", path.string()));
  return content;
}

detail::RawPoints read_raw(const std::filesystem::path& path) {
  const std::string content = read_content(path);
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".xls") return detail::read_table_points(path, content, detail::read_xls_rows);
  if (extension == ".xlsx") return detail::read_table_points(path, content, detail::read_xlsx_rows);
  if (extension == ".csv") return detail::read_table_points(path, content, detail::read_csv_rows);
  if (extension == ".kicad_mod") return detail::read_kicad_points(path, content);
  if (extension == ".pos") return detail::read_pos_points(path, content);
  const auto is_one_of = [&](std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), extension) != names.end();
  };
  if (is_one_of({".gbr", ".ger", ".grb", ".gbx", ".gtp", ".gbp"}))
    return detail::read_gerber_points(path, content);
  if (is_one_of({".drl", ".xln", ".exc", ".cnc"})) return detail::read_excellon_points(path, content);
  throw CoordinateError(
      fmt::format("{}: found extension {}, expected .xls, .xlsx, .csv, .kicad_mod, .pos, .gbr, .ger, .grb, "
                  ".gbx, .gtp, .gbp, "
                  ".drl, .xln, .exc or .cnc",
                  path.string(), detail::in_quotes(extension)));
}

void check_range(std::string_view axis, const Range& range) {
  if (!std::isfinite(range.min_mm) || !std::isfinite(range.max_mm) || range.min_mm > range.max_mm)
    throw CoordinateError(fmt::format("travel {}: found {}..{} mm, expected finite ends, the smaller first",
                                      axis, range.min_mm, range.max_mm));
}

void check_options(const CoordinateOptions& options) {
  if (!std::isfinite(options.pitch_mm) || options.pitch_mm <= 0.0)
    throw CoordinateError(
        fmt::format("pitch: found {} mm, expected a finite number above 0", options.pitch_mm));
  const auto check_finite = [](std::string_view what, double value) {
    if (!std::isfinite(value))
      throw CoordinateError(fmt::format("{}: found {}, expected a finite number", what, value));
  };
  check_finite("origin x", options.origin_x_mm);
  check_finite("origin y", options.origin_y_mm);
  check_finite("rotation", options.rotation_deg);
  check_range("x", options.travel.x);
  check_range("y", options.travel.y);
}

std::vector<Point> place(const std::vector<detail::RawPoint>& raw, const CoordinateOptions& options) {
  const Rotation turn = rotation(options.rotation_deg);
  const double x_sign = options.mirror_x ? -1.0 : 1.0;
  std::vector<Point> points;
  points.reserve(raw.size());
  for (const auto& [raw_x, raw_y, row] : raw) {
    const double x_mm = x_sign * raw_x * options.pitch_mm;
    const double y_mm = raw_y * options.pitch_mm;
    points.push_back({turn.cosine * x_mm - turn.sine * y_mm + options.origin_x_mm,
                      turn.sine * x_mm + turn.cosine * y_mm + options.origin_y_mm, row});
  }
  return points;
}

void check_in_travel(const std::filesystem::path& path, std::size_t row, std::string_view axis,
                     double value_mm, const Range& range) {
  if (value_mm >= range.min_mm && value_mm <= range.max_mm) return;
  throw CoordinateError(
      fmt::format("{}: row {}: {} is {:.6g} mm on the stage, expected {:.6g}..{:.6g} mm (travel); move the "
                  "origin or change the pitch",
                  path.string(), row, axis, value_mm, range.min_mm, range.max_mm));
}

/// Names the first point of the file that stands where an earlier one does.
void check_no_duplicates(const std::filesystem::path& path, const std::vector<Point>& points) {
  std::vector<std::size_t> cell_order(points.size());
  std::iota(cell_order.begin(), cell_order.end(), std::size_t{0});
  // Rounding to the duplicate distance makes "the same" transitive, so one sort finds every pair.
  const auto cell = [](double value_mm) { return std::round(value_mm * (1.0 / kDuplicateDistance_mm)); };
  std::sort(cell_order.begin(), cell_order.end(), [&](std::size_t a, std::size_t b) {
    const double ax = cell(points[a].x_mm), bx = cell(points[b].x_mm);
    if (ax != bx) return ax < bx;
    const double ay = cell(points[a].y_mm), by = cell(points[b].y_mm);
    return ay != by ? ay < by : a < b;
  });
  // The pair whose second point comes first in the file is the one a reader meets first.
  std::size_t first = points.size(), second = points.size();
  for (std::size_t i = 1; i < cell_order.size(); ++i) {
    const std::size_t a = cell_order[i - 1], b = cell_order[i];
    const bool same =
        cell(points[a].x_mm) == cell(points[b].x_mm) && cell(points[a].y_mm) == cell(points[b].y_mm);
    if (same && b < second) {
      first = a;
      second = b;
    }
  }
  if (second == points.size()) return;
  throw CoordinateError(fmt::format(
      "{}: row {}: found ({:.6g}, {:.6g}) mm again, first in row {}; expected every point once",
      path.string(), points[second].row, points[second].x_mm, points[second].y_mm, points[first].row));
}

}  // namespace

CoordinateFile read_coordinate_file(const std::filesystem::path& path, const CoordinateOptions& options) {
  check_options(options);
  detail::RawPoints raw = read_raw(path);
  if (raw.points.empty())
    throw CoordinateError(fmt::format("{}: found no points, expected at least one", path.string()));
  if (raw.has_unit && options.pitch_mm != 1.0)
    throw CoordinateError(
        fmt::format("{}: found pitch {} mm for coordinates that have a unit, expected no pitch; it is for "
                    "grid indices only",
                    path.string(), options.pitch_mm));
  std::vector<Point> points = place(raw.points, options);
  for (const Point& point : points) {
    check_in_travel(path, point.row, "x", point.x_mm, options.travel.x);
    check_in_travel(path, point.row, "y", point.y_mm, options.travel.y);
  }
  check_no_duplicates(path, points);
  if (raw.bottom && !options.mirror_x)
    raw.notes.emplace_back(
        "the bumps lie on the bottom of the board and mirror_x is false: they are printed as seen from its "
        "top; "
        "set mirror_x = true unless the file was mirrored when it was written");
  return {std::move(points), std::move(raw.notes), raw.has_unit};
}

std::vector<Point> read_coordinates(const std::filesystem::path& path, const CoordinateOptions& options) {
  return read_coordinate_file(path, options).points;
}

}  // namespace meltstage::motion
