// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <stdlib.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "app/commands/diagnosis_command.hpp"
#include "app/number_range.hpp"
#include "app/terminal.hpp"
#include "app/verbs.hpp"
#include "asic/dft/atpg/functional.hpp"
#include "asic/dft/atpg/generate.hpp"
#include "asic/dft/atpg/iddq.hpp"
#include "asic/dft/atpg/proof_check.hpp"
#include "asic/dft/atpg/test_solver.hpp"
#include "asic/dft/core/bench_file.hpp"
#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/workers.hpp"
#include "asic/dft/files/formats.hpp"
#include "asic/dft/files/pattern_files.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/grade_file.hpp"
#include "asic/dft/program.hpp"
#include "asic/dft/scan/lint.hpp"
#include "asic/dft/scan/masks.hpp"
#include "asic/dft/scan/replay.hpp"
#include "asic/dft/scan/scan.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "asic/signoff/functional_vectors.hpp"
#include "asic/signoff/grade_report.hpp"
#include "asic/signoff/vectors_files.hpp"
#include "base/build_stamp.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/temporary_folder.hpp"
#include "base/toml_file.hpp"
#include "recording/text.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct Options {
  fs::path netlist, patterns, liberty, out, tester, cnf, proof, sdf, cells, unreached, readback;
  std::string on = "netlist", reset, model = "stuck-at";
  std::string scan;  // where the chains of a file without any stand
  std::size_t chains = 8;
  std::size_t stops = 20;
  std::uint64_t seed = 1;
  std::uint32_t conflicts = 0;
  std::optional<std::size_t> faults;
  FunctionalLength length = FunctionalLength::whole;
  bool board = false;
  bool two_power_ups = false;
  std::uint64_t cycles = 0;  // 0: all
  std::vector<fs::path> rtl;
  std::vector<double> timing;  // period, drive, strobe, clock rise and fall; ns
};

constexpr std::size_t kDrawnFaults = 1022;
constexpr unsigned kPowerUps = 10;  // at random, beside all 0 and all 1

nlohmann::ordered_json hashes(const std::vector<fs::path>& files) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const fs::path& file : files) json[file.filename().string()] = sha256_of(read_file(file));
  return json;
}

bool is_bench(const fs::path& path) { return path.extension() == ".bench"; }

// What has cells and pins; a .bench netlist has neither.
void require_cells(const fs::path& path) {
  if (is_bench(path))
    throw UserError(path.string() + ": found .bench, expected a netlist of Yosys' write_json");
}
Netlist read_cells(const fs::path& path) {
  require_cells(path);
  return read_yosys_json(path);
}

CellLibrary library_of(const Options& options) {
  return options.liberty.empty() ? yosys_library() : read_liberty(options.liberty);
}

ScanOptions scan_of(const Options& options) {
  ScanOptions scan;
  scan.chains = options.chains;
  scan.reset = options.reset;
  return scan;
}

GenerateOptions generation_of(const Options& options, ProgressLine& line) {
  return {.seed = options.seed, .conflict_limit = options.conflicts, .progress = shown_on(line)};
}

void print_coverage(const Coverage& c) {
  for (const FaultClass k : {FaultClass::DS, FaultClass::DI, FaultClass::PT, FaultClass::UT, FaultClass::UR,
                             FaultClass::AU, FaultClass::NC, FaultClass::NO})
    fmt::print("{:<22} {:>10}\n", to_string(k), c.of(k));
  fmt::print("{:<22} {:>10}\n{:<22} {:>10}\n", "faults", c.total(), "collapsed", c.collapsed);
  fmt::print("{:<22} {:>9.2f} %\n{:<22} {:>9.2f} %\n{:<22} {:>9.2f} %\n", "test coverage",
             100 * c.test_coverage(), "fault coverage", 100 * c.fault_coverage(), "fault efficiency",
             100 * c.fault_efficiency());
}

nlohmann::ordered_json coverage_json(const Coverage& c) {
  nlohmann::ordered_json json;
  for (std::size_t k = 0; k < kFaultClasses; ++k) json[to_string(static_cast<FaultClass>(k))] = c.count[k];
  json["total"] = c.total();
  json["collapsed"] = c.collapsed;
  json["test_coverage"] = c.test_coverage();
  json["fault_coverage"] = c.fault_coverage();
  json["fault_efficiency"] = c.fault_efficiency();
  return json;
}

std::string scan_json(const Options& options, const ScanDesign& design) {
  nlohmann::ordered_json json = {
      {"tool", version()},
      {"netlist",
       {{"file", options.netlist.filename().string()}, {"sha256", sha256_of(read_file(options.netlist))}}},
      {"clock", design.clock},
      {"reset", design.reset},
      {"test_mode", design.test_mode},
      {"scan_enable", design.scan_enable}};
  for (const ScanChain& chain : design.chains)
    json["chains"].push_back(
        {{"name", chain.name}, {"in", chain.in}, {"out", chain.out}, {"cells", chain.cells}});
  return json.dump(2) + "\n";
}

// What is left out is no input.
void require_apart(const fs::path& folder, std::vector<fs::path> inputs) {
  std::erase_if(inputs, [](const fs::path& path) { return path.empty(); });
  require_outside(folder, inputs);
}

// The report takes the place of nothing that is read.
void keep_inputs(const Options& options) {
  if (options.out.empty()) return;
  std::vector<fs::path> inputs{options.netlist, options.patterns, options.liberty, options.unreached,
                               options.cells,   options.sdf,      options.readback};
  if (options.scan != "netlist") inputs.emplace_back(options.scan);
  std::erase_if(inputs, [](const fs::path& path) { return path.empty(); });
  require_other_file(options.out, inputs);
}

constexpr const char* kManifest = "manifest.json";
const std::vector<std::string> kPatternFiles = {"patterns.stil", "patterns.wgl", "patterns.avc",
                                                "patterns.atp",  "masks.txt",    "faults.txt"};
const std::vector<std::string> kScanFiles = {"netlist.json", "netlist.v", "cells.v", "scan.json"};
const std::vector<std::string> kFunctionalFiles = {"functional.mvec", "functional.stil", "functional.wgl",
                                                   "functional.avc",  "functional.atp",  "masks.txt"};

// Names and hashes of what an earlier run wrote into the folder, by its manifest.
std::map<std::string, std::string> earlier_files(const fs::path& folder) {
  std::map<std::string, std::string> files;
  if (!fs::is_regular_file(folder / kManifest)) return files;
  const nlohmann::json json = nlohmann::json::parse(read_file(folder / kManifest), nullptr, false);
  if (!json.is_object() || !json.contains("tool") || !json.contains("files") || !json["files"].is_object())
    return files;
  for (const auto& [name, hash] : json["files"].items()) {
    if (hash.is_string()) files[name] = hash;
  }
  files[kManifest] = "";
  return files;
}

// Refuses a folder in which another file has one of these names.
void require_own(const fs::path& folder, std::vector<std::string> names) {
  names.emplace_back(kManifest);
  if (fs::exists(fs::symlink_status(folder)) && !fs::is_directory(folder))
    throw UserError(
        folder.string() +
        ": found what is no folder, expected the name of a folder to write; choose another --out");
  const std::map<std::string, std::string> earlier = earlier_files(folder);
  for (const std::string& name : names) {
    if (fs::exists(fs::symlink_status(folder / name)) && earlier.count(name) == 0)
      throw UserError((folder / name).string() +
                      ": was not written by an earlier run (manifest.json), and would be replaced; choose "
                      "another --out, or move it away");
  }
}

// Files that an earlier run wrote into the folder and this one doesn't: beside the new ones they would pass
// for theirs. What somebody has changed since stays.
void remove_earlier(const fs::path& folder, const std::map<std::string, std::string>& written) {
  for (const auto& [name, hash] : earlier_files(folder)) {
    const fs::path file = folder / name;
    if (written.count(name) != 0 || fs::path(name) != fs::path(name).filename() || !fs::is_regular_file(file))
      continue;
    if (hash == sha256_of(read_file(file))) fs::remove(file);
  }
}

// The manifest of a folder that has nothing else to tell.
void write_manifest(const Options& options, const std::map<std::string, std::string>& written) {
  remove_earlier(options.out, written);
  nlohmann::ordered_json manifest = {
      {"tool", version()},
      {"netlist",
       {{"file", options.netlist.filename().string()}, {"sha256", sha256_of(read_file(options.netlist))}}}};
  for (const auto& [name, hash] : written) manifest["files"][name] = hash;
  write_whole(options.out / kManifest, manifest.dump(2) + "\n");
}

int generate(const Options& options) {
  const auto start = std::chrono::steady_clock::now();
  const CellLibrary library = library_of(options);
  const bool transitions = options.model == "transition";
  std::vector<fs::path> inputs = options.rtl;
  for (const fs::path& path : {options.netlist, options.liberty}) inputs.push_back(path);
  require_apart(options.out, inputs);
  std::vector<std::string> names = kPatternFiles;
  if (!is_bench(options.netlist)) names.insert(names.end(), kScanFiles.begin(), kScanFiles.end());
  require_own(options.out, names);
  ProgressLine line;
  const TestProgram program = make_test_program(options.netlist, library,
                                                {transitions ? FaultModel::transition : FaultModel::stuck_at,
                                                 scan_of(options), generation_of(options, line)});
  const TestSet& set = program.set;
  line.show("writing");
  auto written = write_test_program(program, library, options.out);
  if (program.subject.is_scanned) {
    const std::string chains = scan_json(options, program.subject.design);
    write_whole(options.out / "scan.json", chains);
    written["scan.json"] = sha256_of(chains);
  }
  remove_earlier(options.out, written);
  nlohmann::ordered_json manifest = {
      {"tool", version()},
      {"seed", options.seed},
      {"netlist",
       {{"file", options.netlist.filename().string()}, {"sha256", sha256_of(read_file(options.netlist))}}},
      {"library", options.liberty.empty() ? nlohmann::ordered_json("yosys gates")
                                          : nlohmann::ordered_json(sha256_of(read_file(options.liberty)))},
      {"rtl", hashes(options.rtl)},
      {"patterns", set.patterns.size()},
      {"cycles", program.stream.cycles.size()},
      {"chains", program.subject.design.chains.size()},
      {"aborted", set.aborted},
      {"masked", mask_json(program.masked)},
      {transitions ? "transition" : "stuck_at", coverage_json(program.coverage)}};
  for (const auto& [name, hash] : written) manifest["files"][name] = hash;
  write_whole(options.out / kManifest, manifest.dump(2) + "\n");
  line.clear();
  print_coverage(program.coverage);
  fmt::print("{:<22} {:>10}\n{:<22} {:>10}\n{:<22} {:>10}\n", "aborted", set.aborted, "patterns",
             set.patterns.size(), "cycles", program.stream.cycles.size());
  double generation_s = 0, generation_processor_s = 0;
  fmt::print("{:<22} {:>11} {:>11}\n", "", "time", "processor");
  for (const StepTime& step : set.steps) {
    fmt::print("{:<22} {:>9.2f} s {:>9.2f} s\n", step.name, step.wall_s, step.processor_s);
    generation_s += step.wall_s;
    generation_processor_s += step.processor_s;
  }
  fmt::print("{:<22} {:>9.2f} s {:>9.2f} s\n", "generation", generation_s, generation_processor_s);
  fmt::print("{:<22} {:>9.2f} s\n", "time",
             std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  return set.aborted == 0 ? 0 : 1;
}

// Scan alone.
int insert_chains(const Options& options) {
  const CellLibrary library = library_of(options);
  require_cells(options.netlist);
  require_apart(options.out, {options.netlist, options.liberty});
  require_own(options.out, kScanFiles);
  const TestSubject subject = test_subject(options.netlist, library, scan_of(options));
  if (!subject.is_scanned)
    throw UserError(options.netlist.string() + ": found no flop, expected some to scan");
  const ScanDesign& design = subject.design;
  std::size_t longest = 0;
  for (const ScanChain& chain : design.chains) longest = std::max(longest, chain.cells.size());
  fs::create_directories(options.out);
  std::map<std::string, std::string> written;
  for (const auto& [name, text] : {std::pair("netlist.json", yosys_json_text(design.netlist)),
                                   std::pair("netlist.v", verilog_text(design.netlist)),
                                   std::pair("scan.json", scan_json(options, design))}) {
    write_whole(options.out / name, text);
    written[name] = sha256_of(text);
  }
  write_manifest(options, written);
  fmt::print("{} flops in {} chains of {} at the most\n", subject.view.flops.size(), design.chains.size(),
             longest);
  return 0;
}

bool is_recording(const fs::path& path) { return path.extension() == ".mvec"; }

std::vector<ScanChain> read_chains(const fs::path& path) {
  std::vector<ScanChain> chains;
  try {
    const nlohmann::json json = nlohmann::json::parse(read_file(path));
    for (const nlohmann::json& chain : json.at("chains"))
      chains.push_back({chain.at("name"), chain.at("in"), chain.at("out"), chain.at("cells")});
  } catch (const nlohmann::json::exception& error) {
    throw UserError(
        fmt::format("{}: found {}, expected \"chains\", each with name, in, out and cells, as `vectors "
                    "scan` writes them",
                    path.string(), error.what()));
  }
  return chains;
}

// What a file of patterns holds, whatever its format.
CycleStream read_any(const Options& options) {
  const fs::path& path = options.patterns;
  if (is_recording(path)) return chip_cycles(recording::read_text(path), {}, nullptr, path.string());
  if (path.extension() == ".wgl") return parse_wgl(read_file(path), path.string());
  if (path.extension() != ".vcd" && path.extension() != ".evcd") return read_stil(path);
  TestTiming timing;
  if (!options.timing.empty())
    timing = {options.timing[0], options.timing[1], options.timing[2], options.timing[3], options.timing[4]};
  Directions directions;
  if (path.extension() == ".vcd") {
    if (options.netlist.empty() || is_bench(options.netlist))
      throw UserError(path.string() +
                      ": a plain VCD tells no directions; give --netlist, or an extended VCD");
    for (const Port& port : read_yosys_json(options.netlist).ports) {
      for (std::size_t i = 0; i < port.bits.size(); ++i) directions[port.bit_name(i)] = port.is_input;
    }
  }
  return parse_dump(read_file(path), path.string(), timing, directions);
}

// The same; messages about it name the file.
CycleStream read_cycles(const Options& options) {
  CycleStream stream = read_any(options);
  stream.title = options.patterns.string();
  return stream;
}

// The same, with chains from elsewhere where they are asked for.
CycleStream read_patterns(const Options& options) {
  CycleStream stream = read_cycles(options);
  if (options.scan.empty()) return stream;
  if (!stream.chains.empty())
    throw UserError(fmt::format("{}: found {} chains in the file, expected none with --chains; leave it out",
                                options.patterns.string(), stream.chains.size()));
  if (options.scan == "netlist" && options.netlist.empty())
    throw UserError("--netlist: found nothing, expected the netlist to find the chains in");
  attach_chains(stream,
                options.scan == "netlist" ? trace_chains(read_cells(options.netlist), library_of(options))
                                          : read_chains(options.scan),
                ScanOptions{}.scan_enable);
  return stream;
}

// Vectors without scan, clock by clock, faults drawn at random.
int grade_clock_by_clock(const Options& options, const Netlist& netlist, const CaptureView& view,
                         const CycleStream& stream) {
  const std::vector<Fault> all = collapse(view.circuit).classes;
  const std::size_t faults = options.faults.value_or(kDrawnFaults);
  const std::vector<Fault> sample = faults == 0 ? all : sample_faults(all, faults, options.seed);
  ProgressLine line;
  const FunctionalGrade graded =
      grade_functional(view, stream, sample, kWorkers, PowerUp::zeros, shown_on(line));
  if (!graded.wrong.empty())
    throw UserError(
        fmt::format("{}: {} without a fault, expected vectors that the netlist fulfils; "
                    "`dft replay` runs them",
                    stream.title, graded.wrong));
  std::vector<FaultClass> verdicts;
  for (const std::uint64_t first : graded.first_cycle)
    verdicts.push_back(first == FunctionalGrade::kUndetected ? FaultClass::NO : FaultClass::DS);
  // Detected from one power-up state alone: possibly.
  if (options.two_power_ups) {
    const FunctionalGrade other =
        grade_functional(view, stream, sample, kWorkers, PowerUp::ones, shown_on(line));
    for (std::size_t i = 0; i < sample.size(); ++i) {
      const bool also = other.first_cycle[i] != FunctionalGrade::kUndetected;
      if (also != (verdicts[i] == FaultClass::DS)) verdicts[i] = FaultClass::PT;
    }
  }
  const GradeReport report =
      grade_report(netlist, view, stream, sample, verdicts, graded,
                   options.unreached.empty() ? std::vector<Unreached>() : read_unreached(options.unreached));
  line.clear();
  if (!options.out.empty()) write_whole(options.out, report.text);
  const ToggleCoverage& toggle = graded.toggle;
  const auto detected =
      static_cast<std::size_t>(std::count(verdicts.begin(), verdicts.end(), FaultClass::DS));
  const auto row = [](const char* name, std::size_t count) { fmt::print("{:<22} {:>10}\n", name, count); };
  row("cycles", graded.cycles);
  row("faults graded", sample.size());
  row("detected", detected);
  if (options.two_power_ups)
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

int record_functional(const Options& options) {
  const FunctionalSources sources{options.netlist, options.liberty};
  require_apart(options.out, {sources.netlist, sources.library});
  for (const fs::path& path : {sources.netlist, sources.library}) {
    if (!path.empty()) read_file(path);  // recording takes minutes
  }
  require_own(options.out, kFunctionalFiles);
  fs::create_directories(options.out);
  ProgressLine line;
  const FunctionalSet set = options.board ? board_set() : functional_set(options.length, shown_on(line));
  line.clear();
  const FunctionalFolder written = write_functional_set(set, sources, options.out);
  fmt::print("{} clocks in {} vectors, {} pieces, {} strobes masked\n", written.clocks, written.vectors,
             set.pieces.size(), written.masked);
  return 0;
}

// Every strobe that the file leaves open.
void report_masks(const Options& options, const CycleStream& stream) {
  const std::vector<dft::MaskedStrobes> masked = masked_strobes(stream, ScanOptions{}.scan_enable);
  const MaskSummary sums = summary(masked);
  const auto outputs = static_cast<std::uint64_t>(std::count_if(
      stream.signals.begin(), stream.signals.end(), [](const TestSignal& s) { return !s.is_input; }));
  write_whole(options.out, mask_text(masked));
  fmt::print("{} of {} strobes masked\n", sums.masked, outputs * cycle_count(stream));
  for (const auto& [reason, strobes] : sums.reasons) fmt::print("{:>12}  {}\n", strobes, reason);
}

int report_replay(std::uint64_t cycles, std::uint64_t strobes, std::uint64_t mismatches,
                  const std::string& first) {
  fmt::print("{} cycles, {} strobes, {} mismatches\n", cycles, strobes, mismatches);
  if (mismatches != 0) fmt::print("first: {}\n", first);
  return mismatches == 0 ? 0 : 1;
}

// A stream without scan, on whatever it is asked for.
int replay_functional_stream(const Options& options, const CycleStream& stream) {
  ProgressLine line;
  if (options.on == "netlist") {
    const CaptureView view = view_to_replay(options.netlist, library_of(options));
    const ReplayResult result = replay_cycles(view, stream, kPowerUps, options.seed, shown_on(line));
    line.clear();
    return report_replay(result.cycles, result.strobes, result.mismatches, result.first);
  }
  const PinReplay result =
      replay_cycles_on(stream, options.on == "rtl" ? ReplayDevice::rtl : ReplayDevice::model, shown_on(line));
  line.clear();
  return report_replay(result.clocks, result.strobes, result.mismatches, result.first);
}

int grade_patterns(const Options& options) {
  keep_inputs(options);
  const CellLibrary library = library_of(options);
  const CycleStream stream = read_patterns(options);
  if (!is_bench(options.netlist) && stream.chains.empty()) {
    const Netlist netlist = read_yosys_json(options.netlist);
    const CaptureView plain = capture_view(netlist, library);
    if (!plain.flops.empty()) return grade_clock_by_clock(options, netlist, plain, stream);
  }
  const char* const needless = options.faults               ? "--faults"
                               : options.two_power_ups      ? "--two-power-ups"
                               : !options.unreached.empty() ? "--unreached"
                                                            : nullptr;
  if (needless != nullptr)
    throw UserError(fmt::format(
        "{}: found {}, expected vectors without scan of a netlist with flops for {}; leave it out: every "
        "fault is graded",
        options.patterns.string(), stream.chains.empty() ? "a netlist without flops" : "scan patterns",
        needless));
  ProgressLine line;
  const GradedFile file = grade_file(options.netlist, library, stream, shown_on(line));
  line.clear();
  if (!options.out.empty())
    write_whole(options.out, fault_report(file.list, file.reported, file.graded, [&](std::size_t fault) {
                  return fault_name(file.circuit, fault);
                }));
  print_coverage(coverage(file.list, file.reported));
  fmt::print("{:<22} {:>10}\n", "patterns", file.patterns);
  return 0;
}

int check_scan_rules(const Options& options) {
  const std::vector<RuleViolation> violations = check_rules(read_cells(options.netlist), library_of(options));
  for (const RuleViolation& v : violations) fmt::print("{}: {}: {}\n", v.rule, v.offender, v.text);
  fmt::print("{} violations\n", violations.size());
  return violations.empty() ? 0 : 1;
}

TesterProfile tester_of(const fs::path& path) {
  constexpr std::int64_t kMostCount = 1'000'000'000'000;
  TesterProfile profile;
  if (path.empty()) return profile;
  const toml::table table = parse_toml(path, "a tester's profile (TOML)");
  TomlSection tester(path, &table, "");
  const auto time_ns = [&](const char* key, double fallback) {
    return tester.number(key, fallback, 1e-6, 1e9);
  };
  const auto count = [&](const char* key, std::uint64_t fallback) {
    return static_cast<std::uint64_t>(
        tester.integer(key, static_cast<std::int64_t>(fallback), 1, kMostCount));
  };
  profile.name = tester.text("name", profile.name);
  profile.least_period_ns = time_ns("least_period_ns", profile.least_period_ns);
  profile.edge_resolution_ns = time_ns("edge_resolution_ns", profile.edge_resolution_ns);
  profile.least_pulse_ns = time_ns("least_pulse_ns", profile.least_pulse_ns);
  profile.vector_memory = count("vector_memory", profile.vector_memory);
  profile.pins = count("pins", profile.pins);
  tester.finish();
  // A limit that nobody told would count as kept.
  for (const char* limit :
       {"least_period_ns", "edge_resolution_ns", "least_pulse_ns", "vector_memory", "pins"}) {
    if (!tester.has(limit)) tester.fail(limit, "nothing", "every limit of the tester in its profile");
  }
  return profile;
}

int lint_patterns(const Options& options) {
  const CycleStream stream = read_patterns(options);
  const std::vector<std::string> reasons = lint(stream, tester_of(options.tester));
  for (const std::string& reason : reasons) fmt::print("{}\n", reason);
  fmt::print("{} cycles in {} vectors, {} signals, {} complaints\n", cycle_count(stream),
             stream.cycles.size(), stream.signals.size(), reasons.size());
  return reasons.empty() ? 0 : 1;
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

int replay_patterns(const Options& options) {
  const bool on_chip = options.on == "model" || options.on == "rtl", on_fpga = options.on == "fpga";
  if (on_fpga && options.readback.empty())
    throw UserError("--readback: found nothing, expected the Verilog read back from the bitstream");
  if (!on_chip && !on_fpga && options.netlist.empty())
    throw UserError("--netlist: found nothing, expected the netlist to run on");
  keep_inputs(options);
  CycleStream stream = read_patterns(options);
  require_order(stream);
  if (options.cycles != 0) keep_first(stream, options.cycles);
  if (!options.out.empty()) report_masks(options, stream);
  if (on_fpga) {
    const TemporaryFolder folder;
    ProgressLine line;
    const ReplayResult result =
        replay_verilog_in_icarus(options.readback, stream, folder.path(), shown_on(line));
    line.clear();
    return report_replay(result.cycles, result.strobes, result.mismatches, result.first);
  }
  if (stream.chains.empty() && options.on != "icarus") return replay_functional_stream(options, stream);
  if (on_chip)
    throw UserError(fmt::format("{}: found scan patterns for --on {}, expected functional vectors",
                                options.patterns.string(), options.on));
  const CellLibrary library = library_of(options);
  const Netlist netlist = read_cells(options.netlist);
  name_as_ports(stream, netlist);
  // What the file tells of its cells must be so; it needn't tell any.
  const bool tells_cells = std::any_of(stream.chains.begin(), stream.chains.end(),
                                       [](const ScanChain& chain) { return !chain.cells.empty(); });
  if (tells_cells) require_chains(stream, capture_view(netlist, library), netlist.file);
  ReplayResult result;
  ProgressLine line;
  if (options.on == "icarus") {
    const TemporaryFolder folder;
    result = replay_in_icarus(netlist, library, stream, folder.path(), {options.cells, options.sdf},
                              shown_on(line));
  } else {
    result = replay(capture_view(netlist, library), stream, ScanOptions{}.scan_enable, options.seed, {},
                    shown_on(line));
  }
  line.clear();
  return report_replay(result.cycles, result.strobes, result.mismatches, result.first);
}

CLI::Validator one_of(std::vector<std::string> words) {
  const std::string known = fmt::format("{}", fmt::join(words, ", "));
  const auto refusal = [=](const std::string& text) {
    if (std::find(words.begin(), words.end(), text) != words.end()) return std::string();
    return fmt::format("found {}, expected one of: {}", text, known);
  };
  return {refusal, "one of: " + known};
}

ProofFile proof_file(const fs::path& path) { return {path.string(), read_file(path)}; }

// Names of proofs that lie in the folder already, whoever wrote them.
std::vector<std::string> proofs_in(const fs::path& folder) {
  std::vector<std::string> names;
  if (!fs::is_directory(folder)) return names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    if (name.string().starts_with("class") && (name.extension() == ".cnf" || name.extension() == ".drat"))
      names.push_back(name.string());
  }
  return names;
}

int prove(const Options& options) {
  require_apart(options.out, {options.netlist, options.liberty});
  std::vector<std::string> names = proofs_in(options.out);
  names.emplace_back("index.txt");
  require_own(options.out, names);
  const CellLibrary library = library_of(options);
  const TestSubject subject = test_subject(options.netlist, library, scan_of(options));
  ProgressLine line;
  const TestSet set = generate_tests(subject.circuit, generation_of(options, line));
  fs::create_directories(options.out);
  TestSolver solver(subject.circuit);
  std::size_t proved = 0, refused = 0;
  std::set<std::uint32_t> done;
  std::string index;
  std::map<std::string, std::string> written;
  for (std::size_t f = 0; f < set.faults.total(); ++f) {
    tell(shown_on(line), "proving", f, set.faults.total());
    const std::uint32_t c = set.faults.class_of[f];
    if (c == FaultList::kNoClass || set.of_class[c] != FaultClass::UR) continue;
    const std::string name = fmt::format("class{}", c);
    index += fmt::format("{} {}\n", name, fault_name(subject.circuit, f));
    if (!done.insert(c).second) continue;  // an equivalent fault had it
    std::string reason;
    const bool good = solver.prove_untestable(set.faults.classes[c], options.out, name) &&
                      refutes(proof_file(options.out / (name + ".cnf")),
                              proof_file(options.out / (name + ".drat")), reason);
    for (const std::string& file : {name + ".cnf", name + ".drat"}) {
      if (fs::exists(options.out / file)) written[file] = sha256_of(read_file(options.out / file));
    }
    ++(good ? proved : refused);
    if (!good) fmt::print("{}: {}\n", name, reason.empty() ? "not refuted" : reason);
  }
  line.clear();
  write_whole(options.out / "index.txt", index);
  written["index.txt"] = sha256_of(index);
  write_manifest(options, written);
  fmt::print("{} classes proved untestable, {} refused\n", proved, refused);
  return refused == 0 ? 0 : 1;
}

// Where a tester stops to measure the supply current, and what it sees there.
int iddq(const Options& options) {
  const CellLibrary library = library_of(options);
  const TestSubject subject = test_subject(options.netlist, library, scan_of(options));
  if (!subject.is_scanned)
    throw UserError(options.netlist.string() + ": found no flop, expected some to load states into");
  ProgressLine line;
  const IddqStops stops =
      scan_iddq_stops(subject.design, subject.view, options.stops, generation_of(options, line));
  line.clear();
  for (std::size_t i = 0; i < stops.states.size(); ++i)
    fmt::print("stop {:<17} {:>10}\n", i + 1, stops.detected[i]);
  fmt::print("{:<22} {:>10}\n{:<22} {:>9.2f} %\n", "faults", stops.faults - stops.tied, "coverage",
             100 * stops.coverage());
  return 0;
}

int check_proof(const Options& options) {
  std::string reason;
  const bool good = refutes(proof_file(options.cnf), proof_file(options.proof), reason);
  fmt::print("{}\n", good ? "verified" : "refused: " + reason);
  return good ? 0 : 1;
}

}  // namespace

Action add_dft_command(CLI::App& cli, const std::string&) {
  auto options = std::make_shared<Options>();
  CLI::App* command = cli.add_subcommand(
      "dft", "Scan, test patterns and sign-off vectors for a flat netlist (docs/make/test-vectors.md)");
  command->require_subcommand(1);
  const auto netlist_of = [&](CLI::App* sub, const char* kinds = "Yosys JSON (flat, mapped) or .bench") {
    sub->add_option("NETLIST", options->netlist, kinds)->required();
    sub->add_option("--liberty", options->liberty, "Library of its cells (default: Yosys' own gates)");
  };
  const auto chains_of = [&](CLI::App* sub) {
    sub->add_option("--chains", options->chains,
                    "Scan chains (default 8) of a netlist without ports scan_i and scan_o")
        ->check(whole_number_from(1, 1024));
    sub->add_option("--reset", options->reset,
                    "Port that resets in test mode (default: the one that resets flops)");
  };
  const auto seed_of = [&](CLI::App* sub, const char* what) {
    sub->add_option("--seed", options->seed, what)->check(whole_number_from(0, UINT64_MAX));
  };
  const auto generation_options_of = [&](CLI::App* sub) {
    chains_of(sub);
    sub->add_option("--conflicts", options->conflicts,
                    "Give a fault up after so many conflicts of the solver (default, and 0: never)")
        ->check(whole_number_from(0, UINT32_MAX));
    seed_of(sub, "Seed of random patterns and fills (default 1)");
  };
  CLI::App* sub_generate = command->add_subcommand(
      "generate", "Insert scan, generate tests, write them and a verdict on every fault");
  netlist_of(sub_generate);
  generation_options_of(sub_generate);
  sub_generate->add_option("--rtl", options->rtl,
                           "Sources of the netlist: their hashes go into the manifest");
  sub_generate
      ->add_option("--faults", options->model,
                   "stuck-at (default), or transition: launched and captured by two clocks in a row")
      ->check(one_of({"stuck-at", "transition"}));
  sub_generate->add_option("--out", options->out, "Folder to write")->required();
  CLI::App* sub_scan = command->add_subcommand("scan", "Insert scan alone: netlist and order of the chains");
  netlist_of(sub_scan, "Yosys JSON (flat, mapped)");
  chains_of(sub_scan);
  sub_scan->add_option("--out", options->out, "Folder to write")->required();
  CLI::App* sub_grade = command->add_subcommand("grade", "Which faults patterns detect");
  netlist_of(sub_grade);
  sub_grade
      ->add_option("--patterns", options->patterns,
                   "STIL, WGL (.wgl), dump (.vcd, .evcd), or recording of the chip's pins (.mvec)")
      ->required();
  sub_grade
      ->add_option("--faults", options->faults,
                   "Vectors without scan: so many faults at random, 0 for all (default 1022)")
      ->check(whole_number_from(0, UINT32_MAX));
  seed_of(sub_grade, "Vectors without scan: seed of the draw (default 1)");
  sub_grade->add_flag("--two-power-ups", options->two_power_ups,
                      "Vectors without scan: all flops at 0 and at 1 first; tells possibly detected faults");
  sub_grade->add_option("--unreached", options->unreached,
                        "Vectors without scan: what function cannot move, and why (TOML)");
  sub_grade->add_option("--report", options->out,
                        "File for one line a fault, and an output that stands still");
  const auto timing_of = [&](CLI::App* sub) {
    sub->add_option("--timing", options->timing,
                    "Dumps: period, drive, strobe, clock rise, clock fall, ns (default 100,0,40,50,80)")
        ->delimiter(',')
        ->expected(5);
  };
  timing_of(sub_grade);
  const auto scan_options_of = [&](CLI::App* sub) {
    sub->add_option(
        "--chains", options->scan,
        "Files without scan chains: where they stand, scan.json of `dft generate` or `scan`, or the "
        "word netlist: found in it");
  };
  scan_options_of(sub_grade);
  CLI::App* sub_functional = command->add_subcommand(
      "functional", "Record the chip's functional set (.mvec), labelled by requirement");
  sub_functional->add_option("--out", options->out, "Folder to write")->required();
  sub_functional->add_option("--netlist", options->netlist,
                             "Netlist that the set is meant for: its hash goes into the manifest");
  sub_functional->add_option("--liberty", options->liberty, "Library of its cells: likewise");
  sub_functional->add_flag_callback(
      "--quick", [=] { options->length = FunctionalLength::quick; }, "Each register written once");
  sub_functional->add_flag("--board", options->board, "The set for the chip on a small FPGA (fpga/ice40)")
      ->excludes("--quick");
  CLI::App* sub_rules = command->add_subcommand("rules", "Breaches of the rules that scan asks for");
  netlist_of(sub_rules, "Yosys JSON (flat, mapped)");
  CLI::App* sub_lint =
      command->add_subcommand("lint", "Read a STIL or WGL file and check it against a tester");
  sub_lint->add_option("PATTERNS", options->patterns, "STIL file")->required();
  sub_lint->add_option("--tester", options->tester, "Tester profile (TOML)");
  CLI::App* sub_replay =
      command->add_subcommand("replay", "Run a STIL file on the scanned netlist, or a recording on the chip");
  sub_replay
      ->add_option("PATTERNS", options->patterns,
                   "STIL, WGL (.wgl), dump (.vcd, .evcd), or recording of the chip's pins (.mvec)")
      ->required();
  sub_replay->add_option("--netlist", options->netlist,
                         "Yosys JSON: of the scanned netlist for STIL, any for recordings");
  sub_replay->add_option("--liberty", options->liberty, "Library of its cells (default: Yosys' own gates)");
  sub_replay
      ->add_option(
          "--on", options->on,
          "netlist (default), icarus; model or rtl for the chip's vectors without scan; fpga for a block's")
      ->check(one_of({"netlist", "icarus", "model", "rtl", "fpga"}));
  sub_replay->add_option("--readback", options->readback,
                         "For --on fpga: Verilog of what was read back from a bitstream (icebox_vlog)");
  sub_replay->add_option("--report", options->out, "File for every strobe that is not made, and why");
  seed_of(sub_replay, "Seed of what fills unknowns (default 1)");
  CLI::Option* cells =
      sub_replay->add_option("--cells", options->cells, "Verilog of the cells with specify blocks");
  sub_replay->add_option("--sdf", options->sdf, "Delays of the netlist's instances, for --on icarus")
      ->needs(cells);
  timing_of(sub_replay);
  scan_options_of(sub_replay);
  sub_replay->add_option("--cycles", options->cycles, "Only so many cycles from the first (default: all)")
      ->check(whole_number_from(1, UINT64_MAX));
  CLI::App* sub_prove =
      command->add_subcommand("prove", "A checked refutation for every fault called redundant");
  netlist_of(sub_prove);
  generation_options_of(sub_prove);
  sub_prove->add_option("--out", options->out, "Folder for .cnf and .drat")->required();
  CLI::App* sub_iddq = command->add_subcommand("iddq", "Pseudo-stuck-at coverage of supply current stops");
  netlist_of(sub_iddq, "Yosys JSON (flat, mapped)");
  generation_options_of(sub_iddq);
  sub_iddq->add_option("--stops", options->stops, "At the most (default 20)")
      ->check(whole_number_from(1, 10000));
  CLI::App* sub_check = command->add_subcommand("check-proof", "Check one refutation");
  sub_check->add_option("CNF", options->cnf, "DIMACS file")->required();
  sub_check->add_option("PROOF", options->proof, "DRAT file in text")->required();
  const Action test = add_tester_command(*command), diagnose = add_diagnose_command(*command);
  return [=] {
    if (command->got_subcommand("tester")) return test();
    if (command->got_subcommand("diagnose")) return diagnose();
    if (*sub_generate) return generate(*options);
    if (*sub_scan) return insert_chains(*options);
    if (*sub_grade) return grade_patterns(*options);
    if (*sub_functional) return record_functional(*options);
    if (*sub_rules) return check_scan_rules(*options);
    if (*sub_lint) return lint_patterns(*options);
    if (*sub_replay) return replay_patterns(*options);
    if (*sub_prove) return prove(*options);
    if (*sub_iddq) return iddq(*options);
    return check_proof(*options);
  };
}

}  // namespace meltstage::app
