// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/commands/dft/inputs.hpp"
#include "app/commands/dft/subcommands.hpp"
#include "app/number_range.hpp"
#include "asic/dft/atpg/functional.hpp"
#include "asic/dft/files/formats.hpp"
#include "asic/dft/grade_file.hpp"
#include "asic/dft/scan/masks.hpp"
#include "asic/dft/scan/replay.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "asic/signoff/functional_vectors.hpp"
#include "base/count.hpp"
#include "base/error.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/temporary_folder.hpp"
#include "base/terminal.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct ReplayInput : NetlistInput {
  PatternInput patterns;
  std::string on = "netlist";
  fs::path cells, sdf, readback, report;
  std::uint64_t seed = 1;
  std::uint64_t cycles = 0;  // 0: all
};

constexpr unsigned kPowerUps = 10;  // at random, beside all 0 and all 1

// Every strobe that the file leaves open.
void report_masks(const ReplayInput& input, const CycleStream& stream) {
  const std::vector<dft::MaskedStrobes> masked = masked_strobes(stream, ScanOptions{}.scan_enable);
  const MaskSummary sums = summary(masked);
  const auto outputs = static_cast<std::uint64_t>(std::count_if(
      stream.signals.begin(), stream.signals.end(), [](const TestSignal& s) { return !s.is_input; }));
  write_whole(input.report, mask_text(masked));
  fmt::print("{} of {} strobes masked\n", sums.masked, outputs * cycle_count(stream));
  for (const auto& [reason, strobes] : sums.reasons) fmt::print("{:>12}  {}\n", strobes, reason);
}

int report_replay(std::uint64_t cycles, std::uint64_t strobes, std::uint64_t mismatches,
                  const std::string& first) {
  fmt::print("{} cycles, {} strobes, {} mismatches\n", cycles, strobes, mismatches);
  if (mismatches != 0) fmt::print("first: {}\n", first);
  if (strobes == 0) fmt::print("no strobe: nothing was compared\n");
  return mismatches == 0 && strobes != 0 ? 0 : 1;
}

void tell_outputs_beside(const CycleStream& stream, const CaptureView& view) {
  std::vector<std::string> beside;
  for (const std::string& port : view.output_ports)
    if (std::none_of(stream.signals.begin(), stream.signals.end(),
                     [&](const TestSignal& signal) { return signal.name == port; }))
      beside.push_back(shown(port));
  if (beside.empty()) return;
  fmt::print("note: {} of the netlist {} no signal of the patterns and {} compared, first {}\n",
             counted(beside.size(), "output"), beside.size() == 1 ? "is" : "are",
             beside.size() == 1 ? "isn't" : "aren't", beside.front());
}

// A stream without scan, on whatever it is asked for.
int replay_functional_stream(const ReplayInput& input, const CycleStream& stream) {
  ProgressLine line;
  if (input.on == "netlist") {
    const CaptureView view = view_to_replay(input.netlist, library_of(input));
    tell_outputs_beside(stream, view);
    const ReplayResult result = replay_cycles(view, stream, kPowerUps, input.seed, shown_on(line));
    line.clear();
    return report_replay(result.cycles, result.strobes, result.mismatches, result.first);
  }
  const PinReplay result =
      replay_cycles_on(stream, input.on == "rtl" ? ReplayDevice::rtl : ReplayDevice::model, shown_on(line));
  line.clear();
  return report_replay(result.clocks, result.strobes, result.mismatches, result.first);
}

// What runs in a simulator that takes a while.
void keep_first(CycleStream& stream, std::uint64_t cycles) {
  std::size_t kept = 0;
  for (; kept < stream.cycles.size() && cycles != 0; ++kept) {
    stream.cycles[kept].count = std::min(stream.cycles[kept].count, cycles);
    cycles -= stream.cycles[kept].count;
  }
  stream.cycles.resize(kept);
}

int replay_patterns(const ReplayInput& input) {
  const bool on_chip = input.on == "model" || input.on == "rtl", on_fpga = input.on == "fpga";
  if (!on_fpga && !input.readback.empty())
    throw UserError(
        "--readback: found a file without --on fpga, which reads it; leave it out, or say --on fpga");
  if (!input.cells.empty() && (input.on != "icarus" || input.sdf.empty()))
    throw UserError(
        "--cells: found a file without --on icarus and --sdf, with which it is read; leave it out, or give "
        "both");
  if (on_fpga && input.readback.empty())
    throw UserError("--readback: found nothing, expected the Verilog read back from the bitstream");
  if (!on_chip && !on_fpga && input.netlist.empty())
    throw UserError("--netlist: found nothing, expected the netlist to run on");
  keep_inputs(input.report, input.patterns, input, {input.cells, input.sdf, input.readback});
  CycleStream stream = read_patterns(input.patterns, input);
  require_runnable(stream);
  if (input.cycles != 0) keep_first(stream, input.cycles);
  if (!input.report.empty()) report_masks(input, stream);
  if (on_fpga) {
    const TemporaryFolder folder;
    ProgressLine line;
    const ReplayResult result =
        replay_verilog_in_icarus(input.readback, stream, folder.path(), shown_on(line));
    line.clear();
    return report_replay(result.cycles, result.strobes, result.mismatches, result.first);
  }
  if (stream.chains.empty() && input.on != "icarus") return replay_functional_stream(input, stream);
  if (on_chip)
    throw UserError(fmt::format("{}: found scan patterns for --on {}, expected functional vectors",
                                input.patterns.patterns.string(), input.on));
  const CellLibrary library = library_of(input);
  const Netlist netlist = read_cells(input.netlist);
  name_as_ports(stream, netlist);
  // What the file tells of its cells must be so; it needn't tell any.
  const bool tells_cells = std::any_of(stream.chains.begin(), stream.chains.end(),
                                       [](const ScanChain& chain) { return !chain.cells.empty(); });
  if (tells_cells) require_chains(stream, capture_view(netlist, library), netlist.file);
  ReplayResult result;
  ProgressLine line;
  if (input.on == "icarus") {
    const TemporaryFolder folder;
    result =
        replay_in_icarus(netlist, library, stream, folder.path(), {input.cells, input.sdf}, shown_on(line));
  } else {
    result = replay(capture_view(netlist, library), stream, ScanOptions{}.scan_enable, input.seed, {},
                    shown_on(line));
  }
  line.clear();
  return report_replay(result.cycles, result.strobes, result.mismatches, result.first);
}

}  // namespace

Action add_replay_command(CLI::App& dft) {
  auto input = std::make_shared<ReplayInput>();
  CLI::App* sub =
      dft.add_subcommand("replay", "Run a STIL file on the scanned netlist, or a recording on the chip");
  show_example(sub, "dft replay patterns.stil --netlist scanned.json --liberty cells.lib");
  sub->add_option("PATTERNS", input->patterns.patterns, kPatternKinds)->required();
  sub->add_option("--netlist", input->netlist,
                  "Yosys JSON: of the scanned netlist for STIL, any for recordings");
  sub->add_option("--liberty", input->liberty, "Library of its cells (default: Yosys' own gates)");
  sub->add_option(
         "--on", input->on,
         "netlist (default), icarus; model or rtl for the chip's vectors without scan; fpga for a block's")
      ->check(one_of({"netlist", "icarus", "model", "rtl", "fpga"}));
  sub->add_option("--readback", input->readback,
                  "For --on fpga: Verilog of what was read back from a bitstream (icebox_vlog)");
  sub->add_option("--report", input->report, "File for every strobe that is not made, and why");
  seed_option_of(*sub, input->seed, "Seed of what fills unknowns (default 1)");
  CLI::Option* cells = sub->add_option("--cells", input->cells, "Verilog of the cells with specify blocks");
  sub->add_option("--sdf", input->sdf, "Delays of the netlist's instances, for --on icarus")->needs(cells);
  timing_and_chains_options_of(*sub, input->patterns);
  sub->add_option("--cycles", input->cycles, "Only so many cycles from the first (default: all)")
      ->check(whole_number_from(1, UINT64_MAX));
  return [=] { return replay_patterns(*input); };
}

}  // namespace meltstage::app
