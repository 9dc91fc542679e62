// SPDX-License-Identifier: Apache-2.0
// One random case of each promise about profiles; the tests run some, the soak as many as are asked for.
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include "tests/motion/profile/profile_checks.hpp"

namespace meltstage::motion {

/// What random S-curves must all have met, or the property says little.
struct ScurveSeen {
  std::uint64_t cruise = 0, no_cruise = 0, hold_both = 0, hold_one = 0, hold_none = 0, refused = 0;
};

/// The same of changes of plan.
struct RetargetSeen {
  std::uint64_t farther = 0, nearer = 0, speeding_up = 0, slowing_down = 0, faster_than_limit = 0;
};

// Each returns what is wrong, or nothing.

/// Limits, continuity, exact end, and no time at constant speed below the limit.
std::string scurve_case(std::mt19937_64& random, ScurveSeen& seen);
/// With A = D and one jerk: duration of the textbook's time-optimal double S (Biagiotti & Melchiorri 2008,
/// section 3.4), to 1e-12 of it.
std::string symmetric_case(std::mt19937_64& random);
/// Whole servo cycles, the same distance, limits kept.
std::string rounded_case(std::mt19937_64& random);
/// Each axis within its limits; together; the slowest no slower than alone.
std::string synchronized_case(std::mt19937_64& random);
/// Another target and other limits at any moment: limits, continuity, exact end, never slower than to stop
/// first.
std::string retarget_case(std::mt19937_64& random, RetargetSeen& seen);
/// Bellman: what is left of an optimal motion is the optimal motion from there.
std::string replan_case(std::mt19937_64& random);
/// A stop at any moment: limits, continuity, never past the target, never later than the plan.
std::string stop_case(std::mt19937_64& random);

}  // namespace meltstage::motion
