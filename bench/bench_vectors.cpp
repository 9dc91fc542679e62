// SPDX-License-Identifier: Apache-2.0
// Test vectors of the chip: its gate netlist, scan inserted, stuck-at tests generated, graded, written as
// STIL, read back and replayed.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <numeric>
#include <random>

#include "asic/dft/atpg/functional.hpp"
#include "asic/dft/atpg/generate.hpp"
#include "asic/dft/atpg/iddq.hpp"
#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/transition.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/scan/replay.hpp"
#include "asic/dft/scan/scan_grade.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "asic/signoff/functional_vectors.hpp"
#include "asic/signoff/grade_report.hpp"
#include "bench/bench.hpp"
#include "bench/data_file.hpp"

namespace meltstage::app {

namespace {

constexpr std::size_t kGradedPatterns = 1000;
constexpr std::size_t kQuickReplay = 8;  // patterns replayed with --quick
constexpr unsigned kThreads = 2;
// Conflicts of the solver after which a fault is given up, and the row of those falls short.
constexpr std::uint32_t kConflicts = 50'000;
constexpr std::uint32_t kFewConflicts =
    2'000;  // for a stop of the supply current: another may show the fault
constexpr std::size_t kIddqStops = 20;

double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Of all threads of the program.
double processor_time() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

std::vector<dft::Pattern> random_patterns(const dft::Circuit& circuit, std::size_t count,
                                          std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<dft::Pattern> patterns(count, dft::Pattern(circuit.inputs().size()));
  for (dft::Pattern& pattern : patterns) {
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      const std::int8_t held = circuit.held()[i];
      pattern[i] = static_cast<std::uint8_t>(held >= 0 ? held : random() & 1);
    }
  }
  return patterns;
}

struct Sampled {
  dft::Coverage coverage;
  std::size_t aborted = 0;
  double seconds = 0;
};

// Transition faults drawn at random, each with a test or a verdict.
Sampled transition_sample(const dft::CaptureView& view, const std::string& scan_enable, std::size_t count,
                          std::uint64_t seed, const Progress& progress) {
  dft::TransitionView transitions = dft::launch_on_capture(view, scan_enable);
  std::vector<std::size_t> inside, sample;
  for (std::size_t fault = 0; fault < transitions.faults.total(); ++fault) {
    if (transitions.faults.class_of[fault] != dft::FaultList::kNoClass) inside.push_back(fault);
  }
  std::mt19937_64 random(seed);
  std::sample(inside.begin(), inside.end(), std::back_inserter(sample), count, random);
  dft::FaultList list;
  list.class_of.assign(transitions.faults.total(), dft::FaultList::kNoClass);
  for (const std::size_t fault : sample) {
    list.class_of[fault] = static_cast<std::uint32_t>(list.classes.size());
    list.classes.push_back(transitions.faults.classes[transitions.faults.class_of[fault]]);
  }
  transitions.faults = list;
  const auto start = std::chrono::steady_clock::now();
  const dft::TestSet set = dft::generate_tests(
      transitions.circuit, list, {.seed = seed, .conflict_limit = kConflicts, .progress = progress});
  Sampled result;
  result.seconds = since(start);
  result.aborted = set.aborted;
  const auto reported = dft::reported_transitions(view, transitions, set.of_class);
  for (const std::size_t fault : sample) ++result.coverage.count[static_cast<std::size_t>(reported[fault])];
  return result;
}

struct Functional {
  std::uint64_t clocks = 0;
  double toggle = 0;            // 0..1
  double reachable_toggle = 0;  // 0..1, of the outputs that nothing keeps still
  double coverage = 0;          // of the sample, 0..1
};

Functional functional_sample(const dft::Netlist& netlist, const dft::CellLibrary& library, std::size_t faults,
                             const BenchOptions& options) {
  const dft::CaptureView view = dft::capture_view(netlist, library);
  const FunctionalSet set = functional_set(options.quick ? FunctionalLength::quick : FunctionalLength::whole);
  const dft::CycleStream cycles = chip_cycles(set.stream);
  const auto sample = dft::sample_faults(dft::collapse(view.circuit).classes, faults, options.seed);
  const dft::FunctionalGrade grade =
      dft::grade_functional(view, cycles, sample, kThreads, dft::PowerUp::zeros, options.progress);
  const dft::ToggleCoverage& toggle = grade.toggle;
  std::vector<dft::FaultClass> verdicts;
  for (const std::uint64_t first : grade.first_cycle)
    verdicts.push_back(first == dft::FunctionalGrade::kUndetected ? dft::FaultClass::NO
                                                                  : dft::FaultClass::DS);
  const GradeReport report =
      grade_report(netlist, view, cycles, sample, verdicts, grade,
                   read_unreached(data_file("unreached.toml", "install or build meltstage-bench again")));
  return {grade.cycles, static_cast<double>(toggle.toggled) / static_cast<double>(toggle.lines),
          report.toggle_of_reachable(toggle),
          static_cast<double>(grade.detected()) / static_cast<double>(sample.size())};
}

}  // namespace

std::vector<BenchRow> bench_vectors(const BenchOptions& options) {
  const std::filesystem::path file =
      data_file("netlist.json", "./run bench vectors makes it, or the build's target chip_netlist");
  const dft::Netlist netlist = dft::read_yosys_json(file);
  const dft::CellLibrary& library = dft::yosys_library();
  const dft::ScanDesign design = dft::insert_scan(netlist, library);
  const dft::CaptureView view = dft::scan_view(design, library);

  auto start = std::chrono::steady_clock::now();
  const double cpu_start = processor_time();
  const dft::TestSet set = dft::generate_tests(
      view.circuit, {.seed = options.seed, .conflict_limit = kConflicts, .progress = options.progress});
  const double generate_s = since(start);
  const double generate_cpu_s = processor_time() - cpu_start;
  const dft::Coverage result = dft::coverage(
      set.faults, dft::scan_classes(view, design, set.faults, set.of_class,
                                    dft::expand(dft::make_scan_test(design, view, set.patterns, "tc_top")),
                                    false, options.progress));

  const auto blocks = dft::blocks_of(random_patterns(view.circuit, kGradedPatterns, options.seed),
                                     view.circuit.inputs().size());
  double grade_s = 1e9;
  for (int run = 0; run < 3; ++run) {
    start = std::chrono::steady_clock::now();
    dft::grade(view.circuit, blocks, set.faults.classes, kThreads);
    grade_s = std::min(grade_s, since(start));
  }

  std::vector<dft::Pattern> replayed = set.patterns;
  if (options.quick && replayed.size() > kQuickReplay) replayed.resize(kQuickReplay);
  const dft::ScanTest test = dft::make_scan_test(design, view, replayed, "tc_top");
  const dft::CycleStream stream = dft::parse_stil(dft::stil_text(test), "tc_top.stil");
  const dft::ReplayResult replay = dft::replay(dft::capture_view(design.netlist, library), stream,
                                               design.scan_enable, options.seed, {}, options.progress);

  const dft::IddqStops iddq = dft::scan_iddq_stops(
      design, view, kIddqStops,
      {.seed = options.seed, .conflict_limit = kFewConflicts, .progress = options.progress});
  const std::size_t transition_faults = options.quick ? 250 : 1000;
  const Sampled transition =
      transition_sample(view, design.scan_enable, transition_faults, options.seed, options.progress);
  const std::size_t functional_faults = options.quick ? 511 : 1022;
  const Functional functional = functional_sample(netlist, library, functional_faults, options);

  const auto number = [](std::size_t n) { return static_cast<double>(n); };
  const std::string part = options.quick ? fmt::format(" (first {} patterns)", replayed.size()) : "";
  return {
      {"chip: cells", number(design.netlist.instances.size()), "", {}, {}},
      {"chip: scan flops", number(view.flops.size()), "", {}, {}},
      {"stuck-at faults", number(result.total()), "", {}, {}},
      {"stuck-at faults, collapsed", number(result.collapsed), "", {}, {}},
      {"stuck-at test coverage", 100 * result.test_coverage(), "%", 99.5, {}},
      {"stuck-at fault coverage", 100 * result.fault_coverage(), "%", 99.0, {}},
      {"stuck-at fault efficiency", 100 * result.fault_efficiency(), "%", 100.0, {}},
      {"faults given up", number(set.aborted), "", {}, 0.0},
      {"patterns", number(set.patterns.size()), "", {}, {}},
      {"tester cycles" + part, number(stream.cycles.size()), "", {}, {}},
      {"generation with compaction", generate_s, "s", {}, 10.0},
      {"processor time of that, both threads", generate_cpu_s, "s", {}, {}},
      {"1,000 scan patterns graded", grade_s, "s", {}, 0.5},
      {"fault-patterns graded a second",
       number(set.faults.classes.size() * kGradedPatterns) / grade_s,
       "1/s",
       3e8,
       {}},
      {"strobes replayed from the STIL file" + part, number(replay.strobes), "", {}, {}},
      {fmt::format("mismatches on the netlist{}, unknowns filled in {} ways", part, dft::kFills),
       number(replay.mismatches),
       "",
       {},
       0.0},
      {"supply current stops", number(iddq.states.size()), "", {}, number(kIddqStops)},
      {"pseudo-stuck-at coverage of the stops", 100 * iddq.coverage(), "%", 95.0, {}},
      {fmt::format("transition test coverage ({} faults at random)", transition_faults),
       100 * transition.coverage.test_coverage(),
       "%",
       92.0,
       {}},
      {"of these given up", number(transition.aborted), "", {}, 0.0},
      {"of these generated in", transition.seconds, "s", {}, {}},
      {"functional set: clocks", number(functional.clocks), "", {}, {}},
      {fmt::format("functional set: stuck-at coverage ({} faults at random)", functional_faults),
       100 * functional.coverage,
       "%",
       80.0,
       {}},
      {"functional set: cell outputs that rise and fall", 100 * functional.toggle, "%", {}, {}},
      {"functional set: of those that can (asic/signoff/unreached.toml)",
       100 * functional.reachable_toggle,
       "%",
       99.0,
       {}},
  };
}

}  // namespace meltstage::app
