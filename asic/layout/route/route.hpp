// SPDX-License-Identifier: Apache-2.0
// Wires for a placed design: from the lowest metal (pins) up through all layers with the tracks of the second
// and third.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "asic/layout/db/design.hpp"
#include "asic/layout/route/antenna.hpp"
#include "base/progress.hpp"

namespace meltstage::layout {

struct RouteOptions {
  int rounds = 60;
  Progress progress;
};

/// A wired net as resistances and capacitances; node 0 is where the driver is.
struct NetParasitics {
  struct Resistor {
    int a, b;
    double ohm;
  };
  std::vector<double> node_pf;
  std::vector<Resistor> resistors;
  std::vector<int> node_of_pin;  ///< in the order of Net::pins, -1 for a pin that isn't reached
};

struct RouteReport {
  std::vector<std::string> no_access;    ///< pins without room for a via, "component pin"
  std::vector<std::string> crowded;      ///< components with pins too near to each other
  std::vector<std::string> open;         ///< nets with a pin that isn't reached
  std::vector<std::string> conflicting;  ///< nets that share a place with another
  std::vector<AntennaFault> antenna;     ///< of the wires as they are
  int diodes = 0;                        ///< antenna cells that took the place of fillers
  int nets = 0;
  int rounds = 0;
  Nm wire_nm = 0;
  std::vector<Nm> wire_nm_of_layer;  ///< by index into Technology::layers
  std::size_t vias = 0;
  std::vector<NetParasitics> parasitics;  ///< by index into Design::nets
  bool is_clean() const {
    return no_access.empty() && crowded.empty() && open.empty() && conflicting.empty() && antenna.empty();
  }
};

/// Adds wires, vias and patches to the design's nets, in place of those it has. Where wires break an antenna
/// rule and the library has a cell for it, a diode takes the place of a filler nearby, and what that concerns
/// is routed once more. Throws UserError when a die pin lies on no track or the library's vias don't fit its
/// tracks.
RouteReport route(Design& design, const Technology& technology, const RouteOptions& options);

/// IEEE 1481 (SPEF) of a routed design: a net each as the tree of its wires.
std::string routed_spef_text(const Design& design, const Technology& technology, const RouteReport& report);

}  // namespace meltstage::layout
