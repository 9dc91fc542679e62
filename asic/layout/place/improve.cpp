// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "asic/layout/db/model.hpp"
#include "asic/layout/place/place.hpp"

namespace meltstage::layout {

namespace {

struct Slot {
  int row = 0;
  std::size_t index = 0;  ///< in the row
};

class Improver {
 public:
  Improver(Design& design, const Technology& technology)
      : design_(design), technology_(technology), model_(make_model(design, technology, 200)) {
    rows_.resize(design.rows.size());
    const Nm bottom = design.rows.front().at.y;
    height_ = technology.sites[static_cast<std::size_t>(design.rows.front().site)].height;
    low_ = design.rows.front().at.x;
    site_ = technology.sites[static_cast<std::size_t>(design.rows.front().site)].width;
    high_ = low_ + design.rows.front().sites * site_;
    for (std::size_t c = 0; c < design.components.size(); ++c) {
      const int row = static_cast<int>((design.components[c].at.y - bottom) / height_);
      row_of_.push_back(row);
      rows_[static_cast<std::size_t>(row)].push_back(static_cast<int>(c));
    }
    for (auto& row : rows_) std::sort(row.begin(), row.end(), [&](int a, int b) { return x(a) < x(b); });
    seen_.assign(static_cast<std::size_t>(model_.nets()), 0);
  }

  void pass() {
    for (std::size_t c = 0; c < design_.components.size(); ++c) to_best_region(static_cast<int>(c));
    for (std::size_t r = 0; r < rows_.size(); ++r) reorder(static_cast<int>(r));
    for (std::size_t c = 0; c < design_.components.size(); ++c) mirror(static_cast<int>(c));
  }

 private:
  Component& cell(int c) { return design_.components[static_cast<std::size_t>(c)]; }
  const Component& cell(int c) const { return design_.components[static_cast<std::size_t>(c)]; }
  const Macro& macro(int c) const { return technology_.macros[static_cast<std::size_t>(cell(c).macro)]; }
  Nm x(int c) const { return cell(c).at.x; }
  Nm width(int c) const { return macro(c).width + cell(c).padding; }
  std::vector<int>& row(int r) { return rows_[static_cast<std::size_t>(r)]; }

  Point point_of(int p) const {
    const ModelPin& pin = model_.pins[static_cast<std::size_t>(p)];
    if (pin.cell < 0) return {pin.x, pin.y};
    const Rect r = placed({pin.x, pin.y, pin.x, pin.y}, macro(pin.cell), cell(pin.cell));
    return {r.x0, r.y0};
  }

  Nm length_of_net(int n) const {
    Rect box;
    for (int p = model_.net_start[static_cast<std::size_t>(n)];
         p < model_.net_start[static_cast<std::size_t>(n) + 1]; ++p) {
      const Point at = point_of(p);
      if (p == model_.net_start[static_cast<std::size_t>(n)]) box = {at.x, at.y, at.x, at.y};
      box = {std::min(box.x0, at.x), std::min(box.y0, at.y), std::max(box.x1, at.x), std::max(box.y1, at.y)};
    }
    return static_cast<Nm>(model_.weight[static_cast<std::size_t>(n)] *
                           static_cast<double>(box.width() + box.height()));
  }

  /// Length of all nets on these cells, each net once.
  Nm length_around(const int* cells, std::size_t count) {
    ++stamp_;
    Nm sum = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const auto c = static_cast<std::size_t>(cells[k]);
      for (int i = model_.cell_start[c]; i < model_.cell_start[c + 1]; ++i) {
        const int n =
            model_.pins[static_cast<std::size_t>(model_.pin_of_cell[static_cast<std::size_t>(i)])].net;
        if (seen_[static_cast<std::size_t>(n)] == stamp_) continue;
        seen_[static_cast<std::size_t>(n)] = stamp_;
        sum += length_of_net(n);
      }
    }
    return sum;
  }

  std::size_t index_of(int c) {
    const auto& cells = row(row_of_[static_cast<std::size_t>(c)]);
    const auto found =
        std::lower_bound(cells.begin(), cells.end(), x(c), [&](int a, Nm at) { return x(a) < at; });
    return static_cast<std::size_t>(found - cells.begin());
  }

  /// Free room around place `index` of a row when the cell that stands there is taken away.
  std::pair<Nm, Nm> room(int r, std::size_t index) {
    const auto& cells = row(r);
    const Nm from = index == 0 ? low_ : x(cells[index - 1]) + width(cells[index - 1]);
    const Nm to = index + 1 >= cells.size() ? high_ : x(cells[index + 1]);
    return {from, to};
  }

  void put(int c, int r, Nm at) {
    Component& component = cell(c);
    const Row& where = design_.rows[static_cast<std::size_t>(r)];
    const bool is_mirrored =
        component.orientation == Orientation::FN || component.orientation == Orientation::S;
    const bool is_upside_down = where.orientation == Orientation::FS || where.orientation == Orientation::S;
    component.at = {at, where.at.y};
    component.orientation = is_upside_down ? (is_mirrored ? Orientation::S : Orientation::FS)
                                           : (is_mirrored ? Orientation::FN : Orientation::N);
    row_of_[static_cast<std::size_t>(c)] = r;
  }

  /// The box in which the cell's nets are no longer than without it: medians of the nets' other pins.
  bool best_region(int c, Rect& region) {
    xs_.clear();
    ys_.clear();
    for (int i = model_.cell_start[static_cast<std::size_t>(c)];
         i < model_.cell_start[static_cast<std::size_t>(c) + 1]; ++i) {
      const int n =
          model_.pins[static_cast<std::size_t>(model_.pin_of_cell[static_cast<std::size_t>(i)])].net;
      Rect box;
      bool is_first = true;
      for (int p = model_.net_start[static_cast<std::size_t>(n)];
           p < model_.net_start[static_cast<std::size_t>(n) + 1]; ++p) {
        if (model_.pins[static_cast<std::size_t>(p)].cell == c) continue;
        const Point at = point_of(p);
        if (is_first) box = {at.x, at.y, at.x, at.y};
        is_first = false;
        box = {std::min(box.x0, at.x), std::min(box.y0, at.y), std::max(box.x1, at.x),
               std::max(box.y1, at.y)};
      }
      if (is_first) continue;
      xs_.insert(xs_.end(), {box.x0, box.x1});
      ys_.insert(ys_.end(), {box.y0, box.y1});
    }
    if (xs_.empty()) return false;
    const auto medians = [](std::vector<Nm>& values) {
      std::sort(values.begin(), values.end());
      return std::pair(values[values.size() / 2 - 1], values[values.size() / 2]);
    };
    std::tie(region.x0, region.x1) = medians(xs_);
    std::tie(region.y0, region.y1) = medians(ys_);
    return true;
  }

  Nm on_site(Nm at) const { return low_ + (at - low_) / site_ * site_; }

  void to_best_region(int c) {
    Rect region;
    if (!best_region(c, region)) return;
    const Point middle = outline(cell(c), technology_).middle();
    const Point target{std::clamp(middle.x, region.x0, region.x1),
                       std::clamp(middle.y, region.y0, region.y1)};
    if (target == middle) return;
    const Nm bottom = design_.rows.front().at.y;
    const auto last = static_cast<Nm>(rows_.size()) - 1;
    const Nm home = std::clamp<Nm>((target.y - bottom) / height_, 0, last);
    Nm best_gain = 0;
    int best_row = -1;
    std::size_t best_index = 0;
    bool best_is_gap = false;
    Nm best_at = 0;
    for (Nm r = std::max<Nm>(0, home - 2); r <= std::min(last, home + 2); ++r) {
      const auto& cells = row(static_cast<int>(r));
      const auto near =
          std::lower_bound(cells.begin(), cells.end(), target.x, [&](int a, Nm at) { return x(a) < at; });
      const auto middle_index = static_cast<std::size_t>(near - cells.begin());
      const std::size_t from = middle_index < 5 ? 0 : middle_index - 5;
      for (std::size_t k = from; k < std::min(cells.size(), middle_index + 5); ++k) {
        if (cells[k] == c) continue;
        Nm at = 0;
        const Nm swap = gain_of_swap(c, static_cast<int>(r), k);
        if (swap > best_gain)
          best_gain = swap, best_row = static_cast<int>(r), best_index = k, best_is_gap = false;
        const Nm move = gain_of_gap(c, static_cast<int>(r), k, target.x, at);
        if (move > best_gain)
          best_gain = move, best_row = static_cast<int>(r), best_index = k, best_is_gap = true, best_at = at;
      }
    }
    if (best_row < 0) return;
    if (best_is_gap)
      move_to_gap(c, best_row, best_at);
    else
      swap(c, best_row, best_index);
  }

  /// Where two cells come to stand when they change places; false when one doesn't fit.
  bool swapped(int c, int d, int r, std::size_t k, Nm& at_c, Nm& at_d) {
    const std::size_t mine = index_of(c);
    const int my_row = row_of_[static_cast<std::size_t>(c)];
    if (my_row == r && (k == mine + 1 || mine == k + 1)) return false;  // neighbours: reorder() does these
    const auto [from_c, to_c] = room(my_row, mine);
    const auto [from_d, to_d] = room(r, k);
    if (to_c - from_c < width(d) || to_d - from_d < width(c)) return false;
    at_c = std::clamp(on_site(x(d) + width(d) / 2 - width(c) / 2), from_d, to_d - width(c));
    at_d = std::clamp(on_site(x(c) + width(c) / 2 - width(d) / 2), from_c, to_c - width(d));
    return true;
  }

  Nm gain_of_swap(int c, int r, std::size_t k) {
    const int d = row(r)[k];
    Nm at_c = 0, at_d = 0;
    if (!swapped(c, d, r, k, at_c, at_d)) return 0;
    const std::array<int, 2> both{c, d};
    const Nm before = length_around(both.data(), 2);
    const Component old_c = cell(c), old_d = cell(d);
    const int row_c = row_of_[static_cast<std::size_t>(c)];
    put(c, r, at_c);
    put(d, row_c, at_d);
    const Nm after = length_around(both.data(), 2);
    restore(c, old_c, row_c);
    restore(d, old_d, r);
    return before - after;
  }

  void restore(int c, const Component& old, int r) {
    cell(c).at = old.at;
    cell(c).orientation = old.orientation;
    row_of_[static_cast<std::size_t>(c)] = r;
  }

  /// Into the free room behind cell k of the row, as near to the target as it allows.
  Nm gain_of_gap(int c, int r, std::size_t k, Nm target, Nm& at) {
    const auto& cells = row(r);
    const Nm from = x(cells[k]) + width(cells[k]);
    std::size_t behind = k + 1;
    if (behind < cells.size() && cells[behind] == c) ++behind;
    const Nm to = behind < cells.size() ? x(cells[behind]) : high_;
    if (to - from < width(c)) return 0;
    at = std::clamp(on_site(target - width(c) / 2), from, to - width(c));
    const Nm before = length_around(&c, 1);
    const Component old = cell(c);
    const int old_row = row_of_[static_cast<std::size_t>(c)];
    put(c, r, at);
    const Nm after = length_around(&c, 1);
    restore(c, old, old_row);
    return before - after;
  }

  void move_to_gap(int c, int r, Nm at) {
    auto& mine = row(row_of_[static_cast<std::size_t>(c)]);
    mine.erase(mine.begin() + static_cast<std::ptrdiff_t>(index_of(c)));
    put(c, r, at);
    auto& cells = row(r);
    cells.insert(std::lower_bound(cells.begin(), cells.end(), at, [&](int a, Nm v) { return x(a) < v; }), c);
  }

  void swap(int c, int r, std::size_t k) {
    const int d = row(r)[k];
    Nm at_c = 0, at_d = 0;
    if (!swapped(c, d, r, k, at_c, at_d)) return;
    const std::size_t mine = index_of(c);
    const int my_row = row_of_[static_cast<std::size_t>(c)];
    row(r)[k] = c;
    row(my_row)[mine] = d;
    put(c, r, at_c);
    put(d, my_row, at_d);
  }

  /// Each three neighbours in their best order, the gaps between them as they were.
  void reorder(int r) {
    auto& cells = row(r);
    for (std::size_t k = 0; k + 3 <= cells.size(); ++k) {
      std::array<int, 3> old{cells[k], cells[k + 1], cells[k + 2]};
      const std::array<Nm, 3> old_at{x(old[0]), x(old[1]), x(old[2])};
      const Nm gap1 = old_at[1] - old_at[0] - width(old[0]);
      const Nm gap2 = old_at[2] - old_at[1] - width(old[1]);
      std::array<int, 3> order{0, 1, 2};
      std::array<int, 3> best = order;
      Nm least = length_around(old.data(), 3);
      while (std::next_permutation(order.begin(), order.end())) {
        set_three(old, order, old_at[0], gap1, gap2, r);
        const Nm length = length_around(old.data(), 3);
        if (length < least) least = length, best = order;
      }
      set_three(old, best, old_at[0], gap1, gap2, r);
      for (std::size_t j = 0; j < 3; ++j) cells[k + j] = old[static_cast<std::size_t>(best[j])];
    }
  }

  void set_three(const std::array<int, 3>& cells, const std::array<int, 3>& order, Nm start, Nm gap1, Nm gap2,
                 int r) {
    const auto nth = [&](std::size_t j) { return cells[static_cast<std::size_t>(order[j])]; };
    put(nth(0), r, start);
    put(nth(1), r, start + width(nth(0)) + gap1);
    put(nth(2), r, start + width(nth(0)) + gap1 + width(nth(1)) + gap2);
  }

  void mirror(int c) {
    if (!macro(c).symmetric_y) return;
    constexpr std::array<Orientation, 4> kMirrored{Orientation::FN, Orientation::FS, Orientation::N,
                                                   Orientation::S};
    const Nm before = length_around(&c, 1);
    const Orientation old = cell(c).orientation;
    cell(c).orientation = kMirrored[static_cast<std::size_t>(old)];
    if (length_around(&c, 1) >= before) cell(c).orientation = old;
  }

  Design& design_;
  const Technology& technology_;
  Model model_;
  std::vector<std::vector<int>> rows_;
  std::vector<int> row_of_;
  Nm height_ = 0, low_ = 0, high_ = 0, site_ = 1;
  std::vector<int> seen_;
  int stamp_ = 0;
  std::vector<Nm> xs_, ys_;
};

}  // namespace

void improve(Design& design, const Technology& technology, int passes, const Progress& progress) {
  if (design.components.empty()) return;
  Improver improver(design, technology);
  for (int p = 0; p < passes; ++p) {
    tell(progress, "improvement", static_cast<std::size_t>(p), static_cast<std::size_t>(passes));
    improver.pass();
  }
}

}  // namespace meltstage::layout
