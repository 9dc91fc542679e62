// SPDX-License-Identifier: Apache-2.0
// Tables in the encodings and with the endings that other programs give them.
#include <string>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// UTF-16 of text below U+0100, given in Latin-1.
std::string utf16(std::string_view text, bool big_endian) {
  std::string out = big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : text) out += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
  return out;
}

TEST_F(Readers, SpreadsheetsUnicodeTextIsRead) {
  const std::string text = "Ref\tX (\xB5m)\tY (\xB5m)\r\nC1\t1000\t2000\r\n";
  for (const bool big_endian : {false, true})
    expect_points(read("a.txt", utf16(text, big_endian)).points, {{1, 2, 2}});
  EXPECT_THAT(error_of("b.txt", utf16(text, false) + "x"),
              StartsWith("row 3: found UTF-16 text that breaks off or is damaged, expected UTF-8"));
  EXPECT_THAT(error_of("c.txt", utf16(text, false) + std::string("\x00\xD8\x31\x00", 4)),
              StartsWith("row 3: found UTF-16 text that breaks off"));
}

TEST_F(Readers, LettersOfWindows1252ThatStandAloneAreRead) {
  expect_points(read("a.csv",
                     "Gr\xF6\xDF"
                     "e,H\xF6he,X [\xB5m],Y [\xB5m]\n1,2,1000,2000\n")
                    .points,
                {{1, 2, 2}});
  EXPECT_THAT(error_of("b.csv",
                       "Ref,Lage,X,Y\nC1,R\xFC"
                       "ckseite,1,2\nC2,Vorderseite,3,4\n"),
              HasSubstr("expected one side; say which"));
}

// "Top layer" and "bottom layer" of GBK and CP1251 were words without a meaning, and both sides printed as
// one.
TEST_F(Readers, TextOfAnEncodingThatNothingTellsIsRefused) {
  constexpr std::string_view kMessage =
      "row 2: found letters of an encoding that the file does not tell, expected UTF-8; save the file with "
      "that "
      "encoding";
  EXPECT_EQ(error_of("gbk.csv", "Ref,Side,X,Y\nC1,\xB6\xA5\xB2\xE3,1,2\nC2,\xB5\xD7\xB2\xE3,3,4\n"),
            kMessage);
  EXPECT_EQ(error_of("cp1251.csv", "Ref,S,X,Y\nC1,\xE2\xE5\xF0\xF5,1,2\nC2,\xED\xE8\xE7,3,4\n"), kMessage);
  EXPECT_EQ(error_of("one_letter.csv", "Ref,S,X,Y\nC1,\xC2,1,2\nC2,\xCD,3,4\n"), kMessage);
  EXPECT_EQ(error_of("control.csv",
                     "Ref,S,X,Y\nC1,a\x81"
                     "b,1,2\n"),
            kMessage);
}

TEST_F(Readers, BlanksSeparateWhereNoSignDoes) {
  expect_points(read("a.mnt", "C1  12.70 25.40  90 100nF C0805\nC2  1.5   2.5    0 10k   R0603\n").points,
                {{12.7, 25.4, 1}, {1.5, 2.5, 2}});
  expect_points(
      read("b.txt",
           "Report of board A\nDate: 2026-11-28\nUnits used: mil\n\n"
           "RefDes   X       Y      Layer\nC1       1000    2000   Top\n \"C 2\"  3000    4000   Top  \n")
          .points,
      {{25.4, 50.8, 6}, {76.2, 101.6, 7}});
  expect_points(read("c.csv", "# x_mm y_mm\n1 2\n3 4\n").points, {{1, 2, 2}, {3, 4, 3}});
  EXPECT_EQ(error_of("d.mnt", "C1 12.70 25.40 90 100nF C0805\nC2 1.5 2.5 0 R0603\n"),
            "row 2: found 5 cells, expected 6, as row 1 has; where blanks separate, no cell can be empty: "
            "quote it; a remark begins with '#'");
  EXPECT_THAT(error_of("e.mnt", "C1 12.70 25.40 90 100nF C0805\nC2 1.5 2.5 0 10 k R0603\n"),
              StartsWith("row 2: found 7 cells, expected at most 6, as row 1 has"));
  EXPECT_THAT(read("f.MNB", "C1 12.70 25.40 90 100nF C0805\n").notes,
              Contains(StartsWith("the bumps lie on the bottom of the board")));
}

TEST_F(Readers, TheEndingTxtIsOfTablesAndDrills) {
  expect_points(
      read("a.txt", "; by a layout system\nM48\nMETRIC,TZ,000.000\nT1C0.3\n%\nT1\nX001500Y002500\nM30\n")
          .points,
      {{1.5, 2.5, 7}});
  expect_points(read("b.txt", "x,y\n1.5,2.5\n").points, {{1.5, 2.5, 2}});
}

TEST_F(Readers, ProtelsEndingsTellTheSide) {
  const std::string flash = "%FSLAX24Y24*%\n%MOMM*%\n%ADD10C,0.3*%\nD10*\nX15000Y25000D03*\nM02*\n";
  for (const char* name : {"a.gts", "a.GTL", "a.art"}) EXPECT_TRUE(read(name, flash).notes.empty()) << name;
  for (const char* name : {"a.gbs", "a.GBL"}) EXPECT_EQ(read(name, flash).notes.size(), 1U) << name;
}

TEST_F(Readers, TheRowBelowTheNamesMayHoldTheUnits) {
  const auto file = read("a.csv", "Ref,X,Y,Rot\n,[mil],[mil],deg\nC1,1000,2000,0\n");
  EXPECT_TRUE(file.has_unit);
  EXPECT_EQ(file.unit_place, "row 2, column 2: [mil]");
  expect_points(file.points, {{25.4, 50.8, 3}});
  EXPECT_EQ(error_of("b.csv", "X,Y\nmm,um\n1,2\n"),
            "row 2: found the units 'mm' and 'um', expected one unit for x and y");
  EXPECT_EQ(error_of("c.csv", "X (mm),Y (mm)\nmil,mil\n1,2\n"),
            "row 2: found the units 'mil' and 'mil', expected one unit for x and y, that of row 1, column 1: "
            "X (mm)");
  EXPECT_THAT(error_of("d.csv", "X,Y\nfurlong,furlong\n1,2\n"),
              StartsWith("row 2, column 1 (x): found 'furlong'"));
}

}  // namespace
}  // namespace meltstage::motion
