// SPDX-License-Identifier: Apache-2.0
// A regression in Slurm job arrays, on a one-node cluster that the test starts itself.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>

#include "tests/tb/windows/command.hpp"
#include "tests/tb/windows/recording.hpp"
#include "tests/tb/windows/slurm_cluster.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class RegressSlurm : public testing::Test {
 protected:
  std::string arguments(unsigned seeds, unsigned clocks) const {
    set_text(
        folder_ / "suites.toml",
        fmt::format("[[suite]]\nname = \"mine\"\nrun = [{{ test = \"random\", seeds = {}, amount = {} }}]\n",
                    seeds, clocks));
    return fmt::format("regress run mine --slurm --suites {} --out {}", (folder_ / "suites.toml").string(),
                       (folder_ / "out").string());
  }
  fs::path mine() const { return folder_ / "out" / "mine"; }

  SlurmCluster cluster_;
  TemporaryFolder folder_;
};

TEST_F(RegressSlurm, AJobArrayGivesTheVerdict) {
  const Ran ran = run_command(arguments(6, 20'000));
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, AllOf(HasSubstr("passed: 6 of 6 runs good"), HasSubstr("Slurm job")));
  fs::remove(mine() / "results" / "000001.json");
  EXPECT_THAT(run_command(arguments(6, 20'000)).output, HasSubstr("; 5 results were there already"));
  EXPECT_EQ(text_of(mine() / "slurm" / "array_1.list"), "1\n");
}

TEST_F(RegressSlurm, AKilledWorkersRunIsSubmittedAgain) {
  Background run(arguments(2, 400'000));
  std::optional<pid_t> worker;
  ASSERT_TRUE(wait_until([&] { return (worker = find_worker(mine(), "job")).has_value(); }));
  ASSERT_EQ(kill(*worker, SIGKILL), 0);
  const Ran ran = run.wait();
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, AllOf(HasSubstr("passed: 2 of 2 runs good"), HasSubstr("no result from Slurm job"),
                                HasSubstr("run again")));
}

}  // namespace
}  // namespace meltstage::tb
