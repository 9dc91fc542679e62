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
  // The trial's part with its touches and its probe program; what `print` takes of it.
  std::string print_of_trial() const {
    EXPECT_EQ(run_command("conformal trial --out " + at("part")).status, 0);
    return print_of(at("part/lines.apt"), at("part/points.txt"));
  }
  std::string print_of(const std::string& path, const std::string& points,
                       const std::string& options = "") const {
    const Ran probe = run_command("conformal probe " + path + " --out " + at("probe.ngc") + options);
    EXPECT_EQ(probe.status, 0) << probe.output;
    return "print " + path + " " + points + " --probe " + at("probe.ngc");
  }
  // Touches of a part that lies so high over its model.
  void touch(const std::string& program, const std::string& points, double over_mm) const {
    std::istringstream rows(read(at(program)));
    std::ofstream touches(at(points));
    double start_z = 0.0;
    for (std::string line; std::getline(rows, line);) {
      double x = 0.0, y = 0.0, z = 0.0;
      if (std::sscanf(line.c_str(), "G0 X%lf Y%lf Z%lf", &x, &y, &z) == 3) start_z = z;
      if (std::sscanf(line.c_str(), "G38.2 X%lf Y%lf Z%lf", &x, &y, &z) == 3)
        touches << x << " " << y << " " << start_z - 2.0 + over_mm << " 0 0 0 0 0 0\n";  // from 2 mm off
    }
  }
  void expect_refused(const std::string& arguments, const std::string& part) const {
    const Ran ran = run_command("conformal " + arguments + " --out " + at("out.ngc"));
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, StartsWith("meltstage"));
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
  const Ran print = run_command(
      "conformal print " + path + " " + points + " --probe " + at("probe.ngc") + " --out " + at("print.ngc") +
      " --effective-radius 0.992 --height 0.08,0.1,0.11,0.08,0.1,0.11,0.08,0.1,0.11");
  ASSERT_EQ(print.status, 0) << print.output;
  EXPECT_THAT(print.output, HasSubstr("9 lines"));
  EXPECT_THAT(read(at("print.ngc")), HasSubstr("G93"));
  const Ran control = run_command(
      "conformal print " + path + " " + points + " --probe " + at("probe.ngc") + " --out " +
      at("control.ngc") + " --effective-radius 0.992 --rtcp control --tilt-axis b --station 30,0.5,-4");
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

// One touch of the trial's part on a chip, 0.15 mm too high: no program is written until it was measured
// again.
TEST_F(Conformal, AWrongTouchIsNamedAndNothingIsWritten) {
  const std::string print = print_of_trial() + " --effective-radius 0.992";
  std::istringstream rows(read(at("part/points.txt")));
  std::string wrong;
  std::size_t row = 0;
  for (std::string line; std::getline(rows, line);) {
    double x = 0.0, y = 0.0, z = 0.0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf %lf %lf", &x, &y, &z), 3);
    std::ostringstream out;
    out << x << " " << y << " " << z + (++row == 9 ? 0.15 : 0.0) << " 0 0 0 0 0 0\n";
    wrong += out.str();
  }
  std::ofstream(at("part/points.txt")) << wrong;
  const Ran ran = run_command("conformal " + print + " --out " + at("out.ngc"));
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output,
              ::testing::AllOf(HasSubstr(": touch 9 of "), HasSubstr("um off what its neighbours say"),
                               HasSubstr("out.ngc: not written; measure these touches again")));
  EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 2) << ran.output;
  EXPECT_FALSE(fs::exists(at("out.ngc")));
  const Ran stands = run_command("conformal " + print + " --measured-again --out " + at("out.ngc"));
  EXPECT_EQ(stands.status, 0) << stands.output;
  EXPECT_THAT(stands.output, HasSubstr("over the tolerance"));
  EXPECT_TRUE(fs::exists(at("out.ngc")));
}

// A part 100 mm above the table, and one turned by its axes: between lines the head stays above it.
TEST_F(Conformal, SafeZIsAboveThePart) {
  std::ofstream high(at("high.csv"));
  high << "x_mm,y_mm,z_mm\n";
  for (int x = 0; x <= 20; ++x) high << x << ",0,100\n";
  high.close();
  const std::string path = at("high.csv");
  expect_refused("probe " + path, "safe z: found 50 mm, expected at least 103.000 mm");
  const std::string print = print_of(path, at("high.txt"), " --safe-z 150");
  touch("probe.ngc", at("high.txt"), 0.0);
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
  const std::string print = print_of_trial(), path = at("part/lines.apt");
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
  expect_refused(print + " --safe-z 0x50", "--safe-z: found 0x50, expected a decimal number");
  expect_refused("probe " + path + " --capability nan", "--capability: found nan, expected a decimal number");
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

TEST_F(Conformal, NotesARampThroughTheAir) {
  std::ofstream(at("ramp.nc")) << "G21 G90\nG0 X0 Y0 Z10\nG1 X2 Z1 F9\nX10\nX12 Z10\nM2\n";
  const Ran ran = run_command("conformal probe " + at("ramp.nc") + " --out " + at("ramp.ngc"));
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("note: line 1: its first move (row 3) comes down 9 mm"));
  EXPECT_THAT(ran.output, HasSubstr("note: line 1: its last move (row 5) goes up 9 mm"));
}

TEST_F(Conformal, AnOptionStandsOnce) {
  const std::string print = "conformal print a b --probe c --out d ";
  EXPECT_THAT(run_command(print + "--tilt-centre 1,2,3 --tilt-centre 1,2,3").output,
              HasSubstr("--tilt-centre: found 6 values, expected 3; give the option once;"));
  EXPECT_THAT(run_command(print + "--feed 1 --feed 2").output,
              HasSubstr("--feed: found 2 values, expected 1; give the option once;"));
  EXPECT_THAT(run_command(print + "--tilt-centre 1,2").output,
              HasSubstr("--tilt-centre: found 2 values, expected 3;"));
}

TEST_F(Conformal, AWordThatIsNoChoiceIsToldWithTheChoices) {
  EXPECT_THAT(run_command("conformal print a b --probe c --out d --rtcp maybe").output,
              HasSubstr("--rtcp: found maybe, expected one of: control, post;"));
}

TEST_F(Conformal, AWallIsRefused) {
  for (const char* wall : {"X5 Y0 Z1\nX5 Y0 Z6", "X5 Y0 Z1\nX5.05 Y0 Z6", "X5 Y0 Z1\nX5 Y0 Z1.5"})
    for (const char* rule : {"spline", "chord", "even"}) {
      std::ofstream(at("wall.nc")) << "G21 G90\nG0 X0 Y0 Z9\nG1 Z1 F9\n" << wall << "\nX10\nG0 Z9\nM2\n";
      expect_refused("probe " + at("wall.nc") + " --rule " + rule, "faces sideways or down (axis z 0.0");
    }
}

TEST_F(Conformal, NoTouchIsDroppedWithoutAWord) {
  std::ofstream(at("line.csv")) << "x_mm,y_mm,z_mm\n0,0,0\n10,0,0\n";
  const auto print = [&](const std::string& points) { return print_of(at("line.csv"), at(points)); };
  const std::string rest = "0 0 1\n";
  std::ofstream(at("first.txt")) << "1.o 2 3\n" << rest;
  expect_refused(print("first.txt"), "row 1, column 1: found '1.o'");
  std::ofstream(at("comma.txt")) << "1x,2,3\n" << rest;
  expect_refused(print("comma.txt"), "row 1, column 1: found '1x'");
  // a row of names, and a byte order mark, are skipped
  for (const char* head : {"x y z\n", "\xEF\xBB\xBF", "\xEF\xBB\xBFX;Y;Z\n"}) {
    std::ofstream(at("head.txt")) << head << rest;
    expect_refused(print("head.txt"), "head.txt: row");
    expect_refused(print("head.txt"), ": found 1 points, expected");
  }
}

// Cut anywhere, none of the files that go from hand to hand is taken for a whole one.
TEST_F(Conformal, RefusesFilesThatAreCutOff) {
  const std::string print = print_of_trial();
  const std::string apt = read(at("part/lines.apt")), touches = read(at("part/points.txt"));
  std::ofstream(at("cut.apt")) << apt.substr(0, 100'000);
  expect_refused("probe " + at("cut.apt"), "cut.apt: row ");
  std::ofstream(at("rows.apt")) << apt.substr(0, apt.rfind('\n', 100'000) + 1);
  expect_refused("probe " + at("rows.apt"), "the file ends without FINI");
  const std::string rest = " --probe " + at("probe.ngc");
  for (const std::size_t missing : {1U, 17U, 22U}) {  // of "8.332000 0 0 0 0 0 0\n"
    std::ofstream(at("cut.txt")) << touches.substr(0, touches.size() - missing);
    expect_refused("print " + at("part/lines.apt") + " " + at("cut.txt") + rest, "cut.txt: row 205: ");
  }
  const std::string program = read(at("probe.ngc"));
  std::ofstream(at("cut.ngc")) << program.substr(0, program.size() / 2);
  expect_refused("print " + at("part/lines.apt") + " " + at("part/points.txt") + " --probe " + at("cut.ngc"),
                 "the file ends without M2");
}

TEST_F(Conformal, TakesTouchesOfTheProbeProgramsBallOnly) {
  std::ofstream(at("line.csv")) << "x_mm,y_mm,z_mm\n0,0,5\n10,0,5\n";
  const std::string print = print_of(at("line.csv"), at("points.txt"));
  touch("probe.ngc", at("points.txt"), 0.05);
  const std::string out = " --out " + at("print.ngc");
  EXPECT_EQ(run_command("conformal " + print + out).status, 0);
  expect_refused(
      print + " --ball-radius 2",
      "probe.ngc: row 3: found ball radius 1 mm, expected 2 mm (--ball-radius); give the options that the "
      "program was written with");
  expect_refused(print + " --approach 3", "point 1: found its touch to begin at");
  expect_refused(print + " --wavelength 20", "probe.ngc: ");
  const Ran without = run_command("conformal print " + at("line.csv") + " " + at("points.txt") + out);
  EXPECT_EQ(without.status, 2);
  EXPECT_THAT(without.output, HasSubstr("--probe is required"));
  // The pre-travel is no radius.
  for (const char* radius : {"9.92", "0.0992", "1.984", "0.79", "1.21"})
    expect_refused(print + " --effective-radius " + radius,
                   std::string("--effective-radius: found ") + radius + " mm, expected 0.8 to 1.2 mm");
  EXPECT_EQ(run_command("conformal " + print + " --effective-radius 0.81" + out).status, 0);
}

TEST_F(Conformal, AsksForTheUnitOfAPath) {
  std::ofstream(at("line.csv")) << "x,y,z\n0,0,0\n1,0,0\n";
  expect_refused("probe " + at("line.csv"), "expected names such as x_mm, or the unit by --unit");
  expect_refused("probe " + at("line.csv") + " --unit ell",
                 "--unit: found \"ell\", expected mm, um, cm, m, inch or mil");
  const Ran inches =
      run_command("conformal probe " + at("line.csv") + " --unit inch --out " + at("probe.ngc"));
  EXPECT_THAT(inches.output, HasSubstr("25.400 mm"));
  std::ofstream(at("said.csv")) << "x_mm,y_mm,z_mm\n0,0,0\n1,0,0\n";
  expect_refused("probe " + at("said.csv") + " --unit mm", "says its unit itself; leave out --unit");
}

// Where the tool stands upright all along, the tilt has its limits all the same, and at the program's end.
TEST_F(Conformal, KeepsTheTiltWithinItsLimits) {
  std::ofstream(at("line.csv")) << "x_mm,y_mm,z_mm\n0,0,5\n10,0,5\n";
  const std::string print = print_of(at("line.csv"), at("points.txt"));
  touch("probe.ngc", at("points.txt"), 0.0);
  expect_refused(print + " --tilt-limits 10,20",
                 "pose 1: needs a tilt of +0.000 degrees, expected 10..20 degrees");
  const Ran ran = run_command("conformal " + print + " --tilt-limits 0.2,20 --rotary-limits 30,60 --out " +
                              at("print.ngc"));
  EXPECT_EQ(ran.status, 0) << ran.output;
  std::istringstream rows(read(at("print.ngc")));
  int turns = 0;
  for (std::string row; std::getline(rows, row);)
    if (const auto tilt = row.find('A'), turn = row.find(" C"); row[0] == 'G' && turn != std::string::npos) {
      EXPECT_GE(std::stod(row.substr(tilt + 1)), 0.2) << row;
      EXPECT_GE(std::stod(row.substr(turn + 2)), 30.0) << row;
      ++turns;
    }
  EXPECT_GT(turns, 10);
}

TEST_F(Conformal, RefusesWrongInputInOneLine) {
  const std::string print = print_of_trial();
  const std::string path = at("part/lines.apt"), points = at("part/points.txt");
  const auto print_with = [&](const std::string& touches) {
    return "print " + path + " " + at(touches) + " --probe " + at("probe.ngc");
  };
  for (const std::string& out : {path, points, at("probe.ngc")}) {
    const Ran ran = run_command("conformal " + print + " --out " + out);
    EXPECT_EQ(ran.status, 2);
    EXPECT_THAT(ran.output, HasSubstr("would be written over the input"));
  }
  EXPECT_EQ(run_command("conformal probe " + path + " --out " + path).status, 2);
  expect_refused("probe " + at("none.apt"), "no such file");
  expect_refused("probe " + path + " --wavelength -1", "--wavelength: found -1, expected 0.01 to 10000");
  expect_refused("probe " + path + " --safe-z 1", "safe z: found 1 mm");
  expect_refused(print + " --rule chord", "give the options that the program was written with");
  expect_refused(print + " --height 0.1,0.2", "heights: found 2 for 9 lines");
  expect_refused(print + " --tilt-limits=-3,3", "needs a tilt of");
  expect_refused("probe " + path + " --ball-radius -1", "--ball-radius: found -1");
  expect_refused("probe " + path + " --approach 0", "--approach: found 0");
  expect_refused("probe " + path + " --rule chord --chord-error 0", "--chord-error: found 0");
  expect_refused("probe " + path + " --rule even --capability 1", "process capability: found 1");
  expect_refused("probe " + path + " --rule even --confidence 1", "confidence: found 1");
  expect_refused("probe " + path + " --station nan,0,0", "--station: found nan");
  expect_refused(print + " --effective-radius -1", "--effective-radius: found -1 mm");
  expect_refused(print + " --noise -1", "--noise: found -1");
  expect_refused(print + " --height 0", "--height: found 0");
  expect_refused(print + " --feed 0", "--feed: found 0");
  expect_refused(print + " --tilt-limits=3,-3", "tilt limits: found 3..-3");
  expect_refused(print + " --tilt-centre nan,0,0", "--tilt-centre: found nan");
  expect_refused(print + " --output 99", "pressure output: found 99");
  expect_refused(print + " --off-delay 1000", "takes to close");
  expect_refused(print_with("none.txt"), "no such file");
  std::ofstream(at("swapped.txt")) << [&] {
    std::istringstream rows(read(points));
    std::string first, second, rest;
    std::getline(rows, first), std::getline(rows, second), std::getline(rows, rest, '\0');
    return second + '\n' + first + '\n' + rest;
  }();
  expect_refused(print_with("swapped.txt"), "beside the way of its touch");
  std::ofstream(at("nan.txt")) << "nan 2 3\n";
  expect_refused(print_with("nan.txt"), "row 1, column 1: found 'nan'");
  std::ofstream(at("down.csv")) << "x_mm,y_mm,z_mm,i,j,k\n0,0,0,0,0,-1\n1,0,0,0,0,-1\n";
  expect_refused("probe " + at("down.csv"), "faces sideways or down");
  std::ofstream(at("point.csv")) << "x_mm,y_mm,z_mm\n0,0,0\n0,0,0\n";
  expect_refused("probe " + at("point.csv"), "point.csv: row 2: found a line of one point");
  std::ofstream(at("bad.csv")) << "x_mm,y_mm,z_mm\n0,0,0\n1,nan,0\n";
  expect_refused("probe " + at("bad.csv"), "found 'nan', expected a finite number");
  std::ofstream(at("short.txt")) << "1 2 3\n";
  expect_refused(print_with("short.txt"), "short.txt: row 1: point 1 is (1.0000, 2.0000, 3.0000)");
}

}  // namespace
}  // namespace meltstage
