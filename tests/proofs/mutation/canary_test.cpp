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

struct Bug {
  unsigned number;  // that bug_i chooses
  std::string what;
};

// Those above the line "# Subtle ..." of bugs.tsv, or those below it.
std::vector<Bug> bugs(bool subtle) {
  std::ifstream file(MELTSTAGE_SOURCE_DIR "/tests/proofs/mutation/bugs.tsv");
  std::vector<Bug> list;
  bool below = false;
  unsigned number = 0;
  for (std::string line; std::getline(file, line);) {
    below |= line.starts_with("# Subtle");
    if (line.empty() || line[0] == '#') continue;
    ++number;
    if (below == subtle) list.push_back({number, line.substr(line.rfind('\t') + 1)});
  }
  return list;
}

void expect_all_caught(const std::vector<Bug>& list) {
  for (const Bug& bug : list) {
    const auto kill = killed_by(make_variant<Vbugs>, bug.number, {.seeds = 200});
    ASSERT_TRUE(kill) << "survived: " << bug.what;
    EXPECT_TRUE(kill->report.starts_with("MISMATCH")) << bug.what << ": " << kill->report;
  }
}

TEST(Canary, SeededBugsAreCaught) { expect_all_caught(bugs(false)); }

TEST(Canary, SubtleBugsAreCaught) { expect_all_caught(bugs(true)); }

// A slice of the above for every ./check.
TEST(Canary, MostSubtleBugsAreCaughtSoon) {
  unsigned caught = 0;
  for (const Bug& bug : bugs(true))
    caught += killed_by(make_variant<Vbugs>, bug.number, {.trials = 20'000, .seeds = 0}).has_value();
  EXPECT_GE(caught, 45u);
  RecordProperty("caught", static_cast<int>(caught));
}

TEST(CanaryControl, CopyWithoutABugAgrees) {
  EXPECT_FALSE(killed_by(make_variant<Vbugs>, 0, {.trials = 50'000, .seeds = 3}));
}

TEST(CanaryControl, ThereAreBugs) {
  EXPECT_GE(bugs(false).size(), 20u);
  EXPECT_GE(bugs(true).size(), 70u);
}

}  // namespace
}  // namespace meltstage::tb
