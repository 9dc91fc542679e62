// SPDX-License-Identifier: Apache-2.0
// The definition that verdicts are held against: cells and nets of a netlist as they stand, up to 64 machines
// side by side, with pins stuck. It shares nothing with the simulators of asic/dft/ but the netlist.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "asic/dft/core/cycles.hpp"
#include "asic/netlist/liberty.hpp"
#include "asic/netlist/netlist.hpp"

namespace meltstage::dft {

class NetlistMachine {
 public:
  using Bits = std::uint64_t;  // a bit a machine

  NetlistMachine(const Netlist& netlist, const CellLibrary& library)
      : netlist_(netlist),
        net_(static_cast<std::size_t>(netlist.next_net)),
        state_(netlist.instances.size()) {
    for (std::size_t i = 0; i < netlist.instances.size(); ++i) {
      cells_.push_back(&library.at(netlist.instances[i].type));
      index_[netlist.instances[i].name] = i;
    }
    for (const Port& port : netlist.ports) {
      for (std::size_t b = 0; b < port.bits.size(); ++b)
        port_[port.bit_name(b)] = {port.is_input, port.bits[b]};
    }
  }

  /// "instance/PIN" or a port's bit stuck in these machines.
  void stick(const std::string& site, bool level, Bits machines) {
    const std::size_t slash = site.rfind('/');
    const auto instance = slash == std::string::npos ? index_.end() : index_.find(site.substr(0, slash));
    Stuck& stuck =
        instance == index_.end() ? of_port_[site] : of_pin_[{instance->second, site.substr(slash + 1)}];
    stuck.machines |= machines;
    if (level) stuck.level |= machines;
  }
  /// What flops hold before the first cycle, in their order in the netlist.
  template <class Draw>
  void power_up(const Draw& draw) {
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (cells_[i]->flop) state_[i] = draw();
    }
  }

  /// Machines in which a strobe of the stream fails. `open` gives what an input is that the stream leaves
  /// open.
  template <class Open>
  Bits run(const CycleStream& stream, const Open& open) {
    Bits failing = 0;
    for (const TestCycle& cycle : stream.cycles) {
      for (std::uint64_t c = 0; c < cycle.count; ++c) failing |= step(stream, cycle.states, open);
    }
    return failing;
  }

 private:
  struct Stuck {
    Bits machines = 0, level = 0;
    Bits apply(Bits value) const { return (value & ~machines) | level; }
  };
  static Bits forced(const Stuck* stuck, Bits value) {
    return stuck == nullptr ? value : stuck->apply(value);
  }
  const Stuck* at_port(const std::string& name) const {
    const auto found = of_port_.find(name);
    return found == of_port_.end() ? nullptr : &found->second;
  }
  const Stuck* at_pin(std::size_t i, const std::string& pin) const {
    const auto found = of_pin_.find({i, pin});
    return found == of_pin_.end() ? nullptr : &found->second;
  }

  Bits level(std::size_t i, const std::string& pin) const {
    const Net net = netlist_.instances[i].pins.at(pin);
    return forced(at_pin(i, pin), net == 1 ? ~Bits{0} : net == 0 ? 0 : net_[static_cast<std::size_t>(net)]);
  }
  Bits value(const Expression& e, std::size_t i) const {
    using Op = Expression::Op;
    const Cell& cell = *cells_[i];
    if (e.op == Op::zero) return 0;
    if (e.op == Op::one) return ~Bits{0};
    if (e.op == Op::inv) return ~value(e.args[0], i);
    if (e.op == Op::pin) {
      if (cell.flop && e.pin == cell.flop->state) return state_[i];
      if (cell.flop && e.pin == cell.flop->state_n) return ~state_[i];
      return level(i, e.pin);
    }
    Bits result = value(e.args[0], i);
    for (std::size_t k = 1; k < e.args.size(); ++k) {
      const Bits next = value(e.args[k], i);
      result = e.op == Op::all ? result & next : e.op == Op::any ? result | next : result ^ next;
    }
    return result;
  }
  // Resets act when all lines are at rest: what passes through them for no time resets nothing.
  void settle() {
    do {
      propagate();
    } while (reset());
  }
  void propagate() {
    bool changed = true;
    for (std::size_t round = 0; changed; ++round) {
      if (round > 1000) throw std::logic_error("the netlist does not come to rest");
      changed = false;
      for (std::size_t i = 0; i < cells_.size(); ++i) {
        for (const CellPin& pin : cells_[i]->pins) {
          const auto net = netlist_.instances[i].pins.find(pin.name);
          if (!pin.is_output || !pin.function || net == netlist_.instances[i].pins.end()) continue;
          Bits& now = net_[static_cast<std::size_t>(net->second)];
          const Bits next = forced(at_pin(i, pin.name), value(*pin.function, i));
          changed = changed || now != next;
          now = next;
        }
      }
    }
  }
  bool reset() {
    bool changed = false;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const auto& flop = cells_[i]->flop;
      if (!flop) continue;
      const Bits before = state_[i];
      if (flop->clear) state_[i] &= ~value(*flop->clear, i);
      if (flop->preset) state_[i] |= value(*flop->preset, i);
      changed = changed || state_[i] != before;
    }
    return changed;
  }
  void put(const std::string& name, Bits level) {
    const auto port = port_.find(name);
    if (port == port_.end() || !port->second.first) throw std::logic_error("no input " + name);
    net_[static_cast<std::size_t>(port->second.second)] = forced(at_port(name), level);
  }
  std::vector<std::pair<Bits, Bits>> clocks_and_data() const {  // of each flop
    std::vector<std::pair<Bits, Bits>> all(cells_.size());
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (const auto& flop = cells_[i]->flop)
        all[i] = {value(flop->clocked_on, i), value(flop->next_state, i)};
    }
    return all;
  }

  template <class Open>
  Bits step(const CycleStream& stream, const std::string& states, const Open& open) {
    std::vector<std::string> clocked;
    for (std::size_t s = 0; s < states.size(); ++s) {
      if (!stream.signals[s].is_input) continue;
      const char c = states[s];
      put(stream.signals[s].name, c == '1' ? ~Bits{0} : c == '0' || c == 'P' ? 0 : open());
      if (c == 'P') clocked.push_back(stream.signals[s].name);
    }
    settle();
    const Bits failing = compare(stream, states);
    if (clocked.empty()) return failing;
    const auto before = clocks_and_data();
    for (const std::string& name : clocked) put(name, ~Bits{0});
    settle();
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (!cells_[i]->flop) continue;
      const Bits rises = ~before[i].first & value(cells_[i]->flop->clocked_on, i);
      state_[i] = (state_[i] & ~rises) | (before[i].second & rises);
    }
    reset();  // one that acts during the edge wins
    settle();
    for (const std::string& name : clocked) put(name, 0);
    settle();
    return failing;
  }
  Bits compare(const CycleStream& stream, const std::string& states) const {
    Bits failing = 0;
    for (std::size_t s = 0; s < states.size(); ++s) {
      if (stream.signals[s].is_input || (states[s] != 'H' && states[s] != 'L')) continue;
      const auto port = port_.find(stream.signals[s].name);
      if (port == port_.end() || port->second.first)
        throw std::logic_error("no output " + stream.signals[s].name);
      const Net net = port->second.second;
      const Bits shown = forced(at_port(port->first), net == 1   ? ~Bits{0}
                                                      : net == 0 ? 0
                                                                 : net_[static_cast<std::size_t>(net)]);
      failing |= states[s] == 'H' ? ~shown : shown;
    }
    return failing;
  }

  const Netlist& netlist_;
  std::vector<const Cell*> cells_;
  std::map<std::string, std::size_t> index_;
  std::map<std::string, std::pair<bool, Net>> port_;  // whether it is an input
  std::map<std::string, Stuck> of_port_;
  std::map<std::pair<std::size_t, std::string>, Stuck> of_pin_;
  std::vector<Bits> net_, state_;
};

}  // namespace meltstage::dft
