// SPDX-License-Identifier: Apache-2.0
// From cells to gates: the function of each cell becomes one gate where there is one for it, else a few; pins
// become fault sites.
#include "asic/dft/core/capture_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "base/error.hpp"

namespace meltstage::dft {

namespace {

using Op = Expression::Op;

// An expression in the gates of a circuit: inverters folded into the gate above, nested ANDs joined,
// multiplexers found.
struct Term {
  enum class Kind { pin, gate };
  Kind kind = Kind::pin;
  std::string pin;
  Gate gate = Gate::buf;
  std::vector<Term> args;
};

Term pin_term(std::string name) { return {Term::Kind::pin, std::move(name), Gate::buf, {}}; }
Term gate_term(Gate gate, std::vector<Term> args) { return {Term::Kind::gate, "", gate, std::move(args)}; }

Gate inverse(Gate gate) {
  switch (gate) {
    case Gate::tie0:
      return Gate::tie1;
    case Gate::tie1:
      return Gate::tie0;
    case Gate::buf:
      return Gate::inv;
    case Gate::inv:
      return Gate::buf;
    case Gate::all:
      return Gate::nall;
    case Gate::nall:
      return Gate::all;
    case Gate::any:
      return Gate::none;
    case Gate::none:
      return Gate::any;
    case Gate::parity:
      return Gate::same;
    default:
      return Gate::parity;  // same
  }
}

Term inverted(Term term) {
  if (term.kind == Term::Kind::pin || term.gate == Gate::mux) return gate_term(Gate::inv, {std::move(term)});
  if (term.gate == Gate::inv) return std::move(term.args[0]);
  term.gate = inverse(term.gate);
  return term;
}

bool is_inverse_pin(const Expression& e, const std::string& pin) {
  return e.op == Op::inv && e.args[0].op == Op::pin && e.args[0].pin == pin;
}

Term term_of(const Expression& e);

// A!S + BS in any order: the multiplexer of A and B by S.
std::optional<Term> mux_of(const Expression& e) {
  if (e.op != Op::any || e.args.size() != 2) return std::nullopt;
  const Expression &left = e.args[0], &right = e.args[1];
  if (left.op != Op::all || right.op != Op::all || left.args.size() != 2 || right.args.size() != 2)
    return std::nullopt;
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Expression &a = left.args[i], &b = right.args[k];
      if (a.op == Op::pin && is_inverse_pin(b, a.pin))
        return gate_term(Gate::mux, {term_of(right.args[1 - k]), term_of(left.args[1 - i]), pin_term(a.pin)});
      if (b.op == Op::pin && is_inverse_pin(a, b.pin))
        return gate_term(Gate::mux, {term_of(left.args[1 - i]), term_of(right.args[1 - k]), pin_term(b.pin)});
    }
  }
  return std::nullopt;
}

Term term_of(const Expression& e) {
  switch (e.op) {
    case Op::zero:
      return gate_term(Gate::tie0, {});
    case Op::one:
      return gate_term(Gate::tie1, {});
    case Op::pin:
      return pin_term(e.pin);
    case Op::inv:
      return inverted(term_of(e.args[0]));
    default:
      break;
  }
  if (auto mux = mux_of(e)) return *mux;
  const Gate gate = e.op == Op::all ? Gate::all : e.op == Op::any ? Gate::any : Gate::parity;
  std::vector<Term> args;
  for (const Expression& arg : e.args) {
    Term term = term_of(arg);
    if (term.kind == Term::Kind::gate && term.gate == gate)
      args.insert(args.end(), term.args.begin(), term.args.end());
    else
      args.push_back(std::move(term));
  }
  return gate_term(gate, std::move(args));
}

void count_pins(const Term& term, std::map<std::string, int>& uses) {
  if (term.kind == Term::Kind::pin) ++uses[term.pin];
  for (const Term& arg : term.args) count_pins(arg, uses);
}

// Stands for the clock gates before a flop: 1 when they let the clock pass.
constexpr char kOpen[] = "(clock gate open)";

// What a flop has in its state after a clock (or in asynchronous reset). Behind closed clock gates it keeps
// its state.
Term captured(const Flop& flop, bool gated) {
  Term next = term_of(flop.next_state);
  if (gated) next = gate_term(Gate::mux, {pin_term(flop.state), std::move(next), pin_term(kOpen)});
  if (flop.clear) next = gate_term(Gate::all, {std::move(next), inverted(term_of(*flop.clear))});
  if (flop.preset) next = gate_term(Gate::any, {std::move(next), term_of(*flop.preset)});
  return next;
}

void pins_of(const Expression& e, std::vector<std::string>& names) {
  if (e.op == Op::pin) names.push_back(e.pin);
  for (const Expression& arg : e.args) pins_of(arg, names);
}

class ViewBuilder {
 public:
  ViewBuilder(const Netlist& netlist, const CellLibrary& library, const HeldPorts& held)
      : netlist_(netlist), library_(library), held_(held) {}

  CaptureView build() {
    for (const Instance& instance : netlist_.instances) cells_.push_back(&cell_of(instance));
    add_input_ports();
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (cells_[i]->flop) add_state(i);
    }
    for (std::size_t i = 0; i < cells_.size(); ++i) add_outputs(i);
    find_clock_cells();
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (!cells_[i]->flop) connect(i);
    }
    add_output_ports();
    for (std::size_t k = 0; k < view_.flops.size(); ++k) connect_flop(k);
    mark_clocks();
    find_stopped();
    std::vector<Node> number;
    view_.circuit = builder_.finish(netlist_.file, &number);
    require_one_edge();
    for (const auto& [net, node] : driver_) view_.node_of_net[net] = number[node];
    return std::move(view_);
  }

 private:
  struct Driven {
    const CellPin* pin;
    Term term;
    Node node;
  };

  const Cell& cell_of(const Instance& instance) const {
    const auto found = library_.find(instance.type);
    if (found == library_.end())
      throw UserError(
          fmt::format("{}: cell {}: found type {}, expected a cell of the library; map the netlist to it",
                      netlist_.file, instance.name, instance.type));
    const Cell& cell = found->second;
    if (!cell.defect.empty())
      throw UserError(
          fmt::format("{}; {} uses {} as {}", cell.defect, netlist_.file, instance.type, instance.name));
    if (cell.has_latch)
      throw UserError(fmt::format("{}: cell {}: found {}, a latch, expected flops and gates; replace it",
                                  netlist_.file, instance.name, instance.type));
    for (const auto& [pin, net] : instance.pins) {
      if (cell.find(pin) == nullptr)
        throw UserError(fmt::format(
            "{}: cell {}: found pin {}, which {} does not have; use the library the netlist was mapped to",
            netlist_.file, instance.name, pin, instance.type));
    }
    return cell;
  }
  void drive(Net net, Node node, const std::string& by) {
    if (net == 0 || net == 1)
      throw UserError(fmt::format("{}: {}: found the constant {} as what it drives, expected a net",
                                  netlist_.file, by, net));
    if (net < 2) return;
    if (!driver_.emplace(net, node).second)
      throw UserError(fmt::format("{}: net {}: found a second driver {}, expected one", netlist_.file,
                                  net_name(net), by));
  }
  std::string net_name(Net net) const {
    const auto found = netlist_.net_names.find(net);
    return found == netlist_.net_names.end() ? fmt::format("{}", net) : found->second;
  }
  Node constant(bool one) {
    Node& node = constants_[one ? 1 : 0];
    if (node == kNoNode) node = builder_.add(one ? Gate::tie1 : Gate::tie0, {}, one ? "1" : "0");
    return node;
  }
  Node node_of(Net net, const std::string& reader) {
    if (net == 0 || net == 1) return constant(net == 1);
    const auto found = driver_.find(net);
    if (found == driver_.end())
      throw UserError(
          fmt::format("{}: {}: found no driver of net {}, expected one; unknown values can't be tested",
                      netlist_.file, reader, net == kUnknownNet ? "x" : net_name(net)));
    return found->second;
  }

  void add_input_ports() {
    HeldPorts unknown = held_;
    for (const Port& port : netlist_.ports) {
      if (!port.is_input) continue;
      for (std::size_t i = 0; i < port.bits.size(); ++i) {
        const std::string name = port.bit_name(i);
        const Node node = builder_.add(Gate::input, {}, name);
        drive(port.bits[i], node, "port " + name);
        port_node_[port.bits[i]] = view_.input_ports.size();
        port_site_.push_back(builder_.site_count());
        builder_.add_site({name, node, kStem});
        view_.input_ports.push_back(name);
        if (const auto held = held_.find(name); held != held_.end()) builder_.hold(node, held->second);
        unknown.erase(name);
      }
    }
    view_.clock_ports.assign(view_.input_ports.size(), 0);
    if (!unknown.empty())
      throw UserError(fmt::format("{}: found no input port {}, expected one to hold", netlist_.file,
                                  unknown.begin()->first));
  }

  // The flop as its instance has it: a reset that is tied off is none.
  Flop flop_of(std::size_t i) const {
    const Instance& instance = netlist_.instances[i];
    Flop flop = *cells_[i]->flop;
    for (std::optional<Expression>* const reset : {&flop.clear, &flop.preset}) {
      if (!*reset) continue;
      std::vector<std::string> names;
      pins_of(**reset, names);
      if (!is_pin_or_inverse(**reset))
        throw UserError(fmt::format(
            "{}: {}: found a {} of more than one pin or its inverse, expected one of both; {} uses it as {}",
            cells_[i]->where, instance.type, reset == &flop.clear ? "clear" : "preset", netlist_.file,
            instance.name));
      const auto net = names.size() == 1 ? instance.pins.find(names[0]) : instance.pins.end();
      if (net == instance.pins.end() || net->second > 1) continue;
      if ((net->second == 0) == ((*reset)->op == Op::inv))
        throw UserError(
            fmt::format("{}: {}: found {} tied to {}, which resets the flop for ever, expected it tied to "
                        "the other level",
                        netlist_.file, instance.name, names[0], net->second));
      reset->reset();
    }
    if (flop.clear && flop.preset)
      throw UserError(fmt::format(
          "{}: {}: found a clear and a preset that are both in use, expected one of them tied off",
          netlist_.file, instance.name));
    return flop;
  }

  void add_state(std::size_t i) {
    const Instance& instance = netlist_.instances[i];
    const Flop flop = flop_of(i);
    ScanFlop entry;
    entry.instance = i;
    entry.name = instance.name;
    entry.has_reset = flop.clear || flop.preset;
    entry.reset_value = flop.preset.has_value();
    std::vector<std::string> clock_pins;
    pins_of(flop.clocked_on, clock_pins);
    if (clock_pins.size() == 1 && instance.pins.count(clock_pins[0]) != 0)
      entry.clock = instance.pins.at(clock_pins[0]);
    if (entry.has_reset) {
      const Expression& reset = flop.clear ? *flop.clear : *flop.preset;
      std::vector<std::string> names;
      pins_of(reset, names);
      if (names.size() == 1 && instance.pins.count(names[0]) != 0) {
        entry.reset = instance.pins.at(names[0]);
        entry.reset_low = reset.op == Op::inv;
      }
    }
    state_.push_back(builder_.add(Gate::input, {}, instance.name));
    state_of_[i] = state_.back();
    view_.flops.push_back(std::move(entry));
  }

  // The gate of every output pin; its fan-in follows once all drivers are known.
  void add_outputs(std::size_t i) {
    const Instance& instance = netlist_.instances[i];
    const Cell& cell = *cells_[i];
    if (cell.flop) {
      const Node state = state_[flop_index_++];
      for (const CellPin& pin : cell.pins) {
        const auto net = instance.pins.find(pin.name);
        if (!pin.is_output || net == instance.pins.end()) continue;
        if (!pin.function || pin.function->op == Op::zero) continue;
        const Term term = term_of(*pin.function);
        const bool plain = term.kind == Term::Kind::pin && term.pin == cell.flop->state;
        const bool inverse_state =
            (term.kind == Term::Kind::pin && term.pin == cell.flop->state_n) ||
            (term.kind == Term::Kind::gate && term.gate == Gate::inv && term.args[0].pin == cell.flop->state);
        if (!plain && !inverse_state)
          throw UserError(fmt::format(
              "{}: found an output {} of {} that is not the state, expected it or its inverse; {} "
              "uses it as {}",
              cell.where, pin.name, instance.type, netlist_.file, instance.name));
        const Node node =
            builder_.add(plain ? Gate::buf : Gate::inv, {state}, instance.name + "/" + pin.name);
        builder_.add_site({instance.name + "/" + pin.name, node, kStem});
        drive(net->second, node, instance.name);
      }
      return;
    }
    if (cell.gate) {
      add_clock_gate(i);
      return;
    }
    for (const CellPin& pin : cell.pins) {
      const auto net = instance.pins.find(pin.name);
      if (!pin.is_output || net == instance.pins.end()) continue;
      if (!pin.function)
        throw UserError(fmt::format("{}: found no function of {} of {}, expected one; {} uses it as {}",
                                    cell.where, pin.name, instance.type, netlist_.file, instance.name));
      Term term = term_of(*pin.function);
      const Gate gate = term.kind == Term::Kind::pin ? Gate::buf : term.gate;
      const Node node = builder_.add(gate, {}, instance.name + "/" + pin.name);
      builder_.add_site({instance.name + "/" + pin.name, node, kStem});
      drive(net->second, node, instance.name);
      driven_[i].push_back({&pin, std::move(term), node});
    }
  }

  // A clock gate is whether it is open, which the flops behind it read; its clock stands still at 0 while the
  // circuit is looked at. A gate that is dead stops the flops behind it.
  void add_clock_gate(std::size_t i) {
    const Instance& instance = netlist_.instances[i];
    const ClockGate& gate = *cells_[i]->gate;
    open_of_[i] = builder_.add(gate.test.empty() ? Gate::buf : Gate::any, {}, instance.name);
    const auto net = instance.pins.find(gate.out);
    if (net == instance.pins.end()) return;
    drive(net->second, constant(false), instance.name);
    builder_.add_site({instance.name + "/" + gate.out, kNoNode, kStem});
  }
  void connect_clock_gate(std::size_t i) {
    const ClockGate& gate = *cells_[i]->gate;
    Term open = pin_term(gate.enable);
    if (!gate.test.empty()) open = gate_term(Gate::any, {std::move(open), pin_term(gate.test)});
    uses_.clear();
    pin_buffers_.clear();
    count_pins(open, uses_);
    fill(open_of_.at(i), open, i);
    add_idle_pins(i);
  }

  // Fan-in of `node` from the arguments of `term`; a pin that is read once is a branch there, else it gets a
  // buffer of its own.
  void fill(Node node, const Term& term, std::size_t i) {
    std::vector<Node> fanin;
    const std::vector<Term> self{term};
    const std::vector<Term>& args = term.kind == Term::Kind::pin ? self : term.args;
    for (const Term& arg : args) {
      if (arg.kind == Term::Kind::pin)
        fanin.push_back(pin_node(arg.pin, i, node, static_cast<std::int32_t>(fanin.size())));
      else {
        const Node inner = builder_.add(arg.gate, {}, builder_name(i));
        fill(inner, arg, i);
        fanin.push_back(inner);
      }
    }
    builder_.set_fanin(node, std::move(fanin));
  }
  std::string builder_name(std::size_t i) const { return netlist_.instances[i].name; }
  Node pin_node(const std::string& pin, std::size_t i, Node reader, std::int32_t position) {
    const Instance& instance = netlist_.instances[i];
    if (cells_[i]->flop && pin == cells_[i]->flop->state)
      return state_of_.at(i);  // an enable keeps the state
    if (cells_[i]->flop && pin == cells_[i]->flop->state_n)
      return builder_.add(Gate::inv, {state_of_.at(i)}, netlist_.instances[i].name);
    if (pin == kOpen) return open_node(gates_before_.at(i));
    if (const auto known = pin_buffers_.find(pin); known != pin_buffers_.end()) return known->second;
    const auto net = instance.pins.find(pin);
    const std::string name = instance.name + "/" + pin;
    if (net == instance.pins.end())
      throw UserError(fmt::format("{}: {}: found nothing connected, expected a net", netlist_.file, name));
    const Node source = node_of(net->second, name);
    Site site{name, reader, position};
    site.shifts = cells_[i]->scan && pin == cells_[i]->scan->in;
    if (uses_[pin] == 1) {
      builder_.add_site(std::move(site));
      return source;
    }
    const Node buffer = builder_.add(Gate::buf, {source}, name);
    pin_buffers_[pin] = buffer;
    site.node = buffer;
    site.pin = kStem;
    builder_.add_site(std::move(site));
    return buffer;
  }

  void connect(std::size_t i) {
    if (cells_[i]->gate) {
      connect_clock_gate(i);
      return;
    }
    uses_.clear();
    pin_buffers_.clear();
    for (const Driven& driven : driven_[i]) count_pins(driven.term, uses_);
    for (const Driven& driven : driven_[i]) fill(driven.node, driven.term, i);
    add_idle_pins(i);
  }
  // Pins no function reads: no test can see them.
  void add_idle_pins(std::size_t i) {
    const Instance& instance = netlist_.instances[i];
    for (const CellPin& pin : cells_[i]->pins) {
      if (pin.is_output || instance.pins.count(pin.name) == 0 || uses_.count(pin.name) != 0) continue;
      builder_.add_site({instance.name + "/" + pin.name, kNoNode, kStem});
    }
  }

  void connect_flop(std::size_t k) {
    const std::size_t i = view_.flops[k].instance;
    uses_.clear();
    pin_buffers_.clear();
    gates_before_[i] = clock_of(view_.flops[k].clock).gates;
    const Term term = captured(flop_of(i), !gates_before_[i].empty());
    count_pins(term, uses_);
    const Node node = builder_.add(Gate::output, {}, view_.flops[k].name);
    if (term.kind == Term::Kind::pin) {
      fill(node, term, i);
    } else {
      const Node gate = builder_.add(term.gate, {}, view_.flops[k].name);
      fill(gate, term, i);
      builder_.set_fanin(node, {gate});
    }
    add_idle_pins(i);
  }

  void add_output_ports() {
    for (const Port& port : netlist_.ports) {
      if (port.is_input) continue;
      for (std::size_t i = 0; i < port.bits.size(); ++i) {
        const std::string name = port.bit_name(i);
        const Node node = builder_.add(Gate::output, {node_of(port.bits[i], "port " + name)}, name);
        builder_.add_site({name, node, 0});
        view_.output_ports.push_back(name);
      }
    }
  }

  // Clock pins lie outside the circuit; what leads to them must be a port, buffers, inverters and clock
  // gates.
  void find_clock_cells() {
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (cells_[i]->gate) {
        const auto out = netlist_.instances[i].pins.find(cells_[i]->gate->out);
        if (out != netlist_.instances[i].pins.end()) clock_cell_[out->second] = i;
      }
      if (cells_[i]->flop || driven_[i].size() != 1) continue;
      const Term& term = driven_[i][0].term;
      if (term.kind == Term::Kind::pin || term.gate == Gate::inv || term.gate == Gate::buf)
        clock_cell_[netlist_.instances[i].pins.at(driven_[i][0].pin->name)] = i;
    }
  }
  struct ClockWay {
    Net source;
    std::vector<std::size_t> gates;  // from the flop on
    bool inverts = false;
  };
  ClockWay clock_of(Net net) const {
    ClockWay way{net, {}};
    std::size_t steps = 0;
    for (auto at = clock_cell_.find(net); at != clock_cell_.end() && steps <= cells_.size();
         at = clock_cell_.find(way.source), ++steps) {
      const std::size_t i = at->second;
      if (cells_[i]->gate) way.gates.push_back(i);
      if (!cells_[i]->gate && driven_.at(i)[0].term.kind == Term::Kind::gate)
        way.inverts ^= driven_.at(i)[0].term.gate == Gate::inv;
      for (const auto& [pin, source] : netlist_.instances[i].pins) {
        const bool leads = cells_[i]->gate ? pin == cells_[i]->gate->clock : !cells_[i]->find(pin)->is_output;
        if (leads) way.source = source;
      }
    }
    return way;
  }
  Node open_node(const std::vector<std::size_t>& gates) {
    if (gates.size() == 1) return open_of_.at(gates[0]);
    const auto [known, fresh] = open_of_all_.emplace(gates, kNoNode);
    if (fresh) {
      std::vector<Node> opens;
      for (const std::size_t i : gates) opens.push_back(open_of_.at(i));
      known->second = builder_.add(Gate::all, std::move(opens), netlist_.instances[gates[0]].name);
    }
    return known->second;
  }
  void mark_clocks() {
    const ScanFlop* first = nullptr;
    for (const ScanFlop& flop : view_.flops) {
      const auto port = port_node_.find(clock_of(flop.clock).source);
      if (port == port_node_.end())
        throw UserError(
            fmt::format("{}: cell {}: found clock net {} driven by logic, expected an input port through "
                        "buffers and clock gates; bypass "
                        "it in test mode",
                        netlist_.file, flop.name, net_name(flop.clock)));
      if (view_.clock_ports[port->second] != 0) continue;
      if (first != nullptr)
        throw UserError(fmt::format(
            "{}: cell {}: found a flop clocked by {}, where that of {} is another; expected one clock",
            netlist_.file, flop.name, view_.input_ports[port->second], first->name));
      first = &flop;
      view_.clock_ports[port->second] = 1;
      builder_.hold(builder_.site(port_site_[port->second]).node,
                    false);  // outputs are compared and states captured while the clock is low
    }
  }

  bool captures_at_fall(std::size_t k) const {
    const ScanFlop& flop = view_.flops[k];
    return clock_of(flop.clock).inverts != (cells_[flop.instance]->flop->clocked_on.op == Op::inv);
  }
  // In the view all flops capture at once. One of the falling edge does so unless it reads what the rising
  // edge of the same cycle has changed.
  void require_one_edge() const {
    const Circuit& circuit = view_.circuit;
    const std::size_t ports = view_.input_ports.size();
    std::unordered_map<Node, std::size_t> rising;  // flop by its state
    std::vector<std::size_t> falling;
    for (std::size_t k = 0; k < view_.flops.size(); ++k) {
      if (captures_at_fall(k))
        falling.push_back(k);
      else
        rising.emplace(circuit.inputs()[ports + k], k);
    }
    if (rising.empty()) return;
    std::vector<bool> seen(circuit.size());
    for (const std::size_t k : falling) {
      std::vector<Node> ahead{circuit.outputs()[view_.output_ports.size() + k]};
      while (!ahead.empty()) {
        const Node node = ahead.back();
        ahead.pop_back();
        if (seen[node]) continue;
        seen[node] = true;
        if (const auto read = rising.find(node); read != rising.end())
          throw UserError(
              fmt::format("{}: cell {}: found a flop of the clock's falling edge that reads {}, which the "
                          "rising edge of the "
                          "same cycle changes; expected flops of one edge",
                          netlist_.file, view_.flops[k].name, view_.flops[read->second].name));
        for (const Node fanin : circuit.fanin(node)) ahead.push_back(fanin);
      }
    }
  }

  // A clock's line that is stuck stops every flop behind it.
  void find_stopped() {
    std::unordered_map<std::string_view, std::size_t> sites;
    for (std::size_t i = 0; i < builder_.site_count(); ++i) sites.emplace(builder_.site(i).name, i);
    for (std::size_t k = 0; k < view_.flops.size(); ++k) {
      for (const std::string& line : clock_lines(k)) {
        if (const auto site = sites.find(line); site != sites.end()) view_.stopped[site->second].push_back(k);
      }
    }
  }
  // Pins and port by which the clock comes to a flop.
  std::vector<std::string> clock_lines(std::size_t k) const {
    const Instance& flop = netlist_.instances[view_.flops[k].instance];
    std::vector<std::string> pins;
    pins_of(cells_[view_.flops[k].instance]->flop->clocked_on, pins);
    std::vector<std::string> lines;
    for (const std::string& pin : pins) lines.push_back(flop.name + "/" + pin);
    Net net = view_.flops[k].clock;
    std::size_t steps = 0;
    for (auto at = clock_cell_.find(net); at != clock_cell_.end() && steps <= cells_.size();
         at = clock_cell_.find(net), ++steps) {
      const std::size_t i = at->second;
      for (const auto& [pin, connected] : netlist_.instances[i].pins) {
        const bool out = cells_[i]->find(pin)->is_output;
        if (out || !cells_[i]->gate || pin == cells_[i]->gate->clock)
          lines.push_back(netlist_.instances[i].name + "/" + pin);
        if (!out && (!cells_[i]->gate || pin == cells_[i]->gate->clock)) net = connected;
      }
    }
    if (const auto port = port_node_.find(net); port != port_node_.end())
      lines.push_back(view_.input_ports[port->second]);
    return lines;
  }

  const Netlist& netlist_;
  const CellLibrary& library_;
  const HeldPorts& held_;
  CircuitBuilder builder_;
  CaptureView view_;
  std::vector<const Cell*> cells_;
  std::vector<Node> state_;
  std::unordered_map<std::size_t, Node> state_of_;  // by instance
  std::size_t flop_index_ = 0;
  std::unordered_map<Net, Node> driver_;
  std::unordered_map<Net, std::size_t> port_node_;
  std::vector<std::size_t> port_site_;
  std::unordered_map<std::size_t, std::vector<Driven>> driven_;
  std::unordered_map<Net, std::size_t> clock_cell_;  // buffer, inverter or clock gate that drives a net
  std::unordered_map<std::size_t, Node> open_of_;    // by clock gate
  std::map<std::vector<std::size_t>, Node> open_of_all_;
  std::unordered_map<std::size_t, std::vector<std::size_t>> gates_before_;  // by flop
  std::map<std::string, int> uses_;
  std::map<std::string, Node> pin_buffers_;
  Node constants_[2] = {kNoNode, kNoNode};
};

}  // namespace

CaptureView capture_view(const Netlist& netlist, const CellLibrary& library, const HeldPorts& held) {
  require_directions(netlist, library);
  return ViewBuilder(netlist, library, held).build();
}

bool resets_by(const CaptureView& view, std::size_t flop, Node node, std::int32_t pin) {
  if (pin == kStem || !view.flops[flop].has_reset) return false;
  const auto reset = view.node_of_net.find(view.flops[flop].reset);
  if (reset == view.node_of_net.end()) return false;
  if (view.circuit.fanin(node)[static_cast<std::size_t>(pin)] != reset->second) return false;
  const Node capture = view.circuit.outputs()[view.output_ports.size() + flop];
  while (node != capture && view.circuit.name(node) == view.flops[flop].name &&
         view.circuit.fanout(node).size() == 1)
    node = view.circuit.fanout(node)[0];
  return node == capture;
}

}  // namespace meltstage::dft
