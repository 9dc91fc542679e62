// SPDX-License-Identifier: Apache-2.0
// `meltstage regress` from outside: verdicts, resuming, lost workers, runs that failed before, mistakes.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "base/folder_lock.hpp"
#include "tb/regress/regression.hpp"
#include "tests/base/scratch_folder.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class RegressCommand : public testing::Test {
 protected:
  // A suite of four short runs.
  Ran run(const std::string& more = "", const std::string& coverage = "open") const {
    folder_.write(
        "suites.toml",
        fmt::format("[[suite]]\nname = \"mine\"\ncoverage = \"{}\"\nrun = [{{ test = \"random\", seeds = 4, "
                    "amount = 5_000 }}]\n",
                    coverage));
    return run_command(fmt::format("regress run mine --suites {} --out {} {}",
                                   folder_.at("suites.toml").string(), out().string(), more));
  }
  fs::path out() const { return folder_.at("out"); }
  fs::path mine(std::string_view name) const { return out() / "mine" / name; }

  ScratchFolder folder_;
};

TEST_F(RegressCommand, GoodRunsPassAndLeaveReports) {
  const Ran ran = run();
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("passed: 4 of 4 runs good"));
  for (const char* name : {"junit.xml", "summary.json", "report.html"})
    EXPECT_TRUE(fs::exists(mine(name))) << name;
}

TEST_F(RegressCommand, GoesOnWhereItStopped) {
  ASSERT_EQ(run().status, 0);
  fs::remove(mine("results") / "000002.json");
  std::ofstream(mine("results") / "000001.json") << "{\"format\": \"cut off";
  EXPECT_THAT(run().output, HasSubstr("; 2 results were there already"));
  EXPECT_THAT(run().output, HasSubstr("; 4 results were there already"));
  EXPECT_THAT(run("--seed 7").output, testing::Not(HasSubstr("there already")));
}

TEST_F(RegressCommand, ACoverageThatIsToBeClosedAndIsNotFails) {
  const Ran ran = run("", "closed");
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, AllOf(HasSubstr("not covered: fault "), HasSubstr("FAILED: 4 of 4 runs good")));
}

// Shell: `worker` is the first child of the process `run`, once it has one.
constexpr const char* kAwaitWorker =
    "for look in $(seq 500); do\n"
    "  worker=$(cat /proc/$run/task/$run/children)\n"
    "  if [ -n \"$worker\" ]; then break; fi\n"
    "  sleep 0.01\n"
    "done\n";

TEST_F(RegressCommand, AKilledWorkerLosesNothing) {
  folder_.write("long.toml",
                "[[suite]]\nname = \"long\"\nrun = [{ test = \"random\", seeds = 2, amount = 100_000 }]\n");
  const Ran ran = run_shell(
      fmt::format("{} regress run long --suites {} --out {} -j 1 & run=$!\n"
                  "{}kill -9 $worker; wait $run",
                  MELTSTAGE_COMMAND, folder_.at("long.toml").string(), out().string(), kAwaitWorker));
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, AllOf(HasSubstr("worker lost (killed by signal 9), run again"),
                                HasSubstr("passed: 2 of 2 runs good")));
}

TEST_F(RegressCommand, AKilledRunLeavesNoWorker) {
  folder_.write(
      "long.toml",
      "[[suite]]\nname = \"long\"\nrun = [{ test = \"random\", seeds = 1, amount = 100_000_000 }]\n");
  const Ran ran = run_shell(
      fmt::format("{} regress run long --suites {} --out {} -j 1 & run=$!\n"
                  "{}sleep 2; kill -9 $run; wait $run\n"
                  "for look in $(seq 500); do\n"
                  "  if ! kill -0 $worker; then echo \"no worker is left\"; exit 0; fi\n"
                  "  sleep 0.01\n"
                  "done\n"
                  "kill -9 $worker; exit 1",
                  MELTSTAGE_COMMAND, folder_.at("long.toml").string(), out().string(), kAwaitWorker));
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("no worker is left"));
}

TEST_F(RegressCommand, RunsThatFailedBeforeComeFirst) {
  folder_.write("failed.txt", "random.99 4000  # last week\nrandom.2 5000\n");
  const Ran ran = run("--failed " + folder_.at("failed.txt").string());
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("passed: 5 of 5 runs good"));
  EXPECT_LT(folder_.read("out/mine/junit.xml").find("random.99"),
            folder_.read("out/mine/junit.xml").find("random.1\""));
}

// A line of another suite's smaller run takes nothing from this suite's, and its larger one is not lost.
TEST_F(RegressCommand, ARunThatFailedBeforeIsDoneOnceWithTheLargestAmount) {
  folder_.write("failed.txt", "random.1 50\nrandom.2 6000\nrandom.2 5500\n");
  ASSERT_EQ(run("--failed " + folder_.at("failed.txt").string()).status, 0);
  const std::string plan = folder_.read("out/mine/plan.json");
  EXPECT_THAT(folder_.read("out/mine/junit.xml"), HasSubstr("tests=\"4\""));
  EXPECT_THAT(plan, HasSubstr("5000"));
  EXPECT_THAT(plan, HasSubstr("6000"));
  EXPECT_THAT(plan, testing::Not(HasSubstr("5500")));
  EXPECT_THAT(folder_.read("out/mine/summary.json"), testing::Not(HasSubstr("\"amount\": 50,")));
}

TEST_F(RegressCommand, TheVerdictOfAnotherPlanDoesNotStay) {
  ASSERT_EQ(run().status, 0);
  Suite other;
  other.name = "mine";
  other.runs = {{"random", 7, 10}};
  begin_regression(out() / "mine", plan_for(other));
  for (const char* file : {"junit.xml", "summary.json", "report.html"})
    EXPECT_FALSE(fs::exists(out() / "mine" / file)) << file;
}

TEST_F(RegressCommand, RecordsTheRandomRunsFromPowerUp) {
  folder_.write(
      "two.toml",
      "[[suite]]\nname = \"two\"\nrun = [{ test = \"random\", first = 3, seeds = 2, amount = 4_000 }, "
      "{ test = \"skip\", seeds = 1, amount = 10 }]\n"
      "[[suite]]\nname = \"none\"\nrun = [{ test = \"skip\", seeds = 1, amount = 10 }]\n");
  const std::string suites = " --suites " + folder_.at("two.toml").string();
  const Ran ran = run_command("regress record two " + folder_.at("pins").string() + suites);
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(folder_.read("pins/random.3.mvec"), HasSubstr("origin regress record random.3"));
  EXPECT_THAT(folder_.read("pins/random.4.mvec"), HasSubstr("end"));
  EXPECT_FALSE(std::filesystem::exists(folder_.at("pins/skip.1.mvec")));
  const Ran none = run_command("regress record none " + folder_.at("pins").string() + suites);
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.output, HasSubstr("suite none: found no run of random"));
}

TEST_F(RegressCommand, OneRunAlone) {
  const Ran ran = run_command("regress one random.3 --amount 5000");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("random.3: good, "));
}

TEST_F(RegressCommand, ARunThatTakesTooLongIsEndedAndIsNotGood) {
  folder_.write(
      "long.toml",
      "[[suite]]\nname = \"long\"\nlimit_min = 0.01\nrun = [{ test = \"random\", first = 5, amount = "
      "900_000_000 }]\n");
  const Ran ran = run_command(
      fmt::format("regress run long --suites {} --out {}", folder_.at("long.toml").string(), out().string()));
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, HasSubstr("random.5: ended after 0.01 min, the suite's limit_min"));
  EXPECT_THAT(folder_.read("out/long/junit.xml"), HasSubstr("ended after 0.01 min"));
  EXPECT_THAT(folder_.read("out/failed.txt"), HasSubstr("random.5 900000000"));
}

TEST_F(RegressCommand, TwoDontWorkInOneFolder) {
  ASSERT_EQ(run().status, 0);
  const FolderLock other(out() / "mine");
  const Ran second = run();
  EXPECT_EQ(second.status, 2);
  EXPECT_THAT(second.output, HasSubstr("mine: found another process at work in it"));
}

TEST_F(RegressCommand, MistakesAreOneLine) {
  const auto refused = [&](const std::string& arguments, const std::string& said) {
    const Ran ran = run_command("regress " + arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_THAT(ran.output, HasSubstr(said)) << arguments;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
  };
  refused("run nothing --out " + out().string(),
          "suite: found \"nothing\", expected one of: smoke, pr, nightly, release");
  refused("run smoke --suites " + folder_.at("nowhere.toml").string(), "nowhere.toml");
  refused("one random", "expected TEST.SEED such as random.17");
  refused("one rand.1", "the test one of: random, late_pins, register_ends, any_state, skip");
  refused("one random.1 --amount 0", "found 0, expected a whole number from 1");
  refused("job " + folder_.at("").string() + " 0", "expected a folder that meltstage regress run made");
  refused("case " + folder_.at("nowhere.json").string(), "nowhere.json");
  const auto sound = folder_.write("sound.json", "{\"format\": \"meltstage-case\", \"clocks\": [{}]}");
  refused("case " + sound.string() + " --fst " + folder_.at("no/waves.fst").string(),
          "waves.fst: cannot be written");
}

}  // namespace
}  // namespace meltstage::tb
