// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/paths.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace meltstage::layout {

namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();
constexpr double kClockSlewNs = 0.1;
constexpr double kPortSlewNs = 0.1;
enum Edge : std::size_t { kRise, kFall };
constexpr std::array kEdges{kRise, kFall};

std::size_t at(int i) { return static_cast<std::size_t>(i); }

double delay_ns(const DelayArc& arc, Edge out, double slew_ns, double load_pf) {
  return (out == kRise ? arc.delay : arc.fall_delay).at(slew_ns, load_pf);
}
double slew_ns(const DelayArc& arc, Edge out, double in_slew_ns, double load_pf) {
  return (out == kRise ? arc.slew : arc.fall_slew).at(in_slew_ns, load_pf);
}
bool makes(const DelayArc& arc, Edge in, Edge out) {
  return arc.unateness == Unateness::none || (arc.unateness == Unateness::positive) == (in == out);
}

/// A way from a net through a gate to the net that it drives.
struct Way {
  const DelayArc* arc = nullptr;
  int to = 0;
};

class Analysis {
 public:
  Analysis(const Design& design, const Technology& technology, const Delays& delays,
           const std::vector<double>& load_pf)
      : load_(load_pf),
        ways_(design.nets.size()),
        is_end_(design.nets.size()),
        before_(design.nets.size()),
        last_(design.nets.size()),
        rest_(design.nets.size()) {
    for (auto& arrivals : last_) arrivals.fill({kNever, 0.0});
    for (auto& rests : rest_) rests.fill(kNever);
    find_ways(design, technology, delays);
  }

  std::vector<double> through() {
    std::vector<int> order;
    for (std::size_t n = 0; n < ways_.size(); ++n)
      if (before_[n] == 0) order.push_back(static_cast<int>(n));
    for (std::size_t i = 0; i < order.size(); ++i) go_on(order[i], order);
    std::for_each(order.rbegin(), order.rend(), [this](int net) { go_back(net); });
    std::vector<double> longest(ways_.size(), 0.0);
    for (std::size_t n = 0; n < ways_.size(); ++n)
      for (const Edge e : kEdges) longest[n] = std::max(longest[n], last_[n][e].at_ns + rest_[n][e]);
    return longest;
  }

 private:
  struct Arrival {
    double at_ns;
    double slew_ns;
  };

  void find_ways(const Design& design, const Technology& technology, const Delays& delays) {
    const auto name_of = [&](const PinRef& ref) -> const std::string& {
      return technology.macros[at(design.components[at(ref.component)].macro)].pins[at(ref.pin)].name;
    };
    std::vector<std::vector<std::pair<int, const DelayPin*>>> outputs(design.components.size());
    for (std::size_t n = 0; n < design.nets.size(); ++n) {
      for (const PinRef& ref : design.nets[n].pins) {
        if (!is_driver(design, technology, ref)) continue;
        if (ref.component == kDiePin) {
          last_[n].fill({0.0, kPortSlewNs});
          continue;
        }
        const DelayCell* cell = delay_cell_of(design, technology, delays, ref.component);
        if (cell == nullptr || cell->is_clock_gate) continue;
        const auto pin = cell->pins.find(name_of(ref));
        if (pin == cell->pins.end()) continue;
        if (cell->is_flop)
          leave_flop(n, pin->second);
        else
          outputs[at(ref.component)].emplace_back(static_cast<int>(n), &pin->second);
      }
    }
    for (std::size_t n = 0; n < design.nets.size(); ++n) {
      for (const PinRef& ref : design.nets[n].pins) {
        if (is_driver(design, technology, ref)) continue;
        const bool is_end = ref.component == kDiePin || outputs[at(ref.component)].empty();
        if (is_end)
          is_end_[n] = true;
        else
          for (const auto& [to, pin] : outputs[at(ref.component)])
            for (const DelayArc& arc : pin->arcs)
              if (arc.from == name_of(ref)) ways_[n].push_back({&arc, to}), ++before_[at(to)];
      }
    }
  }

  void leave_flop(std::size_t net, const DelayPin& out) {
    for (const DelayArc& arc : out.arcs)
      for (const Edge e : kEdges)
        arrive(net, e,
               {delay_ns(arc, e, kClockSlewNs, load_[net]), slew_ns(arc, e, kClockSlewNs, load_[net])});
  }

  void arrive(std::size_t net, Edge edge, const Arrival& arrival) {
    Arrival& last = last_[net][edge];
    last = {std::max(last.at_ns, arrival.at_ns), std::max(last.slew_ns, arrival.slew_ns)};
  }

  void go_on(int net, std::vector<int>& order) {
    for (const Way& way : ways_[at(net)]) {
      for (const Edge in : kEdges) {
        const Arrival& from = last_[at(net)][in];
        if (from.at_ns == kNever) continue;
        for (const Edge out : kEdges)
          if (makes(*way.arc, in, out))
            arrive(at(way.to), out,
                   {from.at_ns + delay_ns(*way.arc, out, from.slew_ns, load_[at(way.to)]),
                    slew_ns(*way.arc, out, from.slew_ns, load_[at(way.to)])});
      }
      if (--before_[at(way.to)] == 0) order.push_back(way.to);
    }
  }

  void go_back(int net) {
    for (const Edge in : kEdges) {
      double& rest = rest_[at(net)][in];
      if (is_end_[at(net)]) rest = 0.0;
      for (const Way& way : ways_[at(net)])
        for (const Edge out : kEdges)
          if (makes(*way.arc, in, out))
            rest = std::max(rest, delay_ns(*way.arc, out, last_[at(net)][in].slew_ns, load_[at(way.to)]) +
                                      rest_[at(way.to)][out]);
    }
  }

  const std::vector<double>& load_;
  std::vector<std::vector<Way>> ways_;  ///< from each net
  std::vector<bool> is_end_;
  std::vector<int> before_;  ///< ways to a net that haven't been gone yet
  std::vector<std::array<Arrival, 2>> last_;
  std::vector<std::array<double, 2>> rest_;  ///< from the net to the last end
};

}  // namespace

const DelayCell* delay_cell_of(const Design& design, const Technology& technology, const Delays& delays,
                               int component) {
  const auto found = delays.find(technology.macros[at(design.components[at(component)].macro)].name);
  return found == delays.end() ? nullptr : &found->second;
}

bool is_driver(const Design& design, const Technology& technology, const PinRef& ref) {
  const PinDirection direction = pin_direction(design, technology, ref);
  return ref.component == kDiePin ? direction == PinDirection::input : direction == PinDirection::output;
}

std::vector<double> longest_paths_ns(const Design& design, const Technology& technology, const Delays& delays,
                                     const std::vector<double>& load_pf) {
  return Analysis(design, technology, delays, load_pf).through();
}

}  // namespace meltstage::layout
