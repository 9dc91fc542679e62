// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/design.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include "base/error.hpp"
#include "base/output_file.hpp"
#include "base/temporary_folder.hpp"

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
    const auto path = folder_.path() / "netlist.json";
    write_whole(path, kNetlist);
    return read_netlist(path, technology);
  }
  const Technology technology = read_lef({OSU018_LEF});
  const TemporaryFolder folder_;
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
      parse_def("UNITS DISTANCE MICRONS 1000 ;\n" + text, "a.def", technology);
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message("DESIGN t ;\nCOMPONENTS 1 ;\n- a NOSUCH + PLACED ( 0 0 ) N ;\n"),
            "a.def:4:5: found \"NOSUCH\", expected a macro of the LEF");
  EXPECT_EQ(message("DESIGN t ;\n"), "a.def:3:1: found the file's end, expected END DESIGN");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- a INVX1 + PLACED ( 0 0 ) W ;"),
            "a.def:3:28: found \"W\", expected orientation N, S, FN or FS");
  EXPECT_EQ(message("BLOCKAGES 1 ;\n- LAYER m2 RECT ( 0 0 ) ( 3200 2000 ) ;\nEND BLOCKAGES"),
            "a.def:3:3: found \"LAYER\", expected the end of BLOCKAGES: what it asks for is not kept here");
  EXPECT_EQ(message("DESIGN d ;\nBLOCKAGES 0 ;\nEND BLOCKAGES\nFILLS 0 ;\nEND FILLS\nEND DESIGN"), "");
  EXPECT_EQ(message("UNITS DISTANCE MICRONS 1000 ;"), "a.def:2:1: found \"UNITS\", expected UNITS once");
  EXPECT_EQ(message("DIEAREA ( 0 0 ) ( nan 1 ) ;"),
            "a.def:2:19: found \"nan\", expected a length of at most a metre");
  EXPECT_EQ(message("DIEAREA ( 0 0 ) ( 1e300 1 ) ;"),
            "a.def:2:19: found \"1e300\", expected a length of at most a metre");
  EXPECT_EQ(message("DIEAREA ( 5 0 ) ( 5 1 ) ;"),
            "a.def:2:25: found \";\", expected a die whose second corner is above and right of the first");
  EXPECT_EQ(message("TRACKS X 0 DO 1e9 STEP 1 ;"),
            "a.def:2:15: found \"1e9\", expected a whole number from 1 to 10000000");
  EXPECT_EQ(message("TRACKS X 0 DO 5 STEP 0 ;"),
            "a.def:2:22: found \"0\", expected a length of a nanometre or more");
  EXPECT_EQ(message("ROW r core 0 0 N DO 0 BY 1 ;"),
            "a.def:2:21: found \"0\", expected a whole number from 1 to 10000000");
  EXPECT_EQ(message("PINS 1 ;\n- a + DIRECTION INPUT ;\nEND PINS"),
            "a.def:4:1: found \"END\", expected NET of pin a before it");
  EXPECT_EQ(
      message(
          "COMPONENTS 2 ;\n- a INVX1 + PLACED ( 0 0 ) N ;\n- a INVX1 + FIXED ( 0 0 ) N ;\nEND COMPONENTS"),
      "a.def:5:1: found \"END\", expected each component once, not another a before it");
  EXPECT_EQ(message("VIAS 1 ;\n- v ;\nEND VIAS"),
            "a.def:4:1: found \"END\", expected a via of RECTs before it");
  const std::string cells =
      "COMPONENTS 2 ;\n- u INVX1 + PLACED ( 0 0 ) N ;\n- v INVX1 + PLACED ( 0 0 ) N ;\nEND COMPONENTS\n"
      "PINS 1 ;\n- p + NET a + DIRECTION INPUT ;\nEND PINS\n";
  EXPECT_EQ(message("COMPONENTS 3" + cells.substr(12)),
            "a.def:2:12: found \"3\", expected 2, as so many are listed");
  EXPECT_EQ(message(cells + "NETS 2 ;\n- a ( PIN p ) ;\nEND NETS"),
            "a.def:9:6: found \"2\", expected 1, as so many are listed");
  EXPECT_EQ(message(cells + "NETS 2 ;\n- a ( u A ) ;\n- a ( v A ) ;\nEND NETS"),
            "a.def:11:3: found \"a\", expected each net once");
  EXPECT_EQ(message(cells + "NETS 2 ;\n- a ( u A ) ;\n- b ( v A ) ( u A ) ;\nEND NETS"),
            "a.def:11:17: found \"A\", expected each pin in one net, once");
  EXPECT_EQ(message(cells + "NETS 2 ;\n- a ( u A ) ;\n- b ( PIN p ) ;\nEND NETS"),
            "a.def:11:11: found \"p\", expected a pin with + NET b in PINS");
  EXPECT_EQ(message(cells + "COMPONENTS 0 ;"), "a.def:9:1: found \"COMPONENTS\", expected COMPONENTS once");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- u INVX1 + UNPLACED ;"),
            "a.def:3:13: found \"UNPLACED\", expected PLACED or FIXED, as all components have a place");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- u INVX1 ;"),
            "a.def:3:3: found \"u\", expected a component with PLACED or FIXED");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- u INVX1 + PLACED ( 800.5 0 ) N ;"),
            "a.def:3:22: found \"800.5\", expected a whole number of the DEF's units");
  EXPECT_EQ(message("COMPONENTS 1 ;\n- u INVX1 + PLACED ( 800.0 0 ) W ;"),
            "a.def:3:32: found \"W\", expected orientation N, S, FN or FS");
  const std::string die = "DIEAREA ( 0 0 ) ( 9000 10000 ) ;\nCOMPONENTS 1 ;\n- u INVX1 + PLACED ";
  EXPECT_EQ(message(die + "( 7401 0 ) N ;"), "a.def:4:3: found \"u\", expected a component within DIEAREA");
  EXPECT_EQ(message(die + "( 7400 0 ) N ;"), "a.def:4:34: found the file's end, expected -");
  EXPECT_EQ(
      message("DIEAREA ( 0 0 ) ( 9000 10000 ) ;\nPINS 1 ;\n- a + NET a + LAYER metal1 ( 0 0 ) ( 100 100 ) + "
              "PLACED ( 9500 500 ) N ;"),
      "a.def:4:3: found \"a\", expected a pin that touches DIEAREA");
}

class DefText : public DesignTest {
 protected:
  std::string message(const std::string& text) const {
    try {
      parse_def(text, "a.def", technology);
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
  /// The DEF with `found` changed once.
  std::string changed(const std::string& found, const std::string& to) const {
    std::string text = kSmall;
    const std::size_t at = text.find(found);
    EXPECT_NE(at, std::string::npos) << found;
    return text.replace(at, found.size(), to);
  }
  static constexpr const char* kSmall = R"(VERSION 5.8 ;
BUSBITCHARS "[]" ;
DIVIDERCHAR "/" ;
DESIGN d ;
UNITS DISTANCE MICRONS 1000 ;
DIEAREA ( 0 0 ) ( 16000 10000 ) ;
ROW r core 0 0 N DO 20 BY 1 STEP 800 0 ;
TRACKS X 400 DO 20 STEP 800 LAYER metal2 ;
COMPONENTS 2 ;
- u INVX1 + SOURCE NETLIST + PLACED ( 0 0 ) N + WEIGHT 3 ;
- v INVX1 + FIXED ( 8000 0 ) FN ;
END COMPONENTS
PINS 1 ;
- a + NET a + DIRECTION INPUT + USE SIGNAL + LAYER metal2 ( -150 -150 ) ( 150 150 ) + PLACED ( 400 9000 ) N ;
END PINS
NETS 2 ;
- a ( PIN a ) ( u A ) + USE SIGNAL ;
- n ( u Y ) ( v A ) + FIXED metal2 ( 400 500 ) ( * 900 ) M2_M1 ;
END NETS
END DESIGN
)";
};

TEST_F(DefText, StatementsAreKnownSkippedOrRefused) {
  EXPECT_EQ(message(kSmall), "");
  EXPECT_EQ(message(changed("TRACKS", "GCELLGRID X 0 DO 3 STEP 100 ;\nHISTORY the END of it ;\nTRACKS")), "");
  EXPECT_EQ(message(changed("TRACKS", "TRAKCS")),
            "a.def:8:1: found \"TRAKCS\", expected a statement of DEF, perhaps TRACKS");
  EXPECT_EQ(message(changed("TRACKS", "GARBAGE hello world ;\nTRACKS")),
            "a.def:8:1: found \"GARBAGE\", expected a statement of DEF");
  EXPECT_EQ(message(changed("5.8", "6.7")), "a.def:1:9: found \"6.7\", expected a version from 5.0 to 5.8");
  EXPECT_EQ(message(changed("\"[]\"", "\"()\"")), "a.def:2:13: found \"\"()\"\", expected \"[]\" or \"<>\"");
  EXPECT_EQ(message(changed("\"/\"", "\"|\"")), "a.def:3:13: found \"\"|\"\", expected \"/\"");
  EXPECT_EQ(message(changed("UNITS DISTANCE MICRONS 1000 ;\n", "")),
            "a.def:5:11: found \"0\", expected UNITS DISTANCE MICRONS before the first length");
  EXPECT_EQ(message(changed("MICRONS 1000", "MICRONS 300")),
            "a.def:5:24: found \"300\", expected 100, 200, 400 or 800, ten times that, or 20000");
  EXPECT_EQ(message(changed("DESIGN d ;\n", "")), "a.def: found no DESIGN, expected DESIGN and a name");
  EXPECT_EQ(message(std::string(kSmall) + "NETS 0 ;"),
            "a.def:21:1: found \"NETS\", expected the file's end behind END DESIGN");
  EXPECT_EQ(message(changed("END NETS\nEND DESIGN\n", "")), "a.def:19:1: found the file's end, expected -");
}

TEST_F(DefText, ClausesAreKnownSkippedOrRefused) {
  EXPECT_EQ(message(changed("+ SOURCE", "+ SOUCRE")),
            "a.def:10:13: found \"SOUCRE\", expected a statement of a component, perhaps SOURCE");
  EXPECT_EQ(message(changed("+ WEIGHT 3 ;", "+ WEIGHT 3")), "a.def:11:1: found \"-\", expected ; before it");
  EXPECT_EQ(message(changed("+ WEIGHT 3", "+ REGION x")),
            "a.def:10:49: found \"REGION\", expected no REGION: what it asks for is not kept here");
  EXPECT_EQ(message(changed("+ DIRECTION", "+ DIRECTON")),
            "a.def:14:15: found \"DIRECTON\", expected a statement of a pin, perhaps DIRECTION");
  EXPECT_EQ(message(changed("+ PLACED ( 400", "+ LAYER metal1 ( 0 0 ) ( 1 1 ) + PLACED ( 400")),
            "a.def:14:93: found \"metal1\", expected one LAYER and rectangle a pin");
  EXPECT_EQ(
      message(changed("+ USE SIGNAL ;\n- n", "+ NONDEFAULTRULE w ;\n- n")),
      "a.def:17:25: found \"NONDEFAULTRULE\", expected no NONDEFAULTRULE: what it asks for is not kept here");
  EXPECT_EQ(message(changed("( * 900 )", "( 500 900 )")),
            "a.def:18:48: found \"(\", expected a point straight above or beside the one before it");
  EXPECT_EQ(message(changed("( 400 500 )", "( 400 500 0 )")), "");
  EXPECT_EQ(message(changed("( 400 500 )", "( 400 500 90 )")),
            "a.def:18:46: found \"90\", expected no extension of the wire beyond its point");
  EXPECT_EQ(message(changed("( 400 500 )", "( * 500 )")),
            "a.def:18:38: found \"*\", expected a number, as no point is before it");
  EXPECT_EQ(message(changed("STEP 800 0", "STEP 400 0")),
            "a.def:7:34: found \"400\", expected 800, the width of the site");
  EXPECT_EQ(message(changed("TRACKS X", "TRACKS Z")), "a.def:8:8: found \"Z\", expected X or Y");
}

TEST_F(DefText, EachNetHasOneDriverAndListsItsPins) {
  EXPECT_EQ(message(changed("( PIN a ) ", "")),
            "a.def:14:3: found pin a with + NET a, expected ( PIN a ) in that net of NETS");
  EXPECT_EQ(message(changed("( v A )", "( v A ) ( v Y )")),
            "a.def:18:25: found \"Y\", expected one output a net, as u/Y drives it");
  EXPECT_THAT(message(changed("( u A )", "( u A ) ( v vdd )")),
              HasSubstr("expected a signal's pin, as vdd of"));
  EXPECT_EQ(message(changed("( u A )", "( u A ) ( v Y )")),
            "a.def:17:27: found \"Y\", expected one output a net, as PIN a drives it");
  EXPECT_EQ(message(changed("( v A )", "( * A )")),
            "a.def:18:15: found \"*\", expected a component or PIN in a net of NETS");
}

TEST_F(DefText, WiresOfAnyKindAreReadWithTheirPlace) {
  for (const char* word : {"FIXED", "ROUTED", "COVER"}) {
    const Design d =
        parse_def(changed("+ FIXED metal2", std::string("+ ") + word + " metal2"), "a.def", technology);
    const Net& net = d.nets.at(static_cast<std::size_t>(d.find_net("n")));
    ASSERT_TRUE(net.wiring) << word;
    EXPECT_EQ(net.wiring->line, 18u);
    EXPECT_EQ(net.wires.size(), 1u);
    EXPECT_EQ(net.vias.size(), 1u);
  }
}

// A netlist whose cells disagree with the LEF, or whose outputs fight.
TEST_F(DesignTest, WrongNetlistIsOneLine) {
  const auto message = [&](const std::string& found, const std::string& to) {
    std::string text = kNetlist;
    text.replace(text.find(found), found.size(), to);
    const auto path = folder_.path() / "wrong.json";
    write_whole(path, text);
    try {
      read_netlist(path, technology);
    } catch (const UserError& error) {
      return std::string(error.what()).substr(path.string().size());
    }
    return std::string();
  };
  EXPECT_EQ(message("\"Y\": [4]", "\"Y\": [5]"),
            ": net some.net[3]: found cell g1/Y and cell g2/Y, expected one output");
  EXPECT_EQ(message("\"A\": [2]", "\"A\": [99]"),
            ": net _n99_: found nothing that drives it, expected an output or a port; tie an input that "
            "isn't used");
  EXPECT_EQ(message("\"A\": [2], ", " "), ": cell g1/A: found no net, expected one at every input");
  EXPECT_EQ(message("\"A\": [2], ", "\"A\": [2], \"vdd\": [\"1\"], "), "");
  EXPECT_EQ(
      message("\"A\": [2], ", "\"A\": [2], \"gnd\": [\"1\"], "),
      ": cell g1/gnd: found the other constant at a supply pin, expected the constant 0 or nothing; take the "
      "supplies out of the netlist");
  EXPECT_THAT(message("\"A\": [2], ", "\"A\": [2], \"vdd\": [3], "),
              HasSubstr(": cell g1/vdd: found a net at a supply pin"));
  EXPECT_EQ(message("\"Y\": [4]", "\"Y\": [\"1\"]"),
            ": cell g2/Y: found a constant, expected a net, as it is driven there");
  EXPECT_EQ(message("\"Y\": [4]", "\"Y\": [2]"),
            ": net a_0: found port a_0 and cell g2/Y, expected one output");
  // bits of buses are called NAME_BIT, and the supplies as the library's
  for (const auto& [taken, name] : {std::pair("\"some.net[3]\"", "a_1"), {"\"some.net[3]\"", "vdd"}})
    EXPECT_THAT(message(taken, "\"" + std::string(name) + "\""),
                testing::StartsWith(": net " + std::string(name) + ": found two nets of this name"))
        << name;
  EXPECT_EQ(message("\"AND2X1\", ", "\"AND2X1\", \"port_directions\": {\"A\": \"output\"}, "),
            ": cells of AND2X1: found A as output in port_directions, expected input as in the LEF");
  try {
    Technology empty;
    parse_lef("", "empty.lef", empty);
    const auto path = folder_.path() / "whole.json";
    write_whole(path, kNetlist);
    read_netlist(path, empty);
    FAIL();
  } catch (const UserError& error) {
    EXPECT_STREQ(
        error.what(),
        "empty.lef: found no pin with USE POWER, expected MACROs of the library with their supplies");
  }
}

}  // namespace
}  // namespace meltstage::layout
