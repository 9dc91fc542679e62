// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: chained Lin-Kernighan on a closed tour (Lin & Kernighan 1973; Johnson & McGeoch
// 1997; kicks as Applegate, Cook & Rohe 2003).
//
// A step of the search is a chain of exchanges, each a reversal of a stretch of the tour. While a chain is
// being tried, its reversals are kept as a list through which positions are translated; the tour itself is
// turned only for a chain that shortens it.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "motion/tour/path_costs.hpp"
#include "motion/tour/point_tree.hpp"

namespace meltstage::motion::detail {

/// What a tour has to hold besides the sites. The joker is a further node, numbered behind the sites, that is
/// as far as `0` from every site: a closed tour through it is an open path without it. A fixed edge stays.
struct TourRules {
  static constexpr Node kNone = UINT32_MAX;
  Node joker = kNone;
  Node fixed_a = kNone, fixed_b = kNone;

  bool is_fixed(Node a, Node b) const {
    return (a == fixed_a && b == fixed_b) || (a == fixed_b && b == fixed_a);
  }
};

/// For a search whose share nobody wants to know.
struct TellNobody {
  void operator()(double /*share*/) const {}
};

/// Where a node stands in the tour.
using Place = std::int32_t;

template <class Cost>
class LinKernighan {
 public:
  /// `tour`: every site and the joker once. `weights`: of every site and the joker, added to the cost of each
  /// of its edges; they lengthen every tour alike but show the search which edges belong in it (Held & Karp).
  /// What is referred to must outlive the search.
  LinKernighan(std::span<const Site> sites, std::span<const double> weights, const Cost& of_hop,
               const Neighbours& neighbours, TourRules rules, std::vector<Node> tour)
      : cost_(of_hop), neighbours_(neighbours), rules_(rules), tour_(std::move(tour)) {
    places_.resize(tour_.size());
    for (std::size_t i = 0; i < tour_.size(); ++i) {
      places_[i].site = i < sites.size() ? sites[i] : Site{};
      places_[i].weight = weights[i];
      weight_of_tour_ += 2.0 * weights[i];
    }
    place_.resize(tour_.size());
    for (Place i = 0; i < size(); ++i) place_[tour_[static_cast<std::size_t>(i)]] = i;
    queued_.assign(tour_.size(), 0);
    // Beyond this a move costs more time than it is worth; only tours of hundreds of thousands get there.
    longest_turn_ = tour_.size() <= 150'000 ? size() : Place{30000};
    double total = 0.0;  // with weights
    for (std::size_t i = 0; i < tour_.size(); ++i) total += cost(tour_[i], tour_[(i + 1) % tour_.size()]);
    length_ = total;
    tolerance_ = 1e-9 * (total - weight_of_tour_) / static_cast<double>(tour_.size()) + 1e-300;
  }

  double length() const { return length_ - weight_of_tour_; }
  std::span<const Node> tour() const { return tour_; }

  /// Searches from every node until no chain shortens the tour.
  void improve_everywhere() {
    for (const Node node : tour_) push(node);
    std::reverse(queue_.begin(), queue_.end());
    drain();
  }

  /// What a search may cost; the first to be spent ends it. Work is counted alike on every machine: a place
  /// that is looked at, or 64 that are turned. The clock is not.
  struct Budget {
    std::size_t kicks = SIZE_MAX;
    std::uint64_t work = UINT64_MAX;
    std::optional<std::chrono::steady_clock::time_point> begin = {}, end = {};  ///< both or none
  };

  /// Again and again: exchanges four edges near each other, repairs, and goes back unless the tour is as
  /// short as before, or longer by no more than chance allows at a temperature that falls to 0 (Metropolis et
  /// al. 1953): what one kick spoils here, others mend there. Never longer in the end. Stops at
  /// `good_enough`. `tell` is told now and then the share of the budget that is spent.
  template <class Tell = TellNobody>
  void improve_by_kicks(const Budget& budget, double good_enough, std::mt19937_64& random,
                        const Tell& tell = {}) {
    constexpr std::size_t kKicksBetweenTellings = 4096;
    if (size() < 8) return;
    const std::vector<Node> tour_before = tour_;
    const double length_before = length_;
    const double hottest = kHottestShare * length() / static_cast<double>(size());
    const std::uint64_t work_before = work_;
    double share_of_time = 0.0;
    for (std::size_t i = 0; length() > good_enough + tolerance_; ++i) {
      constexpr std::size_t kKicksBetweenLooks = 64;  // at the clock
      if (budget.end && i % kKicksBetweenLooks == 0)
        share_of_time = std::chrono::duration<double>(std::chrono::steady_clock::now() - *budget.begin) /
                        std::chrono::duration<double>(*budget.end - *budget.begin);
      const double spent = std::max(
          {static_cast<double>(i) / static_cast<double>(budget.kicks),
           static_cast<double>(work_ - work_before) / static_cast<double>(budget.work), share_of_time});
      if (!(spent < 1.0)) break;
      if (i % kKicksBetweenTellings == 0) tell(spent);
      kick(random, hottest * std::max(0.0, 1.0 - spent / kCooledShare));
    }
    if (length_ <= length_before) return;
    tour_ = tour_before;
    for (Place i = 0; i < size(); ++i) place_[tour_[static_cast<std::size_t>(i)]] = i;
    length_ = length_before;
  }

 private:
  struct Placed {
    Site site;
    double weight;
  };
  struct Turn {
    Place first, last;  ///< virtual places, first <= last
  };
  struct Step {
    double open;      ///< gain of the chain before it is closed
    Place near, far;  ///< places that the exchange uses, meaning depends on `kind`
    enum class Kind : std::uint8_t { head, tail, splice_turned, splice } kind;
  };

  // Wide at the start of a chain, where a wrong first exchange can't be made good; measured on uniform and on
  // lattice instances of 1,000 to 10,000 sites against the same processor time spent on more kicks.
  static constexpr int kDeepest = 3;        // exchanges of a chain
  static constexpr int kDeepestSplice = 1;  // levels that try the exchanges of three edges
  static constexpr std::array<std::size_t, kDeepest> kBreadth = {0, 5, 3};
  static constexpr Place kLongestSegment = 100;  // of a kick
  static constexpr double kHottestShare = 0.4;   // first temperature over the mean edge
  static constexpr double kCooledShare = 0.95;   // of the budget, behind which the temperature is 0

  Place size() const { return static_cast<Place>(tour_.size()); }

  [[gnu::always_inline]] double cost(Node a, Node b) const {
    const Placed &p = places_[a], &q = places_[b];
    const double weights = p.weight + q.weight;
    if (a == rules_.joker || b == rules_.joker) return weights;
    return cost_(p.site.x - q.site.x, p.site.y - q.site.y) + weights;
  }

  // ---- the tour as the chain sees it: places 0..n-1 from the chain's one end round to its other ----

  [[gnu::always_inline]] Place place_of(Node node) const {
    Place at = mirrored_ ? base_ - place_[node] : place_[node] - base_;
    if (at < 0) at += size();
    for (int i = 0; i < turn_count_; ++i)
      if (at >= turns_[i].first && at <= turns_[i].last) at = turns_[i].first + turns_[i].last - at;
    return at;
  }

  [[gnu::always_inline]] Node node_at(Place at) const {
    for (int i = turn_count_ - 1; i >= 0; --i)
      if (at >= turns_[i].first && at <= turns_[i].last) at = turns_[i].first + turns_[i].last - at;
    return tour_[real(at)];
  }

  [[gnu::always_inline]] std::size_t real(Place at) const {
    at = mirrored_ ? base_ - at : base_ + at;
    if (at < 0) at += size();
    if (at >= size()) at -= size();
    return static_cast<std::size_t>(at);
  }

  void try_turn(Place first, Place last) {
    if (first < last) turns_[turn_count_++] = {first, last};
  }

  /// Reverses `count` nodes from a real place on; its own inverse.
  void reverse_real(std::size_t first, Place count) {
    auto i = static_cast<Place>(first), j = i + count - 1;
    if (j >= size()) j -= size();
    for (Place step = 0; step < count / 2; ++step) {
      const Node a = tour_[i], b = tour_[j];
      tour_[i] = b;
      place_[b] = i;
      tour_[j] = a;
      place_[a] = j;
      if (++i == size()) i = 0;
      if (--j < 0) j = size() - 1;
    }
  }

  /// Makes the tried turns real. Turning the rest of the tour instead of a stretch gives the same tour seen
  /// from its other side, so the shorter of the two is turned.
  void apply_turns() {
    for (int i = 0; i < turn_count_; ++i) {
      const auto [first, last] = turns_[i];
      const Place count = last - first + 1;
      const bool inside = 2 * count <= size();
      const Place begin = inside ? first : last + 1, turned = inside ? count : size() - count;
      if (turned > 1) {
        const std::size_t start = mirrored_ ? real((begin + turned - 1) % size()) : real(begin % size());
        reverse_real(start, turned);
        work_ += static_cast<std::uint64_t>(turned) / 64;
        journal_.push_back({start, turned});
      }
      if (!inside) {
        base_ = (mirrored_ ? base_ - first - last : base_ + first + last) % size();
        if (base_ < 0) base_ += size();
        mirrored_ = !mirrored_;
      }
    }
    turn_count_ = 0;
  }

  Place longest_turn() const {
    Place most = 0;
    for (int i = 0; i < turn_count_; ++i) {
      const Place count = turns_[i].last - turns_[i].first + 1;
      most = std::max(most, std::min(count, size() - count));
    }
    return most;
  }

  // ---- search ----

  void push(Node node) {
    if (queued_[node]) return;
    queued_[node] = 1;
    queue_.push_back(node);
  }

  void drain() {
    while (!queue_.empty()) {
      const Node node = queue_.back();
      queue_.pop_back();
      queued_[node] = 0;
      while (improve_at(node)) {
      }
    }
  }

  bool improve_at(Node node) {
    for (const bool mirrored : {false, true}) {
      mirrored_ = mirrored;
      // The chain's far end is `node` at place n-1, its near end the node behind it, at place 0.
      base_ = place_[node] + (mirrored ? -1 : 1);
      if (base_ < 0) base_ += size();
      if (base_ >= size()) base_ -= size();
      turn_count_ = 0;
      touched_.clear();
      const Node next = node_at(0);
      if (rules_.is_fixed(node, next)) continue;
      if (!extend(1, cost(node, next))) continue;
      push(node);
      push(next);
      for (const Node end : touched_) push(end);
      apply_turns();
      length_ -= gained_;
      return true;
    }
    turn_count_ = 0;
    return false;
  }

  /// Exchanges that lengthen the chain, the most promising first, and the best that ends it.
  struct Steps {
    std::array<Step, 3 * 16> list;
    std::size_t count = 0;
    Step closing{};
    double closed = 0.0;

    void add(const Step& step, double closing_cost) {
      if (step.open - closing_cost > closed) {
        closed = step.open - closing_cost;
        closing = step;
      }
      if (count < list.size()) list[count++] = step;
    }
    void keep_best(std::size_t wanted) {
      wanted = std::min(wanted, count);
      const auto at = [&](std::size_t i) { return list.begin() + static_cast<std::ptrdiff_t>(i); };
      std::partial_sort(at(0), at(wanted), at(count),
                        [](const Step& a, const Step& b) { return a.open > b.open; });
      count = wanted;
    }
  };

  /// The edges from `node` that a chain with this gain may add, cheapest first; the joker comes before all.
  template <class Visit>
  void for_candidates(Node node, int level, double gain, const Visit& visit) const {
    if (node == rules_.joker) return;
    if (rules_.joker != TourRules::kNone && level <= 2 && !rules_.is_fixed(node, rules_.joker)) {
      const double open = gain - cost(node, rules_.joker);
      if (open > tolerance_) visit(rules_.joker, open);
    }
    for (const Near& near : neighbours_.of(node))
      if (gain - near.cost > tolerance_) visit(near.node, gain - near.cost);
  }

  /// The exchanges that extend the open path at places 0..n-1. `gain`: of the edges removed over those added.
  void collect(int level, double gain, Steps& steps) {
    ++work_;
    const Place last = size() - 1;
    const Node near_end = node_at(0), far_end = node_at(last);
    // From the near end to c, removing the edge before c: the stretch from the near end to there is turned.
    for_candidates(near_end, level, gain, [&](Node c, double open) {
      const Place at = place_of(c);
      if (at >= 2) {
        const Node freed = node_at(at - 1);
        if (!rules_.is_fixed(freed, c))
          steps.add({open + cost(freed, c), at - 1, 0, Step::Kind::head}, cost(freed, far_end));
      }
      // The edge behind c instead leaves a ring 0..c, to be opened by the next edge.
      if (level <= kDeepestSplice && at >= 1 && at < last) add_splices(steps, level, open, at, far_end);
    });
    // The same from the far end.
    for_candidates(far_end, level, gain, [&](Node c, double open) {
      const Place at = place_of(c);
      if (at > last - 2) return;
      const Node freed = node_at(at + 1);
      if (!rules_.is_fixed(freed, c))
        steps.add({open + cost(freed, c), at + 1, 0, Step::Kind::tail}, cost(freed, near_end));
    });
  }

  /// Tries to extend the open path to a shorter tour. On success the turns lead to it and gained_ says by how
  /// much it is shorter.
  bool extend(int level, double gain) {
    Steps steps;
    steps.closed = tolerance_;
    collect(level, gain, steps);
    const int turns_before = turn_count_;
    const std::size_t touched_before = touched_.size();
    if (steps.closed > tolerance_) {
      take(steps.closing);
      if (longest_turn() <= longest_turn_) {
        gained_ = steps.closed;
        return true;
      }
      turn_count_ = turns_before;
      touched_.resize(touched_before);
    }
    if (level == kDeepest) return false;
    steps.keep_best(kBreadth[level]);
    for (std::size_t i = 0; i < steps.count; ++i) {
      take(steps.list[i]);
      if (extend(level + 1, steps.list[i].open)) return true;
      turn_count_ = turns_before;
      touched_.resize(touched_before);
    }
    return false;
  }

  /// Near end - c at place `ring` closes the ring 0..ring, the edge behind c goes; its outer end e is joined
  /// to a node of the ring whose edge to either side opens it again.
  void add_splices(Steps& steps, int level, double open, Place ring, Node far_end) {
    const Node c = node_at(ring), e = node_at(ring + 1);
    if (rules_.is_fixed(c, e)) return;
    for_candidates(e, level + 1, open + cost(c, e), [&](Node d, double gain) {
      const Place at = place_of(d);
      if (at > ring) return;
      if (at >= 1) {
        const Node freed = node_at(at - 1);
        if (!rules_.is_fixed(freed, d))
          steps.add({gain + cost(freed, d), at, ring, Step::Kind::splice_turned}, cost(freed, far_end));
      }
      if (at < ring) {
        const Node freed = node_at(at + 1);
        if (!rules_.is_fixed(freed, d))
          steps.add({gain + cost(freed, d), at, ring, Step::Kind::splice}, cost(freed, far_end));
      }
    });
  }

  /// Adds the step's turns to those that are being tried.
  void take(const Step& step) {
    switch (step.kind) {
      case Step::Kind::head:
        touch(step.near, step.near + 1);
        try_turn(0, step.near);
        return;
      case Step::Kind::tail:
        touch(step.near - 1, step.near);
        try_turn(step.near, size() - 1);
        return;
      case Step::Kind::splice_turned:  // 0..d-1 | d..c | e : turned each for itself
        touch(step.near - 1, step.near);
        touch(step.far, step.far + 1);
        try_turn(0, step.near - 1);
        try_turn(step.near, step.far);
        return;
      case Step::Kind::splice:  // 0..d | d+1..c | e : change places
        touch(step.near, step.near + 1);
        touch(step.far, step.far + 1);
        try_turn(0, step.far);
        try_turn(0, step.far - step.near - 1);
        try_turn(step.far - step.near, step.far);
        return;
    }
  }

  void touch(Place a, Place b) {
    touched_.push_back(node_at(a));
    touched_.push_back(node_at(b));
  }

  // ---- kicks ----

  /// Double bridge: the neighbouring stretches B C D at a random place become D C B.
  void kick(std::mt19937_64& random, double temperature) {
    const Place longest = std::min(kLongestSegment, (size() - 1) / 3);
    const auto any = [&](Place below) {
      return static_cast<Place>(random() % static_cast<std::uint64_t>(below));
    };
    base_ = any(size());
    const Place b = 1 + any(longest), c = 1 + any(longest), d = 1 + any(longest);  // lengths
    const Place all = b + c + d;
    mirrored_ = false;
    turn_count_ = 0;
    for (const Place edge : {Place{0}, b, b + c, all}) {
      const Node before = tour_[real((edge + size() - 1) % size())], after = tour_[real(edge % size())];
      if (rules_.is_fixed(before, after)) return;
    }
    const double length_before = length_;
    journal_.clear();
    for (const Place edge : {Place{0}, b, b + c, all}) {
      const Node before = tour_[real((edge + size() - 1) % size())], after = tour_[real(edge % size())];
      length_ -= cost(before, after);
      push(before);
      push(after);
    }
    try_turn(0, all - 1);
    try_turn(0, d - 1);
    try_turn(d, d + c - 1);
    try_turn(d + c, all - 1);
    apply_turns();
    for (const Place edge : {Place{0}, d, d + c, all})
      length_ += cost(tour_[real((edge + size() - 1) % size())], tour_[real(edge % size())]);
    drain();
    const double chance = std::ldexp(static_cast<double>(random() >> 11U) + 0.5, -53);
    if (length_ <= length_before + tolerance_ - temperature * std::log(chance)) return;
    for (auto entry = journal_.rbegin(); entry != journal_.rend(); ++entry)
      reverse_real(entry->first, entry->second);
    length_ = length_before;
  }

  std::vector<Placed> places_;
  double weight_of_tour_ = 0.0;
  const Cost& cost_;
  const Neighbours& neighbours_;
  TourRules rules_;
  std::vector<Node> tour_;
  std::vector<Place> place_;
  double length_ = 0.0, tolerance_ = 0.0, gained_ = 0.0;
  Place longest_turn_ = 0;
  std::uint64_t work_ = 0;

  Place base_ = 0;
  bool mirrored_ = false;
  std::array<Turn, 3 * kDeepest + 4> turns_{};
  int turn_count_ = 0;
  std::vector<Node> touched_;

  std::vector<Node> queue_;
  std::vector<char> queued_;
  std::vector<std::pair<std::size_t, Place>> journal_;
};

}  // namespace meltstage::motion::detail
