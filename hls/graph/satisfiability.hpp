// SPDX-License-Identifier: Apache-2.0
// Whether a condition over flops and pins can ever hold.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>

#include "hls/graph/aig.hpp"
#include "hls/graph/graph.hpp"

namespace CaDiCaL {
class Solver;
}

namespace meltstage::hls {

/// A solver beside a graph that grows. What it has learnt of earlier conditions is kept.
class Satisfiability {
 public:
  explicit Satisfiability(const Graph& graph);
  ~Satisfiability();

  /// False when no values of the inputs meet the condition; true as well where the solver gives up.
  bool can_hold(Node condition);

 private:
  void name_inputs();
  void tell_solver();
  void add_clause(std::initializer_list<int> literals);

  const Graph& graph_;
  Aig aig_;
  Bits inputs_;
  Blaster blaster_;
  std::unique_ptr<CaDiCaL::Solver> solver_;
  std::size_t named_ = 0, told_ = 1;  // nodes of the graph, and of the gates
};

}  // namespace meltstage::hls
