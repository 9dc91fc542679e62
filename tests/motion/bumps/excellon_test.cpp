// SPDX-License-Identifier: Apache-2.0
// Drill files: what is a hole, where it is, and that no hole is lost without a word.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "motion/bumps/coordinate_sources.hpp"

namespace meltstage::motion::detail {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::StartsWith;

RawPoints read(std::string_view content) { return read_excellon_points("a.drl", content); }

std::string refusal(std::string_view content) {
  try {
    read(content);
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), StartsWith("a.drl: "));
    return std::string(error.what()).substr(7);
  }
  return "read without an error";
}

void expect_holes(std::string_view content, const std::vector<RawPoint>& expected) {
  const RawPoints file = read(content);
  ASSERT_EQ(file.points.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(file.points[i].x, expected[i].x, 1e-9) << i;
    EXPECT_NEAR(file.points[i].y, expected[i].y, 1e-9) << i;
    EXPECT_EQ(file.points[i].row, expected[i].row) << i;
  }
}

/// A file in millimetres whose two tools are defined; the body begins in row 7, behind the choice of tool 1.
std::string metric(std::string_view body) {
  return "M48\nMETRIC,TZ\nT1C0.5\nT2C0.8\n%\nT1\n" + std::string(body) + "M30\n";
}

TEST(Excellon, HolesAreBumps) {
  const auto file = read(
      "M48\n; DRILL file\nFMAT,2\nMETRIC,TZ\nT1C0.300\nT2C1.000\n%\nG90\nG05\nT1\nX10.5Y2.0\nX11.5\nT2\n"
      "X1.0Y30.25\nX2.0Y3.0G85X4.0Y3.0\nT0\nM30\n");
  ASSERT_EQ(file.points.size(), 3U);
  EXPECT_EQ(file.points[1].x, 11.5);
  EXPECT_EQ(file.points[1].y, 2.0);
  EXPECT_EQ(file.points[2].row, 14U);
  EXPECT_THAT(file.notes, ElementsAre("1 slot, in row 15, holds no bump"));
}

TEST(Excellon, WithoutDecimalPoints) {
  // Inches 2.4: leading zeros kept, so 015 is 1.5; trailing zeros kept, so 15000 is 1.5.
  expect_holes("M48\nINCH,LZ\nT1C0.02\n%\nT1\nX015Y02\nM30\n", {{38.1, 50.8, 6}});
  expect_holes("M48\nINCH,TZ\nT1C0.02\n%\nT1\nX15000Y20000\nM30\n", {{38.1, 50.8, 6}});
  expect_holes("M48\nMETRIC,LZ,0000.00\nT1C0.5\n%\nT1\nX00125Y0020\nM30\n", {{12.5, 20.0, 6}});
  expect_holes("M48\n;FILE_FORMAT=4:4\nMETRIC,LZ\nT1C0.5\n%\nT1\nX00125Y0020\nM30\n", {{12.5, 20.0, 7}});
}

TEST(Excellon, DigitsMayStandBeforeTheZeros) {
  expect_holes("M48\nMETRIC,000.000,TZ\nT1C0.5\n%\nT1\nX12500Y20000\nM30\n", {{12.5, 20.0, 6}});
  expect_holes("M48\nMETRIC,0000.00,LZ\nT1C0.5\n%\nT1\nX00125Y0020\nM30\n", {{12.5, 20.0, 6}});
}

TEST(Excellon, AUnitMayBeSaidTwice) {
  expect_holes("M48\nMETRIC,TZ\nMETRIC,TZ\nT1C0.5\n%\nT1\nX12500Y20000\nM30\n", {{12.5, 20.0, 7}});
  expect_holes("M48\nMETRIC,TZ,000.00\nT1C0.5\n%\nM71\nT1\nX1250Y2000\nM30\n", {{12.5, 20.0, 7}});
  expect_holes("M48\nINCH,TZ\nT1C0.5\n%\nM72\nT1\nX15000Y20000\nM30\n", {{38.1, 50.8, 7}});
}

std::string kicad(const std::string& format, const std::string& unit, const std::string& hole) {
  return "M48\n; DRILL file {KiCad 7.0.10}\n; FORMAT={" + format + "}\nFMAT,2\n" + unit + "\nT1C1\n%\nT1\n" +
         hole + "\nM30\n";
}

TEST(Excellon, KicadSaysItsDigitsInAComment) {
  expect_holes(kicad("3:4/ absolute / metric / suppress leading zeros", "METRIC,TZ", "X12345Y-12345"),
               {{1.2345, -1.2345, 9}});
  expect_holes(kicad("4:2/ absolute / metric / suppress trailing zeros", "METRIC,LZ", "X012345Y0001"),
               {{123.45, 1.0, 9}});
  expect_holes(kicad("3:5 / absolute / inch / keep zeros", "INCH,TZ", "X00150000Y-00100000"),
               {{38.1, -25.4, 9}});
  expect_holes(kicad("-:-/ absolute / metric / decimal", "METRIC", "X1.5Y2.0"), {{1.5, 2.0, 9}});
  expect_holes(kicad("2:4/ absolute / inch / decimal", "INCH", "X1.5Y2.0"), {{38.1, 50.8, 9}});
}

// As KiCad 6 writes it: no word behind the unit says which zeros are kept.
TEST(Excellon, AllZerosMayBeKept) {
  const std::string kept = "absolute / metric / keep zeros";
  expect_holes(kicad("3:3/ " + kept, "METRIC",
                     "X-005080Y-002500\nX000000Y000000\nX007620Y-120000\nX019972Y-018000\nX101600Y076200"),
               {{-5.08, -2.5, 9}, {0, 0, 10}, {7.62, -120, 11}, {19.972, -18, 12}, {101.6, 76.2, 13}});
  expect_holes(kicad("2:4/ absolute / inch / keep zeros", "INCH", "X-002000Y-000984\nX040000Y007863"),
               {{-5.08, -2.49936, 9}, {101.6, 19.97202, 10}});
  expect_holes(kicad("3:3/ " + kept, "METRIC,LZ", "X019972Y-018000"), {{19.972, -18, 9}});
  EXPECT_EQ(refusal(kicad("3:3/ " + kept, "METRIC", "X019972Y-18000")),
            "row 9, column 8: found 'Y-18000', expected 6 digits (format 3.3, all zeros kept)");
  EXPECT_EQ(refusal(kicad("3:3/ " + kept, "METRIC,TZ", "X0199720Y000000")),
            "row 9, column 1: found 'X0199720', expected 6 digits (format 3.3, all zeros kept)");
  EXPECT_THAT(refusal(kicad("-:-/ " + kept, "METRIC", "X019972Y-018000")),
              StartsWith("row 9, column 1: found 'X019972', expected decimal points, or LZ or TZ"));
}

TEST(Excellon, AByteOrderMarkIsPassedOver) {
  expect_holes("\xEF\xBB\xBFM48\nMETRIC,TZ\nT1C1\n%\nT1\nX1.5Y2.0\nM30\n", {{1.5, 2.0, 6}});
}

TEST(Excellon, UnitAndZerosMayStandInTheBody) {
  expect_holes("%\nMETRIC,TZ\nT1C0.5\nX12500Y20000\nM30\n", {{12.5, 20.0, 4}});
}

TEST(Excellon, RepeatsAndIncrements) {
  expect_holes(metric("X1.0Y1.0\nR3X2.0\nG91\nX0.5Y0.5\n"),
               {{1, 1, 7}, {3, 1, 8}, {5, 1, 8}, {7, 1, 8}, {7.5, 1.5, 10}});
  expect_holes("M48\nMETRIC,TZ\nICI,ON\nT1C0.5\n%\nT1\nX1.0Y1.0\nX1.0\nM30\n", {{1, 1, 7}, {2, 1, 8}});
  expect_holes("M48\nMETRIC,TZ\nICI\nICI,OFF\nT1C0.5\n%\nT1\nX1.0Y1.0\nX1.0\nX3.0\nM30\n",
               {{1, 1, 8}, {1, 1, 9}, {3, 1, 10}});
}

TEST(Excellon, AHoleMayFollowACommandInItsRow) {
  for (const char* row :
       {"G81X2.0Y1.0\n", "G05X2.0Y1.0\n", "G5X2.0Y1.0\n", "T2X2.0Y1.0\n", "T2C0.8X2.0Y1.0\n", "N1X2.0Y1.0\n",
        "N12 G90 X2.0 Y1.0\n", "x2.0y1.0\n", "g81x2.0y1.0\n", "Y1.0X2.0\n", "X2.0Y1.0 ; the first\n",
        "G90G05T1X+2.0Y1.0\n", "X2.0Y1.0F100S65\n"})
    expect_holes(metric(row), {{2, 1, 7}});
  expect_holes("m48\nmetric,tz\nt1c0.5\n%\nt1\nx2.0y1.0\nm30\n", {{2, 1, 6}});
}

TEST(Excellon, RoutingEndsWhereDrillingIsAskedForAgain) {
  const RawPoints file =
      read(metric("G00X1.0Y1.0\nM15\nG01X2.0\nY3.0F20\nM16\nG05X5.0Y5.0\nG00X6.0Y6.0\nG81\nX7.0\n"));
  ASSERT_EQ(file.points.size(), 2U);
  EXPECT_EQ(file.points[0].x, 5.0);
  EXPECT_EQ(file.points[1].y, 6.0);
  EXPECT_THAT(file.notes, ElementsAre("4 routing moves, first in row 7, hold no bump"));
}

TEST(Excellon, ASlotMayBeginWhereTheToolStands) {
  const RawPoints file = read(metric("X1.0Y1.0\nG85X2.0Y1.0\nX3.0\n"));
  ASSERT_EQ(file.points.size(), 2U);
  EXPECT_EQ(file.points[1].x, 3.0);
  EXPECT_THAT(file.notes, ElementsAre("1 slot, in row 8, holds no bump"));
}

TEST(Excellon, WhatMakesNoHoleIsPassedOver) {
  const RawPoints file = read(
      "%\nM48\nVER,1\nFMAT,2\nINCH,TZ\nTCST,OFF\nICI,OFF\nT1C0.02F200S65\n%\n\nG93X0Y0\nT1\nF100\nS65\nM47, "
      "Turn it; X1Y1\n"
      "X10000Y10000\nM09\nT0\nM30X0Y0\n; made by a stranger\n");
  EXPECT_EQ(file.points.size(), 1U);
  EXPECT_THAT(file.notes, IsEmpty());
}

TEST(Excellon, ToolZeroDrillsWhenItIsDefined) {
  expect_holes("M48\nMETRIC,TZ\nT0C0.5\n%\nT0\nX1.0Y1.0\nM30\n", {{1, 1, 6}});
}

struct Bad {
  std::string name, content, message;
};
void PrintTo(const Bad& bad, std::ostream* out) { *out << bad.name; }

class BadExcellon : public ::testing::TestWithParam<Bad> {};
TEST_P(BadExcellon, NamesPlaceAndValue) {
  EXPECT_THAT(refusal(GetParam().content), StartsWith(GetParam().message));
}

const std::string kPatterns = "expected single holes";
INSTANTIATE_TEST_SUITE_P(
    All, BadExcellon,
    ::testing::Values(
        Bad{"no_end", "M48\nMETRIC,TZ\nT1C0.5\n%\nT1\nX1.0Y1.0\n", "the file ends without M30"},
        Bad{"no_unit", "M48\nT1C0.5\n%\nT1\nX1.0Y1.0\nM30\n",
            "row 5, column 1: found 'X1.0', expected a unit"},
        Bad{"no_zeros", "M48\nMETRIC\nT1C0.5\n%\nT1\nX10Y10\nM30\n",
            "row 6, column 1: found 'X10', expected decimal points, or LZ or TZ"},
        Bad{"unknown_tool", "M48\nMETRIC,TZ\n%\nT4\nM30\n",
            "row 4, column 1: found 'T4', expected a tool that the header defines"},
        Bad{"tool_without_number", metric("T\n"),
            "row 7, column 1: found 'T', expected the number of a tool"},
        Bad{"no_tool", "M48\nMETRIC,TZ\nT1C0.5\n%\nX1.0Y1.0\nM30\n",
            "row 5, column 1: found 'X1.0Y1.0', expected a tool (T1)"},
        Bad{"bad_number", metric("X1..0Y1.0\n"),
            "row 7, column 1: found 'X1..0', expected a number behind X"},
        Bad{"no_number", metric("X1.0Y\n"), "row 7, column 5: found 'Y', expected a number behind Y"},
        Bad{"twice", metric("X1.0Y1.0X2.0\n"), "row 7, column 9: found 'X2.0', expected X once"},
        Bad{"repeat_of_nothing", metric("R3X1.0\n"),
            "row 7, column 1: found 'R3X1.0', expected a repetition"},
        Bad{"repeat_of_a_slot", metric("X1.0Y1.0\nX2.0Y1.0G85X3.0Y1.0\nR3X1.0\n"),
            "row 9, column 1: found 'R3X1.0', expected a repetition"},
        Bad{"repeat_without_a_step", metric("X1.0Y1.0\nR3\n"),
            "row 8, column 1: found 'R3', expected a repetition"},
        Bad{"repeat_of_a_pattern", metric("X1.0Y1.0\nR3M02X1.0\n"),
            "row 8, column 3: found 'M02X1.0', expected X or Y"},
        Bad{"too_many_digits", metric("X1234567Y1\n"),
            "row 7, column 1: found 'X1234567', expected at most 6 digits"},
        Bad{"unknown_zeros", "M48\nMETRIC,XZ\nM30\n",
            "row 2, column 8: found 'XZ', expected LZ, TZ or digits"},
        Bad{"two_units", "M48\nMETRIC,TZ\nINCH,TZ\nT1C0.5\n%\nT1\nX1.0Y1.0\nM30\n",
            "row 3, column 1: found 'INCH,TZ', expected one unit; row 2 has METRIC"},
        Bad{"two_units_as_codes", "M48\nM71\nM72\nT1C0.5\n%\nT1\nX1.0Y1.0\nM30\n",
            "row 3, column 1: found 'M72', expected one unit; row 2 has M71"},
        Bad{"a_unit_and_a_code", "M48\nMETRIC,TZ\nM72\nT1C0.5\n%\nT1\nX1.0Y1.0\nM30\n",
            "row 3, column 1: found 'M72', expected one unit; row 2 has METRIC"},
        Bad{"two_units_on_the_way", metric("X1.0Y1.0\nINCH,TZ\n"),
            "row 8, column 1: found 'INCH,TZ', expected one unit; row 2 has METRIC"},
        Bad{"two_kinds_of_zeros", "M48\nMETRIC,TZ\nMETRIC,LZ\nT1C0.5\n%\nT1\nX1.0Y1.0\nM30\n",
            "row 3, column 8: found 'LZ', expected TZ (suppress leading zeros), as row 2 has"},
        Bad{"another_unit_in_the_body", metric("X1.0Y1.0\nM72\nX2.0Y2.0\n"),
            "row 8, column 1: found 'M72', expected one unit; row 2 has METRIC"},
        Bad{"another_unit_before_the_first_hole", "M48\nINCH,TZ\nT1C0.5\n%\nM71\nT1\nX1.0Y1.0\nM30\n",
            "row 5, column 1: found 'M71', expected one unit; row 2 has INCH"},
        Bad{"kicads_comment_says_inch",
            kicad("2:4/ absolute / inch / suppress leading zeros", "METRIC,TZ", "X1Y1"),
            "row 5, column 1: found 'METRIC,TZ', expected one unit; row 3 has inch"},
        Bad{"kicads_comment_says_other_zeros",
            kicad("3:3/ absolute / metric / suppress trailing zeros", "METRIC,TZ", "X1Y1"),
            "row 5, column 8: found 'TZ', expected LZ (suppress trailing zeros), as row 3 has"},
        Bad{"kicads_comment_says_other_digits",
            kicad("3:3/ absolute / metric / keep zeros", "METRIC,000.00,TZ", "X1Y1"),
            "row 5, column 8: found '000.00', expected 3 digits before the point and 3 behind it, as row 3"},
        Bad{"kicads_comment_is_incremental",
            kicad("3:3/ incremental / metric / suppress leading zeros", "METRIC,TZ", "X1000Y2000"),
            "row 3, column 16: found 'incremental', expected digits such as 3:3, absolute, metric, inch"},
        Bad{"kicads_comment_says_what_is_not_known",
            kicad("3:3/ absolute / furlong", "METRIC,TZ", "X1000Y2000"),
            "row 3, column 27: found 'furlong', expected digits such as 3:3"},
        Bad{"kicads_comment_has_odd_digits", kicad("33/ absolute / metric", "METRIC,TZ", "X1000Y2000"),
            "row 3, column 11: found '33', expected digits such as 3:3"},
        Bad{"a_comment_of_odd_digits", "M48\n;FILE_FORMAT=44\nMETRIC,TZ\nT1C0.5\n%\nM30\n",
            "row 2, column 1: found ';FILE_FORMAT=44', expected digits such as FILE_FORMAT=4:4"},
        Bad{"two_kinds_of_digits", "M48\nMETRIC,TZ,000.000\nMETRIC,TZ,0000.00\nT1C0.5\n%\nM30\n",
            "row 3, column 11: found '0000.00', expected 3 digits before the point and 3 behind it, as row 2 "
            "has"},
        Bad{"digits_other_than_the_comment", "M48\n;FILE_FORMAT=4:4\nMETRIC,TZ,000.000\nT1C0.5\n%\nM30\n",
            "row 3, column 11: found '000.000', expected 4 digits before the point and 4 behind it, as row 2 "
            "has"},
        Bad{"bad_digits", "M48\nMETRIC,000.0x\nM30\n",
            "row 2, column 8: found '000.0x', expected LZ, TZ or digits"},
        Bad{"unknown_header", "M48\nMETRIC,TZ\n  HOLES,2\nM30\n",
            "row 3, column 3: found 'HOLES,2', expected a command of an Excellon header"},
        Bad{"hole_in_header", "M48\nMETRIC,TZ\nT1C0.5\nX1.0Y1.0\nM30\n",
            "row 4, column 1: found 'X1.0Y1.0', expected a command of an Excellon header; the body begins "
            "behind % or M95"},
        Bad{"hole_in_header_behind_a_tool", "M48\nMETRIC,TZ\nT1C0.5X1.0Y1.0\nM30\n",
            "row 3, column 7: found 'X1.0Y1.0', expected a command of an Excellon header"},
        Bad{"behind_the_end", metric("X1.0Y1.0\nM00\nX2.0Y1.0\n"),
            "row 9, column 1: found 'X2.0Y1.0', expected nothing behind the end of the program in row 8"},
        Bad{"zero_set", metric("G93X1.0Y1.0\n"), "row 7, column 1: found 'G93X1.0Y1.0', expected"},
        Bad{"zero_set_on_the_way", metric("X1.0Y1.0\nG92X0Y0\n"),
            "row 8, column 1: found 'G92X0Y0', expected"},
        Bad{"mirror_x", metric("M80\nX1.0Y1.0\n"), "row 7, column 1: found 'M80', expected"},
        Bad{"mirror_y", metric("M90X1.0\n"), "row 7, column 1: found 'M90X1.0', expected"},
        Bad{"swapped_axes", metric("M70\n"), "row 7, column 1: found 'M70', expected"},
        Bad{"two_rows_of_pins", metric("X1.0Y1.0\nG82X2.0Y1.0\n"),
            "row 8, column 1: found 'G82X2.0Y1.0', " + kPatterns},
        Bad{"eight_pins", metric("N3G83X2.0Y1.0\n"), "row 7, column 3: found 'G83X2.0Y1.0', " + kPatterns},
        Bad{"circle", metric("X2.0Y1.0G84X3.0\n"), "row 7, column 9: found 'G84X3.0', " + kPatterns},
        Bad{"routed_circle", metric("G32X2.0Y1.0A1.0\n"),
            "row 7, column 1: found 'G32X2.0Y1.0A1.0', " + kPatterns},
        Bad{"pattern", metric("M25\nX1.0Y1.0\nM01\nM02X3.0\nM08\n"),
            "row 7, column 1: found 'M25', " + kPatterns},
        Bad{"text", metric("M97,HELLO\n"), "row 7, column 1: found 'M97,HELLO', " + kPatterns},
        Bad{"unknown_g", metric("G77\n"), "row 7, column 1: found 'G77', expected a command that"},
        Bad{"unknown_m", metric(" M77X1.0Y1.0\n"),
            "row 7, column 2: found 'M77X1.0Y1.0', expected a command that"},
        Bad{"unknown_word", metric("X1.0Q7\n"), "row 7, column 5: found 'Q7', expected"},
        Bad{"block_delete", metric("/X1.0Y1.0\n"), "row 7, column 1: found '/X1.0Y1.0', expected"},
        Bad{"tool_behind_a_hole", metric("X1.0Y1.0T2\n"), "row 7, column 9: found 'T2', expected"},
        Bad{"repeat_behind_a_hole", metric("X1.0Y1.0R2X1.0\n"), "row 7, column 9: found 'R2X1.0', expected"},
        Bad{"a_command_without_its_end", metric("M71X1.0Y1.0\n"),
            "row 7, column 4: found 'X1.0Y1.0', expected the end of the row"}),
    [](const auto& test) { return test.param.name; });

TEST(Excellon, UnplatedHolesOfAMixedFileAreTold) {
  EXPECT_THAT(
      read("M48\nMETRIC\n; #@! TF.FileFunction,MixedPlating,1,2\n; #@! TA.AperFunction,NonPlated,NPTH,"
           "ComponentDrill\nT1C0.5\n%\nT1\nX1.0Y1.0\nM30\n")
          .notes,
      ::testing::Contains(::testing::HasSubstr("says that holes are not plated")));
}

}  // namespace
}  // namespace meltstage::motion::detail
