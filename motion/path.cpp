// SPDX-License-Identifier: Apache-2.0
#include "motion/path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

namespace meltstage::motion {
namespace {

using Index = std::uint32_t;
constexpr double tolerance_mm = 1e-9;

struct Site {
  double x, y;
};

/// k-d tree over the points that lets points leave, for neighbour lists and for the nearest-neighbour walk.
class PointTree {
 public:
  PointTree(std::span<const Site> sites, Metric metric)
      : sites_(sites), metric_(metric), order_(sites.size()) {
    std::iota(order_.begin(), order_.end(), Index{0});
    place_.resize(sites.size());
    build(0, static_cast<Index>(sites.size()));
    for (Index i = 0; i < order_.size(); ++i) place_[order_[i]] = i;
  }

  /// The `count` nearest points that have not left, nearest first, the lower index first when equally near.
  void nearest(const Site& site, std::size_t count, std::vector<std::pair<double, Index>>& found) const {
    found.clear();
    search(0, site, count, found);
  }

  void leave(Index site) {
    for (Index node = 0;;) {
      --nodes_[node].present;
      if (nodes_[node].left == 0) break;
      node = place_[site] < nodes_[nodes_[node].left].end ? nodes_[node].left : nodes_[node].right;
    }
    gone_.resize(sites_.size());
    gone_[site] = true;
  }

 private:
  struct Node {
    Index begin, end, present;
    Index left = 0, right = 0;  ///< 0: a leaf, as the root is nobody's child
    Site low{}, high{};
  };

  Index build(Index begin, Index end) {
    constexpr Index leaf_size = 8;
    const auto id = static_cast<Index>(nodes_.size());
    Node node{begin, end, end - begin, 0, 0, {1e300, 1e300}, {-1e300, -1e300}};
    for (Index i = begin; i < end; ++i) {
      const Site& site = sites_[order_[i]];
      node.low = {std::min(node.low.x, site.x), std::min(node.low.y, site.y)};
      node.high = {std::max(node.high.x, site.x), std::max(node.high.y, site.y)};
    }
    nodes_.push_back(node);
    if (end - begin <= leaf_size) return id;
    const Index middle = begin + (end - begin) / 2;
    const bool by_x = node.high.x - node.low.x >= node.high.y - node.low.y;
    std::nth_element(
        order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](Index a, Index b) {
          const double va = by_x ? sites_[a].x : sites_[a].y, vb = by_x ? sites_[b].x : sites_[b].y;
          return va != vb ? va < vb : a < b;
        });
    const Index left = build(begin, middle);
    const Index right = build(middle, end);
    nodes_[id].left = left;
    nodes_[id].right = right;
    return id;
  }

  double distance_to_box(const Node& node, const Site& site) const {
    return distance_mm(std::max({node.low.x - site.x, site.x - node.high.x, 0.0}),
                       std::max({node.low.y - site.y, site.y - node.high.y, 0.0}), metric_);
  }

  void search(Index id, const Site& site, std::size_t count,
              std::vector<std::pair<double, Index>>& found) const {
    const Node& node = nodes_[id];
    if (node.present == 0) return;
    if (found.size() == count && distance_to_box(node, site) > found.back().first) return;
    if (node.left != 0) {
      const bool left_first =
          distance_to_box(nodes_[node.left], site) <= distance_to_box(nodes_[node.right], site);
      search(left_first ? node.left : node.right, site, count, found);
      search(left_first ? node.right : node.left, site, count, found);
      return;
    }
    for (Index i = node.begin; i < node.end; ++i) {
      const Index other = order_[i];
      if (!gone_.empty() && gone_[other]) continue;
      const std::pair entry(distance_mm(sites_[other].x - site.x, sites_[other].y - site.y, metric_), other);
      if (found.size() == count && entry >= found.back()) continue;
      if (found.size() == count) found.pop_back();
      found.insert(std::upper_bound(found.begin(), found.end(), entry), entry);
    }
  }

  std::span<const Site> sites_;
  Metric metric_;
  std::vector<Index> order_, place_;
  std::vector<Node> nodes_;
  std::vector<bool> gone_;
};

/// Always to the nearest point not yet visited.
std::vector<Index> walk_to_nearest(std::span<const Site> sites, Site from, Metric metric) {
  PointTree tree(sites, metric);
  std::vector<Index> order;
  std::vector<std::pair<double, Index>> found;
  while (order.size() < sites.size()) {
    tree.nearest(from, 1, found);
    order.push_back(found[0].second);
    from = sites[order.back()];
    tree.leave(order.back());
  }
  return order;
}

/// Local search on the path closed to a ring: points 0..n-1, then the start, then an end that is free to
/// reach from anywhere. The edge end-start is never removed, so cutting the ring there gives the open path.
class Ring {
 public:
  Ring(std::span<const Site> sites, Site start, Metric metric, std::span<const Index> order)
      : sites_(sites.begin(), sites.end()),
        metric_(metric),
        start_(static_cast<Index>(sites.size())),
        end_(start_ + 1),
        neighbours_per_point_(std::min<std::size_t>(10, sites.size() - 1)) {
    find_neighbours(sites);
    sites_.push_back(start);
    ring_.push_back(start_);
    ring_.insert(ring_.end(), order.begin(), order.end());
    ring_.push_back(end_);
    place_.resize(ring_.size());
    for (Index i = 0; i < ring_.size(); ++i) place_[ring_[i]] = i;
    queued_.assign(ring_.size(), false);
    longest_reversal_ = sites.size() <= 100'000 ? ring_.size() : 50'000;
  }

  void improve_from(std::span<const Index> points) {
    for (const Index point : points) push(point);
    while (!queue_.empty()) {
      const Index point = queue_.back();
      queue_.pop_back();
      queued_[point] = false;
      while (improve_at(point)) {
      }
    }
  }

  /// Swaps neighbouring segments near a random place and repairs; keeps the result unless it is longer.
  void kick(std::mt19937_64& random) {
    constexpr std::size_t longest_segment = 50;
    const std::size_t reach = std::min(longest_segment, (ring_.size() - 2) / 2);
    const auto at = static_cast<Index>(random() % ring_.size());
    const auto first = static_cast<Index>(1 + random() % reach),
               second = static_cast<Index>(1 + random() % reach);
    const std::array<Index, 6> ends = {node_at(at),
                                       node_at(at + 1),
                                       node_at(at + first),
                                       node_at(at + first + 1),
                                       node_at(at + first + second),
                                       node_at(at + first + second + 1)};
    if (is_fixed(ends[0], ends[1]) || is_fixed(ends[2], ends[3]) || is_fixed(ends[4], ends[5])) return;
    journal_.clear();
    gained_mm_ = 0.0;
    move_segment(ends[0], ends[1], ends[2], ends[3], ends[4], ends[5], true);
    improve_from(ends);
    if (gained_mm_ >= -tolerance_mm) return;
    for (auto entry = journal_.rbegin(); entry != journal_.rend(); ++entry)
      reverse(entry->first, entry->second);
  }

  std::vector<Index> order() const {
    std::vector<Index> out;
    const bool forward = next(end_) == start_;
    for (Index node = start_; out.size() + 2 < ring_.size();) {
      node = forward ? next(node) : previous(node);
      out.push_back(node);
    }
    return out;
  }

 private:
  void find_neighbours(std::span<const Site> sites) {
    const PointTree tree(sites, metric_);
    std::vector<std::pair<double, Index>> found;
    neighbours_.reserve(sites.size() * neighbours_per_point_);
    for (Index i = 0; i < sites.size(); ++i) {
      tree.nearest(sites[i], neighbours_per_point_ + 1, found);
      std::erase_if(found, [&](const auto& entry) { return entry.second == i; });
      for (std::size_t k = 0; k < neighbours_per_point_; ++k) neighbours_.push_back(found[k].second);
    }
  }

  std::span<const Index> neighbours(Index point) const {
    return point >= start_
               ? std::span<const Index>{}
               : std::span(neighbours_).subspan(point * neighbours_per_point_, neighbours_per_point_);
  }

  double length(Index a, Index b) const {
    if (a == end_ || b == end_) return 0.0;
    return distance_mm(sites_[a].x - sites_[b].x, sites_[a].y - sites_[b].y, metric_);
  }

  Index node_at(std::size_t place) const { return ring_[place % ring_.size()]; }
  Index next(Index node) const {
    return place_[node] + 1 == ring_.size() ? ring_.front() : ring_[place_[node] + 1];
  }
  Index previous(Index node) const { return place_[node] == 0 ? ring_.back() : ring_[place_[node] - 1]; }
  bool is_fixed(Index a, Index b) const { return (a == end_ && b == start_) || (a == start_ && b == end_); }

  void push(Index node) {
    if (queued_[node]) return;
    queued_[node] = true;
    queue_.push_back(node);
  }

  /// Reverses the places i..j (round the ring); turning the rest instead gives the same ring, so the shorter
  /// is turned.
  void reverse(Index i, Index j) {
    const auto size = static_cast<Index>(ring_.size());
    Index count = (j + size - i) % size + 1;
    if (2 * count > size) {
      const Index old_i = i;
      i = (j + 1) % size;
      j = (old_i + size - 1) % size;
      count = size - count;
    }
    for (Index step = 0; step < count / 2; ++step) {
      std::swap(ring_[i], ring_[j]);
      place_[ring_[i]] = i;
      place_[ring_[j]] = j;
      i = i + 1 == size ? 0 : i + 1;
      j = j == 0 ? size - 1 : j - 1;
    }
  }

  /// Replaces the edges (a,b), (c,d) by (a,c), (b,d); b follows a and d follows c, in either direction of the
  /// ring.
  void exchange(Index a, Index b, Index c, Index d) {
    gained_mm_ += length(a, b) + length(c, d) - length(a, c) - length(b, d);
    const bool forward = next(a) == b;
    const std::pair<Index, Index> places =
        forward ? std::pair(place_[b], place_[c]) : std::pair(place_[a], place_[d]);
    journal_.push_back(places);
    reverse(places.first, places.second);
    for (const Index node : {a, b, c, d}) push(node);
  }

  /// Takes the segment first..last from between before and after, and puts it between c and its follower d (d
  /// follows c in the direction before -> first): keeping its direction (c-first, last-d) or turned (c-last,
  /// first-d).
  void move_segment(Index before, Index first, Index last, Index after, Index c, Index d,
                    bool keep_direction) {
    exchange(before, first, c, d);
    exchange(before, c, after, last);
    if (keep_direction) exchange(c, last, first, d);
  }

  bool improve_at(Index a) { return try_two_opt(a) || try_or_opt(a); }

  std::size_t reversal_cost(Index i, Index j) const {
    const std::size_t span = (place_[j] + ring_.size() - place_[i]) % ring_.size();
    return std::min(span, ring_.size() - span);
  }

  bool try_two_opt(Index a) {
    for (const bool forward : {true, false}) {
      const Index b = forward ? next(a) : previous(a);
      if (is_fixed(a, b)) continue;
      const double removed = length(a, b);
      for (const Index c : neighbours(a)) {
        const double added = length(a, c);
        if (added >= removed - tolerance_mm) break;
        const Index d = forward ? next(c) : previous(c);
        if (is_fixed(c, d)) continue;
        if (removed + length(c, d) - added - length(b, d) <= tolerance_mm) continue;
        if (reversal_cost(a, c) > longest_reversal_) continue;
        exchange(a, b, c, d);
        return true;
      }
    }
    return false;
  }

  /// Moves a segment of one to three points that ends at a, to beside a neighbour c of a.
  bool try_or_opt(Index a) {
    if (a >= start_) return false;
    for (const bool forward : {true, false}) {
      const auto follow = [&](Index node) { return forward ? next(node) : previous(node); };
      const auto precede = [&](Index node) { return forward ? previous(node) : next(node); };
      // Segment first..last in the direction of `follow`; a = first, so that a's edge to `before` is the one
      // to lose.
      const Index before = precede(a);
      Index last = a;
      for (int size = 1; size <= 3; ++size, last = follow(last)) {
        if (last >= start_) break;
        const Index after = follow(last);
        if (before == after) break;
        const double freed = length(before, a) + length(last, after) - length(before, after);
        if (freed <= tolerance_mm) continue;
        if (try_insert(a, before, last, after, freed, forward, size)) return true;
      }
    }
    return false;
  }

  bool is_inside(Index node, Index first, bool forward, int size) const {
    const std::size_t n = ring_.size();
    const std::size_t offset =
        forward ? (place_[node] + n - place_[first]) % n : (place_[first] + n - place_[node]) % n;
    return offset < static_cast<std::size_t>(size);
  }

  bool try_insert(Index first, Index before, Index last, Index after, double freed, bool forward, int size) {
    for (const Index c : neighbours(first)) {
      const double reached = length(first, c);
      if (reached >= freed - tolerance_mm) break;
      if (is_inside(c, first, forward, size)) continue;
      const Index follower = forward ? next(c) : previous(c), leader = forward ? previous(c) : next(c);
      // Behind c: c-first..last-follower keeps the direction. Before c: leader-last..first-c turns the
      // segment.
      if (c != before && !is_fixed(c, follower) &&
          freed + length(c, follower) - reached - length(last, follower) > tolerance_mm &&
          reversal_cost(first, c) <= longest_reversal_) {
        move_segment(before, first, last, after, c, follower, true);
        return true;
      }
      if (c != after && !is_fixed(leader, c) &&
          freed + length(leader, c) - reached - length(last, leader) > tolerance_mm &&
          reversal_cost(first, c) <= longest_reversal_) {
        move_segment(before, first, last, after, leader, c, false);
        return true;
      }
    }
    return false;
  }

  std::vector<Site> sites_;
  Metric metric_;
  Index start_, end_;
  std::size_t neighbours_per_point_;
  std::vector<Index> neighbours_, ring_, place_, queue_;
  std::vector<bool> queued_;
  std::size_t longest_reversal_ = 0;
  std::vector<std::pair<Index, Index>> journal_;
  double gained_mm_ = 0.0;
};

std::vector<Index> shorten(std::span<const Site> sites, Site start, Metric metric, std::vector<Index> order) {
  constexpr std::size_t smallest_ring = 4;  // fewer points leave no segments to swap
  if (sites.size() < smallest_ring) return order;
  Ring ring(sites, start, metric, order);
  ring.improve_from(order);
  // Bounded so that the time stays about linear: a second or two for ten thousand points.
  const std::size_t kicks = std::clamp<std::size_t>(10 * sites.size(), 2'000, 100'000);
  std::mt19937_64 random(1);
  for (std::size_t i = 0; i < kicks; ++i) ring.kick(random);
  return ring.order();
}

/// All orders of up to three points.
std::vector<Index> shortest_of_all(std::vector<Index> order, const auto& length_of) {
  std::sort(order.begin(), order.end());
  std::vector<Index> best = order;
  while (std::next_permutation(order.begin(), order.end()))
    if (length_of(order) < length_of(best) - tolerance_mm) best = order;
  return best;
}

}  // namespace

double distance_mm(double dx_mm, double dy_mm, Metric metric) {
  const double dx = std::abs(dx_mm), dy = std::abs(dy_mm);
  switch (metric) {
    case Metric::manhattan:
      return dx + dy;
    case Metric::chebyshev:
      return std::max(dx, dy);
    case Metric::euclidean:
      break;
  }
  return std::sqrt(dx * dx + dy * dy);
}

double path_length(std::span<const Point> points, std::span<const std::size_t> order, Metric metric,
                   Start start) {
  double length = 0.0, x = start.x_mm, y = start.y_mm;
  for (const std::size_t i : order) {
    length += distance_mm(points[i].x_mm - x, points[i].y_mm - y, metric);
    x = points[i].x_mm;
    y = points[i].y_mm;
  }
  return length;
}

Plan plan_path(std::span<const Point> points, Metric metric, Start start) {
  Plan plan;
  plan.order.resize(points.size());
  std::iota(plan.order.begin(), plan.order.end(), std::size_t{0});
  plan.length_before_mm = plan.length_after_mm = path_length(points, plan.order, metric, start);
  if (points.empty()) return plan;

  std::vector<Site> sites;
  for (const Point& point : points) sites.push_back({point.x_mm, point.y_mm});
  const Site from{start.x_mm, start.y_mm};
  std::vector<Index> order = walk_to_nearest(sites, from, metric);
  const auto length_of = [&](const std::vector<Index>& candidate) {
    return path_length(points, std::vector<std::size_t>(candidate.begin(), candidate.end()), metric, start);
  };
  order = points.size() <= 3 ? shortest_of_all(std::move(order), length_of)
                             : shorten(sites, from, metric, std::move(order));
  const double length = length_of(order);
  if (length < plan.length_before_mm) {
    plan.order.assign(order.begin(), order.end());
    plan.length_after_mm = length;
  }
  return plan;
}

}  // namespace meltstage::motion
