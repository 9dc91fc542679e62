// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/commands/dft/inputs.hpp"
#include "app/commands/dft/outputs.hpp"
#include "app/commands/dft/subcommands.hpp"
#include "asic/dft/program.hpp"
#include "asic/signoff/vectors_files.hpp"
#include "base/error.hpp"
#include "base/output_file.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct InsertInput : NetlistInput {
  ChainInput scan;
  fs::path out;
};

// Scan alone.
int insert_chains(const InsertInput& input) {
  const CellLibrary library = library_of(input);
  require_cells(input.netlist);
  require_apart(input.out, {input.netlist, input.liberty});
  require_own(input.out, kScanFiles);
  const TestSubject subject = test_subject(input.netlist, library, scan_of(input.scan));
  if (!subject.is_scanned) throw UserError(input.netlist.string() + ": found no flop, expected some to scan");
  const ScanDesign& design = subject.design;
  std::size_t longest = 0;
  for (const ScanChain& chain : design.chains) longest = std::max(longest, chain.cells.size());
  const OutputClaim claim(input.out, kScanFiles);
  std::map<std::string, std::string> written;
  for (const auto& [name, text] : {std::pair("netlist.json", yosys_json_text(design.netlist)),
                                   std::pair("netlist.v", verilog_text(design.netlist)),
                                   std::pair("scan.json", scan_json(input.netlist, design))}) {
    write_whole(input.out / name, text);
    written[name] = sha256_of(text);
  }
  write_manifest(input.out, input.netlist, written);
  fmt::print("{} flops in {} chains of {} at the most\n", subject.view.flops.size(), design.chains.size(),
             longest);
  return 0;
}

int check_scan_rules(const NetlistInput& input) {
  const std::vector<RuleViolation> violations = check_rules(read_cells(input.netlist), library_of(input));
  for (const RuleViolation& v : violations) fmt::print("{}: {}: {}\n", v.rule, v.offender, v.text);
  fmt::print("{} violations\n", violations.size());
  return violations.empty() ? 0 : 1;
}

}  // namespace

Action add_scan_command(CLI::App& dft) {
  auto input = std::make_shared<InsertInput>();
  CLI::App* sub = dft.add_subcommand("scan", "Insert scan alone: netlist and order of the chains");
  show_example(sub, "dft scan netlist.json --liberty cells.lib --out scanned");
  netlist_options_of(*sub, *input, kCells);
  chain_options_of(*sub, input->scan);
  sub->add_option("--out", input->out, "Folder to write")->required();
  return [=] { return insert_chains(*input); };
}

Action add_rules_command(CLI::App& dft) {
  auto input = std::make_shared<NetlistInput>();
  CLI::App* sub = dft.add_subcommand("rules", "Breaches of the rules that scan asks for");
  show_example(sub, "dft rules netlist.json --liberty cells.lib");
  netlist_options_of(*sub, *input, kCells);
  return [=] { return check_scan_rules(*input); };
}

}  // namespace meltstage::app
