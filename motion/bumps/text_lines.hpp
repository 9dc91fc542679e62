// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: lines of a text file with their numbers.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "base/byte_order_mark.hpp"

namespace meltstage::motion::detail {

struct Line {
  std::size_t number = 0;
  std::string_view text;  ///< without its end
};

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

/// Blanks beyond ASCII as programs write them before a unit: the no-break, the figure, the thin and the
/// narrow no-break space.
inline constexpr std::array<std::string_view, 4> kOtherBlanks = {"\u00a0", "\u2007", "\u2009", "\u202f"};

/// With the blank of ASCII in the place of those.
inline std::string with_plain_blanks(std::string_view text) {
  constexpr std::string_view kFirstBytes = "\xC2\xE2";  // of theirs
  if (text.find_first_of(kFirstBytes) == std::string_view::npos) return std::string(text);
  std::string plain;
  while (!text.empty()) {
    const auto* blank = std::find_if(kOtherBlanks.begin(), kOtherBlanks.end(),
                                     [&](std::string_view other) { return text.starts_with(other); });
    const bool found = blank != kOtherBlanks.end();
    plain += found ? ' ' : text.front();
    text.remove_prefix(found ? blank->size() : 1);
  }
  return plain;
}

/// Without blanks at its ends.
inline std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n\f\v";
  for (bool again = true; again;) {
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
    text = text.substr(0, text.find_last_not_of(kBlanks) + 1);
    again = false;
    for (const std::string_view blank : kOtherBlanks) {
      const bool before = text.starts_with(blank);
      if (before) text.remove_prefix(blank.size());
      const bool behind = text.ends_with(blank);
      if (behind) text.remove_suffix(blank.size());
      again = again || before || behind;
    }
  }
  return text;
}

}  // namespace meltstage::motion::detail
