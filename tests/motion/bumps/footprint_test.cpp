// SPDX-License-Identifier: Apache-2.0
// Footprints of KiCad (.kicad_mod): which pads hold a bump.
#include <fmt/format.h>

#include <array>
#include <vector>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr Travel kAnywhere{{-1e3, 1e3}, {-1e3, 1e3}, {}};

TEST_F(Readers, APadOfCustomShapeIsToldSinceItsMiddleIsNotKnown) {
  const CoordinateFile file = read(
      "a.kicad_mod",
      "(footprint T (pad 1 smd custom (at 1 -2) (size 0.2 0.2) (layers F.Cu))\n(pad 2 smd rect (at 6 -2) "
      "(size 1 1) (layers F.Cu)))");
  EXPECT_EQ(file.points.size(), 2U);
  EXPECT_THAT(file.notes,
              ElementsAre(HasSubstr("1 pad of custom shape, in row 1, holds a bump at the anchor")));
}

TEST_F(Readers, LinesBehindAHashAreComments) {
  const CoordinateFile file =
      read("a.kicad_mod",
           "# pads\n(footprint T\n  (pad 1 smd rect (at 1 -2) (size 1 1) (layers F.Cu))\n  # (pad 2 smd rect "
           "(at 6 -2) (size 1 1) "
           "(layers F.Cu))\n  (descr #3)\n  (pad 3 smd rect (at 7 -2) (size 1 1) (layers F.Cu)))\n# end\n");
  ASSERT_EQ(file.points.size(), 2U);
  EXPECT_EQ(file.points[1].x_mm, 7.0);
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

// A board as KiCad 6.0.11 wrote it, but for what is no pad. The middles are those that its own library
// (pcbnew, ShapePos) gives; the bottom's footprints were flipped left to right and top to bottom.
TEST_F(Readers, ABoardIsWhatKicadMakesOfIt) {
  const fs::path board = fs::path(MELTSTAGE_SOURCE_DIR) / "tests/motion/data/two_sides.kicad_pcb";
  const auto expect_places = [&](Side side, const std::vector<std::array<double, 2>>& expected) {
    const CoordinateFile file = read_coordinate_file(board, {.side = side, .travel = kAnywhere});
    ASSERT_EQ(file.points.size(), expected.size());
    EXPECT_TRUE(file.has_unit);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_NEAR(file.points[i].x_mm, expected[i][0], 1e-6) << i;
      EXPECT_NEAR(file.points[i].y_mm, expected[i][1], 1e-6) << i;
    }
  };
  const std::vector<std::array<double, 2>> header = {
      {100.0, -95.0}, {102.453452, -94.3426}, {100.6574, -97.453452}, {103.110852, -96.796051}};
  std::vector<std::array<double, 2>> top = {{143.900081, -82.543251},
                                            {142.564464, -80.670786},
                                            {137.435536, -84.329214},
                                            {141.228847, -78.798320},
                                            {98.35, -78.5},
                                            {98.4375, -80.0},
                                            {98.35, -81.5}};
  top.insert(top.end(), header.begin(), header.end());
  top.insert(top.end(), {{107.534748, -79.242190}, {108.646835, -80.781250}, {109.321058, -82.124038}});
  expect_places(Side::top, top);
  std::vector<std::array<double, 2>> bottom = header;
  bottom.insert(bottom.end(), {{118.35, -81.5},
                               {118.4375, -80.0},
                               {118.35, -78.5},
                               {128.513898, -78.897049},
                               {129.595595, -78.490741},
                               {131.021837, -78.017994}});
  expect_places(Side::bottom, bottom);
  EXPECT_THAT(error_of(board, {.travel = kAnywhere}),
              HasSubstr("found side 'bottom' behind bumps of side 'top'"));
}

TEST_F(Readers, ABoardIsReadWholeOrRefused) {
  const std::string footprint =
      "(footprint a (layer F.Cu) {} (pad 1 smd rect (at 1 2) (size 1 1) (layers F.Cu)))";
  EXPECT_EQ(error_of("a.kicad_pcb", "(kicad_pcb\n" + fmt::format(fmt::runtime(footprint), "") + ")"),
            "line 2, column 1: found a footprint without a position, expected (at x y)");
  EXPECT_THAT(error_of("b.kicad_pcb", "(kicad_pcb " + fmt::format(fmt::runtime(footprint), "(at 1 x)") + ")"),
              HasSubstr("(y of footprint 'a'): found 'x', expected a finite number"));
  EXPECT_THAT(error_of("c.kicad_pcb", "(footprint a)"), HasSubstr("found '(footprint', expected a board"));
  EXPECT_THAT(error_of("d.kicad_mod", "(kicad_pcb)"), HasSubstr("found '(kicad_pcb', expected a footprint"));
  EXPECT_THAT(error_of("e.kicad_pcb", "(kicad_pcb (layers))"), HasSubstr("found no pads, expected pads"));
}

// Of a board, a drill file and a Gerber layer.
TEST_F(Readers, OneFootprintToolOrApertureIsTakenByItsName) {
  const std::string board =
      "(kicad_pcb (footprint a (at 0 0) (property \"Reference\" \"U1\") (pad 1 smd rect (at 1 -2) (layers "
      "F.Cu)))\n(module b (at 5 0) (fp_text reference R1 (at 0 0)) (pad 1 smd rect (at 1 -2) (layers "
      "F.Cu))))\n";
  const CoordinateFile all = read("a.kicad_pcb", board);
  ASSERT_EQ(all.groups.size(), 2U);
  EXPECT_EQ(all.groups[0].name, "R1");
  EXPECT_EQ(all.groups[0].bumps, 1U);
  const CoordinateFile resistor = read("a.kicad_pcb", board, {.only = "R1"});
  ASSERT_EQ(resistor.points.size(), 1U);
  EXPECT_EQ(resistor.points[0].x_mm, 6.0);
  EXPECT_THAT(resistor.notes, ElementsAre("1 bump that is not of R1 left out"));
  EXPECT_EQ(error_of("a.kicad_pcb", board, {.only = "U2"}), "only: found 'U2', expected one of R1, U1");

  EXPECT_EQ(
      error_of("b.kicad_pcb", "(kicad_pcb (footprint a (at 0 0) (pad 1 smd rect (at 1 -2) (layers F.Cu))))",
               {.only = "U2"}),
      "only: found 'U2', expected one of unnamed");

  const std::string drills =
      "M48\nMETRIC\nT1C0.3\nT2C1.0\n%\nT1\nX1.0Y1.0\nX2.0Y1.0\nT2\nX3.0Y1.0\nT1\nX4.0Y1.0\nM30\n";
  const CoordinateFile first = read("a.drl", drills, {.only = "T1"});
  ASSERT_EQ(first.points.size(), 3U);
  EXPECT_EQ(first.points[2].x_mm, 4.0);

  // A block's flashes keep their own aperture.
  const std::string layer =
      gerber("%ABD20*%\nD11*\nX0Y0D03*\n%AB*%\nD10*\nX1000000Y0D03*\nD20*\nX2000000Y0D03*\n");
  const CoordinateFile flashes = read("a.gbr", layer, {.only = "D11"});
  ASSERT_EQ(flashes.points.size(), 1U);
  EXPECT_EQ(flashes.points[0].x_mm, 2.0);
  // So do those of a step and repeat.
  const std::string steps = gerber("%SRX2Y2I10.0J10.0*%\nD10*\nX0Y0D03*\nD11*\nX3000000Y0D03*\n%SR*%\n");
  EXPECT_EQ(read("b.gbr", steps, {.only = "D10"}).points.size(), 4U);
  EXPECT_EQ(read("b.gbr", steps).groups.size(), 2U);
  EXPECT_EQ(error_of("a.csv", "x_mm,y_mm\n1,2\n", {.only = "T1"}),
            "only: found 'T1', expected none: this format has no tools, apertures, footprints or layers");
}

// Until KiCad 5 pads carry the names that a user has given the copper.
TEST_F(Readers, CopperOfABoardMayHaveAnyName) {
  const std::string board =
      "(kicad_pcb (version 20171130)\n(layers (0 Top signal) (1 Ground power) (31 Under mixed) (34 B.Paste "
      "user))\n"
      "(module x (layer Top) (at 100 50)\n(pad 1 smd rect (at 0 0) (size 1 1) (layers Top F.Paste F.Mask))\n"
      "(pad 2 smd rect (at 1 0) (size 1 1) (layers Under B.Paste))\n"
      "(pad 3 smd rect (at 2 0) (size 1 1) (layers Ground))\n"
      "(pad 4 thru_hole circle (at 3 0) (size 1 1) (drill 0.5) (layers *.Cu *.Mask))))\n";
  const CoordinateFile top = read("a.kicad_pcb", board, {.side = Side::top, .travel = kAnywhere});
  expect_points(top.points, {{100, -50, 4}, {103, -50, 7}});
  EXPECT_THAT(top.notes, ::testing::Contains(HasSubstr("1 pad of inner layers, in row 6")));
  expect_points(read("a.kicad_pcb", board, {.side = Side::bottom, .travel = kAnywhere}).points,
                {{101, -50, 5}, {103, -50, 7}});
}

TEST_F(Readers, ViasAndPartsNotPopulatedAreTold) {
  const auto board =
      read("b.kicad_pcb",
           "(kicad_pcb (version 20240108)\n(footprint \"R\" (layer \"F.Cu\") (at 10 10)\n(attr "
           "smd dnp)\n(pad \"1\" smd rect (at 0 0) (size 1 1) (layers \"F.Cu\")))\n(footprint "
           "\"R\" (layer \"F.Cu\") (at 20 10) (attr smd)\n(pad \"1\" smd rect (at 0 0) (size 1 "
           "1) (layers \"F.Cu\")))\n(via (at 5 5) (size 0.6) (drill 0.3) (layers \"F.Cu\" "
           "\"B.Cu\")))",
           {.travel = kAnywhere});
  EXPECT_EQ(board.points.size(), 2U);
  EXPECT_THAT(board.notes, testing::Contains("1 pad, in row 4, is of a part not populated by the file's own "
                                             "word and makes a bump all the same"));
  EXPECT_THAT(board.notes, testing::Contains("1 via, in row 7, holds no bump"));
}

TEST_F(Readers, FiducialPadsOfABoardAreTold) {
  const std::string pad =
      "(pad \"1\" smd circle (at 0 0) (size 1 1) (property \"any\") (property pad_prop_fiducial_glob) "
      "(layers \"F.Cu\" \"F.Mask\"))";
  const auto board =
      read("f.kicad_mod",
           "(footprint \"FID\"\n" + pad + "\n(pad \"2\" smd rect (at 5 -5) (size 1 1) (layers \"F.Cu\")))");
  EXPECT_EQ(board.points.size(), 2U);
  EXPECT_THAT(board.notes, testing::Contains("1 pad, in row 2, is a fiducial by the file's own word and "
                                             "makes a bump all the same"));
}

}  // namespace
}  // namespace meltstage::motion
