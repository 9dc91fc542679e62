// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/scan_ways.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <unordered_map>

#include "asic/dft/scan/scan.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

ScanDesign scanned_design(const Netlist& netlist, const CaptureView& view, std::vector<ScanChain> chains) {
  const ScanOptions names;
  const auto has = [&](const std::string& name) {
    return std::find(view.input_ports.begin(), view.input_ports.end(), name) != view.input_ports.end();
  };
  if (!has(names.test_mode) || !has(names.scan_enable))
    throw UserError(
        fmt::format("{}: found no ports {} and {}, expected a netlist that `dft generate` has scanned",
                    netlist.file, names.test_mode, names.scan_enable));
  ScanDesign design;
  design.netlist = netlist;
  design.chains = std::move(chains);
  design.test_mode = names.test_mode;
  design.scan_enable = names.scan_enable;
  for (const ScanFlop& flop : view.flops) {
    for (const Port& port : netlist.ports) {
      for (std::size_t i = 0; i < port.bits.size(); ++i) {
        if (!flop.has_reset || !port.is_input || port.bits[i] != flop.reset) continue;
        design.reset = port.bit_name(i);
        design.reset_low = flop.reset_low;
      }
    }
  }
  return design;
}

HeldPorts capture_holds(const ScanDesign& design) {
  HeldPorts held{{design.test_mode, true}, {design.scan_enable, false}};
  if (!design.reset.empty()) held[design.reset] = design.reset_low;
  return held;
}

std::int32_t open_pin(const Circuit& circuit, const std::vector<std::int8_t>& constant, Node node) {
  const auto fanin = circuit.fanin(node);
  switch (circuit.kind(node)) {
    case Gate::output:
    case Gate::buf:
    case Gate::inv:
      return constant[fanin[0]] < 0 ? 0 : -1;
    case Gate::mux: {
      const std::int8_t select = constant[fanin[2]];
      return select >= 0 && constant[fanin[static_cast<std::size_t>(select)]] < 0 ? select : -1;
    }
    case Gate::all:
    case Gate::nall:
    case Gate::any:
    case Gate::none: {
      const bool is_and = circuit.kind(node) == Gate::all || circuit.kind(node) == Gate::nall;
      std::int32_t open = -1;
      for (std::size_t pin = 0; pin < fanin.size(); ++pin) {
        const std::int8_t value = constant[fanin[pin]];
        if (value == (is_and ? 1 : 0)) continue;
        if (value >= 0 || open >= 0) return -1;
        open = static_cast<std::int32_t>(pin);
      }
      return open;
    }
    default:
      return -1;
  }
}

namespace {

// Marks what lies on open ways through a circuit whose constants are known.
class WayMarker {
 public:
  WayMarker(Circuit& circuit, std::vector<std::int8_t> constant)
      : circuit_(circuit), constant_(std::move(constant)) {
    for (std::size_t i = 0; i < circuit.sites().size(); ++i) {
      const Site& site = circuit.sites()[i];
      if (site.node != kNoNode) sites_[key(site.node, site.pin)].push_back(i);
    }
  }
  // Backwards from the input of `node` as long as one input of each gate is free and the others let it pass.
  void from(Node node) {
    while (!circuit_.fanin(node).empty()) {
      const std::int32_t open = open_pin(circuit_, constant_, node);
      if (open < 0) return;
      mark(node, open);
      node = circuit_.fanin(node)[static_cast<std::size_t>(open)];
      mark(node, kStem);
    }
  }

 private:
  static std::uint64_t key(Node node, std::int32_t pin) {
    return (std::uint64_t{node} << 32) | static_cast<std::uint32_t>(pin);
  }
  void mark(Node node, std::int32_t pin) {
    const auto found = sites_.find(key(node, pin));
    if (found == sites_.end()) return;
    for (const std::size_t site : found->second) circuit_.mark_shifting(site);
  }

  Circuit& circuit_;
  std::vector<std::int8_t> constant_;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> sites_;
};

// From the input of a node back along open ways to where they begin, a port or the state of a flop.
struct Origin {
  Node node;
  bool inverted = false;
};
Origin origin_of(const Circuit& circuit, const std::vector<std::int8_t>& constant, Node node) {
  bool inverted = false;
  while (!circuit.fanin(node).empty()) {
    const std::int32_t open = open_pin(circuit, constant, node);
    if (open < 0) return {kNoNode};
    const Gate kind = circuit.kind(node);
    inverted ^= kind == Gate::inv || kind == Gate::nall || kind == Gate::none;
    node = circuit.fanin(node)[static_cast<std::size_t>(open)];
  }
  return {node, inverted};
}

// What is before each output of a view while it shifts.
class ShiftingView {
 public:
  ShiftingView(const CaptureView& view, const ScanOptions& names) : view_(view) {
    const std::vector<Node>& inputs = view.circuit.inputs();
    std::vector<std::int8_t> shifting(inputs.size(), -1);
    for (std::size_t i = 0; i < view.input_ports.size(); ++i) {
      if (view.input_ports[i] == names.scan_enable || view.input_ports[i] == names.test_mode) shifting[i] = 1;
    }
    for (std::size_t i = 0; i < inputs.size(); ++i) input_[inputs[i]] = i;
    constant_ = constants(view.circuit, shifting);
    for (const ScanFlop& flop : view.flops) {  // resets don't act
      const auto node = view.node_of_net.find(flop.reset);
      if (!flop.has_reset || node == view.node_of_net.end()) continue;
      const Origin origin = origin_of(view.circuit, constant_, node->second);
      if (origin.node != kNoNode && input_.at(origin.node) < view.input_ports.size())
        shifting[input_.at(origin.node)] = flop.reset_low != origin.inverted ? 1 : 0;
    }
    constant_ = constants(view.circuit, shifting);
  }

  Origin origin(Node output) const { return origin_of(view_.circuit, constant_, output); }
  /// Ports first, then flops.
  std::size_t input(const Origin& origin) const { return input_.at(origin.node); }

 private:
  const CaptureView& view_;
  std::unordered_map<Node, std::size_t> input_;
  std::vector<std::int8_t> constant_;
};

// The chain that ends at this output port.
ScanChain traced(const std::string& file, const CaptureView& view, const ShiftingView& ways,
                 const std::string& name, const std::string& out) {
  const std::vector<Node>& outputs = view.circuit.outputs();
  ScanChain chain{name, "", out, {}};
  const auto port = std::find(view.output_ports.begin(), view.output_ports.end(), out);
  if (port == view.output_ports.end())
    throw UserError(
        fmt::format("{}: found no output port {}, expected the end of chain {}", file, out, name));
  Node at = outputs[static_cast<std::size_t>(port - view.output_ports.begin())];
  while (chain.in.empty()) {
    const Origin origin = ways.origin(at);
    const std::string before = chain.cells.empty() ? chain.out : chain.cells.back();
    if (origin.node == kNoNode || chain.cells.size() > view.flops.size())
      throw UserError(
          fmt::format("{}: {}: found no open way to one flop or port while scan_en_i is high, "
                      "expected a scan chain",
                      file, before));
    if (origin.inverted) chain.inversions.push_back(chain.cells.size());  // counted from the output
    const std::size_t i = ways.input(origin);
    if (i < view.input_ports.size()) {
      chain.in = view.input_ports[i];
    } else {
      const std::size_t flop = i - view.input_ports.size();
      chain.cells.push_back(view.flops[flop].name);
      at = outputs[view.output_ports.size() + flop];
    }
  }
  std::reverse(chain.cells.begin(), chain.cells.end());
  std::reverse(chain.inversions.begin(), chain.inversions.end());
  for (std::size_t& before : chain.inversions) before = chain.cells.size() - before;
  return chain;
}

}  // namespace

std::map<std::string, std::string> shifted_from(const Netlist& netlist, const CellLibrary& library,
                                                const ScanOptions& names) {
  const CaptureView view = capture_view(netlist, library);
  const ShiftingView ways(view, names);
  const std::size_t ports = view.input_ports.size();
  std::map<std::string, std::string> from;
  for (std::size_t f = 0; f < view.flops.size(); ++f) {
    const Origin origin = ways.origin(view.circuit.outputs()[view.output_ports.size() + f]);
    if (origin.node == kNoNode || origin.inverted || ways.input(origin) < ports) continue;
    from[view.flops[f].name] = view.flops[ways.input(origin) - ports].name;
  }
  return from;
}

std::vector<ScanChain> trace_chains(const Netlist& netlist, const CellLibrary& library,
                                    const ScanOptions& names) {
  const CaptureView view = capture_view(netlist, library);
  const ShiftingView ways(view, names);
  const Port* scan_out = nullptr;
  for (const Port& port : netlist.ports) {
    if (!port.is_input && port.name == names.scan_out) scan_out = &port;
  }
  if (scan_out == nullptr)
    throw UserError(fmt::format("{}: found no output port {}, expected a scanned netlist; give its scan.json",
                                netlist.file, names.scan_out));
  std::vector<ScanChain> chains;
  for (std::size_t bit = 0; bit < scan_out->bits.size(); ++bit)
    chains.push_back(traced(netlist.file, view, ways, fmt::format("chain{}", bit), scan_out->bit_name(bit)));
  return chains;
}

void require_chains(const CycleStream& stream, const CaptureView& view, const std::string& netlist,
                    const ScanOptions& names) {
  const ShiftingView ways(view, names);
  std::set<std::string> shifted;
  for (const ScanChain& chain : stream.chains) {
    const ScanChain own = traced(netlist, view, ways, chain.name, chain.out);
    const auto refuse = [&](const std::string& found, const std::string& expected) {
      throw UserError(fmt::format("{}: chain {}: found {}, expected {}, as {} shifts", stream.title,
                                  chain.name, found, expected, netlist));
    };
    const auto cell = [](const ScanChain& of, std::size_t number) {
      return number < of.cells.size() ? of.cells[number] : "its end";
    };
    for (std::size_t i = 0; i < std::max(chain.cells.size(), own.cells.size()); ++i) {
      if (cell(chain, i) != cell(own, i))
        refuse(fmt::format("{} as cell {}", cell(chain, i), i + 1), cell(own, i));
    }
    if (chain.in != own.in) refuse("the input " + chain.in, own.in);
    const std::vector<std::uint8_t> found = chain.inverses(), expected = own.inverses();
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i] != expected[i])
        refuse(fmt::format("{} {}", cell(chain, i),
                           found[i] != 0 ? "inverse to what is shifted in" : "as shifted in"),
               expected[i] != 0 ? "the inverse" : "no inversion");
    }
    for (const std::string& name : chain.cells) {
      if (!shifted.insert(name).second)
        throw UserError(fmt::format("{}: chain {}: found cell {} again, expected each cell once",
                                    stream.title, chain.name, name));
    }
  }
  for (const ScanFlop& flop : view.flops) {
    if (shifted.count(flop.name) == 0)
      throw UserError(fmt::format("{}: found no chain with flop {}, expected each flop of {} in one",
                                  stream.title, flop.name, netlist));
  }
}

CaptureView scan_view(const ScanDesign& design, const CellLibrary& library) {
  CaptureView view = capture_view(design.netlist, library, capture_holds(design));
  std::vector<std::int8_t> shifting = view.circuit.held();
  for (std::size_t i = 0; i < view.input_ports.size(); ++i) {
    if (view.input_ports[i] == design.scan_enable) shifting[i] = 1;
  }
  WayMarker chain(view.circuit, constants(view.circuit, shifting));
  for (std::size_t f = 0; f < view.flops.size(); ++f)
    chain.from(view.circuit.outputs()[view.output_ports.size() + f]);
  for (std::size_t o = 0; o < view.output_ports.size(); ++o) {
    const bool scan_out = std::any_of(design.chains.begin(), design.chains.end(),
                                      [&](const ScanChain& c) { return c.out == view.output_ports[o]; });
    if (scan_out) chain.from(view.circuit.outputs()[o]);
  }
  return view;
}

}  // namespace meltstage::dft
