// SPDX-License-Identifier: Apache-2.0
// `meltstage init`: other people's files become jobs that print at once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class InitCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("meltstage_init_command." + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::string job() const { return (folder_ / "job.toml").string(); }
  Ran init(const std::string& arguments) const {
    return run_command("init " + arguments + " --out " + job() + " < /dev/null");
  }
  // What it made prints, every bump.
  void expect_printed(const std::string& bumps) const {
    const Ran ran = run_command("print " + job() + " --rtl none --out " + (folder_ / "out").string());
    EXPECT_EQ(ran.status, 0) << ran.output;
    EXPECT_THAT(ran.output,
                HasSubstr(bumps + " of " + bumps + (bumps == "1" ? " bump printed" : " bumps printed")));
  }
  fs::path folder_;
};

TEST_F(InitCommand, AMetreTable) {
  const Ran ran = init(write("bumps.csv", "x (m),y (m)\n0.010,0.020\n0.012,0.020\n0.012,0.024\n"));
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("3 bumps over 2 mm x 4 mm"));
  expect_printed("3");
}

TEST_F(InitCommand, AMillimetreTableWithoutAUnit) {
  const std::string file = write("bumps.csv", "x,y\n10,20\n12,20\n12,24\n");
  const Ran refused = init(file);
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.output, HasSubstr("found numbers without a unit, expected --unit"));
  EXPECT_FALSE(fs::exists(job()));
  const Ran ran = init(file + " --unit mm");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("3 bumps over 2 mm x 4 mm"));
  expect_printed("3");
}

TEST_F(InitCommand, SemicolonsAndDecimalCommas) {
  const Ran ran = init(write("bumps.csv", "x_mm;y_mm\n10,5;20,25\n12,5;20,25\n"));
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("2 bumps over 2 mm x 0 mm"));
  expect_printed("2");
}

TEST_F(InitCommand, OneBumpIsABump) {
  EXPECT_THAT(init(write("bumps.csv", "x_mm,y_mm\n10,20\n")).output, HasSubstr(": 1 bump over 0 mm x 0 mm"));
  expect_printed("1");
}

TEST_F(InitCommand, AKicadFootprint) {
  const Ran ran = init(MELTSTAGE_SOURCE_DIR "/examples/bga.kicad_mod");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("KiCad's y points down; what lies above there lies above here"));
  const std::string bumps = ran.output.substr(ran.output.find(".toml: ") + 7);
  expect_printed(bumps.substr(0, bumps.find(' ')));
}

TEST_F(InitCommand, OneSideAndOneToolAlone) {
  const std::string board = MELTSTAGE_SOURCE_DIR "/tests/motion/data/two_sides.kicad_pcb";
  EXPECT_THAT(init(board).output, HasSubstr("expected one side; say which (side = \"top\")"));
  EXPECT_EQ(init(board + " --side left").status, 2);
  const Ran ran = init(board + " --side bottom");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("note: 10 bumps of the other side, first in row 5, left out"));
  expect_printed("10");
  fs::remove(job());
  const std::string drills =
      write("a.drl", "M48\nMETRIC\nT1C0.3\nT2C1.0\n%\nT1\nX1.0Y1.0\nX2.0Y1.0\nT2\nX3.0Y1.0\nM30\n");
  EXPECT_THAT(run_command("coordinates " + drills).output, HasSubstr("T1       2 bumps\nT2       1 bump\n"));
  EXPECT_EQ(init(drills + " --only T1").status, 0);
  expect_printed("2");
}

TEST_F(InitCommand, ANameThatNoJobCanHoldIsRefused) {
  for (const std::string name : {"a\nb.csv", "a\x1b.csv", "a\xff.csv", "a\x7f.csv"}) {
    const Ran ran = init("'" + write(name, "x_mm,y_mm\n0,0\n2,0\n") + "'");
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("expected a name that a job can hold; rename"));
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_FALSE(fs::exists(job()));
  }
  const Ran ran = init("'" + write("a \"\\\xc3\xa4.csv", "x_mm,y_mm\n0,0\n2,0\n") + "'");
  EXPECT_EQ(ran.status, 0) << ran.output;
  expect_printed("2");
}

TEST_F(InitCommand, RefusesInOneLine) {
  for (const char* pitch : {"nan", "inf", "0", "1e7", "1x"}) {
    const Ran ran = init(write("grid.csv", "0,0\n1,0\n") + " --pitch-mm " + pitch);
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output,
                HasSubstr(std::string("--pitch-mm: found ") + pitch + ", expected a number from"));
  }
  ASSERT_EQ(mkfifo((folder_ / "pipe.csv").c_str(), 0600), 0);
  EXPECT_THAT(
      init((folder_ / "pipe.csv").string()).output,
      HasSubstr("pipe.csv: found a pipe, a socket or a device, expected a file with coordinates, such as "
                "bumps.csv; save what it gives as a file and name that"));
  const std::string file = write("bumps.csv", "x_mm,y_mm\n0,0\n300,1\n");
  EXPECT_THAT(init(file).output,
              HasSubstr("found bumps over 300 mm x 1 mm, expected at most 200 mm x 200 mm"));
  EXPECT_THAT(init(file + " --unit um").output,
              HasSubstr("says its unit itself (row 1, column 1: x_mm); leave out --unit"));
  const Ran mil = init(write("units.csv", "X,Y,Unit\n15,25,mil\n35,40,mil\n") + " --unit mm");
  EXPECT_EQ(mil.status, 2);
  EXPECT_THAT(mil.output,
              HasSubstr("units.csv: says its unit itself (row 2, column 3 (Unit): mil); leave out --unit"));
  EXPECT_THAT(init(write("inches.csv", "Units: inches\nRef,X,Y\nR1,1,2\n") + " --unit mm").output,
              HasSubstr("says its unit itself (row 1: inches); leave out --unit"));
  EXPECT_THAT(init(write("plain.csv", "1,2\n3,4\n") + " --unit foot").output,
              HasSubstr("unit: found \"foot\", expected one of inch, m, mil, mm, um"));
  EXPECT_THAT(
      init(write("mixed.csv", "x_mm;y_mm\n1,5;2\n3.5;4\n")).output,
      HasSubstr("row 3, column 1: found '1,5' in row 2 and '3.5' in row 3, expected one decimal mark"));
  EXPECT_THAT(init(write("far.csv", "x_mm,y_mm\n1e308,0\n")).output,
              HasSubstr("row 2: x: found 1e+308 mm, expected at most 1000000 mm from the file's origin"));
  EXPECT_THAT(init(write("far.csv", "0,1e308\n") + " --unit m").output, HasSubstr("row 1: y: found inf mm"));
  write("job.toml", "mine");
  const Ran ran = init(write("small.csv", "x_mm,y_mm\n0,0\n"));
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("job.toml: is there already"));
}

}  // namespace
}  // namespace meltstage
