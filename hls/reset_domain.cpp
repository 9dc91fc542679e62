// SPDX-License-Identifier: Apache-2.0
#include "hls/reset_domain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/error.hpp"

namespace meltstage::hls {
namespace {

constexpr std::size_t kMostInputs = 5;

// Values of some inputs.
using Fixed = std::vector<std::pair<Node, bool>>;

std::vector<bool> behind(const Graph& graph, const std::vector<Node>& roots) {
  std::vector<bool> needed(graph.size(), false);
  for (const Node root : roots) needed[root] = true;
  for (Node node = static_cast<Node>(graph.size()); node-- > 0;)
    for (unsigned i = 0; needed[node] && i < argument_count(graph[node].op); ++i)
      needed[graph[node].arguments[i]] = true;
  return needed;
}

Node made(Graph& graph, const Expression& e, const std::array<Node, 3>& arguments) {
  switch (e.op) {
    case Op::kNot:
      return graph.invert(arguments[0]);
    case Op::kSelect:
      return graph.select(arguments[0], arguments[1], arguments[2]);
    case Op::kConcat:
      return graph.concat(arguments[0], arguments[1]);
    case Op::kSlice:
      return graph.slice(arguments[0], e.low, e.width);
    case Op::kSignExtend:
      return graph.sign_extend(arguments[0], e.width);
    default:
      return graph.binary(e.op, arguments[0], arguments[1]);
  }
}

// The roots as they are with these inputs.
std::vector<Node> with(Graph& graph, const std::vector<Node>& roots, const Fixed& fixed) {
  const std::vector<bool> needed = behind(graph, roots);
  std::vector<Node> image(needed.size());
  for (Node node = 0; node < needed.size(); ++node) {
    if (!needed[node]) continue;
    const Expression e = graph[node];
    image[node] = node;
    if (const unsigned count = argument_count(e.op); count > 0) {
      std::array<Node, 3> arguments{};
      bool changed = false;
      for (unsigned i = 0; i < count; ++i) {
        arguments[i] = image[e.arguments[i]];
        changed = changed || arguments[i] != e.arguments[i];
      }
      if (!changed) continue;
      graph.at(graph.place(node));
      image[node] = made(graph, e, arguments);
    } else if (e.op == Op::kInput) {
      const auto value =
          std::find_if(fixed.begin(), fixed.end(), [&](const auto& input) { return input.first == node; });
      if (value != fixed.end()) image[node] = graph.truth(value->second);
    }
  }
  std::vector<Node> result;
  for (const Node root : roots) result.push_back(image[root]);
  return result;
}

std::vector<Node> inputs_of(const Graph& graph, Node root) {
  const std::vector<bool> needed = behind(graph, {root});
  std::vector<Node> result;
  for (Node node = 0; node < graph.size(); ++node) {
    if (!needed[node] || (graph[node].op != Op::kInput && graph[node].op != Op::kAny)) continue;
    result.push_back(node);
    if (graph[node].op == Op::kAny || graph.width(node) != 1 || result.size() > kMostInputs)
      throw UserError(fmt::format(
          "hls_in_reset(): found it to depend on more, expected at most {} flops and pins of a bit",
          kMostInputs));
  }
  return result;
}

// All ways to give inputs 0, 1 or, with `left`, no value; those with fewer values come first.
std::vector<Fixed> assignments(const std::vector<Node>& inputs, bool left) {
  std::vector<Fixed> result{{}};
  for (const Node input : inputs) {
    std::vector<Fixed> longer;
    for (const Fixed& fixed : result) {
      if (left) longer.push_back(fixed);
      for (const bool value : {false, true}) {
        longer.push_back(fixed);
        longer.back().emplace_back(input, value);
      }
    }
    result = std::move(longer);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Fixed& a, const Fixed& b) { return a.size() < b.size(); });
  return result;
}

}  // namespace

std::vector<std::optional<Node>> next_out_of_reset(Circuit& circuit, Node active) {
  Graph& graph = circuit.graph;
  std::vector<Node> next;
  for (const Flop& flop : circuit.flops) next.push_back(flop.next);
  const auto value_of_active = [&](const Fixed& fixed) -> std::optional<bool> {
    const Node value = with(graph, {active}, fixed)[0];
    return graph.is_constant(value) ? std::optional(!graph.value(value).isZero()) : std::nullopt;
  };
  // What each flop does for all values that `active` can depend on.
  struct Case {
    Fixed fixed;
    bool in_reset;
    std::vector<Node> next;
  };
  const std::vector<Node> inputs = inputs_of(graph, active);
  std::vector<Case> cases;
  for (const Fixed& fixed : assignments(inputs, false))
    cases.push_back({fixed, value_of_active(fixed).value(), with(graph, next, fixed)});

  std::vector<std::optional<Node>> result(next.size());
  for (const Fixed& fixed : assignments(inputs, true)) {
    if (value_of_active(fixed).value_or(true)) continue;
    const std::vector<Node> candidate = with(graph, next, fixed);
    std::vector<bool> holds(next.size(), true);
    for (const Case& one : cases) {
      const std::vector<Node> then = one.in_reset ? std::vector<Node>{} : with(graph, candidate, one.fixed);
      for (std::size_t i = 0; i < next.size(); ++i) {
        const Node expected = one.in_reset ? graph.constant(circuit.flops[i].reset) : then[i];
        if (one.next[i] != expected) holds[i] = false;
      }
    }
    for (std::size_t i = 0; i < next.size(); ++i)
      if (holds[i] && !result[i]) result[i] = candidate[i];
  }
  return result;
}

}  // namespace meltstage::hls
