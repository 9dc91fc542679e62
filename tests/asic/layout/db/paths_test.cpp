// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/paths.hpp"

#include <gtest/gtest.h>

#include "asic/layout/place/drivers.hpp"
#include "asic/layout/place/place.hpp"
#include "tests/asic/layout/random_netlist.hpp"

namespace meltstage::layout {
namespace {

/// A cell whose output rises after `rise_ns` and falls after `fall_ns`, whatever slew and load.
std::string cell(const std::string& name, const std::string& inner, const std::vector<std::string>& inputs,
                 const std::string& out, const std::string& sense, double rise_ns, double fall_ns) {
  const auto table = [](const std::string& kind, double ns) {
    return fmt::format("{}(t) {{ values(\"{}, {}\", \"{}, {}\"); }}\n", kind, ns, ns, ns, ns);
  };
  std::string text = fmt::format("cell({}) {{ {}\n", name, inner);
  for (const std::string& in : inputs)
    text += fmt::format("pin({}) {{ direction : input; capacitance : 0.01;{} }}\n", in,
                        in == "CLK" ? " clock : true;" : "");
  text += fmt::format("pin({}) {{ direction : output;\n", out);
  for (const std::string& in : inputs)
    if (in != "D")
      text += fmt::format("timing() {{ related_pin : \"{}\"; timing_sense : {};\n{}{}{}{} }}\n", in, sense,
                          table("cell_rise", rise_ns), table("cell_fall", fall_ns),
                          table("rise_transition", 0.1), table("fall_transition", 0.1));
  return text + "} }\n";
}

class Paths : public ::testing::Test {
 protected:
  int new_net(const std::string& name) {
    design.nets.emplace_back();
    design.nets.back().name = name;
    return static_cast<int>(design.nets.size()) - 1;
  }
  void add(const std::string& kind, const std::map<std::string, int>& pins) {
    const int macro = technology.find_macro(kind);
    const auto component = static_cast<int>(design.components.size());
    design.components.push_back({fmt::format("u{}", component), macro, {}, Orientation::N, true, false});
    for (const auto& [pin, net] : pins)
      design.nets[static_cast<std::size_t>(net)].pins.push_back(
          {component, technology.macros[static_cast<std::size_t>(macro)].find_pin(pin)});
  }
  double through(int net) const {
    return longest_paths_ns(design, technology, delays,
                            std::vector<double>(design.nets.size()))[static_cast<std::size_t>(net)];
  }

  const Technology technology = read_lef({OSU018_LEF});
  const Delays delays = parse_delays(
      "library(l) { lu_table_template(t) { variable_1 : input_net_transition; variable_2 : "
      "total_output_net_capacitance; index_1(\"0, 1\"); index_2(\"0, 1\"); }\n" +
          cell("INVX1", "", {"A"}, "Y", "negative_unate", 1, 3) +
          cell("XOR2X1", "", {"A", "B"}, "Y", "non_unate", 5, 7) +
          cell("DFFPOSX1", "ff(IQ, IQN) { }", {"D", "CLK"}, "Q", "non_unate", 10, 20) + "}",
      "by hand");
  Design design;
};

TEST_F(Paths, EdgesKeepTheirDirectionThroughInverters) {
  const int clk = new_net("clk"), q = new_net("q"), n1 = new_net("n1"), n2 = new_net("n2");
  add("DFFPOSX1", {{"CLK", clk}, {"Q", q}});
  add("INVX1", {{"A", q}, {"Y", n1}});
  add("INVX1", {{"A", n1}, {"Y", n2}});
  add("DFFPOSX1", {{"CLK", clk}, {"D", n2}});
  // falls after 20, then rises after 1, then falls after 3; not 20 + 3 + 3
  for (const int net : {q, n1, n2}) EXPECT_DOUBLE_EQ(through(net), 24) << net;
  EXPECT_DOUBLE_EQ(through(clk), 0);
}

TEST_F(Paths, EitherEdgeGoesThroughAnExclusiveOr) {
  const int clk = new_net("clk"), q = new_net("q"), n1 = new_net("n1"), short_way = new_net("short"),
            y = new_net("y");
  add("DFFPOSX1", {{"CLK", clk}, {"Q", q}});
  add("INVX1", {{"A", q}, {"Y", n1}});
  add("DFFPOSX1", {{"CLK", clk}, {"Q", short_way}});
  add("XOR2X1", {{"A", n1}, {"B", short_way}, {"Y", y}});
  add("DFFPOSX1", {{"CLK", clk}, {"D", y}});
  EXPECT_DOUBLE_EQ(through(y), 20 + 1 + 7);
  EXPECT_DOUBLE_EQ(through(n1), 20 + 1 + 7);
  EXPECT_DOUBLE_EQ(through(short_way), 20 + 7);
}

TEST_F(Paths, ALoopOrAnEndMissingIsNoPath) {
  const int a = new_net("a"), b = new_net("b"), open = new_net("open"), q = new_net("q"),
            clk = new_net("clk");
  add("INVX1", {{"A", a}, {"Y", b}});
  add("INVX1", {{"A", b}, {"Y", a}});
  add("DFFPOSX1", {{"CLK", clk}, {"Q", q}});
  add("INVX1", {{"A", q}, {"Y", open}});
  for (const int net : {a, b, q, open}) EXPECT_DOUBLE_EQ(through(net), 0) << net;
}

TEST_F(Paths, StrongerDriversMakeLongPathsShorter) {
  const Delays osu = read_delays(OSU018_LIBERTY);
  const TreeOptions trees{{"BUFX2", "BUFX4", "CLKBUF1"}, 0.25, 20};
  Design placed = random_netlist(technology, 500, 4);
  make_floorplan(placed, technology, {0.6, 5000});
  place_globally(placed, technology, {});
  const auto longest = [&](const Design& d) {
    std::vector<double> loads;
    for (const Net& net : d.nets)
      loads.push_back(net.use == Use::signal ? expected_load_pf(d, technology, osu, net) : 0.0);
    const std::vector<double> paths = longest_paths_ns(d, technology, osu, loads);
    return *std::max_element(paths.begin(), paths.end());
  };
  Design by_slew = placed;
  Design by_path = placed;
  const SizedDrivers few = size_drivers(by_slew, technology, osu, "clk", {.most_slew_ns = 0.5}, trees);
  const SizedDrivers more = size_drivers(
      by_path, technology, osu, "clk", {.most_slew_ns = 0.5, .most_path_ns = 0.8 * longest(by_slew)}, trees);
  EXPECT_LT(longest(by_path), 0.98 * longest(by_slew));
  EXPECT_GT(more.resized + more.buffered, few.resized + few.buffered);
}

}  // namespace
}  // namespace meltstage::layout
