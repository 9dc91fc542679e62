// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numeric>

#include "asic/layout/place/spef.hpp"
#include "asic/layout/route/route.hpp"

namespace meltstage::layout {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// Nodes in the middle of a wire fall away: their resistances add up, their capacitance goes to both sides by
// half.
NetParasitics without_middles(NetParasitics net) {
  std::vector<std::vector<int>> touching(net.node_pf.size());
  for (std::size_t i = 0; i < net.resistors.size(); ++i) {
    touching[at(net.resistors[i].a)].push_back(static_cast<int>(i));
    touching[at(net.resistors[i].b)].push_back(static_cast<int>(i));
  }
  std::vector<bool> is_pin(net.node_pf.size(), false);
  for (const int node : net.node_of_pin)
    if (node >= 0) is_pin[at(node)] = true;
  std::vector<bool> gone(net.resistors.size(), false);
  for (std::size_t node = 0; node < net.node_pf.size(); ++node) {
    if (is_pin[node] || touching[node].size() != 2) continue;
    const int kept = touching[node][0], merged = touching[node][1];
    const auto other = [&](int r) {
      return net.resistors[at(r)].a == static_cast<int>(node) ? net.resistors[at(r)].b
                                                              : net.resistors[at(r)].a;
    };
    const int left = other(kept), right = other(merged);
    if (left == right) continue;
    net.resistors[at(kept)] = {left, right, net.resistors[at(kept)].ohm + net.resistors[at(merged)].ohm};
    gone[at(merged)] = true;
    std::replace(touching[at(right)].begin(), touching[at(right)].end(), merged, kept);
    net.node_pf[at(left)] += net.node_pf[node] / 2;
    net.node_pf[at(right)] += net.node_pf[node] / 2;
    net.node_pf[node] = 0.0;
  }
  std::vector<NetParasitics::Resistor> left;
  for (std::size_t i = 0; i < net.resistors.size(); ++i)
    if (!gone[i]) left.push_back(net.resistors[i]);
  net.resistors = std::move(left);
  return net;
}

}  // namespace

std::string routed_spef_text(const Design& design, const Technology& technology, const RouteReport& report) {
  std::string text;
  auto out = std::back_inserter(text);
  fmt::format_to(out,
                 "*SPEF \"IEEE 1481-1998\"\n*DESIGN \"{}\"\n*DATE \"\"\n*VENDOR \"\"\n*PROGRAM "
                 "\"\"\n*VERSION \"\"\n*DESIGN_FLOW \"\"\n*DIVIDER /\n*DELIMITER :\n"
                 "*BUS_DELIMITER [ ]\n*T_UNIT 1 NS\n*C_UNIT 1 PF\n*R_UNIT 1 OHM\n*L_UNIT 1 HENRY\n\n",
                 design.name);
  for (std::size_t n = 0; n < design.nets.size(); ++n) {
    const Net& net = design.nets[n];
    if (report.parasitics[n].resistors.empty()) continue;
    const NetParasitics parasitics = without_middles(report.parasitics[n]);
    fmt::format_to(out, "*D_NET {} {:.6g}\n*CONN\n", spef_name(net.name),
                   std::accumulate(parasitics.node_pf.begin(), parasitics.node_pf.end(), 0.0));
    std::vector<std::string> name(parasitics.node_pf.size());
    std::string joined;  // pins that share a node with another
    for (std::size_t p = 0; p < net.pins.size(); ++p) {
      const PinRef& ref = net.pins[p];
      const bool is_port = ref.component == kDiePin;
      const std::string pin =
          is_port
              ? spef_name(design.pins[at(ref.pin)].name)
              : fmt::format(
                    "{}:{}", spef_name(design.components[at(ref.component)].name),
                    technology.macros[at(design.components[at(ref.component)].macro)].pins[at(ref.pin)].name);
      const PinDirection direction = pin_direction(design, technology, ref);
      fmt::format_to(out, "*{} {} {}\n", is_port ? 'P' : 'I', pin,
                     direction == PinDirection::input    ? 'I'
                     : direction == PinDirection::output ? 'O'
                                                         : 'B');
      const int node = parasitics.node_of_pin[p];
      if (node < 0) continue;
      if (name[at(node)].empty())
        name[at(node)] = pin;
      else
        joined += fmt::format("{} {} {}\n", name[at(node)], pin, 0.01);
    }
    for (std::size_t node = 0; node < name.size(); ++node)
      if (name[node].empty()) name[node] = fmt::format("{}:{}", spef_name(net.name), node + 1);
    fmt::format_to(out, "*CAP\n");
    int number = 0;
    for (std::size_t node = 0; node < name.size(); ++node)
      if (parasitics.node_pf[node] > 0)
        fmt::format_to(out, "{} {} {:.4g}\n", ++number, name[node], parasitics.node_pf[node]);
    fmt::format_to(out, "*RES\n");
    number = 0;
    for (const auto& r : parasitics.resistors)
      fmt::format_to(out, "{} {} {} {:.4g}\n", ++number, name[at(r.a)], name[at(r.b)],
                     std::max(r.ohm, 0.001));
    for (std::size_t start = 0; start < joined.size();) {
      const std::size_t end = joined.find('\n', start);
      fmt::format_to(out, "{} {}\n", ++number, joined.substr(start, end - start));
      start = end + 1;
    }
    fmt::format_to(out, "*END\n\n");
  }
  return text;
}

}  // namespace meltstage::layout
