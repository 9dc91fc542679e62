// SPDX-License-Identifier: Apache-2.0
#include "hls/cpp/pointers.hpp"

#include <llvm/IR/Constants.h>
#include <llvm/IR/DerivedTypes.h>

#include <numeric>

namespace meltstage::hls {

Pointer to_object(Graph& graph, unsigned object, std::int64_t start) {
  return {{.when = graph.truth(true),
           .object = object,
           .start = start,
           .index = std::nullopt,
           .array = std::nullopt}};
}

bool is_known(const Pointer& pointer) { return pointer.size() == 1 && !pointer[0].index; }

Node is_null(Graph& graph, const Pointer& pointer) {
  Node null = graph.truth(true);
  for (const Target& target : pointer) null = graph.both(null, graph.invert(target.when));
  return null;
}

Pointer taken_when(Graph& graph, Node condition, Pointer pointer) {
  for (Target& target : pointer) target.when = graph.both(condition, target.when);
  return pointer;
}

namespace {

/// Bytes from the beginning of the object.
Node offset_of(Graph& graph, const Target& target) {
  const Node start = graph.constant(64, static_cast<std::uint64_t>(target.start));
  if (!target.index) return start;
  return graph.binary(Op::kAdd, start,
                      graph.binary(Op::kMul, *target.index, graph.constant(64, target.stride)));
}

}  // namespace

Node is_same_place(Graph& graph, const Pointer& a, const Pointer& b) {
  Node same = graph.both(is_null(graph, a), is_null(graph, b));
  for (const Target& of_a : a)
    for (const Target& of_b : b) {
      if (of_a.object != of_b.object) continue;
      const Node meant = graph.both(of_a.when, of_b.when);
      const Node equal = graph.binary(Op::kEqual, offset_of(graph, of_a), offset_of(graph, of_b));
      same = graph.either(same, graph.both(meant, equal));
    }
  return same;
}

Node distance(Graph& graph, const Pointer& a, const Pointer& b) {
  const Node none = graph.constant(64, 0);
  Node result = none;
  for (const Target& of_a : a)
    for (const Target& of_b : b) {
      if (of_a.object != of_b.object) continue;
      const Node bytes = graph.binary(Op::kSub, offset_of(graph, of_a), offset_of(graph, of_b));
      result = graph.either(result, graph.select(graph.both(of_a.when, of_b.when), bytes, none));
    }
  return result;
}

Node are_apart(Graph& graph, const Pointer& a, const Pointer& b) {
  Node together = graph.both(is_null(graph, a), is_null(graph, b));
  for (const Target& of_a : a)
    for (const Target& of_b : b)
      if (of_a.object == of_b.object) together = graph.either(together, graph.both(of_a.when, of_b.when));
  return graph.invert(together);
}

void add_index(Graph& graph, Target& target, Node index, std::uint64_t stride) {
  if (graph.is_constant(index)) {
    target.start += graph.value(index).getSExtValue() * static_cast<std::int64_t>(stride);
  } else if (!target.index) {
    target.index = index;
    target.stride = stride;
  } else {
    const std::uint64_t common = std::gcd(target.stride, stride);
    const auto in_units = [&](Node value, std::uint64_t of) {
      return graph.binary(Op::kMul, value, graph.constant(64, of / common));
    };
    target.index = graph.binary(Op::kAdd, in_units(*target.index, target.stride), in_units(index, stride));
    target.stride = common;
  }
}

std::optional<Range> array_of(const llvm::GEPOperator& address, const llvm::DataLayout& layout) {
  const auto size_of = [&](llvm::Type* type) {
    return static_cast<std::int64_t>(layout.getTypeAllocSize(type));
  };
  llvm::Type* type = address.getSourceElementType();
  auto index = address.idx_begin();
  const auto* from_base = llvm::dyn_cast<llvm::ConstantInt>(*index);
  if (from_base == nullptr) return std::nullopt;
  std::int64_t at = from_base->getSExtValue() * size_of(type);
  while (++index != address.idx_end()) {
    const auto* chosen = llvm::dyn_cast<llvm::ConstantInt>(*index);
    if (auto* fields = llvm::dyn_cast<llvm::StructType>(type)) {
      const auto field = static_cast<unsigned>(chosen->getZExtValue());
      at += static_cast<std::int64_t>(layout.getStructLayout(fields)->getElementOffset(field));
      type = fields->getElementType(field);
    } else if (auto* words = llvm::dyn_cast<llvm::ArrayType>(type)) {
      if (chosen == nullptr) return Range{at, at + size_of(words)};
      type = words->getElementType();
      at += chosen->getSExtValue() * size_of(type);
    } else {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace meltstage::hls
