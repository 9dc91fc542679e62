// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: lines of a text file with their numbers.
#pragma once

#include <cstddef>
#include <string_view>

namespace meltstage::motion::detail {

struct Line {
  std::size_t number = 0;
  std::string_view text;  ///< without its end
};

/// Some editors begin a UTF-8 text with a mark that shows nowhere and says nothing.
inline std::string_view without_byte_order_mark(std::string_view content) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  return content.starts_with(kMark) ? content.substr(kMark.size()) : content;
}

/// Calls `visit(Line)` for every line; LF, CRLF and CR end a line.
template <class Visit>
void for_lines(std::string_view content, const Visit& visit) {
  std::size_t number = 0;
  while (!content.empty()) {
    const std::size_t end = content.find_first_of("\r\n");
    visit(Line{++number, content.substr(0, end)});
    if (end == std::string_view::npos) return;
    const bool both = content[end] == '\r' && end + 1 < content.size() && content[end + 1] == '\n';
    content.remove_prefix(end + (both ? 2 : 1));
  }
}

inline std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n\f\v";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

}  // namespace meltstage::motion::detail
