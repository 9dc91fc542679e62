// SPDX-License-Identifier: Apache-2.0
#include "hls/cpp/arithmetic.hpp"

#include <utility>

namespace meltstage::hls {
namespace {

Op operator_of(llvm::Instruction::BinaryOps code) {
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

Node sign(Graph& graph, Node a) { return graph.slice(a, graph.width(a) - 1, 1); }
Node negative(Graph& graph, Node a) { return graph.binary(Op::kSub, graph.constant(graph.width(a), 0), a); }

Node lesser(Graph& graph, Op less, Node a, Node b) { return graph.select(graph.binary(less, a, b), a, b); }
Node greater(Graph& graph, Op less, Node a, Node b) { return graph.select(graph.binary(less, a, b), b, a); }

Node ones(Graph& graph, Node a) {
  const unsigned bits = graph.width(a);
  Node result = graph.zero_extend(graph.slice(a, 0, 1), bits);
  for (unsigned i = 1; i < bits; ++i)
    result = graph.binary(Op::kAdd, result, graph.zero_extend(graph.slice(a, i, 1), bits));
  return result;
}

// Zeros below the lowest one (trailing) or above the highest one.
Node zeros(Graph& graph, Node a, bool trailing) {
  const unsigned bits = graph.width(a);
  Node result = graph.constant(bits, bits);
  for (unsigned i = 0; i < bits; ++i) {
    const unsigned bit = trailing ? bits - 1 - i : i;
    result =
        graph.select(graph.slice(a, bit, 1), graph.constant(bits, trailing ? bit : bits - 1 - bit), result);
  }
  return result;
}

// Sum, difference or product in as many bits as it needs; from it the result and whether it overflowed, or
// the saturated result.
std::vector<Node> exact(Graph& graph, const llvm::BinaryOpIntrinsic& call, Node a, Node b) {
  const bool is_signed = call.isSigned();
  const Op op = operator_of(call.getBinaryOp());
  const unsigned bits = graph.width(a);
  const unsigned wide = op == Op::kMul ? 2 * bits : bits + 2;
  const auto widened = [&](Node x) {
    return is_signed ? graph.sign_extend(x, wide) : graph.zero_extend(x, wide);
  };
  const Node result = graph.binary(op, widened(a), widened(b));
  const Node narrow = graph.slice(result, 0, bits);
  const Node overflow = graph.invert(graph.binary(Op::kEqual, widened(narrow), result));
  if (llvm::isa<llvm::WithOverflowInst>(call)) return {narrow, overflow};
  const Node below = graph.constant(is_signed ? APInt::getSignedMinValue(bits) : APInt(bits, 0));
  const Node above = graph.constant(is_signed ? APInt::getSignedMaxValue(bits) : APInt::getAllOnes(bits));
  return {graph.select(overflow, graph.select(sign(graph, result), below, above), narrow)};
}

}  // namespace

Node arithmetic(Graph& graph, llvm::Instruction::BinaryOps code, Node a, Node b) {
  return graph.binary(operator_of(code), a, b);
}

Node comparison(Graph& graph, llvm::CmpInst::Predicate predicate, Node a, Node b) {
  using Predicate = llvm::CmpInst::Predicate;
  const bool negated = predicate == Predicate::ICMP_NE || llvm::CmpInst::isNonStrictPredicate(predicate);
  if (negated) predicate = llvm::CmpInst::getInversePredicate(predicate);
  if (predicate == Predicate::ICMP_UGT || predicate == Predicate::ICMP_SGT) std::swap(a, b);
  const Op op = predicate == Predicate::ICMP_EQ      ? Op::kEqual
                : llvm::CmpInst::isSigned(predicate) ? Op::kLessSigned
                                                     : Op::kLess;
  const Node result = graph.binary(op, a, b);
  return negated ? graph.invert(result) : result;
}

std::vector<Node> intrinsic(Graph& graph, const llvm::IntrinsicInst& call,
                            llvm::function_ref<Node(unsigned)> operand) {
  const Node a = operand(0);
  const unsigned bits = graph.width(a);
  if (const auto* operation = llvm::dyn_cast<llvm::BinaryOpIntrinsic>(&call))
    return exact(graph, *operation, a, operand(1));
  const llvm::Intrinsic::ID id = call.getIntrinsicID();
  switch (id) {
    case llvm::Intrinsic::expect:
      return {a};
    case llvm::Intrinsic::abs:
      return {graph.select(sign(graph, a), negative(graph, a), a)};
    case llvm::Intrinsic::umin:
      return {lesser(graph, Op::kLess, a, operand(1))};
    case llvm::Intrinsic::umax:
      return {greater(graph, Op::kLess, a, operand(1))};
    case llvm::Intrinsic::smin:
      return {lesser(graph, Op::kLessSigned, a, operand(1))};
    case llvm::Intrinsic::smax:
      return {greater(graph, Op::kLessSigned, a, operand(1))};
    case llvm::Intrinsic::ctpop:
      return {ones(graph, a)};
    case llvm::Intrinsic::cttz:
      return {zeros(graph, a, true)};
    case llvm::Intrinsic::ctlz:
      return {zeros(graph, a, false)};
    case llvm::Intrinsic::bswap: {
      Node result = graph.slice(a, 0, 8);
      for (unsigned i = 8; i < bits; i += 8) result = graph.concat(result, graph.slice(a, i, 8));
      return {result};
    }
    case llvm::Intrinsic::bitreverse: {
      Node result = graph.slice(a, 0, 1);
      for (unsigned i = 1; i < bits; ++i) result = graph.concat(result, graph.slice(a, i, 1));
      return {result};
    }
    case llvm::Intrinsic::fshl:
    case llvm::Intrinsic::fshr: {
      const Node pair = graph.concat(a, operand(1));
      const Node by = graph.binary(Op::kUnsignedRemainder, operand(2), graph.constant(bits, bits));
      const Op op = id == llvm::Intrinsic::fshl ? Op::kShiftLeft : Op::kShiftRight;
      const Node shifted = graph.binary(op, pair, graph.zero_extend(by, 2 * bits));
      return {graph.slice(shifted, id == llvm::Intrinsic::fshl ? bits : 0, bits)};
    }
    default:
      return {};
  }
}

}  // namespace meltstage::hls
