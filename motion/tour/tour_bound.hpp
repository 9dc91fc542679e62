// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: lower bound of a tour by 1-trees with node weights (Held & Karp 1970, 1971). The
// ascent of the weights runs on candidate edges; the bound itself is the 1-tree over all pairs under the last
// weights, found exactly, so that it holds whatever the candidates left out.
#pragma once

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "motion/tour/greedy_tour.hpp"
#include "motion/tour/lin_kernighan.hpp"
#include "motion/tour/point_tree.hpp"

namespace meltstage::motion::detail {

template <class Cost>
class TourBound {
 public:
  TourBound(const PointTree& tree, const Cost& cost, TourRules rules)
      : tree_(tree), cost_(cost), rules_(rules), weight_(tree.sites().size(), 0.0) {}

  /// Raises the weights for at most `steps` steps, fewer if `enough(bound)`; `tour` (with the joker) and its
  /// length steer the step size. `tell` is told the share of the steps at each.
  /// @return the bound, <= the shortest tour.
  template <class Enough, class Tell = TellNobody>
  double ascend(const Neighbours& neighbours, std::span<const Node> tour, double tour_length, int steps,
                const Enough& enough, const Tell& tell = {}) {
    build_graph(neighbours, tour);
    const std::size_t count = weight_.size();
    std::vector<double> best = weight_;
    std::vector<int> degree(count), degree_before;
    double highest = -std::numeric_limits<double>::infinity();
    double scale = 1.0;
    int since_better = 0;
    for (int step = 0; step < steps && scale > 1e-3; ++step) {
      tell(static_cast<double>(step) / static_cast<double>(steps));
      const double bound = sparse_one_tree(degree);
      if (bound > highest) {
        if (bound > highest + 1e-5 * (tour_length - highest)) since_better = 0;
        highest = bound;
        best = weight_;
        if (enough(bound)) break;
      }
      if (++since_better > 6) {
        scale *= 0.7;
        since_better = 0;
      }
      double square = 0.0;
      for (std::size_t i = 0; i < count; ++i)
        square += static_cast<double>((degree[i] - 2) * (degree[i] - 2));
      if (square == 0.0) break;  // the 1-tree is a tour: the shortest one
      const double size = scale * std::max(tour_length - bound, 1e-6 * tour_length) / square;
      if (degree_before.empty()) degree_before = degree;
      for (std::size_t i = 0; i < count; ++i)
        weight_[i] += size * (0.7 * (degree[i] - 2) + 0.3 * (degree_before[i] - 2));
      degree_before = degree;
    }
    weight_ = best;
    return exact_one_tree();
  }

  /// Weights of the sites, then of the joker: such that its cheapest edges weigh nothing.
  std::vector<double> weights() const {
    std::vector<double> out = weight_;
    if (rules_.joker != TourRules::kNone) {
      std::vector<int> ignored(weight_.size());
      out.push_back(-0.5 * two_joker_edges(ignored));
    }
    return out;
  }

  /// Candidates by alpha (Helsgaun 2000): what the shortest spanning tree grows by when it has to hold the
  /// edge, under the present weights; `per_site` of each, their cost with the weights. After ascend() only.
  Neighbours alpha_nearest(std::size_t per_site) {
    const auto count = static_cast<Node>(weight_.size());
    std::vector<int> degree(count);
    sparse_one_tree(degree);
    std::vector<Node> order;
    for (Node i = 0; i < count; ++i)
      if (parent_[i] != TourRules::kNone) order.push_back(i);
    std::sort(order.begin(), order.end(), [&](Node a, Node b) { return key_[a] < key_[b]; });
    // Joined by rank, not flattened: on the way up to where two sites meet stands the tree path's longest
    // edge.
    std::vector<Node> up(count);
    std::iota(up.begin(), up.end(), Node{0});
    std::vector<double> joined_at(count, std::numeric_limits<double>::infinity());
    std::vector<int> rank(count, 0);
    const auto top = [&](Node i) {
      while (up[i] != i) i = up[i];
      return i;
    };
    for (const Node i : order) {
      Node a = top(i), b = top(parent_[i]);
      if (rank[a] < rank[b]) std::swap(a, b);
      up[b] = a;
      joined_at[b] = key_[i];
      rank[a] = std::max(rank[a], rank[b] + 1);
    }
    const auto longest_between = [&](Node a, Node b) {
      double longest = 0.0;
      while (a != b) {
        Node& lower = joined_at[a] <= joined_at[b] ? a : b;
        longest = joined_at[lower];
        lower = up[lower];
      }
      return longest;
    };
    struct Rated {
      double alpha;
      Near near;
    };
    std::vector<Rated> rated;
    Neighbours out;
    std::vector<Near> chosen;
    for (Node i = 0; i < count; ++i) {
      rated.clear();
      for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) {
        const Node j = links_[k].node;
        const double cost = links_[k].cost + weight_[i] + weight_[j];
        rated.push_back({cost - longest_between(i, j), {cost, j}});
      }
      const std::size_t kept = std::min(per_site, rated.size());
      std::partial_sort(rated.begin(), rated.begin() + static_cast<std::ptrdiff_t>(kept), rated.end(),
                        [](const Rated& a, const Rated& b) {
                          return a.alpha != b.alpha ? a.alpha < b.alpha : a.near < b.near;
                        });
      chosen.clear();
      for (std::size_t k = 0; k < kept; ++k) chosen.push_back(rated[k].near);
      out.add(chosen);
    }
    return out;
  }

  /// The bound under the present weights over all pairs of sites.
  double exact_one_tree() {
    std::vector<int> degree(weight_.size(), 0);
    double total = exact_spanning_tree(degree);
    if (rules_.joker != TourRules::kNone || rules_.fixed_a != TourRules::kNone) {
      total += two_joker_edges(degree);
    } else {
      // Each leaf may be the 1-tree's special node: its second edge is what it still needs.
      double most = 0.0;
      for (Node i = 0; i < weight_.size(); ++i)
        if (degree[i] == 1) most = std::max(most, second_edge(i, most));
      total += most;
    }
    for (const double weight : weight_) total -= 2.0 * weight;
    return total;
  }

 private:
  bool joins_the_ends(Node a, Node b) const {
    return weight_.size() > 2 &&
           ((a == rules_.fixed_a && b == rules_.fixed_b) || (a == rules_.fixed_b && b == rules_.fixed_a));
  }
  double weighted(Node a, Node b) const {
    // A path between two given ends never goes from one to the other at once.
    if (joins_the_ends(a, b)) return std::numeric_limits<double>::infinity();
    const auto sites = tree_.sites();
    return cost_(sites[a].x - sites[b].x, sites[a].y - sites[b].y) + weight_[a] + weight_[b];
  }

  // ---- the joker as the 1-tree's special node: its two edges cost what their sites weigh ----

  /// A path between two given ends is a tour through a joker that both of its edges are fixed to.
  double two_joker_edges(std::vector<int>& degree) const {
    const auto lightest_but = [&](Node other) {
      Node lightest = other == 0 ? 1 : 0;
      for (Node i = 0; i < weight_.size(); ++i)
        if (i != other && weight_[i] < weight_[lightest]) lightest = i;
      return lightest;
    };
    Node first = rules_.fixed_a, second = rules_.fixed_b;
    if (rules_.joker != TourRules::kNone) {
      if (first == rules_.joker) first = rules_.fixed_b;
      if (first == TourRules::kNone) first = lightest_but(TourRules::kNone);
      second = lightest_but(first);
    }
    ++degree[first];
    ++degree[second];
    return weight_[first] + weight_[second];
  }

  // ---- 1-tree on candidate edges: Prim with a heap ----

  struct Link {
    Node node;
    double cost;
  };
  struct Reached {
    double key;
    Node node;
    friend bool operator<(const Reached& a, const Reached& b) { return a.key > b.key; }
  };

  /// Candidates in both directions, and the tour's edges, which connect all.
  void build_graph(const Neighbours& neighbours, std::span<const Node> tour) {
    const std::size_t count = weight_.size();
    const auto sites = tree_.sites();
    struct Edge {
      Node a, b;
      bool operator<(const Edge& other) const { return a != other.a ? a < other.a : b < other.b; }
      bool operator==(const Edge& other) const { return a == other.a && b == other.b; }
    };
    constexpr std::size_t kUsedPerSite = 8;
    std::vector<Edge> edges;
    edges.reserve(2 * count * (kUsedPerSite + 1));
    const auto add = [&](Node a, Node b) {
      if (a == rules_.joker || b == rules_.joker || a == b || joins_the_ends(a, b)) return;
      edges.push_back({a, b});
      edges.push_back({b, a});
    };
    for (Node i = 0; i < count; ++i) {
      const auto near = neighbours.of(i);
      for (std::size_t k = 0; k < std::min(near.size(), kUsedPerSite); ++k) add(i, near[k].node);
    }
    for (std::size_t i = 0; i < tour.size(); ++i) add(tour[i], tour[(i + 1) % tour.size()]);
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    first_.assign(count + 1, 0);
    links_.clear();
    links_.reserve(edges.size());
    for (const Edge& edge : edges) {
      ++first_[edge.a + 1];
      links_.push_back({edge.b, cost_(sites[edge.a].x - sites[edge.b].x, sites[edge.a].y - sites[edge.b].y)});
    }
    for (std::size_t i = 0; i < count; ++i) first_[i + 1] += first_[i];
  }

  double sparse_one_tree(std::vector<int>& degree) {
    const std::size_t count = weight_.size();
    const double infinity = std::numeric_limits<double>::infinity();
    key_.assign(count, infinity);
    parent_.assign(count, TourRules::kNone);
    done_.assign(count, 0);
    std::fill(degree.begin(), degree.end(), 0);
    heap_.clear();
    double total = 0.0;
    Node at = 0;
    for (std::size_t reached = 1;; ++reached) {
      done_[at] = 1;
      for (std::size_t k = first_[at]; k < first_[at + 1]; ++k) {
        const Node to = links_[k].node;
        const double key = links_[k].cost + weight_[at] + weight_[to];
        if (done_[to] || key >= key_[to]) continue;
        key_[to] = key;
        parent_[to] = at;
        heap_.push_back({key, to});
        std::push_heap(heap_.begin(), heap_.end());
      }
      if (reached == count) break;
      Reached next{};
      do {
        std::pop_heap(heap_.begin(), heap_.end());
        next = heap_.back();
        heap_.pop_back();
      } while (done_[next.node]);
      at = next.node;
      total += next.key;
      ++degree[at];
      ++degree[parent_[at]];
    }
    if (rules_.joker != TourRules::kNone || rules_.fixed_a != TourRules::kNone) {
      total += two_joker_edges(degree);
    } else {
      double most = -infinity;
      Node special = 0, other = 0;
      for (Node i = 0; i < count; ++i) {
        if (degree[i] != 1) continue;
        const Node tree_end = parent_[i] != TourRules::kNone ? parent_[i] : child_of(i);
        double second = infinity;
        Node to = i;
        for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) {
          const double key = links_[k].cost + weight_[i] + weight_[links_[k].node];
          if (links_[k].node == tree_end || key >= second) continue;
          second = key;
          to = links_[k].node;
        }
        if (second == infinity || second <= most) continue;
        most = second;
        special = i;
        other = to;
      }
      total += most;
      ++degree[special];
      ++degree[other];
    }
    for (const double weight : weight_) total -= 2.0 * weight;
    return total;
  }

  Node child_of(Node root) const {
    for (std::size_t k = first_[root]; k < first_[root + 1]; ++k)
      if (parent_[links_[k].node] == root) return links_[k].node;
    return TourRules::kNone;
  }

  // ---- over all pairs: Boruvka, each component's cheapest edge out by the k-d tree ----

  struct Out {
    double cost = std::numeric_limits<double>::infinity();
    Node from = TourRules::kNone, to = TourRules::kNone;
  };

  double exact_spanning_tree(std::vector<int>& degree) {
    const auto nodes = tree_.nodes();
    const auto count = static_cast<Node>(weight_.size());
    lightest_.resize(nodes.size());
    component_.resize(nodes.size());
    owner_.resize(count);
    for (std::size_t id = nodes.size(); id-- > 0;)
      lightest_[id] = *std::min_element(weight_.begin() + nodes[id].begin, weight_.begin() + nodes[id].end);
    UnionFind sets(count);
    std::vector<Out> out(count);
    double total = 0.0;
    for (Node left = count; left > 1;) {
      for (Node i = 0; i < count; ++i) owner_[i] = sets.find(i);
      for (std::size_t id = nodes.size(); id-- > 0;) component_[id] = component_of(nodes[id]);
      std::fill(out.begin(), out.end(), Out{});
      for (Node i = 0; i < count; ++i) cheapest_out(0, i, out[owner_[i]]);
      for (const Out& edge : out) {
        if (edge.from == TourRules::kNone || !sets.join(edge.from, edge.to)) continue;
        total += edge.cost;
        ++degree[edge.from];
        ++degree[edge.to];
        tree_end_.resize(count);
        tree_end_[edge.from] = edge.to;  // read for leaves alone, which have one edge
        tree_end_[edge.to] = edge.from;
        --left;
      }
    }
    return total;
  }

  /// The component all sites of the subtree belong to, or none; children come behind their parent.
  Node component_of(const TreeNode& node) const {
    if (node.left != 0)
      return component_[node.left] == component_[node.right] ? component_[node.left] : TourRules::kNone;
    for (Node i = node.begin; i < node.end; ++i)
      if (owner_[i] != owner_[node.begin]) return TourRules::kNone;
    return owner_[node.begin];
  }

  void cheapest_out(std::size_t id, Node from, Out& best) const {
    const TreeNode& node = tree_.nodes()[id];
    if (component_[id] == owner_[from]) return;
    if (node.left == 0) {
      for (Node i = node.begin; i < node.end; ++i) {
        if (owner_[i] == owner_[from]) continue;
        const double cost = weighted(from, i);
        if (cost < best.cost) best = {cost, from, i};
      }
      return;
    }
    const double left = least(node.left, from), right = least(node.right, from);
    const bool left_first = left <= right;
    if (std::min(left, right) < best.cost) cheapest_out(left_first ? node.left : node.right, from, best);
    if (std::max(left, right) < best.cost) cheapest_out(left_first ? node.right : node.left, from, best);
  }

  /// No edge from the site into the subtree costs less.
  double least(std::size_t id, Node from) const {
    return PointTree::cost_to_box(cost_, tree_.nodes()[id], tree_.sites()[from]) + weight_[from] +
           lightest_[id];
  }

  /// The cheapest edge at a leaf besides its tree edge; no search where it can't exceed `floor`.
  double second_edge(Node leaf, double floor) const {
    Out best;
    search_second(0, leaf, floor, best);
    return best.cost;
  }

  void search_second(std::size_t id, Node leaf, double floor, Out& best) const {
    if (best.cost <= floor) return;
    const TreeNode& node = tree_.nodes()[id];
    if (node.left == 0) {
      for (Node i = node.begin; i < node.end; ++i) {
        if (i == leaf || i == tree_end_[leaf]) continue;
        const double cost = weighted(leaf, i);
        if (cost < best.cost) best = {cost, leaf, i};
      }
      return;
    }
    const double left = least(node.left, leaf), right = least(node.right, leaf);
    const bool left_first = left <= right;
    if (std::min(left, right) < best.cost)
      search_second(left_first ? node.left : node.right, leaf, floor, best);
    if (std::max(left, right) < best.cost)
      search_second(left_first ? node.right : node.left, leaf, floor, best);
  }

  const PointTree& tree_;
  const Cost& cost_;
  TourRules rules_;
  std::vector<double> weight_;

  std::vector<std::size_t> first_;
  std::vector<Link> links_;
  std::vector<double> key_;
  std::vector<Node> parent_;
  std::vector<char> done_;
  std::vector<Reached> heap_;

  std::vector<double> lightest_;
  std::vector<Node> component_, owner_, tree_end_;
};

}  // namespace meltstage::motion::detail
