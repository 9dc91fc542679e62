// SPDX-License-Identifier: Apache-2.0
// DEF, written.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "asic/layout/db/def_words.hpp"
#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

namespace {

using Out = std::back_insert_iterator<std::string>;

void write_connections(Out& out, const Net& net, const Design& design, const Technology& technology) {
  int on_line = 0;
  for (const PinRef& ref : net.pins) {
    if (on_line++ % 6 == 0) fmt::format_to(out, "\n ");
    if (ref.component == kDiePin) {
      fmt::format_to(out, " ( PIN {} )", design.pins[static_cast<std::size_t>(ref.pin)].name);
    } else {
      const Component& component = design.components[static_cast<std::size_t>(ref.component)];
      const Macro& macro = technology.macros[static_cast<std::size_t>(component.macro)];
      fmt::format_to(out, " ( {} {} )", component.name, macro.pins[static_cast<std::size_t>(ref.pin)].name);
    }
  }
}

void write_signal(Out& out, const Net& net, const Design& design, const Technology& technology) {
  fmt::format_to(out, "- {}", net.name);
  write_connections(out, net, design, technology);
  const char* start = "\n  + ROUTED";
  const auto begin = [&](int layer) {
    fmt::format_to(out, "{} {}", start, technology.layers[static_cast<std::size_t>(layer)].name);
    start = "\n    NEW";
  };
  for (const Wire& w : net.wires) {
    begin(w.layer);
    fmt::format_to(out, " ( {} {} ) ( {} {} )", w.from.x, w.from.y, w.to.x, w.to.y);
  }
  for (const PlacedVia& v : net.vias) {
    const Via& via = design.via(technology, v.via);
    begin(via.shapes.front().layer);
    fmt::format_to(out, " ( {} {} ) {}", v.at.x, v.at.y, via.name);
  }
  for (const Shape& p : net.patches) {
    begin(p.layer);
    fmt::format_to(out, " ( {} {} ) RECT ( 0 0 {} {} )", p.rect.x0, p.rect.y0, p.rect.width(),
                   p.rect.height());
  }
  fmt::format_to(out, "\n  + USE {} ;\n", text_of(net.use, kUseWords));
}

void write_supply(Out& out, const Net& net, const Design& design, const Technology& technology) {
  fmt::format_to(out, "- {} ( * {} )", net.name, net.name);
  const char* start = "\n  + ROUTED";
  for (const Shape& strap : net.straps) {
    const Rect& r = strap.rect;
    const bool across = r.width() >= r.height();
    const Point middle = r.middle();
    fmt::format_to(out, "{} {} {} + SHAPE STRIPE", start,
                   technology.layers[static_cast<std::size_t>(strap.layer)].name,
                   across ? r.height() : r.width());
    if (across)
      fmt::format_to(out, " ( {} {} ) ( {} {} )", r.x0, middle.y, r.x1, middle.y);
    else
      fmt::format_to(out, " ( {} {} ) ( {} {} )", middle.x, r.y0, middle.x, r.y1);
    start = "\n    NEW";
  }
  for (const PlacedVia& v : net.strap_vias) {
    const Via& via = design.via(technology, v.via);
    fmt::format_to(out, "{} {} 0 + SHAPE STRIPE ( {} {} ) {}", start,
                   technology.layers[static_cast<std::size_t>(via.shapes.front().layer)].name, v.at.x, v.at.y,
                   via.name);
    start = "\n    NEW";
  }
  fmt::format_to(out, "\n  + USE {} ;\n", text_of(net.use, kUseWords));
}

}  // namespace

std::string def_text(const Design& design, const Technology& technology) {
  std::string text;
  Out out = std::back_inserter(text);
  // names of nets hold [ and ], so the bus characters are others
  fmt::format_to(out,
                 "VERSION 5.8 ;\nDIVIDERCHAR \"/\" ;\nBUSBITCHARS \"<>\" ;\nDESIGN {} ;\nUNITS DISTANCE "
                 "MICRONS 1000 ;\n",
                 design.name);
  fmt::format_to(out, "DIEAREA ( {} {} ) ( {} {} ) ;\n", design.die.x0, design.die.y0, design.die.x1,
                 design.die.y1);
  for (const Row& row : design.rows) {
    const Site& site = technology.sites[static_cast<std::size_t>(row.site)];
    fmt::format_to(out, "ROW {} {} {} {} {} DO {} BY 1 STEP {} 0 ;\n", row.name, site.name, row.at.x,
                   row.at.y, text_of(row.orientation, kOrientationWords), row.sites, site.width);
  }
  for (const Tracks& t : design.tracks)
    fmt::format_to(out, "TRACKS {} {} DO {} STEP {} LAYER {} ;\n", t.axis == Axis::horizontal ? "Y" : "X",
                   t.start, t.count, t.step, technology.layers[static_cast<std::size_t>(t.layer)].name);
  if (!design.vias.empty()) {
    fmt::format_to(out, "VIAS {} ;\n", design.vias.size());
    for (const Via& via : design.vias) {
      fmt::format_to(out, "- {}", via.name);
      for (const Shape& s : via.shapes)
        fmt::format_to(out, "\n  + RECT {} ( {} {} ) ( {} {} )",
                       technology.layers[static_cast<std::size_t>(s.layer)].name, s.rect.x0, s.rect.y0,
                       s.rect.x1, s.rect.y1);
      fmt::format_to(out, " ;\n");
    }
    fmt::format_to(out, "END VIAS\n");
  }
  fmt::format_to(out, "COMPONENTS {} ;\n", design.components.size());
  for (const Component& c : design.components) {
    fmt::format_to(out, "- {} {}", c.name, technology.macros[static_cast<std::size_t>(c.macro)].name);
    if (c.is_placed)
      fmt::format_to(out, " + {} ( {} {} ) {}", c.is_fixed ? "FIXED" : "PLACED", c.at.x, c.at.y,
                     text_of(c.orientation, kOrientationWords));
    fmt::format_to(out, " ;\n");
  }
  fmt::format_to(out, "END COMPONENTS\nPINS {} ;\n", design.pins.size());
  for (const DiePin& p : design.pins) {
    fmt::format_to(out, "- {} + NET {} + DIRECTION {} + USE {}", p.name,
                   design.nets[static_cast<std::size_t>(p.net)].name, text_of(p.direction, kDirectionWords),
                   text_of(p.use, kUseWords));
    if (p.is_placed) {
      const Point at = p.shape.rect.middle();
      const Rect r = p.shape.rect.moved({-at.x, -at.y});
      fmt::format_to(out, " + LAYER {} ( {} {} ) ( {} {} ) + PLACED ( {} {} ) N",
                     technology.layers[static_cast<std::size_t>(p.shape.layer)].name, r.x0, r.y0, r.x1, r.y1,
                     at.x, at.y);
    }
    fmt::format_to(out, " ;\n");
  }
  fmt::format_to(out, "END PINS\n");
  const auto supplies = std::count_if(design.nets.begin(), design.nets.end(),
                                      [](const Net& net) { return is_supply(net.use); });
  fmt::format_to(out, "SPECIALNETS {} ;\n", supplies);
  for (const Net& net : design.nets) {
    if (is_supply(net.use)) write_supply(out, net, design, technology);
  }
  fmt::format_to(out, "END SPECIALNETS\n");
  // a supply stands here too when inputs of cells are tied to it
  const auto is_routed = [](const Net& net) { return !is_supply(net.use) || !net.pins.empty(); };
  fmt::format_to(out, "NETS {} ;\n", std::count_if(design.nets.begin(), design.nets.end(), is_routed));
  for (const Net& net : design.nets) {
    if (is_routed(net)) write_signal(out, net, design, technology);
  }
  fmt::format_to(out, "END NETS\nEND DESIGN\n");
  return text;
}

}  // namespace meltstage::layout
