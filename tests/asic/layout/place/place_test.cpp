// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/place/place.hpp"

#include <gmock/gmock.h>

#include <random>

#include "base/error.hpp"
#include "tests/asic/layout/random_netlist.hpp"

namespace meltstage::layout {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Place : public ::testing::Test {
 protected:
  Design ready(int cells, unsigned seed, double utilization) const {
    Design d = random_netlist(technology, cells, seed);
    make_floorplan(d, technology, {utilization, 5000});
    return d;
  }
  Design legal(int cells, unsigned seed, double utilization) const {
    Design d = ready(cells, seed, utilization);
    place_globally(d, technology, {});
    legalize(d, technology);
    return d;
  }
  /// Cells anywhere on the die.
  void scatter(Design& d, unsigned seed) const {
    std::mt19937 random(seed);
    for (Component& c : d.components) {
      c.at = {static_cast<Nm>(random() % static_cast<unsigned>(d.die.x1)),
              static_cast<Nm>(random() % static_cast<unsigned>(d.die.y1))};
      c.is_placed = true;
    }
  }
  const Technology technology = read_lef({OSU018_LEF});
};

TEST_F(Place, IsLegalWhateverTheNetlistAndUtilization) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    for (const double utilization : {0.4, 0.7, 0.95}) {
      Design d = legal(10 + static_cast<int>(seed) * 30, seed, utilization);
      EXPECT_THAT(placement_errors(d, technology), IsEmpty()) << seed << ' ' << utilization;
      const Nm before = wirelength(d, technology);
      improve(d, technology, 2);
      EXPECT_THAT(placement_errors(d, technology), IsEmpty()) << seed << ' ' << utilization;
      EXPECT_LT(wirelength(d, technology), before);
    }
  }
}

TEST_F(Place, LegalizesAnyStart) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Design d = ready(300, seed, 0.95);
    scatter(d, seed);
    legalize(d, technology);
    EXPECT_THAT(placement_errors(d, technology), IsEmpty()) << seed;
  }
}

TEST_F(Place, IsFarShorterThanCellsAnywhere) {
  Design d = legal(1000, 5, 0.7);
  improve(d, technology, 2);
  Design any = d;
  scatter(any, 5);
  legalize(any, technology);
  EXPECT_LT(3 * wirelength(d, technology), wirelength(any, technology));
}

TEST_F(Place, SameInputSamePlacement) {
  EXPECT_EQ(def_text(legal(200, 3, 0.7), technology), def_text(legal(200, 3, 0.7), technology));
}

TEST_F(Place, FillersLeaveNoGapAndStrapsMeetEachRail) {
  Design d = legal(200, 2, 0.7);
  add_fillers(d, technology, "FILL");
  EXPECT_THAT(placement_errors(d, technology), IsEmpty());
  EXPECT_DOUBLE_EQ(utilization(d, technology), 1.0);
  add_power_grid(d, technology, {"metal6", 1600, 50000});
  for (const int supply : {0, 1}) {
    const Net& net = d.nets[static_cast<std::size_t>(supply)];
    for (const Shape& rail : net.straps) {
      if (technology.layers[static_cast<std::size_t>(rail.layer)].name != "metal1") continue;
      for (const Shape& strap : net.straps) {
        if (technology.layers[static_cast<std::size_t>(strap.layer)].name != "metal6") continue;
        const Point at{strap.rect.middle().x, rail.rect.middle().y};
        EXPECT_EQ(std::count_if(net.strap_vias.begin(), net.strap_vias.end(),
                                [&](const PlacedVia& v) { return v.at == at; }),
                  5);
      }
    }
  }
}

// Each seeded fault must be found by name.
TEST_F(Place, FindsSeededFaults) {
  const Design good = legal(100, 1, 0.7);
  const auto errors_of = [&](const auto& spoil) {
    Design d = good;
    spoil(d);
    return ::testing::PrintToString(placement_errors(d, technology));
  };
  EXPECT_THAT(errors_of([](Design& d) {
                d.components[7].at = d.components[8].at;
                d.components[7].orientation = d.components[8].orientation;
              }),
              HasSubstr("overlap"));
  // two cells in one, behind the first of them
  EXPECT_THAT(errors_of([&](Design& d) {
                Component wide = d.components[7];
                wide.name = "wide";
                wide.macro = technology.find_macro("DFFSR");
                wide.at.x = 0;
                for (Component& c : d.components) wide.at.x = std::max(wide.at.x, c.at.x);
                Component narrow = wide;
                narrow.macro = technology.find_macro("INVX1");
                narrow.name = "first";
                narrow.at.x += 800;
                d.components.push_back(wide);
                d.components.push_back(narrow);
                narrow.name = "second";
                narrow.at.x += 3200;
                d.components.push_back(narrow);
              }),
              ::testing::AllOf(HasSubstr("wide and first: overlap"), HasSubstr("wide and second: overlap")));
  EXPECT_THAT(errors_of([](Design& d) { d.components[7].at.x += 50; }), HasSubstr("u7: at x"));
  EXPECT_THAT(errors_of([](Design& d) { d.components[7].at.y += 50; }), HasSubstr("u7: at y"));
  EXPECT_THAT(errors_of([](Design& d) { d.components[7].at.x = d.die.x1; }),
              HasSubstr("u7: outside the die"));
  EXPECT_THAT(errors_of([](Design& d) { d.components[7].is_placed = false; }), HasSubstr("u7: not placed"));
  EXPECT_THAT(errors_of([](Design& d) {
                Orientation& o = d.components[7].orientation;
                o = o == Orientation::N ? Orientation::FS : Orientation::N;
              }),
              HasSubstr("u7: its supplies"));
}

TEST_F(Place, WrongOptionsAreOneLine) {
  Design d = random_netlist(technology, 20, 1);
  EXPECT_THROW(make_floorplan(d, technology, {1.5, 0}), UserError);
  make_floorplan(d, technology, {0.7, 0});
  EXPECT_THROW(add_power_grid(d, technology, {"nosuch", 1600, 50000}), UserError);
  EXPECT_THROW(add_fillers(d, technology, "NOSUCH"), UserError);
  d.rows.resize(1);
  scatter(d, 1);
  EXPECT_THROW(legalize(d, technology), UserError);
}

}  // namespace
}  // namespace meltstage::layout
