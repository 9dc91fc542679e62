// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/route/antenna.hpp"

#include <gmock/gmock.h>

#include "asic/layout/place/place.hpp"
#include "asic/layout/route/route.hpp"
#include "tests/asic/layout/metal_check.hpp"
#include "tests/asic/layout/random_netlist.hpp"

namespace meltstage::layout {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

// Gates of 0.1 um2; metal's ratio may be 200, and 3,200 with 0.16 um2 of diffusion or more.
constexpr const char* kLibrary = R"(
LAYER M1
  TYPE ROUTING ; DIRECTION HORIZONTAL ; WIDTH 0.2 ;
  ANTENNACUMAREARATIO 200 ;
  ANTENNACUMDIFFAREARATIO PWL ( ( 0 200 ) ( 0.159 200 ) ( 0.16 3200 ) ( 1.16 4200 ) ) ;
END M1
LAYER V1
  TYPE CUT ;
  ANTENNAAREARATIO 20 ;
  ANTENNADIFFAREARATIO 80 ;
END V1
LAYER M2
  TYPE ROUTING ; DIRECTION VERTICAL ; WIDTH 0.2 ;
  ANTENNACUMAREARATIO 200 ;
  ANTENNACUMDIFFAREARATIO PWL ( ( 0 200 ) ( 0.159 200 ) ( 0.16 3200 ) ( 1.16 4200 ) ) ;
END M2
VIA V12 DEFAULT
  LAYER M1 ; RECT -0.1 -0.1 0.1 0.1 ;
  LAYER V1 ; RECT -0.1 -0.1 0.1 0.1 ;
  LAYER M2 ; RECT -0.1 -0.1 0.1 0.1 ;
END V12
MACRO GATE
  CLASS CORE ; SIZE 2 BY 4 ;
  PIN A
    DIRECTION INPUT ;
    ANTENNAGATEAREA 0.1 ;
    PORT
      LAYER M1 ; RECT 0 0 0.2 0.2 ;
    END
  END A
END GATE
MACRO DRIVER
  CLASS CORE ; SIZE 2 BY 4 ;
  PIN Y
    DIRECTION OUTPUT ;
    ANTENNADIFFAREA 0.5 ;
    PORT
      LAYER M1 ; RECT 0 0 0.2 0.2 ;
    END
  END Y
END DRIVER
MACRO FILL
  CLASS CORE SPACER ; SIZE 2 BY 4 ;
END FILL
MACRO DIODE
  CLASS CORE ANTENNACELL ; SIZE 2 BY 4 ;
  PIN A
    DIRECTION INPUT ;
    ANTENNADIFFAREA 0.5 ;
    PORT
      LAYER M1 ; RECT 0 0 0.2 0.2 ;
    END
  END A
END DIODE
END LIBRARY)";

// A driver at x = 100 um, a gate at 0: metal 1 from the gate over `low`, from there a via to metal 2 and on
// to the driver's via.
struct OneNet {
  Technology technology;
  Design design;
  explicit OneNet(Nm low) {
    parse_lef(kLibrary, "library", technology);
    design.components.push_back({"u0", technology.find_macro("DRIVER"), {100'000, 0}, Orientation::N, true});
    design.components.push_back({"u1", technology.find_macro("GATE"), {0, 0}, Orientation::N, true});
    Net net;
    net.name = "n";
    net.pins = {{0, 0}, {1, 0}};
    const Nm x = low + 100;
    net.wires.push_back({technology.find_layer("M1"), {100, 100}, {x, 100}, 200});
    net.wires.push_back({technology.find_layer("M2"), {x, 100}, {100'100, 100}, 200});
    net.vias = {{0, {x, 100}}, {0, {100'100, 100}}};
    design.nets.push_back(net);
  }
  std::vector<AntennaFault> faults() const { return antenna_faults(design, technology); }
};

TEST(Antenna, LimitGrowsWithDiffusion) {
  const OneNet n(1000);
  const AntennaRule& rule = n.technology.layers[0].antenna;
  EXPECT_TRUE(rule.is_cumulative);
  EXPECT_DOUBLE_EQ(rule.limit(0.0), 200.0);
  EXPECT_DOUBLE_EQ(rule.limit(0.159), 200.0);
  EXPECT_DOUBLE_EQ(rule.limit(0.66), 3700.0);
  EXPECT_DOUBLE_EQ(rule.limit(100.0), 4200.0);
  const AntennaRule& cut = n.technology.layers[1].antenna;
  EXPECT_FALSE(cut.is_cumulative);
  EXPECT_DOUBLE_EQ(cut.limit(0.0), 20.0);
  EXPECT_DOUBLE_EQ(cut.limit(0.5), 80.0);
}

TEST(Antenna, CountsTheMetalThatIsThereBeforeTheDriver) {
  // 0.2 um wide, the ends half a width beyond; the pin and the via's metal are 0.04 um2 each
  EXPECT_THAT(OneNet(99'000).faults(), IsEmpty());
  const OneNet longer(99'500);
  const std::vector<AntennaFault> faults = longer.faults();
  ASSERT_THAT(faults, SizeIs(1));
  EXPECT_EQ(faults[0].layer, longer.technology.find_layer("M1"));
  EXPECT_NEAR(faults[0].ratio, (0.2 * 99.7 + 2 * 0.04) / 0.1, 1e-6);
  EXPECT_DOUBLE_EQ(faults[0].limit, 200.0);
  EXPECT_THAT(faults[0].pins, ElementsAre(1));
}

TEST(Antenna, MetalOfTheDriversLayerHasItsDiffusion) {
  OneNet n(0);
  n.design.components[0].at.x = 1'000'000;  // all the way on metal 2, which joins the driver
  n.design.nets[0].wires[1].to.x = 1'000'100;
  n.design.nets[0].vias[1].at.x = 1'000'100;
  EXPECT_THAT(n.faults(), IsEmpty());
  n.design.nets[0].pins.erase(n.design.nets[0].pins.begin());  // a die pin's net has none
  const std::vector<AntennaFault> faults = n.faults();
  ASSERT_THAT(faults, SizeIs(1));
  EXPECT_EQ(faults[0].layer, n.technology.find_layer("M2"));
  EXPECT_NEAR(faults[0].ratio, (3 * 0.04 + 0.2 * 1000.2 + 2 * 0.04) / 0.1, 1e-6);
  EXPECT_EQ(antenna_text(faults[0], n.design, n.technology),
            fmt::format("net n: M2 area over gate area {:.0f}, most 200, at u1 A", faults[0].ratio));
}

TEST(Antenna, ManyCutsOnOneGate) {
  OneNet n(1000);
  for (int i = 0; i < 60; ++i) n.design.nets[0].vias.push_back({0, {1'100, 100}});
  n.design.nets[0].wires.pop_back();  // cuts before the driver is reached
  const std::vector<AntennaFault> faults = n.faults();
  ASSERT_THAT(faults, SizeIs(1));
  EXPECT_EQ(faults[0].layer, n.technology.find_layer("V1"));
  EXPECT_NEAR(faults[0].ratio, 61 * 0.04 / 0.1, 1e-6);
}

// Not where the gate is: the way from there to the diode would be more metal before it is joined.
TEST(Antenna, DiodesGoWhereTheMetalIsNear) {
  OneNet n(99'500);
  const int filler = n.technology.find_macro("FILL");
  n.design.components.push_back({"near_the_gate", filler, {0, 20'000}, Orientation::N, true});
  n.design.components.push_back({"near_the_metal", filler, {70'000, 4'000}, Orientation::N, true});
  EXPECT_EQ(insert_diodes(n.design, n.technology, n.faults()), 1);
  EXPECT_EQ(n.design.components[2].macro, filler);
  EXPECT_EQ(n.design.components[3].macro, n.technology.find_macro("DIODE"));
  EXPECT_EQ(n.design.nets[0].pins.back().component, 3);
}

// OSU's cells with gates that bear little metal, a diode three sites wide, and fillers of four sites.
class Diodes : public ::testing::Test {
 protected:
  Diodes() {
    for (Macro& macro : technology.macros)
      for (MacroPin& pin : macro.pins) {
        if (pin.use == Use::power || pin.use == Use::ground) continue;
        (pin.direction == PinDirection::output ? pin.diffusion_area_um2 : pin.gate_area_um2) = 0.5;
      }
    for (const char* name : {"metal2", "metal3", "metal4", "metal5"})
      technology.layers[static_cast<std::size_t>(technology.find_layer(name))].antenna = {
          30.0, {{0.0, 30.0}, {0.5, 1e6}}, true};
    technology.macros[static_cast<std::size_t>(technology.find_macro("FILL"))].macro_class = "CORE SPACER";
    add_macro("FILLS", 4, "CORE SPACER");
  }
  void add_macro(const std::string& name, int sites, const std::string& macro_class) {
    Macro macro = technology.macros[static_cast<std::size_t>(technology.find_macro("FILL"))];
    const Nm more = (sites - 1) * macro.width;
    macro.name = name;
    macro.macro_class = macro_class;
    macro.width += more;
    for (MacroPin& pin : macro.pins)
      for (Shape& s : pin.shapes) s.rect.x1 += more;
    technology.macro_index[name] = static_cast<int>(technology.macros.size());
    technology.macros.push_back(macro);
  }
  void add_diode() {
    add_macro("DIODE", 3, "CORE ANTENNACELL");
    MacroPin pin;
    pin.name = "A";
    pin.diffusion_area_um2 = 0.5;
    pin.shapes = {{technology.find_layer("metal1"), {800, 4000, 1600, 6000}}};
    technology.macros.back().pins.push_back(pin);
  }
  Design placed_design(unsigned seed) const {
    Design d = random_netlist(technology, 150, seed);
    make_floorplan(d, technology, {0.4, 8000});
    place_globally(d, technology, {});
    legalize(d, technology);
    add_fillers(d, technology, "FILL");
    return d;
  }
  Technology technology = read_lef({OSU018_LEF});
};

TEST_F(Diodes, TakeThePlaceOfFillersAndMendEveryFault) {
  add_diode();
  int diodes = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Design d = placed_design(seed);
    const std::size_t cells = d.components.size();
    const RouteReport report = route(d, technology, {});
    for (const AntennaFault& fault : report.antenna)
      ADD_FAILURE() << seed << ' ' << antenna_text(fault, d, technology) << ' ' << report.diodes;
    EXPECT_TRUE(report.is_clean()) << seed;
    EXPECT_THAT(open_nets(d, technology), IsEmpty()) << seed;
    EXPECT_THAT(spacing_errors(d, technology), IsEmpty()) << seed;
    EXPECT_THAT(placement_errors(d, technology), IsEmpty()) << seed;
    EXPECT_DOUBLE_EQ(utilization(d, technology), 1.0) << "no gap where a filler was";
    EXPECT_EQ(d.components.size(), cells + static_cast<std::size_t>(report.diodes))
        << "a filler of four sites: a diode and one of one";
    diodes += report.diodes;
  }
  EXPECT_GT(diodes, 0);
}

TEST_F(Diodes, WithoutTheCellTheFaultsAreTold) {
  Design d = placed_design(1);
  const RouteReport report = route(d, technology, {});
  EXPECT_THAT(report.antenna, Not(IsEmpty()));
  EXPECT_EQ(report.diodes, 0);
  EXPECT_FALSE(report.is_clean());
}

}  // namespace
}  // namespace meltstage::layout
