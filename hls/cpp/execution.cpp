// SPDX-License-Identifier: Apache-2.0
#include "hls/cpp/execution.hpp"

#include <fmt/format.h>
#include <llvm/ADT/DenseMap.h>
#include <llvm/ADT/MapVector.h>
#include <llvm/ADT/PostOrderIterator.h>
#include <llvm/Analysis/LoopInfo.h>
#include <llvm/Demangle/Demangle.h>
#include <llvm/IR/CFG.h>
#include <llvm/IR/Constants.h>
#include <llvm/IR/Dominators.h>
#include <llvm/IR/Instructions.h>
#include <llvm/IR/IntrinsicInst.h>
#include <llvm/IR/Operator.h>

#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "hls/cpp/arithmetic.hpp"
#include "hls/cpp/compile.hpp"
#include "hls/cpp/paths.hpp"
#include "hls/cpp/pointers.hpp"
#include "hls/graph/satisfiability.hpp"

namespace meltstage::hls {
namespace {

constexpr int kMostIterations = 4096;
constexpr int kRoundsBeforeAsking = 4;

// An integer, an aggregate of integers, or a pointer.
struct Value {
  std::vector<Node> parts;
  Pointer pointer;
};

// What a way takes to the next block: the values of its phis, and memory.
struct Carried {
  std::vector<Value> phis;
  Memory memory;
};

class Execution {
 public:
  Execution(Graph& graph, OpenValues& opens, llvm::Function& function, Memory memory)
      : graph_(graph),
        paths_(graph),
        findings_(graph, paths_, opens),
        function_(function),
        layout_(function.getParent()->getDataLayout()),
        addresses_(graph, findings_, layout_, std::move(memory)),
        loops_(llvm::DominatorTree(function)) {
    llvm::ReversePostOrderTraversal<llvm::Function*> order(&function);
    order_.assign(order.begin(), order.end());
    for (unsigned i = 0; i < function.arg_size(); ++i)
      values_[function.getArg(i)] = {{}, to_object(graph, i)};
  }

  // Memory after the function has returned.
  Memory run(std::vector<Promise>& promises) {
    require_loops_with_one_entry();
    carried_.push_back({{}, addresses_.memory()});
    incoming_[&function_.getEntryBlock()] = {Paths::kEntry};
    run_blocks(nullptr);
    if (returned_.empty()) refuse({}, fmt::format("{}() never returns", function_.getName().str()));
    findings_.promise(promises);
    return join(returned_).memory;
  }

 private:
  // ---- order of execution --------------------------------------------------------------------------------

  // A way back leads to the beginning of a loop around it. One into the middle would be left out.
  void require_loops_with_one_entry() const {
    std::map<const llvm::BasicBlock*, std::size_t> place_in_order;
    for (std::size_t i = 0; i < order_.size(); ++i) place_in_order[order_[i]] = i;
    for (llvm::BasicBlock* from : order_)
      for (llvm::BasicBlock* to : llvm::successors(from)) {
        if (place_in_order.at(to) > place_in_order.at(from)) continue;
        const llvm::Loop* loop = loops_.getLoopFor(to);
        if (loop != nullptr && loop->getHeader() == to && loop->contains(from)) continue;
        refuse(place_of(*from->getTerminator()),
               "found a way into the middle of a loop (goto, or a case within it), expected loops that are "
               "entered at "
               "their beginning");
      }
  }

  // Blocks of `loop` (nullptr: of none) once, loops in it as often as they go round.
  void run_blocks(const llvm::Loop* loop) {
    for (llvm::BasicBlock* block : order_) {
      const llvm::Loop* innermost = loops_.getLoopFor(block);
      if (innermost == loop) {
        execute(*block);
      } else if (innermost != nullptr && innermost->getHeader() == block &&
                 innermost->getParentLoop() == loop) {
        for (int i = 0; !incoming_[block].empty(); ++i) {
          if (i >= kRoundsBeforeAsking && !can_be_taken(incoming_[block])) {
            incoming_[block].clear();
            break;
          }
          if (i == kMostIterations) {
            refuse(place_of(*block->getTerminator()),
                   fmt::format("found a loop that goes on after {} rounds for some state and pins, expected "
                               "at most so many",
                               kMostIterations));
          }
          run_blocks(innermost);
        }
      }
    }
  }

  // The end of most loops is known as soon as the graph is made; that of others only the solver sees.
  bool can_be_taken(const std::vector<int>& edges) {
    Node taken = graph_.truth(false);
    for (const int edge : edges) taken = graph_.either(taken, paths_.taken(edge));
    return satisfiability_.can_hold(taken);
  }

  void execute(llvm::BasicBlock& block) {
    std::vector<int> edges;
    std::swap(edges, incoming_[&block]);
    if (edges.empty()) return;
    Carried carried = join(edges);
    paths_.enter(edges);
    for (const int edge : edges) carried_[edge].memory.clear();
    addresses_.set_memory(std::move(carried.memory));
    unsigned i = 0;
    for (llvm::PHINode& phi : block.phis()) values_[&phi] = carried.phis[i++];
    for (llvm::Instruction& instruction : block) {
      if (llvm::isa<llvm::PHINode>(instruction)) continue;
      findings_.at(instruction);
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
      returned_.push_back(add_edge(graph_.truth(true), {{}, addresses_.memory()}));
    } else if (llvm::isa<llvm::UnreachableInst>(instruction)) {
      if (!findings_.is_trapped())
        findings_.trap(graph_.truth(true), "a place is reached that the C++ rules out");
    } else {
      findings_.refuse(
          fmt::format("found {}, expected branches, switches and returns", instruction.getOpcodeName()));
    }
  }

  void leave(llvm::BasicBlock& from, Node condition, llvm::BasicBlock& to) {
    if (graph_.is_zero(condition)) return;
    Carried carried{{}, addresses_.memory()};
    for (llvm::PHINode& phi : to.phis())
      carried.phis.push_back(value_of(phi.getIncomingValueForBlock(&from)));
    incoming_[&to].push_back(add_edge(condition, std::move(carried)));
  }

  // A new edge out of the block that is executed.
  int add_edge(Node when, Carried carried) {
    carried_.push_back(std::move(carried));
    return paths_.leave(when);
  }

  // Values and memory behind a place where edges meet.
  Carried join(const std::vector<int>& edges) {
    const Carried& first = carried_[edges[0]];
    if (edges.size() == 1) return first;
    Carried result;
    for (std::size_t phi = 0; phi < first.phis.size(); ++phi)
      result.phis.push_back(
          meet_values(edges, [&](std::size_t i) -> const Value& { return carried_[edges[i]].phis[phi]; }));
    std::vector<const Memory*> memories;
    for (const int edge : edges) memories.push_back(&carried_[edge].memory);
    result.memory = meet(graph_, paths_, edges, memories);
    return result;
  }

  Value meet_values(const std::vector<int>& edges, llvm::function_ref<const Value&(std::size_t)> value) {
    Value result;
    for (std::size_t part = 0; part < value(0).parts.size(); ++part)
      result.parts.push_back(paths_.meet(edges, [&](std::size_t i) { return value(i).parts[part]; }));
    if (value(0).parts.empty()) {
      for (std::size_t k = 0; k < edges.size(); ++k) {
        const Node taken = paths_.meet(edges, [&](std::size_t i) { return graph_.truth(i == k); });
        for (const Target& target : taken_when(graph_, taken, value(k).pointer))
          if (!graph_.is_zero(target.when)) result.pointer.push_back(target);
      }
    }
    return result;
  }

  // ---- values --------------------------------------------------------------------------------------------

  Value value_of(const llvm::Value* value) {
    if (const auto* constant = llvm::dyn_cast<llvm::Constant>(value)) return constant_value(constant);
    const auto known = values_.find(value);
    if (known == values_.end()) findings_.refuse("found a value that no instruction gave");
    return known->second;
  }

  Value constant_value(const llvm::Constant* constant) {
    if (const auto* number = llvm::dyn_cast<llvm::ConstantInt>(constant))
      return {{graph_.constant(number->getValue())}, {}};
    if (constant->getType()->isPointerTy()) return {{}, addresses_.constant_pointer(constant)};
    if (keeps_address(*constant))
      return {{}, addresses_.constant_pointer(llvm::cast<llvm::Constant>(constant->getOperand(0)))};
    if (constant->getType()->isIntegerTy() && llvm::isa<llvm::UndefValue>(constant))
      return {{findings_.open(constant->getType()->getIntegerBitWidth(), "a local")}, {}};
    if (constant->getType()->isAggregateType()) {
      Value result;
      for (unsigned i = 0; constant->getAggregateElement(i) != nullptr; ++i)
        result.parts.push_back(constant_value(constant->getAggregateElement(i)).parts.at(0));
      return result;
    }
    refuse_type(constant->getType());
  }

  Node integer(const llvm::Value* value) {
    const Value result = value_of(value);
    if (result.parts.size() != 1)
      findings_.refuse(fmt::format("found {}, expected a whole number", value->getType()->isIntegerTy()
                                                                            ? "an address as a number"
                                                                            : type_name(value->getType())));
    return result.parts[0];
  }

  [[noreturn]] void refuse_type(llvm::Type* type) const {
    findings_.refuse(fmt::format("found {}, expected whole numbers only", type_name(type)));
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
        findings_.refuse(fmt::format("found a write of {}, expected whole numbers in memory",
                                     type_name(write->getValueOperand()->getType())));
      const auto bytes = layout_.getTypeStoreSize(write->getValueOperand()->getType());
      return addresses_.store(value_of(write->getPointerOperand()).pointer,
                              graph_.zero_extend(value.parts[0], static_cast<unsigned>(8 * bytes)));
    }
    values_[&instruction] = result_of(instruction);
  }

  Value result_of(llvm::Instruction& instruction) {
    llvm::Type* type = instruction.getType();
    if (const auto* operation = llvm::dyn_cast<llvm::BinaryOperator>(&instruction))
      return computed(*operation);
    if (const auto* compare = llvm::dyn_cast<llvm::ICmpInst>(&instruction)) return {{compared(*compare)}, {}};
    if (const auto* choice = llvm::dyn_cast<llvm::SelectInst>(&instruction)) return selection(*choice);
    if (const auto* address = llvm::dyn_cast<llvm::GEPOperator>(&instruction)) return {{}, moved(*address)};
    if (const auto* read = llvm::dyn_cast<llvm::LoadInst>(&instruction)) return loaded(*read);
    if (const auto* part = llvm::dyn_cast<llvm::ExtractValueInst>(&instruction)) {
      if (part->getNumIndices() != 1) findings_.refuse("found a structure within a structure as a value");
      return {{value_of(part->getAggregateOperand()).parts.at(part->getIndices()[0])}, {}};
    }
    if (const auto* part = llvm::dyn_cast<llvm::InsertValueInst>(&instruction)) {
      if (part->getNumIndices() != 1) findings_.refuse("found a structure within a structure as a value");
      Value whole = value_of(part->getAggregateOperand());
      whole.parts.at(part->getIndices()[0]) = integer(part->getInsertedValueOperand());
      return whole;
    }
    if (llvm::isa<llvm::FreezeInst>(instruction) || llvm::isa<llvm::BitCastInst>(instruction)) {
      if (!type->isIntegerTy() && !type->isPointerTy()) refuse_type(type);
      return value_of(instruction.getOperand(0));
    }
    if (keeps_address(instruction)) return value_of(instruction.getOperand(0));
    if (const auto* room = llvm::dyn_cast<llvm::AllocaInst>(&instruction))
      return {{}, addresses_.allocate(*room)};
    if (type->isIntegerTy() && instruction.getNumOperands() == 1 &&
        instruction.getOperand(0)->getType()->isIntegerTy()) {
      const unsigned bits = type->getIntegerBitWidth();
      const Node from = integer(instruction.getOperand(0));
      if (llvm::isa<llvm::ZExtInst>(instruction)) return {{graph_.zero_extend(from, bits)}, {}};
      if (llvm::isa<llvm::SExtInst>(instruction)) return {{graph_.sign_extend(from, bits)}, {}};
      if (llvm::isa<llvm::TruncInst>(instruction)) return {{graph_.slice(from, 0, bits)}, {}};
    }
    findings_.refuse(
        fmt::format("found {}, expected whole numbers, branches and memory of flops, pins and locals",
                    type->isFloatingPointTy() ? "a floating-point number" : instruction.getOpcodeName()));
  }

  Value computed(const llvm::BinaryOperator& operation) {
    if (!operation.getType()->isIntegerTy()) refuse_type(operation.getType());
    const unsigned bits = operation.getType()->getIntegerBitWidth();
    const Value first = value_of(operation.getOperand(0)), second = value_of(operation.getOperand(1));
    const bool adds = operation.getOpcode() == llvm::Instruction::Add,
               subtracts = operation.getOpcode() == llvm::Instruction::Sub;
    if (subtracts && is_address(first) && is_address(second))
      return {{graph_.slice(distance_of(first.pointer, second.pointer), 0, bits)}, {}};
    if (adds && is_address(first) && !is_address(second)) return moved(first, second.parts[0]);
    if (adds && !is_address(first) && is_address(second)) return moved(second, first.parts[0]);
    if (subtracts && is_address(first) && !is_address(second))
      return moved(first, graph_.binary(Op::kSub, graph_.constant(bits, 0), second.parts[0]));
    const Node a = integer(operation.getOperand(0));
    const Node b = integer(operation.getOperand(1));
    return {{arithmetic(graph_, operation.getOpcode(), a, b)}, {}};
  }

  Value moved(Value address, Node bytes) {
    for (Target& target : address.pointer) add_index(graph_, target, graph_.sign_extend(bytes, 64), 1);
    return address;
  }

  // Only distances are taken of addresses as numbers, and those of their lowest bits are as good.
  bool keeps_address(const llvm::Value& value) {
    if (llvm::isa<llvm::PtrToIntOperator>(value)) return true;
    const auto* narrower = llvm::dyn_cast<llvm::TruncInst>(&value);
    return narrower != nullptr && is_address(value_of(narrower->getOperand(0)));
  }

  // A number that is where something lies.
  static bool is_address(const Value& value) { return value.parts.empty(); }

  Node compared(const llvm::ICmpInst& compare) {
    const llvm::Type* type = compare.getOperand(0)->getType();
    if ((type->isPointerTy() || type->isIntegerTy(64)) && is_address(value_of(compare.getOperand(0))) &&
        is_address(value_of(compare.getOperand(1))))
      return compared_pointers(compare);
    const Node a = integer(compare.getOperand(0));
    const Node b = integer(compare.getOperand(1));
    return comparison(graph_, compare.getPredicate(), a, b);
  }

  Node compared_pointers(const llvm::ICmpInst& compare) {
    const Pointer a = value_of(compare.getOperand(0)).pointer;
    const Pointer b = value_of(compare.getOperand(1)).pointer;
    if (compare.isEquality()) {
      const Node same = is_same_place(graph_, a, b);
      return compare.getPredicate() == llvm::CmpInst::ICMP_EQ ? same : graph_.invert(same);
    }
    return comparison(graph_, compare.getSignedPredicate(), distance_of(a, b), graph_.constant(64, 0));
  }

  Node distance_of(const Pointer& a, const Pointer& b) {
    if (const Node apart = are_apart(graph_, a, b); !graph_.is_zero(apart))
      findings_.trap(apart, "addresses in different objects are subtracted or ordered");
    return distance(graph_, a, b);
  }

  Value selection(const llvm::SelectInst& choice) {
    const Node condition = integer(choice.getCondition());
    const Value then = value_of(choice.getTrueValue());
    const Value otherwise = value_of(choice.getFalseValue());
    if (graph_.is_constant(condition)) return graph_.is_zero(condition) ? otherwise : then;
    Value result;
    for (std::size_t i = 0; i < then.parts.size(); ++i)
      result.parts.push_back(graph_.select(condition, then.parts[i], otherwise.parts[i]));
    for (const auto& [pointer, taken] :
         {std::pair(&then.pointer, condition), std::pair(&otherwise.pointer, graph_.invert(condition))})
      for (const Target& target : taken_when(graph_, taken, *pointer)) result.pointer.push_back(target);
    return result;
  }

  // The address of a member or of an array's word.
  Pointer moved(const llvm::GEPOperator& address) {
    llvm::MapVector<llvm::Value*, APInt> scales;
    APInt constant(64, 0);
    if (!address.collectOffset(layout_, 64, scales, constant))
      findings_.refuse("found an address of unknown size");
    Pointer pointer = value_of(address.getPointerOperand()).pointer;
    const std::optional<Range> array = array_of(address, layout_);
    for (Target& target : pointer) {
      if (array && !target.index)
        target.array = Range{target.start + array->first, target.start + array->behind};
      target.start += constant.getSExtValue();
      for (const auto& [value, scale] : scales) {
        const Node index = graph_.sign_extend(integer(value), 64);
        add_index(graph_, target, index, scale.getZExtValue());
      }
    }
    return pointer;
  }

  Value loaded(const llvm::LoadInst& read) {
    const Pointer pointer = value_of(read.getPointerOperand()).pointer;
    if (read.getType()->isPointerTy()) return {{}, addresses_.load_pointer(pointer, read.getType())};
    if (!read.getType()->isIntegerTy()) refuse_type(read.getType());
    const auto bytes = static_cast<std::size_t>(layout_.getTypeStoreSize(read.getType()));
    return {{graph_.slice(addresses_.load(pointer, bytes), 0, read.getType()->getIntegerBitWidth())}, {}};
  }

  // ---- calls ---------------------------------------------------------------------------------------------

  [[noreturn]] void refuse_function(const llvm::Function& called) {
    std::string name = llvm::demangle(called.getName().str());
    if (name.find('(') == std::string::npos) name += "()";
    if (called.isDeclaration())
      findings_.refuse(fmt::format("found a call of {}, expected functions whose source is given", name));
    findings_.refuse(fmt::format(
        "found a call of {} that can't be copied in, expected no recursion and no noinline", name));
  }

  void run_call(llvm::CallInst& call) {
    if (call.isInlineAsm()) findings_.refuse("found assembler, expected C++");
    const llvm::Function* called = call.getCalledFunction();
    if (called == nullptr) findings_.refuse("found a call through a pointer, expected functions by name");
    const std::string name = called->getName().str();
    if (name == "bcmp" || name == "memcmp") {
      values_[&call] = {{order_of_bytes(call)}, {}};
      return;
    }
    if (llvm::StringRef(name).startswith(kOpenLocal)) {
      values_[&call] = {
          {findings_.open(call.getType()->getIntegerBitWidth(),
                          llvm::StringRef(name).substr(std::strlen(kOpenLocal)).split('.').second.str())},
          {}};
      return;
    }
    if (!called->isIntrinsic()) refuse_function(*called);
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
        return findings_.trap(graph_.invert(integer(call.getArgOperand(0))),
                              "what the C++ takes for granted is not so");
      case llvm::Intrinsic::trap:
      case llvm::Intrinsic::ubsantrap:
        return findings_.trap(graph_.truth(true),
                              "undefined behaviour of C++ (overflow, shift, index or the like)");
      case llvm::Intrinsic::abs:
        promise_of_abs(call);
        values_[&call] = {result_of(llvm::cast<llvm::IntrinsicInst>(call)), {}};
        return;
      case llvm::Intrinsic::is_constant:
        values_[&call] = {{graph_.truth(graph_.is_constant(integer(call.getArgOperand(0))))}, {}};
        return;
      case llvm::Intrinsic::memcpy:
      case llvm::Intrinsic::memmove:
        return copy(call);
      case llvm::Intrinsic::memset:
        return fill(call);
      default:
        values_[&call] = {result_of(llvm::cast<llvm::IntrinsicInst>(call)), {}};
    }
  }

  std::size_t known_bytes(const llvm::Value* value) {
    const Node bytes = integer(value);
    if (!graph_.is_constant(bytes) || graph_.value(bytes).getLimitedValue() > kMostObjectBytes)
      findings_.refuse("found a copy whose size is not known, expected a constant one");
    return static_cast<std::size_t>(graph_.value(bytes).getZExtValue());
  }

  // A pointer to one place that is known.
  Target known_place(const llvm::Value* value) {
    const Pointer pointer = value_of(value).pointer;
    if (!is_known(pointer))
      findings_.refuse("found a copy between places that depend on flops or pins, expected known ones");
    return pointer[0];
  }

  void copy(const llvm::CallInst& call) {
    const std::size_t bytes = known_bytes(call.getArgOperand(2));
    const Target to = known_place(call.getArgOperand(0));
    const Target from = known_place(call.getArgOperand(1));
    addresses_.copy(to, from, bytes);
  }

  void fill(const llvm::CallInst& call) {
    const std::size_t bytes = known_bytes(call.getArgOperand(2));
    const Target to = known_place(call.getArgOperand(0));
    addresses_.fill(to, integer(call.getArgOperand(1)), bytes);
  }

  Node order_of_bytes(const llvm::CallInst& call) {
    const std::size_t bytes = known_bytes(call.getArgOperand(2));
    const Pointer a = value_of(call.getArgOperand(0)).pointer;
    const Pointer b = value_of(call.getArgOperand(1)).pointer;
    return addresses_.order(a, b, bytes);
  }

  // The least number has no absolute value of its width: undefined where the compiler says so.
  void promise_of_abs(const llvm::CallInst& call) {
    const auto* forbidden = llvm::dyn_cast<llvm::ConstantInt>(call.getArgOperand(1));
    if (forbidden == nullptr || forbidden->isZero() || !call.getType()->isIntegerTy()) return;
    const Node least = graph_.constant(llvm::APInt::getSignedMinValue(call.getType()->getIntegerBitWidth()));
    findings_.trap(graph_.binary(Op::kEqual, integer(call.getArgOperand(0)), least),
                   "the absolute value of the least number overflows");
  }

  std::vector<Node> result_of(const llvm::IntrinsicInst& call) {
    const std::string name = call.getCalledFunction()->getName().str();
    if (call.arg_size() == 0 || !call.getArgOperand(0)->getType()->isIntegerTy())
      findings_.refuse(fmt::format("found {}, expected whole numbers only", name));
    std::vector<Node> parts =
        intrinsic(graph_, call, [&](unsigned i) { return integer(call.getArgOperand(i)); });
    if (parts.empty()) findings_.refuse(fmt::format("found {}, which has no circuit here", name));
    return parts;
  }

  Graph& graph_;
  Satisfiability satisfiability_{graph_};
  Paths paths_;
  Findings findings_;
  llvm::Function& function_;
  const llvm::DataLayout& layout_;
  AddressSpace addresses_;
  llvm::LoopInfo loops_;
  std::vector<llvm::BasicBlock*> order_;

  std::vector<Carried> carried_;  // by edge
  std::map<const llvm::BasicBlock*, std::vector<int>> incoming_;
  std::vector<int> returned_;
  llvm::DenseMap<const llvm::Value*, Value> values_;
};

}  // namespace

Memory execute(Graph& graph, std::vector<Promise>& promises, OpenValues& opens, llvm::Function& function,
               Memory memory) {
  return Execution(graph, opens, function, std::move(memory)).run(promises);
}

}  // namespace meltstage::hls
