// SPDX-License-Identifier: Apache-2.0
// Where the nets of a netlist come from.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "asic/netlist/liberty.hpp"
#include "asic/netlist/netlist.hpp"

namespace meltstage::dft {

class Drivers {
 public:
  Drivers(const Netlist& netlist, const CellLibrary& library);
  bool is_driven(Net net) const;
  /// Instance that drives a net; nothing for ports and constants.
  std::optional<std::size_t> driver_of(Net net) const;
  /// The input port that drives a net straight; "" when none does.
  std::string port_at(Net net) const;
  /// The input port that drives a net straight or through buffers, inverters and clock gates; "" when logic
  /// does. `inverted` tells the sense.
  std::string port_of(Net net, bool* inverted = nullptr) const;

 private:
  const Netlist& netlist_;
  const CellLibrary& library_;
  std::unordered_map<Net, std::string> port_;
  std::unordered_map<Net, std::size_t> driver_;
};

/// The input port that alone decides a net in test mode, with the sense of the net: the way of a reset that
/// has its bypass already. "" when there is none.
std::string bypass_of(const Netlist& netlist, const CellLibrary& library, const Drivers& drivers, Net net,
                      const std::string& test_mode, bool* inverted);

}  // namespace meltstage::dft
