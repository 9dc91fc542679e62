// SPDX-License-Identifier: Apache-2.0
// `meltstage conformal ...` as a machine builder meets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tests/support/rs274.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Conformal : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("meltstage_conformal_" + std::string(info->name()) + "." + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  static std::string read(const std::string& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void expect_refused(const std::string& arguments, const std::string& part) const {
    const Ran ran = run_command("conformal " + arguments + " --out " + at("out.ngc"));
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, StartsWith("meltstage: "));
    EXPECT_THAT(ran.output, HasSubstr(part));
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_FALSE(fs::exists(at("out.ngc")));
  }
  fs::path folder_;
};

TEST_F(Conformal, GoesFromToolPathToPrintProgram) {
  const Ran trial = run_command("conformal trial --out " + at("part"));
  ASSERT_EQ(trial.status, 0) << trial.output;
  const std::string path = at("part/lines.apt"), points = at("part/points.txt");
  const Ran probe = run_command("conformal probe " + path + " --out " + at("probe.ngc"));
  ASSERT_EQ(probe.status, 0) << probe.output;
  EXPECT_THAT(probe.output, HasSubstr("touches on 9 lines"));
  const std::string program = read(at("probe.ngc"));
  std::size_t touches = 0;
  for (auto i = program.find("G38.2"); i != std::string::npos; i = program.find("G38.2", i + 1)) ++touches;
  const std::string written = read(points);
  EXPECT_EQ(touches, static_cast<std::size_t>(std::count(written.begin(), written.end(), '\n')));
  const Ran print =
      run_command("conformal print " + path + " " + points + " --out " + at("print.ngc") +
                  " --effective-radius 0.992 --height 0.08,0.1,0.11,0.08,0.1,0.11,0.08,0.1,0.11");
  ASSERT_EQ(print.status, 0) << print.output;
  EXPECT_THAT(print.output, HasSubstr("9 lines"));
  EXPECT_THAT(read(at("print.ngc")), HasSubstr("G93"));
  const Ran control =
      run_command("conformal print " + path + " " + points + " --out " + at("control.ngc") +
                  " --effective-radius 0.992 --rtcp control --tilt-axis b --station 30,0.5,-4");
  ASSERT_EQ(control.status, 0) << control.output;
  // LinuxCNC's interpreter takes all three.
  EXPECT_EQ(motion::interpret(program).error, "");
  EXPECT_EQ(motion::interpret(program).count("STRAIGHT_PROBE"), touches);
  for (const char* name : {"print.ngc", "control.ngc"}) {
    const motion::Interpreted run = motion::interpret(read(at(name)));
    EXPECT_EQ(run.error, "") << name;
    EXPECT_GT(run.count("STRAIGHT_FEED"), 9U * 300U) << name;
  }
}

// A part 100 mm above the table, and one turned by its axes: between lines the head stays above it.
TEST_F(Conformal, SafeZIsAboveThePart) {
  std::ofstream high(at("high.csv")), touches(at("high.txt"));
  high << "x,y,z\n";
  for (int x = 0; x <= 20; ++x) high << x << ",0,100\n";
  high.close();
  const std::string path = at("high.csv"), points = at("high.txt");
  ASSERT_EQ(run_command("conformal probe " + path + " --safe-z 150 --out " + at("probe.ngc")).status, 0);
  std::istringstream program(read(at("probe.ngc")));
  for (std::string line; std::getline(program, line);)
    if (double x = 0.0, y = 0.0, z = 0.0; std::sscanf(line.c_str(), "G38.2 X%lf Y%lf Z%lf", &x, &y, &z) == 3)
      touches << x << " " << y << " 101\n";  // the ball's centre on the surface
  touches.close();
  expect_refused("probe " + path, "safe z: found 50 mm, expected at least 103.000 mm");
  const std::string print = "print " + path + " " + points;
  for (const char* rtcp : {"post", "control"}) {
    const std::string with = print + " --rtcp " + rtcp;
    // The tip is 0.1 mm over the surface, and 5 mm higher where a line begins and ends.
    expect_refused(with, "safe z: found 80 mm, expected at least 105.100 mm");
    expect_refused(with + " --safe-z 103", "safe z: found 103 mm, expected at least 105.100 mm");
    expect_refused(with + " --safe-z 80 --height 1 --retract 20", "expected at least 121.000 mm");
    const Ran ran = run_command("conformal " + with + " --safe-z 105.2 --out " + at("print.ngc"));
    EXPECT_EQ(ran.status, 0) << ran.output;
  }
}

TEST_F(Conformal, ATrialReplacesNoFiles) {
  fs::create_directory(at("part"));
  for (const std::string name : {"part/points.txt", "part/lines.apt"}) {
    std::ofstream(at(name)) << "mine";
    const Ran ran = run_command("conformal trial --out " + at("part"));
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr(name + ": is there already"));
    EXPECT_EQ(read(at(name)), "mine");
    EXPECT_EQ(std::distance(fs::directory_iterator(at("part")), fs::directory_iterator()), 1);
    fs::remove(at(name));
  }
  EXPECT_EQ(run_command("conformal trial --out " + at("part")).status, 0);
}

TEST_F(Conformal, OptionsHaveRanges) {
  ASSERT_EQ(run_command("conformal trial --out " + at("part")).status, 0);
  const std::string path = at("part/lines.apt"), points = at("part/points.txt");
  const std::string print = "print " + path + " " + points;
  for (const char* value : {"nan", "inf", "-1", "90", "1e300"})
    expect_refused(print + " --singular " + value, "--singular: ");
  for (const char* value : {"nan", "1e9", "1e300"})
    expect_refused(print + " --height " + value, "--height: ");
  for (const char* value : {"1e300,0,0", "0,0,nan", "0,-1e9,0"}) {
    expect_refused(print + " --station=" + value, "--station: ");
    expect_refused("probe " + path + " --station=" + value, "--station: ");
    expect_refused(print + " --tilt-centre=" + value, "--tilt-centre: ");
  }
  expect_refused(print + " --safe-z 1e300", "--safe-z: ");
  expect_refused("probe " + path + " --safe-z inf", "--safe-z: ");
  expect_refused("probe " + path + " --points-file ''", "--points-file: ");
  for (const char* value : {"-1", "1e3", "99999999999999999999"}) {
    const Ran starts = run_command("conformal calibrate --starts " + std::string(value));
    EXPECT_EQ(starts.status, 2);
    EXPECT_THAT(starts.output,
                HasSubstr("--starts: found " + std::string(value) + ", expected a whole number"));
    EXPECT_EQ(run_command("conformal trial --out " + at("seeded") + " --seed " + value).status, 2);
    EXPECT_FALSE(fs::exists(at("seeded")));
  }
  expect_refused("probe " + path + " --points-file 'a)(b'", "--points-file: ");
}

TEST_F(Conformal, NoTouchIsDroppedWithoutAWord) {
  std::ofstream(at("line.csv")) << "x,y,z\n0,0,0\n10,0,0\n";
  const std::string rest = "0 0 1\n";
  std::ofstream(at("first.txt")) << "1.o 2 3\n" << rest;
  expect_refused("print " + at("line.csv") + " " + at("first.txt"), "row 1, column 1: found '1.o'");
  std::ofstream(at("comma.txt")) << "1x,2,3\n" << rest;
  expect_refused("print " + at("line.csv") + " " + at("comma.txt"), "row 1, column 1: found '1x'");
  // a row of names, and a byte order mark, are skipped
  for (const char* head : {"x y z\n", "\xEF\xBB\xBF", "\xEF\xBB\xBFX;Y;Z\n"}) {
    std::ofstream(at("head.txt")) << head << rest;
    expect_refused("print " + at("line.csv") + " " + at("head.txt"), "point cloud: found 1 points");
  }
}

TEST_F(Conformal, RefusesWrongInputInOneLine) {
  ASSERT_EQ(run_command("conformal trial --out " + at("part")).status, 0);
  const std::string path = at("part/lines.apt"), points = at("part/points.txt");
  for (const std::string& out : {path, points}) {
    const Ran ran = run_command("conformal print " + path + " " + points + " --out " + out);
    EXPECT_EQ(ran.status, 2);
    EXPECT_THAT(ran.output, HasSubstr("would be written over the input"));
  }
  EXPECT_EQ(run_command("conformal probe " + path + " --out " + path).status, 2);
  expect_refused("probe " + at("none.apt"), "no such file");
  expect_refused("probe " + path + " --wavelength -1", "--wavelength: found -1, expected 0.01 to 10000");
  expect_refused("probe " + path + " --safe-z 1", "safe z: found 1 mm");
  expect_refused("print " + path + " " + points + " --rule chord", "point cloud: found");
  expect_refused("print " + path + " " + points + " --height 0.1,0.2", "heights: found 2 for 9 lines");
  expect_refused("print " + path + " " + points + " --tilt-limits=-3,3", "needs a tilt of");
  expect_refused("probe " + path + " --ball-radius -1", "--ball-radius: found -1");
  expect_refused("probe " + path + " --approach 0", "--approach: found 0");
  expect_refused("probe " + path + " --rule chord --chord-error 0", "--chord-error: found 0");
  expect_refused("probe " + path + " --rule even --capability 1", "process capability: found 1");
  expect_refused("probe " + path + " --rule even --confidence 1", "confidence: found 1");
  expect_refused("probe " + path + " --station nan,0,0", "--station: found nan");
  expect_refused("print " + path + " " + points + " --effective-radius -1", "--effective-radius: found -1");
  expect_refused("print " + path + " " + points + " --noise -1", "--noise: found -1");
  expect_refused("print " + path + " " + points + " --height 0", "--height: found 0");
  expect_refused("print " + path + " " + points + " --feed 0", "--feed: found 0");
  expect_refused("print " + path + " " + points + " --tilt-limits=3,-3", "tilt limits: found 3..-3");
  expect_refused("print " + path + " " + points + " --tilt-centre nan,0,0", "--tilt-centre: found nan");
  expect_refused("print " + path + " " + points + " --output 99", "pressure output: found 99");
  expect_refused("print " + path + " " + points + " --off-delay 1000", "takes to close");
  expect_refused("print " + path + " " + at("none.txt"), "no such file");
  std::ofstream(at("swapped.txt")) << [&] {
    std::istringstream rows(read(points));
    std::string first, second, rest;
    std::getline(rows, first), std::getline(rows, second), std::getline(rows, rest, '\0');
    return second + '\n' + first + '\n' + rest;
  }();
  expect_refused("print " + path + " " + at("swapped.txt"), "beside the way of its touch");
  std::ofstream(at("nan.txt")) << "nan 2 3\n";
  expect_refused("print " + path + " " + at("nan.txt"), "row 1, column 1: found 'nan'");
  std::ofstream(at("down.csv")) << "x,y,z,i,j,k\n0,0,0,0,0,-1\n1,0,0,0,0,-1\n";
  expect_refused("probe " + at("down.csv"), "faces sideways or down");
  std::ofstream(at("point.csv")) << "x,y,z\n0,0,0\n0,0,0\n";
  expect_refused("probe " + at("point.csv"), "found no line");
  std::ofstream(at("bad.csv")) << "x,y,z\n0,0,0\n1,nan,0\n";
  expect_refused("probe " + at("bad.csv"), "found 'nan', expected a finite number");
  std::ofstream(at("short.txt")) << "1 2 3\n";
  expect_refused("print " + path + " " + at("short.txt"), "point cloud: found 1 points");
}

}  // namespace
}  // namespace meltstage
