// SPDX-License-Identifier: Apache-2.0
#include "tests/asic/dft/serial.hpp"

#include <algorithm>
#include <cstddef>

namespace meltstage::dft {

namespace {

bool gate_value(Gate kind, const std::vector<bool>& in) {
  const auto ones = std::count(in.begin(), in.end(), true);
  switch (kind) {
    case Gate::tie0:
      return false;
    case Gate::tie1:
      return true;
    case Gate::buf:
    case Gate::output:
      return in[0];
    case Gate::inv:
      return !in[0];
    case Gate::all:
      return ones == static_cast<std::ptrdiff_t>(in.size());
    case Gate::nall:
      return ones != static_cast<std::ptrdiff_t>(in.size());
    case Gate::any:
      return ones != 0;
    case Gate::none:
      return ones == 0;
    case Gate::parity:
      return ones % 2 == 1;
    case Gate::same:
      return ones % 2 == 0;
    case Gate::mux:
      return in[2] ? in[1] : in[0];
    default:
      return false;
  }
}

}  // namespace

std::vector<bool> serial_values(const Circuit& circuit, const Pattern& pattern, const Fault* fault) {
  std::vector<bool> value(circuit.size());
  for (std::size_t i = 0; i < pattern.size(); ++i) value[circuit.inputs()[i]] = pattern[i] != 0;
  for (Node node = 0; node < circuit.size(); ++node) {
    std::vector<bool> in;
    for (const Node driver : circuit.fanin(node)) in.push_back(value[driver]);
    if (fault != nullptr && fault->node == node && fault->pin != kStem)
      in[static_cast<std::size_t>(fault->pin)] = fault->stuck;
    if (circuit.kind(node) != Gate::input) value[node] = gate_value(circuit.kind(node), in);
    if (fault != nullptr && fault->node == node && fault->pin == kStem) value[node] = fault->stuck;
  }
  return value;
}

bool serial_detects(const Circuit& circuit, const Pattern& pattern, const Fault& fault) {
  const std::vector<bool> good = serial_values(circuit, pattern, nullptr),
                          bad = serial_values(circuit, pattern, &fault);
  if (fault.launch != kNoNode && good[fault.launch] != fault.stuck) return false;
  return std::any_of(circuit.outputs().begin(), circuit.outputs().end(),
                     [&](Node node) { return good[node] != bad[node]; });
}

}  // namespace meltstage::dft
