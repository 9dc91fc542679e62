// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/technology.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "base/error.hpp"

namespace meltstage::layout {
namespace {

TEST(Technology, ReadsDebiansCells) {
  const Technology t = read_lef({OSU018_LEF});
  ASSERT_EQ(t.routing_layers().size(), 6u);
  const Layer& metal2 = t.layers.at(t.find_layer("metal2"));
  EXPECT_EQ(metal2.direction, Axis::vertical);
  EXPECT_EQ(metal2.pitch, 800);
  EXPECT_EQ(metal2.offset, 400);
  EXPECT_EQ(metal2.width, 300);
  EXPECT_EQ(metal2.spacing, 300);
  EXPECT_DOUBLE_EQ(metal2.edge_cap_pf_um, 6e-5);
  EXPECT_EQ(t.sites.at(0).height, 10000);
  const Macro& gate = t.macros.at(t.find_macro("AND2X1"));
  EXPECT_EQ(gate.width, 3200);
  EXPECT_EQ(gate.pins.at(gate.find_pin("Y")).direction, PinDirection::output);
  EXPECT_EQ(gate.pins.at(gate.find_pin("vdd")).use, Use::power);
  EXPECT_EQ(gate.pins.at(gate.find_pin("A")).shapes.at(0).rect, (Rect{200, 3300, 600, 4100}));
  EXPECT_EQ(t.via_rules.size(), 5u);  // TURN rules hold no cut
  EXPECT_EQ(t.vias.at(t.find_via("M2_M1")).shapes.size(), 3u);
}

TEST(Technology, SpacingGrowsWithWidthAndRun) {
  Technology t;
  parse_lef(R"(LAYER M
  TYPE ROUTING ;
  WIDTH 0.16 ;
  AREA 0.09 ;
  SPACINGTABLE PARALLELRUNLENGTH 0.00 1.00 10.00
    WIDTH 0.00 0.18 0.18 0.18
    WIDTH 0.30 0.18 0.22 0.22
    WIDTH 10.0 0.18 0.22 0.60 ;
  END M
  END LIBRARY)",
            "text", t);
  const Layer& metal = t.layers.at(0);
  EXPECT_EQ(metal.spacing, 180);
  EXPECT_EQ(metal.area_nm2, 90000);
  EXPECT_EQ(metal.spacing_for(160, 20000), 180);
  EXPECT_EQ(metal.spacing_for(300, 999), 180);
  EXPECT_EQ(metal.spacing_for(300, 1000), 220);
  EXPECT_EQ(metal.spacing_for(10000, 10000), 600);
}

// A file may repeat what another says, and not say something else.
TEST(Technology, ANameHasOneMeaning) {
  const std::string layer = "LAYER M\n TYPE ROUTING ;\n PITCH 1 ;\nEND M\n";
  for (const std::string& described :
       {std::string("SITE s\n SIZE 1 BY 2 ;\nEND s\n"), std::string("MACRO m\n SIZE 1 BY 2 ;\nEND m\n"),
        std::string("VIA v\n LAYER M ;\n RECT 0 0 1 2 ;\nEND v\n"), layer}) {
    Technology t;
    parse_lef(layer + described, "a.lef", t);
    parse_lef(described, "b.lef", t);
    EXPECT_EQ(t.files, "a.lef, b.lef");
    EXPECT_EQ(t.layers.size(), 1u);
    EXPECT_LE(t.sites.size() + t.macros.size() + t.vias.size(), 1u);
    std::string other = described;
    other.replace(other.find(" 1 "), 3, " 3 ");
    try {
      parse_lef(other, "c.lef", t);
      ADD_FAILURE() << other;
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), ::testing::StartsWith("c.lef:1:"));
      EXPECT_THAT(
          error.what(),
          ::testing::EndsWith("expected another name, as that one was described before with other values"));
    }
  }
}

// Its own resistance counts, and the order of its layers does not.
TEST(Technology, AViaIsReadFromEitherEnd) {
  Technology t;
  parse_lef(
      "LAYER a TYPE ROUTING ; END a\nLAYER c TYPE CUT ; END c\nLAYER b TYPE ROUTING ; END b\n"
      "VIA v DEFAULT RESISTANCE 5 ; LAYER b ; RECT 0 0 3 3 ; LAYER c ; RECT 0 0 2 2 ; LAYER a ; RECT 0 0 1 1 "
      "; END v",
      "text", t);
  ASSERT_EQ(t.vias.at(0).shapes.size(), 3u);
  EXPECT_EQ(t.vias[0].resistance_ohm, 5.0);
  for (int layer = 0; layer < 3; ++layer)
    EXPECT_EQ(t.vias[0].shapes[static_cast<std::size_t>(layer)].layer, layer);
}

TEST(Technology, RailsReachBeyondTheirCell) {
  Technology t;
  parse_lef(
      "LAYER M\n TYPE ROUTING ;\nEND M\nMACRO m\n SIZE 1 BY 2 ;\n PIN g\n PORT\n LAYER M ;\n"
      " RECT 0 -1 1 1 ;\n END\n USE GROUND ;\nEND g\nEND m",
      "a.lef", t);
  EXPECT_EQ(t.macros.at(0).pins.at(0).shapes.size(), 1u);
}

TEST(Technology, WrongInputIsOneLine) {
  const auto message = [](const char* text) {
    Technology t;
    try {
      parse_lef(text, "cells.lef", t);
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message("LAYER M\n PITCH zero ;"),
            "cells.lef:2:8: found \"zero\", expected a length of at most a metre");
  EXPECT_EQ(message("LAYER M\n TYPE CUT ;\nEND M\nVIA V\n LAYER M ;\n RECT -1 -1 -1 1 ;"),
            "cells.lef:6:7: found \"-1\", expected a RECT with an area");
  EXPECT_EQ(message("VIA V\n LAYER nosuch ;"),
            "cells.lef:2:8: found \"nosuch\", expected a layer that was described before");
  EXPECT_EQ(message("MACRO A\n SIZE 1 BY 2 ;\n"), "cells.lef:3:1: found the file's end, expected more");
  for (const char* number : {"inf", "nan", "1e300", "1e7", "-1e7", "1e999"})
    EXPECT_EQ(message((std::string("LAYER M\n OFFSET ") + number + " ;").c_str()),
              "cells.lef:2:9: found \"" + std::string(number) + "\", expected a length of at most a metre");
  EXPECT_EQ(message("LAYER M\n PITCH 0 ;"),
            "cells.lef:2:8: found \"0\", expected a length of a nanometre or more");
  EXPECT_EQ(message("SITE s\n SIZE 0.0001 BY 1 ;"),
            "cells.lef:2:7: found \"0.0001\", expected a length of a nanometre or more");
  EXPECT_EQ(message("SITE s\nEND s"), "cells.lef:2:5: found \"s\", expected SIZE of the site before its end");
  EXPECT_EQ(message("MACRO m\nEND m"),
            "cells.lef:2:5: found \"m\", expected SIZE of the macro before its end");
  EXPECT_EQ(message("LAYER M\n AREA nan ;"),
            "cells.lef:2:7: found \"nan\", expected a number from 0 to 1e+12");
  EXPECT_EQ(message("LAYER M\n SPACINGTABLE PARALLELRUNLENGTH WIDTH 0 ;"),
            "cells.lef:2:33: found \"WIDTH\", expected a run length before WIDTH");
  const std::string layers = "LAYER M\n TYPE ROUTING ;\nEND M\n";
  const std::string macro = layers + "MACRO m\n SIZE 1 BY 2 ;\n PIN A\n";
  const auto refused = [&](const std::string& text) { return message(text.c_str()); };
  EXPECT_EQ(message("UNITS\n DATABASE MICRONS 0 ;\nEND UNITS"),
            "cells.lef:2:19: found \"0\", expected a whole number from 1 to 10000000");
  EXPECT_EQ(message("LAYER M\n TYPE ROUTIN ;"),
            "cells.lef:2:7: found \"ROUTIN\", expected ROUTING, CUT, MASTERSLICE, OVERLAP or IMPLANT");
  EXPECT_EQ(message("LAYER M\n DIRECTION UP ;"),
            "cells.lef:2:12: found \"UP\", expected HORIZONTAL or VERTICAL");
  EXPECT_EQ(refused(macro + " DIRECTION INPUTT ;"),
            "cells.lef:7:12: found \"INPUTT\", expected INPUT, OUTPUT, INOUT or FEEDTHRU");
  EXPECT_EQ(refused(macro + " USE POWERR ;"),
            "cells.lef:7:6: found \"POWERR\", expected SIGNAL, ANALOG, CLOCK, POWER or GROUND");
  for (const char* rule : {"SPACING", "DESIGNRULEWIDTH"})
    EXPECT_EQ(refused(layers + "MACRO m\n SIZE 1 BY 2 ;\n OBS\n LAYER M " + rule + " 5 ;"),
              fmt::format("cells.lef:7:10: found \"{}\", expected no spacing but the layer's, which alone is "
                          "kept",
                          rule));
  EXPECT_EQ(refused(macro + " PORT\n LAYER M ; RECT 0 0 1 1 ; END END A\n PIN A\n"),
            "cells.lef:9:6: found \"A\", expected each pin once");
  EXPECT_EQ(refused(macro + " PORT\n LAYER M ;\n RECT 0 0 1.001 1 ;\n END\nEND A\nEND m"),
            "cells.lef:9:7: found \"0\", expected a RECT of a signal's pin within the SIZE of MACRO m");
  EXPECT_EQ(message("LAYER M\n PITCH \x1b[31m ;"),
            "cells.lef:2:8: found \"\\x1B[31m\", expected text without control characters");
}

TEST(Technology, StatementsAreKnownSkippedOrRefused) {
  const auto message = [](const std::string& text) {
    Technology t;
    try {
      parse_lef(text, "a.lef", t);
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string layer = "LAYER M\n TYPE ROUTING ;\n ";
  EXPECT_EQ(message(layer + "SPACNG 0.3 ;\nEND M"),
            "a.lef:3:2: found \"SPACNG\", expected a statement of LAYER, perhaps SPACING");
  EXPECT_EQ(message(layer + "FROB 1 ;\nEND M"), "a.lef:3:2: found \"FROB\", expected a statement of LAYER");
  EXPECT_EQ(message("MARCO m"), "a.lef:1:1: found \"MARCO\", expected a statement of LEF, perhaps MACRO");
  EXPECT_EQ(message("VERSION 6.7 ;"), "a.lef:1:9: found \"6.7\", expected a version from 5.0 to 5.8");
  EXPECT_EQ(message("END LIBRARY\nLAYER M"),
            "a.lef:2:1: found \"LAYER\", expected the file's end behind END LIBRARY");
  // a lost `;` takes no rule with it
  EXPECT_EQ(message(layer + "PITCH 1\n WIDTH 0.3 ;\nEND M"),
            "a.lef:4:2: found \"WIDTH\", expected a length of at most a metre");
  EXPECT_EQ(message(layer + "WIDTH 0.3\n SPACING 1 ;\nEND M"), "a.lef:4:2: found \"SPACING\", expected ;");
  EXPECT_EQ(message(layer + "MINSTEP 0.3\n SPACING 1 ;\nEND M"),
            "a.lef:4:2: found \"SPACING\", expected ; before it");
  EXPECT_EQ(message(layer + "MINSTEP 0.3\nEND M"), "a.lef:4:1: found \"END\", expected ; before it");
  EXPECT_EQ(message(layer + "SPACING -0.3 ;\nEND M"),
            "a.lef:3:10: found \"-0.3\", expected a length not below 0");
  EXPECT_EQ(message(layer + "RESISTANCE RPERSQ -1 ;\nEND M"),
            "a.lef:3:20: found \"-1\", expected a number from 0 to 1e+12");
  EXPECT_EQ(message(layer + "ANTENNAMODEL OXIDE2 ;\nEND M"),
            "a.lef:3:15: found \"OXIDE2\", expected OXIDE1, the only oxide whose rules are read");
  EXPECT_EQ(message("LAYER M\nEND M"), "a.lef:2:5: found \"M\", expected TYPE of the layer before its end");
  EXPECT_EQ(message(layer + "\nEND M\nMACRO m\n SIZE 1 BY 2 ;\n SITE nosuch ;\n"),
            "a.lef:7:7: found \"nosuch\", expected a SITE that was described before");
  EXPECT_EQ(message(layer + "\nEND M\nMACRO m\n SIZE 1 BY 2 ;\n PIN A\nEND A\n"),
            "a.lef:8:5: found \"A\", expected a PORT with a RECT of the signal's pin before its end");
  EXPECT_EQ(message("MACRO m\n CLASS COER ;\n"),
            "a.lef:2:8: found \"COER\", expected COVER, RING, BLOCK, PAD, CORE or ENDCAP");
}

TEST(Technology, WhatIsSkippedChangesNoRule) {
  Technology t;
  parse_lef(R"(LAYER M
  TYPE ROUTING ;
  WIDTH 0.3 ;
  SPACING 0.2 ;
  ACCURRENTDENSITY AVERAGE
    FREQUENCY 1 100 ;
    WIDTH 0.4 0.8 ;
    TABLEENTRIES 1 2 3 4 ;
  SPACING 0.4 RANGE 1 2 ;
  MINIMUMCUT 2 WIDTH 1.4 ;
  PROPERTY LEF58_X "SPACING 3 ; END" ;
END M
NONDEFAULTRULE wide
  LAYER M WIDTH 1 ; END M
END wide
BEGINEXT "x" anything END ENDEXT
MACRO m
  SIZE 1 BY 2 ;
  PIN Y
    DIRECTION OUTPUT TRISTATE ;
    PORT
      LAYER M ; RECT 0 0 1 1 ;
    END
  END Y
END m)",
            "a.lef", t);
  EXPECT_EQ(t.layers.at(0).width, 300);
  EXPECT_EQ(t.layers.at(0).spacing, 200);
  EXPECT_TRUE(t.macros.at(0).pins.at(0).is_tristate);
}

}  // namespace
}  // namespace meltstage::layout
