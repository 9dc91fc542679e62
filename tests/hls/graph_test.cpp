// SPDX-License-Identifier: Apache-2.0
// Expressions: what the graph folds, narrows and puts into gates is what the operators mean on numbers.
#include "hls/graph/graph.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "hls/graph/aig.hpp"
#include "hls/proof/prover.hpp"

namespace meltstage::hls {
namespace {

APInt meant(Op op, const APInt& a, const APInt& b) {
  const unsigned bits = a.getBitWidth();
  switch (op) {
    case Op::kAnd:
      return a & b;
    case Op::kOr:
      return a | b;
    case Op::kXor:
      return a ^ b;
    case Op::kAdd:
      return a + b;
    case Op::kSub:
      return a - b;
    case Op::kMul:
      return a * b;
    case Op::kUnsignedDivide:
      return b.isZero() ? APInt::getAllOnes(bits) : a.udiv(b);
    case Op::kUnsignedRemainder:
      return b.isZero() ? a : a.urem(b);
    case Op::kShiftLeft:
      return a.shl(b);
    case Op::kShiftRight:
      return a.lshr(b);
    case Op::kShiftRightSigned:
      return a.ashr(b);
    case Op::kEqual:
      return APInt(1, a == b);
    case Op::kLess:
      return APInt(1, a.ult(b));
    default:
      return APInt(1, a.slt(b));
  }
}

constexpr Op kOps[] = {Op::kAnd,
                       Op::kOr,
                       Op::kXor,
                       Op::kAdd,
                       Op::kSub,
                       Op::kMul,
                       Op::kUnsignedDivide,
                       Op::kUnsignedRemainder,
                       Op::kShiftLeft,
                       Op::kShiftRight,
                       Op::kShiftRightSigned,
                       Op::kEqual,
                       Op::kLess,
                       Op::kLessSigned};

// A random expression of three inputs and its value for theirs, built side by side.
class Both {
 public:
  Both(std::mt19937_64& random, Graph& graph) : random_(random), graph_(graph) {
    for (const char* name : {"a", "b", "c"}) {
      const unsigned width = pick(12) + 1;
      const APInt value(width, random_());
      nodes_.push_back(graph.input(name, width));
      values_.push_back(value);
      for (unsigned i = 0; i < width; ++i) {
        bits_[width == 1 ? name : std::string(name) + "[" + std::to_string(i) + "]"] = aig_.input();
        inputs_.push_back(value[i]);
      }
    }
  }

  void grow() {
    const std::size_t x = pick(nodes_.size()), y = pick(nodes_.size());
    const Node a = nodes_[x];
    const APInt va = values_[x];
    const unsigned kind = pick(6);
    SCOPED_TRACE(fmt::format("kind {} of a {} bit expression with operator {}", kind, graph_.width(a),
                             static_cast<int>(graph_[a].op)));
    switch (kind) {
      case 0:
        return add(graph_.invert(a), ~va);
      case 1: {
        const unsigned low = pick(va.getBitWidth()), bits = 1 + pick(va.getBitWidth() - low);
        return add(graph_.slice(a, low, bits), va.extractBits(bits, low));
      }
      case 2: {
        const unsigned bits = va.getBitWidth() + pick(4);
        return pick(2) == 0 ? add(graph_.sign_extend(a, bits), va.sext(bits))
                            : add(graph_.zero_extend(a, bits), va.zext(bits));
      }
      case 3:
        if (va.getBitWidth() + values_[y].getBitWidth() > 24) return;
        return add(graph_.concat(a, nodes_[y]), va.concat(values_[y]));
      case 4: {
        const auto [b, vb] = as_wide(y, va.getBitWidth());
        const std::size_t z = pick(nodes_.size());
        const Node one = graph_.slice(nodes_[z], 0, 1);
        return add(graph_.select(one, a, b), values_[z][0] ? va : vb);
      }
      default: {
        const auto [b, vb] = as_wide(y, va.getBitWidth());
        const Op op = kOps[pick(std::size(kOps))];
        SCOPED_TRACE(fmt::format("operator {} of {} and {}, {} bits", static_cast<int>(op), va.getZExtValue(),
                                 vb.getZExtValue(), va.getBitWidth()));
        return add(graph_.binary(op, a, b), meant(op, va, vb));
      }
    }
  }

  void expect_same_in_gates() {
    Blaster blaster(graph_, aig_, bits_, {});
    const Word& word = blaster.bits(nodes_.back());
    const std::vector<bool> value = evaluate(aig_, inputs_);
    ASSERT_EQ(word.size(), values_.back().getBitWidth());
    for (unsigned i = 0; i < word.size(); ++i)
      ASSERT_EQ(value[word[i] / 2] != ((word[i] & 1) != 0), values_.back()[i]) << "bit " << i;
  }

 private:
  unsigned pick(std::size_t count) { return static_cast<unsigned>(random_() % count); }
  void add(Node node, const APInt& value) {
    ASSERT_EQ(graph_.width(node), value.getBitWidth());
    if (graph_.is_constant(node)) {
      ASSERT_EQ(graph_.value(node), value);
    }
    nodes_.push_back(node);
    values_.push_back(value);
  }
  // Or one of those that make a product a shift: 2^k, 2^k - 1, -2^k.
  APInt any_constant(unsigned bits) {
    const APInt power = APInt::getOneBitSet(bits, pick(bits));
    switch (pick(5)) {
      case 0:
        return power;
      case 1:
        return power - 1;
      case 2:
        return -power;
      default:
        return APInt(bits, random_());
    }
  }
  std::pair<Node, APInt> as_wide(std::size_t i, unsigned bits) {
    const APInt& value = values_[i];
    if (pick(4) == 0) {
      const APInt constant = any_constant(bits);
      return {graph_.constant(constant), constant};
    }
    if (value.getBitWidth() >= bits) return {graph_.slice(nodes_[i], 0, bits), value.trunc(bits)};
    return {graph_.zero_extend(nodes_[i], bits), value.zext(bits)};
  }

  std::mt19937_64& random_;
  Graph& graph_;
  Aig aig_;
  Bits bits_;
  std::vector<bool> inputs_;
  std::vector<Node> nodes_;
  std::vector<APInt> values_;
};

TEST(Graph, WhatItMakesOfExpressionsIsWhatTheyMean) {
  const std::uint64_t seed = std::random_device()();
  RecordProperty("seed", std::to_string(seed));
  std::mt19937_64 random(seed);
  for (int round = 0; round < 3000; ++round) {
    Graph graph;
    Both both(random, graph);
    for (int i = 0; i < 12; ++i) both.grow();
    both.expect_same_in_gates();
    if (HasFatalFailure()) FAIL() << "seed " << seed << ", round " << round;
  }
}

TEST(Graph, EqualExpressionsAreOneNode) {
  Graph graph;
  const Node a = graph.input("a", 8), b = graph.input("b", 8);
  EXPECT_EQ(graph.binary(Op::kAdd, a, b), graph.binary(Op::kAdd, b, a));
  EXPECT_EQ(graph.select(graph.truth(true), a, b), a);
  EXPECT_EQ(graph.binary(Op::kXor, a, a), graph.constant(8, 0));
}

// LLVM writes a - 8 b as a + -8 b, and 8 a - a as 7 a.
TEST(Graph, ChoicesThatLeadToTwoValuesAreOneChoice) {
  Graph graph;
  const Node c = graph.input("c", 1), d = graph.input("d", 1);
  const Node v = graph.input("v", 8), o = graph.input("o", 8);
  const auto choice = [&](Node condition, Node then, Node otherwise) {
    return graph.select(condition, then, otherwise);
  };
  EXPECT_EQ(choice(c, choice(d, v, o), o), choice(graph.both(c, d), v, o));
  EXPECT_EQ(choice(c, choice(d, o, v), o), choice(graph.both(c, graph.invert(d)), v, o));
  EXPECT_EQ(choice(c, v, choice(d, v, o)), choice(graph.either(c, d), v, o));
  EXPECT_EQ(choice(c, v, choice(d, o, v)), choice(graph.either(c, graph.invert(d)), v, o));
  const Node e = graph.input("e", 1);
  EXPECT_EQ(choice(c, choice(d, v, o), choice(e, v, o)), choice(choice(c, d, e), v, o));
}

TEST(Graph, TheLowestBitOfASumNeedsNoAdder) {
  Graph graph;
  const Node a = graph.input("a", 8), b = graph.input("b", 8);
  const Node parity = graph.binary(Op::kXor, graph.slice(a, 0, 1), graph.slice(b, 0, 1));
  EXPECT_EQ(graph.slice(graph.binary(Op::kAdd, a, b), 0, 1), parity);
  EXPECT_EQ(graph.slice(graph.binary(Op::kSub, a, b), 0, 1), parity);
}

TEST(Graph, ProductsByConstantsOfFewDigitsAreShiftsAndDifferences) {
  Graph graph;
  const Node a = graph.input("a", 16), b = graph.input("b", 16);
  const Node eight_b = graph.binary(Op::kShiftLeft, b, graph.constant(16, 3));
  const auto times = [&](Node x, const APInt& factor) {
    return graph.binary(Op::kMul, x, graph.constant(factor));
  };
  EXPECT_EQ(graph.binary(Op::kAdd, a, times(b, -APInt(16, 8))), graph.binary(Op::kSub, a, eight_b));
  EXPECT_EQ(times(b, APInt(16, 7)), graph.binary(Op::kSub, eight_b, b));
}

}  // namespace
}  // namespace meltstage::hls
