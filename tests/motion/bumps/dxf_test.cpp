// SPDX-License-Identifier: Apache-2.0
// Drawings in DXF: which entities hold a bump, and where blocks put them.
#include <fmt/format.h>

#include <array>
#include <string>
#include <vector>

#include "tests/motion/bumps/reader_files.hpp"

namespace meltstage::motion {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr Travel kAnywhere{{-1e3, 1e3}, {-1e3, 1e3}, {}};

/// Entities in a drawing of this unit, as group codes and values in turn.
std::string drawing(const std::string& entities, const std::string& sections = "", int unit = 4) {
  return fmt::format(
      "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{}\n0\nENDSEC\n{}0\nSECTION\n2\nENTITIES\n{}"
      "0\nENDSEC\n0\nEOF\n",
      unit, sections, entities);
}

// A drawing in inches as ezdxf 0.18.1 wrote it, but for sections and groups that say nothing here. The places
// are those of ezdxf's matrix44() and multi_insert(): blocks turned, scaled, mirrored, in each other,
// in rows, and seen from below.
TEST_F(Readers, ADrawingIsWhatAnotherReaderMakesOfIt) {
  const fs::path file = fs::path(MELTSTAGE_SOURCE_DIR) / "tests/motion/data/blocks.dxf";
  struct Place {
    const char* layer;
    double x_mm, y_mm;
  };
  const std::vector<Place> expected = {
      {"PADS", 25.400000000, 50.800000000},    {"OLD", 76.200000000, 101.600000000},
      {"PADS", 127.340295474, 146.730590949},  {"HOLES", 128.905000000, 149.100443212},
      {"HOLES", 253.780625765, 17.370811066},  {"HOLES", 252.045354881, 20.029656672},
      {"HOLES", 225.138794683, 27.795585034},  {"HOLES", 228.341692989, 34.738860014},
      {"PADS", 505.722698301, 14.271392856},   {"HOLES", 509.972201124, 18.039645204},
      {"PADS", 517.989956295, 17.558394729},   {"HOLES", 522.239459118, 21.326647076},
      {"PADS", 530.257214288, 20.845396601},   {"HOLES", 534.506717111, 24.613648949},
      {"PADS", 501.120895679, 31.445554047},   {"HOLES", 505.370398502, 35.213806395},
      {"PADS", 513.388153673, 34.732555920},   {"HOLES", 517.637656496, 38.500808268},
      {"PADS", 525.655411667, 38.019557793},   {"HOLES", 529.904914490, 41.787810141},
      {"PADS", -177.800000000, 203.200000000}, {"PADS", -763.319608172, 70.675813700},
      {"HOLES", -764.449020793, 73.281370672}};
  for (const char* layer : {"PADS", "HOLES", "OLD"}) {
    CoordinateOptions options{.only = layer, .travel = kAnywhere};
    const CoordinateFile read = read_coordinate_file(file, options);
    std::size_t at = 0;
    for (const Place& place : expected) {
      if (place.layer != std::string(layer)) continue;
      ASSERT_LT(at, read.points.size());
      // The order within a layer is the drawing's, rows of a block column by column.
      EXPECT_NEAR(read.points[at].x_mm, place.x_mm, 1e-6) << layer << ' ' << at;
      EXPECT_NEAR(read.points[at].y_mm, place.y_mm, 1e-6) << layer << ' ' << at;
      ++at;
    }
    EXPECT_EQ(at, read.points.size()) << layer;
    EXPECT_THAT(read.notes, Contains(HasSubstr("LINEs, first in row")));
    EXPECT_THAT(read.notes,
                Contains(HasSubstr("layer 'OLD' is off or frozen, and its 1 bump is taken all the same")));
  }
}

TEST_F(Readers, ADrawingWithoutAUnitCountsInThePitch) {
  const std::string circle = "0\nCIRCLE\n8\nA\n10\n1.5\n20\n2\n40\n0.1\n";
  EXPECT_FALSE(read("a.dxf", drawing(circle, "", 0)).has_unit);
  EXPECT_NEAR(read("b.dxf", drawing(circle, "", 13)).points[0].x_mm, 0.0015, 1e-12);
  EXPECT_THAT(error_of("c.dxf", drawing(circle, "", 7)),
              "row 8 ($INSUNITS): found '7', expected the number of a unit: 1 "
              "(inch), 2, 4 (mm), 5, 6, 8, 9 (mil), 12, 13 (um) or 14");
}

TEST_F(Readers, ADrawingSaysWhatIsNoBump) {
  const CoordinateFile file = read(
      "a.dxf",
      drawing("0\nCIRCLE\n10\n1\n20\n2\n0\nARC\n10\n9\n20\n9\n0\nLINE\n10\n0\n20\n0\n0\nLINE\n10\n0\n20\n0\n"
              "0\nCIRCLE\n67\n1\n10\n5\n20\n5\n0\nPOLYLINE\n0\nVERTEX\n10\n1\n20\n1\n0\nSEQEND\n"));
  EXPECT_EQ(file.points.size(), 1U);
  EXPECT_THAT(file.notes,
              ElementsAre("1 ARC, in row 22, holds no bump", "2 LINEs, first in row 28, hold no bump",
                          "1 POLYLINE, in row 48, holds no bump",
                          "1 entity of the paper space, in row 40, holds no bump"));
}

/// Layers, each with its flags (code 70: 1 is frozen) and colour (code 62: below 0 is off).
std::string layers(const std::vector<std::array<std::string, 3>>& entries) {
  std::string out = "0\nSECTION\n2\nTABLES\n";
  for (const auto& [name, flags, colour] : entries)
    out += fmt::format("0\nLAYER\n2\n{}\n70\n{}\n62\n{}\n", name, flags, colour);
  return out + "0\nENDSEC\n";
}

std::string block(const std::string& name, const std::string& entities) {
  return fmt::format("0\nBLOCK\n2\n{}\n{}0\nENDBLK\n", name, entities);
}

std::string insert(const std::string& name, const std::string& layer, const std::string& more = "") {
  return fmt::format("0\nINSERT\n2\n{}\n8\n{}\n10\n0\n20\n0\n{}", name, layer, more);
}

std::string circle_in(const std::string& layer) {
  return fmt::format("0\nCIRCLE\n8\n{}\n10\n1\n20\n2\n40\n0.1\n", layer);
}

TEST_F(Readers, ABumpOfAnUnseenLayerIsToldOnce) {
  const std::string frozen = layers({{"PADS", "1", "7"}, {"OLD", "1", "7"}}),
                    off = layers({{"PADS", "0", "-7"}, {"OLD", "1", "7"}});
  const std::string blocks = "0\nSECTION\n2\nBLOCKS\n" + block("ONE", circle_in("0")) +
                             block("HOLE", circle_in("HOLES")) + block("PAD", circle_in("PADS")) +
                             block("TWICE", insert("ONE", "0")) + block("OLD_ONE", insert("HOLE", "OLD")) +
                             "0\nENDSEC\n";
  const auto notes = [&](const std::string& table, const std::string& entities) {
    return read("a.dxf", drawing(entities, table + blocks)).notes;
  };
  const auto told = [](const std::string& layer, const std::string& bumps) {
    return ElementsAre(
        fmt::format("layer '{}' is off or frozen, and its {} taken all the same", layer, bumps));
  };
  for (const std::string& table : {frozen, off}) {
    EXPECT_THAT(notes(table, insert("ONE", "PADS")), told("PADS", "1 bump is"));
    EXPECT_THAT(notes(table, insert("TWICE", "PADS")), told("PADS", "1 bump is"));
    EXPECT_THAT(notes(table, insert("PAD", "HOLES")), told("PADS", "1 bump is"));
    EXPECT_THAT(notes(table, insert("ONE", "PADS", "70\n3\n44\n5\n")), told("PADS", "3 bumps are"));
    EXPECT_THAT(notes(table, insert("OLD_ONE", "PADS")), told("OLD", "1 bump is"));
  }
  // What is inserted in a frozen layer is frozen; of a layer that is off only what belongs to it isn't seen.
  EXPECT_THAT(notes(frozen, insert("HOLE", "PADS")), told("PADS", "1 bump is"));
  EXPECT_THAT(notes(off, insert("HOLE", "PADS")), ::testing::IsEmpty());
}

TEST_F(Readers, AHiddenEntityIsTold) {
  EXPECT_THAT(read("a.dxf", drawing("0\nCIRCLE\n60\n1\n10\n1\n20\n2\n")).notes,
              ElementsAre("1 entity is hidden, first in row 16, and taken all the same"));
}

TEST_F(Readers, ADrawingIsReadWholeOrRefused) {
  const std::string circle = "0\nCIRCLE\n10\n1\n20\n2\n";
  const std::string whole = drawing(circle);
  EXPECT_EQ(error_of("a.dxf", whole.substr(0, whole.size() - 6)),
            "the file ends without EOF, expected it; the file may be cut off");
  EXPECT_EQ(error_of("b.dxf", whole + "0\nCIRCLE\n"), "row 25: found '0', expected nothing behind EOF");
  EXPECT_EQ(error_of("c.dxf", "x,y\n1,2\n"), "row 1: found 'x,y', expected a group code of DXF, such as 0");
  EXPECT_EQ(error_of("d.dxf", drawing("0\nCIRCLE\n10\n1\n")),
            "row 16 (CIRCLE): found no y, expected one (group code 20)");
  EXPECT_EQ(error_of("e.dxf", drawing("0\nCIRCLE\n10\nnan\n20\n1\n")),
            "row 18 (group code 10 of CIRCLE): found 'nan', expected a finite number such as 12.5");
  EXPECT_EQ(error_of("f.dxf", drawing("0\nCIRCLE\n10\n1\n20\n1\n210\n0.6\n230\n0.8\n")),
            "row 16 (CIRCLE): found the extrusion (0.6, 0, 0.8), expected one along z: a flat drawing");
  EXPECT_EQ(error_of("g.dxf", drawing("0\nINSERT\n2\nQ\n10\n0\n20\n0\n")),
            "row 16 (INSERT): found block 'Q', expected one of the section BLOCKS");
  EXPECT_EQ(error_of("h.dxf", drawing("0\nLINE\n10\n0\n20\n0\n")),
            "found no circle and no point, but LINEs, expected them: each is a bump");
  EXPECT_EQ(error_of("j.dxf", drawing("0\nLI\x1bNE\n")),
            "found no circle and no point, but LI\\x1BNEs, expected them: each is a bump");
  const std::string empty = "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nQ\n0\nENDBLK\n0\nENDSEC\n";
  EXPECT_THAT(error_of("k.dxf", drawing("0\nINSERT\n2\nQ\n10\n0\n20\n0\n70\n100000\n71\n100000\n", empty)),
              HasSubstr("found more than 8000000 entities in blocks"));
  const std::string itself =
      "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nQ\n0\nINSERT\n2\nQ\n10\n0\n20\n0\n0\nENDBLK\n0\nENDSEC\n";
  EXPECT_THAT(error_of("i.dxf", drawing("0\nINSERT\n2\nQ\n10\n0\n20\n0\n", itself)),
              HasSubstr("found blocks nested 32 deep"));
}

// Names of blocks are the same in any case; no repeat is one.
TEST_F(Readers, BlocksAreInsertedByTheirNameInAnyCase) {
  const std::string block =
      "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nOUTER\n10\n0\n20\n0\n0\nCIRCLE\n10\n1\n20\n2\n40\n"
      "1\n0\nENDBLK\n0\nENDSEC\n";
  const CoordinateFile file = read(
      "a.dxf", drawing("0\nINSERT\n2\nouter\n10\n5\n20\n5\n70\n0\n71\n0\n", block), {.travel = kAnywhere});
  ASSERT_EQ(file.points.size(), 1U);
  EXPECT_EQ(file.points[0].x_mm, 6.0);
  EXPECT_EQ(file.points[0].y_mm, 7.0);
}

TEST_F(Readers, ADrawingThatLiesElsewhereIsRefused) {
  for (const char* flags : {"4", "36", "8"}) {
    const std::string block = fmt::format(
        "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nPCB\n70\n{}\n10\n0\n20\n0\n1\npcb.dwg\n0\nENDBLK\n0\nENDSEC\n",
        flags);
    EXPECT_THAT(
        error_of("a.dxf", drawing("0\nPOINT\n10\n1\n20\n2\n0\nINSERT\n2\nPCB\n10\n5\n20\n5\n", block)),
        HasSubstr("(INSERT): found the external drawing 'pcb.dwg', expected what it holds in this file"));
  }
}

TEST_F(Readers, ADrawingHasOneUnit) {
  const std::string twice = drawing("", "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n1\n0\nENDSEC\n", 4);
  EXPECT_THAT(error_of("a.dxf", twice), HasSubstr("($INSUNITS): found '1', expected one unit"));
}

}  // namespace
}  // namespace meltstage::motion
