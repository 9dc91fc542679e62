// SPDX-License-Identifier: Apache-2.0
// The canary: seeded RTL bugs (bugs.tsv), one at a time, each of which the random lockstep runs must catch; and without a bug
// the same runs must agree. docs/mutation.md
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "Vbugs.h"
#include "Vbugs___024root.h"
#include "Vbugs__Syms.h"
#include "tb/verilated_top.hpp"
#include "tests/lockstep/random_run.hpp"

namespace meltstage::tb {
namespace {

constexpr std::uint64_t kClocks = 300'000;
constexpr std::uint64_t kSeeds = 50;  // as the random lockstep test

// The copy of the RTL in which input bug_i chooses a bug; 0 is none.
class BuggyRtl final : public verilated::VerilatedTop<Vbugs> {
 public:
  explicit BuggyRtl(unsigned bug) { top_.bug_i = static_cast<std::uint8_t>(bug); }
};

std::vector<std::string> bugs() {
  std::ifstream file(MELTSTAGE_SOURCE_DIR "/tests/mutation/bugs.tsv");
  std::vector<std::string> list;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line[0] != '#') list.push_back(line.substr(line.rfind('\t') + 1));
  }
  return list;
}

// Seed that betrays the bug; 0 when none does.
std::uint64_t killed_by(unsigned bug, std::uint64_t seeds) {
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    try {
      random_run(in_lockstep_with([bug] { return std::make_unique<BuggyRtl>(bug); }, random_start(seed), {"canary", seed, ""}), seed,
                 kClocks);
    } catch (const Mismatch&) {
      return seed;
    }
  }
  return 0;
}

class Canary : public ::testing::TestWithParam<unsigned> {};

TEST_P(Canary, SeededBugIsCaught) {
  EXPECT_NE(killed_by(GetParam(), kSeeds), 0u) << "survived: " << bugs()[GetParam() - 1];
}

INSTANTIATE_TEST_SUITE_P(Bug, Canary, ::testing::Range(1u, static_cast<unsigned>(bugs().size()) + 1));

TEST(CanaryControl, CopyWithoutABugAgrees) { EXPECT_EQ(killed_by(0, 3), 0u); }

TEST(CanaryControl, ThereAreAtLeastTenBugs) { EXPECT_GE(bugs().size(), 10u); }

}  // namespace
}  // namespace meltstage::tb
