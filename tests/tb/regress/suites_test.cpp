// SPDX-License-Identifier: Apache-2.0
#include "tb/regress/suites.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage::tb {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class Suites : public testing::Test {
 protected:
  void refused(const std::string& text, const std::string& said) const {
    const auto path = folder_.write("suites.toml", text);
    EXPECT_THAT([&] { read_suites(path); }, ThrowsMessage<UserError>(HasSubstr(said))) << text;
  }
  ScratchFolder folder_;
};

TEST_F(Suites, OfTheProjectHaveEachNameOnce) {
  const std::vector<Suite> suites = standard_suites();
  for (const char* name : {"smoke", "pr", "nightly", "release"})
    EXPECT_EQ(find_suite(suites, name).name, name);
  EXPECT_THAT([&] { find_suite(suites, "smok"); },
              ThrowsMessage<UserError>(HasSubstr("one of: smoke, pr, nightly, release")));
}

TEST_F(Suites, AreRunsOfTestsAndSeeds) {
  const auto path = folder_.write("suites.toml", R"([[suite]]
name = "mine"
coverage = "closed"
run = [{ test = "random", first = 5, seeds = 2, amount = 70 }, { test = "skip", amount = 9 }]
)");
  const std::vector<Suite> suites = read_suites(path);
  ASSERT_EQ(suites.size(), 1u);
  EXPECT_TRUE(suites[0].coverage_closed);
  EXPECT_EQ(suites[0].runs, (std::vector<RegressRun>{{"random", 5, 70}, {"random", 6, 70}, {"skip", 1, 9}}));
  EXPECT_EQ(name_of(with_seeds_moved(suites[0], 100).runs[1]), "random.106");
}

TEST_F(Suites, MistakesAreNamedWithTheirPlace) {
  refused("", "suites.toml");
  refused("[[suite]]\nname = \"a\"\n", "run: found none, expected a run");
  refused("[[suite]]\nname = \"../a\"\nrun = [{ test = \"random\", amount = 1 }]\n",
          "suites.toml:2:8: suite.name");
  refused("[[suite]]\nname = \"a\"\nrun = [{ test = \"rand\", amount = 1 }]\n",
          "one of: random, late_pins, register_ends, any_state, skip");
  refused("[[suite]]\nname = \"a\"\nrun = [{ test = \"random\" }]\n", "amount");
  refused("[[suite]]\nname = \"a\"\nlimit_min = 0\nrun = [{ test = \"random\", amount = 1 }]\n",
          "limit_min: found 0");
  refused("[[suite]]\nname = \"a\"\nrun = [{ test = \"random\", amount = 0 }]\n", "amount: found 0");
  refused("[[suite]]\nname = \"a\"\nrun = [{ test = \"random\", amount = 1, seed = 4 }]\n", "seed");
  refused(
      "[[suite]]\nname = \"a\"\nrun = [{ test = \"skip\", amount = 1 }, { test = \"skip\", amount = 2 }]\n",
      "skip.1 twice");
  const std::string mine = "[[suite]]\nname = \"a\"\nrun = [{ test = \"random\", amount = 1 }]\n";
  refused(mine + mine, "name: found \"a\" twice, expected each suite once");
}

TEST_F(Suites, RunsThatFailedAreReadLineByLine) {
  const auto path =
      folder_.write("failed.txt", "# by hand\nrandom.17 300000  # Monday\n\nskip.3 9\nrandom.17 300000\n");
  EXPECT_EQ(read_failed(path), (std::vector<RegressRun>{{"random", 17, 300'000}, {"skip", 3, 9}}));
  EXPECT_TRUE(read_failed(folder_.at("nothing")).empty());
  for (const char* line : {"random.17", "random.17 many", "random.17 0", "random 17", "rand.1 5",
                           "random.17 5 6", "random.-1 5"}) {
    const auto wrong = folder_.write("wrong.txt", std::string("skip.3 9\n") + line + "\n");
    EXPECT_THAT([&] { read_failed(wrong); }, ThrowsMessage<UserError>(HasSubstr("wrong.txt:2: "))) << line;
  }
}

}  // namespace
}  // namespace meltstage::tb
