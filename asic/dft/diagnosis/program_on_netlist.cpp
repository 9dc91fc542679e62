// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/diagnosis/program_on_netlist.hpp"

#include <fmt/format.h>

#include <utility>

#include "asic/dft/diagnosis/tester.hpp"
#include "asic/dft/files/pattern_files.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/grade_file.hpp"
#include "asic/dft/scan/replay.hpp"
#include "asic/dft/scan/scan.hpp"
#include "asic/dft/scan/scan_grade.hpp"
#include "asic/netlist/netlist.hpp"
#include "asic/netlist/yosys_json.hpp"
#include "base/error.hpp"
#include "base/file.hpp"

namespace meltstage::dft {
namespace {

void require_passing(const ProgramOnNetlist& program) {
  const FailLog good = test_chip(program.view, program.stream, program.scan_enable, {});
  if (good.fails.empty()) return;
  throw UserError(
      fmt::format("{}: found {} strobes that fail without a defect, the first in cycle {} at {}, expected "
                  "patterns of this "
                  "netlist",
                  program.stream.title, good.fails.size(), good.fails[0].cycle,
                  program.stream.signals[good.fails[0].signal].name));
}

}  // namespace

ProgramOnNetlist read_program(const std::filesystem::path& patterns, const std::filesystem::path& netlist,
                              const CellLibrary& library) {
  ProgramOnNetlist program;
  CycleStream stream = patterns.extension() == ".wgl"
                           ? parse_wgl(read_file(patterns, "a WGL file"), patterns.string())
                           : read_stil(patterns);
  stream.title = patterns.string();
  require_runnable(stream);
  program.stream = unrolled(std::move(stream));
  program.view = view_to_replay(netlist, library);
  if (program.view.flops.empty()) {
    program.captures = program.view;
    program.patterns = captures_of_cycles(program.view, program.stream, false);
    require_passing(program);
    return program;
  }
  const Netlist cells = read_yosys_json(netlist);
  name_as_ports(program.stream, cells);
  const ScanDesign design = scanned_design(cells, program.view, program.stream.chains);
  require_chains(program.stream, program.view, netlist.string());
  program.scan_enable = design.scan_enable;
  program.captures = scan_view(design, library);
  if (!is_captures_alone(program.captures, design, program.stream))
    throw UserError(
        fmt::format("{}: found more than one clock, or none, between a load and its unload, expected "
                    "patterns of a load, one "
                    "clock and an unload beside the chain and reset tests",
                    patterns.string()));
  program.patterns = captures_of(program.captures, program.stream, program.scan_enable);
  require_passing(program);
  return program;
}

}  // namespace meltstage::dft
