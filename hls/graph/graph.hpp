// SPDX-License-Identifier: Apache-2.0
// Bit-vector expressions that share equal parts: what a C++ function computes, as a circuit without flops.
#pragma once

#include <llvm/ADT/APInt.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

namespace meltstage::hls {

using llvm::APInt;

enum class Op : std::uint8_t {
  kInput,     // a named input
  kAny,       // a value that the C++ leaves open: an input without a name
  kConstant,  //
  kNot,
  kAnd,
  kOr,
  kXor,
  kAdd,
  kSub,
  kMul,
  kUnsignedDivide,
  kUnsignedRemainder,
  kSignedDivide,
  kSignedRemainder,
  kShiftLeft,
  kShiftRight,
  kShiftRightSigned,
  kEqual,
  kLess,        // unsigned
  kLessSigned,  //
  kSelect,      // first ? second : third
  kConcat,      // first above second
  kSlice,       // `width` bits of first from bit `low` on
  kSignExtend,  //
};

/// A node of the graph that made it.
using Node = std::uint32_t;

/// File and line of the C++ that asked for a node.
struct Place {
  std::string file;
  unsigned line = 0;
};

struct Expression {
  Op op;
  unsigned width;                   // bits, at least 1
  std::array<Node, 3> arguments{};  // as many as the operator takes; the others are 0
  unsigned low = 0;                 // kSlice; of kInput and kAny a number of its own
  unsigned used = 0;                // bits from here up are known to be 0
  unsigned significant = 0;         // the lowest bits that tell the number with its sign
};

/// Number of arguments of an operator.
unsigned argument_count(Op op);

class Graph {
 public:
  Graph();

  Node input(std::string name, unsigned width);
  Node any(unsigned width);
  Node constant(const APInt& value);
  Node constant(unsigned width, std::uint64_t value) { return constant(APInt(width, value)); }
  Node truth(bool value) { return constant(1, value ? 1 : 0); }

  /// One node of operators that take nodes of one width and give that width, or one bit when they compare.
  Node binary(Op op, Node a, Node b);
  Node invert(Node a);
  Node select(Node condition, Node then, Node otherwise);
  Node concat(Node high, Node low);
  Node slice(Node a, unsigned low, unsigned width);
  Node zero_extend(Node a, unsigned width);
  Node sign_extend(Node a, unsigned width);
  Node both(Node a, Node b) { return binary(Op::kAnd, a, b); }
  Node either(Node a, Node b) { return binary(Op::kOr, a, b); }

  const Expression& operator[](Node node) const { return expressions_[node]; }
  unsigned width(Node node) const { return expressions_[node].width; }
  std::size_t size() const { return expressions_.size(); }
  const std::string& name(Node input) const { return names_[expressions_[input].low]; }
  bool is_constant(Node node) const { return expressions_[node].op == Op::kConstant; }
  const APInt& value(Node constant) const { return values_[expressions_[constant].low]; }
  bool is_zero(Node node) const { return is_constant(node) && value(node).isZero(); }

  /// Which nodes `roots` rest on, and themselves.
  std::vector<bool> behind(const std::vector<Node>& roots) const;
  /// The roots as they are with other nodes in the place of some.
  std::vector<Node> replaced(const std::vector<Node>& roots, const std::unordered_map<Node, Node>& by);

  /// Nodes made from now on come from here.
  void at(Place place);
  const Place& place(Node node) const { return places_[place_of_[node]]; }

 private:
  struct Hash {
    std::size_t operator()(const Expression& e) const;
  };
  struct Equal {
    bool operator()(const Expression& a, const Expression& b) const;
  };

  Node again(const Expression& e, const std::array<Node, 3>& arguments);
  Node make(Op op, unsigned width, std::array<Node, 3> arguments, unsigned low = 0);
  bool is_ones(Node node) const { return is_constant(node) && value(node).isAllOnes(); }
  unsigned used_bits(const Expression& e) const;
  unsigned significant_bits(const Expression& e) const;
  Node fold(Op op, const APInt& a, const APInt& b);
  std::optional<Node> negated(Node a);
  std::optional<Node> joined_select(Node condition, Node then, Node otherwise);
  Node simplified(Op op, Node a, Node b, bool& done);

  std::vector<Expression> expressions_;
  std::vector<unsigned> place_of_;
  std::vector<Place> places_;
  std::vector<APInt> values_;
  std::vector<std::string> names_;
  std::unordered_map<Expression, Node, Hash, Equal> known_;
  std::unordered_map<std::string, unsigned> constants_;
};

}  // namespace meltstage::hls
