// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/test_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cadical.hpp>
#include <cstdlib>
#include <stdexcept>

#include "base/error.hpp"
#include "base/output_file.hpp"

namespace meltstage::dft {

namespace {
constexpr int kSat = 10;
constexpr int kUnsat = 20;
constexpr int kUndecided = 0;
constexpr std::size_t kAll = ~std::size_t{0};
constexpr int kTry = 1000;             // conflicts, of a problem that need not be decided
constexpr std::uint32_t kFree = 5000;  // with nothing held
constexpr std::uint32_t kSearch = 20000;

bool is_wire(Gate kind) { return kind == Gate::buf || kind == Gate::inv || kind == Gate::output; }

// After a refutation: whether it makes use of one of these assumptions.
bool needs_any(CaDiCaL::Solver& engine, const std::vector<int>& assumed) {
  return std::any_of(assumed.begin(), assumed.end(), [&](int literal) { return engine.failed(literal); });
}

}  // namespace

// A piece of the circuit around a fault: nodes that it reaches, nodes that feed them, conflicts to spend on
// it.
struct TestSolver::Window {
  std::size_t cone, support;
  std::uint32_t conflicts;
};
constexpr TestSolver::Window TestSolver::kNeighbours{40, 250, 300};
constexpr TestSolver::Window TestSolver::kSurroundings{150, 1500, 2000};
constexpr TestSolver::Window TestSolver::kWholeSupport{250, kAll, 300};

OutputCones output_cones(const Circuit& circuit) {
  OutputCones cones{std::vector<std::uint32_t>(circuit.size(), 0),
                    std::vector<Node>(circuit.size(), kNoNode)};
  std::vector<std::uint32_t> stamp(circuit.size(), 0);
  std::vector<Node> stack;
  std::uint32_t now = 0;
  for (const Node output : circuit.outputs()) {
    stack.assign(1, output);
    stamp[output] = ++now;
    while (!stack.empty()) {
      const Node node = stack.back();
      stack.pop_back();
      ++cones.size[output];
      for (const Node driver : circuit.fanin(node)) {
        if (stamp[driver] == now) continue;
        stamp[driver] = now;
        stack.push_back(driver);
      }
    }
  }
  for (Node node = static_cast<Node>(circuit.size()); node-- > 0;) {
    if (circuit.kind(node) == Gate::output) cones.nearest[node] = node;
    for (const Node next : circuit.fanout(node)) {
      const Node candidate = cones.nearest[next], best = cones.nearest[node];
      if (candidate != kNoNode && (best == kNoNode || cones.size[candidate] < cones.size[best]))
        cones.nearest[node] = candidate;
    }
  }
  return cones;
}

TestSolver::TestSolver(const Circuit& circuit, OutputCones cones)
    : circuit_(circuit),
      cones_(std::move(cones)),
      input_of_(circuit.size(), 0),
      in_fault_cone_(circuit.size(), 0),
      in_support_(circuit.size(), 0),
      good_(circuit.size(), 0),
      bad_(circuit.size(), 0),
      differs_(circuit.size(), 0),
      lifter_(circuit) {
  for (std::uint32_t i = 0; i < circuit.inputs().size(); ++i) input_of_[circuit.inputs()[i]] = i;
}

void TestSolver::add(std::initializer_list<int> literals) {
  clauses_.insert(clauses_.end(), literals);
  clauses_.push_back(0);
}

// The nodes that feed the targets, and the targets.
void TestSolver::take_support(std::vector<Node> targets) {
  for (const Node node : support_) in_support_[node] = 0;
  support_ = std::move(targets);
  for (const Node node : support_) in_support_[node] = 1;
  for (std::size_t i = 0; i < support_.size(); ++i) {
    for (const Node driver : circuit_.fanin(support_[i])) {
      if (in_support_[driver] != 0) continue;
      in_support_[driver] = 1;
      support_.push_back(driver);
    }
  }
  std::sort(support_.begin(), support_.end());
}

// The nodes of the support that the fault reaches.
void TestSolver::take_fault_cone(const Fault& fault) {
  for (const Node node : fault_cone_) in_fault_cone_[node] = 0;
  fault_cone_.assign(1, fault.node);
  in_fault_cone_[fault.node] = 1;
  for (std::size_t i = 0; i < fault_cone_.size(); ++i) {
    for (const Node next : circuit_.fanout(fault_cone_[i])) {
      if (in_fault_cone_[next] != 0 || in_support_[next] == 0) continue;
      in_fault_cone_[next] = 1;
      fault_cone_.push_back(next);
    }
  }
  std::sort(fault_cone_.begin(), fault_cone_.end());
}

void TestSolver::add_gate(Node node, const std::vector<int>& in, int out) {
  const auto conjunction = [&](int result, int sign) {  // result = AND of sign * in
    for (const int i : in) add({-result, sign * i});
    for (const int i : in) clauses_.push_back(-sign * i);
    clauses_.push_back(result);
    clauses_.push_back(0);
  };
  switch (circuit_.kind(node)) {
    case Gate::input:
      break;
    case Gate::tie0:
      add({-out});
      break;
    case Gate::tie1:
      add({out});
      break;
    case Gate::buf:
    case Gate::output:
      add({-out, in[0]});
      add({out, -in[0]});
      break;
    case Gate::inv:
      add({-out, -in[0]});
      add({out, in[0]});
      break;
    case Gate::all:
      conjunction(out, 1);
      break;
    case Gate::nall:
      conjunction(-out, 1);
      break;
    case Gate::any:
      conjunction(-out, -1);
      break;
    case Gate::none:
      conjunction(out, -1);
      break;
    case Gate::parity:
    case Gate::same: {
      int sum = in[0];
      for (std::size_t i = 1; i < in.size(); ++i) {
        const bool last = i + 1 == in.size();
        const int next = last ? (circuit_.kind(node) == Gate::same ? -out : out) : ++variables_;
        add({-next, sum, in[i]});
        add({-next, -sum, -in[i]});
        add({next, -sum, in[i]});
        add({next, sum, -in[i]});
        sum = next;
      }
      if (in.size() == 1) {
        const int next = circuit_.kind(node) == Gate::same ? -out : out;
        add({-next, sum});
        add({next, -sum});
      }
      break;
    }
    case Gate::mux:
      add({in[2], -in[0], out});
      add({in[2], in[0], -out});
      add({-in[2], -in[1], out});
      add({-in[2], in[1], -out});
      add({-in[0], -in[1], out});
      add({in[0], in[1], -out});
      break;
  }
}

// The good circuit of the support. Buffers and inverters are their driver's literal.
void TestSolver::start() {
  clauses_.clear();
  variables_ = 0;
  std::vector<int> in;
  for (const Node node : support_) {
    const auto fanin = circuit_.fanin(node);
    const bool cut =
        std::any_of(fanin.begin(), fanin.end(), [&](Node driver) { return in_support_[driver] == 0; });
    const bool wire = !cut && is_wire(circuit_.kind(node));
    good_[node] = bad_[node] = wire ? along_wire(node, good_) : ++variables_;
    if (cut || wire) continue;  // at the edge of a window any value may come in
    in.clear();
    for (const Node driver : fanin) in.push_back(good_[driver]);
    add_gate(node, in, good_[node]);
  }
}

int TestSolver::along_wire(Node node, const std::vector<int>& literals) const {
  const int literal = literals[circuit_.fanin(node)[0]];
  return circuit_.kind(node) == Gate::inv ? -literal : literal;
}

// The faulty circuit where the fault reaches, and a chain of differences from the fault to an output.
void TestSolver::add_fault(const Fault& fault) {
  for (const Node node : fault_cone_) {
    const bool wire = node != fault.node && is_wire(circuit_.kind(node));
    bad_[node] = wire ? along_wire(node, bad_) : ++variables_;
    differs_[node] = ++variables_;
  }
  std::vector<int> in;
  for (const Node node : fault_cone_) {
    const auto fanin = circuit_.fanin(node);
    if (node == fault.node && fault.pin == kStem) {
      add({fault.stuck ? bad_[node] : -bad_[node]});
    } else {
      in.clear();
      for (const Node driver : fanin) in.push_back(bad_[driver]);
      if (node == fault.node) {
        in[static_cast<std::size_t>(fault.pin)] = ++variables_;
        add({fault.stuck ? variables_ : -variables_});
      }
      if (node == fault.node || !is_wire(circuit_.kind(node))) add_gate(node, in, bad_[node]);
    }
    add({-differs_[node], good_[node], bad_[node]});
    add({-differs_[node], -good_[node], -bad_[node]});
    const auto fanout = circuit_.fanout(node);
    const bool leaves =
        std::any_of(fanout.begin(), fanout.end(), [&](Node next) { return in_fault_cone_[next] == 0; });
    if (circuit_.kind(node) == Gate::output || (window_ && leaves)) continue;
    clauses_.push_back(-differs_[node]);
    for (const Node next : fanout) {
      if (in_fault_cone_[next] != 0) clauses_.push_back(differs_[next]);
    }
    clauses_.push_back(0);
  }
  add({differs_[fault.node]});
  if (fault.launch != kNoNode) add({fault.stuck ? good_[fault.launch] : -good_[fault.launch]});
  if (fault.pin != kStem) {
    const int line = good_[circuit_.fanin(fault.node)[static_cast<std::size_t>(fault.pin)]];
    add({fault.stuck ? -line : line});
  }
}

Verdict TestSolver::solve(const Fault& fault, Cube& cube, std::uint32_t conflict_limit) {
  if (cones_.nearest[fault.node] == kNoNode) return Verdict::redundant;
  if (!window_has_effect(fault, kSurroundings, Holds::held)) return refuted(fault);
  // more and more outputs, small cones first
  bool all = false;
  int status = kUndecided;
  for (const std::size_t most : {std::size_t{8}, std::size_t{64}}) {
    all = encode_outputs(fault, most) <= most;
    status = run(kTry, "plain", &fault, held_literals(), cube);
    if (status == kSat) return Verdict::test;
    if (all && status == kUnsat) return refuted(fault);
    if (most == 8 && !window_has_effect(fault, kWholeSupport, Holds::held)) return refuted(fault);
  }
  status = run_to_all(fault, conflict_limit, cube);
  if (status == kSat) return Verdict::test;
  return status == kUndecided ? Verdict::aborted : refuted(fault);
}

// After a refutation. Where that needs a held input, it is tried without; what has no quick verdict then is
// known as held. A transition isn't tried: with scan enable free it is launched by a shift, as a rule.
Verdict TestSolver::refuted(const Fault& fault) {
  if (!holds_refute_) return Verdict::redundant;
  if (fault.launch != kNoNode) return Verdict::held;
  return without_holds(fault);
}

Verdict TestSolver::without_holds(const Fault& fault) {
  Cube none;
  encode_outputs(fault, kAll);
  return run(kFree, "plain", nullptr, {}, none) == kUnsat ? Verdict::redundant : Verdict::held;
}

// To all outputs: in a search of some length, which finds most tests; by cases of what steers the circuit; in
// one search with inprocessing where that doesn't end.
int TestSolver::run_to_all(const Fault& fault, std::uint32_t conflict_limit, Cube& cube) {
  encode_outputs(fault, kAll);
  const std::vector<int> holds = held_literals();
  int status =
      run(conflict_limit == 0 ? kSearch : std::min(kSearch, conflict_limit), "sat", &fault, holds, cube);
  if (status != kUndecided) return status;
  encode_outputs(fault, kAll);
  status = run_by_cases(fault, conflict_limit, holds, cube);
  if (status != kUndecided) return status;
  encode_outputs(fault, kAll);
  return run(conflict_limit, "default", &fault, holds, cube);
}

// The values of held inputs in the support.
std::vector<int> TestSolver::held_literals() const {
  std::vector<int> literals;
  for (const Node node : support_) {
    if (circuit_.kind(node) != Gate::input || circuit_.held()[input_of_[node]] < 0) continue;
    literals.push_back(circuit_.held()[input_of_[node]] != 0 ? good_[node] : -good_[node]);
  }
  return literals;
}

// Most redundant faults are so in their surroundings: whatever comes in at the edge of a piece of the circuit
// around the fault, no difference leaves it. That is quickly refuted where the whole circuit would be large.
void TestSolver::encode_window(const Fault& fault, const Window& window) {
  for (const Node node : fault_cone_) in_fault_cone_[node] = 0;
  for (const Node node : support_) in_support_[node] = 0;
  std::vector<Node> cone{fault.node};
  in_fault_cone_[fault.node] = 1;
  for (std::size_t i = 0; i < cone.size() && cone.size() < window.cone; ++i) {
    for (const Node next : circuit_.fanout(cone[i])) {
      if (in_fault_cone_[next] != 0) continue;
      in_fault_cone_[next] = 1;
      cone.push_back(next);
    }
  }
  fault_cone_ = std::move(cone);
  std::sort(fault_cone_.begin(), fault_cone_.end());
  support_ = fault_cone_;
  if (fault.launch != kNoNode) support_.push_back(fault.launch);
  for (const Node node : support_) in_support_[node] = 1;
  for (std::size_t i = 0; i < support_.size(); ++i) {
    // all drivers of a node or none: half of them would make it an edge, and no use of them. Those of the
    // cone are always there.
    if (support_.size() > window.support && in_fault_cone_[support_[i]] == 0) break;
    for (const Node driver : circuit_.fanin(support_[i])) {
      if (in_support_[driver] != 0) continue;
      in_support_[driver] = 1;
      support_.push_back(driver);
    }
  }
  std::sort(support_.begin(), support_.end());
  start();
  window_ = true;
  add_fault(fault);
  window_ = false;
}

bool TestSolver::window_has_effect(const Fault& fault, const Window& window, Holds holds) {
  encode_window(fault, window);
  Cube none;
  return run(window.conflicts, "plain", nullptr, holds == Holds::held ? held_literals() : std::vector<int>{},
             none) != kUnsat;
}

// To those outputs that the fault reaches, at most so many, smallest cones first. Returns how many it
// reaches.
std::size_t TestSolver::encode_outputs(const Fault& fault, std::size_t most) {
  std::vector<Node> reached{fault.node}, targets;
  for (const Node node : fault_cone_) in_fault_cone_[node] = 0;
  in_fault_cone_[fault.node] = 1;
  for (std::size_t i = 0; i < reached.size(); ++i) {
    if (circuit_.kind(reached[i]) == Gate::output) targets.push_back(reached[i]);
    for (const Node next : circuit_.fanout(reached[i])) {
      if (in_fault_cone_[next] != 0) continue;
      in_fault_cone_[next] = 1;
      reached.push_back(next);
    }
  }
  fault_cone_ = std::move(reached);
  const std::size_t count = targets.size();
  std::sort(targets.begin(), targets.end(),
            [&](Node a, Node b) { return std::pair(cones_.size[a], a) < std::pair(cones_.size[b], b); });
  if (count > most) targets.resize(most);
  if (fault.launch != kNoNode) targets.push_back(fault.launch);
  take_support(std::move(targets));
  take_fault_cone(fault);
  start();
  add_fault(fault);
  return count;
}

// What is encoded, in a solver of its own; of a test for `fault`, when it is given, the cube. Configuration
// "plain" has no inprocessing: quicker where little search is needed. `holds` are assumed, so that a
// refutation tells whether it needs them.
int TestSolver::run(std::uint32_t conflict_limit, const char* configuration, const Fault* fault,
                    const std::vector<int>& holds, Cube& cube) {
  CaDiCaL::Solver engine;
  hand_over(engine, configuration);
  if (conflict_limit != 0) engine.limit("conflicts", static_cast<int>(conflict_limit));
  for (const int literal : holds) engine.assume(literal);
  ++calls_;
  const int status = engine.solve();
  if (status == kSat && fault != nullptr) lift(*fault, engine, cube);
  holds_refute_ = status == kUnsat && needs_any(engine, holds);
  return status;
}

void TestSolver::hand_over(CaDiCaL::Solver& engine, const char* configuration) {
  engine.set("quiet", 1);
  engine.configure(configuration);
  engine.set("lucky", 0);  // as a rule costs more than the search
  engine.reserve(variables_);
  for (const int literal : clauses_) engine.add(literal);
  clauses_.clear();
}

// The inputs that drive most gates: as a rule they steer what the circuit does, and with them at a value much
// of it falls away.
std::vector<int> TestSolver::steering_inputs(std::size_t most) const {
  std::vector<std::pair<std::size_t, Node>> ranked;
  std::vector<Node> wires;
  for (const Node input : support_) {
    if (circuit_.kind(input) != Gate::input || circuit_.held()[input_of_[input]] >= 0) continue;
    std::size_t gates = 0;
    wires.assign(1, input);
    for (std::size_t i = 0; i < wires.size(); ++i) {
      for (const Node next : circuit_.fanout(wires[i])) {
        if (in_support_[next] == 0) continue;
        if (circuit_.kind(next) == Gate::buf || circuit_.kind(next) == Gate::inv)
          wires.push_back(next);
        else
          ++gates;
      }
    }
    ranked.emplace_back(gates, input);
  }
  std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  if (ranked.size() > most) ranked.resize(most);
  std::vector<int> variables;
  for (const auto& [gates, input] : ranked) variables.push_back(good_[input]);
  return variables;
}

// What is encoded, split into cases where a short search doesn't decide it. All cases share what is learned.
int TestSolver::run_by_cases(const Fault& fault, std::uint32_t conflict_limit, const std::vector<int>& holds,
                             Cube& cube) {
  constexpr std::size_t kDepth = 20;
  constexpr std::uint32_t kShort = 300, kLeaf = 10'000;  // conflicts
  const std::vector<int> split = steering_inputs(kDepth);
  CaDiCaL::Solver engine;
  hand_over(engine, "plain");
  std::vector<int> chosen;  // the case at hand
  holds_refute_ = false;
  for (std::uint32_t spent = 0; conflict_limit == 0 || spent < conflict_limit;) {
    for (const int literal : holds) engine.assume(literal);
    for (const int literal : chosen) engine.assume(literal);
    const std::uint32_t conflicts = chosen.size() < split.size() ? kShort : kLeaf;
    engine.limit("conflicts", static_cast<int>(conflicts));
    spent += conflicts;
    ++calls_;
    const int status = engine.solve();
    if (status == kSat) {
      lift(fault, engine, cube);
      return kSat;
    }
    if (status == kUndecided) {
      if (chosen.size() == split.size()) return kUndecided;
      chosen.push_back(split[chosen.size()]);
      continue;
    }
    holds_refute_ = holds_refute_ || needs_any(engine, holds);
    while (!chosen.empty() && chosen.back() < 0) chosen.pop_back();
    if (chosen.empty()) return kUnsat;
    chosen.back() = -chosen.back();
  }
  return kUndecided;
}

bool TestSolver::prove_untestable(const Fault& fault, const std::filesystem::path& folder,
                                  const std::string& name) {
  if (!window_has_effect(fault, kNeighbours, Holds::free))
    encode_window(fault, kNeighbours);
  else if (!window_has_effect(fault, kSurroundings, Holds::free))
    encode_window(fault, kSurroundings);
  else if (!window_has_effect(fault, kWholeSupport, Holds::free))
    encode_window(fault, kWholeSupport);
  else
    encode_outputs(fault, kAll);
  const std::filesystem::path cnf = folder / (name + ".cnf"), drat = folder / (name + ".drat");
  std::string text =
      fmt::format("p cnf {} {}\n", variables_, std::count(clauses_.begin(), clauses_.end(), 0));
  for (const int literal : clauses_) text += literal == 0 ? "0\n" : fmt::format("{} ", literal);
  write_whole(cnf, text);
  CaDiCaL::Solver solver;
  solver.set("quiet", 1);
  solver.set("binary", 0);
  if (!solver.trace_proof(drat.c_str()))
    throw UserError(fmt::format("{}: found no way to write it, expected a folder with room", drat.string()));
  solver.configure("plain");  // steps that follow by unit propagation alone
  for (const int literal : clauses_) solver.add(literal);
  clauses_.clear();
  const bool refuted = solver.solve() == kUnsat;
  solver.close_proof_trace();
  return refuted;
}

// Reads only those values of the solver's model that matter.
void TestSolver::lift(const Fault& fault, CaDiCaL::Solver& engine, Cube& cube) {
  const auto value = [&](int literal) { return (engine.val(std::abs(literal)) > 0) == (literal > 0); };
  const auto good = [&](Node node) { return value(good_[node]); };
  const auto bad = [&](Node node) { return value(bad_[node]); };
  const auto target = std::find_if(fault_cone_.begin(), fault_cone_.end(), [&](Node node) {
    return circuit_.kind(node) == Gate::output && good(node) != bad(node);
  });
  lifter_.lift(fault, *target, good, bad, cube);
}

}  // namespace meltstage::dft
