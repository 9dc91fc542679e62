// SPDX-License-Identifier: Apache-2.0
// Workbooks (.xlsx), placement files and Gerber layers; damaged files and other people's boards of every
// kind.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "motion/bumps/coordinates.hpp"

namespace meltstage::motion {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

const fs::path examples = fs::path(MELTSTAGE_SOURCE_DIR) / "examples";
const fs::path boards = "/usr/share/doc/gerbv/examples";

class Readers : public ::testing::Test {
 protected:
  Readers() {
    std::string pattern = (fs::temp_directory_path() / "meltstage-readers-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~Readers() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, std::string_view content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }

  std::string error_of(const std::string& name, std::string_view content) const {
    return error_of(write(name, content));
  }

  static std::string error_of(const fs::path& path) {
    try {
      read_coordinates(path);
    } catch (const UserError& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos);
      EXPECT_THAT(message, StartsWith(path.string() + ": "));
      return message.substr(std::min(message.size(), path.string().size() + 2));
    }
    return "read without an error";
  }

  CoordinateFile read(const std::string& name, std::string_view content) const {
    return read_coordinate_file(write(name, content));
  }

  fs::path folder_;
};

std::string read_file(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void expect_points(const std::vector<Point>& points, const std::vector<Point>& expected) {
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(points[i].x_mm, expected[i].x_mm, 1e-9) << "point " << i;
    EXPECT_NEAR(points[i].y_mm, expected[i].y_mm, 1e-9) << "point " << i;
    EXPECT_EQ(points[i].row, expected[i].row) << "point " << i;
  }
}

// ---- .xlsx, written by another maker's library ----

class Xlsx : public Readers {
 protected:
  /// Runs openpyxl over `body`, in which `sheet` is the active sheet of `book`.
  fs::path make(const std::string& body) const {
    const fs::path script =
        write("make.py", "import openpyxl\nbook = openpyxl.Workbook()\nsheet = book.active\n" + body +
                             "\nbook.save('" + (folder_ / "a.xlsx").string() + "')\n");
    EXPECT_EQ(std::system(("/usr/bin/python3 " + script.string()).c_str()), 0);
    return folder_ / "a.xlsx";
  }
};

TEST_F(Xlsx, ReadsColumnsByNameWithTheirUnits) {
  const auto points = read_coordinates(
      make("for row in [['ref', 'Y (um)', 'X (um)'], ['A1', 2500, 1500.5], ['A2', '4000', 3000]]:\n"
           "  sheet.append(row)"));
  expect_points(points, {{1.5005, 2.5, 2}, {3.0, 4.0, 3}});
}

TEST_F(Xlsx, ReadsTheFirstSheetAndKeepsItsRowNumbers) {
  const auto points =
      read_coordinates(make("sheet['B3'] = 1.25\nsheet['D3'] = 7\nsheet['B9'] = 2.5\nsheet['D9'] = 8\n"
                            "book.create_sheet('other').append(['x', 'y'])"));
  expect_points(points, {{1.25, 7.0, 3}, {2.5, 8.0, 9}});
}

TEST_F(Xlsx, HoldsTheSameBumpsAsTheXlsExample) {
  const auto expected = read_coordinates(examples / "bumps_8x8.xls");
  std::string body = "sheet.append(['x', 'y'])\n";
  for (const Point& p : expected) body += fmt::format("sheet.append([{}, {}])\n", p.x_mm, p.y_mm);
  expect_points(read_coordinates(make(body)), expected);
}

TEST_F(Xlsx, BadNumberNamesItsPlace) {
  EXPECT_THAT(error_of(make("sheet.append(['x', 'y'])\nsheet.append([1, 'two'])")),
              StartsWith("row 2, column 2 (y): found 'two', expected a number"));
}

TEST_F(Xlsx, TruthValuesAreNoNumbers) {
  EXPECT_THAT(error_of(make("sheet.append(['x', 'y'])\nsheet.append([1, True])")),
              StartsWith("row 2, column 2 (y): found 'TRUE', expected a number"));
  EXPECT_THAT(error_of(make("sheet.append(['x', 'y'])\nsheet.append([False, 1])")),
              StartsWith("row 2, column 1 (x): found 'FALSE', expected a number"));
}

TEST_F(Xlsx, HiddenRowsAreTold) {
  const auto file = read_coordinate_file(
      make("for row in [['x', 'y'], [1, 2], [3, 4], [5, 6]]:\n  sheet.append(row)\n"
           "sheet.row_dimensions[3].hidden = True\nsheet.row_dimensions[4].hidden = True"));
  EXPECT_EQ(file.points.size(), 3U);
  EXPECT_THAT(file.notes,
              ElementsAre("2 rows, first row 3, are hidden in the sheet and hold bumps all the same"));
}

TEST_F(Xlsx, AHiddenSheetIsPassedOver) {
  for (const std::string state : {"hidden", "veryHidden"}) {
    const auto points = read_coordinates(
        make("sheet.append([1, 2])\nsheet.sheet_state = '" + state +
             "'\nother = book.create_sheet('other')\nother.append([3, 4])\nbook.active = 1"));
    expect_points(points, {{3, 4, 1}});
  }
}

TEST_F(Xlsx, AFormulaWithoutItsValueIsRefused) {
  EXPECT_EQ(
      error_of(make("for row in [['x', 'y'], [1, 2], ['=A2+1', '=B2*2']]:\n  sheet.append(row)")),
      "row 3, column 1 (x): found '=A2+1', expected a number such as 12.5; a formula without its value: "
      "open the file in a spreadsheet program and save it there");
}

TEST_F(Xlsx, NamesMayHaveAPrefix) {
  const std::string script =
      "import zipfile\nm = 'http://schemas.openxmlformats.org/spreadsheetml/2006/main'\n"
      "r = 'http://schemas.openxmlformats.org/officeDocument/2006/relationships'\n"
      "p = 'http://schemas.openxmlformats.org/package/2006/relationships'\n"
      "z = zipfile.ZipFile('" +
      (folder_ / "a.xlsx").string() +
      "', 'w')\n"
      "z.writestr('xl/workbook.xml', f'<x:workbook xmlns:x=\"{m}\" xmlns:q=\"{r}\"><x:sheets><x:sheet "
      "name=\"S\" "
      "sheetId=\"1\" q:id=\"R1\"/></x:sheets></x:workbook>')\n"
      "z.writestr('xl/_rels/workbook.xml.rels', f'<Relationships xmlns=\"{p}\"><Relationship Id=\"R1\" "
      "Target=\"/xl/worksheets/sheet.xml\"/></Relationships>')\n"
      "z.writestr('xl/sharedStrings.xml', f'<x:sst xmlns:x=\"{m}\"><x:si><x:t>x_mm</x:t></x:si><x:si><x:r>"
      "<x:t>y_</x:t></x:r><x:r><x:t>mm</x:t></x:r></x:si></x:sst>')\n"
      "z.writestr('xl/worksheets/sheet.xml', f'<x:worksheet xmlns:x=\"{m}\"><x:sheetData><x:row r=\"1\">"
      "<x:c r=\"A1\" t=\"s\"><x:v>0</x:v></x:c><x:c r=\"B1\" t=\"s\"><x:v>1</x:v></x:c></x:row><x:row "
      "r=\"2\">"
      "<x:c r=\"A2\"><x:v>1.5</x:v></x:c><x:c "
      "r=\"B2\"><x:v>2.5</x:v></x:c></x:row></x:sheetData></x:worksheet>')\n"
      "z.close()\n";
  ASSERT_EQ(std::system(("/usr/bin/python3 " + write("zip.py", script).string()).c_str()), 0);
  expect_points(read_coordinates(folder_ / "a.xlsx"), {{1.5, 2.5, 2}});
}

TEST_F(Xlsx, RowsAndCellsStandWhereTheySay) {
  const fs::path good = make("for row in [['x', 'y'], [1, 2], [3, 4]]:\n  sheet.append(row)");
  const auto changed = [&](const std::string& from, const std::string& to) {
    const fs::path script = write("change.py",
                                  "import zipfile, sys\n"
                                  "a = zipfile.ZipFile(sys.argv[1])\n"
                                  "b = zipfile.ZipFile(sys.argv[2], 'w')\n"
                                  "for name in a.namelist():\n"
                                  "  text = a.read(name)\n"
                                  "  if name.endswith('sheet1.xml'):\n"
                                  "    assert sys.argv[3].encode() in text, text\n"
                                  "    text = text.replace(sys.argv[3].encode(), sys.argv[4].encode())\n"
                                  "  b.writestr(name, text)\n"
                                  "b.close()\n");
    EXPECT_EQ(std::system(fmt::format("/usr/bin/python3 {} {} {} '{}' '{}'", script.string(), good.string(),
                                      (folder_ / "b.xlsx").string(), from, to)
                              .c_str()),
              0);
    return error_of(folder_ / "b.xlsx");
  };
  EXPECT_EQ(changed("r=\"A2\"", "r=\"A3\""),
            "row 2: found cell 'A3', expected cells of this row in order; the workbook is damaged");
  EXPECT_THAT(changed("r=\"A2\"", "r=\"A\""), StartsWith("row 2: found cell 'A'"));
  EXPECT_THAT(changed("r=\"B2\"", "r=\"A2\""), StartsWith("row 2: found cell 'A2'"));
  EXPECT_EQ(changed("<row r=\"3\"", "<row r=\"2\""),
            "row 2: found a row of number '2' behind it, expected rows in order and at most 16777216; the "
            "workbook is damaged");
  EXPECT_THAT(changed("<row r=\"3\"", "<row r=\"4000000000\""),
              StartsWith("row 2: found a row of number '4000000000' behind it"));
  EXPECT_THAT(changed("<row r=\"3\"", "<row r=\"x\""),
              StartsWith("row 2: found a row of number 'x' behind it"));
}

TEST_F(Xlsx, OfAnotherKindOrCutOffIsRefused) {
  EXPECT_THAT(error_of("b.xlsx", read_file(examples / "bumps_8x8.xls")), StartsWith("found an OLE2 file"));
  EXPECT_THAT(error_of("c.xlsx", "x,y\n1,2\n"), StartsWith("found text, expected an Excel workbook"));
  const std::string whole = read_file(make("sheet.append([1, 2])"));
  for (const std::size_t size : {10UL, whole.size() / 2, whole.size() - 5})
    EXPECT_THAT(error_of("d.xlsx", whole.substr(0, size)), HasSubstr("expected an Excel workbook"));
}

TEST_F(Xlsx, ArchiveThatIsNoWorkbookIsRefused) {
  const fs::path script =
      write("zip.py", "import zipfile\nzipfile.ZipFile('" + (folder_ / "e.xlsx").string() +
                          "', 'w').writestr('a.txt', 'x')\n");
  ASSERT_EQ(std::system(("/usr/bin/python3 " + script.string()).c_str()), 0);
  EXPECT_THAT(error_of(folder_ / "e.xlsx"), HasSubstr("no part 'xl/workbook.xml'"));
}

// ---- placement tables ----

constexpr std::string_view kPos =
    "### Footprint positions - created on 2026-01-01 ###\n"
    "### Printed by KiCad version 7.0\n"
    "## Unit = mm, Angle = deg.\n"
    "## Side : top\n"
    "# Ref     Val       Package                PosX       PosY       Rot  Side\n"
    "C1        100 nF    C_0603              12.5000    45.6000   90.0000  top\n"
    "U1        MCU       BGA                 20.0000    30.2500    0.0000  top\n"
    "## End\n";

TEST_F(Readers, PosHoldsABumpAFootprint) {
  expect_points(read("a.pos", kPos).points, {{12.5, 45.6, 6}, {20.0, 30.25, 7}});
}

TEST_F(Readers, PosInInches) {
  std::string text(kPos);
  text.replace(text.find("mm,"), 3, "inches,");
  EXPECT_NEAR(
      read_coordinate_file(write("a.pos", text), {.travel = {{0, 2000}, {0, 2000}, {}}}).points[1].x_mm,
      508.0, 1e-9);
}

TEST_F(Readers, PosThatCantBeUsed) {
  std::string text(kPos);
  EXPECT_THAT(error_of("a.pos", text.substr(0, text.find("## End"))), HasSubstr("## End"));
  EXPECT_THAT(error_of("a.pos", "C1 1 C 1 2 0 top\n"), StartsWith("row 1: found 'C1 1 C 1 2 0 top' before"));
  std::string mixed = text;
  mixed.replace(mixed.rfind("top"), 3, "bottom");
  EXPECT_THAT(error_of("a.pos", mixed), StartsWith("row 7: found side 'bottom'"));
  EXPECT_THAT(error_of("a.pos", text + "C2 1 C 1 2 0 top\n"),
              StartsWith("row 9: found 'C2 1 C 1 2 0 top', expected nothing behind '## End' in row 8"));
  std::string bad = text;
  bad.replace(bad.find("30.2500"), 7, "30,2500");
  EXPECT_THAT(error_of("a.pos", bad), StartsWith("row 7 (PosY): found '30,2500'"));
}

std::string pos(const std::string& head, const std::string& rows) {
  return "### Footprint positions - created on 2026-01-01 ###\n" + head + rows + "## End\n";
}

constexpr const char* kPosUnit = "## Unit = mm, Angle = deg.\n";
constexpr const char* kPosNames = "# Ref Val Package PosX PosY Rot Side\n";

TEST_F(Readers, PosHasACellForEachNameOrKeepsToItsColumns) {
  const std::string head = std::string(kPosUnit) + kPosNames;
  EXPECT_EQ(error_of("a.pos", pos(head, "R1 10k 0402 1.0 2.0 90.0\n")),
            "row 4: found 6 cells, expected 7 (Ref Val Package PosX PosY Rot Side), without blanks in a "
            "cell");
  EXPECT_THAT(error_of("b.pos", pos(head, "R1 0402 1.0 2.0 90.0 top\n")), StartsWith("row 4: found 6 cells"));
  EXPECT_THAT(error_of("c.pos", pos(head, "R1 10 k R_0402 1.0 2.0 90.0 top\n")),
              StartsWith("row 4: found 8 cells, expected 7"));
  EXPECT_EQ(error_of("d.pos", pos(head, "R1 10 k 0402 1.0 2.0 90.0\n")),
            "row 4, column 22 (Side): found '90.0', expected top or bottom");
  EXPECT_THAT(error_of("e.pos", pos(kPosUnit, "R1 10k 0402 1.0 2.0 90.0\n")),
              StartsWith("row 3: found 6 cells, expected 7"));
  // An empty value, as KiCad writes it.
  expect_points(
      read("f.pos", pos(kPosUnit,
                        "# Ref     Val       Package                PosX       PosY       Rot  Side\n"
                        "S1                  SW                  12.5000    45.6000   90.0000  top\n"))
          .points,
      {{12.5, 45.6, 4}});
}

TEST_F(Readers, PosIsReadInTheOrderOfItsNames) {
  const std::string row = "R1 10k R_0402 1.0 2.0 90.0 top\n";
  expect_points(
      read("a.pos", pos(kPosUnit + std::string("# Ref Val Package PosY PosX Rot Side\n"), row)).points,
      {{2, 1, 4}});
  expect_points(
      read("b.pos", pos(kPosUnit + std::string("#Ref Side PosX PosY\n"), "R1 top 1.0 2.0\n")).points,
      {{1, 2, 4}});
  EXPECT_EQ(error_of("c.pos", pos(kPosUnit + std::string("# Ref Val Package PosX Rot Side\n"), row)),
            "row 3: found no column of the name PosY, expected one among the names of the columns");
  EXPECT_EQ(error_of("d.pos", pos(kPosUnit + std::string("# Ref PosX PosX PosY Side\n"), row)),
            "row 3: found two columns of the name PosX, expected one among the names of the columns");
  EXPECT_THAT(error_of("e.pos", pos(kPosUnit + std::string(kPosNames),
                                    row + "# Ref Val Package PosY PosX Rot Side\n")),
              StartsWith("row 5: found other names of columns"));
}

TEST_F(Readers, PosSaysOneUnitAndOneSide) {
  const std::string row = "R1 10k R_0402 1.0 2.0 90.0 top\n";
  EXPECT_EQ(error_of("a.pos", pos(kPosUnit + std::string("## Unit = inches, Angle = deg.\n"), row)),
            "row 3, column 11: found unit 'inches', expected one unit; row 2 has mm");
  EXPECT_EQ(read("b.pos", pos(kPosUnit + std::string(kPosUnit), row)).points.size(), 1U);
  EXPECT_THAT(error_of("c.pos", pos(kPosUnit + std::string("## Side : bottom\n"), row)),
              StartsWith("row 4: found side 'top' behind bumps of side 'bottom', expected one side"));
  for (const char* side : {"top", "F.Cu", "All", "both", "---"})
    EXPECT_EQ(read("d.pos", pos(kPosUnit + fmt::format("## Side : {}\n", side), row)).points.size(), 1U)
        << side;
  EXPECT_EQ(error_of("e.pos", pos(kPosUnit + std::string("## Side : left\n"), row)),
            "row 3, column 11: found side 'left', expected top, bottom, both or All");
}

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

TEST_F(Xlsx, AUnitAboveTheColumnsMayHaveACellOfItsOwn) {
  const std::string body =
      "for row in [['Units used:', '{}'], ['Ref', 'X', 'Y'], ['C1', 1000, 2000]]:\n"
      "  sheet.append(row)";
  expect_points(read_coordinates(make(fmt::format(fmt::runtime(body), "mil"))), {{25.4, 50.8, 3}});
  EXPECT_THAT(error_of(make(fmt::format(fmt::runtime(body), "furlong"))),
              StartsWith("row 1, column 1: found unit 'furlong' above the columns"));
}

TEST_F(Xlsx, TitlesAboveTheNamesOfTheColumnsArePassedOver) {
  expect_points(
      read_coordinates(make("for row in [['Board A'], [], ['Ref', 'X', 'Y'], ['C1', '1000mil', '10.5mm']]:\n"
                            "  sheet.append(row)")),
      {{25.4, 10.5, 4}});
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

std::vector<std::string> bottom_notes(const CoordinateFile& file) {
  std::vector<std::string> notes;
  for (const std::string& note : file.notes)
    if (note.starts_with("the bumps lie on the bottom of the board and mirror_x is false"))
      notes.push_back(note);
  return notes;
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

TEST_F(Readers, APadOfCustomShapeIsToldSinceItsMiddleIsNotKnown) {
  const CoordinateFile file = read(
      "a.kicad_mod",
      "(footprint T (pad 1 smd custom (at 1 -2) (size 0.2 0.2) (layers F.Cu))\n(pad 2 smd rect (at 6 -2) "
      "(size 1 1) (layers F.Cu)))");
  EXPECT_EQ(file.points.size(), 2U);
  EXPECT_THAT(file.notes,
              ElementsAre(HasSubstr("1 pad of custom shape, in row 1, holds a bump at the anchor")));
}

// ---- the bottom of a board ----

std::string paste(const std::string& function) {
  return function + "%FSLAX46Y46*%%MOMM*%%ADD10C,1*%D10*X1000000Y2000000D03*M02*";
}

TEST_F(Readers, BumpsOnTheBottomAreToldUnlessTheyAreMirrored) {
  std::string pos(kPos);
  for (auto at = pos.find(" top\n"); at != std::string::npos; at = pos.find(" top\n"))
    pos.replace(at, 4, " bottom");
  const std::string pad =
      "(footprint \"a\" (layer \"B.Cu\") (pad \"1\" smd rect (at 1 -2) (layers \"B.Cu\" \"B.Paste\")))";
  for (const fs::path& path :
       {write("a.pos", pos), write("a.csv", "x,y,Side\n1,2,bottom\n"),
        write("b.csv", "Designator,Layer,Mid X,Mid Y\nC1,Bottom,1,2\n"), write("a.kicad_mod", pad),
        write("a.gbp", paste("")), write("b.GBP", paste("")),
        write("a.gbr", paste("%TF.FileFunction,Paste,Bot*%")),
        write("b.gbr", paste("G04 #@! TF.FileFunction,Paste,Bot*"))}) {
    EXPECT_EQ(bottom_notes(read_coordinate_file(path)).size(), 1U) << path;
    CoordinateOptions mirrored;
    mirrored.origin_x_mm = 100.0;
    mirrored.mirror_x = true;
    EXPECT_THAT(bottom_notes(read_coordinate_file(path, mirrored)), IsEmpty()) << path;
  }
}

TEST_F(Readers, BumpsOnTheTopOrOnNoSideAreNotToldAsThoseOfTheBottom) {
  for (const fs::path& path :
       {write("a.pos", kPos), write("a.csv", "x,y,Side\n1,2,top\n"), write("b.csv", "x,y\n1,2\n"),
        write("a.gbr", paste("")), write("a.gbp", paste("%TF.FileFunction,Paste,Top*%"))})
    EXPECT_THAT(read_coordinate_file(path).notes, IsEmpty()) << path;
}

// ---- Gerber ----

std::string gerber(std::string_view body) {
  return "%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,0.5*%\n%ADD11R,0.5X0.3*%\n" + std::string(body) + "M02*\n";
}

TEST_F(Readers, GerberFlashesAreBumps) {
  const auto file = read("a.gbr", gerber("D10*\nX1000000Y2000000D03*\nX3500000D03*\nD11*\nY4000000D03*\n"));
  expect_points(file.points, {{1.0, 2.0, 6}, {3.5, 2.0, 7}, {3.5, 4.0, 9}});
  EXPECT_THAT(file.notes, IsEmpty());
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
  expect_points(flash("5,1,3,1,0,2,0*", "").points, {{2, 2, 8}});
  expect_points(flash("4,1,4,0,0,2,0,2,1,0,1,0,0,0*", "").points, {{2, 2.5, 8}});
  expect_points(flash("7,0,1,2,1.5,0.2,0*", "").points, {{1, 3, 8}});
  // Four windows about the flash, a ring, and a middle that is off by less than a digit.
  EXPECT_THAT(flash("21,1,1,1,1,1,0*21,1,1,1,-1,-1,0*", "").notes, IsEmpty());
  expect_points(flash("21,1,1,1,1,1,0*21,1,1,1,-1,-1,0*", "").points, {{1, 2, 8}});
  expect_points(flash("1,1,2,0,0*1,0,1,0,0*", "").points, {{1, 2, 8}});
  expect_points(flash("1,1,2,0.0000001,0*", "").points, {{1, 2, 8}});
  // An angle whose middle is no copper holds the flash.
  const auto angle = flash("4,1,6,-1,-1,9,-1,9,1,1,1,1,9,-1,9,-1,-1,0*", "");
  expect_points(angle.points, {{1, 2, 8}});
  EXPECT_THAT(
      angle.notes,
      ElementsAre("1 flash, in row 8, of a macro with no copper in its middle holds a bump at the flash"));
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
        BadFile{"negative_image", gerber("%IPNEG*%"), "row 5: found 'IPNEG', expected IPPOS"},
        BadFile{"mirrored_image", gerber("%MIA1B0*%"), "row 5: found 'MIA1B0', expected no change"},
        BadFile{"flash_in_region", gerber("D10*G36*\nX0Y0D03*"), "row 6: found 'X0Y0D03', expected no flash"},
        BadFile{"bad_format", "%FSLAX4Y46*%M02*", "row 1: found 'FSLAX4Y46', expected a format"},
        BadFile{"bad_coordinate", gerber("D10*\nX1.5Y0D03*"), "row 6: found 'X1.5Y0D03', expected"},
        BadFile{"too_many_digits", gerber("D10*\nX123456789012D03*"),
                "row 6: found 'X123456789012D03', expected coordinates of at most 10"},
        BadFile{"open_block", gerber("%ABD20*%D10*X0Y0D03*"), "the file ends inside a block"},
        BadFile{"scaled_image", gerber("%SFA1.0B1.01*%"), "row 5: found 'SFA1.0B1.01', expected no change"},
        BadFile{"swapped_axes", gerber("%ASAYBX*%"), "row 5: found 'ASAYBX', expected no change"},
        BadFile{"endless_step", gerber("D10*%SRX2000000Y2000000I1J1*%X0Y0D03*%SR*%"),
                "found more than 2000000 points"},
        BadFile{"too_many_steps", gerber("D10*%SRX2000000000Y2I1J1*%X0Y0D03*%SR*%"),
                "row 5: found 'SRX2000000000Y2I1J1', expected repeats from 1 to 2000000 in X and in Y"},
        BadFile{
            "macro_beside_its_flash", gerber("%AMM*21,1,1,1,3,3,0*21,1,1,1,5,5,0*%%ADD12M*%D12*X0Y0D03*"),
            "row 5: found 'X0Y0D03', expected copper at the flash or in the aperture's middle; D12 has it"},
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

// ---- other people's boards ----

CoordinateOptions wide() {
  CoordinateOptions options;
  options.travel.x = options.travel.y = {-1e5, 1e5};
  return options;
}

// gerbv's example board alone and as a panel of two by three.
TEST(Boards, PanelIsTheBoardRepeated) {
  const auto board = read_coordinates(boards / "dan" / "top.gbx", wide());
  const auto panel = read_coordinates(boards / "dan" / "top_sr.gbx", wide());
  ASSERT_EQ(panel.size(), 6 * board.size());
  auto place = panel.begin();
  for (int column = 0; column < 2; ++column)
    for (int line = 0; line < 3; ++line)
      for (const Point& p : board) {
        EXPECT_NEAR(place->x_mm, p.x_mm + column * 4.0 * 25.4, 1e-9);
        EXPECT_NEAR(place->y_mm, p.y_mm + line * 3.0 * 25.4, 1e-9);
        ++place;
      }
}

TEST(Boards, EveryExampleOfGerbvGivesPointsOrOneLine) {
  int read = 0, refused = 0;
  for (const auto& entry : fs::recursive_directory_iterator(boards)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".gbr" && extension != ".grb" && extension != ".gbx" && extension != ".ger" &&
        extension != ".exc" && extension != ".drl" && extension != ".cnc")
      continue;
    try {
      EXPECT_GT(read_coordinates(entry.path(), wide()).size(), 0U);
      ++read;
    } catch (const UserError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      ++refused;
      if (std::getenv("MELTSTAGE_SHOW_REFUSALS") != nullptr) fmt::print("{}\n", error.what());
    }
  }
  EXPECT_GT(read, 10);
}

std::string damaged(std::string content, std::mt19937& random) {
  if (content.empty()) return content;
  for (std::size_t damages = 1 + random() % 3; damages > 0; --damages) {
    const std::size_t at = random() % content.size();
    switch (random() % 4) {
      case 0:
        content.resize(at + 1);
        break;
      case 1:
        content.erase(at, random() % 8);
        break;
      default:
        content[at] = static_cast<char>(random());
    }
    if (content.empty()) return content;
  }
  return content;
}

TEST_F(Xlsx, DamagedFilesGivePointsOrOneLine) {
  const fs::path book = make("for i in range(40):\n  sheet.append([i, 'a%d' % i, 2 * i])");
  const std::pair<std::string, std::string> originals[] = {
      {"a.xlsx", read_file(book)},
      {"b.pos", std::string(kPos)},
      {"c.gbr", gerber("%ABD20*%D10*X1000000Y0D03*X0Y500000D03*%AB*%\nD20*%SRX3Y2I5.0J4.0*%"
                       "X10000000Y10000000D03*%SR*%\n%LR90*%X20000000D03*\n")},
      {"d.drl", "M48\nMETRIC,TZ\nT1C0.5\n%\nT1\nX1.0Y1.0\nR3X2.0\nG91\nX0.5Y0.5\nM30\n"}};
  std::mt19937 random(20261121);
  int refused = 0;
  constexpr int kFiles = 2000;
  for (int i = 0; i < kFiles; ++i) {
    const auto& [name, content] = originals[random() % std::size(originals)];
    const fs::path path = write(name, damaged(content, random));
    try {
      EXPECT_FALSE(read_coordinates(path).empty());
    } catch (const UserError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      EXPECT_THAT(error.what(), StartsWith(path.string() + ": "));
      ++refused;
    }
  }
  EXPECT_GT(refused, kFiles / 4);
  EXPECT_LT(refused, kFiles);
}

}  // namespace
}  // namespace meltstage::motion
