// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "asic/layout/place/place.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

/// A run of cells that touch: it stands where the squares of its cells' ways are least.
struct Cluster {
  double at = 0.0;
  double weight = 0.0;
  double pull = 0.0;  ///< sum of weight times wanted place
  Nm width = 0;
  std::size_t first = 0;  ///< in RowState::cells
};

struct RowState {
  Nm low = 0;
  Nm high = 0;
  Nm used = 0;
  std::vector<int> cells;
  std::vector<Cluster> clusters;

  /// Where a cell of this width would come to stand; the clusters it would join are `joined` last ones.
  double trial(double wanted, Nm width) const {
    Cluster sum{wanted, 1.0, wanted, width, 0};
    double at = clamp(wanted, width);
    for (std::size_t k = clusters.size(); k-- > 0;) {
      const Cluster& before = clusters[k];
      if (before.at + static_cast<double>(before.width) <= at) break;
      sum.pull = before.pull + sum.pull - sum.weight * static_cast<double>(before.width);
      sum.weight += before.weight;
      sum.width += before.width;
      at = clamp(sum.pull / sum.weight, sum.width);
    }
    return at + static_cast<double>(sum.width - width);
  }

  void insert(int cell, double wanted, Nm width) {
    Cluster last{clamp(wanted, width), 1.0, wanted, width, cells.size()};
    cells.push_back(cell);
    used += width;
    while (!clusters.empty() && clusters.back().at + static_cast<double>(clusters.back().width) > last.at) {
      const Cluster& before = clusters.back();
      last.pull = before.pull + last.pull - last.weight * static_cast<double>(before.width);
      last.weight += before.weight;
      last.width += before.width;
      last.first = before.first;
      last.at = clamp(last.pull / last.weight, last.width);
      clusters.pop_back();
    }
    clusters.push_back(last);
  }

 private:
  double clamp(double at, Nm width) const {
    return std::max(static_cast<double>(low), std::min(at, static_cast<double>(high - width)));
  }
};

}  // namespace

void legalize(Design& design, const Technology& technology) {
  const Nm height = technology.sites[static_cast<std::size_t>(design.rows.front().site)].height;
  const Nm bottom = design.rows.front().at.y;
  std::vector<RowState> rows;
  for (const Row& row : design.rows) {
    const Site& site = technology.sites[static_cast<std::size_t>(row.site)];
    rows.push_back({row.at.x, row.at.x + row.sites * site.width, 0, {}, {}});
  }
  std::vector<int> order(design.components.size());
  std::iota(order.begin(), order.end(), 0);
  const auto component = [&](int c) -> Component& { return design.components[static_cast<std::size_t>(c)]; };
  const auto width = [&](int c) {
    return technology.macros[static_cast<std::size_t>(component(c).macro)].width + component(c).padding;
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return std::tuple(component(a).at.x, component(a).at.y, a) <
           std::tuple(component(b).at.x, component(b).at.y, b);
  });
  const auto count = static_cast<Nm>(rows.size());
  for (const int c : order) {
    const Point wanted = component(c).at;
    const Nm home = std::clamp<Nm>(
        std::llround(static_cast<double>(wanted.y - bottom) / static_cast<double>(height)), 0, count - 1);
    double best = std::numeric_limits<double>::max();
    Nm best_row = -1;
    for (Nm away = 0; away < count; ++away) {
      if (static_cast<double>((away - 1) * height) > best) break;
      for (const Nm r : {home - away, home + away}) {
        if (r < 0 || r >= count || (away == 0 && best_row >= 0)) continue;
        const RowState& row = rows[static_cast<std::size_t>(r)];
        if (row.used + width(c) > row.high - row.low) continue;
        const double cost =
            std::abs(row.trial(static_cast<double>(wanted.x), width(c)) - static_cast<double>(wanted.x)) +
            std::abs(static_cast<double>(bottom + r * height - wanted.y));
        if (cost < best) best = cost, best_row = r;
      }
    }
    if (best_row < 0)
      throw UserError(
          fmt::format("{}: found no room for {}, expected larger rows; take a lower --utilization",
                      design.file, shown(component(c).name)));
    rows[static_cast<std::size_t>(best_row)].insert(c, static_cast<double>(wanted.x), width(c));
  }
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const Row& row = design.rows[r];
    const Nm step = technology.sites[static_cast<std::size_t>(row.site)].width;
    const RowState& state = rows[r];
    // from the left each cluster to the nearest free site; from the right back what stands beyond the end
    std::vector<Nm> starts;
    Nm next = state.low;
    for (const Cluster& cluster : state.clusters) {
      const Nm site =
          state.low +
          std::llround((cluster.at - static_cast<double>(state.low)) / static_cast<double>(step)) * step;
      starts.push_back(std::max(next, site));
      next = starts.back() + cluster.width;
    }
    Nm end = state.high;
    for (std::size_t k = starts.size(); k-- > 0;) {
      starts[k] = std::min(starts[k], end - state.clusters[k].width);
      end = starts[k];
    }
    for (std::size_t k = 0; k < starts.size(); ++k) {
      const std::size_t last = k + 1 < starts.size() ? state.clusters[k + 1].first : state.cells.size();
      Nm x = starts[k];
      for (std::size_t j = state.clusters[k].first; j < last; ++j) {
        Component& cell = component(state.cells[j]);
        cell.at = {x, row.at.y};
        cell.orientation = row.orientation;
        cell.is_placed = true;
        x += width(state.cells[j]);
      }
    }
  }
}

}  // namespace meltstage::layout
