// SPDX-License-Identifier: Apache-2.0
// What `generate` and `grade` say of each fault, against a simulator of its own (netlist_machine.hpp) that
// runs the written file on the netlist with the fault, on random netlists.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "asic/dft/files/pattern_files.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/grade_file.hpp"
#include "asic/dft/program.hpp"
#include "asic/dft/scan/replay.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "base/error.hpp"
#include "tests/asic/dft/netlist_machine.hpp"
#include "tests/asic/dft/random_netlist.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

using Bits = NetlistMachine::Bits;
constexpr unsigned kUnknowns = 12;  // ways in which what is unknown is filled: all 0, all 1, drawn
constexpr unsigned kTogether = 64 / kUnknowns;

// By fault "SITE stuck-at-V", in how many of the fillings a strobe of the file fails.
std::vector<unsigned> failing_fillings(const Netlist& netlist, const CellLibrary& library,
                                       const CycleStream& stream, const std::vector<std::string>& faults,
                                       std::uint64_t seed = 1) {
  std::vector<unsigned> counts;
  for (std::size_t first = 0; first < faults.size(); first += kTogether) {
    NetlistMachine machine(netlist, library);
    const std::size_t count = std::min<std::size_t>(kTogether, faults.size() - first);
    Bits ones = 0, drawn = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const Bits all = ((Bits{1} << kUnknowns) - 1) << (k * kUnknowns);
      ones |= Bits{2} << (k * kUnknowns);
      drawn |= all & ~(Bits{3} << (k * kUnknowns));
      const std::string& name = faults[first + k];
      const std::size_t blank = name.find(" stuck-at-");
      if (blank != std::string::npos) machine.stick(name.substr(0, blank), name.back() == '1', all);
    }
    std::mt19937_64 random(seed + first);
    const auto unknown = [&] { return (random() & drawn) | ones; };
    machine.power_up(unknown);
    const Bits failing = machine.run(stream, unknown);
    for (std::size_t k = 0; k < count; ++k)
      counts.push_back(
          static_cast<unsigned>(std::popcount(failing >> (k * kUnknowns) & ((Bits{1} << kUnknowns) - 1))));
  }
  return counts;
}

// Names of faults to their classes, as in faults.txt.
using Verdicts = std::vector<std::pair<std::string, std::string>>;
Verdicts verdicts_in(const std::string& report) {
  Verdicts verdicts;
  std::istringstream lines(report);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t blank = line.find(' '), name = line.find(' ', blank + 1) + 1;
    verdicts.emplace_back(line.substr(name), line.substr(0, blank));
  }
  return verdicts;
}

// Whether there are unknowns, seldom drawn, with which no strobe fails.
bool passes_at_times(const Netlist& netlist, const CellLibrary& library, const CycleStream& stream,
                     const std::string& fault) {
  for (std::uint64_t seed = 2; seed < 60; ++seed) {
    if (failing_fillings(netlist, library, stream, {fault}, seed)[0] != kUnknowns) return true;
  }
  return false;
}

// A fault that counts as detected fails the file whatever is unknown; no other does.
std::size_t disagreements(const Netlist& netlist, const CellLibrary& library, const CycleStream& stream,
                          const Verdicts& verdicts, const std::string& what) {
  std::vector<std::string> names{"none"};
  for (const auto& [name, c] : verdicts) names.push_back(name);
  const std::vector<unsigned> failing = failing_fillings(netlist, library, stream, names);
  EXPECT_EQ(failing[0], 0u) << what << ": the file fails without a fault";
  std::size_t wrong = 0;
  for (std::size_t f = 0; f < verdicts.size(); ++f) {
    const auto& [name, c] = verdicts[f];
    const bool detected = c == "DS" || c == "DI", never = c == "UT" || c == "UR";
    const bool agrees = never ? failing[f + 1] == 0 : detected == (failing[f + 1] == kUnknowns);
    if (agrees || (!never && !detected && passes_at_times(netlist, library, stream, name))) continue;
    ++wrong;
    ADD_FAILURE() << what << ": " << name << " is " << c << ", the file fails with " << failing[f + 1]
                  << " of " << kUnknowns;
  }
  return wrong;
}

struct Written {
  Netlist netlist;
  CycleStream stream;
  Verdicts verdicts;
};
Written generated(const TestFolder& folder, const Netlist& plain, const CellLibrary& library,
                  std::size_t chains) {
  const auto path = folder.file("random.json", yosys_json_text(plain));
  ProgramOptions options;
  options.scan.chains = chains;
  const TestProgram program = make_test_program(path, library, options);
  write_test_program(program, library, folder.path() / "out");
  std::ifstream report(folder.path() / "out/faults.txt");
  const std::string text((std::istreambuf_iterator<char>(report)), std::istreambuf_iterator<char>());
  return {program.subject.is_scanned ? read_yosys_json(folder.path() / "out/netlist.json") : plain,
          read_stil(folder.path() / "out/patterns.stil"), verdicts_in(text)};
}

std::size_t netlists() {
  const char* wanted = std::getenv("MELTSTAGE_VERDICT_NETLISTS");
  return wanted == nullptr ? 40 : std::strtoul(wanted, nullptr, 10);
}
std::uint64_t first_seed() {
  const char* wanted = std::getenv("MELTSTAGE_VERDICT_SEED");
  return wanted == nullptr ? 1 : std::strtoull(wanted, nullptr, 10);
}

TEST(Verdicts, OfGenerateHoldOnTheWrittenFile) {
  std::size_t faults = 0, wrong = 0;
  for (std::uint64_t seed = first_seed(); seed < first_seed() + netlists(); ++seed) {
    const bool mini = seed % 2 == 0;
    const CellLibrary& library = mini ? mini_library() : yosys_library();
    const Netlist plain = RandomNetlist(seed, mini).make(1 + seed % 9, 4 + seed % 17);
    const std::size_t chains = 1 + seed % 5;
    const TestFolder folder;
    const Written written = generated(folder, plain, library, chains);
    faults += written.verdicts.size();
    wrong += disagreements(written.netlist, library, written.stream, written.verdicts,
                           fmt::format("seed {}, {} chains", seed, chains));
  }
  fmt::print("{} netlists from seed {}: {} faults, {} disagreements\n", netlists(), first_seed(), faults,
             wrong);
  EXPECT_GT(faults, 20 * netlists());
}

// Files that compare less than what was generated: the chain test may be gone, strobes are masked at random,
// inputs are left open, tests are of two clocks.
Verdicts graded(const TestFolder& folder, const Netlist& netlist, const CellLibrary& library,
                const CycleStream& stream) {
  const GradedFile file = grade_file(folder.file("graded.json", yosys_json_text(netlist)), library, stream);
  return verdicts_in(fault_report(file.list, file.reported, file.graded,
                                  [&](std::size_t fault) { return fault_name(file.circuit, fault); }));
}
void mask_some(CycleStream& stream, std::mt19937_64& random) {
  const std::size_t share = 1 + random() % 10;
  for (TestCycle& cycle : stream.cycles) {
    for (std::size_t s = 0; s < cycle.states.size(); ++s) {
      if (!stream.signals[s].is_input && random() % share == 0) cycle.states[s] = 'X';
    }
  }
}

TEST(Verdicts, OfGradeAreWhatTheFilesStrobesShow) {
  std::size_t faults = 0, wrong = 0, detected = 0;
  for (std::uint64_t seed = first_seed(); seed < first_seed() + netlists(); ++seed) {
    std::mt19937_64 random(seed);
    const bool mini = seed % 2 == 0, flops = seed % 4 != 3;
    const CellLibrary& library = mini ? mini_library() : yosys_library();
    const Netlist plain = RandomNetlist(seed, mini).make(flops ? 1 + seed % 9 : 0, 4 + seed % 17);
    const TestFolder folder;
    ProgramOptions options;
    options.scan.chains = 1 + seed % 5;
    if (flops && seed % 5 == 0) options.model = FaultModel::transition;
    const TestProgram program =
        make_test_program(folder.file("random.json", yosys_json_text(plain)), library, options);
    const Netlist& netlist = flops ? program.subject.design.netlist : plain;
    CycleStream stream = program.stream;
    if (flops && seed % 3 == 0) {  // from the first pattern on
      const auto pattern = std::find_if(stream.cycles.begin(), stream.cycles.end(),
                                        [](const TestCycle& cycle) { return cycle.label == "pattern 0"; });
      // what the first unload of what is left shows is no more what was loaded
      const std::size_t enable = static_cast<std::size_t>(
          std::find(stream.signals.begin(), stream.signals.end(), TestSignal{"scan_en_i", true}) -
          stream.signals.begin());
      for (auto at = pattern; at != stream.cycles.end() && at->states[enable] == '1'; ++at) {
        for (std::size_t s = 0; s < at->states.size(); ++s) {
          if (!stream.signals[s].is_input) at->states[s] = 'X';
        }
      }
      stream.cycles.erase(stream.cycles.begin(), pattern);
    }
    mask_some(stream, random);
    const Verdicts verdicts = graded(folder, netlist, library, stream);
    faults += verdicts.size();
    for (const auto& [name, c] : verdicts) detected += c == "DS" || c == "DI" ? 1 : 0;
    wrong += disagreements(netlist, library, stream, verdicts, fmt::format("seed {}", seed));
  }
  fmt::print("{} netlists from seed {}: {} faults, {} detected, {} disagreements\n", netlists(), first_seed(),
             faults, detected, wrong);
  EXPECT_GT(detected, faults / 4);
}

TEST(Verdicts, AFileThatTheNetlistDoesNotFulfilIsNotGraded) {
  const TestFolder folder;
  const auto path = folder.file("c.bench", "INPUT(a)\nINPUT(b)\nOUTPUT(y)\nOUTPUT(a)\ny = AND(a, b)\n");
  const TestProgram program = make_test_program(path, yosys_library(), {});
  CycleStream stream = program.stream;
  EXPECT_EQ(stream.signals[2], (TestSignal{"y", false}));
  EXPECT_EQ(stream.signals[3], (TestSignal{"a_out", false}));
  EXPECT_EQ(replay(view_to_replay(path, yosys_library()), stream).mismatches, 0u);
  const GradedFile whole = grade_file(path, yosys_library(), stream);
  EXPECT_DOUBLE_EQ(coverage(whole.list, whole.reported).test_coverage(), 1.0);
  CycleStream masked = stream;
  for (TestCycle& cycle : masked.cycles) cycle.states[2] = cycle.states[3] = 'X';
  const GradedFile none = grade_file(path, yosys_library(), masked);
  EXPECT_EQ(coverage(none.list, none.reported).detected(), 0u);
  stream.title = "c.stil";
  stream.cycles[0].states[2] = stream.cycles[0].states[2] == 'H' ? 'L' : 'H';
  EXPECT_THAT([&] { grade_file(path, yosys_library(), stream); },
              testing::ThrowsMessage<UserError>(testing::HasSubstr("c.stil: cycle 0 ")));
}

}  // namespace
}  // namespace meltstage::dft
