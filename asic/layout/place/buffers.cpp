// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/place/buffers.hpp"

#include "asic/layout/db/paths.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

WireModel wire_model(const Technology& technology) {
  WireModel model;
  const std::vector<int> routing = technology.routing_layers();
  for (const std::size_t k : {std::size_t{1}, std::size_t{2}}) {
    const Layer& layer =
        technology.layers[static_cast<std::size_t>(routing.at(std::min(k, routing.size() - 1)))];
    const double width_um = um(layer.width);
    model.ohm_per_um += layer.resistance_ohm / width_um / 2;
    model.pf_per_um += (layer.area_cap_pf_um2 * width_um + 2 * layer.edge_cap_pf_um) / 2;
  }
  return model;
}

double expected_load_pf(const Design& design, const Technology& technology, const Delays& delays,
                        const Net& net) {
  std::vector<Sink> sinks;
  double sum = 0.0;
  for (const PinRef& ref : net.pins) {
    sinks.push_back({ref, place_of(design, technology, ref), 0.0, 0.0});
    sum += is_driver(design, technology, ref) ? 0.0 : pin_load_pf(design, technology, delays, ref);
  }
  return sum + wire_model(technology).pf_per_um * TreeBuilder::tree_um(sinks);
}

int net_of_port(const Design& design, const std::string& port) {
  for (const DiePin& pin : design.pins) {
    if (pin.name == port) return pin.net;
  }
  throw UserError(fmt::format("--clock: found {}, expected a port of the netlist", shown(port)));
}

/// Takes the cells' inputs off a net.
std::vector<PinRef> take_sinks(Design& design, const Technology& technology, int net) {
  std::vector<PinRef> sinks;
  auto& pins = design.nets[static_cast<std::size_t>(net)].pins;
  const auto is_sink = [&](const PinRef& ref) {
    return ref.component != kDiePin && !is_driver(design, technology, ref);
  };
  std::copy_if(pins.begin(), pins.end(), std::back_inserter(sinks), is_sink);
  std::erase_if(pins, is_sink);
  return sinks;
}

Point place_of(const Design& design, const Technology& technology, const PinRef& ref) {
  if (ref.component == kDiePin) return design.pins[static_cast<std::size_t>(ref.pin)].shape.rect.middle();
  const Component& c = design.components[static_cast<std::size_t>(ref.component)];
  const Macro& macro = technology.macros[static_cast<std::size_t>(c.macro)];
  const Point middle = middle_of(macro.pins[static_cast<std::size_t>(ref.pin)]);
  return placed({middle.x, middle.y, middle.x, middle.y}, macro, c).middle();
}

double pin_load_pf(const Design& design, const Technology& technology, const Delays& delays,
                   const PinRef& ref) {
  const DelayCell* cell =
      ref.component == kDiePin ? nullptr : delay_cell_of(design, technology, delays, ref.component);
  if (cell == nullptr) return 0.0;
  const Macro& macro =
      technology
          .macros[static_cast<std::size_t>(design.components[static_cast<std::size_t>(ref.component)].macro)];
  const auto pin = cell->pins.find(macro.pins[static_cast<std::size_t>(ref.pin)].name);
  return pin == cell->pins.end() ? 0.0 : pin->second.capacitance_pf;
}

void change_macro(Design& design, const Technology& technology, int component, int macro,
                  const std::vector<int>& nets) {
  const auto& old =
      technology
          .macros[static_cast<std::size_t>(design.components[static_cast<std::size_t>(component)].macro)];
  const Macro& now = technology.macros[static_cast<std::size_t>(macro)];
  for (const int n : nets) {
    for (PinRef& ref : design.nets[static_cast<std::size_t>(n)].pins) {
      if (ref.component == component)
        ref.pin = now.find_pin(old.pins[static_cast<std::size_t>(ref.pin)].name);
    }
  }
  design.components[static_cast<std::size_t>(component)].macro = macro;
}

}  // namespace meltstage::layout
