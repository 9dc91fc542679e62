// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/parities.hpp"

#include <cadical.hpp>
#include <initializer_list>

namespace meltstage::dft {

namespace {

constexpr int kSat = 10;
constexpr int kUnsat = 20;
constexpr int kConflicts = 20000;

int literal(Node node) { return static_cast<int>(node) + 1; }

class Encoder {
 public:
  Encoder(CaDiCaL::Solver& solver, const Circuit& circuit)
      : solver_(solver), next_(literal(static_cast<Node>(circuit.size()))) {}

  void clause(std::initializer_list<int> literals) {
    for (const int l : literals) solver_.add(l);
    solver_.add(0);
  }
  void equal(int a, int b) {
    clause({a, -b});
    clause({-a, b});
  }
  // Sum of these modulo 2.
  int sum(const std::vector<int>& terms) {
    int total = terms.at(0);
    for (std::size_t i = 1; i < terms.size(); ++i) {
      const int a = total, b = terms[i], c = next_++;
      clause({-a, -b, -c});
      clause({a, b, -c});
      clause({a, -b, c});
      clause({-a, b, c});
      total = c;
    }
    return total;
  }
  void gate(const Circuit& circuit, Node node) {
    const int out = literal(node);
    std::vector<int> in;
    for (const Node driver : circuit.fanin(node)) in.push_back(literal(driver));
    switch (circuit.kind(node)) {
      case Gate::input:
        return;
      case Gate::tie0:
        return clause({-out});
      case Gate::tie1:
        return clause({out});
      case Gate::buf:
      case Gate::output:
        return equal(out, in[0]);
      case Gate::inv:
        return equal(out, -in[0]);
      case Gate::all:
        return conjunction(out, in, 1);
      case Gate::nall:
        return conjunction(-out, in, 1);
      case Gate::any:
        return conjunction(-out, in, -1);
      case Gate::none:
        return conjunction(out, in, -1);
      case Gate::parity:
        return equal(out, sum(in));
      case Gate::same:
        return equal(-out, sum(in));
      case Gate::mux:
        clause({in[2], -in[0], out});
        clause({in[2], in[0], -out});
        clause({-in[2], -in[1], out});
        clause({-in[2], in[1], -out});
        return;
    }
  }

 private:
  // out = all of sign x in
  void conjunction(int out, const std::vector<int>& in, int sign) {
    for (const int l : in) clause({-out, sign * l});
    for (const int l : in) solver_.add(-sign * l);
    solver_.add(out);
    solver_.add(0);
  }

  CaDiCaL::Solver& solver_;
  int next_;  // free variable
};

}  // namespace

std::vector<std::int8_t> levels_under(const Circuit& circuit, const std::vector<Parity>& parities,
                                      const std::vector<std::int8_t>& legal,
                                      const std::vector<std::uint8_t>& held,
                                      const std::vector<Node>& wanted) {
  const std::vector<std::int8_t> values = constants(circuit, legal);

  CaDiCaL::Solver solver;
  Encoder encoder(solver, circuit);
  for (const Parity& parity : parities) {
    std::vector<int> terms;
    bool odd = false;
    for (const Node input : parity) {
      terms.push_back(literal(input));
      odd ^= values[input] == 1;
    }
    const int sum = encoder.sum(terms);
    encoder.clause({odd ? sum : -sum});
  }
  for (std::size_t i = 0; i < held.size(); ++i)
    if (held[i] != 0)
      encoder.clause({legal[i] == 1 ? literal(circuit.inputs()[i]) : -literal(circuit.inputs()[i])});
  std::vector<std::uint8_t> in_cone(circuit.size(), 0);
  std::vector<Node> cone;
  const auto take = [&](Node node) {
    if (in_cone[node] != 0) return;
    in_cone[node] = 1;
    cone.push_back(node);
  };
  for (const Node node : wanted) take(node);
  for (std::size_t i = 0; i < cone.size(); ++i) {
    encoder.gate(circuit, cone[i]);
    for (const Node driver : circuit.fanin(cone[i])) take(driver);
  }

  // A state in which one line moves often moves others too.
  std::vector<std::int8_t> levels(circuit.size(), -1);
  std::vector<std::uint8_t> moves(circuit.size(), 0);
  for (const Node node : wanted) {
    if (moves[node] != 0 || values[node] < 0) continue;
    solver.assume(values[node] == 1 ? -literal(node) : literal(node));
    solver.limit("conflicts", kConflicts);
    const int verdict = solver.solve();
    if (verdict == kUnsat) levels[node] = values[node];
    if (verdict != kSat) continue;
    for (const Node other : wanted)
      if ((solver.val(literal(other)) > 0) != (values[other] == 1)) moves[other] = 1;
  }
  return levels;
}

}  // namespace meltstage::dft
