// SPDX-License-Identifier: Apache-2.0
// Random runs follow from their seeds. That lockstep holds in them and that they cover the specification is
// asked by the suite pr of meltstage regress.
#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "tb/lockstep/bench.hpp"
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

TEST(StimulusHash, KnowsEachPinThatATestTurns) {
  const auto hash_with = [](const std::function<void(World&)>& turn) {
    Bench bench(model_alone(chip_with(quick())));
    bench.run(10);
    turn(bench.world);
    bench.run(10);
    return bench.stimulus_hash();
  };
  const std::set<std::uint64_t> hashes{hash_with([](World&) {}),
                                       hash_with([](World& world) { world.reset = true; }),
                                       hash_with([](World& world) { world.addr_strap = 1; }),
                                       hash_with([](World& world) { world.addr_strap = 4; }),
                                       hash_with([](World& world) { world.feedback = Feedback::stuck_high; }),
                                       hash_with([](World& world) { world.inhibit = true; }),
                                       hash_with([](World& world) { world.drop = true; }),
                                       hash_with([](World& world) { world.test_mode = true; })};
  EXPECT_EQ(hashes.size(), 8u);
}

}  // namespace
}  // namespace meltstage::tb
