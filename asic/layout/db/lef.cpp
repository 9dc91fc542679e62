// SPDX-License-Identifier: Apache-2.0
// LEF, read.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "asic/layout/db/statements.hpp"
#include "asic/layout/db/technology.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

constexpr double kNmPerUm = 1000.0;
constexpr std::size_t kMostLayers = 1000;

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

constexpr std::array<std::string_view, 6> kMacroClasses{"COVER", "RING", "BLOCK", "PAD", "CORE", "ENDCAP"};

class LefReader;
template <typename Into>
using LefStatement = Statement<LefReader, Into>;
template <typename Into>
using LefBlock = Block<LefReader, Into>;

struct PlacedRect {
  Tokens at;
  Rect rect;
};

/// A pin of a macro while it is read.
struct PinDraft {
  MacroPin pin;
  Point origin;
  std::vector<PlacedRect> metal;
};

struct MacroDraft {
  Macro macro;
  Point origin;
  std::vector<PlacedRect> metal;  // of pins of signals
};

/// Shapes of a PORT or of OBS.
struct ShapesDraft {
  std::vector<Shape>& into;
  Point origin;
  std::vector<PlacedRect>* places;
  int layer = -1;
};

struct ViaDraft {
  Via via;
  bool is_of_a_rule = false;
  int layer = -1;
};

struct ViaRuleDraft {
  ViaRule rule;
  std::vector<ViaRuleLayer> metals;
  bool has_cut = false;
  ViaRuleLayer current;
  int layer = -1;
  Axis direction = Axis::horizontal;
};

class LefReader {
 public:
  LefReader(std::string_view text, const std::string& name, Technology& technology)
      : in_(text, name), technology_(technology) {}

  void read() {
    static constexpr std::array kKnown{
        LefStatement<Technology>{"LAYER", [](LefReader& r, Technology&) { r.layer(); }},
        LefStatement<Technology>{"VIA", [](LefReader& r, Technology&) { r.via(); }},
        LefStatement<Technology>{"VIARULE", [](LefReader& r, Technology&) { r.via_rule(); }},
        LefStatement<Technology>{"SITE", [](LefReader& r, Technology&) { r.site(); }},
        LefStatement<Technology>{"MACRO", [](LefReader& r, Technology&) { r.macro(); }},
        LefStatement<Technology>{"MANUFACTURINGGRID",
                                 [](LefReader& r, Technology& t) { t.grid = r.ended(r.um_above_0()); }},
        LefStatement<Technology>{"UNITS", [](LefReader& r, Technology&) { r.units(); }},
        LefStatement<Technology>{"VERSION", [](LefReader& r, Technology&) { read_version(r.in_); }},
        LefStatement<Technology>{"BUSBITCHARS",
                                 [](LefReader& r, Technology&) { read_bus_bit_characters(r.in_); }},
        LefStatement<Technology>{"NAMESCASESENSITIVE",
                                 [](LefReader& r, Technology&) { read_case_sensitivity(r.in_); }},
        LefStatement<Technology>{"PROPERTYDEFINITIONS",
                                 [](LefReader& r, Technology&) { r.skip_block("PROPERTYDEFINITIONS"); }},
        LefStatement<Technology>{"SPACING", [](LefReader& r, Technology&) { r.skip_block("SPACING"); }},
        LefStatement<Technology>{"NONDEFAULTRULE",
                                 [](LefReader& r, Technology&) { r.skip_block(std::string(r.in_.next())); }},
        LefStatement<Technology>{"ARRAY",
                                 [](LefReader& r, Technology&) { r.skip_block(std::string(r.in_.next())); }},
        LefStatement<Technology>{"NOISETABLE", [](LefReader& r, Technology&) { r.skip_block("NOISETABLE"); }},
        LefStatement<Technology>{"CORRECTIONTABLE",
                                 [](LefReader& r, Technology&) { r.skip_block("CORRECTIONTABLE"); }},
        LefStatement<Technology>{"IRDROP", [](LefReader& r, Technology&) { r.skip_block("IRDROP"); }},
        LefStatement<Technology>{"BEGINEXT", [](LefReader& r, Technology&) { skip_extension(r.in_); }},
    };
    static constexpr std::string_view kSkipped =
        "DIVIDERCHAR USEMINSPACING CLEARANCEMEASURE NOWIREEXTENSIONATPIN FIXEDMASK MAXVIASTACK "
        "MINFEATURE DIELECTRIC UNIVERSALNOISEMARGIN EDGERATETHRESHOLD1 EDGERATETHRESHOLD2 "
        "EDGERATESCALEFACTOR INPUTPINANTENNASIZE OUTPUTPINANTENNASIZE INOUTPINANTENNASIZE "
        "ANTENNAINPUTGATEAREA ANTENNAINOUTDIFFAREA ANTENNAOUTPUTDIFFAREA";
    static constexpr LefBlock<Technology> kBlock("LEF", kKnown, kSkipped);
    while (!in_.at_end()) {
      if (!in_.take("END")) {
        kBlock.next(in_, *this, technology_);
        continue;
      }
      in_.expect("LIBRARY");
      if (!in_.at_end()) in_.fail("the file's end behind END LIBRARY");
    }
  }

 private:
  Nm um() { return in_.length(kNmPerUm); }
  Nm um_from_0() { return in_.length_from_0(kNmPerUm); }
  Nm um_above_0() { return in_.length_above_0(kNmPerUm); }
  /// What was read, with the `;` behind it.
  template <typename Value>
  Value ended(Value value) {
    in_.expect(";");
    return value;
  }
  /// For both axes: two lengths have to be the same.
  Nm of_both_axes(Nm first) {
    if (!in_.is(";")) {
      const Tokens second = in_;
      if (um() != first) second.fail("the length before it again, as both axes have one");
    }
    return ended(first);
  }

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
    static constexpr std::array kKnown{
        LefStatement<Technology>{"DATABASE",
                                 [](LefReader& r, Technology&) {
                                   r.in_.expect("MICRONS");
                                   r.ended(r.in_.count());
                                 }},
    };
    static constexpr std::string_view kSkipped =
        "TIME CAPACITANCE RESISTANCE POWER CURRENT VOLTAGE FREQUENCY";
    static constexpr LefBlock<Technology> kBlock("UNITS", kKnown, kSkipped);
    while (!in_.take("END")) kBlock.next(in_, *this, technology_);
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

  /// The widest of several spacings holds all of them.
  void spacing(Layer& layer) {
    const Nm spacing = um_from_0();
    // a spacing with a condition (ADJACENTCUTS, RANGE, ...) isn't the least one
    if (in_.is(";")) layer.spacing = std::max(layer.spacing, spacing);
    in_.skip_statement();
  }

  void spacing_table(Layer& layer) {
    if (!in_.take("PARALLELRUNLENGTH")) {
      in_.skip_statement();
      return;
    }
    layer.run_lengths.clear();
    layer.spacing_table.clear();
    const auto ascends = [this](const std::vector<Nm>& lengths) {
      const Tokens at = in_;
      const Nm length = um_from_0();
      if (!lengths.empty() && length <= lengths.back()) at.fail("a length above the one before it");
      return length;
    };
    while (!in_.is("WIDTH")) layer.run_lengths.push_back(ascends(layer.run_lengths));
    if (layer.run_lengths.empty()) in_.fail("a run length before WIDTH");
    std::vector<Nm> widths;
    while (in_.take("WIDTH")) {
      widths.push_back(ascends(widths));
      SpacingRow row{widths.back(), {}};
      while (!in_.is("WIDTH") && !in_.is(";")) row.spacing.push_back(um_from_0());
      if (row.spacing.size() != layer.run_lengths.size()) in_.fail("one spacing a run length");
      layer.spacing_table.push_back(std::move(row));
    }
    in_.expect(";");
    layer.spacing = std::max(layer.spacing, layer.spacing_table.front().spacing.front());
  }

  /// A number, or PWL ( ( area ratio ) ... ).
  std::vector<std::pair<double, double>> area_ratios() {
    std::vector<std::pair<double, double>> points;
    if (in_.take("PWL")) {
      in_.expect("(");
      while (in_.take("(")) {
        const double area = in_.number_from_0();
        points.emplace_back(area, in_.number_from_0());
        in_.expect(")");
      }
      in_.expect(")");
    } else {
      points.emplace_back(0.0, in_.number_from_0());
    }
    return ended(std::move(points));
  }

  void antenna_ratio(Layer& layer, bool is_cumulative) {
    if (layer.antenna.ratio > 0.0) in_.fail("one ratio of areas a layer");
    layer.antenna.is_cumulative = is_cumulative;
    layer.antenna.ratio = ended(in_.number_from_0());
  }
  void antenna_model() {
    if (!in_.take("OXIDE1")) in_.fail("OXIDE1, the only oxide whose rules are read");
    in_.expect(";");
  }
  void antenna_factor() {
    const Tokens at = in_;
    if (in_.number() != 1.0) at.fail("1, as areas count as they are");
    in_.skip_statement();
  }

  /// A number, or frequencies, widths and currents, each with a `;` of its own.
  void current_density() {
    in_.next();
    const bool is_table = in_.is("FREQUENCY") || in_.is("WIDTH") || in_.is("CUTAREA");
    while (is_table && !in_.is("TABLEENTRIES")) in_.skip_statement();
    in_.skip_statement();
  }

  void layer() {
    static constexpr std::array kKnown{
        LefStatement<Layer>{"TYPE", [](LefReader& r, Layer& l) { l.kind = r.ended(r.one_of(kLayerKinds)); }},
        LefStatement<Layer>{"DIRECTION",
                            [](LefReader& r, Layer& l) { l.direction = r.ended(r.one_of(kAxes)); }},
        LefStatement<Layer>{"PITCH",
                            [](LefReader& r, Layer& l) { l.pitch = r.of_both_axes(r.um_above_0()); }},
        LefStatement<Layer>{"OFFSET", [](LefReader& r, Layer& l) { l.offset = r.of_both_axes(r.um()); }},
        LefStatement<Layer>{"WIDTH", [](LefReader& r, Layer& l) { l.width = r.ended(r.um_above_0()); }},
        LefStatement<Layer>{"AREA",
                            [](LefReader& r, Layer& l) {
                              l.area_nm2 = std::llround(r.ended(r.in_.number_from_0()) * kNmPerUm * kNmPerUm);
                            }},
        LefStatement<Layer>{"SPACING", [](LefReader& r, Layer& l) { r.spacing(l); }},
        LefStatement<Layer>{"SPACINGTABLE", [](LefReader& r, Layer& l) { r.spacing_table(l); }},
        LefStatement<Layer>{"RESISTANCE",
                            [](LefReader& r, Layer& l) {
                              r.in_.take("RPERSQ");
                              l.resistance_ohm = r.ended(r.in_.number_from_0());
                            }},
        LefStatement<Layer>{"CAPACITANCE",
                            [](LefReader& r, Layer& l) {
                              r.in_.take("CPERSQDIST");
                              l.area_cap_pf_um2 = r.ended(r.in_.number_from_0());
                            }},
        LefStatement<Layer>{
            "EDGECAPACITANCE",
            [](LefReader& r, Layer& l) { l.edge_cap_pf_um = r.ended(r.in_.number_from_0()); }},
        LefStatement<Layer>{"ANTENNAAREARATIO", [](LefReader& r, Layer& l) { r.antenna_ratio(l, false); }},
        LefStatement<Layer>{"ANTENNACUMAREARATIO", [](LefReader& r, Layer& l) { r.antenna_ratio(l, true); }},
        LefStatement<Layer>{"ANTENNADIFFAREARATIO",
                            [](LefReader& r, Layer& l) { l.antenna.with_diffusion = r.area_ratios(); }},
        LefStatement<Layer>{"ANTENNACUMDIFFAREARATIO",
                            [](LefReader& r, Layer& l) { l.antenna.with_diffusion = r.area_ratios(); }},
        LefStatement<Layer>{"ANTENNAMODEL", [](LefReader& r, Layer&) { r.antenna_model(); }},
        LefStatement<Layer>{"ANTENNAAREAFACTOR", [](LefReader& r, Layer&) { r.antenna_factor(); }},
        LefStatement<Layer>{"ACCURRENTDENSITY", [](LefReader& r, Layer&) { r.current_density(); }},
        LefStatement<Layer>{"DCCURRENTDENSITY", [](LefReader& r, Layer&) { r.current_density(); }},
    };
    static constexpr std::string_view kSkipped =
        "ANTENNASIDEAREARATIO ANTENNACUMSIDEAREARATIO ANTENNADIFFSIDEAREARATIO "
        "ANTENNACUMDIFFSIDEAREARATIO ANTENNASIDEAREAFACTOR ANTENNACUMROUTINGPLUSCUT "
        "ANTENNAGATEPLUSDIFF ANTENNAAREAMINUSDIFF ANTENNAAREADIFFREDUCEPWL ANTENNALENGTHFACTOR "
        "ARRAYSPACING CAPMULTIPLIER CURRENTDEN DENSITYCHECKSTEP DENSITYCHECKWINDOW "
        "DIAGMINEDGELENGTH DIAGPITCH DIAGSPACING DIAGWIDTH ENCLOSURE FILLACTIVESPACING HEIGHT "
        "LENGTHTHRESHOLD MASK MAXIMUMDENSITY MAXWIDTH MINENCLOSEDAREA MINIMUMCUT "
        "MINIMUMDENSITY MINSIZE MINSTEP MINWIDTH PREFERENCLOSURE PROPERTY PROTRUSIONWIDTH "
        "SHRINKAGE SLOTLENGTH SLOTWIDTH SLOTWIRELENGTH SLOTWIREWIDTH THICKNESS WIREEXTENSION";
    static constexpr LefBlock<Layer> kBlock("LAYER", kKnown, kSkipped);
    const Tokens at = in_;
    Layer layer;
    layer.name = in_.next();
    bool has_type = false;
    while (!in_.take("END")) {
      has_type = has_type || in_.is("TYPE");
      kBlock.next(in_, *this, layer);
    }
    if (!has_type) in_.fail("TYPE of the layer before its end");
    in_.expect(layer.name);
    if (!is_first(technology_.layers, technology_.find_layer(layer.name), layer, at)) return;
    if (technology_.layers.size() == kMostLayers) in_.fail(fmt::format("at most {} layers", kMostLayers));
    technology_.layers.push_back(std::move(layer));
  }

  void via() {
    static constexpr auto of_a_rule = [](LefReader& r, ViaDraft& d) {
      d.is_of_a_rule = true;
      r.in_.skip_statement();
    };
    static constexpr std::array kKnown{
        LefStatement<ViaDraft>{"LAYER",
                               [](LefReader& r, ViaDraft& d) { d.layer = r.ended(r.layer_index()); }},
        LefStatement<ViaDraft>{"RECT",
                               [](LefReader& r, ViaDraft& d) {
                                 if (d.layer < 0) r.in_.fail("LAYER before RECT");
                                 const Tokens at = r.in_;
                                 const Rect rect = r.rect();
                                 if (rect.width() == 0 || rect.height() == 0) at.fail("a RECT with an area");
                                 d.via.shapes.push_back({d.layer, rect});
                               }},
        LefStatement<ViaDraft>{
            "RESISTANCE",
            [](LefReader& r, ViaDraft& d) { d.via.resistance_ohm = r.ended(r.in_.number_from_0()); }},
        LefStatement<ViaDraft>{"VIARULE", of_a_rule},
        LefStatement<ViaDraft>{"CUTSIZE", of_a_rule},
        LefStatement<ViaDraft>{"LAYERS", of_a_rule},
        LefStatement<ViaDraft>{"CUTSPACING", of_a_rule},
        LefStatement<ViaDraft>{"ENCLOSURE", of_a_rule},
        LefStatement<ViaDraft>{"ROWCOL", of_a_rule},
        LefStatement<ViaDraft>{"ORIGIN", of_a_rule},
        LefStatement<ViaDraft>{"OFFSET", of_a_rule},
        LefStatement<ViaDraft>{"PATTERN", of_a_rule},
    };
    static constexpr std::string_view kSkipped = "FOREIGN PROPERTY";
    static constexpr LefBlock<ViaDraft> kBlock("VIA", kKnown, kSkipped);
    const Tokens at = in_;
    ViaDraft draft;
    Via& via = draft.via;
    via.name = in_.next();
    via.is_default = in_.take("DEFAULT");
    in_.take("TOPOFSTACKONLY");
    in_.take("GENERATED");
    while (!in_.take("END")) {
      if (in_.is("POLYGON")) in_.fail("RECT, the only shape that is read");
      kBlock.next(in_, *this, draft);
    }
    if (via.shapes.empty() && !draft.is_of_a_rule) in_.fail("RECT or VIARULE of the via before its end");
    in_.expect(via.name);
    if (via.shapes.empty()) return;
    std::stable_sort(via.shapes.begin(), via.shapes.end(),
                     [](const Shape& a, const Shape& b) { return a.layer < b.layer; });
    if (is_first(technology_.vias, technology_.find_via(via.name), via, at))
      technology_.vias.push_back(std::move(via));
  }

  void close_metal(ViaRuleDraft& d) const {
    if (d.layer >= 0 && technology_.layers[static_cast<std::size_t>(d.layer)].kind == LayerKind::routing)
      d.metals.push_back({d.layer, d.current.enclosure_x, d.current.enclosure_y});
  }

  void via_rule() {
    static constexpr std::array kKnown{
        LefStatement<ViaRuleDraft>{"LAYER",
                                   [](LefReader& r, ViaRuleDraft& d) {
                                     r.close_metal(d);
                                     d.layer = r.ended(r.layer_index());
                                     d.current = {};
                                   }},
        LefStatement<ViaRuleDraft>{
            "DIRECTION", [](LefReader& r, ViaRuleDraft& d) { d.direction = r.ended(r.one_of(kAxes)); }},
        LefStatement<ViaRuleDraft>{"ENCLOSURE",
                                   [](LefReader& r, ViaRuleDraft& d) {
                                     d.current.enclosure_x = r.um();
                                     d.current.enclosure_y = r.ended(r.um());
                                   }},
        LefStatement<ViaRuleDraft>{"OVERHANG",  // LEF 5.4: along the wire
                                   [](LefReader& r, ViaRuleDraft& d) {
                                     (d.direction == Axis::horizontal ? d.current.enclosure_x
                                                                      : d.current.enclosure_y) =
                                         r.ended(r.um());
                                   }},
        LefStatement<ViaRuleDraft>{"METALOVERHANG",  // LEF 5.4: across the wire
                                   [](LefReader& r, ViaRuleDraft& d) {
                                     (d.direction == Axis::horizontal ? d.current.enclosure_y
                                                                      : d.current.enclosure_x) =
                                         r.ended(r.um());
                                   }},
        LefStatement<ViaRuleDraft>{"RECT",
                                   [](LefReader& r, ViaRuleDraft& d) {
                                     if (d.layer < 0) r.in_.fail("LAYER before RECT");
                                     d.rule.cut_layer = d.layer;
                                     d.rule.cut = r.rect();
                                     if (d.rule.cut.width() == 0 || d.rule.cut.height() == 0)
                                       r.in_.fail("a cut with an area before it");
                                     d.has_cut = true;
                                   }},
        LefStatement<ViaRuleDraft>{"SPACING",
                                   [](LefReader& r, ViaRuleDraft& d) {
                                     d.rule.pitch_x = r.um_above_0();
                                     r.in_.expect("BY");
                                     d.rule.pitch_y = r.ended(r.um_above_0());
                                   }},
    };
    static constexpr std::string_view kSkipped = "WIDTH RESISTANCE VIA PROPERTY";
    static constexpr LefBlock<ViaRuleDraft> kBlock("VIARULE", kKnown, kSkipped);
    const Tokens at = in_;
    ViaRuleDraft draft;
    ViaRule& rule = draft.rule;
    rule.name = in_.next();
    in_.take("GENERATE");
    in_.take("DEFAULT");
    while (!in_.take("END")) kBlock.next(in_, *this, draft);
    close_metal(draft);
    in_.expect(rule.name);
    const std::vector<ViaRuleLayer>& metals = draft.metals;
    if (!draft.has_cut || metals.size() != 2) return;  // turns of LEF 5.4, which need no rule
    rule.bottom = metals[metals[0].layer < metals[1].layer ? 0 : 1];
    rule.top = metals[metals[0].layer < metals[1].layer ? 1 : 0];
    if (is_first(technology_.via_rules, technology_.find_via_rule(rule.name), rule, at))
      technology_.via_rules.push_back(std::move(rule));
  }

  void site() {
    static constexpr std::array kKnown{
        LefStatement<Site>{"SIZE",
                           [](LefReader& r, Site& s) {
                             s.width = r.um_above_0();
                             r.in_.expect("BY");
                             s.height = r.ended(r.um_above_0());
                           }},
    };
    static constexpr std::string_view kSkipped = "CLASS SYMMETRY ROWPATTERN";
    static constexpr LefBlock<Site> kBlock("SITE", kKnown, kSkipped);
    const Tokens at = in_;
    Site site;
    site.name = in_.next();
    while (!in_.take("END")) kBlock.next(in_, *this, site);
    if (site.width == 0) in_.fail("SIZE of the site before its end");
    in_.expect(site.name);
    if (is_first(technology_.sites, technology_.find_site(site.name), site, at))
      technology_.sites.push_back(std::move(site));
  }

  /// Shapes up to END; POLYGON and PATH would leave metal unseen, so they are an error.
  void shapes(ShapesDraft draft, std::string_view block) {
    static constexpr std::array kKnown{
        LefStatement<ShapesDraft>{"LAYER",
                                  [](LefReader& r, ShapesDraft& d) {
                                    d.layer = r.layer_index();
                                    r.in_.take("EXCEPTPGNET");
                                    if (r.in_.is("SPACING") || r.in_.is("DESIGNRULEWIDTH"))
                                      r.in_.fail("no spacing but the layer's, which alone is kept");
                                    r.in_.expect(";");
                                  }},
        LefStatement<ShapesDraft>{"RECT",
                                  [](LefReader& r, ShapesDraft& d) {
                                    if (d.layer < 0) r.in_.fail("LAYER before RECT");
                                    const Tokens at = r.in_;
                                    d.into.push_back({d.layer, r.rect().moved(d.origin)});
                                    if (d.places != nullptr) d.places->push_back({at, d.into.back().rect});
                                  }},
    };
    static constexpr std::string_view kSkipped = "CLASS WIDTH PROPERTY";
    const LefBlock<ShapesDraft> shapes_block(block, kKnown, kSkipped);
    while (!in_.take("END")) {
      if (in_.is("POLYGON") || in_.is("PATH") || in_.is("VIA")) in_.fail("RECT, the only shape that is read");
      shapes_block.next(in_, *this, draft);
    }
  }

  /// An area, with the layer that it is on.
  double antenna_area() {
    const double area = in_.number_from_0();
    if (in_.take("LAYER")) layer_index();
    return ended(area);
  }

  void pin(MacroDraft& macro) {
    static constexpr std::array kKnown{
        LefStatement<PinDraft>{"DIRECTION",
                               [](LefReader& r, PinDraft& d) {
                                 d.pin.direction = r.one_of(kPinDirections);
                                 d.pin.is_tristate = r.in_.take("TRISTATE");
                                 r.in_.expect(";");
                               }},
        LefStatement<PinDraft>{"USE",
                               [](LefReader& r, PinDraft& d) { d.pin.use = r.ended(r.one_of(kUses)); }},
        LefStatement<PinDraft>{"ANTENNAGATEAREA",
                               [](LefReader& r, PinDraft& d) { d.pin.gate_area_um2 = r.antenna_area(); }},
        LefStatement<PinDraft>{
            "ANTENNADIFFAREA",
            [](LefReader& r, PinDraft& d) { d.pin.diffusion_area_um2 = r.antenna_area(); }},
        LefStatement<PinDraft>{"ANTENNAMODEL", [](LefReader& r, PinDraft&) { r.antenna_model(); }},
        LefStatement<PinDraft>{"PORT",
                               [](LefReader& r, PinDraft& d) {
                                 r.shapes({d.pin.shapes, d.origin, &d.metal}, "PORT");
                               }},
    };
    static constexpr std::string_view kSkipped =
        "ANTENNAMAXAREACAR ANTENNAMAXSIDEAREACAR ANTENNAMAXCUTCAR ANTENNAPARTIALMETALAREA "
        "ANTENNAPARTIALMETALSIDEAREA ANTENNAPARTIALCUTAREA ANTENNASIZE ANTENNAMETALAREA "
        "ANTENNAMETALLENGTH CAPACITANCE CURRENTSOURCE FALLSATCUR FALLTHRESH FOREIGN "
        "GROUNDSENSITIVITY INPUTNOISEMARGIN IV_TABLES LEAKAGE LEQ MAXDELAY MAXLOAD MUSTJOIN "
        "NETEXPR OUTPUTNOISEMARGIN OUTPUTRESISTANCE POWER PROPERTY PULLDOWNRES RESISTANCE "
        "RISESATCUR RISETHRESH SCANUSE SHAPE SUPPLYSENSITIVITY TAPERRULE TIEOFFR VHI VLO";
    static constexpr LefBlock<PinDraft> kBlock("PIN", kKnown, kSkipped);
    if (macro.macro.find_pin(in_.peek()) >= 0) in_.fail("each pin once");
    PinDraft draft{{}, macro.origin, {}};
    draft.pin.name = in_.next();
    while (!in_.take("END")) kBlock.next(in_, *this, draft);
    // a pad's supplies may come by its neighbours alone
    if (draft.pin.shapes.empty() && !is_supply(draft.pin.use))
      in_.fail("a PORT with a RECT of the signal's pin before its end");
    in_.expect(draft.pin.name);
    // rails reach beyond the cell, as two rows share them
    if (!is_supply(draft.pin.use))
      macro.metal.insert(macro.metal.end(), draft.metal.begin(), draft.metal.end());
    macro.macro.pins.push_back(std::move(draft.pin));
  }

  void macro_class(Macro& macro) {
    if (std::none_of(kMacroClasses.begin(), kMacroClasses.end(), [this](auto name) { return in_.is(name); }))
      in_.fail("COVER, RING, BLOCK, PAD, CORE or ENDCAP");
    macro.macro_class.clear();
    while (!in_.is(";")) {
      if (in_.is("END") || in_.starts_line()) in_.fail("; before it");
      macro.macro_class += (macro.macro_class.empty() ? "" : " ") + std::string(in_.next());
    }
    in_.expect(";");
  }

  void symmetry(Macro& macro) {
    while (!in_.take(";")) {
      macro.symmetric_x = macro.symmetric_x || in_.is("X");
      macro.symmetric_y = macro.symmetric_y || in_.is("Y");
      if (!in_.take("X") && !in_.take("Y") && !in_.take("R90")) in_.fail("X, Y, R90 or ;");
    }
  }

  void origin(MacroDraft& draft) {
    // pins before it would lie elsewhere
    if (!draft.macro.pins.empty() || !draft.macro.obstructions.empty()) in_.fail("ORIGIN before PIN and OBS");
    draft.origin.x = um();
    draft.origin.y = ended(um());
  }

  void site_of(Macro& macro) {
    if (technology_.find_site(in_.peek()) < 0) in_.fail("a SITE that was described before");
    macro.site = in_.next();
    in_.skip_statement();
  }

  void macro() {
    static constexpr std::array kKnown{
        LefStatement<MacroDraft>{"CLASS", [](LefReader& r, MacroDraft& d) { r.macro_class(d.macro); }},
        LefStatement<MacroDraft>{"ORIGIN", [](LefReader& r, MacroDraft& d) { r.origin(d); }},
        LefStatement<MacroDraft>{"SIZE",
                                 [](LefReader& r, MacroDraft& d) {
                                   d.macro.width = r.um_above_0();
                                   r.in_.expect("BY");
                                   d.macro.height = r.ended(r.um_above_0());
                                 }},
        LefStatement<MacroDraft>{"SYMMETRY", [](LefReader& r, MacroDraft& d) { r.symmetry(d.macro); }},
        LefStatement<MacroDraft>{"SITE", [](LefReader& r, MacroDraft& d) { r.site_of(d.macro); }},
        LefStatement<MacroDraft>{"PIN", [](LefReader& r, MacroDraft& d) { r.pin(d); }},
        LefStatement<MacroDraft>{"OBS",
                                 [](LefReader& r, MacroDraft& d) {
                                   r.shapes({d.macro.obstructions, d.origin, nullptr}, "OBS");
                                 }},
        LefStatement<MacroDraft>{"TIMING", [](LefReader& r, MacroDraft&) { r.skip_block("TIMING"); }},
        LefStatement<MacroDraft>{"DENSITY",
                                 [](LefReader& r, MacroDraft&) {
                                   while (!r.in_.take("END")) r.in_.skip_statement();
                                 }},
        LefStatement<MacroDraft>{"BEGINEXT", [](LefReader& r, MacroDraft&) { skip_extension(r.in_); }},
    };
    static constexpr std::string_view kSkipped =
        "EEQ FIXEDMASK FOREIGN FUNCTION GENERATE GENERATED LEQ POWER PROPERTY SOURCE";
    static constexpr LefBlock<MacroDraft> kBlock("MACRO", kKnown, kSkipped);
    const Tokens at = in_;
    MacroDraft draft;
    Macro& macro = draft.macro;
    macro.name = in_.next();
    while (!in_.take("END")) kBlock.next(in_, *this, draft);
    if (macro.width == 0) in_.fail("SIZE of the macro before its end");
    in_.expect(macro.name);
    for (const PlacedRect& shape : draft.metal)
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
