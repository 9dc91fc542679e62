// SPDX-License-Identifier: Apache-2.0
// A flat netlist as Yosys writes it (write_json), read as it stands: what dft and layout make of it is
// theirs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace meltstage::yosys {

/// A bit of a wire: the number of a net from 2 on, or a constant.
using Bit = std::int32_t;
inline constexpr Bit kZero = 0;
inline constexpr Bit kOne = 1;
inline constexpr Bit kUnknown = -1;  ///< "x" or "z"
inline constexpr Bit kMostNets = 100'000'000;

struct Wire {
  std::vector<Bit> bits;  ///< bit 0 first
  int offset = 0;         ///< the lowest index in the source
  bool rises = false;     ///< declared as [0:3]: bit 0 has the highest index

  std::int64_t index(std::size_t bit) const {
    return offset + static_cast<std::int64_t>(rises ? bits.size() - 1 - bit : bit);
  }
};

struct Port : Wire {
  bool is_input = true;
};

struct NetName : Wire {
  bool is_hidden = false;  ///< Yosys made it up
};

struct Cell {
  std::string type;
  std::map<std::string, Bit> pins;  ///< those that are connected, by name
};

/// What port_directions say, "input", "output" or "inout", by pin.
using Directions = std::map<std::string, std::string>;

struct Module {
  std::string name;
  std::map<std::string, Port> ports;
  std::map<std::string, Cell> cells;
  std::map<std::string, NetName> net_names;
  std::map<std::string, Directions> directions;  ///< by type of cell, of the types whose cells say them
};

/// The module marked as the top, or the only one that is no black box. Throws UserError: FILE:LINE:COLUMN,
/// what was found and what is expected, also for two such modules, a key that an object has twice, a port
/// that is neither input nor output and a pin of several bits.
Module read_top_module(const std::filesystem::path& path);
Module parse_top_module(std::string_view text, const std::string& file);

/// A name as JSON writes it.
std::string quoted(const std::string& name);

}  // namespace meltstage::yosys
