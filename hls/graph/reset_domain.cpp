// SPDX-License-Identifier: Apache-2.0
#include "hls/graph/reset_domain.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "base/error.hpp"

namespace meltstage::hls {
namespace {

constexpr std::size_t kMostInputs = 5;

// Values of some inputs.
using Fixed = std::vector<std::pair<Node, APInt>>;

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
      if (value != fixed.end()) image[node] = graph.constant(value->second);
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
        longer.back().emplace_back(input, APInt(1, value ? 1 : 0));
      }
    }
    result = std::move(longer);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Fixed& a, const Fixed& b) { return a.size() < b.size(); });
  return result;
}

// Flops that have their reset values for good once the pin has been low for long enough.
void add_reset_by(Circuit& circuit, const Pin& pin, std::vector<bool>& reset) {
  Graph& graph = circuit.graph;
  Fixed fixed = {{pin.node, APInt(1, 0)}};
  std::vector<Node> next;
  for (const Flop& flop : circuit.flops) next.push_back(flop.next);
  std::vector<bool> here(circuit.flops.size(), false);
  for (bool any = true; any;) {
    any = false;
    const std::vector<Node> then = with(graph, next, fixed);
    for (std::size_t i = 0; i < then.size(); ++i) {
      if (here[i] || !graph.is_constant(then[i]) || graph.value(then[i]) != circuit.flops[i].reset) continue;
      here[i] = reset[i] = any = true;
      fixed.emplace_back(circuit.flops[i].now, circuit.flops[i].reset);
    }
  }
}

}  // namespace

std::vector<std::string> never_reset(Circuit circuit, const std::set<std::string>& at_once, bool tied_high) {
  std::vector<bool> reset;
  for (const Flop& flop : circuit.flops) reset.push_back(at_once.contains(flop.field.name));
  for (const Pin& pin : circuit.inputs)
    if (pin.field.name == "rst_ni" && !tied_high) add_reset_by(circuit, pin, reset);

  std::vector<std::string> result;
  Fixed start;
  for (std::size_t i = 0; i < reset.size(); ++i) {
    const Flop& flop = circuit.flops[i];
    if (reset[i])
      start.emplace_back(flop.now, flop.reset);
    else
      result.push_back(flop.field.name);
  }
  for (const Invariant& invariant : circuit.invariants) {
    const Node holds = with(circuit.graph, {invariant.now}, start)[0];
    if (!circuit.graph.is_constant(holds) || circuit.graph.value(holds).isZero())
      throw UserError(
          fmt::format("invariant {}: found it to rest on flops that nothing resets ({}), expected it to hold "
                      "whatever they are",
                      invariant.name, fmt::join(result, ", ")));
  }
  return result;
}

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
