// SPDX-License-Identifier: Apache-2.0
// What steps from any state are drawn from: events of the model, and the edges of its decisions.
#include "tb/stimulus/decision_edge.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "tb/stimulus/any_state.hpp"

namespace meltstage::tb {
namespace {

// Whether a block goes another way when the flop is one less, or one more.
bool is_edge(const FlopBlock& block, const Flop& flop, const Moment& moment) {
  const auto way = [&](std::uint64_t value) {
    chip::Chip before = moment.chip;
    set_flop(flop, value, before);
    chip::Chip after = before;
    after.step(moment.in);
    return way_of_block(block, before, after);
  };
  const std::uint64_t value = flop.get(moment.chip, flop.word);
  return way(value) != way(value - 1) || way(value) != way(value + 1);
}

TEST(DecisionEdge, EachValueFoundIsOneApartFromAnotherWay) {
  const Moments moments(5, 8, 50'000);
  EXPECT_GT(moments.events(), 300u);
  Rng rng(5, "edges");
  std::set<std::string> flops;
  std::size_t found = 0;
  for (int draw = 0; draw < 20'000; ++draw) {
    Moment moment = moments.any(rng);
    const std::vector<const Flop*>& steering = moment.steering[moment.block];
    if (steering.empty()) continue;
    const FlopBlock& block = flop_blocks()[moment.block];
    const Flop& flop = *steering[rng.below(steering.size())];
    const std::uint64_t low = rng.bits() & ones(flop.width), high = rng.bits() & ones(flop.width);
    if (!set_at_decision_edge(rng, block, flop, low, high, moment.in, moment.chip)) continue;
    ++found;
    if (flop.width > kNarrowBits) flops.insert(flop.name);
    EXPECT_TRUE(is_edge(block, flop, moment)) << name_of(flop);
  }
  EXPECT_GT(found, 5'000u);
  EXPECT_GT(flops.size(), 30u);
  EXPECT_TRUE(flops.contains("guard.pv_q"));
}

}  // namespace
}  // namespace meltstage::tb
