// SPDX-License-Identifier: Apache-2.0
#include "base/file.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "base/error.hpp"
#include "tests/base/scratch_folder.hpp"
#include "tests/support/error_of.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;

TEST(ReadFile, GivesEveryByte) {
  const ScratchFolder folder;
  const std::string bytes("a\0\r\n\xff", 5);
  EXPECT_EQ(read_file(folder.write("file", bytes), "bytes"), bytes);
  EXPECT_EQ(read_file(folder.write("empty", ""), "bytes"), "");
  const std::string large(700'000, 'x');
  EXPECT_EQ(read_file(folder.write("large", large), "bytes"), large);
}

TEST(ReadFile, RefusesWhatIsNoFileInOneLine) {
  const ScratchFolder folder;
  EXPECT_THAT(error_of([&] { read_file(folder.at("none"), "a job file"); }),
              EndsWith("none: no such file, expected a job file"));
  EXPECT_THAT(error_of([&] { read_file(folder.at(""), "a job file"); }),
              EndsWith(": found a folder, expected a job file"));
  EXPECT_THAT(error_of([&] { read_file(folder.write("file", "") / "below", "a job file"); }),
              EndsWith("expected a job file"));
  ASSERT_EQ(mkfifo(folder.at("pipe").c_str(), 0600), 0);
  EXPECT_THAT(
      error_of([&] { read_file(folder.at("pipe"), "a job file"); }),  // and doesn't wait for a writer
      EndsWith(
          "pipe: found a pipe, a socket or a device, expected a job file; save what it gives as a file and "
          "name that"));
  EXPECT_THAT(error_of([&] { read_file("/dev/zero", "a job file"); }), HasSubstr("a device"));
  fs::create_symlink("loop", folder.at("loop"));
  EXPECT_THAT(error_of([&] { read_file(folder.at("loop"), "a job file"); }),
              AllOf(HasSubstr("loop: can't be read (Too many levels"), EndsWith("expected a job file")));
}

TEST(ReadFile, RefusesMoreBytesThanAskedFor) {
  const ScratchFolder folder;
  EXPECT_EQ(read_file(folder.write("file", "1234"), "a job file", 4), "1234");
  EXPECT_THAT(error_of([&] { read_file(folder.write("file", "12345"), "a job file", 4); }),
              EndsWith("file: found more than 4 bytes, expected a job file of at most so many"));
}

TEST(OtherFile, SeesAnInputUnderEveryName) {
  const ScratchFolder folder;
  const fs::path input = folder.write("job.toml", "x");
  fs::create_symlink("job.toml", folder.at("link"));
  fs::create_hard_link(input, folder.at("hard"));
  fs::create_directory(folder.at("sub"));
  for (const fs::path& output :
       {input, folder.at("link"), folder.at("hard"), folder.at("sub/../job.toml"), fs::relative(input)}) {
    EXPECT_THAT(error_of([&] {
                  require_other_file(output, {folder.at("other"), input});
                }),
                HasSubstr("would be written over the input"))
        << output;
  }
  EXPECT_EQ(error_of([&] { require_other_file(folder.write("copy", "x"), {input}); }), "");
  EXPECT_EQ(error_of([&] { require_other_file(folder.at("new"), {input}); }), "");
}

TEST(OtherFiles, TwoOutputsAreNotOneFile) {
  const ScratchFolder folder;
  const fs::path input = folder.write("in", "x");
  fs::create_symlink(".", folder.at("link"));
  EXPECT_THAT(error_of([&] {
                require_other_files({"", folder.at("new"), input}, {input});
              }),
              HasSubstr("would be written over the input"));
  for (const char* other : {"new", "./new", "link/new"})
    EXPECT_THAT(error_of([&] {
                  require_other_files({folder.at("new"), folder.at(other)}, {input});
                }),
                EndsWith(": would be written twice, expected another file each"))
        << other;
  EXPECT_EQ(error_of([&] {
              require_other_files({"", folder.at("new"), "", folder.at("newer")}, {input});
            }),
            "");
}

TEST(Outside, SeesAnInputInAFolderThatIsReplaced) {
  const ScratchFolder folder;
  fs::create_directories(folder.at("out/sub"));
  const fs::path in_it = folder.write("out/sub/bumps.csv", "x"), beside = folder.write("outside.csv", "x");
  fs::create_symlink("out", folder.at("link"));
  for (const fs::path& whole :
       {folder.at("out"), folder.at("out/"), folder.at("link"), folder.at("out/../out/sub")}) {
    EXPECT_THAT(error_of([&] {
                  require_outside(whole, {beside, in_it});
                }),
                HasSubstr("bumps.csv lies in it"))
        << whole;
    EXPECT_EQ(error_of([&] { require_outside(whole, {beside}); }), "") << whole;
  }
  EXPECT_EQ(error_of([&] { require_outside(folder.at("new"), {beside, in_it}); }), "");
}

}  // namespace
}  // namespace meltstage
