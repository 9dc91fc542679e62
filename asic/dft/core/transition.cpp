// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/transition.hpp"

namespace meltstage::dft {

namespace {

// Both copies of the circuit's nodes, numbered by the builder.
struct Frames {
  std::vector<Node> first, second;
};

Frames add_frames(const CaptureView& view, CircuitBuilder& builder) {
  const Circuit& circuit = view.circuit;
  Frames frames{std::vector<Node>(circuit.size(), kNoNode), std::vector<Node>(circuit.size(), kNoNode)};
  const auto copy = [&](Node node, const std::vector<Node>& of) {
    std::vector<Node> fanin;
    for (const Node driver : circuit.fanin(node)) fanin.push_back(of[driver]);
    return builder.add(circuit.kind(node), std::move(fanin), circuit.name(node));
  };
  const std::size_t ports_in = view.input_ports.size(), ports_out = view.output_ports.size();
  for (std::size_t i = 0; i < circuit.inputs().size(); ++i) {
    const Node input = circuit.inputs()[i];
    frames.first[input] = builder.add(Gate::input, {}, circuit.name(input));
    if (circuit.held()[i] >= 0) builder.hold(frames.first[input], circuit.held()[i] != 0);
  }
  for (Node node = 0; node < circuit.size(); ++node) {
    if (circuit.kind(node) != Gate::input && circuit.kind(node) != Gate::output)
      frames.first[node] = copy(node, frames.first);
  }
  for (std::size_t i = 0; i < circuit.inputs().size(); ++i) {
    const Node input = circuit.inputs()[i];
    const Node source = i < ports_in
                            ? frames.first[input]
                            : frames.first[circuit.fanin(circuit.outputs()[ports_out + i - ports_in])[0]];
    frames.second[input] = builder.add(Gate::buf, {source}, circuit.name(input));
  }
  for (Node node = 0; node < circuit.size(); ++node) {
    if (circuit.kind(node) != Gate::input && circuit.kind(node) != Gate::output)
      frames.second[node] = copy(node, frames.second);
  }
  for (std::size_t k = 0; k < circuit.outputs().size(); ++k) {
    const Node output = circuit.outputs()[k];
    // a port isn't compared: what feeds it alone reaches nothing
    frames.second[output] = k < ports_out ? builder.add(Gate::buf, {frames.second[circuit.fanin(output)[0]]},
                                                        circuit.name(output))
                                          : copy(output, frames.second);
  }
  return frames;
}

// By node: the level that lines of the scan enable have while chains shift, -1 for all others.
std::vector<std::int8_t> shifting_levels(const CaptureView& view, const std::string& scan_enable) {
  const Circuit& circuit = view.circuit;
  std::vector<std::int8_t> levels(circuit.size(), -1);
  for (std::size_t i = 0; i < view.input_ports.size(); ++i) {
    if (view.input_ports[i] == scan_enable && circuit.held()[i] >= 0)
      levels[circuit.inputs()[i]] = circuit.held()[i] == 0 ? 1 : 0;
  }
  for (Node node = 0; node < circuit.size(); ++node) {
    const Gate kind = circuit.kind(node);
    if (kind != Gate::buf && kind != Gate::inv) continue;
    const std::int8_t driver = levels[circuit.fanin(node)[0]];
    if (driver >= 0) levels[node] = kind == Gate::inv ? static_cast<std::int8_t>(1 - driver) : driver;
  }
  return levels;
}

}  // namespace

TransitionView launch_on_capture(const CaptureView& view, const std::string& scan_enable) {
  CircuitBuilder builder;
  Frames frames = add_frames(view, builder);
  for (const Site& site : view.circuit.sites())
    builder.add_site({site.name, site.node == kNoNode ? kNoNode : frames.second[site.node], site.pin});
  TransitionView result;
  std::vector<Node> number;
  result.circuit = builder.finish("launch on capture", &number);
  const auto renumber = [&](std::vector<Node>& nodes) {
    for (Node& node : nodes) node = node == kNoNode ? kNoNode : number[node];
  };
  renumber(frames.first);
  renumber(frames.second);
  result.first_clock = std::move(frames.first);
  result.second_clock = std::move(frames.second);
  result.faults = collapse_along_wires(result.circuit);
  std::vector<Node> in_view(result.circuit.size(), kNoNode);  // by node of the second clock
  for (Node node = 0; node < view.circuit.size(); ++node) in_view[result.second_clock[node]] = node;
  const std::vector<std::int8_t> shifting = shifting_levels(view, scan_enable);
  for (Fault& fault : result.faults.classes) {
    const Node site = in_view[fault.node];
    const Node line =
        fault.pin == kStem ? site : view.circuit.fanin(site)[static_cast<std::size_t>(fault.pin)];
    const Node before = result.first_clock[line];
    fault.launch = before != kNoNode ? before : result.first_clock[view.circuit.fanin(line)[0]];
    if (shifting[line] != (fault.stuck ? 1 : 0) || result.first_clock[site] == kNoNode) continue;
    fault.node = result.first_clock[site];
    fault.launch = kNoNode;
  }
  return result;
}

std::vector<FaultClass> reported_transitions(const CaptureView& view, const TransitionView& transitions,
                                             const std::vector<FaultClass>& of_class) {
  std::vector<FaultClass> reported = reported_classes(transitions.faults, of_class);
  for (std::size_t fault = 0; fault < reported.size(); ++fault) {
    if (view.circuit.sites()[fault / 2].shifts && reported[fault] == FaultClass::AU)
      reported[fault] = FaultClass::DI;
  }
  return reported;
}

std::string transition_name(const Circuit& circuit, std::size_t fault) {
  return circuit.sites()[fault / 2].name + (fault % 2 == 0 ? " slow-to-rise" : " slow-to-fall");
}

}  // namespace meltstage::dft
