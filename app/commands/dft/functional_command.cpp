// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/commands/dft/outputs.hpp"
#include "app/commands/dft/subcommands.hpp"
#include "asic/signoff/functional_vectors.hpp"
#include "asic/signoff/vectors_files.hpp"
#include "base/terminal.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct FunctionalInput {
  FunctionalSources sources;
  FunctionalLength length = FunctionalLength::whole;
  bool board = false;
  fs::path out;
};

const std::vector<std::string> kFunctionalFiles = {"functional.mvec", "functional.stil", "functional.wgl",
                                                   "functional.avc",  "functional.atp",  "masks.txt"};

int record_functional(const FunctionalInput& input) {
  const FunctionalSources& sources = input.sources;
  require_apart(input.out, {sources.netlist, sources.library});
  for (const fs::path& path : {sources.netlist, sources.library}) {
    if (!path.empty()) read_file(path);  // recording takes minutes
  }
  require_own(input.out, kFunctionalFiles);
  ProgressLine line;
  const FunctionalSet set = input.board ? board_set() : functional_set(input.length, shown_on(line));
  line.clear();
  const OutputClaim claim(input.out, kFunctionalFiles);
  const FunctionalFolder written = write_functional_set(set, sources, input.out);
  fmt::print("{} clocks in {} vectors, {} pieces, {} strobes masked\n", written.clocks, written.vectors,
             set.pieces.size(), written.masked);
  return 0;
}

}  // namespace

Action add_functional_command(CLI::App& dft) {
  auto input = std::make_shared<FunctionalInput>();
  CLI::App* sub =
      dft.add_subcommand("functional", "Record the chip's functional set (.mvec), labelled by requirement");
  show_example(sub, "dft functional --out functional");
  sub->add_option("--out", input->out, "Folder to write")->required();
  sub->add_option("--netlist", input->sources.netlist,
                  "Netlist that the set is meant for: its hash goes into the manifest");
  sub->add_option("--liberty", input->sources.library, "Library of its cells: likewise");
  sub->add_flag_callback(
      "--quick", [=] { input->length = FunctionalLength::quick; }, "Each register written once");
  sub->add_flag("--board", input->board, "The set for the chip on a small FPGA (fpga/ice40)")
      ->excludes("--quick");
  return [=] { return record_functional(*input); };
}

}  // namespace meltstage::app
