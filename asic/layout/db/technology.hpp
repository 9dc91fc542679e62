// SPDX-License-Identifier: Apache-2.0
// What placement and routing know of a process and its cells: LEF 5.4 to 5.8, without density rules.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "asic/layout/db/geometry.hpp"

namespace meltstage::layout {

enum class LayerKind { routing, cut, other };
enum class Axis { horizontal, vertical };

/// One row of SPACINGTABLE PARALLELRUNLENGTH: spacing of a wire of this width or more, one value a run
/// length.
struct SpacingRow {
  Nm width = 0;
  std::vector<Nm> spacing;
  friend bool operator==(const SpacingRow&, const SpacingRow&) = default;
};

/// Most area of metal or cuts over the area of the gates that it is connected to while it is etched.
struct AntennaRule {
  double ratio = 0.0;  ///< without diffusion on the way; 0: no rule
  std::vector<std::pair<double, double>>
      with_diffusion;          ///< area of diffusion in um2, ratio: between these straight lines
  bool is_cumulative = false;  ///< ratios of the layers below are added
  double limit(double diffusion_um2) const;
  friend bool operator==(const AntennaRule&, const AntennaRule&) = default;
};

struct Layer {
  std::string name;
  LayerKind kind = LayerKind::other;
  Axis direction = Axis::horizontal;
  Nm pitch = 0;
  Nm offset = 0;
  Nm width = 0;                 ///< routing: of a wire; cut: of a cut (0 when LEF doesn't say)
  Nm spacing = 0;               ///< least spacing of all
  Nm area_nm2 = 0;              ///< least area of a shape, 0: no rule
  std::vector<Nm> run_lengths;  ///< columns of the spacing table
  std::vector<SpacingRow> spacing_table;
  double resistance_ohm = 0.0;   ///< routing: per square; cut: per cut
  double area_cap_pf_um2 = 0.0;  ///< CAPACITANCE CPERSQDIST
  double edge_cap_pf_um = 0.0;   ///< EDGECAPACITANCE
  AntennaRule antenna;

  /// Spacing between two shapes, the wider `width_nm` wide, that run side by side for `run_nm`.
  Nm spacing_for(Nm width_nm, Nm run_nm) const;
  friend bool operator==(const Layer&, const Layer&) = default;
};

/// A rectangle on a layer (index into Technology::layers).
struct Shape {
  int layer = 0;
  Rect rect;
  friend bool operator==(const Shape&, const Shape&) = default;
};

struct Via {
  std::string name;
  bool is_default = false;
  std::vector<Shape> shapes;    ///< around the via's origin; bottom metal, cuts and top metal
  double resistance_ohm = 0.0;  ///< 0: that of its cut layer
  friend bool operator==(const Via&, const Via&) = default;
};

struct ViaRuleLayer {
  int layer = 0;
  Nm enclosure_x = 0;
  Nm enclosure_y = 0;
  friend bool operator==(const ViaRuleLayer&, const ViaRuleLayer&) = default;
};

/// VIARULE ... GENERATE with a cut: arrays of vias between wide wires.
struct ViaRule {
  std::string name;
  ViaRuleLayer bottom;
  ViaRuleLayer top;
  int cut_layer = 0;
  Rect cut;
  Nm pitch_x = 0;  ///< from cut to cut, centre to centre (LEF's SPACING ... BY)
  Nm pitch_y = 0;
  friend bool operator==(const ViaRule&, const ViaRule&) = default;
};

struct Site {
  std::string name;
  Nm width = 0;
  Nm height = 0;
  friend bool operator==(const Site&, const Site&) = default;
};

enum class PinDirection { input, output, inout };
enum class Use { signal, clock, power, ground };
inline bool is_supply(Use use) { return use == Use::power || use == Use::ground; }

struct MacroPin {
  std::string name;
  PinDirection direction = PinDirection::input;
  Use use = Use::signal;
  double gate_area_um2 = 0.0;       ///< ANTENNAGATEAREA
  double diffusion_area_um2 = 0.0;  ///< ANTENNADIFFAREA
  std::vector<Shape> shapes;        ///< in the macro's frame, its lower left corner at 0, 0
  bool is_tristate = false;         ///< an output that another may drive beside
  friend bool operator==(const MacroPin&, const MacroPin&) = default;
};

/// Supply pins are no signals, whatever their direction.
inline bool is_signal_input(const MacroPin& pin) {
  return pin.direction == PinDirection::input && (pin.use == Use::signal || pin.use == Use::clock);
}

struct Macro {
  std::string name;
  std::string macro_class;  ///< "CORE", "CORE SPACER", ...
  Nm width = 0;
  Nm height = 0;
  std::string site;
  bool symmetric_x = false;  ///< may be mirrored at the x axis (FS)
  bool symmetric_y = false;  ///< may be mirrored at the y axis (FN)
  std::vector<MacroPin> pins;
  std::vector<Shape> obstructions;

  /// Index of the pin, -1 when there is none of that name.
  int find_pin(std::string_view pin) const;
  friend bool operator==(const Macro&, const Macro&) = default;
};

struct Technology {
  std::vector<Layer> layers;  ///< bottom first
  std::vector<Via> vias;
  std::vector<ViaRule> via_rules;
  std::vector<Site> sites;
  std::vector<Macro> macros;
  Nm grid = 1;        ///< MANUFACTURINGGRID
  std::string files;  ///< that it was read from, as messages name them

  int find_layer(std::string_view name) const;  ///< -1: none
  int find_via(std::string_view name) const;
  int find_via_rule(std::string_view name) const;
  int find_site(std::string_view name) const;
  int find_macro(std::string_view name) const;
  /// Layers of kind routing, bottom first.
  std::vector<int> routing_layers() const;

  std::unordered_map<std::string, int> macro_index;  ///< filled by read_lef
};

/// Reads LEF files into one technology (layers first: technology, then cells). Throws UserError.
Technology read_lef(const std::vector<std::filesystem::path>& files);
/// The same from text; `name` stands in messages.
void parse_lef(std::string_view text, const std::string& name, Technology& technology);

}  // namespace meltstage::layout
