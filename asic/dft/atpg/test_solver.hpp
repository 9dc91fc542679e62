// SPDX-License-Identifier: Apache-2.0
// One test for one fault, by satisfiability (Larrabee, "Test pattern generation using Boolean
// satisfiability", IEEE TCAD 11(1) 1992, with the D-chains of Stephan et al., IEEE TCAD 15(9) 1996), and the
// part of it that the fault needs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "asic/dft/atpg/lift.hpp"
#include "asic/dft/core/faults.hpp"

namespace CaDiCaL {
class Solver;
}

namespace meltstage::dft {

enum class Verdict : std::uint8_t {
  test,
  redundant,  ///< no test, whatever the inputs are
  held,       ///< no test while the held inputs have their values
  aborted
};

/// How large a problem each output makes.
struct OutputCones {
  std::vector<std::uint32_t> size;  ///< by node; of outputs, the nodes before them
  std::vector<Node>
      nearest;  ///< by node, the output of the smallest cone that it reaches; kNoNode when it reaches none
};
OutputCones output_cones(const Circuit& circuit);

/// Solves faults of one circuit one after another; one worker's memory. The circuit must outlive it.
class TestSolver {
 public:
  TestSolver(const Circuit& circuit, OutputCones cones);
  explicit TestSolver(const Circuit& circuit) : TestSolver(circuit, output_cones(circuit)) {}

  /// A test for the fault with the circuit's held inputs at their values; `cube` is set for Verdict::test.
  /// `conflict_limit` 0: none. What it finds depends on the fault alone.
  Verdict solve(const Fault& fault, Cube& cube, std::uint32_t conflict_limit = 0);
  /// Of a fault without a test while the held inputs have their values: redundant, or held where a short
  /// search with all inputs free doesn't refute it.
  Verdict without_holds(const Fault& fault);
  /// Writes FOLDER/NAME.cnf (DIMACS: "this fault has a test", or "its effect leaves its surroundings" where
  /// that is refuted already) and, when that is unsatisfiable, FOLDER/NAME.drat (its refutation in text
  /// DRAT). Returns whether it is refuted. Throws std::runtime_error when a file can't be written.
  bool prove_untestable(const Fault& fault, const std::filesystem::path& folder, const std::string& name);

  /// Of the solver, so far.
  std::uint64_t calls() const { return calls_; }

 private:
  struct Window;
  static const Window kNeighbours, kSurroundings, kWholeSupport;
  int along_wire(Node node, const std::vector<int>& literals) const;
  void take_support(std::vector<Node> targets);
  void take_fault_cone(const Fault& fault);
  void start();
  void add_fault(const Fault& fault);
  void add_gate(Node node, const std::vector<int>& in, int out);
  void add(std::initializer_list<int> literals);
  std::size_t encode_outputs(const Fault& fault, std::size_t most);
  void encode_window(const Fault& fault, const Window& window);
  enum class Holds : std::uint8_t { free, held };
  bool window_has_effect(const Fault& fault, const Window& window, Holds holds);
  Verdict refuted(const Fault& fault);
  void hand_over(CaDiCaL::Solver& engine, const char* configuration);
  int run(std::uint32_t conflict_limit, const char* configuration, const Fault* fault,
          const std::vector<int>& holds, Cube& cube);
  std::vector<int> steering_inputs(std::size_t most) const;
  int run_by_cases(const Fault& fault, std::uint32_t conflict_limit, const std::vector<int>& holds,
                   Cube& cube);
  int run_to_all(const Fault& fault, std::uint32_t conflict_limit, Cube& cube);
  std::vector<int> held_literals() const;
  void lift(const Fault& fault, CaDiCaL::Solver& engine, Cube& cube);

  const Circuit& circuit_;
  OutputCones cones_;
  std::vector<std::uint32_t> input_of_;  // circuit input of a node
  std::vector<std::uint8_t> in_fault_cone_, in_support_;
  std::vector<Node> fault_cone_, support_;  // topological order
  std::vector<int> good_, bad_;  // literals by node; bad_ of nodes outside the fault's cone is good_
  std::vector<int> differs_;     // variables of nodes in the fault's cone
  std::vector<int> clauses_;     // not handed to the solver yet
  int variables_ = 0;
  bool holds_refute_ = false;  // the last refutation needs a held input
  bool window_ = false;        // a difference may end where the fault's cone is cut, too
  std::uint64_t calls_ = 0;
  CubeLifter lifter_;
};

}  // namespace meltstage::dft
