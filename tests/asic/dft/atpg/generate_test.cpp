// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/generate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <numeric>
#include <random>

#include "asic/dft/atpg/iddq.hpp"
#include "asic/dft/atpg/podem.hpp"
#include "asic/dft/atpg/proof_check.hpp"
#include "asic/dft/atpg/test_solver.hpp"
#include "asic/dft/core/fault_simulator.hpp"
#include "asic/dft/core/transition.hpp"
#include "base/error.hpp"
#include "tests/asic/dft/serial.hpp"
#include "tests/asic/dft/support.hpp"

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

// A state machine with inputs and flops, as clocked twice, against all patterns that keep its clock and
// reset.
TEST(Generate, EveryTransitionVerdictIsRight) {
  const TransitionView transitions =
      launch_on_capture(capture_view(circuit_netlist("machine"), mini_library(), {{"rst_ni", true}}));
  const Circuit& circuit = transitions.circuit;
  const TestSet set = generate_tests(circuit, transitions.faults, {});
  std::vector<std::size_t> free;
  for (std::size_t i = 0; i < circuit.inputs().size(); ++i) {
    if (circuit.held()[i] < 0) free.push_back(i);
  }
  ASSERT_LT(free.size(), 22u);
  std::vector<std::uint8_t> testable(set.of_class.size(), 0);
  FaultSimulator simulator(circuit);
  for (std::size_t first = 0; first < std::size_t{1} << free.size(); first += kLanes) {
    PatternBlock block{std::vector<Word>(circuit.inputs().size()), kLanes, {}};
    for (std::size_t i = 0; i < circuit.inputs().size(); ++i) {
      if (circuit.held()[i] == 1) block.inputs[i].part.fill(~std::uint64_t{0});
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      for (std::size_t k = 0; k < free.size(); ++k)
        block.inputs[free[k]].set(lane, (((first + lane) >> k) & 1) != 0);
    }
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < testable.size(); ++i) {
      if (testable[i] == 0) open.push_back(i);
    }
    const std::vector<Word>& detected = simulator.detect(block, set.faults.classes, open);
    for (std::size_t k = 0; k < open.size(); ++k) testable[open[k]] = detected[k].any() ? 1 : 0;
  }
  for (std::size_t i = 0; i < testable.size(); ++i) {
    const Fault& fault = set.faults.classes[i];
    EXPECT_EQ(set.of_class[i] == FaultClass::DS, testable[i] != 0) << i << " " << to_string(set.of_class[i]);
    EXPECT_EQ(std::any_of(set.patterns.begin(), set.patterns.end(),
                          [&](const Pattern& pattern) { return serial_detects(circuit, pattern, fault); }),
              testable[i] != 0)
        << i;
  }
  EXPECT_GT(std::count(testable.begin(), testable.end(), 0), 0);
}

// A slow line is a stuck line only where it had to move.
TEST(Transition, IsDetectedWhereTheLineMovesAndTheOldValueShows) {
  const CaptureView view = capture_view(circuit_netlist("machine"), mini_library(), {{"rst_ni", true}});
  const TransitionView transitions = launch_on_capture(view);
  std::size_t detected = 0, unmoved = 0;
  for (const Pattern& pattern : random_patterns(3, 40, transitions.circuit.inputs().size())) {
    for (Fault fault : transitions.faults.classes) {
      const bool slow = serial_detects(transitions.circuit, pattern, fault);
      fault.launch = kNoNode;
      const bool stuck = serial_detects(transitions.circuit, pattern, fault);
      EXPECT_TRUE(stuck || !slow);
      detected += slow ? 1 : 0;
      unmoved += stuck && !slow ? 1 : 0;
    }
  }
  EXPECT_GT(detected, 100u);
  EXPECT_GT(unmoved, 100u);
}

// Faults that a set of states shows by the definition, one state and one site at a time.
std::size_t shown_by(const Circuit& circuit, const std::vector<Pattern>& states) {
  std::size_t shown = 0;
  for (const Site& site : circuit.sites()) {
    if (site.node == kNoNode) continue;
    for (const bool stuck : {false, true}) {
      const Fault fault{site.node, site.pin, stuck};
      shown += std::any_of(states.begin(), states.end(), [&](const Pattern& state) {
        return serial_values(circuit, state, &fault)[site.node] !=
               serial_values(circuit, state, nullptr)[site.node];
      });
    }
  }
  return shown;
}

TEST(Iddq, StopsShowWhatTheyClaim) {
  const Circuit circuit = capture_view(circuit_netlist("multiplier"), mini_library()).circuit;
  const std::vector<Pattern> states = random_patterns(5, 100, circuit.inputs().size());
  const IddqStops stops = choose_iddq_stops(circuit, states, 6);
  ASSERT_FALSE(stops.states.empty());
  EXPECT_LE(stops.states.size(), 6u);
  for (const Pattern& state : stops.states)
    EXPECT_NE(std::find(states.begin(), states.end(), state), states.end());
  EXPECT_EQ(stops.detected.back(), shown_by(circuit, stops.states));
  EXPECT_LT(stops.detected.front(), stops.detected.back());
}

// Improved states show what they claim, and more than those that they were made from.
TEST(Iddq, SearchShowsMore) {
  const Circuit circuit = random_circuit(3, 40, 600);
  const std::vector<Pattern> states = random_patterns(5, 100, circuit.inputs().size());
  const IddqStops chosen = choose_iddq_stops(circuit, states, 4),
                  made = search_iddq_stops(circuit, states, 4, 1);
  EXPECT_EQ(made.detected.back(), shown_by(circuit, made.states));
  EXPECT_GT(made.detected.back(), chosen.detected.back());
  EXPECT_EQ(made.states, search_iddq_stops(circuit, states, 4, 1).states);
}

// States made for it show every fault that any state shows.
TEST(Iddq, StatesFromGatesObservedShowAllThatCanBeShown) {
  const Circuit circuit = capture_view(circuit_netlist("multiplier"), mini_library()).circuit;
  const TestSet set = generate_tests(observe_every_gate(circuit));
  const IddqStops made = choose_iddq_stops(circuit, set.patterns, 1000);
  const IddqStops any = choose_iddq_stops(circuit, random_patterns(9, 2000, circuit.inputs().size()), 1000);
  ASSERT_FALSE(any.detected.empty());
  EXPECT_GE(made.detected.back(), any.detected.back());
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

// Of the quick search: a cube detects its fault whatever else the inputs are, and hardly any value of it
// could be another; a fault without a test has none.
TEST(Podem, ACubeAloneDetectsItsFault) {
  std::size_t testable = 0, found = 0, refuted = 0, turned = 0, still = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Circuit circuit = random_circuit(seed, 8, 60);
    const std::vector<Pattern> everything = all_patterns(circuit.inputs().size());
    Podem podem(circuit);
    for (const Fault& fault : collapse(circuit).classes) {
      const bool has_test = std::any_of(everything.begin(), everything.end(), [&](const Pattern& pattern) {
        return serial_detects(circuit, pattern, fault);
      });
      testable += has_test ? 1 : 0;
      Cube cube;
      const Search result = podem.search(fault, 12, cube);
      if (result == Search::none) {
        ++refuted;
        EXPECT_FALSE(has_test) << "seed " << seed;
      }
      if (result != Search::test) continue;
      ++found;
      for (Pattern pattern : random_patterns(seed, 8, circuit.inputs().size())) {
        for (const auto& [input, value] : cube) pattern[input] = value ? 1 : 0;
        EXPECT_TRUE(serial_detects(circuit, pattern, fault)) << "seed " << seed;
        for (const auto& [input, value] : cube) {
          pattern[input] ^= 1;
          ++turned;
          still += serial_detects(circuit, pattern, fault) ? 1 : 0;
          pattern[input] ^= 1;
        }
      }
    }
  }
  EXPECT_GT(found, testable * 99 / 100);
  EXPECT_GT(refuted, 50u);
  EXPECT_LT(still, turned / 2);
}

// The same circuit with its first two inputs held at 0 and 1.
Circuit with_holds(const Circuit& circuit) {
  CircuitBuilder builder;
  for (Node node = 0; node < circuit.size(); ++node)
    builder.add(circuit.kind(node), {circuit.fanin(node).begin(), circuit.fanin(node).end()});
  for (const Site& site : circuit.sites()) builder.add_site(site);
  for (std::size_t i = 0; i < 2; ++i) builder.hold(circuit.inputs()[i], i == 1);
  return builder.finish("held");
}

// Without a test while the holds last, though there may be one with all inputs free.
TEST(Podem, RefutesWithinHolds) {
  std::size_t held = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Circuit circuit = with_holds(random_circuit(seed, 7, 40));
    const std::vector<Pattern> everything = all_patterns(circuit.inputs().size());
    Podem podem(circuit), with_all_free(circuit, std::vector<std::int8_t>(circuit.inputs().size(), -1));
    for (const Fault& fault : collapse(circuit).classes) {
      const auto detects = [&](const Pattern& pattern) { return serial_detects(circuit, pattern, fault); };
      const bool any = std::any_of(everything.begin(), everything.end(), detects);
      const bool within = std::any_of(everything.begin(), everything.end(), [&](const Pattern& pattern) {
        return pattern[0] == 0 && pattern[1] == 1 && detects(pattern);
      });
      Cube cube;
      const Search result = podem.search(fault, 100, cube);
      if (result != Search::gave_up) {
        EXPECT_EQ(result == Search::test, within) << "seed " << seed;
      }
      held += result == Search::none && any ? 1 : 0;
      const Search free = with_all_free.search(fault, 100, cube);
      if (free != Search::gave_up) {
        EXPECT_EQ(free == Search::test, any) << "seed " << seed;
      }
    }
  }
  EXPECT_GT(held, 10u);
}

// A cube that is found beside what is fixed contradicts none of it; both together detect both faults.
TEST(Podem, FindsTestsBesideWhatIsFixed) {
  std::size_t beside = 0, other = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Circuit circuit = random_circuit(seed, 12, 60);
    const std::vector<Fault> faults = collapse(circuit).classes;
    Podem free(circuit), podem(circuit);
    for (std::size_t first = 0; first < faults.size(); first += 7) {
      Cube fixed, alone, cube;
      if (free.search(faults[first], 12, fixed) != Search::test) continue;
      podem.release();
      podem.fix(fixed);
      for (std::size_t second = 0; second < faults.size(); second += 5) {
        const Search without = free.search(faults[second], 12, alone);
        if (podem.search(faults[second], 12, cube) != Search::test) continue;
        EXPECT_NE(without, Search::none);
        ++beside;
        other += cube != alone ? 1 : 0;
        Pattern pattern = random_patterns(second, 1, circuit.inputs().size())[0];
        for (const auto& [input, value] : cube) pattern[input] = value ? 1 : 0;
        for (const auto& [input, value] : fixed) pattern[input] = value ? 1 : 0;
        EXPECT_TRUE(serial_detects(circuit, pattern, faults[first]));
        EXPECT_TRUE(serial_detects(circuit, pattern, faults[second])) << "seed " << seed;
      }
    }
  }
  EXPECT_GT(beside, 500u);
  EXPECT_GT(other, 100u);
}

// With held inputs and lines that must have been at another value before.
TEST(Podem, FindsTransitionsAndKeepsHeldInputs) {
  const TransitionView transitions =
      launch_on_capture(capture_view(circuit_netlist("machine"), mini_library(), {{"rst_ni", true}}));
  const Circuit& circuit = transitions.circuit;
  Podem podem(circuit);
  std::size_t found = 0;
  for (const Fault& fault : transitions.faults.classes) {
    Cube cube;
    if (podem.search(fault, 12, cube) != Search::test) continue;
    ++found;
    for (Pattern pattern : random_patterns(found, 4, circuit.inputs().size())) {
      for (std::size_t i = 0; i < pattern.size(); ++i) {
        if (circuit.held()[i] >= 0) pattern[i] = static_cast<std::uint8_t>(circuit.held()[i]);
      }
      for (const auto& [input, value] : cube) {
        EXPECT_LT(circuit.held()[input], 0);
        pattern[input] = value ? 1 : 0;
      }
      EXPECT_TRUE(serial_detects(circuit, pattern, fault));
    }
  }
  EXPECT_GT(found, transitions.faults.classes.size() / 2);
}

// Patterns come back as they were, in any order.
TEST(PackedPatterns, ComeBack) {
  constexpr std::size_t kInputs = 150;
  const std::vector<Pattern> patterns = random_patterns(5, 300, kInputs);
  const PatternBlock block = blocks_of(patterns, kInputs)[0];
  PackedPatterns packed(kInputs);
  const std::vector<std::uint32_t> lanes{0, 3, 63, 64, 200, 299};
  packed.append(block, {1, 2});
  packed.append(block, lanes);
  ASSERT_EQ(packed.size(), 2 + lanes.size());
  std::vector<std::uint32_t> order(70, PackedPatterns::kSkip);
  for (std::uint32_t k = 0; k < lanes.size(); ++k) order[69 - k] = 2 + k;
  const PatternBlock back = packed.block_of(order);
  EXPECT_EQ(back.count, order.size());
  for (std::size_t i = 0; i < kInputs; ++i) {
    EXPECT_FALSE(back.inputs[i].bit(0));
    for (std::size_t k = 0; k < lanes.size(); ++k)
      EXPECT_EQ(back.inputs[i].bit(69 - k), patterns[lanes[k]][i] != 0);
  }
}

// To all outputs: with a test, without one while the holds last, without one at all.
TEST(Generate, HeldAndRedundantAreToldApart) {
  std::map<Verdict, std::size_t> met;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Circuit circuit = with_holds(random_circuit(seed, 7, 40));
    const std::vector<Pattern> everything = all_patterns(circuit.inputs().size());
    TestSolver solver(circuit);
    for (const Fault& fault : collapse(circuit).classes) {
      const auto detects = [&](const Pattern& pattern) { return serial_detects(circuit, pattern, fault); };
      const auto within_holds = [&](const Pattern& pattern) {
        return pattern[0] == 0 && pattern[1] == 1 && detects(pattern);
      };
      Verdict expected = Verdict::redundant;
      if (std::any_of(everything.begin(), everything.end(), within_holds))
        expected = Verdict::test;
      else if (std::any_of(everything.begin(), everything.end(), detects))
        expected = Verdict::held;
      Cube cube;
      EXPECT_EQ(solver.solve(fault, cube), expected) << "seed " << seed;
      ++met[expected];
    }
  }
  EXPECT_GT(met[Verdict::test], 100u);
  EXPECT_GT(met[Verdict::held], 20u);
  EXPECT_GT(met[Verdict::redundant], 20u);
}

// Detectors of words: each wants its inputs at values of its own, and hardly shows by chance.
Circuit detectors(std::uint64_t seed) {
  constexpr std::size_t kInputs = 40, kWide = 14, kGates = 60;
  std::mt19937_64 random(seed);
  CircuitBuilder builder;
  std::vector<Node> inputs, inverted;
  for (std::size_t i = 0; i < kInputs; ++i) inputs.push_back(builder.add(Gate::input, {}));
  for (const Node input : inputs) inverted.push_back(builder.add(Gate::inv, {input}));
  for (std::size_t g = 0; g < kGates; ++g) {
    std::vector<std::size_t> taken(kInputs);
    std::iota(taken.begin(), taken.end(), std::size_t{0});
    std::shuffle(taken.begin(), taken.end(), random);
    std::vector<Node> fanin;
    for (std::size_t k = 0; k < kWide; ++k) fanin.push_back((random() & 1 ? inputs : inverted)[taken[k]]);
    const Node gate = builder.add(Gate::all, fanin);
    for (std::size_t k = 0; k < kWide; ++k) builder.add_site({"", gate, static_cast<std::int32_t>(k)});
    builder.add(Gate::output, {gate});
  }
  return builder.finish("detectors");
}

// Merged and extended: of no cube a part may be lost.
TEST(Generate, MergedCubesKeepWhatTheyDetect) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Circuit circuit = detectors(seed);
    const TestSet set = generate_tests(circuit);
    const Grade graded =
        grade(circuit, blocks_of(set.patterns, circuit.inputs().size()), set.faults.classes, 1);
    for (std::size_t i = 0; i < set.faults.classes.size(); ++i) {
      EXPECT_EQ(set.of_class[i], FaultClass::DS) << "seed " << seed;
      EXPECT_NE(graded.first_pattern[i], Grade::kUndetected) << "seed " << seed;
    }
    EXPECT_LT(set.patterns.size(), set.faults.classes.size() / 2);
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
      const bool accepted = refutes({"f.cnf", text_of(folder.path() / "f.cnf")},
                                    {"f.drat", text_of(folder.path() / "f.drat")}, reason);
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
  const auto said = [&](const char* formula, const char* proof) {
    return refutes({"a.cnf", formula}, {"a.drat", proof}, reason);
  };
  EXPECT_TRUE(said("p cnf 2 4\n1 2 0\n-1 2 0\n1 -2 0\n-1 -2 0\n", "2 0\n0\n"));
  EXPECT_FALSE(said("p cnf 2 3\n1 2 0\n-1 2 0\n1 -2 0\n", "2 0\n0\n"));
  EXPECT_EQ(reason, "step 2 of the proof does not follow by unit propagation");
  EXPECT_FALSE(said("p cnf 2 4\n1 2 0\n-1 2 0\n1 -2 0\n-1 -2 0\n", "2 0\n"));
  EXPECT_FALSE(said("p cnf 2 4\n1 2 0\n-1 2 0\n1 -2 0\n-1 -2 0\n", "d 1 2 0\n2 0\n0\n"));
}

TEST(Proof, WhatIsNeitherIsNamedWithItsPlace) {
  std::string reason;
  const auto refusal = [&](const char* formula, const char* proof) -> std::string {
    try {
      refutes({"a.cnf", formula}, {"a.drat", proof}, reason);
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("p cnf 2 1\n1 x 0\n", "").substr(0, 22), "a.cnf:2:3: found \"x\", ");
  // cut short, or no formula at all
  EXPECT_EQ(refusal("c formula\np cnf 2 4\n1 2 0\n-1 2 0\n1 -2 0\n", "2 0\n0\n"),
            "a.cnf:2:1: found \"p cnf 2 4\" and 3 clauses, expected p cnf VARIABLES 3, or the whole file");
  EXPECT_EQ(refusal("", "0\n"), "a.cnf:1:1: found no problem line, expected p cnf VARIABLES CLAUSES");
  EXPECT_EQ(refusal("p cnf 1 1\n1 0\n", "2\n").substr(0, 24), "a.drat:1:2: found no 0 a");
}

}  // namespace
}  // namespace meltstage::dft
