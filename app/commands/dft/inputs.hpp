// SPDX-License-Identifier: Apache-2.0
// What subcommands of `dft` read, and the options that name it.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "asic/dft/atpg/generate.hpp"
#include "asic/dft/core/cycles.hpp"
#include "asic/dft/scan/scan.hpp"
#include "asic/netlist/liberty.hpp"
#include "asic/netlist/netlist.hpp"
#include "base/terminal.hpp"

namespace meltstage::app {

inline constexpr const char* kCells = "Yosys JSON (flat, mapped)";
inline constexpr const char* kCellsOrBench = "Yosys JSON (flat, mapped) or .bench";

struct NetlistInput {
  std::filesystem::path netlist, liberty;
};
void netlist_options_of(CLI::App& sub, NetlistInput& input, const char* kinds);
bool is_bench(const std::filesystem::path& path);
/// What has cells and pins; a .bench netlist has neither. Throws UserError.
void require_cells(const std::filesystem::path& path);
dft::Netlist read_cells(const std::filesystem::path& path);
dft::CellLibrary library_of(const NetlistInput& input);

struct ChainInput {
  std::size_t chains = 8;
  std::string reset;
};
void chain_options_of(CLI::App& sub, ChainInput& input);
dft::ScanOptions scan_of(const ChainInput& input);

struct GenerationInput {
  ChainInput scan;
  std::uint32_t conflicts = 0;
  std::uint64_t seed = 1;
};
void generation_options_of(CLI::App& sub, GenerationInput& input);
dft::GenerateOptions generation_of(const GenerationInput& input, ProgressLine& line);

struct PatternInput {
  std::filesystem::path patterns;
  std::string chains;          // where those of a file without any stand
  std::vector<double> timing;  // of a dump: period, drive, strobe, clock rise and fall; ns
};
inline constexpr const char* kPatternKinds =
    "STIL, WGL (.wgl), dump (.vcd, .evcd), or recording of the chip's pins (.mvec)";
void timing_and_chains_options_of(CLI::App& sub, PatternInput& input);
/// What a file of patterns holds, whatever its format, with chains from elsewhere where they are asked for.
/// Throws UserError.
dft::CycleStream read_patterns(const PatternInput& input, const NetlistInput& of);
/// A report takes the place of nothing that is read. Paths may be empty.
void keep_inputs(const std::filesystem::path& report, const PatternInput& patterns,
                 const NetlistInput& netlist, const std::vector<std::filesystem::path>& others);

void seed_option_of(CLI::App& sub, std::uint64_t& seed, const char* what);
CLI::Validator one_of(std::vector<std::string> words);

}  // namespace meltstage::app
