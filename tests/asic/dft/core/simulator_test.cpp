// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "asic/dft/core/fault_simulator.hpp"
#include "base/error.hpp"
#include "tests/asic/dft/serial.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

constexpr std::size_t kSerial = 40;  // patterns that the oracle sees

// Every fault in every pattern as the definition says; returns the differences.
std::size_t differences(const Circuit& circuit, const std::vector<Fault>& simulated,
                        const std::vector<Fault>& defined) {
  const std::vector<Pattern> patterns = random_patterns(7, kSerial, circuit.inputs().size());
  FaultSimulator simulator(circuit);
  const std::vector<Word>& detected =
      simulator.detect(blocks_of(patterns, circuit.inputs().size())[0], simulated, every(simulated.size()));
  std::size_t count = 0;
  for (std::size_t f = 0; f < simulated.size(); ++f) {
    for (std::size_t p = 0; p < patterns.size(); ++p)
      count += detected[f].bit(p) != serial_detects(circuit, patterns[p], defined[f]) ? 1 : 0;
  }
  return count;
}

// All reported faults, not only one of each class.
std::vector<Fault> all_faults(const Circuit& circuit) {
  std::vector<Fault> faults;
  for (const Site& site : circuit.sites()) {
    if (site.node == kNoNode) continue;
    faults.push_back({site.node, site.pin, false});
    faults.push_back({site.node, site.pin, true});
  }
  return faults;
}

TEST(FaultSimulator, IsTheSerialOneOnOwnCircuits) {
  for (const char* name : {"adder", "multiplier", "machine"}) {
    const Circuit circuit = capture_view(circuit_netlist(name), mini_library()).circuit;
    EXPECT_EQ(differences(circuit, all_faults(circuit), all_faults(circuit)), 0u) << name;
  }
}

TEST(FaultSimulator, IsTheSerialOneOnRandomCircuits) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Circuit circuit = random_circuit(seed, 6, 40);
    EXPECT_EQ(differences(circuit, all_faults(circuit), all_faults(circuit)), 0u) << "seed " << seed;
  }
}

// What is asked for has no bearing on the answer: some faults, in any order, after other blocks.
TEST(FaultSimulator, SomeFaultsAreDetectedAsAmongAll) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Circuit circuit = random_circuit(seed, 8, 200);
    const std::vector<Fault> faults = all_faults(circuit);
    const auto blocks =
        blocks_of(random_patterns(seed, 1024, circuit.inputs().size()), circuit.inputs().size());
    FaultSimulator of_all(circuit), of_some(circuit);
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      std::vector<std::uint32_t> some;
      for (std::size_t i = faults.size(); i-- > 0;) {
        if ((i * 7 + seed + b) % 5 == 0) some.push_back(static_cast<std::uint32_t>(i));
      }
      const std::vector<Word>& all = of_all.detect(blocks[b], faults, every(faults.size()));
      const std::vector<Word>& found = of_some.detect(blocks[b], faults, some);
      for (std::size_t k = 0; k < some.size(); ++k) EXPECT_EQ(found[k], all[some[k]]) << "seed " << seed;
    }
  }
}

// The comparison itself sees one wrong fault.
TEST(FaultSimulator, AWrongFaultIsSeen) {
  const Circuit circuit = capture_view(circuit_netlist("adder"), mini_library()).circuit;
  std::vector<Fault> wrong = all_faults(circuit);
  wrong[5].stuck = !wrong[5].stuck;
  EXPECT_NE(differences(circuit, wrong, all_faults(circuit)), 0u);
}

// The select stood last, where all who write MUX in a .bench have it first: other patterns without a word.
TEST(Bench, TheSelectOfAMuxIsFirst) {
  const Circuit circuit = bench_circuit("INPUT(s)\nINPUT(a)\nINPUT(b)\nOUTPUT(z)\nz = MUX(s, a, b)\n");
  const Circuit gates = bench_circuit(
      "INPUT(s)\nINPUT(a)\nINPUT(b)\nOUTPUT(z)\nn = NOT(s)\np = AND(n, a)\nq = AND(s, b)\nz = OR(p, q)\n");
  for (const Pattern& pattern : all_patterns(3))
    EXPECT_EQ(serial_values(circuit, pattern, nullptr).back(), serial_values(gates, pattern, nullptr).back());
}

TEST(Bench, WhatAbcWritesIsReadOrRefusedByName) {
  EXPECT_EQ(
      bench_circuit("INPUT(a)\nOUTPUT(z)\nOUTPUT(y)\nk = vdd\nz = AND(a, k)\ny = gnd\n").inputs().size(), 1U);
  EXPECT_THAT([] { bench_circuit("INPUT(a)\nOUTPUT(z)\nz = LUT 0x1 ( a )\n"); },
              testing::ThrowsMessage<UserError>(testing::HasSubstr(
                  ":3:1: found a look-up table (LUT), expected gates; ABC writes them by write_bench -l")));
}

// Equivalent faults are detected by the same patterns, all of them.
// A gate that reads a line twice, a line that is an output and what two flops take, a line of such a name.
TEST(Faults, EachHasANameOfItsOwn) {
  const Circuit circuit = bench_circuit(
      "INPUT(a)\nINPUT(b)\nOUTPUT(n)\nOUTPUT(z)\nn = NAND(a, b)\nz = XOR(n, n, a)\nq = DFF(n)\nr = DFF(n)\n"
      "OUTPUT(n->z)\nn->z = AND(q, r)\n");
  std::set<std::string> names;
  for (const Site& site : circuit.sites()) EXPECT_TRUE(names.insert(site.name).second) << site.name;
  for (const char* name : {"n->z", "n->z.2", "n->z.3", "n->n", "n->q", "n->r"})
    EXPECT_EQ(names.count(name), 1u) << name;
}

// The select stands first in the file, and last in the circuit.
TEST(Faults, EndsOfALineAreCountedAsTheFileHasThem) {
  const Circuit circuit = bench_circuit("INPUT(m)\nINPUT(p)\nOUTPUT(y)\ny = MUX(m, p, m)\n");
  constexpr int kSelect = 2, kSecond = 1;
  std::map<std::string, int> pins;
  for (const Site& site : circuit.sites()) pins[site.name] = site.pin;
  EXPECT_EQ(pins.at("m->y"), kSelect);
  EXPECT_EQ(pins.at("m->y.2"), kSecond);
}

TEST(Faults, ClassesCantBeToldApart) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Circuit circuit = random_circuit(seed, 6, 40);
    const FaultList list = collapse(circuit);
    const std::vector<Pattern> patterns = all_patterns(6);
    const std::vector<Fault> faults = all_faults(circuit);
    std::vector<std::vector<bool>> of_class(list.classes.size());
    for (std::size_t f = 0; f < faults.size(); ++f) {
      std::vector<bool> detects;
      for (const Pattern& pattern : patterns) detects.push_back(serial_detects(circuit, pattern, faults[f]));
      std::vector<bool>& known = of_class[list.class_of[f]];
      if (known.empty()) known = detects;
      EXPECT_EQ(known, detects) << "seed " << seed << ", " << fault_name(circuit, f);
    }
  }
}

// Blocks of more than 512 patterns, and several threads, count the same.
TEST(FaultSimulator, ThreadsAndBlocksDontMatter) {
  const Circuit circuit = capture_view(circuit_netlist("machine"), mini_library()).circuit;
  const FaultList list = collapse(circuit);
  const auto blocks = blocks_of(random_patterns(3, 1300, circuit.inputs().size()), circuit.inputs().size());
  const Grade one = grade(circuit, blocks, list.classes, 1), two = grade(circuit, blocks, list.classes, 2);
  EXPECT_EQ(one.first_pattern, two.first_pattern);
  EXPECT_EQ(one.detections, two.detections);
  EXPECT_EQ(blocks.size(), 3u);
}

// What isn't compared detects nothing.
TEST(FaultSimulator, OutputsThatAreNotComparedDontCount) {
  const Circuit circuit = capture_view(circuit_netlist("adder"), mini_library()).circuit;
  const FaultList list = collapse(circuit);
  const std::vector<Pattern> patterns = random_patterns(3, 100, circuit.inputs().size());
  const auto detected = [&](const std::vector<Pattern>& compared) {
    const Grade g = grade(circuit, blocks_of(patterns, circuit.inputs().size(), compared), list.classes, 1);
    return std::count_if(g.detections.begin(), g.detections.end(), [](std::uint32_t n) { return n != 0; });
  };
  const std::size_t outputs = circuit.outputs().size();
  Pattern first_alone(outputs, 0);
  first_alone[0] = 1;
  EXPECT_EQ(detected(std::vector<Pattern>(100, Pattern(outputs, 1))), detected({}));
  EXPECT_EQ(detected(std::vector<Pattern>(100, Pattern(outputs, 0))), 0);
  EXPECT_GT(detected(std::vector<Pattern>(100, first_alone)), 0);
  EXPECT_LT(detected(std::vector<Pattern>(100, first_alone)), detected({}));
}

}  // namespace
}  // namespace meltstage::dft
