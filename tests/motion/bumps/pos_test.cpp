// SPDX-License-Identifier: Apache-2.0
// Placement files of KiCad (.pos).
#include <fmt/format.h>

#include <string>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

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
  EXPECT_THAT(error_of("a.pos", mixed),
              HasSubstr("(Side): found 'bottom', expected top, as the file's '## Side' says"));
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
              HasSubstr("(Side): found 'top', expected bottom, as the file's '## Side' says"));
  for (const char* side : {"top", "F.Cu", "All", "both", "---"})
    EXPECT_EQ(read("d.pos", pos(kPosUnit + fmt::format("## Side : {}\n", side), row)).points.size(), 1U)
        << side;
  EXPECT_EQ(error_of("e.pos", pos(kPosUnit + std::string("## Side : left\n"), row)),
            "row 3, column 11: found side 'left', expected top, bottom, both or All");
}

}  // namespace
}  // namespace meltstage::motion
