// SPDX-License-Identifier: Apache-2.0
// `meltstage hls`: what resets which flop, and what may rest on it.
#include "tests/hls/hls_command.hpp"

namespace meltstage {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(Hls, AnAsynchronousResetIsOnePinOrFlop) {
  const std::string cpp = text_of(kExample + ".cpp"), sv = text_of(kExample + ".sv");
  write("block.cpp", replaced(cpp, "if (in->rst_ni == 0)", "if (in->rst_ni == 0 || (in->hold_i & 1) != 0)"));
  const std::string declared =
      replaced(sv, "steady_q, steady;", "steady_q, steady; wire clear_n = rst_ni & ~hold_i[0];");
  write("block.sv", replaced(replaced(declared, "negedge rst_ni", "negedge clear_n"), "!rst_ni", "!clear_n"));
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("block.sv:16: found flop level_q reset at once by hold_i[0] and rst_ni, "
                                    "expected one pin or flop alone, or hls_in_reset() in the C++"));
  // without a clock or with one: the table says which
  write("block.cpp", cpp);
  write("block.sv", sv);
  EXPECT_THAT(prove().output, HasSubstr("\nRTL: 6 flop bits are reset at once by rst_ni\n"));
  write("block.sv", replaced(sv, " or negedge rst_ni", ""));
  const Ran with_clock = prove();
  EXPECT_EQ(with_clock.status, 0) << with_clock.output;
  EXPECT_THAT(with_clock.output, HasSubstr("\nRTL: 6 flop bits are not reset before a clock\n"));
}

TEST_F(Hls, BothSidesBeginInTheStateOfReset) {
  write_block("  s->a_q = in->x_i;");
  const std::string cpp = text_of(at("block.cpp"));
  ASSERT_EQ(translate().status, 0) << translate().output;
  write("block.cpp", replaced(cpp, "*s = {}; }", "*s = {}; s->a_q = 7; }"));
  write("block.cpp", replaced(text_of(at("block.cpp")), "return hls_reset(s);", "{ *s = {}; return; }"));
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("a_q[0]: hls_reset() gives another value than the RTL's reset"));
}

TEST_F(Hls, ATiedPinHasOneValueAndIsToldWithTheVerdict) {
  write_block("  s->a_q = in->x_i;");
  ASSERT_EQ(translate().status, 0) << translate().output;
  EXPECT_THAT(prove("--tie rst_ni=1").output, HasSubstr("equal for every state and input with rst_ni=1; "));
  const Ran twice = prove("--tie rst_ni=1 --tie rst_ni=0");
  EXPECT_EQ(twice.status, 2) << twice.output;
  EXPECT_THAT(twice.output, HasSubstr("--tie: found rst_ni twice, expected one value a pin"));
}

TEST_F(Hls, AFlopThatNothingResetsIsNamed) {
  const std::string cpp = replaced(text_of(kExample + ".cpp"), "in->rst_ni == 0", "false");
  const std::string sv = replaced(text_of(kExample + ".sv"), " or negedge rst_ni", "");
  write("block.cpp", cpp);
  write("block.sv", replaced(sv, "!rst_ni", "1'b0"));
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("\nnothing resets level_q, steady_q, pressed_q: "));
  write("block.cpp", text_of(kExample + ".cpp"));
  write("block.sv", sv);
  EXPECT_THAT(prove().output, Not(HasSubstr("nothing resets")));
}

TEST_F(Hls, AFlopThatTheCppDoesNotResetHasNoResetInWhatIsTranslated) {
  write_block("  s->a_q = in->x_i;");
  write("block.cpp", replaced(text_of(at("block.cpp")), "return hls_reset(s);", "{ s->a_q = 0; return; }"));
  ASSERT_EQ(translate().status, 0) << translate().output;
  EXPECT_THAT(text_of(at("block.sv")), HasSubstr("always_ff @(posedge clk_i) begin"));
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("\nnothing resets c_q, b_q[0], b_q[1], b_q[2], b_q[3]: "));
}

TEST_F(Hls, AnInvariantHoldsWhateverNothingResets) {
  const std::string body = R"(  s->a_q = in->x_i;
}
struct Held { std::uint8_t small; };
extern const meltstage::hls::Field hls_invariant_names[] = {HLS_FIELD(Held, small, 1)};
void hls_invariants(const State* s, Held* held) {
  held->small = s->c_q < 4;)";
  write_block(body);
  write("block.cpp", replaced(text_of(at("block.cpp")), "if (in->rst_ni == 0) return hls_reset(s);", ""));
  ASSERT_EQ(translate().status, 0) << translate().output;
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("invariant small: found it to rest on flops that nothing resets"));
}

// A block alone was "proved for every state" under an invariant that nothing had asked for.
TEST_F(Hls, ABlockIsProvedTogetherWithTheInvariants) {
  write_block(R"(  if (s->a_q < 9) ++s->a_q;
}
struct Held { std::uint8_t small; };
extern const meltstage::hls::Field hls_invariant_names[] = {HLS_FIELD(Held, small, 1)};
void hls_invariants(const State* s, Held* held) {
  held->small = s->a_q < 4;)");
  ASSERT_EQ(translate().status, 0) << translate().output;
  const Ran ran = prove("--block pins");
  EXPECT_EQ(ran.status, 1) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("small does not hold in the next state"));
  EXPECT_THAT(compare("--other=-DANY").output, HasSubstr("58 of 58 bits equal for every state and input"));
  const Ran still = run_command("hls still " + at("block.cpp") + " --option=-I" MELTSTAGE_SOURCE_DIR);
  EXPECT_EQ(still.status, 1) << still.output;
  EXPECT_THAT(still.output, HasSubstr("invariant: small, which is not shown to hold\n"));
}

// A pin that is tied for the switches is not tied for what they rest on.
TEST_F(Hls, InvariantsAreAskedForAllValuesOfATiedPin) {
  write_block(R"(  s->a_q = in->x_i;
}
struct Held { std::uint8_t zero; };
extern const meltstage::hls::Field hls_invariant_names[] = {HLS_FIELD(Held, zero, 1)};
void hls_invariants(const State* s, Held* held) {
  held->zero = (s->a_q & 1) == 0;)");
  const Ran still =
      run_command("hls still " + at("block.cpp") + " --option=-I" MELTSTAGE_SOURCE_DIR " --tie x_i[0]=0");
  EXPECT_EQ(still.status, 1) << still.output;
  EXPECT_THAT(still.output, HasSubstr("invariant: zero, which is not shown to hold\n"));
}

// What is so in those states alone was counted as if it were so in all.
TEST_F(Hls, BitsThatNeedTheInvariantsAreCounted) {
  write_block(R"(  if (s->a_q < 3) ++s->a_q;
#ifdef OTHER
  if (s->a_q > 4) s->b_q[0] = 1;
#endif
}
struct Held { std::uint8_t small; };
extern const meltstage::hls::Field hls_invariant_names[] = {HLS_FIELD(Held, small, 1)};
void hls_invariants(const State* s, Held* held) {
  held->small = s->a_q < 4;)");
  const Ran ran = compare("--other=-DOTHER");
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output,
              HasSubstr("bits equal for every state and input, 8 of them where the invariants hold, as "
                        "prove shows of them; "));
}

// An invariant may not rest on the bits of a flop that nothing resets.
TEST_F(Hls, AFlopOfWhichOneBitIsResetIsNotReset) {
  write("block.cpp", R"(#include <cstdint>
#include "hls/interface.hpp"
struct S { std::uint8_t a_q; };
struct I { std::uint8_t rst_ni, d_i; };
struct O { std::uint8_t y_o; };
struct V { std::uint8_t high_is_low; };
extern "C" {
void hls_reset(S* s) { s->a_q = 0; }
void hls_step(S* s, const I* i) { s->a_q = std::uint8_t((s->a_q & 2) | (i->rst_ni ? i->d_i & 1 : 0)); }
void hls_outputs(const S* s, const I*, O* o) { o->y_o = s->a_q & 1; }
void hls_invariants(const S* s, V* v) { v->high_is_low = s->a_q < 2; }
extern const meltstage::hls::Field hls_invariant_names[] = {HLS_FIELD(V, high_is_low, 1)};
extern const meltstage::hls::Field hls_flops[] = {HLS_FIELD(S, a_q, 2)};
extern const meltstage::hls::Field hls_input_pins[] = {HLS_FIELD(I, rst_ni, 1), HLS_FIELD(I, d_i, 1)};
extern const meltstage::hls::Field hls_output_pins[] = {HLS_FIELD(O, y_o, 1)};
}
)");
  write("block.sv", R"(module debounce (input logic clk_i, rst_ni, d_i, output logic y_o);
  logic [1:0] a_q;
  always_ff @(posedge clk_i or negedge rst_ni) if (!rst_ni) a_q[0] <= 1'b0; else a_q[0] <= d_i;
  always_ff @(posedge clk_i) a_q[1] <= a_q[1];
  assign y_o = a_q[0] ^ a_q[1];
endmodule
)");
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output,
              HasSubstr("invariant high_is_low: found it to rest on flops that nothing resets (a_q)"));
}

// Nobody promises that en_i is ever low.
TEST_F(Hls, ADataPinIsNoReset) {
  write("block.cpp", R"(#include <cstdint>
#include "hls/interface.hpp"
struct S { std::uint8_t a_q, b_q; };
struct I { std::uint8_t rst_ni, en_i; };
struct O { std::uint8_t y_o; };
struct V { std::uint8_t low; };
extern "C" {
void hls_reset(S* s) { *s = {}; }
void hls_step(S* s, const I* i) {
  s->a_q = i->rst_ni & i->en_i;
  s->b_q = s->b_q & i->en_i;
}
void hls_outputs(const S* s, const I*, O* o) { o->y_o = s->a_q; }
void hls_invariants(const S* s, V* v) { v->low = s->b_q == 0; }
extern const meltstage::hls::Field hls_invariant_names[] = {HLS_FIELD(V, low, 1)};
extern const meltstage::hls::Field hls_flops[] = {HLS_FIELD(S, a_q, 1), HLS_FIELD(S, b_q, 1)};
extern const meltstage::hls::Field hls_input_pins[] = {HLS_FIELD(I, rst_ni, 1), HLS_FIELD(I, en_i, 1)};
extern const meltstage::hls::Field hls_output_pins[] = {HLS_FIELD(O, y_o, 1)};
}
)");
  write("block.sv", R"(module debounce (input logic clk_i, rst_ni, en_i, output logic y_o);
  logic a_q, b_q;
  always_ff @(posedge clk_i or negedge rst_ni) if (!rst_ni) a_q <= 1'b0; else a_q <= en_i;
  always_ff @(posedge clk_i) b_q <= b_q & en_i;
  assign y_o = a_q ^ b_q;
endmodule
)");
  for (const char* options : {"", "--tie en_i=1"}) {
    const Ran ran = prove(options);
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("invariant low: found it to rest on flops that nothing resets (b_q)"));
  }
}

// Two signs of negation in a row are a syntax error in Icarus.
TEST_F(Hls, TheResetOfATranslatedBlockIsReadByOtherTools) {
  const std::string text = text_of(kExample + ".cpp");
  write("block.cpp",
        replaced(
            text, "extern const meltstage::hls::Field hls_flops[]",
            "void hls_in_reset(const State*, const Inputs* in, std::uint8_t* r) { *r = in->rst_ni == 0 ? 1 : "
            "0; }\n\nextern const meltstage::hls::Field hls_flops[]"));
  ASSERT_EQ(translate().status, 0) << translate().output;
  EXPECT_EQ(run_shell("iverilog -g2012 -o " + at("block.vvp") + " " + at("block.sv")).output, "");
}

}  // namespace
}  // namespace meltstage
