// SPDX-License-Identifier: Apache-2.0
// Random lockstep: a slice of what `soak` runs for as long as one likes, with its coverage asked for.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "running_case.hpp"
#include "suite_seeds.hpp"
#include "tb/stimulus/random_run.hpp"

namespace meltstage::tb {
namespace {

constexpr std::uint64_t kClocks = 300'000;

TEST(Random, LockstepHoldsAndCoversTheSpecification) {
  Coverage all;
  std::uint64_t clocks = 0;
  for (const std::uint64_t seed : suite_seeds()) {
    const RandomRun run = random_run(
        in_lockstep(random_start(seed),
                    {"random", seed, fmt::format("soak --first {} --seeds 1 --clocks {}", seed, kClocks)}),
        seed, kClocks);
    all.add(run.coverage);
    clocks += run.compared.clocks;
  }
  EXPECT_GE(clocks, kClocks * 63);
  EXPECT_THAT(all.holes(), ::testing::IsEmpty());
}

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
