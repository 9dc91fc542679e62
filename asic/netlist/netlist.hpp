// SPDX-License-Identifier: Apache-2.0
// A flat netlist of library cells, as tests and scan insertion work on it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

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
  /// By type and pin, where the file says it: whether it is an output. require_directions() compares them.
  std::map<std::string, std::map<std::string, bool>> is_output;
  Net next_net = 2;  ///< first number that is free
  std::map<Net, std::string> net_names;
  /// The shortest of the names that stand inside a module of the flattened design ("u_guard.wd_q[3]").
  std::map<Net, std::string> register_names;
  /// By each such name, constants too.
  std::map<std::string, Net> nets_in_modules;
};

/// Reads the only, or top, module of a Yosys JSON file (write_json). Throws UserError.
Netlist read_yosys_json(const std::filesystem::path& path);
/// The same from text; `name` stands in messages.
Netlist parse_yosys_json(std::string_view text, const std::string& name);
/// Throws UserError when the file gives a pin another direction than the library.
void require_directions(const Netlist& netlist, const CellLibrary& library);
/// Structural Verilog of the netlist.
std::string verilog_text(const Netlist& netlist);
/// Yosys JSON of the netlist.
std::string yosys_json_text(const Netlist& netlist);

}  // namespace meltstage::dft
