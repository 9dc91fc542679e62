// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/route/access.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>

namespace meltstage::layout {
namespace {

constexpr std::size_t kCandidatesKept = 16;
constexpr int kChoicesTried = 20'000;

const Rect& shape_on(const Via& via, int layer) {
  return std::find_if(via.shapes.begin(), via.shapes.end(), [&](const Shape& s) { return s.layer == layer; })
      ->rect;
}

/// A candidate with what the others must keep away from.
struct Candidate {
  Access access;
  Rect lower_pad;
  Rect cut;
  std::vector<Rect> upper;  // all metal on the upper layer, with the pad that a via on the crossing will have
  bool inside = false;      // the lower pad adds nothing to the pin's metal
  Nm cost = 0;
};

struct Context {
  const Technology& technology;
  const AccessRules& rules;
  const Grid& grid;
  Nm snapped(Nm v) const {
    return (v >= 0 ? v + rules.grid / 2 : v - rules.grid / 2) / rules.grid * rules.grid;
  }
};

bool covered(const Rect& pad, const std::vector<Rect>& metal) {
  if (std::any_of(metal.begin(), metal.end(), [&](const Rect& r) { return r.contains(pad); })) return true;
  // a pad over the seam of two rectangles: each strip between the rectangles' edges must be covered by one of
  // them
  std::set<Nm> xs{pad.x0, pad.x1}, ys{pad.y0, pad.y1};
  for (const Rect& r : metal) {
    for (const Nm x : {r.x0, r.x1})
      if (x > pad.x0 && x < pad.x1) xs.insert(x);
    for (const Nm y : {r.y0, r.y1})
      if (y > pad.y0 && y < pad.y1) ys.insert(y);
  }
  for (auto x = xs.begin(); std::next(x) != xs.end(); ++x)
    for (auto y = ys.begin(); std::next(y) != ys.end(); ++y) {
      const Rect part{*x, *y, *std::next(x), *std::next(y)};
      if (std::none_of(metal.begin(), metal.end(), [&](const Rect& r) { return r.contains(part); }))
        return false;
    }
  return true;
}

bool touches(const Rect& a, const Rect& b) { return distance_squared(a, b) == 0; }

// Does the pad leave the pin's own metal with a slit that is too narrow?
bool makes_slit(const Rect& pad, const std::vector<Rect>& metal, Nm spacing) {
  return std::any_of(metal.begin(), metal.end(),
                     [&](const Rect& r) { return !touches(pad, r) && nearer_than(pad, r, spacing); });
}

std::vector<Nm> positions(const Context& c, Nm low, Nm high, Nm half_low, Nm half_high, Nm first_track,
                          Nm pitch) {
  std::set<Nm> found;
  const Nm inner_low = low + half_low, inner_high = high - half_high;
  const Nm from = std::min(inner_low, (low + high) / 2 - pitch / 2),
           to = std::max(inner_high, (low + high) / 2 + pitch / 2);
  for (Nm track = first_track + (from - first_track) / pitch * pitch - pitch; track <= to; track += pitch)
    if (track >= from) found.insert(track);
  if (inner_low <= inner_high) {
    found.insert(c.snapped(inner_low + c.rules.grid - 1));
    found.insert(c.snapped(inner_high - c.rules.grid + 1));
  }
  found.insert(c.snapped((low + high) / 2));
  return {found.begin(), found.end()};
}

// Metal from the via to the crossing, long enough for the least area. Extension: up, down or both ways along
// the track, or wider.
std::vector<std::vector<Rect>> upper_shapes(const Context& c, Point via, const Rect& pad, Point crossing) {
  const Nm half = std::max(c.rules.upper_wire / 2, c.rules.upper_pad.x1);
  const Rect jog{std::min(via.x + pad.x0, crossing.x - half), via.y + pad.y0,
                 std::max(via.x + pad.x1, crossing.x + half), via.y + pad.y1};
  const Rect track{crossing.x - half, std::min(via.y + pad.y0, crossing.y + c.rules.upper_pad.y0),
                   crossing.x + half, std::max(via.y + pad.y1, crossing.y + c.rules.upper_pad.y1)};
  const bool straight = via.x == crossing.x;
  const Nm there = straight ? track.width() * track.height()
                            : jog.width() * jog.height() + half * 2 * (track.height() - jog.height());
  const Nm missing = c.rules.upper_area_nm2 - there;
  if (missing <= 0)
    return straight ? std::vector<std::vector<Rect>>{{track}} : std::vector<std::vector<Rect>>{{jog, track}};
  const auto up = [&](Nm v) { return (v + c.rules.grid - 1) / c.rules.grid * c.rules.grid; };
  const Nm longer = up((missing + 2 * half - 1) / (2 * half));
  const Nm each = up((longer + 1) / 2);
  std::vector<std::vector<Rect>> shapes;
  for (const auto& [below, above] :
       {std::pair{each, each}, std::pair{Nm{0}, longer}, std::pair{longer, Nm{0}}}) {
    const Rect stretched{track.x0, track.y0 - below, track.x1, track.y1 + above};
    shapes.push_back(straight ? std::vector<Rect>{stretched} : std::vector<Rect>{jog, stretched});
  }
  const Nm widest = (c.grid.pitch_x - c.rules.upper_spacing) / 2 / c.rules.grid * c.rules.grid - c.rules.grid;
  if (straight && widest > half) {
    const Nm height = std::max(track.height(), up(c.rules.upper_area_nm2 / (2 * widest) + 1));
    const Nm more = up((height - track.height() + 1) / 2);
    shapes.push_back({Rect{crossing.x - widest, track.y0 - more, crossing.x + widest, track.y1 + more}});
  }
  return shapes;
}

std::vector<Candidate> candidates_of(const Context& c, const AccessCell& cell, std::size_t pin) {
  const std::vector<Rect>& metal = cell.pins[pin].metal;
  const Rect room = cell.outline;
  std::vector<Rect> obstructions = cell.upper_obstructions;
  for (const Rect& own : cell.pins[pin].upper_metal) std::erase(obstructions, own);
  std::vector<Candidate> found;
  for (const int via_index : c.rules.vias) {
    const Via& via = c.technology.vias[static_cast<std::size_t>(via_index)];
    const Rect lower = shape_on(via, c.rules.lower), upper = shape_on(via, c.rules.upper);
    const Rect cut = via.shapes[1].rect;
    for (const Rect& r : metal)
      for (const Nm x : positions(c, r.x0, r.x1, -lower.x0, lower.x1, c.grid.x0, c.grid.pitch_x))
        for (const Nm y : positions(c, r.y0, r.y1, -lower.y0, lower.y1, c.grid.y0, c.grid.pitch_y)) {
          const Rect pad = lower.moved({x, y});
          if (!pad.overlaps(r)) continue;
          const bool inside = covered(pad, metal);
          if (!inside) {
            const Nm border = (c.rules.lower_spacing + 1) / 2;
            if (pad.x0 < room.x0 + border || pad.x1 > room.x1 - border || pad.y0 < room.y0 ||
                pad.y1 > room.y1)
              continue;
            if (makes_slit(pad, metal, c.rules.lower_spacing)) continue;
            const auto near = [&](const Rect& o) { return nearer_than(pad, o, c.rules.lower_spacing); };
            if (std::any_of(cell.other_metal.begin(), cell.other_metal.end(), near)) continue;
            bool free = true;
            for (std::size_t other = 0; other < cell.pins.size() && free; ++other)
              free = other == pin ||
                     std::none_of(cell.pins[other].metal.begin(), cell.pins[other].metal.end(), near);
            if (!free) continue;
          }
          const Nm fx = x - c.grid.x0, fy = y - c.grid.y0;
          const auto floored = [](Nm v, Nm p) {
            return static_cast<int>(v >= 0 ? v / p : -((-v + p - 1) / p));
          };
          const int ix0 = floored(fx, c.grid.pitch_x), iy0 = floored(fy, c.grid.pitch_y);
          for (int ix = ix0; ix <= ix0 + (fx % c.grid.pitch_x ? 1 : 0); ++ix)
            for (int iy = iy0; iy <= iy0 + (fy % c.grid.pitch_y ? 1 : 0); ++iy) {
              if (ix < 0 || ix >= c.grid.columns || iy < 0 || iy >= c.grid.rows) continue;
              const Point crossing{c.grid.x0 + ix * c.grid.pitch_x, c.grid.y0 + iy * c.grid.pitch_y};
              for (std::vector<Rect>& shapes : upper_shapes(c, {x, y}, upper, crossing)) {
                Candidate one;
                one.access = {via_index, {x, y}, ix, iy, shapes, false};
                one.lower_pad = pad;
                one.cut = cut.moved({x, y});
                one.upper = std::move(shapes);
                one.upper.push_back(c.rules.upper_pad.moved(crossing));
                one.inside = inside;
                bool free = true;
                Rect all = one.upper.front();
                for (const Rect& u : one.upper) {
                  all = hull(all, u);
                  for (const Rect& o : obstructions) free = free && !nearer_than(u, o, c.rules.upper_spacing);
                }
                if (!free) continue;
                // sideways metal takes the neighbouring track's room, length along the track takes the pin's
                // neighbours'
                const Nm side = std::abs(x - crossing.x);
                one.cost = 4 * side + std::abs(y - crossing.y) + all.height() + (inside ? 0 : 200);
                // over a rail or at the cell's edge there is less room to get away
                one.cost += (crossing.x <= room.x0 || crossing.x >= room.x1) ? 60 : 0;
                found.push_back(std::move(one));
              }
            }
        }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  // at most three of a crossing, so that what is kept differs
  std::map<std::pair<int, int>, int> of_crossing;
  std::vector<Candidate> kept;
  for (Candidate& one : found) {
    if (kept.size() == kCandidatesKept) break;
    if (++of_crossing[{one.access.ix, one.access.iy}] <= 3) kept.push_back(std::move(one));
  }
  return kept;
}

bool conflict(const AccessRules& rules, const Candidate& a, const Candidate& b) {
  for (const Rect& p : a.upper)
    for (const Rect& q : b.upper)
      if (nearer_than(p, q, rules.upper_spacing)) return true;
  if (nearer_than(a.cut, b.cut, rules.cut_spacing)) return true;
  return !(a.inside && b.inside) && nearer_than(a.lower_pad, b.lower_pad, rules.lower_spacing);
}

Candidate moved(Candidate c, Point by, const Grid& grid) {
  c.access.at = {c.access.at.x + by.x, c.access.at.y + by.y};
  c.access.ix += static_cast<int>(by.x / grid.pitch_x);
  c.access.iy += static_cast<int>(by.y / grid.pitch_y);
  for (Rect& r : c.access.metal) r = r.moved(by);
  for (Rect& r : c.upper) r = r.moved(by);
  c.lower_pad = c.lower_pad.moved(by);
  c.cut = c.cut.moved(by);
  return c;
}

/// Chosen candidates by place.
class Chosen {
 public:
  explicit Chosen(const Grid& grid) : grid_(grid) {}
  void add(const Candidate& c) { bins_[key(c.access.ix / kBin, c.access.iy / kBin)].push_back(c); }
  bool conflicts(const AccessRules& rules, const Candidate& c) const {
    for (int bx = (c.access.ix - kReach) / kBin; bx <= (c.access.ix + kReach) / kBin; ++bx)
      for (int by = (c.access.iy - kReach) / kBin; by <= (c.access.iy + kReach) / kBin; ++by) {
        const auto found = bins_.find(key(bx, by));
        if (found == bins_.end()) continue;
        for (const Candidate& o : found->second)
          if (conflict(rules, c, o)) return true;
      }
    return false;
  }

 private:
  static constexpr int kBin = 8, kReach = 4;
  std::int64_t key(int bx, int by) const { return static_cast<std::int64_t>(by) * (grid_.columns + 16) + bx; }
  const Grid& grid_;
  std::unordered_map<std::int64_t, std::vector<Candidate>> bins_;
};

/// Depth first: one candidate a pin, none in conflict with another.
class Chooser {
 public:
  Chooser(const AccessRules& rules, const std::vector<std::vector<Candidate>>& candidates)
      : rules_(rules), candidates_(candidates) {
    for (std::size_t i = 0; i < candidates.size(); ++i) order_.push_back(i);
    std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return candidates[a].size() < candidates[b].size();
    });
    picks_.assign(candidates.size(), 0);
  }
  bool run() { return descend(0); }
  const std::vector<std::size_t>& picks() const { return picks_; }

 private:
  bool descend(std::size_t depth) {
    if (depth == order_.size()) return true;
    const std::size_t pin = order_[depth];
    for (std::size_t k = 0; k < candidates_[pin].size(); ++k) {
      if (++tried_ > kChoicesTried) return false;
      bool free = true;
      for (std::size_t d = 0; d < depth && free; ++d)
        free = !conflict(rules_, candidates_[pin][k], candidates_[order_[d]][picks_[order_[d]]]);
      picks_[pin] = k;
      if (free && descend(depth + 1)) return true;
    }
    return false;
  }
  const AccessRules& rules_;
  const std::vector<std::vector<Candidate>>& candidates_;
  std::vector<std::size_t> order_;
  std::vector<std::size_t> picks_;
  int tried_ = 0;
};

}  // namespace

AccessRules access_rules(const Technology& technology, int lower, int upper, const Rect& upper_pad) {
  AccessRules rules;
  rules.lower = lower;
  rules.upper = upper;
  rules.upper_pad = upper_pad;
  const Layer& low = technology.layers[static_cast<std::size_t>(lower)];
  const Layer& up = technology.layers[static_cast<std::size_t>(upper)];
  rules.upper_wire = up.width;
  rules.upper_spacing = up.spacing;
  rules.upper_area_nm2 = up.area_nm2;
  rules.lower_spacing = low.spacing;
  rules.grid = technology.grid;
  Nm narrowest = std::numeric_limits<Nm>::max();
  const auto single = [&](const Via& via) {
    return via.shapes.size() == 3 && via.shapes[0].layer == lower && via.shapes[2].layer == upper;
  };
  for (const Via& via : technology.vias)
    if (single(via))
      narrowest = std::min(narrowest, via.shapes[2].rect.width() * 1000 + via.shapes[2].rect.height());
  for (std::size_t i = 0; i < technology.vias.size(); ++i) {
    const Via& via = technology.vias[i];
    if (!single(via) || via.shapes[2].rect.width() * 1000 + via.shapes[2].rect.height() != narrowest)
      continue;
    rules.vias.push_back(static_cast<int>(i));
    rules.cut_spacing = technology.layers[static_cast<std::size_t>(via.shapes[1].layer)].spacing;
  }
  return rules;
}

std::vector<std::vector<Access>> choose_access(const Technology& technology, const AccessRules& rules,
                                               const Grid& grid, const std::vector<AccessCell>& cells) {
  const Context context{technology, rules, grid};
  struct Known {
    Point corner;
    std::vector<std::vector<Candidate>> candidates;
  };
  std::map<std::tuple<std::string, Nm, Nm>, Known> known;
  Chosen chosen(grid);
  std::vector<std::vector<Access>> result;
  for (const AccessCell& cell : cells) {
    const Point corner{cell.outline.x0, cell.outline.y0};
    const auto phase = [](Nm v, Nm pitch) { return (v % pitch + pitch) % pitch; };
    auto [place, is_new] = known.try_emplace(
        {cell.kind, phase(corner.x - grid.x0, grid.pitch_x), phase(corner.y - grid.y0, grid.pitch_y)});
    if (is_new) {
      place->second.corner = corner;
      for (std::size_t pin = 0; pin < cell.pins.size(); ++pin)
        place->second.candidates.push_back(candidates_of(context, cell, pin));
    }
    const Point by{corner.x - place->second.corner.x, corner.y - place->second.corner.y};
    std::vector<std::vector<Candidate>> free(cell.pins.size());
    std::vector<std::vector<Candidate>> all(cell.pins.size());
    bool crowded = false;
    for (std::size_t pin = 0; pin < cell.pins.size(); ++pin) {
      for (const Candidate& c : place->second.candidates[pin]) {
        all[pin].push_back(moved(c, by, grid));
        const Access& a = all[pin].back().access;
        if (a.ix < 0 || a.ix >= grid.columns || a.iy < 0 || a.iy >= grid.rows) {
          all[pin].pop_back();
          continue;
        }
        if (!chosen.conflicts(rules, all[pin].back())) free[pin].push_back(all[pin].back());
      }
      crowded = crowded || free[pin].empty();
    }
    Chooser chooser(rules, free);
    crowded = crowded || !chooser.run();
    std::vector<Access> accesses;
    for (std::size_t pin = 0; pin < cell.pins.size(); ++pin) {
      const std::vector<Candidate>& of = crowded ? all[pin] : free[pin];
      if (of.empty()) {
        accesses.emplace_back();
        continue;
      }
      const Candidate& pick = of[crowded ? 0 : chooser.picks()[pin]];
      chosen.add(pick);
      accesses.push_back(pick.access);
      accesses.back().crowded = crowded;
    }
    result.push_back(std::move(accesses));
  }
  return result;
}

}  // namespace meltstage::layout
