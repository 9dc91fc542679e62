// SPDX-License-Identifier: Apache-2.0
// The ways through a function: which blocks are executed, in which order, under which conditions, and what
// holds where ways meet again.
#pragma once

#include <llvm/ADT/STLExtras.h>

#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "hls/graph/graph.hpp"

namespace meltstage::hls {

/// Basic blocks as they are executed, one after the other, each behind all that lead to it; a block of a loop
/// has one number for each iteration. Edges lead from one executed block to the next.
class Paths {
 public:
  static constexpr int kEntry = 0;  // the edge into the function

  explicit Paths(Graph& graph) : graph_(graph) { edges_.push_back({kNone, kNone, graph.truth(true)}); }

  /// The block that is executed next is one to which `edges` lead.
  void enter(const std::vector<int>& edges);
  /// A new edge out of the block that is executed, taken `when`, of the ways out of this one.
  int leave(Node when);
  /// The block that is executed.
  int current() const { return static_cast<int>(executed_.size()) - 1; }

  /// What comes in over `edges`, as a function of the conditions that were met since their dominator. `leaf`
  /// gives it for the n-th edge.
  Node meet(const std::vector<int>& edges, llvm::function_ref<Node(std::size_t)> leaf);
  /// Whether an executed block is reached, from the beginning on.
  Node reached(int executed);
  /// Whether an edge is taken, from the beginning on.
  Node taken(int edge) { return graph_.both(reached(edges_[edge].from), edges_[edge].when); }

 private:
  static constexpr int kNone = -1;

  // A way from one executed block to the next one.
  struct Edge {
    int from;
    int to;     // kNone until it is known
    Node when;  // of the ways out of `from`, this one
  };
  struct Executed {
    int dominator;
    int depth;
    std::vector<int> into;  // edges
    std::vector<int> out;   // edges; one of them is taken
  };

  int nearest_dominator(const std::vector<int>& edges) const;
  std::optional<Node> met_from(int executed);

  Graph& graph_;
  std::vector<Edge> edges_;
  std::vector<Executed> executed_;
  std::map<int, Node> reached_;

  // of the last meeting, whose number is the first of each pair
  int meeting_ = 0;
  std::vector<std::pair<int, Node>> leaf_of_;
  std::vector<std::pair<int, std::optional<Node>>> met_;
};

}  // namespace meltstage::hls
