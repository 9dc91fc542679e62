// SPDX-License-Identifier: Apache-2.0
// Windows in Slurm job arrays, on a one-node cluster that the test starts itself.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>

#include "command.hpp"
#include "recording.hpp"
#include "slurm_cluster.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Slurm : public ::testing::Test {
 protected:
  fs::path work() const { return folder_ / "work"; }
  void plan(std::uint64_t clocks, std::uint64_t window_clocks) const {
    const Ran ran = plan_by_command(work(), clocks, window_clocks);
    ASSERT_EQ(ran.status, 0) << ran.output;
  }
  std::string run_arguments() const { return "windows run --slurm " + work().string(); }

  SlurmCluster cluster_;  // of the test: one that does not come up fails it, where a suite's would be skipped
  TemporaryFolder folder_;
};

TEST_F(Slurm, AJobArrayGivesAWholeVerdict) {
  plan(600'000, 100'000);
  const Ran ran = run_command(run_arguments());
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, AllOf(HasSubstr("6 of 6 equal, 600000 of 600000 clocks"), HasSubstr("no gap"),
                                HasSubstr("Slurm job")));
}

TEST_F(Slurm, AKilledWorkersWindowIsSubmittedAgain) {
  plan(1'500'000, 750'000);
  Background run(run_arguments());
  std::optional<pid_t> worker;
  ASSERT_TRUE(wait_until([&] { return (worker = find_worker(work())).has_value(); }));
  ASSERT_EQ(kill(*worker, SIGKILL), 0);
  const Ran ran = run.wait();
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, AllOf(HasSubstr("2 of 2 equal, 1500000 of 1500000 clocks"),
                                HasSubstr("no result from Slurm job"), HasSubstr("run again")));
}

TEST_F(Slurm, OnlyMissingWindowsAreSubmitted) {
  plan(50'000, 10'000);
  ASSERT_EQ(run_command("windows run " + work().string()).status, 0);
  fs::remove(work() / "results" / "000001.json");
  fs::remove(work() / "results" / "000004.json");
  const Ran ran = run_command(run_arguments());
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("3 results were there already"));
  EXPECT_EQ(text_of(work() / "slurm" / "array_0.list"), "1\n4\n");
}

TEST_F(Slurm, ADifferenceGivesStatusOneAndNamesTheWindow) {
  plan(30'000, 10'000);
  seed_difference(work(), 2, "u_algor.i_q");
  const Ran ran = run_command(run_arguments());
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, AllOf(HasSubstr("window 1 differs"), HasSubstr("u_algor.i_q")));
}

TEST_F(Slurm, AnInterruptCancelsTheJobs) {
  plan(1'500'000, 50'000);
  Background run(run_arguments());
  ASSERT_TRUE(wait_until([&] { return count_results(work()) >= 1; }));
  ASSERT_EQ(kill(run.pid(), SIGTERM), 0);
  const Ran ran = run.wait();
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("interrupted; results so far stay"));
  EXPECT_TRUE(wait_until([] { return shell("squeue --noheader").empty(); }, std::chrono::seconds(60)));
  EXPECT_LT(count_results(work()), 30u);
}

TEST_F(Slurm, WithoutAControllerIsRefusedInOneLine) {
  plan(30'000, 10'000);
  const std::string conf = getenv("SLURM_CONF");
  const fs::path dead = folder_ / "slurm.conf";
  std::string text = text_of(conf);
  const std::size_t port = text.find("SlurmctldPort=") + 14;
  text.replace(port, text.find('\n', port) - port, "9\nMessageTimeout=2");  // nobody listens there
  set_text(dead, text);
  setenv("SLURM_CONF", dead.c_str(), 1);
  const Ran ran = run_command(run_arguments());
  setenv("SLURM_CONF", conf.c_str(), 1);
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("meltstage: scontrol: no answer from Slurm's controller"));
  EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
}

}  // namespace
}  // namespace meltstage::tb
