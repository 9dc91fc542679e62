// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/test_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cadical.hpp>
#include <fstream>
#include <stdexcept>

namespace meltstage::dft {

namespace {

constexpr int kSat = 10;
constexpr int kUnsat = 20;
constexpr std::size_t kAll = ~std::size_t{0};

}  // namespace

struct TestSolver::Solver {
  CaDiCaL::Solver engine;
};

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
      need_(circuit.size(), 0),
      good_(circuit.size(), 0),
      bad_(circuit.size(), 0),
      differs_(circuit.size(), 0) {
  for (std::uint32_t i = 0; i < circuit.inputs().size(); ++i) input_of_[circuit.inputs()[i]] = i;
}
TestSolver::TestSolver(TestSolver&&) noexcept = default;
TestSolver::~TestSolver() = default;

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

// The good circuit of the support.
void TestSolver::start(bool held) {
  clauses_.clear();
  variables_ = 0;
  std::vector<int> in;
  for (const Node node : support_) good_[node] = bad_[node] = ++variables_;
  for (const Node node : support_) {
    const auto fanin = circuit_.fanin(node);
    const bool cut =
        std::any_of(fanin.begin(), fanin.end(), [&](Node driver) { return in_support_[driver] == 0; });
    in.clear();
    for (const Node driver : fanin) in.push_back(good_[driver]);
    if (!cut) add_gate(node, in, good_[node]);  // at the edge of a window any value may come in
    if (held && circuit_.kind(node) == Gate::input && circuit_.held()[input_of_[node]] >= 0)
      add({circuit_.held()[input_of_[node]] != 0 ? good_[node] : -good_[node]});
  }
  first_variables_ = variables_;
}

// The faulty circuit where the fault reaches, and a chain of differences from the fault to an output.
// `activation`, when it isn't 0, must be true for the fault to be there: the other clauses only define what
// is new and stay.
void TestSolver::add_fault(const Fault& fault, int activation) {
  const auto demand = [&](int literal) {
    if (activation != 0) clauses_.push_back(-activation);
    add({literal});
  };
  for (const Node node : fault_cone_) {
    bad_[node] = ++variables_;
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
      add_gate(node, in, bad_[node]);
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
  demand(differs_[fault.node]);
  if (fault.pin != kStem) {
    const int line = good_[circuit_.fanin(fault.node)[static_cast<std::size_t>(fault.pin)]];
    demand(fault.stuck ? -line : line);
  }
}

void TestSolver::read_model() {
  model_.resize(static_cast<std::size_t>(variables_) + 1);
  for (int v = 1; v <= variables_; ++v)
    model_[static_cast<std::size_t>(v)] = solver_->engine.val(v) > 0 ? 1 : 0;
}

Verdict TestSolver::solve(const Fault& fault, Cube& cube, std::uint32_t conflict_limit) {
  constexpr int kTry = 1000;  // conflicts, of a problem that need not be decided
  constexpr int kGrowth = 4;  // a solver that has grown to so many times its circuit starts anew
  const Node nearest = cones_.nearest[fault.node];
  if (nearest == kNoNode) return Verdict::redundant;
  if (solver_output_ != nearest || variables_ > kGrowth * first_variables_ + 1000) {
    take_support({nearest});
    start(true);
    solver_ = std::make_unique<Solver>();
    solver_->engine.set("quiet", 1);
    solver_->engine.configure("plain");  // the problems are many and small: no pre- and inprocessing
    solver_output_ = nearest;
  }
  take_fault_cone(fault);
  const int activation = ++variables_;
  add_fault(fault, activation);
  for (const int literal : clauses_) solver_->engine.add(literal);
  clauses_.clear();
  solver_->engine.limit("conflicts", kTry);
  solver_->engine.assume(activation);
  ++effort_.near_calls;
  int status = solver_->engine.solve();
  if (status == kSat) read_model();
  solver_->engine.add(-activation);
  solver_->engine.add(0);
  if (status != kSat) {
    if (!window_has_effect(fault)) return Verdict::redundant;
    // more and more outputs, small cones first
    for (std::size_t most = 8;; most *= 8) {
      const bool all = encode_outputs(fault, true, most) <= most;
      ++effort_.full_calls;
      status = run(all ? conflict_limit : kTry);
      if (status == kSat || all) break;
    }
    if (status == kUnsat && support_is_held()) {
      encode_outputs(fault, false, kAll);
      return run(conflict_limit) == kSat ? Verdict::held : Verdict::redundant;
    }
  }
  if (status == kSat) lift(fault, cube);
  for (const Node node : fault_cone_) bad_[node] = good_[node];
  return status == kSat ? Verdict::test : status == kUnsat ? Verdict::redundant : Verdict::aborted;
}

bool TestSolver::support_is_held() const {
  return std::any_of(support_.begin(), support_.end(), [&](Node node) {
    return circuit_.kind(node) == Gate::input && circuit_.held()[input_of_[node]] >= 0;
  });
}

// Most redundant faults are so in their surroundings: whatever comes in at the edge of a piece of the circuit
// around the fault, no difference leaves it. That is quickly refuted where the whole circuit would be large.
void TestSolver::encode_window(const Fault& fault) {
  constexpr std::size_t kCone = 150, kSupport = 1500;
  for (const Node node : fault_cone_) in_fault_cone_[node] = 0;
  for (const Node node : support_) in_support_[node] = 0;
  std::vector<Node> cone{fault.node};
  in_fault_cone_[fault.node] = 1;
  for (std::size_t i = 0; i < cone.size() && cone.size() < kCone; ++i) {
    for (const Node next : circuit_.fanout(cone[i])) {
      if (in_fault_cone_[next] != 0) continue;
      in_fault_cone_[next] = 1;
      cone.push_back(next);
    }
  }
  fault_cone_ = std::move(cone);
  std::sort(fault_cone_.begin(), fault_cone_.end());
  support_ = fault_cone_;
  for (const Node node : support_) in_support_[node] = 1;
  for (std::size_t i = 0; i < support_.size(); ++i) {
    // all drivers of a node or none: half of them would make it an edge, and no use of them. Those of the
    // cone are always there.
    if (support_.size() > kSupport && in_fault_cone_[support_[i]] == 0) break;
    for (const Node driver : circuit_.fanin(support_[i])) {
      if (in_support_[driver] != 0) continue;
      in_support_[driver] = 1;
      support_.push_back(driver);
    }
  }
  std::sort(support_.begin(), support_.end());
  solver_output_ = kNoNode;
  start(false);
  window_ = true;
  add_fault(fault, 0);
  window_ = false;
}

bool TestSolver::window_has_effect(const Fault& fault) {
  ++effort_.window_calls;
  encode_window(fault);
  constexpr std::uint32_t kConflicts = 2000;
  return run(kConflicts) != kUnsat;
}

// To those outputs that the fault reaches, at most so many, smallest cones first. Returns how many it
// reaches.
std::size_t TestSolver::encode_outputs(const Fault& fault, bool held, std::size_t most) {
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
  take_support(std::move(targets));
  take_fault_cone(fault);
  start(held);
  add_fault(fault, 0);
  solver_output_ = kNoNode;
  return count;
}

// What is encoded, in a solver of its own.
int TestSolver::run(std::uint32_t conflict_limit) {
  solver_ = std::make_unique<Solver>();
  solver_->engine.set("quiet", 1);
  solver_->engine.configure("plain");
  for (const int literal : clauses_) solver_->engine.add(literal);
  clauses_.clear();
  if (conflict_limit != 0) solver_->engine.limit("conflicts", static_cast<int>(conflict_limit));
  const int status = solver_->engine.solve();
  if (status == kSat) read_model();
  return status;
}

bool TestSolver::prove_untestable(const Fault& fault, const std::filesystem::path& folder,
                                  const std::string& name) {
  if (window_has_effect(fault))
    encode_outputs(fault, true, kAll);
  else
    encode_window(fault);
  const std::filesystem::path cnf = folder / (name + ".cnf"), drat = folder / (name + ".drat");
  std::string text =
      fmt::format("p cnf {} {}\n", variables_, std::count(clauses_.begin(), clauses_.end(), 0));
  for (const int literal : clauses_) text += literal == 0 ? "0\n" : fmt::format("{} ", literal);
  std::ofstream file(cnf, std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error(cnf.string() + ": can't be written");
  CaDiCaL::Solver solver;
  solver.set("quiet", 1);
  solver.set("binary", 0);
  if (!solver.trace_proof(drat.c_str())) throw std::runtime_error(drat.string() + ": can't be written");
  solver.configure("plain");  // steps that follow by unit propagation alone
  for (const int literal : clauses_) solver.add(literal);
  clauses_.clear();
  const bool refuted = solver.solve() == kUnsat;
  solver.close_proof_trace();
  return refuted;
}

// Which inputs keep the difference at one output, traced back from there through the good and the faulty
// circuit: a controlling input justifies a gate by itself, otherwise all inputs do.
void TestSolver::lift(const Fault& fault, Cube& cube) {
  constexpr std::uint8_t kGood = 1, kBad = 2;
  const auto good = [&](Node node) { return model_[static_cast<std::size_t>(good_[node])] != 0; };
  const auto bad = [&](Node node) { return model_[static_cast<std::size_t>(bad_[node])] != 0; };
  const auto require = [&](Node node, std::uint8_t which) {
    need_[node] |= in_fault_cone_[node] != 0 ? which : kGood;
  };
  for (const Node node : support_) need_[node] = 0;
  Node target = kNoNode;
  for (const Node node : support_) {
    if (in_fault_cone_[node] != 0 && circuit_.kind(node) == Gate::output && good(node) != bad(node)) {
      target = node;
      break;
    }
  }
  require(target, kGood);
  require(target, kBad);
  require(fault.pin == kStem ? fault.node : circuit_.fanin(fault.node)[static_cast<std::size_t>(fault.pin)],
          kGood);
  cube.clear();
  for (std::size_t i = support_.size(); i-- > 0;) {
    const Node node = support_[i];
    if (need_[node] == 0) continue;
    const auto fanin = circuit_.fanin(node);
    const Gate kind = circuit_.kind(node);
    if (kind == Gate::input && (need_[node] & kGood) != 0 && circuit_.held()[input_of_[node]] < 0)
      cube.emplace_back(input_of_[node], good(node));
    for (const std::uint8_t which : {kGood, kBad}) {
      if ((need_[node] & which) == 0) continue;
      if (which == kBad && node == fault.node && fault.pin == kStem) continue;
      // an input that is itself the faulty line reads the stuck value and needs nothing
      const auto is_stuck = [&](std::size_t pin) {
        return which == kBad && node == fault.node && static_cast<std::int32_t>(pin) == fault.pin;
      };
      const auto value = [&](std::size_t pin) {
        if (is_stuck(pin)) return fault.stuck;
        return which == kGood ? good(fanin[pin]) : bad(fanin[pin]);
      };
      const auto take = [&](std::size_t pin) {
        if (!is_stuck(pin)) require(fanin[pin], which);
      };
      if (kind == Gate::mux) {
        take(2);
        take(value(2) ? 1 : 0);
        continue;
      }
      const bool has_controlling =
          kind == Gate::all || kind == Gate::nall || kind == Gate::any || kind == Gate::none;
      const bool controlling = kind == Gate::any || kind == Gate::none;
      std::size_t choice = fanin.size();
      if (has_controlling) {
        for (std::size_t pin = 0; pin < fanin.size(); ++pin) {
          if (value(pin) != controlling) continue;
          const bool free = is_stuck(pin) || need_[fanin[pin]] != 0;
          if (choice == fanin.size() || free ||
              (need_[fanin[choice]] == 0 && circuit_.level(fanin[pin]) < circuit_.level(fanin[choice])))
            choice = pin;
          if (free) break;
        }
      }
      if (choice != fanin.size()) {
        take(choice);
      } else {
        for (std::size_t pin = 0; pin < fanin.size(); ++pin) take(pin);
      }
    }
  }
  std::sort(cube.begin(), cube.end());
}

}  // namespace meltstage::dft
