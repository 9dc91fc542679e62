// SPDX-License-Identifier: Apache-2.0
#include "hls/cpp/paths.hpp"

#include <algorithm>

namespace meltstage::hls {

void Paths::enter(const std::vector<int>& edges) {
  const int dominator = nearest_dominator(edges);
  executed_.push_back({dominator, dominator < 0 ? 0 : executed_[dominator].depth + 1, edges, {}});
  for (const int edge : edges) edges_[edge].to = current();
}

int Paths::leave(Node when) {
  const int number = static_cast<int>(edges_.size());
  executed_[current()].out.push_back(number);
  edges_.push_back({current(), kNone, when});
  return number;
}

int Paths::nearest_dominator(const std::vector<int>& edges) const {
  int a = edges_[edges[0]].from;
  for (const int edge : edges) {
    int b = edges_[edge].from;
    while (a != b) {
      if (executed_[a].depth < executed_[b].depth) std::swap(a, b);
      a = executed_[a].dominator;
    }
  }
  return a;
}

Node Paths::meet(const std::vector<int>& edges, llvm::function_ref<Node(std::size_t)> leaf) {
  ++meeting_;
  leaf_of_.resize(edges_.size(), {0, 0});
  met_.resize(executed_.size(), {0, std::nullopt});
  for (std::size_t i = 0; i < edges.size(); ++i) leaf_of_[edges[i]] = {meeting_, leaf(i)};
  return *met_from(nearest_dominator(edges));
}

// The same from an executed block on; none when no path leads to the edges.
std::optional<Node> Paths::met_from(int executed) {
  if (met_[executed].first == meeting_) return met_[executed].second;
  std::vector<std::pair<Node, Node>> choices;  // value, and when
  for (const int edge : executed_[executed].out) {
    std::optional<Node> value;
    if (leaf_of_[edge].first == meeting_) {
      value = leaf_of_[edge].second;
    } else if (edges_[edge].to >= 0) {
      value = met_from(edges_[edge].to);
    }
    if (!value) continue;
    const auto same =
        std::find_if(choices.begin(), choices.end(), [&](const auto& c) { return c.first == *value; });
    if (same == choices.end()) {
      choices.emplace_back(*value, edges_[edge].when);
    } else {
      same->second = graph_.either(same->second, edges_[edge].when);
    }
  }
  std::optional<Node> result;
  for (const auto& [value, when] : choices) result = result ? graph_.select(when, value, *result) : value;
  met_[executed] = {meeting_, result};
  return result;
}

Node Paths::reached(int executed) {
  if (executed < 0) return graph_.truth(true);
  const auto known = reached_.find(executed);
  if (known != reached_.end()) return known->second;
  Node result = graph_.truth(false);
  for (const int edge : executed_[executed].into)
    result = graph_.either(result, graph_.both(reached(edges_[edge].from), edges_[edge].when));
  reached_[executed] = result;
  return result;
}

}  // namespace meltstage::hls
