// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/route/antenna.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <set>
#include <string_view>

namespace meltstage::layout {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }
double um2(const Rect& r) { return static_cast<double>(r.width()) * static_cast<double>(r.height()) * 1e-6; }
bool touches(const Rect& a, const Rect& b) {
  return a.x0 <= b.x1 && b.x0 <= a.x1 && a.y0 <= b.y1 && b.y0 <= a.y1;
}

struct Piece {
  Rect rect;
  int pin = -1;  // of the net, whose metal it is
};

struct Cut {
  double area_um2;
  int below, above;  // pieces
};

// A net's metal and cuts, a layer of the technology each.
struct Metal {
  std::vector<Piece> pieces;
  std::vector<std::vector<int>> of_layer;
  std::vector<std::vector<Cut>> cuts_of_layer;

  int add(const Shape& shape, int pin) {
    of_layer[at(shape.layer)].push_back(static_cast<int>(pieces.size()));
    pieces.push_back({shape.rect, pin});
    return static_cast<int>(pieces.size()) - 1;
  }
};

Metal metal_of(const Net& net, const Design& design, const Technology& technology) {
  Metal metal;
  metal.of_layer.resize(technology.layers.size());
  metal.cuts_of_layer.resize(technology.layers.size());
  for (std::size_t p = 0; p < net.pins.size(); ++p)
    for (const Shape& s : pin_shapes(design, technology, net.pins[p])) metal.add(s, static_cast<int>(p));
  for (const Wire& wire : net.wires) metal.add({wire.layer, wire.metal()}, -1);
  for (const Shape& patch : net.patches) metal.add(patch, -1);
  for (const PlacedVia& placed_via : net.vias) {
    const Via& via = design.via(technology, placed_via.via);
    if (via.shapes.size() < 3) continue;
    const int below = metal.add({via.shapes.front().layer, via.shapes.front().rect.moved(placed_via.at)}, -1);
    const int above = metal.add({via.shapes.back().layer, via.shapes.back().rect.moved(placed_via.at)}, -1);
    for (std::size_t i = 1; i + 1 < via.shapes.size(); ++i)
      metal.cuts_of_layer[at(via.shapes[i].layer)].push_back({um2(via.shapes[i].rect), below, above});
  }
  return metal;
}

class Groups {
 public:
  explicit Groups(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  int of(int i) {
    while (parent_[at(i)] != i) i = parent_[at(i)] = parent_[at(parent_[at(i)])];
    return i;
  }
  void join(int a, int b) { parent_[at(of(a))] = of(b); }

 private:
  std::vector<int> parent_;
};

void join_touching(const Metal& metal, std::vector<int> pieces, Groups& groups) {
  const auto rect = [&](int piece) -> const Rect& { return metal.pieces[at(piece)].rect; };
  std::sort(pieces.begin(), pieces.end(), [&](int a, int b) { return rect(a).x0 < rect(b).x0; });
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (std::size_t k = i + 1; k < pieces.size() && rect(pieces[k]).x0 <= rect(pieces[i]).x1; ++k)
      if (touches(rect(pieces[i]), rect(pieces[k]))) groups.join(pieces[i], pieces[k]);
}

// What is connected by now.
struct Group {
  double gate_um2 = 0.0;
  double diffusion_um2 = 0.0;
  double fresh_um2 = 0.0;  // on the layer in the making
  std::vector<int> gates;  // pins of the net
};

class NetCheck {
 public:
  NetCheck(int net, const Design& design, const Technology& technology)
      : net_(net),
        pins_(design.nets[at(net)].pins),
        design_(design),
        technology_(technology),
        metal_(metal_of(design.nets[at(net)], design, technology)),
        groups_(metal_.pieces.size()),
        metal_ratio_(pins_.size(), 0.0),
        is_told_(pins_.size(), false) {
    std::vector<int> first(pins_.size(), -1);
    for (std::size_t i = 0; i < metal_.pieces.size(); ++i) {
      const int pin = metal_.pieces[i].pin;
      if (pin < 0) continue;
      if (first[at(pin)] < 0) first[at(pin)] = static_cast<int>(i);
      groups_.join(first[at(pin)], static_cast<int>(i));
    }
    place_of_pin_ = std::move(first);
  }

  void run(std::vector<AntennaFault>& faults) {
    for (std::size_t layer = 0; layer < technology_.layers.size(); ++layer) {
      const LayerKind kind = technology_.layers[layer].kind;
      if (kind == LayerKind::cut)
        cuts(static_cast<int>(layer), faults);
      else if (kind == LayerKind::routing)
        metal(static_cast<int>(layer), faults);
    }
  }

 private:
  const MacroPin* macro_pin(std::size_t pin) const {
    const PinRef& ref = pins_[pin];
    if (ref.component == kDiePin) return nullptr;
    return &technology_.macros[at(design_.components[at(ref.component)].macro)].pins[at(ref.pin)];
  }

  std::vector<Group> connected() {
    std::vector<Group> found(metal_.pieces.size());
    for (std::size_t p = 0; p < pins_.size(); ++p) {
      const MacroPin* pin = macro_pin(p);
      if (pin == nullptr || place_of_pin_[p] < 0) continue;
      Group& group = found[at(groups_.of(place_of_pin_[p]))];
      group.gate_um2 += pin->gate_area_um2;
      group.diffusion_um2 += pin->diffusion_area_um2;
      if (pin->gate_area_um2 > 0.0) group.gates.push_back(static_cast<int>(p));
    }
    return found;
  }

  // Before the metal above joins them.
  void cuts(int layer, std::vector<AntennaFault>& faults) {
    std::vector<Group> found = connected();
    for (const Cut& cut : metal_.cuts_of_layer[at(layer)])
      found[at(groups_.of(cut.below))].fresh_um2 += cut.area_um2;
    for (const Group& group : found)
      if (!group.gates.empty()) judge(layer, group, group.fresh_um2 / group.gate_um2, faults);
    for (const Cut& cut : metal_.cuts_of_layer[at(layer)]) groups_.join(cut.below, cut.above);
  }

  void metal(int layer, std::vector<AntennaFault>& faults) {
    join_touching(metal_, metal_.of_layer[at(layer)], groups_);
    std::vector<Group> found = connected();
    for (const int piece : metal_.of_layer[at(layer)])
      found[at(groups_.of(piece))].fresh_um2 += um2(metal_.pieces[at(piece)].rect);
    for (const Group& group : found) {
      if (group.gates.empty()) continue;
      const double ratio = group.fresh_um2 / group.gate_um2;
      double most = 0.0;
      for (const int gate : group.gates) {
        metal_ratio_[at(gate)] += ratio;
        most = std::max(most, metal_ratio_[at(gate)]);
      }
      judge(layer, group, technology_.layers[at(layer)].antenna.is_cumulative ? most : ratio, faults);
    }
  }

  void judge(int layer, const Group& group, double ratio, std::vector<AntennaFault>& faults) {
    const AntennaRule& rule = technology_.layers[at(layer)].antenna;
    const double limit = rule.limit(group.diffusion_um2);
    if (rule.ratio <= 0.0 || ratio <= limit) return;
    if (std::all_of(group.gates.begin(), group.gates.end(), [&](int gate) { return is_told_[at(gate)]; }))
      return;
    for (const int gate : group.gates) is_told_[at(gate)] = true;
    AntennaFault fault{net_, group.gates, layer, ratio, limit, {}};
    const int connected = groups_.of(place_of_pin_[at(group.gates.front())]);
    for (std::size_t i = 0; i < metal_.pieces.size(); ++i)
      if (groups_.of(static_cast<int>(i)) == connected) fault.metal.push_back(metal_.pieces[i].rect);
    std::stable_sort(fault.pins.begin(), fault.pins.end(),
                     [&](int a, int b) { return metal_ratio_[at(a)] > metal_ratio_[at(b)]; });
    faults.push_back(std::move(fault));
  }

  int net_;
  const std::vector<PinRef>& pins_;
  const Design& design_;
  const Technology& technology_;
  Metal metal_;
  Groups groups_;
  std::vector<int> place_of_pin_;    // a piece
  std::vector<double> metal_ratio_;  // of a pin, summed up from below
  std::vector<bool> is_told_;
};

bool is_spacer(const Macro& macro) { return macro.macro_class.ends_with("SPACER"); }

struct Diode {
  int macro = -1;
  int pin = -1;
};

Diode find_diode(const Technology& technology) {
  for (std::size_t m = 0; m < technology.macros.size(); ++m) {
    if (!technology.macros[m].macro_class.ends_with("ANTENNACELL")) continue;
    const auto& pins = technology.macros[m].pins;
    for (std::size_t p = 0; p < pins.size(); ++p)
      if (pins[p].diffusion_area_um2 > 0.0 && pins[p].use == Use::signal)
        return {static_cast<int>(m), static_cast<int>(p)};
  }
  return {};
}

// Macros of fillers that stand in the design, widest first.
std::vector<int> fillers_in_use(const Design& design, const Technology& technology) {
  std::set<int> macros;
  for (const Component& c : design.components)
    if (is_spacer(technology.macros[at(c.macro)])) macros.insert(c.macro);
  std::vector<int> sorted(macros.begin(), macros.end());
  std::stable_sort(sorted.begin(), sorted.end(), [&](int a, int b) {
    return technology.macros[at(a)].width > technology.macros[at(b)].width;
  });
  return sorted;
}

// Fillers that add up to the width; empty when none do.
std::vector<int> fill(Nm width, const std::vector<int>& fillers, const Technology& technology) {
  std::vector<int> chosen;
  for (const int macro : fillers)
    for (; technology.macros[at(macro)].width <= width; width -= technology.macros[at(macro)].width)
      chosen.push_back(macro);
  if (width != 0) chosen.clear();
  return chosen;
}

Nm distance(Point a, const Rect& b) {
  return std::max({Nm{0}, b.x0 - a.x, a.x - b.x1}) + std::max({Nm{0}, b.y0 - a.y, a.y - b.y1});
}
Nm distance(Point a, const std::vector<Rect>& metal) {
  Nm least = std::numeric_limits<Nm>::max();
  for (const Rect& rect : metal) least = std::min(least, distance(a, rect));
  return least;
}

}  // namespace

std::vector<AntennaFault> antenna_faults(const Design& design, const Technology& technology) {
  std::vector<AntennaFault> faults;
  for (std::size_t n = 0; n < design.nets.size(); ++n)
    if (design.nets[n].use != Use::power && design.nets[n].use != Use::ground)
      NetCheck(static_cast<int>(n), design, technology).run(faults);
  return faults;
}

std::string antenna_text(const AntennaFault& fault, const Design& design, const Technology& technology) {
  const Net& net = design.nets[at(fault.net)];
  const PinRef& ref = net.pins[at(fault.pins.front())];
  const Component& component = design.components[at(ref.component)];
  return fmt::format("net {}: {} area over gate area {:.0f}, most {:.0f}, at {} {}", net.name,
                     technology.layers[at(fault.layer)].name, fault.ratio, fault.limit, component.name,
                     technology.macros[at(component.macro)].pins[at(ref.pin)].name);
}

int insert_diodes(Design& design, const Technology& technology, const std::vector<AntennaFault>& faults) {
  const Diode diode = find_diode(technology);
  if (diode.macro < 0) return 0;
  const std::vector<int> fillers = fillers_in_use(design, technology);
  const Nm width = technology.macros[at(diode.macro)].width;
  int inserted = 0;
  for (const AntennaFault& fault : faults) {
    int best = -1;
    Nm nearest = std::numeric_limits<Nm>::max();
    for (std::size_t c = 0; c < design.components.size(); ++c) {
      const Component& filler = design.components[c];
      const Macro& macro = technology.macros[at(filler.macro)];
      if (!is_spacer(macro) || macro.width < width) continue;
      const Nm far = distance(outline(filler, technology).middle(), fault.metal);
      if (far >= nearest || (macro.width > width && fill(macro.width - width, fillers, technology).empty()))
        continue;
      nearest = far;
      best = static_cast<int>(c);
    }
    if (best < 0) break;
    const Component filler = design.components[at(best)];
    design.components[at(best)].macro = diode.macro;
    design.components[at(best)].name = filler.name + "_antenna";
    Nm x = filler.at.x + width;
    int number = 0;
    for (const int macro : fill(technology.macros[at(filler.macro)].width - width, fillers, technology)) {
      Component rest = filler;
      rest.name = fmt::format("{}_{}", filler.name, ++number);
      rest.macro = macro;
      rest.at.x = x;
      x += technology.macros[at(macro)].width;
      design.components.push_back(std::move(rest));
    }
    design.nets[at(fault.net)].pins.push_back({best, diode.pin});
    ++inserted;
  }
  return inserted;
}

}  // namespace meltstage::layout
