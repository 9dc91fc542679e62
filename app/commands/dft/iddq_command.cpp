// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "app/commands/dft/inputs.hpp"
#include "app/commands/dft/subcommands.hpp"
#include "app/number_range.hpp"
#include "asic/dft/atpg/iddq.hpp"
#include "asic/dft/program.hpp"
#include "base/error.hpp"
#include "base/terminal.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct IddqInput : NetlistInput {
  GenerationInput generation;
  std::size_t stops = 20;
};

// Where a tester stops to measure the supply current, and what it sees there.
int iddq(const IddqInput& input) {
  const CellLibrary library = library_of(input);
  const TestSubject subject = test_subject(input.netlist, library, scan_of(input.generation.scan));
  if (!subject.is_scanned)
    throw UserError(input.netlist.string() + ": found no flop, expected some to load states into");
  ProgressLine line;
  const IddqStops stops =
      scan_iddq_stops(subject.design, subject.view, input.stops, generation_of(input.generation, line));
  line.clear();
  for (std::size_t i = 0; i < stops.states.size(); ++i)
    fmt::print("stop {:<17} {:>10}\n", i + 1, stops.detected[i]);
  fmt::print("{:<22} {:>10}\n{:<22} {:>9.2f} %\n", "faults", stops.faults - stops.tied, "coverage",
             100 * stops.coverage());
  return 0;
}

}  // namespace

Action add_iddq_command(CLI::App& dft) {
  auto input = std::make_shared<IddqInput>();
  CLI::App* sub = dft.add_subcommand("iddq", "Pseudo-stuck-at coverage of supply current stops");
  show_example(sub, "dft iddq netlist.json --liberty cells.lib");
  netlist_options_of(*sub, *input, kCells);
  generation_options_of(*sub, input->generation);
  sub->add_option("--stops", input->stops, "At the most (default 20)")->check(whole_number_from(1, 10000));
  return [=] { return iddq(*input); };
}

}  // namespace meltstage::app
