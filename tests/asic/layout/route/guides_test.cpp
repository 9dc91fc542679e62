// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/route/guides.hpp"

#include <gmock/gmock.h>

#include <queue>
#include <set>

#include "asic/layout/place/place.hpp"
#include "tests/asic/layout/random_netlist.hpp"

namespace meltstage::layout {
namespace {

using ::testing::IsSubsetOf;
using ::testing::SizeIs;

class GuidesTest : public ::testing::Test {
 protected:
  Design placed_design(int cells, unsigned seed, double utilization, int crowding_rounds) const {
    Design d = random_netlist(technology, cells, seed);
    make_floorplan(d, technology, {utilization, 8000});
    GlobalPlacement options;
    options.crowding_rounds = crowding_rounds;
    place_globally(d, technology, options);
    return d;
  }
  /// Regions of the net's pins, found without the router.
  std::set<int> regions_of_pins(const Design& d, const Net& net, const RegionGrid& grid) const {
    std::set<int> regions;
    for (const PinRef& ref : net.pins) {
      const std::vector<Shape> shapes = pin_shapes(d, technology, ref);
      Rect box = shapes.front().rect;
      for (const Shape& s : shapes)
        box = {std::min(box.x0, s.rect.x0), std::min(box.y0, s.rect.y0), std::max(box.x1, s.rect.x1),
               std::max(box.y1, s.rect.y1)};
      regions.insert(grid.region_of(box.middle()));
    }
    return regions;
  }
  const Technology technology = read_lef({OSU018_LEF});
};

/// Each gate's input from any gate: far more wire than logic has.
void tangle(Design& d, const Technology& technology) {
  std::mt19937 random(1);
  std::vector<PinRef> inputs;
  std::vector<int> nets;
  for (std::size_t n = 3; n < d.nets.size(); ++n) {
    nets.push_back(static_cast<int>(n));
    std::erase_if(d.nets[n].pins, [&](const PinRef& ref) {
      const bool is_input =
          ref.component != kDiePin && pin_direction(d, technology, ref) == PinDirection::input;
      if (is_input) inputs.push_back(ref);
      return is_input;
    });
  }
  for (const PinRef& ref : inputs)
    d.nets[static_cast<std::size_t>(nets[random() % nets.size()])].pins.push_back(ref);
}

/// Regions that can be reached from the first through sides of others of the list.
std::set<int> reached(const std::vector<int>& regions, const RegionGrid& grid) {
  const std::set<int> all(regions.begin(), regions.end());
  std::set<int> seen{regions.front()};
  std::queue<int> left({regions.front()});
  while (!left.empty()) {
    const int r = left.front();
    left.pop();
    std::vector<int> beside{r - grid.columns, r + grid.columns};
    if (r % grid.columns > 0) beside.push_back(r - 1);
    if (r % grid.columns + 1 < grid.columns) beside.push_back(r + 1);
    for (const int next : beside)
      if (all.count(next) != 0 && seen.insert(next).second) left.push(next);
  }
  return seen;
}

TEST_F(GuidesTest, EachNetsRegionsHoldItsPinsAndHangTogether) {
  const Design d = placed_design(400, 2, 0.6, 0);
  const Guides guides = route_globally(d, technology, {});
  ASSERT_GT(guides.grid.regions(), 50);
  int seen = 0;
  for (std::size_t n = 0; n < d.nets.size(); ++n) {
    const Net& net = d.nets[n];
    if (net.use != Use::signal || net.pins.size() < 2) continue;
    ++seen;
    EXPECT_THAT(regions_of_pins(d, net, guides.grid), IsSubsetOf(guides.regions[n])) << net.name;
    EXPECT_THAT(reached(guides.regions[n], guides.grid), SizeIs(guides.regions[n].size())) << net.name;
  }
  EXPECT_GT(seen, 300);
}

TEST_F(GuidesTest, NetsGoRoundWhatIsCrowded) {
  const Design d = placed_design(1000, 3, 0.8, 0);
  GuideOptions tight;
  tight.usable = 0.3;
  tight.rounds = 1;
  const double first = route_globally(d, technology, tight).overflow;
  tight.rounds = 12;
  const double last = route_globally(d, technology, tight).overflow;
  EXPECT_GT(first, 10.0);
  EXPECT_LT(last, 0.5 * first);
}

TEST_F(GuidesTest, CellsGetRoomWhereWiresAreCrowded) {
  const auto crowded = [&](int crowding_rounds) {
    Design d = random_netlist(technology, 1500, 4);
    tangle(d, technology);
    make_floorplan(d, technology, {0.55, 8000});
    GlobalPlacement options;
    options.crowding_rounds = crowding_rounds;
    options.usable_tracks = 0.45;
    place_globally(d, technology, options);
    GuideOptions once;
    once.usable = options.usable_tracks;
    once.rounds = 1;
    return std::pair{route_globally(d, technology, once).overflow,
                     std::count_if(d.components.begin(), d.components.end(),
                                   [](const Component& c) { return c.padding > 0; })};
  };
  const auto [before, none] = crowded(0);
  const auto [after, padded] = crowded(6);
  EXPECT_EQ(none, 0);
  EXPECT_GT(padded, 0);
  EXPECT_GT(before, 0.0);
  EXPECT_LT(after, before);
}

}  // namespace
}  // namespace meltstage::layout
