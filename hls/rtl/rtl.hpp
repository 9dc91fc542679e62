// SPDX-License-Identifier: Apache-2.0
// Hand-written RTL in gates, as Yosys reads it, cut at its flops and its products of two variables.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "hls/graph/aig.hpp"
#include "hls/rtl/netlist.hpp"

namespace meltstage::hls {

struct RtlSources {
  std::vector<std::filesystem::path> files;
  std::vector<std::filesystem::path> include_folders;
  std::string top;
};

/// Files and include folders of a list as simulators take it: a file or +incdir+FOLDER a line, beside the
/// list.
RtlSources read_file_list(const std::filesystem::path& list, const std::string& top);

/// One bit of a flop; literals of Rtl::gates.
struct RtlFlop {
  std::vector<std::string> names;  // NAME or NAME[BIT]: all wires that are its output alone
  std::uint32_t now;
  std::uint32_t next;
  std::uint32_t clock;
  std::uint32_t in_reset;     // reset acts at once, without a clock
  std::uint32_t reset_value;  //
};

/// As Product of aig.hpp, in literals of Rtl::gates.
struct RtlProduct {
  std::vector<std::uint32_t> a;
  std::vector<std::uint32_t> b;
  std::vector<std::uint32_t> result;
};

struct Rtl {
  AigerFile gates;
  std::vector<RtlFlop> flops;
  std::vector<RtlProduct> products;  // each behind those that its operands rest on
  /// Pins, bit by bit. x#NUMBER is an x, or a value that a net without a driver has: it may be any.
  std::map<std::string, std::uint32_t> inputs;
  std::map<std::string, std::uint32_t> outputs;
  Netlist netlist;
  std::string array_note;  // when indices of arrays could not be looked at; else empty
};

/// Throws UserError with what Yosys says when it refuses the files, and what read_netlist() throws.
Rtl read_rtl(const RtlSources& sources);

}  // namespace meltstage::hls
