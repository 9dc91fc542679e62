// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/circuit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

namespace {

std::int8_t inverse(std::int8_t value) { return value < 0 ? value : static_cast<std::int8_t>(1 - value); }

std::int8_t constant_of(const Circuit& circuit, Node node, const std::vector<std::int8_t>& known) {
  const auto fanin = circuit.fanin(node);
  const auto count = [&](std::int8_t value) {
    return static_cast<std::size_t>(
        std::count_if(fanin.begin(), fanin.end(), [&](Node n) { return known[n] == value; }));
  };
  const auto wide = [&](std::int8_t controlling) -> std::int8_t {  // the output of an AND (0) or OR (1)
    if (count(controlling) != 0) return controlling;
    return count(inverse(controlling)) == fanin.size() ? inverse(controlling) : std::int8_t{-1};
  };
  switch (circuit.kind(node)) {
    case Gate::input:
      return known[node];
    case Gate::tie0:
      return 0;
    case Gate::tie1:
      return 1;
    case Gate::buf:
    case Gate::output:
      return known[fanin[0]];
    case Gate::inv:
      return inverse(known[fanin[0]]);
    case Gate::all:
      return wide(0);
    case Gate::nall:
      return inverse(wide(0));
    case Gate::any:
      return wide(1);
    case Gate::none:
      return inverse(wide(1));
    case Gate::parity:
    case Gate::same: {
      if (count(-1) != 0) return -1;
      const bool odd = count(1) % 2 == 1;
      return odd == (circuit.kind(node) == Gate::parity) ? 1 : 0;
    }
    case Gate::mux:
      if (known[fanin[2]] >= 0) return known[fanin[known[fanin[2]] == 0 ? 0 : 1]];
      return known[fanin[0]] == known[fanin[1]] ? known[fanin[0]] : std::int8_t{-1};
  }
  return -1;
}

}  // namespace

std::vector<std::int8_t> constants(const Circuit& circuit, const std::vector<std::int8_t>& inputs,
                                   const std::vector<std::uint8_t>& open) {
  std::vector<std::int8_t> known(circuit.size(), -1);
  for (std::size_t i = 0; i < inputs.size(); ++i) known[circuit.inputs()[i]] = inputs[i];
  for (Node node = 0; node < circuit.size(); ++node) {
    known[node] = constant_of(circuit, node, known);
    if (!open.empty() && open[node] != 0) known[node] = -1;
  }
  return known;
}

Node CircuitBuilder::add(Gate kind, std::vector<Node> fanin, std::string name) {
  nodes_.push_back({kind, std::move(fanin), std::move(name)});
  return static_cast<Node>(nodes_.size() - 1);
}

Circuit CircuitBuilder::finish(const std::string& source, std::vector<Node>* renumbered) {
  const std::size_t count = nodes_.size();
  std::vector<std::vector<Node>> fanout(count);
  std::vector<std::uint32_t> waiting(count), level(count, 0);
  for (Node node = 0; node < count; ++node) {
    waiting[node] = static_cast<std::uint32_t>(nodes_[node].fanin.size());
    for (const Node driver : nodes_[node].fanin) fanout[driver].push_back(node);
  }
  std::vector<Node> order;
  order.reserve(count);
  for (Node node = 0; node < count; ++node) {
    if (waiting[node] == 0) order.push_back(node);
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (const Node next : fanout[order[i]]) {
      level[next] = std::max(level[next], level[order[i]] + 1);
      if (--waiting[next] == 0) order.push_back(next);
    }
  }
  if (order.size() != count) {
    const auto stuck = std::find_if(waiting.begin(), waiting.end(), [](std::uint32_t n) { return n != 0; });
    throw UserError(
        fmt::format("{}: found a combinational loop through or before \"{}\", expected none; cut it", source,
                    shown(nodes_[static_cast<std::size_t>(stuck - waiting.begin())].name)));
  }
  std::stable_sort(order.begin(), order.end(), [&](Node a, Node b) { return level[a] < level[b]; });

  std::vector<Node> number(count);
  for (Node i = 0; i < count; ++i) number[order[i]] = i;
  Circuit circuit;
  circuit.fanin_begin_.push_back(0);
  for (const Node old : order) {
    circuit.kinds_.push_back(nodes_[old].kind);
    circuit.names_.push_back(std::move(nodes_[old].name));
    circuit.level_.push_back(level[old]);
    for (const Node driver : nodes_[old].fanin) circuit.fanin_.push_back(number[driver]);
    circuit.fanin_begin_.push_back(static_cast<std::uint32_t>(circuit.fanin_.size()));
  }
  std::vector<std::vector<Node>> new_fanout(count);
  for (Node node = 0; node < count; ++node) {
    for (const Node driver : circuit.fanin(node)) new_fanout[driver].push_back(node);
  }
  circuit.fanout_begin_.push_back(0);
  for (const auto& targets : new_fanout) {
    circuit.fanout_.insert(circuit.fanout_.end(), targets.begin(), targets.end());
    circuit.fanout_begin_.push_back(static_cast<std::uint32_t>(circuit.fanout_.size()));
  }
  for (Node old = 0; old < count; ++old) {
    if (nodes_[old].kind == Gate::input) circuit.inputs_.push_back(number[old]);
    if (nodes_[old].kind == Gate::output) circuit.outputs_.push_back(number[old]);
  }
  circuit.sites_ = std::move(sites_);
  for (Site& site : circuit.sites_) {
    if (site.node != kNoNode) site.node = number[site.node];
  }
  circuit.held_.assign(circuit.inputs_.size(), -1);
  for (const Held& held : held_) {
    const auto at = std::find(circuit.inputs_.begin(), circuit.inputs_.end(), number[held.input]);
    circuit.held_[static_cast<std::size_t>(at - circuit.inputs_.begin())] = held.value ? 1 : 0;
  }
  if (renumbered != nullptr) *renumbered = std::move(number);
  nodes_.clear();
  sites_.clear();
  held_.clear();
  return circuit;
}

}  // namespace meltstage::dft
