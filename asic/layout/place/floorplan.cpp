// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "asic/layout/place/place.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

Nm round_up(Nm value, Nm step) { return (value + step - 1) / step * step; }

double area_of(const Component& component, const Technology& technology) {
  const Rect box = outline(component, technology);
  return static_cast<double>(box.width()) * static_cast<double>(box.height());
}

double cell_area(const Design& design, const Technology& technology) {
  double area = 0.0;
  for (const Component& component : design.components) area += area_of(component, technology);
  return area;
}

/// The layers from the rails' up to the straps', and the rule that joins each to the next.
std::vector<const ViaRule*> rules_up_to(const Technology& technology, int bottom, int top) {
  std::vector<const ViaRule*> rules;
  while (bottom != top) {
    const ViaRule* found = nullptr;
    for (const ViaRule& rule : technology.via_rules) {
      if (rule.bottom.layer == bottom) found = &rule;
    }
    if (found == nullptr)
      throw UserError(
          fmt::format("{}: found no VIARULE GENERATE from {} upwards, expected a way to the straps on {}",
                      technology.files, technology.layers[static_cast<std::size_t>(bottom)].name,
                      technology.layers[static_cast<std::size_t>(top)].name));
    rules.push_back(found);
    bottom = found->top.layer;
  }
  return rules;
}

/// As many cuts as fit side by side into a box of the strap's width; metal of the rail's height, or what one
/// cut needs.
Via crossing(const ViaRule& rule, const std::string& name, Nm width, Nm height) {
  const Nm cut_w = rule.cut.width();
  const Nm cut_h = rule.cut.height();
  const Nm side = std::max(rule.bottom.enclosure_x, rule.top.enclosure_x);
  const Nm cuts = 1 + std::max<Nm>(0, (width - 2 * side - cut_w) / std::max(rule.pitch_x, cut_w));
  const Nm half_run = (cuts - 1) * rule.pitch_x / 2;
  const auto metal = [&](const ViaRuleLayer& layer) {
    const Nm half_w = std::max(width / 2, half_run + cut_w / 2 + layer.enclosure_x);
    const Nm half_h = std::max(height / 2, cut_h / 2 + layer.enclosure_y);
    return Shape{layer.layer, {-half_w, -half_h, half_w, half_h}};
  };
  Via via{name, false, {metal(rule.bottom)}};
  for (Nm i = 0; i < cuts; ++i) {
    const Nm x = i * rule.pitch_x - half_run;
    via.shapes.push_back({rule.cut_layer, {x - cut_w / 2, -cut_h / 2, x + cut_w / 2, cut_h / 2}});
  }
  via.shapes.push_back(metal(rule.top));
  return via;
}

/// The widest shape of a supply pin along a cell's edge: the rail.
struct Rail {
  int layer = -1;
  Nm half_height = 0;
};

Rail rail_of(const Technology& technology) {
  for (const Macro& macro : technology.macros) {
    for (const MacroPin& pin : macro.pins) {
      if (pin.use != Use::ground) continue;
      for (const Shape& shape : pin.shapes) {
        if (shape.rect.width() >= macro.width && shape.rect.y0 <= 0) return {shape.layer, shape.rect.y1};
      }
    }
  }
  throw UserError(
      fmt::format("{}: found no ground pin along a cell's lower edge, expected one for the power rails",
                  technology.files));
}

}  // namespace

double core_area(const Design& design, const Technology& technology) {
  double rows = 0.0;
  for (const Row& row : design.rows) {
    const Site& site = technology.sites[static_cast<std::size_t>(row.site)];
    rows +=
        static_cast<double>(row.sites) * static_cast<double>(site.width) * static_cast<double>(site.height);
  }
  return rows;
}

double utilization(const Design& design, const Technology& technology) {
  const double rows = core_area(design, technology);
  return rows > 0.0 ? cell_area(design, technology) / rows : 0.0;
}

void make_floorplan(Design& design, const Technology& technology, const Floorplan& floorplan) {
  if (floorplan.utilization <= 0.0 || floorplan.utilization > 1.0)
    throw UserError(
        fmt::format("--utilization: found {}, expected more than 0 and at most 1", floorplan.utilization));
  if (technology.sites.empty() || technology.routing_layers().empty())
    throw UserError(fmt::format("{}: found no SITE or no routing layer, expected both", technology.files));
  const Site& site = technology.sites.front();
  constexpr Nm kMostRows = 1'000'000, kMostSites = 10'000'000;
  const double area = cell_area(design, technology) / floorplan.utilization;
  const auto rows = std::max<Nm>(1, std::llround(std::sqrt(area) / static_cast<double>(site.height)));
  const auto sites = static_cast<Nm>(
      std::ceil(area / static_cast<double>(rows * site.height) / static_cast<double>(site.width)));
  if (rows > kMostRows || sites > kMostSites)
    throw UserError(fmt::format(
        "{}: found {} rows of {} sites, expected at most {} of {}; SITE of {} is too small for its cells",
        design.file, rows, sites, kMostRows, kMostSites, technology.files));
  const Point low{round_up(floorplan.margin, site.width), round_up(floorplan.margin, site.height)};
  design.die = {0, 0, 2 * low.x + sites * site.width, 2 * low.y + rows * site.height};
  design.rows.clear();
  for (Nm r = 0; r < rows; ++r)
    design.rows.push_back({fmt::format("ROW_{}", r),
                           0,
                           {low.x, low.y + r * site.height},
                           r % 2 == 0 ? Orientation::N : Orientation::FS,
                           static_cast<int>(sites)});
  design.tracks.clear();
  for (const int index : technology.routing_layers()) {
    const Layer& layer = technology.layers[static_cast<std::size_t>(index)];
    const Nm length = layer.direction == Axis::horizontal ? design.die.y1 : design.die.x1;
    if (layer.pitch <= 0 || length <= layer.offset) continue;
    design.tracks.push_back({index, layer.direction, layer.offset,
                             static_cast<int>((length - layer.offset) / layer.pitch) + 1, layer.pitch});
  }
  if (design.tracks.empty())
    throw UserError(fmt::format("{}: found no routing layer with a PITCH, expected some", technology.files));
}

void add_fillers(Design& design, const Technology& technology, const std::string& prefix) {
  std::vector<int> fillers;
  for (std::size_t m = 0; m < technology.macros.size(); ++m) {
    if (technology.macros[m].name.starts_with(prefix)) fillers.push_back(static_cast<int>(m));
  }
  const auto width = [&](int macro) { return technology.macros[static_cast<std::size_t>(macro)].width; };
  std::sort(fillers.begin(), fillers.end(), [&](int a, int b) { return width(a) > width(b); });
  std::vector<std::vector<Rect>> taken(design.rows.size());
  for (const Component& component : design.components) {
    for (std::size_t r = 0; r < design.rows.size(); ++r) {
      if (design.rows[r].at.y == component.at.y) taken[r].push_back(outline(component, technology));
    }
  }
  std::set<std::string> names;
  for (const Component& component : design.components) names.insert(component.name);
  int count = 0;
  const auto free_name = [&] {
    std::string name;
    do name = fmt::format("FILLER_{}", count++);
    while (names.contains(name));
    return name;
  };
  for (std::size_t r = 0; r < design.rows.size(); ++r) {
    const Row& row = design.rows[r];
    std::sort(taken[r].begin(), taken[r].end(), [](const Rect& a, const Rect& b) { return a.x0 < b.x0; });
    const Nm end = row.at.x + row.sites * technology.sites[static_cast<std::size_t>(row.site)].width;
    taken[r].push_back({end, row.at.y, end, row.at.y});
    Nm x = row.at.x;
    for (const Rect& cell : taken[r]) {
      while (x < cell.x0) {
        const auto fits =
            std::find_if(fillers.begin(), fillers.end(), [&](int f) { return width(f) <= cell.x0 - x; });
        if (fits == fillers.end())
          throw UserError(
              fmt::format("--fillers {}: found a gap of {} nm at ({}, {}), expected a cell that fits", prefix,
                          cell.x0 - x, x, row.at.y));
        design.components.push_back({free_name(), *fits, {x, row.at.y}, row.orientation, true, false});
        x += width(*fits);
      }
      x = std::max(x, cell.x1);
    }
  }
}

void add_power_grid(Design& design, const Technology& technology, const PowerGrid& grid) {
  const int top = technology.find_layer(grid.layer);
  if (top < 0)
    throw UserError(
        fmt::format("--strap-layer: found {}, expected a layer of {}", shown(grid.layer), technology.files));
  const Rail rail = rail_of(technology);
  const Layer& layer = technology.layers[static_cast<std::size_t>(top)];
  if (layer.kind != LayerKind::routing || layer.direction != Axis::vertical || top <= rail.layer)
    throw UserError(fmt::format("--strap-layer: found {}, expected a vertical layer above the rails' {}",
                                shown(grid.layer),
                                technology.layers[static_cast<std::size_t>(rail.layer)].name));
  const std::vector<const ViaRule*> rules = rules_up_to(technology, rail.layer, top);
  const int first_via = static_cast<int>(technology.vias.size() + design.vias.size());
  for (const ViaRule* rule : rules)
    design.vias.push_back(crossing(*rule, rule->name + "_strap", grid.width, 2 * rail.half_height));

  int supplies[2] = {-1, -1};  // ground, power
  for (std::size_t n = 0; n < design.nets.size(); ++n) {
    if (design.nets[n].use == Use::ground) supplies[0] = static_cast<int>(n);
    if (design.nets[n].use == Use::power) supplies[1] = static_cast<int>(n);
  }
  if (supplies[0] < 0 || supplies[1] < 0)
    throw UserError(fmt::format("{}: found no supply nets, expected power and ground", design.file));
  const Row& low = design.rows.front();
  const Site& site = technology.sites[static_cast<std::size_t>(low.site)];
  const Nm x0 = low.at.x;
  const Nm x1 = low.at.x + low.sites * site.width;
  std::vector<Nm> rails;
  for (const Row& row : design.rows) rails.push_back(row.at.y);
  rails.push_back(design.rows.back().at.y + site.height);
  for (std::size_t r = 0; r < rails.size(); ++r)
    design.nets[static_cast<std::size_t>(supplies[r % 2])].straps.push_back(
        {rail.layer, {x0, rails[r] - rail.half_height, x1, rails[r] + rail.half_height}});

  // pairs of straps in the middle of equal shares of the rows' width, on sites so that each stack lies alike
  const Nm pairs = std::max<Nm>(1, (x1 - x0) / grid.pitch);
  for (Nm pair = 0; pair < pairs; ++pair) {
    for (int s = 0; s < 2; ++s) {
      const Nm x = x0 + ((x1 - x0) * (4 * pair + 1 + 2 * s) / (4 * pairs)) / site.width * site.width;
      Net& net = design.nets[static_cast<std::size_t>(supplies[s])];
      const Rect strap{x - grid.width / 2, 0, x + grid.width / 2, design.die.y1};
      net.straps.push_back({top, strap});
      for (std::size_t r = static_cast<std::size_t>(s); r < rails.size(); r += 2) {
        for (std::size_t v = 0; v < rules.size(); ++v)
          net.strap_vias.push_back({first_via + static_cast<int>(v), {x, rails[r]}});
      }
      if (pair > 0) continue;
      const Rect end{strap.x0, strap.y1 - grid.width, strap.x1, strap.y1};
      design.pins.push_back({net.name, supplies[s], PinDirection::inout, net.use, true, {top, end}});
    }
  }
}

namespace {

std::string class_of(const Component& component, const Technology& technology) {
  const std::string& all = technology.macros[static_cast<std::size_t>(component.macro)].macro_class;
  return all.substr(0, all.find(' '));
}

/// What is wrong with a cell in rows; empty: nothing.
std::string row_fault(const Component& component, const Design& design, const Technology& technology) {
  const Rect box = outline(component, technology);
  const auto is_upside_down = [](Orientation o) { return o == Orientation::S || o == Orientation::FS; };
  std::string fault = fmt::format("at y = {} nm, where no row is", box.y0);
  for (const Row& row : design.rows) {
    if (row.at.y != box.y0) continue;
    const Nm width = technology.sites[static_cast<std::size_t>(row.site)].width;
    if ((box.x0 - row.at.x) % width != 0 || box.x0 < row.at.x || box.x1 > row.at.x + row.sites * width)
      fault = fmt::format("at x = {} nm, not on the sites of {}", box.x0, row.name);
    else
      return is_upside_down(component.orientation) == is_upside_down(row.orientation)
                 ? ""
                 : fmt::format("its supplies are not those of {}", row.name);
  }
  return fault;
}

/// Pairs of cells that overlap, each once, and some hundred at the most: stripes as high as the lowest cell
/// are searched from left to right.
constexpr std::size_t kMostPairs = 200;
std::set<std::pair<int, int>> overlaps(const Design& design, const Technology& technology) {
  std::vector<std::pair<Rect, int>> boxes;
  Nm height = std::numeric_limits<Nm>::max();
  for (std::size_t c = 0; c < design.components.size(); ++c) {
    if (!design.components[c].is_placed || class_of(design.components[c], technology) == "COVER") continue;
    boxes.emplace_back(outline(design.components[c], technology), static_cast<int>(c));
    height = std::min(height, boxes.back().first.height());
  }
  std::sort(boxes.begin(), boxes.end(), [](const auto& a, const auto& b) { return a.first.x0 < b.first.x0; });
  std::map<Nm, std::vector<std::size_t>> open;  // by stripe: cells that have not ended
  std::set<std::pair<int, int>> pairs;
  const auto stripe = [&](Nm y) { return y >= 0 ? y / height : -((-y - 1) / height) - 1; };
  for (std::size_t b = 0; b < boxes.size() && pairs.size() < kMostPairs; ++b) {
    const auto& [box, cell] = boxes[b];
    for (Nm s = stripe(box.y0); s <= stripe(box.y1 - 1); ++s) {
      std::vector<std::size_t>& here = open[s];
      std::erase_if(here, [&](std::size_t o) { return boxes[o].first.x1 <= box.x0; });
      for (const std::size_t o : here)
        if (boxes[o].first.overlaps(box)) pairs.insert(std::minmax(boxes[o].second, cell));
      here.push_back(b);
    }
  }
  return pairs;
}

}  // namespace

std::vector<PlacementFault> placement_faults(const Design& design, const Technology& technology) {
  std::vector<PlacementFault> faults;
  for (std::size_t c = 0; c < design.components.size(); ++c) {
    const Component& component = design.components[c];
    const auto add = [&](const std::string& what) {
      faults.push_back({static_cast<int>(c), fmt::format("{}: {}", component.name, what)});
    };
    if (!component.is_placed) {
      add("not placed");
      continue;
    }
    if (!design.die.contains(outline(component, technology))) add("outside the die");
    const std::string its_class = class_of(component, technology);
    const bool is_in_rows = its_class.empty() || its_class == "CORE" || its_class == "ENDCAP";
    const std::string fault = is_in_rows ? row_fault(component, design, technology) : "";
    if (!fault.empty()) add(fault);
  }
  for (const auto& [a, b] : overlaps(design, technology))
    faults.push_back(
        {b, fmt::format("{} and {}: overlap", design.components[static_cast<std::size_t>(a)].name,
                        design.components[static_cast<std::size_t>(b)].name)});
  return faults;
}

std::vector<std::string> placement_errors(const Design& design, const Technology& technology) {
  std::vector<std::string> errors;
  for (PlacementFault& fault : placement_faults(design, technology)) errors.push_back(std::move(fault.text));
  return errors;
}

Nm wirelength(const Design& design, const Technology& technology) {
  Nm sum = 0;
  for (const Net& net : design.nets) {
    if (is_supply(net.use)) continue;
    Rect box;
    int pins = 0;
    for (const PinRef& ref : net.pins) {
      const bool is_placed = ref.component == kDiePin
                                 ? design.pins[static_cast<std::size_t>(ref.pin)].is_placed
                                 : design.components[static_cast<std::size_t>(ref.component)].is_placed;
      const std::vector<Shape> shapes = pin_shapes(design, technology, ref);
      if (!is_placed || shapes.empty()) continue;
      Rect pin = shapes.front().rect;
      for (const Shape& s : shapes)
        pin = {std::min(pin.x0, s.rect.x0), std::min(pin.y0, s.rect.y0), std::max(pin.x1, s.rect.x1),
               std::max(pin.y1, s.rect.y1)};
      const Point at = pin.middle();
      box = pins++ == 0 ? Rect{at.x, at.y, at.x, at.y}
                        : Rect{std::min(box.x0, at.x), std::min(box.y0, at.y), std::max(box.x1, at.x),
                               std::max(box.y1, at.y)};
    }
    sum += box.width() + box.height();
  }
  return sum;
}

}  // namespace meltstage::layout
