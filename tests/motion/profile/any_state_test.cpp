// SPDX-License-Identifier: Apache-2.0
// Changes of plan from any state: limits, continuity, end.
#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>

#include "tests/motion/profile/any_state_cases.hpp"

namespace meltstage::motion {
namespace {

constexpr int kCases = 100'000;

// No two runs draw the same cases; the seed of one that fails is in its message.
std::uint64_t new_seed() { return std::random_device{}(); }

TEST(AnyState, TurnsBackWithinTheJerkLimit) {
  // So hard a deceleration can't be ended before the axis turns.
  const AnyState task{
      asymmetric_limits(400, 4000, 4000, 4e5, 4e5), {0.0, 1.0, -3000.0, 0.0}, {5.0, 0.0, 0.0, 0.0}};
  EXPECT_EQ(fault_of(plan_retarget(task.limits, task.state, task.target.position_mm), task), "");
}

TEST(AnyStateProperty, KeepsTheLimitsAndEndsAtTheTarget) {
  const std::uint64_t seed = new_seed();
  std::mt19937_64 random(seed);
  AnyStateSeen seen;
  for (int i = 0; i < kCases; ++i)
    ASSERT_EQ(any_state_case(random, seen), "") << "seed " << seed << ", case " << i;
  EXPECT_GT(seen.turns_back, 1000u);
  EXPECT_GT(seen.symmetric, 40'000u);
}

}  // namespace
}  // namespace meltstage::motion
