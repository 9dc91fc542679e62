// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/commands/dft/subcommands.hpp"
#include "app/number_range.hpp"
#include "asic/dft/diagnosis/defect.hpp"
#include "asic/dft/diagnosis/fail_log.hpp"
#include "asic/dft/diagnosis/findings.hpp"
#include "asic/dft/diagnosis/program_on_netlist.hpp"
#include "asic/dft/diagnosis/tester.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"

namespace meltstage::app {
namespace {

namespace fs = std::filesystem;
using namespace dft;

struct DiagnosisOptions {
  fs::path patterns, netlist, liberty, out;
  std::vector<fs::path> logs;
  std::vector<std::string> defects;
  std::size_t room = std::numeric_limits<std::size_t>::max();
  std::size_t shown = 5;
  std::uint64_t seed = 1;
};

CellLibrary cells_of(const DiagnosisOptions& options) {
  return options.liberty.empty() ? yosys_library() : read_liberty(options.liberty);
}

void program_options_of(CLI::App* sub, DiagnosisOptions& options) {
  sub->add_option("PATTERNS", options.patterns, "STIL, or WGL (.wgl)")->required();
  sub->add_option("--netlist", options.netlist, "Scanned netlist (Yosys JSON), or a .bench")->required();
  sub->add_option("--liberty", options.liberty, "Library of its cells (default: Yosys' own gates)");
}

int play_on_tester(const DiagnosisOptions& options) {
  std::vector<fs::path> inputs{options.patterns, options.netlist};
  if (!options.liberty.empty()) inputs.push_back(options.liberty);
  require_other_file(options.out, inputs);
  const ProgramOnNetlist program = read_program(options.patterns, options.netlist, cells_of(options));
  TestedChip chip{{}, options.seed};
  for (const std::string& text : options.defects)
    chip.defects.push_back(parse_defect(program.view.circuit, text));
  ProgressLine line;
  const FailLog log = kept_in_memory(
      test_chip(program.view, program.stream, program.scan_enable, chip, shown_on(line)), options.room);
  line.clear();
  write_whole(options.out, fail_log_text(log, program.stream));
  fmt::print("{} failed strobes{}\n", log.fails.size(), log.truncated ? ", then the memory was full" : "");
  return log.fails.empty() ? 0 : 1;
}

void print_suspects(const std::vector<ChainSuspect>& suspects, const LineNames& names, std::size_t most) {
  if (suspects.empty() || suspects[0].agreement < kLeastAgreement)
    fmt::print("    no defect of one line that was tried fails as the chip does\n");
  for (std::size_t i = 0; i < std::min(most, suspects.size()); ++i) {
    const auto& [defect, agreement] = suspects[i];
    fmt::print("    {:>5.1f} % alike  {} {}\n", 100 * agreement, names.of(defect.line),
               to_string(defect.kind));
  }
  if (suspects.size() > most) fmt::print("    and {} more\n", suspects.size() - most);
}

void print_captures(const Diagnosis& diagnosis, const LineNames& names, std::size_t most) {
  fmt::print("  {} of {} patterns fail", diagnosis.failing_patterns,
             diagnosis.failing_patterns + diagnosis.passing_patterns);
  if (diagnosis.unexplained_patterns != 0)
    fmt::print(", {} of them by no single line", diagnosis.unexplained_patterns);
  if (diagnosis.elsewhere != 0) fmt::print("; {} strobes outside captures fail", diagnosis.elsewhere);
  fmt::print("\n");
  for (std::size_t d = 0; d < diagnosis.defects.size(); ++d) {
    const std::vector<Suspect>& suspects = diagnosis.defects[d].suspects;
    fmt::print("  defect {}: {} suspects\n", d + 1, suspects.size());
    for (std::size_t i = 0; i < std::min(most, suspects.size()); ++i) {
      const Suspect& s = suspects[i];
      std::string other;
      for (const Node node : s.others) other += (other.empty() ? " " : " or ") + names.of({node, kStem});
      fmt::print("    {:>4} explained {:>4} against  {} {}{}\n", s.explained, s.contradicted,
                 names.of(s.line), to_string(s.behaviour), other);
    }
    if (suspects.size() > most) fmt::print("    and {} more\n", suspects.size() - most);
  }
}

void print_findings(const Findings& findings, const ProgramOnNetlist& program, const LogReader& reader,
                    std::size_t most) {
  for (const BrokenChain& found : findings.chains) {
    const ScanChain& chain = program.stream.chains[found.chain];
    fmt::print("  chain {} is broken, likeliest at cell {} of {}, {}\n", chain.name, found.cell + 1,
               chain.cells.size(), chain.cells[std::min(found.cell, chain.cells.size() - 1)]);
    print_suspects(found.suspects, reader.lines_of_chip(), most);
  }
  if (!findings.chains.empty()) return;
  print_captures(findings.captures, reader.lines(), most);
  if (findings.resets.empty()) return;
  fmt::print("  cells are not reset\n");
  print_suspects(findings.resets, reader.lines_of_chip(), most);
}

// Over several chips: how often each net is to blame; those that can't be told apart share a chip.
void print_pareto(const std::vector<std::vector<std::string>>& blamed, std::size_t most) {
  std::map<std::string, double> share;
  for (const auto& nets : blamed)
    for (const std::string& net : nets) share[net] += 1.0 / static_cast<double>(nets.size());
  std::vector<std::pair<std::string, double>> nets(share.begin(), share.end());
  std::stable_sort(nets.begin(), nets.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  fmt::print("{} chips, by net\n", blamed.size());
  for (std::size_t i = 0; i < std::min(most, nets.size()); ++i)
    fmt::print("  {:>6.2f}  {}\n", nets[i].second, nets[i].first);
}

int diagnose_logs(const DiagnosisOptions& options) {
  const ProgramOnNetlist program = read_program(options.patterns, options.netlist, cells_of(options));
  std::vector<FailLog> logs;
  for (const fs::path& path : options.logs) logs.push_back(read_fail_log(path, program.stream));
  const LogReader reader(program);
  std::vector<std::vector<std::string>> blamed;  // best of each chip that fails
  bool all_explained = true;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    fmt::print("{}: {} failed strobes{}\n", escaped(options.logs[i].string()), logs[i].fails.size(),
               logs[i].truncated ? ", then the tester's memory was full" : "");
    if (logs[i].fails.empty()) continue;
    ProgressLine line;
    const Findings findings = reader.findings(logs[i], shown_on(line));
    line.clear();
    print_findings(findings, program, reader, options.shown);
    if (findings.blamed.empty())
      all_explained = false;
    else
      blamed.push_back(findings.blamed[0]);
  }
  if (blamed.size() > 1) print_pareto(blamed, 2 * options.shown);
  return all_explained ? 0 : 1;
}

}  // namespace

Action add_tester_command(CLI::App& dft) {
  auto options = std::make_shared<DiagnosisOptions>();
  CLI::App* sub = dft.add_subcommand("tester", "Play patterns on a chip with defects and write its fail log");
  show_example(sub,
               "dft tester patterns.stil --netlist netlist.json --defect \"up_i stuck-at-0\" --out chip.log");
  program_options_of(sub, *options);
  sub->add_option("--defect", options->defects,
                  "\"CELL/PIN stuck-at-0\" (stuck-at-1, slow-to-rise, slow-to-fall), or a bridge: \"CELL/PIN "
                  "dominated-by CELL/PIN\" (wired-and, wired-or); none: a good chip");
  sub->add_option("--memory", options->room, "Failed strobes that the tester can keep (default: all)")
      ->check(whole_number_from(1, UINT32_MAX));
  sub->add_option("--seed", options->seed, "Of what the flops hold at power-up (default 1)")
      ->check(whole_number_from(0, UINT64_MAX));
  sub->add_option("--out", options->out, "Fail log to write")->required();
  return [=] { return play_on_tester(*options); };
}

Action add_diagnose_command(CLI::App& dft) {
  auto options = std::make_shared<DiagnosisOptions>();
  CLI::App* sub = dft.add_subcommand("diagnose", "Find the lines that explain a tester's fail logs");
  show_example(sub, "dft diagnose patterns.stil chip.log --netlist netlist.json");
  program_options_of(sub, *options);
  sub->add_option("LOGS", options->logs, "Fail logs, one a chip")->required();
  sub->add_option("--suspects", options->shown, "Lines shown of each defect (default 5)")
      ->check(whole_number_from(1, 10000));
  return [=] { return diagnose_logs(*options); };
}

}  // namespace meltstage::app
