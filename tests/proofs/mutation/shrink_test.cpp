// SPDX-License-Identifier: Apache-2.0
// Mismatches of seeded RTL bugs (bugs.tsv) are made small: few clocks, few flops, and they fail again by
// themselves.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "Vbugs.h"
#include "Vbugs__Syms.h"
#include "Vbugs___024root.h"
#include "base/rng.hpp"
#include "lockstep_kill.hpp"
#include "tb/regress/failing_case.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage::tb {
namespace {

constexpr unsigned kBugs = 24;  // those above "# Subtle" of bugs.tsv, which random runs meet

// The stretch in which a random run of few seeds meets the bug; none: it doesn't.
std::shared_ptr<const FailedStretch> stretch_of(unsigned bug) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    std::uint64_t clocks = 0;
    const auto make = [&] { return std::make_unique<VariantRtl<Vbugs>>(bug, clocks); };
    try {
      random_run(in_lockstep_with(make, random_start(seed), {"variant", seed, ""}), seed, 300'000);
    } catch (const Mismatch& mismatch) {
      return mismatch.stretch;
    } catch (const std::exception&) {  // a safety rule was broken first
    }
  }
  return nullptr;
}

std::size_t flops_of(const chip::Chip& chip) {
  const std::string text = list_differences(chip::Chip{}, chip);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST(Shrink, MismatchesOfSeededBugsBecomeSmallAndFailAgain) {
  const ScratchFolder scratch;
  std::vector<std::size_t> clocks, flops;
  unsigned met = 0;
  for (unsigned bug = 1; bug <= kBugs; ++bug) {
    const auto stretch = stretch_of(bug);
    if (!stretch) continue;
    ++met;
    std::uint64_t stepped = 0;
    VariantRtl<Vbugs> rtl(bug, stepped), sound(0, stepped);
    const auto failing = shrink(*stretch, "bug", rtl);
    if (!failing) continue;
    clocks.push_back(failing->inputs.size());
    flops.push_back(flops_of(failing->state));
    write_case(scratch.at("case.json"), *failing);
    const FailingCase read = read_case(scratch.at("case.json"));
    EXPECT_EQ(replay(read, rtl).differs, failing->differs) << "bug " << bug;
    sound.set_assertions(false);
    EXPECT_TRUE(replay(read, sound).differs.empty()) << "bug " << bug << ": differs without it";
  }
  ASSERT_GE(met, 10u);
  ASSERT_FALSE(clocks.empty());
  std::sort(clocks.begin(), clocks.end());
  std::sort(flops.begin(), flops.end());
  RecordProperty("met", static_cast<int>(met));
  RecordProperty("shrunk", static_cast<int>(clocks.size()));
  RecordProperty("most_clocks", static_cast<int>(clocks.back()));
  RecordProperty("median_flops", static_cast<int>(flops[flops.size() / 2]));
  const auto small = std::count_if(clocks.begin(), clocks.end(), [](std::size_t n) { return n <= 2'000; });
  EXPECT_GE(10 * small, 9 * static_cast<std::ptrdiff_t>(met));  // of those met, 90 % to 2,000 clocks at most
  EXPECT_LE(flops[flops.size() / 2], 20u);
}

}  // namespace
}  // namespace meltstage::tb
