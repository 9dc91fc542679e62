// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/places.hpp"

#include <algorithm>

namespace meltstage::dft {

namespace {

// Name of what a flop drives, else its own.
std::string flop_name(const Netlist& netlist, const CaptureView& view, const ScanFlop& flop) {
  for (const auto& [pin, net] : netlist.instances[flop.instance].pins) {
    const auto node = view.node_of_net.find(net);
    if (node == view.node_of_net.end()) continue;
    const Gate kind = view.circuit.kind(node->second);
    if (kind != Gate::buf && kind != Gate::inv) continue;
    const Node state = view.circuit.fanin(node->second)[0];
    if (view.circuit.kind(state) != Gate::input || view.circuit.name(state) != flop.name) continue;
    if (const auto name = netlist.register_names.find(net); name != netlist.register_names.end())
      return name->second;
  }
  return flop.name;
}

}  // namespace

std::vector<std::string> places_of(const Netlist& netlist, const CaptureView& view) {
  const Circuit& circuit = view.circuit;
  std::vector<std::string> places(circuit.size());
  std::vector<Node> queue;
  const auto place = [&](Node node, const std::string& name) {
    if (!places[node].empty()) return;
    places[node] = name;
    queue.push_back(node);
  };
  std::vector<std::string> names;
  for (const ScanFlop& flop : view.flops) names.push_back(flop_name(netlist, view, flop));
  for (std::size_t k = 0; k < view.flops.size(); ++k)
    places[circuit.inputs()[view.input_ports.size() + k]] = names[k];
  // Buffers and inverters at a flop's output are part of it.
  for (Node node = 0; node < circuit.size(); ++node) {
    if (circuit.kind(node) != Gate::buf && circuit.kind(node) != Gate::inv) continue;
    const Node driver = circuit.fanin(node)[0];
    if (circuit.kind(driver) == Gate::input && !places[driver].empty()) places[node] = places[driver];
  }
  for (std::size_t i = 0; i < view.output_ports.size(); ++i)
    place(circuit.outputs()[i], view.output_ports[i]);
  for (std::size_t k = 0; k < view.flops.size(); ++k)
    place(circuit.outputs()[view.output_ports.size() + k], names[k]);
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const std::string name = places[queue[i]];
    for (const Node driver : circuit.fanin(queue[i])) place(driver, name);
  }
  return places;
}

std::string module_of(const std::string& place) {
  const std::size_t bits = place.find('['), dot = place.rfind('.', bits);
  return dot == std::string::npos ? "(top)" : place.substr(0, dot);
}

std::vector<std::int8_t> still_after_reset(const CaptureView& view, const std::vector<std::uint8_t>& held) {
  const Circuit& circuit = view.circuit;
  const std::size_t ports = view.input_ports.size();
  std::vector<std::int8_t> inputs(circuit.inputs().size(), -1);
  for (std::size_t i = 0; i < ports && !held.empty(); ++i) {
    if (held[i] != 0) inputs[i] = 0;
  }
  for (std::size_t k = 0; k < view.flops.size(); ++k) {
    if (view.flops[k].has_reset) inputs[ports + k] = view.flops[k].reset_value ? 1 : 0;
  }
  std::vector<std::int8_t> lines;
  for (bool more = true; more;) {
    more = false;
    lines = constants(circuit, inputs);
    for (std::size_t k = 0; k < view.flops.size(); ++k) {
      std::int8_t& state = inputs[ports + k];
      if (state < 0 || (!held.empty() && held[ports + k] != 0) ||
          lines[circuit.outputs()[view.output_ports.size() + k]] == state)
        continue;
      state = -1;
      more = true;
    }
  }
  return lines;
}

std::vector<std::uint8_t> leads_only_to(const CaptureView& view, const std::vector<std::uint8_t>& unseen) {
  const Circuit& circuit = view.circuit;
  std::vector<std::uint8_t> only(circuit.size(), 1);
  std::vector<Node> queue;
  const auto seen = [&](Node node) {
    if (only[node] == 0) return;
    only[node] = 0;
    queue.push_back(node);
  };
  for (std::size_t i = 0; i < circuit.outputs().size(); ++i) {
    if (unseen[i] == 0) seen(circuit.outputs()[i]);
  }
  // A reset is no gate's input: what drives one is seen.
  for (const ScanFlop& flop : view.flops) {
    const auto line = flop.has_reset ? view.node_of_net.find(flop.reset) : view.node_of_net.end();
    if (line != view.node_of_net.end()) seen(line->second);
  }
  for (std::size_t i = 0; i < queue.size(); ++i) {
    for (const Node driver : circuit.fanin(queue[i])) seen(driver);
  }
  return only;
}

}  // namespace meltstage::dft
