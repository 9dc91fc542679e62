// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Sparse>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string_view>

#include "asic/layout/db/model.hpp"
#include "asic/layout/place/place.hpp"
#include "asic/layout/route/guides.hpp"

namespace meltstage::layout {

namespace {

using Vector = Eigen::VectorXd;

/// Positions are middles of cells, in nm.
class GlobalPlacer {
 public:
  GlobalPlacer(Design& design, const Technology& technology, const GlobalPlacement& options)
      : design_(design), technology_(technology), options_(options) {
    for (std::size_t c = 0; c < design.components.size(); ++c) {
      const Rect box = outline(design.components[c], technology);
      width_.push_back(static_cast<double>(box.width()));
      height_.push_back(static_cast<double>(box.height()));
      if (!design.components[c].is_fixed) movable_.push_back(static_cast<int>(c));
    }
    const Row& low = design.rows.front();
    const Site& site = technology.sites[static_cast<std::size_t>(low.site)];
    row_height_ = static_cast<double>(site.height);
    core_ = {static_cast<double>(low.at.x), static_cast<double>(low.at.y),
             static_cast<double>(low.at.x + low.sites * site.width),
             static_cast<double>(design.rows.back().at.y + site.height)};
    variable_.assign(design.components.size(), -1);
    for (std::size_t v = 0; v < movable_.size(); ++v)
      variable_[static_cast<std::size_t>(movable_[v])] = static_cast<int>(v);
    inflation_.assign(design.components.size(), 1.0);
    limit_density();
  }

  void run() {
    spread_pins({});
    start();
    iterate("first placement", 0, options_.iterations / 3);
    std::vector<double> wishes;
    for (const DiePin& pin : design_.pins) wishes.push_back(wish_of(pin));
    spread_pins(wishes);
    start();
    iterate("placement", 0, options_.iterations);
    put_cells();
    for (int round = 0; round < options_.crowding_rounds && make_room(); ++round) {
      iterate(fmt::format("room for wires, round {}", round + 1), options_.iterations / 2,
              options_.iterations);
      put_cells();
    }
    const double site =
        static_cast<double>(technology_.sites[static_cast<std::size_t>(design_.rows.front().site)].width);
    for (const int c : movable_) {
      const auto k = static_cast<std::size_t>(c);
      design_.components[k].padding =
          static_cast<Nm>((inflation_[k] - 1.0) * width_[k] / site) * static_cast<Nm>(site);
    }
  }

 private:
  static constexpr double kFullest = 0.92;  ///< of the rows, with the room given; trees need some, too
  struct Box {
    double x0, y0, x1, y1;
  };
  static Eigen::Index i(std::size_t v) { return static_cast<Eigen::Index>(v); }
  double area_of(int c) const {
    const auto k = static_cast<std::size_t>(c);
    return inflation_[k] * width_[k] * height_[k];
  }
  double area() const {
    double sum = 0.0;
    for (const int c : movable_) sum += area_of(c);
    return sum;
  }
  double room() const { return (core_.x1 - core_.x0) * (core_.y1 - core_.y0); }
  void limit_density() { density_ = std::min(1.0, std::max(options_.density, 1.02 * area() / room())); }

  void put_cells() {
    for (std::size_t v = 0; v < movable_.size(); ++v) {
      const auto c = static_cast<std::size_t>(movable_[v]);
      Component& component = design_.components[c];
      component.at = {std::llround(spread_x_[i(v)] - width_[c] / 2),
                      std::llround(spread_y_[i(v)] - height_[c] / 2)};
      component.is_placed = true;
    }
  }

  /// More room for cells where wires are crowded; false when there is nothing to gain.
  bool make_room() {
    GuideOptions estimate;
    estimate.rounds = 1;
    estimate.usable = options_.usable_tracks;
    estimate.ignored_pins = options_.ignored_pins;
    const Guides guides = route_globally(design_, technology_, estimate);
    const double left = kFullest * room() - area();
    std::vector<double> growth(inflation_.size(), 0.0);
    double wanted = 0.0;
    for (const int c : movable_) {
      const auto k = static_cast<std::size_t>(c);
      const double crowding = guides.crowding[static_cast<std::size_t>(
          guides.grid.region_of(outline(design_.components[k], technology_).middle()))];
      growth[k] = std::clamp(crowding - 1.0, 0.0, 1.0) * inflation_[k];
      wanted += growth[k] * width_[k] * height_[k];
    }
    if (wanted <= 0.0 || left <= 0.0) return false;
    const double share = std::min(1.0, left / wanted);
    for (std::size_t k = 0; k < growth.size(); ++k) inflation_[k] += share * growth[k];
    limit_density();
    return true;
  }

  /// A die pin's best place on the edge, as a share of the way around it: where its net's cells are, seen
  /// from the middle.
  double wish_of(const DiePin& pin) const {
    double x = 0.0, y = 0.0;
    int count = 0;
    for (const PinRef& ref : design_.nets[static_cast<std::size_t>(pin.net)].pins) {
      if (ref.component == kDiePin || variable_[static_cast<std::size_t>(ref.component)] < 0) continue;
      const Eigen::Index v = variable_[static_cast<std::size_t>(ref.component)];
      x += x_[v];
      y += y_[v];
      ++count;
    }
    if (count == 0) return 0.0;
    const double dx = x / count - (core_.x0 + core_.x1) / 2;
    const double dy = y / count - (core_.y0 + core_.y1) / 2;
    // along a square: left edge upwards, top, right edge downwards, bottom
    const double reach = std::max(std::abs(dx), std::abs(dy));
    if (reach == 0.0) return 0.0;
    const double u = dx / reach, w = dy / reach;
    if (u == -1.0) return (w + 1) / 8;
    if (w == 1.0) return 0.25 + (u + 1) / 8;
    if (u == 1.0) return 0.5 + (1 - w) / 8;
    return 0.75 + (1 - u) / 8;
  }

  /// Evenly along the edge on tracks, in the order of the wishes, turned as suits them best; without wishes
  /// in the pins' own order.
  void spread_pins(const std::vector<double>& wishes) {
    std::vector<std::size_t> order(design_.pins.size());
    std::iota(order.begin(), order.end(), 0);
    std::erase_if(order, [&](std::size_t p) { return design_.pins[p].use != Use::signal; });
    const std::size_t n = order.size();
    std::size_t turn = 0;
    if (!wishes.empty()) {
      std::stable_sort(order.begin(), order.end(),
                       [&](std::size_t a, std::size_t b) { return wishes[a] < wishes[b]; });
      double best = 1e300;
      for (std::size_t t = 0; t < n; ++t) {
        double cost = 0.0;
        for (std::size_t k = 0; k < n; ++k) {
          const double away = std::abs(wishes[order[k]] - slot(t + k, n));
          cost += std::min(away, 1.0 - away);
        }
        if (cost < best) best = cost, turn = t;
      }
    }
    for (std::size_t k = 0; k < n; ++k) put_pin(design_.pins[order[k]], slot(turn + k, n));
  }

  static double slot(std::size_t k, std::size_t n) {
    return (static_cast<double>(k % n) + 0.5) / static_cast<double>(n);
  }

  /// On the second or third routing layer, whichever's wires run away from that edge, a square of the wire's
  /// width at the edge.
  void put_pin(DiePin& pin, double share) const {
    const auto side = std::min(3, static_cast<int>(share * 4));
    const double along = share * 4 - side;
    const Axis axis = side % 2 == 0 ? Axis::horizontal : Axis::vertical;
    const Tracks* tracks = nullptr;
    int seen = 0;
    for (const Tracks& t : design_.tracks) {
      if (++seen > 1 && t.axis == axis && tracks == nullptr) tracks = &t;
    }
    if (tracks == nullptr) tracks = &design_.tracks.front();
    const Layer& layer = technology_.layers[static_cast<std::size_t>(tracks->layer)];
    const double lead = side == 0 || side == 1 ? along : 1 - along;
    const Nm length = axis == Axis::horizontal ? design_.die.y1 : design_.die.x1;
    const Nm wanted = std::llround(static_cast<double>(length) * (0.02 + 0.96 * lead));
    const Nm at = tracks->start + (wanted - tracks->start) / tracks->step * tracks->step;
    const Nm half = layer.width / 2;
    // long enough for the least area of a shape
    const Nm deep =
        std::max(layer.width, layer.width == 0 ? 0 : (layer.area_nm2 / layer.width + 9) / 10 * 10);
    pin.is_placed = true;
    pin.shape.layer = tracks->layer;
    if (side == 0) pin.shape.rect = {0, at - half, deep, at + half};
    if (side == 1) pin.shape.rect = {at - half, design_.die.y1 - deep, at + half, design_.die.y1};
    if (side == 2) pin.shape.rect = {design_.die.x1 - deep, at - half, design_.die.x1, at + half};
    if (side == 3) pin.shape.rect = {at - half, 0, at + half, deep};
  }

  void start() {
    model_ = make_model(design_, technology_, options_.ignored_pins);
    const auto n = static_cast<Eigen::Index>(movable_.size());
    x_ = Vector::Constant(n, (core_.x0 + core_.x1) / 2);
    y_ = Vector::Constant(n, (core_.y0 + core_.y1) / 2);
    spread_x_ = x_;
    spread_y_ = y_;
    for (int k = 0; k < 6; ++k) solve(0.0);
  }

  void iterate(std::string_view step, int first, int last) {
    for (int k = first; k < last; ++k) {
      tell(options_.progress, step, static_cast<std::size_t>(k - first),
           static_cast<std::size_t>(last - first));
      spread(k);
      const double upper = length(spread_x_, spread_y_);
      const double lower = length(x_, y_);
      if (k > 10 && upper - lower < 0.03 * upper) break;
      solve(0.01 * (k + 1));
    }
    spread(0);
  }

  double length(const Vector& x, const Vector& y) const {
    double sum = 0.0;
    for (int n = 0; n < model_.nets(); ++n) {
      const auto [a, b] = ends(n, x, true);
      const auto [c, d] = ends(n, y, false);
      sum += at(b, x, true) - at(a, x, true) + at(d, y, false) - at(c, y, false);
    }
    return sum;
  }

  double offset(const ModelPin& pin, bool is_x) const {
    if (pin.cell < 0 || variable_[static_cast<std::size_t>(pin.cell)] < 0) return 0.0;
    // rows turn every other cell upside down: in y the middle stands for all pins
    return is_x ? static_cast<double>(pin.x) - width_[static_cast<std::size_t>(pin.cell)] / 2 : 0.0;
  }
  int variable(const ModelPin& pin) const {
    return pin.cell < 0 ? -1 : variable_[static_cast<std::size_t>(pin.cell)];
  }
  double at(int p, const Vector& position, bool is_x) const {
    const ModelPin& pin = model_.pins[static_cast<std::size_t>(p)];
    const int v = variable(pin);
    if (v >= 0) return position[v] + offset(pin, is_x);
    if (pin.cell < 0) return static_cast<double>(is_x ? pin.x : pin.y);
    const Component& c = design_.components[static_cast<std::size_t>(pin.cell)];
    return static_cast<double>(is_x ? c.at.x + pin.x : c.at.y + pin.y);
  }
  std::pair<int, int> ends(int net, const Vector& position, bool is_x) const {
    int low = model_.net_start[static_cast<std::size_t>(net)];
    int high = low;
    double low_at = at(low, position, is_x), high_at = low_at;
    for (int p = low + 1; p < model_.net_start[static_cast<std::size_t>(net) + 1]; ++p) {
      const double here = at(p, position, is_x);
      if (here < low_at) low = p, low_at = here;
      if (here >= high_at) high = p, high_at = here;
    }
    return {low, high};
  }

  void solve(double pull) {
    solve_axis(x_, spread_x_, pull, true);
    solve_axis(y_, spread_y_, pull, false);
  }

  /// One linear system of the bound-to-bound model at the current positions.
  void solve_axis(Vector& position, const Vector& spread, double pull, bool is_x) {
    const auto n = static_cast<Eigen::Index>(movable_.size());
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(model_.pins.size() * 2);
    Vector diagonal = Vector::Zero(n);
    Vector right = Vector::Zero(n);
    const double least = row_height_ / 4;
    const auto spring = [&](int p, int q, double factor) {
      const ModelPin& a = model_.pins[static_cast<std::size_t>(p)];
      const ModelPin& b = model_.pins[static_cast<std::size_t>(q)];
      const int u = variable(a), v = variable(b);
      if (u == v) return;
      const double weight = factor / std::max(least, std::abs(at(p, position, is_x) - at(q, position, is_x)));
      const double du = offset(a, is_x), dv = offset(b, is_x);
      if (u >= 0) {
        diagonal[u] += weight;
        right[u] += weight * ((v >= 0 ? dv : at(q, position, is_x)) - du);
      }
      if (v >= 0) {
        diagonal[v] += weight;
        right[v] += weight * ((u >= 0 ? du : at(p, position, is_x)) - dv);
      }
      if (u >= 0 && v >= 0) entries.emplace_back(std::max(u, v), std::min(u, v), -weight);
    };
    for (int net = 0; net < model_.nets(); ++net) {
      const int first = model_.net_start[static_cast<std::size_t>(net)];
      const int last = model_.net_start[static_cast<std::size_t>(net) + 1];
      const auto [low, high] = ends(net, position, is_x);
      const double factor = model_.weight[static_cast<std::size_t>(net)] / (last - first - 1);
      if (low != high) spring(low, high, factor);
      for (int p = first; p < last; ++p) {
        if (p == low || p == high) continue;
        spring(p, low, factor);
        spring(p, high, factor);
      }
    }
    const double middle = is_x ? (core_.x0 + core_.x1) / 2 : (core_.y0 + core_.y1) / 2;
    for (Eigen::Index v = 0; v < n; ++v) {
      const double weight = pull > 0 ? pull / std::max(least, std::abs(position[v] - spread[v])) : 1e-9;
      diagonal[v] += weight;
      right[v] += weight * (pull > 0 ? spread[v] : middle);
      entries.emplace_back(static_cast<int>(v), static_cast<int>(v), diagonal[v]);
    }
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower> solver;
    solver.setTolerance(1e-5);
    solver.setMaxIterations(300);
    solver.compute(matrix);
    position = solver.solveWithGuess(right, position);
    const double low = is_x ? core_.x0 : core_.y0;
    const double high = is_x ? core_.x1 : core_.y1;
    position = position.cwiseMax(low).cwiseMin(high);
  }

  /// Copies the positions and moves cells out of crowded regions, halving the core again and again.
  void spread(int round) {
    spread_x_ = x_;
    spread_y_ = y_;
    std::vector<int> cells(movable_.size());
    std::iota(cells.begin(), cells.end(), 0);
    // the first cuts wander from round to round, so that no line stays one that cells can't cross
    wander_ = 0.08 * std::sin(2.4 * round);
    halve(core_, cells.data(), cells.data() + cells.size());
  }

  void halve(Box box, int* first, int* last) {
    const double w = box.x1 - box.x0, h = box.y1 - box.y0;
    if (last - first < 2 || (last - first < 4 && w < 4 * row_height_)) return;
    const bool is_x = w >= h || h < 1.5 * row_height_;
    Vector& position = is_x ? spread_x_ : spread_y_;
    const double low = is_x ? box.x0 : box.y0;
    const double high = is_x ? box.x1 : box.y1;
    double middle = low + (high - low) * (0.5 + (w * h > 400 * row_height_ * row_height_ ? wander_ : 0.0));
    if (!is_x) middle = core_.y0 + std::max(1.0, std::round((middle - core_.y0) / row_height_)) * row_height_;
    if (middle <= low || middle >= high) middle = (low + high) / 2;
    double area = 0.0, area_low = 0.0;
    for (int* c = first; c != last; ++c) {
      position[*c] = std::clamp(position[*c], low, high);
      const double a = area_of(movable_[static_cast<std::size_t>(*c)]);
      area += a;
      if (position[*c] < middle) area_low += a;
    }
    const double share = (middle - low) / (high - low);
    const double fill = std::max(density_, area / (w * h));
    const double room_low = fill * w * h * share;
    const double room_high = fill * w * h * (1 - share);
    int* cut = nullptr;
    double cut_at = middle;
    if (area_low <= room_low && area - area_low <= room_high) {
      cut = std::partition(first, last, [&](int c) { return position[c] < middle; });
    } else {
      const double wanted = area_low > room_low ? room_low : area - room_high;
      cut = split(first, last, position, wanted);
      if (cut != first && cut != last) {
        const double below =
            position[*std::max_element(first, cut, [&](int a, int b) { return position[a] < position[b]; })];
        const double above =
            position[*std::min_element(cut, last, [&](int a, int b) { return position[a] < position[b]; })];
        cut_at = (below + above) / 2;
      } else {
        cut_at = cut == first ? low : high;
      }
      stretch(first, cut, position, low, cut_at, low, middle);
      stretch(cut, last, position, cut_at, high, middle, high);
    }
    Box lower = box, upper = box;
    (is_x ? lower.x1 : lower.y1) = middle;
    (is_x ? upper.x0 : upper.y0) = middle;
    halve(lower, first, cut);
    halve(upper, cut, last);
  }

  /// Parts the cells by position so that the first ones' area is about `wanted`.
  int* split(int* first, int* last, const Vector& position, double wanted) const {
    const auto less = [&](int a, int b) { return std::pair(position[a], a) < std::pair(position[b], b); };
    while (last - first > 1) {
      int* middle = first + (last - first) / 2;
      std::nth_element(first, middle, last, less);
      double area = 0.0;
      for (int* c = first; c != middle; ++c) area += area_of(movable_[static_cast<std::size_t>(*c)]);
      if (area > wanted) {
        last = middle;
      } else {
        wanted -= area;
        first = middle;
      }
    }
    if (first != last && area_of(movable_[static_cast<std::size_t>(*first)]) <= 2 * wanted) ++first;
    return first;
  }

  static void stretch(const int* first, const int* last, Vector& position, double from0, double from1,
                      double to0, double to1) {
    const auto count = static_cast<double>(last - first);
    if (from1 - from0 < 1e-6 * (to1 - to0)) {  // all in one place: side by side in their order
      for (const int* c = first; c != last; ++c)
        position[*c] = to0 + (to1 - to0) * (static_cast<double>(c - first) + 0.5) / count;
      return;
    }
    for (const int* c = first; c != last; ++c)
      position[*c] = to0 + (position[*c] - from0) * (to1 - to0) / (from1 - from0);
  }

  Design& design_;
  const Technology& technology_;
  const GlobalPlacement options_;
  Model model_;
  std::vector<double> width_;
  std::vector<double> height_;
  std::vector<double> inflation_;  ///< room a component is given, over its width
  std::vector<int> movable_;       ///< components
  std::vector<int> variable_;      ///< by component, -1: fixed
  Box core_{};
  double row_height_ = 0.0;
  double density_ = 0.0;
  double wander_ = 0.0;
  Vector x_, y_;                ///< of the quadratic model
  Vector spread_x_, spread_y_;  ///< the same, spread
};

}  // namespace

void place_globally(Design& design, const Technology& technology, const GlobalPlacement& options) {
  if (!design.components.empty()) GlobalPlacer(design, technology, options).run();
}

}  // namespace meltstage::layout
