// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: the greedy-edge start of the tour search (Bentley 1992): the cheapest edges that
// leave no node with three edges and close no ring, then the fragments joined at their nearest ends.
#pragma once

#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "motion/tour/lin_kernighan.hpp"
#include "motion/tour/point_tree.hpp"

namespace meltstage::motion::detail {

/// Sets that only ever join (Tarjan), with path halving.
class UnionFind {
 public:
  explicit UnionFind(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), Node{0});
  }
  Node find(Node i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// False if they were one set already.
  bool join(Node a, Node b) {
    a = find(a);
    b = find(b);
    if (a == b) return false;
    parent_[std::max(a, b)] = std::min(a, b);
    return true;
  }

 private:
  std::vector<Node> parent_;
};

template <class Cost>
class GreedyTour {
 public:
  GreedyTour(const PointTree& tree, const Cost& cost, const Neighbours& neighbours, TourRules rules)
      : tree_(tree), cost_(cost), rules_(rules), fragments_(tree.sites().size()) {
    const auto count = static_cast<Node>(tree.sites().size());
    links_.assign(count, {TourRules::kNone, TourRules::kNone});
    open_ = count;
    // A fixed edge is there from the start; one to the joker takes one of its site's two places.
    if (rules.fixed_a != TourRules::kNone) {
      if (rules.fixed_a != rules.joker && rules.fixed_b != rules.joker)
        link(rules.fixed_a, rules.fixed_b);
      else
        links_[rules.fixed_a == rules.joker ? rules.fixed_b : rules.fixed_a][0] = rules.joker;
    }
    link_cheapest(neighbours);
    while (open_ > 1) join_fragments();
  }

  /// Every site once, in the order of the path through all fragments, the joker behind its end.
  std::vector<Node> tour() const {
    const auto count = static_cast<Node>(links_.size());
    std::vector<Node> out;
    Node at = 0;
    while (at < count && is_inner(at)) ++at;  // an end of the path; beside the joker that is fixed, if any
    Node before = links_[at][0] == rules_.joker ? rules_.joker : TourRules::kNone;
    while (out.size() < count) {
      out.push_back(at);
      const Node next = links_[at][0] == before ? links_[at][1] : links_[at][0];
      before = at;
      at = next;
    }
    if (rules_.joker != TourRules::kNone) out.push_back(rules_.joker);
    return out;
  }

 private:
  struct Edge {
    double cost;
    Node a, b;
  };

  bool is_full(Node i) const { return links_[i][0] != TourRules::kNone && links_[i][1] != TourRules::kNone; }
  bool is_inner(Node i) const {
    return is_full(i) && (rules_.joker == TourRules::kNone || links_[i][0] != rules_.joker);
  }

  void link(Node a, Node b) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
      auto& places = links_[from];
      (places[0] == TourRules::kNone ? places[0] : places[1]) = to;
    }
    fragments_.join(a, b);
    --open_;
  }

  void link_in_order(std::vector<Edge>& edges) {
    std::sort(edges.begin(), edges.end(), [](const Edge& p, const Edge& q) {
      if (p.cost != q.cost) return p.cost < q.cost;
      return p.a != q.a ? p.a < q.a : p.b < q.b;
    });
    for (const Edge& edge : edges)
      if (!is_full(edge.a) && !is_full(edge.b) && fragments_.find(edge.a) != fragments_.find(edge.b))
        link(edge.a, edge.b);
  }

  void link_cheapest(const Neighbours& neighbours) {
    std::vector<Edge> edges;
    for (Node i = 0; i < links_.size(); ++i)
      for (const Near& near : neighbours.of(i)) {
        const auto back = neighbours.of(near.node);
        const bool twice = near.node < i && std::any_of(back.begin(), back.end(),
                                                        [&](const Near& other) { return other.node == i; });
        if (!twice) edges.push_back({near.cost, i, near.node});
      }
    link_in_order(edges);
  }

  struct OtherFragment {
    const std::vector<Node>& fragment;
    Node own;
    bool site(Node i) const { return fragment[i] != own; }
    bool subtree(const TreeNode&) const { return true; }
  };

  /// One round: every fragment's ends look for the nearest ends of others. At least the cheapest edge of all
  /// is linked, usually half of the fragments go.
  void join_fragments() {
    std::vector<Node> ends, fragment;
    std::vector<Site> sites;
    for (Node i = 0; i < links_.size(); ++i)
      if (!is_full(i)) {
        ends.push_back(i);
        sites.push_back(tree_.sites()[i]);
      }
    const PointTree tree(sites);
    for (const Node i : tree.origin()) fragment.push_back(fragments_.find(ends[i]));
    std::vector<Edge> edges;
    std::vector<Near> found;
    for (Node i = 0; i < fragment.size(); ++i) {
      constexpr std::size_t kWanted = 5;
      tree.nearest(cost_, tree.sites()[i], kWanted, OtherFragment{fragment, fragment[i]}, found);
      for (const Near& near : found)
        edges.push_back({near.cost, ends[tree.origin()[i]], ends[tree.origin()[near.node]]});
    }
    link_in_order(edges);
  }

  const PointTree& tree_;
  const Cost& cost_;
  TourRules rules_;
  UnionFind fragments_;
  std::vector<std::array<Node, 2>> links_;
  std::size_t open_ = 0;
};

}  // namespace meltstage::motion::detail
