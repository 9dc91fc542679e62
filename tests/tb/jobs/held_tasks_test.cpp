// SPDX-License-Identifier: Apache-2.0
// Job arrays whose tasks Slurm holds, by stand-ins for its commands.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/temporary_folder.hpp"
#include "tb/jobs/job_runners.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// Arrays 17 and 18, one task each at most, all held; scancel ends with this status and writes down what it
// was asked.
class HeldTasks : public ::testing::Test {
 protected:
  HeldTasks() : path_(getenv("PATH")) {
    command("scontrol", "echo MaxArraySize = 2");
    command("sbatch",
            fmt::format("id=17; [ -e {0} ] && id=18; touch {0}; echo $id", file("submitted").string()));
    command("squeue", "echo PENDING JobHeldUser");
    setenv("PATH", (folder_.path().string() + ":" + path_).c_str(), 1);
  }
  ~HeldTasks() override { setenv("PATH", path_.c_str(), 1); }

  fs::path file(const std::string& name) const { return folder_.path() / name; }
  void command(const std::string& name, const std::string& does) const {
    OutputFile script(file(name));
    script.write("#!/bin/sh\n" + does + "\n");
    script.publish();
    fs::permissions(file(name), fs::perms::owner_all);
  }
  void scancel_ends_with(int status) const {
    command("scancel", fmt::format("printf '[%s]' \"$@\" >> {}; echo no such job; exit {}",
                                   file("asked").string(), status));
  }
  JobsDone run() const {
    const std::vector<std::size_t> numbers{0, 1, 2};
    const Jobs jobs{
        .what = "window", .worker = {"true"}, .folder = file("work"), .numbers = numbers, .left = [=] {
          return numbers;
        }};
    return run_jobs_slurm(jobs, {.attempts = 1}, [](const JobProgress&) {});
  }

 private:
  TemporaryFolder folder_;
  std::string path_;
};

TEST_F(HeldTasks, AreCancelledByTheirArraysIds) {
  scancel_ends_with(0);
  const JobsDone done = run();
  EXPECT_EQ(done.workers, "Slurm job 17, 18");
  EXPECT_EQ(read_file(file("asked"), "what scancel was asked"), "[17][18]");
  EXPECT_EQ(done.notes.size(), 3U);  // a window each
}

TEST_F(HeldTasks, AreToldWhenScancelRefuses) {
  scancel_ends_with(1);
  EXPECT_THAT(run().notes,
              testing::Contains(HasSubstr("scancel refused to end its held tasks: no such job")));
}

}  // namespace
}  // namespace meltstage::tb
