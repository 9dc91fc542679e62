// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: what every option that is a length, a time or a rate must be.
#pragma once

#include <string_view>

namespace meltstage::motion {

/// What is beyond these has no place on a machine, and its powers would leave the range of a double.
inline constexpr double kLeastMeasure = 1e-12, kLargestMeasure = 1e15;

/// @throws MotionError "WHAT: found VALUE UNIT, expected a finite number above 0", or "expected a number from
///   1e-12 to 1e15".
void check_positive(std::string_view what, double value, std::string_view unit);

}  // namespace meltstage::motion
