// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/route/guides.hpp"

#include <fmt/format.h>

#include <limits>
#include <numeric>

#include "asic/layout/db/model.hpp"
#include "base/error.hpp"

namespace meltstage::layout {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Borders are numbered by the region to their left or below: 2 * region for the one to its right, 2 * region
/// + 1 for the one above it.
class GlobalRouter {
 public:
  GlobalRouter(const Design& design, const Technology& technology, const GuideOptions& options)
      : design_(design), technology_(technology), options_(options) {
    make_grid();
    const auto regions = at(guides_.grid.regions());
    used_.assign(2 * regions, 0.0F);
    history_.assign(2 * regions, 0.0F);
    marks_.resize(regions);
    guides_.regions.resize(design.nets.size());
    borders_.resize(design.nets.size());
    find_terminals();
  }

  Guides run() {
    std::vector<int> order;
    for (std::size_t n = 0; n < terminals_.size(); ++n)
      if (terminals_[n].size() > 1) order.push_back(static_cast<int>(n));
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return span(a) < span(b); });
    for (int round = 0; round < options_.rounds; ++round) {
      over_price_ = 1.0F + static_cast<float>(round);
      for (const int net : order) {
        if (round > 0 && !is_crowded(net)) continue;
        take(net, -1.0F);
        route(net);
        take(net, 1.0F);
      }
      for (std::size_t b = 0; b < used_.size(); ++b)
        if (used_[b] > capacity(b)) history_[b] += 0.5F;
      if (overflow() == 0.0) break;
    }
    finish();
    return std::move(guides_);
  }

 private:
  struct Mark {
    float cost = std::numeric_limits<float>::max();
    int from = -1;
    int tree = 0;
  };
  struct Entry {
    float estimate;
    float cost;
    int region;
    bool operator<(const Entry& o) const { return estimate > o.estimate; }
  };

  void make_grid() {
    const std::vector<int> layers = track_layers(technology_);
    Nm pitch = 0;
    double across_x = 0.0, across_y = 0.0;  // tracks a nm
    for (const int l : layers) {
      const Layer& layer = technology_.layers[at(l)];
      if (layer.pitch <= 0)
        throw UserError(
            fmt::format("{}: found no PITCH of layer {}, expected one", technology_.files, layer.name));
      pitch = std::max(pitch, layer.pitch);
      (layer.direction == Axis::horizontal ? across_x : across_y) += 1.0 / static_cast<double>(layer.pitch);
    }
    RegionGrid& grid = guides_.grid;
    grid.size = std::max<Nm>(1, pitch * options_.tracks);
    grid.columns = static_cast<int>((design_.die.x1 + grid.size - 1) / grid.size);
    grid.rows = static_cast<int>((design_.die.y1 + grid.size - 1) / grid.size);
    constexpr double kMostRegions = 1e7;
    if (static_cast<double>(grid.columns) * grid.rows > kMostRegions)
      throw UserError(fmt::format(
          "{}: found a die of {} x {} regions of {} tracks, expected at most {:g}; it is too large for the "
          "PITCH of {}",
          design_.file, grid.columns, grid.rows, options_.tracks, kMostRegions, technology_.files));
    capacity_[0] = static_cast<float>(across_x * static_cast<double>(grid.size) * options_.usable);
    capacity_[1] = static_cast<float>(across_y * static_cast<double>(grid.size) * options_.usable);
  }

  void find_terminals() {
    terminals_.resize(design_.nets.size());
    const RegionGrid& grid = guides_.grid;
    for (std::size_t n = 0; n < design_.nets.size(); ++n) {
      const Net& net = design_.nets[n];
      if (is_supply(net.use) || net.pins.size() > options_.ignored_pins) continue;
      std::vector<int>& regions = terminals_[n];
      for (const PinRef& ref : net.pins) {
        const int region = grid.region_of(place_of(ref));
        regions.push_back(region);
        // what the pin takes is shared between the borders on both sides
        const auto half = static_cast<float>(options_.tracks_a_pin / 2);
        for (const int dir : {0, 1}) {
          used_[at(2 * region + dir)] += half;
          const int before = dir == 0 ? (region % grid.columns > 0 ? region - 1 : -1) : region - grid.columns;
          if (before >= 0) used_[at(2 * before + dir)] += half;
        }
      }
      std::sort(regions.begin(), regions.end());
      regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
    }
  }

  Point place_of(const PinRef& ref) const {
    if (ref.component == kDiePin) return design_.pins[at(ref.pin)].shape.rect.middle();
    const Component& component = design_.components[at(ref.component)];
    const Macro& macro = technology_.macros[at(component.macro)];
    const Point middle = middle_of(macro.pins[at(ref.pin)]);
    const Rect there = placed({middle.x, middle.y, middle.x, middle.y}, macro, component);
    return {there.x0, there.y0};
  }

  int span(int net) const {
    int x0 = std::numeric_limits<int>::max(), y0 = x0, x1 = 0, y1 = 0;
    for (const int r : terminals_[at(net)]) {
      const int x = r % guides_.grid.columns, y = r / guides_.grid.columns;
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
    return x1 - x0 + y1 - y0;
  }

  float capacity(std::size_t border) const { return capacity_[border % 2]; }
  void take(int net, float tracks) {
    for (const int b : borders_[at(net)]) used_[at(b)] += tracks;
  }
  bool is_crowded(int net) const {
    return std::any_of(borders_[at(net)].begin(), borders_[at(net)].end(),
                       [&](int b) { return used_[at(b)] > capacity(at(b)); });
  }
  double overflow() const {
    double sum = 0.0;
    for (std::size_t b = 0; b < used_.size(); ++b) sum += std::max(0.0F, used_[b] - capacity(b));
    return sum;
  }

  float price(int border) const {
    const float fill = (used_[at(border)] + 1.0F) / capacity(at(border));
    const float crowded = fill > 1.0F ? over_price_ * (1.0F + 4.0F * (fill - 1.0F))
                                      : (fill > 0.8F ? 2.5F * (fill - 0.8F) : 0.0F);
    return 1.0F + crowded + history_[at(border)];
  }

  void route(int net) {
    std::vector<int>& borders = borders_[at(net)];
    borders.clear();
    std::vector<int> left = terminals_[at(net)];
    const int columns = guides_.grid.columns;
    ++stamp_;
    tree_ = {left.front()};
    marks_[at(left.front())].tree = stamp_;
    left.erase(left.begin());
    const auto distance = [&](int a, int b) {
      return std::abs(a % columns - b % columns) + std::abs(a / columns - b / columns);
    };
    // Prim's order over the terminals; each joins the tree wherever that is cheapest
    std::vector<int> nearest(left.size());
    for (std::size_t i = 0; i < left.size(); ++i) nearest[i] = distance(left[i], tree_.front());
    while (!left.empty()) {
      const auto next = std::min_element(nearest.begin(), nearest.end()) - nearest.begin();
      const int from = left[static_cast<std::size_t>(next)];
      left.erase(left.begin() + next);
      nearest.erase(nearest.begin() + next);
      const std::size_t had = tree_.size();
      join(from, borders);
      for (std::size_t i = 0; i < left.size(); ++i)
        for (std::size_t k = had; k < tree_.size(); ++k)
          nearest[i] = std::min(nearest[i], distance(left[i], tree_[k]));
    }
  }

  void join(int from, std::vector<int>& borders) {
    const int columns = guides_.grid.columns, rows = guides_.grid.rows;
    if (marks_[at(from)].tree == stamp_) return;
    int aim_x0 = columns, aim_y0 = rows, aim_x1 = -1, aim_y1 = -1;
    for (const int r : tree_) {
      aim_x0 = std::min(aim_x0, r % columns), aim_x1 = std::max(aim_x1, r % columns);
      aim_y0 = std::min(aim_y0, r / columns), aim_y1 = std::max(aim_y1, r / columns);
    }
    const auto ahead = [&](int r) {
      const int x = r % columns, y = r / columns;
      return static_cast<float>(std::max({0, aim_x0 - x, x - aim_x1}) +
                                std::max({0, aim_y0 - y, y - aim_y1}));
    };
    heap_.clear();
    touched_.clear();
    const auto reach = [&](int r, int before, float cost) {
      Mark& mark = marks_[at(r)];
      if (cost >= mark.cost) return;
      mark.cost = cost;
      mark.from = before;
      touched_.push_back(r);
      heap_.push_back({cost + ahead(r), cost, r});
      std::push_heap(heap_.begin(), heap_.end());
    };
    reach(from, -1, 0.0F);
    int reached = -1;
    while (!heap_.empty()) {
      std::pop_heap(heap_.begin(), heap_.end());
      const Entry entry = heap_.back();
      heap_.pop_back();
      const int r = entry.region;
      if (entry.cost != marks_[at(r)].cost) continue;
      if (marks_[at(r)].tree == stamp_) {
        reached = r;
        break;
      }
      const int x = r % columns, y = r / columns;
      if (x > 0) reach(r - 1, r, entry.cost + price(2 * (r - 1)));
      if (x + 1 < columns) reach(r + 1, r, entry.cost + price(2 * r));
      if (y > 0) reach(r - columns, r, entry.cost + price(2 * (r - columns) + 1));
      if (y + 1 < rows) reach(r + columns, r, entry.cost + price(2 * r + 1));
    }
    for (int r = reached; r >= 0; r = marks_[at(r)].from) {
      const int before = marks_[at(r)].from;
      if (marks_[at(r)].tree != stamp_) tree_.push_back(r);
      marks_[at(r)].tree = stamp_;
      if (before < 0) break;
      const int low = std::min(r, before);
      borders.push_back(2 * low + (std::abs(r - before) == 1 ? 0 : 1));
    }
    for (const int r : touched_) marks_[at(r)].cost = std::numeric_limits<float>::max();
  }

  void finish() {
    const int columns = guides_.grid.columns;
    guides_.overflow = overflow();
    guides_.crowding.assign(marks_.size(), 0.0F);
    for (std::size_t b = 0; b < used_.size(); ++b) {
      const int low = static_cast<int>(b / 2);
      const int high = b % 2 == 0 ? low + 1 : low + columns;
      const float fill = used_[b] / capacity(b);
      for (const int r : {low, high})
        if (r < guides_.grid.regions()) guides_.crowding[at(r)] = std::max(guides_.crowding[at(r)], fill);
    }
    for (std::size_t n = 0; n < borders_.size(); ++n) {
      std::vector<int>& regions = guides_.regions[n];
      regions = terminals_[n];
      for (const int b : borders_[n]) {
        regions.push_back(b / 2);
        regions.push_back(b % 2 == 0 ? b / 2 + 1 : b / 2 + columns);
      }
      std::sort(regions.begin(), regions.end());
      regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
    }
  }

  const Design& design_;
  const Technology& technology_;
  const GuideOptions options_;
  Guides guides_;
  float capacity_[2] = {1.0F, 1.0F};  // to the right, upwards
  std::vector<float> used_;
  std::vector<float> history_;
  std::vector<std::vector<int>> terminals_;  // regions, a net each
  std::vector<std::vector<int>> borders_;    // crossed, a net each
  std::vector<Mark> marks_;
  std::vector<Entry> heap_;
  std::vector<int> touched_;
  std::vector<int> tree_;
  int stamp_ = 0;
  float over_price_ = 1.0F;
};

}  // namespace

std::vector<int> track_layers(const Technology& technology) {
  const std::vector<int> metals = technology.routing_layers();
  std::vector<int> layers;
  for (std::size_t i = 1; i < metals.size(); ++i) {
    const auto layer = [&](std::size_t k) -> const Layer& { return technology.layers[at(metals[k])]; };
    if (i >= 3 && (layer(i).pitch != layer(i - 2).pitch || layer(i).direction != layer(i - 2).direction))
      break;
    layers.push_back(metals[i]);
  }
  return layers;
}

Guides route_globally(const Design& design, const Technology& technology, const GuideOptions& options) {
  return GlobalRouter(design, technology, options).run();
}

}  // namespace meltstage::layout
