// SPDX-License-Identifier: Apache-2.0
#include "hls/translate.hpp"

#include <fmt/format.h>
#include <llvm/ADT/DenseMap.h>
#include <llvm/ADT/PostOrderIterator.h>
#include <llvm/Analysis/ConstantFolding.h>
#include <llvm/Analysis/LoopInfo.h>
#include <llvm/IR/Constants.h>
#include <llvm/IR/DebugInfoMetadata.h>
#include <llvm/IR/Dominators.h>
#include <llvm/IR/GlobalVariable.h>
#include <llvm/IR/InstIterator.h>
#include <llvm/IR/Instructions.h>
#include <llvm/IR/IntrinsicInst.h>
#include <llvm/IR/Operator.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <regex>
#include <set>
#include <tuple>

#include "base/error.hpp"
#include "hls/compile.hpp"
#include "hls/names.hpp"

namespace meltstage::hls {
namespace {

constexpr int kMostIterations = 4096;
constexpr std::uint64_t kMostObjectBytes = 1 << 16;

// ---- Values ----------------------------------------------------------------------------------------------

// Bytes of an object, the last one excluded.
struct Range {
  std::int64_t first;
  std::int64_t behind;
};

// One place that a pointer may point to: `start`, and `index` times `stride` bytes behind it.
struct Target {
  Node when;  // of the targets that are left, this one
  unsigned object;
  std::int64_t start;
  std::optional<Node> index;
  std::uint64_t stride = 0;
  std::optional<Range> array;  // that `index` is of: it does not leave it
};
using Pointer = std::vector<Target>;  // the last one is meant when no other is

// An integer, an aggregate of integers, or a pointer.
struct Value {
  std::vector<Node> parts;
  Pointer pointer;
};

// A byte of memory: byte `index` of an integer.
struct Byte {
  Node of = 0;
  unsigned index = 0;
  bool operator==(const Byte&) const = default;
};
using Object = std::vector<Byte>;
using Memory = std::vector<std::shared_ptr<const Object>>;

// A way from one executed block to the next one.
struct Edge {
  int from;
  int to;                   // -1 until it is known
  Node when;                // of the ways out of `from`, this one
  std::vector<Value> phis;  // what the next block's phis take
  Memory memory;
};

// A basic block as it was executed; a block of a loop has one for each iteration.
struct Executed {
  int dominator;
  int depth;
  std::vector<int> into;  // edges
  std::vector<int> out;   // edges; one of them is taken
};

// A value that the C++ leaves open: an Op::kAny, and whose it is.
struct Open {
  Node node;
  std::string of;
  Place place;
};

struct OpenValues {
  std::vector<Open> values;
  std::unordered_map<Node, Place> reads;  // where such a byte is first read
};

Place place_of(const llvm::Instruction& instruction) {
  const llvm::DILocation* at = instruction.getDebugLoc().get();
  if (at == nullptr) return {};
  return {at->getFilename().str(), at->getLine()};
}

[[noreturn]] void refuse(const Place& place, const std::string& what) {
  if (place.line == 0) throw UserError(fmt::format("hls: {}", what));
  throw UserError(fmt::format("{}:{}: {}", place.file, place.line, what));
}

// ---- Execution of one function ---------------------------------------------------------------------------

class Execution {
 public:
  Execution(Graph& graph, std::vector<Promise>& promises, OpenValues& opens, llvm::Function& function,
            Memory memory)
      : graph_(graph),
        promises_(promises),
        opens_(opens),
        function_(function),
        layout_(function.getParent()->getDataLayout()),
        dominators_(function),
        loops_(dominators_),
        memory_(std::move(memory)) {
    llvm::ReversePostOrderTraversal<llvm::Function*> order(&function);
    order_.assign(order.begin(), order.end());
    for (unsigned i = 0; i < function.arg_size(); ++i) values_[function.getArg(i)] = {{}, to_object(i)};
  }

  // Memory after the function has returned.
  Memory run() {
    edges_.push_back({-1, -1, graph_.truth(true), {}, memory_});
    incoming_[&function_.getEntryBlock()] = {0};
    run_blocks(nullptr);
    if (returned_.empty()) refuse({}, fmt::format("{}() never returns", function_.getName().str()));
    for (const Trap& trap : traps_) promise(trap.broken, trap.executed, trap.what, trap.place);
    return join(returned_).second;
  }

 private:
  struct Trap {
    Node broken;
    int executed;
    std::string what;
    Place place;
  };

  // ---- order of execution --------------------------------------------------------------------------------

  // Blocks of `loop` (nullptr: of none) once, loops in it as often as they go round.
  void run_blocks(const llvm::Loop* loop) {
    for (llvm::BasicBlock* block : order_) {
      const llvm::Loop* innermost = loops_.getLoopFor(block);
      if (innermost == loop) {
        execute(*block);
      } else if (innermost != nullptr && innermost->getHeader() == block &&
                 innermost->getParentLoop() == loop) {
        for (int i = 0; !incoming_[block].empty(); ++i) {
          if (i == kMostIterations) {
            refuse(place_of(*block->getTerminator()),
                   fmt::format("found a loop whose end is not known after {} rounds, expected a bound that "
                               "does not depend on flops or pins",
                               kMostIterations));
          }
          run_blocks(innermost);
        }
      }
    }
  }

  void execute(llvm::BasicBlock& block) {
    std::vector<int> edges;
    std::swap(edges, incoming_[&block]);
    if (edges.empty()) return;
    auto [phis, memory] = join(edges);
    const int dominator = nearest_dominator(edges);
    current_ = static_cast<int>(executed_.size());
    executed_.push_back({dominator, dominator < 0 ? 0 : executed_[dominator].depth + 1, edges, {}});
    for (const int edge : edges) {
      edges_[edge].to = current_;
      edges_[edge].memory.clear();
    }
    memory_ = std::move(memory);
    unsigned i = 0;
    for (llvm::PHINode& phi : block.phis()) values_[&phi] = phis[i++];
    for (llvm::Instruction& instruction : block) {
      if (llvm::isa<llvm::PHINode>(instruction)) continue;
      if (const Place place = place_of(instruction); place.line != 0) {
        here_ = place;
        graph_.at(place);
      }
      if (instruction.isTerminator()) {
        end_block(block, instruction);
      } else {
        run_instruction(instruction);
      }
    }
  }

  void end_block(llvm::BasicBlock& block, llvm::Instruction& instruction) {
    if (auto* branch = llvm::dyn_cast<llvm::BranchInst>(&instruction)) {
      const Node condition = branch->isConditional() ? integer(branch->getCondition()) : graph_.truth(true);
      leave(block, condition, *branch->getSuccessor(0));
      if (branch->isConditional()) leave(block, graph_.invert(condition), *branch->getSuccessor(1));
    } else if (auto* choice = llvm::dyn_cast<llvm::SwitchInst>(&instruction)) {
      const Node subject = integer(choice->getCondition());
      Node other = graph_.truth(true);
      for (auto one : choice->cases()) {
        const Node equal =
            graph_.binary(Op::kEqual, subject, graph_.constant(one.getCaseValue()->getValue()));
        leave(block, equal, *one.getCaseSuccessor());
        other = graph_.both(other, graph_.invert(equal));
      }
      leave(block, other, *choice->getDefaultDest());
    } else if (llvm::isa<llvm::ReturnInst>(instruction)) {
      returned_.push_back(add_edge({current_, -1, graph_.truth(true), {}, memory_}));
    } else if (llvm::isa<llvm::UnreachableInst>(instruction)) {
      if (traps_.empty() || traps_.back().executed != current_)
        trap(graph_.truth(true), "a place is reached that the C++ rules out");
    } else {
      refuse(here_,
             fmt::format("found {}, expected branches, switches and returns", instruction.getOpcodeName()));
    }
  }

  void leave(llvm::BasicBlock& from, Node condition, llvm::BasicBlock& to) {
    if (is_false(condition)) return;
    Edge edge{current_, -1, condition, {}, memory_};
    for (llvm::PHINode& phi : to.phis()) edge.phis.push_back(value_of(phi.getIncomingValueForBlock(&from)));
    incoming_[&to].push_back(add_edge(std::move(edge)));
  }

  int add_edge(Edge edge) {
    const int number = static_cast<int>(edges_.size());
    executed_[current_].out.push_back(number);
    edges_.push_back(std::move(edge));
    return number;
  }

  bool is_false(Node condition) const {
    return graph_.is_constant(condition) && graph_.value(condition).isZero();
  }

  // ---- where paths meet ----------------------------------------------------------------------------------

  int nearest_dominator(const std::vector<int>& edges) const {
    int a = edges_[edges[0]].from;
    for (const int edge : edges) {
      int b = edges_[edge].from;
      while (a != b) {
        if (executed_[a].depth < executed_[b].depth) std::swap(a, b);
        a = executed_[a].dominator;
      }
    }
    return a;
  }

  // What comes in over `edges`, as a function of the conditions that were met since their dominator. `leaf`
  // gives it for the n-th edge.
  Node meet(const std::vector<int>& edges, const std::function<Node(std::size_t)>& leaf) {
    ++meeting_;
    leaf_of_.resize(edges_.size(), {0, 0});
    met_.resize(executed_.size(), {0, std::nullopt});
    for (std::size_t i = 0; i < edges.size(); ++i) leaf_of_[edges[i]] = {meeting_, leaf(i)};
    return *met_from(nearest_dominator(edges));
  }
  // The same from an executed block on; none when no path leads to the edges.
  std::optional<Node> met_from(int executed) {
    if (met_[executed].first == meeting_) return met_[executed].second;
    std::vector<std::pair<Node, Node>> choices;  // value, and when
    for (const int edge : executed_[executed].out) {
      std::optional<Node> value;
      if (leaf_of_[edge].first == meeting_) {
        value = leaf_of_[edge].second;
      } else if (edges_[edge].to >= 0) {
        value = met_from(edges_[edge].to);
      }
      if (!value) continue;
      const auto same =
          std::find_if(choices.begin(), choices.end(), [&](const auto& c) { return c.first == *value; });
      if (same == choices.end()) {
        choices.emplace_back(*value, edges_[edge].when);
      } else {
        same->second = graph_.either(same->second, edges_[edge].when);
      }
    }
    std::optional<Node> result;
    for (const auto& [value, when] : choices) result = result ? graph_.select(when, value, *result) : value;
    met_[executed] = {meeting_, result};
    return result;
  }

  // Whether an executed block is reached, from the beginning on.
  Node reached(int executed) {
    if (executed < 0) return graph_.truth(true);
    const auto known = reached_.find(executed);
    if (known != reached_.end()) return known->second;
    Node result = graph_.truth(false);
    for (const int edge : executed_[executed].into)
      result = graph_.either(result, graph_.both(reached(edges_[edge].from), edges_[edge].when));
    reached_[executed] = result;
    return result;
  }

  // Values and memory behind a place where edges meet.
  std::pair<std::vector<Value>, Memory> join(const std::vector<int>& edges) {
    const Edge& first = edges_[edges[0]];
    if (edges.size() == 1) return {first.phis, first.memory};
    std::pair<std::vector<Value>, Memory> result;
    for (std::size_t phi = 0; phi < first.phis.size(); ++phi)
      result.first.push_back(
          meet_values(edges, [&](std::size_t i) -> const Value& { return edges_[edges[i]].phis[phi]; }));
    for (std::size_t object = 0; object < first.memory.size(); ++object)
      result.second.push_back(meet_objects(edges, object));
    return result;
  }

  Value meet_values(const std::vector<int>& edges, const std::function<const Value&(std::size_t)>& value) {
    Value result;
    for (std::size_t part = 0; part < value(0).parts.size(); ++part)
      result.parts.push_back(meet(edges, [&](std::size_t i) { return value(i).parts[part]; }));
    if (value(0).parts.empty()) {
      for (std::size_t k = 0; k < edges.size(); ++k) {
        const Node taken = meet(edges, [&](std::size_t i) { return graph_.truth(i == k); });
        for (Target target : value(k).pointer) {
          target.when = graph_.both(taken, target.when);
          if (!is_false(target.when)) result.pointer.push_back(target);
        }
      }
    }
    return result;
  }

  std::shared_ptr<const Object> meet_objects(const std::vector<int>& edges, std::size_t object) {
    std::vector<const Object*> from;
    for (const int edge : edges) from.push_back(edges_[edge].memory[object].get());
    if (std::all_of(from.begin(), from.end(), [&](const Object* o) { return o == from[0]; }))
      return edges_[edges[0]].memory[object];
    auto result = std::make_shared<Object>(*from[0]);
    for (std::size_t at = 0; at < result->size();) {
      const auto same = [&](const Object* o) { return (*o)[at] == (*from[0])[at]; };
      if (std::all_of(from.begin(), from.end(), same)) {
        ++at;
        continue;
      }
      std::size_t bytes = 1;  // the largest integer that one of them has here
      for (const Object* o : from) {
        const std::size_t whole = graph_.width((*o)[at].of) / 8;
        if (is_whole(*o, at, whole)) bytes = std::max(bytes, whole);
      }
      const Node met = meet(edges, [&](std::size_t i) { return load(*from[i], at, bytes); });
      for (std::size_t i = 0; i < bytes; ++i) (*result)[at + i] = {met, static_cast<unsigned>(i)};
      at += bytes;
    }
    return result;
  }

  // One integer lies at these bytes and nowhere else.
  bool is_whole(const Object& object, std::size_t at, std::size_t bytes) const {
    if (at + bytes > object.size() || graph_.width(object[at].of) != 8 * bytes) return false;
    for (std::size_t i = 0; i < bytes; ++i)
      if (object[at + i] != Byte{object[at].of, static_cast<unsigned>(i)}) return false;
    return true;
  }

  // ---- promises ------------------------------------------------------------------------------------------

  void trap(Node broken, std::string what) { traps_.push_back({broken, current_, std::move(what), here_}); }
  void promise(Node broken, int executed, const std::string& what, const Place& place) {
    const Node there = graph_.both(broken, reached(executed));
    if (!is_false(there)) promises_.push_back({there, what, place});
  }

  // A value that nothing is known of.
  Node open(unsigned width, std::string of) {
    const Node node = graph_.any(width);
    opens_.values.push_back({node, std::move(of), here_});
    return node;
  }

  // ---- memory --------------------------------------------------------------------------------------------

  Pointer to_object(unsigned object, std::int64_t start = 0) {
    return {{.when = graph_.truth(true),
             .object = object,
             .start = start,
             .index = std::nullopt,
             .array = std::nullopt}};
  }

  const Object& object(unsigned number) const {
    return number < kGlobals ? *memory_[number] : globals_[number - kGlobals];
  }

  Node load(const Object& object, std::size_t at, std::size_t bytes) {
    std::optional<Node> result;
    for (std::size_t i = 0; i < bytes;) {
      const Byte first = object[at + i];
      std::size_t run = 1;
      while (i + run < bytes &&
             object[at + i + run] == Byte{first.of, static_cast<unsigned>(first.index + run)})
        ++run;
      const Node piece = graph_.slice(first.of, 8 * first.index, static_cast<unsigned>(8 * run));
      result = result ? graph_.concat(piece, *result) : piece;
      i += run;
    }
    return *result;
  }

  void store(Object& object, std::size_t at, Node value) {
    for (unsigned i = 0; 8 * i < graph_.width(value); ++i) object[at + i] = {value, i};
  }

  // Calls `use` with each offset that `target` may mean, and whether it does.
  void each_offset(const Target& target, std::size_t bytes,
                   const std::function<void(std::size_t, Node)>& use) {
    const auto size = static_cast<std::int64_t>(object(target.object).size());
    const auto fits = [&](std::int64_t at) {
      const std::int64_t behind = at + static_cast<std::int64_t>(bytes);
      return at >= 0 && behind <= size &&
             (!target.array || (at >= target.array->first && behind <= target.array->behind));
    };
    if (!target.index) {
      if (!fits(target.start)) return trap(target.when, "memory beside the object is read or written");
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
      const Node is_k = graph_.binary(Op::kEqual, index,
                                      graph_.constant(graph_.width(index), static_cast<std::uint64_t>(k)));
      if (is_false(is_k)) continue;
      use(static_cast<std::size_t>(target.start + k * stride), graph_.both(target.when, is_k));
      none = graph_.both(none, graph_.invert(is_k));
    }
    if (!is_false(none)) trap(none, "memory beside the array is read or written");
  }

  Node load(const Pointer& pointer, std::size_t bytes) {
    std::vector<std::pair<Node, Node>> found;  // when, what
    for (const Target& target : pointer)
      each_offset(target, bytes, [&](std::size_t at, Node when) {
        note_open_bytes(object(target.object), at, bytes);
        found.emplace_back(when, load(object(target.object), at, bytes));
      });
    if (found.empty())
      refuse(here_, "found a pointer that points nowhere, expected one into flops, pins or locals");
    Node result = found.back().second;
    for (auto one = found.rbegin() + 1; one != found.rend(); ++one)
      result = graph_.select(one->first, one->second, result);
    return result;
  }

  void note_open_bytes(const Object& object, std::size_t at, std::size_t bytes) {
    for (std::size_t i = at; i < at + bytes; ++i)
      if (graph_[object[i].of].op == Op::kAny) opens_.reads.try_emplace(object[i].of, here_);
  }

  void store(const Pointer& pointer, Node value) {
    const std::size_t bytes = graph_.width(value) / 8;
    const bool alone = pointer.size() == 1 && !pointer[0].index;
    for (const Target& target : pointer) {
      if (target.object >= kGlobals)
        refuse(here_, "found a write to a global, expected flops, outputs or locals to be written");
      Object changed = object(target.object);
      each_offset(target, bytes, [&](std::size_t at, Node when) {
        store(changed, at, alone ? value : graph_.select(when, value, load(changed, at, bytes)));
      });
      memory_[target.object] = std::make_shared<Object>(std::move(changed));
    }
    if (pointer.empty()) refuse(here_, "found a write through a pointer that points nowhere");
  }

  unsigned global_object(const llvm::GlobalVariable& global) {
    const auto known = global_of_.find(&global);
    if (known != global_of_.end()) return known->second;
    const std::uint64_t bytes = layout_.getTypeAllocSize(global.getValueType());
    if (!global.isConstant() || !global.hasInitializer())
      refuse(here_, fmt::format("found the global {}, expected one that is constant and known",
                                global.getName().str()));
    if (bytes > kMostObjectBytes)
      refuse(here_, fmt::format("found a table of {} bytes, expected at most {}", bytes, kMostObjectBytes));
    Object content;
    llvm::Type* byte = llvm::Type::getInt8Ty(global.getContext());
    for (std::uint64_t i = 0; i < bytes; ++i) {
      auto* initial = const_cast<llvm::Constant*>(global.getInitializer());
      const auto* known_byte = llvm::dyn_cast_or_null<llvm::ConstantInt>(
          llvm::ConstantFoldLoadFromConst(initial, byte, APInt(64, i), layout_));
      content.push_back(
          {known_byte != nullptr ? graph_.constant(known_byte->getValue()) : open(8, global.getName().str()),
           0});
    }
    globals_.push_back(std::move(content));
    constants_.push_back(global.getInitializer());
    const auto number = static_cast<unsigned>(kGlobals + globals_.size() - 1);
    global_of_[&global] = number;
    return number;
  }

  // ---- values --------------------------------------------------------------------------------------------

  Value value_of(const llvm::Value* value) {
    if (const auto* constant = llvm::dyn_cast<llvm::Constant>(value)) return constant_value(constant);
    const auto known = values_.find(value);
    if (known == values_.end()) refuse(here_, "found a value that no instruction gave");
    return known->second;
  }

  Value constant_value(const llvm::Constant* constant) {
    if (const auto* number = llvm::dyn_cast<llvm::ConstantInt>(constant))
      return {{graph_.constant(number->getValue())}, {}};
    if (constant->getType()->isPointerTy()) return {{}, constant_pointer(constant)};
    if (constant->getType()->isIntegerTy() && llvm::isa<llvm::UndefValue>(constant))
      return {{open(constant->getType()->getIntegerBitWidth(), "a local")}, {}};
    if (constant->getType()->isAggregateType()) {
      Value result;
      for (unsigned i = 0; constant->getAggregateElement(i) != nullptr; ++i)
        result.parts.push_back(constant_value(constant->getAggregateElement(i)).parts.at(0));
      return result;
    }
    refuse(here_, fmt::format("found {}, expected whole numbers only", type_name(constant->getType())));
  }

  Pointer constant_pointer(const llvm::Constant* constant) {
    if (llvm::isa<llvm::ConstantPointerNull>(constant) || llvm::isa<llvm::UndefValue>(constant)) return {};
    APInt offset(64, 0);
    const llvm::Value* base =
        constant->stripAndAccumulateConstantOffsets(layout_, offset, /*AllowNonInbounds=*/true);
    const auto* global = llvm::dyn_cast<llvm::GlobalVariable>(base);
    if (global == nullptr)
      refuse(here_, "found an address that is no flop, pin, local or table, expected one of these");
    return to_object(global_object(*global), offset.getSExtValue());
  }

  Node integer(const llvm::Value* value) {
    const Value result = value_of(value);
    if (result.parts.size() != 1)
      refuse(here_, fmt::format("found {}, expected a whole number", type_name(value->getType())));
    return result.parts[0];
  }

  static std::string type_name(llvm::Type* type) {
    if (type->isFloatingPointTy()) return "a floating-point number";
    if (type->isVectorTy()) return "a vector";
    if (type->isPointerTy()) return "a pointer";
    return "a value that is no whole number";
  }

  // ---- instructions --------------------------------------------------------------------------------------

  void run_instruction(llvm::Instruction& instruction) {
    if (auto* call = llvm::dyn_cast<llvm::CallInst>(&instruction)) return run_call(*call);
    if (const auto* write = llvm::dyn_cast<llvm::StoreInst>(&instruction)) {
      const Value value = value_of(write->getValueOperand());
      if (value.parts.size() != 1)
        refuse(here_, fmt::format("found a write of {}, expected whole numbers in memory",
                                  type_name(write->getValueOperand()->getType())));
      const auto bytes = layout_.getTypeStoreSize(write->getValueOperand()->getType());
      return store(value_of(write->getPointerOperand()).pointer,
                   graph_.zero_extend(value.parts[0], static_cast<unsigned>(8 * bytes)));
    }
    values_[&instruction] = result_of(instruction);
  }

  Value result_of(llvm::Instruction& instruction) {
    llvm::Type* type = instruction.getType();
    if (const auto* operation = llvm::dyn_cast<llvm::BinaryOperator>(&instruction))
      return {{arithmetic(*operation)}, {}};
    if (const auto* compare = llvm::dyn_cast<llvm::ICmpInst>(&instruction))
      return {{comparison(*compare)}, {}};
    if (const auto* choice = llvm::dyn_cast<llvm::SelectInst>(&instruction)) return selection(*choice);
    if (const auto* address = llvm::dyn_cast<llvm::GEPOperator>(&instruction)) return {{}, moved(*address)};
    if (const auto* read = llvm::dyn_cast<llvm::LoadInst>(&instruction)) return loaded(*read);
    if (const auto* part = llvm::dyn_cast<llvm::ExtractValueInst>(&instruction)) {
      if (part->getNumIndices() != 1) refuse(here_, "found a structure within a structure as a value");
      return {{value_of(part->getAggregateOperand()).parts.at(part->getIndices()[0])}, {}};
    }
    if (const auto* part = llvm::dyn_cast<llvm::InsertValueInst>(&instruction)) {
      if (part->getNumIndices() != 1) refuse(here_, "found a structure within a structure as a value");
      Value whole = value_of(part->getAggregateOperand());
      whole.parts.at(part->getIndices()[0]) = integer(part->getInsertedValueOperand());
      return whole;
    }
    if (llvm::isa<llvm::FreezeInst>(instruction) || llvm::isa<llvm::BitCastInst>(instruction)) {
      if (!type->isIntegerTy() && !type->isPointerTy())
        refuse(here_, fmt::format("found {}, expected whole numbers only", type_name(type)));
      return value_of(instruction.getOperand(0));
    }
    if (const auto* room = llvm::dyn_cast<llvm::AllocaInst>(&instruction)) return {{}, new_object(*room)};
    if (type->isIntegerTy() && instruction.getNumOperands() == 1 &&
        instruction.getOperand(0)->getType()->isIntegerTy()) {
      const unsigned bits = type->getIntegerBitWidth();
      const Node from = integer(instruction.getOperand(0));
      if (llvm::isa<llvm::ZExtInst>(instruction)) return {{graph_.zero_extend(from, bits)}, {}};
      if (llvm::isa<llvm::SExtInst>(instruction)) return {{graph_.sign_extend(from, bits)}, {}};
      if (llvm::isa<llvm::TruncInst>(instruction)) return {{graph_.slice(from, 0, bits)}, {}};
    }
    refuse(here_,
           fmt::format("found {}, expected whole numbers, branches and memory of flops, pins and locals",
                       type->isFloatingPointTy() ? "a floating-point number" : instruction.getOpcodeName()));
  }

  Node arithmetic(const llvm::BinaryOperator& operation) {
    if (!operation.getType()->isIntegerTy())
      refuse(here_, fmt::format("found {}, expected whole numbers only", type_name(operation.getType())));
    const Node a = integer(operation.getOperand(0));
    const Node b = integer(operation.getOperand(1));
    return graph_.binary(operator_of(operation.getOpcode()), a, b);
  }

  static Op operator_of(llvm::Instruction::BinaryOps code) {
    switch (code) {
      case llvm::Instruction::Add:
        return Op::kAdd;
      case llvm::Instruction::Sub:
        return Op::kSub;
      case llvm::Instruction::Mul:
        return Op::kMul;
      case llvm::Instruction::And:
        return Op::kAnd;
      case llvm::Instruction::Or:
        return Op::kOr;
      case llvm::Instruction::Xor:
        return Op::kXor;
      case llvm::Instruction::Shl:
        return Op::kShiftLeft;
      case llvm::Instruction::LShr:
        return Op::kShiftRight;
      case llvm::Instruction::AShr:
        return Op::kShiftRightSigned;
      case llvm::Instruction::UDiv:
        return Op::kUnsignedDivide;
      case llvm::Instruction::URem:
        return Op::kUnsignedRemainder;
      case llvm::Instruction::SDiv:
        return Op::kSignedDivide;
      default:
        return Op::kSignedRemainder;
    }
  }

  Node comparison(const llvm::ICmpInst& compare) {
    using Predicate = llvm::CmpInst::Predicate;
    Predicate predicate = compare.getPredicate();
    if (!compare.getOperand(0)->getType()->isIntegerTy()) return same_pointer(compare);
    Node a = integer(compare.getOperand(0));
    Node b = integer(compare.getOperand(1));
    const bool negated = predicate == Predicate::ICMP_NE || predicate == Predicate::ICMP_UGE ||
                         predicate == Predicate::ICMP_ULE || predicate == Predicate::ICMP_SGE ||
                         predicate == Predicate::ICMP_SLE;
    if (negated) predicate = llvm::CmpInst::getInversePredicate(predicate);
    if (predicate == Predicate::ICMP_UGT || predicate == Predicate::ICMP_SGT) std::swap(a, b);
    const Op op = predicate == Predicate::ICMP_EQ ? Op::kEqual
                  : compare.isSigned()            ? Op::kLessSigned
                                                  : Op::kLess;
    const Node result = graph_.binary(op, a, b);
    return negated ? graph_.invert(result) : result;
  }

  Node same_pointer(const llvm::ICmpInst& compare) {
    const Pointer a = value_of(compare.getOperand(0)).pointer;
    const Pointer b = value_of(compare.getOperand(1)).pointer;
    const bool known = a.size() == 1 && b.size() == 1 && !a[0].index && !b[0].index && compare.isEquality();
    if (!known)
      refuse(here_, "found a comparison of addresses that depend on flops or pins, expected whole numbers");
    const bool equal = a[0].object == b[0].object && a[0].start == b[0].start;
    return graph_.truth(equal == (compare.getPredicate() == llvm::CmpInst::ICMP_EQ));
  }

  Value selection(const llvm::SelectInst& choice) {
    const Node condition = integer(choice.getCondition());
    const Value then = value_of(choice.getTrueValue());
    const Value otherwise = value_of(choice.getFalseValue());
    if (graph_.is_constant(condition)) return is_false(condition) ? otherwise : then;
    Value result;
    for (std::size_t i = 0; i < then.parts.size(); ++i)
      result.parts.push_back(graph_.select(condition, then.parts[i], otherwise.parts[i]));
    for (const auto& [pointer, taken] :
         {std::pair(&then.pointer, condition), std::pair(&otherwise.pointer, graph_.invert(condition))}) {
      for (Target target : *pointer) {
        target.when = graph_.both(taken, target.when);
        result.pointer.push_back(target);
      }
    }
    return result;
  }

  // The address of a member or of an array's word.
  Pointer moved(const llvm::GEPOperator& address) {
    llvm::MapVector<llvm::Value*, APInt> scales;
    APInt constant(64, 0);
    if (!address.collectOffset(layout_, 64, scales, constant))
      refuse(here_, "found an address of unknown size");
    Pointer pointer = value_of(address.getPointerOperand()).pointer;
    const std::optional<Range> array = array_of(address);
    for (Target& target : pointer) {
      if (array && !target.index)
        target.array = Range{target.start + array->first, target.start + array->behind};
      target.start += constant.getSExtValue();
      for (const auto& [value, scale] : scales) {
        const Node index = graph_.sign_extend(integer(value), 64);
        add_index(target, index, scale.getZExtValue());
      }
    }
    return pointer;
  }

  // The array from which an address' first variable index chooses, behind its base; none when it counts from
  // the base itself.
  std::optional<Range> array_of(const llvm::GEPOperator& address) const {
    const auto size_of = [&](llvm::Type* type) {
      return static_cast<std::int64_t>(layout_.getTypeAllocSize(type));
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
        at += static_cast<std::int64_t>(layout_.getStructLayout(fields)->getElementOffset(field));
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

  void add_index(Target& target, Node index, std::uint64_t stride) {
    if (graph_.is_constant(index)) {
      target.start += graph_.value(index).getSExtValue() * static_cast<std::int64_t>(stride);
    } else if (!target.index) {
      target.index = index;
      target.stride = stride;
    } else {
      const std::uint64_t common = std::gcd(target.stride, stride);
      const auto in_units = [&](Node value, std::uint64_t of) {
        return graph_.binary(Op::kMul, value, graph_.constant(64, of / common));
      };
      target.index = graph_.binary(Op::kAdd, in_units(*target.index, target.stride), in_units(index, stride));
      target.stride = common;
    }
  }

  Value loaded(const llvm::LoadInst& read) {
    const Pointer pointer = value_of(read.getPointerOperand()).pointer;
    if (read.getType()->isPointerTy()) return {{}, loaded_pointer(pointer, read)};
    if (!read.getType()->isIntegerTy())
      refuse(here_, fmt::format("found {}, expected whole numbers only", type_name(read.getType())));
    const auto bytes = static_cast<std::size_t>(layout_.getTypeStoreSize(read.getType()));
    return {{graph_.slice(load(pointer, bytes), 0, read.getType()->getIntegerBitWidth())}, {}};
  }

  // A pointer within a table, such as a name.
  Pointer loaded_pointer(const Pointer& from, const llvm::LoadInst& read) {
    if (from.size() != 1 || from[0].index || from[0].object < kGlobals)
      refuse(here_, "found an address in memory, expected flops, pins and locals to hold whole numbers");
    auto* table = const_cast<llvm::Constant*>(constants_[from[0].object - kGlobals]);
    const llvm::Constant* content = llvm::ConstantFoldLoadFromConst(
        table, read.getType(), APInt(64, static_cast<std::uint64_t>(from[0].start)), layout_);
    if (content == nullptr) refuse(here_, "found an address that is not known");
    return constant_pointer(content);
  }

  Pointer new_object(const llvm::AllocaInst& room) {
    const auto bits = room.getAllocationSizeInBits(layout_);
    if (!bits || *bits / 8 > kMostObjectBytes)
      refuse(here_,
             fmt::format("found a local of unknown size, expected at most {} bytes", kMostObjectBytes));
    Object content;
    const std::string name = room.hasName() ? room.getName().str() : "a local";
    for (std::uint64_t i = 0; i < *bits / 8; ++i) content.push_back({open(8, name), 0});
    memory_.push_back(std::make_shared<Object>(std::move(content)));
    return to_object(static_cast<unsigned>(memory_.size() - 1));
  }

  // ---- calls ---------------------------------------------------------------------------------------------

  void run_call(llvm::CallInst& call) {
    const llvm::Function* called = call.getCalledFunction();
    if (called == nullptr) refuse(here_, "found a call through a pointer, expected functions by name");
    const std::string name = called->getName().str();
    if (name == "bcmp" || name == "memcmp") {
      values_[&call] = {{order_of_bytes(call)}, {}};
      return;
    }
    if (llvm::StringRef(name).startswith(kOpenLocal)) {
      values_[&call] = {{open(call.getType()->getIntegerBitWidth(),
                              llvm::StringRef(name).substr(std::strlen(kOpenLocal)).split('.').second.str())},
                        {}};
      return;
    }
    if (!called->isIntrinsic())
      refuse(here_, fmt::format("found a call of {}(), expected functions whose source is given", name));
    switch (called->getIntrinsicID()) {
      case llvm::Intrinsic::lifetime_start:
      case llvm::Intrinsic::lifetime_end:
      case llvm::Intrinsic::dbg_declare:
      case llvm::Intrinsic::dbg_value:
      case llvm::Intrinsic::dbg_label:
      case llvm::Intrinsic::experimental_noalias_scope_decl:
      case llvm::Intrinsic::donothing:
        return;
      case llvm::Intrinsic::assume:
        return trap(graph_.invert(integer(call.getArgOperand(0))),
                    "what the C++ takes for granted is not so");
      case llvm::Intrinsic::trap:
      case llvm::Intrinsic::ubsantrap:
        return trap(graph_.truth(true), "undefined behaviour of C++ (overflow, shift, index or the like)");
      case llvm::Intrinsic::memcpy:
      case llvm::Intrinsic::memmove:
        return copy(call);
      case llvm::Intrinsic::memset:
        return fill(call);
      default:
        values_[&call] = intrinsic(call, called->getIntrinsicID());
    }
  }

  std::size_t known_bytes(const llvm::Value* value) {
    const Node bytes = integer(value);
    if (!graph_.is_constant(bytes) || graph_.value(bytes).getLimitedValue() > kMostObjectBytes)
      refuse(here_, "found a copy whose size is not known, expected a constant one");
    return static_cast<std::size_t>(graph_.value(bytes).getZExtValue());
  }

  // A pointer to one place that is known.
  Target known_place(const llvm::Value* value) {
    const Pointer pointer = value_of(value).pointer;
    if (pointer.size() != 1 || pointer[0].index)
      refuse(here_, "found a copy between places that depend on flops or pins, expected known ones");
    return pointer[0];
  }

  void copy(const llvm::CallInst& call) {
    const std::size_t bytes = known_bytes(call.getArgOperand(2));
    const Target to = known_place(call.getArgOperand(0));
    const Target from = known_place(call.getArgOperand(1));
    const Object source = object(from.object);
    each_offset(from, bytes, [&](std::size_t read, Node) {
      each_offset(to, bytes, [&](std::size_t written, Node) {
        if (to.object >= kGlobals) refuse(here_, "found a write to a global");
        Object changed = object(to.object);
        std::copy_n(source.begin() + static_cast<std::ptrdiff_t>(read), bytes,
                    changed.begin() + static_cast<std::ptrdiff_t>(written));
        memory_[to.object] = std::make_shared<Object>(std::move(changed));
      });
    });
  }

  void fill(const llvm::CallInst& call) {
    const std::size_t bytes = known_bytes(call.getArgOperand(2));
    const Target to = known_place(call.getArgOperand(0));
    const Node value = integer(call.getArgOperand(1));
    if (to.object >= kGlobals) refuse(here_, "found a write to a global");
    each_offset(to, bytes, [&](std::size_t written, Node) {
      Object changed = object(to.object);
      for (std::size_t i = 0; i < bytes; ++i) changed[written + i] = {value, 0};
      memory_[to.object] = std::make_shared<Object>(std::move(changed));
    });
  }

  // -1, 0 or 1: the order of the first bytes that differ.
  Node order_of_bytes(const llvm::CallInst& call) {
    const auto byte = [&](unsigned argument, std::size_t i) {
      Pointer pointer = value_of(call.getArgOperand(argument)).pointer;
      for (Target& target : pointer) target.start += static_cast<std::int64_t>(i);
      return load(pointer, 1);
    };
    Node result = graph_.constant(32, 0);
    for (std::size_t i = known_bytes(call.getArgOperand(2)); i-- > 0;) {
      const Node a = byte(0, i);
      const Node b = byte(1, i);
      const Node differ = graph_.select(graph_.binary(Op::kLess, a, b),
                                        graph_.constant(APInt::getAllOnes(32)), graph_.constant(32, 1));
      result = graph_.select(graph_.binary(Op::kEqual, a, b), result, differ);
    }
    return result;
  }

  Value intrinsic(const llvm::CallInst& call, llvm::Intrinsic::ID id) {
    if (call.arg_size() == 0 || !call.getArgOperand(0)->getType()->isIntegerTy())
      refuse(here_,
             fmt::format("found {}, expected whole numbers only", call.getCalledFunction()->getName().str()));
    const Node a = integer(call.getArgOperand(0));
    const unsigned bits = graph_.width(a);
    const auto second = [&] { return integer(call.getArgOperand(1)); };
    const auto less = [&](Op op, Node x, Node y) { return graph_.binary(op, x, y); };
    switch (id) {
      case llvm::Intrinsic::expect:
        return {{a}, {}};
      case llvm::Intrinsic::abs:
        return {{graph_.select(sign(a), negative(a), a)}, {}};
      case llvm::Intrinsic::umin:
        return {{graph_.select(less(Op::kLess, a, second()), a, second())}, {}};
      case llvm::Intrinsic::umax:
        return {{graph_.select(less(Op::kLess, a, second()), second(), a)}, {}};
      case llvm::Intrinsic::smin:
        return {{graph_.select(less(Op::kLessSigned, a, second()), a, second())}, {}};
      case llvm::Intrinsic::smax:
        return {{graph_.select(less(Op::kLessSigned, a, second()), second(), a)}, {}};
      case llvm::Intrinsic::ctpop:
        return {{ones(a)}, {}};
      case llvm::Intrinsic::cttz:
        return {{zeros(a, true)}, {}};
      case llvm::Intrinsic::ctlz:
        return {{zeros(a, false)}, {}};
      case llvm::Intrinsic::bswap: {
        Node result = graph_.slice(a, 0, 8);
        for (unsigned i = 8; i < bits; i += 8) result = graph_.concat(result, graph_.slice(a, i, 8));
        return {{result}, {}};
      }
      case llvm::Intrinsic::bitreverse: {
        Node result = graph_.slice(a, 0, 1);
        for (unsigned i = 1; i < bits; ++i) result = graph_.concat(result, graph_.slice(a, i, 1));
        return {{result}, {}};
      }
      case llvm::Intrinsic::fshl:
      case llvm::Intrinsic::fshr: {
        const Node pair = graph_.concat(a, second());
        const Node by = graph_.binary(Op::kUnsignedRemainder, integer(call.getArgOperand(2)),
                                      graph_.constant(bits, bits));
        const Op op = id == llvm::Intrinsic::fshl ? Op::kShiftLeft : Op::kShiftRight;
        const Node shifted = graph_.binary(op, pair, graph_.zero_extend(by, 2 * bits));
        return {{graph_.slice(shifted, id == llvm::Intrinsic::fshl ? bits : 0, bits)}, {}};
      }
      case llvm::Intrinsic::uadd_with_overflow:
      case llvm::Intrinsic::sadd_with_overflow:
      case llvm::Intrinsic::usub_with_overflow:
      case llvm::Intrinsic::ssub_with_overflow:
      case llvm::Intrinsic::umul_with_overflow:
      case llvm::Intrinsic::smul_with_overflow:
      case llvm::Intrinsic::uadd_sat:
      case llvm::Intrinsic::sadd_sat:
      case llvm::Intrinsic::usub_sat:
      case llvm::Intrinsic::ssub_sat:
        return exact(id, a, second());
      default:
        refuse(here_,
               fmt::format("found {}, which has no circuit here", call.getCalledFunction()->getName().str()));
    }
  }

  Node sign(Node a) { return graph_.slice(a, graph_.width(a) - 1, 1); }
  Node negative(Node a) { return graph_.binary(Op::kSub, graph_.constant(graph_.width(a), 0), a); }

  Node ones(Node a) {
    const unsigned bits = graph_.width(a);
    Node result = graph_.zero_extend(graph_.slice(a, 0, 1), bits);
    for (unsigned i = 1; i < bits; ++i)
      result = graph_.binary(Op::kAdd, result, graph_.zero_extend(graph_.slice(a, i, 1), bits));
    return result;
  }

  // Zeros below the lowest one (trailing) or above the highest one.
  Node zeros(Node a, bool trailing) {
    const unsigned bits = graph_.width(a);
    Node result = graph_.constant(bits, bits);
    for (unsigned i = 0; i < bits; ++i) {
      const unsigned bit = trailing ? bits - 1 - i : i;
      result = graph_.select(graph_.slice(a, bit, 1), graph_.constant(bits, trailing ? bit : bits - 1 - bit),
                             result);
    }
    return result;
  }

  // Sum, difference or product in as many bits as it needs; from it the result and whether it overflowed, or
  // the saturated result.
  Value exact(llvm::Intrinsic::ID id, Node a, Node b) {
    const std::string name = llvm::Intrinsic::getBaseName(id).str();
    const bool is_signed = name[5] == 's';
    const std::string kind = name.substr(6, 3);
    const unsigned bits = graph_.width(a);
    const unsigned wide = kind == "mul" ? 2 * bits : bits + 2;
    const auto widened = [&](Node x) {
      return is_signed ? graph_.sign_extend(x, wide) : graph_.zero_extend(x, wide);
    };
    const Op op = kind == "add" ? Op::kAdd : kind == "sub" ? Op::kSub : Op::kMul;
    const Node result = graph_.binary(op, widened(a), widened(b));
    const Node narrow = graph_.slice(result, 0, bits);
    const Node overflow = graph_.invert(graph_.binary(Op::kEqual, widened(narrow), result));
    if (name.find("sat") == std::string::npos) return {{narrow, overflow}, {}};
    const Node below = graph_.constant(is_signed ? APInt::getSignedMinValue(bits) : APInt(bits, 0));
    const Node above = graph_.constant(is_signed ? APInt::getSignedMaxValue(bits) : APInt::getAllOnes(bits));
    return {{graph_.select(overflow, graph_.select(sign(result), below, above), narrow)}, {}};
  }

  static constexpr unsigned kGlobals = 1u << 20;  // object numbers from here on are tables

  Graph& graph_;
  std::vector<Promise>& promises_;
  OpenValues& opens_;
  llvm::Function& function_;
  const llvm::DataLayout& layout_;
  llvm::DominatorTree dominators_;
  llvm::LoopInfo loops_;
  std::vector<llvm::BasicBlock*> order_;

  std::vector<Edge> edges_;
  std::vector<Executed> executed_;
  std::map<const llvm::BasicBlock*, std::vector<int>> incoming_;
  std::vector<int> returned_;
  std::vector<Trap> traps_;
  int current_ = -1;
  Place here_;
  Memory memory_;
  llvm::DenseMap<const llvm::Value*, Value> values_;

  std::vector<Object> globals_;
  std::vector<const llvm::Constant*> constants_;
  std::map<const llvm::GlobalVariable*, unsigned> global_of_;

  int meeting_ = 0;
  std::vector<std::pair<int, Node>> leaf_of_;
  std::vector<std::pair<int, std::optional<Node>>> met_;
  std::map<int, Node> reached_;
};

// ---- The module's three functions ------------------------------------------------------------------------

// The rows of a table.
std::vector<Field> fields(const llvm::Module& module, const std::string& name) {
  const llvm::GlobalVariable* table = module.getGlobalVariable(name);
  if (table == nullptr || !table->hasInitializer())
    throw UserError(fmt::format("{}: found no table {}, expected one (hls/interface.hpp)",
                                module.getSourceFileName(), name));
  std::vector<Field> result;
  const llvm::Constant* rows = table->getInitializer();
  while (rows->getType()->isStructTy() && rows->getType()->getStructNumElements() == 1)
    rows = rows->getAggregateElement(0U);  // an std::array
  for (unsigned i = 0; rows->getAggregateElement(i) != nullptr; ++i) {
    const llvm::Constant* row = rows->getAggregateElement(i);
    const auto number = [&](unsigned column) {
      const auto* cell = llvm::dyn_cast_or_null<llvm::ConstantInt>(row->getAggregateElement(column));
      return cell == nullptr ? 0 : cell->getZExtValue();
    };
    APInt offset(64, 0);
    const auto* text =
        llvm::dyn_cast<llvm::GlobalVariable>(row->getAggregateElement(0U)->stripAndAccumulateConstantOffsets(
            module.getDataLayout(), offset, true));
    const auto* letters =
        text == nullptr ? nullptr : llvm::dyn_cast<llvm::ConstantDataArray>(text->getInitializer());
    if (letters == nullptr || !letters->isCString())
      throw UserError(
          fmt::format("{}: {}[{}]: found no name, expected a string", module.getSourceFileName(), name, i));
    Field field{.name = std::regex_replace(letters->getAsCString().str(), std::regex("__DOT__"), "."),
                .offset = static_cast<unsigned>(number(1)),
                .bytes = static_cast<unsigned>(number(2)),
                .width = static_cast<unsigned>(number(3)),
                .is_signed = number(4) != 0,
                .kept = APInt()};
    if (field.width < 1 || field.width > 8 * field.bytes)
      throw UserError(fmt::format("{}: {}: found {} bits, expected 1 to {}", module.getSourceFileName(),
                                  field.name, field.width, 8 * field.bytes));
    field.kept = APInt(64, number(5)).zextOrTrunc(field.width);
    if (const auto word = static_cast<std::int32_t>(number(6)); word >= 0)
      field.name += fmt::format("[{}]", word);
    result.push_back(std::move(field));
  }
  return result;
}

class Translation {
 public:
  explicit Translation(llvm::Module& module) : module_(module) {}

  Circuit run() {
    Graph& graph = circuit_.graph;
    const std::vector<Field> flops = fields(module_, "hls_flops");
    const std::vector<Field> inputs = fields(module_, "hls_input_pins");
    const std::vector<Field> outputs = fields(module_, "hls_output_pins");

    require_names(flops, inputs, outputs);
    require_own_bytes(flops, "hls_flops", "hls_step", 0);
    require_own_bytes(inputs, "hls_input_pins", "hls_step", 1);
    require_own_bytes(outputs, "hls_output_pins", "hls_outputs", 2);

    const Memory in_reset = call("hls_reset", {unknown("hls_reset", 0)});
    for (const Field& field : flops) {
      const Node reset = graph.slice(read(*in_reset[0], field), 0, field.width);
      if (!graph.is_constant(reset))
        throw UserError(fmt::format("{}: hls_reset(): found no value for {}, expected a constant",
                                    module_.getSourceFileName(), field.name));
      circuit_.flops.push_back({field, graph.input(field.name, field.width), 0, graph.value(reset)});
    }
    for (const Field& field : inputs)
      circuit_.inputs.push_back({field, graph.input(field.name, field.width)});

    const auto state = unknown("hls_step", 0);
    for (const Flop& flop : circuit_.flops) {
      const Node fixed = graph.constant(flop.reset & ~flop.field.kept);
      const Node moving = graph.both(flop.now, graph.constant(flop.field.kept));
      write(*state, flop.field, graph.either(moving, fixed));
    }
    const auto pins = unknown("hls_step", 1);
    for (const Pin& pin : circuit_.inputs) write(*pins, pin.field, pin.node);

    const Memory after = call("hls_step", {state, pins});
    for (Flop& flop : circuit_.flops) flop.next = taken(*after[0], flop.field, &flop);
    if (module_.getFunction("hls_invariants") != nullptr) take_invariants(in_reset[0], state, after[0]);
    if (module_.getFunction("hls_in_reset") != nullptr) {
      const Memory told = call("hls_in_reset", {state, pins, unknown("hls_in_reset", 2)});
      circuit_.in_reset = graph.slice(told[2]->at(0).of, 8 * told[2]->at(0).index, 1);
    }
    const Memory shown = call("hls_outputs", {state, pins, unknown("hls_outputs", 2)});
    for (const Field& field : outputs) circuit_.outputs.push_back({field, taken(*shown[2], field, nullptr)});
    const std::vector<Node> results = all_results();
    refuse_unlisted(results);
    if (module_.getNamedMetadata(kShowsPromises) != nullptr) promise_that_open_values_are_unused(results);
    return std::move(circuit_);
  }

 private:
  // Rows of a table lie in the struct that an argument of a function points to, each in bytes of its own.
  void require_own_bytes(const std::vector<Field>& rows, const char* table, const std::string& name,
                         unsigned argument) {
    const std::size_t size = unknown(name, argument)->size();
    std::map<unsigned, std::string> owners;
    for (const Field& field : rows) {
      for (unsigned byte = field.offset; byte < field.offset + field.bytes; ++byte) {
        if (byte >= size)
          refuse_row(table, fmt::format("found {} in byte {} of a struct of {} bytes, expected it within",
                                        field.name, byte, size));
        const auto [owner, is_first] = owners.try_emplace(byte, field.name);
        if (!is_first)
          refuse_row(table, fmt::format("found {} in bytes of {}, expected bytes of its own", field.name,
                                        owner->second));
      }
    }
  }

  // Flops and pins stand side by side in the RTL, words and bits of them too.
  void require_names(const std::vector<Field>& flops, const std::vector<Field>& inputs,
                     const std::vector<Field>& outputs) const {
    std::set<std::string> known;
    const auto take = [&](const char* table, const std::string& name) {
      if (!known.insert(name).second)
        refuse_row(table, fmt::format("found {} twice, expected each name once", name));
    };
    for (const auto& [table, rows] : {std::pair("hls_flops", &flops), std::pair("hls_input_pins", &inputs),
                                      std::pair("hls_output_pins", &outputs)}) {
      for (const Field& field : *rows) {
        if (!can_be_escaped(field.name) || field.name == "clk_i")
          refuse_row(table, fmt::format("found the name '{}', expected letters, digits and _, and not clk_i",
                                        field.name));
        take(table, field.name);
        for (unsigned bit = 0; field.width > 1 && bit < field.width; ++bit)
          take(table, fmt::format("{}[{}]", field.name, bit));
        if (field.name == "rst_ni" && (rows != &inputs || field.width != 1))
          refuse_row(table,
                     fmt::format("found rst_ni of {} bits, expected 1 in hls_input_pins", field.width));
      }
    }
    for (const Field& field : flops)  // a block is known by its name, too
      for (std::size_t dot = field.name.find('.'); dot != std::string::npos;
           dot = field.name.find('.', dot + 1))
        if (known.contains(field.name.substr(0, dot)))
          refuse_row("hls_flops", fmt::format("found {} in {}, which is a flop or pin, expected a block",
                                              field.name, field.name.substr(0, dot)));
  }

  [[noreturn]] void refuse_row(const char* table, const std::string& what) const {
    throw UserError(fmt::format("{}: {}: {}", module_.getSourceFileName(), table, what));
  }

  std::vector<Node> all_results() const {
    std::vector<Node> result;
    for (const Flop& flop : circuit_.flops) result.push_back(flop.next);
    for (const Pin& pin : circuit_.outputs) result.push_back(pin.node);
    for (const Invariant& invariant : circuit_.invariants) {
      result.push_back(invariant.now);
      result.push_back(invariant.next);
    }
    if (circuit_.in_reset) result.push_back(*circuit_.in_reset);
    return result;
  }

  // A byte of a struct that no row of a table gives a value, though a result rests on it.
  void refuse_unlisted(const std::vector<Node>& results) const {
    const Graph& graph = circuit_.graph;
    const std::vector<bool> needed = graph.behind(results);
    for (Node node = 0; node < needed.size(); ++node) {
      const auto byte = bytes_.find(node);
      if (!needed[node] || byte == bytes_.end()) continue;
      if (!opens_.reads.contains(node) && !is_result(byte->second)) continue;
      const auto& [function, argument, type, at] = byte->second;
      const std::string member = member_at(*type, at);
      if (is_result(byte->second))
        throw UserError(fmt::format("{}: {}(): found {} left without a value, expected one on every path",
                                    module_.getSourceFileName(), function, member));
      refuse(opens_.reads.at(node),
             fmt::format("found {} read, which is in no row of {}, expected one for all that keeps its value",
                         member, argument == 0 ? "hls_flops" : "hls_input_pins"));
    }
  }

  // State of 2 bytes at offset 6: a member has no name here.
  std::string member_at(llvm::Type& whole, std::uint64_t byte) const {
    const llvm::DataLayout& layout = module_.getDataLayout();
    llvm::Type* type = &whole;
    std::uint64_t offset = 0;
    while (auto* structure = llvm::dyn_cast<llvm::StructType>(type)) {
      const llvm::StructLayout& members = *layout.getStructLayout(structure);
      const unsigned member = members.getElementContainingOffset(byte - offset);
      offset += members.getElementOffset(member);
      type = structure->getElementType(member);
    }
    const std::uint64_t bytes = layout.getTypeAllocSize(type);
    const llvm::StringRef name = whole.isStructTy() ? whole.getStructName() : "";
    return fmt::format("{} of {} byte{} at offset {}", name.substr(name.find('.') + 1).str(), bytes,
                       bytes == 1 ? "" : "s", offset);
  }

  // Locals may hold anything before they are written, so no result may change with them.
  void promise_that_open_values_are_unused(const std::vector<Node>& results) {
    Graph& graph = circuit_.graph;
    const std::vector<bool> needed = graph.behind(results);
    Node kept = graph.truth(true);  // all that is promised so far
    for (const Promise& promise : circuit_.promises) kept = graph.both(kept, graph.invert(promise.broken));
    std::map<std::tuple<std::string, unsigned, std::string>, std::vector<const Open*>> groups;
    for (const Open& open : opens_.values)
      if (needed[open.node]) groups[{open.place.file, open.place.line, open.of}].push_back(&open);
    for (const auto& [key, group] : groups) {
      std::unordered_map<Node, Node> others;
      for (const Open* open : group) others[open->node] = graph.any(graph.width(open->node));
      const std::vector<Node> changed = graph.replaced(results, others);
      Node broken = graph.truth(false);
      for (std::size_t i = 0; i < results.size(); ++i)
        broken = graph.either(broken, graph.invert(graph.binary(Op::kEqual, results[i], changed[i])));
      circuit_.promises.push_back({graph.both(kept, broken),
                                   fmt::format("{} is read before it is written", group[0]->of),
                                   group[0]->place});
    }
  }

  void take_invariants(const std::shared_ptr<const Object>& in_reset,
                       const std::shared_ptr<const Object>& now, const std::shared_ptr<const Object>& after) {
    Graph& graph = circuit_.graph;
    const auto hold = [&](const std::shared_ptr<const Object>& state) {
      return *call("hls_invariants", {state, unknown("hls_invariants", 1)})[1];
    };
    const Object at_first = hold(in_reset), at_present = hold(now), at_last = hold(after);
    for (const Field& field : fields(module_, "hls_invariant_names")) {
      const auto bit = [&](const Object& object) { return graph.slice(read(object, field), 0, 1); };
      const Node first = bit(at_first);
      if (!graph.is_constant(first) || graph.value(first).isZero())
        throw UserError(fmt::format("{}: invariant {}: found it broken in reset, expected it to hold there",
                                    module_.getSourceFileName(), field.name));
      circuit_.invariants.push_back({field.name, bit(at_present), bit(at_last)});
    }
  }

  // The struct that an argument of a function points to, with nothing known of it.
  std::shared_ptr<Object> unknown(const std::string& name, unsigned argument) {
    llvm::Type* type = function(name).getArg(argument)->getType()->getPointerElementType();
    auto object = std::make_shared<Object>();
    if (!type->isSized())
      throw UserError(
          fmt::format("{}: {}(): found a struct of unknown size", module_.getSourceFileName(), name));
    for (std::uint64_t i = 0; i < module_.getDataLayout().getTypeAllocSize(type); ++i) {
      object->push_back({circuit_.graph.any(8), 0});
      bytes_[object->back().of] = {name, argument, type, i};
    }
    return object;
  }

  // One of those of interface.hpp.
  llvm::Function& function(const std::string& name) {
    const unsigned pointers = name == "hls_reset"                               ? 1
                              : name == "hls_outputs" || name == "hls_in_reset" ? 3
                                                                                : 2;
    llvm::Function* result = module_.getFunction(name);
    if (result == nullptr || result->isDeclaration())
      throw UserError(
          fmt::format("{}: found no function {}(), expected one with C linkage (hls/interface.hpp)",
                      module_.getSourceFileName(), name));
    bool fits = result->arg_size() == pointers && result->getReturnType()->isVoidTy();
    for (const llvm::Argument& argument : result->args()) fits = fits && argument.getType()->isPointerTy();
    if (!fits)
      throw UserError(
          fmt::format("{}: {}(): found other arguments or a result, expected {} pointers to structs and void",
                      module_.getSourceFileName(), name, pointers));
    return *result;
  }

  Memory call(const std::string& name, Memory arguments) {
    return Execution(circuit_.graph, circuit_.promises, opens_, function(name), std::move(arguments)).run();
  }

  void write(Object& object, const Field& field, Node value) {
    const Node whole = field.is_signed ? circuit_.graph.sign_extend(value, 8 * field.bytes)
                                       : circuit_.graph.zero_extend(value, 8 * field.bytes);
    for (unsigned i = 0; i < field.bytes; ++i) object[field.offset + i] = {whole, i};
  }

  Node read(const Object& object, const Field& field) {
    Graph& graph = circuit_.graph;
    Node result = 0;
    for (unsigned i = 0; i < field.bytes; ++i) {
      const Byte byte = object[field.offset + i];
      const Node piece = graph.slice(byte.of, 8 * byte.index, 8);
      result = i == 0 ? piece : graph.concat(piece, result);
    }
    return result;
  }

  // The bits that the circuit has; that the others follow from them is a promise.
  Node taken(const Object& object, const Field& field, const Flop* flop) {
    Graph& graph = circuit_.graph;
    const Node whole = read(object, field);
    Node kept = graph.slice(whole, 0, field.width);
    if (flop != nullptr && !field.kept.isAllOnes()) {
      kept = graph.either(graph.both(kept, graph.constant(field.kept)),
                          graph.constant(flop->reset & ~field.kept));
    }
    const Node again =
        field.is_signed ? graph.sign_extend(kept, 8 * field.bytes) : graph.zero_extend(kept, 8 * field.bytes);
    const Node broken = graph.invert(graph.binary(Op::kEqual, again, whole));
    if (!graph.is_constant(broken) || !graph.value(broken).isZero())
      circuit_.promises.push_back(
          {broken, fmt::format("{} has more bits than the circuit", field.name), graph.place(whole)});
    return kept;
  }

  // A byte of a struct whose value is not given: what a function's argument points to.
  struct StructByte {
    std::string function;
    unsigned argument;
    llvm::Type* type;
    std::uint64_t at;
  };

  // A byte that a function is there to write.
  static bool is_result(const StructByte& byte) {
    return ((byte.function == "hls_outputs" || byte.function == "hls_in_reset") && byte.argument == 2) ||
           (byte.function == "hls_invariants" && byte.argument == 1);
  }

  llvm::Module& module_;
  Circuit circuit_;
  OpenValues opens_;
  std::unordered_map<Node, StructByte> bytes_;
};

}  // namespace

Circuit translate(llvm::Module& module) { return Translation(module).run(); }

}  // namespace meltstage::hls
