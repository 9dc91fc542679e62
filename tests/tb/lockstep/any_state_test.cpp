// SPDX-License-Identifier: Apache-2.0
// A slice of what `any_state` runs for as long as one likes, and what it reaches.
#include "tb/stimulus/any_state.hpp"

#include <gtest/gtest.h>

#include "tb/lockstep/lockstep.hpp"

namespace meltstage::tb {
namespace {

TEST(AnyState, ModelAndRtlStepAlike) {
  const Moments moments(1, kMomentSeeds, kMomentClocks);
  EXPECT_GE(moments.of_events().size(), 160u);  // rises and falls of the chip's flops of one bit
  const auto rtl = make_verilated_rtl();
  const TrialCount reached = step_from_any_state(moments, *rtl, 1, 0, 100'000);
  EXPECT_GE(reached.compared, 80'000u) << reached.refused << " states without an invariant";
}

}  // namespace
}  // namespace meltstage::tb
