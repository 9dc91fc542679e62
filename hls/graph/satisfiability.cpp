// SPDX-License-Identifier: Apache-2.0
#include "hls/graph/satisfiability.hpp"

#include <fmt/format.h>

#include <cadical.hpp>

namespace meltstage::hls {
namespace {

int variable_of(Literal literal) {
  const int variable = static_cast<int>(literal / 2) + 1;
  return (literal & 1) != 0 ? -variable : variable;
}

}  // namespace

Satisfiability::Satisfiability(const Graph& graph)
    : graph_(graph), blaster_(graph, aig_, inputs_, {}), solver_(std::make_unique<CaDiCaL::Solver>()) {
  add_clause({-variable_of(kFalse)});
}

Satisfiability::~Satisfiability() = default;

void Satisfiability::add_clause(std::initializer_list<int> literals) {
  for (const int literal : literals) solver_->add(literal);
  solver_->add(0);
}

bool Satisfiability::can_hold(Node condition) {
  constexpr int kConflicts = 2000, kUnsatisfiable = 20;  // the latter as in cadical.hpp
  name_inputs();
  const Literal holds = blaster_.bits(condition).at(0);
  tell_solver();
  solver_->assume(variable_of(holds));
  solver_->limit("conflicts", kConflicts);
  return solver_->solve() != kUnsatisfiable;
}

void Satisfiability::name_inputs() {
  for (; named_ < graph_.size(); ++named_) {
    const auto node = static_cast<Node>(named_);
    if (graph_[node].op != Op::kInput) continue;
    const std::string& name = graph_.name(node);
    const unsigned width = graph_.width(node);
    if (width == 1) inputs_.try_emplace(name, aig_.input());
    for (unsigned i = 0; i < width && width > 1; ++i)
      inputs_.try_emplace(fmt::format("{}[{}]", name, i), aig_.input());
  }
}

void Satisfiability::tell_solver() {
  for (; told_ < aig_.nodes(); ++told_) {
    if (aig_.is_input(told_)) continue;
    const int y = variable_of(static_cast<Literal>(2 * told_)), a = variable_of(aig_[told_].a),
              b = variable_of(aig_[told_].b);
    add_clause({-y, a});
    add_clause({-y, b});
    add_clause({y, -a, -b});
  }
}

}  // namespace meltstage::hls
