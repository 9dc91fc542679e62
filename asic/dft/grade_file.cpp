// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/grade_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "asic/dft/core/bench_file.hpp"
#include "asic/dft/core/workers.hpp"
#include "asic/dft/scan/replay.hpp"
#include "asic/dft/scan/scan.hpp"
#include "asic/dft/scan/scan_grade.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

namespace {

bool is_bench(const std::filesystem::path& path) { return path.extension() == ".bench"; }

void require_good(const CaptureView& view, const CycleStream& stream, const std::string& scan_enable,
                  const Progress& progress) {
  const ReplayResult good = replay(view, stream, scan_enable, 1, {}, progress);
  if (good.mismatches != 0)
    throw UserError(fmt::format(
        "{}: {} without a fault ({} of {} strobes fail), expected a file that the netlist fulfils; "
        "`dft replay` runs it",
        stream.title, good.first, good.mismatches, good.strobes));
}

GradedFile without_reports(Circuit circuit) {
  GradedFile result;
  result.circuit = std::move(circuit);
  result.list = collapse(result.circuit);
  return result;
}
std::vector<FaultClass> classes_of(const Grade& graded) {
  std::vector<FaultClass> of_class;
  for (const std::uint32_t detections : graded.detections)
    of_class.push_back(detections != 0 ? FaultClass::DS : FaultClass::NO);
  return of_class;
}

GradedFile grade_plain(CaptureView view, const CycleStream& stream, const Progress& progress) {
  require_good(view, stream, "", progress);
  GradedFile result = without_reports(view.circuit);
  const auto graded_with = [&](bool open) {
    const Captures plain = captures_of_cycles(view, stream, open);
    return grade(view.circuit, blocks_of(plain.patterns, view.circuit.inputs().size(), plain.compared),
                 result.list.classes, kWorkers, progress);
  };
  result.graded = graded_with(false);
  if (leaves_inputs_open(stream)) {  // a fault must show whatever they are
    const Grade other = graded_with(true);
    for (std::size_t c = 0; c < other.detections.size(); ++c) {
      if (other.detections[c] != 0) continue;
      result.graded.detections[c] = 0;
      result.graded.first_pattern[c] = Grade::kUndetected;
    }
  }
  result.reported = reported_classes(result.list, classes_of(result.graded));
  result.patterns = stream.cycles.size();
  return result;
}

GradedFile grade_scanned(const Netlist& netlist, const CaptureView& free_view, const CellLibrary& library,
                         const CycleStream& counted, const Progress& progress) {
  const CycleStream stream = unrolled(counted);
  const ScanDesign design = scanned_design(netlist, free_view, stream.chains);
  require_chains(stream, free_view, netlist.file);
  require_good(free_view, stream, design.scan_enable, progress);
  const CaptureView view = scan_view(design, library);
  GradedFile result = without_reports(view.circuit);
  const Captures found = captures_of(view, stream, design.scan_enable);
  result.patterns = found.patterns.size();
  const bool captures = is_captures_alone(view, design, stream) && !leaves_inputs_open(stream);
  if (captures) {
    result.graded =
        grade(view.circuit, blocks_of(found.patterns, view.circuit.inputs().size(), found.compared),
              result.list.classes, kWorkers, progress);
  } else {
    result.graded.detections.assign(result.list.classes.size(), 0);
    result.graded.first_pattern.assign(result.list.classes.size(), Grade::kUndetected);
  }
  result.reported =
      scan_classes(view, design, result.list, classes_of(result.graded), stream, !captures, progress);
  return result;
}

}  // namespace

Captures captures_of_cycles(const CaptureView& view, const CycleStream& stream, bool open) {
  require_levels(stream);
  const auto signals_of = [&](const std::vector<std::string>& names, bool input) {
    std::vector<std::size_t> signals;
    for (const std::string& name : names) {
      const auto found = std::find(stream.signals.begin(), stream.signals.end(), TestSignal{name, input});
      signals.push_back(static_cast<std::size_t>(found - stream.signals.begin()));
    }
    return signals;
  };
  const std::vector<std::size_t> ins = signals_of(view.input_ports, true),
                                 outs = signals_of(view.output_ports, false);
  Captures result;
  result.compared_at = outs;
  for (const TestCycle& cycle : stream.cycles) {
    Pattern pattern, compared;
    std::vector<std::uint32_t>& compared_in = result.compared_in.emplace_back();
    for (const std::size_t s : ins) {
      const char c = cycle.states[s];
      pattern.push_back(c == '1' || (open && c != '0' && c != 'P') ? 1 : 0);
    }
    for (const std::size_t s : outs) {
      const char c = s < cycle.states.size() ? cycle.states[s] : 'X';
      compared.push_back(c == 'H' || c == 'L' ? 1 : 0);
      compared_in.push_back(compared.back() != 0 ? static_cast<std::uint32_t>(result.patterns.size())
                                                 : Captures::kNotCompared);
    }
    result.before.push_back(result.patterns.empty() ? pattern : result.patterns.back());
    result.patterns.push_back(std::move(pattern));
    result.compared.push_back(std::move(compared));
  }
  return result;
}

CaptureView plain_view(Circuit circuit) {
  CaptureView view;
  std::set<std::string> taken;
  for (const Node node : circuit.inputs()) {
    view.input_ports.push_back(circuit.name(node));
    taken.insert(circuit.name(node));
  }
  for (const Node node : circuit.outputs()) {
    std::string name = circuit.name(node);
    if (taken.count(name) != 0) name += "_out";
    while (!taken.insert(name).second) name += "_";
    view.output_ports.push_back(std::move(name));
  }
  view.clock_ports.assign(view.input_ports.size(), 0);
  view.circuit = std::move(circuit);
  return view;
}

CaptureView view_to_replay(const std::filesystem::path& netlist, const CellLibrary& library) {
  if (is_bench(netlist)) return plain_view(read_bench(netlist));
  return capture_view(read_yosys_json(netlist), library);
}

GradedFile grade_file(const std::filesystem::path& path, const CellLibrary& library,
                      const CycleStream& stream, const Progress& progress) {
  if (is_bench(path)) return grade_plain(plain_view(read_bench(path)), stream, progress);
  const Netlist netlist = read_yosys_json(path);
  CaptureView view = capture_view(netlist, library);
  if (view.flops.empty()) return grade_plain(std::move(view), stream, progress);
  return grade_scanned(netlist, view, library, stream, progress);
}

}  // namespace meltstage::dft
