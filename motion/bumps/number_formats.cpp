// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/number_formats.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "motion/bumps/column_names.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

/// One of the up to four parts of a code: of numbers above 0, below 0, of 0, and of texts.
struct Section {
  std::string signs;   ///< that stand for parts of the value
  std::string before;  ///< text that it shows before the first digit
  std::string behind;  ///< text that it shows behind the last digit
  bool has_digits = false;
  /// A comma behind the last digit divides by 1000; a text among digits is a mark of its own.
  bool rescales = false;
  bool has_condition = false;  ///< [<0]: which numbers it is for
};

/// Takes the first section off the code.
Section next_section(std::string_view& code) {
  constexpr std::array<std::string_view, 2> kPlain = {"general", "standard"};  // a number as it is
  Section section;
  bool comma = false;  // behind the last digit so far
  std::size_t i = 0;
  for (; i < code.size() && code[i] != ';'; ++i) {
    const char c = code[i];
    const std::string small = in_small_letters(code.substr(i, kPlain[1].size()));
    const auto plain = std::find_if(kPlain.begin(), kPlain.end(),
                                    [&](std::string_view word) { return small.starts_with(word); });
    if (plain != kPlain.end() || c == '@') {
      section.before += std::exchange(section.behind, "");
      section.has_digits = true;
      i += plain != kPlain.end() ? plain->size() - 1 : 0;
    } else if (c == '"') {
      const std::size_t end = std::min(code.find('"', i + 1), code.size());
      section.behind += code.substr(i + 1, end - i - 1);
      i = end;
    } else if (c == '\\' && i + 1 < code.size()) {
      section.behind += code[++i];
    } else if ((c == '_' || c == '*') && i + 1 < code.size()) {
      ++i;  // room as wide as a sign, and a sign that fills the cell
    } else if (c == '[') {
      const std::size_t end = std::min(code.find(']', i), code.size());
      const std::string inside = in_small_letters(code.substr(i + 1, end - i - 1));
      // [h], [mm] and [ss] are times; else a colour, a condition, a currency or a language.
      if (inside.find_first_not_of("hms") == std::string::npos) section.signs += inside;
      section.has_condition = section.has_condition || inside.find_first_of("<>=") != std::string::npos;
      if (inside.starts_with('$')) section.behind += inside.substr(1, inside.find('-') - 1);
      i = end;
    } else {
      section.signs += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      const bool digit = c == '0' || c == '#' || c == '?';
      if (digit && section.has_digits && !trimmed(section.behind).empty()) section.rescales = true;
      if (c == '.' && comma) section.rescales = true;
      if (digit && !section.has_digits) section.before = section.behind;
      if (digit) section.behind.clear();
      section.has_digits = section.has_digits || digit;
      comma = section.has_digits && !digit && (c == ',' || (comma && c != '.'));
    }
  }
  section.rescales = section.rescales || comma;
  code.remove_prefix(std::min(i + 1, code.size()));
  return section;
}

/// What a format shows beside the number, where it is a unit, known or not; words before a number are often
/// no unit.
std::string unit_in(const Section& section) {
  const auto bare = [](std::string_view text) {
    const std::size_t first = std::min(text.find_first_not_of(" ([."), text.size());
    return in_small_letters(text.substr(first, text.find_last_not_of(" )].") + 1 - first));
  };
  const std::string behind = bare(section.behind), before = bare(section.before);
  const bool has_letters = std::any_of(behind.begin(), behind.end(),
                                       [](unsigned char c) { return std::isalpha(c) != 0 || c >= 0x80; });
  if (has_letters || find_unit(behind) != nullptr) return behind;
  return find_unit(before) != nullptr ? before : "";
}

/// Whether numbers above 0 look as if they were below.
bool shows_a_minus(const Section& section) {
  const std::string_view before = trimmed(section.before);
  return before == "-" || before == "\u2212" || section.signs.starts_with('-');
}

}  // namespace

NumberFormat number_format(std::string_view code) {
  using Kind = NumberFormat::Kind;
  NumberFormat format;
  bool first = true;
  for (int i = 0; i < 3 && !code.empty(); ++i) {
    const Section section = next_section(code);
    if (section.signs.find_first_of("dmyhs") != std::string::npos) return {Kind::date, ""};
    if (!section.has_digits) continue;
    if (section.signs.find('%') != std::string::npos) return {Kind::percent, ""};
    const std::string unit = unit_in(section);
    const bool negated = i == 0 && !section.has_condition && shows_a_minus(section);
    if (section.rescales || negated || (!first && unit != format.unit)) return {Kind::rescaled, ""};
    format.unit = unit;
    first = false;
  }
  return format;
}

Cell as_shown(Cell cell, const NumberFormat& format) {
  switch (format.kind) {
    case NumberFormat::Kind::date:
      return {cell.text + ", shown as a date or time", std::nullopt};
    case NumberFormat::Kind::percent:
      return {cell.text + ", shown as a percentage", std::nullopt};
    case NumberFormat::Kind::rescaled:
      return {cell.text + ", shown in another scale or sign", std::nullopt};
    case NumberFormat::Kind::number:
      break;
  }
  if (!format.unit.empty()) return {cell.text + " " + format.unit, std::nullopt, cell.sums_up};
  return cell;
}

NumberFormat built_in_format(unsigned id) {
  if (id == 9 || id == 10) return {NumberFormat::Kind::percent, ""};
  const bool date =
      (id >= 14 && id <= 22) || (id >= 27 && id <= 36) || (id >= 45 && id <= 47) || (id >= 50 && id <= 58);
  return {date ? NumberFormat::Kind::date : NumberFormat::Kind::number, ""};
}

}  // namespace meltstage::motion::detail
