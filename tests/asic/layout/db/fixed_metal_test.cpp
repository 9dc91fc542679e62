// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/fixed_metal.hpp"

#include <gmock/gmock.h>

#include <string>

#include "asic/layout/db/delays.hpp"
#include "asic/layout/db/technology.hpp"
#include "asic/layout/place/place.hpp"
#include "asic/layout/place/rails.hpp"
#include "base/error.hpp"

namespace meltstage::layout {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kLayers = R"(MANUFACTURINGGRID 0.005 ;
LAYER m1 TYPE ROUTING ; DIRECTION HORIZONTAL ; PITCH 1 ; WIDTH 0.3 ; SPACING 0.3 ; END m1
LAYER m2 TYPE ROUTING ; DIRECTION VERTICAL ; PITCH 1 ; WIDTH 0.3 ; SPACING 0.3 ; END m2
SITE core CLASS CORE ; SIZE 1 BY 10 ; END core
)";

// A cell of 4 x 10 um with these rails, this SYMMETRY, and more.
std::string cell(const std::string& name, const std::string& low, const std::string& high,
                 const std::string& symmetry, const std::string& more) {
  const auto use = [](const std::string& rail) { return rail == "gnd" ? " USE GROUND ;" : " USE POWER ;"; };
  return "MACRO " + name + " CLASS CORE ; SIZE 4 BY 10 ; " + symmetry + " SITE core ;\n PIN " + low +
         use(low) + " PORT LAYER m1 ; RECT 0 -0.5 4 0.5 ; END END " + low + "\n PIN " + high + use(high) +
         " PORT LAYER m1 ; RECT 0 9.5 4 10.5 ; END END " + high +
         "\n PIN a DIRECTION INPUT ; PORT LAYER m1 ; RECT 1 4 2 5 ; LAYER m2 ; RECT 1 4 2 5 ; END END a\n" +
         more + "END " + name + "\n";
}

Technology with(const std::string& cells) {
  Technology technology;
  parse_lef(kLayers + cells, "cells.lef", technology);
  return technology;
}

// One cell of each macro side by side in a die of 40 x 40 um, with a power and a ground net.
Design row_of(const Technology& technology) {
  Design d;
  d.die = {0, 0, 40'000, 40'000};
  d.nets.resize(2);
  d.nets[0].name = "vdd";
  d.nets[0].use = Use::power;
  d.nets[1].name = "gnd";
  d.nets[1].use = Use::ground;
  for (std::size_t m = 0; m < technology.macros.size(); ++m)
    d.components.push_back({"u" + std::to_string(m),
                            static_cast<int>(m),
                            {10'000 + 4'000 * static_cast<Nm>(m), 10'000},
                            Orientation::N,
                            true,
                            false});
  return d;
}

TEST(FixedMetal, StrapsKeepApartFromEachOtherAndFromCells) {
  const Technology technology =
      with(cell("inv", "gnd", "vdd", "SYMMETRY X Y ;", " OBS LAYER m2 ; RECT 3 6 4 7 ; END\n"));
  const int m1 = technology.find_layer("m1"), m2 = technology.find_layer("m2");
  const auto faults = [&](const std::vector<Shape>& power, const std::vector<Shape>& ground) {
    Design d = row_of(technology);
    d.nets[0].straps = power;
    d.nets[1].straps = ground;
    return supply_faults(d, technology);
  };
  const Shape rail_low{m1, {10'000, 9'500, 14'000, 10'500}}, rail_high{m1, {10'000, 19'500, 14'000, 20'500}};
  EXPECT_THAT(faults({rail_high}, {rail_low}), IsEmpty());
  EXPECT_THAT(faults({rail_low}, {rail_high}), Contains(HasSubstr("is at pin gnd of u0 on m1")));
  const auto strap = [&](Nm x, Nm width) { return Shape{m2, {x, 0, x + width, 40'000}}; };
  EXPECT_THAT(faults({strap(20'000, 1'000)}, {strap(21'300, 1'000)}), IsEmpty());
  EXPECT_THAT(faults({strap(20'000, 1'000)}, {strap(21'295, 1'000)}),
              ElementsAre("vdd and gnd are nearer than the spacing of m2 at (21295, 0) nm"));
  EXPECT_THAT(faults({strap(12'300, 500)}, {}), IsEmpty());
  EXPECT_THAT(faults({strap(12'295, 500)}, {}),
              ElementsAre("vdd is at pin a of u0 on m2 at (11000, 14000) nm"));
  EXPECT_THAT(faults({strap(13'500, 500)}, {}),
              ElementsAre("vdd is at an obstruction of u0 on m2 at (13000, 16000) nm"));
  EXPECT_THAT(faults({strap(20'000, 295)}, {}),
              ElementsAre(HasSubstr("is 295 nm wide, less than the layer's WIDTH of 300 nm")));
  EXPECT_THAT(faults({strap(20'001, 500)}, {}),
              ElementsAre(HasSubstr("is off the manufacturing grid of 5 nm")));
  EXPECT_THAT(faults({strap(39'800, 500)}, {}), ElementsAre(HasSubstr("reaches out of the die")));
}

TEST(FixedMetal, PinsOfTheDieKeepApartFromAllButTheirNet) {
  const Technology technology =
      with(cell("inv", "gnd", "vdd", "SYMMETRY X Y ;", " OBS LAYER m2 ; RECT 3 6 4 7 ; END\n"));
  const int m2 = technology.find_layer("m2");
  Design d = row_of(technology);
  d.nets.resize(4);
  d.nets[0].straps.push_back({m2, {30'000, 0, 31'000, 40'000}});
  d.nets[2].pins = {{0, technology.macros[0].find_pin("a")}};  // its shape on m2: 11..12, 14..15 um
  const auto faults = [&](int net, const std::vector<Point>& places) {
    d.pins.clear();
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Point at = places[i];
      d.pins.push_back({"p" + std::to_string(i),
                        net + static_cast<int>(i),
                        PinDirection::input,
                        Use::signal,
                        true,
                        {m2, {at.x, at.y, at.x + 300, at.y + 300}},
                        {}});
    }
    return die_pin_faults(d, technology);
  };
  EXPECT_THAT(faults(3, {{20'000, 0}}), IsEmpty());
  EXPECT_THAT(faults(2, {{11'500, 14'500}}), IsEmpty());
  EXPECT_THAT(faults(3, {{11'500, 14'500}}), ElementsAre("pin p0 is at pin a of u0 on m2"));
  EXPECT_THAT(faults(3, {{13'500, 16'500}}), ElementsAre("pin p0 is at an obstruction of u0 on m2"));
  EXPECT_THAT(faults(3, {{29'400, 0}}), IsEmpty());
  EXPECT_THAT(faults(3, {{29'405, 0}}), ElementsAre("pin p0 is at a strap of vdd on m2"));
  EXPECT_THAT(faults(2, {{20'000, 0}, {20'600, 0}}), IsEmpty());
  // a supply's pin is metal like its straps
  d.pins = {{"vss", 1, PinDirection::inout, Use::ground, true, {m2, {30'500, 0, 30'800, 300}}, {}}};
  EXPECT_THAT(die_pin_faults(d, technology), ElementsAre("pin vss is at a strap of vdd on m2"));
  d.pins[0].net = 0;
  d.pins[0].use = Use::power;
  EXPECT_THAT(die_pin_faults(d, technology), IsEmpty());
  EXPECT_THAT(fixed_shapes(d, technology), Contains(d.pins[0].shape));
  EXPECT_THAT(faults(2, {{20'000, 0}, {20'595, 0}}), ElementsAre("pin p1 is at pin p0 on m2"));
}

TEST(FixedMetal, CellsOfARowHaveLikeRails) {
  const auto refusal = [](const std::string& cells) -> std::string {
    const Technology technology = with(cells);
    try {
      require_like_rails(row_of(technology), technology);
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  };
  const std::string good = cell("inv", "gnd", "vdd", "SYMMETRY X Y ;", "");
  EXPECT_EQ(refusal(good + cell("buf", "gnd", "vdd", "SYMMETRY X ;", "")), "");
  EXPECT_EQ(
      refusal(good + cell("buf", "vdd", "gnd", "SYMMETRY X Y ;", "")),
      "cells.lef: MACRO buf: found the rails vdd below and gnd above, expected gnd and vdd as MACRO inv has");
  EXPECT_THAT(refusal(good + cell("buf", "gnd", "vcc", "SYMMETRY X Y ;", "")),
              HasSubstr("gnd below and vcc above"));
  for (const char* symmetry : {"", "SYMMETRY Y ;"})
    EXPECT_EQ(
        refusal(good + cell("buf", "gnd", "vdd", symmetry, "")),
        "cells.lef: MACRO buf: found SYMMETRY without X, expected it, as every second row is upside down");
}

TEST(Delays, OtherUnitsAreRefused) {
  const auto refusal = [](const std::string& units) -> std::string {
    try {
      parse_delays("library(l) {\n " + units + "\n cell(c) { pin(a) { capacitance : 1; } } }", "a.lib");
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("time_unit : \"1ns\"; capacitive_load_unit (1, pf);"), "");
  EXPECT_EQ(refusal("capacitive_load_unit (1.000, \"pF\");"), "");
  EXPECT_EQ(refusal("time_unit : \"1ps\";"), "a.lib:2:2: found time_unit 1ps, expected 1ns");
  EXPECT_EQ(refusal("capacitive_load_unit (1, ff);"),
            "a.lib:2:2: found capacitive_load_unit 1 ff, expected 1 pf");
  EXPECT_THAT(refusal("capacitive_load_unit (10, pf);"), HasSubstr("found capacitive_load_unit 10 pf"));
}

TEST(FixedMetal, StrapsLieOnAVerticalLayerAboveTheRails) {
  const Technology technology = with(cell("inv", "gnd", "vdd", "SYMMETRY X Y ;", ""));
  for (const char* layer : {"m1", "nosuch"}) {
    Design d = row_of(technology);
    make_floorplan(d, technology, {0.5, 10'000});
    EXPECT_THROW(add_power_grid(d, technology, {layer, 1'000, 8'000}), UserError) << layer;
  }
}

}  // namespace
}  // namespace meltstage::layout
