// SPDX-License-Identifier: Apache-2.0
// skip() against step() from any state: counters near their limits, any register value, upset flops.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "base/rng.hpp"
#include "cmodel/advance.hpp"
#include "skipped_part.hpp"
#include "tb/stimulus/any_state.hpp"

namespace meltstage::tb {
namespace {

TEST(AnySkip, DoesWhatSteppingDoes) {
  const Moments moments(3, kMomentSeeds, kMomentClocks);
  std::uint64_t skipped = 0, whole = 0, clocks = 0;
  for (std::uint64_t trial = 0; trial < 100'000; ++trial) {
    Rng rng = stream(trial, "any skip");
    Moment moment = any_moment(rng, moments);
    // a moment is one before an event: on to where nothing happens
    for (int clock = 0; clock < 64 && moment.chip.quiet(moment.in) == 0; ++clock) moment.chip.step(moment.in);
    // where all is quiet, what stirs a block alone
    if (rng.below(4) != 0) change_one_block(rng, moment.chip);
    const std::uint64_t quiet = moment.chip.quiet(moment.in);
    if (quiet == 0 || !holds_invariants(moment.chip)) continue;
    const std::uint64_t part = part_of(rng, quiet);
    chip::Chip stepped = moment.chip, leapt = moment.chip;
    const chip::Outputs standing = stepped.outputs(moment.in);
    for (std::uint64_t clock = 0; clock < part; ++clock) {
      chip::Outputs out = stepped.step(moment.in);
      // heater_o stands on the pin's own gate; safe_en_o has a rhythm that advance() knows
      out.safe_en = standing.safe_en;
      ASSERT_TRUE(out == standing) << "trial " << trial << ", clock " << clock << " of " << part;
    }
    leapt.skip(moment.in, part);
    ASSERT_EQ(list_differences(stepped, leapt), "")
        << "trial " << trial << ", " << part << " clocks of " << quiet << " from\n"
        << list_differences(chip::Chip{}, moment.chip);
    ++skipped;
    whole += part == quiet;
    clocks += part;
  }
  RecordProperty("skipped", static_cast<int>(skipped));
  EXPECT_GT(skipped, 5'000u);
  EXPECT_GT(whole, 1'000u);
  EXPECT_GT(clocks, 3'000'000u);
}

}  // namespace
}  // namespace meltstage::tb
