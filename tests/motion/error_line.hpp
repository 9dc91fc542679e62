// SPDX-License-Identifier: Apache-2.0
// What a refused call says.
#pragma once

#include <functional>
#include <string>

#include "motion/profile.hpp"

namespace meltstage::motion {

/// The message of the MotionError; empty if there was none, or if it isn't one line.
inline std::string error_line(const std::function<void()>& action) {
  try {
    action();
  } catch (const MotionError& error) {
    const std::string line = error.what();
    return line.find('\n') == std::string::npos ? line : "";
  }
  return "";
}

}  // namespace meltstage::motion
