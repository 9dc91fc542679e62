// SPDX-License-Identifier: Apache-2.0
// The RTL as Yosys reads it, before it is put into gates: what has no place in the proof is found here, while
// files, lines and names of nets are still known.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>

namespace meltstage::hls {

struct RtlPort {
  bool is_input;
  unsigned width;
  std::string place;  // FILE:LINE
};

struct Netlist {
  std::map<std::string, RtlPort> ports;
  /// Bits of flops by what resets them at once, without a clock; by "" when nothing does.
  std::map<std::string, std::size_t> reset_by;
  std::map<std::string, std::string> flop_places;  // FILE:LINE by name
  /// A flop that more than one pin or flop resets at once, FILE:LINE first; empty when there is none.
  std::string mixed_reset;
};

/// Reads what write_json wrote of one flattened module. Throws UserError by file, line and name for
///  - a flop that is not clocked by clk_i at its rising edge or has no one constant reset value, a latch;
///  - a net of two drivers;
///  - a net without a driver, a z, the clock as data or a loop without a flop, on which a flop or pin
///  depends.
Netlist read_netlist(const std::filesystem::path& json, const std::string& top);

}  // namespace meltstage::hls
