// SPDX-License-Identifier: Apache-2.0
// The canary: seeded RTL bugs (bugs.tsv), one at a time, each of which the random lockstep runs must catch;
// and without a bug the same runs must agree. docs/verify/mutation.md
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "Vbugs.h"
#include "Vbugs__Syms.h"
#include "Vbugs___024root.h"
#include "lockstep_kill.hpp"

namespace meltstage::tb {
namespace {

std::vector<std::string> bugs() {
  std::ifstream file(MELTSTAGE_SOURCE_DIR "/tests/proofs/mutation/bugs.tsv");
  std::vector<std::string> list;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line[0] != '#') list.push_back(line.substr(line.rfind('\t') + 1));
  }
  return list;
}

class Canary : public ::testing::TestWithParam<unsigned> {};

TEST_P(Canary, SeededBugIsCaught) {
  const auto kill = killed_by<Vbugs>(GetParam(), {.seeds = 200});
  ASSERT_TRUE(kill) << "survived: " << bugs()[GetParam() - 1];
  EXPECT_TRUE(kill->report.starts_with("MISMATCH")) << kill->report;
}

INSTANTIATE_TEST_SUITE_P(Bug, Canary, ::testing::Range(1u, static_cast<unsigned>(bugs().size()) + 1));

TEST(CanaryControl, CopyWithoutABugAgrees) { EXPECT_FALSE(killed_by<Vbugs>(0, {.seeds = 3})); }

TEST(CanaryControl, ThereAreAtLeastTenBugs) { EXPECT_GE(bugs().size(), 10u); }

}  // namespace
}  // namespace meltstage::tb
