// SPDX-License-Identifier: Apache-2.0
// A slice of what `meltstage regress` runs as test skip, and what it reaches.
#include "tb/stimulus/any_skip.hpp"

#include <gtest/gtest.h>

namespace meltstage::tb {
namespace {

TEST(AnySkip, DoesWhatSteppingDoes) {
  const Moments moments(3, kMomentSeeds, kMomentClocks);
  const SkipCount reached = skip_from_any_state(moments, 1, 100'000);
  RecordProperty("skipped", static_cast<int>(reached.skipped));
  EXPECT_GT(reached.skipped, 5'000u);
  EXPECT_GT(reached.whole, 1'000u);
  EXPECT_GT(reached.clocks, 3'000'000u);
}

}  // namespace
}  // namespace meltstage::tb
