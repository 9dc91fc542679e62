// SPDX-License-Identifier: Apache-2.0
// Long commands tell their share and the time left on a terminal, and nothing in a pipe.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "base/terminal.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kFirst = MELTSTAGE_SOURCE_DIR "/examples/first.toml";

TEST(DescribeShare, TellsPercentAndTimeLeft) {
  EXPECT_EQ(describe_share(0.25, 10.0), "25 %, 30 s left");
  EXPECT_EQ(describe_share(0.999, 10.0), "99 %, 1 s left");
  EXPECT_EQ(describe_share(1.0, 10.0), "100 %, 0 s left");
  EXPECT_EQ(describe_share(0.01, 10.0), "1 %, 17 min left");
  EXPECT_EQ(describe_share(0.5, 0.1), "50 %");              // too early to tell
  EXPECT_EQ(describe_share(0.0, 10.0), "0 %");              // nothing to tell from
  EXPECT_EQ(describe_share(-0.1, 10.0), "0 %");             // a head that cools first
  EXPECT_EQ(describe_share(1.2, 10.0), "100 %, 0 s left");  // or overshoots
}

class ProgressOfCommands : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("meltstage_progress." + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string in_folder(const std::string& name) const { return (folder_ / name).string(); }

  // A job whose path takes the planner a second or two.
  std::string job_of_many_bumps() const {
    std::mt19937 random(1);
    std::ofstream bumps(folder_ / "bumps.csv");
    bumps << "x_mm,y_mm\n";
    for (int i = 0; i < 2000; ++i)
      bumps << 0.001 * static_cast<double>(random() % 190'000) << ","
            << 0.001 * static_cast<double>(random() % 190'000) << "\n";
    std::ofstream(folder_ / "job.toml") << "[coordinates]\nfile = \"bumps.csv\"\n";
    return in_folder("job.toml");
  }

  fs::path folder_;
};

TEST_F(ProgressOfCommands, GcodeTellsItOfThePath) {
  const std::string command = "gcode " + job_of_many_bumps() + " --out " + in_folder("job.ngc");
  const Ran seen = run_in_terminal(command);
  EXPECT_EQ(seen.status, 0) << seen.output;
  EXPECT_THAT(seen.output, ContainsRegex("planning the path  [0-9]+ %, [0-9]+ s left"));
  const Ran piped = run_command(command);
  EXPECT_THAT(piped.output, ::testing::StartsWith(in_folder("job.ngc") + ": 2000 droplets; path of "));
  EXPECT_EQ(std::count(piped.output.begin(), piped.output.end(), '\n'), 1);
}

TEST_F(ProgressOfCommands, PrintAndWindowTellIt) {
  const Ran print = run_in_terminal("print " + kFirst + " --rtl none --out " + in_folder("out"));
  EXPECT_EQ(print.status, 0) << print.output;
  EXPECT_THAT(print.output, ContainsRegex("heat-up  [0-9]+ %.*degC of"));

  const std::string work = in_folder("work");
  EXPECT_EQ(
      run_command("windows plan " + in_folder("out/pins.mvec") + " " + work + " --borders 400000,1400000")
          .status,
      0);
  const Ran window = run_in_terminal("window " + work + " 1");
  EXPECT_EQ(window.status, 0) << window.output;
  EXPECT_THAT(window.output, ContainsRegex("window 1 in RTL  [0-9]+ %, [0-9]+ s left"));
  EXPECT_THAT(run_command("window " + work + " 0").output, Not(HasSubstr("in RTL")));
}

// Before the first of them is done.
TEST_F(ProgressOfCommands, WindowsTellIt) {
  ASSERT_EQ(run_command("print " + kFirst + " --rtl none --out " + in_folder("out")).status, 0);
  const std::string work = in_folder("work");
  ASSERT_EQ(
      run_command("windows plan " + in_folder("out/pins.mvec") + " " + work + " --borders 100000000").status,
      0);
  // Both are long: they are left when they have told enough.
  const Ran seen = run_in_terminal("windows run " + work + " -j 2 & sleep 8; kill -INT $!; wait $!");
  EXPECT_THAT(seen.output, ContainsRegex("2 windows in RTL  [0-9]+ %, [0-9]+ (s|min) left  0 done"));
}

TEST_F(ProgressOfCommands, BoardAlignmentTellsIt) {
  std::ofstream marks(folder_ / "marks.csv");
  marks << "x_mm,y_mm\n";
  for (int i = 0; i < 100; ++i) marks << 10 + 3 * (i % 10) << "," << 10 + 3 * (i / 10) << "\n";
  marks.close();
  std::ofstream(folder_ / "bumps.csv") << "x_mm,y_mm\n10,10\n";
  std::ofstream(folder_ / "job.toml")
      << "[coordinates]\nfile = \"bumps.csv\"\n[head]\nplant = \"E3D-like\"\n"
         "[temperature]\nsetpoint_degc = 28\n[alignment]\nmarks = \"marks.csv\"\n";
  const std::string command = "print " + in_folder("job.toml") + " --rtl none --out " + in_folder("out");
  EXPECT_THAT(run_in_terminal(command).output, ContainsRegex("looking at the board, look 1  [0-9]+ %"));
  EXPECT_THAT(run_command(command).output, Not(HasSubstr("looking at")));
}

TEST_F(ProgressOfCommands, CalibrationTellsIt) {
  const Ran seen = run_in_terminal("conformal calibrate & sleep 4; kill $!; wait $!");
  EXPECT_THAT(seen.output, ContainsRegex("fit from the best  [0-9]+ %"));
}

TEST_F(ProgressOfCommands, BenchesTellIt) {
  const Ran seen = run_in_terminal("bench prp --quick");
  EXPECT_THAT(seen.output, ContainsRegex("10 stages, sliders 0.5 um  [0-9]+ %"));
  EXPECT_THAT(run_command("bench prp --quick").output, Not(HasSubstr("10 stages, sliders")));
}

}  // namespace
}  // namespace meltstage
