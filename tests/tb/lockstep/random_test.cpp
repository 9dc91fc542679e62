// SPDX-License-Identifier: Apache-2.0
// Random runs follow from their seeds. That lockstep holds in them and that they cover the specification is
// asked by the suite pr of meltstage regress.
#include <gtest/gtest.h>

#include <set>

#include "tb/stimulus/random_run.hpp"

namespace meltstage::tb {
namespace {

TEST(Random, SameSeedGivesTheSameStimulusAndOthersDoNot) {
  std::set<std::uint64_t> hashes;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    const std::uint64_t first = random_run(model_alone(random_start(seed)), seed, 100'000).stimulus_hash;
    EXPECT_EQ(random_run(model_alone(random_start(seed)), seed, 100'000).stimulus_hash, first);
    hashes.insert(first);
  }
  EXPECT_EQ(hashes.size(), 4u);
}

}  // namespace
}  // namespace meltstage::tb
