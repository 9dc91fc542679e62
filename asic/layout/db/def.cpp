// SPDX-License-Identifier: Apache-2.0
// DEF, read.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "asic/layout/db/def_words.hpp"
#include "asic/layout/db/design.hpp"
#include "asic/layout/db/statements.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

class DefReader;
template <typename Into>
using DefStatement = Statement<DefReader, Into>;
template <typename Into>
using DefBlock = Block<DefReader, Into>;

/// A pin of the die while it is read.
struct DiePinDraft {
  DiePin pin;
  Rect shape;  // around its place
  Point at;
  bool has_shape = false;
  bool has_direction = false;
};

struct NetDraft {
  Net& net;
  bool is_special = false;
  bool has_wiring = false;
  bool has_all_pins = false;  // ( * name )
};

class DefReader {
 public:
  DefReader(std::string_view text, const std::string& name, const Technology& technology)
      : in_(text, name), technology_(technology) {
    design_.file = name;
  }

  Design read() {
    static constexpr std::array kKnown{
        DefStatement<Design>{"DESIGN",
                             [](DefReader& r, Design& d) {
                               d.name = r.in_.next();
                               r.in_.expect(";");
                             }},
        DefStatement<Design>{"UNITS", [](DefReader& r, Design&) { r.units(); }},
        DefStatement<Design>{"DIEAREA", [](DefReader& r, Design&) { r.die_area(); }},
        DefStatement<Design>{"ROW", [](DefReader& r, Design&) { r.row(); }},
        DefStatement<Design>{"TRACKS", [](DefReader& r, Design&) { r.tracks(); }},
        DefStatement<Design>{"VIAS", [](DefReader& r, Design&) { r.section("VIAS", [&r] { r.via(); }); }},
        DefStatement<Design>{"COMPONENTS",
                             [](DefReader& r, Design&) { r.section("COMPONENTS", [&r] { r.component(); }); }},
        DefStatement<Design>{"PINS", [](DefReader& r, Design&) { r.section("PINS", [&r] { r.pin(); }); }},
        DefStatement<Design>{"NETS",
                             [](DefReader& r, Design&) { r.section("NETS", [&r] { r.net(false); }); }},
        DefStatement<Design>{"SPECIALNETS",
                             [](DefReader& r, Design&) { r.section("SPECIALNETS", [&r] { r.net(true); }); }},
        DefStatement<Design>{"VERSION", [](DefReader& r, Design&) { read_version(r.in_); }},
        DefStatement<Design>{"BUSBITCHARS", [](DefReader& r, Design&) { read_bus_bit_characters(r.in_); }},
        DefStatement<Design>{"DIVIDERCHAR",
                             [](DefReader& r, Design&) {
                               r.in_.expect("\"/\"");
                               r.in_.expect(";");
                             }},
        DefStatement<Design>{"NAMESCASESENSITIVE",
                             [](DefReader& r, Design&) { read_case_sensitivity(r.in_); }},
        DefStatement<Design>{"HISTORY",
                             [](DefReader& r, Design&) {
                               while (r.in_.next() != ";") {
                               }
                             }},
        DefStatement<Design>{"BEGINEXT", [](DefReader& r, Design&) { skip_extension(r.in_); }},
        DefStatement<Design>{"PROPERTYDEFINITIONS",
                             [](DefReader& r, Design&) { r.skip_section("PROPERTYDEFINITIONS"); }},
        DefStatement<Design>{"PINPROPERTIES", [](DefReader& r, Design&) { r.skip_section("PINPROPERTIES"); }},
        DefStatement<Design>{"SCANCHAINS", [](DefReader& r, Design&) { r.skip_section("SCANCHAINS"); }},
    };
    static constexpr DefBlock<Design> kBlock("DEF", kKnown, "TECHNOLOGY ARRAY FLOORPLAN GCELLGRID");
    while (!in_.at_end()) {
      if (in_.take("END")) {
        in_.expect("DESIGN");
        if (!in_.at_end()) in_.fail("the file's end behind END DESIGN");
        require_whole();
        return std::move(design_);
      }
      once();
      if (const char* name = unkept()) {
        in_.next();
        section(name, [this, name] {
          in_.fail(fmt::format("the end of {}: what it asks for is not kept here", name));
        });
      } else {
        kBlock.next(in_, *this, design_);
      }
    }
    in_.fail("END DESIGN");
  }

 private:
  /// A section that a layout would have to keep to; null for any other.
  const char* unkept() const {
    for (const char* name : {"BLOCKAGES", "REGIONS", "GROUPS", "FILLS", "SLOTS", "NONDEFAULTRULES", "STYLES"})
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

  /// What can be told at the end alone: a name, and pins of the die that their nets list. A supply's pins
  /// stand on its straps.
  void require_whole() const {
    if (design_.name.empty())
      throw UserError(fmt::format("{}: found no DESIGN, expected DESIGN and a name", design_.file));
    for (std::size_t p = 0; p < design_.pins.size(); ++p) {
      const DiePin& pin = design_.pins[p];
      const Net& net = design_.nets[static_cast<std::size_t>(pin.net)];
      const bool is_on_straps =
          is_supply(pin.use) || is_supply(net.use) || !net.straps.empty() || !net.strap_vias.empty();
      if (!is_on_straps && !connected_.contains({kDiePin, static_cast<int>(p)}))
        throw UserError(defect_at(design_.file, pin.where,
                                  fmt::format("pin {} with + NET {}", shown(pin.name), shown(net.name)),
                                  fmt::format("( PIN {} ) in that net of NETS", shown(pin.name))));
    }
  }

  template <typename Entry>
  void section(const char* name, const Entry& entry) {
    const Tokens at = in_;
    const int said = in_.count(0);
    in_.expect(";");
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

  void skip_section(const char* name) {
    while (!(in_.take("END") && in_.take(name)))
      if (!in_.is("END")) in_.next();
  }

  /// What follows the name of an entry: clauses that begin with `+`, and `;`. Those of `refused` ask for what
  /// is not kept here.
  template <typename Into>
  void clauses(const DefBlock<Into>& block, std::string_view refused, Into& into) {
    while (!in_.take(";")) {
      if (!in_.take("+")) in_.fail("+ or ;");
      clause(block, refused, into);
    }
  }
  template <typename Into>
  void clause(const DefBlock<Into>& block, std::string_view refused, Into& into) {
    for (const std::string_view word : words_of(refused))
      if (in_.is(word)) in_.fail(fmt::format("no {}: what it asks for is not kept here", word));
    block.next_clause(in_, *this, into);
  }

  void units() {
    in_.expect("DISTANCE");
    in_.expect("MICRONS");
    const Tokens at = in_;
    const int units = in_.count();
    static constexpr std::array kUnits{100, 200, 400, 800, 1000, 2000, 4000, 8000, 10'000, 20'000};
    if (std::find(kUnits.begin(), kUnits.end(), units) == kUnits.end())
      at.fail("100, 200, 400 or 800, ten times that, or 20000");
    scale_ = 1000.0 / units;
    in_.expect(";");
  }

  Nm length() {
    if (scale_ == 0.0) in_.fail("UNITS DISTANCE MICRONS before the first length");
    return in_.whole_length(scale_);
  }

  Point point() {
    in_.expect("(");
    const Nm x = length();
    const Nm y = length();
    in_.expect(")");
    return {x, y};
  }

  /// `( x y [extension] )` of a wire; a star repeats the value of the point before it.
  Point point_after(const std::optional<Point>& before) {
    Point here = before.value_or(Point{});
    in_.expect("(");
    const auto coordinate = [&](Nm& value) {
      if (in_.is("*") && !before) in_.fail("a number, as no point is before it");
      if (!in_.take("*")) value = length();
    };
    coordinate(here.x);
    coordinate(here.y);
    if (!in_.is(")") && !in_.take("0")) in_.fail("no extension of the wire beyond its point");
    in_.expect(")");
    return here;
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
  Orientation orientation() { return one_of<Orientation>(kOrientationWords, "orientation N, S, FN or FS"); }
  Use use() { return one_of<Use>(kUseWords, "SIGNAL, CLOCK, POWER or GROUND"); }

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

  void die_area() {
    if (!design_.components.empty()) in_.fail("DIEAREA before COMPONENTS");
    const Point low = point();
    const Point high = point();
    design_.die = {low.x, low.y, high.x, high.y};
    if (low.x >= high.x || low.y >= high.y)
      in_.fail("a die whose second corner is above and right of the first");
    if (!in_.take(";")) in_.fail("; (a die of two corners)");
  }

  void row() {
    Row row;
    if (!row_names_.insert(std::string(in_.peek())).second) in_.fail("each row once");
    row.name = in_.next();
    row.site = technology_.find_site(in_.peek());
    if (row.site < 0) in_.fail("a site of the LEF");
    in_.next();
    row.at.x = length();
    row.at.y = length();
    row.orientation = orientation();
    row.sites = 1;
    if (in_.take("DO")) {
      row.sites = in_.count();
      in_.expect("BY");
      const Tokens rows = in_;
      if (in_.count() != 1) rows.fail("1, a row of sites beside each other");
      if (in_.take("STEP")) sites_side_by_side(technology_.sites[static_cast<std::size_t>(row.site)].width);
    }
    if (in_.take("+")) {
      in_.expect("PROPERTY");
      in_.skip_statement();
    } else {
      in_.expect(";");
    }
    design_.rows.push_back(std::move(row));
  }

  void sites_side_by_side(Nm width) {
    const Tokens step = in_;
    if (length() != width)
      step.fail(fmt::format("{:g}, the width of the site", static_cast<double>(width) / scale_));
    length();
  }

  void tracks() {
    Tracks tracks;
    if (!in_.is("X") && !in_.is("Y")) in_.fail("X or Y");
    tracks.axis = in_.take("Y") ? Axis::horizontal : (in_.next(), Axis::vertical);
    tracks.start = length();
    in_.expect("DO");
    tracks.count = in_.count();
    in_.expect("STEP");
    const Tokens step = in_;
    tracks.step = length();
    if (tracks.step <= 0) step.fail("a length of a nanometre or more");
    in_.expect("LAYER");
    do {
      tracks.layer = layer();
      design_.tracks.push_back(tracks);
    } while (!in_.take(";"));
  }

  void via() {
    static constexpr std::array kKnown{DefStatement<Via>{"RECT", [](DefReader& r, Via& v) {
                                                           const int where = r.layer();
                                                           v.shapes.push_back({where, r.rect()});
                                                         }}};
    static constexpr DefBlock<Via> kBlock("VIAS", kKnown, "PATTERNNAME PROPERTY");
    const Tokens at = in_;
    Via via;
    via.name = in_.next();
    while (!in_.take(";")) {
      if (!in_.take("+")) in_.fail("+ or ;");
      if (in_.is("VIARULE") || in_.is("POLYGON")) in_.fail("a via of RECTs");
      kBlock.next_clause(in_, *this, via);
    }
    if (via.shapes.empty()) in_.fail("a via of RECTs before it");
    if (find_via(via.name) >= 0) at.fail("a name that no via of the LEF and of VIAS has");
    design_.vias.push_back(std::move(via));
  }

  void place(Component& component) {
    component.is_placed = true;
    component.at = point();
    component.orientation = orientation();
  }

  void component() {
    static constexpr std::array kKnown{
        DefStatement<Component>{"PLACED", [](DefReader& r, Component& c) { r.place(c); }},
        DefStatement<Component>{"FIXED",
                                [](DefReader& r, Component& c) {
                                  c.is_fixed = true;
                                  r.place(c);
                                }},
    };
    static constexpr DefBlock<Component> kBlock("a component", kKnown,
                                                "SOURCE WEIGHT EEQMASTER GENERATE FOREIGN HALO PROPERTY");
    const Tokens at = in_;
    Component component;
    component.where = in_.place();
    component.name = in_.next();
    component.macro = technology_.find_macro(in_.peek());
    if (component.macro < 0) in_.fail("a macro of the LEF");
    in_.next();
    while (!in_.take(";")) {
      if (!in_.take("+")) in_.fail("+ or ;");
      if (in_.is("UNPLACED") || in_.is("COVER")) in_.fail("PLACED or FIXED, as all components have a place");
      clause(kBlock, "ROUTEHALO REGION MASKSHIFT", component);
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

  void shape(DiePinDraft& draft) {
    if (draft.has_shape) in_.fail("one LAYER and rectangle a pin");
    draft.has_shape = true;
    draft.pin.shape.layer = layer();
    if (in_.take("MASK")) in_.count();
    if (in_.take("SPACING") || in_.take("DESIGNRULEWIDTH")) length();
    draft.shape = rect();
  }

  void place(DiePinDraft& draft) {
    if (draft.pin.is_placed) in_.fail("one place a pin");
    draft.pin.is_placed = true;
    draft.at = point();
    if (orientation() != Orientation::N) in_.fail("a die pin placed as N");
  }

  void pin() {
    static constexpr std::array kKnown{
        DefStatement<DiePinDraft>{
            "NET", [](DefReader& r, DiePinDraft& d) { d.pin.net = r.net_index(std::string(r.in_.next())); }},
        DefStatement<DiePinDraft>{"DIRECTION",
                                  [](DefReader& r, DiePinDraft& d) {
                                    d.has_direction = true;
                                    d.pin.direction =
                                        r.one_of<PinDirection>(kDirectionWords, "INPUT, OUTPUT or INOUT");
                                  }},
        DefStatement<DiePinDraft>{"USE", [](DefReader& r, DiePinDraft& d) { d.pin.use = r.use(); }},
        DefStatement<DiePinDraft>{"LAYER", [](DefReader& r, DiePinDraft& d) { r.shape(d); }},
        DefStatement<DiePinDraft>{"PLACED", [](DefReader& r, DiePinDraft& d) { r.place(d); }},
        DefStatement<DiePinDraft>{"FIXED", [](DefReader& r, DiePinDraft& d) { r.place(d); }},
        DefStatement<DiePinDraft>{"COVER", [](DefReader& r, DiePinDraft& d) { r.place(d); }},
    };
    static constexpr DefBlock<DiePinDraft> kBlock(
        "a pin", kKnown,
        "SPECIAL PORT NETEXPR SUPPLYSENSITIVITY GROUNDSENSITIVITY PROPERTY ANTENNAMODEL "
        "ANTENNAPINPARTIALMETALAREA ANTENNAPINPARTIALMETALSIDEAREA ANTENNAPINPARTIALCUTAREA "
        "ANTENNAPINDIFFAREA ANTENNAPINGATEAREA ANTENNAPINMAXAREACAR ANTENNAPINMAXSIDEAREACAR "
        "ANTENNAPINMAXCUTCAR");
    const Tokens at = in_;
    DiePinDraft draft;
    DiePin& pin = draft.pin;
    pin.where = in_.place();
    pin.name = in_.next();
    clauses(kBlock, "POLYGON VIA", draft);
    if (pin.net < 0) in_.fail("NET of pin " + shown(pin.name) + " before it");
    if (pin.is_placed && !draft.has_shape) at.fail("LAYER and a rectangle of a pin with a place");
    if (pin.is_placed) pin.shape.rect = draft.shape.moved(draft.at);
    if (pin.is_placed && design_.die.width() > 0 && !design_.die.touches(pin.shape.rect))
      at.fail("a pin that touches DIEAREA");
    if (!pin_index_.emplace(pin.name, static_cast<int>(design_.pins.size())).second)
      in_.fail("each pin once, not another " + shown(pin.name) + " before it");
    if (draft.has_direction) drives_.push_back(pin.direction == PinDirection::input);
    drives_.resize(design_.pins.size() + 1, false);
    design_.pins.push_back(std::move(pin));
  }

  /// A pin that stands in two nets would make them one.
  void connect(Net& net, PinRef ref) {
    if (!connected_.insert({ref.component, ref.pin}).second) in_.fail("each pin in one net, once");
    net.pins.push_back(ref);
  }

  /// Two outputs would pull a net both ways.
  void drive(const Net& net, const std::string& pin) {
    const auto [first, is_first] = driver_.try_emplace(&net - design_.nets.data(), pin);
    if (!is_first) in_.fail(fmt::format("one output a net, as {} drives it", shown(first->second)));
  }

  void connection(NetDraft& draft) {
    Net& net = draft.net;
    const Tokens at = in_;
    const std::string owner(in_.next());
    if (owner == "*") {  // all cells' pins of that name: supplies
      if (!draft.is_special) at.fail("a component or PIN in a net of NETS");
      draft.has_all_pins = true;
    } else if (owner == "PIN") {
      const auto found = pin_index_.find(std::string(in_.peek()));
      if (found == pin_index_.end()) in_.fail("a pin of PINS");
      const int its = design_.pins[static_cast<std::size_t>(found->second)].net;
      if (&net != &design_.nets[static_cast<std::size_t>(its)])
        in_.fail(fmt::format("a pin with + NET {} in PINS", shown(net.name)));
      connect(net, {kDiePin, found->second});
      if (drives_[static_cast<std::size_t>(found->second)]) drive(net, "PIN " + found->first);
    } else {
      const auto found = component_index_.find(owner);
      if (found == component_index_.end())
        in_.fail("a pin of a component of COMPONENTS, not of " + shown(owner));
      const Macro& macro = technology_.macros[static_cast<std::size_t>(
          design_.components[static_cast<std::size_t>(found->second)].macro)];
      const int pin = macro.find_pin(in_.peek());
      if (pin < 0) in_.fail("a pin of " + macro.name);
      connect(net, {found->second, pin});
      const MacroPin& its = macro.pins[static_cast<std::size_t>(pin)];
      if (!draft.is_special && is_supply(its.use))
        at.fail(fmt::format("a signal's pin, as {} of {} is a supply's", its.name, macro.name));
      if (its.direction == PinDirection::output && !its.is_tristate) drive(net, owner + "/" + its.name);
    }
    in_.next();
    if (in_.take("+")) in_.expect("SYNTHESIZED");
    in_.expect(")");
  }

  void path(NetDraft& draft) {
    Net& net = draft.net;
    const int metal = layer();
    Nm width = technology_.layers[static_cast<std::size_t>(metal)].width;
    if (draft.is_special) width = length();
    while (in_.take("+")) {
      if (!in_.take("SHAPE")) in_.fail("SHAPE, as wires of a STYLE or MASK are not read");
      in_.next();
    }
    in_.take("TAPER");
    if (in_.is("TAPERRULE") || in_.is("STYLE")) in_.fail("a wire of its layer's width");
    int current = metal;
    std::optional<Point> at;
    while (!in_.is("NEW") && !in_.is("+") && !in_.is(";")) {
      const Tokens piece = in_;
      if (in_.is("(")) {
        const Point to = point_after(at);
        if (at && to.x != at->x && to.y != at->y)
          piece.fail("a point straight above or beside the one before it");
        if (at && !(draft.is_special && to == *at)) add_wire(draft, current, *at, to, width);
        at = to;
        continue;
      }
      if (!at) in_.fail("a point first");
      if (!draft.is_special && in_.take("RECT")) {
        in_.expect("(");
        const Nm x0 = length();
        const Nm y0 = length();
        const Nm x1 = length();
        const Nm y1 = length();
        in_.expect(")");
        net.patches.push_back({current, Rect{x0, y0, x1, y1}.moved(*at)});
      } else {
        const int via = find_via(in_.peek());
        if (via < 0) in_.fail("a via of the LEF or of VIAS, a point, NEW or ;");
        in_.next();
        (draft.is_special ? net.strap_vias : net.vias).push_back({via, *at});
        current = other_metal(via, current);
      }
    }
  }

  static void add_wire(NetDraft& draft, int layer, Point from, Point to, Nm width) {
    if (!draft.is_special) {
      draft.net.wires.push_back({layer, from, to, width});
      return;
    }
    const Nm half = width / 2;
    const bool across = from.y == to.y;
    draft.net.straps.push_back(
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

  void wiring(NetDraft& draft) {
    draft.has_wiring = true;
    if (!draft.is_special && !draft.net.wiring) draft.net.wiring = in_.place();
    path(draft);
  }

  void net(bool is_special) {
    static constexpr auto wires = [](DefReader& r, NetDraft& d) { r.wiring(d); };
    static constexpr std::array kKnown{
        DefStatement<NetDraft>{"USE", [](DefReader& r, NetDraft& d) { d.net.use = r.use(); }},
        DefStatement<NetDraft>{"ROUTED", wires},
        DefStatement<NetDraft>{"FIXED", wires},
        DefStatement<NetDraft>{"COVER", wires},
    };
    static constexpr DefBlock<NetDraft> kBlock(
        "a net", kKnown, "SOURCE WEIGHT FREQUENCY ORIGINAL PATTERN ESTCAP XTALK VOLTAGE PROPERTY");
    const Tokens at = in_;
    const int index = net_index(std::string(in_.next()));
    if (!listed_[is_special ? 1 : 0].insert(index).second) at.fail("each net once");
    NetDraft draft{design_.nets[static_cast<std::size_t>(index)], is_special};
    while (!in_.take(";")) {
      if (in_.take("(")) {
        connection(draft);
      } else if (draft.has_wiring && in_.take("NEW")) {
        path(draft);
      } else if (in_.take("+")) {
        clause(kBlock,
               "SHIELDNET VPIN SUBNET NONDEFAULTRULE NOSHIELD FIXEDBUMP SHIELD RECT POLYGON VIA SHAPE",
               draft);
      } else {
        in_.fail("(, + or ;");
      }
    }
    if (is_special && !is_supply(draft.net.use)) {
      if (draft.has_all_pins) at.fail("USE POWER or GROUND of a net of all pins of a name");
      if (draft.has_wiring && !draft.net.wiring) draft.net.wiring = at.place();
    }
  }

  Tokens in_;
  const Technology& technology_;
  Design design_;
  double scale_ = 0.0;  // nm a unit; 0: not said yet
  std::unordered_map<std::string, int> component_index_;
  std::unordered_map<std::string, int> net_index_;
  std::unordered_map<std::string, int> pin_index_;
  std::unordered_set<std::string> row_names_;
  std::vector<bool> drives_;                                // by die pin: said to be an input
  std::unordered_map<std::ptrdiff_t, std::string> driver_;  // of a net
  std::set<std::string_view> seen_;                         // statements that stand once
  std::array<std::unordered_set<int>, 2> listed_;           // in NETS, in SPECIALNETS
  std::set<std::pair<int, int>> connected_;                 // component and pin
};

}  // namespace

Design read_def(const std::filesystem::path& path, const Technology& technology) {
  return parse_def(read_file(path, "a DEF file"), path.string(), technology);
}

Design parse_def(std::string_view text, const std::string& name, const Technology& technology) {
  return DefReader(text, name, technology).read();
}

}  // namespace meltstage::layout
