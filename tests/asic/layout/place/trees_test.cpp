// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/place/trees.hpp"

#include <gmock/gmock.h>

#include <set>

#include "asic/layout/place/drivers.hpp"
#include "asic/layout/place/place.hpp"
#include "asic/layout/place/spef.hpp"
#include "base/error.hpp"
#include "tests/asic/layout/random_netlist.hpp"

namespace meltstage::layout {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Every sink of the original net is reached from it through buffers alone, once.
std::multiset<std::string> reached(const Design& d, const Technology& t, int net) {
  std::multiset<std::string> names;
  for (const PinRef& ref : d.nets[static_cast<std::size_t>(net)].pins) {
    if (ref.component == kDiePin || pin_direction(d, t, ref) == PinDirection::output) continue;
    const Component& c = d.components[static_cast<std::size_t>(ref.component)];
    const Macro& macro = t.macros[static_cast<std::size_t>(c.macro)];
    if (macro.name.find("BUF") == std::string::npos) {
      names.insert(c.name + "/" + macro.pins[static_cast<std::size_t>(ref.pin)].name);
      continue;
    }
    for (std::size_t n = 0; n < d.nets.size(); ++n) {
      for (const PinRef& out : d.nets[n].pins) {
        if (out.component == ref.component && pin_direction(d, t, out) == PinDirection::output)
          names.merge(reached(d, t, static_cast<int>(n)));
      }
    }
  }
  return names;
}

class Trees : public ::testing::Test {
 protected:
  Design placed_design(int cells, unsigned seed) const {
    Design d = random_netlist(technology, cells, seed);
    make_floorplan(d, technology, {0.6, 5000});
    mark_clock(d, technology, delays, "clk");
    place_globally(d, technology, {});
    return d;
  }
  const Technology technology = read_lef({OSU018_LEF});
  const Delays delays = read_delays(OSU018_LIBERTY);
  const TreeOptions options{{"BUFX2", "BUFX4", "CLKBUF1"}, 0.25, 20};
};

TEST_F(Trees, ReadsDebiansDelays) {
  const DelayPin& out = delays.at("BUFX2").pins.at("Y");
  EXPECT_EQ(out.arcs.at(0).from, "A");
  EXPECT_TRUE(delays.at("DFFPOSX1").is_flop);
  EXPECT_TRUE(delays.at("DFFPOSX1").pins.at("CLK").is_clock);
  const DelayTable table{{0.1, 0.3}, {1.0, 2.0}, {10, 20, 30, 40}};
  EXPECT_DOUBLE_EQ(table.at(0.1, 1.0), 10);
  EXPECT_DOUBLE_EQ(table.at(0.2, 1.5), 25);
  EXPECT_DOUBLE_EQ(table.at(0.1, 3.0), 30);  // beyond the table, as between its last points
  try {
    parse_delays("library (a) { cell (b) { area 3; } }", "a.lib");
    FAIL();
  } catch (const UserError& error) {
    EXPECT_STREQ(error.what(), "a.lib:1:31: found \"3\", expected \":\" or \"(\"");
  }
}

TEST_F(Trees, ClockReachesEachFlopOnceAtNearlyTheSameTime) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Design d = placed_design(300 * static_cast<int>(seed), seed);
    const int clock = d.find_net("clk");
    const auto before = reached(d, technology, clock);
    const ClockTree tree = build_clock_tree(d, technology, delays, "clk", options);
    EXPECT_EQ(reached(d, technology, clock), before) << seed;
    EXPECT_EQ(static_cast<std::size_t>(tree.sinks), before.size());
    EXPECT_GT(tree.buffers, 0);
    legalize(d, technology);
    EXPECT_THAT(placement_errors(d, technology), IsEmpty());
    const ClockTree legal = measure_clock(d, technology, delays, "clk");
    EXPECT_LT(legal.skew_ns, 0.25 * legal.latency_ns) << seed;
  }
}

TEST_F(Trees, ClockIsThePortsNetAndThoseBehindGates) {
  Design d = random_netlist(technology, 200, 1);
  Delays gated = delays;
  gated.at("AND2X2").is_clock_gate = true;
  mark_clock(d, technology, gated, "clk");
  const int gate = technology.find_macro("AND2X2");
  for (const Net& net : d.nets) {
    const bool is_gated = std::any_of(net.pins.begin(), net.pins.end(), [&](const PinRef& ref) {
      return ref.component != kDiePin &&
             d.components[static_cast<std::size_t>(ref.component)].macro == gate &&
             pin_direction(d, technology, ref) == PinDirection::output;
    });
    EXPECT_EQ(net.use == Use::clock, net.name == "clk" || is_gated) << net.name;
  }
}

// Flops drawn anywhere in the netlist share a clock net, a word of 16 each time.
TEST_F(Trees, FlopsOfOneClockNetLieNearEachOther) {
  const auto words_um = [&](Use use, unsigned seed) {
    Design d = random_netlist(technology, 1500, seed);
    std::vector<PinRef> flops = take_sinks(d, technology, d.find_net("clk"));
    std::shuffle(flops.begin(), flops.end(), std::mt19937(seed));
    std::vector<std::size_t> words;
    for (std::size_t k = 0; k + 16 <= flops.size(); k += 16) {
      words.push_back(d.nets.size());
      Net& word = d.nets.emplace_back();
      word.name = fmt::format("word{}", k);
      word.use = use;
      word.pins.assign(flops.begin() + static_cast<std::ptrdiff_t>(k),
                       flops.begin() + static_cast<std::ptrdiff_t>(k + 16));
    }
    make_floorplan(d, technology, {0.8, 5000});
    place_globally(d, technology, {});
    legalize(d, technology);
    improve(d, technology, 2);
    double sum = 0.0;
    for (const std::size_t n : words) {
      std::vector<Sink> pins;
      for (const PinRef& ref : d.nets[n].pins) pins.push_back({ref, place_of(d, technology, ref), 0.0, 0.0});
      const Rect box = TreeBuilder::box_of(pins);
      sum += um(box.width() + box.height());
    }
    return sum;
  };
  for (unsigned seed = 1; seed <= 3; ++seed)
    EXPECT_LT(words_um(Use::clock, seed), 0.9 * words_um(Use::signal, seed)) << seed;
}

// A flop that hangs at the root instead of a leaf must show.
TEST_F(Trees, SkewShowsAMisplacedFlop) {
  Design d = placed_design(600, 1);
  const ClockTree good = build_clock_tree(d, technology, delays, "clk", options);
  const int clock = d.find_net("clk");
  for (std::size_t n = d.nets.size(); n-- > 0;) {
    Net& net = d.nets[n];
    const auto flop = std::find_if(net.pins.begin(), net.pins.end(), [&](const PinRef& ref) {
      return ref.component != kDiePin && d.components[static_cast<std::size_t>(ref.component)].name[0] == 'u';
    });
    if (net.use != Use::clock || static_cast<int>(n) == clock || flop == net.pins.end()) continue;
    d.nets[static_cast<std::size_t>(clock)].pins.push_back(*flop);
    net.pins.erase(flop);
    break;
  }
  EXPECT_GT(measure_clock(d, technology, delays, "clk").skew_ns, 2 * good.skew_ns);
}

TEST_F(Trees, LargeNetsAreSplitAndReachTheSamePins) {
  Design d = placed_design(500, 4);
  const int a = d.find_net("a");
  for (std::size_t c = 0; c < 120; ++c) {  // a net of many inputs
    for (Net& other : d.nets) {
      const auto moved = std::find_if(other.pins.begin(), other.pins.end(), [&](const PinRef& ref) {
        return ref.component == static_cast<int>(c) && &other != &d.nets[static_cast<std::size_t>(a)] &&
               other.name != "clk" && pin_direction(d, technology, ref) == PinDirection::input;
      });
      if (moved == other.pins.end()) continue;
      d.nets[static_cast<std::size_t>(a)].pins.push_back(*moved);
      other.pins.erase(moved);
      break;
    }
  }
  const auto before = reached(d, technology, a);
  ASSERT_GT(before.size(), 80u);
  // no more buffers, and no larger ones, than the edges need
  std::vector<Nm> width;
  for (const double most_slew_ns : {0.15, 0.3, 0.6}) {
    Design split = d;
    EXPECT_GT(buffer_nets(split, technology, delays, "clk", 40, most_slew_ns, options), 0);
    EXPECT_EQ(reached(split, technology, a), before);
    EXPECT_LE(split.nets[static_cast<std::size_t>(a)].pins.size(), 41u);
    width.push_back(0);
    for (const Net& net : split.nets) {
      for (const PinRef& ref : net.pins) {
        if (ref.component == kDiePin || pin_direction(split, technology, ref) != PinDirection::output)
          continue;
        const Component& c = split.components[static_cast<std::size_t>(ref.component)];
        if (!c.name.starts_with("fanout")) continue;
        const Macro& macro = technology.macros[static_cast<std::size_t>(c.macro)];
        width.back() += macro.width;
        EXPECT_LE(delays.at(macro.name)
                      .pins.at("Y")
                      .arcs.at(0)
                      .slew.at(0.08, expected_load_pf(split, technology, delays, net)),
                  1.1 * most_slew_ns)
            << net.name;
      }
    }
  }
  EXPECT_GT(width[0], width[1]);
  EXPECT_GT(width[1], width[2]);
}

TEST_F(Trees, WeakDriversBecomeStrongEnough) {
  constexpr double kLimit_ns = 0.15;
  Design d = placed_design(500, 4);
  const std::size_t nets = d.nets.size();
  const auto slow_nets = [&] {
    std::vector<std::string> slow;
    for (const Net& net : d.nets) {
      if (net.use != Use::signal || net.name == "clk") continue;
      for (const PinRef& ref : net.pins) {
        if (ref.component == kDiePin || pin_direction(d, technology, ref) != PinDirection::output) continue;
        const Macro& macro = technology.macros[static_cast<std::size_t>(
            d.components[static_cast<std::size_t>(ref.component)].macro)];
        for (const DelayArc& arc :
             delays.at(macro.name).pins.at(macro.pins[static_cast<std::size_t>(ref.pin)].name).arcs)
          if (arc.slew.at(0.1, expected_load_pf(d, technology, delays, net)) > kLimit_ns)
            slow.push_back(macro.name + " " + net.name);
      }
    }
    return slow;
  };
  std::vector<std::multiset<std::string>> before;
  for (std::size_t n = 0; n < nets; ++n) before.push_back(reached(d, technology, static_cast<int>(n)));
  ASSERT_GT(slow_nets().size(), 5u);
  const SizedDrivers sized = size_drivers(d, technology, delays, "clk", {.most_slew_ns = kLimit_ns}, options);
  EXPECT_GT(sized.resized, 0);
  EXPECT_GT(sized.buffered, 0);
  for (const Net& net : d.nets) {  // other sizes have their pins in another order
    const auto drivers = std::count_if(net.pins.begin(), net.pins.end(), [&](const PinRef& ref) {
      return pin_direction(d, technology, ref) ==
             (ref.component == kDiePin ? PinDirection::input : PinDirection::output);
    });
    EXPECT_EQ(drivers, net.use == Use::power || net.use == Use::ground ? 0 : 1) << net.name;
  }
  EXPECT_THAT(slow_nets(),
              ::testing::Each(HasSubstr("CLKBUF1 ")));  // the largest buffer: nothing is stronger
  for (std::size_t n = 2; n < nets; ++n)
    EXPECT_EQ(reached(d, technology, static_cast<int>(n)), before[n]) << d.nets[n].name;
  legalize(d, technology);
  EXPECT_THAT(placement_errors(d, technology), IsEmpty());
}

TEST_F(Trees, SpefHoldsTheWiresBetweenPins) {
  Design d = placed_design(20, 1);
  legalize(d, technology);
  const std::string text = spef_text(d, technology);
  EXPECT_THAT(text, HasSubstr("*D_NET clk "));
  EXPECT_THAT(text, HasSubstr("*P clk I"));
  const WireModel wire = wire_model(technology);
  EXPECT_NEAR(wire.ohm_per_um, 0.08 / 0.3, 1e-9);
  EXPECT_NEAR(wire.pf_per_um, ((1.9e-5 + 1.3e-5) * 0.3 + 2 * (6e-5 + 5.4e-5)) / 2, 1e-12);
}

TEST_F(Trees, TiedInputsGetACell) {
  Design d = placed_design(20, 1);
  const int b = d.find_net("b");
  Net& from = d.nets[static_cast<std::size_t>(b)];
  ASSERT_GT(from.pins.size(), 1u);
  d.nets[0].pins.push_back(from.pins.back());
  from.pins.pop_back();
  Technology with_tie = technology;
  with_tie.macros.push_back(technology.macros.front());
  with_tie.macros.back().name = "TIEHI";
  with_tie.macro_index["TIEHI"] = static_cast<int>(with_tie.macros.size()) - 1;
  with_tie.macros.back().pins.resize(1);
  with_tie.macros.back().pins.front().name = "Y";
  with_tie.macros.back().pins.front().direction = PinDirection::output;
  EXPECT_EQ(add_ties(d, with_tie, Use::power, "TIEHI", "Y"), 1);
  EXPECT_TRUE(d.nets[0].pins.empty());
  EXPECT_EQ(d.nets.back().pins.size(), 2u);
  EXPECT_THROW(add_ties(d, technology, Use::power, "NOSUCH", "Y"), UserError);
  for (const char* pin : {"A", "Y"})  // an input drives nothing, and a buffer's own is open
    EXPECT_THROW(add_ties(d, technology, Use::power, "BUFX2", pin), UserError) << pin;
}

TEST_F(Trees, OnlyBuffersMakeATree) {
  for (const char* cell : {"NAND2X1", "INVX1"}) {
    Design d = placed_design(20, 1);
    TreeOptions other = options;
    other.buffers = {cell};
    EXPECT_THROW(build_clock_tree(d, technology, delays, "clk", other), UserError) << cell;
  }
}

}  // namespace
}  // namespace meltstage::layout
