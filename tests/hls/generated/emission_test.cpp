// SPDX-License-Identifier: Apache-2.0
// How a circuit is written: flops in the blocks of their names, words as arrays, resets where they are.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "hls/graph/aig.hpp"
#include "hls/graph/reset_domain.hpp"
#include "hls/graph/sharing.hpp"
#include "hls/graph/verilog.hpp"
#include "hls/proof/prover.hpp"

namespace meltstage::hls {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Pins rst_ni, test_i and x_i; flops are added by their names.
class Emission : public ::testing::Test {
 protected:
  Emission() {
    for (const char* name : {"rst_ni", "test_i"}) pin(name, 1);
    pin("x_i", 4);
  }

  void pin(const std::string& name, unsigned width) {
    circuit_.inputs.push_back({field(name, width), circuit_.graph.input(name, width)});
  }
  Node in(std::size_t number) const { return circuit_.inputs[number].node; }
  // Its next state is its own value until it gets another one.
  Flop& flop(const std::string& name, unsigned width, std::uint64_t reset = 0) {
    const Node now = circuit_.graph.input(name, width);
    circuit_.flops.push_back({field(name, width), now, now, APInt(width, reset)});
    return circuit_.flops.back();
  }
  static Field field(const std::string& name, unsigned width) {
    return {.name = name,
            .offset = 0,
            .bytes = 1,
            .width = width,
            .is_signed = false,
            .kept = APInt::getAllOnes(width)};
  }
  std::string text() const {
    std::ostringstream out;
    write_verilog(circuit_, "block", out);
    return out.str();
  }

  // A reset that begins with the pin and ends a clock later, as behind a synchroniser.
  void add_late_reset() {
    Graph& graph = circuit_.graph;
    Flop& ended = flop("u_reset.ended_q", 1);
    ended.next = in(0);
    const Node out_of_reset = graph.both(in(0), graph.either(ended.now, in(1)));
    circuit_.in_reset = graph.invert(out_of_reset);
  }

  Circuit circuit_;
};

TEST_F(Emission, BlocksHoldTheirFlopsAndTheBlocksInThem) {
  flop("a_q", 1);
  flop("u_one.b_q", 4);
  flop("u_one.u_two.c_q", 8);
  flop("u_one.d_q", 2);
  EXPECT_THAT(text(), HasSubstr(R"(
  logic a_q;
  if (1) begin : u_one
    logic [3:0] b_q;
    logic [1:0] d_q;
    if (1) begin : u_two
      logic [7:0] c_q;
    end
  end
)"));
  EXPECT_THAT(text(), HasSubstr("      u_one.u_two.c_q <= u_one.u_two.c_q;\n"));
}

// A flop that takes a product on one of several ways has one multiplier; what it computes stays the same.
TEST_F(Emission, ProductsOnWaysThatExcludeEachOtherAreOne) {
  pin("way_i", 2);
  for (const char* name : {"a_i", "b_i", "c_i"}) pin(name, 8);
  Graph& graph = circuit_.graph;
  const auto wide = [&](std::size_t number) { return graph.sign_extend(in(number), 16); };
  const auto way = [&](unsigned number) {
    return graph.binary(Op::kEqual, in(3), graph.constant(2, number));
  };
  const Node ab = graph.binary(Op::kMul, wide(4), wide(5));
  const Node cc = graph.binary(Op::kMul, wide(6), wide(6));
  const Node by_constant = graph.binary(Op::kMul, wide(6), graph.constant(16, 100));
  Flop& product = flop("product_q", 16);
  product.next = graph.select(
      way(0), ab, graph.select(way(1), graph.constant(16, 7), graph.select(way(2), cc, by_constant)));
  const Node before = product.next;
  share_products(circuit_);
  const std::string shared = text();
  EXPECT_EQ(std::count(shared.begin(), shared.end(), '*'), 1);

  Problem problem;
  Bits inputs;
  for (const Pin& pin : circuit_.inputs)
    for (unsigned i = 0; i < pin.field.width; ++i)
      inputs[pin.field.width == 1 ? pin.field.name : pin.field.name + "[" + std::to_string(i) + "]"] =
          problem.aig.input();
  problem.reachable = kTrue;
  Blaster gates(graph, problem.aig, inputs, {});
  std::vector<std::size_t> all;
  for (unsigned i = 0; i < 16; ++i) {
    problem.obligations.push_back(
        {Kind::kFlop, "product", "top",
         problem.aig.differ(gates.bits(before)[i], gates.bits(circuit_.flops[0].next)[i]), kFalse, kFalse});
    all.push_back(i);
  }
  for (const Answer& answer : try_random_values(problem, all, 1)) EXPECT_NE(answer.verdict, Verdict::kBroken);
}

TEST_F(Emission, AProductAloneStays) {
  pin("a_i", 8);
  Graph& graph = circuit_.graph;
  Flop& product = flop("product_q", 8);
  product.next = graph.select(in(1), graph.binary(Op::kMul, in(3), in(3)), product.now);
  const Node before = product.next;
  share_products(circuit_);
  EXPECT_EQ(circuit_.flops[0].next, before);
}

TEST_F(Emission, WordsOfAnArrayAreOne) {
  for (const unsigned word : {1, 2, 3}) flop("u_mem.row_q[" + std::to_string(word) + "]", 4, word);
  EXPECT_THAT(text(), HasSubstr("    (* mem2reg *) logic [3:0] row_q [1:3];\n  end\n"));
  EXPECT_THAT(text(), HasSubstr("      u_mem.row_q[3] <= u_mem.row_q[3];\n"));
}

TEST_F(Emission, WordsThatAreNoArrayKeepTheirNames) {
  flop("row_q[1]", 4);
  flop("row_q[3]", 4);
  flop("wide_q[0]", 4);
  flop("wide_q[1]", 5);
  for (const char* line : {"  logic [3:0] \\row_q[1] ;\n", "  logic [3:0] \\row_q[3] ;\n",
                           "  logic [3:0] \\wide_q[0] ;\n", "  logic [4:0] \\wide_q[1] ;\n"})
    EXPECT_THAT(text(), HasSubstr(line));
}

TEST_F(Emission, WhatNeverChangesIsNoFlop) {
  flop("u_mem.row_q[0]", 4).field.kept = APInt(4, 0);
  flop("u_mem.row_q[1]", 4);
  EXPECT_THAT(text(), HasSubstr("row_q [1:1];\n"));
  EXPECT_THAT(text(), Not(HasSubstr("row_q[0]")));
}

TEST_F(Emission, AFlopKnowsItsResetByItsResetPin) {
  Flop& a = flop("a_q", 4, 5);
  a.next = circuit_.graph.select(in(0), in(2), circuit_.graph.constant(4, 5));
  EXPECT_THAT(text(), HasSubstr("negedge rst_ni) begin\n    if (!rst_ni) begin\n      a_q <= 4'h5;\n"
                                "    end else begin\n      a_q <= x_i;\n"));
}

TEST_F(Emission, AResetOfItsOwnIsAWire) {
  add_late_reset();
  Graph& graph = circuit_.graph;
  Flop& a = flop("a_q", 4, 5);
  a.next = graph.select(*circuit_.in_reset, graph.constant(4, 5), in(2));
  EXPECT_THAT(text(), HasSubstr("negedge reset_n) begin\n    if (!reset_n) begin\n      a_q <= 4'h5;\n"
                                "    end else begin\n      a_q <= x_i;\n"));
  EXPECT_THAT(text(),
              HasSubstr("negedge rst_ni) begin\n    if (!rst_ni) begin\n      u_reset.ended_q <= 1'b0;\n"
                        "    end else begin\n      u_reset.ended_q <= 1'b1;\n"));
}

TEST_F(Emission, TheWireOfAResetHasANameOfItsOwn) {
  add_late_reset();
  flop("reset_n", 1).next = circuit_.graph.both(circuit_.graph.invert(*circuit_.in_reset), in(1));
  EXPECT_THAT(text(),
              HasSubstr("negedge reset_n_) begin\n    if (!reset_n_) begin\n      reset_n <= 1'b0;\n"));
}

TEST_F(Emission, AFlopThatDoesMoreInResetKeepsIt) {
  add_late_reset();
  Graph& graph = circuit_.graph;
  const Node active = *circuit_.in_reset;
  const Node ended = circuit_.flops[0].now;
  flop("held_q", 4, 5).next = graph.select(active, graph.constant(4, 5), in(2));
  flop("other_value_q", 4, 5).next = graph.select(active, graph.constant(4, 6), in(2));
  flop("counts_q", 4, 5).next = graph.select(active, in(2), graph.constant(4, 5));
  // out of reset it reads what reset is made of
  flop("tests_q", 1, 0).next = graph.both(graph.invert(active), graph.both(in(1), ended));
  const auto next = next_out_of_reset(circuit_, active);
  EXPECT_FALSE(next[0]) << "the synchroniser's own";
  EXPECT_EQ(next[1], in(2));
  EXPECT_FALSE(next[2]);
  EXPECT_FALSE(next[3]);
  EXPECT_FALSE(next[4]) << "no choice of pins and flops alone ends reset and leaves it what it is";
}

TEST_F(Emission, AResetOfWideValuesIsRefused) {
  flop("a_q", 4);
  circuit_.in_reset = circuit_.graph.binary(Op::kEqual, in(2), circuit_.graph.constant(4, 3));
  EXPECT_THROW(text(), std::exception);
}

}  // namespace
}  // namespace meltstage::hls
