// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace meltstage {

/// Some editors begin a UTF-8 text with a mark that shows nowhere and says nothing.
inline std::string_view without_byte_order_mark(std::string_view text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  return text.starts_with(kMark) ? text.substr(kMark.size()) : text;
}

}  // namespace meltstage
