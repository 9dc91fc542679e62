// SPDX-License-Identifier: Apache-2.0
#include "base/rng.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace meltstage {
namespace {

TEST(Rng, SameSeedAndNameRepeat) {
  Rng a = stream(7, "noise");
  Rng b = stream(7, "noise");
  for (int i = 0; i < 100; ++i) ASSERT_EQ(a.gaussian(), b.gaussian());
}

TEST(Rng, NameAndSeedSeparateStreams) {
  EXPECT_NE(stream(7, "noise").bits(), stream(7, "jitter").bits());
  EXPECT_NE(stream(7, "noise").bits(), stream(8, "noise").bits());
}

TEST(Rng, UniformMomentsAndRange) {
  Rng rng = stream(1, "uniform");
  constexpr int kDraws = 200000;
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = rng.uniform();
    ASSERT_GE(x, 0.0);
    ASSERT_LT(x, 1.0);
    sum += x;
    squares += x * x;
  }
  EXPECT_NEAR(sum / kDraws, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / kDraws));
  EXPECT_NEAR(squares / kDraws, 1.0 / 3.0, 0.004);
}

TEST(Rng, BelowReachesEachValueEqually) {
  Rng rng = stream(1, "below");
  std::array<int, 7> counts{};
  for (int i = 0; i < 70000; ++i) ++counts.at(rng.below(7));
  for (const int count : counts) EXPECT_NEAR(count, 10000, 500);
}

TEST(Rng, GaussianFollowsTheNormalDistribution) {
  Rng rng = stream(3, "gauss");
  constexpr int kDraws = 400000;
  const std::array<double, 9> bounds{-3.0, -2.0, -1.0, -0.3, 0.0, 0.3, 1.0, 2.0, 3.0};
  std::array<int, 9> below{};
  double squares = 0.0;
  double fourth = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = rng.gaussian();
    squares += x * x;
    fourth += x * x * x * x;
    for (std::size_t j = 0; j < bounds.size(); ++j) below.at(j) += x < bounds.at(j) ? 1 : 0;
  }
  EXPECT_NEAR(squares / kDraws, 1.0, 5.0 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(fourth / kDraws, 3.0, 5.0 * std::sqrt(96.0 / kDraws));
  for (std::size_t j = 0; j < bounds.size(); ++j) {
    const double p = 0.5 * std::erfc(-bounds.at(j) / std::sqrt(2.0));
    EXPECT_NEAR(below.at(j) / double{kDraws}, p, 5.0 * std::sqrt(p * (1.0 - p) / kDraws)) << bounds.at(j);
  }
}

}  // namespace
}  // namespace meltstage
