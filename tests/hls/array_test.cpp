// SPDX-License-Identifier: Apache-2.0
// `meltstage hls`: what IEEE 1800 says of words beyond an array and of quotients by 0, where Yosys has values
// of its own.
#include "tests/hls/hls_command.hpp"

namespace meltstage {
namespace {

using ::testing::HasSubstr;

// A block without flops: y_o of the pins a_i and b_i, of 4 bits each.
class HlsArrays : public Hls {
 protected:
  void expect(int status, const std::string& rtl, const std::string& result) {
    write("block.sv",
          "module debounce (input logic clk_i, input logic rst_ni, input logic [3:0] a_i, input logic [3:0] "
          "b_i,\n"
          "  output logic [3:0] y_o);\nlogic spare_q;\n"
          "always_ff @(posedge clk_i or negedge rst_ni) if (!rst_ni) spare_q <= 0; else spare_q <= "
          "~spare_q;\n" +
              rtl + "\nendmodule\n" + below_);
    write("block.cpp", R"(#include <cstdint>
#include "hls/interface.hpp"
struct State { std::uint8_t spare_q; };
struct Inputs { std::uint8_t rst_ni, a_i, b_i; };
struct Outputs { std::uint8_t y_o; };
static const std::uint8_t kTable[4] = {3, 9, 12, 6};
extern "C" {
void hls_reset(State* s) { *s = {}; }
void hls_step(State* s, const Inputs* in) { s->spare_q = in->rst_ni != 0 && s->spare_q == 0; }
void hls_outputs(const State*, const Inputs* in, Outputs* out) { out->y_o = static_cast<std::uint8_t>()" +
                           result + R"(); }
extern const meltstage::hls::Field hls_flops[] = {HLS_FIELD(State, spare_q, 1)};
extern const meltstage::hls::Field hls_input_pins[] = {
    HLS_FIELD(Inputs, rst_ni, 1), HLS_FIELD(Inputs, a_i, 4), HLS_FIELD(Inputs, b_i, 4)};
extern const meltstage::hls::Field hls_output_pins[] = {HLS_FIELD(Outputs, y_o, 4)};
}
)");
    const Ran ran = prove();
    EXPECT_EQ(ran.status, status) << rtl << "\n" << result << "\n" << ran.output;
    said_ = ran.output;
  }
  // `rtl` begins in line 5.
  void expect_refused(const std::string& rtl, const std::string& said) {
    expect(2, rtl, "in->a_i");
    EXPECT_THAT(said_, HasSubstr(said)) << rtl;
  }

  std::string below_;  // another module
  std::string said_;
};

TEST_F(HlsArrays, AWordBeyondATableIsAnyValue) {
  const std::string table =
      "logic [3:0] m [0:3];\ninitial begin m[0] = 3; m[1] = 9; m[2] = 12; m[3] = 6; end\n";
  expect(1, table + "assign y_o = m[a_i];", "kTable[in->a_i & 3]");
  expect(0, table + "assign y_o = m[a_i[1:0]];", "kTable[in->a_i & 3]");
  expect(0, table + "assign y_o = a_i < 4 ? m[a_i] : 4'd0;", "in->a_i < 4 ? kTable[in->a_i & 3] : 0");
  // a number of words that is no power of two was refused without a place
  const std::string three = "logic [3:0] m [0:2];\ninitial begin m[0] = 3; m[1] = 9; m[2] = 12; end\n";
  expect(0, three + "assign y_o = a_i < 3 ? m[a_i] : 4'd6;", "in->a_i < 3 ? kTable[in->a_i & 3] : 6");
  expect(1, three + "assign y_o = m[a_i[1:0]];", "kTable[in->a_i & 3]");
}

// Yosys chose from the whole struct.
TEST_F(HlsArrays, AMemberOfAStructIsNotChosenFromByAnIndex) {
  const std::string type =
      "typedef struct packed { logic [1:0] high; logic [1:0] low; } pair_t;\npair_t pair;\n";
  expect(2, type + "assign pair = a_i;\nassign y_o = {3'd0, pair.low[b_i[1:0]]};",
         "in->a_i >> (in->b_i & 3) & 1");
  expect(2, type + "always_comb begin pair = a_i; pair.low[b_i[1:0]] = 1'b1; end\nassign y_o = pair;",
         "in->a_i | 1 << (in->b_i & 3)");
  expect(0, type + "logic [1:0] low;\nassign pair = a_i, low = pair.low;\nassign y_o = {3'd0, low[b_i[0]]};",
         "in->a_i >> (in->b_i & 1) & 1");
  expect(0, type + "assign pair = a_i;\nassign y_o = {3'd0, pair.low[1]};", "in->a_i >> 1 & 1");
}

TEST_F(HlsArrays, AQuotientByZeroIsAnyValue) {
  expect(1, "assign y_o = a_i / b_i;", "in->b_i ? in->a_i / in->b_i : 15");
  expect(1, "assign y_o = a_i % b_i;", "in->b_i ? in->a_i % in->b_i : in->a_i");
  expect(0, "assign y_o = b_i == 0 ? 4'd5 : a_i / b_i;", "in->b_i ? in->a_i / in->b_i : 5");
  expect(0, "assign y_o = a_i / 4'd3;", "in->a_i / 3");
}

TEST_F(Hls, AWriteBeyondAMemoryStaysAway) {
  write_block("  s->a_q = s->b_q[0];\n  if (in->x_i < 4) s->b_q[in->x_i] = 5;");
  const std::string pins =
      "module debounce (input logic clk_i, input logic rst_ni, input logic [7:0] x_i, output logic [7:0] "
      "y_o);\n"
      "logic [7:0] a_q;\nlogic signed [9:0] c_q;\nlogic [7:0] b_q [0:3];\n";
  const std::string behind =
      "assign y_o = a_q;\nalways_ff @(posedge clk_i or negedge rst_ni)\n"
      "if (!rst_ni) begin a_q <= 0; c_q <= 0; end else begin a_q <= b_q[0]; c_q <= c_q; end\nendmodule\n";
  const auto memory = [&](const std::string& index) {
    return pins +
           "always_ff @(posedge clk_i)\nif (!rst_ni) begin b_q[0] <= 0; b_q[1] <= 0; b_q[2] <= 0; b_q[3] <= "
           "0; end\n"
           "else b_q[" +
           index + "] <= 8'd5;\n" + behind;
  };
  write("block.sv", memory("x_i"));
  EXPECT_EQ(prove().status, 0) << prove().output;
  write("block.sv", memory("x_i[1:0]"));
  EXPECT_EQ(prove().status, 1) << prove().output;
  // Yosys makes flops of an array that a reset sets at once, and drops the upper bits of the index
  const auto flops = [&](const std::string& index) {
    return pins +
           "always_ff @(posedge clk_i or negedge rst_ni)\nif (!rst_ni) for (int i = 0; i < 4; i++) b_q[i] <= "
           "0;\n"
           "else b_q[" +
           index + "] <= 8'd5;\n" + behind;
  };
  for (const char* index : {"x_i", "x_i + 1"}) {
    write("block.sv", flops(index));
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("block.sv:7: found an index of "));
  }
  // the later index of a line hid the earlier one; a number is as wide as it is
  write("block.sv", flops("x_i[2:0]] <= 8'd5; else if (x_i[7]) b_q[x_i[1:0]"));
  EXPECT_EQ(prove().status, 2) << prove().output;
  write("block.sv", flops("x_i[1:0]] <= b_q[0] ^ b_q[x_i[3:2]"));
  EXPECT_EQ(prove().status, 1) << prove().output;
  write("block.sv", flops("x_i[1:0]"));
  EXPECT_EQ(prove().status, 1);
  write_block("  s->a_q = s->b_q[0];\n  s->b_q[in->x_i & 3] = 5;");
  EXPECT_EQ(prove().status, 0) << prove().output;
}

// Yosys makes one dimension of several: an index beyond its own was a word of the next row.
TEST_F(Hls, AnIndexBeyondOneOfSeveralDimensionsIsRefused) {
  const auto block = [&](const std::string& index) {
    return "module debounce (input logic clk_i, input logic rst_ni, input logic [7:0] x_i, output logic "
           "[7:0] y_o);\n"
           "logic [7:0] a_q;\nlogic signed [9:0] c_q;\nlogic [7:0] b_q [0:1][0:1];\n"
           "always_ff @(posedge clk_i) b_q[x_i[7]][" +
           index +
           "] <= 8'd5;\nassign y_o = a_q;\n"
           "always_ff @(posedge clk_i or negedge rst_ni)\n"
           "if (!rst_ni) begin a_q <= 0; c_q <= 0; end else begin a_q <= b_q[0][0]; c_q <= c_q; "
           "end\nendmodule\n";
  };
  write_block("  s->a_q = s->b_q[0];\n  s->b_q[(in->x_i >> 7) * 2 + (in->x_i & 1)] = 5;");
  write("block.sv", block("x_i[1:0]"));
  EXPECT_EQ(prove().status, 2);
  EXPECT_THAT(prove().output, HasSubstr("block.sv: found an index of 2 bits in a dimension of 2 words"));
  write("block.sv", block("x_i[0]"));
  EXPECT_NE(prove().status, 2) << prove().output;
}

// Yosys wrote nothing of a slice that ends below bit 0, and took a signed index without its sign.
TEST_F(HlsArrays, WhatYosysReadsOtherwiseIsRefused) {
  const std::string any = "in->a_i";
  expect(2, "always_comb begin y_o = a_i; y_o[b_i[1:0] -: 2] = 2'd3; end", any);
  expect(2,
         "logic [3:0] m [0:7];\nlogic signed [1:0] i;\nassign i = a_i[1:0], y_o = m[i];\n"
         "initial begin m[0] = 3; m[1] = 9; m[2] = 12; m[3] = 6; m[4] = 1; m[5] = 2; m[6] = 7; m[7] = 8; end",
         any);
  expect(2, "logic [3:0] m [-1:2];\nassign y_o = m[a_i[1:0]];\ninitial begin m[0] = 3; m[1] = 9; end", any);
  expect(0,
         "logic [3:0] v;\nalways_comb begin v = a_i; for (int i = 0; i < 2; i++) v[2 * i + 1 -: 2] = "
         "b_i[1:0]; end\n"
         "assign y_o = v;",
         "in->b_i % 4 * 5");
}

// Yosys took the first for a continuous assignment, worked out the second in the operands' bits, and made a
// net of the third; simulators do otherwise.
TEST_F(HlsArrays, SlipsThatYosysTakesAreRefused) {
  expect_refused("logic [3:0] n = a_i & b_i;\nassign y_o = n;",
                 "block.sv:5: found an initial value of n that is no constant");
  expect_refused("logic [3:0] n;\ninitial n = a_i;\nassign y_o = n;",
                 "block.sv: found an initial value of n");
  expect_refused("assign y_o = a_i & nosuch;", "block.sv:5: found nosuch without a declaration");
  expect(0, "wire [3:0] n = a_i & b_i;\nassign y_o = n;", "in->a_i & in->b_i");
  expect(0,
         "logic [3:0] n;\nalways @* begin n = a_i; for (int i = 0; i < 2; i++) n[i] = b_i[i]; end\nassign "
         "y_o = n;",
         "(in->a_i & 12) | (in->b_i & 3)");
  expect(
      0,
      "function [3:0] f(input [1:0] x); begin f = 0; f[2:1] = x; end endfunction\nassign y_o = f(a_i[1:0]);",
      "(in->a_i & 3) * 2");
  expect(0, "logic [3:0] n = 4'd5;\nassign y_o = n;", "5");
}

// Simulators do otherwise than Yosys, whose reading was proved.
TEST_F(HlsArrays, WhatIcarusReadsOtherwiseIsRefused) {
  const std::string both = " as Icarus does, in clock ";
  expect_refused("function [3:0] f(input [3:0] x); f = x; endfunction\nassign y_o = f(~2'd3) ^ a_i;", both);
  expect_refused(
      "task automatic t(inout [3:0] c); c = c + 1; endtask\nlogic [3:0] c;\n"
      "always_comb begin c = b_i; t(c); y_o = c; end",
      both);
  expect_refused("localparam signed K = 2'd2;\nassign y_o = K;", both);
  expect_refused("typedef enum logic {A, B} e_t;\nassign y_o = {A, B, A, B};", both);
  expect(0, "assign y_o = a_i & b_i;", "in->a_i & in->b_i");
  EXPECT_THAT(said_, HasSubstr("RTL: as Yosys reads it, it ran like Icarus for 200 clocks"));
  EXPECT_THAT(prove("--simulate 0").output, HasSubstr("RTL: not run beside Icarus: --simulate 0"));
}

TEST_F(HlsArrays, AnExpressionAtAWiderPortIsRefused) {
  const auto block = [](const std::string& x) { return "wider u (.x(" + x + "), .y(y_o));"; };
  below_ =
      "module wider (input logic [7:0] x, output logic [3:0] y); assign y = x[7:4] ^ x[3:0]; endmodule\n";
  expect_refused(block("a_i + b_i"), "block.sv:5: found an expression at port x of u, 4 of 8 bits");
  expect_refused(block("~a_i"), "found an expression at port x of u");
  expect(0, block("a_i"), "in->a_i");
  expect(0, block("{a_i, b_i}"), "in->a_i ^ in->b_i");
  expect(0, block("{b_i[1:0], 2'd2}"), "(in->b_i & 3) * 4 + 2");
}

// Names are a module's own: an array of 8 words is read by 3 bits where another module has 4 words of that
// name, and an index without a sign where another module's has one.
TEST_F(Hls, NamesOfOtherModulesSayNothingOfAnIndex) {
  write("block.cpp", R"(#include <cstdint>
#include "hls/interface.hpp"
struct State { std::uint8_t b[8], s[4]; };
struct Inputs { std::uint8_t rst_ni, we, pc, d; };
struct Outputs { std::uint8_t q, q2, y; };
constexpr meltstage::hls::Field word(meltstage::hls::Field field, int number) { field.word = number; return field; }
extern "C" {
void hls_reset(State* s) { *s = {}; }
void hls_step(State* s, const Inputs* in) {
  if (in->rst_ni == 0) return hls_reset(s);
  if (in->we != 0) { s->b[in->pc] = in->d; s->s[in->pc & 3] = in->d; }
}
void hls_outputs(const State* s, const Inputs* in, Outputs* out) {
  *out = {s->b[in->pc], s->s[in->pc & 3], static_cast<std::uint8_t>(in->pc >> 2)};
}
#define B(n) word(meltstage::hls::field<std::uint8_t>("u_big__DOT__t_q", n, 2), n)
#define S(n) word(meltstage::hls::field<std::uint8_t>("u_small__DOT__t_q", 8 + n, 2), n)
extern const meltstage::hls::Field hls_flops[] = {B(0), B(1), B(2), B(3), B(4), B(5), B(6), B(7), S(0), S(1), S(2), S(3)};
extern const meltstage::hls::Field hls_input_pins[] = {HLS_FIELD(Inputs, rst_ni, 1), HLS_FIELD(Inputs, we, 1),
    HLS_FIELD(Inputs, pc, 3), HLS_FIELD(Inputs, d, 2)};
extern const meltstage::hls::Field hls_output_pins[] = {HLS_FIELD(Outputs, q, 2), HLS_FIELD(Outputs, q2, 2),
    HLS_FIELD(Outputs, y, 1)};
}
)");
  const auto table = [](const std::string& name, const std::string& words, const std::string& bits) {
    return "module " + name + " (input logic clk_i, rst_ni, we, input logic [" + bits +
           ":0] pc, input logic [1:0] d, output logic [1:0] q);\nlogic [1:0] t_q [" + words +
           "];\nassign q = t_q[pc];\nalways_ff @(posedge clk_i or negedge rst_ni)\n"
           "if (!rst_ni) for (int i = 0; i < " +
           words + "; i++) t_q[i] <= 0; else if (we) t_q[pc] <= d;\nendmodule\n";
  };
  const std::string rest =
      "module sign (input logic signed [2:0] pc, output logic y);\nassign y = pc < 0;\nendmodule\n"
      "module debounce (input logic clk_i, rst_ni, we, input logic [2:0] pc, input logic [1:0] d, output "
      "logic [1:0] q, q2, "
      "output logic y);\nbig u_big (.clk_i, .rst_ni, .we, .pc, .d, .q);\n"
      "small u_small (.clk_i, .rst_ni, .we, .pc(pc[1:0]), .d, .q(q2));\nsign u_sign (.pc(pc), "
      ".y);\nendmodule\n";
  const std::string big = table("big", "8", "2"), small = table("small", "4", "1");
  for (const std::string& text : {big + small + rest, small + big + rest}) {
    write("block.sv", text);
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 0) << ran.output;
  }
  write("block.sv", big + replaced(small, "t_q[pc] <= d", "t_q[{1'b0, pc}] <= d") + rest);
  EXPECT_THAT(prove().output, HasSubstr("found an index of 3 bits of t_q, which has 4 words"));
}

TEST_F(Hls, AListWithoutFilesIsRefused) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  write("list.f", "// nothing\n\n");
  EXPECT_THAT(prove().output, HasSubstr("list.f: found no file, expected the names of RTL files"));
}

}  // namespace
}  // namespace meltstage
