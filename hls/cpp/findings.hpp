// SPDX-License-Identifier: Apache-2.0
// What is found while a function is executed: that it can't be a circuit, places that it must not reach, and
// values that the C++ leaves open; each with the line of C++ that it is at.
#pragma once

#include <llvm/IR/Instruction.h>

#include <string>
#include <unordered_map>
#include <vector>

#include "hls/cpp/paths.hpp"
#include "hls/graph/circuit.hpp"
#include "hls/graph/graph.hpp"

namespace meltstage::hls {

/// A value that the C++ leaves open: an Op::kAny, and whose it is.
struct Open {
  Node node;
  std::string of;
  Place place;
};

struct OpenValues {
  std::vector<Open> values;
  std::unordered_map<Node, Place> reads;  // where such a byte is first read
};

/// The line of C++ behind an instruction; line 0 when it has none.
Place place_of(const llvm::Instruction& instruction);

/// Throws UserError with a place, when it has a line.
[[noreturn]] void refuse(const Place& place, const std::string& what);

/// Findings in the execution of one function.
class Findings {
 public:
  Findings(Graph& graph, Paths& paths, OpenValues& opens) : graph_(graph), paths_(paths), opens_(opens) {}

  /// What is found from now on, and nodes that are made, are of this instruction.
  void at(const llvm::Instruction& instruction);
  [[noreturn]] void refuse(const std::string& what) const { hls::refuse(here_, what); }

  /// The block that is executed must not be reached with `broken`.
  void trap(Node broken, std::string what) {
    traps_.push_back({broken, paths_.current(), std::move(what), here_});
  }
  /// Whether the last trap is in the block that is executed.
  bool is_trapped() const { return !traps_.empty() && traps_.back().executed == paths_.current(); }
  /// That no trap is reached.
  void promise(std::vector<Promise>& promises) const;

  /// A value that nothing is known of.
  Node open(unsigned width, std::string of);
  /// A byte of memory is read.
  void read(Node byte);

 private:
  struct Trap {
    Node broken;
    int executed;
    std::string what;
    Place place;
  };

  Graph& graph_;
  Paths& paths_;
  OpenValues& opens_;
  std::vector<Trap> traps_;
  Place here_;
};

}  // namespace meltstage::hls
