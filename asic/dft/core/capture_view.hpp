// SPDX-License-Identifier: Apache-2.0
// The circuit that a scan test sees of a netlist.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "asic/dft/core/circuit.hpp"
#include "asic/netlist/liberty.hpp"
#include "asic/netlist/netlist.hpp"

namespace meltstage::dft {

/// A flop of the netlist in the capture view.
struct ScanFlop {
  std::size_t instance = 0;
  std::string name;
  Net clock = 0;
  bool has_reset = false;
  Net reset = 1;  ///< net of the asynchronous reset, when there is one
  bool reset_low = true;
  bool reset_value = false;
};

/// What a scan test sees: every flop is an input (its state) and an output (what it captures).
/// circuit.inputs(): input port bits in port order, then flops; circuit.outputs(): output port bits, then
/// flops.
struct CaptureView {
  Circuit circuit;
  std::vector<std::string> input_ports;   ///< by circuit input
  std::vector<std::string> output_ports;  ///< by circuit output
  std::vector<ScanFlop> flops;
  std::vector<std::int8_t> clock_ports;  ///< by input port: 1 when it clocks flops
  std::unordered_map<Net, Node> node_of_net;
  /// By site of the circuit that lies on a clock's way, the flops that stand still when it is stuck.
  std::unordered_map<std::size_t, std::vector<std::size_t>> stopped;
};

/// Values that ports keep while a test captures (test mode, scan enable, reset): port bit to 0 or 1.
using HeldPorts = std::map<std::string, bool>;

/// Builds the view. Clocks must come straight from a port or through buffers and inverters. Throws UserError
/// that names the cell on an unknown cell, an undriven or twice driven net, a loop, or a held port that
/// doesn't exist.
CaptureView capture_view(const Netlist& netlist, const CellLibrary& library, const HeldPorts& held = {});

/// Whether the input `pin` of `node` is the pin by which this flop of the view is reset.
bool resets_by(const CaptureView& view, std::size_t flop, Node node, std::int32_t pin);

}  // namespace meltstage::dft
