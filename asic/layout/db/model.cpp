// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/model.hpp"

namespace meltstage::layout {

namespace {

// Flops of one clock gate lie near each other for it: their clock's wires and buffers draw most of the
// current, and differ most in delay. At 4 all wires together are too long to route at 95 % of the rows, at 1
// the chip's clock tree takes nearly twice the buffers.
constexpr double kClockWeight = 3.0;

}  // namespace

Point middle_of(const MacroPin& pin) {
  if (pin.shapes.empty()) return {};
  Rect box = pin.shapes.front().rect;
  for (const Shape& shape : pin.shapes)
    box = {std::min(box.x0, shape.rect.x0), std::min(box.y0, shape.rect.y0), std::max(box.x1, shape.rect.x1),
           std::max(box.y1, shape.rect.y1)};
  return box.middle();
}

Model make_model(const Design& design, const Technology& technology, std::size_t most_pins) {
  Model model;
  std::vector<std::vector<Point>> middles(technology.macros.size());
  for (std::size_t m = 0; m < middles.size(); ++m) {
    for (const MacroPin& pin : technology.macros[m].pins) middles[m].push_back(middle_of(pin));
  }
  model.net_start.push_back(0);
  for (const Net& net : design.nets) {
    if (is_supply(net.use) || net.pins.size() > most_pins) continue;
    const std::size_t first = model.pins.size();
    for (const PinRef& ref : net.pins) {
      ModelPin pin{ref.component, model.nets(), 0, 0};
      if (ref.component == kDiePin) {
        const DiePin& die_pin = design.pins[static_cast<std::size_t>(ref.pin)];
        if (!die_pin.is_placed) continue;
        pin.x = die_pin.shape.rect.middle().x;
        pin.y = die_pin.shape.rect.middle().y;
      } else {
        const auto macro =
            static_cast<std::size_t>(design.components[static_cast<std::size_t>(ref.component)].macro);
        const Point middle = middles[macro][static_cast<std::size_t>(ref.pin)];
        pin.x = middle.x;
        pin.y = middle.y;
      }
      model.pins.push_back(pin);
    }
    if (model.pins.size() < first + 2) {
      model.pins.resize(first);
    } else {
      model.net_start.push_back(static_cast<int>(model.pins.size()));
      model.weight.push_back(net.use == Use::clock ? kClockWeight : 1.0);
    }
  }
  model.cell_start.assign(design.components.size() + 1, 0);
  for (const ModelPin& pin : model.pins) {
    if (pin.cell >= 0) ++model.cell_start[static_cast<std::size_t>(pin.cell) + 1];
  }
  for (std::size_t c = 1; c < model.cell_start.size(); ++c) model.cell_start[c] += model.cell_start[c - 1];
  model.pin_of_cell.resize(static_cast<std::size_t>(model.cell_start.back()));
  std::vector<int> next(model.cell_start.begin(), model.cell_start.end() - 1);
  for (std::size_t p = 0; p < model.pins.size(); ++p) {
    if (model.pins[p].cell >= 0)
      model.pin_of_cell[static_cast<std::size_t>(next[static_cast<std::size_t>(model.pins[p].cell)]++)] =
          static_cast<int>(p);
  }
  return model;
}

}  // namespace meltstage::layout
