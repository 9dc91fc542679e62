// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/toggles.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>

#include "tb/lockstep/verilated_rtl.hpp"

namespace meltstage::tb {
namespace {

constexpr chip::Inputs kRunning{.test_mode = true};  // out of reset whatever the synchroniser holds

using testing::Contains;
using testing::Not;

unsigned switched(const FlopToggles& toggles, const std::string& block) {
  for (const auto& b : toggles.blocks())
    if (b.name == block) return b.switched;
  return 9999;
}

TEST(Toggles, ABitSwitchesBothWaysWhenItRisesAndFalls) {
  FlopToggles toggles;
  chip::Chip chip;
  toggles.resume(chip);
  chip.guard.pv_q = -1;  // with its sign
  toggles.observe(kRunning, chip);
  EXPECT_THAT(toggles.still(), Contains("guard.pv_q[15]: never fell"));
  chip.guard.pv_q = 0;
  toggles.observe(kRunning, chip);
  EXPECT_THAT(toggles.still(), Not(Contains(testing::StartsWith("guard.pv_q["))));
  EXPECT_THAT(toggles.still(), Contains("guard.run_q: never switched"));
  EXPECT_EQ(switched(toggles, "guard"), 16u);
}

TEST(Toggles, WhatIsSetByHandDoesNotCount) {
  FlopToggles toggles;
  chip::Chip chip;
  for (const bool level : {false, true, false}) {
    chip.guard.run_q = level;
    toggles.resume(chip);
  }
  EXPECT_EQ(switched(toggles, "guard"), 0u);
}

// RST_SYNC holds all others in reset for some clocks more.
TEST(Toggles, WhatAResetDoesDoesNotCount) {
  FlopToggles toggles;
  chip::Chip before, after;
  before.guard.run_q = 1;
  before.rst_sync.stage_q = before.rst_sync.out_q = 0;
  after.rst_sync.stage_q = 1;
  toggles.resume(before);
  toggles.observe({}, after);
  EXPECT_EQ(toggles.rose[flop_blocks()[0][0][0].place], 1u);
  EXPECT_THAT(toggles.still(), Contains("guard.run_q: never switched"));
  toggles.resume(before);
  toggles.observe({.test_mode = true}, after);
  EXPECT_THAT(toggles.still(), Contains("guard.run_q: never rose"));
}

TEST(Toggles, EachFlopOfTheRtlIsThere) {
  unsigned bits = 0;
  for (const auto& block : FlopToggles().blocks()) bits += block.bits;
  EXPECT_EQ(bits, make_verilated_rtl()->flop_bits());
}

// Each line of never_switch.txt is a bit of a flop; that it never switches so is what hls.never_switch
// proves.
TEST(Toggles, WhatNeverHappensIsNotAskedFor) {
  const FlopToggles::Never& never = FlopToggles::never();
  std::size_t bits = 0;
  for (std::size_t place = 0; place < kFlopPlaces; ++place)
    bits += std::popcount(never.rises[place]) + std::popcount(never.falls[place]);
  EXPECT_EQ(bits, never.count);
  EXPECT_GT(bits, 0u);
  FlopToggles toggles;
  chip::Chip chip;
  toggles.resume(chip);
  EXPECT_THAT(toggles.still(), Contains("algor.i_q[31]: never switched"));
  chip.algor.i_q = -1;
  toggles.resume(chip);
  chip.algor.i_q = 0;
  toggles.observe(kRunning, chip);
  EXPECT_THAT(toggles.still(), Not(Contains(testing::StartsWith("algor.i_q[31]"))));
  EXPECT_THAT(toggles.still(), Contains("algor.i_q[30]: never rose"));
}

TEST(Toggles, RunsAddUp) {
  FlopToggles first, second;
  chip::Chip low, high;
  high.guard.run_q = true;
  first.resume(low);
  first.observe(kRunning, high);
  second.resume(high);
  second.observe(kRunning, low);
  first.add(second);
  EXPECT_EQ(switched(first, "guard"), 1u);
}

}  // namespace
}  // namespace meltstage::tb
