// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/coordinates.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
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
  text = trimmed(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  constexpr std::string_view kMinus = "\u2212";  // as word processors write it
  const bool negated = text.starts_with(kMinus) && !text.substr(kMinus.size()).starts_with('-');
  if (negated) text.remove_prefix(kMinus.size());
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return negated ? -value : value;
}

void OtherPads::tell(RawPoints& points) const {
  if (count == 0) return;
  points.notes.push_back(count == 1 ? fmt::format("1 {}, in row {}, is {} by the file's own word and makes "
                                                  "a bump all the same",
                                                  thing, first_row, one)
                                    : fmt::format("{} {}, the first in row {}, are {} by the file's own word "
                                                  "and make bumps all the same",
                                                  count, things, first_row, many));
}

std::string no_bump_note(std::size_t count, std::string_view thing, std::size_t first_row) {
  return fmt::format("{}, {}in row {}, {} no bump", counted(count, thing), count == 1 ? "" : "first ",
                     first_row, count == 1 ? "holds" : "hold");
}

std::string in_quotes(std::string_view text) { return "'" + shown(text) + "'"; }

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

/// An Excellon file has a header, which a table has not. Layout systems call both ".txt".
bool holds_drills(std::string_view content) {
  bool header = false;
  detail::for_lines(content.substr(0, 65536), [&](const detail::Line& line) {
    header = header || detail::trimmed(line.text) == "M48";
  });
  return header;
}

using Path = std::filesystem::path;

detail::RawPoints read_text(const Path& path, std::string_view content) {
  return holds_drills(content) ? detail::read_excellon_points(path, content)
                               : detail::read_text_table(path, content);
}

/// Eagle's mounting list of the bottom.
detail::RawPoints read_bottom_list(const Path& path, std::string_view content) {
  detail::RawPoints table = detail::read_text_table(path, content);
  for (const detail::RawPoint& point : table.points)
    if (point.side == Side::top)
      detail::fail(path,
                   fmt::format("row {}: found top, expected bottom, as the ending .mnb says", point.row));
  lie_on(table.points, Side::bottom);
  return table;
}

/// A file's ending, and what reads it.
struct Format {
  std::string_view ending;
  detail::RawPoints (*read)(const Path& path, std::string_view content);
};

constexpr std::array kFormats{
    Format{".xls", detail::read_xls_table},
    Format{".xlsx", detail::read_xlsx_table},
    Format{".csv", detail::read_text_table},
    Format{".tsv", detail::read_text_table},
    Format{".txt", read_text},
    Format{".mnt", detail::read_text_table},
    Format{".mnb", read_bottom_list},
    Format{".pkp", detail::read_text_table},
    Format{".kicad_mod", detail::read_kicad_points},
    Format{".kicad_pcb", detail::read_kicad_board},
    Format{".dxf", detail::read_dxf_points},
    Format{".pos", detail::read_pos_points},
    Format{".gbr", detail::read_gerber_points},
    Format{".ger", detail::read_gerber_points},
    Format{".grb", detail::read_gerber_points},
    Format{".gbx", detail::read_gerber_points},
    Format{".gtp", detail::read_gerber_points},
    Format{".gbp", detail::read_gerber_points},
    Format{".gts", detail::read_gerber_points},
    Format{".gbs", detail::read_gerber_points},
    Format{".gtl", detail::read_gerber_points},
    Format{".gbl", detail::read_gerber_points},
    Format{".art", detail::read_gerber_points},
    Format{".pho", detail::read_gerber_points},
    Format{".drl", detail::read_excellon_points},
    Format{".xln", detail::read_excellon_points},
    Format{".exc", detail::read_excellon_points},
    Format{".cnc", detail::read_excellon_points},
    Format{".ipc", detail::read_ipc356_points},
    Format{".d356", detail::read_ipc356_points},
    Format{".356", detail::read_ipc356_points},
    Format{".xml", detail::read_wafer_map},
    Format{".g85", detail::read_wafer_map},
};

detail::RawPoints read_raw(const Path& path) {
  const std::string content = read_content(path);
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::vector<std::string_view> endings;
  for (const Format& format : kFormats) {
    if (format.ending == ending) return format.read(path, content);
    endings.push_back(format.ending);
  }
  throw CoordinateError(fmt::format("{}: found extension {}, expected one of {}", path.string(),
                                    detail::in_quotes(ending), fmt::join(endings, ", ")));
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
  for (const detail::RawPoint& point : raw) {
    const double x_mm = x_sign * point.x * options.pitch_mm;
    const double y_mm = point.y * options.pitch_mm;
    points.push_back({turn.cosine * x_mm - turn.sine * y_mm + options.origin_x_mm,
                      turn.sine * x_mm + turn.cosine * y_mm + options.origin_y_mm, point.row});
  }
  return points;
}

/// Several footprints may have one name.
void keep_group(const Path& path, detail::RawPoints& raw, const std::string& wanted) {
  std::set<std::string> names;
  for (const auto& [key, name] : raw.groups) names.insert(name);
  if (!names.contains(wanted))
    throw CoordinateError(
        fmt::format("{}: only: found {}, expected {}", path.string(), detail::in_quotes(wanted),
                    names.empty() ? "none: this format has no tools, apertures, footprints or layers"
                                  : "one of " + shown(fmt::format("{}", fmt::join(names, ", ")))));
  const std::size_t others = std::erase_if(
      raw.points, [&](const detail::RawPoint& point) { return raw.groups.at(point.group) != wanted; });
  if (others > 0)
    raw.notes.push_back(fmt::format("{} that {} not of {} left out", counted(others, "bump"),
                                    others == 1 ? "is" : "are", shown(wanted)));
}

std::vector<BumpGroup> groups_of(const detail::RawPoints& raw) {
  std::map<std::string, std::size_t> counts;
  if (!raw.groups.empty())
    for (const detail::RawPoint& point : raw.points) ++counts[raw.groups.at(point.group)];
  std::vector<BumpGroup> out;
  for (const auto& [name, bumps] : counts) out.push_back({name, bumps});
  return out;
}

/// With both sides, one half of the bumps would be printed on the wrong one.
void require_one_side(const Path& path, const detail::RawPoints& raw) {
  std::optional<Side> side;
  for (const detail::RawPoint& point : raw.points) {
    if (side && point.side && point.side != side)
      throw CoordinateError(fmt::format(
          "{}: row {}: found side '{}' behind bumps of side '{}', expected one side; say which (side = "
          "\"{}\"), or export them apart{}",
          path.string(), point.row, detail::name_of(*point.side), detail::name_of(*side),
          detail::name_of(*side),
          raw.side_place.empty()
              ? ""
              : fmt::format(", or leave out {} where it tells no side of a board", raw.side_place)));
    if (point.side) side = point.side;
  }
}

/// Holes have no side: they stay.
void keep_side(const Path& path, detail::RawPoints& raw, Side wanted) {
  const auto has_side = [](const detail::RawPoint& point) { return point.side.has_value(); };
  if (std::none_of(raw.points.begin(), raw.points.end(), has_side))
    throw CoordinateError(
        fmt::format("{}: found no word on sides, expected one, since side = \"{}\"; leave the side out",
                    path.string(), detail::name_of(wanted)));
  const auto is_other = [&](const detail::RawPoint& point) { return point.side && point.side != wanted; };
  const auto first = std::find_if(raw.points.begin(), raw.points.end(), is_other);
  if (first == raw.points.end()) return;
  const std::size_t first_row = first->row;
  const std::size_t others = std::erase_if(raw.points, is_other);
  if (raw.points.empty())
    throw CoordinateError(fmt::format("{}: found bumps of the other side alone, expected some of side {}",
                                      path.string(), detail::name_of(wanted)));
  raw.notes.push_back(fmt::format("{} of the other side, first in row {}, left out (side = \"{}\")",
                                  counted(others, "bump"), first_row, detail::name_of(wanted)));
}

void check_in_travel(const std::filesystem::path& path, std::size_t row, std::string_view axis,
                     double value_mm, const Range& range) {
  if (value_mm >= range.min_mm && value_mm <= range.max_mm) return;
  throw CoordinateError(
      fmt::format("{}: row {}: {} is {:.6g} mm on the stage, expected {:.6g}..{:.6g} mm (travel); move the "
                  "origin or change the pitch",
                  path.string(), row, axis, value_mm, range.min_mm, range.max_mm));
}

// ---- bumps on top of each other ----

struct Pair {
  std::size_t first, second;  // in the order of the file
};

/// Points in strips along y, each as wide as the distance of two bumps that are one.
class Strips {
 public:
  explicit Strips(const std::vector<Point>& points) : points_(points), order_(points.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      const double as = strip(a), bs = strip(b);
      if (as != bs) return as < bs;
      return points_[a].y_mm != points_[b].y_mm ? points_[a].y_mm < points_[b].y_mm : a < b;
    });
  }

  /// The pair whose second point comes first in the file: the one a reader meets first.
  std::optional<Pair> find_pair() {
    for (std::size_t i = 1; i < order_.size(); ++i)
      if (strip(order_[i - 1]) == strip(order_[i])) compare(order_[i - 1], order_[i]);
    if (!found_) find_pair_across();
    return found_;
  }

 private:
  // Below the distance by more than a number's last digits.
  static constexpr double kNear_mm = kDuplicateDistance_mm * (1.0 - 1e-6);

  double strip(std::size_t i) const { return std::floor(points_[i].x_mm * (1.0 / kDuplicateDistance_mm)); }

  void compare(std::size_t a, std::size_t b) {
    if (a == b) return;  // so far out that a strip and its neighbour are one number
    if (std::abs(points_[a].x_mm - points_[b].x_mm) >= kNear_mm ||
        std::abs(points_[a].y_mm - points_[b].y_mm) >= kNear_mm)
      return;
    const Pair pair{std::min(a, b), std::max(a, b)};
    if (!found_ || pair.second < found_->second) found_ = pair;
  }

  /// Between neighbouring strips, in which no two points are near: each point has few to be compared with.
  void find_pair_across() {
    std::size_t other = 0;
    for (const std::size_t a : order_) {
      const double next = strip(a) + 1.0;
      const auto lies_before = [&](std::size_t b) {
        return strip(b) < next || (strip(b) == next && points_[b].y_mm <= points_[a].y_mm - kNear_mm);
      };
      while (other < order_.size() && lies_before(order_[other])) ++other;
      for (std::size_t i = other; i < order_.size() && strip(order_[i]) == next &&
                                  points_[order_[i]].y_mm < points_[a].y_mm + kNear_mm;
           ++i)
        compare(a, order_[i]);
    }
  }

  const std::vector<Point>& points_;
  std::vector<std::size_t> order_;
  std::optional<Pair> found_;
};

/// Names the first point of the file that stands where an earlier one does.
void check_no_duplicates(const std::filesystem::path& path, const std::vector<Point>& points) {
  const auto pair = Strips(points).find_pair();
  if (!pair) return;
  const Point &first = points[pair->first], &second = points[pair->second];
  throw CoordinateError(
      fmt::format("{}: row {}: found ({:.6g}, {:.6g}) mm again, first in row {}; expected every point once",
                  path.string(), second.row, second.x_mm, second.y_mm, first.row));
}

}  // namespace

CoordinateFile read_coordinate_file(const std::filesystem::path& path, const CoordinateOptions& options) {
  check_options(options);
  detail::RawPoints raw = read_raw(path);
  if (raw.points.empty())
    throw CoordinateError(fmt::format("{}: found no points, expected at least one", path.string()));
  if (raw.has_unit && options.pitch_mm != 1.0)
    throw CoordinateError(fmt::format(
        "{}: found pitch {} mm for coordinates that have a unit{}, expected no pitch; it is for "
        "grid indices only",
        path.string(), options.pitch_mm, raw.unit_place.empty() ? "" : " (" + raw.unit_place + ")"));
  if (!options.only.empty()) keep_group(path, raw, options.only);
  if (options.side)
    keep_side(path, raw, *options.side);
  else
    require_one_side(path, raw);
  const bool bottom = std::any_of(raw.points.begin(), raw.points.end(),
                                  [](const detail::RawPoint& point) { return point.side == Side::bottom; });
  std::vector<Point> points = place(raw.points, options);
  for (const Point& point : points) {
    check_in_travel(path, point.row, "x", point.x_mm, options.travel.x);
    check_in_travel(path, point.row, "y", point.y_mm, options.travel.y);
  }
  check_no_duplicates(path, points);
  if (bottom && !options.mirror_x)
    raw.notes.emplace_back(
        "the bumps lie on the bottom of the board and mirror_x is false: they are printed as seen from its "
        "top; "
        "set mirror_x = true unless the file was mirrored when it was written");
  return {std::move(points), std::move(raw.notes), raw.has_unit, std::move(raw.unit_place), bottom,
          groups_of(raw)};
}

std::vector<Point> read_coordinates(const std::filesystem::path& path, const CoordinateOptions& options) {
  return read_coordinate_file(path, options).points;
}

}  // namespace meltstage::motion
