// SPDX-License-Identifier: Apache-2.0
// A second opinion on the fault list and its grading: Yosys lists every stuck pin and builds them into the
// netlist, Icarus runs them.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "asic/dft/atpg/generate.hpp"
#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/scan/replay.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

struct Mutant {
  std::string arguments;  // of `mutate`
  std::string pin;        // cell/PIN
  bool stuck;
};

// All stuck pins that Yosys finds.
std::vector<Mutant> mutants_of(const TestFolder& folder, const std::string& json) {
  std::vector<Mutant> mutants;
  for (const char* mode : {"const0", "const1"}) {
    const std::string list = (folder.path() / mode).string();
    const std::string command = "yosys -q -p 'read_liberty -lib " MINI_LIB "; read_json " + json +
                                "; mutate -list 100000 -none -mode " + mode + " -o " + list + "' > /dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0);
    std::ifstream file(list);
    std::set<std::string> seen;
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      std::map<std::string, std::string> options;
      std::string arguments;
      for (std::string word, value; words >> word;) {
        if (word == "mutate") continue;
        if (!(words >> value)) break;
        options[word] = value;
        if (word != "-src") arguments += word + " " + value + " ";
      }
      if (options.count("-cell") == 0) continue;
      const auto plain = [](const std::string& name) { return name[0] == '\\' ? name.substr(1) : name; };
      const std::string pin = plain(options["-cell"]) + "/" + plain(options["-port"]);
      if (seen.insert(pin).second) mutants.push_back({arguments, pin, mode[5] == '1'});
    }
  }
  return mutants;
}

TEST(Mutate, YosysAndIcarusFindTheSameFaults) {
  const TestFolder folder;
  const std::string json = std::string(CIRCUITS) + "/adder.json";
  const Netlist netlist = circuit_netlist("adder");
  const CaptureView view = capture_view(netlist, mini_library());
  const FaultList list = collapse(view.circuit);
  const std::vector<Pattern> patterns =
      random_patterns(5, 6, view.circuit.inputs().size());  // few, so that some faults escape
  const Grade own = grade(view.circuit, blocks_of(patterns, view.circuit.inputs().size()), list.classes, 1);
  std::map<std::string, bool> detected;
  std::size_t pins = 0;
  for (std::size_t f = 0; f < list.total(); ++f) {
    detected[fault_name(view.circuit, f)] = own.detections[list.class_of[f]] != 0;
    pins += view.circuit.sites()[f / 2].name.find('/') != std::string::npos ? 1 : 0;
  }
  const std::vector<Mutant> mutants = mutants_of(folder, json);
  EXPECT_EQ(mutants.size(), pins);  // both list every pin of every cell

  std::string script = "read_liberty -lib " MINI_LIB "\nread_json " + json + "\n";
  for (std::size_t i = 0; i < mutants.size(); ++i)
    script += "mutate -ctrl mutsel 16 " + std::to_string(i + 1) + " " + mutants[i].arguments + "\n";
  script += "write_verilog -noattr " + (folder.path() / "mutated.v").string() + "\n";
  const auto ys = folder.file("mutate.ys", script);
  ASSERT_EQ(std::system(("yosys -q " + ys.string() + " > /dev/null").c_str()), 0);
  folder.file("cells.v", cell_models(netlist, mini_library()));
  std::string bench =
      "module bench;\n  reg [15:0] sel; reg [3:0] a, b; reg c; wire [4:0] sum; integer m; reg seen;\n  reg "
      "[4:0] good [0:63];\n"
      "  adder dut(.a(a), .b(b), .c(c), .sum(sum), .mutsel(sel));\n"
      "  task run(input integer k); begin\n";
  for (std::size_t p = 0; p < patterns.size(); ++p) {
    bench += "    {";
    for (std::size_t i = 0; i < view.input_ports.size(); ++i)
      bench += (i == 0 ? "" : ", ") + view.input_ports[i];
    bench += "} = " + std::to_string(view.input_ports.size()) + "'b";
    for (const std::uint8_t bit : patterns[p]) bench += bit != 0 ? '1' : '0';
    bench += "; #1; if (k == 0) good[" + std::to_string(p) + "] = sum; else if (good[" + std::to_string(p) +
             "] !== sum) seen = 1;\n";
  }
  bench +=
      "  end endtask\n  initial begin\n    sel = 0; run(0);\n    for (m = 1; m <= " +
      std::to_string(mutants.size()) +
      "; m = m + 1) begin sel = m; seen = 0; run(m); $display(\"%0d %b\", m, seen); end\n  end\nendmodule\n";
  folder.file("bench.v", bench);
  ASSERT_EQ(std::system(("cd " + folder.path().string() +
                         " && iverilog -g2012 -o b.vvp bench.v mutated.v cells.v && vvp -n b.vvp > out.txt")
                            .c_str()),
            0);
  std::ifstream out(folder.path() / "out.txt");
  std::size_t number = 0, compared = 0, caught = 0;
  for (char seen = 0; out >> number >> seen; ++compared) {
    const Mutant& mutant = mutants[number - 1];
    const auto mine = detected.find(mutant.pin + (mutant.stuck ? " stuck-at-1" : " stuck-at-0"));
    ASSERT_NE(mine, detected.end()) << mutant.pin;
    EXPECT_EQ(mine->second, seen == '1') << mutant.pin << " stuck-at-" << mutant.stuck;
    caught += seen == '1' ? 1 : 0;
  }
  EXPECT_EQ(compared, mutants.size());
  EXPECT_GT(caught, compared / 2);
  EXPECT_LT(caught, compared);
}

}  // namespace
}  // namespace meltstage::dft
