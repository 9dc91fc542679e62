// SPDX-License-Identifier: Apache-2.0
// DEF, read and written.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <iterator>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "asic/layout/db/design.hpp"
#include "asic/layout/db/tokens.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

constexpr std::array<const char*, 4> kOrientations{"N", "S", "FN", "FS"};
constexpr std::array<const char*, 4> kUses{"SIGNAL", "CLOCK", "POWER", "GROUND"};
constexpr std::array<const char*, 3> kDirections{"INPUT", "OUTPUT", "INOUT"};

template <typename Enum, std::size_t N>
const char* text_of(Enum value, const std::array<const char*, N>& names) {
  return names[static_cast<std::size_t>(value)];
}

class DefReader {
 public:
  DefReader(std::string_view text, const std::string& name, const Technology& technology)
      : in_(text, name), technology_(technology) {
    design_.file = name;
  }

  Design read() {
    while (!in_.at_end()) {
      once();
      if (in_.take("DESIGN")) {
        design_.name = in_.next();
        in_.skip_statement();
      } else if (in_.take("UNITS")) {
        in_.expect("DISTANCE");
        in_.expect("MICRONS");
        scale_ = 1000.0 / in_.count();
        in_.skip_statement();
      } else if (in_.take("DIEAREA")) {
        if (!design_.components.empty()) in_.fail("DIEAREA before COMPONENTS");
        const Point low = point();
        const Point high = point();
        design_.die = {low.x, low.y, high.x, high.y};
        if (low.x >= high.x || low.y >= high.y)
          in_.fail("a die whose second corner is above and right of the first");
        if (!in_.is(";")) in_.fail("; (a die of two corners)");
        in_.skip_statement();
      } else if (in_.take("ROW")) {
        row();
      } else if (in_.take("TRACKS")) {
        tracks();
      } else if (in_.take("VIAS")) {
        section("VIAS", [this] { via(); });
      } else if (in_.take("COMPONENTS")) {
        section("COMPONENTS", [this] { component(); });
      } else if (in_.take("PINS")) {
        section("PINS", [this] { pin(); });
      } else if (in_.take("NETS")) {
        section("NETS", [this] { net(false); });
      } else if (in_.take("SPECIALNETS")) {
        section("SPECIALNETS", [this] { net(true); });
      } else if (in_.take("PROPERTYDEFINITIONS")) {
        while (!(in_.next() == "END" && in_.is("PROPERTYDEFINITIONS"))) {
        }
        in_.next();
      } else if (const char* name = unkept()) {
        in_.next();
        section(name, [this, name] {
          in_.fail(fmt::format("the end of {}: what it asks for is not kept here", name));
        });
      } else if (in_.take("END")) {
        in_.expect("DESIGN");
        return std::move(design_);
      } else {
        in_.skip_statement();
      }
    }
    in_.fail("END DESIGN");
  }

 private:
  /// A section that a layout would have to keep to; null for any other.
  const char* unkept() const {
    for (const char* name : {"BLOCKAGES", "REGIONS", "GROUPS", "FILLS", "SLOTS", "NONDEFAULTRULES"})
      if (in_.is(name)) return name;
    return nullptr;
  }

  /// Statements that a second time would say something else.
  void once() {
    for (const char* name :
         {"DESIGN", "UNITS", "DIEAREA", "VIAS", "COMPONENTS", "PINS", "NETS", "SPECIALNETS"}) {
      if (in_.is(name) && !seen_.insert(name).second) in_.fail(fmt::format("{} once", name));
    }
  }

  template <typename Entry>
  void section(const char* name, const Entry& entry) {
    const Tokens at = in_;
    const int said = in_.count(0);
    in_.skip_statement();
    int listed = 0;
    for (; !in_.take("END"); ++listed) {
      in_.expect("-");
      entry();
    }
    // qrouter of Debian counts one special net too many
    if (listed != said && std::string_view(name) != "SPECIALNETS")
      at.fail(fmt::format("{}, as so many are listed", listed));
    in_.expect(name);
  }

  Nm length() { return in_.whole_length(scale_); }

  /// `( x y [extension] )`; a star repeats the last value.
  Point point() {
    in_.expect("(");
    if (!in_.take("*")) last_.x = length();
    if (!in_.take("*")) last_.y = length();
    if (!in_.is(")")) in_.number();
    in_.expect(")");
    return last_;
  }

  Rect rect() {
    const Point a = point();
    const Point b = point();
    return {std::min(a.x, b.x), std::min(a.y, b.y), std::max(a.x, b.x), std::max(a.y, b.y)};
  }

  template <typename Enum, std::size_t N>
  Enum one_of(const std::array<const char*, N>& names, const char* expected) {
    for (std::size_t i = 0; i < N; ++i) {
      if (in_.take(names[i])) return static_cast<Enum>(i);
    }
    in_.fail(expected);
  }
  Orientation orientation() { return one_of<Orientation>(kOrientations, "orientation N, S, FN or FS"); }

  int layer() {
    const int index = technology_.find_layer(in_.peek());
    if (index < 0) in_.fail("a layer of the LEF");
    in_.next();
    return index;
  }

  int find_via(std::string_view name) const {
    const int shared = technology_.find_via(name);
    if (shared >= 0) return shared;
    for (std::size_t i = 0; i < design_.vias.size(); ++i) {
      if (design_.vias[i].name == name) return static_cast<int>(technology_.vias.size() + i);
    }
    return -1;
  }

  void row() {
    Row row;
    row.name = in_.next();
    row.site = -1;
    for (std::size_t i = 0; i < technology_.sites.size(); ++i) {
      if (in_.is(technology_.sites[i].name)) row.site = static_cast<int>(i);
    }
    if (row.site < 0) in_.fail("a site of the LEF");
    in_.next();
    row.at.x = length();
    row.at.y = length();
    row.orientation = orientation();
    row.sites = 1;
    if (in_.take("DO")) row.sites = in_.count();
    in_.skip_statement();
    design_.rows.push_back(std::move(row));
  }

  void tracks() {
    Tracks tracks;
    tracks.axis = in_.is("Y") ? Axis::horizontal : Axis::vertical;
    in_.next();
    tracks.start = length();
    in_.expect("DO");
    tracks.count = in_.count();
    in_.expect("STEP");
    tracks.step = in_.length_above_0(scale_);
    in_.take("LAYER");
    while (!in_.is(";")) {
      tracks.layer = layer();
      design_.tracks.push_back(tracks);
    }
    in_.expect(";");
  }

  void via() {
    Via via;
    via.name = in_.next();
    while (!in_.take(";")) {
      if (in_.take("RECT")) {
        const int where = layer();
        via.shapes.push_back({where, rect()});
      } else if (in_.is("VIARULE") || in_.is("POLYGON")) {
        in_.fail("a via of RECTs");
      } else {
        in_.next();
      }
    }
    if (via.shapes.empty()) in_.fail("a via of RECTs before it");
    design_.vias.push_back(std::move(via));
  }

  void component() {
    const Tokens at = in_;
    Component component;
    component.name = in_.next();
    component.macro = technology_.find_macro(in_.peek());
    if (component.macro < 0) in_.fail("a macro of the LEF");
    in_.next();
    while (!in_.take(";")) {
      if (in_.is("PLACED") || in_.is("FIXED")) {
        component.is_fixed = in_.is("FIXED");
        component.is_placed = true;
        in_.next();
        component.at = point();
        component.orientation = orientation();
      } else if (in_.is("UNPLACED")) {
        in_.fail("PLACED or FIXED, as all components have a place");
      } else {
        in_.next();
      }
    }
    if (!component.is_placed) at.fail("a component with PLACED or FIXED");
    if (design_.die.width() > 0 && !design_.die.contains(outline(component, technology_)))
      at.fail("a component within DIEAREA");
    if (!component_index_.emplace(component.name, static_cast<int>(design_.components.size())).second)
      in_.fail("each component once, not another " + shown(component.name) + " before it");
    design_.components.push_back(std::move(component));
  }

  int net_index(const std::string& name) {
    const auto [entry, is_new] = net_index_.try_emplace(name, static_cast<int>(design_.nets.size()));
    if (is_new) {
      design_.nets.emplace_back();
      design_.nets.back().name = name;
    }
    return entry->second;
  }

  void pin() {
    DiePin pin;
    pin.where = in_.place();
    pin.name = in_.next();
    Rect shape;
    while (!in_.take(";")) {
      if (in_.take("NET")) {
        pin.net = net_index(std::string(in_.next()));
      } else if (in_.take("DIRECTION")) {
        pin.direction = one_of<PinDirection>(kDirections, "INPUT, OUTPUT or INOUT");
      } else if (in_.take("USE")) {
        pin.use = one_of<Use>(kUses, "SIGNAL, CLOCK, POWER or GROUND");
      } else if (in_.take("LAYER")) {
        pin.shape.layer = layer();
        shape = rect();
      } else if (in_.is("PLACED") || in_.is("FIXED")) {
        in_.next();
        pin.is_placed = true;
        pin.shape.rect = shape.moved(point());
        if (orientation() != Orientation::N) in_.fail("a die pin placed as N");
      } else {
        in_.next();
      }
    }
    if (pin.net < 0) in_.fail("NET of pin " + shown(pin.name) + " before it");
    if (!pin_index_.emplace(pin.name, static_cast<int>(design_.pins.size())).second)
      in_.fail("each pin once, not another " + shown(pin.name) + " before it");
    design_.pins.push_back(std::move(pin));
  }

  /// A pin that stands in two nets would make them one.
  void connect(Net& net, PinRef ref) {
    if (!connected_.insert({ref.component, ref.pin}).second) in_.fail("each pin in one net, once");
    net.pins.push_back(ref);
  }

  void connection(Net& net) {
    const std::string owner(in_.next());
    if (owner == "*") {  // all cells' pins of that name: supplies
      in_.next();
    } else if (owner == "PIN") {
      const auto found = pin_index_.find(std::string(in_.peek()));
      if (found == pin_index_.end()) in_.fail("a pin of PINS");
      const int its = design_.pins[static_cast<std::size_t>(found->second)].net;
      if (&net != &design_.nets[static_cast<std::size_t>(its)])
        in_.fail(fmt::format("a pin with + NET {} in PINS", shown(net.name)));
      connect(net, {kDiePin, found->second});
      in_.next();
    } else {
      const auto found = component_index_.find(owner);
      if (found == component_index_.end())
        in_.fail("a pin of a component of COMPONENTS, not of " + shown(owner));
      const Macro& macro = technology_.macros[static_cast<std::size_t>(
          design_.components[static_cast<std::size_t>(found->second)].macro)];
      const int pin = macro.find_pin(in_.peek());
      if (pin < 0) in_.fail("a pin of " + macro.name);
      connect(net, {found->second, pin});
      in_.next();
    }
    while (!in_.take(")")) in_.next();
  }

  void path(Net& net, bool is_special) {
    const int metal = layer();
    Nm width = technology_.layers[static_cast<std::size_t>(metal)].width;
    if (is_special) width = length();
    while (in_.take("+")) {  // + SHAPE x
      in_.next();
      in_.next();
    }
    if (in_.take("TAPER")) {
    } else if (in_.take("TAPERRULE")) {
      in_.next();
    }
    int current = metal;
    Point at;
    bool has_point = false;
    while (!in_.is("NEW") && !in_.is("+") && !in_.is(";")) {
      if (in_.is("(")) {
        const Point to = point();
        if (has_point && !(is_special && to == at)) add_wire(net, is_special, current, at, to, width);
        at = to;
        has_point = true;
      } else if (in_.take("RECT")) {
        in_.expect("(");
        const Nm x0 = length();
        const Nm y0 = length();
        const Nm x1 = length();
        const Nm y1 = length();
        in_.expect(")");
        net.patches.push_back({current, Rect{x0, y0, x1, y1}.moved(at)});
      } else {
        const int via = find_via(in_.peek());
        if (via < 0) in_.fail("a via of the LEF or of VIAS, a point, NEW or ;");
        in_.next();
        (is_special ? net.strap_vias : net.vias).push_back({via, at});
        current = other_metal(via, current);
      }
    }
  }

  static void add_wire(Net& net, bool is_special, int layer, Point from, Point to, Nm width) {
    if (!is_special) {
      net.wires.push_back({layer, from, to, width});
      return;
    }
    const Nm half = width / 2;
    const bool across = from.y == to.y;
    net.straps.push_back(
        {layer,
         Rect{std::min(from.x, to.x) - (across ? 0 : half), std::min(from.y, to.y) - (across ? half : 0),
              std::max(from.x, to.x) + (across ? 0 : half), std::max(from.y, to.y) + (across ? half : 0)}});
  }

  int other_metal(int via, int metal) const {
    for (const Shape& shape : design_.via(technology_, via).shapes) {
      if (shape.layer != metal &&
          technology_.layers[static_cast<std::size_t>(shape.layer)].kind == LayerKind::routing)
        return shape.layer;
    }
    return metal;
  }

  void net(bool is_special) {
    const Tokens at = in_;
    const int index = net_index(std::string(in_.next()));
    if (!listed_[is_special ? 1 : 0].insert(index).second) at.fail("each net once");
    Net& net = design_.nets[static_cast<std::size_t>(index)];
    while (!in_.take(";")) {
      if (in_.take("(")) {
        connection(net);
      } else if (in_.take("USE")) {
        net.use = one_of<Use>(kUses, "SIGNAL, CLOCK, POWER or GROUND");
      } else if (in_.is("ROUTED") || in_.is("FIXED") || in_.is("NEW")) {
        in_.next();
        path(net, is_special);
      } else {
        in_.next();
      }
    }
  }

  Tokens in_;
  const Technology& technology_;
  Design design_;
  double scale_ = 1.0;
  Point last_;
  std::unordered_map<std::string, int> component_index_;
  std::unordered_map<std::string, int> net_index_;
  std::unordered_map<std::string, int> pin_index_;
  std::set<std::string_view> seen_;                // statements that stand once
  std::array<std::unordered_set<int>, 2> listed_;  // in NETS, in SPECIALNETS
  std::set<std::pair<int, int>> connected_;        // component and pin
};

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
  fmt::format_to(out, "\n  + USE {} ;\n", text_of(net.use, kUses));
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
  fmt::format_to(out, "\n  + USE {} ;\n", text_of(net.use, kUses));
}

bool is_supply(const Net& net) { return net.use == Use::power || net.use == Use::ground; }

}  // namespace

Design read_def(const std::filesystem::path& path, const Technology& technology) {
  return parse_def(read_file(path, "a DEF file"), path.string(), technology);
}

Design parse_def(std::string_view text, const std::string& name, const Technology& technology) {
  return DefReader(text, name, technology).read();
}

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
                   row.at.y, text_of(row.orientation, kOrientations), row.sites, site.width);
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
                     text_of(c.orientation, kOrientations));
    fmt::format_to(out, " ;\n");
  }
  fmt::format_to(out, "END COMPONENTS\nPINS {} ;\n", design.pins.size());
  for (const DiePin& p : design.pins) {
    fmt::format_to(out, "- {} + NET {} + DIRECTION {} + USE {}", p.name,
                   design.nets[static_cast<std::size_t>(p.net)].name, text_of(p.direction, kDirections),
                   text_of(p.use, kUses));
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
  const auto supplies = std::count_if(design.nets.begin(), design.nets.end(), is_supply);
  fmt::format_to(out, "SPECIALNETS {} ;\n", supplies);
  for (const Net& net : design.nets) {
    if (is_supply(net)) write_supply(out, net, design, technology);
  }
  fmt::format_to(out, "END SPECIALNETS\n");
  // a supply stands here too when inputs of cells are tied to it
  const auto is_routed = [](const Net& net) { return !is_supply(net) || !net.pins.empty(); };
  fmt::format_to(out, "NETS {} ;\n", std::count_if(design.nets.begin(), design.nets.end(), is_routed));
  for (const Net& net : design.nets) {
    if (is_routed(net)) write_signal(out, net, design, technology);
  }
  fmt::format_to(out, "END NETS\nEND DESIGN\n");
  return text;
}

}  // namespace meltstage::layout
