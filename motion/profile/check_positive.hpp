// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: what every option that is a length, a time or a rate must be.
#pragma once

#include <string_view>

namespace meltstage::motion {

/// @throws MotionError "WHAT: found VALUE UNIT, expected a finite number above 0".
void check_positive(std::string_view what, double value, std::string_view unit);

}  // namespace meltstage::motion
