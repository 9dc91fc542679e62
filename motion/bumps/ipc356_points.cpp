// SPDX-License-Identifier: Apache-2.0
// Pads out of a bare board's netlist in IPC-D-356 (1992) and IPC-D-356A (1998): a surface pad, or a plated
// hole of a component.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <string>

#include "base/file.hpp"
#include "base/number.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

/// Columns of a record, counted from 0.
struct Columns {
  std::size_t begin, count;
};
constexpr Columns kOperation{0, 3}, kReference{20, 6}, kMidpoint{31, 1}, kDrill{32, 6}, kAccess{38, 3},
    kX{41, 8}, kY{49, 8};

/// A record's columns; blank where the line has ended before them.
std::string_view at(const Line& line, Columns columns) {
  return line.text.size() <= columns.begin ? std::string_view()
                                           : line.text.substr(columns.begin, columns.count);
}

class Ipc356File {
 public:
  explicit Ipc356File(const std::filesystem::path& path) : path_(path) { result_.has_unit = true; }

  void add(const Line& line) {
    if (trimmed(line.text).empty()) return;
    if (ended_row_ != 0)
      fail(path_, fmt::format("row {}: found {}, expected nothing behind 999 in row {}", line.number,
                              in_quotes(trimmed(line.text)), ended_row_));
    const char kind = line.text[0];
    if (kind == 'C') return;
    if (kind == 'P') return read_parameter(line);
    const std::string_view operation = at(line, kOperation);
    if (operation == "999")
      ended_row_ = line.number;
    else if (operation == "317" || operation == "327")
      read_pad(line, operation == "327");
    else if (operation.size() == 3 && std::all_of(operation.begin(), operation.end(),
                                                  [](unsigned char c) { return std::isdigit(c) != 0; }))
      count(others_, operation, line.number);
    else
      fail(path_, fmt::format("row {}: found {}, expected C, P or a record such as 317, 327 and 999",
                              line.number, in_quotes(trimmed(line.text))));
  }

  RawPoints finish() && {
    if (ended_row_ == 0)
      fail(path_, "the file ends without its last record 999, expected it; the file may be cut off");
    for (const auto& [operation, seen] : others_)
      result_.notes.push_back(no_bump_note(seen.count, "record " + operation, seen.first_row));
    for (const auto& [what, seen] : passed_by_)
      result_.notes.push_back(no_bump_note(seen.count, what, seen.first_row));
    return std::move(result_);
  }

 private:
  struct Seen {
    std::size_t count = 0, first_row = 0;
  };
  using Counts = std::map<std::string, Seen, std::less<>>;

  static void count(Counts& counts, std::string_view what, std::size_t row) {
    Seen& seen = counts[std::string(what)];
    if (seen.count++ == 0) seen.first_row = row;
  }

  /// "P  UNITS CUST 1". Other parameters say nothing of places.
  void read_parameter(const Line& line) {
    const std::string_view rest = trimmed(line.text.substr(1));
    if (!rest.starts_with("UNITS")) return;
    const std::string_view unit = trimmed(rest.substr(5));
    const bool millimetres = unit == "SI" || unit == "CUST 1";
    if (!millimetres && unit != "CUST" && unit != "CUST 0" && unit != "CUST 2")
      fail(path_, fmt::format("row {}: found UNITS {}, expected SI, CUST 0, CUST 1 or CUST 2", line.number,
                              in_quotes(unit)));
    const double step_mm = millimetres ? 0.001 : 0.0001 * kInch_mm;
    if (step_mm_ != 0.0 && step_mm != step_mm_)
      fail(path_, fmt::format("row {}: found UNITS {}, expected one unit; row {} has another", line.number,
                              in_quotes(unit), unit_row_));
    step_mm_ = step_mm;
    unit_row_ = line.number;
  }

  void read_pad(const Line& line, bool on_surface) {
    if (step_mm_ == 0.0)
      fail(path_,
           fmt::format("row {}: found a pad before a line such as 'P  UNITS CUST 1', expected the unit first",
                       line.number));
    const double x_mm = length(line, kX, 'X'), y_mm = length(line, kY, 'Y');
    const std::string reference(trimmed(at(line, kReference)));
    if (reference == "VIA") return count(passed_by_, "via", line.number);
    if (at(line, kMidpoint) == "M") return count(passed_by_, "point within a trace", line.number);
    if (!on_surface && at(line, kDrill).ends_with('U'))
      return count(passed_by_, "unplated hole", line.number);
    const auto [group, is_new] =
        group_of_.try_emplace(reference, static_cast<std::uint32_t>(group_of_.size()));
    if (is_new) result_.groups.emplace(group->second, reference);
    result_.points.push_back(
        {x_mm, y_mm, line.number, on_surface ? side(line) : std::nullopt, group->second});
    check_point_count(path_, result_.points.size());
  }

  /// A00: from both sides; A01: from the first layer; another number: from the last one.
  std::optional<Side> side(const Line& line) const {
    const std::string_view access = at(line, kAccess);
    const auto layer = access.starts_with('A') ? number_in<int>(access.substr(1), 0, 99) : std::nullopt;
    if (!layer || access.size() != kAccess.count)
      fail(path_, fmt::format("row {}, column {}: found {}, expected the side, such as A01", line.number,
                              kAccess.begin + 1, in_quotes(access)));
    if (*layer == 0) return std::nullopt;
    return *layer == 1 ? Side::top : Side::bottom;
  }

  /// "X+012600": the sign may be a blank.
  double length(const Line& line, Columns columns, char axis) const {
    const std::string_view cell = at(line, columns);
    const bool well = cell.size() == columns.count && cell[0] == axis &&
                      std::string_view("+- ").find(cell[1]) != std::string_view::npos;
    const std::string_view digits = well ? trimmed(cell.substr(2)) : std::string_view();
    const auto steps = number_in<int>(digits, 0, 999'999);
    if (!steps ||
        !std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c) != 0; }))
      fail(path_,
           fmt::format(
               "row {}, column {}: found {}, expected {} with a sign and six digits, such as {}+012600",
               line.number, columns.begin + 1, in_quotes(cell), axis, axis));
    return (cell[1] == '-' ? -1.0 : 1.0) * *steps * step_mm_;
  }

  const std::filesystem::path& path_;
  RawPoints result_;
  double step_mm_ = 0.0;
  std::size_t unit_row_ = 0, ended_row_ = 0;
  Counts others_, passed_by_;
  std::map<std::string, std::uint32_t> group_of_;
};

}  // namespace

RawPoints read_ipc356_points(const std::filesystem::path& path, std::string_view content) {
  if (const auto kind = describe_content(content); kind != "text")
    fail(path, fmt::format("found {}, expected a netlist in IPC-D-356", kind));
  Ipc356File file(path);
  for_lines(without_byte_order_mark(content), [&](const Line& line) { file.add(line); });
  return std::move(file).finish();
}

}  // namespace meltstage::motion::detail
