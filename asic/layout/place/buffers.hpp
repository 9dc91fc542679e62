// SPDX-License-Identifier: Apache-2.0
// Buffers put into nets, and what they and wires take: clock tree, trees of large nets and help for weak
// drivers are made with these.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "asic/layout/db/delays.hpp"
#include "asic/layout/db/design.hpp"
#include "asic/layout/db/model.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::layout {

/// What a wire of the signal layers costs, from the LEF.
struct WireModel {
  double ohm_per_um = 0.0;
  double pf_per_um = 0.0;
};
/// Mean of the second and third routing layer, alone above ground.
WireModel wire_model(const Technology& technology);

/// What drives the net has to charge: pins and the wire that is expected where cells are now, pF.
double expected_load_pf(const Design& design, const Technology& technology, const Delays& delays,
                        const Net& net);

struct TreeOptions {
  std::vector<std::string> buffers;  ///< macros with one input and one output, weakest first
  double leaf_load_pf = 0.2;         ///< what a buffer of a tree drives at most, wires with it
  std::size_t leaf_sinks = 24;  ///< and how many pins: a word of 16 bits with its check bits is one buffer's
};

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

inline double um(Nm nm) { return static_cast<double>(nm) / 1000.0; }
inline double distance_um(Point a, Point b) { return um(std::abs(a.x - b.x) + std::abs(a.y - b.y)); }

/// Net of a port. Throws UserError.
int net_of_port(const Design& design, const std::string& port);
/// Takes the cells' inputs off a net.
std::vector<PinRef> take_sinks(Design& design, const Technology& technology, int net);
/// Middle of a pin on the die.
Point place_of(const Design& design, const Technology& technology, const PinRef& ref);
/// What an input holds.
double pin_load_pf(const Design& design, const Technology& technology, const Delays& delays,
                   const PinRef& ref);
/// Another cell with the same pins; `nets` are those that the component is on.
void change_macro(Design& design, const Technology& technology, int component, int macro,
                  const std::vector<int>& nets);

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
    if (buffers_.empty()) throw UserError("--buffers: found no buffer, expected the names of the library's");
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

  /// The smallest buffer whose edges are at most `most_slew_ns` slow behind the group's load, or else the one
  /// with the fastest.
  const Buffer& smallest_for(const std::vector<Sink>& group, double most_slew_ns) const {
    const double load = load_pf(group);
    const auto fast_enough = std::find_if(buffers_.begin(), buffers_.end(),
                                          [&](const Buffer& b) { return slew_ns(b, load) <= most_slew_ns; });
    if (fast_enough != buffers_.end()) return *fast_enough;
    return *std::min_element(buffers_.begin(), buffers_.end(), [&](const Buffer& a, const Buffer& b) {
      return slew_ns(a, load) < slew_ns(b, load);
    });
  }

  /// The most that one of the buffers charges with edges of at most `most_slew_ns`.
  double most_load_pf(double most_slew_ns) const {
    constexpr double kStepPf = 0.01;
    double load = kStepPf;
    const auto one_can = [&](double pf) {
      return std::any_of(buffers_.begin(), buffers_.end(), [&](const Buffer& b) {
        return pf <= b.most_load_pf && slew_ns(b, pf) <= most_slew_ns;
      });
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

  static double slew_ns(const Buffer& b, double load_pf) {
    return b.arc->slowest_slew_ns(kTypicalSlewNs, load_pf);
  }

  Buffer buffer(const std::string& name) const {
    Buffer b;
    b.macro = technology_.find_macro(name);
    const auto cell = delays_.find(name);
    if (b.macro < 0 || cell == delays_.end())
      throw UserError(
          fmt::format("--buffers: found {}, expected a cell of the LEF and of Liberty", shown(name)));
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
    const auto inputs = std::count_if(macro.pins.begin(), macro.pins.end(), is_signal_input);
    const auto outputs = std::count_if(macro.pins.begin(), macro.pins.end(), [](const MacroPin& pin) {
      return pin.direction == PinDirection::output;
    });
    if (inputs != 1 || outputs != 1 || !follows_input(cell->second, macro, b))
      throw UserError(fmt::format(
          "--buffers: found {}, expected a buffer: one input, and one output that follows it", shown(name)));
    if (b.arc == nullptr)
      throw UserError(
          fmt::format("--buffers: found no delay of {} in Liberty, expected a buffer", shown(name)));
    return b;
  }

  /// By its function, as Liberty need not tell the sense of an arc.
  static bool follows_input(const DelayCell& cell, const Macro& macro, const Buffer& b) {
    if (b.arc == nullptr) return true;  // told as such
    std::string function = cell.pins.find(macro.pins[static_cast<std::size_t>(b.out)].name)->second.function;
    std::erase_if(function, [](char c) { return c == ' ' || c == '(' || c == ')'; });
    return function == macro.pins[static_cast<std::size_t>(b.in)].name &&
           b.arc->unateness != Unateness::negative;
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

}  // namespace meltstage::layout
