// SPDX-License-Identifier: Apache-2.0
#include "rtl_side.hpp"

#include <fmt/format.h>

#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>

#include "cmodel/spec.hpp"
#include "solver_bits.hpp"

namespace meltstage::proof {

namespace {

constexpr const char* kModule = "tc_algor";

struct Port {
  std::string name;
  unsigned width;
};

// Lines "; yosys-smt2-input NAME WIDTH" (or output).
std::vector<Port> ports(const std::string& text, const std::string& direction) {
  std::vector<Port> found;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string semicolon;
    std::string kind;
    Port port{};
    if (words >> semicolon >> kind >> port.name >> port.width && kind == "yosys-smt2-" + direction) {
      found.push_back(port);
    }
  }
  return found;
}

z3::expr as_word(const z3::expr& value) {
  z3::context& c = SolverBits::context();
  return value.is_bool() ? z3::ite(value, c.bv_val(1, 1), c.bv_val(0, 1)) : value;
}

// The file makes each flop, input and wire a function of a state and the clock a relation of two states. One
// state is enough here: with its argument taken away, each of them is a constant, and the relation is a list
// of pairs (next value, register).
class Netlist {
 public:
  explicit Netlist(const std::string& smt) {
    const std::string state = fmt::format(R"(\|{}_s\|)", kModule);
    const std::size_t relation = smt.find(fmt::format("(define-fun |{}_t|", kModule));
    if (relation == std::string::npos) throw std::runtime_error("SMT-LIB file: found no module tc_algor");
    text_ = std::regex_replace(smt.substr(0, relation), std::regex(R"(\((\|[^|]*\|) state\))"), "$1");
    text_ = std::regex_replace(text_, std::regex("\\(\\(state " + state + "\\)\\)"), "()");
    text_ = std::regex_replace(text_, std::regex("\\(" + state + "\\)"), "()");
    const std::regex pair(R"(\(= \((\|[^|]*\|) state\) \((\|[^|]*\|) next_state\)\))");
    for (std::sregex_iterator it(smt.begin() + static_cast<std::ptrdiff_t>(relation), smt.end(), pair), end;
         it != end; ++it) {
      registers_.push_back({(*it)[2], (*it)[1]});
    }
  }
  // Names of register and next value, as read() gives them.
  struct Register {
    std::string now;
    std::string next;
  };
  const std::vector<Register>& registers() const { return registers_; }

  // The words of these names, each an expression over free constants.
  Words<z3::expr> read(const std::vector<std::string>& names) const {
    std::string text = text_;
    for (const std::string& name : names) text += fmt::format("(assert (= {0} {0}))\n", name);
    const z3::expr_vector equations = SolverBits::context().parse_string(text.c_str());
    if (equations.size() != names.size())
      throw std::runtime_error("SMT-LIB file: found assertions of its own");
    Words<z3::expr> words;
    for (unsigned i = 0; i < names.size(); ++i) words.emplace(names[i], equations[i].arg(0));
    return words;
  }
  static std::string wire(const std::string& name) { return fmt::format("|{}_n {}|", kModule, name); }

 private:
  std::string text_;
  std::vector<Register> registers_;
};

// Free constants of an expression.
void collect_leaves(const z3::expr& e, std::set<unsigned>& seen, Words<z3::expr>& leaves) {
  if (!seen.insert(Z3_get_ast_id(e.ctx(), e)).second) return;
  if (e.is_const() && e.decl().decl_kind() == Z3_OP_UNINTERPRETED) leaves.emplace(e.decl().name().str(), e);
  for (unsigned i = 0; i < e.num_args(); ++i) collect_leaves(e.arg(i), seen, leaves);
}
z3::expr only_leaf(const z3::expr& e, const std::string& what) {
  std::set<unsigned> seen;
  Words<z3::expr> leaves;
  collect_leaves(e, seen, leaves);
  if (leaves.size() != 1) {
    throw std::runtime_error(
        fmt::format("{}: expected one free word behind it, found {}", what, leaves.size()));
  }
  return leaves.begin()->second;
}

// Substitution as a list of pairs.
class Substitution {
 public:
  void add(const z3::expr& from, const z3::expr& to) {
    from_.push_back(from);
    to_.push_back(to);
  }
  z3::expr operator()(z3::expr e) const { return e.substitute(from_, to_); }

 private:
  z3::expr_vector from_{SolverBits::context()};
  z3::expr_vector to_{SolverBits::context()};
};

}  // namespace

RtlSide load_rtl(const std::string& path, const std::vector<FlopWord>& flops) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": can not be read; expected the SMT-LIB 2 file of tc_algor");
  std::ostringstream content;
  content << file.rdbuf();
  std::vector<Port> inputs = ports(content.str(), "input");
  std::erase_if(inputs, [](const Port& port) { return port.name == "clk_i" || port.name == "rst_ni"; });
  const std::vector<Port> outputs = ports(content.str(), "output");

  const Netlist netlist(content.str());
  std::vector<std::string> names{netlist.wire("rst_ni")};
  for (const FlopWord& flop : flops) names.push_back(netlist.wire(flop.name));
  for (const Port& port : inputs) names.push_back(netlist.wire(port.name));
  for (const Port& port : outputs) names.push_back(netlist.wire(port.name));
  for (const auto& [now, next] : netlist.registers()) {
    names.push_back(now);
    names.push_back(next);
  }
  const Words<z3::expr> words = netlist.read(names);
  const auto wire = [&](const std::string& name) { return as_word(words.at(netlist.wire(name))); };
  if (netlist.registers().size() != flops.size()) {
    throw std::runtime_error(fmt::format("RTL: expected the kernel's {} flops, found {} registers",
                                         flops.size(), netlist.registers().size()));
  }

  z3::context& c = SolverBits::context();
  const z3::expr reset = only_leaf(wire("rst_ni"), "rst_ni");
  Substitution released;
  released.add(reset, c.bv_val(1, 1));
  Substitution held;
  held.add(reset, c.bv_val(0, 1));

  // With reset high each flop's wire is a register of its own; that register gets the flop's name.
  Substitution named;
  Words<z3::expr> next_of;
  for (const auto& [now, next] : netlist.registers()) {
    next_of.emplace(words.at(now).decl().name().str(), as_word(words.at(next)));
  }
  Words<z3::expr> next;
  for (const FlopWord& flop : flops) {
    const z3::expr leaf = only_leaf(released(wire(flop.name)).simplify(), flop.name);
    const auto found = next_of.find(leaf.decl().name().str());
    if (found == next_of.end())
      throw std::runtime_error(flop.name + ": expected a register of its own behind it");
    named.add(leaf, c.constant(flop.name.c_str(), leaf.get_sort()));
    next.emplace(flop.name, found->second);
    next_of.erase(found);
  }

  RtlSide rtl;
  for (const FlopWord& flop : flops) {
    const z3::expr now = c.bv_const(flop.name.c_str(), flop.width);
    z3::solver solver(c);
    solver.add(named(released(wire(flop.name))) != now);
    if (solver.check() != z3::unsat) throw std::runtime_error(flop.name + ": its wire is not its register");
    rtl.before.emplace(flop.name, now);
    rtl.after.emplace(flop.name, named(released(next.at(flop.name))));
    rtl.in_reset.emplace(flop.name, held(wire(flop.name)).simplify());
    rtl.in_reset.emplace(flop.name + " after reset", held(next.at(flop.name)).simplify());
  }
  for (const Port& port : inputs) {
    const z3::expr word = wire(port.name);
    if (port.name != "params_i") {
      rtl.before.emplace(port.name, word.simplify());
      continue;
    }
    for (unsigned r = 0; r < chip::spec::kHoldingCount; ++r) {
      rtl.before.emplace(register_name(r), word.extract(16 * r + 15, 16 * r).simplify());
    }
  }
  for (const Port& port : outputs) rtl.after.emplace(port.name, named(released(wire(port.name))));
  return rtl;
}

}  // namespace meltstage::proof
