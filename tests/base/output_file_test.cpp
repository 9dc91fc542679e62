// SPDX-License-Identifier: Apache-2.0
#include "base/output_file.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "base/error.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;

TEST(OutputFile, AppearsWholeOrNotAtAll) {
  const ScratchFolder folder;
  folder.write("a", "old");
  {
    OutputFile file(folder.at("a"));
    file.write("new");
    EXPECT_EQ(folder.read("a"), "old");
  }
  EXPECT_EQ(folder.read("a"), "old");
  EXPECT_FALSE(fs::exists(folder.at("a.partial")));
  write_whole(folder.at("a"), "new");
  EXPECT_EQ(folder.read("a"), "new");
}

TEST(OutputFile, ReplacesWhatAKilledRunLeft) {
  const ScratchFolder folder;
  folder.write("a.partial", "half of a lo");
  write_whole(folder.at("a"), "whole");
  EXPECT_EQ(folder.read("a"), "whole");
  EXPECT_FALSE(fs::exists(folder.at("a.partial")));
}

TEST(OutputFile, DoesNotWriteThroughALinkThatWasLeft) {
  const ScratchFolder folder;
  folder.write("job.toml", "mine");
  fs::create_symlink("job.toml", folder.at("a.partial"));
  write_whole(folder.at("a"), "whole");
  EXPECT_EQ(folder.read("job.toml"), "mine");
  EXPECT_EQ(folder.read("a"), "whole");
  EXPECT_FALSE(fs::is_symlink(folder.at("a")));
}

TEST(OutputFile, DoesNotWaitForTheReaderOfAPipe) {
  const ScratchFolder folder;
  ASSERT_EQ(mkfifo(folder.at("a.partial").c_str(), 0600), 0);
  write_whole(folder.at("a"), "whole");
  EXPECT_EQ(folder.read("a"), "whole");
}

TEST(OutputFile, LeavesDevicesAndFoldersAlone) {
  const ScratchFolder folder;
  EXPECT_THROW(write_whole(folder.at(""), "text"), UserError);
  ASSERT_EQ(mkfifo(folder.at("pipe").c_str(), 0600), 0);
  EXPECT_THROW(write_whole(folder.at("pipe"), "text"), UserError);
  EXPECT_TRUE(fs::is_fifo(folder.at("pipe")));
  fs::create_directory(folder.at("a.partial"));
  folder.write("a.partial/in_it", "");
  EXPECT_THROW(write_whole(folder.at("a"), "text"), UserError);
  EXPECT_TRUE(fs::exists(folder.at("a.partial/in_it")));
}

}  // namespace
}  // namespace meltstage
