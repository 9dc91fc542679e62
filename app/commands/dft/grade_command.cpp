// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "app/commands/dft/inputs.hpp"
#include "app/commands/dft/outputs.hpp"
#include "app/commands/dft/subcommands.hpp"
#include "app/number_range.hpp"
#include "asic/dft/atpg/functional.hpp"
#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/workers.hpp"
#include "asic/dft/grade_file.hpp"
#include "asic/dft/program.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "asic/signoff/grade_report.hpp"
#include "base/error.hpp"
#include "base/output_file.hpp"
#include "base/terminal.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct GradeInput : NetlistInput {
  PatternInput patterns;
  std::optional<std::size_t> faults;
  std::uint64_t seed = 1;
  bool two_power_ups = false;
  fs::path unreached, report;
};

constexpr std::size_t kDrawnFaults = 1022;

// What one filling of open inputs detects, and another doesn't, is not detected.
FunctionalGrade grade_with_fillings(const CaptureView& view, const CycleStream& stream,
                                    const std::vector<Fault>& sample, const GradeInput& input,
                                    PowerUp power_up, const Progress& progress) {
  FunctionalGrade graded = grade_functional(view, stream, sample, kWorkers, power_up, progress);
  if (!graded.wrong.empty() || !leaves_inputs_open(stream)) return graded;
  std::mt19937_64 random(input.seed);
  const std::function<char()> fillings[] = {[] { return '1'; },
                                            [&] { return random() % 2 == 0 ? '0' : '1'; }};
  for (const auto& level : fillings) {
    const FunctionalGrade other =
        grade_functional(view, with_open_inputs(stream, level), sample, kWorkers, power_up, progress);
    if (!other.wrong.empty()) return other;
    for (std::size_t i = 0; i < sample.size(); ++i)
      if (other.first_cycle[i] == FunctionalGrade::kUndetected)
        graded.first_cycle[i] = FunctionalGrade::kUndetected;
  }
  return graded;
}

// Vectors without scan, clock by clock, faults drawn at random.
int grade_clock_by_clock(const GradeInput& input, const Netlist& netlist, const CaptureView& view,
                         const CycleStream& stream) {
  const std::vector<Fault> all = collapse(view.circuit).classes;
  const std::size_t faults = input.faults.value_or(kDrawnFaults);
  const std::vector<Fault> sample = faults == 0 ? all : sample_faults(all, faults, input.seed);
  ProgressLine line;
  const FunctionalGrade graded =
      grade_with_fillings(view, stream, sample, input, PowerUp::zeros, shown_on(line));
  if (!graded.wrong.empty())
    throw UserError(
        fmt::format("{}: {} without a fault, expected vectors that the netlist fulfils; "
                    "`dft replay` runs them",
                    stream.title, graded.wrong));
  std::vector<FaultClass> verdicts;
  for (const std::uint64_t first : graded.first_cycle)
    verdicts.push_back(first == FunctionalGrade::kUndetected ? FaultClass::NO : FaultClass::DS);
  // Detected from one power-up state alone: possibly.
  if (input.two_power_ups) {
    const FunctionalGrade other =
        grade_with_fillings(view, stream, sample, input, PowerUp::ones, shown_on(line));
    for (std::size_t i = 0; i < sample.size(); ++i) {
      const bool also = other.first_cycle[i] != FunctionalGrade::kUndetected;
      if (also != (verdicts[i] == FaultClass::DS)) verdicts[i] = FaultClass::PT;
    }
  }
  const GradeReport report =
      grade_report(netlist, view, stream, sample, verdicts, graded,
                   input.unreached.empty() ? std::vector<Unreached>() : read_unreached(input.unreached));
  line.clear();
  if (!input.report.empty()) write_whole(input.report, report.text);
  const ToggleCoverage& toggle = graded.toggle;
  const auto detected =
      static_cast<std::size_t>(std::count(verdicts.begin(), verdicts.end(), FaultClass::DS));
  const auto row = [](const char* name, std::size_t count) { fmt::print("{:<22} {:>10}\n", name, count); };
  row("cycles", graded.cycles);
  row("faults graded", sample.size());
  row("detected", detected);
  if (input.two_power_ups)
    row("possibly detected",
        static_cast<std::size_t>(std::count(verdicts.begin(), verdicts.end(), FaultClass::PT)));
  row("cell outputs", toggle.lines);
  row("tied, left out", toggle.tied);
  row("toggled", toggle.toggled);
  row("cannot toggle", report.unreached);
  row("faults not to be shown", report.hidden);
  fmt::print("{:<22} {:>9.2f} %\n{:<22} {:>9.2f} %\n{:<22} {:>9.2f} %\n{:<22} {:>9.2f} %\n", "coverage",
             100.0 * static_cast<double>(detected) / static_cast<double>(sample.size()),
             "of faults to be shown", 100.0 * report.coverage_of_visible(detected, sample.size()),
             "outputs toggled",
             100.0 * static_cast<double>(toggle.toggled) / static_cast<double>(toggle.lines),
             "of those that can", 100.0 * report.toggle_of_reachable(toggle));
  fmt::print("\n{:<22} {:>16} {:>8} {:>18} {:>8} {:>7}\n", "module", "faults found", "", "outputs toggle", "",
             "cannot");
  for (const auto& [name, m] : report.modules)
    fmt::print(
        "{:<22} {:>7} of {:>5} {:>6.1f} % {:>8} of {:>6} {:>6.1f} % {:>7}\n", name, m.detected, m.faults,
        100.0 * static_cast<double>(m.detected) / static_cast<double>(std::max<std::size_t>(m.faults, 1)),
        m.toggled, m.outputs,
        100.0 * static_cast<double>(m.toggled) / static_cast<double>(std::max<std::size_t>(m.outputs, 1)),
        m.unreached);
  return 0;
}

int grade_patterns(const GradeInput& input) {
  keep_inputs(input.report, input.patterns, input, {input.unreached});
  const CellLibrary library = library_of(input);
  const CycleStream stream = read_patterns(input.patterns, input);
  if (!is_bench(input.netlist) && stream.chains.empty()) {
    const Netlist netlist = read_yosys_json(input.netlist);
    const CaptureView plain = capture_view(netlist, library);
    if (!plain.flops.empty()) return grade_clock_by_clock(input, netlist, plain, stream);
  }
  const char* const needless = input.faults               ? "--faults"
                               : input.two_power_ups      ? "--two-power-ups"
                               : !input.unreached.empty() ? "--unreached"
                                                          : nullptr;
  if (needless != nullptr)
    throw UserError(fmt::format(
        "{}: found {}, expected vectors without scan of a netlist with flops for {}; leave it out: every "
        "fault is graded",
        input.patterns.patterns.string(), stream.chains.empty() ? "a netlist without flops" : "scan patterns",
        needless));
  ProgressLine line;
  const GradedFile file = grade_file(input.netlist, library, stream, shown_on(line));
  line.clear();
  if (!input.report.empty())
    write_whole(input.report, fault_report(file.list, file.reported, file.graded, [&](std::size_t fault) {
                  return fault_name(file.circuit, fault);
                }));
  print_coverage(coverage(file.list, file.reported));
  fmt::print("{:<22} {:>10}\n", "patterns", file.patterns);
  return 0;
}

}  // namespace

Action add_grade_command(CLI::App& dft) {
  auto input = std::make_shared<GradeInput>();
  CLI::App* sub = dft.add_subcommand("grade", "Which faults patterns detect");
  show_example(sub, "dft grade scanned.json --liberty cells.lib --patterns patterns.stil");
  netlist_options_of(*sub, *input, kCellsOrBench);
  sub->add_option("--patterns", input->patterns.patterns, kPatternKinds)->required();
  sub->add_option("--faults", input->faults,
                  "Vectors without scan: so many faults at random, 0 for all (default 1022)")
      ->check(whole_number_from(0, UINT32_MAX));
  seed_option_of(*sub, input->seed, "Vectors without scan: seed of the draw (default 1)");
  sub->add_flag("--two-power-ups", input->two_power_ups,
                "Vectors without scan: all flops at 0 and at 1 first; tells possibly detected faults");
  sub->add_option("--unreached", input->unreached,
                  "Vectors without scan: what function cannot move, and why (TOML)");
  sub->add_option("--report", input->report, "File for one line a fault, and an output that stands still");
  timing_and_chains_options_of(*sub, input->patterns);
  return [=] { return grade_patterns(*input); };
}

}  // namespace meltstage::app
