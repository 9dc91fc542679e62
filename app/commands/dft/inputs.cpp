// SPDX-License-Identifier: Apache-2.0
#include "app/commands/dft/inputs.hpp"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>

#include "app/number_range.hpp"
#include "asic/dft/files/chain_file.hpp"
#include "asic/dft/files/formats.hpp"
#include "asic/dft/files/pattern_files.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "asic/signoff/functional_vectors.hpp"
#include "asic/signoff/vectors_files.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "recording/text.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

bool is_recording(const fs::path& path) { return path.extension() == ".mvec"; }

// What a file of patterns holds, whatever its format.
CycleStream read_any(const PatternInput& input, const NetlistInput& of) {
  const fs::path& path = input.patterns;
  if (is_recording(path)) return chip_cycles(recording::read_text(path), {}, nullptr, path.string());
  if (path.extension() == ".wgl") return parse_wgl(read_file(path), path.string());
  if (path.extension() != ".vcd" && path.extension() != ".evcd") return read_stil(path);
  TestTiming timing;
  if (!input.timing.empty())
    timing = {input.timing[0], input.timing[1], input.timing[2], input.timing[3], input.timing[4]};
  Directions directions;
  if (path.extension() == ".vcd") {
    if (is_bench(of.netlist))
      throw UserError(path.string() +
                      ": found a plain VCD with a .bench netlist, expected an extended VCD or STIL");
    if (of.netlist.empty())
      throw UserError(path.string() +
                      ": a plain VCD tells no directions; give --netlist, or an extended VCD");
    for (const Port& port : read_yosys_json(of.netlist).ports) {
      for (std::size_t i = 0; i < port.bits.size(); ++i) directions[port.bit_name(i)] = port.is_input;
    }
  }
  return parse_dump(read_file(path), path.string(), timing, directions);
}

// The same; messages about it name the file.
CycleStream read_cycles(const PatternInput& input, const NetlistInput& of) {
  CycleStream stream = read_any(input, of);
  stream.title = input.patterns.string();
  return stream;
}

}  // namespace

void netlist_options_of(CLI::App& sub, NetlistInput& input, const char* kinds) {
  sub.add_option("NETLIST", input.netlist, kinds)->required();
  sub.add_option("--liberty", input.liberty, "Library of its cells (default: Yosys' own gates)");
}

bool is_bench(const fs::path& path) { return path.extension() == ".bench"; }

void require_cells(const std::filesystem::path& path) {
  if (is_bench(path))
    throw UserError(path.string() + ": found .bench, expected a netlist of Yosys' write_json");
}
dft::Netlist read_cells(const std::filesystem::path& path) {
  require_cells(path);
  dft::Netlist netlist = read_yosys_json(path);
  if (netlist.instances.empty())
    throw UserError(path.string() + ": found a top module without a cell, expected a netlist of cells");
  return netlist;
}

dft::CellLibrary library_of(const NetlistInput& input) {
  return input.liberty.empty() ? yosys_library() : read_liberty(input.liberty);
}

void chain_options_of(CLI::App& sub, ChainInput& input) {
  sub.add_option("--chains", input.chains,
                 "Scan chains (default 8) of a netlist without ports scan_i and scan_o")
      ->check(whole_number_from(1, 1024));
  sub.add_option("--reset", input.reset,
                 "Port that resets in test mode (default: the one that resets flops)");
}

ScanOptions scan_of(const ChainInput& input) {
  ScanOptions scan;
  scan.chains = input.chains;
  scan.reset = input.reset;
  return scan;
}

void generation_options_of(CLI::App& sub, GenerationInput& input) {
  chain_options_of(sub, input.scan);
  sub.add_option("--conflicts", input.conflicts,
                 "Give a fault up after so many conflicts of the solver (default, and 0: never)")
      ->check(whole_number_from(0, UINT32_MAX));
  seed_option_of(sub, input.seed, "Seed of random patterns and fills (default 1)");
}

GenerateOptions generation_of(const GenerationInput& input, ProgressLine& line) {
  return {.seed = input.seed, .conflict_limit = input.conflicts, .progress = shown_on(line)};
}

void timing_and_chains_options_of(CLI::App& sub, PatternInput& input) {
  sub.add_option("--timing", input.timing,
                 "Dumps: period, drive, strobe, clock rise, clock fall, ns (default 100,0,40,50,80)")
      ->delimiter(',')
      ->expected(5);
  sub.add_option("--chains", input.chains,
                 "Files without scan chains: where they stand, scan.json of `dft generate` or `scan`, or the "
                 "word netlist: found in it");
}

dft::CycleStream read_patterns(const PatternInput& input, const NetlistInput& of) {
  CycleStream stream = read_cycles(input, of);
  if (input.chains.empty()) return stream;
  if (!stream.chains.empty())
    throw UserError(fmt::format("{}: found {} chains in the file, expected none with --chains; leave it out",
                                input.patterns.string(), stream.chains.size()));
  if (input.chains == "netlist" && of.netlist.empty())
    throw UserError("--netlist: found nothing, expected the netlist to find the chains in");
  attach_chains(stream,
                input.chains == "netlist" ? trace_chains(read_cells(of.netlist), library_of(of))
                                          : read_chain_file(input.chains),
                ScanOptions{}.scan_enable);
  return stream;
}

void keep_inputs(const fs::path& report, const PatternInput& patterns, const NetlistInput& netlist,
                 const std::vector<fs::path>& others) {
  if (report.empty()) return;
  std::vector<fs::path> inputs{netlist.netlist, patterns.patterns, netlist.liberty};
  inputs.insert(inputs.end(), others.begin(), others.end());
  if (patterns.chains != "netlist") inputs.emplace_back(patterns.chains);
  std::erase_if(inputs, [](const fs::path& path) { return path.empty(); });
  require_other_file(report, inputs);
}

void seed_option_of(CLI::App& sub, std::uint64_t& seed, const char* what) {
  sub.add_option("--seed", seed, what)->check(whole_number_from(0, UINT64_MAX));
}

CLI::Validator one_of(std::vector<std::string> words) {
  const std::string known = fmt::format("{}", fmt::join(words, ", "));
  const auto refusal = [=](const std::string& text) {
    if (std::find(words.begin(), words.end(), text) != words.end()) return std::string();
    return fmt::format("found {}, expected one of: {}", text, known);
  };
  return {refusal, "one of: " + known};
}

}  // namespace meltstage::app
