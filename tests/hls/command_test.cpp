// SPDX-License-Identifier: Apache-2.0
// `meltstage hls`: a block of somebody else goes through it, is proved or refuted, and what can't be a
// circuit is refused by file and line.
#include "tests/hls/hls_command.hpp"

namespace meltstage {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

TEST_F(Hls, AForeignBlockIsTranslatedAndProvedEqualToItsRtl) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  fs::copy(kExample + ".sv", at("block.sv"));
  const Ran by_hand = prove();
  EXPECT_EQ(by_hand.status, 0) << by_hand.output;
  EXPECT_THAT(by_hand.output, HasSubstr("\nproved: 9 of 9 bits equal"));
  // what it is translated to is the same circuit again
  ASSERT_EQ(translate().status, 0);
  EXPECT_THAT(text_of(at("block.sv")), HasSubstr("logic [3:0] steady_q;"));
  const Ran generated = prove();
  EXPECT_EQ(generated.status, 0) << generated.output;
  EXPECT_EQ(run_shell("verilator --lint-only -Wall -Wno-DECLFILENAME -Wno-UNUSED " + at("block.sv")).output,
            "");
}

// Read back by others: ABC takes AIGER, Yosys' own simulator of BTOR2 is none, so its lines are looked at.
TEST_F(Hls, ModelCheckersGetTheCircuitInTheirFormats) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  const auto write_as = [&](const std::string& name) {
    return run_command("hls translate " + at("block.cpp") +
                       " --option=-I" MELTSTAGE_SOURCE_DIR " --module debounce --out " + at(name));
  };
  ASSERT_EQ(write_as("block.aig").status, 0);
  EXPECT_THAT(text_of(at("block.aig")), HasSubstr("i6 hold_i[3]\no0 pressed_o\n"));
  EXPECT_THAT(run_shell("berkeley-abc -q 'read " + at("block.aig") + "; print_stats'").output,
              HasSubstr("lat =    6"));
  ASSERT_EQ(write_as("block.btor").status, 0);
  EXPECT_THAT(text_of(at("block.btor")), HasSubstr("steady_q"));
  EXPECT_THAT(text_of(at("block.btor")), HasSubstr(" next "));
  // A flop that no pin shows is there, too, under its name.
  write_block("  s->c_q = in->x_i;");
  ASSERT_EQ(write_as("block.aig").status, 0);
  EXPECT_THAT(text_of(at("block.aig")), HasSubstr("c_q[9]\n"));
  ASSERT_EQ(write_as("block.btor").status, 0);
  EXPECT_THAT(text_of(at("block.btor")), HasSubstr("output"));
  EXPECT_THAT(text_of(at("block.btor")), HasSubstr(" c_q "));
  const Ran other = write_as("block.vhd");
  EXPECT_EQ(other.status, 2);
  EXPECT_THAT(other.output, HasSubstr("expected a file *.sv or *.v, *.aig (AIGER) or *.btor (BTOR2)"));
}

TEST_F(Hls, AChangeOfEitherSideIsRefutedByAStateAndPins) {
  const std::string cpp = text_of(kExample + ".cpp"), sv = text_of(kExample + ".sv");
  const std::pair<std::string, std::string> in_rtl[] = {{"steady > hold_i", "steady >= hold_i"},
                                                        {"4'd15 ? 4'd15", "4'd14 ? 4'd15"},
                                                        {"pressed_q <= 1'b0", "pressed_q <= 1'b1"},
                                                        {"pressed_o = pressed_q", "pressed_o = ~pressed_q"},
                                                        {"level_q  <= button_i", "level_q <= level_q"}};
  write("block.cpp", cpp);
  for (const auto& [right, wrong] : in_rtl) {
    write("block.sv", replaced(sv, right, wrong));
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 1) << wrong << "\n" << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("counterexample: "));
    EXPECT_THAT(ran.output, AnyOf(HasSubstr("after the clock: RTL 0x"), HasSubstr("in this state: RTL 0x")));
    EXPECT_THAT(ran.output, HasSubstr("\nrefuted: "));
  }
  write("block.sv", sv);
  for (const auto& [right, wrong] :
       {std::pair("steady_q < 15", "steady_q < 14"), std::pair("> in->hold_i", ">= in->hold_i")}) {
    write("block.cpp", replaced(cpp, right, wrong));
    EXPECT_EQ(prove().status, 1) << wrong;
  }
}

TEST_F(Hls, MutantsOfTheRtlAreRefuted) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  fs::copy(kExample + ".sv", at("block.sv"));
  const Ran ran = prove("--mutants 40 --seed 5");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, MatchesRegex("(.|\n)*\nmutants [(]one gate of the RTL inverted, seed 5[)]: "
                                       "[0-9]+ refuted, [0-9] change nothing, 0 not decided; (.|\n)*"));
}

TEST_F(Hls, WhatOneSideHasAloneIsNamed) {
  const std::string cpp = text_of(kExample + ".cpp"), sv = text_of(kExample + ".sv");
  write("block.cpp", cpp);
  write("block.sv",
        replaced(replaced(sv, "logic       level_q, ", "logic       level_q, spare_q, "),
                 "level_q  <= button_i;", "level_q  <= button_i; spare_q <= hold_i[0] && spare_q; "));
  const Ran unread = prove();
  EXPECT_EQ(unread.status, 0) << unread.output;
  EXPECT_THAT(unread.output, HasSubstr("\nRTL: spare_q not compared, since nothing depends on it"));
  write("block.sv",
        replaced(replaced(sv, "logic       level_q, ", "logic       level_q, spare_q, "),
                 "level_q  <= button_i;", "level_q  <= button_i ^ spare_q; spare_q <= hold_i[0]; "));
  EXPECT_THAT(prove().output, HasSubstr("block.sv:16: found flop spare_q, which the C++ has not"));
  write("block.sv", replaced(sv, "steady_q, steady", "other_q, steady") + "");
  EXPECT_EQ(prove().status, 2);
  write("block.sv", replaced(sv, "pressed_o\n", "other_o\n"));
  EXPECT_EQ(prove().status, 2);
  write("block.sv", replaced(sv, "posedge clk_i", "negedge clk_i"));
  EXPECT_EQ(prove().status, 2);
  write("block.sv", "module debounce; this is no Verilog");
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("RTL: Yosys refuses it: "));
}

TEST_F(Hls, AVariableThatSomePathLeavesIsNamedByItsFlop) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  const std::string sv = text_of(kExample + ".sv");
  write("block.sv",
        replaced(replaced(sv, "  always_ff",
                          "  function logic f(input logic a, b); if (b) f = a; endfunction\n  always_ff"),
                 "level_q  <= button_i;", "level_q  <= f(button_i, hold_i[0]);"));
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(
      ran.output,
      MatchesRegex(".*block.sv:[0-9]+: found a variable or a function's result behind flop level_q that "
                   "keeps its last value where no path assigns it, expected each path to assign it\n"));
}

TEST_F(Hls, AFlopOfAGeneratedInstanceIsNamedWithItsPlace) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  const std::string sv = text_of(kExample + ".sv");
  write("block.sv", replaced(replaced(sv, "  always_ff",
                                      "  logic [1:0] spare;\n  for (genvar i = 0; i < 1; i++) begin : gl\n   "
                                      " lane u(.clk_i, .x_i({button_i, "
                                      "hold_i[0]}), .q_o(spare));\n  end\n  always_ff"),
                             "level_q  <= button_i;", "level_q  <= button_i ^ spare[0] ^ spare[1];") +
                        "module lane(input logic clk_i, input logic [1:0] x_i, output logic [1:0] q_o);\n  "
                        "logic [1:0] q_q;\n  assign q_o = "
                        "q_q;\n  always_ff @(posedge clk_i) q_q <= x_i;\nendmodule\n");
  EXPECT_THAT(prove().output,
              MatchesRegex(".*block.sv:[0-9]+: found flop gl.0..u.q_q, which the C.. has not\n"));
}

TEST_F(Hls, WhatYosysRefusesHasNoLine0) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  const std::string sv = text_of(kExample + ".sv");
  for (const auto& [added, told] :
       {std::pair("  logic n; always_comb if (button_i) n = hold_i[0];\n  always_ff",
                  "block.sv: ERROR: Latch inferred for signal"),
        std::pair(
            "  logic [3:0] n; always_comb begin n = 0; while (n < hold_i[3:0]) n = n + 1; end\n  always_ff",
            "While loops are only allowed")}) {
    write("block.sv", replaced(sv, "  always_ff", added));
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 2) << added;
    EXPECT_THAT(ran.output, AllOf(HasSubstr(told), Not(HasSubstr(":0")))) << added;
  }
}

TEST_F(Hls, WhatHasNoExampleIsNamed) {
  const std::string cpp = text_of(kExample + ".cpp"), sv = text_of(kExample + ".sv");
  write("block.cpp", cpp);
  write("block.sv", replaced(replaced(sv, "level_q  <= button_i", "level_q  <= !button_i"),
                             "steady_q <= steady;", "steady_q <= ~steady;"));
  const Ran ran = prove("--examples 1");
  EXPECT_EQ(ran.status, 1);
  EXPECT_THAT(ran.output, AnyOf(HasSubstr("differ, too (--examples shows more): level_q"),
                                HasSubstr("differ, too (--examples shows more): steady_q")));
}

// Verilog-2001 declares it in the module.
TEST_F(Hls, TheVariableOfALoopIsNoFlop) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  const std::string sv = text_of(kExample + ".sv");
  write("block.sv",
        replaced(replaced(sv, "logic       level_q, ", "integer i; logic level_q, "), "steady_q <= steady;",
                 "for (i = 0; i < 4; i = i + 1) steady_q[i] <= steady[i];"));
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("\nproved: 9 of 9 bits equal"));
}

// Changes of examples/hls/debounce.sv, each with what its refusal says.
struct BadRtl {
  std::string right, wrong, message;
};

TEST_F(Hls, RtlThatHasNoOneMeaningIsRefusedByFileLineAndNet) {
  const std::string sv = text_of(kExample + ".sv");
  write("block.cpp", text_of(kExample + ".cpp"));
  const BadRtl cases[] = {
      {"level_q  <= button_i;", "level_q  <= button_i & open;",
       "block.sv:12: found no driver of open, expected one; flop level_q depends on it"},
      {"pressed_o = pressed_q", "pressed_o = pressed_q | wide[1]",
       "block.sv:12: found no driver of wide[1], expected one; pin pressed_o depends on it"},
      {"pressed_o = pressed_q", "pressed_o = button_i ? pressed_q : 1'bz",
       "block.sv:28: found a z, expected 0 or 1; pin pressed_o depends on it"},
      {"pressed_o = pressed_q", "one = two | level_q, two = one & button_i, pressed_o = pressed_q ^ one",
       "block.sv:28: found a loop without a flop through two, one, expected none; pin pressed_o depends on "
       "it"},
      {"pressed_o = pressed_q", "one = level_q & button_i, one = ~level_q, pressed_o = pressed_q ^ one",
       "found two drivers of one, "},
      {"pressed_o = pressed_q", "one = level_q, one = button_i, pressed_o = pressed_q",
       "found two drivers of "},
      {"pressed_o = pressed_q", "one = 1'b0, one = level_q & button_i, pressed_o = pressed_q",
       "block.sv:28: found a result on a net that is a constant, too, expected one driver"},
      {"pressed_o = pressed_q", "pressed_o = pressed_q & clk_i",
       "block.sv:28: found clk_i as data, expected it as a clock alone; pin pressed_o depends on it"},
      {"posedge clk_i", "negedge clk_i",
       "block.sv:16: found flop level_q at a falling edge, expected the rising edge of clk_i"},
      {"posedge clk_i", "posedge hold_i[0]",
       "block.sv:16: found flop level_q clocked by hold_i[0], expected clk_i itself"},
      {"posedge clk_i", "posedge gated",
       "block.sv:16: found flop level_q clocked by gated, expected clk_i itself"},
      {"pressed_o = pressed_q", "pressed_o = held; always_latch if (button_i) held = pressed_q",
       "block.sv:12: found a latch, held, expected flops of clk_i only"},
      {"level_q   <= 1'b0", "level_q   <= hold_i[3]",
       "block.sv:16: found flop level_q with a set and a reset or"},
      {"level_q   <= 1'b0", "level_q   <= 1'bx",
       "block.sv:16: found flop level_q reset to x, expected 0 or 1"},
      {"output logic       pressed_o", "inout  wire        pressed_o", "block.sv:8: found inout pressed_o"},
  };
  for (const BadRtl& one : cases) {
    std::string changed = replaced(sv, "steady_q, steady;",
                                   "steady_q, steady; logic open, one, two, gated, held; logic [1:0] wide; "
                                   "assign wide[0] = button_i, gated = clk_i & hold_i[0];");
    changed = replaced(changed, one.right, one.wrong);
    write("block.sv", changed);
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 2) << one.wrong << "\n" << ran.output;
    EXPECT_THAT(ran.output, HasSubstr(one.message)) << one.wrong;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
  }
}

TEST_F(Hls, AnXOfTheRtlIsAnyValue) {
  const std::string sv = text_of(kExample + ".sv");
  write("block.cpp", text_of(kExample + ".cpp"));
  // where it is chosen by nothing that can be, and where it can be
  write("block.sv", replaced(sv, "pressed_o = pressed_q", "pressed_o = hold_i > 4'd15 ? 1'bx : pressed_q"));
  EXPECT_EQ(prove().status, 0) << prove().output;
  for (const char* wrong :
       {"pressed_o = hold_i > 4'd14 ? 1'bx : pressed_q", "pressed_o = pressed_q | hold_i[{hold_i[2:0]}]",
        "pressed_o = pressed_q & 1'bx"}) {
    write("block.sv", replaced(sv, "pressed_o = pressed_q", wrong));
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 1) << wrong << "\n" << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("counterexample: pressed_o"));
  }
  write("block.sv",
        replaced(sv, "if (steady > hold_i) pressed_q <= button_i;",
                 "case (steady > hold_i) 1'b1: pressed_q <= button_i; default: pressed_q <= 'x; endcase"));
  EXPECT_EQ(prove().status, 1);
}

// The write was lost: the circuit was another one than the C++.
TEST_F(Hls, AFunctionThatWritesWhatItIsToReadIsRefused) {
  write_block("  s->a_q = in->x_i;");
  const std::string all = text_of(at("block.cpp"));
  write("block.cpp",
        replaced(all, "out->y_o = s->a_q;", "out->y_o = s->a_q; const_cast<State*>(s)->b_q[0] = 77;"));
  expect_refusal(
      "block.cpp:13: hls_outputs(): found a write to byte 1 of its argument 1, expected a function that only "
      "reads it");
  write("block.cpp",
        replaced(all, "  s->a_q = in->x_i;", "  s->a_q = in->x_i;\n  const_cast<Inputs*>(in)->x_i = 0;"));
  expect_refusal("hls_step(): found a write to byte 1 of its argument 2");
  write("block.cpp", all + R"(
struct Held { std::uint8_t small; };
extern "C" {
extern const meltstage::hls::Field hls_invariant_names[] = {HLS_FIELD(Held, small, 1)};
void hls_invariants(const State* s, Held* held) {
  held->small = 1;
  const_cast<State*>(s)->b_q[0] = 3;
}
})");
  expect_refusal("hls_invariants(): found a write to byte 1 of its argument 1");
}

// The sanitizer compared the argument with null: an address that depends on nothing was refused as one that
// does.
TEST_F(Hls, MemoryFunctionsTakeTheStateItself) {
  write_block(
      "  std::uint16_t both = 0;\n  __builtin_memcpy(&both, s, 2);\n  if (in->x_i == 3) __builtin_memset(s, "
      "0, sizeof *s);\n  s->a_q = static_cast<std::uint8_t>(both >> 8);");
  ASSERT_EQ(translate().status, 0) << translate().output;
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 0) << ran.output;
}

TEST_F(Hls, TheAbsoluteValueOfTheLeastNumberIsABrokenPromise) {
  write_block(
      "  const int i = in->x_i == 200 ? -2147483647 - 1 : -int{in->x_i};\n  s->a_q = "
      "static_cast<std::uint8_t>(__builtin_abs(i));");
  ASSERT_EQ(translate().status, 0) << translate().output;
  const Ran ran = prove("--block promises");
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("x_i=0xc8"));
}

// Of a pin both values are those of this state; and a pin of the RTL alone matters at 0, too.
TEST_F(Hls, ACounterexampleOfAPinCanBeReplayed) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  std::string sv = text_of(kExample + ".sv");
  sv = replaced(sv, "input  logic       button_i,",
                "input  logic       button_i,\n  input  logic       kill_i,");
  write("block.sv", replaced(sv, "assign pressed_o = pressed_q;", "assign pressed_o = pressed_q & kill_i;"));
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("kill_i=0x0\n  in this state: RTL 0x0, C++ 0x1"));
}

TEST_F(Hls, PinsOfOtherWidthsAreNamedOnBothSides) {
  const std::string sv = text_of(kExample + ".sv");
  write("block.cpp", text_of(kExample + ".cpp"));
  const BadRtl cases[] = {
      {"input  logic [3:0] hold_i", "input  logic [4:0] hold_i",
       "block.sv:7: found pin hold_i of 5 bits, expected 4 as in hls_input_pins"},
      {"input  logic       button_i", "input  logic [1:0] button_i",
       "block.sv:6: found pin button_i of 2 bits, expected 1 as in hls_input_pins"},
      {"output logic       pressed_o", "output logic [1:0] pressed_o",
       "block.sv:8: found pin pressed_o of 2 bits, expected 1 as in hls_output_pins"},
  };
  for (const BadRtl& one : cases) {
    write("block.sv", replaced(sv, one.right, one.wrong));
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr(one.message));
  }
  write("block.sv", replaced(replaced(sv, "output logic       pressed_o", "input logic pressed_o"),
                             "assign pressed_o = pressed_q;", ""));
  EXPECT_THAT(prove().output,
              HasSubstr("block.sv:8: found input pressed_o, expected an output as in hls_output_pins"));
  write("block.sv", replaced(replaced(sv, "output logic       pressed_o", "output logic pressed_o, other_o"),
                             "pressed_o = pressed_q;", "pressed_o = pressed_q, other_o = level_q;"));
  EXPECT_THAT(prove().output, HasSubstr("\nRTL: other_o not compared, since the C++ has no such output\n"));
  write("block.sv", sv);
  EXPECT_THAT(prove("--tie hold_i=1").output,
              HasSubstr("--tie: found hold_i, a pin of 4 bits, expected one bit of it, as hold_i[0]=1"));
  EXPECT_THAT(prove("--tie hold=1").output,
              HasSubstr("--tie: found hold, expected an input pin of the RTL or a bit of one"));
  EXPECT_EQ(prove("--tie hold_i[0]=1").status, 0);
}

TEST_F(Hls, LoopsArraysSwitchesAndProductsBecomeCircuits) {
  write_block(R"(  int sum = 0;
  for (int i = 0; i < 4; ++i) sum += s->b_q[i] * (i + 1);
  s->b_q[in->x_i & 3] = static_cast<std::uint8_t>(s->a_q / 7);
  switch (in->x_i >> 6) {
    case 0: s->c_q = static_cast<std::int16_t>((sum & 0x3FF) - 512); break;
    case 1: s->c_q = static_cast<std::int16_t>(s->c_q >> 1); break;
    case 2: s->a_q = static_cast<std::uint8_t>(s->a_q * in->x_i); break;
    default: s->a_q = s->b_q[s->a_q & 3];
  })");
  ASSERT_EQ(translate().status, 0) << translate().output;
  write("list.f", "block.sv\n");
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 0) << ran.output;
}

TEST_F(Hls, AnIndexThatVariesReachesItsArrayAlone) {
  write_block("  s->b_q[s->a_q] = in->x_i;");
  ASSERT_EQ(translate().status, 0) << translate().output;
  for (const char* neighbour : {"a_q <= a_q;", "c_q <= c_q;"})
    EXPECT_THAT(text_of(at("block.sv")), HasSubstr(neighbour));
}

TEST_F(Hls, WhatCppLeavesUndefinedIsFound) {
  write_block("  s->a_q = static_cast<std::uint8_t>(1 << (in->x_i & 63));");
  ASSERT_EQ(translate().status, 0);
  const Ran shift = prove("--block promises");
  EXPECT_EQ(shift.status, 1) << shift.output;
  EXPECT_THAT(shift.output, HasSubstr("block.cpp:11: undefined behaviour of C++"));
  write_block("  s->c_q = static_cast<std::int16_t>(s->c_q + 1);");
  ASSERT_EQ(translate().status, 0);
  const Ran wide = prove();
  EXPECT_EQ(wide.status, 1) << wide.output;
  EXPECT_THAT(wide.output, HasSubstr("c_q has more bits than the circuit"));
}

TEST_F(Hls, ProductsOfMoreThan64BitsAreMadeOfGates) {
  write_block(R"(  using Wide = unsigned __int128;
  const auto spread = [](std::uint8_t high, std::uint8_t low) { return std::uint64_t{high} << 30 | low; };
  const Wide product = Wide{spread(s->a_q, s->b_q[0])} * spread(in->x_i, s->b_q[1]);
  s->b_q[0] = static_cast<std::uint8_t>(product >> 30);
  s->b_q[1] = static_cast<std::uint8_t>(product >> 62);
  s->a_q = static_cast<std::uint8_t>(s->a_q * in->x_i);)");
  ASSERT_EQ(translate().status, 0) << translate().output;
  const Ran ran = prove("--block pins");  // the products themselves are too hard
  EXPECT_EQ(ran.status, 0) << ran.output;
}

TEST_F(Hls, ALocalThatIsReadBeforeItIsWrittenIsABrokenPromise) {
  const std::pair<const char*, const char*> bodies[] = {
      {"  std::uint8_t v;\n  if (in->x_i & 1) v = 3;\n  s->a_q = v;",
       "block.cpp:11: v is read before it is written"},
      {"  std::uint8_t v;\n  s->a_q = v;", "block.cpp:11: v is read before it is written"},
      {"  int v[3] = {1, 2};\n  int w[3];\n  w[in->x_i & 1] = 0;\n  s->a_q = (w[1] + v[0]) & 1;",
       "block.cpp:12: w is read before it is written"},
      {"  struct Pair { std::uint8_t a, b; } p;\n  p.a = 1;\n  const Pair q = p;\n  s->a_q = q.b;",
       "block.cpp:11: p is read before it is written"},
      {"  std::uint8_t v = 1;\n  switch (in->x_i) {\n    std::uint8_t w;\n    case 1: w = 2; v = w; break;\n"
       "    case 2: v = w;\n  }\n  s->a_q = v;",
       "w is read before it is written"},
      {"  bool v;\n  if (in->x_i & 1) v = true;\n  if (v) s->a_q = 3;", "block.cpp:1"},
      {"  auto open = [] { std::uint8_t inner; return inner; };\n  s->a_q = static_cast<std::uint8_t>(open() "
       "^ open());",
       "block.cpp:11: inner is read before it is written"},
  };
  for (const auto& [body, message] : bodies) expect_broken_promise(body, message);
  for (const char* kept :
       {"  std::uint8_t v;\n  const bool set = in->x_i & 1;\n  if (set) v = 3;\n  if (set) s->a_q = v;",
        "  std::uint8_t v;\n  for (int i = 0; i < 4; ++i) v = s->b_q[i];\n  s->a_q = v;",
        "  struct Pair { std::uint8_t a, b; } p;\n  p.a = 1;\n  const Pair q = p;\n  s->a_q = q.a;"}) {
    write_block(kept);
    ASSERT_EQ(translate().status, 0) << kept << translate().output;
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 0) << kept << "\n" << ran.output;
  }
}

TEST_F(Hls, EveryByteThatIsReadStandsInATable) {
  write_block("  s->a_q = static_cast<std::uint8_t>(s->c_q);");
  const std::string all = text_of(at("block.cpp"));
  const auto refused = [&](const std::string& right, const std::string& wrong, const std::string& message) {
    write("block.cpp", replaced(all, right, wrong));
    expect_refusal(message);
  };
  refused("HLS_FIELD(State, c_q, 10),", "",
          "block.cpp:11: found State of 2 bytes at offset 6 read, which is in no row of hls_flops");
  refused("HLS_FIELD(Inputs, rst_ni, 1), ", "",
          "found Inputs of 1 byte at offset 0 read, which is in no row of hls_input_pins");
  refused("out->y_o = s->a_q;", "if (s->a_q > 3) out->y_o = s->a_q;",
          "hls_outputs(): found Outputs of 1 byte at offset 0 left without a value");
  refused("void hls_reset(State* s) { *s = {}; }", "void hls_reset(State* s) { s->a_q = 0; }",
          "hls_reset(): found no value for c_q");
  // what is written before it is read keeps nothing
  write("block.cpp", replaced(replaced(all, "HLS_FIELD(State, c_q, 10),", ""),
                              "  s->a_q =", "  s->c_q = in->x_i;\n  s->a_q ="));
  EXPECT_EQ(translate().status, 0) << translate().output;
}

TEST_F(Hls, TablesAndNamesThatMakeNoCircuitAreRefused) {
  write_block("  s->a_q = in->x_i;");
  const std::string all = text_of(at("block.cpp"));
  const auto refused = [&](const std::string& right, const std::string& wrong, const std::string& message) {
    write("block.cpp", replaced(all, right, wrong));
    expect_refusal(message);
  };
  refused("HLS_FIELD(Inputs, x_i, 8)", "HLS_FIELD(Inputs, x_i, 8), HLS_FIELD(Inputs, x_i, 8)",
          "hls_input_pins: found x_i twice, expected each name once");
  refused("HLS_FIELD(Outputs, y_o, 8)", "meltstage::hls::field<std::uint8_t>(\"x_i\", 0, 8)",
          "hls_output_pins: found x_i twice, expected each name once");
  refused("field<std::uint8_t>(\"b_q[1]\"", "field<std::uint8_t>(\"a_q[1]\"",
          "hls_flops: found a_q[1] twice, expected each name once");
  refused("field<std::uint8_t>(\"b_q[1]\"", "field<std::uint8_t>(\"a_q.b_q\"",
          "hls_flops: found a_q.b_q in a_q, which is a flop or pin, expected a block");
  refused("offsetof(State, b_q) + 1, 8", "offsetof(State, b_q) + 2, 8",
          "hls_flops: found b_q[2] in bytes of b_q[1], expected bytes of its own");
  refused("offsetof(State, b_q) + 1, 8", "sizeof(State), 8",
          "hls_flops: found b_q[1] in byte 8 of a struct of 8 bytes");
  for (const char* name : {"clk_i", "a b", "a\\n", "ä"})
    refused("HLS_FIELD(Inputs, x_i, 8)",
            "meltstage::hls::field<std::uint8_t>(\"" + std::string(name) + "\", 1, 8)",
            "hls_input_pins: found the name '");
  for (const char* name : {"b_q.", ".b_q", "b..q", "b$q"})
    refused("field<std::uint8_t>(\"b_q[1]\"", "field<std::uint8_t>(\"" + std::string(name) + "\"",
            "hls_flops: found the name '" + std::string(name) + "', expected letters");
  refused("field<std::uint8_t>(\"b_q[1]\"", "field<std::uint8_t>(\"clk_i.b_q\"",
          "hls_flops: found clk_i.b_q in clk_i, which is a flop or pin, expected a block");
  refused("HLS_FIELD(Inputs, rst_ni, 1)", "HLS_FIELD(Inputs, rst_ni, 2)",
          "hls_input_pins: found rst_ni of 2 bits, expected 1");
  refused("HLS_FIELD(Outputs, y_o, 8)", "meltstage::hls::field<std::uint8_t>(\"rst_ni\", 0, 8)",
          "hls_output_pins: found rst_ni twice");
  write("block.cpp", all);
  for (const char* module : {"9x", "a-b", "wire"}) {
    const Ran ran = translate("--module " + std::string(module));
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("--module: found '"));
  }
}

TEST_F(Hls, NamesThatVerilogHasItselfAreKept) {
  write_block("  s->a_q = static_cast<std::uint8_t>(in->x_i * s->b_q[0] + 3); s->b_q[1] = s->a_q ^ 1;");
  std::string text = text_of(at("block.cpp"));
  text = replaced(text, "HLS_FIELD(Inputs, x_i, 8)", "meltstage::hls::field<std::uint8_t>(\"wire\", 1, 8)");
  text = replaced(text, "HLS_FIELD(State, a_q, 8)", "meltstage::hls::field<std::uint8_t>(\"n31\", 0, 8)");
  for (unsigned i = 0; i < 4; ++i)
    text = replaced(text, "b_q[" + std::to_string(i) + "]\"",
                    (i == 3 ? "9" : "n") + std::to_string(60 + i) + "\"");
  text = replaced(text, "HLS_FIELD(Outputs, y_o, 8)", "meltstage::hls::field<std::uint8_t>(\"logic\", 0, 8)");
  write("block.cpp", text);
  ASSERT_EQ(translate().status, 0) << translate().output;
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_EQ(run_shell("iverilog -g2012 -o " + at("block.vvp") + " " + at("block.sv")).output, "");
}

TEST_F(Hls, ProductsOfProductsAreProvedInWhatWasTranslated) {
  write_block(R"(  const unsigned first = s->a_q * unsigned{in->x_i};
  const unsigned second = first * s->b_q[0];
  s->c_q = static_cast<std::int16_t>((second * s->b_q[1] + first) & 0xFF);
  s->b_q[2] = static_cast<std::uint8_t>(second * s->b_q[2]);
  s->b_q[3] = static_cast<std::uint8_t>(s->b_q[2] * s->b_q[3]);)");
  ASSERT_EQ(translate().status, 0) << translate().output;
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 0) << ran.output;
}

// Whatever the other products are: the second factor of the first one might be the first one's product.
TEST_F(Hls, ProductsOfProductsAreThoseOfRtlByHand) {
  write("block.cpp", R"(#include <cstdint>
#include "hls/interface.hpp"
struct State { std::uint32_t x_q; };
struct Inputs { std::uint16_t rst_ni, a_i, b_i, c_i; };
struct Outputs { std::uint8_t y_o; };
extern "C" {
void hls_reset(State* s) { *s = {}; }
void hls_step(State* s, const Inputs* in) {
  if (in->rst_ni == 0) return hls_reset(s);
  s->x_q = std::uint32_t{in->a_i} * in->b_i * in->c_i;
}
void hls_outputs(const State*, const Inputs*, Outputs* out) { out->y_o = 0; }
extern const meltstage::hls::Field hls_flops[] = {HLS_FIELD(State, x_q, 32)};
extern const meltstage::hls::Field hls_input_pins[] = {HLS_FIELD(Inputs, rst_ni, 1), HLS_FIELD(Inputs, a_i, 10),
    HLS_FIELD(Inputs, b_i, 10), HLS_FIELD(Inputs, c_i, 10)};
extern const meltstage::hls::Field hls_output_pins[] = {HLS_FIELD(Outputs, y_o, 1)};
}
)");
  write("block.sv", R"(
module debounce (input logic clk_i, rst_ni, input logic [9:0] a_i, b_i, c_i, output logic y_o);
logic [31:0] x_q; logic [19:0] first; assign first = a_i * b_i; assign y_o = 1'b0;
always_ff @(posedge clk_i or negedge rst_ni) if (!rst_ni) x_q <= 0; else x_q <= c_i * first;
endmodule
)");
  const Ran ran = prove("--block top");
  EXPECT_EQ(ran.status, 0) << ran.output;
}

// What is above the bits of both factors is the product's sign: the C++ has more bits than the RTL.
TEST_F(Hls, AMultiplyAccumulateOfRtlByHandIsProved) {
  write_block(
      "  const int sum = s->c_q + std::int8_t(in->x_i) * std::int8_t(s->a_q);\n"
      "  s->c_q = sum > 511 ? 511 : sum < -512 ? -512 : sum;");
  write("block.sv",
        "module debounce (input logic clk_i, input logic rst_ni, input logic [7:0] x_i, output logic [7:0] "
        "y_o);\n"
        "logic [7:0] a_q;\nlogic signed [9:0] c_q;\nlogic [7:0] b_q [0:3];\nlogic signed [16:0] sum;\n"
        "assign sum = c_q + $signed(x_i) * $signed(a_q);\n"
        "always_ff @(posedge clk_i or negedge rst_ni)\nif (!rst_ni) begin a_q <= 0; c_q <= 0; for (int i = "
        "0; i < 4; "
        "i++) b_q[i] <= 0; end\nelse c_q <= sum > 511 ? 10'sd511 : sum < -512 ? -10'sd512 : sum[9:0];\n"
        "assign y_o = a_q;\nendmodule\n");
  const Ran ran = prove("--block top");
  EXPECT_EQ(ran.status, 0) << ran.output;
}

// Yosys takes v[1] for a pattern, which is v1.
TEST_F(Hls, RtlInAFolderThatYosysTakesForAPatternIsRefused) {
  fs::create_directories(at("v[1]"));
  fs::copy(kExample + ".sv", at("v[1]/block.sv"));
  fs::copy(kExample + ".cpp", at("block.cpp"));
  write("list.f", "v[1]/block.sv\n");
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("v[1]/block.sv, expected a path without *, ?, [, ] and quotes"));
}

// The compiler would wait for a pipe, and read a device without end.
TEST_F(Hls, SourcesThatAreNoFilesAreRefused) {
  write_block("  s->c_q = in->x_i;");
  ASSERT_EQ(translate().status, 0);
  const std::string good = text_of(at("block.cpp"));
  for (const char* name : {"block.sv", "block.cpp"}) {
    const std::string kept = text_of(at(name));
    fs::remove(at(name));
    ASSERT_EQ(run_shell("mkfifo " + at(name)).status, 0);
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 2) << name;
    EXPECT_THAT(ran.output, HasSubstr(name)) << ran.output;
    fs::remove(at(name));
    write(name, kept);
  }
}

// A promise may rest on what a product is: with any function in its place it was broken at 0 times 0.
TEST_F(Hls, AnswersAreAskedWithRealProducts) {
  const auto write_product = [&](const std::string& body, const std::string& rtl) {
    write_block(body);
    write("block.sv",
          "module debounce (input logic clk_i, input logic rst_ni, input logic [7:0] x_i, output logic [7:0] "
          "y_o);\n"
          "logic [7:0] a_q;\nlogic signed [9:0] c_q;\nlogic [7:0] b_q [0:3];\n"
          "always_ff @(posedge clk_i or negedge rst_ni)\nif (!rst_ni) begin a_q <= 0; c_q <= 0; for (int i = "
          "0; i < 4; "
          "i++) b_q[i] <= 0; end\nelse begin " +
              rtl + " end\nassign y_o = a_q;\nendmodule\n");
  };
  write_product("  if ((in->x_i & 15) < 14 && (in->x_i >> 4) < 10) s->c_q = (in->x_i & 15) * (in->x_i >> 4);",
                "if (x_i[3:0] < 14 && x_i[7:4] < 10) c_q <= x_i[3:0] * x_i[7:4];");
  const Ran holds = prove();
  EXPECT_EQ(holds.status, 0) << holds.output;
  write_product("  s->c_q = static_cast<std::int8_t>(in->x_i) * ((in->x_i >> 4) + 0);",
                "c_q <= $signed(x_i) * $signed({1'b0, x_i[7:4]});");
  const Ran broken = prove();
  EXPECT_EQ(broken.status, 1) << broken.output;
  EXPECT_THAT(broken.output, HasSubstr("c_q has more bits than the circuit"));
  const std::size_t x_at = broken.output.find("x_i=0x");
  ASSERT_NE(x_at, std::string::npos) << broken.output;
  const int x = std::stoi(broken.output.substr(x_at + 4), nullptr, 16);
  const int product = static_cast<std::int8_t>(x) * (x >> 4);
  EXPECT_TRUE(product < -512 || product > 511) << "no example: " << x;
  // the forgotten sign differs for most factors: what is equal of both products is not proved first
  write_product("  s->c_q = (static_cast<std::int8_t>(in->x_i) * (in->x_i >> 4) << 22) >> 22;",
                "c_q <= x_i * x_i[7:4];");
  const Ran unsigned_product = prove("--block top");
  EXPECT_EQ(unsigned_product.status, 1) << unsigned_product.output;
  EXPECT_THAT(unsigned_product.output, HasSubstr("counterexample: c_q"));
}

TEST_F(Hls, WhatCanBeNoCircuitIsRefusedByFileAndLine) {
  expect_refused("  while (s->a_q != 3) s->a_q = static_cast<std::uint8_t>((s->a_q + 2) & 15);",
                 "block.cpp:11: found a loop that goes on after 4096 rounds for some state and pins");
  expect_refused("  s->a_q = static_cast<std::uint8_t>(elsewhere(in->x_i));",
                 "block.cpp:11: found a call of elsewhere");
  expect_refused("  s->a_q = static_cast<std::uint8_t>(1.5 * in->x_i);", "block.cpp:11: found ");
  expect_refused("  s->a_q = static_cast<std::uint8_t>(reinterpret_cast<std::uintptr_t>(s));",
                 "block.cpp:11: found ");
  expect_refused("  s->a_q = nothing;", "block.cpp:11:");
  write("block.cpp", "int main() {}\n");
  EXPECT_THAT(translate().output, HasSubstr("block.cpp"));
  EXPECT_EQ(translate().status, 2);
}

// Duff's device: what is left out there would leave a flop as it was.
TEST_F(Hls, ALoopThatIsEnteredInItsMiddleIsRefused) {
  expect_refused(
      R"(  std::uint8_t acc = s->a_q;
  int n = in->x_i & 31;
  if (n < 3) return;
  switch (in->x_i >> 6) {
    case 0: do { ++acc; [[fallthrough]];
    case 3:      acc = acc * 3u + n; [[fallthrough]];
    case 2:      ++acc; [[fallthrough]];
    case 1:      acc ^= n;
            } while ((n -= 4) > 0);
  }
  s->a_q = acc;)",
      "found a way into the middle of a loop (goto, or a case within it), expected loops that are entered at "
      "their beginning");
}

TEST_F(Hls, FormalCellsOfTheRtlAreNoneOfItsGates) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  const std::string rtl = text_of(kExample + ".sv");
  for (const char* cell :
       {"always @(posedge clk_i) assert (steady_q <= 15);", "always @(posedge clk_i) assume (hold_i != 3);",
        "always @(posedge clk_i) cover (pressed_q);"}) {
    write("block.sv", replaced(rtl, "endmodule", std::string(cell) + "\nendmodule"));
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 0) << cell << "\n" << ran.output;
  }
  write("block.sv", replaced(rtl, "assign pressed_o = pressed_q;",
                             "(* anyconst *) logic any; assign pressed_o = pressed_q | any;"));
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("t:$anyconst"));
}

// The compiler takes both for calls that hardly ever happen.
TEST_F(Hls, HelpersOfAWideSwitchAndColdOnesAreCopiedIn) {
  std::string body = "  switch (in->x_i) {\n";
  for (int i = 0; i < 40; ++i)
    body += "    case " + std::to_string(i) + ": s->a_q = " +
            (i == 7 || i == 27 ? "mix(s->a_q, s->c_q)" : "s->a_q ^ " + std::to_string(3 * i + 1)) +
            "; break;\n";
  write_block(body + "  }\n  if (s->b_q[0] == 3) s->b_q[1] = rare(in->x_i, s->c_q);");
  write("block.cpp", replaced(text_of(at("block.cpp")), "extern \"C\" int elsewhere(int);", R"(
static std::uint8_t mix(int a, int b) {
  int sum = a * 3 + b;
  if (sum > 500) sum -= b; else if (sum < -500) sum += a;
  if (sum & 1) sum ^= 0x55;
  return static_cast<std::uint8_t>(sum >> 1);
}

[[gnu::cold]] static std::uint8_t rare(int a, int b) {
  int sum = mix(a, b) + mix(b, a) * 5;
  for (int i = 0; i < 8; ++i) sum = sum & 1 ? sum >> 1 ^ 0x8c : sum >> 1;
  return static_cast<std::uint8_t>(sum + mix(sum, a));
})"));
  const Ran ran = translate();
  EXPECT_EQ(ran.status, 0) << ran.output;
}

TEST_F(Hls, CallsThatCannotBeCopiedInAreNamedAsTheirAuthorNamesThem) {
  for (const char* helper :
       {"static int again(int a) { return a == 0 ? 1 : 3 * again(a - 1) + again(a / 2); }",
        "[[gnu::noinline]] static int again(int a) { return a * a ^ 5; }"}) {
    write_block("  s->a_q = static_cast<std::uint8_t>(again(in->x_i));");
    write("block.cpp", replaced(text_of(at("block.cpp")), "extern \"C\" int elsewhere(int);", helper));
    expect_refusal("found a call of again(int) that can't be copied in");
  }
}

TEST_F(Hls, TwoFilesOfOneFunctionAreRefused) {
  write_block("  s->a_q = in->x_i;");
  fs::copy(at("block.cpp"), at("twice.cpp"));
  const Ran ran = translate("--module debounce " + at("twice.cpp"));
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("two of the files define the same function"));
}

TEST_F(Hls, FilesThatAreMissingOrReadAreNamed) {
  EXPECT_EQ(run_command("hls translate " + at("none.cpp") + " --out " + at("x.sv")).status, 2);
  fs::copy(kExample + ".cpp", at("block.cpp"));
  const Ran own = run_command("hls translate " + at("block.cpp") +
                              " --option=-I" MELTSTAGE_SOURCE_DIR " --out " + at("block.cpp"));
  EXPECT_EQ(own.status, 2);
  EXPECT_EQ(text_of(at("block.cpp")), text_of(kExample + ".cpp"));
  EXPECT_THAT(prove().output, HasSubstr("block.sv"));
  EXPECT_EQ(prove("--tie nonsense").status, 2);
}

// One source, two ways: with a macro it is written otherwise.
// steady_q stops at 15; held in reset nothing rises; with the button tied nothing falls that follows it.
TEST_F(Hls, BitsThatNeverSwitchAreListed) {
  const auto still = [&](const std::string& options) {
    return run_command("hls still " + kExample + ".cpp --option=-I" MELTSTAGE_SOURCE_DIR " " + options);
  };
  const Ran all = still("");
  EXPECT_EQ(all.status, 0) << all.output;
  EXPECT_THAT(all.output,
              HasSubstr("6 bits of flops: 12 rises and falls have a state that shows them, 0 never "
                        "happen, 0 not decided"));
  const Ran held = still("--tie rst_ni=0");
  EXPECT_THAT(held.output, HasSubstr("steady_q[3] never rises\n"));
  EXPECT_THAT(held.output, HasSubstr(" 6 never happen with rst_ni=0"));
  const Ran pressed = still("--tie rst_ni=1 button_i=1 --block top top");
  EXPECT_THAT(pressed.output, HasSubstr("level_q never falls\npressed_q never falls\n6 bits of flops: 10 "));
  EXPECT_THAT(still("--tie nothing=0").output, HasSubstr("--tie: found no input pin nothing, which"));
  EXPECT_THAT(still("--tie hold_i=0").output,
              HasSubstr("found no input pin hold_i of one bit, such as hold_i[0]"));
  EXPECT_THAT(still("--block u_nothing").output, HasSubstr("found no block u_nothing, expected one of top"));
}

TEST_F(Hls, TwoWaysOfOneSourceAreProvedEqualOrRefuted) {
  write_block(
      "#ifdef BY_SHIFT\n  s->a_q = static_cast<std::uint8_t>(in->x_i << 1);\n#else\n"
      "  s->a_q = static_cast<std::uint8_t>(in->x_i + in->x_i);\n#endif\n");
  const Ran equal = compare("--other=-DBY_SHIFT");
  EXPECT_EQ(equal.status, 0) << equal.output;
  EXPECT_THAT(equal.output, HasSubstr("proved: "));

  write_block("  s->a_q = in->x_i;\n#ifdef WRONG\n  if (in->x_i == 200) s->a_q = 1;\n#endif\n");
  const Ran refuted = compare("--other=-DWRONG");
  EXPECT_EQ(refuted.status, 1) << refuted.output;
  EXPECT_THAT(refuted.output, HasSubstr("x_i=0xc8"));
  EXPECT_THAT(refuted.output, HasSubstr("after the clock: second way 0x1, first way 0xc8"));
}

TEST_F(Hls, WaysThatBeginUnlikeAreRefuted) {
  write_block("  s->a_q = in->x_i;");
  write("block.cpp", replaced(text_of(at("block.cpp")), "{ *s = {}; }",
                              "{ *s = {};\n#ifdef WRONG\n  s->c_q = 5;\n#endif\n}"));
  EXPECT_EQ(compare("--other=-DRIGHT").status, 0);
  // Without a reset pin the next states are alike.
  write("block.cpp", replaced(text_of(at("block.cpp")), "if (in->rst_ni == 0) return hls_reset(s);", ""));
  const Ran refuted = compare("--other=-DWRONG");
  EXPECT_EQ(refuted.status, 1) << refuted.output;
  EXPECT_THAT(refuted.output, HasSubstr("counterexample: c_q[0] in reset"));
}

TEST_F(Hls, WaysOfOtherPinsAreToldBeforeTheyAreCompared) {
  std::string text = text_of(kExample + ".cpp");
  text = replaced(
      text, "HLS_FIELD(Inputs, hold_i, 4)",
      "\n#ifdef SHORTER\nHLS_FIELD(Inputs, hold_i, 3)\n#else\nHLS_FIELD(Inputs, hold_i, 4)\n#endif\n");
  write("block.cpp", text);
  const Ran ran = compare("--other=-DSHORTER");
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(
      ran.output,
      HasSubstr("input pin 3: found hold_i of 3 bits, expected hold_i of 4 bits as the first way has it"));
}

}  // namespace
}  // namespace meltstage
