// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/cl_points.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;

std::string error_of(const std::string& name, const std::string& content) {
  try {
    read_tool_path_text(name, content);
  } catch (const CoordinateError& error) {
    return error.what();
  }
  return "";
}

constexpr const char* kApt = R"(PARTNO/COIL ON A DOME
$$ written by a post
UNITS/MM
TOOL PATH/TOP,TOOL,NOZZLE
LOADTL/1
FEDRAT/300.0,MMPM
RAPID
GOTO/0,0,20,0,0,1
GOTO/0.0,0.0,5.0
GOTO/1.0,0.0,5.1, $
0.1,0.0,2.0
GOTO/2,0,5.3
GODLTA/1,0,0.1
GOTO/3.000,0,25
RAPID
GOTO/0,4,25
GOTO/0,4,5
GOTO/1,4,5
FINI
)";

TEST(AptReader, TakesLinesWithoutLoweringAndLifting) {
  const auto lines = read_tool_path_text("a.cls", kApt);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].name, "TOP");
  EXPECT_EQ(lines[1].name, "TOP 2");
  ASSERT_EQ(lines[0].points.size(), 4U);
  EXPECT_EQ(lines[0].points[0].position_mm, Eigen::Vector3d(0, 0, 5));
  EXPECT_EQ(lines[0].points[0].axis, Eigen::Vector3d(0, 0, 1));
  EXPECT_NEAR(lines[0].points[1].axis.x(), 0.1 / std::hypot(0.1, 2.0), 1e-15);
  EXPECT_EQ(lines[0].points[3].position_mm, Eigen::Vector3d(3, 0, 5.3 + 0.1));
  EXPECT_EQ(lines[0].points[1].row, 10U);
  ASSERT_EQ(lines[1].points.size(), 2U);
}

TEST(AptReader, ReadsInches) {
  const auto lines = read_tool_path_text("a.apt", "UNITS/INCH\nGOTO/0,0,0\nGOTO/1,0,0\n");
  EXPECT_NEAR(lines[0].points[1].position_mm.x(), 25.4, 1e-12);
}

TEST(AptReader, RefusesWhatItCannotFollow) {
  EXPECT_EQ(
      error_of("a.apt", "GOTO/0,0,0\nCIRCLE/0,0,0,0,0,1,5\n"),
      "a.apt: row 2: found 'CIRCLE', expected GOTO or a statement without motion; write the path as linear "
      "moves");
  EXPECT_EQ(error_of("a.apt", "GOTO/0,0,zero\n"),
            "a.apt: row 1: found 'zero', expected a finite number such as 12.5");
  EXPECT_THAT(error_of("a.apt", "GOTO/0,0,nan\n"), HasSubstr("found 'nan', expected a finite number"));
  EXPECT_THAT(error_of("a.apt", "GOTO/0,0\n"), HasSubstr("found 2 numbers after GOTO/, expected 3 or 6"));
  EXPECT_THAT(error_of("a.apt", "GOTO/0,0,0,0,0,0\n"), HasSubstr("found tool axis (0, 0, 0)"));
  EXPECT_THAT(error_of("a.apt", "GOTO/0,0,$\n"), HasSubstr("ends in a statement that goes on"));
  EXPECT_THAT(error_of("a.apt", "GODLTA/0,0,1\n"), HasSubstr("before any GOTO"));
  EXPECT_THAT(error_of("a.apt", "UNITS/CUBITS\n"), HasSubstr("expected MM or INCH"));
  EXPECT_THAT(error_of("a.apt", "GOTO/0,0,0\n"), HasSubstr("found no line"));
}

TEST(GcodeReader, TakesWhatIsMovedBetweenRapids) {
  const auto lines = read_tool_path_text("a.ngc", R"(%
(a coil) G21 G90 G54 F300
G0 X0 Y0 Z20
G1 Z5
X1 Z5.1 ; along
N30 X2 Z5.3
G91 X1
G90 G1 Z20
G0 X0 Y4
G1 Z5
G1 X1
G0 Z20
M2
%
)");
  ASSERT_EQ(lines.size(), 2U);
  ASSERT_EQ(lines[0].points.size(), 4U);
  EXPECT_EQ(lines[0].points[0].position_mm, Eigen::Vector3d(0, 0, 5));
  EXPECT_EQ(lines[0].points[3].position_mm, Eigen::Vector3d(3, 0, 5.3));
  ASSERT_EQ(lines[1].points.size(), 2U);
  // Without tool axes they are square to the line.
  EXPECT_NEAR(lines[0].points[0].axis.dot(Eigen::Vector3d(1, 0, 0.1).normalized()), 0.0, 1e-12);
  EXPECT_GT(lines[0].points[0].axis.z(), 0.9);
}

TEST(GcodeReader, TakesWhatIsMovedUnderPressure) {
  const auto lines = read_tool_path_text(
      "a.ngc", "G21 G0 X0 Y0 Z5\nM64 P0\nG1 X1\nX2\nM65 P0\nX3\nM62 P0\nX4\nX5\nM63 P0\n");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].points.size(), 3U);
  EXPECT_EQ(lines[1].points.size(), 3U);
  EXPECT_EQ(lines[1].points[0].position_mm.x(), 3.0);
}

TEST(GcodeReader, RefusesWhatItCannotFollow) {
  EXPECT_EQ(error_of("a.ngc", "G21 G1 X0 Y0 Z0\nG2 X1 I1\n"),
            "a.ngc: row 2: found G2, expected G0 or G1; write the path as linear moves");
  EXPECT_THAT(error_of("a.ngc", "G1 X0 A10\n"),
              HasSubstr("found A10, expected a path in the workpiece's frame"));
  EXPECT_THAT(error_of("a.ngc", "G1 X#1\n"), HasSubstr("found ''"));
  // Inches or millimetres, and how high: nothing to be guessed.
  EXPECT_EQ(error_of("a.ngc", "G90\nG1 X0 Y0 Z0\nX1\n"),
            "a.ngc: row 2: found a move before G20 or G21, expected one of them first: inches or mm");
  EXPECT_EQ(error_of("a.ngc", "G21\nG0 X0 Y0\nG1 X1\n"),
            "a.ngc: row 3: found a line that begins before any Z, expected X, Y and Z of its beginning, such "
            "as Z5");
  EXPECT_THAT(error_of("a.ngc", "G21 G0 Z5 X1\nM64 P0\nG1 X1\nM65 P0\n"), HasSubstr("before any Y"));
  EXPECT_THAT(error_of("a.ngc", "G1 X1 (open\n"), HasSubstr("comment without its end"));
  EXPECT_THAT(error_of("a.ngc", "#1=2\n"), HasSubstr("parameters and expressions aren't read"));
}

TEST(CsvReader, TakesNamedColumnsAndLines) {
  const auto lines = read_tool_path_text(
      "a.csv",
      "line,X_mm,y,z,i,j,k\na,0,0,1,0,0,1\na,1,0,1,0,1,1\nb,0,2,1,0,0,1\nb,1,2,1,0,0,1\nb,1,2,1,0,0,1\n");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].name, "a");
  EXPECT_NEAR(lines[0].points[1].axis.y(), std::sqrt(0.5), 1e-12);
  EXPECT_EQ(lines[1].points.size(), 2U);  // the repeated point is one
}

TEST(CsvReader, AnEmptyRowEndsALine) {
  const auto lines = read_tool_path_text("a.csv", "0,0,1\n1,0,1\n\n0,2,1\n1,2,1\n");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[1].name, "line 2");
}

TEST(CsvReader, RefusesWhatItCannotUse) {
  EXPECT_THAT(error_of("a.csv", "x,y\n1,2\n"), HasSubstr("expected all three"));
  EXPECT_THAT(error_of("a.csv", "x,y,z,i\n1,2,3,4\n"), HasSubstr("some of the columns i, j and k"));
  EXPECT_THAT(error_of("a.csv", "x,y,q\n1,2,3\n"), HasSubstr("column 3: found name 'q'"));
  EXPECT_THAT(error_of("a.csv", "x,y,z\n1,2,\n"), HasSubstr("row 2: column 3 (z): found nothing"));
  EXPECT_THAT(error_of("a.csv", "x,y,z\n1,2,inf\n"), HasSubstr("found 'inf'"));
}

TEST(ToolPath, RefusesOtherFiles) {
  EXPECT_EQ(error_of("a.step", "x"),
            "a.step: found extension '.step', expected .apt, .cls, .cl, .ngc, .nc, .gcode, .tap or .csv");
  EXPECT_EQ(error_of("a.apt", ""), "a.apt: the file is empty, expected a tool path");
  EXPECT_THAT(error_of("a.apt", std::string("\x89PNG\r\n", 6)), HasSubstr("found a PNG image"));
  EXPECT_THROW(read_tool_path("/no/such/file.apt"), UserError);
}

}  // namespace
}  // namespace meltstage::motion
