// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/route/inputs.hpp"

#include <fmt/format.h>

#include <set>
#include <utility>
#include <vector>

#include "asic/layout/db/fixed_metal.hpp"
#include "asic/layout/place/place.hpp"
#include "asic/layout/route/guides.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

void require_spacings(const Technology& technology) {
  if (technology.routing_layers().size() < 3) return;  // route() tells
  std::vector<int> layers = track_layers(technology);
  layers.push_back(technology.routing_layers().front());
  for (const int index : layers) {
    const Layer& layer = technology.layers[static_cast<std::size_t>(index)];
    if (layer.spacing == 0)
      throw UserError(fmt::format(
          "{}: found no SPACING of layer {} that holds without a condition, expected one, or a SPACINGTABLE "
          "PARALLELRUNLENGTH",
          technology.files, shown(layer.name)));
  }
}

void require_no_wires(const Design& design) {
  for (const Net& net : design.nets) {
    if (net.wiring)
      throw UserError(defect_at(design.file, *net.wiring, fmt::format("wires of net {}", shown(net.name)),
                                "none, as the router makes all wires of signals and keeps none"));
  }
}

void require_apart(const Design& design, const std::vector<std::string>& faults) {
  if (!faults.empty())
    throw UserError(
        fmt::format("{}: found that {}; expected supplies, pins of the die and cells' metal apart",
                    design.file, faults.front()));
}

void require_legal_places(const Design& design, const Technology& technology) {
  const bool has_rows = !design.rows.empty();
  for (const PlacementFault& fault : placement_faults(design, technology)) {
    const Component& component = design.components[static_cast<std::size_t>(fault.component)];
    if (!has_rows && !fault.text.ends_with(": overlap")) continue;
    throw UserError(defect_at(design.file, component.where, shown(fault.text),
                              "cells side by side, on the sites of the rows where there are ROWs"));
  }
}

/// An input without a wire floats, and so does a flop without a clock.
void require_inputs_in_nets(const Design& design, const Technology& technology) {
  std::set<std::pair<int, int>> connected;
  for (const Net& net : design.nets)
    for (const PinRef& ref : net.pins) connected.emplace(ref.component, ref.pin);
  for (std::size_t i = 0; i < design.components.size(); ++i) {
    const Component& component = design.components[i];
    const std::vector<MacroPin>& pins = technology.macros[static_cast<std::size_t>(component.macro)].pins;
    for (std::size_t pin = 0; pin < pins.size(); ++pin) {
      if (is_supply(pins[pin].use) || pins[pin].direction != PinDirection::input ||
          connected.contains({static_cast<int>(i), static_cast<int>(pin)}))
        continue;
      throw UserError(defect_at(design.file, component.where,
                                fmt::format("{}/{} in no net", shown(component.name), shown(pins[pin].name)),
                                "each input of a cell in one"));
    }
  }
}

}  // namespace

void require_routable(const Design& design, const Technology& technology) {
  require_spacings(technology);
  require_no_wires(design);
  require_legal_places(design, technology);
  require_inputs_in_nets(design, technology);
  require_apart(design, supply_faults(design, technology));
  require_apart(design, die_pin_faults(design, technology));
}

}  // namespace meltstage::layout
