// SPDX-License-Identifier: Apache-2.0
// What a routed design's metal connects and how near its shapes are, from the shapes alone: nothing of the
// router is used.
#pragma once

#include <fmt/format.h>

#include <map>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

struct MetalShape {
  int net = -1;  ///< -1: a cell's own metal that is no pin
  Shape shape;
};

inline void add_via(std::vector<MetalShape>& shapes, int net, const Via& via, Point at) {
  for (const Shape& s : via.shapes) shapes.push_back({net, {s.layer, s.rect.moved(at)}});
}

/// All metal of signals, cells' pins and cells' obstructions.
inline std::vector<MetalShape> metal_of(const Design& d, const Technology& technology) {
  std::vector<MetalShape> shapes;
  std::map<std::pair<int, int>, int> net_of;
  for (std::size_t n = 0; n < d.nets.size(); ++n) {
    const int net = static_cast<int>(n);
    for (const PinRef& ref : d.nets[n].pins) {
      net_of[{ref.component, ref.pin}] = net;
      for (const Shape& s : pin_shapes(d, technology, ref)) shapes.push_back({net, s});
    }
    for (const Wire& w : d.nets[n].wires) shapes.push_back({net, {w.layer, w.metal()}});
    for (const Shape& s : d.nets[n].patches) shapes.push_back({net, s});
    for (const PlacedVia& v : d.nets[n].vias) add_via(shapes, net, d.via(technology, v.via), v.at);
  }
  for (std::size_t c = 0; c < d.components.size(); ++c) {
    const Component& component = d.components[c];
    const Macro& macro = technology.macros[static_cast<std::size_t>(component.macro)];
    for (std::size_t p = 0; p < macro.pins.size(); ++p)
      if (!net_of.contains({static_cast<int>(c), static_cast<int>(p)}))
        for (const Shape& s : macro.pins[p].shapes)
          shapes.push_back({-1, {s.layer, placed(s.rect, macro, component)}});
    for (const Shape& s : macro.obstructions)
      shapes.push_back({-1, {s.layer, placed(s.rect, macro, component)}});
  }
  return shapes;
}

/// Pairs of shapes of one layer that lie within `reach` of each other, as (index, index).
template <typename Visit>
void near_pairs(const std::vector<MetalShape>& shapes, Nm reach, Visit visit) {
  constexpr Nm kBin = 10'000;
  std::map<std::tuple<int, Nm, Nm>, std::vector<std::size_t>> bins;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Rect r = shapes[i].shape.rect.grown(reach);
    std::set<std::size_t> seen;
    for (Nm x = r.x0 / kBin - 1; x <= r.x1 / kBin; ++x)
      for (Nm y = r.y0 / kBin - 1; y <= r.y1 / kBin; ++y) {
        auto& in_bin = bins[{shapes[i].shape.layer, x, y}];
        for (const std::size_t j : in_bin)
          if (seen.insert(j).second) visit(j, i);
        in_bin.push_back(i);
      }
  }
}

inline Nm gap_squared(const Rect& a, const Rect& b) {
  const Nm dx = std::max({Nm{0}, a.x0 - b.x1, b.x0 - a.x1}), dy = std::max({Nm{0}, a.y0 - b.y1, b.y0 - a.y1});
  return dx * dx + dy * dy;
}

/// Shapes of different nets that are nearer than their layer's spacing; of nothing but cells none is told.
inline std::vector<std::string> spacing_errors(const Design& d, const Technology& technology) {
  std::vector<std::string> errors;
  const std::vector<MetalShape> shapes = metal_of(d, technology);
  near_pairs(shapes, 1'000, [&](std::size_t i, std::size_t j) {
    if (shapes[i].net == shapes[j].net) return;
    const Layer& layer = technology.layers[static_cast<std::size_t>(shapes[i].shape.layer)];
    const Rect &a = shapes[i].shape.rect, &b = shapes[j].shape.rect;
    if (gap_squared(a, b) < layer.spacing * layer.spacing)
      errors.push_back(fmt::format("{}: nets {} and {} at {} {} and {} {}", layer.name, shapes[i].net,
                                   shapes[j].net, a.x0, a.y0, b.x0, b.y0));
  });
  return errors;
}

/// Nets whose pins the metal doesn't all join.
inline std::vector<std::string> open_nets(const Design& d, const Technology& technology) {
  const std::vector<MetalShape> shapes = metal_of(d, technology);
  std::vector<std::size_t> parent(shapes.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  near_pairs(shapes, 0, [&](std::size_t i, std::size_t j) {
    if (shapes[i].net == shapes[j].net && gap_squared(shapes[i].shape.rect, shapes[j].shape.rect) == 0)
      parent[root(i)] = root(j);
  });
  // a via's three shapes, and a pin's, are one
  std::size_t next = 0;
  std::vector<std::set<std::size_t>> pieces(d.nets.size());
  for (std::size_t n = 0; n < d.nets.size(); ++n) {
    std::vector<std::size_t> first_of_pin;
    for (const PinRef& ref : d.nets[n].pins) {
      first_of_pin.push_back(next);
      const std::size_t count = pin_shapes(d, technology, ref).size();
      for (std::size_t k = 1; k < count; ++k) parent[root(next + k)] = root(next);
      next += count;
    }
    next += d.nets[n].wires.size() + d.nets[n].patches.size();
    for (const PlacedVia& v : d.nets[n].vias) {
      const std::size_t count = d.via(technology, v.via).shapes.size();
      for (std::size_t k = 1; k < count; ++k) parent[root(next + k)] = root(next);
      next += count;
    }
    for (const std::size_t pin : first_of_pin) pieces[n].insert(pin);
  }
  std::vector<std::string> open;
  for (std::size_t n = 0; n < d.nets.size(); ++n) {
    std::set<std::size_t> roots;
    for (const std::size_t pin : pieces[n]) roots.insert(root(pin));
    const bool is_supply = d.nets[n].use == Use::power || d.nets[n].use == Use::ground;
    if (!is_supply && roots.size() > 1) open.push_back(d.nets[n].name);
  }
  return open;
}

}  // namespace meltstage::layout
