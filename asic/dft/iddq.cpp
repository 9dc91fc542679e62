// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/iddq.hpp"

#include <algorithm>

#include "asic/dft/fault_simulator.hpp"

namespace meltstage::dft {

namespace {

// The state of a block that shows most faults of `left`; kLanes when none shows one.
struct Best {
  std::size_t lane = kLanes;
  std::size_t shown = 0;
};
Best best_lane(const std::vector<Word>& detected, const std::vector<std::uint8_t>& left) {
  std::vector<std::size_t> shown(kLanes, 0);
  for (std::size_t i = 0; i < detected.size(); ++i) {
    if (left[i] == 0) continue;
    for (std::size_t part = 0; part < detected[i].part.size(); ++part) {
      for (std::uint64_t bits = detected[i].part[part]; bits != 0; bits &= bits - 1)
        ++shown[64 * part + static_cast<std::size_t>(__builtin_ctzll(bits))];
    }
  }
  const auto most = std::max_element(shown.begin(), shown.end());
  if (*most == 0) return {};
  return {static_cast<std::size_t>(most - shown.begin()), *most};
}

}  // namespace

double IddqStops::coverage() const {
  if (faults == tied) return 1.0;
  return detected.empty() ? 0.0 : static_cast<double>(detected.back()) / static_cast<double>(faults - tied);
}

Circuit observe_every_gate(const Circuit& circuit) {
  CircuitBuilder builder;
  // nodes stand in topological order: their numbers are the builder's
  for (Node node = 0; node < circuit.size(); ++node)
    builder.add(circuit.kind(node), {circuit.fanin(node).begin(), circuit.fanin(node).end()},
                circuit.name(node));
  for (Node node = 0; node < circuit.size(); ++node) {
    if (circuit.kind(node) != Gate::output) builder.add(Gate::output, {node}, circuit.name(node));
  }
  for (const Site& site : circuit.sites()) builder.add_site(site);
  for (std::size_t i = 0; i < circuit.inputs().size(); ++i) {
    if (circuit.held()[i] >= 0) builder.hold(circuit.inputs()[i], circuit.held()[i] != 0);
  }
  return builder.finish("every gate observed");
}

IddqStops choose_iddq_stops(const Circuit& circuit, const std::vector<Pattern>& states, std::size_t most) {
  IddqStops result;
  const std::vector<std::int8_t> constant =
      constants(circuit, std::vector<std::int8_t>(circuit.inputs().size(), -1));
  std::vector<Fault> faults;
  for (const Site& site : circuit.sites()) {
    if (site.node == kNoNode) continue;
    const Node line =
        site.pin == kStem ? site.node : circuit.fanin(site.node)[static_cast<std::size_t>(site.pin)];
    for (const bool stuck : {false, true}) {
      ++result.faults;
      result.tied += constant[line] == (stuck ? 1 : 0) ? 1 : 0;
      faults.push_back({site.node, site.pin, stuck});
    }
  }
  FaultSimulator simulator(circuit);
  std::vector<std::vector<Word>> detected;
  for (const PatternBlock& block : blocks_of(states, circuit.inputs().size())) {
    detected.emplace_back();
    simulator.detect_at_gate(block, faults, detected.back());
  }
  std::vector<std::uint8_t> left(faults.size(), 1);
  while (result.stops.size() < most) {
    Best best;
    std::size_t in_block = 0;
    for (std::size_t b = 0; b < detected.size(); ++b) {
      const Best here = best_lane(detected[b], left);
      if (here.shown <= best.shown) continue;
      best = here;
      in_block = b;
    }
    if (best.shown == 0) break;
    for (std::size_t i = 0; i < faults.size(); ++i) {
      if (detected[in_block][i].bit(best.lane)) left[i] = 0;
    }
    result.stops.push_back(in_block * kLanes + best.lane);
    result.detected.push_back(best.shown + (result.detected.empty() ? 0 : result.detected.back()));
  }
  return result;
}

}  // namespace meltstage::dft
