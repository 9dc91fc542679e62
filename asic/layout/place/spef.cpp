// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/place/spef.hpp"

#include <fmt/format.h>

#include <cctype>
#include <iterator>
#include <limits>

#include "asic/layout/db/model.hpp"
#include "asic/layout/place/buffers.hpp"

namespace meltstage::layout {

std::string spef_name(const std::string& name) {
  std::string text;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') text += '\\';
    text += c;
  }
  return text;
}

std::string spef_text(const Design& design, const Technology& technology) {
  const WireModel wire = wire_model(technology);
  std::string text;
  auto out = std::back_inserter(text);
  fmt::format_to(out,
                 "*SPEF \"IEEE 1481-1998\"\n*DESIGN \"{}\"\n*DATE \"\"\n*VENDOR \"\"\n*PROGRAM "
                 "\"meltstage_place\"\n*VERSION \"\"\n"
                 "*DESIGN_FLOW \"\"\n*DIVIDER /\n*DELIMITER :\n*BUS_DELIMITER [ ]\n*T_UNIT 1 NS\n*C_UNIT 1 "
                 "PF\n*R_UNIT 1 OHM\n"
                 "*L_UNIT 1 HENRY\n\n",
                 design.name);
  std::vector<Point> at;
  std::vector<std::string> names;
  for (const Net& net : design.nets) {
    if (is_supply(net.use) || net.pins.size() < 2) continue;
    at.clear();
    names.clear();
    std::string connections;
    for (const PinRef& ref : net.pins) {
      const bool drives =
          (pin_direction(design, technology, ref) == PinDirection::output) != (ref.component == kDiePin);
      if (ref.component == kDiePin) {
        const DiePin& pin = design.pins[static_cast<std::size_t>(ref.pin)];
        at.push_back(pin.shape.rect.middle());
        names.push_back(spef_name(pin.name));
        connections += fmt::format("*P {} {}\n", names.back(), drives ? "I" : "O");
      } else {
        const Component& c = design.components[static_cast<std::size_t>(ref.component)];
        const Macro& macro = technology.macros[static_cast<std::size_t>(c.macro)];
        const MacroPin& pin = macro.pins[static_cast<std::size_t>(ref.pin)];
        const Point middle = middle_of(pin);
        at.push_back(placed({middle.x, middle.y, middle.x, middle.y}, macro, c).middle());
        names.push_back(spef_name(c.name) + ":" + pin.name);
        connections += fmt::format("*I {} {}\n", names.back(), drives ? "O" : "I");
      }
    }
    // shortest spanning tree (Prim)
    std::vector<double> cap(at.size(), 0.0);
    std::vector<Nm> away(at.size(), std::numeric_limits<Nm>::max());
    std::vector<std::size_t> from(at.size(), 0);
    std::vector<bool> in_tree(at.size(), false);
    std::string resistances;
    double total = 0.0;
    std::size_t newest = 0;
    in_tree[0] = true;
    for (std::size_t k = 1; k < at.size(); ++k) {
      std::size_t next = 0;
      for (std::size_t p = 0; p < at.size(); ++p) {
        if (in_tree[p]) continue;
        const Nm d = std::abs(at[p].x - at[newest].x) + std::abs(at[p].y - at[newest].y);
        if (d < away[p]) away[p] = d, from[p] = newest;
        if (next == 0 || away[p] < away[next]) next = p;
      }
      in_tree[next] = true;
      newest = next;
      const double length_um = static_cast<double>(away[next]) / 1000.0;
      const double half = wire.pf_per_um * length_um / 2;
      cap[next] += half;
      cap[from[next]] += half;
      total += 2 * half;
      resistances += fmt::format("{} {} {} {:.4g}\n", k, names[from[next]], names[next],
                                 std::max(1e-3, wire.ohm_per_um * length_um));
    }
    fmt::format_to(out, "*D_NET {} {:.5g}\n*CONN\n{}*CAP\n", spef_name(net.name), total, connections);
    for (std::size_t p = 0; p < at.size(); ++p)
      fmt::format_to(out, "{} {} {:.5g}\n", p + 1, names[p], cap[p]);
    fmt::format_to(out, "*RES\n{}*END\n\n", resistances);
  }
  return text;
}

}  // namespace meltstage::layout
