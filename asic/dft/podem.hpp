// SPDX-License-Identifier: Apache-2.0
// A quick search for a test in the circuit itself: P. Goel, "An implicit enumeration algorithm to generate
// tests for combinational logic circuits" (PODEM), IEEE Trans. Computers C-30(3) 1981; values are chosen by
// controllability and observability after L. H. Goldstein and E. L. Thigpen, "SCOAP", DAC 1980.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "asic/dft/faults.hpp"
#include "asic/dft/lift.hpp"

namespace meltstage::dft {

/// One worker's memory; the circuit must outlive it.
class Podem {
 public:
  explicit Podem(const Circuit& circuit);
  /// Another worker, for another thread.
  Podem(const Podem& other) = default;

  /// A test with the held inputs at their values, cut down to what the fault needs. False where the search
  /// has not found one within its limits: that says nothing about the fault. What it finds depends on the
  /// fault alone.
  bool search(const Fault& fault, Cube& cube);

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

  std::uint8_t good(Node node) const { return value_[node] & 3U; }
  std::uint8_t bad(Node node) const { return value_[node] >> 2; }
  bool differs(Node node) const { return good(node) != kX && bad(node) != kX && good(node) != bad(node); }
  bool is_unknown(Node node) const { return good(node) == kX || bad(node) == kX; }
  void measure();
  void set(Node node, std::uint8_t value);
  void wake(Node node);
  std::uint8_t evaluate(Node node) const;
  void imply();
  void undo(std::size_t mark);
  bool backtrack();
  Outlook look(Goal& goal);
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
  std::vector<std::uint8_t> value_;     // good, and bad times 4; between calls what holds without a fault
  std::vector<std::uint64_t> pending_;  // a bit a node; all 0 between calls
  std::vector<std::uint32_t> seen_;     // == now_: met in this look
  std::uint32_t now_ = 0;
  std::size_t first_pending_ = 0, work_ = 0;
  std::uint64_t salt_ = 0;
  std::vector<Change> trail_;
  std::vector<Decision> decisions_;
  std::vector<Node> differing_, frontier_, path_;
  Fault fault_;
  Node line_ = kNoNode, shown_ = kNoNode;  // that is faulty; output that shows it
  CubeLifter lifter_;
};

}  // namespace meltstage::dft
