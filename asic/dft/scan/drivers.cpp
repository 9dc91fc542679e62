// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/drivers.hpp"

#include <set>
#include <utility>
#include <vector>

#include "asic/dft/scan/scan_cells.hpp"

namespace meltstage::dft {

namespace {

using Op = Expression::Op;

}  // namespace

Drivers::Drivers(const Netlist& netlist, const CellLibrary& library) : netlist_(netlist), library_(library) {
  for (const Port& port : netlist.ports) {
    if (!port.is_input) continue;
    for (std::size_t i = 0; i < port.bits.size(); ++i) port_[port.bits[i]] = port.bit_name(i);
  }
  for (std::size_t i = 0; i < netlist.instances.size(); ++i) {
    const Cell* cell = find_cell(library, netlist.instances[i].type);
    if (cell == nullptr) continue;
    for (const auto& [pin, net] : netlist.instances[i].pins) {
      const CellPin* known = cell->find(pin);
      if (known != nullptr && known->is_output) driver_[net] = i;
    }
  }
}

bool Drivers::is_driven(Net net) const {
  return net == 0 || net == 1 || port_.count(net) != 0 || driver_.count(net) != 0;
}

std::optional<std::size_t> Drivers::driver_of(Net net) const {
  const auto found = driver_.find(net);
  if (found == driver_.end()) return std::nullopt;
  return found->second;
}

std::string Drivers::port_at(Net net) const {
  const auto found = port_.find(net);
  return found == port_.end() ? "" : found->second;
}

std::string Drivers::port_of(Net net, bool* inverted) const {
  bool odd = false;
  for (std::size_t steps = 0; steps < 1000; ++steps) {
    const auto port = port_.find(net);
    if (port != port_.end()) {
      if (inverted != nullptr) *inverted = odd;
      return port->second;
    }
    const auto driver = driver_.find(net);
    if (driver == driver_.end()) return "";
    const Instance& instance = netlist_.instances[driver->second];
    const Cell& cell = *find_cell(library_, instance.type);
    if (cell.gate && instance.pins.count(cell.gate->clock) != 0) {
      net = instance.pins.at(cell.gate->clock);
      continue;
    }
    if (cell.flop || instance.pins.size() != 2) return "";
    for (const CellPin& pin : cell.pins) {
      if (!pin.is_output || !pin.function) continue;
      const std::string source = only_pin(*pin.function);
      if (source.empty() || instance.pins.count(source) == 0) return "";
      odd = odd != (pin.function->op == Op::inv);
      net = instance.pins.at(source);
    }
  }
  return "";
}

namespace {

// Values of nets where some input ports have one and all else, flops too, is unknown (-1).
class PortValues {
 public:
  PortValues(const Netlist& netlist, const CellLibrary& library, const Drivers& drivers,
             std::map<std::string, bool> ports)
      : netlist_(netlist), library_(library), drivers_(drivers), ports_(std::move(ports)) {}

  int value(Net net) {
    if (net == 0 || net == 1) return net;
    const auto [known, fresh] = value_.emplace(net, -1);  // unknown too while a loop leads back here
    if (!fresh) return known->second;
    const int found = evaluate(net);
    return value_[net] = found;
  }

 private:
  int evaluate(Net net) {
    if (const auto port = ports_.find(drivers_.port_at(net)); port != ports_.end())
      return port->second ? 1 : 0;
    const auto driver = drivers_.driver_of(net);
    if (!driver) return -1;
    const Instance& instance = netlist_.instances[*driver];
    const Cell& cell = *find_cell(library_, instance.type);
    if (cell.flop || cell.gate) return -1;
    for (const auto& [name, out] : instance.pins) {
      const CellPin* pin = cell.find(name);
      if (out == net && pin != nullptr && pin->is_output && pin->function)
        return value(*pin->function, instance);
    }
    return -1;
  }
  int value(const Expression& e, const Instance& instance) {
    if (e.op == Op::zero) return 0;
    if (e.op == Op::one) return 1;
    if (e.op == Op::pin) {
      const auto net = instance.pins.find(e.pin);
      return net == instance.pins.end() ? -1 : value(net->second);
    }
    if (e.op == Op::inv) {
      const int arg = value(e.args[0], instance);
      return arg < 0 ? -1 : 1 - arg;
    }
    int parity = 0;
    bool unknown = false;
    for (const Expression& part : e.args) {
      const int arg = value(part, instance);
      if (e.op == Op::all && arg == 0) return 0;
      if (e.op == Op::any && arg == 1) return 1;
      unknown = unknown || arg < 0;
      parity ^= arg & 1;
    }
    if (unknown) return -1;
    return e.op == Op::parity ? parity : e.op == Op::all ? 1 : 0;
  }

  const Netlist& netlist_;
  const CellLibrary& library_;
  const Drivers& drivers_;
  std::map<std::string, bool> ports_;
  std::unordered_map<Net, int> value_;
};

}  // namespace

std::string bypass_of(const Netlist& netlist, const CellLibrary& library, const Drivers& drivers, Net net,
                      const std::string& test_mode, bool* inverted) {
  std::set<Net> seen{net};
  std::vector<Net> open{net};
  std::set<std::string> ports;
  while (!open.empty()) {
    const Net at = open.back();
    open.pop_back();
    if (const std::string port = drivers.port_at(at); !port.empty()) ports.insert(port);
    const auto driver = drivers.driver_of(at);
    if (!driver) continue;
    const Instance& instance = netlist.instances[*driver];
    const Cell& cell = *find_cell(library, instance.type);
    if (cell.flop || cell.gate) continue;
    for (const auto& [pin, source] : instance.pins) {
      const CellPin* const known = cell.find(pin);
      if (known != nullptr && !known->is_output && seen.insert(source).second) open.push_back(source);
    }
  }
  if (ports.erase(test_mode) == 0) return "";
  for (const std::string& port : ports) {
    const int low = PortValues(netlist, library, drivers, {{test_mode, true}, {port, false}}).value(net);
    const int high = PortValues(netlist, library, drivers, {{test_mode, true}, {port, true}}).value(net);
    if (low < 0 || high < 0 || low == high) continue;
    *inverted = low == 1;
    return port;
  }
  return "";
}

}  // namespace meltstage::dft
