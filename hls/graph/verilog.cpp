// SPDX-License-Identifier: Apache-2.0
#include "hls/graph/verilog.hpp"

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <llvm/ADT/SmallString.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "hls/graph/names.hpp"
#include "hls/graph/reset_domain.hpp"

namespace meltstage::hls {
namespace {

// A name as Verilog takes it, whatever it holds.
std::string identifier(const std::string& name) { return is_identifier(name) ? name : '\\' + name + ' '; }

std::string range(unsigned width) { return width == 1 ? "" : fmt::format("[{}:0] ", width - 1); }

std::string literal(const APInt& value) {
  llvm::SmallString<40> digits;
  value.toStringUnsigned(digits, 16);
  return value.getBitWidth() == 1 ? fmt::format("1'b{}", digits.str().str())
                                  : fmt::format("{}'h{}", value.getBitWidth(), digits.str().str());
}

// What inputs of the graph are called in the text.
using Names = std::unordered_map<std::string, std::string>;

// Writes the expressions behind some nodes, each once, in an order in which every name stands before its use.
class Expressions {
 public:
  Expressions(const Circuit& circuit, Names names, std::ostream& out)
      : graph_(circuit.graph), names_(std::move(names)), wires_(wires_of(circuit)), out_(out) {}

  void write(const std::vector<Node>& roots) {
    std::vector<bool> needed(graph_.size(), false);
    for (const Node root : roots) needed[root] = true;
    for (Node node = static_cast<Node>(graph_.size()); node-- > 0;) {
      if (!needed[node]) continue;
      for (unsigned i = 0; i < argument_count(graph_[node].op); ++i) needed[graph_[node].arguments[i]] = true;
    }
    for (Node node = 0; node < graph_.size(); ++node)
      if (needed[node] && !stands_inline(node)) write_one(node);
  }

  std::string text(Node node) const {
    const Expression& e = graph_[node];
    const auto argument = [&](unsigned i) { return text(e.arguments[i]); };
    if (e.op == Op::kInput) {
      const auto known = names_.find(graph_.name(node));
      return known == names_.end() ? identifier(graph_.name(node)) : known->second;
    }
    if (e.op == Op::kConstant) return literal(graph_.value(node));
    if (!stands_inline(node)) return wire(node);
    if (e.op == Op::kSlice)
      return e.width == 1 ? fmt::format("{}[{}]", argument(0), e.low)
                          : fmt::format("{}[{}:{}]", argument(0), e.low + e.width - 1, e.low);
    if (e.op == Op::kConcat) return fmt::format("{{{}, {}}}", argument(0), argument(1));
    return '~' + argument(0);
  }

 private:
  // The beginning of wires' names that no flop or pin has before a number.
  static std::string wires_of(const Circuit& circuit) {
    std::vector<std::string> taken;
    for (const Flop& flop : circuit.flops) taken.push_back(flop.field.name);
    for (const auto* pins : {&circuit.inputs, &circuit.outputs})
      for (const Pin& pin : *pins) taken.push_back(pin.field.name);
    std::string result = "n";
    const auto is_like_a_wire = [&](const std::string& name) {
      return name.size() > result.size() && name.starts_with(result) &&
             name.find_first_not_of("0123456789", result.size()) == std::string::npos;
    };
    while (std::any_of(taken.begin(), taken.end(), is_like_a_wire)) result += '_';
    return result;
  }
  std::string wire(Node node) const { return fmt::format("{}{}", wires_, node); }

  bool stands_inline(Node node) const {
    const Expression& e = graph_[node];
    switch (e.op) {
      case Op::kInput:
      case Op::kConstant:
        return true;
      case Op::kConcat:
        return graph_.is_constant(e.arguments[0]);
      case Op::kSlice:
      case Op::kNot:
        return has_name(e.arguments[0]);
      default:
        return false;
    }
  }
  // One that can be followed by an index.
  bool has_name(Node node) const { return graph_[node].op == Op::kInput || !stands_inline(node); }

  std::string bit(Node node, unsigned index) const {
    const Expression& e = graph_[node];
    if (e.width == 1) return text(node);
    if (e.op == Op::kSlice && stands_inline(node))
      return fmt::format("{}[{}]", text(e.arguments[0]), e.low + index);
    return fmt::format("{}[{}]", text(node), index);
  }

  void write_one(Node node) {
    const Place& place = graph_.place(node);
    if (place.line != 0 && (place.file != last_.file || place.line != last_.line)) {
      fmt::print(out_, "  // {}:{}\n", place.file, place.line);
      last_ = place;
    }
    const Expression& e = graph_[node];
    if (e.op == Op::kAny) {
      fmt::print(out_, "  wire {}{} = '0;  // left open by the C++\n", range(e.width), wire(node));
    } else {
      fmt::print(out_, "  wire {}{} = {};\n", range(e.width), wire(node), operation(e));
    }
  }

  std::string operation(const Expression& e) const {
    const auto a = [&] { return text(e.arguments[0]); };
    const auto b = [&] { return text(e.arguments[1]); };
    const auto of_two = [&](const char* sign) { return fmt::format("{} {} {}", a(), sign, b()); };
    const auto signed_of_two = [&](const char* sign) {
      return fmt::format("$signed({}) {} $signed({})", a(), sign, b());
    };
    switch (e.op) {
      case Op::kNot:
        return '~' + a();
      case Op::kAnd:
        return of_two("&");
      case Op::kOr:
        return of_two("|");
      case Op::kXor:
        return of_two("^");
      case Op::kAdd:
        return of_two("+");
      case Op::kSub:
        return of_two("-");
      case Op::kMul:  // with the sign, as proofs see operands of products
        return graph_.is_constant(e.arguments[1]) ? of_two("*") : signed_of_two("*");
      case Op::kUnsignedDivide:
        return of_two("/");
      case Op::kUnsignedRemainder:
        return of_two("%");
      case Op::kSignedDivide:
        return signed_of_two("/");
      case Op::kSignedRemainder:
        return signed_of_two("%");
      case Op::kShiftLeft:
        return of_two("<<");
      case Op::kShiftRight:
        return of_two(">>");
      case Op::kShiftRightSigned:
        return fmt::format("$signed({}) >>> {}", a(), b());
      case Op::kEqual:
        return of_two("==");
      case Op::kLess:
        return of_two("<");
      case Op::kLessSigned:
        return signed_of_two("<");
      case Op::kSelect:
        return fmt::format("{} ? {} : {}", a(), b(), text(e.arguments[2]));
      case Op::kConcat:
        return fmt::format("{{{}, {}}}", a(), b());
      case Op::kSlice:
        return e.width == 1 ? fmt::format("{}[{}]", a(), e.low)
                            : fmt::format("{}[{}:{}]", a(), e.low + e.width - 1, e.low);
      default: {
        const unsigned from = graph_.width(e.arguments[0]);
        return fmt::format("{{{{{}{{{}}}}}, {}}}", e.width - from, bit(e.arguments[0], from - 1), a());
      }
    }
  }

  const Graph& graph_;
  Names names_;
  std::string wires_;
  std::ostream& out_;
  Place last_;
};

// ---- Flops -----------------------------------------------------------------------------------------------

// "u_mem.staged_q[5]": the path of the block, the flop's name in it, its word.
struct FlopName {
  explicit FlopName(const std::string& name) {
    const std::size_t dot = name.rfind('.');
    if (dot != std::string::npos) path = name.substr(0, dot);
    rest = name.substr(dot + 1);  // all when there is none
    const std::size_t bracket = rest.find('[');
    const std::string digits = bracket == std::string::npos ? "" : rest.substr(bracket + 1);
    if (digits.size() < 2 || digits.size() > 6 || digits.find_first_not_of("0123456789") != digits.size() - 1)
      return;
    word = static_cast<unsigned>(std::stoul(digits));
    array = rest.substr(0, bracket);
  }
  std::string path;
  std::string rest;
  std::string array;  // if it is a word of one
  std::optional<unsigned> word;
};

// Words of one name and width that have all indices from `first` to `last`.
struct Array {
  unsigned width = 0, first = std::numeric_limits<unsigned>::max(), last = 0, words = 0;
  bool alike = true;
  bool is_one() const { return alike && words == last - first + 1; }
};

// A block: its flops, and the blocks in it.
struct Block {
  std::string name;
  std::vector<std::string> declarations;
  std::vector<Block> inner;

  Block& at(const std::string& path) {
    if (path.empty()) return *this;
    const std::string first = path.substr(0, path.find('.'));
    auto found = std::find_if(inner.begin(), inner.end(), [&](const Block& b) { return b.name == first; });
    if (found == inner.end())
      found = inner.insert(inner.end(), {.name = first, .declarations = {}, .inner = {}});
    return found->at(first.size() == path.size() ? "" : path.substr(first.size() + 1));
  }

  void write(std::ostream& out, const std::string& margin) const {
    for (const std::string& line : declarations) fmt::print(out, "{}{}\n", margin, line);
    for (const Block& block : inner) {
      fmt::print(out, "{}if (1) begin : {}\n", margin, identifier(block.name));
      block.write(out, margin + "  ");
      fmt::print(out, "{}end\n", margin);
    }
  }
};

// Flops stand in named blocks, so that tools know them by the paths that they have among instances.
class Flops {
 public:
  explicit Flops(const std::vector<Flop>& flops) {
    std::map<std::string, Array> arrays;
    for (const Flop& flop : flops) {
      const FlopName name(flop.field.name);
      if (!name.word || flop.field.kept.isZero()) continue;
      Array& array = arrays[name.path + '.' + name.array];
      array.alike = array.words == 0 || (array.alike && array.width == flop.field.width);
      array.width = flop.field.width;
      array.first = std::min(array.first, *name.word);
      array.last = std::max(array.last, *name.word);
      ++array.words;
    }
    for (const Flop& flop : flops) {
      if (flop.field.kept.isZero()) continue;  // a constant
      const FlopName name(flop.field.name);
      Block& block = top_.at(name.path);
      std::string path;
      for (std::size_t from = 0; from < name.path.size();) {
        const std::size_t to = std::min(name.path.find('.', from), name.path.size());
        path += identifier(name.path.substr(from, to - from)) + '.';
        from = to + 1;
      }
      const auto array = arrays.find(name.path + '.' + name.array);
      if (name.word && array->second.is_one()) {
        names_[flop.field.name] = fmt::format("{}{}[{}]", path, identifier(name.array), *name.word);
        if (*name.word == array->second.first)
          block.declarations.push_back(fmt::format("(* mem2reg *) logic {}{} [{}:{}];",
                                                   range(flop.field.width), identifier(name.array),
                                                   array->second.first, array->second.last));
      } else {
        names_[flop.field.name] = path + identifier(name.rest);
        block.declarations.push_back(
            fmt::format("logic {}{};", range(flop.field.width), identifier(name.rest)));
      }
    }
  }

  void declare(std::ostream& out) const { top_.write(out, "  "); }
  const Names& names() const { return names_; }

 private:
  Block top_;
  Names names_;
};

// Flops that one reset holds.
// Flops of one reset, or of none but what the C++ does at a clock.
struct Domain {
  std::string reset_n;  // the wire, active low; empty for none
  std::vector<const Flop*> flops;
  std::vector<Node> next;
};

// A name that no flop, block or pin has.
std::string reset_wire(const Circuit& circuit) {
  std::vector<std::string> taken;
  for (const Flop& flop : circuit.flops)
    taken.push_back(flop.field.name.substr(0, flop.field.name.find('.')));
  for (const auto* pins : {&circuit.inputs, &circuit.outputs})
    for (const Pin& pin : *pins) taken.push_back(pin.field.name);
  std::string result = "reset_n";
  while (std::find(taken.begin(), taken.end(), result) != taken.end()) result += '_';
  return result;
}

// In the reset of the C++ if it says one and that is all it does to the flop; in that of the pin, which a
// block without one gets; in none if the C++ does something else while the pin is low.
std::vector<Domain> domains(Circuit& circuit) {
  using Nexts = std::vector<std::optional<Node>>;
  Nexts inside(circuit.flops.size()), at_pin(circuit.flops.size());
  if (circuit.in_reset) inside = next_out_of_reset(circuit, *circuit.in_reset);
  bool has_pin = false;
  for (const Pin& pin : circuit.inputs) {
    if (pin.field.name != "rst_ni") continue;
    has_pin = true;
    at_pin = next_out_of_reset(circuit, circuit.graph.invert(pin.node));
  }
  Domain by_pin{"rst_ni", {}, {}}, by_wire{reset_wire(circuit), {}, {}}, by_clock{"", {}, {}};
  for (std::size_t i = 0; i < circuit.flops.size(); ++i) {
    const Flop& flop = circuit.flops[i];
    if (flop.field.kept.isZero()) continue;
    Domain& domain = inside[i] ? by_wire : at_pin[i] || !has_pin ? by_pin : by_clock;
    domain.flops.push_back(&flop);
    domain.next.push_back(inside[i] ? *inside[i] : at_pin[i].value_or(flop.next));
  }
  std::vector<Domain> result;
  for (Domain& domain : std::array{std::move(by_pin), std::move(by_wire), std::move(by_clock)})
    if (!domain.flops.empty()) result.push_back(std::move(domain));
  return result;
}

}  // namespace

void write_verilog(Circuit circuit, const std::string& name, std::ostream& out) {
  fmt::print(
      out,
      "// Generated from C++ by meltstage-hls.\nmodule {} (\n  input  logic clk_i,\n  input  logic rst_ni",
      name);
  for (const Pin& pin : circuit.inputs)
    if (pin.field.name != "rst_ni")
      fmt::print(out, ",\n  input  logic {}{}", range(pin.field.width), identifier(pin.field.name));
  for (const Pin& pin : circuit.outputs)
    fmt::print(out, ",\n  output logic {}{}", range(pin.field.width), identifier(pin.field.name));
  fmt::print(out, "\n);\n\n");

  const std::vector<Domain> resets = domains(circuit);
  const Flops flops(circuit.flops);
  flops.declare(out);
  std::vector<Node> roots;
  for (const Domain& domain : resets) roots.insert(roots.end(), domain.next.begin(), domain.next.end());
  for (const Pin& pin : circuit.outputs) roots.push_back(pin.node);
  if (circuit.in_reset) roots.push_back(*circuit.in_reset);
  Expressions expressions(circuit, flops.names(), out);
  expressions.write(roots);

  if (circuit.in_reset)
    fmt::print(out, "\n  wire {} = ~({});\n", reset_wire(circuit), expressions.text(*circuit.in_reset));
  for (const Domain& domain : resets) {
    const auto assign = [&](const Flop& flop, const std::string& value) {
      fmt::print(out, "      {} <= {};\n", flops.names().at(flop.field.name), value);
    };
    const bool has_reset = !domain.reset_n.empty();
    fmt::print(out, "\n  always_ff @(posedge clk_i{}) begin\n",
               has_reset ? " or negedge " + domain.reset_n : "");
    if (has_reset) {
      fmt::print(out, "    if (!{}) begin\n", domain.reset_n);
      for (const Flop* flop : domain.flops) assign(*flop, literal(flop->reset));
      fmt::print(out, "    end else begin\n");
    }
    for (std::size_t i = 0; i < domain.flops.size(); ++i)
      assign(*domain.flops[i], expressions.text(domain.next[i]));
    if (has_reset) fmt::print(out, "    end\n");
    fmt::print(out, "  end\n");
  }
  fmt::print(out, "\n");
  for (const Pin& pin : circuit.outputs)
    fmt::print(out, "  assign {} = {};\n", identifier(pin.field.name), expressions.text(pin.node));
  fmt::print(out, "\nendmodule\n");
}

}  // namespace meltstage::hls
