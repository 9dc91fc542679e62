// SPDX-License-Identifier: Apache-2.0
// A quick search for a test in the circuit itself: P. Goel, "An implicit enumeration algorithm to generate
// tests for combinational logic circuits" (PODEM), IEEE Trans. Computers C-30(3) 1981; values are chosen by
// controllability and observability after L. H. Goldstein and E. L. Thigpen, "SCOAP", DAC 1980. Before the
// search, and as a bound in it, stands what every test needs: the gates that all ways to an output lead
// through must let the fault pass, and what follows from that by implication (M. H. Schulz et al.,
// "SOCRATES", IEEE TCAD 7(1) 1988; H. Fujiwara and T. Shimono, "FAN", IEEE Trans. Computers C-32(12) 1983).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "asic/dft/atpg/lift.hpp"
#include "asic/dft/core/faults.hpp"

namespace meltstage::dft {

enum class Search : std::uint8_t {
  test,
  none,    ///< there is no test
  gave_up  ///< within the limits of the search; says nothing about the fault
};

/// One worker's memory; the circuit must outlive it.
class Podem {
 public:
  /// `inputs` are held at these values (by input; -1: free).
  Podem(const Circuit& circuit, const std::vector<std::int8_t>& inputs);
  /// The circuit's held inputs at their values.
  explicit Podem(const Circuit& circuit) : Podem(circuit, circuit.held()) {}
  /// Another worker, for another thread.
  Podem(const Podem& other) = default;

  /// These inputs have these values, too, until release(): tests found are tests beside them. They must not
  /// contradict what is fixed already.
  void fix(const Cube& cube);
  void release();

  /// A test cut down to what the fault needs; it ends after so many backtracks. What it finds depends on the
  /// fault, and on what is fixed, alone.
  Search search(const Fault& fault, std::size_t backtracks, Cube& cube);
  /// Gates that the last search looked at.
  std::size_t work() const { return work_; }

 private:
  static constexpr std::uint8_t kX = 2;  // beside 0 and 1
  struct Goal {
    Node node = kNoNode;
    std::uint8_t value = 0;
  };
  struct Decision {
    Node input;
    std::uint8_t value;
    bool flipped;
    std::size_t mark;  // of trail_
  };
  struct Change {
    Node node;
    std::uint8_t before;
  };
  enum class Outlook : std::uint8_t { test, open, dead };

  // Two bits for the good circuit, "is 1" and "is 0", and two for the faulty one, so that both are evaluated
  // at once.
  static std::uint8_t pair(std::uint8_t good, std::uint8_t bad) {
    return static_cast<std::uint8_t>((2 - good) | (2 - bad) << 2);
  }
  std::uint8_t good(Node node) const { return static_cast<std::uint8_t>(2 - (value_[node] & 3U)); }
  std::uint8_t bad(Node node) const { return static_cast<std::uint8_t>(2 - (value_[node] >> 2)); }
  bool differs(Node node) const { return value_[node] == pair(0, 1) || value_[node] == pair(1, 0); }
  bool is_unknown(Node node) const { return (value_[node] & 3U) == 0 || value_[node] >> 2 == 0; }
  void measure();
  void set(Node node, std::uint8_t value);
  void wake(Node node);
  Node take_pending();
  std::uint8_t evaluate(Node node) const;
  void imply();
  void undo(std::size_t mark);
  bool backtrack();
  Outlook look(Goal& goal);
  std::uint8_t known(Node node) const { return good(node) != kX ? good(node) : must_[node]; }
  bool require(Node node, std::uint8_t value);
  bool require_all(std::span<const Node> nodes, std::uint8_t value);
  bool require_by(Node gate);
  bool follow();
  bool may_differ(Node gate, std::size_t pin) const;
  bool lets_through(Node gate) const;
  bool trace_cone();
  bool require_passage(Node gate);
  bool require_passages();
  bool find_needs();
  void fix_needed_inputs();
  Search find(std::size_t backtracks);
  Search decide(std::size_t most);
  bool side_input(Node gate, Goal& goal) const;
  bool reaches_output(Node gate);
  Decision backtrace(Goal goal) const;
  std::uint32_t cost(Node node, std::uint8_t value) const { return control_[node][value]; }
  std::uint32_t drawn(std::uint32_t cost, std::uint32_t choice) const;
  std::uint32_t drawn_cost(Node node, std::uint8_t value) const {
    return drawn(cost(node, value), 2 * node + value);
  }

  const Circuit& circuit_;
  std::vector<std::array<std::uint32_t, 2>> control_;  // by node and value
  std::vector<std::uint32_t> observe_;
  std::vector<std::uint8_t> value_;     // see pair(); between calls what holds without a fault
  std::vector<std::uint64_t> pending_;  // a bit a node; all 0 between calls
  std::vector<std::uint32_t> seen_;     // == now_: met in this look
  std::uint32_t now_ = 0;
  std::size_t first_pending_ = 0, waiting_ = 0, work_ = 0;
  bool grows_ = true;  // values that are known stay: all the time but when the fault is put in
  std::uint64_t salt_ = 0;
  std::vector<Change> trail_;
  std::size_t fixed_ = 0;  // of trail_: by fix()
  std::vector<Decision> decisions_;
  std::vector<Node> differing_, frontier_, path_;
  std::vector<std::uint8_t> must_;  // beside value_: good values that every test of the fault has, else kX
  std::vector<Node> needs_;         // nodes with a value in must_
  std::size_t followed_ = 0;        // needs_ whose consequences are drawn
  bool contradicted_ = false;       // a good value is not what it must be
  std::vector<Node> cone_;          // nodes that the fault may change, ascending
  std::vector<std::uint32_t> in_cone_, leads_out_;  // == cone_now_: in cone_; and an output is reached
  std::uint32_t cone_now_ = 0;
  Node cone_end_ = kNoNode;  // nodes from here on were not looked at
  Fault fault_;
  Node line_ = kNoNode, shown_ = kNoNode;  // that is faulty; output that shows it
  CubeLifter lifter_;
};

}  // namespace meltstage::dft
