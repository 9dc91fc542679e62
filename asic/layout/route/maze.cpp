// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/route/maze.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <initializer_list>
#include <limits>
#include <random>
#include <string>

namespace meltstage::layout {
namespace {

using Cost = std::int32_t;
constexpr Cost kUnreached = std::numeric_limits<Cost>::max();
constexpr Cost kUnitsPerPitch = 100;  // of the finer pitch
constexpr Cost kFirstShareCost = 400;
constexpr double kShareGrowth = 1.5;
constexpr Cost kMostShareCost = 4'000;
constexpr Cost kHistoryStep = 50;
constexpr Cost kHistoryShare = 8;    // of the cost of sharing, so that history still tells in late rounds
constexpr int kRoundsAWidening = 6;  // after which a net may leave its regions by one more

struct Window {
  int x0, y0, x1, y1;
  void include(int ix, int iy) {
    x0 = std::min(x0, ix);
    y0 = std::min(y0, iy);
    x1 = std::max(x1, ix);
    y1 = std::max(y1, iy);
  }
};
constexpr std::size_t kBoxesAimedAt = 6;
int distance(const Window& box, int ix, int iy) {
  return std::max({0, box.x0 - ix, ix - box.x1}) + std::max({0, box.y0 - iy, iy - box.y1});
}

constexpr Window kNoWindow{std::numeric_limits<int>::max(), std::numeric_limits<int>::max(), -1, -1};

struct Entry {
  Cost estimate;
  Cost cost;
  int node;
  bool operator<(const Entry& o) const {
    return estimate > o.estimate || (estimate == o.estimate && cost < o.cost);
  }
};

class Router {
 public:
  explicit Router(const MazeProblem& problem)
      : problem_(problem),
        grid_(problem.grid),
        places_(size()),
        marks_(size()),
        step_x_(units_of(grid_.pitch_x)),
        step_y_(units_of(grid_.pitch_y)),
        trees_(problem.nets.size()),
        bodies_(problem.nets.size()) {
    for (std::size_t i = 0; i < size(); ++i) places_[i].owner = problem.owner[i];
    const MazeRegions& regions = problem.regions;
    region_of_column_ = regions.of_column;
    region_of_row_ = regions.of_row;
    region_of_column_.resize(at(grid_.columns));
    region_of_row_.resize(at(grid_.rows));
    opened_.resize(at(std::max(1, regions.columns * regions.rows)));
  }

  bool take_over(int net, const MazeTree& tree);
  bool route(int net, int widening);
  void rip_up(int net);
  bool shares(int net) const;
  void remember_shared(int net);
  void set_share_cost(Cost cost) { share_cost_ = cost; }
  const MazeTree& tree(int net) const { return trees_[static_cast<std::size_t>(net)]; }

 private:
  std::size_t size() const { return static_cast<std::size_t>(grid_.nodes()); }
  Cost units_of(Nm pitch) const {
    return static_cast<Cost>(pitch * kUnitsPerPitch / std::min(grid_.pitch_x, grid_.pitch_y));
  }
  static std::size_t at(int node) { return static_cast<std::size_t>(node); }
  void find_bodies(int net);
  int own_uses(int net, std::size_t i) const;
  void claim(int net, int sign);
  void open_regions(int net, int widening);
  void open_all_regions();
  bool extend(int net, const std::vector<int>& terminal);
  bool search(int net, int& reached);
  bool may_go_on(const MazeNet& net, int node) const;
  Cost length_of(int net, const Grid::Crossing& a, const Grid::Crossing& b) const {
    return a.layer != b.layer ? problem_.nets[at(net)].via_cost : a.ix != b.ix ? step_x_ : step_y_;
  }

  /// Other nets' bodies at the node or, where ends need room, beside it.
  template <typename Visit>
  void around(int node, Visit visit) const {
    visit(node);
    const Grid::Crossing c = grid_.crossing(node);
    if (!grid_.ends_spread[at(c.layer)]) return;
    const bool vertical = grid_.vertical[at(c.layer)];
    const int along = vertical ? c.iy : c.ix;
    const int last = (vertical ? grid_.rows : grid_.columns) - 1;
    if (along > 0) visit(node - 1);
    if (along < last) visit(node + 1);
  }

  const MazeProblem& problem_;
  const Grid& grid_;
  // what a step of the search looks at lies side by side in memory
  struct Place {
    std::int32_t owner;
    Cost history = 0;
    std::uint16_t uses = 0;  // bodies of nets at the node and, where ends spread, beside it
  };
  struct Mark {
    Cost cost = kUnreached;
    std::int32_t from = -1;
    std::int32_t tree = 0;
    Cost depth = 0;  ///< of a tree's node: the way back to the root
  };
  std::vector<Place> places_;
  std::vector<Mark> marks_;
  std::int32_t tree_stamp_ = 0;
  std::vector<int> region_of_column_, region_of_row_;
  std::vector<std::int32_t> opened_;  // a region each
  std::int32_t open_stamp_ = 0;
  std::vector<int> touched_;
  std::vector<Entry> heap_;
  std::vector<Window> tree_boxes_;  // of each straight run that the net's tree has so far
  std::vector<Window> aims_;
  Cost step_x_, step_y_;
  Cost share_cost_ = 0;
  std::vector<MazeTree> trees_;
  std::vector<std::vector<int>> bodies_;  // a net each: its nodes, sorted
};

void Router::find_bodies(int net) {
  std::vector<int>& nodes = bodies_[at(net)];
  nodes.clear();
  for (const auto& [a, b] : tree(net)) {
    nodes.push_back(a);
    nodes.push_back(b);
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

void Router::claim(int net, int sign) {
  for (const int node : bodies_[at(net)])
    around(node,
           [&](int n) { places_[at(n)].uses = static_cast<std::uint16_t>(places_[at(n)].uses + sign); });
}

void Router::rip_up(int net) {
  claim(net, -1);
  trees_[at(net)].clear();
  bodies_[at(net)].clear();
}

// How much of the count at its i-th node is the net's own.
int Router::own_uses(int net, std::size_t i) const {
  const std::vector<int>& nodes = bodies_[at(net)];
  int own = 0;
  around(nodes[i], [&](int n) {
    if (n == nodes[i] || (i > 0 && n == nodes[i - 1]) || (i + 1 < nodes.size() && n == nodes[i + 1])) ++own;
  });
  return own;
}

bool Router::shares(int net) const {
  const std::vector<int>& nodes = bodies_[at(net)];
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (places_[at(nodes[i])].uses > own_uses(net, i)) return true;
  return false;
}

void Router::remember_shared(int net) {
  const std::vector<int>& nodes = bodies_[at(net)];
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (places_[at(nodes[i])].uses > own_uses(net, i))
      places_[at(nodes[i])].history += kHistoryStep + share_cost_ / kHistoryShare;
}

// What the net's own limits say of a node.
bool Router::may_go_on(const MazeNet& net, int node) const {
  if (net.highest >= 0 && node >= (net.highest + 1) * grid_.layer_size()) return false;
  if (net.lowest_reach < 0 || node >= grid_.layer_size()) return true;
  return std::any_of(net.terminals.begin(), net.terminals.end(), [&](const std::vector<int>& terminal) {
    return std::any_of(terminal.begin(), terminal.end(),
                       [&](int from) { return std::abs(from - node) <= net.lowest_reach; });
  });
}

// From the terminal (in heap_) to any node of the tree.
bool Router::search(int net, int& reached) {
  const int layer_size = grid_.layer_size();
  const int top = grid_.layers() - 1;
  const auto ahead = [&](int ix, int iy) {
    Cost least = kUnreached;
    for (const Window& box : aims_) {
      const int dx = std::max({0, box.x0 - ix, ix - box.x1});
      const int dy = std::max({0, box.y0 - iy, iy - box.y1});
      least = std::min(least, dx * step_x_ + dy * step_y_);
    }
    return least;
  };
  while (!heap_.empty()) {
    std::pop_heap(heap_.begin(), heap_.end());
    const Entry entry = heap_.back();
    heap_.pop_back();
    const int node = entry.node;
    if (entry.cost != marks_[at(node)].cost) continue;
    if (marks_[at(node)].tree == tree_stamp_) {
      reached = node;
      return true;
    }
    const Grid::Crossing c = grid_.crossing(node);
    const auto visit = [&](int next, int ix, int iy, Cost step) {
      if (opened_[at(region_of_column_[at(ix)] + region_of_row_[at(iy)])] != open_stamp_) return;
      const Place& place = places_[at(next)];
      if (place.owner != kFreeNode && place.owner != net) return;
      if (!may_go_on(problem_.nets[at(net)], next)) return;
      Mark& mark = marks_[at(next)];
      const Cost way_back = mark.tree == tree_stamp_ ? mark.depth / 100 * problem_.nets[at(net)].way_back : 0;
      const Cost cost = entry.cost + step + way_back + place.history + (place.uses > 0 ? share_cost_ : 0);
      if (cost >= mark.cost) return;
      if (mark.cost == kUnreached) touched_.push_back(next);
      mark.cost = cost;
      mark.from = node;
      heap_.push_back({cost + ahead(ix, iy), cost, next});
      std::push_heap(heap_.begin(), heap_.end());
    };
    if (grid_.vertical[at(c.layer)]) {
      if (c.iy > 0) visit(node - 1, c.ix, c.iy - 1, step_y_);
      if (c.iy + 1 < grid_.rows) visit(node + 1, c.ix, c.iy + 1, step_y_);
    } else {
      if (c.ix > 0) visit(node - 1, c.ix - 1, c.iy, step_x_);
      if (c.ix + 1 < grid_.columns) visit(node + 1, c.ix + 1, c.iy, step_x_);
    }
    const bool vertical = grid_.vertical[at(c.layer)];
    const auto other_layer = [&](int layer) {
      if (grid_.vertical[at(layer)] == vertical) return layer * layer_size + node % layer_size;
      return grid_.node(layer, c.ix, c.iy);
    };
    if (c.layer > 0) visit(other_layer(c.layer - 1), c.ix, c.iy, problem_.nets[at(net)].via_cost);
    if (c.layer < top) visit(other_layer(c.layer + 1), c.ix, c.iy, problem_.nets[at(net)].via_cost);
  }
  return false;
}

void Router::open_regions(int net, int widening) {
  const MazeRegions& regions = problem_.regions;
  const std::vector<int>& wanted = problem_.nets[at(net)].regions;
  if (wanted.empty()) return open_all_regions();
  ++open_stamp_;
  for (const int region : wanted) {
    const int x = region % regions.columns, y = region / regions.columns;
    for (int j = std::max(0, y - widening); j <= std::min(regions.rows - 1, y + widening); ++j)
      for (int i = std::max(0, x - widening); i <= std::min(regions.columns - 1, x + widening); ++i)
        opened_[at(j * regions.columns + i)] = open_stamp_;
  }
}

void Router::open_all_regions() {
  ++open_stamp_;
  std::fill(opened_.begin(), opened_.end(), open_stamp_);
}

bool Router::extend(int net, const std::vector<int>& terminal) {
  for (const int node : terminal)
    if (marks_[at(node)].tree == tree_stamp_) return true;
  // the way is sought towards the nearest parts of the tree
  const auto [layer, ix, iy] = grid_.crossing(terminal.front());
  aims_ = tree_boxes_;
  const auto nearer = [x = ix, y = iy](const Window& a, const Window& b) {
    return distance(a, x, y) < distance(b, x, y);
  };
  if (aims_.size() > kBoxesAimedAt) {
    std::nth_element(aims_.begin(), aims_.begin() + kBoxesAimedAt, aims_.end(), nearer);
    aims_.resize(kBoxesAimedAt);
  }
  heap_.clear();
  for (const int node : terminal) {
    marks_[at(node)].cost = places_[at(node)].uses > 0 ? share_cost_ : 0;
    marks_[at(node)].from = -1;
    touched_.push_back(node);
    heap_.push_back({marks_[at(node)].cost, marks_[at(node)].cost, node});
  }
  std::make_heap(heap_.begin(), heap_.end());
  int reached = -1;
  const bool found = search(net, reached);
  if (found) {
    MazeTree& tree = trees_[static_cast<std::size_t>(net)];
    Window box = kNoWindow;
    Cost depth = marks_[at(reached)].depth;
    for (int node = reached; node >= 0; node = marks_[at(node)].from) {
      const Grid::Crossing c = grid_.crossing(node);
      marks_[at(node)].depth = depth;
      if (marks_[at(node)].from >= 0) depth += length_of(net, c, grid_.crossing(marks_[at(node)].from));
      Window longer = box;
      longer.include(c.ix, c.iy);
      if (longer.x0 < longer.x1 &&
          longer.y0 < longer.y1) {  // a turn: the box of a whole way would be empty in the middle
        tree_boxes_.push_back(box);
        longer = {c.ix, c.iy, c.ix, c.iy};
      }
      box = longer;
      marks_[at(node)].tree = tree_stamp_;
      if (marks_[at(node)].from >= 0) tree.emplace_back(node, marks_[at(node)].from);
    }
    tree_boxes_.push_back(box);
  }
  for (const int node : touched_) marks_[at(node)].cost = kUnreached;
  touched_.clear();
  return found;
}

// Terminals join the tree in Prim's order: the one nearest to those that are in comes next, ways back counted
// as far as the net wants it.
std::vector<int> prim_order(const std::vector<Grid::Crossing>& places, int root, int way_back) {
  const std::size_t n = places.size();
  std::vector<int> order{root};
  std::vector<int> cost(n, std::numeric_limits<int>::max());
  std::vector<int> depth(n, 0);  // of those that aren't in yet: if they joined now
  std::vector<bool> in(n, false);
  in[static_cast<std::size_t>(root)] = true;
  for (auto last = static_cast<std::size_t>(root); order.size() < n;) {
    std::size_t best = n;
    for (std::size_t i = 0; i < n; ++i) {
      if (in[i]) continue;
      const int distance =
          std::abs(places[i].ix - places[last].ix) + std::abs(places[i].iy - places[last].iy);
      const int joining = distance + depth[last] * way_back / 100;
      if (joining < cost[i]) {
        cost[i] = joining;
        depth[i] = depth[last] + distance;
      }
      if (best == n || cost[i] < cost[best]) best = i;
    }
    in[best] = true;
    order.push_back(static_cast<int>(best));
    last = best;
  }
  return order;
}

// A way from before is kept when the net may still use all of it; whether it touches all terminals is told.
// If not, route() goes on from it.
bool Router::take_over(int net, const MazeTree& tree) {
  trees_[at(net)] = tree;
  find_bodies(net);
  const std::vector<int>& nodes = bodies_[at(net)];
  const auto is_ours = [&](int node) {
    if (!may_go_on(problem_.nets[at(net)], node)) return false;
    return places_[at(node)].owner == kFreeNode || places_[at(node)].owner == net;
  };
  const auto is_touched = [&](const std::vector<int>& terminal) {
    return std::any_of(terminal.begin(), terminal.end(),
                       [&](int node) { return std::binary_search(nodes.begin(), nodes.end(), node); });
  };
  const auto& terminals = problem_.nets[at(net)].terminals;
  const bool is_kept = !tree.empty() && std::all_of(nodes.begin(), nodes.end(), is_ours) &&
                       std::any_of(terminals.begin(), terminals.end(), is_touched);
  if (!is_kept) trees_[at(net)].clear();
  const bool is_whole = is_kept && std::all_of(terminals.begin(), terminals.end(), is_touched);
  if (is_whole)
    claim(net, 1);
  else
    bodies_[at(net)].clear();
  return is_whole;
}

bool Router::route(int net, int widening) {
  const MazeNet& wanted = problem_.nets[static_cast<std::size_t>(net)];
  if (wanted.terminals.size() < 2) return true;
  std::vector<Grid::Crossing> places;
  for (const auto& terminal : wanted.terminals) places.push_back(grid_.crossing(terminal.front()));
  const std::vector<int> order = prim_order(places, wanted.root, wanted.way_back);
  ++tree_stamp_;
  tree_boxes_.clear();
  const auto begin_with = [&](std::initializer_list<int> nodes) {
    Window box = kNoWindow;
    for (const int node : nodes) {
      marks_[at(node)].tree = tree_stamp_;
      marks_[at(node)].depth = 0;
      const Grid::Crossing c = grid_.crossing(node);
      box.include(c.ix, c.iy);
    }
    tree_boxes_.push_back(box);
  };
  for (const auto& [a, b] : trees_[at(net)]) begin_with({a, b});
  if (trees_[at(net)].empty())
    for (const int node : wanted.terminals[at(order[0])]) begin_with({node});
  open_regions(net, widening);
  bool all = true;
  for (const int next : order) {
    const auto& terminal = wanted.terminals[at(next)];
    if (extend(net, terminal)) continue;
    open_all_regions();
    all = extend(net, terminal) && all;
    open_regions(net, widening);
  }
  find_bodies(net);
  claim(net, 1);
  return all;
}

}  // namespace

MazeResult route_maze(const MazeProblem& problem, const MazeOptions& options) {
  Router router(problem);
  MazeResult result;
  const int nets = static_cast<int>(problem.nets.size());
  const auto span = [&](int net) {
    Window box = kNoWindow;
    for (const auto& terminal : problem.nets[static_cast<std::size_t>(net)].terminals)
      for (const int node : terminal) {
        const Grid::Crossing c = problem.grid.crossing(node);
        box.include(c.ix, c.iy);
      }
    return box.x1 - box.x0 + box.y1 - box.y0;
  };
  std::vector<int> spans(static_cast<std::size_t>(nets));
  for (int net = 0; net < nets; ++net) spans[static_cast<std::size_t>(net)] = span(net);
  std::vector<int> todo;
  for (int net = 0; net < nets; ++net) {
    const auto n = static_cast<std::size_t>(net);
    if (n >= problem.begun.size() || !router.take_over(net, problem.begun[n])) todo.push_back(net);
  }
  std::stable_sort(todo.begin(), todo.end(), [&](int a, int b) {
    return spans[static_cast<std::size_t>(a)] < spans[static_cast<std::size_t>(b)];
  });
  std::vector<bool> open(static_cast<std::size_t>(nets), false);
  double share_cost = kFirstShareCost;
  // from the second round on in any order, another each time: a net that always goes before its neighbours
  // would for ever move between two of them, and neither of these would ever have to give way
  std::mt19937 any_order(1);
  for (int round = 0; round < options.rounds && !todo.empty(); ++round) {
    router.set_share_cost(static_cast<Cost>(share_cost));
    if (round > 0) std::shuffle(todo.begin(), todo.end(), any_order);
    const std::string name = round == 0
                                 ? fmt::format("routing {} nets", todo.size())
                                 : fmt::format("round {}, {} nets share a place", round + 1, todo.size());
    std::size_t done = 0;
    for (const int net : todo) {
      tell(options.progress, name, done++, todo.size());
      if (round > 0) {
        if (!open[static_cast<std::size_t>(net)] && !router.shares(net))
          continue;  // a net routed before has made room
        router.rip_up(net);
      }
      open[static_cast<std::size_t>(net)] = !router.route(net, 1 + round / kRoundsAWidening);
    }
    todo.clear();
    for (int net = 0; net < nets; ++net)
      if (router.shares(net)) {
        router.remember_shared(net);
        todo.push_back(net);
      }
    result.rounds = round + 1;
    share_cost = std::min(share_cost * kShareGrowth, static_cast<double>(kMostShareCost));
  }
  result.conflicting = todo;
  for (int net = 0; net < nets; ++net) {
    result.trees.push_back(router.tree(net));
    if (open[static_cast<std::size_t>(net)]) result.open.push_back(net);
  }
  return result;
}

}  // namespace meltstage::layout
