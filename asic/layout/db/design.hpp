// SPDX-License-Identifier: Apache-2.0
// A layout in work: die, rows, tracks, cells, nets and wires; read from a netlist or DEF, written as DEF and
// Verilog.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asic/layout/db/technology.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

/// DEF's names: N as drawn, S turned by 180 degrees, FN mirrored at the y axis, FS mirrored at the x axis.
enum class Orientation { N, S, FN, FS };

struct Component {
  std::string name;
  int macro = 0;  ///< index into Technology::macros
  Point at;       ///< lower left corner as placed
  Orientation orientation = Orientation::N;
  bool is_placed = false;
  bool is_fixed = false;
  Nm padding = 0;  ///< kept free of cells to its right while cells find their sites, whole sites
  Place where{};   ///< in the file that it was read from
};

/// A pin of the die.
struct DiePin {
  std::string name;
  int net = -1;
  PinDirection direction = PinDirection::input;
  Use use = Use::signal;
  bool is_placed = false;
  Shape shape;    ///< where it lies on the die
  Place where{};  ///< in the file that it was read from
};

inline constexpr int kDiePin = -1;

/// A pin that a net connects: pin `pin` of component `component`'s macro, or die pin `pin` when component is
/// kDiePin.
struct PinRef {
  int component = kDiePin;
  int pin = 0;
  friend bool operator==(const PinRef&, const PinRef&) = default;
};

/// A wire of a signal, straight; its metal goes half its width beyond both ends (DEF's default).
struct Wire {
  int layer = 0;
  Point from;
  Point to;
  Nm width = 0;
  Rect metal() const;
};

struct PlacedVia {
  int via = 0;  ///< Technology::vias, then Design::vias
  Point at;
};

struct Net {
  std::string name;
  Use use = Use::signal;
  std::vector<PinRef>
      pins;  ///< of a supply: only pins that aren't supply pins of cells (tied inputs), and die pins
  std::vector<Wire> wires;
  std::vector<PlacedVia> vias;
  std::vector<Shape> patches;  ///< metal added for area rules
  std::vector<Shape> straps;   ///< supplies: rails and stripes
  std::vector<PlacedVia> strap_vias;
  /// Where the file that it was read from gives it wires that aren't a supply's straps.
  std::optional<Place> wiring;
};

struct Row {
  std::string name;
  int site = 0;  ///< index into Technology::sites
  Point at;
  Orientation orientation = Orientation::N;
  int sites = 0;
};

/// Tracks across one axis: `axis` horizontal means wires run in x, at y = start + i * step.
struct Tracks {
  int layer = 0;
  Axis axis = Axis::horizontal;
  Nm start = 0;
  int count = 0;
  Nm step = 0;
};

struct Design {
  std::string name;
  std::string file;  ///< that it was read from, as messages name it
  Rect die;
  std::vector<Row> rows;
  std::vector<Tracks> tracks;
  std::vector<Via> vias;  ///< generated for this design (power)
  std::vector<Component> components;
  std::vector<DiePin> pins;
  std::vector<Net> nets;

  int find_net(std::string_view net) const;  ///< -1: none; a search through all
  const Via& via(const Technology& technology, int index) const;
};

/// A rectangle of the macro's frame where the component puts it on the die.
Rect placed(const Rect& in_macro, const Macro& macro, const Component& component);
/// Its area on the die.
Rect outline(const Component& component, const Technology& technology);
/// All shapes of a pin of a net, on the die.
std::vector<Shape> pin_shapes(const Design& design, const Technology& technology, PinRef pin);
PinDirection pin_direction(const Design& design, const Technology& technology, PinRef pin);

/// The top module of a netlist that Yosys wrote (write_json), cells of the library, one net a pin. A bus' bit
/// i is called name_i, as the proof of equivalence calls it. The first two nets are power and ground, named
/// as the library's supply pins; constants become pins of theirs. Throws UserError.
Design read_netlist(const std::filesystem::path& path, const Technology& technology);
/// Structural Verilog, one port a bit; supplies are constants.
std::string verilog_text(const Design& design, const Technology& technology);

/// Reads DEF 5.6 to 5.8. Throws UserError.
Design read_def(const std::filesystem::path& path, const Technology& technology);
Design parse_def(std::string_view text, const std::string& name, const Technology& technology);
/// DEF 5.8, 1000 units a micrometre.
std::string def_text(const Design& design, const Technology& technology);

}  // namespace meltstage::layout
