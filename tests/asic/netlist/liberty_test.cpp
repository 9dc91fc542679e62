// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/liberty.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Liberty, PrecedenceIsNotXorAndOr) {
  EXPECT_EQ(parse_expression("a + b c ^ !d"), parse_expression("a | (b & (c ^ (d')))"));
  EXPECT_NE(parse_expression("(a + b) c"), parse_expression("a + b c"));
  EXPECT_EQ(parse_expression("!a'"), parse_expression("!(a')"));
}

TEST(Liberty, WrongExpressionsNameTheColumn) {
  EXPECT_THAT([] { parse_expression("a & )"); },
              ThrowsMessage<UserError>(HasSubstr("column 5: found \")\", expected a pin")));
  EXPECT_THAT([] { parse_expression("(a | b"); },
              ThrowsMessage<UserError>(HasSubstr("found \"the end\", expected \")\"")));
}

TEST(Liberty, ScanCellOfTheBuiltInLibrary) {
  const Cell& cell = mini_library().at("SDFFR");
  ASSERT_TRUE(cell.scan && cell.flop && cell.flop->clear);
  EXPECT_EQ(cell.scan->in, "SI");
  EXPECT_EQ(cell.scan->enable, "SE");
  EXPECT_EQ(cell.scan->next_state, parse_expression("D"));
  EXPECT_EQ(*cell.flop->clear, parse_expression("!RN"));
}

// Without test_cell the pins say it.
TEST(Liberty, ScanPinsByTheirNextStateType) {
  const CellLibrary cells = parse_liberty(
      "library (x) { cell (S) { ff (IQ,IQN) { clocked_on : \"CK\"; next_state : \"(SE*SI)+(!SE*D)\"; }"
      " pin (D) { direction : input; } pin (CK) { direction : input; }"
      " pin (SI) { direction : input; nextstate_type : scan_in; }"
      " pin (SE) { direction : input; nextstate_type : scan_enable; }"
      " pin (Q) { direction : output; function : \"IQ\"; } } }",
      "x.lib");
  const Cell& cell = cells.at("S");
  ASSERT_TRUE(cell.scan);
  EXPECT_EQ(cell.scan->in, "SI");
  EXPECT_EQ(cell.scan->enable, "SE");
  EXPECT_EQ(cell.scan->next_state, parse_expression("D"));
}

TEST(Liberty, ClockGatesAreNoLatches) {
  const Cell& plain = mini_library().at("CKG");
  ASSERT_TRUE(plain.gate);
  EXPECT_FALSE(plain.has_latch);
  EXPECT_EQ(plain.gate->test, "");
  const Cell& testable = mini_library().at("CKGT");
  ASSERT_TRUE(testable.gate);
  EXPECT_EQ(testable.gate->clock + testable.gate->enable + testable.gate->test + testable.gate->out,
            "CKETEGCK");
  const auto gate = [](const char* function) {
    return parse_liberty(
               std::string(
                   "library (x) { cell (G) { clock_gating_integrated_cell : \"latch_posedge\";\n pin (CK) { "
                   "direction : "
                   "input; clock_gate_clock_pin : true; }\n pin (E) { direction : input; "
                   "clock_gate_enable_pin : true; "
                   "}\n pin (GCK) { direction : output; clock_gate_out_pin : true; state_function : \"") +
                   function + "\"; } } }",
               "x.lib")
        .at("G")
        .gate;
  };
  EXPECT_TRUE(gate("CK * IE"));
  EXPECT_FALSE(gate("CK & !IE"));  // it opens where others close
}

TEST(Liberty, CommentsContinuationsAndUnknownGroupsArePassedOver) {
  const CellLibrary cells = parse_liberty(
      "library (x) { /* a\n b */ voltage_map (VDD, 1.8);\n lu_table_template (t) { index_1 (\"1, \\\n 2\"); "
      "}\n"
      " cell (\"G\") { pin(A){direction:input;capacitance:0.1;} pin(Y) { direction : output ; function : "
      "\"(A)'\"; timing () { related_pin : \"A\"; } } } }",
      "x.lib");
  EXPECT_EQ(*cells.at("G").find("Y")->function, parse_expression("!A"));
}

TEST(Liberty, DefectsNameFileAndLine) {
  EXPECT_THAT([] { parse_liberty("library (x) {\n cell (A) {\n", "x.lib"); },
              ThrowsMessage<UserError>(HasSubstr("x.lib:2:2: found group cell left open")));
  EXPECT_THAT([] { parse_liberty("library (x) { }", "x.lib"); },
              ThrowsMessage<UserError>(HasSubstr("x.lib: found no cell")));
  EXPECT_THAT(
      [] {
        parse_liberty("library (x) {\n cell (A) { pin (Y) { direction : output; function : \"A &\"; } } }",
                      "x.lib");
      },
      ThrowsMessage<UserError>(HasSubstr("cell A: function")));
}

TEST(Liberty, AByteOrderMarkSaysNothing) {
  EXPECT_EQ(parse_liberty("\xEF\xBB\xBFlibrary (x) { cell (A) { } }", "x.lib").size(), 1u);
}

// The same again is no defect.
TEST(Liberty, WhatIsSaidTwiceMustMeanTheSame) {
  const std::string pins = "pin (A) { direction : input; } pin (Y) { direction : output; function : \"A\"; }",
                    ff = "ff (IQ, IQN) { next_state : \"A\"; clocked_on : \"A\"; }";
  const auto read = [](const std::string& cells) {
    parse_liberty("library (x) {\n" + cells + " }", "x.lib");
  };
  const std::string cell = "cell (G) { area : 1.0; " + pins + ff + " }";
  EXPECT_NO_THROW(read(cell + "\n" + cell));
  EXPECT_NO_THROW(read("cell (G) { area : 1.0; area : 1.0; " + pins + pins + ff + ff + " }"));
  EXPECT_NO_THROW(read("cell (G) { " + pins + " pin (A) { direction : input; capacitance : 5; } }"));
  const auto refused = [&](const std::string& cells, const std::string& said) {
    EXPECT_THAT([&] { read(cells); }, ThrowsMessage<UserError>(HasSubstr(said))) << cells;
  };
  refused(cell + "\ncell (G) { area : 1.5; " + pins + ff + " }",
          "x.lib:3:1: found cell G again, other than x.lib:2:1, expected each cell once");
  refused(cell + "\ncell (G) { area : 1.0; " + pins + " }", "x.lib:3:1: found cell G again");
  refused("cell (G) { " + pins + "\n pin (Y) { direction : output; function : \"!A\"; } }",
          "x.lib:3:2: found pin Y of cell G again, with another function than in line 2");
  refused("cell (G) { " + pins + "\n pin (A) { direction : output; } }",
          "x.lib:3:2: found pin A of cell G again, with another direction than in line 2");
  refused("cell (G) { pin (Y) { direction : output; function : \"A\";\n function : \"B\"; } }",
          "x.lib:3:2: found function again, other than in line 2, expected it once");
  refused("cell (G) { area : 1;\n area : 2; }", "x.lib:3:2: found area again, other than in line 2");
  refused("cell (G) { " + ff + "\n ff (IQ, IQN) { next_state : \"!A\"; clocked_on : \"A\"; } }",
          "x.lib:3:2: found ff of cell G again");
  refused("cell (G) { ff (IQ, IQN) { clocked_on : \"A\"; next_state : \"A\";\n next_state : \"!A\"; } }",
          "x.lib:3:2: found next_state again");
  refused("cell (G) {\n pin (A) { direction : inputt; } }",
          "x.lib:3:12: found direction \"inputt\", expected input,");
}

TEST(Liberty, NestingHasALimit) {
  std::string groups = "library (x) {\n", close = "}";
  for (int i = 0; i < 30000; ++i) groups += "a () {", close += "}";
  EXPECT_THAT(
      [&] { parse_liberty(groups + close, "deep.lib"); },
      ThrowsMessage<UserError>(HasSubstr("deep.lib:2:187: found groups 33 deep, expected at most 32")));
  const std::string limit = "expected at most 100 parentheses and inversions in each other";
  for (const char* deeper : {"(", "!"})
    EXPECT_THAT(
        [&] { parse_expression(std::string(101, deeper[0]) + "a"); },
        ThrowsMessage<UserError>(HasSubstr("column 101: found \"" + std::string(deeper) + "\", " + limit)));
  EXPECT_THAT([&] { parse_expression("a" + std::string(30000, '\'')); },
              ThrowsMessage<UserError>(HasSubstr(limit)));
  EXPECT_EQ(parse_expression("(((a)))"), parse_expression("a"));
}

TEST(Liberty, NumbersAreFinite) {
  for (const char* number : {"inf", "nan", "1e999", "-1e31", "0x1p3", "two", "1.0pf"})
    EXPECT_THAT(
        [&] {
          parse_liberty(std::string("library (x) { cell (A) {\n  area : ") + number + "; } }", "x.lib");
        },
        ThrowsMessage<UserError>(HasSubstr("x.lib:2:3: found area \"" + std::string(number) + "\"")));
}

}  // namespace
}  // namespace meltstage::dft
