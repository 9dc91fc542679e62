// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/trees.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <unordered_map>

#include "asic/layout/error.hpp"
#include "asic/layout/model.hpp"

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
  const DelayArc* arc = nullptr;
};

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

  /// A buffer for each cluster; `net` then drives the buffers. The sinks must be off the net already.
  std::vector<Sink> buffer_level(const std::vector<Sink>& sinks, int net) {
    std::vector<std::vector<Sink>> groups;
    for (auto& alike : by_latency(sinks)) {
      for (auto& group : clusters(std::move(alike))) groups.push_back(std::move(group));
    }
    // all buffers of a level aim at what the slowest cluster reaches with its best buffer
    double target = 0.0;
    for (const auto& group : groups) {
      double best = std::numeric_limits<double>::max();
      for (const Buffer& b : buffers_) best = std::min(best, delay(b, group));
      target = std::max(target, best);
    }
    std::vector<Sink> level;
    for (const auto& group : groups) {
      const Buffer* chosen = nullptr;
      for (const Buffer& b : buffers_) {
        if (chosen == nullptr ||
            std::abs(delay(b, group) - target) < std::abs(delay(*chosen, group) - target))
          chosen = &b;
      }
      level.push_back(insert(*chosen, group, net));
    }
    return level;
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

const DelayCell* cell_of(const Design& design, const Technology& technology, const Delays& delays,
                         int component) {
  const auto found = delays.find(
      technology
          .macros[static_cast<std::size_t>(design.components[static_cast<std::size_t>(component)].macro)]
          .name);
  return found == delays.end() ? nullptr : &found->second;
}

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

bool is_driver(const Design& design, const Technology& technology, const PinRef& ref) {
  const PinDirection direction = pin_direction(design, technology, ref);
  return ref.component == kDiePin ? direction == PinDirection::input : direction == PinDirection::output;
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

ClockTree build_clock_tree(Design& design, const Technology& technology, const Delays& delays,
                           const std::string& port, const TreeOptions& options) {
  const int root = net_of_port(design, port);
  const std::vector<int> driven = driven_nets(design, technology);
  TreeBuilder builder(design, technology, delays, options, "clock");
  std::vector<Sink> level;
  std::vector<Sink> flops;
  design.nets[static_cast<std::size_t>(root)].use = Use::clock;
  for (const PinRef& ref : take_sinks(design, technology, root)) {
    const DelayCell* cell = cell_of(design, technology, delays, ref.component);
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
  // level by level towards the port; who has the most latency already waits for the others
  const auto fastest = [](const std::vector<Sink>& sinks) {
    return std::min_element(sinks.begin(), sinks.end(),
                            [](const Sink& a, const Sink& b) { return a.latency_ns < b.latency_ns; })
        ->latency_ns;
  };
  level.insert(level.end(), flops.begin(), flops.end());
  while (level.size() > 1) {
    const double slowest = std::max_element(level.begin(), level.end(), [](const Sink& a, const Sink& b) {
                             return a.latency_ns < b.latency_ns;
                           })->latency_ns;
    const double reach = std::max(fastest(level) + 0.1, slowest - 0.12);
    std::vector<Sink> now, later;
    for (const Sink& s : level) (s.latency_ns <= reach || reach >= slowest - 0.02 ? now : later).push_back(s);
    level = builder.buffer_level(now, root);
    auto& pins = design.nets[static_cast<std::size_t>(root)].pins;
    std::erase_if(pins, [&](const PinRef& ref) { return ref.component != kDiePin; });
    level.insert(level.end(), later.begin(), later.end());
  }
  for (const Sink& s : level) design.nets[static_cast<std::size_t>(root)].pins.push_back(s.pin);
  for (Net& net : design.nets) {
    if (net.name.ends_with("_clock") && net.name.starts_with("_")) net.use = Use::clock;
  }
  ClockTree tree = measure_clock(design, technology, delays, port);
  tree.buffers = builder.made();
  return tree;
}

ClockTree measure_clock(const Design& design, const Technology& technology, const Delays& delays,
                        const std::string& port) {
  const std::vector<int> driven = driven_nets(design, technology);
  const WireModel wire = wire_model(technology);
  ClockTree tree;
  double first = std::numeric_limits<double>::max();
  const auto pin_at = [&](const PinRef& ref) {
    if (ref.component == kDiePin) return design.pins[static_cast<std::size_t>(ref.pin)].shape.rect.middle();
    const Component& c = design.components[static_cast<std::size_t>(ref.component)];
    const Macro& macro = technology.macros[static_cast<std::size_t>(c.macro)];
    const Point middle = middle_of(macro.pins[static_cast<std::size_t>(ref.pin)]);
    return placed({middle.x, middle.y, middle.x, middle.y}, macro, c).middle();
  };
  const auto pin_load = [&](const PinRef& ref) {
    const DelayCell* cell =
        ref.component == kDiePin ? nullptr : cell_of(design, technology, delays, ref.component);
    if (cell == nullptr) return 0.0;
    const Macro& macro = technology.macros[static_cast<std::size_t>(
        design.components[static_cast<std::size_t>(ref.component)].macro)];
    const auto pin = cell->pins.find(macro.pins[static_cast<std::size_t>(ref.pin)].name);
    return pin == cell->pins.end() ? 0.0 : pin->second.capacitance_pf;
  };
  const auto net_load = [&](const Net& net) {
    std::vector<Sink> sinks;
    double load = 0.0;
    for (const PinRef& ref : net.pins) {
      sinks.push_back({ref, pin_at(ref), 0.0, 0.0});
      load += is_driver(design, technology, ref) ? 0.0 : pin_load(ref);
    }
    return load + wire.pf_per_um * TreeBuilder::tree_um(sinks);
  };
  const std::function<void(int, double, double, int)> visit = [&](int n, double at_ns, double slew_ns,
                                                                  int depth) {
    const Net& net = design.nets[static_cast<std::size_t>(n)];
    Point from;
    for (const PinRef& ref : net.pins) {
      if (is_driver(design, technology, ref)) from = pin_at(ref);
    }
    for (const PinRef& ref : net.pins) {
      if (ref.component == kDiePin || is_driver(design, technology, ref)) continue;
      const double length = distance_um(from, pin_at(ref));
      const double here =
          at_ns + 1e-3 * wire.ohm_per_um * length * (wire.pf_per_um * length / 2 + pin_load(ref));
      const DelayCell* cell = cell_of(design, technology, delays, ref.component);
      const int behind = driven[static_cast<std::size_t>(ref.component)];
      const DelayArc* arc = nullptr;
      if (cell != nullptr && !cell->is_flop && behind >= 0) {
        for (const auto& [name, pin] : cell->pins) {
          if (!pin.arcs.empty()) arc = &pin.arcs.front();
        }
      }
      if (arc != nullptr) {
        const double load = net_load(design.nets[static_cast<std::size_t>(behind)]);
        visit(behind, here + arc->delay.at(slew_ns, load), arc->slew.at(slew_ns, load), depth + 1);
        continue;
      }
      ++tree.sinks;
      tree.levels = std::max(tree.levels, depth);
      tree.latency_ns = std::max(tree.latency_ns, here);
      first = std::min(first, here);
    }
  };
  visit(net_of_port(design, port), 0.0, 0.05, 0);
  tree.skew_ns = tree.sinks == 0 ? 0.0 : tree.latency_ns - first;
  return tree;
}

int buffer_nets(Design& design, const Technology& technology, const Delays& delays,
                const std::string& clock_port, std::size_t most_sinks, const TreeOptions& options) {
  TreeBuilder builder(design, technology, delays, options, "fanout");
  const int clock = net_of_port(design, clock_port);
  const std::size_t nets = design.nets.size();
  for (std::size_t n = 0; n < nets; ++n) {
    const Net& net = design.nets[n];
    if (net.use != Use::signal || static_cast<int>(n) == clock || net.pins.size() <= most_sinks + 1) continue;
    std::vector<Sink> level;
    for (const PinRef& ref : take_sinks(design, technology, static_cast<int>(n)))
      level.push_back(builder.sink(ref, 0.0));
    while (level.size() > 4) {
      std::vector<Sink> next;
      for (auto& group : builder.clusters(level)) {
        std::vector<Sink> one = std::move(group);
        for (Sink& s : one) s.latency_ns = 0.0;
        for (const Sink& s : builder.buffer_level(one, static_cast<int>(n))) next.push_back(s);
      }
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
