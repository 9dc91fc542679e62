// SPDX-License-Identifier: Apache-2.0
#include "hls/verilog.hpp"

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <llvm/ADT/SmallString.h>

#include <algorithm>
#include <vector>

namespace meltstage::hls {
namespace {

// A name as Verilog takes it, whatever it holds.
std::string identifier(const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
  return plain ? name : '\\' + name + ' ';
}

std::string range(unsigned width) { return width == 1 ? "" : fmt::format("[{}:0] ", width - 1); }

std::string literal(const APInt& value) {
  llvm::SmallString<40> digits;
  value.toStringUnsigned(digits, 16);
  return value.getBitWidth() == 1 ? fmt::format("1'b{}", digits.str().str())
                                  : fmt::format("{}'h{}", value.getBitWidth(), digits.str().str());
}

// Writes the expressions behind some nodes, each once, in an order in which every name stands before its use.
class Expressions {
 public:
  Expressions(const Graph& graph, std::ostream& out)
      : graph_(graph), out_(out), named_(graph.size(), false) {}

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
    if (e.op == Op::kInput) return identifier(graph_.name(node));
    if (e.op == Op::kConstant) return literal(graph_.value(node));
    if (!stands_inline(node)) return fmt::format("n{}", node);
    if (e.op == Op::kSlice)
      return e.width == 1 ? fmt::format("{}[{}]", argument(0), e.low)
                          : fmt::format("{}[{}:{}]", argument(0), e.low + e.width - 1, e.low);
    if (e.op == Op::kConcat) return fmt::format("{{{}, {}}}", argument(0), argument(1));
    return '~' + argument(0);
  }

 private:
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
      fmt::print(out_, "  wire {}n{} = '0;  // left open by the C++\n", range(e.width), node);
    } else {
      fmt::print(out_, "  wire {}n{} = {};\n", range(e.width), node, operation(e));
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
      case Op::kMul:
        return of_two("*");
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
  std::ostream& out_;
  std::vector<bool> named_;
  Place last_;
};

}  // namespace

void write_verilog(const Circuit& circuit, const std::string& name, std::ostream& out) {
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
  std::vector<Node> roots;
  for (const Flop& flop : circuit.flops) {
    fmt::print(out, "  logic {}{};\n", range(flop.field.width), identifier(flop.field.name));
    roots.push_back(flop.next);
  }
  for (const Pin& pin : circuit.outputs) roots.push_back(pin.node);
  Expressions expressions(circuit.graph, out);
  expressions.write(roots);
  fmt::print(out, "\n  always_ff @(posedge clk_i or negedge rst_ni) begin\n    if (!rst_ni) begin\n");
  for (const Flop& flop : circuit.flops)
    fmt::print(out, "      {} <= {};\n", identifier(flop.field.name), literal(flop.reset));
  fmt::print(out, "    end else begin\n");
  for (const Flop& flop : circuit.flops)
    fmt::print(out, "      {} <= {};\n", identifier(flop.field.name), expressions.text(flop.next));
  fmt::print(out, "    end\n  end\n\n");
  for (const Pin& pin : circuit.outputs)
    fmt::print(out, "  assign {} = {};\n", identifier(pin.field.name), expressions.text(pin.node));
  fmt::print(out, "\nendmodule\n");
}

void write_promises(const Circuit& circuit, const std::string& name, std::ostream& out) {
  fmt::print(out, "// Generated from C++ by meltstage-hls.\nmodule {} (\n", name);
  for (const Pin& pin : circuit.inputs)
    fmt::print(out, "  input  logic {}{},\n", range(pin.field.width), identifier(pin.field.name));
  for (const Flop& flop : circuit.flops)
    fmt::print(out, "  input  logic {}{},\n", range(flop.field.width), identifier(flop.field.name));
  fmt::print(out, "  output logic {}promise_o\n);\n\n",
             range(static_cast<unsigned>(std::max<std::size_t>(1, circuit.promises.size()))));
  std::vector<Node> roots;
  for (const Promise& promise : circuit.promises) roots.push_back(promise.broken);
  Expressions expressions(circuit.graph, out);
  expressions.write(roots);
  for (std::size_t i = 0; i < circuit.promises.size(); ++i) {
    const Promise& promise = circuit.promises[i];
    fmt::print(out, "  assign promise_o{} = {};  // {}:{}: {}\n",
               circuit.promises.size() == 1 ? "" : fmt::format("[{}]", i), expressions.text(promise.broken),
               promise.place.file, promise.place.line, promise.what);
  }
  if (circuit.promises.empty()) fmt::print(out, "  assign promise_o = 1'b0;\n");
  fmt::print(out, "\nendmodule\n");
}

}  // namespace meltstage::hls
