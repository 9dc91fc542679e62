// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/design.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include "base/error.hpp"
#include "base/output_file.hpp"

namespace meltstage::layout {
namespace {

using ::testing::HasSubstr;

const char* const kNetlist = R"({"modules": {"two": {"attributes": {"top": "1"},
  "ports": {"a": {"direction": "input", "bits": [2, 3]}, "y": {"direction": "output", "bits": [4]}},
  "cells": {"g1": {"type": "AND2X1", "connections": {"A": [2], "B": [3], "Y": [5]}},
            "g2": {"type": "AND2X1", "connections": {"A": [5], "B": ["1"], "Y": [4]}}},
  "netnames": {"a": {"bits": [2, 3]}, "y": {"bits": [4]}, "_7_": {"bits": [5]}, "some.net[3]": {"bits": [5]}}}}})";

class DesignTest : public ::testing::Test {
 protected:
  Design netlist() const {
    const auto path = std::filesystem::path(::testing::TempDir()) / "layout_netlist.json";
    write_whole(path, kNetlist);
    return read_netlist(path, technology);
  }
  const Technology technology = read_lef({OSU018_LEF});
};

TEST_F(DesignTest, NetlistKeepsPublicNamesAndTiesConstants) {
  const Design d = netlist();
  EXPECT_EQ(d.nets.at(0).name, "vdd");
  EXPECT_EQ(d.nets.at(0).pins.size(), 1u);
  ASSERT_GE(d.find_net("some.net[3]"), 0);
  EXPECT_EQ(d.find_net("_7_"), -1);
  const std::string verilog = verilog_text(d, technology);
  EXPECT_THAT(verilog, HasSubstr("module two(a_0, a_1, y);"));
  EXPECT_THAT(verilog, HasSubstr(".Y(\\some.net[3] )"));
  EXPECT_THAT(verilog, HasSubstr(".B(1'b1)"));
}

TEST_F(DesignTest, DefIsReadAsItWasWritten) {
  Design d = netlist();
  d.die = {0, 0, 20000, 20000};
  d.rows.push_back({"ROW_0", 0, {800, 0}, Orientation::FS, 20});
  d.tracks.push_back({technology.find_layer("metal1"), Axis::horizontal, 500, 20, 1000});
  d.vias.push_back({"stack",
                    false,
                    {{technology.find_layer("metal1"), {-400, -100, 400, 100}},
                     {technology.find_layer("via"), {-100, -100, 100, 100}},
                     {technology.find_layer("metal2"), {-400, -100, 400, 100}}}});
  d.components[0] = {d.components[0].name, d.components[0].macro, {800, 0}, Orientation::FS, true, false};
  d.components[1] = {d.components[1].name, d.components[1].macro, {8000, 0}, Orientation::S, true, true};
  d.pins[0].is_placed = true;
  d.pins[0].shape = {technology.find_layer("metal3"), {-150, 850, 150, 1150}};
  Net& net = d.nets[static_cast<std::size_t>(d.find_net("some.net[3]"))];
  net.wires.push_back({technology.find_layer("metal1"), {1000, 500}, {3000, 500}, 300});
  net.vias.push_back({technology.find_via("M2_M1"), {3000, 500}});
  net.patches.push_back({technology.find_layer("metal2"), {2850, 350, 3150, 950}});
  d.nets[0].straps.push_back({technology.find_layer("metal1"), {0, 9700, 20000, 10300}});
  d.nets[0].strap_vias.push_back({static_cast<int>(technology.vias.size()), {4000, 10000}});
  const std::string text = def_text(d, technology);
  const Design back = parse_def(text, "text", technology);
  EXPECT_EQ(back.die, d.die);
  EXPECT_EQ(back.components.at(1).orientation, Orientation::S);
  EXPECT_EQ(outline(back.components.at(1), technology), outline(d.components.at(1), technology));
  const Net& same = back.nets.at(static_cast<std::size_t>(back.find_net("some.net[3]")));
  EXPECT_EQ(same.pins, net.pins);
  EXPECT_EQ(same.wires.at(0).metal(), (Rect{850, 350, 3150, 650}));
  EXPECT_EQ(same.patches.at(0).rect, net.patches.at(0).rect);
  const Net& supply = back.nets.at(static_cast<std::size_t>(back.find_net("vdd")));
  EXPECT_EQ(supply.use, Use::power);
  EXPECT_EQ(supply.straps.at(0).rect, d.nets[0].straps.at(0).rect);
  EXPECT_EQ(supply.pins.size(), 1u);
  // the order of nets may change once; after that nothing does
  EXPECT_EQ(def_text(parse_def(def_text(back, technology), "again", technology), technology),
            def_text(back, technology));
}

TEST_F(DesignTest, OrientationTurnsShapes) {
  const Macro& gate = technology.macros.at(technology.find_macro("AND2X1"));
  Component c{"g", technology.find_macro("AND2X1"), {1000, 2000}, Orientation::N, true, false};
  const Rect shape{200, 3300, 600, 4100};
  EXPECT_EQ(placed(shape, gate, c), (Rect{1200, 5300, 1600, 6100}));
  c.orientation = Orientation::FN;
  EXPECT_EQ(placed(shape, gate, c), (Rect{3600, 5300, 4000, 6100}));
  c.orientation = Orientation::FS;
  EXPECT_EQ(placed(shape, gate, c), (Rect{1200, 7900, 1600, 8700}));
  c.orientation = Orientation::S;
  EXPECT_EQ(placed(shape, gate, c), (Rect{3600, 7900, 4000, 8700}));
}

TEST_F(DesignTest, WrongDefIsOneLine) {
  const auto message = [&](const std::string& text) {
    try {
      parse_def(text, "a.def", technology);
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message("DESIGN t ;\nCOMPONENTS 1 ;\n- a NOSUCH + PLACED ( 0 0 ) N ;\n"),
            "a.def:3:5: found \"NOSUCH\", expected a macro of the LEF");
  EXPECT_EQ(message("DESIGN t ;\n"), "a.def:2:1: found the file's end, expected END DESIGN");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- a INVX1 + PLACED ( 0 0 ) W ;"),
            "a.def:2:28: found \"W\", expected orientation N, S, FN or FS");
  EXPECT_EQ(message("BLOCKAGES 1 ;\n- LAYER m2 RECT ( 0 0 ) ( 3200 2000 ) ;\nEND BLOCKAGES"),
            "a.def:2:3: found \"LAYER\", expected the end of BLOCKAGES: what it asks for is not kept here");
  EXPECT_EQ(message("BLOCKAGES 0 ;\nEND BLOCKAGES\nFILLS 0 ;\nEND FILLS\nEND DESIGN"), "");
  EXPECT_EQ(message("UNITS DISTANCE MICRONS 0 ;"),
            "a.def:1:24: found \"0\", expected a whole number from 1 to 10000000");
  EXPECT_EQ(message("DIEAREA ( 0 0 ) ( nan 1 ) ;"),
            "a.def:1:19: found \"nan\", expected a length of at most a metre");
  EXPECT_EQ(message("DIEAREA ( 0 0 ) ( 1e300 1 ) ;"),
            "a.def:1:19: found \"1e300\", expected a length of at most a metre");
  EXPECT_EQ(message("DIEAREA ( 5 0 ) ( 5 1 ) ;"),
            "a.def:1:25: found \";\", expected a die whose second corner is above and right of the first");
  EXPECT_EQ(message("TRACKS X 0 DO 1e9 STEP 1 ;"),
            "a.def:1:15: found \"1e9\", expected a whole number from 1 to 10000000");
  EXPECT_EQ(message("TRACKS X 0 DO 5 STEP 0 ;"),
            "a.def:1:22: found \"0\", expected a length of a nanometre or more");
  EXPECT_EQ(message("ROW r core 0 0 N DO 0 BY 1 ;"),
            "a.def:1:21: found \"0\", expected a whole number from 1 to 10000000");
  EXPECT_EQ(message("PINS 1 ;\n- a + DIRECTION INPUT ;\nEND PINS"),
            "a.def:3:1: found \"END\", expected NET of pin a before it");
  EXPECT_EQ(
      message(
          "COMPONENTS 2 ;\n- a INVX1 + PLACED ( 0 0 ) N ;\n- a INVX1 + FIXED ( 0 0 ) N ;\nEND COMPONENTS"),
      "a.def:4:1: found \"END\", expected each component once, not another a before it");
  EXPECT_EQ(message("VIAS 1 ;\n- v ;\nEND VIAS"),
            "a.def:3:1: found \"END\", expected a via of RECTs before it");
  const std::string cells =
      "COMPONENTS 2 ;\n- u INVX1 + PLACED ( 0 0 ) N ;\n- v INVX1 + PLACED ( 0 0 ) N ;\nEND COMPONENTS\n"
      "PINS 1 ;\n- p + NET a + DIRECTION INPUT ;\nEND PINS\n";
  EXPECT_EQ(message("COMPONENTS 3" + cells.substr(12)),
            "a.def:1:12: found \"3\", expected 2, as so many are listed");
  EXPECT_EQ(message(cells + "NETS 2 ;\n- a ( PIN p ) ;\nEND NETS"),
            "a.def:8:6: found \"2\", expected 1, as so many are listed");
  EXPECT_EQ(message(cells + "NETS 2 ;\n- a ( u A ) ;\n- a ( v A ) ;\nEND NETS"),
            "a.def:10:3: found \"a\", expected each net once");
  EXPECT_EQ(message(cells + "NETS 2 ;\n- a ( u A ) ;\n- b ( v A ) ( u A ) ;\nEND NETS"),
            "a.def:10:17: found \"A\", expected each pin in one net, once");
  EXPECT_EQ(message(cells + "NETS 2 ;\n- a ( u A ) ;\n- b ( PIN p ) ;\nEND NETS"),
            "a.def:10:11: found \"p\", expected a pin with + NET b in PINS");
  EXPECT_EQ(message(cells + "COMPONENTS 0 ;"), "a.def:8:1: found \"COMPONENTS\", expected COMPONENTS once");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- u INVX1 + UNPLACED ;"),
            "a.def:2:13: found \"UNPLACED\", expected PLACED or FIXED, as all components have a place");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- u INVX1 ;"),
            "a.def:2:3: found \"u\", expected a component with PLACED or FIXED");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- u INVX1 + PLACED ( 800.5 0 ) N ;"),
            "a.def:2:22: found \"800.5\", expected a whole number of the DEF's units");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- u INVX1 + PLACED ( 800.0 0 ) W ;"),
            "a.def:2:32: found \"W\", expected orientation N, S, FN or FS");
  const std::string die = "DIEAREA ( 0 0 ) ( 9000 10000 ) ;\nCOMPONENTS 1 ;\n- u INVX1 + PLACED ";
  EXPECT_EQ(message(die + "( 7401 0 ) N ;"), "a.def:3:3: found \"u\", expected a component within DIEAREA");
  EXPECT_EQ(message(die + "( 7400 0 ) N ;"), "a.def:3:34: found the file's end, expected -");
}

}  // namespace
}  // namespace meltstage::layout
