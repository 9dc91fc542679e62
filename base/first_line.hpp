// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace meltstage {

/// What stands before the first line end: the line of a report or of a program's output that a message has
/// room for.
inline std::string_view first_line(std::string_view text) { return text.substr(0, text.find('\n')); }

}  // namespace meltstage
