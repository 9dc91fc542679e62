// SPDX-License-Identifier: Apache-2.0
// Memory as a value: objects of bytes, each byte a part of an integer of the graph; and what a function reads
// and writes of it by address.
#pragma once

#include <llvm/ADT/STLExtras.h>
#include <llvm/IR/DataLayout.h>
#include <llvm/IR/GlobalVariable.h>
#include <llvm/IR/Instructions.h>

#include <cstddef>
#include <map>
#include <memory>
#include <vector>

#include "hls/cpp/findings.hpp"
#include "hls/cpp/paths.hpp"
#include "hls/cpp/pointers.hpp"
#include "hls/graph/graph.hpp"

namespace meltstage::hls {

inline constexpr std::uint64_t kMostObjectBytes = 1 << 16;

/// A byte of memory: byte `index` of an integer.
struct Byte {
  Node of = 0;
  unsigned index = 0;
  bool operator==(const Byte&) const = default;
};
using Object = std::vector<Byte>;
using Memory = std::vector<std::shared_ptr<const Object>>;

/// The integer that lies at these bytes.
Node load(Graph& graph, const Object& object, std::size_t at, std::size_t bytes);
void store(const Graph& graph, Object& object, std::size_t at, Node value);

/// Memory behind the place where `edges` meet; `from` is what comes in over each.
Memory meet(Graph& graph, Paths& paths, const std::vector<int>& edges,
            const std::vector<const Memory*>& from);

/// What a function reaches by address: what its arguments point to, its locals, and constant tables.
class AddressSpace {
 public:
  AddressSpace(Graph& graph, Findings& findings, const llvm::DataLayout& layout, Memory memory)
      : graph_(graph), findings_(findings), layout_(layout), memory_(std::move(memory)) {}

  /// Arguments' objects and locals as they are now. Tables are always the same.
  const Memory& memory() const { return memory_; }
  void set_memory(Memory memory) { memory_ = std::move(memory); }

  Node load(const Pointer& pointer, std::size_t bytes);
  void store(const Pointer& pointer, Node value);
  /// To and from one place each.
  void copy(const Target& to, const Target& from, std::size_t bytes);
  void fill(const Target& to, Node byte, std::size_t bytes);
  /// -1, 0 or 1 in 32 bits: the order of the first bytes that differ.
  Node order(const Pointer& a, const Pointer& b, std::size_t bytes);

  Pointer constant_pointer(const llvm::Constant* constant);
  /// A pointer that lies in a table, such as a name.
  Pointer load_pointer(const Pointer& from, llvm::Type* type);
  /// A new object for a local.
  Pointer allocate(const llvm::AllocaInst& local);

 private:
  struct Table {
    Object bytes;
    const llvm::Constant* content;
  };
  static constexpr unsigned kTables = 1u << 20;  // object numbers from here on are tables

  const Object& object(unsigned number) const {
    return number < kTables ? *memory_[number] : tables_[number - kTables].bytes;
  }
  void trap_null(const Pointer& pointer);
  void each_offset(const Target& target, std::size_t bytes, llvm::function_ref<void(std::size_t, Node)> use);
  unsigned table_of(const llvm::GlobalVariable& global);

  Graph& graph_;
  Findings& findings_;
  const llvm::DataLayout& layout_;
  Memory memory_;
  std::vector<Table> tables_;
  std::map<const llvm::GlobalVariable*, unsigned> number_of_;
};

}  // namespace meltstage::hls
