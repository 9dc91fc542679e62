// SPDX-License-Identifier: Apache-2.0
// Lines that stand still while words of the design are words of a code.
#include "asic/dft/core/parities.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "asic/dft/core/circuit.hpp"

namespace meltstage::dft {
namespace {

// Three data bits with a check bit each for the sums of two, as MEM's words are read: syndrome, its
// corrections, the data behind them, and a line beside them.
struct Word {
  Circuit circuit;
  std::vector<Node> syndrome, flip, data, checks;
  Node beside = kNoNode;

  std::vector<Parity> parities() const {
    return {{data[0], data[1], checks[0]}, {data[1], data[2], checks[1]}, {data[0], data[2], checks[2]}};
  }
  std::vector<std::int8_t> levels(const std::vector<Parity>& sums,
                                  const std::vector<std::uint8_t>& held = {}) const {
    std::vector<Node> all;
    for (Node node = 0; node < circuit.size(); ++node) all.push_back(node);
    return levels_under(circuit, sums, std::vector<std::int8_t>(circuit.inputs().size(), 0), held, all);
  }
};

Word word() {
  CircuitBuilder builder;
  std::vector<Node> data, checks, syndrome, flip;
  for (int i = 0; i < 3; ++i) data.push_back(builder.add(Gate::input, {}));
  for (int i = 0; i < 3; ++i) checks.push_back(builder.add(Gate::input, {}));
  const Node enable = builder.add(Gate::input, {});
  for (const auto& [a, b, c] : {std::array{0, 1, 0}, std::array{1, 2, 1}, std::array{0, 2, 2}})
    syndrome.push_back(builder.add(Gate::parity, {data[a], data[b], checks[c]}));
  flip.push_back(builder.add(Gate::all, {syndrome[0], syndrome[2]}));
  flip.push_back(builder.add(Gate::none,
                             {builder.add(Gate::inv, {syndrome[0]}), builder.add(Gate::inv, {syndrome[1]})}));
  flip.push_back(builder.add(Gate::mux, {syndrome[1], syndrome[2], enable}));
  const Node beside = builder.add(Gate::any, {flip[0], enable});
  for (int i = 0; i < 3; ++i) builder.add(Gate::output, {builder.add(Gate::parity, {data[i], flip[i]})});
  builder.add(Gate::output, {beside});
  std::vector<Node> renumbered;
  Word word;
  word.circuit = builder.finish("word", &renumbered);
  const auto of = [&](const std::vector<Node>& nodes) {
    std::vector<Node> result;
    for (const Node node : nodes) result.push_back(renumbered[node]);
    return result;
  };
  word.syndrome = of(syndrome);
  word.flip = of(flip);
  word.data = of(data);
  word.checks = of(checks);
  word.beside = renumbered[beside];
  return word;
}

TEST(Parities, WhatCorrectsAWordStandsStill) {
  const Word w = word();
  const std::vector<std::int8_t> levels = w.levels(w.parities());
  for (const Node node : w.syndrome) EXPECT_EQ(levels[node], 0);
  for (const Node node : w.flip) EXPECT_EQ(levels[node], 0);
  for (const Node node : w.data) EXPECT_EQ(levels[node], -1);
  for (const Node node : w.checks) EXPECT_EQ(levels[node], -1);
  EXPECT_EQ(levels[w.beside], -1);
}

TEST(Parities, WithoutOneOfTheSumsItsLinesMay) {
  const Word w = word();
  const std::vector<Parity> all = w.parities();
  for (std::size_t left_out = 0; left_out < all.size(); ++left_out) {
    std::vector<Parity> others;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (i != left_out) others.push_back(all[i]);
    const std::vector<std::int8_t> levels = w.levels(others);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(levels[w.syndrome[i]], i == left_out ? -1 : 0);
  }
  for (const Node node : w.syndrome) EXPECT_EQ(w.levels({})[node], -1);
}

TEST(Parities, HeldInputsCount) {
  const Word w = word();
  std::vector<std::uint8_t> held(w.circuit.inputs().size(), 0);
  held.back() = 1;
  EXPECT_EQ(w.levels(w.parities(), held)[w.beside], 0);
}

// The wanted node alone is looked at.
TEST(Parities, OtherNodesAreLeftOpen) {
  const Word w = word();
  const auto levels = levels_under(w.circuit, w.parities(), std::vector<std::int8_t>(7, 0), {}, {w.flip[0]});
  EXPECT_EQ(levels[w.flip[0]], 0);
  EXPECT_EQ(levels[w.flip[1]], -1);
}

}  // namespace
}  // namespace meltstage::dft
