// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/probe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/file.hpp"
#include "base/number.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_lines.hpp"
#include "motion/profile/check_positive.hpp"
#include "motion/profile/profile.hpp"
#include "motion/surface/rs274.hpp"

namespace meltstage::motion {

namespace {

void check_options(const ProbeProgramOptions& options) {
  check_positive("ball radius", options.ball_radius_mm, "mm");
  check_positive("approach", options.approach_mm, "mm");
  check_positive("overtravel", options.overtravel_mm, "mm");
  check_positive("touch feed", options.touch_mm_min, "mm/min");
  constexpr double kSlowest_mm_min = 0.1;  // that its one decimal tells
  if (options.touch_mm_min < kSlowest_mm_min)
    throw MotionError(fmt::format("touch feed: found {} mm/min, expected {} mm/min at least",
                                  options.touch_mm_min, kSlowest_mm_min));
  if (!options.station_offset_mm.allFinite() || !std::isfinite(options.safe_z_mm))
    throw MotionError("station offset or safe z: found a number that isn't finite, expected finite ones");
}

/// Ball's centre when the ball, at the nominal surface or off it by `off_mm`, is on the point's axis.
Eigen::Vector3d centre_mm(const MeasuringPoint& point, const ProbeProgramOptions& options, double off_mm) {
  return point.position_mm + (options.ball_radius_mm + off_mm) * point.axis;
}

std::string xyz(const Eigen::Vector3d& p) {
  return fmt::format("X{:.4f} Y{:.4f} Z{:.4f}", p.x(), p.y(), p.z());
}

}  // namespace

void require_safe_z(double safe_z_mm, double highest_mm, std::string_view why) {
  if (!(highest_mm <= safe_z_mm))
    throw MotionError(
        fmt::format("safe z: found {} mm, expected at least {:.3f} mm ({})", safe_z_mm, highest_mm, why));
}

std::string write_probe_program(std::span<const ProbeLine> lines, std::string_view name,
                                const ProbeProgramOptions& options) {
  check_options(options);
  std::size_t points = 0;
  for (const ProbeLine& line : lines) {
    for (const MeasuringPoint& point : line.points) {
      ++points;
      try {
        require_facing_up(point.position_mm, point.axis);
      } catch (const MotionError& error) {
        throw MotionError(fmt::format("{}: {}", called(line.name), error.what()));
      }
      const Eigen::Vector3d start = centre_mm(point, options, options.approach_mm);
      require_safe_z(options.safe_z_mm, start.z(),
                     fmt::format("a touch of {} begins there", called(line.name)));
    }
  }
  if (points == 0) throw MotionError("probe program: found no point, expected at least one");
  const Eigen::Vector3d& station = options.station_offset_mm;
  std::string out = fmt::format(
      "%\n({})\n({} points on {} lines; ball radius {:.4f} mm)\n"
      "G21 G90 G94 G17 G40 G49 G54\nG43.1 X{:.4f} Y{:.4f} Z{:.4f}\n(PROBEOPEN {})\n",
      rs274_comment(name), points, lines.size(), options.ball_radius_mm, station.x(), station.y(),
      station.z(), rs274_comment(options.points_file));
  out += fmt::format("G0 Z{:.4f}\nG0 A0 C0\n", options.safe_z_mm);
  for (const ProbeLine& line : lines) {
    out += fmt::format("({}: {} points)\n", rs274_comment(line.name), line.points.size());
    for (std::size_t i = 0; i < line.points.size(); ++i) {
      const Eigen::Vector3d start = centre_mm(line.points[i], options, options.approach_mm);
      // From point to point at the height of the approach, unless they are so far apart that the surface may
      // rise between them.
      const bool near = i > 0 && (line.points[i].position_mm - line.points[i - 1].position_mm).norm() <=
                                     2.0 * options.approach_mm;
      if (!near)
        out += fmt::format("G0 Z{:.4f}\nG0 X{:.4f} Y{:.4f}\n", options.safe_z_mm, start.x(), start.y());
      out += fmt::format("G0 {}\n", xyz(start));
      out +=
          fmt::format("G38.2 {} F{:.1f}\n", xyz(centre_mm(line.points[i], options, -options.overtravel_mm)),
                      options.touch_mm_min);
      out += fmt::format("G0 {}\n", xyz(start));
    }
    out += fmt::format("G0 Z{:.4f}\n", options.safe_z_mm);
  }
  out += "(PROBECLOSE)\nG49\nM2\n%\n";
  return out;
}

Touches read_touches(const std::filesystem::path& path) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;
  return read_touches_text(path.string(),
                           read_file(path, "the points that the probe program wrote", kMostBytes));
}

namespace {

/// Whether a row's first word is one of names; one that begins with a digit, a sign or a point is a touch
/// that was written wrong.
bool is_name(std::string_view word) {
  constexpr std::string_view kOfNumbers = "0123456789+-.";
  return kOfNumbers.find(word[0]) == std::string_view::npos && !detail::parse_number(word);
}

std::vector<std::string_view> words_of(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> out;
  for (std::size_t end = 0; out.size() <= kMostColumns;) {
    const std::size_t first = text.find_first_not_of(separators, end);
    if (first == std::string_view::npos) break;
    end = std::min(text.find_first_of(separators, first), text.size());
    out.push_back(text.substr(first, end - first));
  }
  return out;
}

class TouchRows {
 public:
  explicit TouchRows(std::string_view name) : name_(name) { touches.file = name; }

  void take(const detail::Line& line) {
    constexpr std::string_view kSeparators = " ,;\t\r";
    const auto words = words_of(line.text, kSeparators);
    if (words.empty()) return;
    last_row_ = line.number;
    if (line.number == 1 && is_name(words[0])) return require_order(words);
    refuse_decimal_commas(line);
    if (words.size() < 3)
      fail(line.number, fmt::format("found {} numbers, expected x, y and z", words.size()));
    if (columns_ == 0) columns_ = words.size(), first_row_ = line.number;
    if (words.size() != columns_)
      fail(line.number,
           fmt::format("found {} numbers, expected {} as in row {}", words.size(), columns_, first_row_));
    take_numbers(line.number, words);
  }

  /// A last row without its end may lack a part of its last number.
  void require_ended(std::string_view content) const {
    const auto last = content.find_last_not_of(" \t");
    if (last != std::string_view::npos && content[last] != '\n' && content[last] != '\r')
      fail(last_row_,
           "the file ends in the middle of the row, expected its line end; the file may be cut off");
  }

  Touches touches;

 private:
  /// Of a first row that names axes; any other is a title.
  void require_order(const std::vector<std::string_view>& words) const {
    constexpr std::string_view kAxes = "xyzabcuvw";
    std::size_t axes = 0;
    for (std::string_view word : words) {
      std::string name = detail::in_small_letters(word);
      std::erase_if(name,
                    [](char c) { return std::string_view("#()[]_").find(c) != std::string_view::npos; });
      const bool in_mm = name.size() == 3 && name.ends_with("mm");
      if (name == "mm" || kAxes.find(name.empty() ? ' ' : name[0]) == std::string_view::npos) continue;
      const std::string_view unit = std::string_view(name).substr(1);
      if (!unit.empty() && !in_mm && unit != "in" && unit != "inch" && unit != "um" && unit != "m") continue;
      if (axes >= kAxes.size() || name[0] != kAxes[axes] || !(unit.empty() || in_mm))
        fail(1, fmt::format("found the name {}, expected x, y, z, a, b, c, u, v, w in this order, in mm",
                            detail::in_quotes(word)));
      ++axes;
    }
  }

  /// "4,17 6,25" would be four numbers.
  void refuse_decimal_commas(const detail::Line& line) const {
    const auto cells = words_of(line.text, " ;\t\r");
    if (cells.size() < 2) return;
    for (const std::string_view cell : cells) {
      const auto comma = cell.find(',');
      if (comma == std::string_view::npos || comma == 0 || comma + 1 == cell.size()) continue;
      throw CoordinateError(fmt::format(
          "{}: row {}, column {}: found {}, expected numbers with a point, or separated by commas alone",
          name_, line.number, cell.data() - line.text.data() + 1, detail::in_quotes(cell)));
    }
  }

  [[noreturn]] void fail(std::size_t row, std::string_view what) const {
    throw CoordinateError(fmt::format("{}: row {}: {}", name_, row, what));
  }

  double number(std::size_t row, std::size_t column, std::string_view word) const {
    constexpr double kFarthest_mm = 1e6;
    const auto value = number_in(word, -kFarthest_mm, kFarthest_mm);
    if (!value)
      throw CoordinateError(
          fmt::format("{}: row {}, column {}: found {}, expected a finite number such as 12.5", name_, row,
                      column, detail::in_quotes(word)));
    return *value;
  }

  void take_numbers(std::size_t row, const std::vector<std::string_view>& words) {
    constexpr std::size_t kOfControl = 9;  // X Y Z A B C U V W
    constexpr double kZero = 0.01;         // degrees or mm of an axis that stands, as its encoder reads it
    std::vector<double> numbers;
    for (std::size_t i = 0; i < words.size(); ++i) numbers.push_back(number(row, i + 1, words[i]));
    for (std::size_t i = 3; words.size() == kOfControl && i < kOfControl; ++i)
      if (std::abs(numbers[i]) > kZero)
        fail(row, fmt::format("found {} at {:g}{}, expected a touch with the other axes at zero",
                              "ABCUVW"[i - 3], numbers[i], i < 6 ? " degrees" : " mm"));
    touches.points_mm.emplace_back(numbers[0], numbers[1], numbers[2]);
    touches.rows.push_back(row);
    detail::check_point_count(std::string(name_), touches.rows.size());
  }

  std::string_view name_;
  std::size_t columns_ = 0, first_row_ = 0, last_row_ = 0;
};

}  // namespace

Touches read_touches_text(std::string_view name, std::string_view content) {
  content = without_byte_order_mark(content);
  TouchRows rows(name);
  detail::for_lines(content, [&](const detail::Line& line) { rows.take(line); });
  rows.require_ended(content);
  if (rows.touches.rows.empty())
    throw CoordinateError(fmt::format("{}: found no point, expected at least one", name));
  return std::move(rows.touches);
}

namespace {

/// What a probe program does, as far as its touches go.
struct ProbeMoves {
  std::optional<double> ball_radius_mm;
  std::size_t radius_row = 0;
  struct Touch {
    Eigen::Vector3d start_mm, end_mm;
    std::size_t row;
  };
  std::vector<Touch> touches;
  bool ended = false;
};

[[noreturn]] void fail_without_end(std::string_view name) {
  throw CoordinateError(
      fmt::format("{}: the file ends without M2, expected it; the file may be cut off", name));
}

/// Reads what write_probe_program() writes. Any other word could make other touches of it.
class ProbeProgram {
 public:
  ProbeProgram(std::string_view name, std::string_view content)
      : name_(name), end_(content.data() + content.size()) {}

  void take(const detail::Line& line) {
    line_ = line;
    take_radius();
    const std::string text = without_comments();
    const auto words = words_of(text, " \t");
    if (words.empty() || words[0] == "%" || moves_.ended) return;
    const auto is = [&](std::string_view row) { return words == words_of(row, " "); };
    if (is(kFrame))
      framed_ = true;
    else if (words[0] == "G0" && (has_axes(words, "Z") || has_axes(words, "XY") || has_axes(words, "XYZ")))
      move(words);
    else if (words[0] == "G38.2" && has_axes(words, "XYZF"))
      touch(words);
    else if (is("M2"))
      moves_.ended = true;
    else if (!is("G0 A0 C0") && !is("G49") && !(words[0] == "G43.1" && has_axes(words, "XYZ")) &&
             !std::all_of(words.begin(), words.end(), moves_nothing))
      fail("a row as probe wrote it; take its program unchanged");
  }

  ProbeMoves finish() && { return std::move(moves_); }

 private:
  static constexpr std::string_view kFrame = "G21 G90 G94 G17 G40 G49 G54";

  [[noreturn]] void fail(std::string_view expected) const {
    if (line_.text.data() + line_.text.size() == end_) fail_without_end(name_);
    throw CoordinateError(fmt::format("{}: row {}: found {}, expected {}", name_, line_.number,
                                      detail::in_quotes(detail::trimmed(line_.text)), expected));
  }

  void take_radius() {
    const auto words = words_of(line_.text, " \t)");
    for (std::size_t i = 0; i + 2 < words.size() && !moves_.ball_radius_mm; ++i)
      if (words[i] == "ball" && words[i + 1] == "radius") {
        moves_.ball_radius_mm = number_in(words[i + 2], 0.0, 1e6);
        moves_.radius_row = line_.number;
      }
  }

  /// "(...)", and all behind ';'.
  std::string without_comments() const {
    std::string out;
    bool inside = false;
    for (const char c : line_.text) {
      if (!inside && c == ';') break;
      if (!inside && c != '(') out += c;
      inside = c == '(' || (inside && c != ')');
    }
    if (inside) fail("the ')' of the comment");
    return out;
  }

  static bool moves_nothing(std::string_view word) {
    constexpr std::array<std::string_view, 5> kWords = {"M0", "M1", "M5", "M6", "M9"};
    const bool numbered = (word[0] == 'T' || word[0] == 'N') && number_in(word.substr(1), 0, 99'999);
    return numbered || std::find(kWords.begin(), kWords.end(), word) != kWords.end();
  }

  /// Behind the first word, one number each for these letters, in this order, and nothing else.
  static bool has_axes(const std::vector<std::string_view>& words, std::string_view letters) {
    if (words.size() != letters.size() + 1) return false;
    for (std::size_t i = 0; i < letters.size(); ++i)
      if (words[i + 1][0] != letters[i] || !number_of(words[i + 1])) return false;
    return true;
  }

  static std::optional<double> number_of(std::string_view word) {
    constexpr double kFarthest_mm = 1e6;
    return number_in(word.substr(1), -kFarthest_mm, kFarthest_mm);
  }

  void move(const std::vector<std::string_view>& words) {
    constexpr std::string_view kAxes = "XYZ";
    if (!framed_) fail(fmt::format("{} before the first move", kFrame));
    for (const std::string_view word : words)
      if (const auto axis = kAxes.find(word[0]); axis != std::string_view::npos)
        at_mm_[static_cast<Eigen::Index>(axis)] = *number_of(word);
  }

  void touch(const std::vector<std::string_view>& words) {
    const Eigen::Vector3d start_mm = at_mm_;
    move(words);
    moves_.touches.push_back({start_mm, at_mm_, line_.number});
    detail::check_point_count(std::string(name_), moves_.touches.size());
  }

  std::string_view name_;
  const char* end_;  // of the file
  detail::Line line_;
  bool framed_ = false;
  Eigen::Vector3d at_mm_ = Eigen::Vector3d::Zero();
  ProbeMoves moves_;
};

ProbeMoves read_probe_program(std::string_view name, std::string_view content) {
  ProbeProgram program(name, content);
  detail::for_lines(without_byte_order_mark(content), [&](const detail::Line& line) { program.take(line); });
  return std::move(program).finish();
}

}  // namespace

void require_probe_program(std::string_view name, std::string_view content, std::span<const ProbeLine> lines,
                           const ProbeProgramOptions& options) {
  check_options(options);
  // The program's numbers have four decimals.
  constexpr double kSame_mm = 2e-4;
  constexpr std::string_view kAdvice = "give the options that the program was written with";
  const ProbeMoves found = read_probe_program(name, content);
  if (!found.ball_radius_mm)
    throw CoordinateError(fmt::format("{}: found no ball radius, expected a program that probe wrote", name));
  if (std::abs(*found.ball_radius_mm - options.ball_radius_mm) > kSame_mm)
    throw ArgumentError(fmt::format("{}: row {}: found ball radius {:g} mm, expected {:g} mm (", name,
                                    found.radius_row, *found.ball_radius_mm, options.ball_radius_mm),
                        "ball_radius_mm", fmt::format("); {}", kAdvice));
  if (!found.ended) fail_without_end(name);
  std::size_t next = 0;
  const auto require_at = [&](const char* what, const Eigen::Vector3d& at_mm,
                              const Eigen::Vector3d& wanted_mm) {
    if ((at_mm - wanted_mm).cwiseAbs().maxCoeff() > kSame_mm)
      throw CoordinateError(fmt::format(
          "{}: row {}: point {}: found its touch to {} at ({:.4f}, {:.4f}, {:.4f}), expected ({:.4f}, "
          "{:.4f}, {:.4f}) of this tool path; {}",
          name, found.touches[next].row, next + 1, what, at_mm.x(), at_mm.y(), at_mm.z(), wanted_mm.x(),
          wanted_mm.y(), wanted_mm.z(), kAdvice));
  };
  std::size_t wanted = 0;
  for (const ProbeLine& line : lines) wanted += line.points.size();
  for (const ProbeLine& line : lines)
    for (const MeasuringPoint& point : line.points) {
      if (next == found.touches.size()) break;
      require_at("begin", found.touches[next].start_mm, centre_mm(point, options, options.approach_mm));
      require_at("end", found.touches[next].end_mm, centre_mm(point, options, -options.overtravel_mm));
      ++next;
    }
  if (found.touches.size() != wanted)
    throw CoordinateError(fmt::format("{}: found {} touches, expected {} on this tool path; {}", name,
                                      found.touches.size(), wanted, kAdvice));
}

std::vector<std::vector<Eigen::Vector3d>> assign_touches(std::span<const ProbeLine> lines,
                                                         const Touches& touches,
                                                         const ProbeProgramOptions& options,
                                                         double aside_mm) {
  check_options(options);
  const std::string cloud = touches.file.empty() ? "point cloud" : touches.file;
  const auto place = [&](std::size_t i) {
    return i < touches.rows.size() ? fmt::format("{}: row {}", cloud, touches.rows[i]) : cloud;
  };
  std::size_t wanted = 0;
  for (const ProbeLine& line : lines) wanted += line.points.size();
  std::vector<std::vector<Eigen::Vector3d>> out;
  std::size_t next = 0;
  for (const ProbeLine& line : lines) {
    out.emplace_back();
    for (const MeasuringPoint& point : line.points) {
      // One that is missing shows where the next one is beside its way, or at the end.
      if (next == touches.points_mm.size()) break;
      const Eigen::Vector3d& touch = touches.points_mm[next];
      const Eigen::Vector3d off = touch - centre_mm(point, options, 0.0);
      const double along = off.dot(point.axis), aside = (off - along * point.axis).norm();
      if (!(aside <= aside_mm))
        throw CoordinateError(fmt::format(
            "{}: point {} is ({:.4f}, {:.4f}, {:.4f}), {:.4f} mm beside the way of its touch on "
            "{}, expected at most {} mm; {}",
            place(next), next + 1, touch.x(), touch.y(), touch.z(), aside, called(line.name), aside_mm,
            touches.points_mm.size() == wanted
                ? "is it this part's file?"
                : fmt::format("the file has {} points, and the probe program touches {}",
                              touches.points_mm.size(), wanted)));
      if (along > options.approach_mm || along < -options.overtravel_mm)
        throw CoordinateError(fmt::format(
            "{}: point {} on {} is {:+.4f} mm off the nominal surface, expected "
            "{:+.4f}..{:+.4f} mm (the way of its touch)",
            place(next), next + 1, called(line.name), along, -options.overtravel_mm, options.approach_mm));
      out.back().push_back(touch);
      ++next;
    }
  }
  if (touches.points_mm.size() != wanted)
    throw CoordinateError(
        fmt::format("{}: found {} points, expected {}, one for each that the probe program touches; measure "
                    "again, or give the options the program was made with",
                    place(std::min(wanted, touches.points_mm.size() - 1)), touches.points_mm.size(), wanted));
  return out;
}

// ---------------------------------------------------------------- simulation

namespace {

/// Foot of the perpendicular from a point in the part's frame that is found from a place of the surface:
/// Newton with the gradient by differences, the surface taken as a plane locally.
Eigen::Vector3d foot_from(const RealPart& part, const Eigen::Vector3d& p, double x, double y) {
  const auto& h = part.height_mm;
  constexpr double kStep_mm = 1e-4;
  Eigen::Vector3d foot(x, y, h(x, y));
  for (int i = 0; i < 60; ++i) {
    const double gx = (h(x + kStep_mm, y) - h(x - kStep_mm, y)) / (2.0 * kStep_mm);
    const double gy = (h(x, y + kStep_mm) - h(x, y - kStep_mm)) / (2.0 * kStep_mm);
    const double rise = (p.z() - foot.z() - gx * (p.x() - x) - gy * (p.y() - y)) / (1.0 + gx * gx + gy * gy);
    const double nx = p.x() + rise * gx, ny = p.y() + rise * gy;
    const double move = std::hypot(nx - x, ny - y);
    x = nx, y = ny;
    foot = {x, y, h(x, y)};
    if (move < 1e-10) break;
  }
  return foot;
}

}  // namespace

double distance_mm(const RealPart& part, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d p = part.placement.inverse() * point_mm;
  double away = (p - foot_from(part, p, p.x(), p.y())).norm();
  // In a valley each face has a foot of its own; a nearer one lies no farther aside than this one.
  constexpr int kDirections = 8;
  const double ring_mm = 0.7 * away;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kDirections;
    away = std::min(
        away, (p - foot_from(part, p, p.x() + ring_mm * std::cos(angle), p.y() + ring_mm * std::sin(angle)))
                  .norm());
  }
  return p.z() >= part.height_mm(p.x(), p.y()) ? away : -away;
}

namespace {

/// First way along from..to at which a ball of this radius touches; nothing if it doesn't.
std::optional<double> contact_mm(const RealPart& part, const Eigen::Vector3d& from,
                                 const Eigen::Vector3d& along, double length_mm, double radius_mm) {
  constexpr double kClose_mm = 1e-7;
  double way_mm = 0.0;
  // The distance is a way that is free in every direction.
  for (int i = 0; i < 1000; ++i) {
    const double free_mm = distance_mm(part, from + way_mm * along) - radius_mm;
    if (free_mm < kClose_mm) return way_mm;
    way_mm += free_mm;
    if (way_mm > length_mm) return std::nullopt;
  }
  return way_mm;
}

}  // namespace

Eigen::Vector3d surface_along(const RealPart& part, const Eigen::Vector3d& point_mm,
                              const Eigen::Vector3d& axis, double reach_mm) {
  const Eigen::Vector3d from = point_mm + reach_mm * axis;
  const auto way = contact_mm(part, from, -axis, 2.0 * reach_mm, 0.0);
  if (!way || *way == 0.0)
    throw MotionError(fmt::format("surface: not met within {} mm of ({:.4f}, {:.4f}, {:.4f})", reach_mm,
                                  point_mm.x(), point_mm.y(), point_mm.z()));
  return from - *way * axis;
}

double effective_radius_mm(const TouchProbeModel& model) { return model.ball_radius_mm - model.pretravel_mm; }

Eigen::Vector3d TouchProbe::touch(const RealPart& part, const Eigen::Vector3d& from_mm,
                                  const Eigen::Vector3d& to_mm) {
  const Eigen::Vector3d along = (to_mm - from_mm).normalized();
  const double length_mm = (to_mm - from_mm).norm();
  const auto contact = contact_mm(part, from_mm, along, length_mm, model_.ball_radius_mm);
  if (contact && *contact == 0.0)
    throw MotionError(
        fmt::format("probe: touches at ({:.4f}, {:.4f}, {:.4f}) before its move, expected a free "
                    "start; raise the approach",
                    from_mm.x(), from_mm.y(), from_mm.z()));
  std::normal_distribution<double> noise(0.0, model_.noise_mm);
  // The seat of three balls gives way in some directions more than in others; a push from above meets all.
  const double lobes = std::cos(3.0 * std::atan2(along.y(), along.x())) * std::hypot(along.x(), along.y());
  const double trigger_mm =
      contact ? *contact + model_.pretravel_mm + model_.lobing_mm * lobes + noise(random_) : 0.0;
  if (!contact || trigger_mm > length_mm)
    throw MotionError(
        fmt::format("probe: no contact on the way to ({:.4f}, {:.4f}, {:.4f}), expected the surface "
                    "there; raise the overtravel or check the placement",
                    to_mm.x(), to_mm.y(), to_mm.z()));
  const Eigen::Vector3d centre = from_mm + trigger_mm * along;
  return (centre / model_.scale_mm).array().round().matrix() * model_.scale_mm;
}

std::vector<Eigen::Vector3d> touch_all(const RealPart& part, std::span<const ProbeLine> lines,
                                       const ProbeProgramOptions& options, TouchProbe& probe) {
  std::vector<Eigen::Vector3d> out;
  for (const ProbeLine& line : lines)
    for (const MeasuringPoint& point : line.points)
      out.push_back(probe.touch(part, centre_mm(point, options, options.approach_mm),
                                centre_mm(point, options, -options.overtravel_mm)));
  return out;
}

}  // namespace meltstage::motion
