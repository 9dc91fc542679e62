// SPDX-License-Identifier: Apache-2.0
#include "motion/bumps/number_formats.hpp"

#include <algorithm>
#include <cctype>

#include "motion/bumps/column_names.hpp"
#include "motion/bumps/coordinate_sources.hpp"
#include "motion/bumps/text_lines.hpp"

namespace meltstage::motion::detail {
namespace {

/// The signs of a code that stand for parts of the value, and the text that it shows behind the last digit.
struct Parts {
  std::string signs, behind;
};

Parts parts_of(std::string_view code) {
  Parts parts;
  for (std::size_t i = 0; i < code.size(); ++i) {
    const char c = code[i];
    if (c == '"') {
      const std::size_t end = std::min(code.find('"', i + 1), code.size());
      parts.behind += code.substr(i + 1, end - i - 1);
      i = end;
    } else if (c == '\\' && i + 1 < code.size()) {
      parts.behind += code[++i];
    } else if ((c == '_' || c == '*') && i + 1 < code.size()) {
      ++i;  // room as wide as a sign, and a sign that fills the cell
    } else if (c == '[') {
      const std::size_t end = std::min(code.find(']', i), code.size());
      const std::string inside = in_small_letters(code.substr(i + 1, end - i - 1));
      // [h], [mm] and [ss] are times; else a colour, a condition, a currency or a language.
      if (inside.find_first_not_of("hms") == std::string::npos) parts.signs += inside;
      i = end;
    } else if (c == ';') {
      break;  // what follows shows numbers below 0, the 0 and texts
    } else {
      parts.signs += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      if (c == '0' || c == '#' || c == '?') parts.behind.clear();
    }
  }
  return parts;
}

}  // namespace

NumberFormat number_format(std::string_view code) {
  const std::string small = in_small_letters(code);
  if (small.starts_with("general") || small.starts_with("standard")) return {};
  const Parts parts = parts_of(code);
  if (parts.signs.find_first_of("dmyhs") != std::string::npos) return {NumberFormat::Kind::date, ""};
  if (parts.signs.find('%') != std::string::npos) return {NumberFormat::Kind::percent, ""};
  const std::string behind = in_small_letters(trimmed(parts.behind));
  return {NumberFormat::Kind::number, find_unit(behind) != nullptr ? behind : ""};
}

NumberFormat built_in_format(unsigned id) {
  if (id == 9 || id == 10) return {NumberFormat::Kind::percent, ""};
  const bool date =
      (id >= 14 && id <= 22) || (id >= 27 && id <= 36) || (id >= 45 && id <= 47) || (id >= 50 && id <= 58);
  return {date ? NumberFormat::Kind::date : NumberFormat::Kind::number, ""};
}

}  // namespace meltstage::motion::detail
