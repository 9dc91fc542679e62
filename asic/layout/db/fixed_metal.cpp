// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/fixed_metal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "asic/layout/db/shape_index.hpp"
#include "base/place.hpp"

namespace meltstage::layout {
namespace {

constexpr std::size_t kMostFaults = 20;

std::string corner(const Rect& r) { return fmt::format("({}, {})", r.x0, r.y0); }

class SupplyCheck {
 public:
  SupplyCheck(const Design& design, const Technology& technology)
      : design_(design), technology_(technology) {}

  std::vector<std::string> faults() && {
    for (const Net& net : design_.nets) {
      for (const Shape& strap : net.straps) {
        check_alone(net, strap);
        check_others(net, strap);
      }
      for (const PlacedVia& via : net.strap_vias)
        for (const Shape& s : design_.via(technology_, via.via).shapes)
          check_others(net, {s.layer, s.rect.moved(via.at)});
    }
    for (const Component& component : design_.components) check_cell(component);
    return std::move(faults_);
  }

 private:
  const Layer& layer(int index) const { return technology_.layers[static_cast<std::size_t>(index)]; }
  void tell(std::string fault) {
    if (faults_.size() < kMostFaults) faults_.push_back(std::move(fault));
  }

  static Nm narrow(const Rect& r) { return std::min(r.width(), r.height()); }
  static Nm wide(const Rect& r) { return std::max(r.width(), r.height()); }
  Nm spacing(int index, const Rect& a, const Rect& b) const {
    return layer(index).spacing_for(std::max(narrow(a), narrow(b)), std::min(wide(a), wide(b)));
  }
  void check_alone(const Net& net, const Shape& strap) {
    const std::string what = fmt::format("{}: a strap on {} at {} nm", shown(net.name),
                                         layer(strap.layer).name, corner(strap.rect));
    if (!design_.die.contains(strap.rect)) tell(what + " reaches out of the die");
    if (narrow(strap.rect) < layer(strap.layer).width)
      tell(fmt::format("{} is {} nm wide, less than the layer's WIDTH of {} nm", what, narrow(strap.rect),
                       layer(strap.layer).width));
    const Nm grid = technology_.grid;
    if (grid > 1 && (strap.rect.x0 % grid != 0 || strap.rect.x1 % grid != 0 || strap.rect.y0 % grid != 0 ||
                     strap.rect.y1 % grid != 0))
      tell(fmt::format("{} is off the manufacturing grid of {} nm", what, grid));
  }

  /// Against the metal of all supplies before it.
  void check_others(const Net& net, const Shape& shape) {
    if (layer(shape.layer).kind != LayerKind::routing) return;
    const Nm reach = spacing(shape.layer, shape.rect, shape.rect);
    index_.for_each_in({shape.layer, shape.rect.grown(std::max(reach, widest_spacing_))}, [&](std::size_t i) {
      if (owners_[i] != &net &&
          nearer_than(index_[i].rect, shape.rect, spacing(shape.layer, index_[i].rect, shape.rect)))
        tell(fmt::format("{} and {} are nearer than the spacing of {} at {} nm", shown(owners_[i]->name),
                         shown(net.name), layer(shape.layer).name, corner(shape.rect)));
    });
    widest_spacing_ = std::max(widest_spacing_, reach);
    index_.add(shape);
    owners_.push_back(&net);
  }

  /// Cells' own metal may be as near to a rail as the library drew it; above it, straps keep their spacing.
  void check_cell(const Component& component) {
    const Macro& macro = technology_.macros[static_cast<std::size_t>(component.macro)];
    const int pins_layer = technology_.routing_layers().front();
    const auto check = [&](const Shape& drawn, Use use, const std::string& name, bool overlap_alone) {
      if (layer(drawn.layer).kind != LayerKind::routing) return;
      const Shape shape{drawn.layer, placed(drawn.rect, macro, component)};
      index_.for_each_in(
          {shape.layer, shape.rect.grown(std::max<Nm>(widest_spacing_, 1))}, [&](std::size_t i) {
            if (is_supply(use) && owners_[i]->use == use) return;
            const Rect& strap = index_[i].rect;
            const bool wrong = overlap_alone
                                   ? strap.overlaps(shape.rect)
                                   : nearer_than(strap, shape.rect, spacing(shape.layer, strap, shape.rect));
            if (wrong)
              tell(fmt::format("{} is at {} of {} on {} at {} nm", shown(owners_[i]->name), name,
                               shown(component.name), layer(shape.layer).name, corner(shape.rect)));
          });
    };
    for (const MacroPin& pin : macro.pins)
      for (const Shape& s : pin.shapes)
        check(s, pin.use, "pin " + shown(pin.name), s.layer == pins_layer || is_supply(pin.use));
    for (const Shape& s : macro.obstructions) check(s, Use::signal, "an obstruction", true);
  }

  const Design& design_;
  const Technology& technology_;
  ShapeIndex index_;
  std::vector<const Net*> owners_;
  Nm widest_spacing_ = 0;
  std::vector<std::string> faults_;
};

}  // namespace

std::vector<Shape> fixed_shapes(const Design& design, const Technology& technology) {
  std::vector<Shape> shapes;
  for (const Net& net : design.nets) {
    shapes.insert(shapes.end(), net.straps.begin(), net.straps.end());
    for (const PlacedVia& placed_via : net.strap_vias)
      for (const Shape& s : design.via(technology, placed_via.via).shapes)
        shapes.push_back({s.layer, s.rect.moved(placed_via.at)});
  }
  for (const DiePin& pin : design.pins)
    if (pin.is_placed && is_supply(pin.use)) shapes.push_back(pin.shape);
  for (const Component& c : design.components) {
    const Macro& macro = technology.macros[static_cast<std::size_t>(c.macro)];
    const auto add = [&](const Shape& s) { shapes.push_back({s.layer, placed(s.rect, macro, c)}); };
    for (const Shape& s : macro.obstructions) {
      // where no cut may be, no metal above it is needed
      const LayerKind kind = technology.layers[static_cast<std::size_t>(s.layer)].kind;
      add({kind == LayerKind::cut ? s.layer + 1 : s.layer, s.rect});
    }
    for (const MacroPin& pin : macro.pins) std::for_each(pin.shapes.begin(), pin.shapes.end(), add);
  }
  return shapes;
}

ShapeIndex fixed_metal_on(int layer, const Design& design, const Technology& technology) {
  const Layer& metal = technology.layers[static_cast<std::size_t>(layer)];
  ShapeIndex index;
  for (const Shape& shape : fixed_shapes(design, technology)) {
    if (shape.layer != layer) continue;
    const Nm wide = std::min(shape.rect.width(), shape.rect.height()),
             run = std::max(shape.rect.width(), shape.rect.height());
    index.add({layer, shape.rect.grown(metal.spacing_for(wide, run) - metal.spacing)});
  }
  return index;
}

std::vector<std::string> supply_faults(const Design& design, const Technology& technology) {
  return SupplyCheck(design, technology).faults();
}

std::vector<std::string> die_pin_faults(const Design& design, const Technology& technology) {
  struct Owned {
    int net;  // -1: none
    Use use;  // of a cell's pin without a net
    std::string what;
  };
  ShapeIndex index;
  std::vector<Owned> owners;
  const auto add = [&](const Shape& shape, int net, Use use, std::string what) {
    if (technology.layers[static_cast<std::size_t>(shape.layer)].kind != LayerKind::routing) return;
    index.add(shape);
    owners.push_back({net, use, std::move(what)});
  };
  std::map<std::pair<int, int>, int> net_of;
  for (std::size_t n = 0; n < design.nets.size(); ++n) {
    const Net& net = design.nets[n];
    for (const PinRef& ref : net.pins) net_of[{ref.component, ref.pin}] = static_cast<int>(n);
    for (const Shape& strap : net.straps)
      add(strap, static_cast<int>(n), net.use, "a strap of " + shown(net.name));
  }
  for (std::size_t c = 0; c < design.components.size(); ++c) {
    const Component& component = design.components[c];
    const Macro& macro = technology.macros[static_cast<std::size_t>(component.macro)];
    for (std::size_t p = 0; p < macro.pins.size(); ++p) {
      const auto net = net_of.find({static_cast<int>(c), static_cast<int>(p)});
      for (const Shape& s : macro.pins[p].shapes)
        add({s.layer, placed(s.rect, macro, component)}, net == net_of.end() ? -1 : net->second,
            macro.pins[p].use, fmt::format("pin {} of {}", shown(macro.pins[p].name), shown(component.name)));
    }
    for (const Shape& s : macro.obstructions)
      add({s.layer, placed(s.rect, macro, component)}, -1, Use::signal,
          "an obstruction of " + shown(component.name));
  }
  std::vector<std::string> faults;
  for (const DiePin& pin : design.pins) {
    if (!pin.is_placed) continue;
    const Layer& layer = technology.layers[static_cast<std::size_t>(pin.shape.layer)];
    index.for_each_in(
        {pin.shape.layer, pin.shape.rect.grown(std::max<Nm>(layer.spacing, 1))}, [&](std::size_t i) {
          const Rect& other = index[i].rect;
          const bool is_its_rail = owners[i].net < 0 && is_supply(pin.use) && owners[i].use == pin.use;
          if (owners[i].net == pin.net || is_its_rail || faults.size() == kMostFaults) return;
          const Nm spacing = layer.spacing_for(std::min(other.width(), other.height()),
                                               std::max(other.width(), other.height()));
          if (nearer_than(pin.shape.rect, other, spacing))
            faults.push_back(
                fmt::format("pin {} is at {} on {}", shown(pin.name), owners[i].what, layer.name));
        });
    add(pin.shape, pin.net, pin.use, "pin " + shown(pin.name));
  }
  return faults;
}

}  // namespace meltstage::layout
