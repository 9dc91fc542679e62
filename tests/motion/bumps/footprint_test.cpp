// SPDX-License-Identifier: Apache-2.0
// Footprints of KiCad (.kicad_mod): which pads hold a bump.
#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(Readers, APadOfCustomShapeIsToldSinceItsMiddleIsNotKnown) {
  const CoordinateFile file = read(
      "a.kicad_mod",
      "(footprint T (pad 1 smd custom (at 1 -2) (size 0.2 0.2) (layers F.Cu))\n(pad 2 smd rect (at 6 -2) "
      "(size 1 1) (layers F.Cu)))");
  EXPECT_EQ(file.points.size(), 2U);
  EXPECT_THAT(file.notes,
              ElementsAre(HasSubstr("1 pad of custom shape, in row 1, holds a bump at the anchor")));
}

TEST_F(Readers, AFootprintWithoutBumpsSaysWhatItHolds) {
  EXPECT_EQ(
      error_of(
          "a.kicad_mod",
          "(footprint T (pad 1 connect rect (at 1 -2) (size 1 1) (layers F.Cu))\n(pad 2 connect rect (at 6 "
          "-2) (size 1 1) (layers F.Cu))\n(pad 3 smd rect (at 7 -2) (size 1 1) (layers F.Paste)))"),
      "found 2 connect pads, first in row 1, 1 copperless aperture in row 3, expected pads of type smd or "
      "thru_hole on a copper layer, which hold the bumps; change the pads' type where they do");
  EXPECT_THAT(error_of("b.kicad_mod", "(footprint T)"),
              ::testing::StartsWith("found no pads, expected pads of type smd"));
}

}  // namespace
}  // namespace meltstage::motion
