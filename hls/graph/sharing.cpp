// SPDX-License-Identifier: Apache-2.0
#include "hls/graph/sharing.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <utility>

namespace meltstage::hls {
namespace {

// A value that is a x b, both with their signs, `when` that holds, and `rest` otherwise; without `rest` it is
// the product always.
struct Choice {
  Node when;
  Node a;
  Node b;
  std::optional<Node> rest;
  unsigned products = 1;
};

// Looks for products behind the choices that lead to one flop.
class Products {
 public:
  explicit Products(Graph& graph) : graph_(graph) {}

  std::optional<Choice> behind(Node node) {
    if (const auto known = known_.find(node); known != known_.end()) return known->second;
    const std::optional<Choice> found = graph_[node].op == Op::kSelect ? chosen(node) : product(node);
    known_.emplace(node, found);
    return found;
  }

  // The value of `choice`, `width` wide.
  Node value(const Choice& choice, unsigned width) {
    const unsigned bits = std::max(width, graph_.width(choice.a) + graph_.width(choice.b));
    const Node product =
        graph_.binary(Op::kMul, graph_.sign_extend(choice.a, bits), graph_.sign_extend(choice.b, bits));
    const Node low = graph_.slice(product, 0, width);
    return choice.rest ? graph_.select(choice.when, low, *choice.rest) : low;
  }

 private:
  // The operand without the bits that only repeat its sign.
  Node shortest(Node operand) { return graph_.slice(operand, 0, graph_[operand].significant); }

  std::optional<Choice> product(Node node) {
    const Expression e = graph_[node];
    if (e.op == Op::kConcat && graph_.is_zero(e.arguments[0])) return longer(e.arguments[1], false);
    if (e.op == Op::kSignExtend) return longer(e.arguments[0], true);
    if (e.op == Op::kConcat && graph_.is_zero(e.arguments[1])) return shifted(e.arguments[0], e.arguments[1]);
    if (e.op != Op::kMul) return std::nullopt;
    Node a = shortest(e.arguments[0]);
    Node b = shortest(e.arguments[1]);
    if (graph_.width(a) < graph_.width(b)) std::swap(a, b);
    return Choice{graph_.truth(true), a, b, std::nullopt};
  }

  // A product that goes on to the left as it does in whole numbers.
  std::optional<Choice> longer(Node node, bool with_sign) {
    const Expression e = graph_[node];
    if (e.op != Op::kMul) return std::nullopt;
    const Expression a = graph_[e.arguments[0]];
    const Expression b = graph_[e.arguments[1]];
    const bool exact = with_sign ? a.significant + b.significant <= e.width
                                 : a.used + b.used <= e.width && a.used < e.width && b.used < e.width;
    return exact ? product(node) : std::nullopt;
  }

  // A product with zeros below: one of its operands is that much larger.
  std::optional<Choice> shifted(Node node, Node zeros) {
    if (graph_[node].op != Op::kMul) return std::nullopt;
    std::optional<Choice> result = product(node);
    result->b = graph_.concat(result->b, zeros);
    if (graph_.width(result->a) < graph_.width(result->b)) std::swap(result->a, result->b);
    return result;
  }

  std::optional<Choice> chosen(Node node) {
    const Expression e = graph_[node];
    const Node condition = e.arguments[0];
    const auto then = behind(e.arguments[1]);
    const auto otherwise = behind(e.arguments[2]);
    if (then && otherwise) return both(condition, *then, *otherwise);
    if (then) return one(condition, *then, e.arguments[2]);
    if (otherwise) return one(graph_.invert(condition), *otherwise, e.arguments[1]);
    return std::nullopt;
  }

  Choice one(Node condition, Choice choice, Node other) {
    choice.when = graph_.both(condition, choice.when);
    choice.rest = choice.rest ? graph_.select(condition, *choice.rest, other) : other;
    return choice;
  }

  Choice both(Node condition, const Choice& then, const Choice& otherwise) {
    const auto operand = [&](Node x, Node y) {
      const unsigned bits = std::max(graph_.width(x), graph_.width(y));
      return graph_.select(condition, graph_.sign_extend(x, bits), graph_.sign_extend(y, bits));
    };
    Choice result{graph_.select(condition, then.when, otherwise.when), operand(then.a, otherwise.a),
                  operand(then.b, otherwise.b), then.rest ? then.rest : otherwise.rest,
                  then.products + otherwise.products};
    if (then.rest && otherwise.rest) result.rest = graph_.select(condition, *then.rest, *otherwise.rest);
    return result;
  }

  Graph& graph_;
  std::unordered_map<Node, std::optional<Choice>> known_;
};

}  // namespace

void share_products(Circuit& circuit) {
  for (Flop& flop : circuit.flops) {
    Products products(circuit.graph);
    const auto choice = products.behind(flop.next);
    if (choice && choice->products > 1) flop.next = products.value(*choice, flop.field.width);
  }
}

}  // namespace meltstage::hls
