// SPDX-License-Identifier: Apache-2.0
// Small files that ask for much: each is refused in one line, soon and in little memory.
#include <gmock/gmock.h>

#include "base/error.hpp"
#include "motion/bumps/coordinates.hpp"
#include "motion/surface/cl_points.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage::motion {
namespace {

using testing::HasSubstr;

class HostileFiles : public testing::Test {
 protected:
  std::string refusal(std::string_view name, std::string_view content) const {
    return refusal_of(folder_.write(name, content));
  }
  static std::string refusal_of(const std::filesystem::path& path) {
    try {
      read_coordinates(path);
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
  /// A workbook whose parts are these, given as expressions of Python.
  std::filesystem::path workbook(const std::string& sheet, const std::string& strings) const {
    const auto script = folder_.write(
        "make.py",
        "import zipfile\n"
        "z = zipfile.ZipFile('" +
            folder_.at("a.xlsx").string() +
            "', 'w', zipfile.ZIP_DEFLATED, compresslevel=1)\n"
            "z.writestr('xl/workbook.xml', '<workbook><sheets><sheet r:id=\"a\"/></sheets></workbook>')\n"
            "z.writestr('xl/_rels/workbook.xml.rels', '<Relationships><Relationship Id=\"a\" "
            "Target=\"s.xml\"/></Relationships>')\n"
            "z.writestr('xl/sharedStrings.xml', " +
            strings +
            ")\n"
            "z.writestr('xl/s.xml', " +
            sheet + ")\nz.close()\n");
    EXPECT_EQ(std::system(("/usr/bin/python3 " + script.string()).c_str()), 0);
    return folder_.at("a.xlsx");
  }

  const ScratchFolder folder_;
};

TEST_F(HostileFiles, TableOfTooManyColumns) {
  EXPECT_THAT(refusal("a.csv", "x,y\n" + std::string(20'000'000, ',')),
              HasSubstr("a.csv: row 2: found more than 16384 columns"));
  EXPECT_THAT(refusal("a.csv", "x,y\n" + std::string(20'000, ',') + "\n"),
              HasSubstr("more than 16384 columns"));
}

TEST_F(HostileFiles, TableOfTooManyCells) {
  std::string rows = "x,y\n";
  for (int i = 0; i < 1300; ++i) rows += "1," + std::to_string(i) + std::string(16'000, ',') + "\n";
  EXPECT_THAT(refusal("a.csv", rows), HasSubstr("a.csv: row 1251: found more than 20000000 cells"));
}

TEST_F(HostileFiles, WorkbookOfTooManyTags) {
  EXPECT_THAT(refusal_of(workbook("'<'*41000000", "'<sst/>'")), HasSubstr("more than 40000000 tags"));
}

TEST_F(HostileFiles, WorkbookOfOneLongTextInManyCells) {
  EXPECT_THAT(refusal_of(workbook("'<worksheet><sheetData><row>' + '<c t=\"s\"><v>0</v></c>'*10000 + "
                                  "'</row></sheetData></worksheet>'",
                                  "'<sst><si><t>' + 'a'*50000000 + '</t></si></sst>'")),
              HasSubstr("found a text of 50000000 bytes that begins 'aaa"));
}

TEST_F(HostileFiles, WorkbookOfDeepXml) {
  EXPECT_THAT(refusal_of(workbook("'<a>'*1000000", "'<sst/>'")), HasSubstr("a.xlsx: "));
  EXPECT_THAT(refusal_of(workbook("'<a>'*1000000 + '</a>'*1000000", "'<sst/>'")), HasSubstr("no points"));
}

TEST_F(HostileFiles, FootprintOfDeepLists) {
  EXPECT_THAT(refusal("a.kicad_mod", "(footprint " + std::string(1'000'000, '(')),
              HasSubstr("nested deeper than 64"));
}

TEST_F(HostileFiles, FootprintOfTooManyWords) {
  std::string words = "(footprint";
  for (int i = 0; i < 5'100'000; ++i) words += " a";
  EXPECT_THAT(refusal("a.kicad_mod", words + ")"), HasSubstr("behind 5000000 words and lists"));
}

TEST_F(HostileFiles, PlacementOfTooManyWords) {
  std::string words = "## Unit = mm,\n";
  for (int i = 0; i < 100'000; ++i) words += " a";
  EXPECT_THAT(refusal("a.pos", words + "\n## End\n"), HasSubstr("row 2: found more than 1000 words"));
}

constexpr const char* kGerber = "%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,0.5*%\n";

TEST_F(HostileFiles, GerberThatRepeatsNothingForLong) {
  EXPECT_THAT(refusal("a.gbr", std::string(kGerber) + "%SRX2000000Y2000000I1J1*%\n%SR*%\nM02*\n"),
              HasSubstr("no points"));
}

TEST_F(HostileFiles, GerberOfAShortAperture) {
  EXPECT_THAT(refusal("a.gbr", "%AD*%\nM02*\n"), HasSubstr("row 1: found 'AD', expected an aperture"));
}

TEST_F(HostileFiles, GerberOfBlocksInBlocks) {
  std::string blocks = kGerber;
  blocks += "%ABD100*%\nD10*\n%SRX1000Y1000I0.001J0.001*%\nX0Y0D03*\n%SR*%\n%AB*%\n";
  for (int i = 101; i < 5000; ++i) {
    const std::string number = std::to_string(i);
    blocks += "%ABD" + number + "*%\nD100*\nX0Y0D03*\n%AB*%\n";
  }
  EXPECT_THAT(refusal("a.gbr", blocks + "M02*\n"), HasSubstr("more than 8000000 flashes in blocks"));
}

TEST_F(HostileFiles, ExcellonOfHugeRepeats) {
  const std::string head = "M48\nMETRIC,TZ\nT1C0.5\n%\nT1\nX1.0Y1.0\n";
  EXPECT_THAT(refusal("a.drl", head + "R99999999999999999999X0.001\nM30\n"),
              HasSubstr("more than 2000000 points"));
}

std::string path_refusal(const std::string& name, const std::string& content) {
  try {
    read_tool_path_text(name, content);
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

TEST(HostilePaths, ManyLinesOfOneNameAreNumbered) {
  std::string apt = "UNITS/MM\nTOOL PATH/A\n";
  for (int i = 0; i < 20'000; ++i) apt += "RAPID\nGOTO/0,0,0\nGOTO/1,0,0\n";
  apt += "FINI\n";
  const auto lines = read_tool_path_text("a.apt", apt);
  ASSERT_EQ(lines.size(), 20'000U);
  EXPECT_EQ(lines[0].name, "A");
  EXPECT_EQ(lines[1].name, "A 2");
  EXPECT_EQ(lines[19'999].name, "A 20000");
}

TEST(HostilePaths, NumbersBeyondAnyMachineAreRefused) {
  EXPECT_THAT(path_refusal("a.apt", "UNITS/MM\nGOTO/0,0,0\nGOTO/1e300,0,0\n"),
              HasSubstr("a.apt: row 3: found the point (1e+300"));
  EXPECT_THAT(path_refusal("a.apt", "UNITS/MM\nGOTO/0,0,0,1e300,1e300,1\n"), HasSubstr("tool axis"));
  EXPECT_THAT(path_refusal("a.ngc", "G21 G1 X0 Y0 Z0\nX9999999\n"), HasSubstr("row 2: found the point"));
  EXPECT_THAT(path_refusal("a.ngc", "G99999999999999999999999 G1 G21 X0 Y0 Z0\n"), HasSubstr("found 'G9999"));
  EXPECT_THAT(path_refusal("a.ngc", "G1 M99999999999999999999 G21 X0 Y0 Z0\n"), HasSubstr("found 'M9999"));
}

TEST(HostilePaths, NamesBringNoControlBytes) {
  EXPECT_EQ(
      read_tool_path_text("a.apt", "UNITS/MM\nTOOL PATH/\x1b[31mA\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n")[0].name,
      "\\x1B[31mA");
}

TEST(HostilePaths, StatementOfTooManyWords) {
  EXPECT_THAT(path_refusal("a.apt", "CUTTER/" + std::string(1'000'000, ',') + "\n"),
              HasSubstr("more than 16384 words"));
}

}  // namespace
}  // namespace meltstage::motion
