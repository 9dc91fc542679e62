// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/cl_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "base/file.hpp"
#include "base/place.hpp"
#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion {

namespace {

constexpr std::string_view kExpected = ".apt, .cls, .cl, .ngc, .nc, .gcode, .tap or .csv";

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\f\v";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// The lines of a path as they are found; closes one when the tool leaves the surface.
class Lines {
 public:
  explicit Lines(std::string_view file) : file_(file) {}

  [[noreturn]] void fail(std::size_t row, const std::string& message) const {
    throw CoordinateError(fmt::format("{}: row {}: {}", file_, row, message));
  }

  void name_next(std::string_view name) { name_ = shown(name); }
  void has_axes() { has_axes_ = true; }

  /// A point under the tool; `axis` of any length.
  void add(const Eigen::Vector3d& position_mm, const Eigen::Vector3d& axis, std::size_t row) {
    constexpr double kFarthest_mm = 1e6;
    if (!(position_mm.cwiseAbs().maxCoeff() <= kFarthest_mm))
      fail(row, fmt::format("found the point ({:.6g}, {:.6g}, {:.6g}) mm, expected one within {:g} mm",
                            position_mm.x(), position_mm.y(), position_mm.z(), kFarthest_mm));
    const double length = axis.norm();
    if (!(length > 1e-6) || !std::isfinite(length))
      fail(row, fmt::format("found tool axis ({:.6g}, {:.6g}, {:.6g}), expected a direction", axis.x(),
                            axis.y(), axis.z()));
    detail::check_point_count(std::string(file_), ++count_);
    if (!open_.empty() && (open_.back().position_mm - position_mm).norm() <= kSamePoint_mm) return;
    open_.push_back({position_mm, axis / length, row});
  }

  /// The tool leaves the surface; `keep_ends`: there is no lowering or lifting in what was added.
  void end_line(bool keep_ends) {
    if (!keep_ends) drop_approach();
    if (!has_axes_) square_axes();
    if (open_.size() >= 2)
      lines_.push_back({unique(name_.empty() ? fmt::format("line {}", lines_.size() + 1) : name_), open_});
    open_.clear();
  }

  std::vector<ClLine> take() {
    if (lines_.empty())
      throw CoordinateError(fmt::format(
          "{}: found no line, expected at least two points one after the other that aren't a rapid move",
          file_));
    return std::move(lines_);
  }

 private:
  /// Leaves out a first or last move that runs along the tool axis.
  void drop_approach() {
    const auto along_axis = [](const ClPoint& near, const ClPoint& far) {
      const Eigen::Vector3d way = far.position_mm - near.position_mm;
      return way.dot(near.axis) > 0.99 * way.norm();
    };
    if (open_.size() >= 3 && along_axis(open_[1], open_[0])) open_.erase(open_.begin());
    if (open_.size() >= 3 && along_axis(open_[open_.size() - 2], open_.back())) open_.pop_back();
  }

  /// Where the path has no tool axes: the upright one, made square to the line.
  void square_axes() {
    std::vector<Eigen::Vector3d> axes;
    for (std::size_t i = 0; i < open_.size(); ++i) {
      const std::size_t next = std::min(i + 1, open_.size() - 1), before = i == 0 ? 0 : i - 1;
      const Eigen::Vector3d along = (open_[next].position_mm - open_[before].position_mm).normalized();
      const Eigen::Vector3d across = Eigen::Vector3d::UnitZ() - along.z() * along;
      axes.push_back(across.norm() > 0.1 ? across.normalized() : Eigen::Vector3d::UnitZ());
    }
    for (std::size_t i = 0; i < axes.size(); ++i) open_[i].axis = axes[i];
  }

  std::string unique(const std::string& wanted) {
    std::string name = wanted;
    for (int& i = last_number_[wanted]; !taken_.insert(name).second;) {
      i = std::max(i, 1) + 1;
      name = fmt::format("{} {}", wanted, i);
    }
    return name;
  }

  std::string_view file_;
  std::string name_;
  std::size_t count_ = 0;
  bool has_axes_ = false;
  std::vector<ClPoint> open_;
  std::vector<ClLine> lines_;
  std::set<std::string> taken_;             // names of lines
  std::map<std::string, int> last_number_;  // behind a name that stands for several lines
};

double number_of(const Lines& lines, std::size_t row, std::string_view text) {
  const auto value = detail::parse_number(text);
  if (!value || !std::isfinite(*value))
    lines.fail(row,
               fmt::format("found {}, expected a finite number such as 12.5", detail::in_quotes(trim(text))));
  return *value;
}

// ---------------------------------------------------------------- APT, CLS

/// One statement, its continuation lines joined.
struct Statement {
  std::size_t row = 0;
  std::string major;               ///< capitals
  std::vector<std::string> minor;  ///< after the slash, trimmed
};

/// Statements without motion, as far as a surface line is concerned.
bool is_passed_over(std::string_view major) {
  constexpr std::array kKnown{
      "PARTNO",      "PPRINT", "MACHIN", "CLPRNT", "FINI",   "FEDRAT", "SPINDL", "LOADTL", "LOAD",
      "TOOLNO",      "COOLNT", "CUTTER", "INTOL",  "OUTTOL", "TOLER",  "MSYS",   "PAINT",  "TLDATA",
      "END-OF-PATH", "SELECT", "CUTCOM", "DELAY",  "STOP",   "OPSTOP", "OPSKIP", "INSERT", "AUXFUN",
      "PREFUN",      "MODE",   "SEQNO",  "NOPOST", "REMARK", "DISPLY", "SET",    "ORIGIN", "TRANS",
      "CLEARP",      "LINTOL", "TOLRNC", "ROTATE", "ROTHED", "ROTABL", "CATMAT", "PLUNGE", "TOOLPATH"};
  return std::find(kKnown.begin(), kKnown.end(), major) != kKnown.end();
}

class AptReader {
 public:
  explicit AptReader(std::string_view file) : lines_(file) {}

  std::vector<ClLine> read(std::string_view content) {
    std::istringstream stream{std::string(content)};
    std::string joined;
    std::size_t row = 0, first_row = 0;
    for (std::string text; std::getline(stream, text);) {
      ++row;
      std::string_view line = text;
      line = trim(line.substr(0, line.find("$$")));
      if (line.empty()) continue;
      if (joined.empty()) first_row = row;
      const bool goes_on = line.back() == '$';
      if (goes_on) line = trim(line.substr(0, line.size() - 1));
      joined += line;
      if (goes_on) continue;
      take(parse(first_row, joined));
      joined.clear();
    }
    if (!joined.empty())
      lines_.fail(first_row, "the file ends in a statement that goes on ($), expected its rest");
    lines_.end_line(false);
    return lines_.take();
  }

 private:
  Statement parse(std::size_t row, std::string_view text) const {
    Statement out{row, {}, {}};
    const auto slash = text.find('/');
    for (const char c : trim(text.substr(0, slash)))
      out.major += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    while (slash != std::string_view::npos) {
      std::string_view rest = text.substr(slash + 1);
      for (std::size_t start = 0; start <= rest.size();) {
        if (out.minor.size() == kMostColumns)
          lines_.fail(row,
                      fmt::format("found more than {} words in a statement, expected less", kMostColumns));
        const auto comma = std::min(rest.find(',', start), rest.size());
        out.minor.emplace_back(trim(rest.substr(start, comma - start)));
        start = comma + 1;
      }
      break;
    }
    return out;
  }

  void take(const Statement& s) {
    if (s.major == "GOTO" || s.major == "FROM") return go_to(s);
    if (s.major == "GODLTA") return go_by(s);
    if (s.major == "RAPID") {
      rapid_ = true;
      return;
    }
    if (s.major == "UNITS") return set_units(s);
    if (s.major == "MULTAX") return;
    if (s.major == "TOOL PATH") {
      lines_.end_line(false);
      if (!s.minor.empty()) lines_.name_next(s.minor.front());
      return;
    }
    // PPRINT and PARTNO may be followed by their text without a slash.
    const std::string first_word = s.major.substr(0, s.major.find(' '));
    if (is_passed_over(s.major) || is_passed_over(first_word)) return;
    lines_.fail(s.row, fmt::format("found {}, expected GOTO or a statement without motion; write the path as "
                                   "linear moves",
                                   detail::in_quotes(s.major)));
  }

  std::array<double, 6> numbers(const Statement& s, std::size_t most) const {
    if (s.minor.size() != 3 && s.minor.size() != most)
      lines_.fail(s.row, fmt::format("found {} numbers after {}/, expected 3{}", s.minor.size(),
                                     shown(s.major), most == 6 ? " or 6" : ""));
    std::array<double, 6> out{};
    for (std::size_t i = 0; i < s.minor.size(); ++i) out[i] = number_of(lines_, s.row, s.minor[i]);
    return out;
  }

  void go_to(const Statement& s) {
    const auto v = numbers(s, 6);
    if (s.minor.size() == 6) {
      axis_ = {v[3], v[4], v[5]};
      lines_.has_axes();
    }
    move(unit_mm_ * Eigen::Vector3d(v[0], v[1], v[2]), s.row, s.major == "FROM");
  }

  void go_by(const Statement& s) {
    const auto v = numbers(s, 3);
    if (!at_mm_) lines_.fail(s.row, "found GODLTA before any GOTO, expected a place to start from");
    move(*at_mm_ + unit_mm_ * Eigen::Vector3d(v[0], v[1], v[2]), s.row, false);
  }

  void move(const Eigen::Vector3d& to_mm, std::size_t row, bool from) {
    if (rapid_ || from) lines_.end_line(false);
    // Where a rapid move ends, the lowering or the line itself begins.
    lines_.add(to_mm, axis_, row);
    at_mm_ = to_mm;
    rapid_ = false;
  }

  void set_units(const Statement& s) {
    const std::string unit = s.minor.empty() ? "" : lower(s.minor.front());
    if (unit == "mm") {
      unit_mm_ = 1.0;
    } else if (unit == "inch" || unit == "inches") {
      unit_mm_ = 25.4;
    } else {
      lines_.fail(s.row, fmt::format("found UNITS/{}, expected MM or INCH", shown(unit)));
    }
  }

  Lines lines_;
  double unit_mm_ = 1.0;
  bool rapid_ = false;
  Eigen::Vector3d axis_ = Eigen::Vector3d::UnitZ();
  std::optional<Eigen::Vector3d> at_mm_;
};

// ---------------------------------------------------------------- G-code

class GcodeReader {
 public:
  GcodeReader(std::string_view file, bool switched) : lines_(file), switched_(switched) {}

  std::vector<ClLine> read(std::string_view content) {
    std::istringstream stream{std::string(content)};
    for (std::string text; std::getline(stream, text);) {
      ++row_;
      read_block(text);
    }
    lines_.end_line(switched_);
    return lines_.take();
  }

 private:
  struct Word {
    char letter;
    double value;
  };

  std::vector<Word> words(std::string_view text) const {
    std::vector<Word> out;
    std::size_t i = 0;
    while (i < text.size()) {
      const char c = static_cast<char>(std::toupper(static_cast<unsigned char>(text[i])));
      if (c == ';') break;
      if (c == '(') {
        const auto close = text.find(')', i);
        if (close == std::string_view::npos) lines_.fail(row_, "found a comment without its end, expected )");
        i = close + 1;
      } else if (std::isspace(static_cast<unsigned char>(c)) || c == '%' || c == '/') {
        ++i;
      } else if (std::isalpha(static_cast<unsigned char>(c))) {
        std::size_t end = i + 1;
        while (end < text.size() && (std::isdigit(static_cast<unsigned char>(text[end])) ||
                                     std::string_view("+-. ").find(text[end]) != std::string_view::npos))
          ++end;
        out.push_back({c, number_of(lines_, row_, text.substr(i + 1, end - i - 1))});
        i = end;
      } else {
        lines_.fail(row_,
                    fmt::format("found {}, expected a word such as X12.5; parameters and expressions aren't "
                                "read",
                                detail::in_quotes(text.substr(i))));
      }
    }
    return out;
  }

  void read_block(std::string_view text) {
    Eigen::Vector3d to_mm = at_mm_;
    std::array<bool, 3> known = known_;
    bool moves = false, dwell = false;
    std::optional<bool> pressure;
    const auto found = words(text);
    for (const Word& w : found) {
      if (w.letter == 'G') dwell = modal(w.value) || dwell;
      if (w.letter == 'M') {
        const int code = w.value >= 0.0 && w.value < 1000.0 ? static_cast<int>(w.value) : 0;
        if (code == 62 || code == 64) pressure = true;
        if (code == 63 || code == 65) pressure = false;
      }
    }
    for (const Word& w : found) {
      if (w.letter >= 'X' && w.letter <= 'Z') {
        const auto axis = static_cast<std::size_t>(w.letter - 'X');
        double& at = to_mm[w.letter - 'X'];
        at = (absolute_ ? 0.0 : at) + w.value * unit_mm_.value_or(1.0);
        known[axis] = known[axis] || absolute_;
        moves = true;
      } else if (w.letter >= 'A' && w.letter <= 'C' && w.value != 0.0) {
        lines_.fail(row_,
                    fmt::format("found {}{}, expected a path in the workpiece's frame; give tool axes by "
                                ".apt or .csv",
                                w.letter, w.value));
      }
    }
    if (pressure) switch_pressure(*pressure);
    if (!moves || dwell) return;
    if (!unit_mm_)
      lines_.fail(row_, "found a move before G20 or G21, expected one of them first: inches or mm");
    known_ = known;
    move(to_mm);
  }

  /// A point of a line; on a way that begins where no word said, it could lie anywhere.
  void add(const Eigen::Vector3d& at_mm) {
    for (std::size_t axis = 0; axis < known_.size(); ++axis)
      if (!known_[axis])
        lines_.fail(row_, fmt::format("found a line that begins before any {0}, expected X, Y and Z of its "
                                      "beginning, such as {0}5",
                                      "XYZ"[axis]));
    lines_.add(at_mm, Eigen::Vector3d::UnitZ(), row_);
  }

  /// Takes over a G word; true if the block's numbers are no place.
  bool modal(double value) {
    const int code = value >= 0.0 && value < 1000.0 ? static_cast<int>(std::lround(value * 10.0)) : -1;
    switch (code) {
      case 0:
        rapid_ = true;
        return false;
      case 10:
        rapid_ = false;
        return false;
      case 200:
        unit_mm_ = 25.4;
        return false;
      case 210:
        unit_mm_ = 1.0;
        return false;
      case 900:
        absolute_ = true;
        return false;
      case 910:
        absolute_ = false;
        return false;
      case 40:
      case 530:
      case 280:
      case 300:
      case 100:
      case 920:
      case 431:
        return true;
      case 20:
      case 30:
      case 50:
        lines_.fail(row_,
                    fmt::format("found G{:g}, expected G0 or G1; write the path as linear moves", value));
      default:
        return false;
    }
  }

  void switch_pressure(bool on) {
    if (on == pressure_) return;
    pressure_ = on;
    if (on)
      add(at_mm_);
    else
      lines_.end_line(true);
  }

  void move(const Eigen::Vector3d& to_mm) {
    if (switched_) {
      if (pressure_) add(to_mm);
    } else {
      if (rapid_) lines_.end_line(false);
      // Rapid moves, one axis after the other, may lead to where a line begins.
      if (!rapid_ || all_known()) add(to_mm);
    }
    at_mm_ = to_mm;
  }

  bool all_known() const { return known_ == std::array{true, true, true}; }

  Lines lines_;
  bool switched_;
  bool pressure_ = false, rapid_ = true, absolute_ = true;
  std::optional<double> unit_mm_;
  std::array<bool, 3> known_{};  ///< X, Y, Z that a word said
  Eigen::Vector3d at_mm_ = Eigen::Vector3d::Zero();
  std::size_t row_ = 0;
};

/// Whether the program itself switches pressure.
bool switches_pressure(std::string_view content) {
  const std::string text = lower(content);
  return text.find("m62") != std::string::npos || text.find("m64") != std::string::npos;
}

// ---------------------------------------------------------------- CSV

std::vector<ClLine> read_csv(std::string_view file, std::string_view content) {
  constexpr std::array<std::string_view, 7> kNames{"x", "y", "z", "i", "j", "k", "line"};
  Lines lines(file);
  std::array<std::optional<std::size_t>, 7> column;
  bool known = false;
  std::string last_name;
  std::size_t last_row = 0;
  detail::read_csv_rows(std::string(file), content, [&](const detail::TableRow& row) {
    const auto blank = [](const detail::Cell& cell) { return trim(cell.text).empty(); };
    if (std::all_of(row.cells.begin(), row.cells.end(), blank)) {
      lines.end_line(true);
      return;
    }
    // The CSV parser hands over no row for an empty line.
    if (last_row != 0 && row.row > last_row + 1) lines.end_line(true);
    last_row = row.row;
    if (!known) {
      known = true;
      const bool named = !row.cells.empty() && !detail::parse_number(row.cells[0].text);
      for (std::size_t i = 0; i < row.cells.size(); ++i) {
        if (!named && i < 6) column[i] = i;
        if (!named) continue;
        const std::string name = lower(trim(row.cells[i].text));
        const auto* at = std::find_if(kNames.begin(), kNames.end(), [&](std::string_view n) {
          return name == n || name == std::string(n) + "_mm" || name == std::string(n) + " (mm)";
        });
        if (at == kNames.end())
          lines.fail(row.row, fmt::format("column {}: found name {}, expected x, y, z, i, j, k or line",
                                          i + 1, detail::in_quotes(row.cells[i].text)));
        column[static_cast<std::size_t>(at - kNames.begin())] = i;
      }
      if (!column[0] || !column[1] || !column[2])
        lines.fail(row.row, "found no columns x, y and z, expected all three");
      if (column[3].has_value() != column[5].has_value() || column[3].has_value() != column[4].has_value())
        lines.fail(row.row, "found some of the columns i, j and k, expected all three or none");
      if (column[3]) lines.has_axes();
      if (named) return;
    }
    const auto value = [&](std::size_t which) {
      const std::size_t i = *column[which];
      if (i >= row.cells.size() || blank(row.cells[i]))
        lines.fail(row.row,
                   fmt::format("column {} ({}): found nothing, expected a number", i + 1, kNames[which]));
      return number_of(lines, row.row, row.cells[i].text);
    };
    if (column[6] && *column[6] < row.cells.size()) {
      const std::string name(trim(row.cells[*column[6]].text));
      if (name != last_name) {
        lines.end_line(true);
        lines.name_next(name);
        last_name = name;
      }
    }
    const Eigen::Vector3d axis =
        column[3] ? Eigen::Vector3d(value(3), value(4), value(5)) : Eigen::Vector3d::UnitZ();
    lines.add({value(0), value(1), value(2)}, axis, row.row);
  });
  lines.end_line(true);
  return lines.take();
}

}  // namespace

std::vector<ClLine> read_tool_path_text(std::string_view name, std::string_view content) {
  if (content.empty())
    throw CoordinateError(fmt::format("{}: the file is empty, expected a tool path", name));
  if (const auto kind = detail::describe_content(content); kind != "text")
    throw CoordinateError(fmt::format("{}: found {}, expected a tool path as text", name, kind));
  const std::string extension = lower(std::filesystem::path(name).extension().string());
  if (extension == ".apt" || extension == ".cls" || extension == ".cl") return AptReader(name).read(content);
  if (extension == ".ngc" || extension == ".nc" || extension == ".gcode" || extension == ".tap")
    return GcodeReader(name, switches_pressure(content)).read(content);
  if (extension == ".csv") return read_csv(name, content);
  throw CoordinateError(
      fmt::format("{}: found extension {}, expected {}", name, detail::in_quotes(extension), kExpected));
}

std::vector<ClLine> read_tool_path(const std::filesystem::path& path) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;
  return read_tool_path_text(path.string(), read_file(path, fmt::format("a {} file", kExpected), kMostBytes));
}

std::vector<Eigen::Vector3d> positions_mm(const ClLine& line) {
  std::vector<Eigen::Vector3d> out(line.points.size());
  std::transform(line.points.begin(), line.points.end(), out.begin(),
                 [](const ClPoint& point) { return point.position_mm; });
  return out;
}

std::vector<double> polygon_lengths_mm(std::span<const Eigen::Vector3d> points_mm) {
  std::vector<double> out(points_mm.size());
  for (std::size_t i = 1; i < out.size(); ++i) out[i] = out[i - 1] + (points_mm[i] - points_mm[i - 1]).norm();
  return out;
}

}  // namespace meltstage::motion
