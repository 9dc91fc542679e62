// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: G-code that this room writes.
#pragma once

#include <string>
#include <string_view>

namespace meltstage::motion {

/// Text fit for an RS-274 comment: such a comment ends at the first ")" and at the end of its line.
inline std::string rs274_comment(std::string_view text) {
  std::string fit(text);
  for (char& c : fit)
    if (c == '(' || c == ')' || static_cast<unsigned char>(c) < 0x20) c = ' ';
  return fit;
}

}  // namespace meltstage::motion
