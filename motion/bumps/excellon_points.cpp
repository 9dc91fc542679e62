// SPDX-License-Identifier: Apache-2.0
// Hole positions out of an Excellon drill file (format 1 and 2; IPC-NC-349): one bump at every drilled hole.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

constexpr double kInch_mm = 25.4;

[[noreturn]] void fail(const std::filesystem::path& path, std::string_view what) {
  throw CoordinateError(fmt::format("{}: {}", path.string(), what));
}

class ExcellonFile {
 public:
  explicit ExcellonFile(const std::filesystem::path& path) : path_(path) { result_.has_unit = true; }

  void add(const Line& line) {
    row_ = line.number;
    const std::string_view text = trimmed(line.text);
    if (text.empty() || ended_) return;
    if (text.starts_with(';')) return read_comment(text);
    if (text == "M48") {
      in_header_ = true;
    } else if (text == "%" || text == "M95") {
      in_header_ = false;
    } else if (text == "M30" || text == "M00") {
      ended_ = true;
    } else if (text == "M71" || text == "M72") {
      unit_mm_ = text == "M71" ? 1.0 : kInch_mm;
    } else if (in_header_) {
      read_header(text);
    } else {
      read_command(text);
    }
  }

  RawPoints finish() && {
    if (!ended_) fail(path_, "the file ends without M30, expected it; the file may be cut off");
    if (slots_ > 0)
      result_.notes.push_back(fmt::format("{} slots, first in row {}, hold no bump", slots_, first_slot_));
    if (routed_ > 0)
      result_.notes.push_back(
          fmt::format("{} routing moves, first in row {}, hold no bump", routed_, first_routed_));
    return std::move(result_);
  }

 private:
  [[noreturn]] void fail_here(std::string_view found, std::string_view expected) const {
    fail(path_, fmt::format("row {}: found {}, expected {}", row_, in_quotes(found), expected));
  }

  /// ";FILE_FORMAT=4:4" of some systems says where the decimal point is left out.
  void read_comment(std::string_view text) {
    constexpr std::string_view kKey = "FILE_FORMAT=";
    const auto at = text.find(kKey);
    if (at == std::string_view::npos) return;
    const std::string_view format = text.substr(at + kKey.size());
    if (format.size() >= 3 && std::isdigit(static_cast<unsigned char>(format[0])) != 0 && format[1] == ':' &&
        std::isdigit(static_cast<unsigned char>(format[2])) != 0)
      set_digits(format[0] - '0', format[2] - '0');
  }

  void set_digits(int whole, int decimals) {
    whole_ = whole;
    decimals_ = decimals;
  }

  void read_header(std::string_view text) {
    if (text.starts_with("INCH") || text.starts_with("METRIC")) {
      const bool inch = text.starts_with("INCH");
      unit_mm_ = inch ? kInch_mm : 1.0;
      if (whole_ == 0) inch ? set_digits(2, 4) : set_digits(3, 3);
      if (text.find(",LZ") != std::string_view::npos) zeros_ = Zeros::leading_kept;
      if (text.find(",TZ") != std::string_view::npos) zeros_ = Zeros::trailing_kept;
      // "METRIC,LZ,0000.00": the zeros show the digits.
      const auto digits = text.rfind(",0");
      const auto point = text.find('.', digits == std::string_view::npos ? text.size() : digits);
      if (point != std::string_view::npos)
        set_digits(static_cast<int>(point - digits - 1), static_cast<int>(text.size() - point - 1));
      return;
    }
    if (text == "ICI" || text == "ICI,ON") incremental_ = true;
    if (text.starts_with('T') && text.size() > 1 && std::isdigit(static_cast<unsigned char>(text[1])) != 0)
      tools_.insert(tool_number(text));
  }

  int tool_number(std::string_view text) const {
    int number = 0;
    for (std::size_t i = 1;
         i < text.size() && std::isdigit(static_cast<unsigned char>(text[i])) != 0 && i < 6; ++i)
      number = number * 10 + (text[i] - '0');
    return number;
  }

  void read_command(std::string_view text) {
    if (text.starts_with('T')) {
      tool_ = tool_number(text);
      if (text.find('C') != std::string_view::npos) tools_.insert(tool_);
      // Tool 0 is the empty spindle at the end.
      if (tool_ != 0 && !tools_.contains(tool_)) fail_here(text, "a tool that the header defines");
      return;
    }
    if (text == "G90") {
      incremental_ = false;
    } else if (text == "G91") {
      incremental_ = true;
    } else if (text.starts_with("G05") || text == "G81") {
      routing_ = false;
    } else if (text.starts_with("G00") || text.starts_with("G01") || text.starts_with("G02") ||
               text.starts_with("G03")) {
      routing_ = true;
      count_routed();
      if (const auto xy = text.find_first_of("XY"); xy != std::string_view::npos) move(text.substr(xy));
    } else if (text.starts_with('X') || text.starts_with('Y')) {
      drill(text);
    } else if (text.starts_with('R')) {
      repeat(text);
    } else if (text.starts_with("M02") || text.starts_with("M25") || text.starts_with("M01") ||
               text.starts_with("M08") || text.starts_with("M97") || text.starts_with("M98")) {
      fail_here(text, "single holes; patterns and text to be drilled aren't read: export them as holes");
    }
    // Feeds, speeds, plunging, operator's messages: nothing that a bump needs.
  }

  void count_routed() {
    if (routed_++ == 0) first_routed_ = row_;
  }

  void drill(std::string_view text) {
    if (const auto slot = text.find("G85"); slot != std::string_view::npos) {
      if (slots_++ == 0) first_slot_ = row_;
      move(text.substr(slot + 3));
      return;
    }
    move(text);
    if (routing_) {
      count_routed();
      return;
    }
    if (tool_ <= 0) fail_here(text, "a tool (T1) before the first hole");
    add_hole();
  }

  void add_hole() {
    result_.points.push_back({x_ * unit_mm_, y_ * unit_mm_, row_});
    check_point_count(path_, result_.points.size());
  }

  /// "R4X2.54": four more holes, each that far from the one before.
  void repeat(std::string_view text) {
    std::size_t at = 1, count = 0;
    for (; at < text.size() && std::isdigit(static_cast<unsigned char>(text[at])) != 0 && count < kMaxPoints;
         ++at)
      count = count * 10 + static_cast<std::size_t>(text[at] - '0');
    if (count == 0 || at == text.size() || result_.points.empty())
      fail_here(text, "a repetition such as R4X2.54 behind a hole");
    const double step_x = word(text, 'X').value_or(0.0), step_y = word(text, 'Y').value_or(0.0);
    for (; count > 0; --count) {
      x_ += step_x;
      y_ += step_y;
      add_hole();
    }
  }

  void move(std::string_view text) {
    const auto x = word(text, 'X'), y = word(text, 'Y');
    x_ = (incremental_ ? x_ : (x ? 0.0 : x_)) + x.value_or(0.0);
    y_ = (incremental_ ? y_ : (y ? 0.0 : y_)) + y.value_or(0.0);
  }

  /// The number behind a letter, in the file's unit.
  std::optional<double> word(std::string_view text, char letter) const {
    const auto start = text.find(letter);
    if (start == std::string_view::npos) return std::nullopt;
    const std::string_view rest = text.substr(start + 1);
    const std::string_view digits = rest.substr(0, rest.find_first_not_of("+-.0123456789"));
    if (unit_mm_ == 0.0) fail_here(text, "a unit (METRIC, INCH, M71 or M72) before the first coordinate");
    const auto value = parse_number(digits);
    if (!value) fail_here(text, fmt::format("a number behind {}", letter));
    if (digits.find('.') != std::string_view::npos) return value;
    const auto shown = static_cast<int>(
        std::count_if(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c) != 0; }));
    if (zeros_ == Zeros::unknown)
      fail_here(
          text,
          "decimal points, or LZ or TZ in the header: without them the scale of the numbers is a guess");
    if (shown > whole_ + decimals_)
      fail_here(text, fmt::format("at most {} digits (format {}.{})", whole_ + decimals_, whole_, decimals_));
    // Leading zeros kept: the first digits stand for the whole part; else the last ones for the decimals.
    const int scale = zeros_ == Zeros::leading_kept ? whole_ - shown : -decimals_;
    return *value * std::pow(10.0, scale);
  }

  enum class Zeros { unknown, leading_kept, trailing_kept };

  const std::filesystem::path& path_;
  RawPoints result_;
  std::size_t row_ = 0;
  bool in_header_ = false, ended_ = false, incremental_ = false, routing_ = false;
  double unit_mm_ = 0.0;
  int whole_ = 0, decimals_ = 0;
  Zeros zeros_ = Zeros::unknown;
  std::set<int> tools_;
  int tool_ = -1;
  double x_ = 0.0, y_ = 0.0;
  std::size_t slots_ = 0, first_slot_ = 0, routed_ = 0, first_routed_ = 0;
};

}  // namespace

RawPoints read_excellon_points(const std::filesystem::path& path, std::string_view content) {
  if (const auto kind = describe_content(content); kind != "text")
    fail(path, fmt::format("found {}, expected an Excellon drill file", kind));
  ExcellonFile file(path);
  for_lines(content, [&](const Line& line) { file.add(line); });
  return std::move(file).finish();
}

}  // namespace meltstage::motion::detail
