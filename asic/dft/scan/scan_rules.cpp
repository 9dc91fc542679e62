// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <set>

#include "asic/dft/scan/drivers.hpp"
#include "asic/dft/scan/scan.hpp"
#include "asic/dft/scan/scan_cells.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

namespace {

using Op = Expression::Op;

void add_names(const Expression& e, std::set<std::string>& names) {
  if (e.op == Op::pin) names.insert(e.pin);
  for (const Expression& arg : e.args) add_names(arg, names);
}

// Input pins that what the cell does hangs on. A clock gate gets its test enable by scan insertion.
std::set<std::string> pins_read(const Instance& instance, const Cell& cell) {
  std::set<std::string> names;
  if (cell.has_latch || !cell.defect.empty()) return names;
  if (cell.gate) return {cell.gate->clock, cell.gate->enable};
  if (cell.flop) {
    for (const auto& e : {std::optional(cell.flop->next_state), std::optional(cell.flop->clocked_on),
                          cell.flop->clear, cell.flop->preset}) {
      if (e) add_names(*e, names);
    }
    names.erase(cell.flop->state);
    names.erase(cell.flop->state_n);
    return names;
  }
  for (const CellPin& pin : cell.pins) {
    if (pin.is_output && pin.function && instance.pins.count(pin.name) != 0) add_names(*pin.function, names);
  }
  return names;
}

// What is connected to no net, to no pin of the cell, or to a net that something else drives.
void check_connections(const Netlist& netlist, const CellLibrary& library,
                       const std::function<std::string(Net)>& net_name,
                       std::vector<RuleViolation>& violations) {
  std::map<Net, std::string> driver;
  const auto drive = [&](Net net, const std::string& by) {
    if (net == 0 || net == 1)
      violations.push_back({"driven constant", by, fmt::format("it drives the constant {}", net)});
    if (net < 2) return;
    const auto [first, is_new] = driver.emplace(net, by);
    if (!is_new)
      violations.push_back(
          {"several drivers", "net " + net_name(net), fmt::format("{} and {} drive it", first->second, by)});
  };
  for (const Port& port : netlist.ports) {
    for (std::size_t i = 0; port.is_input && i < port.bits.size(); ++i)
      drive(port.bits[i], "port " + port.bit_name(i));
  }
  std::set<std::string> told;
  for (const Instance& instance : netlist.instances) {
    const Cell* const cell = find_cell(library, instance.type);
    if (cell == nullptr) continue;
    if (!cell->defect.empty() && told.insert(instance.type).second)
      violations.push_back({"defect of the library", instance.type, cell->defect});
    for (const auto& [pin, net] : instance.pins) {
      const CellPin* const known = cell->find(pin);
      if (known == nullptr)
        violations.push_back(
            {"unknown pin", instance.name + "/" + pin, fmt::format("{} has no such pin", instance.type)});
      else if (known->is_output)
        drive(net, instance.name + "/" + pin);
    }
    for (const std::string& pin : pins_read(instance, *cell)) {
      if (instance.pins.count(pin) == 0)
        violations.push_back({"unconnected pin", instance.name + "/" + pin, "nothing is connected to it"});
    }
  }
}

// No reset, or one that a constant keeps away.
bool is_tied_off(const Instance& instance, const std::optional<Expression>& reset) {
  if (!reset) return true;
  const auto net = instance.pins.find(only_pin(*reset));
  return net != instance.pins.end() && net->second == (reset->op == Op::inv ? 1 : 0);
}

// What scan insertion mends, or what is told though it keeps nobody from testing.
bool is_mild(const RuleViolation& violation) {
  return violation.rule == "no reset" || violation.rule == "closed clock gate" ||
         violation.rule == "uncontrollable reset";
}

// Why no tests can be generated for the netlist; empty when they can.
std::string refusal(const Netlist& netlist, const CellLibrary& library, const ScanOptions& options) {
  bool flops = false, scanned = false;
  for (const Instance& instance : netlist.instances) {
    const Cell* const cell = find_cell(library, instance.type);
    flops = flops || (cell != nullptr && cell->flop);
    scanned = scanned || (cell != nullptr && cell->flop && cell->scan);
  }
  try {
    if (flops && !scanned)
      scan_view(insert_scan(netlist, library, options), library);
    else
      capture_view(netlist, library);
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

std::vector<RuleViolation> check_rules(const Netlist& netlist, const CellLibrary& library,
                                       const ScanOptions& options) {
  std::vector<RuleViolation> violations;
  const Drivers drivers(netlist, library);
  const auto net_name = [&](Net net) {
    const auto found = netlist.net_names.find(net);
    return net == kUnknownNet                 ? std::string("x")
           : found == netlist.net_names.end() ? fmt::format("{}", net)
                                              : found->second;
  };
  check_connections(netlist, library, net_name, violations);
  std::map<Net, bool> judged;  // resets
  const auto controllable = [&](Net net) {
    const auto [entry, fresh] = judged.emplace(net, true);
    bool inverted = false;
    if (fresh)
      entry->second = net == 0 || net == 1 || !drivers.port_of(net).empty() ||
                      !bypass_of(netlist, library, drivers, net, options.test_mode, &inverted).empty();
    return entry->second;
  };
  std::map<std::string, std::string> clocks;
  for (const Instance& instance : netlist.instances) {
    const Cell* cell = find_cell(library, instance.type);
    if (cell == nullptr) {
      violations.push_back(
          {"unknown cell", instance.name, fmt::format("type {} is not in the library", instance.type)});
      continue;
    }
    if (cell->has_latch)
      violations.push_back(
          {"latch", instance.name, fmt::format("{} keeps a state that no chain sets", instance.type)});
    for (const auto& [pin, net] : instance.pins) {
      const CellPin* known = cell->find(pin);
      if (known != nullptr && !known->is_output && !drivers.is_driven(net))
        violations.push_back(
            {"X source", instance.name + "/" + pin, fmt::format("net {} has no driver", net_name(net))});
    }
    if (cell->gate) {
      const auto test = instance.pins.find(cell->gate->test);
      if (test == instance.pins.end() || drivers.port_of(test->second) != options.scan_enable)
        violations.push_back({"closed clock gate", instance.name,
                              testable_form(library, *cell) == nullptr
                                  ? "no clock gate of the library has a test enable"
                                  : "the scan enable doesn't open it; scan insertion lets it"});
    }
    if (!cell->flop) continue;
    const std::string clock_pin = only_pin(cell->flop->clocked_on);
    const bool clocked = instance.pins.count(clock_pin) != 0;
    bool inverted = false;
    const std::string clock = clocked ? drivers.port_of(instance.pins.at(clock_pin), &inverted) : "";
    if (clocked && clock.empty())
      violations.push_back({"uncontrollable clock", instance.name, "its clock comes from logic"});
    if (!clock.empty() && inverted != (cell->flop->clocked_on.op == Op::inv))
      violations.push_back({"falling edge", instance.name, "it is clocked by the other edge of " + clock});
    if (!clock.empty()) clocks.emplace(clock, instance.name);
    if (is_tied_off(instance, cell->flop->clear) && is_tied_off(instance, cell->flop->preset))
      violations.push_back({"no reset", instance.name, "its state after power-up is unknown"});
    for (const auto& reset : {cell->flop->clear, cell->flop->preset}) {
      if (!reset) continue;
      const std::string pin = only_pin(*reset);
      if (!pin.empty() && instance.pins.count(pin) == 0) continue;  // nothing is connected
      if (pin.empty() || !controllable(instance.pins.at(pin)))
        violations.push_back({"uncontrollable reset", instance.name,
                              "its asynchronous reset comes from logic; scan insertion bypasses it"});
    }
  }
  for (const Port& port : netlist.ports)
    for (std::size_t i = 0; !port.is_input && i < port.bits.size(); ++i)
      if (!drivers.is_driven(port.bits[i]))
        violations.push_back({"X source", "port " + port.bit_name(i),
                              fmt::format("net {} has no driver", net_name(port.bits[i]))});
  if (clocks.size() > 1)
    violations.push_back({"several clocks", std::next(clocks.begin())->second,
                          fmt::format("it is clocked by {}, others by {}", std::next(clocks.begin())->first,
                                      clocks.begin()->first)});
  try {
    capture_view(netlist, library);
  } catch (const UserError& error) {
    if (std::string(error.what()).find("loop") != std::string::npos)
      violations.push_back({"combinational loop", netlist.top, error.what()});
  }
  if (std::all_of(violations.begin(), violations.end(), is_mild)) {
    const std::string reason = refusal(netlist, library, options);
    if (!reason.empty()) violations.push_back({"no tests", netlist.top, reason});
  }
  return violations;
}

}  // namespace meltstage::dft
