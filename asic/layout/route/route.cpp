// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/route/route.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <unordered_map>

#include "asic/layout/db/fixed_metal.hpp"
#include "asic/layout/db/paths.hpp"
#include "asic/layout/db/shape_index.hpp"
#include "asic/layout/route/access.hpp"
#include "asic/layout/route/guides.hpp"
#include "asic/layout/route/maze.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::layout {
namespace {

constexpr int kClockViaCost = 600;  // hundredths of a pitch; a via resists as much as 40 um of wire
constexpr int kClockWayBack = 25;   // hundredths
constexpr int kDiodeRounds = 8;
constexpr int kLowestReach =
    40;  // crossings; of a net whose wire on the lowest layer was too long for its gates
constexpr int kRailReach = 24;  // crossings to the side that a tied input may go to its rail

struct RoutedLayer {
  int layer = 0;
  bool vertical = false;
  Nm wire = 0;
  Nm spacing = 0;
  Rect pad;        ///< of any via on a crossing, and what a run of one pitch is lengthened to
  Rect patch;      ///< of a crossing that the net only passes on its way up: least area
  Nm run_end = 0;  ///< from the last crossing to the end of a wire of one pitch with the least area
};

/// What antenna rules ask of nets.
struct NetLimits {
  std::set<int> lifted;        ///< these leave the lowest layer soon
  std::map<int, int> highest;  ///< a net's highest layer of the technology
  bool operator==(const NetLimits&) const = default;
};

std::size_t at(int i) { return static_cast<std::size_t>(i); }

class Wiring {
 public:
  Wiring(Design& design, const Technology& technology) : design_(design), technology_(technology) {
    find_layers();
    find_grid();
    find_vias();
  }
  /// `trees` are the ways of an earlier run, or none, and then those of this one.
  RouteReport run(const RouteOptions& options, const NetLimits& limits, std::vector<MazeTree>& trees);

 private:
  void find_layers();
  void find_grid();
  void find_vias();
  void size_patches();
  const Layer& layer(int index) const { return technology_.layers[at(index)]; }
  int routed_index(int layer) const;
  Point place(int ix, int iy) const { return {grid_.x0 + ix * grid_.pitch_x, grid_.y0 + iy * grid_.pitch_y}; }
  template <typename Visit>
  void nodes_near(const Rect& area, Visit visit) const;
  void claim(int node, int net) {
    std::int32_t& owner = problem_.owner[at(node)];
    if (owner == kFreeNode)
      owner = net;
    else if (owner != net)
      owner = kBlockedNode;
  }
  void obstruct(const Shape& shape);
  void keep_off(AccessCell& cell, const ShapeIndex& fixed) const;
  void add_cells(RouteReport& report);
  void take_access(int net, const Access& access);
  void add_die_pin(int net, int pin_position, const DiePin& pin);
  void add_tied_input(int net, const Access& access);
  void check_terminals(RouteReport& report);
  void keep(const NetLimits& limits);
  void prefer_low_skew();
  void guide();
  void draw(int maze_net, const MazeTree& tree, RouteReport& report);
  void draw_runs(Net& net, const std::vector<int>& nodes, const std::vector<std::pair<int, int>>& along,
                 const std::vector<int>& via_nodes, RouteReport& report);
  void smooth_run(Net& net, const std::vector<int>& run, const std::vector<int>& via_nodes) const;
  void extract(int maze_net, const MazeTree& tree, RouteReport& report) const;

  Design& design_;
  const Technology& technology_;
  std::vector<RoutedLayer> layers_;
  std::vector<int> vias_;  // from routed layer i to i + 1
  int pin_layer_ = 0;
  AccessRules rules_;
  Grid grid_;
  MazeProblem problem_;
  std::vector<int> design_net_;  // of a maze net
  struct Terminal {
    int net;
    int pin_position;  // in Net::pins
    std::vector<int> nodes;
  };
  std::vector<Terminal> terminals_;
  std::vector<char> holds_metal_;  // nodes with a pin's metal of least area: no patch
};

void require_layers(const Technology& technology) {
  const std::size_t metals = technology.routing_layers().size();
  if (metals < 3)
    throw UserError(fmt::format(
        "{}: found {} routing layers, expected three or more: a pin layer and two layers of tracks",
        technology.files, metals));
  if (technology.vias.empty())
    throw UserError(
        fmt::format("{}: found no VIA, expected one between two routing layers at least", technology.files));
}

int Wiring::routed_index(int layer) const {
  for (std::size_t i = 0; i < layers_.size(); ++i)
    if (layers_[i].layer == layer) return static_cast<int>(i);
  return -1;
}

void Wiring::find_layers() {
  pin_layer_ = technology_.routing_layers().front();
  for (const int index : track_layers(technology_)) {
    const Layer& metal = layer(index);
    if (metal.pitch <= 0 || metal.width <= 0)
      throw UserError(fmt::format("{}: found no WIDTH or no PITCH of layer {}, expected both",
                                  technology_.files, metal.name));
    RoutedLayer routed;
    routed.layer = index;
    routed.vertical = metal.direction == Axis::vertical;
    routed.wire = metal.width;
    routed.spacing = metal.spacing;
    layers_.push_back(routed);
  }
  if (!layers_[0].vertical || layers_[1].vertical)
    throw UserError(
        fmt::format("{}: found layers {} and {}, expected the second metal vertical and the third horizontal",
                    technology_.files, layer(layers_[0].layer).name, layer(layers_[1].layer).name));
}

void Wiring::find_grid() {
  const auto tracks = [&](const RoutedLayer& routed, Nm low, Nm high) {
    const Layer& metal = layer(routed.layer);
    const Axis axis = routed.vertical ? Axis::vertical : Axis::horizontal;
    for (const Tracks& t : design_.tracks)
      if (t.layer == routed.layer && t.axis == axis) {
        if (t.step != metal.pitch)
          throw UserError(fmt::format("{}: found tracks {} nm apart on {}, expected LEF's pitch of {} nm",
                                      design_.file, t.step, metal.name, metal.pitch));
        return std::pair{t.start, t.count};
      }
    const Nm first = low + ((metal.offset - low) % metal.pitch + metal.pitch) % metal.pitch;
    return std::pair{first, static_cast<int>((high - first) / metal.pitch) + 1};
  };
  const auto inside = [](std::pair<Nm, int> t, Nm pitch, Nm low, Nm high) {
    while (t.second > 0 && t.first < low) t = {t.first + pitch, t.second - 1};
    while (t.second > 0 && t.first + (t.second - 1) * pitch > high) --t.second;
    return t;
  };
  const Rect& die = design_.die;
  grid_.pitch_x = layer(layers_[0].layer).pitch;
  grid_.pitch_y = layer(layers_[1].layer).pitch;
  const Nm border_x = layers_[0].wire, border_y = layers_[1].wire;
  std::tie(grid_.x0, grid_.columns) =
      inside(tracks(layers_[0], die.x0, die.x1), grid_.pitch_x, die.x0 + border_x, die.x1 - border_x);
  std::tie(grid_.y0, grid_.rows) =
      inside(tracks(layers_[1], die.y0, die.y1), grid_.pitch_y, die.y0 + border_y, die.y1 - border_y);
  if (grid_.columns < 2 || grid_.rows < 2)
    throw UserError(fmt::format(
        "{}: found fewer than two tracks inside DIEAREA, expected a die of some tracks", design_.file));
  constexpr double kMostCrossings = 4e8;
  if (static_cast<double>(grid_.columns) * grid_.rows * static_cast<double>(layers_.size()) > kMostCrossings)
    throw UserError(fmt::format("{}: found {} x {} tracks on {} layers, expected at most {:g} crossings",
                                design_.file, grid_.columns, grid_.rows, layers_.size(), kMostCrossings));
}

void Wiring::find_vias() {
  const auto across = [](const Rect& r, bool vertical) { return vertical ? r.width() : r.height(); };
  for (std::size_t i = 0; i + 1 < layers_.size(); ++i) {
    int best = -1;
    Nm best_size = std::numeric_limits<Nm>::max();
    for (std::size_t v = 0; v < technology_.vias.size(); ++v) {
      const Via& via = technology_.vias[v];
      if (via.shapes.size() != 3 || via.shapes[0].layer != layers_[i].layer ||
          via.shapes[2].layer != layers_[i + 1].layer)
        continue;
      const Rect bottom = via.shapes[0].rect, top = via.shapes[2].rect;
      const Nm size = (across(bottom, layers_[i].vertical) + across(top, layers_[i + 1].vertical)) * 10'000 +
                      bottom.width() + bottom.height() + top.width() + top.height();
      if (size < best_size) {
        best_size = size;
        best = static_cast<int>(v);
      }
    }
    if (best < 0)
      throw UserError(fmt::format("{}: found no via of one cut between {} and {}, expected a VIA ... DEFAULT",
                                  technology_.files, layer(layers_[i].layer).name,
                                  layer(layers_[i + 1].layer).name));
    vias_.push_back(best);
  }
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const Nm half = layers_[i].wire / 2;
    Rect pad{-half, -half, half, half};
    if (i > 0) pad = hull(pad, technology_.vias[at(vias_[i - 1])].shapes[2].rect);
    if (i < vias_.size()) pad = hull(pad, technology_.vias[at(vias_[i])].shapes[0].rect);
    layers_[i].pad = pad;
  }
  rules_ = access_rules(technology_, pin_layer_, layers_[0].layer, layers_[0].pad);
  if (rules_.vias.empty())
    throw UserError(fmt::format("{}: found no via of one cut on the pins' layer, expected a VIA ... DEFAULT",
                                technology_.files));
  size_patches();
  rules_.upper_pad = layers_[0].pad;
  for (const RoutedLayer& r : layers_) {
    const Nm pitch = r.vertical ? grid_.pitch_x : grid_.pitch_y;
    grid_.vertical.push_back(r.vertical);
    const Rect reserve = hull(r.pad, r.patch);
    const Nm along_pitch = r.vertical ? grid_.pitch_y : grid_.pitch_x;
    const Nm low_end = r.vertical ? -reserve.y0 : -reserve.x0,
             high_end = r.vertical ? reserve.y1 : reserve.x1;
    if (low_end + high_end + r.spacing > 2 * along_pitch)
      throw UserError(fmt::format(
          "{}: metal of a via or of the least AREA on {} reaches {} nm along its track, expected at most {}, "
          "two crossings without the spacing",
          technology_.files, shown(layer(r.layer).name), low_end + high_end, 2 * along_pitch - r.spacing));
    const Nm length = r.vertical ? reserve.height() : reserve.width();
    grid_.ends_spread.push_back(length + r.spacing > (r.vertical ? grid_.pitch_y : grid_.pitch_x));
    if (across(r.pad, r.vertical) + r.spacing > pitch)
      throw UserError(
          fmt::format("{}: vias on neighbouring tracks of {} are nearer than its spacing of {} nm, expected "
                      "a wider pitch",
                      technology_.files, layer(r.layer).name, r.spacing));
  }
}

// Least area: of a crossing between two vias, and of the shortest run of wire.
void Wiring::size_patches() {
  const auto up = [&](Nm v) { return (v + technology_.grid - 1) / technology_.grid * technology_.grid; };
  for (RoutedLayer& r : layers_) {
    const Nm area = layer(r.layer).area_nm2;
    const Nm along_pitch = r.vertical ? grid_.pitch_y : grid_.pitch_x;
    const Nm across_pitch = r.vertical ? grid_.pitch_x : grid_.pitch_y;
    const Nm pad_end = r.vertical ? r.pad.y1 : r.pad.x1;
    Nm half_across = r.wire / 2;
    Nm half_along = std::max(pad_end, up((area / r.wire + 1) / 2));
    r.run_end = std::max(pad_end, up((area / r.wire - along_pitch + 1) / 2));
    if (4 * along_pitch / 2 - 2 * half_along < r.spacing) {
      half_across = (across_pitch - r.spacing) / 2 / technology_.grid * technology_.grid;
      if (half_across <= 0)
        throw UserError(fmt::format("{}: found a spacing of {} nm on {}, expected one below its pitch",
                                    technology_.files, r.spacing, layer(r.layer).name));
      half_along = std::max(pad_end, up((area / (2 * half_across) + 1) / 2));
    }
    r.patch = r.vertical ? Rect{-half_across, -half_along, half_across, half_along}
                         : Rect{-half_along, -half_across, half_along, half_across};
    if (r.vertical)
      r.pad = hull(r.pad, {0, -r.run_end, 0, r.run_end});
    else
      r.pad = hull(r.pad, {-r.run_end, 0, r.run_end, 0});
  }
}

template <typename Visit>
void Wiring::nodes_near(const Rect& area, Visit visit) const {
  const auto index = [](Nm v, Nm first, Nm pitch, int count) {
    return static_cast<int>(std::clamp<Nm>((v - first) / pitch, -1, count));
  };
  const int ix0 = std::max(0, index(area.x0, grid_.x0, grid_.pitch_x, grid_.columns)),
            ix1 = std::min(grid_.columns - 1, index(area.x1, grid_.x0, grid_.pitch_x, grid_.columns) + 1);
  const int iy0 = std::max(0, index(area.y0, grid_.y0, grid_.pitch_y, grid_.rows)),
            iy1 = std::min(grid_.rows - 1, index(area.y1, grid_.y0, grid_.pitch_y, grid_.rows) + 1);
  for (int ix = ix0; ix <= ix1; ++ix)
    for (int iy = iy0; iy <= iy1; ++iy) visit(ix, iy);
}

void Wiring::obstruct(const Shape& shape) {
  const int index = routed_index(shape.layer);
  if (index < 0) return;
  const RoutedLayer& r = layers_[at(index)];
  const Nm spacing = layer(shape.layer)
                         .spacing_for(std::min(shape.rect.width(), shape.rect.height()),
                                      std::max(shape.rect.width(), shape.rect.height()));
  const Rect reserve = hull(r.pad, r.patch);
  nodes_near(shape.rect.grown(spacing + std::max(reserve.x1, reserve.y1)), [&](int ix, int iy) {
    if (nearer_than(reserve.moved(place(ix, iy)), shape.rect, spacing))
      problem_.owner[at(grid_.node(index, ix, iy))] = kBlockedNode;
  });
}

// A cell with fixed metal near it has ways of its own to its pins.
void Wiring::keep_off(AccessCell& cell, const ShapeIndex& fixed) const {
  constexpr int kReach = 4;  // pitches that the metal of a pin may reach out of its cell
  const Rect area = cell.outline.grown(kReach * std::max(grid_.pitch_x, grid_.pitch_y));
  fixed.for_each_in({layers_[0].layer, area}, [&](std::size_t i) {
    const Rect& r = fixed[i].rect;
    cell.upper_obstructions.push_back(r);
    cell.kind += fmt::format(" {} {} {} {}", r.x0 - cell.outline.x0, r.y0 - cell.outline.y0,
                             r.x1 - cell.outline.x0, r.y1 - cell.outline.y0);
  });
}

// Nodes near the access' metal: those on its own track are the net's, others nobody's.
void Wiring::take_access(int net, const Access& access) {
  const Rect via_pad = technology_.vias[at(access.via)].shapes[2].rect.moved(access.at);
  std::vector<Rect> metal = access.metal;
  metal.push_back(via_pad);
  metal.push_back(technology_.vias[at(vias_[0])].shapes[0].rect.moved(place(access.ix, access.iy)));
  const RoutedLayer& r = layers_[0];
  const int entry = grid_.node(0, access.ix, access.iy);
  for (const Rect& m : metal)
    nodes_near(m.grown(r.spacing + std::max(r.pad.x1, r.pad.y1)), [&](int ix, int iy) {
      const int node = grid_.node(0, ix, iy);
      if (node == entry) return;
      if (!nearer_than(r.pad.moved(place(ix, iy)), m, r.spacing)) return;
      if (ix == access.ix)
        claim(node, net);
      else
        problem_.owner[at(node)] = kBlockedNode;
    });
}

void Wiring::add_cells(RouteReport& report) {
  // which net a pin of a component is on
  std::vector<std::vector<std::pair<int, int>>> net_of(
      design_.components.size());  // net, position in its pins
  for (std::size_t c = 0; c < design_.components.size(); ++c)
    net_of[c].assign(technology_.macros[at(design_.components[c].macro)].pins.size(), {-1, -1});
  for (std::size_t n = 0; n < design_.nets.size(); ++n)
    for (std::size_t p = 0; p < design_.nets[n].pins.size(); ++p) {
      const PinRef& ref = design_.nets[n].pins[p];
      if (ref.component != kDiePin)
        net_of[at(ref.component)][at(ref.pin)] = {static_cast<int>(n), static_cast<int>(p)};
    }
  const ShapeIndex fixed = fixed_metal_on(layers_[0].layer, design_, technology_);
  std::vector<AccessCell> cells;
  std::vector<int> component_of;
  std::vector<std::vector<int>> pins_of;
  for (std::size_t c = 0; c < design_.components.size(); ++c) {
    const Component& component = design_.components[c];
    const Macro& macro = technology_.macros[at(component.macro)];
    AccessCell cell;
    cell.outline = outline(component, technology_);
    std::vector<int> pins;
    cell.kind = fmt::format("{} {}", macro.name, static_cast<int>(component.orientation));
    for (std::size_t p = 0; p < macro.pins.size(); ++p) {
      const bool wanted = net_of[c][p].first >= 0 && !is_supply(macro.pins[p].use);
      AccessPin access_pin;
      for (const Shape& s : macro.pins[p].shapes) {
        if (s.layer == layers_[0].layer) access_pin.upper_metal.push_back(placed(s.rect, macro, component));
        if (s.layer != pin_layer_) continue;
        if (wanted)
          access_pin.metal.push_back(placed(s.rect, macro, component));
        else
          cell.other_metal.push_back(placed(s.rect, macro, component));
      }
      if (!wanted) continue;
      cell.kind += " " + macro.pins[p].name;
      cell.pins.push_back(std::move(access_pin));
      pins.push_back(static_cast<int>(p));
    }
    if (pins.empty()) continue;
    for (const Shape& s : macro.obstructions) {
      if (s.layer == pin_layer_) cell.other_metal.push_back(placed(s.rect, macro, component));
    }
    keep_off(cell, fixed);
    cells.push_back(std::move(cell));
    component_of.push_back(static_cast<int>(c));
    pins_of.push_back(std::move(pins));
  }
  const auto accesses = choose_access(technology_, rules_, grid_, cells);
  std::vector<std::vector<int>> maze_nets(design_.nets.size());
  std::vector<std::pair<int, Access>> tied;  // their rails are sought when all pins have their metal
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Component& component = design_.components[at(component_of[i])];
    const Macro& macro = technology_.macros[at(component.macro)];
    bool crowded = false;
    for (std::size_t k = 0; k < pins_of[i].size(); ++k) {
      const auto [net, position] = net_of[at(component_of[i])][at(pins_of[i][k])];
      const Access& access = accesses[i][k];
      if (access.via < 0) {
        report.no_access.push_back(component.name + " " + macro.pins[at(pins_of[i][k])].name);
        continue;
      }
      crowded = crowded || access.crowded;
      int maze_net = 0;
      if (is_supply(design_.nets[at(net)].use) || maze_nets[at(net)].empty()) {
        maze_net = static_cast<int>(problem_.nets.size());
        problem_.nets.emplace_back();
        design_net_.push_back(net);
        maze_nets[at(net)].push_back(maze_net);
      } else {
        maze_net = maze_nets[at(net)].front();
      }
      const int node = grid_.node(0, access.ix, access.iy);
      problem_.owner[at(node)] = maze_net;
      take_access(maze_net, access);
      problem_.nets[at(maze_net)].terminals.push_back({node});
      terminals_.push_back({maze_net, position, {node}});
      holds_metal_[at(node)] = 1;
      Net& drawn = design_.nets[at(net)];
      drawn.vias.push_back({access.via, access.at});
      for (const Rect& m : access.metal) drawn.patches.push_back({layers_[0].layer, m});
      if (is_supply(drawn.use)) tied.emplace_back(maze_net, access);
    }
    if (crowded) report.crowded.push_back(component.name);
  }
  for (std::size_t n = 0; n < design_.nets.size(); ++n) {
    for (std::size_t p = 0; p < design_.nets[n].pins.size(); ++p) {
      const PinRef& ref = design_.nets[n].pins[p];
      if (ref.component != kDiePin) continue;
      if (is_supply(design_.nets[n].use)) {
        const DiePin& pin = design_.pins[at(ref.pin)];
        if (pin.use == Use::signal) report.open.push_back(pin.name + " (output at a constant)");
        continue;
      }
      if (maze_nets[n].empty()) {
        maze_nets[n].push_back(static_cast<int>(problem_.nets.size()));
        problem_.nets.emplace_back();
        design_net_.push_back(static_cast<int>(n));
      }
      add_die_pin(maze_nets[n].front(), static_cast<int>(p), design_.pins[at(ref.pin)]);
    }
  }
  for (const auto& [net, access] : tied) add_tied_input(net, access);
}

/// Whether a wire can end in a pin: across the wire, one lies within the other. Else it would hang on the pin
/// by a corner.
bool ends_within(const Rect& wire, const Rect& pin, bool vertical) {
  const auto within = [&](const Rect& a, const Rect& b) {
    return vertical ? a.x0 >= b.x0 && a.x1 <= b.x1 : a.y0 >= b.y0 && a.y1 <= b.y1;
  };
  return within(wire, pin) || within(pin, wire);
}

void Wiring::add_die_pin(int net, int pin_position, const DiePin& pin) {
  const int index = routed_index(pin.shape.layer);
  if (!pin.is_placed || index < 0)
    throw UserError(defect_at(
        design_.file, pin.where,
        fmt::format("pin {} {}", shown(pin.name), pin.is_placed ? "on another layer" : "not placed"),
        "it placed on a layer of tracks"));
  const RoutedLayer& r = layers_[at(index)];
  std::vector<int> nodes;
  int nearest = -1;  // on the pin's track, when the pin ends between the die's edge and the first crossing
  const Rect reserve = hull(r.pad, r.patch);
  const auto wire_at = [&](Point p) {
    return Rect{p.x - r.wire / 2, p.y - r.wire / 2, p.x + r.wire / 2, p.y + r.wire / 2};
  };
  nodes_near(pin.shape.rect.grown(r.spacing + std::max(reserve.x1, reserve.y1)), [&](int ix, int iy) {
    const Point p = place(ix, iy);
    const int node = grid_.node(index, ix, iy);
    const bool on_track = ends_within(wire_at(p), pin.shape.rect, r.vertical);
    const Nm distance = distance_squared(wire_at(p), pin.shape.rect);
    if (on_track && distance == 0) nodes.push_back(node);
    if (on_track &&
        (nearest < 0 || distance < distance_squared(wire_at(grid_.place(nearest)), pin.shape.rect)))
      nearest = node;
    if (nearer_than(reserve.moved(p), pin.shape.rect, r.spacing)) {
      if (on_track)
        claim(node, net);
      else
        problem_.owner[at(node)] = kBlockedNode;
    }
  });
  if (nodes.empty() && nearest >= 0) {
    nodes.push_back(nearest);
    const Rect wire = wire_at(grid_.place(nearest));
    const Rect both = hull(wire, pin.shape.rect);
    design_.nets[at(design_net_[at(net)])].patches.push_back(
        {r.layer,
         r.vertical ? Rect{wire.x0, both.y0, wire.x1, both.y1} : Rect{both.x0, wire.y0, both.x1, wire.y1}});
  }
  if (nodes.empty())
    throw UserError(
        defect_at(design_.file, pin.where,
                  fmt::format("pin {} beside the tracks of {}", shown(pin.name), layer(pin.shape.layer).name),
                  "it on one"));
  for (const int node : nodes) problem_.owner[at(node)] = net;
  terminals_.push_back({net, pin_position, nodes});
  for (const int node : nodes) holds_metal_[at(node)] = 1;
  problem_.nets[at(net)].terminals.push_back(std::move(nodes));
}

// A tied input goes to the supply's rail on the pins' layer: a via in the rail's middle, and metal from there
// to the crossings above and below it, which the net keeps for itself.
void Wiring::add_tied_input(int net, const Access& access) {
  Net& supply = design_.nets[at(design_net_[at(net)])];
  const int via = rules_.vias.front();
  const Rect pad = technology_.vias[at(via)].shapes[0].rect;
  int best_ix = -1, best_far = std::numeric_limits<int>::max();
  Nm best_y = 0;
  std::vector<int> best;
  for (const Shape& strap : supply.straps) {
    if (strap.layer != pin_layer_) continue;
    const Nm y = strap.rect.middle().y;
    const int low = static_cast<int>((y - grid_.y0) / grid_.pitch_y),
              high = (y - grid_.y0) % grid_.pitch_y == 0 ? low : low + 1;
    if (y < grid_.y0 || high >= grid_.rows || std::abs(low - access.iy) > kRailReach) continue;
    for (int ix = std::max(0, access.ix - kRailReach);
         ix <= std::min(grid_.columns - 1, access.ix + kRailReach); ++ix) {
      const int far = std::abs(ix - access.ix) + std::abs(low - access.iy);
      if (far >= best_far || !strap.rect.contains(pad.moved({place(ix, 0).x, y}))) continue;
      std::vector<int> nodes;
      for (int iy = low; iy <= high; ++iy) nodes.push_back(grid_.node(0, ix, iy));
      if (!std::all_of(nodes.begin(), nodes.end(), [&](int node) {
            return problem_.owner[at(node)] == kFreeNode || problem_.owner[at(node)] == net;
          }))
        continue;
      best_ix = ix;
      best_far = far;
      best_y = y;
      best = std::move(nodes);
    }
  }
  if (best.empty()) return;
  for (const int node : best) problem_.owner[at(node)] = net;
  const Point down{place(best_ix, 0).x, best_y};
  supply.vias.push_back({via, down});
  if (best.size() > 1) {
    const Nm half = layers_[0].pad.x1;
    supply.patches.push_back(
        {layers_[0].layer,
         {down.x - half, grid_.place(best.front()).y, down.x + half, grid_.place(best.back()).y}});
  }
  problem_.nets[at(net)].terminals.push_back(std::move(best));
}

void Wiring::check_terminals(RouteReport& report) {
  for (std::size_t n = 0; n < problem_.nets.size(); ++n) {
    const Net& net = design_.nets[at(design_net_[n])];
    for (auto& terminal : problem_.nets[n].terminals) {
      std::erase_if(terminal, [&](int node) {
        const std::int32_t owner = problem_.owner[at(node)];
        return owner != kFreeNode && owner != static_cast<std::int32_t>(n);
      });
      if (terminal.empty()) report.crowded.push_back(net.name);
    }
    std::erase_if(problem_.nets[n].terminals, [](const std::vector<int>& t) { return t.empty(); });
    if (is_supply(net.use) && problem_.nets[n].terminals.size() < 2)
      report.open.push_back(net.name + " (tied input)");
  }
}

// Vias' metal may be a little wider than the wire: between two of them that are near, and beside a pin's
// metal, the wire gets their width, so that no slit is left.
void Wiring::smooth_run(Net& net, const std::vector<int>& run, const std::vector<int>& via_nodes) const {
  const RoutedLayer& r = layers_[at(grid_.crossing(run.front()).layer)];
  const Nm half = r.vertical ? r.pad.x1 : r.pad.y1;
  if (half <= r.wire / 2) return;
  const auto widen = [&](int first, int last) {
    const Point from = grid_.place(first), to = grid_.place(last);
    net.patches.push_back({r.layer, r.vertical ? Rect{from.x - half, from.y, to.x + half, to.y}
                                               : Rect{from.x, from.y - half, to.x, to.y + half}});
  };
  const auto has_via = [&](int node) { return std::binary_search(via_nodes.begin(), via_nodes.end(), node); };
  for (std::size_t i = 0; i < run.size(); ++i) {
    if (holds_metal_[at(run[i])])
      widen(run[i - std::min<std::size_t>(i, 2)], run[std::min(i + 2, run.size() - 1)]);
    else if (i + 1 < run.size() && has_via(run[i]) && has_via(run[i + 1]))
      widen(run[i], run[i + 1]);
  }
}

void Wiring::draw_runs(Net& net, const std::vector<int>& nodes, const std::vector<std::pair<int, int>>& along,
                       const std::vector<int>& via_nodes, RouteReport& report) {
  // nodes sorted: those of one track that are joined stand side by side
  for (std::size_t i = 0; i < nodes.size();) {
    std::size_t last = i;
    bool holds = holds_metal_[at(nodes[i])] != 0;
    while (last + 1 < nodes.size() &&
           std::binary_search(along.begin(), along.end(), std::pair{nodes[last], nodes[last + 1]})) {
      ++last;
      holds = holds || holds_metal_[at(nodes[last])];
    }
    const Grid::Crossing c = grid_.crossing(nodes[i]);
    const RoutedLayer& r = layers_[at(c.layer)];
    const Point from = grid_.place(nodes[i]), to = grid_.place(nodes[last]);
    if (last > i) {
      smooth_run(net,
                 {nodes.begin() + static_cast<std::ptrdiff_t>(i),
                  nodes.begin() + static_cast<std::ptrdiff_t>(last) + 1},
                 via_nodes);
      net.wires.push_back({r.layer, from, to, r.wire});
      const Nm length = (to.x - from.x) + (to.y - from.y);
      report.wire_nm += length;
      report.wire_nm_of_layer[at(r.layer)] += length;
      const Nm half = r.wire / 2;
      if (!holds && (length + 2 * half) * r.wire < layer(r.layer).area_nm2)
        net.patches.push_back(
            {r.layer, r.vertical ? Rect{from.x - half, from.y - r.run_end, to.x + half, to.y + r.run_end}
                                 : Rect{from.x - r.run_end, from.y - half, to.x + r.run_end, to.y + half}});
    } else if (!holds && layer(r.layer).area_nm2 > 0) {
      net.patches.push_back({r.layer, r.patch.moved(from)});
    }
    i = last + 1;
  }
}

void Wiring::draw(int maze_net, const MazeTree& tree, RouteReport& report) {
  Net& net = design_.nets[at(design_net_[at(maze_net)])];
  std::vector<int> nodes;
  std::vector<int> via_nodes;
  std::vector<std::pair<int, int>> along;
  for (const auto& [a, b] : tree) {
    nodes.push_back(a);
    nodes.push_back(b);
    const Grid::Crossing ca = grid_.crossing(a), cb = grid_.crossing(b);
    if (ca.layer == cb.layer) {
      along.emplace_back(std::min(a, b), std::max(a, b));
    } else {
      net.vias.push_back({vias_[at(std::min(ca.layer, cb.layer))], grid_.place(a)});
      ++report.vias;
      via_nodes.push_back(a);
      via_nodes.push_back(b);
    }
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  // two branches that end side by side would leave a slit between them
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    if (nodes[i + 1] != nodes[i] + 1) continue;
    const Grid::Crossing a = grid_.crossing(nodes[i]), b = grid_.crossing(nodes[i + 1]);
    const bool one_track = a.layer == b.layer && (grid_.vertical[at(a.layer)] ? a.ix == b.ix : a.iy == b.iy);
    if (one_track && grid_.ends_spread[at(a.layer)]) along.emplace_back(nodes[i], nodes[i + 1]);
  }
  std::sort(along.begin(), along.end());
  along.erase(std::unique(along.begin(), along.end()), along.end());
  std::sort(via_nodes.begin(), via_nodes.end());
  draw_runs(net, nodes, along, via_nodes, report);
}

void Wiring::extract(int maze_net, const MazeTree& tree, RouteReport& report) const {
  const int design_net = design_net_[at(maze_net)];
  const Net& net = design_.nets[at(design_net)];
  if (is_supply(net.use)) return;
  NetParasitics& parasitics = report.parasitics[at(design_net)];
  std::unordered_map<int, int> index;
  const auto of_node = [&](int node) {
    const auto [entry, is_new] = index.try_emplace(node, static_cast<int>(parasitics.node_pf.size()));
    if (is_new) parasitics.node_pf.push_back(0.0);
    return entry->second;
  };
  constexpr double kUm = 1e-3;
  for (const auto& [a, b] : tree) {
    const Grid::Crossing ca = grid_.crossing(a), cb = grid_.crossing(b);
    const int na = of_node(a), nb = of_node(b);
    if (ca.layer == cb.layer) {
      const RoutedLayer& r = layers_[at(ca.layer)];
      const Layer& metal = layer(r.layer);
      const double length = static_cast<double>(r.vertical ? grid_.pitch_y : grid_.pitch_x) * kUm;
      const double width = static_cast<double>(r.wire) * kUm;
      const double pf = length * (width * metal.area_cap_pf_um2 + 2 * metal.edge_cap_pf_um);
      parasitics.node_pf[at(na)] += pf / 2;
      parasitics.node_pf[at(nb)] += pf / 2;
      parasitics.resistors.push_back({na, nb, metal.resistance_ohm * length / width});
    } else {
      const Via& via = technology_.vias[at(vias_[at(std::min(ca.layer, cb.layer))])];
      const double of_cut_ohm = layer(via.shapes[1].layer).resistance_ohm;
      parasitics.resistors.push_back({na, nb, via.resistance_ohm > 0.0 ? via.resistance_ohm : of_cut_ohm});
    }
  }
  parasitics.node_of_pin.assign(net.pins.size(), -1);
  const auto first = std::lower_bound(terminals_.begin(), terminals_.end(), maze_net,
                                      [](const Terminal& t, int n) { return t.net < n; });
  for (auto t = first; t != terminals_.end() && t->net == maze_net; ++t)
    for (const int node : t->nodes)
      if (const auto found = index.find(node); found != index.end())
        parasitics.node_of_pin[at(t->pin_position)] = found->second;
}

void Wiring::guide() {
  const Guides guides = route_globally(design_, technology_, {});
  MazeRegions& regions = problem_.regions;
  regions.columns = guides.grid.columns;
  regions.rows = guides.grid.rows;
  for (int ix = 0; ix < grid_.columns; ++ix)
    regions.of_column.push_back(guides.grid.column_of(place(ix, 0).x));
  for (int iy = 0; iy < grid_.rows; ++iy)
    regions.of_row.push_back(guides.grid.row_of(place(0, iy).y) * regions.columns);
  for (std::size_t n = 0; n < problem_.nets.size(); ++n)
    problem_.nets[n].regions = guides.regions[at(design_net_[n])];
}

// Skew is what the clock's nets resist: short ways from the driver to each pin, few vias.
void Wiring::prefer_low_skew() {
  for (std::size_t n = 0; n < problem_.nets.size(); ++n) {
    const Net& net = design_.nets[at(design_net_[n])];
    if (net.use != Use::clock) continue;
    problem_.nets[n].via_cost = kClockViaCost;
    problem_.nets[n].way_back = kClockWayBack;
    for (const Terminal& terminal : terminals_) {
      if (terminal.net != static_cast<int>(n) ||
          !is_driver(design_, technology_, net.pins[at(terminal.pin_position)]))
        continue;
      const auto& of = problem_.nets[n].terminals;
      problem_.nets[n].root = static_cast<int>(std::find(of.begin(), of.end(), terminal.nodes) - of.begin());
      if (problem_.nets[n].root == static_cast<int>(of.size())) problem_.nets[n].root = 0;
    }
  }
}

void Wiring::keep(const NetLimits& limits) {
  const std::vector<int> layers = track_layers(technology_);
  for (std::size_t n = 0; n < problem_.nets.size(); ++n) {
    MazeNet& net = problem_.nets[n];
    if (limits.lifted.contains(design_net_[n])) net.lowest_reach = kLowestReach;
    const auto highest = limits.highest.find(design_net_[n]);
    if (highest == limits.highest.end()) continue;
    net.highest = static_cast<int>(std::find(layers.begin(), layers.end(), highest->second) - layers.begin());
    // a pin of the die may be above
    for (const std::vector<int>& terminal : net.terminals)
      net.highest = std::max(
          net.highest, problem_.grid.crossing(*std::min_element(terminal.begin(), terminal.end())).layer);
  }
}

RouteReport Wiring::run(const RouteOptions& options, const NetLimits& limits, std::vector<MazeTree>& trees) {
  RouteReport report;
  report.wire_nm_of_layer.assign(technology_.layers.size(), 0);
  report.parasitics.resize(design_.nets.size());
  for (Net& net : design_.nets) {
    net.wires.clear();
    net.vias.clear();
    net.patches.clear();
  }
  problem_.grid = grid_;
  problem_.owner.assign(at(grid_.nodes()), kFreeNode);
  holds_metal_.assign(at(grid_.nodes()), 0);
  for (const Shape& shape : fixed_shapes(design_, technology_)) obstruct(shape);
  add_cells(report);
  check_terminals(report);
  guide();
  problem_.begun = std::move(trees);
  keep(limits);
  prefer_low_skew();
  MazeResult result = route_maze(problem_, {options.rounds, options.progress});
  report.rounds = result.rounds;
  report.nets = static_cast<int>(problem_.nets.size());
  for (const int net : result.open) report.open.push_back(design_.nets[at(design_net_[at(net)])].name);
  for (const int net : result.conflicting)
    report.conflicting.push_back(design_.nets[at(design_net_[at(net)])].name);
  std::stable_sort(terminals_.begin(), terminals_.end(),
                   [](const Terminal& a, const Terminal& b) { return a.net < b.net; });
  for (std::size_t n = 0; n < result.trees.size(); ++n) draw(static_cast<int>(n), result.trees[n], report);
  for (std::size_t n = 0; n < result.trees.size(); ++n) extract(static_cast<int>(n), result.trees[n], report);
  trees = std::move(result.trees);
  return report;
}

}  // namespace

RouteReport route(Design& design, const Technology& technology, const RouteOptions& options) {
  require_layers(technology);
  const int lowest = track_layers(technology).front();
  std::vector<MazeTree> trees;
  NetLimits limits;
  std::set<int> with_diode;
  int diodes = 0;
  int rounds = 0;
  for (int round = 0;; ++round) {
    RouteReport report = Wiring(design, technology).run(options, limits, trees);
    report.antenna = antenna_faults(design, technology);
    report.diodes = diodes;
    report.rounds += rounds;
    rounds = report.rounds;
    if (round == kDiodeRounds) return report;
    std::vector<AntennaFault> above;
    const NetLimits before = limits;
    for (const AntennaFault& fault : report.antenna) {
      const auto highest = limits.highest.find(fault.net);
      const bool may_be_lower = technology.layers[at(fault.layer)].kind == LayerKind::routing &&
                                (highest == limits.highest.end() || highest->second > fault.layer);
      // A diode hangs on the lowest layer's own metal only by chance: there the wire has to be shorter.
      if (fault.layer <= lowest) limits.lifted.insert(fault.net);
      // The wire of the last diode met the gate's above that layer. Without layers above it the driver is
      // there in time.
      else if (!with_diode.insert(fault.net).second && may_be_lower)
        limits.highest[fault.net] = fault.layer;
      else
        above.push_back(fault);
    }
    const int added = insert_diodes(design, technology, above);
    if (added == 0 && limits == before) return report;
    diodes += added;
  }
}

}  // namespace meltstage::layout
