// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <random>

#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

/// Gates and flops of OSU 0.18 um whose inputs come mostly from gates made shortly before, as logic has it;
/// the last outputs are ports.
inline Design random_netlist(const Technology& technology, int cells, unsigned seed) {
  std::mt19937 random(seed);
  Design d;
  d.name = "random";
  d.nets.resize(2);
  d.nets[0].name = "vdd";
  d.nets[0].use = Use::power;
  d.nets[1].name = "gnd";
  d.nets[1].use = Use::ground;
  const auto port = [&](const std::string& name, PinDirection direction, int net) {
    d.nets[static_cast<std::size_t>(net)].pins.push_back({kDiePin, static_cast<int>(d.pins.size())});
    d.pins.push_back({name, net, direction, Use::signal, false, {}});
  };
  const auto new_net = [&](const std::string& name) {
    d.nets.emplace_back();
    d.nets.back().name = name;
    return static_cast<int>(d.nets.size()) - 1;
  };
  for (const char* name : {"clk", "a", "b", "c"}) port(name, PinDirection::input, new_net(name));
  const std::vector<std::string> kinds{"NAND2X1", "AND2X2", "INVX1", "XOR2X1", "DFFPOSX1"};
  for (int i = 0; i < cells; ++i) {
    const std::string& kind = kinds[random() % kinds.size()];
    const int macro = technology.find_macro(kind);
    const auto newest = static_cast<int>(d.nets.size());
    const int component = static_cast<int>(d.components.size());
    d.components.push_back({fmt::format("u{}", i), macro, {}, Orientation::N, false, false});
    const auto& pins = technology.macros[static_cast<std::size_t>(macro)].pins;
    for (std::size_t p = 0; p < pins.size(); ++p) {
      if (pins[p].use == Use::power || pins[p].use == Use::ground) continue;
      int net = 2;
      if (pins[p].direction == PinDirection::output)
        net = new_net(fmt::format("n{}", i));
      else if (pins[p].name != "CLK")
        net = 3 + static_cast<int>(random() % 30 == 0
                                       ? random() % static_cast<unsigned>(newest - 3)
                                       : static_cast<unsigned>(newest - 4) -
                                             random() %
                                                 std::min<unsigned>(20, static_cast<unsigned>(newest - 3)));
      d.nets[static_cast<std::size_t>(net)].pins.push_back({component, static_cast<int>(p)});
    }
  }
  const int last = static_cast<int>(d.nets.size()) - 1;
  for (int i = 0; i < 4; ++i) port(fmt::format("y{}", i), PinDirection::output, last - i);
  return d;
}

}  // namespace meltstage::layout
