// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/technology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "asic/layout/db/tokens.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

constexpr double kNmPerUm = 1000.0;
constexpr std::size_t kMostLayers = 1000;

template <typename Items>
int index_by_name(const Items& items, std::string_view name) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

template <typename Enum>
using Named = std::pair<std::string_view, Enum>;

constexpr std::array<Named<LayerKind>, 5> kLayerKinds{{{"ROUTING", LayerKind::routing},
                                                       {"CUT", LayerKind::cut},
                                                       {"MASTERSLICE", LayerKind::other},
                                                       {"OVERLAP", LayerKind::other},
                                                       {"IMPLANT", LayerKind::other}}};
constexpr std::array<Named<Axis>, 2> kAxes{{{"HORIZONTAL", Axis::horizontal}, {"VERTICAL", Axis::vertical}}};
constexpr std::array<Named<PinDirection>, 4> kPinDirections{{{"INPUT", PinDirection::input},
                                                             {"OUTPUT", PinDirection::output},
                                                             {"INOUT", PinDirection::inout},
                                                             {"FEEDTHRU", PinDirection::inout}}};
constexpr std::array<Named<Use>, 5> kUses{{{"SIGNAL", Use::signal},
                                           {"ANALOG", Use::signal},
                                           {"CLOCK", Use::clock},
                                           {"POWER", Use::power},
                                           {"GROUND", Use::ground}}};

class LefReader {
 public:
  LefReader(std::string_view text, const std::string& name, Technology& technology)
      : in_(text, name), technology_(technology) {}

  void read() {
    while (!in_.at_end()) {
      if (in_.take("LAYER")) {
        layer();
      } else if (in_.take("VIA")) {
        via();
      } else if (in_.take("VIARULE")) {
        via_rule();
      } else if (in_.take("SITE")) {
        site();
      } else if (in_.take("MACRO")) {
        macro();
      } else if (in_.take("MANUFACTURINGGRID")) {
        technology_.grid = um_above_0();
        in_.expect(";");
      } else if (in_.take("UNITS")) {
        units();
      } else if (in_.is("PROPERTYDEFINITIONS") || in_.is("SPACING") || in_.is("NONDEFAULTRULE")) {
        skip_block(std::string(in_.next()));
      } else if (in_.take("END")) {
        in_.expect("LIBRARY");
        return;
      } else {
        in_.skip_statement();
      }
    }
  }

 private:
  Nm um() { return in_.length(kNmPerUm); }
  Nm um_above_0() { return in_.length_above_0(kNmPerUm); }

  void skip_block(const std::string& name) {
    while (true) {
      if (in_.take("END")) {
        if (in_.take(name)) return;
      } else {
        in_.next();
      }
    }
  }

  /// Lengths are micrometres, whatever the units of the database; these are for DEF and must be some.
  void units() {
    while (!in_.take("END")) {
      if (in_.take("DATABASE")) {
        in_.expect("MICRONS");
        in_.count();
      }
      in_.skip_statement();
    }
    in_.expect("UNITS");
  }

  template <typename Enum, std::size_t N>
  Enum one_of(const std::array<Named<Enum>, N>& names) {
    std::string expected;
    for (std::size_t i = 0; i < N; ++i) {
      if (in_.take(names[i].first)) return names[i].second;
      expected += (i == 0 ? "" : i + 1 < N ? ", " : " or ") + std::string(names[i].first);
    }
    in_.fail(expected);
  }

  /// Whether it is the first of its name. A second one has the values of the first, as where files repeat
  /// each other.
  template <typename Item>
  static bool is_first(const std::vector<Item>& items, int index, const Item& item, const Tokens& at) {
    if (index < 0) return true;
    if (items[static_cast<std::size_t>(index)] == item) return false;
    at.fail("another name, as that one was described before with other values");
  }

  int layer_index() {
    const int index = technology_.find_layer(in_.peek());
    if (index < 0) in_.fail("a layer that was described before");
    in_.next();
    return index;
  }

  Rect rect() {
    if (in_.take("MASK")) in_.number();
    const Nm x0 = um();
    const Nm y0 = um();
    const Nm x1 = um();
    const Nm y1 = um();
    in_.expect(";");
    return {std::min(x0, x1), std::min(y0, y1), std::max(x0, x1), std::max(y0, y1)};
  }

  void spacing_table(Layer& layer) {
    if (!in_.take("PARALLELRUNLENGTH")) {
      in_.skip_statement();
      return;
    }
    layer.run_lengths.clear();
    layer.spacing_table.clear();
    while (!in_.is("WIDTH")) layer.run_lengths.push_back(um());
    if (layer.run_lengths.empty()) in_.fail("a run length before WIDTH");
    while (in_.take("WIDTH")) {
      SpacingRow row{um(), {}};
      while (!in_.is("WIDTH") && !in_.is(";")) row.spacing.push_back(um());
      if (row.spacing.size() != layer.run_lengths.size()) in_.fail("one spacing a run length");
      layer.spacing_table.push_back(std::move(row));
    }
    in_.expect(";");
    layer.spacing = layer.spacing_table.front().spacing.front();
  }

  /// A number, or PWL ( ( area ratio ) ... ).
  std::vector<std::pair<double, double>> area_ratios() {
    std::vector<std::pair<double, double>> points;
    if (in_.take("PWL")) {
      in_.expect("(");
      while (in_.take("(")) {
        const double area = in_.number();
        points.emplace_back(area, in_.number());
        in_.expect(")");
      }
      in_.expect(")");
    } else {
      points.emplace_back(0.0, in_.number());
    }
    in_.skip_statement();
    return points;
  }

  void layer() {
    const Tokens at = in_;
    Layer layer;
    layer.name = in_.next();
    while (!in_.take("END")) {
      if (in_.take("TYPE")) {
        layer.kind = one_of(kLayerKinds);
        in_.skip_statement();
      } else if (in_.take("DIRECTION")) {
        layer.direction = one_of(kAxes);
        in_.skip_statement();
      } else if (in_.take("PITCH")) {
        layer.pitch = um_above_0();
        in_.skip_statement();
      } else if (in_.take("OFFSET")) {
        layer.offset = um();
        in_.skip_statement();
      } else if (in_.take("WIDTH")) {
        layer.width = um_above_0();
        in_.skip_statement();
      } else if (in_.take("AREA")) {
        layer.area_nm2 = std::llround(in_.number_from_0() * kNmPerUm * kNmPerUm);
        in_.skip_statement();
      } else if (in_.take("SPACING")) {
        const Nm spacing = um();
        // a spacing with a condition (ADJACENTCUTS, RANGE, ...) isn't the least one
        if (in_.is(";") && layer.spacing == 0) layer.spacing = spacing;
        in_.skip_statement();
      } else if (in_.take("SPACINGTABLE")) {
        spacing_table(layer);
      } else if (in_.take("RESISTANCE")) {
        in_.take("RPERSQ");
        layer.resistance_ohm = in_.number();
        in_.skip_statement();
      } else if (in_.take("CAPACITANCE")) {
        in_.take("CPERSQDIST");
        layer.area_cap_pf_um2 = in_.number();
        in_.skip_statement();
      } else if (in_.take("EDGECAPACITANCE")) {
        layer.edge_cap_pf_um = in_.number();
        in_.skip_statement();
      } else if (in_.is("ANTENNAAREARATIO") || in_.is("ANTENNACUMAREARATIO")) {
        layer.antenna.is_cumulative = in_.is("ANTENNACUMAREARATIO");
        in_.next();
        layer.antenna.ratio = in_.number();
        in_.skip_statement();
      } else if (in_.take("ANTENNADIFFAREARATIO") || in_.take("ANTENNACUMDIFFAREARATIO")) {
        layer.antenna.with_diffusion = area_ratios();
      } else {
        in_.skip_statement();
      }
    }
    in_.expect(layer.name);
    if (!is_first(technology_.layers, technology_.find_layer(layer.name), layer, at)) return;
    if (technology_.layers.size() == kMostLayers) in_.fail(fmt::format("at most {} layers", kMostLayers));
    technology_.layers.push_back(std::move(layer));
  }

  void via() {
    const Tokens at = in_;
    Via via;
    via.name = in_.next();
    via.is_default = in_.take("DEFAULT");
    int layer = -1;
    while (!in_.take("END")) {
      if (in_.take("LAYER")) {
        layer = layer_index();
        in_.expect(";");
      } else if (in_.take("RECT")) {
        if (layer < 0) in_.fail("LAYER before RECT");
        via.shapes.push_back({layer, rect()});
      } else {
        in_.skip_statement();
      }
    }
    in_.expect(via.name);
    if (via.shapes.empty()) return;  // made by a rule
    if (is_first(technology_.vias, technology_.find_via(via.name), via, at))
      technology_.vias.push_back(std::move(via));
  }

  void via_rule() {
    const Tokens at = in_;
    ViaRule rule;
    rule.name = in_.next();
    in_.take("GENERATE");
    in_.take("DEFAULT");
    std::vector<ViaRuleLayer> metals;
    bool has_cut = false;
    ViaRuleLayer current;
    int layer = -1;
    const auto is_routing = [&](int l) { return technology_.layers[l].kind == LayerKind::routing; };
    const auto close_metal = [&] {
      if (layer >= 0 && is_routing(layer))
        metals.push_back({layer, current.enclosure_x, current.enclosure_y});
    };
    Axis direction = Axis::horizontal;
    while (!in_.take("END")) {
      if (in_.take("LAYER")) {
        close_metal();
        layer = layer_index();
        current = {};
        in_.expect(";");
      } else if (in_.take("DIRECTION")) {
        direction = one_of(kAxes);
        in_.skip_statement();
      } else if (in_.take("ENCLOSURE")) {
        current.enclosure_x = um();
        current.enclosure_y = um();
        in_.skip_statement();
      } else if (in_.take("OVERHANG")) {  // LEF 5.4: along the wire
        (direction == Axis::horizontal ? current.enclosure_x : current.enclosure_y) = um();
        in_.skip_statement();
      } else if (in_.take("METALOVERHANG")) {  // LEF 5.4: across the wire
        (direction == Axis::horizontal ? current.enclosure_y : current.enclosure_x) = um();
        in_.skip_statement();
      } else if (in_.take("RECT")) {
        if (layer < 0) in_.fail("LAYER before RECT");
        rule.cut_layer = layer;
        rule.cut = rect();
        if (rule.cut.width() == 0 || rule.cut.height() == 0) in_.fail("a cut with an area before it");
        has_cut = true;
      } else if (in_.take("SPACING")) {
        rule.pitch_x = um();
        in_.expect("BY");
        rule.pitch_y = um();
        in_.skip_statement();
      } else {
        in_.skip_statement();
      }
    }
    close_metal();
    in_.expect(rule.name);
    if (!has_cut || metals.size() != 2) return;  // turns of LEF 5.4, which need no rule
    rule.bottom = metals[metals[0].layer < metals[1].layer ? 0 : 1];
    rule.top = metals[metals[0].layer < metals[1].layer ? 1 : 0];
    if (is_first(technology_.via_rules, index_by_name(technology_.via_rules, rule.name), rule, at))
      technology_.via_rules.push_back(std::move(rule));
  }

  void site() {
    const Tokens at = in_;
    Site site;
    site.name = in_.next();
    while (!in_.take("END")) {
      if (in_.take("SIZE")) {
        site.width = um_above_0();
        in_.expect("BY");
        site.height = um_above_0();
      }
      in_.skip_statement();
    }
    if (site.width == 0) in_.fail("SIZE of the site before its end");
    in_.expect(site.name);
    if (is_first(technology_.sites, index_by_name(technology_.sites, site.name), site, at))
      technology_.sites.push_back(std::move(site));
  }

  struct PlacedRect {
    Tokens at;
    Rect rect;
  };

  /// Shapes up to END; POLYGON and PATH would leave metal unseen, so they are an error.
  void shapes(std::vector<Shape>& into, Point origin, std::vector<PlacedRect>* places = nullptr) {
    int layer = -1;
    while (!in_.take("END")) {
      if (in_.take("LAYER")) {
        layer = layer_index();
        in_.skip_statement();
      } else if (in_.take("RECT")) {
        if (layer < 0) in_.fail("LAYER before RECT");
        const Tokens at = in_;
        into.push_back({layer, rect().moved(origin)});
        if (places != nullptr) places->push_back({at, into.back().rect});
      } else if (in_.is("POLYGON") || in_.is("PATH") || in_.is("VIA")) {
        in_.fail("RECT, the only shape that is read");
      } else {
        in_.skip_statement();
      }
    }
  }

  void pin(Macro& macro, Point origin, std::vector<PlacedRect>& metal) {
    if (macro.find_pin(in_.peek()) >= 0) in_.fail("each pin once");
    MacroPin pin;
    pin.name = in_.next();
    std::vector<PlacedRect> places;
    while (!in_.take("END")) {
      if (in_.take("DIRECTION")) {
        pin.direction = one_of(kPinDirections);
        in_.skip_statement();
      } else if (in_.take("USE")) {
        pin.use = one_of(kUses);
        in_.skip_statement();
      } else if (in_.take("ANTENNAGATEAREA")) {
        pin.gate_area_um2 = in_.number();
        in_.skip_statement();
      } else if (in_.take("ANTENNADIFFAREA")) {
        pin.diffusion_area_um2 = in_.number();
        in_.skip_statement();
      } else if (in_.take("PORT")) {
        shapes(pin.shapes, origin, &places);
      } else {
        in_.skip_statement();
      }
    }
    in_.expect(pin.name);
    // rails reach beyond the cell, as two rows share them
    if (pin.use != Use::power && pin.use != Use::ground)
      metal.insert(metal.end(), places.begin(), places.end());
    macro.pins.push_back(std::move(pin));
  }

  void macro() {
    const Tokens at = in_;
    Macro macro;
    macro.name = in_.next();
    Point origin;
    std::vector<PlacedRect> metal;  // of pins of signals
    while (!in_.take("END")) {
      if (in_.take("CLASS")) {
        while (!in_.is(";"))
          macro.macro_class += (macro.macro_class.empty() ? "" : " ") + std::string(in_.next());
        in_.skip_statement();
      } else if (in_.take("ORIGIN")) {
        origin.x = um();
        origin.y = um();
        in_.skip_statement();
      } else if (in_.take("SIZE")) {
        macro.width = um_above_0();
        in_.expect("BY");
        macro.height = um_above_0();
        in_.skip_statement();
      } else if (in_.take("SYMMETRY")) {
        while (!in_.is(";")) {
          macro.symmetric_x = macro.symmetric_x || in_.is("X");
          macro.symmetric_y = macro.symmetric_y || in_.is("Y");
          in_.next();
        }
        in_.skip_statement();
      } else if (in_.take("SITE")) {
        macro.site = in_.next();
        in_.skip_statement();
      } else if (in_.take("PIN")) {
        pin(macro, origin, metal);
      } else if (in_.take("OBS")) {
        shapes(macro.obstructions, origin);
      } else {
        in_.skip_statement();
      }
    }
    if (macro.width == 0) in_.fail("SIZE of the macro before its end");
    in_.expect(macro.name);
    for (const PlacedRect& shape : metal)
      if (!Rect{0, 0, macro.width, macro.height}.contains(shape.rect))
        shape.at.fail(fmt::format("a RECT of a signal's pin within the SIZE of MACRO {}", shown(macro.name)));
    if (!is_first(technology_.macros, technology_.find_macro(macro.name), macro, at)) return;
    technology_.macro_index[macro.name] = static_cast<int>(technology_.macros.size());
    technology_.macros.push_back(std::move(macro));
  }

  Tokens in_;
  Technology& technology_;
};

}  // namespace

Nm Layer::spacing_for(Nm width_nm, Nm run_nm) const {
  Nm wanted = spacing;
  for (const SpacingRow& row : spacing_table) {
    if (width_nm < row.width) break;
    for (std::size_t i = 0; i < run_lengths.size() && run_nm >= run_lengths[i]; ++i)
      wanted = std::max(wanted, row.spacing[i]);
  }
  return wanted;
}

double AntennaRule::limit(double diffusion_um2) const {
  if (diffusion_um2 <= 0.0 || with_diffusion.empty()) return ratio;
  if (diffusion_um2 <= with_diffusion.front().first) return with_diffusion.front().second;
  for (std::size_t i = 1; i < with_diffusion.size(); ++i) {
    const auto [x0, y0] = with_diffusion[i - 1];
    const auto [x1, y1] = with_diffusion[i];
    if (diffusion_um2 <= x1) return y0 + (y1 - y0) * (diffusion_um2 - x0) / (x1 - x0);
  }
  return with_diffusion.back().second;
}

int Macro::find_pin(std::string_view pin) const { return index_by_name(pins, pin); }
int Technology::find_layer(std::string_view name) const { return index_by_name(layers, name); }
int Technology::find_via(std::string_view name) const { return index_by_name(vias, name); }

int Technology::find_macro(std::string_view name) const {
  const auto found = macro_index.find(std::string(name));
  return found == macro_index.end() ? -1 : found->second;
}

std::vector<int> Technology::routing_layers() const {
  std::vector<int> found;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    if (layers[i].kind == LayerKind::routing) found.push_back(static_cast<int>(i));
  }
  return found;
}

Technology read_lef(const std::vector<std::filesystem::path>& files) {
  Technology technology;
  for (const auto& file : files) parse_lef(read_file(file, "a LEF file"), file.string(), technology);
  return technology;
}

void parse_lef(std::string_view text, const std::string& name, Technology& technology) {
  technology.files += (technology.files.empty() ? "" : ", ") + name;
  LefReader(text, name, technology).read();
}

}  // namespace meltstage::layout
