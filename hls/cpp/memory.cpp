// SPDX-License-Identifier: Apache-2.0
#include "hls/cpp/memory.hpp"

#include <fmt/format.h>
#include <llvm/Analysis/ConstantFolding.h>
#include <llvm/Demangle/Demangle.h>
#include <llvm/IR/Constants.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace meltstage::hls {
namespace {

// One integer lies at these bytes and nowhere else.
bool is_whole(const Graph& graph, const Object& object, std::size_t at, std::size_t bytes) {
  if (at + bytes > object.size() || graph.width(object[at].of) != 8 * bytes) return false;
  for (std::size_t i = 0; i < bytes; ++i)
    if (object[at + i] != Byte{object[at].of, static_cast<unsigned>(i)}) return false;
  return true;
}

std::shared_ptr<const Object> meet_objects(Graph& graph, Paths& paths, const std::vector<int>& edges,
                                           const std::vector<std::shared_ptr<const Object>>& from) {
  if (std::all_of(from.begin(), from.end(), [&](const auto& o) { return o == from[0]; })) return from[0];
  auto result = std::make_shared<Object>(*from[0]);
  for (std::size_t at = 0; at < result->size();) {
    const auto same = [&](const auto& o) { return (*o)[at] == (*from[0])[at]; };
    if (std::all_of(from.begin(), from.end(), same)) {
      ++at;
      continue;
    }
    std::size_t bytes = 1;  // the largest integer that one of them has here
    for (const auto& o : from) {
      const std::size_t whole = graph.width((*o)[at].of) / 8;
      if (is_whole(graph, *o, at, whole)) bytes = std::max(bytes, whole);
    }
    const Node met = paths.meet(edges, [&](std::size_t i) { return load(graph, *from[i], at, bytes); });
    store(graph, *result, at, met);
    at += bytes;
  }
  return result;
}

}  // namespace

Node load(Graph& graph, const Object& object, std::size_t at, std::size_t bytes) {
  std::optional<Node> result;
  for (std::size_t i = 0; i < bytes;) {
    const Byte first = object[at + i];
    std::size_t run = 1;
    while (i + run < bytes &&
           object[at + i + run] == Byte{first.of, static_cast<unsigned>(first.index + run)})
      ++run;
    const Node piece = graph.slice(first.of, 8 * first.index, static_cast<unsigned>(8 * run));
    result = result ? graph.concat(piece, *result) : piece;
    i += run;
  }
  return *result;
}

void store(const Graph& graph, Object& object, std::size_t at, Node value) {
  for (unsigned i = 0; 8 * i < graph.width(value); ++i) object[at + i] = {value, i};
}

Memory meet(Graph& graph, Paths& paths, const std::vector<int>& edges,
            const std::vector<const Memory*>& from) {
  Memory result;
  for (std::size_t object = 0; object < from[0]->size(); ++object) {
    Memory versions;
    for (const Memory* memory : from) versions.push_back((*memory)[object]);
    result.push_back(meet_objects(graph, paths, edges, versions));
  }
  return result;
}

// ---- addresses -------------------------------------------------------------------------------------------

Pointer AddressSpace::constant_pointer(const llvm::Constant* constant) {
  if (llvm::isa<llvm::ConstantPointerNull>(constant) || llvm::isa<llvm::UndefValue>(constant)) return {};
  APInt offset(64, 0);
  const llvm::Value* base =
      constant->stripAndAccumulateConstantOffsets(layout_, offset, /*AllowNonInbounds=*/true);
  if (llvm::isa<llvm::ConstantPointerNull>(base)) return {};
  if (llvm::isa<llvm::Function>(base))
    findings_.refuse(fmt::format("found the address of the function {}, expected a call of it by name",
                                 llvm::demangle(base->getName().str())));
  const auto* global = llvm::dyn_cast<llvm::GlobalVariable>(base);
  if (global == nullptr)
    findings_.refuse("found an address that is no flop, pin, local or table, expected one of these");
  return to_object(graph_, table_of(*global), offset.getSExtValue());
}

unsigned AddressSpace::table_of(const llvm::GlobalVariable& global) {
  const auto known = number_of_.find(&global);
  if (known != number_of_.end()) return known->second;
  const std::uint64_t bytes = layout_.getTypeAllocSize(global.getValueType());
  if (!global.isConstant() || !global.hasInitializer())
    findings_.refuse(fmt::format("found the global {}, expected one that is constant and known",
                                 llvm::demangle(global.getName().str())));
  if (bytes > kMostObjectBytes)
    findings_.refuse(fmt::format("found a table of {} bytes, expected at most {}", bytes, kMostObjectBytes));
  Object content;
  llvm::Type* byte = llvm::Type::getInt8Ty(global.getContext());
  for (std::uint64_t i = 0; i < bytes; ++i) {
    auto* initial = const_cast<llvm::Constant*>(global.getInitializer());
    const auto* known_byte = llvm::dyn_cast_or_null<llvm::ConstantInt>(
        llvm::ConstantFoldLoadFromConst(initial, byte, APInt(64, i), layout_));
    content.push_back({known_byte != nullptr ? graph_.constant(known_byte->getValue())
                                             : findings_.open(8, global.getName().str()),
                       0});
  }
  tables_.push_back({std::move(content), global.getInitializer()});
  const auto number = static_cast<unsigned>(kTables + tables_.size() - 1);
  number_of_[&global] = number;
  return number;
}

Pointer AddressSpace::load_pointer(const Pointer& from, llvm::Type* type) {
  if (!is_known(from) || from[0].object < kTables)
    findings_.refuse("found an address in memory, expected flops, pins and locals to hold whole numbers");
  auto* table = const_cast<llvm::Constant*>(tables_[from[0].object - kTables].content);
  const llvm::Constant* content = llvm::ConstantFoldLoadFromConst(
      table, type, APInt(64, static_cast<std::uint64_t>(from[0].start)), layout_);
  if (content == nullptr) findings_.refuse("found an address that is not known");
  return constant_pointer(content);
}

Pointer AddressSpace::allocate(const llvm::AllocaInst& local) {
  const auto bits = local.getAllocationSizeInBits(layout_);
  if (!bits || *bits / 8 > kMostObjectBytes)
    findings_.refuse(
        fmt::format("found a local of unknown size, expected at most {} bytes", kMostObjectBytes));
  Object content;
  const std::string name = local.hasName() ? local.getName().str() : "a local";
  for (std::uint64_t i = 0; i < *bits / 8; ++i) content.push_back({findings_.open(8, name), 0});
  memory_.push_back(std::make_shared<Object>(std::move(content)));
  return to_object(graph_, static_cast<unsigned>(memory_.size() - 1));
}

// Calls `use` with each offset that `target` may mean, and whether it does.
void AddressSpace::each_offset(const Target& target, std::size_t bytes,
                               llvm::function_ref<void(std::size_t, Node)> use) {
  const auto size = static_cast<std::int64_t>(object(target.object).size());
  const auto fits = [&](std::int64_t at) {
    const std::int64_t behind = at + static_cast<std::int64_t>(bytes);
    return at >= 0 && behind <= size &&
           (!target.array || (at >= target.array->first && behind <= target.array->behind));
  };
  if (!target.index) {
    if (!fits(target.start))
      return findings_.trap(target.when, "memory beside the object is read or written");
    return use(static_cast<std::size_t>(target.start), target.when);
  }
  const Node index = *target.index;
  const unsigned used = graph_[index].used;
  const auto stride = static_cast<std::int64_t>(target.stride);
  std::int64_t first = used < graph_.width(index) ? 0 : -(size / stride + 1);
  Node none = target.when;
  for (std::int64_t k = first; target.start + k * stride < size; ++k) {
    if (used < 62 && k >= std::int64_t{1} << used) break;
    if (!fits(target.start + k * stride)) continue;
    const Node is_k =
        graph_.binary(Op::kEqual, index, graph_.constant(graph_.width(index), static_cast<std::uint64_t>(k)));
    if (graph_.is_zero(is_k)) continue;
    use(static_cast<std::size_t>(target.start + k * stride), graph_.both(target.when, is_k));
    none = graph_.both(none, graph_.invert(is_k));
  }
  if (!graph_.is_zero(none)) findings_.trap(none, "memory beside the array is read or written");
}

// ---- reading and writing ---------------------------------------------------------------------------------

Node AddressSpace::load(const Pointer& pointer, std::size_t bytes) {
  std::vector<std::pair<Node, Node>> found;  // when, what
  for (const Target& target : pointer)
    each_offset(target, bytes, [&](std::size_t at, Node when) {
      const Object& read = object(target.object);
      for (std::size_t i = at; i < at + bytes; ++i) findings_.read(read[i].of);
      found.emplace_back(when, hls::load(graph_, read, at, bytes));
    });
  trap_null(pointer);
  if (found.empty()) return graph_.constant(static_cast<unsigned>(8 * bytes), 0);
  if (found.size() == 1) return found[0].second;
  // A pointer points to one place: all behind their conditions in one OR is flatter than one after the other.
  Node result = graph_.constant(static_cast<unsigned>(8 * bytes), 0);
  for (const auto& [when, what] : found)
    result = graph_.either(result, graph_.select(when, what, graph_.constant(graph_.width(what), 0)));
  return result;
}

void AddressSpace::store(const Pointer& pointer, Node value) {
  const std::size_t bytes = graph_.width(value) / 8;
  for (const Target& target : pointer) {
    if (target.object >= kTables)
      findings_.refuse("found a write to a global, expected flops, outputs or locals to be written");
    Object changed = object(target.object);
    each_offset(target, bytes, [&](std::size_t at, Node when) {
      const Node written =
          is_known(pointer) ? value : graph_.select(when, value, hls::load(graph_, changed, at, bytes));
      hls::store(graph_, changed, at, written);
    });
    memory_[target.object] = std::make_shared<Object>(std::move(changed));
  }
  trap_null(pointer);
}

void AddressSpace::trap_null(const Pointer& pointer) {
  if (const Node null = is_null(graph_, pointer); !graph_.is_zero(null))
    findings_.trap(null, "memory is read or written through a pointer that points nowhere");
}

void AddressSpace::copy(const Target& to, const Target& from, std::size_t bytes) {
  const Object source = object(from.object);
  each_offset(from, bytes, [&](std::size_t read, Node) {
    each_offset(to, bytes, [&](std::size_t written, Node) {
      if (to.object >= kTables) findings_.refuse("found a write to a global");
      Object changed = object(to.object);
      std::copy_n(source.begin() + static_cast<std::ptrdiff_t>(read), bytes,
                  changed.begin() + static_cast<std::ptrdiff_t>(written));
      memory_[to.object] = std::make_shared<Object>(std::move(changed));
    });
  });
}

void AddressSpace::fill(const Target& to, Node byte, std::size_t bytes) {
  if (to.object >= kTables) findings_.refuse("found a write to a global");
  each_offset(to, bytes, [&](std::size_t written, Node) {
    Object changed = object(to.object);
    for (std::size_t i = 0; i < bytes; ++i) changed[written + i] = {byte, 0};
    memory_[to.object] = std::make_shared<Object>(std::move(changed));
  });
}

Node AddressSpace::order(const Pointer& a, const Pointer& b, std::size_t bytes) {
  const auto byte = [&](Pointer pointer, std::size_t i) {
    for (Target& target : pointer) target.start += static_cast<std::int64_t>(i);
    return load(pointer, 1);
  };
  Node result = graph_.constant(32, 0);
  for (std::size_t i = bytes; i-- > 0;) {
    const Node of_a = byte(a, i);
    const Node of_b = byte(b, i);
    const Node differ = graph_.select(graph_.binary(Op::kLess, of_a, of_b),
                                      graph_.constant(APInt::getAllOnes(32)), graph_.constant(32, 1));
    result = graph_.select(graph_.binary(Op::kEqual, of_a, of_b), result, differ);
  }
  return result;
}

}  // namespace meltstage::hls
