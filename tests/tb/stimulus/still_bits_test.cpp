// SPDX-License-Identifier: Apache-2.0
// Steps that begin just before a flop bit switches.
#include "tb/stimulus/still_bits.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <string>

#include "tb/lockstep/bench.hpp"
#include "tb/stimulus/random_run.hpp"

namespace meltstage::tb {
namespace {

// The model alone, whose clocks are observed.
class Watched final : public Device {
 public:
  Watched(const chip::Chip& start, StillBits& bits) : model_(start), bits_(bits) {}

  chip::Outputs step(const chip::Inputs& in) override {
    const chip::Chip before = model_;
    const chip::Outputs out = model_.step(in);
    bits_.observe(before, in, model_);
    return out;
  }
  const chip::Chip& model() const override { return model_; }
  void restart(const chip::Chip& state, const chip::Inputs&) override { model_ = state; }
  Compared finish() override { return {}; }

 private:
  chip::Chip model_;
  StillBits& bits_;
};

TEST(StillBits, CarriesReachBitsThatNoRunHasSwitched) {
  StillBits bits;
  for (const std::uint64_t seed : {1, 2, 3})
    random_run(std::make_unique<Watched>(random_start(seed), bits), seed, 50'000);
  const std::size_t still = bits.toggles().still().size();
  ASSERT_GT(still, 1'000u);
  Rng rng(1, "aims");
  std::set<std::string> reached;
  int aimed = 0, switched = 0;
  for (int draw = 0; draw < 40'000; ++draw) {
    const std::optional<Aim> aim = bits.aim(rng);
    if (!aim) continue;
    ++aimed;
    if (!aim->switches()) continue;
    ++switched;
    if (bits.is_still(*aim)) reached.insert(name_of(*aim->flop) + "." + std::to_string(aim->bit));
  }
  EXPECT_GT(switched, aimed / 5);
  EXPECT_GT(reached.size(), 200u);
  EXPECT_TRUE(reached.contains("guard.samples_q.14"));  // a sample each 0.1 s: 27 minutes
}

TEST(StillBits, NothingToAimAtBeforeAClock) {
  Rng rng(1, "aims");
  EXPECT_FALSE(StillBits().aim(rng).has_value());
}

}  // namespace
}  // namespace meltstage::tb
