// SPDX-License-Identifier: Apache-2.0
#include "base/temporary_folder.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "base/error.hpp"
#include "base/path_lock.hpp"
#include "scratch_folder.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;

class TemporaryFolderIn : public testing::Test {
 protected:
  TemporaryFolderIn() { setenv("TMPDIR", parent_.at("").c_str(), 1); }
  ~TemporaryFolderIn() override { unsetenv("TMPDIR"); }

  // The process of a child that has ended.
  static pid_t dead_process() {
    const pid_t child = fork();
    if (child == 0) _exit(0);
    waitpid(child, nullptr, 0);
    return child;
  }

  ScratchFolder parent_;
};

TEST_F(TemporaryFolderIn, GoesWithAllThatIsInIt) {
  fs::path path;
  {
    const TemporaryFolder folder;
    path = folder.path();
    std::ofstream(path / "file") << "content";
    EXPECT_TRUE(fs::exists(path / "file"));
  }
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(TemporaryFolderIn, RemovesOnlyWhatKilledProcessesLeft) {
  const fs::path left = parent_.at("meltstage." + std::to_string(dead_process()) + ".abcdef");
  const fs::path in_use = parent_.at("meltstage." + std::to_string(getpid()) + ".abcdef");
  const fs::path anothers = parent_.at("meltstage.notes.d"), short_name = parent_.at("meltstage.1999999999");
  const fs::path results = parent_.at("meltstage." + std::to_string(dead_process()) + ".results");
  const fs::path locked = parent_.at("meltstage." + std::to_string(dead_process()) + ".ABCDE6");
  for (const fs::path& path : {left, in_use, anothers, short_name, results, locked})
    fs::create_directory(path);
  const int lock = detail::lock_of(locked, O_DIRECTORY);  // as a process of another machine does
  std::ofstream(left / "file") << "content";
  const TemporaryFolder folder;
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(in_use));
  EXPECT_TRUE(fs::exists(anothers));
  EXPECT_TRUE(fs::exists(short_name));
  EXPECT_TRUE(fs::exists(results));
  EXPECT_TRUE(fs::exists(locked));
  close(lock);
}

TEST_F(TemporaryFolderIn, APathThatToolsDoNotTakeIsRefused) {
  fs::create_directory(parent_.at("t m"));
  setenv("TMPDIR", parent_.at("t m").c_str(), 1);
  try {
    const TemporaryFolder folder;
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("t m: found blanks or signs"), std::string::npos)
        << error.what();
  }
}

TEST_F(TemporaryFolderIn, NoPlaceForItIsOneLine) {
  setenv("TMPDIR", parent_.at("nowhere").c_str(), 1);
  try {
    const TemporaryFolder folder;
    FAIL();
  } catch (const UserError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("TMPDIR"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace meltstage
