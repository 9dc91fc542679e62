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

}  // namespace
}  // namespace meltstage::motion
