// SPDX-License-Identifier: Apache-2.0
#include "base/output_file.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "base/error.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;

bool has_partial(const ScratchFolder& folder, const std::string& name) {
  for (const auto& entry : fs::directory_iterator(folder.at("")))
    if (entry.path().filename().string().starts_with(name + ".partial")) return true;
  return false;
}

TEST(OutputFile, AppearsWholeOrNotAtAll) {
  const ScratchFolder folder;
  folder.write("a", "old");
  {
    OutputFile file(folder.at("a"));
    file.write("new");
    EXPECT_EQ(folder.read("a"), "old");
    EXPECT_TRUE(has_partial(folder, "a"));
  }
  EXPECT_EQ(folder.read("a"), "old");
  EXPECT_FALSE(has_partial(folder, "a"));
  write_whole(folder.at("a"), "new");
  EXPECT_EQ(folder.read("a"), "new");
  EXPECT_FALSE(has_partial(folder, "a"));
}

TEST(OutputFile, TakesNoNameThatAnotherHas) {
  const ScratchFolder folder;
  EXPECT_TRUE(write_whole_new(folder.at("a"), "first"));
  EXPECT_FALSE(write_whole_new(folder.at("a"), "second"));
  EXPECT_EQ(folder.read("a"), "first");
  EXPECT_FALSE(has_partial(folder, "a"));
}

TEST(OutputFile, HasAName) {
  try {
    write_whole("", "text");
    FAIL();
  } catch (const UserError& error) {
    EXPECT_STREQ(error.what(), "\"\": found an empty name, expected that of a file to write");
  }
}

TEST(OutputFile, IsNotTheStandardOutput) {
  try {
    write_whole("-", "text");
    FAIL();
  } catch (const UserError& error) {
    EXPECT_STREQ(
        error.what(),
        "-: found the sign for the standard output, expected the name of a file or folder to write; for "
        "one of this name say ./-");
  }
  EXPECT_THROW(PartialFolder("-"), UserError);
  EXPECT_FALSE(std::filesystem::exists("-"));
}

TEST(OutputFile, IsPublishedOnceAndThenClosed) {
  const ScratchFolder folder;
  OutputFile file(folder.at("a"));
  file.write("text");
  file.publish();
  EXPECT_THROW(file.publish(), std::logic_error);
  EXPECT_THROW(file.write("more"), std::logic_error);
  EXPECT_EQ(folder.read("a"), "text");
}

TEST(OutputFile, TwoWritersOfOneNameDoNotMeet) {
  const ScratchFolder folder;
  OutputFile first(folder.at("a")), second(folder.at("a"));
  first.write("first");
  second.write("second");
  second.publish();
  EXPECT_EQ(folder.read("a"), "second");
  first.publish();
  EXPECT_EQ(folder.read("a"), "first");
}

TEST(OutputFile, AnotherProcessLeavesAFileThatIsBeingWritten) {
  const ScratchFolder folder;
  OutputFile file(folder.at("a"));
  file.write("ours");
  const pid_t child = fork();
  if (child == 0) {
    write_whole(folder.at("a"), "theirs");
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(folder.read("a"), "theirs");
  file.publish();
  EXPECT_EQ(folder.read("a"), "ours");
}

TEST(OutputFile, RemovesWhatAKilledRunLeftAndNothingElse) {
  const ScratchFolder folder;
  folder.write("a.partial.1", "half of a lo");  // process 1 lives, but holds no lock
  folder.write("a.partial.1.2", "half of a lo");
  folder.write("a.partial.mine", "kept");
  folder.write("b.partial.1", "kept");
  write_whole(folder.at("a"), "whole");
  EXPECT_EQ(folder.read("a"), "whole");
  EXPECT_FALSE(fs::exists(folder.at("a.partial.1")));
  EXPECT_FALSE(fs::exists(folder.at("a.partial.1.2")));
  EXPECT_EQ(folder.read("a.partial.mine"), "kept");
  EXPECT_EQ(folder.read("b.partial.1"), "kept");
}

TEST(OutputFile, DoesNotWriteThroughALinkThatWasLeft) {
  const ScratchFolder folder;
  folder.write("job.toml", "mine");
  fs::create_symlink("job.toml", folder.at("a.partial." + std::to_string(getpid())));
  write_whole(folder.at("a"), "whole");
  EXPECT_EQ(folder.read("job.toml"), "mine");
  EXPECT_EQ(folder.read("a"), "whole");
  EXPECT_FALSE(fs::is_symlink(folder.at("a")));
}

TEST(OutputFile, LeavesALinkAndReplacesWhatItPointsTo) {
  const ScratchFolder folder;
  fs::create_directory(folder.at("far"));
  folder.write("far/a", "old");
  fs::create_symlink("far/a", folder.at("near"));
  fs::create_symlink("near", folder.at("nearer"));
  write_whole(folder.at("nearer"), "new");
  EXPECT_EQ(folder.read("far/a"), "new");
  EXPECT_TRUE(fs::is_symlink(folder.at("near")) && fs::is_symlink(folder.at("nearer")));
  fs::create_symlink("far/b", folder.at("to_come"));
  write_whole(folder.at("to_come"), "new");
  EXPECT_EQ(folder.read("far/b"), "new");
  fs::create_symlink("ring", folder.at("ring"));
  EXPECT_THROW(write_whole(folder.at("ring"), "new"), UserError);
}

TEST(OutputFile, DoesNotWaitForTheReaderOfAPipe) {
  const ScratchFolder folder;
  ASSERT_EQ(mkfifo(folder.at("a.partial." + std::to_string(getpid())).c_str(), 0600), 0);
  write_whole(folder.at("a"), "whole");
  EXPECT_EQ(folder.read("a"), "whole");
}

TEST(OutputFile, LeavesDevicesAndFoldersAlone) {
  const ScratchFolder folder;
  EXPECT_THROW(write_whole(folder.at(""), "text"), UserError);
  ASSERT_EQ(mkfifo(folder.at("pipe").c_str(), 0600), 0);
  EXPECT_THROW(write_whole(folder.at("pipe"), "text"), UserError);
  EXPECT_TRUE(fs::is_fifo(folder.at("pipe")));
  fs::create_directory(folder.at("a.partial.1"));
  folder.write("a.partial.1/in_it", "");
  write_whole(folder.at("a"), "text");
  EXPECT_EQ(folder.read("a"), "text");
  EXPECT_TRUE(fs::exists(folder.at("a.partial.1/in_it")));
}

TEST(PartialFolder, GoesUnlessItIsRenamed) {
  const ScratchFolder folder;
  fs::path path;
  {
    const PartialFolder partial(folder.at("out"));
    path = partial.path();
    EXPECT_TRUE(fs::is_directory(path));
  }
  EXPECT_FALSE(fs::exists(path));
  {
    PartialFolder partial(folder.at("new/out"));
    partial.publish();
  }
  EXPECT_TRUE(fs::is_directory(folder.at("new/out")));
}

TEST(PartialFolder, IsPublishedOnce) {
  const ScratchFolder folder;
  PartialFolder partial(folder.at("out"));
  std::ofstream(partial.path() / "new") << "new";
  partial.publish();
  EXPECT_THROW(partial.publish(), std::logic_error);
  EXPECT_EQ(folder.read("out/new"), "new");
}

TEST(PartialFolder, ReplacesAFolderOnceItIsComplete) {
  const ScratchFolder folder;
  fs::create_directory(folder.at("out"));
  folder.write("out/old", "old");
  {
    const PartialFolder dropped(folder.at("out/"));
    EXPECT_EQ(dropped.path().parent_path(), folder.at("out").parent_path());
  }
  EXPECT_EQ(folder.read("out/old"), "old");
  {
    PartialFolder partial(folder.at("out/."));
    std::ofstream(partial.path() / "new") << "new";
    EXPECT_EQ(folder.read("out/old"), "old");
    partial.publish();
  }
  EXPECT_EQ(folder.read("out/new"), "new");
  EXPECT_FALSE(fs::exists(folder.at("out/old")));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.at("")), fs::directory_iterator()), 1);
}

TEST(PartialFolder, LeavesALinkAndReplacesWhatItPointsTo) {
  const ScratchFolder folder;
  fs::create_directories(folder.at("far/out"));
  folder.write("far/out/old", "old");
  fs::create_symlink("far/out", folder.at("out"));
  PartialFolder partial(folder.at("out/"));
  std::ofstream(partial.path() / "new") << "new";
  partial.publish();
  EXPECT_TRUE(fs::is_symlink(folder.at("out")));
  EXPECT_EQ(folder.read("far/out/new"), "new");
  EXPECT_FALSE(fs::exists(folder.at("out/old")));
}

TEST(PartialFolder, ThatCannotTakeTheNameLeavesTheOldOne) {
  const ScratchFolder folder;
  fs::create_directory(folder.at("out"));
  folder.write("out/old", "old");
  PartialFolder partial(folder.at("out"));
  fs::remove_all(partial.path());
  EXPECT_THROW(partial.publish(), UserError);
  EXPECT_EQ(folder.read("out/old"), "old");
}

TEST(FolderToWrite, IsNamedWithoutWhatStandsBehindItsName) {
  for (const char* path : {"a/out", "a/out/", "a/out//", "a/out/.", "a/out/./"})
    EXPECT_EQ(folder_to_write(path), "a/out") << path;
  EXPECT_EQ(folder_to_write("./out/"), "./out");
  EXPECT_EQ(folder_to_write("/out/"), "/out");
  for (const char* path : {"", ".", "./", "..", "../", "/", "/.", "a/.."})
    EXPECT_THROW(folder_to_write(path), UserError) << path;
}

TEST(PartialFolder, RemovesWhatKilledRunsLeftAndNothingElse) {
  const ScratchFolder folder;
  fs::create_directories(folder.at("out.partial.1/states"));  // process 1 lives, but holds no lock
  folder.write("out.partial.1/states/0", "");
  fs::create_directory(folder.at("other.partial.1"));
  folder.write("out.partial", "of a file");
  const pid_t child = fork();
  if (child == 0) {
    const PartialFolder living(folder.at("out"));
    folder.write("made", "");
    pause();
    _exit(0);
  }
  while (!fs::exists(folder.at("made"))) usleep(1000);
  {
    const PartialFolder partial(folder.at("out"));
    EXPECT_FALSE(fs::exists(folder.at("out.partial.1")));
    EXPECT_TRUE(fs::exists(folder.at("out.partial." + std::to_string(child))));
    EXPECT_TRUE(fs::exists(folder.at("other.partial.1")));
    EXPECT_TRUE(fs::exists(folder.at("out.partial")));
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  const PartialFolder partial(folder.at("out"));
  EXPECT_FALSE(fs::exists(folder.at("out.partial." + std::to_string(child))));
}

}  // namespace
}  // namespace meltstage
