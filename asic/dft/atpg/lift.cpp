// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/lift.hpp"

namespace meltstage::dft {

namespace {

template <class Value>
bool gate_value(Gate kind, std::size_t inputs, const Value& value) {
  switch (kind) {
    case Gate::tie1:
      return true;
    case Gate::input:
    case Gate::tie0:
      return false;
    case Gate::mux:
      return value(value(2) ? 1 : 0);
    default:
      break;
  }
  bool result = value(0);
  for (std::size_t pin = 1; pin < inputs; ++pin) {
    const bool v = value(pin);
    if (kind == Gate::all || kind == Gate::nall)
      result = result && v;
    else if (kind == Gate::any || kind == Gate::none)
      result = result || v;
    else
      result = result != v;
  }
  const bool invert = kind == Gate::inv || kind == Gate::nall || kind == Gate::none || kind == Gate::same;
  return result != invert;
}

}  // namespace

CubeLifter::CubeLifter(const Circuit& circuit)
    : circuit_(circuit),
      input_of_(circuit.size(), 0),
      need_(circuit.size(), 0),
      pending_(circuit.size() / 64 + 1, 0),
      changed_(circuit.size(), 0) {
  for (std::uint32_t i = 0; i < circuit.inputs().size(); ++i) input_of_[circuit.inputs()[i]] = i;
}

// Event by event, in topological order, until an output differs; kNoNode when none does.
Node CubeLifter::first_difference(const Fault& fault, const std::vector<Word>& values, std::size_t lane) {
  const auto good = [&](Node node) { return values[node].bit(lane); };
  ++now_;
  pending_[fault.node / 64] |= std::uint64_t{1} << (fault.node % 64);
  std::size_t waiting = 1;
  Node found = kNoNode;
  for (std::size_t word = fault.node / 64; waiting != 0; ++word) {
    while (pending_[word] != 0) {
      const Node node =
          static_cast<Node>(64 * word + static_cast<std::size_t>(__builtin_ctzll(pending_[word])));
      pending_[word] &= pending_[word] - 1;
      --waiting;
      if (found != kNoNode) continue;
      const auto fanin = circuit_.fanin(node);
      const auto value = [&](std::size_t pin) {
        if (node == fault.node && static_cast<std::int32_t>(pin) == fault.pin) return fault.stuck;
        return good(fanin[pin]) != (changed_[fanin[pin]] == now_);
      };
      const bool faulty = node == fault.node && fault.pin == kStem
                              ? fault.stuck
                              : gate_value(circuit_.kind(node), fanin.size(), value);
      if (faulty == good(node)) continue;
      changed_[node] = now_;
      if (circuit_.kind(node) == Gate::output) {
        found = node;
        continue;
      }
      for (const Node next : circuit_.fanout(node)) {
        std::uint64_t& bits = pending_[next / 64];
        const std::uint64_t bit = std::uint64_t{1} << (next % 64);
        waiting += (bits & bit) == 0 ? 1 : 0;
        bits |= bit;
      }
    }
  }
  return found;
}

bool CubeLifter::lift_lane(const Fault& fault, const std::vector<Word>& values, std::size_t lane,
                           Cube& cube) {
  const Node target = first_difference(fault, values, lane);
  if (target == kNoNode) return false;
  const auto good = [&](Node node) { return values[node].bit(lane); };
  lift(
      fault, target, good, [&](Node node) { return good(node) != (changed_[node] == now_); }, cube);
  return true;
}

}  // namespace meltstage::dft
