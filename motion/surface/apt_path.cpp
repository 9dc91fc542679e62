// SPDX-License-Identifier: Apache-2.0
// Tool paths as a CAM system writes them: APT and CLS.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "base/file.hpp"
#include "base/place.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_lines.hpp"
#include "motion/surface/path_lines.hpp"

namespace meltstage::motion::detail {

namespace {

std::string upper(std::string_view text) {
  std::string out;
  for (const char c : text) out += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return out;
}

/// One statement, its continuation lines joined.
struct Statement {
  std::size_t row = 0;
  std::string major;               ///< capitals
  std::vector<std::string> minor;  ///< after the slash, trimmed
};

std::string minor_word(const Statement& s, std::size_t i) {
  return i < s.minor.size() ? upper(s.minor[i]) : std::string();
}

bool all_zero(const Statement& s) {
  return std::all_of(s.minor.begin(), s.minor.end(), [](const std::string& word) {
    const auto value = parse_number(word);
    return value && *value == 0.0;
  });
}

/// Statements without motion, as far as a surface line is concerned.
bool is_passed_over(std::string_view major) {
  constexpr std::array kKnown{
      "PARTNO", "PPRINT",   "MACHIN", "CLPRNT", "FEDRAT", "SPINDL", "LOADTL", "LOAD",   "TOOLNO", "COOLNT",
      "CUTTER", "INTOL",    "OUTTOL", "TOLER",  "PAINT",  "TLDATA", "SELECT", "DELAY",  "STOP",   "OPSTOP",
      "AUXFUN", "SEQNO",    "NOPOST", "REMARK", "DISPLY", "SET",    "CLEARP", "LINTOL", "TOLRNC", "CATMAT",
      "PLUNGE", "TOOLPATH", "MODE",   "TRANS",  "ORIGIN", "CUTCOM", "OPSKIP", "TPRINT"};
  return std::find(kKnown.begin(), kKnown.end(), major) != kKnown.end();
}

/// The word at the beginning of a statement.
std::string_view word_of(std::string_view line) {
  const auto end =
      std::find_if_not(line.begin(), line.end(), [](unsigned char c) { return std::isalnum(c) != 0; });
  return line.substr(0, static_cast<std::size_t>(end - line.begin()));
}

/// Its text goes to the end of the line, whatever it holds.
bool is_literal(std::string_view line) {
  constexpr std::array kLiteral{"PARTNO", "PPRINT", "REMARK", "TPRINT"};
  return std::find(kLiteral.begin(), kLiteral.end(), upper(word_of(line))) != kLiteral.end();
}

/// The tool along z, as it is without the statement.
bool sets_upright_axis(const Statement& s) {
  const auto is = [&](std::size_t i, double wanted) { return parse_number(s.minor[i]) == wanted; };
  return s.major == "TLAXIS" && s.minor.size() == 3 && is(0, 0.0) && is(1, 0.0) && is(2, 1.0);
}

/// Statements after which GOTO means another place than one in the workpiece's frame, or the machine does
/// what no statement here says.
bool leaves_frame(const Statement& s) {
  constexpr std::array kAlways{"TRACUT", "COPY", "CALSUB", "ROTATE", "ROTABL", "ROTHED", "PREFUN", "INSERT"};
  constexpr std::array kUnlessZero{"TRANS", "ORIGIN"};
  constexpr std::array kUnlessOff{"CUTCOM", "OPSKIP"};
  const auto is_in = [&](const auto& words) {
    return std::find(words.begin(), words.end(), s.major) != words.end();
  };
  const bool steps = minor_word(s, s.major == "SET" ? 1 : 0) == "INCR";
  return is_in(kAlways) || (is_in(kUnlessZero) && !all_zero(s)) ||
         (is_in(kUnlessOff) && minor_word(s, 0) != "OFF") ||
         ((s.major == "MODE" || (s.major == "SET" && minor_word(s, 0) == "MODE")) && steps);
}

std::string text_of(const Statement& s) {
  std::string out = s.major;
  for (std::size_t i = 0; i < s.minor.size(); ++i) out += (i == 0 ? "/" : ",") + s.minor[i];
  return out;
}

class AptReader {
 public:
  AptReader(std::string_view file, std::optional<double> unit_mm) : lines_(file), unit_(lines_, unit_mm) {
    is_cls_ = lower(std::filesystem::path(file).extension().string()) == ".cls";
  }

  std::vector<ClLine> read(std::string_view content) {
    std::string joined;
    std::size_t first_row = 0;
    bool in_comment = false;
    for_lines(content, [&](const Line& text) {
      std::string_view line = trimmed(text.text);
      if (joined.empty() && (in_comment || line.starts_with("$$"))) {
        // Creo goes on with a coordinate system in "$$-> CSYS / ..., $".
        in_comment = (in_comment || line.starts_with("$$->")) && line.size() > 2 && line.back() == '$';
        return;
      }
      if (joined.empty() && is_literal(line)) return take({text.number, upper(word_of(line)), {}});
      line = trimmed(line.substr(0, line.find("$$")));
      if (line.empty()) return;
      if (joined.empty()) first_row = text.number;
      const bool goes_on = line.back() == '$';
      if (goes_on) line = trimmed(line.substr(0, line.size() - 1));
      joined += line;
      if (goes_on) return;
      take(parse(first_row, joined));
      joined.clear();
    });
    if (!joined.empty())
      lines_.fail(first_row, "the file ends in a statement that goes on ($), expected its rest");
    if (fini_row_ == 0 && !(is_cls_ && path_ended_))
      lines_.fail_cut_off(is_cls_ ? "END-OF-PATH or FINI, expected one of them" : "FINI, expected it");
    lines_.end_line(false);
    return lines_.take();
  }

 private:
  Statement parse(std::size_t row, std::string_view text) const {
    const auto slash = text.find('/');
    Statement out{row, upper(trimmed(text.substr(0, slash))), {}};
    if (slash == std::string_view::npos) return out;
    const std::string_view rest = text.substr(slash + 1);
    for (std::size_t start = 0; start <= rest.size();) {
      if (out.minor.size() == kMostColumns)
        lines_.fail(row, fmt::format("found more than {} words in a statement, expected less", kMostColumns));
      const auto comma = std::min(rest.find(',', start), rest.size());
      out.minor.emplace_back(trimmed(rest.substr(start, comma - start)));
      start = comma + 1;
    }
    return out;
  }

  void take(const Statement& s) {
    if (fini_row_ != 0)
      lines_.fail(s.row, fmt::format("found {} behind FINI in row {}, expected nothing there",
                                     in_quotes(s.major), fini_row_));
    path_ended_ = s.major == "END-OF-PATH";
    if (path_ended_) return;
    if (s.major == "FINI") {
      fini_row_ = s.row;
    } else if (s.major == "GOTO" || s.major == "FROM") {
      go_to(s);
    } else if (s.major == "GODLTA") {
      go_by(s);
    } else if (s.major == "RAPID") {
      rapid_ = true;
    } else if (s.major == "UNITS") {
      set_units(s);
    } else if (s.major == "MULTAX") {
      set_axes(s);
    } else if (s.major == "MSYS") {
      set_frame(s);
    } else if (s.major == "TOOL PATH") {
      lines_.end_line(false);
      if (!s.minor.empty()) lines_.name_next(s.minor.front());
    } else {
      pass_over(s);
    }
  }

  void pass_over(const Statement& s) const {
    // PPRINT, PARTNO and INSERT may be followed by their text without a slash.
    const std::string first_word = s.major.substr(0, s.major.find(' '));
    if (leaves_frame(s) || first_word == "INSERT")
      lines_.fail(s.row, fmt::format("found {}, expected a path in the workpiece's frame alone; write it "
                                     "without such statements",
                                     in_quotes(text_of(s))));
    if (is_passed_over(s.major) || is_passed_over(first_word) || sets_upright_axis(s)) return;
    lines_.fail(s.row, fmt::format("found {}, expected GOTO or a statement without motion; write the path as "
                                   "linear moves",
                                   in_quotes(s.major)));
  }

  std::array<double, 6> numbers(const Statement& s, std::size_t most) const {
    if (s.minor.size() != 3 && s.minor.size() != most)
      lines_.fail(s.row, fmt::format("found {} numbers after {}/, expected 3{}", s.minor.size(),
                                     shown(s.major), most == 6 ? " or 6" : ""));
    std::array<double, 6> out{};
    for (std::size_t i = 0; i < s.minor.size(); ++i) out[i] = lines_.number(s.row, s.minor[i]);
    return out;
  }

  Eigen::Vector3d place_mm(const std::array<double, 6>& v, std::size_t row) const {
    const double mm =
        unit_.mm(row, "found a place before UNITS/MM or UNITS/INCH, expected one of them first");
    return mm * Eigen::Vector3d(v[0], v[1], v[2]);
  }

  void go_to(const Statement& s) {
    const auto v = numbers(s, 6);
    if (s.minor.size() == 6) {
      axis_ = {v[3], v[4], v[5]};
      lines_.has_axes();
    } else if (multax_) {
      lines_.fail(s.row, fmt::format("found 3 numbers after {}/ under MULTAX, expected 6: a place and the "
                                     "tool's axis",
                                     s.major));
    }
    move(place_mm(v, s.row), s.row, s.major == "FROM");
  }

  void go_by(const Statement& s) {
    const auto v = numbers(s, 3);
    if (!at_mm_) lines_.fail(s.row, "found GODLTA before any GOTO, expected a place to start from");
    move(*at_mm_ + place_mm(v, s.row), s.row, false);
  }

  void move(const Eigen::Vector3d& to_mm, std::size_t row, bool from) {
    if (rapid_ || from) lines_.end_line(false);
    // Where a rapid move ends, the lowering or the line itself begins.
    lines_.add(to_mm, axis_, row);
    at_mm_ = to_mm;
    rapid_ = false;
  }

  void set_units(const Statement& s) {
    const std::string unit = minor_word(s, 0);
    if (unit == "MM")
      unit_.say(1.0, s.row);
    else if (unit == "INCH" || unit == "INCHES")
      unit_.say(25.4, s.row);
    else
      lines_.fail(s.row, fmt::format("found UNITS/{}, expected MM or INCH", shown(unit)));
  }

  void set_axes(const Statement& s) {
    const std::string how = minor_word(s, 0);
    if (!how.empty() && how != "ON" && how != "OFF")
      lines_.fail(s.row, fmt::format("found MULTAX/{}, expected ON or OFF", shown(how)));
    multax_ = how != "OFF";
  }

  /// Places count from a frame of the CAM system's; which one doesn't matter, as long as it is one.
  void set_frame(const Statement& s) {
    if (!frame_.empty() && frame_ != s.minor)
      lines_.fail(s.row, fmt::format("found {} behind another MSYS, expected all paths in one frame",
                                     in_quotes(text_of(s))));
    frame_ = s.minor;
  }

  PathLines lines_;
  PathUnit unit_;
  bool is_cls_ = false;
  bool rapid_ = false, multax_ = false, path_ended_ = false;
  std::size_t fini_row_ = 0;
  std::vector<std::string> frame_;
  Eigen::Vector3d axis_ = Eigen::Vector3d::UnitZ();
  std::optional<Eigen::Vector3d> at_mm_;
};

}  // namespace

std::vector<ClLine> read_apt_path(std::string_view file, std::string_view content,
                                  std::optional<double> unit_mm) {
  return AptReader(file, unit_mm).read(content);
}

}  // namespace meltstage::motion::detail
