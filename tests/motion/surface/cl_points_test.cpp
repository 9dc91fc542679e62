// SPDX-License-Identifier: Apache-2.0
#include "motion/surface/cl_points.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>

#include "motion/surface/line_shape.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;

std::string error_of(const std::string& name, const std::string& content,
                     std::optional<double> unit_mm = std::nullopt) {
  try {
    read_tool_path_text(name, content, unit_mm);
  } catch (const CoordinateError& error) {
    return error.what();
  }
  return "";
}

/// A whole APT path in millimetres; its statements begin in row 2.
std::string apt(const std::string& statements) { return "UNITS/MM\n" + statements + "FINI\n"; }

/// A whole program in millimetres; its blocks begin in row 2.
std::string program(const std::string& blocks) { return "G21 G90\n" + blocks + "M2\n"; }

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

TEST(AptReader, TakesAnUprightToolAxis) {
  const std::string path = "GOTO/0,0,0\nTLAXIS/ 0.0, 0.0, 1.0\nGOTO/1,0,0\n";
  EXPECT_EQ(read_tool_path_text("a.apt", apt(path))[0].points.size(), 2U);
  EXPECT_THAT(error_of("a.apt", apt("GOTO/0,0,0\nTLAXIS/0,0.1,1\n")),
              HasSubstr("found 'TLAXIS', expected GOTO"));
}

TEST(AptReader, ReadsInches) {
  const auto lines = read_tool_path_text("a.apt", "UNITS/INCH\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n");
  EXPECT_NEAR(lines[0].points[1].position_mm.x(), 25.4, 1e-12);
}

TEST(AptReader, RefusesWhatItCannotFollow) {
  EXPECT_EQ(
      error_of("a.apt", apt("GOTO/0,0,0\nCIRCLE/0,0,0,0,0,1,5\n")),
      "a.apt: row 3: found 'CIRCLE', expected GOTO or a statement without motion; write the path as linear "
      "moves");
  EXPECT_EQ(error_of("a.apt", apt("GOTO/0,0,zero\n")),
            "a.apt: row 2: found 'zero', expected a finite number such as 12.5");
  EXPECT_THAT(error_of("a.apt", apt("GOTO/0,0,nan\n")), HasSubstr("found 'nan', expected a finite number"));
  EXPECT_THAT(error_of("a.apt", apt("GOTO/0,0\n")),
              HasSubstr("found 2 numbers after GOTO/, expected 3 or 6"));
  EXPECT_THAT(error_of("a.apt", apt("GOTO/0,0,0,0,0,0\n")), HasSubstr("found tool axis (0, 0, 0)"));
  EXPECT_THAT(error_of("a.apt", "UNITS/MM\nGOTO/0,0,$\n"), HasSubstr("ends in a statement that goes on"));
  EXPECT_THAT(error_of("a.apt", apt("GODLTA/0,0,1\n")), HasSubstr("before any GOTO"));
  EXPECT_THAT(error_of("a.apt", "UNITS/CUBITS\n"), HasSubstr("expected MM or INCH"));
  EXPECT_THAT(error_of("a.apt", apt("GOTO/0,0,0\n")), HasSubstr("found no line"));
}

// Wherever a whole path is cut, it is no path.
TEST(AptReader, RefusesAPathThatIsCutOff) {
  const std::string whole =
      "UNITS/MM\nMULTAX\nTOOL PATH/A\nRAPID\nGOTO/0,0,5,0,0,1\nGOTO/10.25,0,5,0,0,1\nFINI";
  EXPECT_EQ(read_tool_path_text("a.apt", whole)[0].points.size(), 2U);
  EXPECT_EQ(read_tool_path_text("a.apt", whole + "\n")[0].points.size(), 2U);
  for (std::size_t size = 1; size < whole.size(); ++size)
    EXPECT_NE(error_of("a.apt", whole.substr(0, size)), "") << whole.substr(0, size);
  EXPECT_EQ(error_of("a.apt", whole.substr(0, whole.size() - 5)),
            "a.apt: the file ends without FINI, expected it; the file may be cut off");
  EXPECT_EQ(error_of("a.apt", whole + "\nGOTO/20,0,5,0,0,1\n"),
            "a.apt: row 8: found 'GOTO' behind FINI in row 7, expected nothing there");
  // A CLS file has no FINI; each of its paths has an end.
  const std::string cls = "UNITS/MM\nTOOL PATH/A,TOOL,T\nGOTO/0,0,5,0,0,1\nGOTO/10,0,5\nEND-OF-PATH\n";
  EXPECT_EQ(read_tool_path_text("a.cls", cls).size(), 1U);
  EXPECT_EQ(read_tool_path_text("a.cls", cls + cls).size(), 2U);
  EXPECT_EQ(error_of("a.apt", cls),
            "a.apt: the file ends without FINI, expected it; the file may be cut off");
  EXPECT_EQ(
      error_of("a.cls", cls + cls.substr(0, cls.size() - 12)),
      "a.cls: the file ends without END-OF-PATH or FINI, expected one of them; the file may be cut off");
}

TEST(AptReader, AsksForAxesUnderMultax) {
  EXPECT_EQ(
      error_of("a.apt", apt("MULTAX\nGOTO/0,0,0,0,0,1\nGOTO/10,0,5\n")),
      "a.apt: row 4: found 3 numbers after GOTO/ under MULTAX, expected 6: a place and the tool's axis");
  EXPECT_THAT(error_of("a.apt", apt("MULTAX/ON\nGOTO/0,0,0\n")), HasSubstr("row 3: found 3 numbers"));
  EXPECT_EQ(error_of("a.apt", apt("MULTAX\nGOTO/0,0,0,0,0,1\nMULTAX/OFF\nGOTO/10,0,0\n")), "");
  EXPECT_THAT(error_of("a.apt", apt("MULTAX/MAYBE\n")), HasSubstr("found MULTAX/MAYBE, expected ON or OFF"));
}

TEST(AptReader, AsksForTheUnit) {
  const std::string path = "GOTO/0,0,0\nGOTO/1,0,0\nFINI\n";
  EXPECT_EQ(
      error_of("a.apt", path),
      "a.apt: row 1: found a place before UNITS/MM or UNITS/INCH, expected one of them first, or the unit "
      "by unit_mm");
  EXPECT_NEAR(read_tool_path_text("a.apt", path, 25.4)[0].points[1].position_mm.x(), 25.4, 1e-12);
  EXPECT_EQ(error_of("a.apt", "UNITS/MM\n" + path, 25.4),
            "a.apt: row 1: the file says its unit itself; leave out unit_mm");
}

TEST(AptReader, RefusesFramesOtherThanTheWorkpieces) {
  for (const char* statement :
       {"TRANS/1,2,3", "TRANS/1,2", "ORIGIN/5,5,5", "ROTATE/AAXIS,30", "ROTABL/90", "ROTHED/ATANGL,5",
        "TRACUT/M1", "COPY/1,TRANSL,1,2,3,4", "CALSUB/X", "CUTCOM/LEFT", "MODE/INCR", "SET/MODE,INCR",
        "PREFUN/68", "INSERT/G68 R45", "OPSKIP/ON"})
    EXPECT_THAT(error_of("a.apt", apt(std::string("GOTO/0,0,0\n") + statement + "\nGOTO/1,0,0\n")),
                HasSubstr("row 3: found '"))
        << statement;
  EXPECT_EQ(
      error_of("a.apt", apt("TRANS/1,2,3\n")),
      "a.apt: row 2: found 'TRANS/1,2,3', expected a path in the workpiece's frame alone; write it without "
      "such statements");
  for (const char* statement :
       {"TRANS/0,0,0", "ORIGIN/0.0,0.0,0.0", "CUTCOM/OFF", "OPSKIP/OFF", "SET/HOLDER,1"})
    EXPECT_EQ(error_of("a.apt", apt(std::string("GOTO/0,0,0\n") + statement + "\nGOTO/1,0,0\n")), "")
        << statement;
  // Each path of a CLS file says its frame; all have to be the same.
  const std::string first = "MSYS/0,0,0,1,0,0,0,1,0\nGOTO/0,0,0\nGOTO/1,0,0\n";
  EXPECT_EQ(error_of("a.cls", apt(first + first)), "");
  EXPECT_THAT(error_of("a.cls", apt(first + "MSYS/10,0,0,1,0,0,0,1,0\n")),
              HasSubstr("row 5: found 'MSYS/10,0,0"));
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

TEST(GcodeReader, ALoweringAloneIsNoLine) {
  EXPECT_EQ(error_of("a.ngc", program("G0 X0 Y0 Z10\nG1 Z1 F10\nG0 Z10\nG0 X5\nG1 Z1\nG1 Z10\n")),
            "a.ngc: found no line, expected at least two points one after the other that are no rapid move, "
            "lowering or lifting");
  EXPECT_THAT(error_of("a.apt", apt("MULTAX\nRAPID\nGOTO/0,0,10,0,0,1\nGOTO/0,0,1,0,0,1\nRAPID\n"
                                    "GOTO/5,0,10,0,0,1\nGOTO/5,0,1,0,0,1\n")),
              HasSubstr("found no line"));
  // Down too far and up again, and in pecks.
  for (const char* down : {"G1 Z0\nZ1\n", "G1 Z4\nZ6\nZ1\n"})
    EXPECT_EQ(read_tool_path_text("a.ngc", program(std::string("G0 X0 Y0 Z9\n") + down + "X5\nG0 Z9\n"))
                  .at(0)
                  .points.size(),
              2U);
  // Between lines, and in steps.
  const auto lines = read_tool_path_text(
      "a.ngc", program("G0 X0 Y0 Z10\nG1 Z4\nZ1\nX5\nZ4\nZ10\nG0 X9\nG1 Z1\nG0 Z10\nG0 X0 Y3\nG1 "
                       "Z1\nX5\nG0 Z10\n"));
  ASSERT_EQ(lines.size(), 2U);
  for (const ClLine& line : lines) {
    ASSERT_EQ(line.points.size(), 2U);
    EXPECT_EQ(line.points[0].position_mm.z(), 1.0);
    EXPECT_EQ(line.points[1].position_mm.z(), 1.0);
  }
}

TEST(GcodeReader, AWallFacesSideways) {
  const auto axis_on = [](const std::string& blocks, double length_mm) {
    const ClLine line = read_tool_path_text("a.ngc", program("G0 X0 Y0 Z1\n" + blocks)).at(0);
    return place_on(line, polygon_lengths_mm(positions_mm(line)), length_mm).axis.z();
  };
  EXPECT_NEAR(axis_on("G1 X5\nZ6\nX10\n", 7.0), 0.0, 1e-12);
  EXPECT_NEAR(axis_on("G1 X5\nX5.05 Z6\nX10\n", 7.0), 0.01, 1e-4);
  EXPECT_EQ(axis_on("G1 X5\nZ6\nX10\n", 4.9), 1.0);
  EXPECT_EQ(axis_on("G1 X5\nZ6\nX10\n", 10.1), 1.0);
  // A steep face at an end is no lowering.
  EXPECT_EQ(read_tool_path_text("a.ngc", program("G0 X0 Y0 Z1\nG1 X5\nX6 Z11\n")).at(0).points.size(), 3U);
}

TEST(GcodeReader, TakesWhatIsMovedUnderPressure) {
  const auto lines = read_tool_path_text(
      "a.ngc", "G21 G0 X0 Y0 Z5\nM64 P0\nG1 X1\nX2\nM65 P0\nX3\nM62 P0\nX4\nX5\nM63 P0\nM30\n");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].points.size(), 3U);
  EXPECT_EQ(lines[1].points.size(), 3U);
  EXPECT_EQ(lines[1].points[0].position_mm.x(), 3.0);
}

TEST(GcodeReader, RefusesWhatItCannotFollow) {
  EXPECT_EQ(
      error_of("a.ngc", "G21 G1 X0 Y0 Z0\nG2 X1\n"),
      "a.ngc: row 2: found 'G2', expected G0, G1 or a G word that moves nothing; write the path as straight "
      "moves in one frame");
  EXPECT_THAT(error_of("a.ngc", "G1 X0 A10\n"),
              HasSubstr("found 'A10', expected a path in the workpiece's frame"));
  // Inches or millimetres, and how high: nothing to be guessed.
  EXPECT_EQ(
      error_of("a.ngc", "G90\nG1 X0 Y0 Z0\nX1\n"),
      "a.ngc: row 2: found a move before G20 or G21, expected one of them first, or the unit by unit_mm");
  EXPECT_EQ(error_of("a.ngc", "G21\nG0 X0 Y0\nG1 X1\n"),
            "a.ngc: row 3: found a line that begins before any Z, expected X, Y and Z of its beginning, such "
            "as Z5");
  EXPECT_THAT(error_of("a.ngc", "G21 G0 Z5 X1\nM64 P0\nG1 X1\nM65 P0\n"), HasSubstr("before any Y"));
  EXPECT_EQ(error_of("a.ngc", "G21 X1 Y2 Z3\n"),
            "a.ngc: row 1: found 'X1' before G0 or G1, expected one of them first");
  EXPECT_THAT(error_of("a.ngc", "G1 X1 (open\n"), HasSubstr("comment without its end"));
}

// A block that the path goes on with behind three points; whatever isn't known is refused by its word.
std::string goes_on(const std::string& block) {
  return program("G0 X0 Y0 Z5\nG1 Z0 F100\nG1 X10\n" + block + "\nG1 X20\nG0 Z5\n");
}

TEST(GcodeReader, TakesOnlyWordsThatItKnows) {
  for (const char* word : {"G2 X11",       "G3 X11",
                           "G5 X11",       "G7",
                           "G10 L2 P1 X5", "G16",
                           "G33 X20 K1",   "G38.2 X20",
                           "G38.5 X20",    "G41 D1",
                           "G42",          "G43.4",
                           "G50",          "G51 X2 Y2",
                           "G52 X3",       "G68 X0 Y0 R45",
                           "G73",          "G81 X20 Z-3 R2",
                           "G89",          "G92 X0",
                           "G92.1",        "G92.2",
                           "G99.5",        "G100",
                           "G-1"})
    EXPECT_THAT(error_of("a.ngc", goes_on(word)), HasSubstr("row 5: found 'G")) << word;
  for (const char* word : {"M98 P1000", "M99", "M47", "M60", "M101", "M2.5", "M-3"})
    EXPECT_THAT(error_of("a.ngc", goes_on(word)), HasSubstr("row 5: found 'M")) << word;
  for (const char* word :
       {"U5", "V5", "W5", "I1", "J1", "K1", "R45", "D1", "E0.5", "P2", "Q3", "L1", "H1", "O100"})
    EXPECT_THAT(error_of("a.ngc", goes_on(std::string("G1 X11 ") + word)),
                HasSubstr(std::string("row 5: found '") + word + "'"))
        << word;
  EXPECT_EQ(error_of("a.ngc", goes_on("G1 X11 U5")),
            "a.ngc: row 5: found 'U5', expected a move by X, Y and Z; write the path without U");
  EXPECT_EQ(error_of("a.ngc", goes_on("G1 X11 P2")),
            "a.ngc: row 5: found 'P2', expected it with G4, G64, M62, M63, M64, M65 or M66 only");
  for (const char* word :
       {"N10 G4 P2", "G4 X2.", "G17", "G40 G49 G80", "G61", "G64 P0.01 Q0.01", "G94 F100", "G97 S1000 M3",
        "M5 M9", "T1 M6", "G43 H1", "G43.1 X1 Y2 Z3", "M48 G98", "M67 E0 Q0.5", "(a (note)", "; G52", "N20",
        "G1 x11 y-.5 A0 B0. C-0", "G15 G69 G91.1"}) {
    const std::string block = std::string(word) + "\nG1";  // G80 ended the moves
    EXPECT_EQ(error_of("a.ngc", goes_on(block)), "") << word;
  }
}

TEST(GcodeReader, ReadsNoExpressionsAndSubroutines) {
  EXPECT_EQ(
      error_of("a.ngc", goes_on("G1 X[5+5]")),
      "a.ngc: row 5: found 'X[5+5]', expected a number behind X; expressions and parameters are not read");
  for (const char* block :
       {"G1 X#1", "#1=5", "G1 X-[5]", "o100 repeat [5]", "o<sub> call", "G[1]", "[5]", "G1 X1,5"})
    EXPECT_THAT(error_of("a.ngc", goes_on(block)), HasSubstr("row 5: found '")) << block;
  EXPECT_THAT(error_of("a.ngc", goes_on("#1=5")), HasSubstr("found '#1=5', expected a word such as X12.5"));
  EXPECT_THAT(error_of("a.ngc", goes_on("G1 X1.2.3")), HasSubstr("found '1.2.3', expected a finite number"));
  EXPECT_THAT(error_of("a.ngc", goes_on("G1 X")), HasSubstr("found 'X', expected a number behind X"));
  EXPECT_EQ(error_of("a.ngc", goes_on("/G1 X11")),
            "a.ngc: row 5: found '/', expected a path that doesn't hang on a switch of the machine");
  // A program's number stands at its beginning.
  EXPECT_EQ(error_of("a.ngc", "%\nO1000\nN10 G21 G90\nN20 G00X0Y0Z5\nN30G01X9\nM30\n%\n"), "");
}

TEST(GcodeReader, AWordStandsOnceInARow) {
  EXPECT_EQ(error_of("a.ngc", goes_on("G1 X10 X20")),
            "a.ngc: row 5: found 'X20' behind 'X10', expected one of them in a row");
  EXPECT_THAT(error_of("a.ngc", goes_on("G0 G1 X11")), HasSubstr("found 'G1' behind 'G0'"));
  EXPECT_THAT(error_of("a.ngc", goes_on("G21 G20")), HasSubstr("found 'G20' behind 'G21'"));
  EXPECT_THAT(error_of("a.ngc", goes_on("G90 G91 X1")), HasSubstr("found 'G91' behind 'G90'"));
  EXPECT_THAT(error_of("a.ngc", goes_on("M64 P0 M65 P0")), HasSubstr("found 'M65' behind 'M64'"));
  EXPECT_THAT(error_of("a.ngc", goes_on("F100 F200")), HasSubstr("found 'F200' behind 'F100'"));
}

TEST(GcodeReader, KeepsToOneFrame) {
  EXPECT_EQ(error_of("a.ngc", goes_on("G53 G1 X20")),
            "a.ngc: row 5: found 'G53' with G1, expected G0: a line lies in the workpiece's frame");
  EXPECT_THAT(error_of("a.ngc", goes_on("G53 X20")), HasSubstr("row 5: found 'G53' with G1"));
  EXPECT_EQ(error_of("a.ngc", goes_on("G55")),
            "a.ngc: row 5: found 'G55' behind a move, expected one workpiece's frame in the path");
  EXPECT_EQ(error_of("a.ngc", program("G55\nG0 X0 Y0 Z5\nG1 X1\nG55\nX2\n")), "");
  EXPECT_THAT(error_of("a.ngc", program("G54\nG55\nG0 X0 Y0 Z5\nG1 X1\n")),
              HasSubstr("found 'G55' behind 'G54'"));
  // A way in the machine's frame ends where the workpiece's frame doesn't know.
  for (const char* block : {"G53 G0 Z0", "G28 Z5", "G30", "G91 G28 Z0\nG90"}) {
    EXPECT_THAT(error_of("a.ngc", goes_on(block + std::string("\nG0 X0 Y0\nG1 X1"))),
                HasSubstr("found a line that begins before any Z"))
        << block;
    EXPECT_EQ(read_tool_path_text("a.ngc", goes_on(block + std::string("\nG0 X0 Y0 Z5\nG1"))).size(), 2U)
        << block;
  }
}

TEST(GcodeReader, TakesTheHeadsThatPostsWrite) {
  const auto lines_behind = [](const std::string& head) {
    return read_tool_path_text("a.nc",
                               "\xEF\xBB\xBF" + head + "G0 X0 Y0\nG43 Z9 H1\nG1 Z1 F9\nX9\nG0 Z9\nM30\n")
        .size();
  };
  EXPECT_EQ(lines_behind("G90 G94\nG17\nG21\nG28 G91 Z0.\nG90\nT1 M6\nS5000 M3\nG54\n"), 1U);
  EXPECT_EQ(lines_behind("G21\nG0 G17 G40 G49 G80 G90\nT1 M6\nG54\n"), 1U);
  EXPECT_EQ(lines_behind("G21 G90\nG53 G0 Z0\nG55\n"), 1U);
  EXPECT_EQ(error_of("a.ngc", goes_on("G80 G1 X11")),
            "a.ngc: row 5: found 'X11' with 'G1' and 'G80', expected a row of its own for the move");
  EXPECT_THAT(error_of("a.ngc", goes_on("G80\nX11")), HasSubstr("found 'X11' before G0 or G1"));
}

TEST(AptReader, PassesOverWhatIsPrintedForTheOperator) {
  EXPECT_EQ(error_of("a.apt", apt("TPRINT/T1 End Mill D 10\nGOTO/0,0,0\nGOTO/1,0,0\n")), "");
}

TEST(ToolPath, MayBeginWithAByteOrderMark) {
  const std::string mark = "\xEF\xBB\xBF";
  EXPECT_EQ(error_of("a.apt", mark + apt("GOTO/0,0,0\nGOTO/1,0,0\n")), "");
  EXPECT_EQ(error_of("a.csv", mark + "x_mm,y_mm,z_mm\n0,0,0\n1,0,0\n"), "");
  EXPECT_EQ(error_of("a.nc", mark), "a.nc: the file is empty, expected a tool path");
}

TEST(ToolPath, NotesRamps) {
  const auto notes = [](const std::string& blocks) {
    return notes_on_ramps(read_tool_path_text("a.nc", program("G0 X0 Y0 Z10\n" + blocks)).at(0));
  };
  const auto ramps = notes("G1 X2 Z1 F9\nX10\nG1 X12 Z10\n");
  ASSERT_EQ(ramps.size(), 2U);
  EXPECT_EQ(
      ramps[0],
      "line 1: its first move (row 3) comes down 9 mm and is touched as a face of the part; if it is a ramp "
      "through the air, make it a rapid move");
  EXPECT_THAT(ramps[1], HasSubstr("its last move (row 5) goes up 9 mm"));
  EXPECT_TRUE(notes("G1 Z1 F9\nX10\nX20 Z2\nG0 Z10\n").empty());
  EXPECT_TRUE(notes("G1 X2 Z1 F9\nX10 Z-35\n").empty());  // a slope that goes on
}

TEST(GcodeReader, AskedForPressureItKnowsWhichOutput) {
  const auto with = [](const std::string& blocks) {
    return error_of("a.ngc", program("G0 X0 Y0 Z5\n" + blocks + "G1 X5\n"));
  };
  EXPECT_EQ(with("M64 P1\nG1 X1\nM65 P1\n"), "");
  EXPECT_EQ(with("M64 P0\nG1 X1\nM65 P0\nM64 P3\nG1 X2\n"),
            "a.ngc: row 6: found 'P3' with M64 behind P0, expected one output that switches pressure");
  EXPECT_EQ(with("M64\nG1 X1\nM65\n"),
            "a.ngc: row 3: found 'M64' without P, expected the output, such as M64 P0");
  EXPECT_THAT(with("M64 P0\nG28\nM65 P0\n"), HasSubstr("row 4: found 'G28' under pressure"));
  // What a comment says switches nothing.
  EXPECT_EQ(read_tool_path_text("a.ngc", goes_on("(M62 M64)")).size(), 1U);
}

TEST(GcodeReader, ReadsUpToTheEndOfTheProgram) {
  const std::string blocks = "G21 G90\nG0 X0 Y0 Z5\nG1 Z0 F100\nG1 X10\n";
  EXPECT_EQ(error_of("a.ngc", blocks),
            "a.ngc: the file ends without M2, M30 or %, expected one of them; the file may be cut off");
  EXPECT_EQ(error_of("a.ngc", blocks + "G1 X2"),
            "a.ngc: the file ends without M2, M30 or %, expected one of them; the file may be cut off");
  for (const char* end : {"M2\n", "M30", "M02\n%\n", "%", "G0 Z5 M2\n\n(end)\n%\n; end\n"})
    EXPECT_EQ(error_of("a.ngc", "%\n" + blocks + end), "") << end;
  EXPECT_EQ(error_of("a.ngc", blocks + "M2\nG1 X20\n"),
            "a.ngc: row 6: found 'G1' behind M2 in row 5, expected nothing behind the program's end");
  EXPECT_THAT(error_of("a.ngc", blocks + "%\nO2000\n"), HasSubstr("row 6: found 'O2000' behind % in row 5"));
  EXPECT_THAT(error_of("a.ngc", blocks + "% X5\nM2\n"), HasSubstr("row 5: found '% X5', expected % alone"));
  EXPECT_EQ(read_tool_path_text("a.ngc", blocks + "X20 M2\n")[0].points.back().position_mm.x(), 20.0);
}

TEST(GcodeReader, TakesTheUnitThatItSaysNot) {
  const std::string blocks = "G0 X0 Y0 Z0\nG1 X1\nM2\n";
  EXPECT_NEAR(read_tool_path_text("a.ngc", blocks, 25.4)[0].points[1].position_mm.x(), 25.4, 1e-12);
  EXPECT_EQ(error_of("a.ngc", "G21\n" + blocks, 25.4),
            "a.ngc: row 1: the file says its unit itself; leave out unit_mm");
}

TEST(CsvReader, TakesNamedColumnsAndLines) {
  const auto lines =
      read_tool_path_text("a.csv",
                          "line,X_mm,y (mm),z_um,i,j,k\na,0,0,1000,0,0,1\na,1,0,1,0,1,1\nb,0,2,1,0,0,1\n"
                          "b,1,2,1,0,0,1\nb,1,2,1,0,0,1\n");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].name, "a");
  EXPECT_NEAR(lines[0].points[0].position_mm.z(), 1.0, 1e-12);
  EXPECT_NEAR(lines[0].points[1].axis.y(), std::sqrt(0.5), 1e-12);
  EXPECT_EQ(lines[1].points.size(), 2U);  // the repeated point is one
}

TEST(CsvReader, TakesDecimalCommasAndNormals) {
  const auto lines =
      read_tool_path_text("a.csv", "x_mm;y_mm;z_mm;nx;ny;nz\n0,5;0;2,25;0,6;0;0,8\n1,5;0;-2,5;0;0;1\n");
  EXPECT_EQ(lines.at(0).points.at(0).position_mm, Eigen::Vector3d(0.5, 0, 2.25));
  EXPECT_EQ(lines.at(0).points.at(1).position_mm, Eigen::Vector3d(1.5, 0, -2.5));
  EXPECT_NEAR(lines.at(0).points.at(0).axis.x(), 0.6, 1e-12);
  EXPECT_FALSE(lines.at(0).axes_by_line);
  EXPECT_EQ(read_tool_path_text("a.csv", "0,5;0;1\n1;0;1\n", 1.0).at(0).points.at(0).position_mm.x(), 0.5);
  EXPECT_THAT(error_of("a.csv", "x_mm;y_mm;z_mm\n0,5;0;1\n1.5;0;1\n"), HasSubstr("one decimal mark"));
  EXPECT_THAT(error_of("a.csv", "x_mm,y_mm,z_mm,i,nx\n"), HasSubstr("found a second column i"));
}

TEST(CsvReader, AnEmptyRowEndsALine) {
  const auto lines = read_tool_path_text("a.csv", "0,0,1\n1,0,1\n\n0,2,1\n1,2,1\n", 1.0);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[1].name, "line 2");
}

TEST(CsvReader, ALineOfOnePointIsRefused) {
  const std::string head = "x_mm,y_mm,z_mm,line\n0,0,0,a\n2,0,0,a\n";
  EXPECT_EQ(error_of("a.csv", head + "0,10,0,b\n"),
            "a.csv: row 4: found a line of one point, 'b', expected two or more that differ");
  EXPECT_EQ(error_of("a.csv", head + "0,10,0,b\n0,10,0,b\n1,1,1,c\n2,1,1,c\n"),
            "a.csv: row 4: found a line of one point, 'b', expected two or more that differ");
  EXPECT_EQ(error_of("a.csv", "0,0,1\n1,0,1\n\n0,2,1\n\n1,2,1\n3,2,1\n", 1.0),
            "a.csv: row 4: found a line of one point, expected two or more that differ");
}

TEST(CsvReader, AsksForTheUnit) {
  EXPECT_EQ(
      error_of("a.csv", "x,y,z\n0,0,1\n1,0,1\n"),
      "a.csv: row 1: found x, y and z without a unit, expected names such as x_mm, or the unit by unit_mm");
  EXPECT_EQ(
      error_of("a.csv", "0,0,1\n1,0,1\n"),
      "a.csv: row 1: found x, y and z without a unit, expected names such as x_mm, or the unit by unit_mm");
  EXPECT_NEAR(read_tool_path_text("a.csv", "x,y,z\n0,0,1\n1,0,1\n", 25.4)[0].points[1].position_mm.x(), 25.4,
              1e-12);
  EXPECT_EQ(error_of("a.csv", "x_mm,y,z\n0,0,1\n1,0,1\n"),
            "a.csv: row 1: found a unit at some of x, y and z, expected it at all or none");
  EXPECT_EQ(error_of("a.csv", "x_mm,y_mm,z_mm\n0,0,1\n1,0,1\n", 25.4),
            "a.csv: row 1: the file says its unit itself; leave out unit_mm");
}

TEST(CsvReader, RefusesWhatItCannotUse) {
  EXPECT_THAT(error_of("a.csv", "x_mm,y_mm\n1,2\n"), HasSubstr("expected all three"));
  EXPECT_THAT(error_of("a.csv", "x,y,z,i\n1,2,3,4\n"), HasSubstr("some of the columns i, j and k"));
  EXPECT_THAT(error_of("a.csv", "x,y,q\n1,2,3\n"), HasSubstr("column 3: found name 'q'"));
  EXPECT_THAT(error_of("a.csv", "x_mm,y_mm,z_ell\n1,2,3\n"), HasSubstr("column 3: found name 'z_ell'"));
  EXPECT_THAT(error_of("a.csv", "x_mm,y_mm,z_mm,x_um\n1,2,3,4\n"),
              HasSubstr("column 4: found a second column x"));
  EXPECT_THAT(error_of("a.csv", "x_mm,y_mm,z_mm\n1,2,\n"), HasSubstr("row 2: column 3 (z): found nothing"));
  EXPECT_THAT(error_of("a.csv", "x_mm,y_mm,z_mm\n1,2,inf\n"), HasSubstr("found 'inf'"));
  EXPECT_THAT(error_of("a.csv", "0,0,0,0,0,1,7\n1,0,0,0,0,1,7\n"),
              HasSubstr("found 7 columns without names, expected 3 (x, y, z) or 6 (and i, j, k)"));
  EXPECT_EQ(
      error_of("a.csv", "x_mm,y_mm,z_mm\n0,0,0\n5,0,12.5"),
      "a.csv: row 3: the file ends in the middle of the row, expected its line end; the file may be cut off");
}

// Moves through the air that are no rapid ones, as some CAM systems link the passes of one operation.
// Neither a '$' nor "$$" of a text goes on or begins a comment.
TEST(AptReader, TextsGoToTheEndOfTheirLine) {
  const auto lines =
      read_tool_path_text("a.apt",
                          "PARTNO IN US$\nUNITS/MM\nRAPID\nGOTO/0,0,10\nGOTO/0,0,0\nGOTO/10,0,0\n"
                          "PPRINT MIDDLE IN US$\nGOTO/10,10,0\nREMARK 50$\nGOTO/20,20,0\nFINI\n");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].points.size(), 4U);
}

// As Creo writes it.
TEST(AptReader, ACoordinateSystemInACommentMayGoOn) {
  const auto lines = read_tool_path_text("a.cl",
                                         "$$-> CSYS / 1.0, 0.0, 0.0, 0.0, $\n 0.0, 1.0, 0.0, 0.0, $\n 0.0, "
                                         "0.0, 1.0, 0.0\nUNITS/MM\n$$ a comment $\n"
                                         "GOTO/0,0,0\nGOTO/10,0,0\nFINI\n");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].points.size(), 2U);
}

TEST(AptReader, LiftsWithinALineEndIt) {
  const std::string passes =
      "GOTO/0,0,30,0,0,1\nGOTO/0,0,10,0,0,1\nGOTO/10,0,10,0,0,1\nGOTO/20,0,10,0,0,1\n"
      "GOTO/20,0,30,0,0,1\nGOTO/20,5,30,0,0,1\nGOTO/20,5,12,0,0,1\nGOTO/20,5,10,0,0,1\nGOTO/0,5,10,0,0,1\n"
      "GOTO/0,5,30,0,0,1\n";
  const auto lines = read_tool_path_text("a.apt", apt(passes));
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].points.size(), 3U);
  EXPECT_EQ(lines[1].points.size(), 2U);
  EXPECT_EQ(lines[1].points.front().position_mm.z(), 10.0);
  EXPECT_EQ(
      error_of("a.apt", apt("GOTO/0,0,0,0,0,1\nGOTO/10,0,0,0,0,1\nGOTO/10,0,5,0,0,1\nGOTO/20,0,5,0,0,1\n")),
      "a.apt: row 4: found a move along the tool's axis within a line, expected a lift and a lowering "
      "behind it, or none");
  EXPECT_THAT(
      error_of("a.apt", apt("GOTO/0,0,5,0,0,1\nGOTO/10,0,5,0,0,1\nGOTO/10,0,0,0,0,1\nGOTO/20,0,0,0,0,1\n")),
      HasSubstr("row 4: found a move along the tool's axis"));
}

TEST(ToolPath, RefusesOtherFiles) {
  EXPECT_EQ(error_of("a.csv", "x,y,z\n0,0,1\n1,0,1\n", -1.0),
            "a.csv: unit_mm: found -1, expected a finite number above 0");
  EXPECT_EQ(error_of("a.step", "x"),
            "a.step: found extension '.step', expected .apt, .cls, .cl, .ngc, .nc, .gcode, .tap or .csv");
  EXPECT_EQ(error_of("a.apt", ""), "a.apt: the file is empty, expected a tool path");
  EXPECT_THAT(error_of("a.apt", std::string("\x89PNG\r\n", 6)), HasSubstr("found a PNG image"));
  EXPECT_THROW(read_tool_path("/no/such/file.apt"), UserError);
}

}  // namespace
}  // namespace meltstage::motion
