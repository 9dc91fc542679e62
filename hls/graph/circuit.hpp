// SPDX-License-Identifier: Apache-2.0
// A module as a graph: its flops and pins, and what is promised of them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hls/graph/graph.hpp"

namespace meltstage::hls {

/// A flop or pin (interface.hpp).
struct Field {
  std::string name;
  unsigned offset;
  unsigned bytes;
  unsigned width;
  bool is_signed;
  APInt kept;  // `width` bits
};

/// "name", or "name[bit]" where there are several.
inline std::string bit_name(const Field& field, unsigned bit) {
  return field.width == 1 ? field.name : field.name + "[" + std::to_string(bit) + "]";
}

/// Something that the C++ promises and the circuit can't show by itself: `broken` must never be 1.
struct Promise {
  Node broken;
  std::string what;
  Place place;
};

struct Flop {
  Field field;
  Node now;     // an input
  Node next;    // of the field's width
  APInt reset;  // `width` bits
};

struct Pin {
  Field field;
  Node node;
};

/// What holds in every state that is reached from reset; true in reset.
struct Invariant {
  std::string name;
  Node now;
  Node next;  // in the state after a clock
};

/// The circuit of one module: flops and pins in the order of the source.
struct Circuit {
  Graph graph;
  std::vector<Flop> flops;
  std::vector<Pin> inputs;
  std::vector<Pin> outputs;
  std::optional<Node> in_reset;  // a bit
  std::vector<Invariant> invariants;
  std::vector<Promise> promises;
};

}  // namespace meltstage::hls
