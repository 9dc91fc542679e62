// SPDX-License-Identifier: Apache-2.0
// Test vectors of the chip: its gate netlist, scan inserted, stuck-at tests generated, graded, written as
// STIL, read back and replayed.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <random>
#include <stdexcept>

#include "app/bench.hpp"
#include "asic/dft/fault_simulator.hpp"
#include "asic/dft/generate.hpp"
#include "asic/dft/replay.hpp"
#include "asic/dft/scan_test.hpp"
#include "asic/dft/stil.hpp"
#include "asic/dft/yosys_library.hpp"

namespace meltstage::app {

namespace {

constexpr std::size_t kGradedPatterns = 1000;
constexpr std::size_t kQuickReplay = 8;  // patterns replayed with --quick
constexpr unsigned kThreads = 2;
constexpr std::uint32_t kConflicts = 20'000;  // then a fault is given up, and the row of those falls short

double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
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

}  // namespace

std::vector<BenchRow> bench_vectors(const BenchOptions& options) {
  const std::filesystem::path file = MELTSTAGE_CHIP_NETLIST;
  if (!std::filesystem::exists(file))
    throw std::runtime_error(file.string() + ": isn't there; build the target chip_netlist");
  const dft::Netlist netlist = dft::read_yosys_json(file);
  const dft::CellLibrary& library = dft::yosys_library();
  const dft::ScanDesign design = dft::insert_scan(netlist, library);
  const dft::CaptureView view = dft::scan_view(design, library);

  auto start = std::chrono::steady_clock::now();
  const dft::TestSet set =
      dft::generate_tests(view.circuit, {.seed = options.seed, .conflict_limit = kConflicts});
  const double generate_s = since(start);
  const dft::Coverage result =
      dft::coverage(set.faults, dft::reported_classes(view.circuit, set.faults, set.of_class));

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
  const dft::ReplayResult replay =
      dft::replay(dft::capture_view(design.netlist, library), stream, design.scan_enable, options.seed);

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
      {"1,000 scan patterns graded", grade_s, "s", {}, 0.5},
      {"fault-patterns graded a second",
       number(set.faults.classes.size() * kGradedPatterns) / grade_s,
       "1/s",
       3e8,
       {}},
      {"strobes replayed from the STIL file" + part, number(replay.strobes), "", {}, {}},
      {"mismatches on the netlist" + part, number(replay.mismatches), "", {}, 0.0},
  };
}

}  // namespace meltstage::app
