// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/route/route.hpp"

#include <gmock/gmock.h>

#include <random>

#include "asic/layout/place/place.hpp"
#include "asic/layout/route/maze.hpp"
#include "base/error.hpp"
#include "tests/asic/layout/metal_check.hpp"
#include "tests/asic/layout/random_netlist.hpp"

namespace meltstage::layout {
namespace {

using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

MazeProblem empty_maze(int columns, int rows, bool ends_spread) {
  MazeProblem problem;
  problem.grid.columns = columns;
  problem.grid.rows = rows;
  problem.grid.vertical = {true, false, true, false};
  problem.grid.ends_spread.assign(4, ends_spread);
  problem.owner.assign(static_cast<std::size_t>(problem.grid.nodes()), kFreeNode);
  return problem;
}

/// Places that two nets use, or that lie beside another's where ends spread; terminals that a net's edges
/// don't join.
std::vector<std::string> maze_errors(const MazeProblem& problem, const MazeResult& result) {
  std::vector<std::string> errors;
  std::map<int, std::set<int>> users;
  for (std::size_t n = 0; n < result.trees.size(); ++n) {
    std::map<int, int> parent;
    const auto root = [&](int i) {
      parent.try_emplace(i, i);
      while (parent[i] != i) i = parent[i];
      return i;
    };
    for (const auto& [a, b] : result.trees[n]) {
      parent[root(a)] = root(b);
      for (const int node : {a, b}) {
        users[node].insert(static_cast<int>(n));
        const std::int32_t owner = problem.owner[static_cast<std::size_t>(node)];
        if (owner != kFreeNode && owner != static_cast<int>(n))
          errors.push_back(fmt::format("net {} on a node of {}", n, owner));
      }
    }
    std::set<int> roots;
    for (const auto& terminal : problem.nets[n].terminals) roots.insert(root(terminal.front()));
    if (roots.size() > 1) errors.push_back(fmt::format("net {} open", n));
  }
  for (const auto& [node, nets] : users) {
    if (nets.size() > 1) errors.push_back(fmt::format("node {} used twice", node));
    const Grid::Crossing c = problem.grid.crossing(node);
    const auto layer = static_cast<std::size_t>(c.layer);
    const int along = problem.grid.vertical[layer] ? c.iy : c.ix;
    if (!problem.grid.ends_spread[layer] || along == 0) continue;
    const auto before = users.find(node - 1);
    if (before != users.end() && before->second != nets)
      errors.push_back(fmt::format("node {} beside another net", node));
  }
  return errors;
}

TEST(Maze, FindsTheStraightWay) {
  MazeProblem problem = empty_maze(8, 8, false);
  problem.nets.push_back({{{problem.grid.node(0, 3, 1)}, {problem.grid.node(0, 3, 6)}}, {}});
  const MazeResult result = route_maze(problem, {});
  EXPECT_THAT(result.open, IsEmpty());
  EXPECT_THAT(result.trees[0], SizeIs(5));
}

int highest_layer(const MazeProblem& problem, const MazeTree& tree) {
  int highest = 0;
  for (const auto& [a, b] : tree)
    highest = std::max({highest, problem.grid.crossing(a).layer, problem.grid.crossing(b).layer});
  return highest;
}

TEST(Maze, ANetStaysBelowItsHighestLayer) {
  MazeProblem problem = empty_maze(8, 8, false);
  // the two lower layers are walled where the straight way is, and left open at the side
  for (int layer = 0; layer < 2; ++layer)
    for (int ix = 0; ix < 7; ++ix)
      problem.owner[static_cast<std::size_t>(problem.grid.node(layer, ix, 4))] = kBlockedNode;
  problem.nets.push_back({{{problem.grid.node(0, 3, 1)}, {problem.grid.node(0, 3, 6)}}, {}});
  const MazeResult free = route_maze(problem, {});
  EXPECT_GT(highest_layer(problem, free.trees[0]), 1);
  problem.nets[0].highest = 1;
  problem.begun = free.trees;
  const MazeResult lower = route_maze(problem, {});
  EXPECT_THAT(lower.open, IsEmpty());
  EXPECT_THAT(maze_errors(problem, lower), IsEmpty());
  EXPECT_EQ(highest_layer(problem, lower.trees[0]), 1);
}

TEST(Maze, WaysToTheRootAreShortWhereTheyCount) {
  MazeProblem problem = empty_maze(30, 30, false);
  const auto node = [&](int ix, int iy) { return problem.grid.node(0, ix, iy); };
  // terminals on three sides of a square: the least wire goes all around it
  problem.nets.push_back({{{node(22, 22)}, {node(2, 22)}, {node(2, 2)}, {node(22, 4)}}, {}});
  problem.nets[0].root = 2;
  const auto way_to = [&](const MazeTree& tree, int from, int to) {
    std::map<int, std::vector<int>> beside;
    for (const auto& [a, b] : tree) beside[a].push_back(b), beside[b].push_back(a);
    std::map<int, int> steps{{from, 0}};
    for (std::vector<int> open{from}; !open.empty();) {
      const int now = open.back();
      open.pop_back();
      for (const int next : beside[now])
        if (steps.try_emplace(next, steps[now] + 1).second) open.push_back(next);
    }
    return steps.at(to);
  };
  const MazeResult least = route_maze(problem, {});
  problem.nets[0].way_back = 50;
  const MazeResult direct = route_maze(problem, {});
  EXPECT_THAT(maze_errors(problem, direct), IsEmpty());
  EXPECT_GT(way_to(least.trees[0], node(2, 2), node(22, 4)), 50);
  EXPECT_LT(way_to(direct.trees[0], node(2, 2), node(22, 4)), 30);
  EXPECT_LE(least.trees[0].size(), direct.trees[0].size());
}

TEST(Maze, TellsANetThatIsWalledIn) {
  MazeProblem problem = empty_maze(8, 8, false);
  for (int layer = 0; layer < problem.grid.layers(); ++layer)
    for (int ix = 0; ix < 8; ++ix)
      problem.owner[static_cast<std::size_t>(problem.grid.node(layer, ix, 4))] = kBlockedNode;
  problem.nets.push_back({{{problem.grid.node(0, 3, 1)}, {problem.grid.node(0, 3, 6)}}, {}});
  EXPECT_THAT(route_maze(problem, {}).open, Contains(0));
}

TEST(Maze, TellsNetsThatCannotShare) {
  MazeProblem problem = empty_maze(2, 8, false);
  problem.grid.vertical = {true};
  problem.grid.ends_spread = {false};
  problem.owner.assign(static_cast<std::size_t>(problem.grid.nodes()), kFreeNode);
  problem.nets.push_back({{{problem.grid.node(0, 0, 1)}, {problem.grid.node(0, 0, 5)}}, {}});
  problem.nets.push_back({{{problem.grid.node(0, 0, 3)}, {problem.grid.node(0, 0, 7)}}, {}});
  EXPECT_THAT(route_maze(problem, {.rounds = 5, .progress = {}}).conflicting, SizeIs(2));
}

/// Regions of 4 by 4 crossings.
void divide(MazeProblem& problem) {
  MazeRegions& regions = problem.regions;
  regions.columns = problem.grid.columns / 4;
  regions.rows = problem.grid.rows / 4;
  for (int ix = 0; ix < problem.grid.columns; ++ix) regions.of_column.push_back(ix / 4);
  for (int iy = 0; iy < problem.grid.rows; ++iy) regions.of_row.push_back(iy / 4 * regions.columns);
}

TEST(Maze, WiresStayNearTheirRegionsUnlessThereIsNoWay) {
  for (const bool is_walled : {false, true}) {
    MazeProblem problem = empty_maze(40, 40, false);
    divide(problem);
    // from the left to the right along the upper edge, though the straight way is along the lower one
    MazeNet net{{{problem.grid.node(0, 1, 1)}, {problem.grid.node(0, 38, 1)}}, {}};
    for (int k = 0; k < 10; ++k) {
      net.regions.push_back(90 + k);
      net.regions.push_back(10 * k);
      net.regions.push_back(10 * k + 9);
    }
    if (is_walled)
      for (int layer = 0; layer < 4; ++layer)
        for (int iy = 20; iy < 40; ++iy)
          problem.owner[static_cast<std::size_t>(problem.grid.node(layer, 20, iy))] = kBlockedNode;
    problem.nets.push_back(net);
    const MazeResult result = route_maze(problem, {});
    EXPECT_THAT(maze_errors(problem, result), IsEmpty());
    int lowest_in_middle = 40;
    for (const auto& [a, b] : result.trees[0]) {
      const Grid::Crossing c = problem.grid.crossing(a);
      if (c.ix >= 12 && c.ix < 28) lowest_in_middle = std::min(lowest_in_middle, c.iy);
    }
    if (is_walled)
      EXPECT_LT(lowest_in_middle, 20);
    else
      EXPECT_GE(lowest_in_middle, 32);
  }
}

TEST(Maze, RandomNetsEndWithoutConflict) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    MazeProblem problem = empty_maze(40, 40, seed % 2 == 0);
    std::set<int> taken;
    for (int n = 0; n < 30; ++n) {
      MazeNet net;
      const int pins = 2 + static_cast<int>(random() % 3);
      while (static_cast<int>(net.terminals.size()) < pins) {
        const int ix = static_cast<int>(random() % 20) * 2, iy = static_cast<int>(random() % 13) * 3;
        if (!taken.insert(problem.grid.node(0, ix, iy)).second) continue;
        net.terminals.push_back({problem.grid.node(0, ix, iy)});
        problem.owner[static_cast<std::size_t>(net.terminals.back().front())] = n;
      }
      problem.nets.push_back(net);
    }
    const MazeResult result = route_maze(problem, {});
    EXPECT_THAT(maze_errors(problem, result), IsEmpty()) << seed;
    EXPECT_THAT(result.conflicting, IsEmpty()) << seed;
    EXPECT_THAT(result.open, IsEmpty()) << seed;
  }
}

class Routing : public ::testing::Test {
 protected:
  Design placed_design(int cells, unsigned seed) const {
    Design d = random_netlist(technology, cells, seed);
    make_floorplan(d, technology, {0.5, 8000});
    place_globally(d, technology, {});
    legalize(d, technology);
    improve(d, technology, 1);
    return d;
  }
  const Technology technology = read_lef({OSU018_LEF});
};

TEST_F(Routing, JoinsAllPinsAndKeepsAllSpacings) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Design d = placed_design(40 + 40 * static_cast<int>(seed), seed);
    const RouteReport report = route(d, technology, {});
    EXPECT_TRUE(report.is_clean()) << seed << ' ' << report.no_access.size() << ' ' << report.crowded.size()
                                   << ' ' << report.open.size() << ' ' << report.conflicting.size();
    EXPECT_THAT(open_nets(d, technology), IsEmpty()) << seed;
    EXPECT_THAT(spacing_errors(d, technology), IsEmpty()) << seed;
  }
}

/// Metal of signals that is nearer to a strap than the strap asks for.
std::vector<std::string> at_a_strap(const Design& d, const Technology& technology) {
  std::vector<std::string> errors;
  for (const MetalShape& metal : metal_of(d, technology)) {
    if (metal.net < 0) continue;
    for (const Net& supply : d.nets)
      for (const Shape& strap : supply.straps) {
        const Layer& layer = technology.layers[static_cast<std::size_t>(strap.layer)];
        const Nm spacing = layer.spacing_for(strap.rect.width(), strap.rect.height());
        if (metal.shape.layer == strap.layer && gap_squared(metal.shape.rect, strap.rect) < spacing * spacing)
          errors.push_back(fmt::format("net {} at a strap of {}", metal.net, supply.name));
      }
  }
  return errors;
}

// Pins beside a strap get their vias on its other side, or are told; nothing of theirs lies in it.
TEST_F(Routing, NoViaOfAPinLiesInAStrap) {
  const int upper = technology.find_layer("metal2");
  std::size_t told = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    for (const Nm width : {800, 4'000}) {
      Design d = placed_design(120, seed);
      const Nm x = d.die.middle().x + 130 * static_cast<Nm>(seed);
      d.nets[0].straps.push_back({upper, {x, d.die.y0, x + width, d.die.y1}});
      const RouteReport report = route(d, technology, {});
      EXPECT_THAT(at_a_strap(d, technology), IsEmpty()) << seed << ' ' << width;
      EXPECT_THAT(spacing_errors(d, technology), IsEmpty()) << seed << ' ' << width;
      told += report.no_access.size();
    }
  }
  EXPECT_GT(told, 0u);
}

TEST_F(Routing, NoViaOfAPinLiesOnAnObstructionOfItsCuts) {
  Technology obstructed = technology;
  const int cut = technology.find_layer("via");
  ASSERT_GE(cut, 0);
  for (Macro& macro : obstructed.macros)
    if (macro.name == "INVX1") macro.obstructions.push_back({cut, {0, 0, macro.width, macro.height}});
  Design d = placed_design(60, 2);
  const auto inverters = std::count_if(d.components.begin(), d.components.end(), [&](const Component& c) {
    return technology.macros[static_cast<std::size_t>(c.macro)].name == "INVX1";
  });
  ASSERT_GT(inverters, 0);
  EXPECT_GE(route(d, obstructed, {}).no_access.size(), 2 * static_cast<std::size_t>(inverters));
}

// Nothing joins it to the supply's rail.
TEST_F(Routing, AnOutputAtAConstantIsToldOpen) {
  Design d = placed_design(40, 1);
  DiePin one = d.pins.back();
  one.name = "one";
  one.net = 0;
  one.direction = PinDirection::output;
  d.nets[0].pins.push_back({kDiePin, static_cast<int>(d.pins.size())});
  d.pins.push_back(one);
  EXPECT_THAT(route(d, technology, {}).open, Contains("one (output at a constant)"));
}

// Vias so small that two of them fit on crossings side by side, where a patch of least area does not.
TEST_F(Routing, PatchesKeepTheirSpacing) {
  Technology small = technology;
  for (Layer& layer : small.layers)
    if (layer.kind == LayerKind::routing) layer.area_nm2 = 330'000;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Design d = placed_design(160, seed);
    route(d, small, {});
    EXPECT_THAT(spacing_errors(d, small), IsEmpty()) << seed;
  }
}

TEST_F(Routing, MetalThatReachesTheCrossingAfterTheNextIsRefused) {
  for (const bool by_area : {true, false}) {
    Technology wide = technology;
    const int metal3 = wide.find_layer("metal3");
    if (by_area) {
      wide.layers[static_cast<std::size_t>(metal3)].area_nm2 = 1'500'000;
    } else {
      for (Via& via : wide.vias)
        for (Shape& shape : via.shapes)
          if (shape.layer == metal3) shape.rect = {-900, -200, 900, 200};
    }
    Design d = placed_design(20, 1);
    EXPECT_THAT([&] { route(d, wide, {}); },
                ::testing::ThrowsMessage<UserError>(::testing::HasSubstr("on metal3 reaches")))
        << by_area;
  }
}

TEST_F(Routing, TheChecksFindAMissingViaAndADisplacedWire) {
  Design d = placed_design(80, 3);
  ASSERT_TRUE(route(d, technology, {}).is_clean());
  const auto wired =
      std::find_if(d.nets.begin(), d.nets.end(), [](const Net& net) { return net.wires.size() > 2; });
  ASSERT_NE(wired, d.nets.end());
  Design without_via = d;
  without_via.nets[static_cast<std::size_t>(wired - d.nets.begin())].vias.pop_back();
  EXPECT_THAT(open_nets(without_via, technology), Contains(wired->name));
  Design displaced = d;
  for (Net& net : displaced.nets)
    for (Wire& wire : net.wires) {
      const Point by = wire.from.x == wire.to.x ? Point{600, 0} : Point{0, 800};
      wire.from = {wire.from.x + by.x, wire.from.y + by.y};
      wire.to = {wire.to.x + by.x, wire.to.y + by.y};
      if (&net == &displaced.nets.back()) break;
    }
  EXPECT_THAT(spacing_errors(displaced, technology), Not(IsEmpty()));
}

TEST_F(Routing, IsTheSameAsDef) {
  Design d = placed_design(60, 5);
  route(d, technology, {});
  const Design again = parse_def(def_text(d, technology), "routed", technology);
  EXPECT_THAT(open_nets(again, technology), IsEmpty());
  EXPECT_THAT(spacing_errors(again, technology), IsEmpty());
}

TEST_F(Routing, ADiePinBesideTheTracksIsOneLine) {
  // Far off, and so near that a wire would touch it by a corner.
  for (const Nm off : {333, 100}) {
    Design d = placed_design(20, 1);
    for (DiePin& pin : d.pins) pin.shape.rect = pin.shape.rect.moved({off, off});
    EXPECT_THROW(route(d, technology, {}), UserError) << off;
  }
}

TEST_F(Routing, ParasiticsNameEveryPinOnce) {
  Design d = placed_design(60, 2);
  const RouteReport report = route(d, technology, {});
  for (std::size_t n = 0; n < d.nets.size(); ++n) {
    if (report.parasitics[n].resistors.empty()) continue;
    for (const int node : report.parasitics[n].node_of_pin) EXPECT_GE(node, 0) << d.nets[n].name;
  }
  EXPECT_THAT(routed_spef_text(d, technology, report), ::testing::HasSubstr("*D_NET"));
}

// Unescaped, a bracket in the middle of a name makes readers miss the net.
TEST_F(Routing, ParasiticsEscapeNames) {
  Design d = placed_design(20, 1);
  for (Net& net : d.nets) net.name = "u_a.words_q[" + net.name + "]_15";
  const std::string text = routed_spef_text(d, technology, route(d, technology, {}));
  EXPECT_THAT(text, ::testing::HasSubstr("*D_NET u_a\\.words_q\\["));
  EXPECT_THAT(text, ::testing::HasSubstr("\\]_15:"));
  EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("q[")));
}

}  // namespace
}  // namespace meltstage::layout
