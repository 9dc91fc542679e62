// SPDX-License-Identifier: Apache-2.0
#include "motion/stage/gcode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <regex>
#include <sstream>
#include <string>

#include "tests/support/error_of.hpp"
#include "tests/support/rs274.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::vector<Point> kBumps = {{1.5, 2.25, 1}, {1.5, 3.0, 2}, {-0.00004, 3.0, 3}, {12.34567, 0.8, 4}};
const Eigen::Vector2d kStart(5.0, 6.0);

GcodeOptions options_of(GcodeDialect dialect) {
  return {.dialect = dialect, .x = {-1.0, 200.0}, .y = {-1.0, 200.0}};
}

/// What LinuxCNC's interpreter would have its machine do: lines of its canonical commands, and its exit
/// status.
struct Commands {
  bool good = false;
  std::vector<std::string> commands;
};

Commands commands_of(const std::string& program) {
  const auto [status, text] = run_rs274(program);
  Commands result{status == 0, {}};
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t at = line.find_first_of("ABCDEFGHIJKLMOPQRSTUVWXYZ", line.find("N.....") + 6);
    if (line.find("N.....") != std::string::npos && at != std::string::npos)
      result.commands.push_back(line.substr(at));
  }
  return result;
}

/// Positions at which the droplet's output rises.
std::vector<Eigen::Vector2d> droplets_of(const Commands& run) {
  std::vector<Eigen::Vector2d> droplets;
  Eigen::Vector2d at(NAN, NAN);
  for (const std::string& command : run.commands) {
    double x = 0.0, y = 0.0;
    if (std::sscanf(command.c_str(), "STRAIGHT_TRAVERSE(%lf, %lf", &x, &y) == 2) at = {x, y};
    if (command == "SET_AUX_OUTPUT_BIT(0)") droplets.push_back(at);
  }
  return droplets;
}

TEST(Gcode, FiresAtEveryBumpInLinuxCncsInterpreter) {
  const Commands run = commands_of(write_gcode(kBumps, kStart, "a job", options_of(GcodeDialect::linuxcnc)));
  ASSERT_TRUE(run.good);
  const auto droplets = droplets_of(run);
  ASSERT_EQ(droplets.size(), kBumps.size());
  for (std::size_t i = 0; i < kBumps.size(); ++i)
    EXPECT_LT((droplets[i] - Eigen::Vector2d(kBumps[i].x_mm, kBumps[i].y_mm)).lpNorm<Eigen::Infinity>(),
              0.51e-4);
  EXPECT_THAT(run.commands, ::testing::Contains("SET_MOTION_CONTROL_MODE(CANON_EXACT_STOP)"));
  EXPECT_THAT(run.commands, ::testing::Contains("DWELL(0.0150)").Times(4));
  EXPECT_THAT(run.commands, ::testing::Contains("DWELL(0.0010)").Times(4));
  EXPECT_THAT(run.commands, ::testing::Contains("CLEAR_AUX_OUTPUT_BIT(0)").Times(5));  // the first before all
  EXPECT_THAT(
      run.commands,
      ::testing::Contains("STRAIGHT_TRAVERSE(5.0000, 6.0000, 0.0000, 0.0000, 0.0000, 0.0000)").Times(2));
}

TEST(Gcode, IsWhatTheInterpreterSeesNotWhatWeMeant) {
  std::string program = write_gcode(kBumps, kStart, "a job", options_of(GcodeDialect::linuxcnc));
  const std::string moved = std::regex_replace(program, std::regex("X12\\.3457"), "X12.4457");
  ASSERT_NE(moved, program);
  EXPECT_NEAR(droplets_of(commands_of(moved)).back().x(), 12.4457, 1e-4);
  const std::string broken = std::regex_replace(program, std::regex("M64 P0"), "M64 P0 X1 X2");
  const Commands run = commands_of(broken);
  EXPECT_LT(droplets_of(run).size(), kBumps.size());
}

TEST(Gcode, CannotBreakOutOfItsComment) {
  const std::string program =
      write_gcode(kBumps, kStart, "x) G0 X100\nM64 P3 (", options_of(GcodeDialect::linuxcnc));
  EXPECT_THAT(program, StartsWith("(name: x_ G0 X100_M64 P3 _)\n"));
  EXPECT_EQ(droplets_of(commands_of(program)).size(), kBumps.size());
}

// A line of grbl holds 79 characters.
TEST(Gcode, LongNotesGoOnInTheNextLine) {
  GcodeOptions options = options_of(GcodeDialect::grbl);
  const std::string note =
      "board.csv: 3 rows of the bottom side are left out, which has 120 of them in all, and 2 fiducials";
  options.notes = {note, std::string(200, 'x')};
  const std::string program = write_gcode(kBumps, kStart, std::string(100, 'n'), options);
  std::istringstream lines(program);
  std::string read;
  std::size_t longest = 0;
  for (std::string line; std::getline(lines, line);) {
    longest = std::max(longest, line.size());
    if (line.starts_with("(note: ") && !line.starts_with("(note: x"))
      read += (read.empty() ? "" : " ") + line.substr(7, line.size() - 8);
  }
  EXPECT_LE(longest, 79u);
  EXPECT_EQ(read, note);
  EXPECT_EQ(std::count(program.begin(), program.end(), 'x'), 200);
}

TEST(Gcode, WaitsForTheTemperatureAndEndsWithoutIt) {
  const std::string program = write_gcode(kBumps, kStart, "a job", options_of(GcodeDialect::linuxcnc));
  EXPECT_LT(program.find("M66 P0 L3 Q600.000"), program.find("G0"));
  // -1 in #5399 is LinuxCNC's "the input never came"
  const std::string tested = std::regex_replace(program, std::regex("#5399"), "-1");
  const Commands run = commands_of(tested);
  EXPECT_TRUE(run.good);
  EXPECT_TRUE(droplets_of(run).empty());
}

// The words that grbl 1.1 knows (its wiki, "G-code commands supported"), and its line length.
TEST(Gcode, KeepsToGrblsWords) {
  const std::string program =
      write_gcode(kBumps, kStart, std::string(500, 'n'), options_of(GcodeDialect::grbl));
  const std::regex line_form(
      R"(\([^()]*\)|(G(0|4|17|21|54|61|90|94)|M(0|2|8|9))( G(17|90|94))*( [XYP]-?[0-9]+\.[0-9]{4})*)");
  std::istringstream lines(program);
  std::size_t droplets = 0;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_TRUE(std::regex_match(line, line_form)) << line;
    EXPECT_LT(line.size(), 80u);
    droplets += line == "M8" ? 1 : 0;
  }
  EXPECT_EQ(droplets, kBumps.size());
  EXPECT_LT(program.find("\nM0\n"), program.find("\nG0 "));
  EXPECT_FALSE(std::regex_match("M64 P0", line_form));
}

// The same words mean the same in LinuxCNC, whose interpreter grbl's follows; M8 is its flood too.
TEST(Gcode, OfGrblVisitsTheSameBumps) {
  std::string program = write_gcode(kBumps, kStart, "a job", options_of(GcodeDialect::grbl));
  program = std::regex_replace(program, std::regex("M8\n"), "M64 P0\n");
  const auto droplets = droplets_of(commands_of(program));
  ASSERT_EQ(droplets.size(), kBumps.size());
  EXPECT_NEAR(droplets.back().x(), 12.3457, 1e-9);
}

TEST(Gcode, RefusesWhatAMachineCannotDo) {
  const auto message = [](const std::function<void(GcodeOptions&)>& change,
                          std::vector<Point> bumps = kBumps) {
    GcodeOptions options = options_of(GcodeDialect::linuxcnc);
    change(options);
    return error_of([&] { write_gcode(bumps, kStart, "", options); });
  };
  EXPECT_EQ(message([](GcodeOptions&) {}, {}), "G-code: found no bumps, expected at least 1");
  EXPECT_THAT(message([](GcodeOptions& o) { o.x.max_mm = 12.0; }),
              StartsWith("G-code: found the bump of row 4 at (12.34567, 0.8) mm, expected x -1..12 mm"));
  EXPECT_THAT(message([](GcodeOptions& o) { o.y.max_mm = 5.0; }), HasSubstr("found the start at (5, 6) mm"));
  EXPECT_THAT(message([](GcodeOptions&) {}, {{NAN, 0.0, 7}}), HasSubstr("row 7 at (nan, 0)"));
  EXPECT_THAT(message([](GcodeOptions& o) { o.settle_s = -1.0; }), HasSubstr("settle time -1 s"));
  EXPECT_EQ(message([](GcodeOptions& o) { o.settle_s = 2e-5; }),
            "G-code: settle time: found 2e-05 s, expected 0 s, or 0.0001 s at least");
  EXPECT_EQ(message([](GcodeOptions& o) { o.settle_s = 0.0; }), "");
  EXPECT_THAT(message([](GcodeOptions& o) { o.pulse_s = 0.0; }), HasSubstr("droplet pulse: found 0 s"));
  EXPECT_THAT(message([](GcodeOptions& o) { o.pulse_s = 1e-9; }), HasSubstr("droplet pulse: found 1e-09 s"));
  EXPECT_THAT(message([](GcodeOptions& o) { o.heat_timeout_s = INFINITY; }),
              HasSubstr("heat timeout: found inf s"));
  EXPECT_THAT(message([](GcodeOptions& o) { o.heat_timeout_s = 4e-4; }),
              HasSubstr("heat timeout: found 0.0004 s, expected 0.001 s at least"));
}

TEST(Gcode, WritesLinuxCncsCompensationFile) {
  const CompensationTable table{{0.0, 10.0}, {0.0, 0.01}, {0.02, -0.03}};
  EXPECT_EQ(write_linuxcnc_compensation(table), "0.000000 0.000000 0.020000\n10.000000 10.010000 9.970000\n");
  EXPECT_THAT(error_of([] { write_linuxcnc_compensation({}); }),
              HasSubstr("found 0 positions, expected 1..256"));
}

TEST(Gcode, WritesGrblsSettings) {
  const ScurveLimits limits = asymmetric_limits(100, 1000, 800, 5e4, 5e4);
  const std::string text = write_grbl_settings({1000, 2000, 2000}, {limits, limits, limits});
  EXPECT_THAT(text, StartsWith("$100=1000.000\n$110=6000.000\n$120=800.000\n$101=2000.000\n"));
}

// grbl takes !, ~ and ? out of the stream wherever they stand.
TEST(Gcode, CommentsHoldNoCommandsOfTheControl) {
  const std::vector<Point> bumps{{1.0, 2.0}};
  for (const GcodeDialect dialect : {GcodeDialect::linuxcnc, GcodeDialect::grbl}) {
    GcodeOptions options;
    options.dialect = dialect;
    options.notes = {"hot! really? ~5 um (or so)"};
    const std::string program = write_gcode(bumps, {0.0, 0.0}, "rev2!", options);
    EXPECT_THAT(program, testing::HasSubstr("(name: rev2_)"));
    EXPECT_THAT(program, testing::HasSubstr("(note: hot_ really_ _5 um _or so_)"));
  }
}

TEST(Gcode, SettingsOfGrblThatWouldBeZeroAreRefused) {
  const ScurveLimits usual, slow = asymmetric_limits(1e-6, 1e-5, 1e-5, 1.0, 1.0);
  EXPECT_THAT(
      [&] {
        write_grbl_settings({1e-4, 100.0, 100.0}, {usual, usual, usual});
      },
      testing::ThrowsMessage<MotionError>(
          testing::HasSubstr("setting $100 of grbl: found 0.0001, expected at least 0.001")));
  EXPECT_THAT(
      [&] {
        write_grbl_settings({100.0, 100.0, 100.0}, {usual, slow, usual});
      },
      testing::ThrowsMessage<MotionError>(testing::HasSubstr("setting $111 of grbl")));
}

}  // namespace
}  // namespace meltstage::motion
