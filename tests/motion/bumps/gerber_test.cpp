// SPDX-License-Identifier: Apache-2.0
// Gerber layers: what is a flash, where its bump is, and what is refused.
#include <fmt/format.h>

#include <string>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

TEST_F(Readers, GerberFlashesAreBumps) {
  const auto file = read("a.gbr", gerber("D10*\nX1000000Y2000000D03*\nX3500000D03*\nD11*\nY4000000D03*\n"));
  expect_points(file.points, {{1.0, 2.0, 6}, {3.5, 2.0, 7}, {3.5, 4.0, 9}});
  EXPECT_THAT(file.notes, IsEmpty());
}

TEST_F(Readers, GerberFiducialsAndUnplatedHolesAreSaid) {
  const auto file = read(
      "a.gtp",
      "%FSLAX46Y46*%\n%MOMM*%\n%TA.AperFunction,FiducialPad,Global*%\n%ADD10C,1*%\n%TD*%\n%ADD11C,0.5*%\n"
      "D10*\nX1000000Y1000000D03*\nD11*\nX5000000Y5000000D03*\nM02*\n");
  EXPECT_THAT(
      file.notes,
      ElementsAre("1 flash, in row 8, is a fiducial by the file's own word and makes a bump all the same"));
  EXPECT_THAT(
      read("c.gtp",
           "%FSLAX46Y46*%\n%MOMM*%\nG04 #@! TA.AperFunction,FiducialPad,Global*\n%ADD10C,1*%\nG04 #@! TD*\n"
           "%ADD11C,0.5*%\nD10*\nX1000000Y1000000D03*\nD11*\nX5000000Y5000000D03*\nM02*\n")
          .notes,
      Contains(StartsWith("1 flash, in row 8, is a fiducial")));
  const auto holes =
      read("b.drl", "M48\n; #@! TF.FileFunction,NonPlated,1,2,NPTH\nMETRIC\nT1C0.4\n%\nT1\nX1.0Y2.0\nM30\n");
  EXPECT_THAT(holes.notes, ElementsAre("row 2 says that holes are not plated; they make bumps all the same"));
}

TEST_F(Readers, GerberFlashesOfViasAreTold) {
  EXPECT_THAT(
      read("a.gtl",
           "%FSLAX46Y46*%\n%MOMM*%\n%TA.AperFunction,ViaPad*%\n%ADD10C,1*%\n%TD*%\n%ADD11C,0.5*%\n"
           "D10*\nX1000000Y1000000D03*\nX2000000D03*\nD11*\nX5000000Y5000000D03*\nM02*\n")
          .notes,
      Contains("2 flashes, the first in row 8, are vias by the file's own word and make bumps all the "
               "same"));
}

TEST_F(Readers, ExcellonNumbersHaveDecimalPointsOrNone) {
  EXPECT_THAT(
      error_of("a.drl", "M48\nMETRIC,TZ\nT1C0.4\n%\nT1\nX10Y20\nX12.5Y20\nM30\n"),
      StartsWith(
          "row 7, column 1: found 'X12.5', expected numbers without a decimal point alone, as row 6 has"));
  EXPECT_THAT(
      error_of("b.drl", "M48\nMETRIC,TZ\nT1C0.4\n%\nT1\nX12.5Y20.0\nX0Y0\nX10Y2\nM30\n"),
      StartsWith("row 8, column 1: found 'X10', expected numbers with a decimal point alone, as row 6 has"));
}

TEST_F(Readers, GerberOldStyles) {
  // Leading zeros kept, inches, G54, a flash at the present point, an operation that stays, commands on one
  // line.
  const auto file =
      read("a.gbr", "%FSTAX23Y23*MOIN*%%ADD10C,0.05*%G54D10*G01X01Y02D02*D03*X015*G04 X9D03*\nX1Y1D02*M02*");
  expect_points(file.points, {{25.4, 50.8, 1}, {38.1, 50.8, 1}});
}

TEST_F(Readers, GerberCommandsThatDoNothingAreRead) {
  const auto file =
      read("a.gbr", gerber("%ICAS*%%IPPOS*%%ASAXBY*%%MIA0B0*%%OFA0.00B0.0*%%SFA1.000B1.000*%%IR0*%"
                           "%SRX1Y1*%D10*\nX1000000Y2000000D03*\n"));
  expect_points(file.points, {{1, 2, 6}});
}

TEST_F(Readers, AByteOrderMarkIsPassedOver) {
  const std::string mark = "\xEF\xBB\xBF";
  expect_points(read("a.gbr", mark + gerber("D10*\nX1000000Y2000000D03*\n")).points, {{1, 2, 6}});
  expect_points(
      read("a.pos", mark + "## Unit = mm, Angle = deg.\nC1 1n C_0402 1.0 2.0 0.0 top\n## End\n").points,
      {{1, 2, 2}});
}

TEST_F(Readers, GerberMaySayTheSameTwiceAndEndInMoreThanOneWay) {
  const auto file =
      read("a.gbr", gerber("%FSLAX46Y46*%%MOMM*%G71*D10*\nX1000000Y2000000D03*\nM00*\nG04 by us*\n"));
  expect_points(file.points, {{1, 2, 6}});
}

TEST_F(Readers, GerberIncrementalNotation) {
  expect_points(
      read("a.gbr",
           "%FSLIX46Y46*%%MOMM*%%ADD10C,1*%D10*X1000000Y1000000D03*X1000000D03*X1000000Y500000D03*M02*")
          .points,
      {{1, 1, 1}, {2, 1, 1}, {3, 1.5, 1}});
}

TEST_F(Readers, GerberStepAndRepeat) {
  const auto points =
      read("a.gbr", gerber("D10*\n%SRX3Y2I5.0J4.0*%\nX1000000Y1000000D03*\n%SR*%\nX0Y0D03*\n")).points;
  expect_points(points, {{1, 1, 7}, {1, 5, 7}, {6, 1, 7}, {6, 5, 7}, {11, 1, 7}, {11, 5, 7}, {0, 0, 9}});
}

TEST_F(Readers, GerberBlocksAreFlashedWithTheirTransformation) {
  const auto points =
      read("a.gbr", gerber("%ABD20*%D10*X1000000Y0D03*X0Y500000D03*%AB*%\nD20*\nX10000000Y10000000D03*\n"
                           "%LR90*%X20000000D03*\n%LR0*%%LMX*%%LS2*%X30000000D03*\n"))
          .points;
  expect_points(points, {{11, 10, 5}, {10, 10.5, 5}, {20, 11, 5}, {19.5, 10, 5}, {28, 10, 5}, {30, 11, 5}});
}

TEST_F(Readers, GerberTellsWhatIsNoFlash) {
  const auto file = read(
      "a.gbr", gerber("%AMRR*21,1,1,1,0,0,0*%\n%ADD12RR*%\nD12*\nX1000000Y1000000D03*\n"
                      "D10*X0Y0D02*\nX1000000D01*\nG36*\nX0Y0D02*X1000000D01*Y1000000D01*X0Y0D01*\nG37*\n"
                      "%TF.FileFunction,Paste,Top*%\n"));
  expect_points(file.points, {{1, 1, 8}});
  EXPECT_THAT(file.notes,
              ElementsAre("1 region, in row 11, holds no bump", "1 draw, in row 10, holds no bump"));
}

// $1 wide: a disc beside the flash, and what else a macro may hold.
TEST_F(Readers, GerberMacroHoldsItsBumpInTheMiddleOfItsCopper) {
  const auto flash = [&](const std::string& macro, const std::string& parameters) {
    return read("a.gbr",
                gerber("%AMM*" + macro + "%\n%ADD12M" + parameters + "*%\nD12*\nX1000000Y2000000D03*\n"));
  };
  expect_points(flash("1,1,$1,3.0,0*", ",0.5").points, {{4, 2, 8}});
  expect_points(flash("1,1,$1,3.0,0,90*", ",0.5").points, {{1, 5, 8}});
  expect_points(flash("$3=$1x2+-($2/4)*\n0 a comment*\n21,1,$1,$2,$3,1-0.5,0*", ",1X2").points,
                {{2.5, 2.5, 10}});
  expect_points(flash("22,1,2,1,-1,-0.5,0*", "").points, {{1, 2, 8}});
  expect_points(flash("20,1,0.2,0,0,2,0,0*", "").points, {{2, 2, 8}});
  expect_points(flash("5,1,4,1,0,2,0*", "").points, {{2, 2, 8}});
  // A triangle is the same one in whichever way it is written: corners at 1 and, twice, at -0.5.
  expect_points(flash("5,1,3,0,0,2,0*", "").points, {{1.25, 2, 8}});
  expect_points(flash("5,1,3,2,0,2,0*", "").points, {{3.25, 2, 8}});
  expect_points(flash("4,1,3,1,0,-0.5,0.866025404,-0.5,-0.866025404,1,0,0*", "").points, {{1.25, 2, 8}});
  expect_points(read("b.gbr", gerber("%ADD12P,2X3*%\nD12*\nX1000000Y2000000D03*\n")).points, {{1, 2, 7}});
  expect_points(flash("4,1,4,0,0,2,0,2,1,0,1,0,0,0*", "").points, {{2, 2.5, 8}});
  expect_points(flash("7,0,0,2,0,0*", "").points, {{1, 2, 8}});
  // A middle that is off by less than a digit.
  expect_points(flash("1,1,2,0.0000001,0*", "").points, {{1, 2, 8}});
  // An angle whose middle is no copper holds the flash.
  const auto angle = flash("4,1,6,-1,-1,9,-1,9,1,1,1,1,9,-1,9,-1,-1,0*", "");
  expect_points(angle.points, {{1, 2, 8}});
  EXPECT_THAT(
      angle.notes,
      ElementsAre(
          "1 flash, in row 8, of an aperture with no copper in its middle holds a bump at the flash"));
}

TEST_F(Readers, GerberMacroIsTurnedAndScaledWithItsFlash) {
  const std::string off = "%AMM*1,1,1,3,0*%\n%ADD12M*%\n";
  expect_points(read("a.gbr", gerber(off + "D12*%LR90*%X0Y0D03*%LR0*%%LMX*%%LS2*%X10000000D03*%LMN*%%LS1*%\n"
                                           "%ABD20*%D12*X1000000Y0D03*%AB*%D20*X0Y5000000D03*\n"))
                    .points,
                {{0, 3, 7}, {4, 0, 7}, {4, 5, 8}});
  expect_points(read("b.gbr", "%FSLAX24Y24*%%MOIN*%%AMM*1,1,1,1,0*%%ADD12M*%D12*X0Y0D03*M02*").points,
                {{25.4, 0, 1}});
}

TEST_F(Readers, GerberTellsFlashesWithoutCopperInTheirMiddle) {
  const auto flash = [&](const std::string& aperture) {
    return read("a.gbr", gerber(aperture + "\nD12*\nX1000000Y2000000D03*\n"));
  };
  // A ring, four windows about the flash, a thermal relief, the rings of a moire, and holes in what is
  // standard.
  for (const char* aperture :
       {"%AMM*1,1,2,0,0*1,0,1,0,0*%%ADD12M*%", "%AMM*21,1,1,1,1,1,0*21,1,1,1,-1,-1,0*%%ADD12M*%",
        "%AMM*7,0,0,2,1,0.2,45*%%ADD12M*%", "%AMM*7,0,0,2,0,0.2,45*%%ADD12M*%",
        "%AMM*6,0,0,5,0.5,0.5,2,0,0,0*%%ADD12M*%", "%ADD12C,1X0.5*%", "%ADD12R,1X2X0.5*%",
        "%ADD12O,1X2X0.5*%", "%ADD12P,1X6X0X0.5*%"}) {
    const auto file = flash(aperture);
    expect_points(file.points, {{1, 2, 7}});
    EXPECT_THAT(file.notes,
                ElementsAre("1 flash, in row 7, of an aperture with no copper in its middle holds a bump "
                            "at the flash"))
        << aperture;
  }
  for (const char* aperture :
       {"%AMM*7,0,0,2,0,0,45*%%ADD12M*%", "%AMM*6,0,0,5,0.5,0.5,2,0.1,6,0*%%ADD12M*%",
        "%AMM*6,0,0,5,0.5,0.5,3,0,0,0*%%ADD12M*%", "%ADD12C,1*%", "%ADD12R,1X2*%", "%ADD12P,1X6*%"})
    EXPECT_THAT(flash(aperture).notes, IsEmpty()) << aperture;
  // A moire beside the flash has its middle under its cross.
  expect_points(flash("%AMM*6,2,0,5,0.5,0.5,2,0.1,6,90*%%ADD12M*%").points, {{1, 4, 7}});
}

struct BadFile {
  const char* name;
  std::string content;
  const char* message;
};

class BadGerber : public Readers, public ::testing::WithParamInterface<BadFile> {};
TEST_P(BadGerber, NamesPlaceAndValue) {
  EXPECT_THAT(error_of("a.gtp", GetParam().content), StartsWith(GetParam().message));
}
INSTANTIATE_TEST_SUITE_P(
    All, BadGerber,
    ::testing::Values(
        BadFile{"no_end", "%FSLAX46Y46*%%MOMM*%%ADD10C,1*%D10*X0Y0D03*", "the file ends without M02*"},
        BadFile{"cut_command", "%FSLAX46Y46*%%MOMM*%\n%ADD10C,1*%\nD10*\nX0Y",
                "row 4: the command that begins here has no end"},
        BadFile{"cut_extended", "%FSLAX46Y46*%\n%MOMM*", "row 2: the command that begins here has no end"},
        BadFile{"no_format", "%MOMM*%%ADD10C,1*%D10*X0Y0D03*M02*",
                "row 1: found 'X0Y0D03', expected a format"},
        BadFile{"no_unit", "%FSLAX46Y46*%%ADD10C,1*%D10*\nX0Y0D03*M02*",
                "row 2: found 'X0Y0D03', expected a unit"},
        BadFile{"no_aperture", gerber("X0Y0D03*"), "row 5: found 'X0Y0D03', expected an aperture"},
        BadFile{"unknown_aperture", gerber("D15*"),
                "row 5: found 'D15', expected an aperture that is defined"},
        BadFile{"unknown_macro", gerber("%ADD12FOO*%"), "row 5: found 'FOO', expected C, R, O, P or a macro"},
        BadFile{"clear_flash", gerber("D10*\n%LPC*%\nX0Y0D03*"),
                "row 7: found 'X0Y0D03', expected flashes of dark"},
        BadFile{
            "cleared_flash", gerber("D10*\nX0Y0D03*\n%LPC*%\nG36*\nX-1Y-1D02*\nX1Y1D01*\nG37*"),
            "row 8: found 'G36', expected regions and draws of clear polarity (LPC) before the first flash"},
        BadFile{"cleared_by_draw", gerber("D10*\nX0Y0D03*\n%LPC*%\nX-1Y0D02*\nX1Y0D01*"),
                "row 9: found 'X1Y0D01', expected regions and draws of clear"},
        BadFile{"no_size", gerber("%ADD13C,0*%\nD13*\nX0Y0D03*"),
                "row 7: found 'X0Y0D03', expected an aperture with copper"},
        BadFile{"negative_image", gerber("%IPNEG*%"), "row 5: found 'IPNEG', expected IPPOS"},
        BadFile{"mirrored_image", gerber("%MIA1B0*%"), "row 5: found 'MIA1B0', expected no change"},
        BadFile{"flash_in_region", gerber("D10*G36*\nX0Y0D03*"), "row 6: found 'X0Y0D03', expected no flash"},
        BadFile{"bad_format", "%FSLAX4Y46*%M02*", "row 1: found 'FSLAX4Y46', expected a format"},
        BadFile{"bad_coordinate", gerber("D10*\nX1.5Y0D03*"), "row 6: found 'X1.5Y0D03', expected"},
        BadFile{"too_many_digits", gerber("D10*\nX123456789012D03*"),
                "row 6: found 'X123456789012D03', expected coordinates of at most 10"},
        BadFile{"open_block", gerber("%ABD20*%D10*X0Y0D03*"), "the file ends inside a block"},
        BadFile{"scaled_image", gerber("%SFA1.0B1.01*%"), "row 5: found 'SFA1.0B1.01', expected no change"},
        BadFile{"turned_image", gerber("%IR90*%"), "row 5: found 'IR90', expected no change"},
        BadFile{"swapped_axes", gerber("%ASAYBX*%"), "row 5: found 'ASAYBX', expected no change"},
        BadFile{"endless_step", gerber("D10*%SRX2000000Y2000000I1J1*%X0Y0D03*%SR*%"),
                "found more than 2000000 points"},
        BadFile{"too_many_steps", gerber("D10*%SRX2000000000Y2I1J1*%X0Y0D03*%SR*%"),
                "row 5: found 'SRX2000000000Y2I1J1', expected repeats from 1 to 2000000 in X and in Y"},
        BadFile{
            "macro_beside_its_flash", gerber("%AMM*21,1,1,1,3,3,0*21,1,1,1,5,5,0*%%ADD12M*%D12*X0Y0D03*"),
            "row 5: found 'X0Y0D03', expected copper at the flash or in the aperture's middle; D12 has it"},
        BadFile{
            "thermal_beside_its_flash", gerber("%AMM*7,5,0,2,1,0.2,0*%%ADD12M*%D12*X0Y0D03*"),
            "row 5: found 'X0Y0D03', expected copper at the flash or in the aperture's middle; D12 has it"},
        BadFile{
            "moire_beside_its_flash", gerber("%AMM*6,5,0,5,0.5,0.5,2,0,0,0*%%ADD12M*%D12*X0Y0D03*"),
            "row 5: found 'X0Y0D03', expected copper at the flash or in the aperture's middle; D12 has it"},
        BadFile{"thermal_without_copper", gerber("%AMM*7,0,0,2,2,0.2,0*%%ADD12M*%D12*X0Y0D03*"),
                "row 5: found '7,0,0,2,2,0.2,0' in the macro of aperture D12, which is defined in row 5, "
                "expected an "
                "outer diameter above the inner one"},
        BadFile{"moire_of_many_rings", gerber("%AMM*6,0,0,5,0.5,0.5,1000000,0,0,0*%%ADD12M*%D12*X0Y0D03*"),
                "row 5: found '6,0,0,5,0.5,0.5,1000000,0,0,0' in the macro of aperture D12, which is defined "
                "in row "
                "5, expected 1 to 10000 rings"},
        BadFile{
            "open_outline", gerber("%AMM*4,1,3,0,0,1,0,1,1,0,1,0*%%ADD12M*%D12*X0Y0D03*"),
            "row 5: found '4,1,3,0,0,1,0,1,1,0,1,0' in the macro of aperture D12, which is defined in row 5, "
            "expected an outline whose last point is the first one again"},
        BadFile{"macro_without_copper", gerber("%AMM*1,0,1,0,0*%%ADD12M*%D12*X0Y0D03*"),
                "row 5: found 'X0Y0D03', expected an aperture with copper; D12 has none"},
        BadFile{"macro_of_an_unknown_primitive", gerber("%AMM*99,1*%\n%ADD12M*%\nD12*X0Y0D03*"),
                "row 7: found '99,1' in the macro of aperture D12, which is defined in row 6, expected a "
                "primitive"},
        BadFile{"macro_of_too_few_numbers", gerber("%AMM*1,1,2*%%ADD12M*%D12*X0Y0D03*"),
                "row 5: found '1,1,2' in the macro of aperture D12, which is defined in row 5, expected 5 "
                "numbers"},
        BadFile{"macro_of_another_number_of_corners",
                gerber("%AMM*4,1,3,0,0,1,0,0,0,0*%%ADD12M*%D12*X0Y0D03*"),
                "row 5: found '4,1,3,0,0,1,0,0,0,0' in the macro of aperture D12, which is defined in row 5, "
                "expected an outline with as many points"},
        BadFile{
            "macro_that_divides_by_zero", gerber("%AMM*1,1,1/$1,0,0*%%ADD12M*%D12*X0Y0D03*"),
            "row 5: found '1,1,1/$1,0,0' in the macro of aperture D12, which is defined in row 5, expected "
            "finite numbers"},
        BadFile{"macro_of_bad_numbers", gerber("%AMM*1,1,a,0,0*%%ADD12M*%D12*X0Y0D03*"),
                "row 5: found 'a,0,0' in the macro of aperture D12, which is defined in row 5, expected a "
                "number"},
        BadFile{"bad_parameter", gerber("%AMM*1,1,$1,0,0*%%ADD12M,1Xb*%D12*X0Y0D03*"),
                "row 5: found 'ADD12M,1Xb', expected a number"},
        BadFile{"negative_step", gerber("D10*%SRX-2Y1I1J0*%"),
                "row 5: found 'SRX-2Y1I1J0', expected repeats"},
        BadFile{"no_gerber", "hello", "row 1: the command that begins here has no end"},
        BadFile{"unknown_command", gerber("%XX*%"), "row 5: found 'XX', expected a command"},
        BadFile{"no_end_of_a_block", gerber("D10*\nX0Y0D03\nX7000000Y1000000D03*\n"),
                "row 6: found 'X0Y0D03X7000000Y1000000D03', expected the block's '*' before 'X7000000"},
        BadFile{"x_twice", gerber("D10*\nX0Y0X7000000D03*\n"),
                "row 6: found 'X0Y0X7000000D03', expected X once in a block"},
        BadFile{"y_twice", gerber("D10*\nX0Y0\nY1000000D03*\n"),
                "row 6: found 'X0Y0Y1000000D03', expected Y once in a block"},
        BadFile{"aperture_and_flash", gerber("D10X0Y0D03*\n"),
                "row 5: found 'D10X0Y0D03', expected the block's '*' before 'X0Y0D03'"},
        BadFile{"two_operations", gerber("D10*\nX0Y0D02D03*\n"),
                "row 6: found 'X0Y0D02D03', expected the block's '*' before 'D03'"},
        BadFile{"comment_over_a_flash", gerber("D10*\nG04 first\nX0Y0D03*\nX1000000D03*\n"),
                "row 7: found 'X0Y0D03' inside a comment, expected the comment's '*' before it"},
        BadFile{"flash_behind_the_end", gerber("D10*\nX0Y0D03*\nM02*\nX1000000D03*\n"),
                "row 8: found 'X1000000D03*', expected nothing behind the end of the file in row 7"},
        BadFile{"no_end_of_the_end", gerber("D10*\nX0Y0D03*\nM01\nX1000000D03*\n"),
                "row 7: found 'M01X1000000D03', expected the block's '*' before 'X1000000D03'"},
        BadFile{"another_image_behind_the_end",
                gerber("D10*\nX0Y0D03*\nM02*\n%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,1*%\nD10*\nX1D03*\n"),
                "row 8: found '%FSLAX46Y46*%', expected nothing behind the end of the file in row 7"},
        BadFile{"half_a_block_behind_the_end", gerber("D10*\nX0Y0D03*\nM02*\nX1000000D03\n") + "%",
                "row 8: found 'X1000000D03"},
        BadFile{"two_formats", gerber("%FSLAX35Y35*%"),
                "row 5: found 'FSLAX35Y35', expected one format; row 1 has 'FSLAX46Y46'"},
        BadFile{"two_sides",
                gerber("%TF.FileFunction,Paste,Bot*%\nG04 #@! TF.FileFunction,Paste,Top*D10*X0Y0D03*"),
                "row 6: found 'G04 #@! TF.FileFunction,Paste,Top', expected one side; row 5 has the other"},
        BadFile{"two_units", gerber("D10*X0Y0D03*\n%MOIN*%X1D03*"),
                "row 6: found 'MOIN', expected one unit; row 2 has 'MOMM'"},
        BadFile{"another_old_unit", gerber("G70*"),
                "row 5: found 'G70', expected one unit; row 2 has 'MOMM'"}),
    [](const auto& test) { return test.param.name; });

// The extent of five corners has its middle elsewhere.
TEST_F(Readers, APolygonIsFlashedByItsCentre) {
  const auto points =
      read("a.gbr",
           "%FSLAX46Y46*%\n%MOMM*%\n%ADD10P,1.0X5*%\n%ADD11P,1.0X7X90*%\n%ADD12P,1.0X3X0X0.2*%\nD10*\n"
           "X1000000Y1000000D03*\nD11*\nX5000000Y1000000D03*\nD12*\nX9000000Y1000000D03*\nM02*\n")
          .points;
  expect_points(points, {{1, 1, 7}, {5, 1, 9}, {9, 1, 11}});
}

TEST_F(Readers, LayersThatHoldNoBumpsAreTold) {
  const auto file = [](const char* attributes) {
    return gerber(fmt::format("{}\nD10*\nX0Y0D03*", attributes)) + "M02*\n";
  };
  EXPECT_THAT(read("a.gbr", file("%TF.FileFunction,Copper,L2,Inr*%")).notes,
              Contains(HasSubstr("an inner layer")));
  EXPECT_THAT(read("b.gbr", file("%TF.FileFunction,NonPlated,1,2,NPTH,Drill*%")).notes,
              Contains(HasSubstr("unplated holes")));
  EXPECT_THAT(error_of("c.gbr", file("%TF.FileFunction,Copper,L1,Top*%\n%TF.FilePolarity,Negative*%")),
              HasSubstr("found a copper layer of negative polarity"));
  for (const char* function :
       {"Component,L1,Top", "Legend,Top", "Profile,NP", "Drillmap", "AssemblyDrawing,Top"})
    EXPECT_THAT(read("i.gbr", file(fmt::format("%TF.FileFunction,{}*%", function).c_str())).notes,
                Contains(HasSubstr("which holds no pads")))
        << function;
  // The same in comments, as KiCad writes without X2; and where the ending tells that it is copper.
  const char *layer = "G04 #@! TF.FileFunction,Copper,L1,Top*\n",
             *negative = "G04 #@! TF.FilePolarity,Negative*\n";
  for (const std::string& attributes :
       {std::string(layer) + negative, std::string("%TF.FileFunction,Copper,L1,Top*%\n") + negative,
        layer + std::string("%TF.FilePolarity,Negative*%")})
    EXPECT_THAT(error_of("e.gbr", file(attributes.c_str())), HasSubstr("found a copper layer of negative"));
  for (const char* name : {"f.gtl", "f.gbl"})
    EXPECT_THAT(error_of(name, file("%TF.FilePolarity,Negative*%")),
                HasSubstr("found a copper layer of negative"));
  EXPECT_THAT(error_of("g.gbr", file("%TF.FileFunction,Plane,L2,Inr*%\n%TF.FilePolarity,Negative*%")),
              HasSubstr("found a copper layer of negative"));
  EXPECT_THAT(read("h.gbr", file("%TF.FilePolarity,Negative*%")).notes,
              Contains(HasSubstr("and no row which layer")));
  // A mask is negative as a rule: its flashes are openings.
  EXPECT_EQ(
      read("d.gbr", file("%TF.FileFunction,Soldermask,Top*%\n%TF.FilePolarity,Negative*%")).points.size(),
      1U);
}

}  // namespace
}  // namespace meltstage::motion
