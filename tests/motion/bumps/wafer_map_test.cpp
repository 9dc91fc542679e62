// SPDX-License-Identifier: Apache-2.0
// Wafer maps in XML after SEMI G85.
#include <fmt/format.h>

#include <algorithm>

#include "reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const CoordinateOptions kAnywhere{.travel = {{-1e3, 1e3}, {-1e3, 1e3}, {}}};

// Rows stand in the lines from 5 on.
std::string map_of(const std::string& device, const std::string& bins, const std::string& rows) {
  return "<?xml version=\"1.0\"?>\n<Maps><Map WaferId=\"W\">\n<Device Rows=\"2\" Columns=\"3\" " + device +
         ">" + bins + "\n<Data>\n" + rows + "</Data></Device></Map></Maps>\n";
}
std::string row(const std::string& codes) { return "<Row><![CDATA[" + codes + "]]></Row>\n"; }

const std::string kDevice =
    R"(BinType="Ascii" OriginLocation="2" NullBin="." DeviceSizeX="5000" DeviceSizeY="4000")";
const std::string kBins = R"(<Bin BinCode="1" BinQuality="Pass"/><Bin BinCode="X" BinQuality="Fail"/>)";
const std::string kRows = row(".11") + row("1X1");

class WaferMaps : public Readers {
 protected:
  std::string refused(const std::string& from, const std::string& to) const {
    std::string text = map_of(kDevice, kBins, kRows);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return error_of("a.xml", text.replace(at, from.size(), to), kAnywhere);
  }
};

TEST_F(WaferMaps, DiesThatPassAreBumpsInTheirMiddles) {
  const CoordinateFile map = read("a.xml", map_of(kDevice, kBins, kRows), kAnywhere);
  expect_points(map.points, {{5, 0, 5}, {10, 0, 5}, {0, -4, 6}, {10, -4, 6}});
  EXPECT_TRUE(map.has_unit);
  EXPECT_THAT(map.notes, Contains("1 die of bin 'X', which fails, make no bump"));
  EXPECT_THAT(map.notes, Contains(StartsWith("(0, 0) is the middle of the die")));
}

TEST_F(WaferMaps, CodesAreAsLongAsTheTypeSays) {
  const auto with = [](const std::string& type, const std::string& null, const std::string& rows) {
    return map_of(
        fmt::format(R"(BinType="{}" OriginLocation="2" NullBin="{}" DeviceSizeX="5000" DeviceSizeY="4000")",
                    type, null),
        R"(<Bin BinCode="0A" BinQuality="Pass"/><Bin BinCode="010" BinQuality="PASS"/>)"
        R"(<Bin BinCode="00A1" BinQuality="pass"/>)",
        rows);
  };
  for (const std::string& text : {with("Hexadecimal", "FF", row("FF0A0A") + row("0AFFFF")),
                                  with("Decimal", "000", row(" 000 010 010") + row("010\n000 000 ")),
                                  with("Integer2", "0000", row("000000A100A1") + row("00A100000000"))})
    EXPECT_EQ(read("a.g85", text, kAnywhere).points.size(), 3u) << text;
}

TEST_F(WaferMaps, OneBinAloneIsTaken) {
  const std::string bins = kBins + R"(<Bin BinCode="2" BinQuality="Pass"/>)";
  CoordinateOptions options = kAnywhere;
  options.only = "2";
  expect_points(read("a.xml", map_of(kDevice, bins, row("122") + row("1.1")), options).points,
                {{5, 0, 5}, {10, 0, 5}});
}

TEST_F(WaferMaps, WithoutTheSizeOfADieItCountsSteps) {
  const std::string device = R"(BinType="Ascii" OriginLocation="2" NullBin=".")";
  CoordinateOptions options = kAnywhere;
  options.pitch_mm = 2.0;
  const CoordinateFile map = read("a.xml", map_of(device, kBins, kRows), options);
  EXPECT_FALSE(map.has_unit);
  expect_points(map.points, {{2, 0, 5}, {4, 0, 5}, {0, -2, 6}, {4, -2, 6}});
}

TEST_F(WaferMaps, ABinOfUnknownQualityIsTold) {
  const CoordinateFile map =
      read("a.xml", map_of(kDevice, R"(<Bin BinCode="1"/><Bin BinCode="X" BinQuality="Fail"/>)", kRows),
           kAnywhere);
  EXPECT_THAT(map.notes,
              Contains("4 dies of bin '1', of which the map doesn't say whether it passes, make bumps"));
}

TEST_F(WaferMaps, NamesMayHaveANamespace) {
  std::string text = map_of(kDevice, kBins, kRows);
  for (const std::string name : {"Map ", "Device", "Bin ", "Data", "Row"})
    for (std::size_t at = text.find("<" + name); at != std::string::npos; at = text.find("<" + name, at + 6))
      text.insert(at + 1, "semi:");
  for (const std::string name : {"Map>", "Device", "Data", "Row"})
    for (std::size_t at = text.find("</" + name); at != std::string::npos;
         at = text.find("</" + name, at + 7))
      text.insert(at + 2, "semi:");
  EXPECT_EQ(read("a.xml", text, kAnywhere).points.size(), 4u);
}

TEST_F(WaferMaps, WhatIsNotUnderstoodIsRefusedByItsRow) {
  EXPECT_EQ(refused(".11", ".111"), "row 5: Row: found more than 3 dies, expected 3 as Columns says");
  EXPECT_EQ(refused(".11", ".1"), "row 5: Row: found only 2 dies, expected 3 as Columns says");
  EXPECT_EQ(refused(".11", ".17"),
            "row 5: Row: column 3: found bin '7', expected NullBin or one that a Bin names");
  EXPECT_EQ(refused(row("1X1"), ""), "row 3: found 1 Row, expected 2 as Rows says");
  EXPECT_THAT(refused("Rows=\"2\"", "Rows=\"2.5\""), HasSubstr("Rows: found 2.5, expected a whole number"));
  EXPECT_THAT(refused("Columns=\"3\"", "Columns=\"nan\""),
              HasSubstr("Columns: found 'nan', expected a number from 1"));
  EXPECT_THAT(refused("\"2\" NullBin", "\"3\" NullBin"),
              HasSubstr("OriginLocation: found '3', expected 2 (upper left)"));
  EXPECT_THAT(refused("\"Ascii\"", "\"Base64\""), HasSubstr("BinType: found 'Base64', expected Ascii"));
  EXPECT_THAT(refused("NullBin=\".\"", ""), HasSubstr("found no NullBin"));
  EXPECT_THAT(refused("\"Pass\"", "\"Good\""), HasSubstr("BinQuality: found 'Good', expected Pass or Fail"));
  EXPECT_THAT(refused("BinCode=\"X\"", "BinCode=\"1\""), HasSubstr("found bin '1' twice"));
  EXPECT_THAT(refused("5000", "0"), HasSubstr("DeviceSizeX: found '0', expected a number from 1 to"));
  EXPECT_THAT(refused("DeviceSizeY=\"4000\"", ""), HasSubstr("DeviceSizeY: found '', expected a number"));
  EXPECT_THAT(refused("</Maps>", "<Map/></Maps>"), HasSubstr("found 2 of Map, expected one"));
  EXPECT_THAT(refused("</Maps>", ""), HasSubstr("found no sound XML"));
  EXPECT_EQ(refused(row("1X1"), "<Row>1<b>X</b>1</Row>\n"),
            "row 6: Row: found 'b' in it, expected codes alone");
  EXPECT_THAT(refused("DeviceSizeX", "DeviceSizeX=\"1\" DeviceSizeX"),
              HasSubstr("found 'DeviceSizeX' twice"));
  EXPECT_THAT(refused("<Maps>", "<!DOCTYPE m [<!ENTITY r \"1\">]><Maps>"),
              HasSubstr("found entities of its own"));
  EXPECT_EQ(refused("\"Pass\"", "\"Fail\""),
            "found no die that passes, and 5 dies of bins that fail, expected one at least");
  EXPECT_THAT(error_of("a.xml", "<svg/>"), HasSubstr("found 'svg', expected Maps or Map"));
}

TEST_F(WaferMaps, WhatMayMatterAndIsNotReadIsTold) {
  std::string device = kDevice + " AxisDirection=\"UpLeft\" xmlns:x=\"y\" WaferSide=\"Bottom\"";
  const CoordinateFile map =
      read("a.xml",
           map_of(device,
                  R"(<Bin BinCode="1" BinCount="3" BinQuality="Pass"/><Bin BinCode="X" BinQuality="Fail"/>)",
                  kRows),
           kAnywhere);
  EXPECT_THAT(map.notes, Contains("the map's 'AxisDirection' is not read"));
  EXPECT_THAT(map.notes, Contains("the map's 'WaferSide' is not read"));
  EXPECT_THAT(map.notes, Contains("BinCount of bin '1' is 3, and the rows hold 4 dies of it"));
  EXPECT_EQ(read("b.xml", map_of(kDevice, kBins, kRows), kAnywhere).notes.size(), 2u)
      << "nothing else to tell";
}

TEST_F(WaferMaps, ACodeIsACharacterEvenABlank) {
  const std::string blank =
      R"(BinType="Ascii" OriginLocation="2" NullBin=" " DeviceSizeX="5000" DeviceSizeY="4000")";
  expect_points(read("a.xml", map_of(blank, kBins, row(" 11") + row("1  ")), kAnywhere).points,
                {{5, 0, 5}, {10, 0, 5}, {0, -4, 6}});
  EXPECT_EQ(read("b.xml",
                 map_of(kDevice, "<Bin BinCode=\"\u00b5\" BinQuality=\"Pass\"/>",
                        row(".\u00b5\u00b5") + row("\u00b5..")),
                 kAnywhere)
                .points.size(),
            3u);
}

TEST_F(WaferMaps, AMapOfManyDiesIsReadInLinearTime) {
  constexpr int kSide = 1000;
  std::string rows;
  for (int i = 0; i < kSide; ++i) rows += row(std::string(kSide, '1'));
  std::string text = map_of(kDevice, kBins, rows);
  text.replace(text.find("Rows=\"2\" Columns=\"3\""), 20, fmt::format("Rows=\"{0}\" Columns=\"{0}\"", kSide));
  EXPECT_EQ(read("a.xml", text, {.travel = {{-1e4, 1e4}, {-1e4, 1e4}, {}}}).points.size(), 1'000'000u);
}

}  // namespace
}  // namespace meltstage::motion
