// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/technology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asic/layout/db/tokens.hpp"
#include "base/file.hpp"

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
      } else if (in_.is("UNITS") || in_.is("PROPERTYDEFINITIONS") || in_.is("SPACING") ||
                 in_.is("NONDEFAULTRULE")) {
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
    Layer layer;
    layer.name = in_.next();
    while (!in_.take("END")) {
      if (in_.take("TYPE")) {
        layer.kind = in_.is("ROUTING") ? LayerKind::routing
                     : in_.is("CUT")   ? LayerKind::cut
                                       : LayerKind::other;
        in_.skip_statement();
      } else if (in_.take("DIRECTION")) {
        layer.direction = in_.is("VERTICAL") ? Axis::vertical : Axis::horizontal;
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
    if (technology_.find_layer(layer.name) >= 0) return;  // a second file repeats it
    if (technology_.layers.size() == kMostLayers) in_.fail(fmt::format("at most {} layers", kMostLayers));
    technology_.layers.push_back(std::move(layer));
  }

  void via() {
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
    if (!via.shapes.empty()) technology_.vias.push_back(std::move(via));  // others are made by a rule
  }

  void via_rule() {
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
        direction = in_.is("VERTICAL") ? Axis::vertical : Axis::horizontal;
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
    technology_.via_rules.push_back(std::move(rule));
  }

  void site() {
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
    technology_.sites.push_back(std::move(site));
  }

  /// Shapes up to END; POLYGON and PATH would leave metal unseen, so they are an error.
  void shapes(std::vector<Shape>& into, Point origin) {
    int layer = -1;
    while (!in_.take("END")) {
      if (in_.take("LAYER")) {
        layer = layer_index();
        in_.skip_statement();
      } else if (in_.take("RECT")) {
        if (layer < 0) in_.fail("LAYER before RECT");
        into.push_back({layer, rect().moved(origin)});
      } else if (in_.is("POLYGON") || in_.is("PATH") || in_.is("VIA")) {
        in_.fail("RECT, the only shape that is read");
      } else {
        in_.skip_statement();
      }
    }
  }

  void pin(Macro& macro, Point origin) {
    MacroPin pin;
    pin.name = in_.next();
    while (!in_.take("END")) {
      if (in_.take("DIRECTION")) {
        pin.direction = in_.is("OUTPUT")  ? PinDirection::output
                        : in_.is("INPUT") ? PinDirection::input
                                          : PinDirection::inout;
        in_.skip_statement();
      } else if (in_.take("USE")) {
        pin.use = in_.is("POWER")    ? Use::power
                  : in_.is("GROUND") ? Use::ground
                  : in_.is("CLOCK")  ? Use::clock
                                     : Use::signal;
        in_.skip_statement();
      } else if (in_.take("ANTENNAGATEAREA")) {
        pin.gate_area_um2 = in_.number();
        in_.skip_statement();
      } else if (in_.take("ANTENNADIFFAREA")) {
        pin.diffusion_area_um2 = in_.number();
        in_.skip_statement();
      } else if (in_.take("PORT")) {
        shapes(pin.shapes, origin);
      } else {
        in_.skip_statement();
      }
    }
    in_.expect(pin.name);
    macro.pins.push_back(std::move(pin));
  }

  void macro() {
    Macro macro;
    macro.name = in_.next();
    Point origin;
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
        pin(macro, origin);
      } else if (in_.take("OBS")) {
        shapes(macro.obstructions, origin);
      } else {
        in_.skip_statement();
      }
    }
    if (macro.width == 0) in_.fail("SIZE of the macro before its end");
    in_.expect(macro.name);
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
  LefReader(text, name, technology).read();
}

}  // namespace meltstage::layout
