// SPDX-License-Identifier: Apache-2.0
// Tables as layout systems write them: names, units, titles and sides of the board.
#include <fmt/format.h>

#include <string>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

TEST_F(Readers, PlacementTablesNameTheirColumnsDifferently) {
  expect_points(read("a.csv", "Ref,Val,Package,PosX,PosY,Rot,Side\nC1,1,C,1.5,2.5,0,top\n").points,
                {{1.5, 2.5, 2}});
  expect_points(read("b.csv", "Designator,Mid X (mm),Mid Y (mm)\nC1,1.5,2.5\n").points, {{1.5, 2.5, 2}});
  expect_points(read("c.csv", "Designator,Center-X(mil),Center-Y(mil)\nC1,1000,2000\n").points,
                {{25.4, 50.8, 2}});
}

constexpr std::string_view kAltium =
    "Altium Designer Pick and Place Locations\r\n"
    "C:\\Boards\\Pick Place for A, B.csv\r\n"
    "\r\n"
    "========================================\r\n"
    "File Design Information:\r\n"
    "\r\n"
    "Date:       25/11/26\r\n"
    "Revision:   Not in VersionControl\r\n"
    "Units used: mil\r\n"
    "\r\n";

TEST_F(Readers, TitlesAboveTheNamesOfTheColumnsArePassedOver) {
  const std::string altium(kAltium);
  expect_points(
      read("a.csv", altium + "\"Designator\",\"Comment\",\"Layer\",\"Center-X(mil)\",\"Center-Y(mil)\"\r\n"
                             "\"C1\",\"100 n, 1 %\",\"TopLayer\",\"1000\",\"2000\"\r\n")
          .points,
      {{25.4, 50.8, 12}});
  const auto file = read("b.csv", altium + "Designator,Center-X,Center-Y\r\nC1,1000,2000\r\n");
  expect_points(file.points, {{25.4, 50.8, 12}});
  EXPECT_TRUE(file.has_unit);
  expect_points(read("c.csv", "Board A\nRef;X;Y\nC1;1,5;2,5\n").points, {{1.5, 2.5, 3}});
}

TEST_F(Readers, AUnitAboveTheColumnsIsKnownAndTheirs) {
  const std::string row = "C1,1000,2000\n";
  EXPECT_EQ(error_of("a.csv", "Units used: furlong\nRef,X,Y\n" + row),
            "row 1, column 1: found unit 'furlong' above the columns, expected mm, um, cm, m, mil or in");
  EXPECT_EQ(error_of("b.csv", "Units used:\nRef,X,Y\n" + row),
            "row 1, column 1: found unit '' above the columns, expected mm, um, cm, m, mil or in");
  EXPECT_EQ(error_of("c.csv", "Units used: mil\nRef,Mid X(mm),Mid Y(mm)\n" + row),
            "row 2, column 2: found the unit in 'Mid X(mm)', expected mil, as row 1 says");
  EXPECT_EQ(error_of("d.csv", "Units used: mil\nUnits used: mm\nRef,X,Y\n" + row),
            "row 2, column 1: found unit 'mm' above the columns, expected mil, as row 1 has");
  expect_points(read("e.csv", "\"Units used:\",\"mil\",,\nRef,X,Y\n" + row).points, {{25.4, 50.8, 3}});
  expect_points(read("f.csv", "Units used: um,,\nRef,X (um),Y (um)\n" + row).points, {{1, 2, 3}});
  expect_points(read("g.csv", "Units: mil\nRef,X,Y\n" + row).points, {{25.4, 50.8, 3}});
  EXPECT_THAT(error_of("h.csv", "Unit: inch,,\nRef,X (mm),Y (mm)\n" + row), HasSubstr("as row 1 says"));
}

TEST_F(Readers, NumbersUnderATitleAloneHaveNoNames) {
  EXPECT_THAT(error_of("a.csv", "Board A\n1,2\n"),
              StartsWith("row 1: no column named x and y, found 'Board A'"));
  EXPECT_THAT(error_of("b.csv", "Board A\nRef,Value\nC1,n\n"),
              StartsWith("row 1: no column named x and y, found 'Board A'"));
  EXPECT_THAT(error_of("c.csv", "Board A\n1,2\nx,y\n3,4\n"),
              StartsWith("row 1: no column named x and y, found 'Board A'"));
}

TEST_F(Readers, CellsMayHaveTheirUnits) {
  const auto file = read("a.csv", "Designator,Mid X,Mid Y\nC1,10.5mm,1000mil\nC2,\"1 mm\",2.5 in\n");
  EXPECT_TRUE(file.has_unit);
  expect_points(file.points, {{10.5, 25.4, 2}, {1.0, 63.5, 3}});
  expect_points(read("b.csv", "Designator,Mid X (mm),Mid Y (mm)\nC1,10.5mm,2\n").points, {{10.5, 2.0, 2}});
  EXPECT_THAT(error_of("c.csv", "Ref,X,Y\nC1,1mm,2mm\nC2,3,4\n"),
              StartsWith("row 3, column 2 (x): found '3', expected a unit behind the number, as row 2 has"));
  EXPECT_THAT(error_of("d.csv", "Ref,X,Y\nC1,1,2\nC2,3mm,4mm\n"),
              StartsWith("row 3, column 2: found '3mm', expected no unit"));
  EXPECT_THAT(error_of("e.csv", "Ref,X (mm),Y (mm)\nC1,1mil,2mil\n"),
              StartsWith("row 2, column 2: found '1mil', expected the unit that stands above the column"));
  EXPECT_THAT(error_of("f.csv", "Ref,X,Y\nC1,1kg,2kg\n"), StartsWith("row 2, column 2 (x): found '1kg'"));
}

TEST_F(Readers, PlacementTablesOfTwoSidesAreRefused) {
  EXPECT_THAT(
      error_of("a.csv", "Ref,Val,Package,PosX,PosY,Rot,Side\nC1,1,C,1.5,2.5,0,top\nC2,1,C,3,4,0,bottom\n"),
      StartsWith("row 3: found side 'bottom' behind bumps of side 'top', expected one side"));
  EXPECT_THAT(error_of("b.csv", "Designator,Layer,Mid X,Mid Y\nC1,TopLayer,1,2\nC2,BottomLayer,3,4\n"),
              StartsWith("row 3: found side 'BottomLayer' behind bumps of side 'TopLayer'"));
  EXPECT_THAT(error_of("c.csv", "Designator,Layer,Mid X,Mid Y\nC1,B,1,2\nC2,T,3,4\n"),
              StartsWith("row 3: found side 'T' behind bumps of side 'B'"));
  for (const char* name : {"TB", "T/B", "Board Side", "placement_side", "Layer name", "PCB-Side"})
    EXPECT_THAT(error_of("f.csv", fmt::format("Ref,X,Y,{}\nC1,1,2,T\nC2,3,4,B\n", name)),
                StartsWith("row 3: found side 'B' behind bumps of side 'T'"))
        << name;
  EXPECT_THAT(error_of("g.csv", "Ref,X,Y,Mirror\nC1,1,2,No\nC2,3,4,Yes\n"),
              StartsWith("row 3: found side 'bottom' behind bumps of side 'top'"));
  EXPECT_EQ(read("h.csv", "Ref,X,Y,Outside,Slayer\nC1,1,2,T,T\nC2,3,4,B,B\n").points.size(), 2U);
  // One side in two spellings.
  EXPECT_EQ(read("i.csv", "x,y,Side\n1,2,TopLayer\n3,4,F.Cu\n").points.size(), 2U);
  EXPECT_EQ(read("e.csv", "x,y,Side\n1,2,top\n3,4, Top\n").points.size(), 2U);
}

TEST_F(Readers, SidesHaveTheNamesOfManyLayoutSystems) {
  for (const auto& [top, bottom] : {std::pair("top", "bottom"),
                                    {"Top", "Bot"},
                                    {"T", "B"},
                                    {"F.Cu", "B.Cu"},
                                    {"F.Paste", "B.Paste"},
                                    {"TopLayer", "BottomLayer"},
                                    {"top_layer", "bottom_layer"},
                                    {"TOP SIDE", "BOTTOM SIDE"},
                                    {"Component", "Solder"},
                                    {"Component Side", "Solder Side"},
                                    {"Primary", "Secondary"},
                                    {"upper", "lower"},
                                    {"front", "back"},
                                    {"Oben", "Unten"},
                                    {"Oberseite", "Unterseite"}}) {
    const std::string rows = "x;y;Layer\n1;2;{}\n3;4;{}\n";
    EXPECT_EQ(
        error_of("a.csv", fmt::format(fmt::runtime(rows), top, bottom)),
        fmt::format("row 3: found side '{}' behind bumps of side '{}', expected one side; export them apart",
                    bottom, top));
    EXPECT_EQ(read("b.csv", fmt::format(fmt::runtime(rows), top, top)).notes.size(), 0U) << top;
    EXPECT_EQ(bottom_notes(read("c.csv", fmt::format(fmt::runtime(rows), bottom, bottom))).size(), 1U)
        << bottom;
  }
  EXPECT_THAT(error_of("d.csv", "x;y;Mirror\n1;2;top\n3;4;bottom\n"),
              StartsWith("row 3: found side 'bottom'"));
  EXPECT_THAT(error_of("e.csv", "x;y;SYM_MIRROR\n1;2;NO\n3;4;YES\n"),
              StartsWith("row 3: found side 'bottom'"));
  EXPECT_THAT(error_of("f.csv", "x;y;BoardSide\n1;2;T\n3;4;B\n"), StartsWith("row 3: found side 'B'"));
}

TEST_F(Readers, ASideThatIsNotKnownIsRefused) {
  EXPECT_EQ(error_of("a.csv", "x;y;Board Side\n1;2;top\n3;4;nadir\n"),
            "row 3, column 3 (Board Side): found 'nadir', expected top or bottom, such as TopLayer, F.Cu or "
            "Component Side; leave the column out where it tells no side of a board");
  for (const char* side : {"L1", "1", "0", "Inner", "both", "In1.Cu"})
    EXPECT_THAT(error_of("b.csv", fmt::format("x;y;Layer\n1;2;{}\n", side)),
                StartsWith(fmt::format("row 2, column 3 (Layer): found '{}', expected top or bottom", side)));
  EXPECT_THAT(error_of("c.csv", "x;y;Mirror\n1;2;no\n3;4;perhaps\n"),
              StartsWith("row 3, column 3 (Mirror): found 'perhaps', expected yes or no"));
}

TEST_F(Readers, ASideIsSaidInEachRowOrInNone) {
  EXPECT_EQ(
      error_of("a.csv", "x,y,side\n1,2,\n3,4,bottom\n"),
      "row 2, column 3 (side): found nothing, expected top or bottom, such as TopLayer, F.Cu or Component "
      "Side, as row 3 has one");
  EXPECT_THAT(error_of("b.csv", "x,y,side\n1,2,bottom\n3,4\n"),
              StartsWith("row 3, column 3 (side): found nothing, expected top or bottom"));
  EXPECT_THAT(error_of("c.csv", "x,y,Mirror\n1,2,\n3,4,Yes\n"),
              StartsWith("row 2, column 3 (Mirror): found nothing, expected yes or no, as row 3 has one"));
  EXPECT_EQ(read("d.csv", "x,y,side\n1,2,\n3,4,\n").points.size(), 2U);
}

TEST_F(Readers, AColumnOfCoordinatesMaySaySo) {
  for (const char* names : {"X Coord (um),Y Coord (um)", "X-coordinate(um),Y-coordinate(um)",
                            "x_pos[um],y_pos[um]", "X Location um,Y Location um"})
    expect_points(read("a.csv", fmt::format("{}\n1000,2000\n", names)).points, {{1, 2, 2}});
}

TEST_F(Readers, TwoColumnsOfSidesTellTheSameOne) {
  EXPECT_EQ(error_of("a.csv", "x,y,Side,Layer\n1,2,Top,Bottom\n3,4,Top,Bottom\n"),
            "row 2, column 4 (Layer): found bottom, expected top, as column 3 (Side) tells");
  EXPECT_EQ(read("b.csv", "x,y,Side,Layer\n1,2,Top,F.Cu\n3,4,Top,F.Cu\n").points.size(), 2U);
  EXPECT_EQ(read("c.csv", "x,y,Side,Layer\n1,2,,B.Cu\n3,4,,B.Cu\n").points.size(), 2U);
}

}  // namespace
}  // namespace meltstage::motion
