// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "base/error.hpp"

namespace meltstage {

/// The line that an action is refused with; empty when it goes through, or when what it says isn't one line.
inline std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const UserError& error) {
    const std::string line = error.what();
    return line.find('\n') == std::string::npos ? line : "";
  }
  return "";
}

}  // namespace meltstage
