// SPDX-License-Identifier: Apache-2.0
// Pointers as values: the places that one may point to, and when. A place is a byte of an object, by an
// offset that may depend on flops and pins.
#pragma once

#include <llvm/IR/DataLayout.h>
#include <llvm/IR/Operator.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "hls/graph/graph.hpp"

namespace meltstage::hls {

/// Bytes of an object, the last one excluded.
struct Range {
  std::int64_t first;
  std::int64_t behind;
};

/// One place that a pointer may point to: `start`, and `index` times `stride` bytes behind it.
struct Target {
  Node when;  // of the targets that are left, this one
  unsigned object;
  std::int64_t start;
  std::optional<Node> index;
  std::uint64_t stride = 0;
  std::optional<Range> array;  // that `index` is of: it does not leave it
};
using Pointer = std::vector<Target>;  // the last one is meant when no other is

/// A pointer to one place that is known.
Pointer to_object(Graph& graph, unsigned object, std::int64_t start = 0);
bool is_known(const Pointer& pointer);

/// Whether a pointer points nowhere.
Node is_null(Graph& graph, const Pointer& pointer);

/// The targets of a pointer as it is when a condition is met.
Pointer taken_when(Graph& graph, Node condition, Pointer pointer);

/// Whether two pointers are the same; null has no target.
Node is_same_place(Graph& graph, const Pointer& a, const Pointer& b);

/// Bytes from `b` to `a`, in 64 bits.
Node distance(Graph& graph, const Pointer& a, const Pointer& b);
/// Whether they point into different objects, so that there is no distance.
Node are_apart(Graph& graph, const Pointer& a, const Pointer& b);

/// The target `index` times `stride` bytes behind.
void add_index(Graph& graph, Target& target, Node index, std::uint64_t stride);

/// The array from which an address' first variable index chooses, behind its base; none when it counts from
/// the base itself.
std::optional<Range> array_of(const llvm::GEPOperator& address, const llvm::DataLayout& layout);

}  // namespace meltstage::hls
