// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/trees.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <unordered_map>

#include "asic/layout/error.hpp"
#include "asic/layout/model.hpp"
#include "asic/layout/paths.hpp"

namespace meltstage::layout {

namespace {

/// A pin that a tree must reach.
struct Sink {
  PinRef pin;
  Point at;
  double load_pf = 0.0;
  double latency_ns = 0.0;  ///< from this pin to the last flop behind it
};

struct Buffer {
  int macro = 0;
  int in = 0;
  int out = 0;
  double load_pf = 0.0;
  double most_load_pf = std::numeric_limits<double>::max();  ///< what it may drive
  const DelayArc* arc = nullptr;
};

constexpr double kCatchUpNs = 0.08;  // less than what a buffer of the tree takes
constexpr double kExtraBufferNs = 0.09;  // what one with little behind it takes
constexpr int kExtraBuffers = 3;         // in a row, at most

double um(Nm nm) { return static_cast<double>(nm) / 1000.0; }
double distance_um(Point a, Point b) { return um(std::abs(a.x - b.x) + std::abs(a.y - b.y)); }

class TreeBuilder {
 public:
  TreeBuilder(Design& design, const Technology& technology, const Delays& delays, const TreeOptions& options,
              std::string kind)
      : design_(design),
        technology_(technology),
        delays_(delays),
        options_(options),
        kind_(std::move(kind)),
        wire_(wire_model(technology)) {
    for (const std::string& name : options.buffers) buffers_.push_back(buffer(name));
    if (buffers_.empty()) throw InputError("trees: found no buffer, expected the names of the library's");
  }

  int made() const { return made_; }

  Sink sink(PinRef ref, double latency_ns) const {
    const Component& component = design_.components[static_cast<std::size_t>(ref.component)];
    const Macro& macro = technology_.macros[static_cast<std::size_t>(component.macro)];
    const MacroPin& pin = macro.pins[static_cast<std::size_t>(ref.pin)];
    const Point middle = middle_of(pin);
    return {ref, placed({middle.x, middle.y, middle.x, middle.y}, macro, component).middle(),
            load_of(macro.name, pin.name), latency_ns};
  }

  double load_of(const std::string& cell, const std::string& pin) const {
    const auto found = delays_.find(cell);
    if (found == delays_.end()) return 0.0;
    const auto entry = found->second.pins.find(pin);
    return entry == found->second.pins.end() ? 0.0 : entry->second.capacitance_pf;
  }

  /// Groups of near sinks that one buffer can drive, by halving again and again across the longer side.
  std::vector<std::vector<Sink>> clusters(std::vector<Sink> sinks) const {
    std::vector<std::vector<Sink>> done;
    std::vector<std::vector<Sink>> open;
    open.push_back(std::move(sinks));
    while (!open.empty()) {
      std::vector<Sink> group = std::move(open.back());
      open.pop_back();
      if (group.size() <= options_.leaf_sinks && load_pf(group) <= options_.leaf_load_pf) {
        if (!group.empty()) done.push_back(std::move(group));
        continue;
      }
      if (group.size() == 1) {
        done.push_back(std::move(group));
        continue;
      }
      const Rect box = box_of(group);
      const bool is_x = box.width() >= box.height();
      std::sort(group.begin(), group.end(), [&](const Sink& a, const Sink& b) {
        return is_x ? std::pair(a.at.x, a.at.y) < std::pair(b.at.x, b.at.y)
                    : std::pair(a.at.y, a.at.x) < std::pair(b.at.y, b.at.x);
      });
      // as many parts as needed, each half an equal share of them
      const double parts = std::max(
          {2.0, std::ceil(static_cast<double>(group.size()) / static_cast<double>(options_.leaf_sinks)),
           std::ceil(load_pf(group) / options_.leaf_load_pf)});
      const auto cut = std::max<std::size_t>(
          1, static_cast<std::size_t>(static_cast<double>(group.size()) * std::floor(parts / 2) / parts));
      open.emplace_back(group.begin(), group.begin() + static_cast<std::ptrdiff_t>(cut));
      open.emplace_back(group.begin() + static_cast<std::ptrdiff_t>(cut), group.end());
    }
    return done;
  }

  /// A buffer for each cluster; `net` then drives the buffers. The sinks must be off the net already. All
  /// buffers aim at the latency `target`, or without one at what the slowest cluster reaches with its best
  /// buffer.
  std::vector<Sink> buffer_level(const std::vector<Sink>& sinks, int net) {
    std::vector<std::vector<Sink>> groups;
    for (auto& alike : by_latency(sinks)) {
      for (auto& group : clusters(std::move(alike))) groups.push_back(std::move(group));
    }
    std::vector<Sink> level;
    for (const auto& group : groups) {
      const Buffer* chosen = &buffers_.front();
      for (const Buffer& b : buffers_) {
        if (delay(b, group) < delay(*chosen, group)) chosen = &b;
      }
      level.push_back(insert(*chosen, group, net));
    }
    return level;
  }

  void insert_weakest(const Sink& sink, int net) { insert(buffers_.front(), {sink}, net); }

  /// The smallest buffer whose edges are at most `most_slew_ns` slow behind the group's load, or else the one with the fastest.
  const Buffer& smallest_for(const std::vector<Sink>& group, double most_slew_ns) const {
    const double load = load_pf(group);
    const auto fast_enough = std::find_if(buffers_.begin(), buffers_.end(), [&](const Buffer& b) { return slew_ns(b, load) <= most_slew_ns; });
    if (fast_enough != buffers_.end()) return *fast_enough;
    return *std::min_element(buffers_.begin(), buffers_.end(), [&](const Buffer& a, const Buffer& b) { return slew_ns(a, load) < slew_ns(b, load); });
  }

  /// The most that one of the buffers charges with edges of at most `most_slew_ns`.
  double most_load_pf(double most_slew_ns) const {
    constexpr double kStepPf = 0.01;
    double load = kStepPf;
    const auto one_can = [&](double pf) {
      return std::any_of(buffers_.begin(), buffers_.end(), [&](const Buffer& b) { return pf <= b.most_load_pf && slew_ns(b, pf) <= most_slew_ns; });
    };
    while (one_can(load + kStepPf)) load += kStepPf;
    return load;
  }

  Sink insert(const Buffer& b, const std::vector<Sink>& group, int net) {
    const Macro& macro = technology_.macros[static_cast<std::size_t>(b.macro)];
    Point middle = centre(group);
    const int component = static_cast<int>(design_.components.size());
    const Rect core = core_box();
    const Point at{std::clamp(middle.x - macro.width / 2, core.x0, core.x1 - macro.width),
                   std::clamp(middle.y - macro.height / 2, core.y0, core.y1 - macro.height)};
    design_.components.push_back(
        {fmt::format("{}_{}", kind_, made_), b.macro, at, Orientation::N, true, false});
    Net driven;
    // a name as Yosys makes them up: the proof of equivalence looks at no such net
    driven.name = fmt::format("_{}_{}", made_, kind_);
    ++made_;
    driven.pins.push_back({component, b.out});
    for (const Sink& s : group) driven.pins.push_back(s.pin);
    design_.nets[static_cast<std::size_t>(net)].pins.push_back({component, b.in});
    design_.nets.push_back(std::move(driven));
    return {{component, b.in}, {at.x + macro.width / 2, at.y + macro.height / 2}, b.load_pf, delay(b, group)};
  }

  /// From the buffer's input to the last flop behind the group.
  double delay(const Buffer& b, const std::vector<Sink>& group) const {
    const Point middle = centre(group);
    double last = 0.0;
    for (const Sink& s : group)
      last = std::max(last, s.latency_ns + wire_ns(distance_um(middle, s.at), s.load_pf));
    return b.arc->delay.at(kTypicalSlewNs, load_pf(group)) + last;
  }

  double load_pf(const std::vector<Sink>& group) const {
    double load = 0.0;
    for (const Sink& s : group) load += s.load_pf;
    return load + wire_.pf_per_um * tree_um(group);
  }

  /// Elmore: half of the wire's own capacitance and all of the pin's behind its resistance.
  double wire_ns(double length_um, double pin_pf) const {
    return 1e-3 * wire_.ohm_per_um * length_um * (wire_.pf_per_um * length_um / 2 + pin_pf);
  }

  /// Length of a spanning tree of few points: that of a grid of them, at least half of the box' edge.
  static double tree_um(const std::vector<Sink>& group) {
    const Rect box = box_of(group);
    const double half = um(box.width() + box.height());
    const double area = um(box.width()) * um(box.height());
    return std::max(half, 0.7 * std::sqrt(area * static_cast<double>(group.size())));
  }

  static Rect box_of(const std::vector<Sink>& group) {
    Rect box{group.front().at.x, group.front().at.y, group.front().at.x, group.front().at.y};
    for (const Sink& s : group)
      box = {std::min(box.x0, s.at.x), std::min(box.y0, s.at.y), std::max(box.x1, s.at.x),
             std::max(box.y1, s.at.y)};
    return box;
  }
  static Point centre(const std::vector<Sink>& group) {
    Point sum;
    for (const Sink& s : group) sum = {sum.x + s.at.x, sum.y + s.at.y};
    const auto count = static_cast<Nm>(group.size());
    return {sum.x / count, sum.y / count};
  }

 private:
  static constexpr double kTypicalSlewNs = 0.08;
  static constexpr double kAlikeNs = 0.05;

  static double slew_ns(const Buffer& b, double load_pf) { return b.arc->slowest_slew_ns(kTypicalSlewNs, load_pf); }

  Buffer buffer(const std::string& name) const {
    Buffer b;
    b.macro = technology_.find_macro(name);
    const auto cell = delays_.find(name);
    if (b.macro < 0 || cell == delays_.end())
      throw InputError(fmt::format("trees: found buffer {}, expected one of the LEF and of Liberty", name));
    const Macro& macro = technology_.macros[static_cast<std::size_t>(b.macro)];
    for (std::size_t p = 0; p < macro.pins.size(); ++p) {
      const auto pin = cell->second.pins.find(macro.pins[p].name);
      if (pin == cell->second.pins.end()) continue;
      if (macro.pins[p].direction == PinDirection::output && !pin->second.arcs.empty()) {
        b.out = static_cast<int>(p);
        b.arc = &pin->second.arcs.front();
        if (pin->second.max_capacitance_pf > 0) b.most_load_pf = pin->second.max_capacitance_pf;
      } else if (macro.pins[p].direction == PinDirection::input) {
        b.in = static_cast<int>(p);
        b.load_pf = pin->second.capacitance_pf;
      }
    }
    if (b.arc == nullptr)
      throw InputError(fmt::format("trees: found no delay of {} in Liberty, expected a buffer", name));
    return b;
  }

  /// Sinks that may share a buffer: latencies within a band.
  static std::vector<std::vector<Sink>> by_latency(std::vector<Sink> sinks) {
    std::sort(sinks.begin(), sinks.end(),
              [](const Sink& a, const Sink& b) { return a.latency_ns < b.latency_ns; });
    std::vector<std::vector<Sink>> bands;
    for (const Sink& s : sinks) {
      if (bands.empty() || s.latency_ns > bands.back().front().latency_ns + kAlikeNs) bands.emplace_back();
      bands.back().push_back(s);
    }
    return bands;
  }

  Rect core_box() const {
    const Row& low = design_.rows.front();
    const Site& site = technology_.sites[static_cast<std::size_t>(low.site)];
    return {low.at.x, low.at.y, low.at.x + low.sites * site.width, design_.rows.back().at.y + site.height};
  }

  Design& design_;
  const Technology& technology_;
  const Delays& delays_;
  const TreeOptions& options_;
  const std::string kind_;
  const WireModel wire_;
  std::vector<Buffer> buffers_;
  int made_ = 0;
};

int net_of_port(const Design& design, const std::string& port) {
  for (const DiePin& pin : design.pins) {
    if (pin.name == port) return pin.net;
  }
  throw InputError(fmt::format("clock: found port {}, expected one of the netlist", port));
}

/// By component: the net that its outputs drive (the last one), -1: none.
std::vector<int> driven_nets(const Design& design, const Technology& technology) {
  std::vector<int> nets(design.components.size(), -1);
  for (std::size_t n = 0; n < design.nets.size(); ++n) {
    for (const PinRef& ref : design.nets[n].pins) {
      if (ref.component != kDiePin && pin_direction(design, technology, ref) == PinDirection::output)
        nets[static_cast<std::size_t>(ref.component)] = static_cast<int>(n);
    }
  }
  return nets;
}

/// Takes the cells' inputs off a net.
std::vector<PinRef> take_sinks(Design& design, const Technology& technology, int net) {
  std::vector<PinRef> sinks;
  auto& pins = design.nets[static_cast<std::size_t>(net)].pins;
  const auto is_sink = [&](const PinRef& ref) {
    return ref.component != kDiePin && !is_driver(design, technology, ref);
  };
  std::copy_if(pins.begin(), pins.end(), std::back_inserter(sinks), is_sink);
  std::erase_if(pins, is_sink);
  return sinks;
}

Point place_of(const Design& design, const Technology& technology, const PinRef& ref) {
  if (ref.component == kDiePin) return design.pins[static_cast<std::size_t>(ref.pin)].shape.rect.middle();
  const Component& c = design.components[static_cast<std::size_t>(ref.component)];
  const Macro& macro = technology.macros[static_cast<std::size_t>(c.macro)];
  const Point middle = middle_of(macro.pins[static_cast<std::size_t>(ref.pin)]);
  return placed({middle.x, middle.y, middle.x, middle.y}, macro, c).middle();
}

double pin_load_pf(const Design& design, const Technology& technology, const Delays& delays, const PinRef& ref) {
  const DelayCell* cell = ref.component == kDiePin ? nullptr : delay_cell_of(design, technology, delays, ref.component);
  if (cell == nullptr) return 0.0;
  const Macro& macro = technology.macros[static_cast<std::size_t>(
      design.components[static_cast<std::size_t>(ref.component)].macro)];
  const auto pin = cell->pins.find(macro.pins[static_cast<std::size_t>(ref.pin)].name);
  return pin == cell->pins.end() ? 0.0 : pin->second.capacitance_pf;
}

/// A net of the clock as the edge passes it.
struct ClockStage {
  int driver = kDiePin;  ///< component
  int in_net = -1;       ///< net at the driver's input
  int net = -1;
  int depth = 0;       ///< buffers and gates before it
  double in_ns = 0.0;  ///< edge at the driver's input
  double in_slew_ns = 0.0;
  double out_ns = 0.0;  ///< edge at the driver's output
  double load_pf = 0.0;
  bool is_leaf = true;           ///< nothing but flops behind it
  std::vector<double> sinks_ns;  ///< edge at each flop on this net
};

class ClockWalk {
 public:
  ClockWalk(const Design& design, const Technology& technology, const Delays& delays)
      : design_(design),
        technology_(technology),
        delays_(delays),
        wire_(wire_model(technology)),
        driven_(driven_nets(design, technology)) {}

  /// Calls `see` once for each net, from the port on.
  void visit(int root, const std::function<void(const ClockStage&)>& see) const {
    ClockStage stage;
    stage.net = root;
    stage.in_slew_ns = 0.05;
    pass(stage, 0.05, see);
  }

 private:
  /// The way through a buffer or gate, nullptr for a flop.
  const DelayArc* arc_of(int component) const {
    const DelayCell* cell = delay_cell_of(design_, technology_, delays_, component);
    if (cell == nullptr || cell->is_flop || driven_[static_cast<std::size_t>(component)] < 0) return nullptr;
    for (const auto& [name, pin] : cell->pins) {
      if (!pin.arcs.empty()) return &pin.arcs.front();
    }
    return nullptr;
  }

  void pass(ClockStage& stage, double slew_ns, const std::function<void(const ClockStage&)>& see) const {
    const Net& net = design_.nets[static_cast<std::size_t>(stage.net)];
    Point from;
    for (const PinRef& ref : net.pins) {
      if (is_driver(design_, technology_, ref)) from = place_of(design_, technology_, ref);
    }
    for (const PinRef& ref : net.pins) {
      if (ref.component == kDiePin || is_driver(design_, technology_, ref)) continue;
      const double length = distance_um(from, place_of(design_, technology_, ref));
      const double here =
          stage.out_ns + 1e-3 * wire_.ohm_per_um * length * (wire_.pf_per_um * length / 2 + pin_load_pf(design_, technology_, delays_, ref));
      const DelayArc* arc = arc_of(ref.component);
      if (arc == nullptr) {
        stage.sinks_ns.push_back(here);
        continue;
      }
      stage.is_leaf = false;
      ClockStage next;
      next.driver = ref.component;
      next.in_net = stage.net;
      next.net = driven_[static_cast<std::size_t>(ref.component)];
      next.depth = stage.depth + 1;
      next.in_ns = here;
      next.in_slew_ns = slew_ns;
      next.load_pf = expected_load_pf(design_, technology_, delays_, design_.nets[static_cast<std::size_t>(next.net)]);
      next.out_ns = here + arc->delay.at(slew_ns, next.load_pf);
      pass(next, arc->slew.at(slew_ns, next.load_pf), see);
    }
    see(stage);
  }

  const Design& design_;
  const Technology& technology_;
  const Delays& delays_;
  const WireModel wire_;
  const std::vector<int> driven_;
};

void change_macro(Design& design, const Technology& technology, int component, int macro,
                  const std::vector<int>& nets) {
  const auto& old =
      technology
          .macros[static_cast<std::size_t>(design.components[static_cast<std::size_t>(component)].macro)];
  const Macro& now = technology.macros[static_cast<std::size_t>(macro)];
  for (const int n : nets) {
    for (PinRef& ref : design.nets[static_cast<std::size_t>(n)].pins) {
      if (ref.component == component)
        ref.pin = now.find_pin(old.pins[static_cast<std::size_t>(ref.pin)].name);
    }
  }
  design.components[static_cast<std::size_t>(component)].macro = macro;
}

/// Takes for each buffer that drives flops alone the slowest size that isn't later than the last flop is with
/// the fastest sizes.
void even_out(Design& design, const Technology& technology, const Delays& delays, int root,
              const std::vector<int>& buffers) {
  std::vector<ClockStage> leaves;
  double last = 0.0;
  const auto arrival = [&](const ClockStage& leaf, int macro) {
    const double wire = *std::max_element(leaf.sinks_ns.begin(), leaf.sinks_ns.end()) - leaf.out_ns;
    for (const auto& [name, pin] :
         delays.find(technology.macros[static_cast<std::size_t>(macro)].name)->second.pins) {
      if (!pin.arcs.empty())
        return leaf.in_ns + pin.arcs.front().delay.at(leaf.in_slew_ns, leaf.load_pf) + wire;
    }
    return 0.0;
  };
  ClockWalk(design, technology, delays).visit(root, [&](const ClockStage& stage) {
    if (stage.sinks_ns.empty()) return;
    const bool is_buffer = stage.driver != kDiePin &&
                           std::count(buffers.begin(), buffers.end(),
                                      design.components[static_cast<std::size_t>(stage.driver)].macro) > 0;
    double soonest = *std::max_element(stage.sinks_ns.begin(), stage.sinks_ns.end());
    if (stage.is_leaf && is_buffer) {
      leaves.push_back(stage);
      for (const int b : buffers) soonest = std::min(soonest, arrival(stage, b));
    }
    last = std::max(last, soonest);
  });
  for (const ClockStage& leaf : leaves) {
    int best = buffers.back();
    for (const int b : buffers) {
      const bool is_late = arrival(leaf, b) > last;
      const bool best_is_late = arrival(leaf, best) > last;
      if (best_is_late ? arrival(leaf, b) < arrival(leaf, best)
                       : !is_late && arrival(leaf, b) > arrival(leaf, best))
        best = b;
    }
    change_macro(design, technology, leaf.driver, best, {leaf.in_net, leaf.net});
  }
}

/// One more buffer before each buffer of flops that is early by more than such a buffer takes. Returns how many.
int delay_early_leaves(Design& design, const Technology& technology, const Delays& delays, int root, TreeBuilder& builder) {
  std::vector<ClockStage> leaves;
  double last = 0.0;
  ClockWalk(design, technology, delays).visit(root, [&](const ClockStage& stage) {
    if (stage.sinks_ns.empty()) return;
    last = std::max(last, *std::max_element(stage.sinks_ns.begin(), stage.sinks_ns.end()));
    if (stage.is_leaf && stage.driver != kDiePin) leaves.push_back(stage);
  });
  int added = 0;
  for (const ClockStage& leaf : leaves) {
    if (*std::max_element(leaf.sinks_ns.begin(), leaf.sinks_ns.end()) > last - kExtraBufferNs) continue;
    auto& before = design.nets[static_cast<std::size_t>(leaf.in_net)].pins;
    const auto pin = std::find_if(before.begin(), before.end(), [&](const PinRef& ref) { return ref.component == leaf.driver; });
    const DelayCell* cell = delay_cell_of(design, technology, delays, leaf.driver);
    if (cell == nullptr || cell->is_clock_gate || pin == before.end()) continue;
    const Sink input = builder.sink(*pin, 0.0);
    before.erase(pin);
    builder.insert_weakest(input, leaf.in_net);
    ++added;
  }
  return added;
}

}  // namespace

WireModel wire_model(const Technology& technology) {
  WireModel model;
  const std::vector<int> routing = technology.routing_layers();
  for (const std::size_t k : {std::size_t{1}, std::size_t{2}}) {
    const Layer& layer =
        technology.layers[static_cast<std::size_t>(routing.at(std::min(k, routing.size() - 1)))];
    const double width_um = um(layer.width);
    model.ohm_per_um += layer.resistance_ohm / width_um / 2;
    model.pf_per_um += (layer.area_cap_pf_um2 * width_um + 2 * layer.edge_cap_pf_um) / 2;
  }
  return model;
}

double expected_load_pf(const Design& design, const Technology& technology, const Delays& delays, const Net& net) {
  std::vector<Sink> sinks;
  double sum = 0.0;
  for (const PinRef& ref : net.pins) {
    sinks.push_back({ref, place_of(design, technology, ref), 0.0, 0.0});
    sum += is_driver(design, technology, ref) ? 0.0 : pin_load_pf(design, technology, delays, ref);
  }
  return sum + wire_model(technology).pf_per_um * TreeBuilder::tree_um(sinks);
}

ClockTree build_clock_tree(Design& design, const Technology& technology, const Delays& delays,
                           const std::string& port, const TreeOptions& options) {
  const int root = net_of_port(design, port);
  const std::vector<int> driven = driven_nets(design, technology);
  TreeBuilder builder(design, technology, delays, options, "clock");
  std::vector<Sink> level;
  std::vector<Sink> flops;
  design.nets[static_cast<std::size_t>(root)].use = Use::clock;
  for (const PinRef& ref : take_sinks(design, technology, root)) {
    const DelayCell* cell = delay_cell_of(design, technology, delays, ref.component);
    if (cell == nullptr || !cell->is_clock_gate) {
      flops.push_back(builder.sink(ref, 0.0));
      continue;
    }
    const int net = driven[static_cast<std::size_t>(ref.component)];
    if (net < 0) continue;
    design.nets[static_cast<std::size_t>(net)].use = Use::clock;
    std::vector<Sink> behind;
    for (const PinRef& pin : take_sinks(design, technology, net)) behind.push_back(builder.sink(pin, 0.0));
    if (behind.empty()) continue;
    // a gate drives little: buffers for more than it can
    behind = builder.buffer_level(behind, net);
    const DelayArc* arc = nullptr;
    for (const auto& [name, pin] : cell->pins) {
      if (!pin.arcs.empty()) arc = &pin.arcs.front();
    }
    double latency = 0.0;
    for (const Sink& s : behind) latency = std::max(latency, s.latency_ns);
    if (arc != nullptr) latency += arc->delay.at(0.08, builder.load_pf(behind));
    level.push_back(builder.sink(ref, latency));
  }
  level.insert(level.end(), flops.begin(), flops.end());
  // first those catch up that have less behind them than the slowest gate, then level by level towards the
  // port
  double slowest = 0.0;
  for (const Sink& s : level) slowest = std::max(slowest, s.latency_ns);
  const auto add_level = [&](std::vector<Sink> now, std::vector<Sink> later) {
    level = builder.buffer_level(now, root);
    auto& pins = design.nets[static_cast<std::size_t>(root)].pins;
    std::erase_if(pins, [&](const PinRef& ref) { return ref.component != kDiePin; });
    level.insert(level.end(), later.begin(), later.end());
  };
  for (bool is_uneven = true; is_uneven;) {
    std::vector<Sink> now, later;
    for (const Sink& s : level) (s.latency_ns < slowest - kCatchUpNs ? now : later).push_back(s);
    is_uneven = !now.empty() && !later.empty();
    if (is_uneven) add_level(std::move(now), std::move(later));
  }
  // Sinks too far apart for a common buffer stay as many as they were: the port drives them.
  for (std::size_t before = level.size() + 1; level.size() > 1 && level.size() < before;) {
    before = level.size();
    add_level(level, {});
  }
  for (const Sink& s : level) design.nets[static_cast<std::size_t>(root)].pins.push_back(s.pin);
  balance_clock(design, technology, delays, port, options);
  for (int round = 0; round < kExtraBuffers && delay_early_leaves(design, technology, delays, root, builder) > 0; ++round)
    balance_clock(design, technology, delays, port, options);
  for (Net& net : design.nets) {
    if (net.name.ends_with("_clock") && net.name.starts_with("_")) net.use = Use::clock;
  }
  ClockTree tree = measure_clock(design, technology, delays, port);
  tree.buffers = builder.made();
  return tree;
}

void balance_clock(Design& design, const Technology& technology, const Delays& delays, const std::string& port,
                   const TreeOptions& options) {
  std::vector<int> buffers;
  for (const std::string& name : options.buffers) buffers.push_back(technology.find_macro(name));
  for (int round = 0; round < 3; ++round) even_out(design, technology, delays, net_of_port(design, port), buffers);
}

ClockTree measure_clock(const Design& design, const Technology& technology, const Delays& delays,
                        const std::string& port) {
  ClockTree tree;
  double first = std::numeric_limits<double>::max();
  ClockWalk walk(design, technology, delays);
  walk.visit(net_of_port(design, port), [&](const ClockStage& stage) {
    for (const double at : stage.sinks_ns) {
      ++tree.sinks;
      tree.levels = std::max(tree.levels, stage.depth);
      tree.latency_ns = std::max(tree.latency_ns, at);
      first = std::min(first, at);
    }
  });
  tree.skew_ns = tree.sinks == 0 ? 0.0 : tree.latency_ns - first;
  return tree;
}

int buffer_nets(Design& design, const Technology& technology, const Delays& delays,
                const std::string& clock_port, std::size_t most_sinks, double most_slew_ns, const TreeOptions& options) {
  TreeOptions by_load = options;
  by_load.leaf_sinks = std::numeric_limits<std::size_t>::max();
  by_load.leaf_load_pf = TreeBuilder(design, technology, delays, options, "fanout").most_load_pf(most_slew_ns);
  TreeBuilder builder(design, technology, delays, by_load, "fanout");
  const int clock = net_of_port(design, clock_port);
  const std::size_t nets = design.nets.size();
  for (std::size_t n = 0; n < nets; ++n) {
    const Net& net = design.nets[n];
    if (net.use != Use::signal || static_cast<int>(n) == clock || net.pins.size() <= most_sinks + 1) continue;
    std::vector<Sink> level;
    for (const PinRef& ref : take_sinks(design, technology, static_cast<int>(n)))
      level.push_back(builder.sink(ref, 0.0));
    for (std::size_t before = level.size() + 1; level.size() > 4 && level.size() < before;) {
      before = level.size();
      std::vector<Sink> next;
      for (const auto& group : builder.clusters(level)) next.push_back(builder.insert(builder.smallest_for(group, most_slew_ns), group, static_cast<int>(n)));
      auto& pins = design.nets[n].pins;
      std::erase_if(pins, [&](const PinRef& ref) {
        return ref.component != kDiePin && !is_driver(design, technology, ref);
      });
      if (next.size() >= level.size()) break;
      level = std::move(next);
    }
    for (const Sink& s : level) design.nets[n].pins.push_back(s.pin);
  }
  return builder.made();
}

/// Macros of the same function, by name: that of `macro` with any number at the end, smallest first.
std::vector<int> sizes_of(const Technology& technology, int macro) {
  const auto stem_of = [](const std::string& name) {
    const std::size_t end = name.find_last_not_of("0123456789");
    return end == std::string::npos || end + 1 == name.size() || (name[end] != '_' && name[end] != 'X') ? name : name.substr(0, end + 1);
  };
  const Macro& now = technology.macros[static_cast<std::size_t>(macro)];
  std::vector<int> sizes;
  for (std::size_t m = 0; m < technology.macros.size(); ++m)
    if (technology.macros[m].macro_class == now.macro_class && stem_of(technology.macros[m].name) == stem_of(now.name)) sizes.push_back(static_cast<int>(m));
  std::sort(sizes.begin(), sizes.end(), [&](int a, int b) {
    return technology.macros[static_cast<std::size_t>(a)].width < technology.macros[static_cast<std::size_t>(b)].width;
  });
  return sizes;
}

namespace {

/// Chooses drivers: sizes where a library has them, buffers behind the others.
class DriverSizing {
 public:
  DriverSizing(Design& design, const Technology& technology, const Delays& delays, const std::string& clock_port, const DriverOptions& options, const TreeOptions& trees)
      : design_(design),
        technology_(technology),
        delays_(delays),
        options_(options),
        clock_(net_of_port(design, clock_port)),
        builder_(design, technology, delays, trees, "drive"),
        sizes_(technology.macros.size()),
        most_slew_ns_(design.nets.size(), options.most_slew_ns) {}

  SizedDrivers run() {
    choose();
    double longest = std::numeric_limits<double>::infinity();
    for (PathsNow now = look_at_paths(); now.may_be_faster && now.longest_ns < kWorthIt * longest; now = look_at_paths()) {
      longest = now.longest_ns;
      choose();
    }
    return {static_cast<int>(resized_.size()), builder_.made()};
  }

 private:
  static constexpr double kSlewInNs = 0.1;
  static constexpr double kWorthIt = 0.99;      // the longest path has to become shorter by this, else it is left as it is
  static constexpr double kFaster = 0.7;        // what a round asks of an edge on a path that is too long
  static constexpr double kFastEnoughNs = 0.1;  // nothing more is asked of such an edge

  struct Driver {
    int component = kDiePin;
    int macro = 0;
    std::string pin;
    double load_pf = 0.0;
  };

  Driver driver_of(std::size_t n) const {
    Driver driver;
    const Net& net = design_.nets[n];
    if (net.use != Use::signal || static_cast<int>(n) == clock_) return driver;
    for (const PinRef& ref : net.pins) {
      if (ref.component == kDiePin || !is_driver(design_, technology_, ref)) continue;
      const DelayCell* cell = delay_cell_of(design_, technology_, delays_, ref.component);
      if (cell == nullptr || cell->is_clock_gate) continue;
      const int macro = design_.components[static_cast<std::size_t>(ref.component)].macro;
      driver = {ref.component, macro, technology_.macros[static_cast<std::size_t>(macro)].pins[static_cast<std::size_t>(ref.pin)].name,
                expected_load_pf(design_, technology_, delays_, net)};
    }
    return driver;
  }

  /// Of a cell's output the most of its arcs' figures.
  template <typename Figure>
  double most(int macro, const std::string& pin, const Figure& figure) const {
    double most = 0.0;
    const auto cell = delays_.find(technology_.macros[static_cast<std::size_t>(macro)].name);
    if (cell == delays_.end()) return most;
    const auto found = cell->second.pins.find(pin);
    if (found != cell->second.pins.end())
      for (const DelayArc& arc : found->second.arcs) most = std::max(most, figure(arc));
    return most;
  }
  double slew_ns(int macro, const std::string& pin, double load_pf) const {
    return most(macro, pin, [&](const DelayArc& arc) { return arc.slowest_slew_ns(kSlewInNs, load_pf); });
  }
  double delay_ns(const Driver& driver, double load_pf) const {
    return most(driver.macro, driver.pin, [&](const DelayArc& arc) { return std::max(arc.delay.at(kSlewInNs, load_pf), arc.fall_delay.at(kSlewInNs, load_pf)); });
  }

  std::vector<std::vector<int>> nets_of_components() const {
    std::vector<std::vector<int>> nets(design_.components.size());
    for (std::size_t n = 0; n < design_.nets.size(); ++n) {
      for (const PinRef& ref : design_.nets[n].pins) {
        if (ref.component == kDiePin) continue;
        std::vector<int>& of = nets[static_cast<std::size_t>(ref.component)];
        if (of.empty() || of.back() != static_cast<int>(n)) of.push_back(static_cast<int>(n));
      }
    }
    return nets;
  }

  /// Sizes first: buffers move pins to other nets.
  void choose() {
    const std::vector<std::vector<int>> nets_of = nets_of_components();
    const std::size_t nets = design_.nets.size();
    for (std::size_t n = 0; n < nets; ++n) choose_size(n, nets_of);
    for (std::size_t n = 0; n < nets; ++n) help(n);
    most_slew_ns_.resize(design_.nets.size(), options_.most_slew_ns);
  }

  void choose_size(std::size_t n, const std::vector<std::vector<int>>& nets_of) {
    const Driver driver = driver_of(n);
    if (driver.component == kDiePin) return;
    auto& known = sizes_[static_cast<std::size_t>(driver.macro)];
    if (known.empty()) known = sizes_of(technology_, driver.macro);
    int best = driver.macro;
    for (const int size : known)
      if (slew_ns(best, driver.pin, driver.load_pf) > most_slew_ns_[n] && slew_ns(size, driver.pin, driver.load_pf) < slew_ns(best, driver.pin, driver.load_pf)) best = size;
    if (best == driver.macro) return;
    change_macro(design_, technology_, driver.component, best, nets_of[static_cast<std::size_t>(driver.component)]);
    resized_.insert(driver.component);
  }

  void help(std::size_t n) {
    const Driver driver = driver_of(n);
    if (driver.component == kDiePin || slew_ns(driver.macro, driver.pin, driver.load_pf) <= most_slew_ns_[n]) return;
    std::vector<Sink> sinks;
    for (const PinRef& ref : take_sinks(design_, technology_, static_cast<int>(n))) sinks.push_back(builder_.sink(ref, 0.0));
    if (sinks.empty()) return;
    const Buffer& buffer = builder_.smallest_for(sinks, most_slew_ns_[n]);
    const bool is_too_slow = slew_ns(driver.macro, driver.pin, driver.load_pf) > options_.most_slew_ns;
    if (is_too_slow || delay_ns(driver, buffer.load_pf) + builder_.delay(buffer, sinks) < delay_ns(driver, driver.load_pf)) builder_.insert(buffer, sinks, static_cast<int>(n));
    else
      for (const Sink& sink : sinks) design_.nets[n].pins.push_back(sink.pin);
  }

  struct PathsNow {
    double longest_ns = 0.0;
    bool may_be_faster = false;
  };

  /// Edges on paths that are too long have to be faster from now on.
  PathsNow look_at_paths() {
    std::vector<double> load_pf(design_.nets.size());
    std::transform(design_.nets.begin(), design_.nets.end(), load_pf.begin(), [&](const Net& net) {
      return net.use == Use::signal ? expected_load_pf(design_, technology_, delays_, net) : 0.0;
    });
    const std::vector<double> path_ns = longest_paths_ns(design_, technology_, delays_, load_pf);
    PathsNow now;
    for (std::size_t n = 0; n < path_ns.size(); ++n) {
      now.longest_ns = std::max(now.longest_ns, path_ns[n]);
      if (path_ns[n] <= options_.most_path_ns) continue;
      const Driver driver = driver_of(n);
      const double slew = driver.component == kDiePin ? 0.0 : slew_ns(driver.macro, driver.pin, driver.load_pf);
      if (slew <= kFastEnoughNs) continue;
      most_slew_ns_[n] = std::min(most_slew_ns_[n], kFaster * slew);
      now.may_be_faster = true;
    }
    return now;
  }

  Design& design_;
  const Technology& technology_;
  const Delays& delays_;
  const DriverOptions& options_;
  const int clock_;
  TreeBuilder builder_;
  std::vector<std::vector<int>> sizes_;  ///< by macro: those of its function, smallest first
  std::vector<double> most_slew_ns_;     ///< by net
  std::set<int> resized_;
};

}  // namespace

SizedDrivers size_drivers(Design& design, const Technology& technology, const Delays& delays, const std::string& clock_port, const DriverOptions& options,
                          const TreeOptions& trees) {
  return DriverSizing(design, technology, delays, clock_port, options, trees).run();
}

int add_ties(Design& design, const Technology& technology, Use use, const std::string& macro_name,
             const std::string& pin_name) {
  const int macro = technology.find_macro(macro_name);
  const int pin = macro < 0 ? -1 : technology.macros[static_cast<std::size_t>(macro)].find_pin(pin_name);
  if (pin < 0)
    throw InputError(
        fmt::format("ties: found {}/{}, expected a cell and pin of the LEF", macro_name, pin_name));
  std::vector<PinRef> tied;
  for (Net& net : design.nets) {
    if (net.use != use) continue;
    tied.insert(tied.end(), net.pins.begin(), net.pins.end());
    net.pins.clear();
  }
  int count = 0;
  for (const PinRef& ref : tied) {
    const int component = static_cast<int>(design.components.size());
    design.components.push_back({fmt::format("{}_{}", use == Use::power ? "tie_high" : "tie_low", count),
                                 macro,
                                 {},
                                 Orientation::N,
                                 false,
                                 false});
    Net net;
    net.name = fmt::format("_{}_{}", count++, use == Use::power ? "tie_high" : "tie_low");
    net.pins = {{component, pin}, ref};
    if (ref.component == kDiePin)
      design.pins[static_cast<std::size_t>(ref.pin)].net = static_cast<int>(design.nets.size());
    design.nets.push_back(std::move(net));
  }
  return count;
}

}  // namespace meltstage::layout
