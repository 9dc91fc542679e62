// SPDX-License-Identifier: Apache-2.0
// And-inverter graphs: the circuit in gates of one kind, as solvers take it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "hls/graph/circuit.hpp"

namespace meltstage::hls {

/// Node and, in the lowest bit, whether it is inverted. 0 is false, 1 is true.
using Literal = std::uint32_t;
inline constexpr Literal kFalse = 0;
inline constexpr Literal kTrue = 1;

class Aig {
 public:
  Literal input();
  Literal constant(bool value) const { return value ? kTrue : kFalse; }
  Literal both(Literal a, Literal b);
  Literal either(Literal a, Literal b) { return both(a ^ 1, b ^ 1) ^ 1; }
  Literal differ(Literal a, Literal b) { return either(both(a, b ^ 1), both(a ^ 1, b)); }
  Literal select(Literal condition, Literal then, Literal otherwise) {
    return either(both(condition, then), both(condition ^ 1, otherwise));
  }

  /// Node 0 is false; each other node is an input, or the AND of two older nodes.
  struct And {
    Literal a;
    Literal b;
  };
  std::size_t nodes() const { return ands_.size(); }
  const And& operator[](std::size_t node) const { return ands_[node]; }
  bool is_input(std::size_t node) const { return ands_[node].a == kNoLiteral; }
  /// Literals of the inputs in the order in which they were made.
  const std::vector<Literal>& inputs() const { return inputs_; }

  /// Nodes that `roots` rest on, inputs too, older ones first.
  std::vector<std::uint32_t> cone(std::span<const Literal> roots) const;

 private:
  static constexpr Literal kNoLiteral = ~Literal{0};

  std::vector<Literal> inputs_;
  std::vector<And> ands_ = {{kFalse, kFalse}};
  std::unordered_map<std::uint64_t, Literal> known_;
};

/// Bits by name: NAME of one bit, NAME[BIT] of several.
using Bits = std::unordered_map<std::string, Literal>;

/// Bits of a number, the lowest one first.
using Word = std::vector<Literal>;

/// A product that is known by its name alone: what is multiplied as numbers of kProductBits with their sign,
/// and inputs that stand for the result.
inline constexpr unsigned kProductBits = 64;
struct Product {
  Word a;
  Word b;
  Word result;
};

/// Expressions in gates. `inputs` holds a literal for every bit of a named input; what the C++ leaves open
/// becomes an input of its own. A product of two variables is that of `products` which has the same operands,
/// and otherwise any number; without `products` it is made of gates.
class Blaster {
 public:
  Blaster(const Graph& graph, Aig& aig, const Bits& inputs, std::span<const Product> products)
      : graph_(graph), aig_(aig), inputs_(inputs), products_(products) {}
  const Word& bits(Node node);
  /// Of numbers of one width, and as wide.
  Word product(const Word& a, const Word& b);

 private:
  Word make(const Expression& e, Node node);
  Word sum(const Word& a, const Word& b, Literal carry);
  Word named_product(const Word& a, const Word& b);
  Word any(unsigned width);
  Literal same(const Word& a, const Word& b);
  std::pair<Word, Word> quotient(const Word& a, const Word& b);
  Word shifted(const Word& a, const Word& by, Op op);
  Literal less(const Word& a, const Word& b);
  Word chosen(Literal condition, const Word& then, const Word& otherwise);

  const Graph& graph_;
  Aig& aig_;
  const Bits& inputs_;
  std::span<const Product> products_;
  std::unordered_map<Node, Word> known_;
};

/// A binary AIGER file without latches, with names (Yosys: write_aiger -symbols).
struct AigerFile {
  std::vector<std::string> inputs;
  struct Output {
    std::string name;
    std::uint32_t value;
  };
  std::vector<Output> outputs;
  std::vector<Aig::And> ands;  // over the file's own literals: inputs, ands
};
AigerFile read_aiger(const std::filesystem::path& path);

/// Writes a binary AIGER file without latches; its inputs are those of `aig`.
void write_aiger(const std::filesystem::path& path, const Aig& aig, std::span<const Literal> outputs);

}  // namespace meltstage::hls
