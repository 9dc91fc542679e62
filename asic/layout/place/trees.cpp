// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/place/trees.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>

#include "asic/layout/db/model.hpp"
#include "asic/layout/db/paths.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

namespace {

constexpr double kCatchUpNs = 0.08;      // less than what a buffer of the tree takes
constexpr double kExtraBufferNs = 0.09;  // what one with little behind it takes
constexpr int kExtraBuffers = 3;         // in a row, at most

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
          stage.out_ns + 1e-3 * wire_.ohm_per_um * length *
                             (wire_.pf_per_um * length / 2 + pin_load_pf(design_, technology_, delays_, ref));
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
      next.load_pf =
          expected_load_pf(design_, technology_, delays_, design_.nets[static_cast<std::size_t>(next.net)]);
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

/// One more buffer before each buffer of flops that is early by more than such a buffer takes. Returns how
/// many.
int delay_early_leaves(Design& design, const Technology& technology, const Delays& delays, int root,
                       TreeBuilder& builder) {
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
    const auto pin = std::find_if(before.begin(), before.end(),
                                  [&](const PinRef& ref) { return ref.component == leaf.driver; });
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

void mark_clock(Design& design, const Technology& technology, const Delays& delays, const std::string& port) {
  design.nets[static_cast<std::size_t>(net_of_port(design, port))].use = Use::clock;
  for (Net& net : design.nets) {
    for (const PinRef& ref : net.pins) {
      if (ref.component == kDiePin || !is_driver(design, technology, ref)) continue;
      const DelayCell* cell = delay_cell_of(design, technology, delays, ref.component);
      if (cell != nullptr && cell->is_clock_gate) net.use = Use::clock;
    }
  }
}

ClockTree build_clock_tree(Design& design, const Technology& technology, const Delays& delays,
                           const std::string& port, const TreeOptions& options) {
  const int root = net_of_port(design, port);
  const std::vector<int> driven = driven_nets(design, technology);
  TreeBuilder builder(design, technology, delays, options, "clock");
  std::vector<Sink> level;
  std::vector<Sink> flops;
  for (const PinRef& ref : take_sinks(design, technology, root)) {
    const DelayCell* cell = delay_cell_of(design, technology, delays, ref.component);
    if (cell == nullptr || !cell->is_clock_gate) {
      flops.push_back(builder.sink(ref, 0.0));
      continue;
    }
    const int net = driven[static_cast<std::size_t>(ref.component)];
    if (net < 0) continue;
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
  const auto add_level = [&](const std::vector<Sink>& now, std::vector<Sink> later) {
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
  for (int round = 0;
       round < kExtraBuffers && delay_early_leaves(design, technology, delays, root, builder) > 0; ++round)
    balance_clock(design, technology, delays, port, options);
  for (Net& net : design.nets) {
    if (net.name.ends_with("_clock") && net.name.starts_with("_")) net.use = Use::clock;
  }
  ClockTree tree = measure_clock(design, technology, delays, port);
  tree.buffers = builder.made();
  return tree;
}

void balance_clock(Design& design, const Technology& technology, const Delays& delays,
                   const std::string& port, const TreeOptions& options) {
  std::vector<int> buffers;
  for (const std::string& name : options.buffers) buffers.push_back(technology.find_macro(name));
  for (int round = 0; round < 3; ++round)
    even_out(design, technology, delays, net_of_port(design, port), buffers);
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
                const std::string& clock_port, std::size_t most_sinks, double most_slew_ns,
                const TreeOptions& options) {
  TreeOptions by_load = options;
  by_load.leaf_sinks = std::numeric_limits<std::size_t>::max();
  by_load.leaf_load_pf =
      TreeBuilder(design, technology, delays, options, "fanout").most_load_pf(most_slew_ns);
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
      for (const auto& group : builder.clusters(level))
        next.push_back(builder.insert(builder.smallest_for(group, most_slew_ns), group, static_cast<int>(n)));
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
  const char* const option = use == Use::power ? "--tie-high" : "--tie-low";
  if (pin < 0)
    throw UserError(fmt::format("{}: found {} {}, expected a cell and its pin of {}", option,
                                shown(macro_name), shown(pin_name), technology.files));
  const std::vector<MacroPin>& pins = technology.macros[static_cast<std::size_t>(macro)].pins;
  if (pins[static_cast<std::size_t>(pin)].direction != PinDirection::output ||
      std::any_of(pins.begin(), pins.end(), is_signal_input))
    throw UserError(fmt::format("{}: found {} {}, expected an output of a cell without inputs", option,
                                macro_name, pin_name));
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
