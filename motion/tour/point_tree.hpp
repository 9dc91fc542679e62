// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: k-d tree over the sites of a tour. Building it sorts the sites, so that what is
// near in the plane is near in memory and every subtree is a range of indices.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "motion/tour/path_costs.hpp"

namespace meltstage::motion::detail {

using Node = std::uint32_t;

/// A site and its cost from the place that was asked for.
struct Near {
  double cost;
  Node node;
  friend bool operator<(const Near& a, const Near& b) {
    return a.cost != b.cost ? a.cost < b.cost : a.node < b.node;
  }
};

struct TreeNode {
  Node begin, end;           ///< sites of this subtree
  Node left = 0, right = 0;  ///< 0: a leaf, as the root is nobody's child
  Site low, high;
};

class PointTree {
 public:
  /// Places of the sites in the order of the tree; `origin(i)` says which of the given sites the i-th is.
  explicit PointTree(std::span<const Site> given) : origin_(given.size()) {
    std::iota(origin_.begin(), origin_.end(), Node{0});
    if (!given.empty()) build(given, 0, static_cast<Node>(given.size()));
    sites_.reserve(given.size());
    for (const Node i : origin_) sites_.push_back(given[i]);
  }

  std::span<const Site> sites() const { return sites_; }
  std::span<const Node> origin() const { return origin_; }
  std::span<const TreeNode> nodes() const { return nodes_; }

  /// The `count` cheapest sites that `accept` lets through, cheapest first, the lower index first when equal.
  /// `accept.site(i)` judges one site; `accept.subtree(node)` may be false only where it lets none through.
  template <class Cost, class Accept>
  void nearest(const Cost& cost, const Site& from, std::size_t count, const Accept& accept,
               std::vector<Near>& found) const {
    found.clear();
    if (!nodes_.empty() && count > 0) search(0, cost, from, count, accept, found);
  }

  template <class Cost>
  static double cost_to_box(const Cost& cost, const TreeNode& node, const Site& from) {
    return cost(std::max({node.low.x - from.x, from.x - node.high.x, 0.0}),
                std::max({node.low.y - from.y, from.y - node.high.y, 0.0}));
  }

 private:
  Node build(std::span<const Site> given, Node begin, Node end) {
    constexpr Node kLeafSize = 6;
    const auto id = static_cast<Node>(nodes_.size());
    TreeNode node{begin, end, 0, 0, given[origin_[begin]], given[origin_[begin]]};
    for (Node i = begin; i < end; ++i) {
      const Site& site = given[origin_[i]];
      node.low = {std::min(node.low.x, site.x), std::min(node.low.y, site.y)};
      node.high = {std::max(node.high.x, site.x), std::max(node.high.y, site.y)};
    }
    nodes_.push_back(node);
    if (end - begin <= kLeafSize) return id;
    const Node middle = begin + (end - begin) / 2;
    const bool by_x = node.high.x - node.low.x >= node.high.y - node.low.y;
    std::nth_element(origin_.begin() + begin, origin_.begin() + middle, origin_.begin() + end,
                     [&](Node a, Node b) {
                       const double va = by_x ? given[a].x : given[a].y, vb = by_x ? given[b].x : given[b].y;
                       return va != vb ? va < vb : a < b;
                     });
    const Node left = build(given, begin, middle);
    const Node right = build(given, middle, end);
    nodes_[id].left = left;
    nodes_[id].right = right;
    return id;
  }

  template <class Cost, class Accept>
  void search(Node id, const Cost& cost, const Site& from, std::size_t count, const Accept& accept,
              std::vector<Near>& found) const {
    const TreeNode& node = nodes_[id];
    if (!accept.subtree(node)) return;
    if (node.left != 0) {
      const double to_left = cost_to_box(cost, nodes_[node.left], from);
      const double to_right = cost_to_box(cost, nodes_[node.right], from);
      const bool left_first = to_left <= to_right;
      const auto useful = [&](double bound) { return found.size() < count || bound <= found.back().cost; };
      if (useful(std::min(to_left, to_right)))
        search(left_first ? node.left : node.right, cost, from, count, accept, found);
      if (useful(std::max(to_left, to_right)))
        search(left_first ? node.right : node.left, cost, from, count, accept, found);
      return;
    }
    for (Node i = node.begin; i < node.end; ++i) {
      const Near entry{cost(sites_[i].x - from.x, sites_[i].y - from.y), i};
      if (found.size() == count && !(entry < found.back())) continue;
      if (!accept.site(i)) continue;
      if (found.size() == count) found.pop_back();
      found.insert(std::upper_bound(found.begin(), found.end(), entry), entry);
    }
  }

  std::vector<Node> origin_;
  std::vector<Site> sites_;
  std::vector<TreeNode> nodes_;
};

/// Candidate edges of every site, cheapest first.
class Neighbours {
 public:
  std::span<const Near> of(Node node) const {
    return std::span(list_).subspan(first_[node], first_[node + 1] - first_[node]);
  }
  std::size_t size() const { return first_.size() - 1; }

  /// Candidates of the next site.
  void add(std::span<const Near> candidates) {
    list_.insert(list_.end(), candidates.begin(), candidates.end());
    first_.push_back(list_.size());
  }

  /// The `nearest` cheapest sites of each and the `per_quadrant` cheapest of each quadrant about it: the
  /// latter are what links a cluster with the next one and what a lattice's many equal costs would leave out.
  template <class Cost>
  static Neighbours find(const PointTree& tree, const Cost& cost, std::size_t nearest,
                         std::size_t per_quadrant) {
    Neighbours out;
    const auto sites = tree.sites();
    out.first_.reserve(sites.size() + 1);
    out.list_.reserve(sites.size() * (nearest + per_quadrant));
    std::vector<Near> found, all;
    for (Node i = 0; i < sites.size(); ++i) {
      const Site from = sites[i];
      // Most of the near ones cover the quadrants already; a search of its own is for those they don't.
      tree.nearest(cost, from, nearest, Others{i}, all);
      std::array<std::size_t, 4> seen{};
      for (const Near& near : all) ++seen[quadrant(sites[near.node], from)];
      for (unsigned q = 0; q < seen.size(); ++q) {
        if (seen[q] >= per_quadrant) continue;
        tree.nearest(cost, from, per_quadrant, InQuadrant{sites, from, i, q}, found);
        all.insert(all.end(), found.begin(), found.end());
      }
      std::sort(all.begin(), all.end());
      all.erase(
          std::unique(all.begin(), all.end(), [](const Near& a, const Near& b) { return a.node == b.node; }),
          all.end());
      out.add(all);
    }
    return out;
  }

 private:
  /// Each quadrant owns one of its two axes.
  static unsigned quadrant(const Site& site, const Site& from) {
    const double dx = site.x - from.x, dy = site.y - from.y;
    if (dx > 0.0 && dy >= 0.0) return 0;
    if (dx <= 0.0 && dy > 0.0) return 1;
    if (dx < 0.0 && dy <= 0.0) return 2;
    return 3;
  }

  struct Others {
    Node self;
    bool site(Node i) const { return i != self; }
    bool subtree(const TreeNode&) const { return true; }
  };

  struct InQuadrant {
    std::span<const Site> sites;
    Site from;
    Node self;
    unsigned which;
    bool site(Node i) const { return i != self && quadrant(sites[i], from) == which; }
    bool subtree(const TreeNode& node) const {
      const bool right = which == 0 || which == 3, up = which == 0 || which == 1;
      return (right ? node.high.x >= from.x : node.low.x <= from.x) &&
             (up ? node.high.y >= from.y : node.low.y <= from.y);
    }
  };

  std::vector<Near> list_;
  std::vector<std::size_t> first_{0};
};

}  // namespace meltstage::motion::detail
