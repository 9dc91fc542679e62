// SPDX-License-Identifier: Apache-2.0
// Workbooks (.xlsx), written by another maker's library.
#include <fmt/format.h>

#include <string>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const fs::path examples = fs::path(MELTSTAGE_SOURCE_DIR) / "examples";

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

TEST_F(Xlsx, ARowWithoutHeightIsHidden) {
  const fs::path flat = with_sheet_text(make("for row in [['x', 'y'], [1, 2], [3, 4]]:\n  sheet.append(row)"),
                                        "<row r=\"3\"", "<row r=\"3\" ht=\"0\" customHeight=\"1\"");
  EXPECT_THAT(read_coordinate_file(flat).notes,
              ElementsAre("1 row, row 3, is hidden in the sheet and holds a bump all the same"));
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

TEST_F(Xlsx, ARowOfSumsIsNoBump) {
  const auto sums = [&](const std::string& formula) {
    return make_calculated("for row in [['x', 'y'], [1, 2], [3, 4], ['=" + formula + "', '=" + formula +
                               "']]:\n  sheet.append(row)",
                           "7");
  };
  EXPECT_THAT(error_of(sums("SUM(A2:A3)")), StartsWith("row 4: found a formula over the rows above it"));
  EXPECT_THAT(error_of(sums("ROUND(AVERAGE(A2:A3),2)")),
              StartsWith("row 4: found a formula over the rows above it"));
  // A place that is calculated is a bump.
  EXPECT_EQ(read_coordinate_file(sums("MAX(A$2:A3)+4")).points.size(), 3U);
}

// What a spreadsheet made a date of was read as the number of days since 1900.
TEST_F(Xlsx, DatesAndPercentagesAreNoLengths) {
  const auto refused = [&](const std::string& format) {
    return error_of(
        make("sheet.append(['x_um', 'y_um'])\nsheet.append([45050, 2])\nsheet['A2'].number_format = '" +
             format + "'"));
  };
  for (const char* format : {"mm-dd-yy", "d/m", "[h]:mm", "[$-407]d. mmm;@", "h:mm AM/PM"})
    EXPECT_EQ(refused(format),
              "row 2, column 1 (x): found '45050, shown as a date or time', expected a number such as 12.5")
        << format;
  for (const char* format : {"0%", "0.00%", "[Red]0 %"})
    EXPECT_THAT(refused(format), StartsWith("row 2, column 1 (x): found '45050, shown as a percentage'"))
        << format;
}

TEST_F(Xlsx, WhatIsShownInAnotherScaleOrSignIsNoLength) {
  for (const char* format : {"0.000,\" mm\"", "[>=1000]0.000,\" mm\";0\" um\"", "0.00\" mm\";-0.00\" um\"",
                             "0\".\"000\" mm\"", "0.000,", "0,.0", "\"-\"0.0", "-0.0", "\\\\-0.0"})
    EXPECT_THAT(
        error_of(
            make("sheet.append(['x_um', 'y_um'])\nsheet.append([45050, 2])\nsheet['A2'].number_format = '" +
                 std::string(format) + "'")),
        StartsWith("row 2, column 1 (x): found '45050, shown in another scale or sign', expected a number"))
        << format;
}

TEST_F(Xlsx, OtherFormatsShowNumbersAndTheirUnits) {
  const auto with = [&](const std::string& format) {
    return read_coordinate_file(
        make("sheet.append(['x', 'y'])\nsheet.append([100, 200])\n"
             "for c in 'A2', 'B2': sheet[c].number_format = '" +
             format + "'"));
  };
  for (const char* format :
       {"General", "0.00", "#,##0.0_);[Red](#,##0.0)", "0.00E+00", "# ?/?", "@", "\"d\"0.0"}) {
    EXPECT_FALSE(with(format).has_unit) << format;
    expect_points(with(format).points, {{100, 200, 2}});
  }
  for (const char* format : {"0.0\" mil\"", "0.0 \\\\m\\\\i\\\\l", "0.0\"mil\";-0.0\"mil\"",
                             "General\" mil\"", "General\\\\ \"mil\"", "Standard\" mil\"", "0.00 [$mil]",
                             "0.0\" (mil)\"", "0.0\" [mil]\"", "0.0\"mil.\"", "\"mil \"0.00", "@\" mil\""}) {
    EXPECT_TRUE(with(format).has_unit) << format;
    expect_points(with(format).points, {{2.54, 5.08, 2}});
  }
  EXPECT_THAT(error_of(make("sheet.append(['x', 'y'])\nsheet.append([100, 200])\n"
                            "sheet['A2'].number_format = '0.0\" ft\"'")),
              StartsWith("row 2, column 1 (x): found '100 ft'"));
}

// A title may hold a number, as in a text; without names below it nothing is guessed.
TEST_F(Xlsx, ATitleMayHoldANumber) {
  expect_points(
      read_coordinate_file(make("sheet.append(['Project', 'Foo'])\nsheet.append(['Bumps', 128])\n"
                                "sheet.append(['Name', 'X (mm)', 'Y (mm)'])\nsheet.append(['A', 1, 2])"))
          .points,
      {{1, 2, 4}});
  EXPECT_EQ(error_of(make("sheet.append(['A', 1])\nsheet.append(['B', 3, 4])")),
            "row 1: no column named x and y, found 'A', '1'; expected a header with x and y, or numbers");
}

TEST_F(Xlsx, AnEmptyTextOfAFormulaIsABlankCell) {
  const fs::path formulas =
      make("sheet.append(['x', 'y'])\nsheet.append([1, 2])\nsheet.append(['=A9', '=A9'])");
  const fs::path file = with_sheet_text(with_sheet_text(formulas, "<c r=\"A3\"", "<c r=\"A3\" t=\"str\""),
                                        "<c r=\"B3\"", "<c r=\"B3\" t=\"str\"");
  expect_points(read_coordinate_file(file).points, {{1, 2, 2}});
}

// The sign was dropped, and with it the factor of 25.4.
TEST_F(Xlsx, AnInchMarkInAFormatIsItsUnit) {
  for (const char* format : {"0.00\\\\\"", "0.00\"\u2033\"", "0.00\" in\""}) {
    const CoordinateFile file = read_coordinate_file(make(
        "sheet.append(['x', 'y'])\nsheet.append([1, 2])\nfor c in 'A2', 'B2': sheet[c].number_format = '" +
        std::string(format) + "'"));
    EXPECT_TRUE(file.has_unit) << format;
    expect_points(file.points, {{25.4, 50.8, 2}});
  }
}

// The archive's checksum of a part was not compared: a flipped bit was another coordinate.
TEST_F(Xlsx, ADamagedPartIsRefused) {
  const fs::path file = make("sheet.append(['x', 'y'])\nsheet.append([1.5, 2.5])");
  const std::string script =
      "import zipfile\nf = '" + file.string() +
      "'\nz = zipfile.ZipFile(f)\n"
      "parts = {n: z.read(n) for n in z.namelist()}\nz.close()\nz = zipfile.ZipFile(f, 'w')\n"
      "for n, d in parts.items(): z.writestr(n, d)\nz.close()\n"
      "d = open(f, 'rb').read()\nassert d.count(b'<v>2.5</v>') == 1\nopen(f, "
      "'wb').write(d.replace(b'<v>2.5</v>', b'<v>7.5</v>'))\n";
  ASSERT_EQ(std::system(("/usr/bin/python3 " + write("damage.py", script).string()).c_str()), 0);
  EXPECT_EQ(
      error_of(file),
      "part 'xl/worksheets/sheet1.xml' can't be unpacked, expected an undamaged workbook without a password");
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
    return error_of(with_sheet_text(good, from, to));
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

// Their bumps would be lost without a word.
TEST_F(Xlsx, OtherSheetsWithCellsAreTold) {
  const std::string first =
      "sheet.append(['x_mm', 'y_mm'])\nsheet.append([1, 2])\nbook.create_sheet('Empty')\n";
  EXPECT_THAT(read_coordinate_file(make(first)).notes, ::testing::IsEmpty());
  const std::string second = "book.create_sheet('Bottom').append([3, 4])\n";
  EXPECT_THAT(read_coordinate_file(make(first + second)).notes,
              ::testing::ElementsAre("one sheet alone is read, the first that is shown; 'Bottom' has cells "
                                     "too, to be saved as a file of its own"));
  EXPECT_THAT(read_coordinate_file(make(first + second + "book.create_sheet('More').append([5])\n")).notes,
              ::testing::ElementsAre("one sheet alone is read, the first that is shown; 'Bottom' and 1 other "
                                     "sheet have cells too, to be saved "
                                     "as a file of their own"));
  EXPECT_THAT(read_coordinate_file(make(first + second + "book['Bottom'].sheet_state = 'hidden'\n")).notes,
              ::testing::ElementsAre(
                  "one sheet alone is read, the first that is shown; 'Bottom (hidden)' has cells too, to be "
                  "saved as a file of its own"));
  // Written by xlwt: three sheets, the middle one empty.
  EXPECT_THAT(read_coordinate_file(fs::path(MELTSTAGE_SOURCE_DIR) / "tests/motion/data/two_sheets.xls").notes,
              ::testing::ElementsAre("one sheet alone is read, the first that is shown; 'Bottom' has cells "
                                     "too, to be saved as a file of its own"));
}

TEST_F(Xlsx, ANoBreakSpaceMayStandBeforeAUnit) {
  expect_points(read_coordinates(make("sheet.append(['Ref', 'X\\u00a0Pos', 'Y\\u00a0Pos'])\n"
                                      "sheet.append(['C1', '10.5\\u00a0mm', 2])\n"
                                      "sheet['C2'].number_format = '0.0\"\\u202fmm\"'\n")),
                {{10.5, 2, 2}});
}

}  // namespace
}  // namespace meltstage::motion
