// SPDX-License-Identifier: Apache-2.0
// Bumps on the bottom of a board, in files of every kind.
#include <string>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::IsEmpty;

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
        write("a.gbr", paste("")), write("b.gbr", paste("%TF.FileFunction,Paste,Top*%"))})
    EXPECT_THAT(read_coordinate_file(path).notes, IsEmpty()) << path;
}

}  // namespace
}  // namespace meltstage::motion
