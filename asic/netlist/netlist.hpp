// SPDX-License-Identifier: Apache-2.0
// A flat netlist of library cells, as Yosys writes it (write_json), and the circuit that a test sees of it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "asic/dft/core/circuit.hpp"
#include "asic/netlist/liberty.hpp"

namespace meltstage::dft {

/// A wire of one bit, numbered as in the Yosys file; 0 and 1 are the constants.
using Net = std::int32_t;
inline constexpr Net kUnknownNet = -1;  ///< Yosys' "x"; a rule violation where logic reads it

struct Port {
  std::string name;
  bool is_input = true;
  std::vector<Net> bits;  ///< bit 0 first
  /// "name", or "name[i]" when there are several bits.
  std::string bit_name(std::size_t i) const;
};

struct Instance {
  std::string name;
  std::string type;
  std::map<std::string, Net> pins;
};

struct Netlist {
  std::string file;  ///< for messages
  std::string top;
  std::vector<Port> ports;
  std::vector<Instance> instances;
  Net next_net = 2;  ///< first number that is free
  std::map<Net, std::string> net_names;
  /// The shortest of the names that stand inside a module of the flattened design ("u_guard.wd_q[3]").
  std::map<Net, std::string> register_names;
  /// By each such name, constants too.
  std::map<std::string, Net> nets_in_modules;
};

/// Reads the only, or top, module of a Yosys JSON file. Throws UserError.
Netlist read_yosys_json(const std::filesystem::path& path);
/// Structural Verilog of the netlist.
std::string verilog_text(const Netlist& netlist);
/// Yosys JSON of the netlist.
std::string yosys_json_text(const Netlist& netlist);

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
};

/// Values that ports keep while a test captures (test mode, scan enable, reset): port bit to 0 or 1.
using HeldPorts = std::map<std::string, bool>;

/// Builds the view. Clocks must come straight from a port or through buffers and inverters. Throws UserError
/// that names the cell on an unknown cell, an undriven or twice driven net, a loop, or a held port that
/// doesn't exist.
CaptureView capture_view(const Netlist& netlist, const CellLibrary& library, const HeldPorts& held = {});

/// Reads an ISCAS/ITC netlist (.bench); DFFs become inputs and outputs of the circuit. Fault sites are its
/// lines: each gate output or input, and each branch of a line that feeds more than one place. Throws
/// UserError with file and line.
Circuit read_bench(const std::filesystem::path& path);

}  // namespace meltstage::dft
