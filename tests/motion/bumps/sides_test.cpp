// SPDX-License-Identifier: Apache-2.0
// The sides of a board in tables: by which columns and words they are told.
#include <fmt/format.h>

#include <array>
#include <string>
#include <tuple>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

TEST_F(Readers, PlacementTablesOfTwoSidesAreRefused) {
  EXPECT_THAT(
      error_of("a.csv", "Ref,Val,Package,PosX,PosY,Rot,Side\nC1,1,C,1.5,2.5,0,top\nC2,1,C,3,4,0,bottom\n"),
      StartsWith("row 3: found side 'bottom' behind bumps of side 'top', expected one side"));
  EXPECT_THAT(error_of("b.csv", "Designator,Layer,Mid X,Mid Y\nC1,TopLayer,1,2\nC2,BottomLayer,3,4\n"),
              StartsWith("row 3: found side 'bottom' behind bumps of side 'top'"));
  EXPECT_THAT(error_of("c.csv", "Designator,Layer,Mid X,Mid Y\nC1,B,1,2\nC2,T,3,4\n"),
              StartsWith("row 3: found side 'top' behind bumps of side 'bottom'"));
  for (const char* name : {"TB", "T/B", "Board Side", "placement_side", "Layer name", "PCB-Side"})
    EXPECT_THAT(error_of("f.csv", fmt::format("Ref,X,Y,{}\nC1,1,2,T\nC2,3,4,B\n", name)),
                StartsWith("row 3: found side 'bottom' behind bumps of side 'top'"))
        << name;
  EXPECT_THAT(error_of("g.csv", "Ref,X,Y,Mirror\nC1,1,2,No\nC2,3,4,Yes\n"),
              StartsWith("row 3: found side 'bottom' behind bumps of side 'top'"));
  EXPECT_EQ(read("h.csv", "Ref,X,Y,Outside,Slayer\nC1,1,2,T,T\nC2,3,4,B,B\n").points.size(), 2U);
  // One side in two spellings.
  EXPECT_EQ(read("i.csv", "x,y,Side\n1,2,TopLayer\n3,4,F.Cu\n").points.size(), 2U);
  EXPECT_EQ(read("e.csv", "x,y,Side\n1,2,top\n3,4, Top\n").points.size(), 2U);
}

// One side of many formats, by its name; holes lie on both.
TEST_F(Readers, TheBumpsOfOneSideAreTakenByItsName) {
  const auto of = [&](const char* name, const std::string& content, Side side) {
    return read(name, content, {.side = side});
  };
  const std::string table = "x_mm,y_mm,Layer\n1,2,TopLayer\n3,4,BottomLayer\n1,2,BottomLayer\n";
  const CoordinateFile top = of("a.csv", table, Side::top), bottom = of("a.csv", table, Side::bottom);
  ASSERT_EQ(top.points.size(), 1U);
  EXPECT_EQ(top.points[0].row, 2U);
  EXPECT_FALSE(top.bottom);
  EXPECT_THAT(top.notes, ElementsAre("2 bumps of the other side, first in row 3, left out (side = \"top\")"));
  ASSERT_EQ(bottom.points.size(), 2U);
  EXPECT_EQ(bottom.points[0].x_mm, 3.0);
  EXPECT_TRUE(bottom.bottom);
  EXPECT_THAT(bottom.notes,
              Contains("1 bump of the other side, first in row 2, left out (side = \"bottom\")"));
  const std::string footprint =
      "(footprint \"a\"\n(pad 1 smd rect (at 1 0) (size 1 1) (layers F.Cu))\n(pad 2 smd rect (at 2 0) (size "
      "1 1) "
      "(layers B.Cu))\n(pad 3 thru_hole circle (at 3 0) (size 1 1) (drill 0.5) (layers *.Cu))\n)\n";
  const CoordinateFile pads = of("a.kicad_mod", footprint, Side::bottom);
  ASSERT_EQ(pads.points.size(), 2U);
  EXPECT_EQ(pads.points[0].x_mm, 2.0);
  EXPECT_EQ(pads.points[1].x_mm, 3.0);
  const std::string placement =
      "## Unit = mm, Angle = deg.\n## Side : All\nA a a 1 2 0 top\nB b b 3 4 0 bottom\n## End\n";
  EXPECT_EQ(of("a.pos", placement, Side::bottom).points.at(0).x_mm, 3.0);
  EXPECT_THAT(error_of("b.csv", "x_mm,y_mm\n1,2\n", {.side = Side::top}),
              "found no word on sides, expected one, since side = \"top\"; leave the side out");
  EXPECT_THAT(error_of("c.csv", "x_mm,y_mm,Side\n1,2,top\n", {.side = Side::bottom}),
              "found bumps of the other side alone, expected some of side bottom");
  // Contradictions stay refused.
  EXPECT_THAT(error_of("d.csv", "x,y,Side,Layer\n1,2,top,bottom\n", {.side = Side::top}),
              "row 2, column 4 (Layer): found bottom, expected top, as column 3 (Side) tells");
  EXPECT_THAT(error_of("e.csv", "# Side: top\nx,y,Side\n1,2,bottom\n", {.side = Side::top}),
              "row 3, column 3 (Side): found bottom, expected top, as told above the table");
  EXPECT_THAT(
      error_of("f.pos", "## Unit = mm, Angle = deg.\n## Side : top\nA a a 1 2 0 bottom\n## End\n",
               {.side = Side::top}),
      StartsWith("row 3, column 13 (Side): found 'bottom', expected top, as the file's '## Side' says"));
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
    EXPECT_EQ(error_of("a.csv", fmt::format(fmt::runtime(rows), top, bottom)),
              "row 3: found side 'bottom' behind bumps of side 'top', expected one side; say which (side = "
              "\"top\"), "
              "or export them apart");
    EXPECT_EQ(read("b.csv", fmt::format(fmt::runtime(rows), top, top)).notes.size(), 0U) << top;
    EXPECT_EQ(bottom_notes(read("c.csv", fmt::format(fmt::runtime(rows), bottom, bottom))).size(), 1U)
        << bottom;
  }
  EXPECT_THAT(error_of("d.csv", "x;y;Mirror\n1;2;top\n3;4;bottom\n"),
              StartsWith("row 3: found side 'bottom'"));
  EXPECT_THAT(error_of("e.csv", "x;y;SYM_MIRROR\n1;2;NO\n3;4;YES\n"),
              StartsWith("row 3: found side 'bottom'"));
  EXPECT_THAT(error_of("f.csv", "x;y;BoardSide\n1;2;T\n3;4;B\n"), StartsWith("row 3: found side 'bottom'"));
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

TEST_F(Readers, TwoColumnsOfSidesTellTheSameOne) {
  EXPECT_EQ(error_of("a.csv", "x,y,Side,Layer\n1,2,Top,Bottom\n3,4,Top,Bottom\n"),
            "row 2, column 4 (Layer): found bottom, expected top, as column 3 (Side) tells");
  EXPECT_EQ(read("b.csv", "x,y,Side,Layer\n1,2,Top,F.Cu\n3,4,Top,F.Cu\n").points.size(), 2U);
  EXPECT_EQ(read("c.csv", "x,y,Side,Layer\n1,2,,B.Cu\n3,4,,B.Cu\n").points.size(), 2U);
}

// Words that are not known are refused where the column's name is.
TEST_F(Readers, SidesInLanguagesThatAreNotReadAreRefused) {
  for (const auto& [name, word] : {std::pair("Lato", "davanti"),
                                   {"Cara", "delante"},
                                   {"C\u00f4t\u00e9", "devant"},
                                   {"Zijde", "boven"},
                                   {"\u5b9f\u88c5\u9762", "\u8868"}})
    EXPECT_THAT(error_of("a.csv", fmt::format("x_mm;y_mm;{}\n1;2;{}\n", name, word)),
                AllOf(StartsWith("row 2"), HasSubstr("expected top or bottom")))
        << name;
}

TEST_F(Readers, SidesAreToldByColumnsOfManyNames) {
  for (const auto& [name, top, bottom] : {std::tuple("Location", "Top", "Bottom"),
                                          {"Flip", "0", "1"},
                                          {"Flipped", "no", "yes"},
                                          {"Bottom", "no", "yes"},
                                          {"Top", "yes", "no"},
                                          {"On bottom", "false", "true"},
                                          {"face", "dessus", "dessous"},
                                          {"Face", "Recto", "Verso"},
                                          {"Face", "composants", "soudure"},
                                          {"Couche", "Haut", "Bas"},
                                          {"Capa", "Superior", "Inferior"},
                                          {"lato", "sopra", "sotto"},
                                          {"Seite", "Vorderseite", "R\u00fcckseite"},
                                          {"Seite", "VORDERSEITE", "R\u00dcCKSEITE"},
                                          {"Platinenseite", "Vorderseite", "Rueckseite"},
                                          {"Side", "Top(1)", "Bottom(2)"},
                                          {"Side", "top", "btm"},
                                          {"Placement", "Top", "Bottom"},
                                          {"Top/Bottom", "T", "B"},
                                          {"mirror", "0", "1"},
                                          {"Mirrored", "False", "True"},
                                          {"Assembled on", "Top", "Bottom"},
                                          {"", "F.Cu", "B.Cu"},
                                          {"Location", "T", "B"},
                                          {"Layer", "Front Layer", "Back Layer"},
                                          {"Side", "SMD Top", "SMD Bottom"}}) {
    const std::string rows = "x_mm;y_mm;{}\n1;2;{}\n3;4;{}\n";
    EXPECT_THAT(error_of("a.csv", fmt::format(fmt::runtime(rows), name, top, bottom)),
                AllOf(StartsWith("row 3: found side '"), HasSubstr("expected one side; say which")))
        << name << ' ' << top;
    EXPECT_THAT(error_of("a.csv", fmt::format(fmt::runtime(rows), name, bottom, top)),
                StartsWith("row 3: found side '"))
        << name << ' ' << top;
    EXPECT_THAT(read("b.csv", fmt::format(fmt::runtime(rows), name, top, top)).notes, IsEmpty())
        << name << ' ' << top;
    EXPECT_EQ(bottom_notes(read("c.csv", fmt::format(fmt::runtime(rows), name, bottom, bottom))).size(), 1U)
        << name << ' ' << bottom;
  }
  EXPECT_THAT(error_of("d.csv", "R1,1,2,top\nR2,3,4,bottom\n"),
              "row 2: found side 'bottom' behind bumps of side 'top', expected one side; say which (side = "
              "\"top\"), or "
              "export them apart, or leave out column 4 where it tells no side of a board");
}

TEST_F(Readers, WordsOfSidesElsewhereTellNone) {
  for (const char* name : {"Quality", "Comment", "Remark", "Description", "Net", "Ref"})
    EXPECT_THAT(read("a.csv", fmt::format("x,y,{}\n1,2,Top\n3,4,Bottom\n", name)).notes, IsEmpty()) << name;
  // A column of other words, in which one happens to be a side's.
  EXPECT_THAT(read("b.csv", "x,y,Kind\n1,2,bottom\n3,4,left\n").notes, IsEmpty());
  EXPECT_THAT(read("c.csv", "x,y,Kind\n1,2,bottom\n3,4,\n").notes, IsEmpty());
  EXPECT_THAT(read("d.csv", "x,y,Location\n1,2,A\n3,4,B\n5,6,C\n").notes, IsEmpty());
  EXPECT_THAT(read("e.csv", "x,y,Top\n1,2,12.5\n3,4,13.5\n").notes, IsEmpty());
  // What says itself that it tells the side counts for more.
  EXPECT_THAT(read("f.csv", "x,y,Side,Print\n1,2,top,front\n3,4,top,back\n").notes, IsEmpty());
}

TEST_F(Readers, EaglesMirroredTurnsLieOnTheBottom) {
  constexpr const char* kTable = "part,x,y,orientation\nR1,1,2,{}\nR2,3,4,{}\n";
  const auto table = [&](const char* first, const char* second) {
    return fmt::format(fmt::runtime(kTable), first, second);
  };
  for (const auto& [top, bottom] :
       {std::pair("R0", "MR90"), std::pair("90", "M90"), std::pair("R90", "SMR270")}) {
    EXPECT_THAT(error_of("a.csv", table(top, bottom)), StartsWith("row 3: found side 'bottom'")) << bottom;
    EXPECT_THAT(read("b.csv", table(top, top)).notes, IsEmpty()) << top;
    EXPECT_EQ(bottom_notes(read("c.csv", table(bottom, bottom))).size(), 1U) << bottom;
  }
  // Turns that aren't mirrored say nothing against another column.
  EXPECT_EQ(bottom_notes(read("d.csv", "x,y,Rotation,Side\n1,2,90,bottom\n3,4,180,bottom\n")).size(), 1U);
}

TEST_F(Readers, SidesAmongOtherWords) {
  EXPECT_THAT(error_of("a.csv", "x,y,Mount\n1,2,Top Side SMD\n3,4,Bottom Side SMD\n"),
              StartsWith("row 3: found side 'bottom'"));
  EXPECT_THAT(error_of("d.csv", "x,y,\u5c42\n1,2,\u9876\u5c42\n3,4,\u5e95\u5c42\n"),
              StartsWith("row 3: found side"));
  EXPECT_THAT(error_of("b.csv", "x;y;Lage\n1;2;BS\n3;4;LS\n"), StartsWith("row 3: found side 'bottom'"));
  EXPECT_THAT(read("c.csv", "x;y;Lage\n1;2;BS\n3;4;BS\n").notes, IsEmpty());
}

TEST_F(Readers, ASideInSomeRowsAloneIsRefused) {
  EXPECT_EQ(error_of("a.csv", "x,y,Location\n1,2,Top\n3,4,shelf\n"),
            "row 3, column 3 (Location): found 'shelf', expected top or bottom, such as TopLayer, F.Cu or "
            "Component "
            "Side, as row 2 has; leave the column out where it tells no side of a board");
  EXPECT_EQ(error_of("b.csv", "x,y,Bottom\n1,2,\n3,4,yes\n"),
            "row 2, column 3 (Bottom): found nothing, expected yes or no, as row 3 has one");
}

// A side above the table was a title like any other: the bottom was printed as the top.
TEST_F(Readers, ASideAboveTheTableIsThatOfAllItsBumps) {
  const std::string table = "Ref,X (mm),Y (mm)\nA,1,2\nB,3,4\n";
  for (const char* above :
       {"# Side: bottom\n", "Layer: Bottom\n", "Layer:,Bottom,\n", "Board A\nSide = B.Cu\n", "Seite: Unten\n",
        "Side: Bottom;;\n", "# Side: Bottom;;\n", "Side;Bottom;\n", "Side,Bottom,\n", "Layer\tBottomLayer\n",
        "\"Side: Bottom\",,\n", "Units,mm,Side,Bottom\n"}) {
    const auto file = read("a.csv", above + table);
    EXPECT_TRUE(file.bottom) << above;
    EXPECT_EQ(file.notes.size(), 1U) << above;
  }
  for (const char* above : {"# Side: top\n", "Layers: 4, bottom copper 35 um\n", "Bottom line: all good\n"})
    EXPECT_FALSE(read("b.csv", above + table).bottom) << above;
  EXPECT_THAT(error_of("e.csv", "# Layer: Top and Bottom\n" + table),
              ::testing::StartsWith("row 1: found 'top and bottom' above the table, expected top or bottom"));
  EXPECT_EQ(error_of("c.csv", "# Side: bottom\nRef,Side,X (mm),Y (mm)\nA,Top,1,2\n"),
            "row 3, column 2 (Side): found top, expected bottom, as told above the table");
  EXPECT_THAT(error_of("d.csv", "Side: top\nLayer: Bottom\n" + table),
              ::testing::StartsWith("row 2: found 'bottom' above the table, expected top"));
}

TEST_F(Readers, SidesInMoreLanguagesAreToldApart) {
  for (const auto& [name, top, bottom] :
       {std::array{"Warstwa", "G\u00f3ra", "D\u00f3\u0142"},
        {"Strana", "horn\u00ed", "spodn\u00ed"},
        {"\u0421\u0442\u043e\u0440\u043e\u043d\u0430", "\u0412\u0435\u0440\u0445", "\u041d\u0438\u0437"},
        {"Y\u00fcz", "\u00dcst", "Alt"},
        {"Sida", "ovan", "under"},
        {"Puoli", "yl\u00e4", "ala"},
        {"\uc704\uce58", "\uc717\uba74", "\uc544\ub7ab\uba74"}}) {
    const std::string head = "Ref," + std::string(name) + ",x mm,y mm\n";
    EXPECT_THAT(error_of("a.csv", head + "A," + top + ",1,2\nB," + bottom + ",3,4\n"),
                ::testing::HasSubstr("expected one side"))
        << name;
    EXPECT_TRUE(read("b.csv", head + "A," + bottom + ",1,2\n").bottom) << name;
  }
}

TEST_F(Readers, NamesOfSidesMayBeWrittenInOneWord) {
  for (const char* name : {"IsBottom", "onBottom", "Flip X", "FlipY", "isMirrored"})
    EXPECT_THAT(error_of("a.csv", fmt::format("Ref,x_mm,y_mm,{}\nR1,1,2,yes\nR2,3,4,no\n", name)),
                StartsWith("row 3: found side 'top' behind bumps of side 'bottom'"))
        << name;
  EXPECT_THAT(error_of("b.csv", "Ref,x_mm,y_mm,IsTop\nR1,1,2,yes\nR2,3,4,no\n"),
              StartsWith("row 3: found side 'bottom' behind bumps of side 'top'"));
}

TEST_F(Readers, ASideThatEndingAndFileTellDifferentlyIsRefused) {
  EXPECT_THAT(error_of("a.mnb", "Ref,X (mm),Y (mm),Side\nA,1,2,Top\n"),
              StartsWith("row 2: found top, expected bottom, as the ending .mnb says"));
  const std::string layer =
      "%FSLAX46Y46*%\n%MOMM*%\n%TF.FileFunction,Copper,L1,Top*%\n%ADD10C,1*%\nD10*\nX0Y0D03*\nM02*\n";
  EXPECT_EQ(error_of("a.gbl", layer),
            "row 3: found a layer of the top, expected one of the bottom, as the ending says");
  EXPECT_EQ(read("a.gtl", layer).points.size(), 1U);
}

TEST_F(Readers, WordsAboveATableThatNameASideAreTold) {
  for (const char* title : {"Bottom side components", "Placement list - BOTTOM"})
    EXPECT_THAT(read("a.csv", std::string(title) + "\nRef,X (mm),Y (mm)\nA,1,2\n").notes,
                Contains(AllOf(StartsWith("row 1 says '"), HasSubstr("which is not read"))))
        << title;
  EXPECT_THAT(read("b.csv", "Top level parts\nRef,X (mm),Y (mm),Side\nA,1,2,top\n").notes, IsEmpty());
}

// "Mirrored: yes" above a table changed nothing, without a word.
TEST_F(Readers, WhatElseIsSaidAboveATableIsTold) {
  const std::string table = "Ref,X (mm),Y (mm)\nA,1,2\n";
  for (const char* line :
       {"Mirrored: yes", "# Mirrored: yes", "Scale = 2", "Y axis: down", "# y axis points down",
        "Ma\u00dfstab 1:10", "\"Gespiegelt\";ja", "Substrate: FR4", "# flip x"})
    EXPECT_THAT(read("a.csv", std::string(line) + "\n" + table).notes,
                Contains(AllOf(StartsWith("row 1 says '"), HasSubstr("which is not read; above a table"))))
        << line;
  for (const char* line :
       {"Units: mm", "Side: top", "Date: 2026-11-30", "Bumps of the sensor", "# made by hand"})
    EXPECT_THAT(read("b.csv", std::string(line) + "\n" + table).notes, IsEmpty()) << line;
  EXPECT_THAT(read("c.csv", "Mirrored: yes\nScale: 2\nUnits: mm\n" + table).notes,
              Contains(HasSubstr("'Mirrored: yes', which is not read, nor 1 other such row")));
}

// The first unit of a line was taken, whatever came behind it.
TEST_F(Readers, TwoUnitsInOneLineAboveATableAreRefused) {
  for (const char* line : {"# all dimensions in mm; x and y in um", "All dimensions in mm. X and Y in um.",
                           "Dimensions: mm; Coordinates: um", "Units: mm, X/Y: um"})
    EXPECT_THAT(error_of("a.csv", std::string(line) + "\nBump;X;Y\nA;100;200\n"),
                StartsWith("row 1, column 1: found the units mm and um above the columns, expected one"))
        << line;
  EXPECT_EQ(read("b.csv", "Units: mm, deg\nBump,X,Y\nA,1,2\n").unit_place, "row 1: mm");
}

// "Dimensions (mm)" over width and height made the micrometres of x and y millimetres.
TEST_F(Readers, AUnitOverOtherColumnsIsNotOfXAndY) {
  for (const char* table : {",,,Dimensions (mm),\nName,X,Y,Width,Height\nA,1000,2000,0.08,0.08\n",
                            ",,,,Length (mm)\nPad,X,Y,Net,Wire\n1,1000,2000,A,3\n",
                            ";;;Values in mm;\nName;X;Y;Width;Height\nA;1000;2000;1;1\n"}) {
    const CoordinateFile read_so = read("a.csv", table, {.travel = {{-1e4, 1e4}, {-1e4, 1e4}, {}}});
    EXPECT_FALSE(read_so.has_unit) << table;
    EXPECT_THAT(read_so.notes, Contains(HasSubstr("which is not read"))) << table;
  }
  EXPECT_EQ(read("b.csv", ",Dimensions (mm),,\nName,X,Y,Net\nA,1,2,N\n").unit_place, "row 1: mm");
  EXPECT_EQ(read("c.csv", ",,,Units: mm\nName,X,Y,Net\nA,1,2,N\n").unit_place, "row 1: mm");
}

TEST_F(Readers, PointsThatMayStandBetweenThousandsOfMicrometresAreTold) {
  EXPECT_THAT(read("a.csv", "Nr;X [um];Y [um]\n1;1.234;1.500\n2;2.500;1.750\n").notes,
              Contains(HasSubstr("three digits behind its point")));
  EXPECT_THAT(read("b.csv", "Nr;X [mm];Y [mm]\n1;1.234;1.500\n").notes, IsEmpty());
}

TEST_F(Readers, ADosEndOfFileIsNoPartOfATable) {
  EXPECT_EQ(read("a.csv", "x_mm,y_mm\r\n1,2\r\n\x1A").points.size(), 1U);
}

// T and B told no side where no name said that they do, and nothing said so.
TEST_F(Readers, SingleLettersWithoutANameAreTold) {
  for (const char* table : {"C1,1.0,2.0,90,T,100n\nC2,3.0,4.0,90,B,10k\n", "Ref,X,Y,Sub\nA,1,2,B\nC,3,4,B\n"})
    EXPECT_THAT(read("a.csv", table).notes,
                Contains(AllOf(HasSubstr("found 'B', which tells no side"), HasSubstr("row "))))
        << table;
  EXPECT_THAT(read("b.csv", "Ref,X,Y,Bin\nA,1,2,A\nC,3,4,B\n").notes, IsEmpty());
}

TEST_F(Readers, WordsOfLengthAboveATableAreTold) {
  for (const char* line : {"# all coordinates in 1/1000 inch", "inch", "METRIC",
                           "Coordinates in tenths of mm", "UNITS DATABASE MICRONS 2000"})
    EXPECT_THAT(read("a.csv", std::string(line) + "\nRef,X,Y\nA,1,2\n").notes,
                Contains(AllOf(StartsWith("row 1 says '"), HasSubstr("which is not read"))))
        << line;
}

TEST_F(Readers, ASeparatorInQuotesSeparatesNothingWhereBlanksDo) {
  expect_points(
      read("a.txt",
           "Designator Center-X(mm) Center-Y(mm) Description\nC1 1 2 \"Cap, ceramic\"\nC2 3 4 \"Res\"\n")
          .points,
      {{1, 2, 2}, {3, 4, 3}});
}

}  // namespace
}  // namespace meltstage::motion
