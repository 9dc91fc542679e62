// SPDX-License-Identifier: Apache-2.0
// Changes of plan from any state: limits, continuity, end.
#include <fmt/format.h>
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

class AnyStateProperty : public ::testing::TestWithParam<Limits> {};

TEST_P(AnyStateProperty, KeepsTheLimitsAndEndsAtTheTarget) {
  const std::uint64_t seed = new_seed();
  std::mt19937_64 random(seed);
  for (int i = 0; i < kCases; ++i) {
    const AnyState task = random_any_state(random, GetParam());
    ASSERT_EQ(fault_of(plan_retarget(task.limits, task.state, task.target.position_mm), task), "")
        << fmt::format("seed {}, case {}: {}", seed, i, text_of(task));
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, AnyStateProperty, ::testing::Values(Limits::symmetric, Limits::asymmetric),
                         [](const auto& kind) {
                           return kind.param == Limits::symmetric ? "Symmetric" : "Asymmetric";
                         });

}  // namespace
}  // namespace meltstage::motion
