// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/commands/dft/inputs.hpp"
#include "app/commands/dft/outputs.hpp"
#include "app/commands/dft/subcommands.hpp"
#include "asic/dft/program.hpp"
#include "asic/dft/scan/masks.hpp"
#include "asic/signoff/vectors_files.hpp"
#include "base/build_stamp.hpp"
#include "base/output_file.hpp"
#include "base/terminal.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct GenerateInput : NetlistInput {
  GenerationInput generation;
  std::string model = "stuck-at";
  std::vector<fs::path> rtl;
  fs::path out;
};

const std::vector<std::string> kPatternFiles = {"patterns.stil", "patterns.wgl", "patterns.avc",
                                                "patterns.atp",  "masks.txt",    "faults.txt"};

nlohmann::ordered_json hashes(const std::vector<fs::path>& files) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const fs::path& file : files) json[file.filename().string()] = sha256_of(read_file(file));
  return json;
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

int generate(const GenerateInput& input) {
  const auto start = std::chrono::steady_clock::now();
  const CellLibrary library = library_of(input);
  const bool transitions = input.model == "transition";
  std::vector<fs::path> inputs = input.rtl;
  for (const fs::path& path : {input.netlist, input.liberty}) inputs.push_back(path);
  require_apart(input.out, inputs);
  std::vector<std::string> names = kPatternFiles;
  if (!is_bench(input.netlist)) names.insert(names.end(), kScanFiles.begin(), kScanFiles.end());
  require_own(input.out, names);
  ProgressLine line;
  const TestProgram program =
      make_test_program(input.netlist, library,
                        {transitions ? FaultModel::transition : FaultModel::stuck_at,
                         scan_of(input.generation.scan), generation_of(input.generation, line)});
  const TestSet& set = program.set;
  line.show("writing");
  const OutputClaim claim(input.out, names);
  auto written = write_test_program(program, library, input.out);
  if (program.subject.is_scanned) {
    const std::string chains = scan_json(input.netlist, program.subject.design);
    write_whole(input.out / "scan.json", chains);
    written["scan.json"] = sha256_of(chains);
  }
  remove_earlier(input.out, written);
  nlohmann::ordered_json manifest = {
      {"tool", version()},
      {"seed", input.generation.seed},
      {"netlist",
       {{"file", input.netlist.filename().string()}, {"sha256", sha256_of(read_file(input.netlist))}}},
      {"library", input.liberty.empty() ? nlohmann::ordered_json("yosys gates")
                                        : nlohmann::ordered_json(sha256_of(read_file(input.liberty)))},
      {"rtl", hashes(input.rtl)},
      {"patterns", set.patterns.size()},
      {"cycles", program.stream.cycles.size()},
      {"chains", program.subject.design.chains.size()},
      {"aborted", set.aborted},
      {"masked", mask_json(program.masked)},
      {transitions ? "transition" : "stuck_at", coverage_json(program.coverage)}};
  for (const auto& [name, hash] : written) manifest["files"][name] = hash;
  write_whole(input.out / kManifest, manifest.dump(2) + "\n");
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

}  // namespace

Action add_generate_command(CLI::App& dft) {
  auto input = std::make_shared<GenerateInput>();
  CLI::App* sub =
      dft.add_subcommand("generate", "Insert scan, generate tests, write them and a verdict on every fault");
  show_example(sub, "dft generate netlist.json --liberty cells.lib --out patterns");
  netlist_options_of(*sub, *input, kCellsOrBench);
  generation_options_of(*sub, input->generation);
  sub->add_option("--rtl", input->rtl, "Sources of the netlist: their hashes go into the manifest");
  sub->add_option("--faults", input->model,
                  "stuck-at (default), or transition: launched and captured by two clocks in a row")
      ->check(one_of({"stuck-at", "transition"}));
  sub->add_option("--out", input->out, "Folder to write")->required();
  return [=] { return generate(*input); };
}

}  // namespace meltstage::app
