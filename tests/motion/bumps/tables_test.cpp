// SPDX-License-Identifier: Apache-2.0
// Tables as layout systems write them: names, units, titles and rows without a bump.
#include <fmt/format.h>

#include <string>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

TEST_F(Readers, PlacementTablesNameTheirColumnsDifferently) {
  expect_points(read("a.csv", "Ref,Val,Package,PosX,PosY,Rot,Side\nC1,1,C,1.5,2.5,0,top\n").points,
                {{1.5, 2.5, 2}});
  expect_points(read("b.csv", "Designator,Mid X (mm),Mid Y (mm)\nC1,1.5,2.5\n").points, {{1.5, 2.5, 2}});
  for (const char* names : {"Bump,Bump X (mm),Bump Y (mm)", "Ball,BallX_mm,BallY_mm", "Pad,Pad X mm,Pad Y mm",
                            "Ref,X-mm,Y-mm", "Ref,Xmm,Ymm", "Ref,Pos. X-mm,Pos. Y-mm"})
    expect_points(read("names.csv", std::string(names) + "\nC1,1.5,2.5\n").points, {{1.5, 2.5, 2}});
  expect_points(read("um.csv", "Ref,Xum,Yum\nC1,1500,2500\n").points, {{1.5, 2.5, 2}});
  EXPECT_THAT(error_of("two.csv", "Ref,X,Y,Pad X,Pad Y\nC1,1,2,3,4\n"),
              HasSubstr("found a second column named x"));
  expect_points(read("c.csv", "Designator,Center-X(mil),Center-Y(mil)\nC1,1000,2000\n").points,
                {{25.4, 50.8, 2}});
}

TEST_F(Readers, RowsAboveTheNamesMayHoldANumber) {
  expect_points(read("a.csv", "Date;2024-01-02\nRef;X (mm);Y (mm)\nC1;1,5;2,5\n").points, {{1.5, 2.5, 3}});
  expect_points(read("b.csv", "Wafer map,,\nPitch,150,\nRef,X (um),Y (um)\nC1,1000,2000\n").points,
                {{1, 2, 4}});
  for (const char* title : {"X and Y in mm", "X/Y table", "Y axis up", "\"X = right, Y = up\""})
    expect_points(read("c.csv", std::string(title) + "\nRef,X (mm),Y (mm)\nC1,1,2\n").points, {{1, 2, 3}});
  expect_points(read("d.csv", "1mm,2mm\n3mm,4mm\n").points, {{1, 2, 1}, {3, 4, 2}});
}

TEST_F(Readers, OtherColumnsOfTheAxesAreNotTheirs) {
  expect_points(
      read("a.csv", "Ref,X Offset (mm),Y Offset (mm),X Coord (mm),Y Coord (mm)\nC1,9,9,1.5,2.5\n").points,
      {{1.5, 2.5, 2}});
  expect_points(read("b.csv", "# units: inch\n# x,y are centres\nx,y\n1,2\n").points, {{25.4, 50.8, 4}});
}

TEST_F(Readers, WhatIsSaidOfAnAxisIsNoSecondColumnOfIt) {
  for (const char* names :
       {"X,Y,X Size,Y Size", "X,Y,X Offset,Y Offset", "X,Y,X Tolerance,Y Tolerance", "X,Y,X Error,Y Error",
        "X,Y,X Pitch,Y Pitch", "X,Y,X Rotation,Y Rotation", "X,Y,X Status,Y Status", "X,Y,X Ref,Y/N",
        "Mid X,Mid Y,X Size,Y Size", "x_mm,y_mm,x_error_um,y_error_um", "x_mm,y_mm,x_meas_mm,y_meas_mm",
        "X (mm),Y (mm),X (mm) measured,Y (mm) measured"}) {
    expect_points(read("a.csv", fmt::format("Ref,{}\nC1,1.5,2.5,9,8\n", names)).points, {{1.5, 2.5, 2}});
    const std::string both = names;
    const std::size_t half = both.find(',', both.find(',') + 1);
    expect_points(
        read("b.csv", fmt::format("Ref,{},{}\nC1,9,8,1.5,2.5\n", both.substr(half + 1), both.substr(0, half)))
            .points,
        {{1.5, 2.5, 2}});
  }
  expect_points(read("c.csv", "Ref,X,Y,Y/N\nC1,1.5,2.5,N\n").points, {{1.5, 2.5, 2}});
  const std::string units = ", expected mm, um, cm, m, mil or in";
  EXPECT_EQ(error_of("d.csv", "Ref,X Size,Y Size\nC1,1,2\n"),
            "row 1, column 2: found unit 'size' in the name 'X Size'" + units);
  EXPECT_EQ(error_of("e.csv", "Ref,X,X Size,Y Size\nC1,1,2,3\n"),
            "row 1, column 4: found unit 'size' in the name 'Y Size'" + units);
  EXPECT_EQ(error_of("f.csv", "Ref,x,y,x_mm,y_mm\nC1,1,2,3,4\n"),
            "row 1, column 4: found a second column named x, expected one");
}

// Taken in the unit that was given instead.
TEST_F(Readers, AColumnOfOneAxisUnitTellsIt) {
  for (const char* name : {"X Unit", "Unit X", "XUnit"}) {
    const auto file = read("a.csv", fmt::format("Ref,X,{},Y\nC1,100,mil,50\n", name));
    expect_points(file.points, {{2.54, 1.27, 2}});
    EXPECT_TRUE(file.has_unit);
  }
  EXPECT_EQ(error_of("b.csv", "Ref,X,X Unit,Y,Y Unit\nC1,100,mil,50,mil\n"),
            "row 1, column 5: found a second column of units, expected one");
}

TEST_F(Readers, BlanksThatBreakNoLineAreBlanks) {
  for (const char* blank : {"\u00a0", "\u2007", "\u2009", "\u202f"}) {
    const std::string b = blank;
    const auto file = read("a.csv", "Ref;X;Y\nC1;10,5" + b + "mm;" + b + "2" + b + "mm" + b + "\n");
    expect_points(file.points, {{10.5, 2, 2}});
    EXPECT_TRUE(file.has_unit);
    expect_points(read("b.csv", "X" + b + "(um),Y" + b + "(um)\n1000," + b + "2000\n" + b + ",\n").points,
                  {{1, 2, 2}});
    expect_points(read("c.csv", "Board" + b + "A\nDate,1\nRef,Mid" + b + "X,Mid" + b + "Y\nC1,1,2\n").points,
                  {{1, 2, 4}});
    expect_points(read("d.csv", "Units used:" + b + "mil\nRef,X,Y\nC1,1000,2000\n").points,
                  {{25.4, 50.8, 3}});
    expect_points(read("e.txt", "x y\n1" + b + "mm 2" + b + "mm\n").points, {{1, 2, 2}});
    // Between digits it may stand for thousands.
    EXPECT_EQ(error_of("f.csv", "Ref;X;Y\nC1;1" + b + "234,5;2\n"),
              "row 2, column 2 (x): found '1 234,5', expected a number such as 12.5");
  }
}

constexpr std::string_view kProteus =
    "LABCENTER PROTEUS PICK AND PLACE FILE\n"
    "=====================================\n"
    "\n";

TEST_F(Readers, PlacementFilesOfProteusNameNoColumns) {
  const std::string title(kProteus), rows =
                                         "\"R1\",\"15k, 1%\",\"RES40\",TOP,180,1548,90\n"
                                         "\"R3\",\"7\",\"1206\",TOP,-90,2190.5,-120\n";
  const CoordinateOptions anywhere{.travel = {{-1e4, 1e4}, {-1e4, 1e4}, {}}};
  const auto plain = read("a.csv", title + rows, anywhere);
  expect_points(plain.points, {{1548, 90, 4}, {2190.5, -120, 5}});
  EXPECT_FALSE(plain.has_unit);
  EXPECT_THAT(plain.notes, ::testing::IsEmpty());
  // With the remarks that it may hold, and with a stock code.
  const std::string remarks =
      "Fields: Part ID, Value, Package, Layer, Rotation, X, Y\n"
      "Units: Rotation - degrees, X, Y - thou\n"
      "Notes: The X, Y value is the centre of the package\n\n";
  const auto stated = read("a.pkp", title + remarks + rows, anywhere);
  expect_points(stated.points, {{39.3192, 2.286, 8}, {55.6387, -3.048, 9}});
  EXPECT_TRUE(stated.has_unit);
  expect_points(read("b.txt", title + "\"R1\",\"1\",\"1206\",\"17-4\",BOTTOM,180,10,20\n").points,
                {{10, 20, 4}});
  // Names of columns that someone wrote above the rows are taken, with or without quotes.
  for (const char* header :
       {"Part,Value,Package,Side,X (mm),Y (mm),Angle", "\"Part\",Val,Pack,Side,x_mm,y_mm,R"})
    expect_points(
        read("h.csv", fmt::format("{}{}\n\"R1\",\"1\",\"1206\",TOP,18,19,90\n", title, header)).points,
        {{18, 19, 5}});
  EXPECT_THAT(error_of("i.csv", title + "Part,Side,X,Y\n" + rows),
              StartsWith("row 5: found 'R1', '15k, 1%'"));
  EXPECT_EQ(error_of("c.csv", title + "Units: Rotation - degrees, X, Y - furlong\n" + rows),
            "row 4, column 1: found unit 'furlong' above the columns, expected mm, um, cm, m, mil or in");
  const std::string expected =
      ", expected Part ID, Value, Package, Layer, Rotation, X and Y of a placement file of Proteus, perhaps "
      "with a stock code before the layer";
  EXPECT_EQ(error_of("d.csv", title + "\"R1\",\"1\",\"1206\",180,10,20\n"),
            "row 4: found 'R1', '1', '1206', '180', ..." + expected);
  EXPECT_EQ(error_of("e.csv", title), "found no row that begins with a quote" + expected);
  EXPECT_THAT(error_of("f.csv", title + rows + "\"R4\",\"7\",\"1206\",TOP,0,1\n"),
              HasSubstr("row 6, column 7 (y): found nothing, expected a number"));
  EXPECT_THAT(error_of("g.csv", title + rows + "\"R4\",\"7\",\"1206\",0,TOP,1,2\n"),
              StartsWith("row 6, column 4 (Layer): found '0'"));
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
              StartsWith("row 2, column 2: found '1mil', expected the unit of its column"));
  EXPECT_THAT(error_of("f.csv", "Ref,X,Y\nC1,1kg,2kg\n"), StartsWith("row 2, column 2 (x): found '1kg'"));
}

TEST_F(Readers, AColumnOfCoordinatesMaySaySo) {
  for (const char* names : {"X Coord (um),Y Coord (um)", "X-coordinate(um),Y-coordinate(um)",
                            "x_pos[um],y_pos[um]", "X Location um,Y Location um"})
    expect_points(read("a.csv", fmt::format("{}\n1000,2000\n", names)).points, {{1, 2, 2}});
}

TEST_F(Readers, NamesOfColumnsInManySpellings) {
  for (const char* names :
       {"x (mm)|y (mm)", "x (millimeter)|y (millimeter)", "x (millimetres)|y (millimetres)",
        "x in mm|y in mm", "X_Center|Y_Center", "Position X|Position Y", "Pos. X (mm)|Pos. Y (mm)",
        "Loc X (mm)|Loc Y (mm)", "X Mid [mm]|Y Mid [mm]", "X-Koordinate|Y-Koordinate"}) {
    const std::string both = names;
    const auto bar = both.find('|');
    expect_points(
        read("a.csv", fmt::format("Ref;{};{}\nR1;1;2\n", both.substr(0, bar), both.substr(bar + 1))).points,
        {{1, 2, 2}});
  }
  expect_points(read("b.csv", "x (inches),y (inches)\n1,2\n").points, {{25.4, 50.8, 2}});
  expect_points(read("c.csv", "x (in.),y (in.)\n1,2\n").points, {{25.4, 50.8, 2}});
  expect_points(read("d.csv", "x [thou],y [thou]\n1000,2000\n").points, {{25.4, 50.8, 2}});
  expect_points(read("e.csv", "\"x (\"\")\",\"y (\"\")\"\n1,2\n").points, {{25.4, 50.8, 2}});
  EXPECT_EQ(
      error_of("f.csv", "x in furlong,y in furlong\n1,2\n"),
      "row 1, column 1: found unit 'furlong' in the name 'x in furlong', expected mm, um, cm, m, mil or in");
  EXPECT_THAT(error_of("g.csv", "X,Y,X Center,Y Center\n1,2,3,4\n"),
              HasSubstr("found a second column named x"));
}

TEST_F(Readers, AColumnOfUnitsTellsThoseOfItsRows) {
  const auto file = read("a.csv", "X,Y,Unit\n1000,2000,mil\n1,2,mm\n");
  expect_points(file.points, {{25.4, 50.8, 2}, {1, 2, 3}});
  EXPECT_TRUE(file.has_unit);
  EXPECT_EQ(file.unit_place, "row 2, column 3 (Unit): mil");
  expect_points(read("b.csv", "x_mm,y_mm,Units\n1,2,mm\n").points, {{1, 2, 2}});
  expect_points(read("c.csv", "Einheit;X;Y\num;1000;2000\n").points, {{1, 2, 2}});
  expect_points(read("d.csv", "X,Y,Unit\n1,2,\n").points, {{1, 2, 2}});
  EXPECT_EQ(error_of("e.csv", "x_mm,y_mm,Unit\n1,2,mm\n3,4,mil\n"),
            "row 3, column 3 (Unit): found unit 'mil', expected that of row 1, column 1: x_mm");
  EXPECT_EQ(error_of("f.csv", "Units: mm\nRef,X,Y,Unit\nR1,1,2,mil\n"),
            "row 3, column 4 (Unit): found unit 'mil', expected that of row 1: mm");
  EXPECT_EQ(
      error_of("g.csv", "X,Y,Unit\n1,2,pcs\n"),
      "row 2, column 3 (Unit): found 'pcs', expected mm, um, cm, m, mil or in; leave the column out where it "
      "tells no unit of x and y");
  EXPECT_EQ(error_of("h.csv", "X,Y,Unit\n1,2,mm\n3,4,\n"),
            "row 3, column 3 (Unit): found nothing, expected a unit, as row 2 has one");
  EXPECT_EQ(error_of("i.csv", "X,Y,Unit\n1mm,2mm,mil\n"),
            "row 2, column 1: found '1mm', expected the unit of its row");
  EXPECT_EQ(error_of("j.csv", "X,Y,Unit,Units\n1,2,mm,mm\n"),
            "row 1, column 4: found a second column of units, expected one");
  EXPECT_THAT(error_of("k.csv", "x_mm,y_mm,Unit\n1,2,mm\n3,4mil,mm\n"),
              StartsWith("row 3, column 2: found '4mil', expected the unit of its column"));
}

TEST_F(Readers, AUnitAboveTheColumnsIsSaidInManyWays) {
  for (const char* line :
       {"Units: inches", "Units,inches", "Unit = inch", "units inch", "Dimensions in inches",
        "All dimensions are in inches", "# Units: inch", "# unit = in, by us", "Einheit: Zoll"})
    expect_points(read("a.csv", fmt::format("{}\nRef,X,Y\nR1,1,2\n", line)).points, {{25.4, 50.8, 3}});
  expect_points(read("b.csv", "# units: inch\n1,2\n").points, {{25.4, 50.8, 2}});
  EXPECT_EQ(read("c.csv", "# unit cell of the board\n1,2\n").has_unit, false);
  EXPECT_THAT(error_of("d.csv", "# units: inch\nx_mm,y_mm\n1,2\n"),
              HasSubstr("expected inch, as row 1 says"));
}

TEST_F(Readers, UnitsInCells) {
  expect_points(read("a.csv", "X,Y\n1000thou,1000 \u00b5m\n").points, {{25.4, 1, 2}});
  expect_points(read("b.csv", "X;Y\n\"1\"\"\";2 in.\n").points, {{25.4, 50.8, 2}});
  expect_points(read("c.csv", "X;Y\n1 inch;2. mm\n").points, {{25.4, 2, 2}});
}

TEST_F(Readers, NumbersInThousandsAreRefused) {
  for (const char* number : {"\"1,234.5\"", "\"1.234,5\"", "1 234.5", "1'234.5"})
    EXPECT_THAT(
        error_of("a.csv", fmt::format("x_um,y_um\n{},2\n", number)),
        AllOf(StartsWith("row 2, column 1 (x): found '1"), HasSubstr("expected a number such as 12.5")))
        << number;
  EXPECT_THAT(error_of("b.csv", "x_um;y_um\n1,234.5;2\n"),
              StartsWith("row 2, column 1 (x): found '1,234.5'"));
}

TEST_F(Readers, RowsThatHoldNoBump) {
  EXPECT_EQ(error_of("a.csv", "Ref,X,Y\nR1,1,2\nR2,3,4\nTotal,4,6\n"),
            "row 4: found a row of totals, expected a bump; leave it out, or give it a label with a number "
            "if it is one");
  EXPECT_THAT(error_of("b.csv", "Ref,X,Y\nR1,1,2\nTotal: 1,,\n"),
              StartsWith("row 3, column 2 (x): found nothing"));
  EXPECT_THAT(error_of("c.csv", "Ref,X,Y\nR1,1,2\nSumme: 1,3,4\n"),
              StartsWith("row 3: found a row of totals"));
  for (const char* word : {"Somme", "Totale", "\u5408\u8ba1", "\u03a3", "Std dev", "Range", "max"})
    EXPECT_THAT(error_of("g.csv", fmt::format("Ref,X,Y\nR1,1,2\n{},3,4\n", word)),
                StartsWith("row 3: found a row of totals"))
        << word;
  EXPECT_EQ(read("d.csv", "Net,X,Y\nSUM,1,2\nOUT,3,4\n").points.size(), 2U);
  EXPECT_THAT(error_of("e.csv", "x,y\n1,2\nx,y\n3,4\n"), StartsWith("row 3, column 1 (x): found 'x'"));
  EXPECT_THAT(error_of("f.csv", "x,y,x,y\n1,2,3,4\n"), HasSubstr("found a second column named x"));
}

TEST_F(Readers, ARowThatSumsUpTheOthersIsNoBump) {
  EXPECT_THAT(error_of("a.csv", "Ref,X,Y\nR1,1,2\nR2,3,5\nKaikki,4,7\n"),
              StartsWith("row 4: found the sum of the rows above it"));
  EXPECT_THAT(error_of("b.csv", "Ref,X,Y\nR1,1,2\nR2,3,5\n,2,3.5\n"),
              StartsWith("row 4: found the mean of the rows above it"));
  EXPECT_THAT(error_of("c.csv", "Ref,X,Y\nR1,1,3\nR2,3,5\nSztuk,2,2\n"),
              StartsWith("row 4: found the count of the rows above it"));
  // A bump that happens to lie there.
  EXPECT_EQ(read("d.csv", "Ref,X,Y\nR1,1,2\nR2,3,5\nR3,4,7\n").points.size(), 3U);
  EXPECT_EQ(read("e.csv", "x,y\n1,2\n3,5\n4,7\n").points.size(), 3U);
}

TEST_F(Readers, XAndYHaveOneUnit) {
  EXPECT_EQ(error_of("a.csv", "x_mm,y_inch\n1,2\n"),
            "row 1: found 'x_mm' and 'y_inch', expected one unit for x and y");
}

TEST_F(Readers, ALastRowWithoutItsLineEndIsSaid) {
  EXPECT_THAT(read("a.csv", "x_mm,y_mm\n1,2\n10,2").notes,
              Contains(StartsWith("row 3 has no line end; if the file was cut off there")));
}

TEST_F(Readers, TabsAndTypographicMinus) {
  EXPECT_EQ(read("a.tsv", "x_mm\ty_mm\n1.5\t2\n3\t.5\n").points.size(), 2U);
  EXPECT_THAT(error_of("a.csv", "x,y\n\u22121.5,2\n"), HasSubstr("x is -1.5 mm on the stage"));
  EXPECT_THAT(error_of("b.csv", "x,y\n\u2212-1,2\n"), HasSubstr("expected a number"));
}

TEST_F(Readers, CommasThatMayStandBetweenThousandsAreRefused) {
  EXPECT_EQ(error_of("a.csv", "Ref;x_um;y_um\nA;1,234;2,500\nB;950;10\nC;12,000;1,000\n"),
            "found '1,234' in row 2 and '950' in row 3, expected numbers of which a comma is no mark between "
            "thousands; "
            "write points before decimals, or no marks between thousands");
  // Decimal commas beyond doubt: another number of decimals, none before the comma, or a large number
  // without.
  for (const char* rows : {"1,234;2,5\n950;10\n", "0,234;2,500\n950;10\n", "1,234;2,500\n9500;10\n",
                           "1,234;2,500\n3,000;-4,125\n"})
    EXPECT_EQ(read("b.csv", std::string("x_um;y_um\n") + rows, {.travel = {{-1e3, 1e3}, {-1e3, 1e3}, {}}})
                  .points.size(),
              2U)
        << rows;
  // Points may be such marks, too, where whole numbers stand beside them and the unit is a small one.
  EXPECT_THAT(read("p.csv", "x_um;y_um\n1.234;950\n3.000;10\n").notes,
              testing::Contains(
                  "the points are read as decimal marks; '1.234' in row 2 and '950' in row 2 may mean that "
                  "they stand between thousands"));
  for (const char* table : {"x_mm;y_mm\n1.234;950\n", "x_um;y_um\n1.234;9.5\n", "x_um;y_um\n0.234;950\n",
                            "x_um;y_um\n1.234;9500\n"})
    EXPECT_THAT(read("p.csv", table, {.travel = {{-1e3, 1e3}, {-1e3, 1e3}, {}}}).notes,
                Not(testing::Contains(HasSubstr("points are read"))))
        << table;
}

TEST_F(Readers, CommasOfWhichEachMayStandBetweenThousandsAreTold) {
  const auto notes = read("a.txt", "Pad\tX (um)\tY (um)\n1\t1,250\t2,500\n2\t1,250\t3,750\n").notes;
  EXPECT_THAT(notes, Contains(HasSubstr("the commas are read as decimal marks, '1,250' in row 2 too")));
}

TEST_F(Readers, DecimalCommasThatSeparateCellsAreRefused) {
  for (const char* text :
       {"Ref,X (mm),Y (mm),Value,Note\nC1,1,5,2,100n,\nC2,3,7,4,1u,\n", "x_mm,y_mm\n1,5,,\n2,6,,\n"})
    EXPECT_THAT(error_of("a.csv", text),
                HasSubstr("where a comma is the decimal mark, separate the cells by ';'"))
        << text;
  EXPECT_EQ(read("b.csv", "x_mm,y_mm\n1.5,2,\n2,6.5,\n").points.size(), 2U);
}

TEST_F(Readers, ASentenceAboveTheTableMayTellItsUnit) {
  for (const char* const sentence :
       {"# X,Y in mils.  rotation in degrees.", "# Koordinaten in mil", "# Alle Ma\u00dfe in mil",
        "# Ma\u00dfeinheit: mil", "# Measurement units: mil", "# Position units: mil", "# (mil)",
        "// units: mil", "# All coordinates are given in mils."}) {
    expect_points(read("a.csv", std::string(sentence) + "\nRef,X,Y\nC1,100,200\n").points, {{2.54, 5.08, 3}});
  }
}

TEST_F(Readers, RowsThatAreCommentedOutAreRefused) {
  for (const char* sign : {"#", ";", "//", "# "})
    EXPECT_EQ(error_of("a.csv", std::string("Ref,X (mm),Y (mm)\nA,1,2\n") + sign + "B,3,4\nC,5,6\n"),
              std::string("row 3: found '") + sign +
                  "B' at its beginning, expected a bump; take rows out that are none");
}

TEST_F(Readers, LabelsMayAllBeNumberedByASign) {
  EXPECT_EQ(read("a.csv", "Bump,X (mm),Y (mm)\n#1,1,2\n#2,3,4\n").points.size(), 2U);
}

TEST_F(Readers, SubtotalsAmongTheRowsAreNoBumps) {
  for (const char* row :
       {"Subtotal,4,6", "Mean,2,3", "Count:,2,2", "Total bumps,2,2", "Summe X/Y,4,6", "Avg.,2,3",
        "Std. Abw.,2,3", "Number of bumps,2,2", "Total (2 bumps),4,6", "Gesamtsumme,4,6"})
    EXPECT_EQ(
        error_of("a.csv", std::string("Group,X_mm,Y_mm\nA1,1,2\nA2,3,4\n") + row + "\nB1,10,2\nB2,30,4\n"),
        "row 4: found a row of totals, expected a bump; leave it out, or give it a label with a number if it "
        "is one")
        << row;
}

TEST_F(Readers, RowsThatSayTheyAreNoBumpsAreTold) {
  const auto notes = [&](const std::string& table) { return read("a.csv", table).notes; };
  const std::string unpopulated = "which may mean that no bump is wanted there, and ";
  EXPECT_THAT(notes("Bump,X_mm,Y_mm,Type\nA1,1,2,ball\nA2,3,4,depopulated\n"),
              Contains("1 row, row 3, says 'depopulated', " + unpopulated + "makes a bump all the same"));
  EXPECT_THAT(notes("Bump,X_mm,Y_mm,Status\nA1,1,2,DNP\nA2,3,4,\nA3,5,6,Do not populate\n"),
              Contains("2 rows, first row 2, say 'DNP', " + unpopulated + "make bumps all the same"));
  EXPECT_THAT(notes("Bump,X_mm,Y_mm,Populate\nA1,1,2,yes\nA2,3,4,no\n"),
              Contains(HasSubstr("row 3, says 'no', " + unpopulated)));
  EXPECT_THAT(notes("Bump,X_mm,Y_mm,DNP\nA1,1,2,\nA2,3,4,x\n"),
              Contains(HasSubstr("row 3, says 'x', " + unpopulated)));
  EXPECT_THAT(notes("Bump,X_mm,Y_mm,Skip\nA1,1,2,\nA2,3,4,yes\n"),
              Contains(HasSubstr("row 3, says 'yes', " + unpopulated)));
  EXPECT_THAT(notes("Bump,X_mm,Y_mm,Remark\nA1,1,2,\nA2,3,4,Exclude\n"),
              Contains(HasSubstr("row 3, says 'Exclude', " + unpopulated)));
  EXPECT_THAT(notes("Bump,X_mm,Y_mm,Type\nA1,1,2,ball\nA2,3,4,Fiducial\n"),
              Contains("1 row, row 3, says 'Fiducial', which may mean a mark for alignment, and makes a bump "
                       "all the same"));
  EXPECT_THAT(
      notes("Ball,X_mm,Y_mm\nA1,1,2\nOrigin,0,0\nDie edge LL,5,5\n"),
      Contains("2 rows, first row 3, say 'Origin', which may mean the outline or the origin, and make "
               "bumps all the same"));
  EXPECT_THAT(notes("Die size,5,6\nA1,1,2\nA2,3,4\n"), Contains(HasSubstr("row 1, says 'Die size'")));
  EXPECT_THAT(notes("Ball,X_mm,Y_mm,Net\nA1,1,2,EDGE_CLK\nA2,3,4,NO\nA3,5,6,TOP\n"),
              Not(Contains(HasSubstr("may mean"))));
}

// The names "Signal Name" and the value "A 1" make four cells of three each.
TEST_F(Readers, NamesOfTwoWordsAmongBlanksAreTold) {
  EXPECT_THAT(read("a.csv", "Ball X_mm Y_mm Signal Name\nA 1 10 20 VDD\nA 2 11 21 VSS\n").notes,
              Contains("blanks part the columns, so 'Signal' and 'Name' are two of them; x is column 2 and y "
                       "column 3"));
  EXPECT_THAT(read("b.csv", "Ball X_mm Y_mm Net\nA1 10 20 VDD\n").notes, IsEmpty());
}

TEST_F(Readers, UnitsInColumnsWithoutANameAreRefused) {
  EXPECT_EQ(error_of("a.csv", "Ref,X,,Y,\nR1,10.5,mm,20.25,mm\n"),
            "row 2, column 3: found 'mm' in a column without a name, expected the name Unit above it");
  EXPECT_THAT(error_of("b.csv", "Ref,X,Y\nR1,10.5,20.25,mil\n"), HasSubstr("found 4 cells"));
  expect_points(read("c.csv", "Ref,X (mm),,Y (mm)\nR1,10.5,,20.25\n").points, {{10.5, 20.25, 2}});
}

// gEDA and pcb-rnd write so.
TEST_F(Readers, RemarksMayFollowNamesThatBeginSo) {
  const std::string rows = "R1,\"RES 0603\",413.3858,797.2441,top\n";
  const CoordinateFile file =
      read("a.csv",
           "# RefDes, Description, X (mil), Y (mil), top/bottom\r\n# X,Y in mils.  rotation in degrees.\r\n# "
           "----\r\n" +
               rows,
           {.travel = {{-1e3, 1e3}, {-1e3, 1e3}, {}}});
  ASSERT_EQ(file.points.size(), 1U);
  EXPECT_NEAR(file.points[0].x_mm, 10.5, 1e-6);
  EXPECT_EQ(file.points[0].row, 4U);
  // A row of numbers is none.
  expect_points(read("b.csv", "#,x,y\n#1,1,2\n#2,3,4\n").points, {{1, 2, 2}, {3, 4, 3}});
}

TEST_F(Readers, AQuotedCellMayBeEmptyWhereBlanksSeparate) {
  expect_points(read("a.txt", "X Y Val\n1 2 \"\"\n3 4 \"\"\n").points, {{1, 2, 2}, {3, 4, 3}});
  EXPECT_THAT(error_of("b.txt", "X Y Val\n1 2\n"), HasSubstr("no cell can be empty"));
}

}  // namespace
}  // namespace meltstage::motion
