// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/generate.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "asic/dft/fault_simulator.hpp"
#include "asic/dft/proof_check.hpp"
#include "asic/dft/test_solver.hpp"
#include "tests/dft/support.hpp"

namespace meltstage::dft {
namespace {

// Verdicts against all patterns there are, by the serial simulator; returns how many are untestable.
std::size_t check_all(const Circuit& circuit, const std::string& name) {
  const TestSet set = generate_tests(circuit);
  const std::vector<Pattern> everything = all_patterns(circuit.inputs().size());
  std::size_t untestable = 0;
  EXPECT_EQ(set.aborted, 0u) << name;
  for (std::size_t i = 0; i < set.faults.classes.size(); ++i) {
    const auto detects = [&](const Pattern& pattern) {
      return serial_detects(circuit, pattern, set.faults.classes[i]);
    };
    const bool testable = std::any_of(everything.begin(), everything.end(), detects);
    const bool detected = std::any_of(set.patterns.begin(), set.patterns.end(), detects);
    EXPECT_EQ(detected, testable) << name << ", class " << i;
    EXPECT_EQ(set.of_class[i] == FaultClass::DS, testable)
        << name << ", class " << i << " " << to_string(set.of_class[i]);
    untestable += testable ? 0 : 1;
  }
  return untestable;
}

TEST(Generate, EveryVerdictIsRightOnOwnCircuits) {
  for (const char* name : {"adder", "multiplier"})
    check_all(capture_view(circuit_netlist(name), mini_library()).circuit, name);
}

TEST(Generate, EveryVerdictIsRightOnRandomCircuits) {
  std::size_t untestable = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed)
    untestable += check_all(random_circuit(seed, 7, 40), "seed " + std::to_string(seed));
  EXPECT_GT(untestable, 20u);  // the case that needs a proof has been met
}

TEST(Generate, ACubeAloneDetectsItsFault) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Circuit circuit = random_circuit(seed, 8, 60);
    TestSolver solver(circuit);
    for (const Fault& fault : collapse(circuit).classes) {
      Cube cube;
      if (solver.solve(fault, cube) != Verdict::test) continue;
      for (Pattern pattern : random_patterns(seed, 8, circuit.inputs().size())) {
        for (const auto& [input, value] : cube) pattern[input] = value ? 1 : 0;
        EXPECT_TRUE(serial_detects(circuit, pattern, fault)) << "seed " << seed;
      }
    }
  }
}

TEST(Generate, SameInputsSamePatterns) {
  const Circuit circuit = capture_view(circuit_netlist("machine"), mini_library()).circuit;
  const TestSet one = generate_tests(circuit), two = generate_tests(circuit);
  EXPECT_EQ(one.patterns, two.patterns);
  EXPECT_EQ(one.of_class, two.of_class);
  EXPECT_NE(generate_tests(circuit, {.seed = 2}).patterns, one.patterns);
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Every fault called redundant has a proof that the checker accepts; a testable one has none.
TEST(Proof, RedundantFaultsAreProved) {
  const TestFolder folder;
  std::size_t proved = 0, refused = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Circuit circuit = random_circuit(seed, 7, 40);
    const TestSet set = generate_tests(circuit);
    TestSolver solver(circuit);
    for (std::size_t i = 0; i < set.of_class.size(); ++i) {
      if (set.of_class[i] != FaultClass::UR && (set.of_class[i] != FaultClass::DS || i % 10 != 0)) continue;
      const bool refuted = solver.prove_untestable(set.faults.classes[i], folder.path(), "f");
      std::string reason;
      const bool accepted =
          refutes(text_of(folder.path() / "f.cnf"), text_of(folder.path() / "f.drat"), reason);
      EXPECT_EQ(refuted, set.of_class[i] == FaultClass::UR);
      EXPECT_EQ(accepted, refuted) << reason;
      ++(refuted ? proved : refused);
    }
  }
  EXPECT_GT(proved, 10u);
  EXPECT_GT(refused, 10u);
}

TEST(Proof, CheckerRefusesWhatDoesNotFollow) {
  std::string reason;
  EXPECT_TRUE(refutes("p cnf 2 4\n1 2 0\n-1 2 0\n1 -2 0\n-1 -2 0\n", "2 0\n0\n", reason));
  EXPECT_FALSE(refutes("p cnf 2 3\n1 2 0\n-1 2 0\n1 -2 0\n", "2 0\n0\n", reason));
  EXPECT_EQ(reason, "step 2 of the proof does not follow by unit propagation");
  EXPECT_FALSE(refutes("p cnf 2 4\n1 2 0\n-1 2 0\n1 -2 0\n-1 -2 0\n", "2 0\n", reason));
  EXPECT_FALSE(refutes("p cnf 2 4\n1 2 0\n-1 2 0\n1 -2 0\n-1 -2 0\n", "d 1 2 0\n2 0\n0\n", reason));
}

}  // namespace
}  // namespace meltstage::dft
