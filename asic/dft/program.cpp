// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>

#include "asic/dft/core/bench_file.hpp"
#include "asic/dft/core/transition.hpp"
#include "asic/dft/core/workers.hpp"
#include "asic/dft/files/formats.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/grade_file.hpp"
#include "asic/dft/scan/replay.hpp"
#include "asic/dft/scan/scan_grade.hpp"
#include "base/error.hpp"
#include "base/output_file.hpp"
#include "base/sha256.hpp"

namespace meltstage::dft {

namespace {

// Patterns of a combinational view as cycles: every input driven, every output compared.
CycleStream plain_stream(const Circuit& circuit, const std::vector<Pattern>& patterns,
                         const std::string& title) {
  CycleStream stream;
  stream.title = title;
  const CaptureView view = plain_view(circuit);
  for (const std::string& name : view.input_ports) stream.signals.push_back({name, true});
  for (const std::string& name : view.output_ports) stream.signals.push_back({name, false});
  std::vector<Word> values;
  std::size_t first = 0;
  for (const PatternBlock& block : blocks_of(patterns, circuit.inputs().size())) {
    simulate(circuit, block, values);
    for (std::size_t lane = 0; lane < block.count; ++lane) {
      std::string states;
      for (const std::uint8_t bit : patterns[first + lane]) states += bit != 0 ? '1' : '0';
      for (const Node node : circuit.outputs()) states += values[node].bit(lane) ? 'H' : 'L';
      stream.cycles.push_back({states, fmt::format("pattern {}", first + lane)});
    }
    first += block.count;
  }
  return stream;
}

void add_stuck_at_tests(TestProgram& program, const GenerateOptions& options, const std::string& title) {
  const TestSubject& subject = program.subject;
  program.set = generate_tests(subject.circuit, options);
  program.graded = grade(subject.circuit, blocks_of(program.set.patterns, subject.circuit.inputs().size()),
                         program.set.faults.classes, kWorkers, options.progress);
  if (subject.is_scanned) {
    program.scan = make_scan_test(subject.design, subject.view, program.set.patterns, title);
    program.stream = expand(program.scan);
    program.reported = scan_classes(subject.view, subject.design, program.set.faults, program.set.of_class,
                                    program.stream, false, options.progress);
  } else {
    program.stream = plain_stream(subject.circuit, program.set.patterns, title);
    program.reported = reported_classes(program.set.faults, program.set.of_class);
  }
}

void add_transition_tests(TestProgram& program, const GenerateOptions& options, const std::string& title) {
  const TestSubject& subject = program.subject;
  const TransitionView view = launch_on_capture(subject.view, subject.design.scan_enable);
  program.set = generate_tests(view.circuit, view.faults, options);
  program.reported = reported_transitions(subject.view, view, program.set.of_class);
  program.graded = grade(view.circuit, blocks_of(program.set.patterns, view.circuit.inputs().size()),
                         program.set.faults.classes, kWorkers, options.progress);
  program.scan = make_transition_test(subject.design, subject.view, view, program.set.patterns, title);
  program.stream = expand(program.scan);
}

using Writers = std::map<std::string, std::function<std::string()>>;

// Writes files into the folder and returns their hashes by name. By two threads, each of which takes the next
// file when it is free; the last ones by name, the patterns, are the largest and come first.
std::map<std::string, std::string> write_files(const Writers& writers, const std::filesystem::path& folder) {
  std::vector<Writers::const_reverse_iterator> files;
  for (auto file = writers.rbegin(); file != writers.rend(); ++file) files.push_back(file);
  std::vector<std::string> hash(files.size());
  std::vector<std::exception_ptr> failed(files.size());
  std::atomic<std::size_t> next{0};
  in_parallel([&](unsigned) {
    for (std::size_t k = next++; k < files.size(); k = next++) {
      try {
        const std::string text = files[k]->second();
        Sha256 sum;
        sum.update(text);
        hash[k] = sum.finish();
        write_whole(folder / files[k]->first, text);
      } catch (...) {
        failed[k] = std::current_exception();
      }
    }
  });
  std::map<std::string, std::string> hashes;
  for (std::size_t k = 0; k < files.size(); ++k) {
    if (failed[k]) std::rethrow_exception(failed[k]);
    hashes[files[k]->first] = hash[k];
  }
  return hashes;
}

}  // namespace

std::string fault_report(const FaultList& list, const std::vector<FaultClass>& reported, const Grade& graded,
                         const std::function<std::string(std::size_t)>& name) {
  std::string text;
  for (std::size_t f = 0; f < reported.size(); ++f) {
    const std::uint32_t first =
        list.class_of[f] == FaultList::kNoClass ? Grade::kUndetected : graded.first_pattern[list.class_of[f]];
    text += fmt::format("{} {} {}\n", to_string(reported[f]),
                        first == Grade::kUndetected ? "-" : std::to_string(first), name(f));
  }
  return text;
}

TestSubject test_subject(const std::filesystem::path& path, const CellLibrary& library,
                         const ScanOptions& scan) {
  TestSubject subject;
  if (path.extension() == ".bench") {
    subject.circuit = read_bench(path);
    return subject;
  }
  const Netlist netlist = read_yosys_json(path);
  const bool flops = std::any_of(netlist.instances.begin(), netlist.instances.end(), [&](const Instance& i) {
    const auto cell = library.find(i.type);
    return cell != library.end() && cell->second.flop;
  });
  if (!flops) {
    subject.circuit = capture_view(netlist, library).circuit;
    return subject;
  }
  subject.design = insert_scan(netlist, library, scan);
  subject.view = scan_view(subject.design, library);
  subject.circuit = subject.view.circuit;
  subject.is_scanned = true;
  return subject;
}

TestProgram make_test_program(const std::filesystem::path& netlist, const CellLibrary& library,
                              const ProgramOptions& options) {
  TestProgram program;
  program.model = options.model;
  program.subject = test_subject(netlist, library, options.scan);
  const std::string title = netlist.stem().string();
  if (options.model == FaultModel::stuck_at) {
    add_stuck_at_tests(program, options.generation, title);
  } else {
    if (!program.subject.is_scanned)
      throw UserError(
          fmt::format("{}: found no flops, expected some that launch transitions; give --faults stuck-at",
                      netlist.string()));
    add_transition_tests(program, options.generation, title);
  }
  program.coverage = coverage(program.set.faults, program.reported);
  program.masked = masked_strobes(program.stream, program.subject.design.scan_enable);
  return program;
}

std::map<std::string, std::string> write_test_program(const TestProgram& program, const CellLibrary& library,
                                                      const std::filesystem::path& folder) {
  const TestSubject& subject = program.subject;
  const CycleStream& stream = program.stream;
  Writers writers = {
      {"patterns.stil",
       [&] { return subject.is_scanned ? stil_text(program.scan) : flat_stil_text(stream); }},
      {"patterns.wgl", [&] { return subject.is_scanned ? wgl_text(program.scan) : wgl_text(stream); }},
      {"patterns.avc", [&] { return avc_text(stream); }},
      {"patterns.atp", [&] { return atp_text(stream); }},
      {"masks.txt", [&] { return mask_text(program.masked); }},
      {"faults.txt", [&] {
         return fault_report(program.set.faults, program.reported, program.graded, [&](std::size_t fault) {
           return program.model == FaultModel::transition ? transition_name(subject.circuit, fault)
                                                          : fault_name(subject.circuit, fault);
         });
       }}};
  if (subject.is_scanned) {
    writers["netlist.json"] = [&] { return yosys_json_text(subject.design.netlist); };
    writers["netlist.v"] = [&] { return verilog_text(subject.design.netlist); };
    writers["cells.v"] = [&] { return cell_models(subject.design.netlist, library); };
  }
  std::filesystem::create_directories(folder);
  return write_files(writers, folder);
}

}  // namespace meltstage::dft
