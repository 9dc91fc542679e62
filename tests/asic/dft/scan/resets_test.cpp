// SPDX-License-Identifier: Apache-2.0
// Netlists of several resets, of tied ones, and of flops with clear and preset: what `generate` writes holds
// on its own netlist, or `rules` says why not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/asic/dft/support.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage::dft {
namespace {

using ::testing::HasSubstr;

constexpr const char* kCells = R"lib(library(cells) {
cell(NAND) { area : 1; pin(A) { direction : input; } pin(B) { direction : input; }
  pin(Y) { direction : output; function : "!(A*B)"; } }
cell(MUX) { area : 1; pin(A) { direction : input; } pin(B) { direction : input; } pin(S) { direction : input; }
  pin(Y) { direction : output; function : "(S*B)+(!S*A)"; } }
cell(FLOP) { area : 1; ff(IQ, IQN) { clocked_on : "CK"; next_state : "D"; clear : "!R"; }
  pin(D) { direction : input; } pin(CK) { direction : input; clock : true; } pin(R) { direction : input; }
  pin(Q) { direction : output; function : "IQ"; } }
cell(FLOPSR) { area : 1; ff(IQ, IQN) { clocked_on : "CK"; next_state : "D"; clear : "!R"; preset : "!S";
    clear_preset_var1 : L; clear_preset_var2 : H; }
  pin(D) { direction : input; } pin(CK) { direction : input; clock : true; } pin(R) { direction : input; }
  pin(S) { direction : input; } pin(Q) { direction : output; function : "IQ"; } }
}
)lib";

class Resets : public ::testing::Test {
 protected:
  // A netlist of `body` with pins ck, r, s, d, e and q.
  void write(const std::string& body) {
    const auto verilog =
        folder_.file("top.v",
                     "module NAND(input A, input B, output Y); endmodule\n"
                     "module FLOP(input D, input CK, input R, output Q); endmodule\n"
                     "module FLOPSR(input D, input CK, input R, input S, output Q); endmodule\n"
                     "module top(input ck, input r, input s, input d, input e, output q);\nwire a, b;\n" +
                         body + "\nendmodule\n");
    liberty_ = folder_.file("cells.lib", kCells).string();
    const std::string command = "yosys -q -p 'read_verilog " + verilog.string() +
                                "; hierarchy -top top; write_json " + netlist() + "' > /dev/null";
    ASSERT_EQ(std::system(command.c_str()), 0);
  }
  std::string netlist() const { return (folder_.path() / "top.json").string(); }
  std::string library() const { return " --liberty " + liberty_; }
  Ran generate() const {
    return run_command("dft generate " + netlist() + library() + " --out " +
                       (folder_.path() / "out").string());
  }
  Ran replay(const std::string& patterns, const std::string& of) const {
    return run_command("dft replay " + (folder_.path() / patterns).string() + " --netlist " + of + library());
  }
  void expect_patterns_to_hold() const {
    const Ran made = generate();
    ASSERT_EQ(made.status, 0) << made.output;
    const Ran ran = replay("out/patterns.stil", (folder_.path() / "out/netlist.json").string());
    EXPECT_EQ(ran.status, 0) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr(" 0 mismatches"));
  }

  TestFolder folder_;
  std::string liberty_;
};

TEST_F(Resets, OfTwoPortsAreOneInTestMode) {
  write(
      "FLOP f(.D(d), .CK(ck), .R(r), .Q(a)); NAND n(.A(a), .B(e), .Y(b));\n"
      "FLOP g(.D(b), .CK(ck), .R(s), .Q(q));");
  expect_patterns_to_hold();
}

TEST_F(Resets, ThatAreTiedOffAreNone) {
  write(
      "FLOP f(.D(d), .CK(ck), .R(1'b1), .Q(a)); NAND n(.A(a), .B(e), .Y(b));\n"
      "FLOP g(.D(b), .CK(ck), .R(r), .Q(q));");
  EXPECT_THAT(run_command("dft rules " + netlist() + library()).output, HasSubstr("no reset: f"));
  expect_patterns_to_hold();
}

TEST_F(Resets, OfFlopsWithAPresetThatIsTiedOffAct) {
  write(
      "FLOPSR f(.D(d), .CK(ck), .R(r), .S(1'b1), .Q(a)); NAND n(.A(a), .B(e), .Y(b));\n"
      "FLOPSR g(.D(b), .CK(ck), .R(1'b1), .S(r), .Q(q));");
  expect_patterns_to_hold();
  // worked out by hand: f is cleared and g set; then a clock takes d into f, and nand(a, e) into g
  folder_.file("vectors.stil", R"(STIL 1.0;
Signals { ck In; r In; s In; d In; e In; q Out; }
SignalGroups { in = 'ck+r+s+d+e'; }
Timing { WaveformTable t { Period '100ns'; Waveforms {
  in { 01P { '0ns' D/U/D; '50ns' D/U/U; '80ns' D/U/D; } } q { LHX { '0ns' X; '40ns' L/H/X; } } } } }
PatternBurst b { PatList { x; } } PatternExec { PatternBurst b; }
Pattern x { W t;
V { in=00011; q=H; } V { in=P1011; q=H; } V { in=P1011; q=H; } V { in=01011; q=L; } V { in=00011; q=H; } }
)");
  const Ran ran = replay("vectors.stil", netlist());
  EXPECT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr(" 0 mismatches"));
}

TEST_F(Resets, OfBothKindsInUseAreRefused) {
  write("FLOPSR f(.D(d), .CK(ck), .R(r), .S(s), .Q(q)); NAND n(.A(e), .B(e), .Y(b));");
  const Ran rules = run_command("dft rules " + netlist() + library());
  EXPECT_EQ(rules.status, 1) << rules.output;
  EXPECT_THAT(rules.output, HasSubstr("f: found a clear and a preset that are both in use"));
  EXPECT_EQ(generate().status, 2);
}

TEST_F(Resets, ThatNeverEndAreRefused) {
  write("FLOP f(.D(d), .CK(ck), .R(1'b0), .Q(q)); NAND n(.A(e), .B(e), .Y(b));");
  const Ran made = generate();
  EXPECT_EQ(made.status, 2) << made.output;
  EXPECT_THAT(made.output, HasSubstr("f: found R tied to 0, which resets the flop for ever"));
}

}  // namespace
}  // namespace meltstage::dft
