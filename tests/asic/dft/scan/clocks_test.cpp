// SPDX-License-Identifier: Apache-2.0
// Netlists whose flops do not all capture at one edge of one clock, and cells whose resets a cycle can't
// tell: refused by name, or replayed as Icarus does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/asic/dft/support.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage::dft {
namespace {

using ::testing::HasSubstr;

class Clocks : public ::testing::Test {
 protected:
  // Two flops one behind the other, clk and ckb their pins; `first` and `second` are cells of Yosys with
  // their clocks.
  void write(const std::string& first, const std::string& second) {
    folder_.file("top.json", R"({"modules":{"t":{"attributes":{"top":1},"ports":{
"clk":{"direction":"input","bits":[2]},"ckb":{"direction":"input","bits":[3]},
"d":{"direction":"input","bits":[4]},"q":{"direction":"output","bits":[5]}},
"cells":{"u0":{"type":)" + first +
                                 R"(,"D":[4],"Q":[50]}},"u1":{"type":)" + second +
                                 R"(,"D":[50],"Q":[5]}}},"netnames":{}}}})");
  }
  void write_pattern(const std::string& vectors, const std::string& ckb_rises = "50") {
    folder_.file("p.stil",
                 "STIL 1.0; Signals { clk In; ckb In; d In; q Out; } SignalGroups { pi='clk+ckb+d'; }\n"
                 "Timing { WaveformTable w { Period '100ns'; Waveforms { pi { 01 { '0ns' D/U; } }\n"
                 "clk { P { '0ns' D; '50ns' U; '80ns' D; } } ckb { P { '0ns' D; '" +
                     ckb_rises +
                     "ns' U; '80ns' D; } }\nq { LHX { '40ns' L/H/X; } } } } }\n"
                     "PatternBurst b { PatList { p; } } PatternExec { PatternBurst b; }\nPattern p { W w; " +
                     vectors + " }\n");
  }
  Ran replay(const std::string& options = "") const {
    return run_command("dft replay " + path("p.stil") + " --netlist " + path("top.json") + options);
  }
  // Icarus has flops of any clock and edge.
  void expect_refused_on_the_netlist_alone(const std::string& words) const {
    const Ran ran = replay();
    EXPECT_EQ(ran.status, 2) << ran.output;
    EXPECT_THAT(ran.output, HasSubstr(words));
    EXPECT_THAT(replay(" --on icarus").output, HasSubstr(" 0 mismatches"));
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  TestFolder folder_;
};

constexpr const char* kRising = R"("$_DFF_P_","connections":{"C":[2])";
constexpr const char* kFalling = R"("$_DFF_N_","connections":{"C":[2])";
constexpr const char* kOther = R"("$_DFF_P_","connections":{"C":[3])";

TEST_F(Clocks, TwoAreRefusedOnTheNetlist) {
  write(kRising, kOther);
  write_pattern(
      "V { pi=P01; q=X; } V { pi=0P0; q=X; } V { pi=P00; q=H; } V { pi=0P0; q=H; } V { pi=000; q=L; }");
  expect_refused_on_the_netlist_alone("found a flop clocked by ckb, where that of u0 is another");
}

TEST_F(Clocks, PulsesAtSeveralTimesOfACycleAreRefused) {
  write(kRising, kOther);
  write_pattern("V { pi=PP1; q=X; } V { pi=PP0; q=H; }", "70");
  const Ran ran = replay(" --on icarus");
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("high from 70 to 80 ns, expected one time for all clocks of a cycle"));
}

TEST_F(Clocks, AFlopOfTheFallingEdgeBehindOneOfTheRisingEdgeIsRefused) {
  write(kRising, kFalling);
  write_pattern("V { pi=P01; q=X; } V { pi=P00; q=H; } V { pi=P01; q=L; } V { pi=000; q=H; }");
  expect_refused_on_the_netlist_alone("cell u1: found a flop of the clock's falling edge that reads u0");
}

TEST_F(Clocks, AFlopOfTheFallingEdgeBeforeOneOfTheRisingEdgeIsReplayed) {
  write(kFalling, kRising);
  write_pattern("V { pi=P01; q=X; } V { pi=P00; q=X; } V { pi=P01; q=H; } V { pi=000; q=L; }");
  for (const char* on : {"", " --on icarus"})
    EXPECT_THAT(replay(on).output, HasSubstr(" 0 mismatches")) << on;
}

class ResetCells : public Clocks {
 protected:
  // A flop with this ff group, by pins clk, ckb (SN), d and rn.
  void write_cell(const std::string& ff) {
    folder_.file(
        "cells.lib",
        "library (l) { cell (FF) { area : 1; ff (IQ, IQN) { clocked_on : \"CK\"; next_state : \"D\"; " + ff +
            " }\n pin(D){direction:input;} pin(CK){direction:input;} "
            "pin(RN){direction:input;} pin(SN){direction:input;}\n"
            "pin(Q){direction:output;function:\"IQ\";} pin(QN){direction:output;function:\"IQN\";} } }\n");
    folder_.file("top.json", R"({"modules":{"t":{"attributes":{"top":1},"ports":{
"clk":{"direction":"input","bits":[2]},"d":{"direction":"input","bits":[3]},"rn":{"direction":"input","bits":[4]},
"sn":{"direction":"input","bits":[5]},"q":{"direction":"output","bits":[6]},"qn":{"direction":"output","bits":[7]}},
"cells":{"u":{"type":"FF","connections":{"CK":[2],"D":[3],"RN":[4],"SN":[5],"Q":[6],"QN":[7]}}},"netnames":{}}}})");
  }
  void write_pattern(const std::string& vectors) {
    folder_.file("p.stil",
                 "STIL 1.0; Signals { clk In; d In; rn In; sn In; q Out; qn Out; } SignalGroups { "
                 "pi='clk+d+rn+sn'; po='q+qn'; }\n"
                 "Timing { WaveformTable w { Period '100ns'; Waveforms { pi { 01 { '0ns' D/U; } }\n"
                 "clk { P { '0ns' D; '50ns' U; '80ns' D; } } po { LHX { '40ns' L/H/X; } } } } }\n"
                 "PatternBurst b { PatList { p; } } PatternExec { PatternBurst b; }\nPattern p { W w; " +
                     vectors + " }\n");
  }
  Ran replay(const std::string& options = "") const {
    return Clocks::replay(" --liberty " + path("cells.lib") + options);
  }
};

TEST_F(ResetCells, AResetOfSeveralPinsIsRefusedOnTheNetlist) {
  write_cell("clear : \"!RN*SN\";");
  write_pattern("V { pi=P111; po=XX; } V { pi=0111; po=HL; } V { pi=0101; po=LH; } V { pi=P111; po=LH; }");
  const Ran ran = replay();
  EXPECT_EQ(ran.status, 2) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("found a clear of more than one pin or its inverse"));
  EXPECT_THAT(replay(" --on icarus").output, HasSubstr(" 0 mismatches"));
}

TEST_F(ResetCells, IcarusKnowsWhatClearAndPresetTogetherGive) {
  const auto expect = [&](const std::string& both, const std::string& seen) {
    write_cell("clear : \"!RN\"; preset : \"!SN\"; clear_preset_var1 : " + both.substr(0, 1) +
               "; clear_preset_var2 : " + both.substr(1) + ";");
    write_pattern("V { pi=P111; po=XX; } V { pi=0100; po=" + seen + "; }");
    EXPECT_THAT(replay(" --on icarus").output, HasSubstr(" 0 mismatches")) << both;
  };
  for (const char* levels : {"LL", "LH", "HL", "HH"}) expect(levels, levels);
  write_cell("clear : \"!RN\"; clear_preset_var1 : Q;");
  EXPECT_THAT(replay().output, HasSubstr("found clear_preset_var1 Q, expected L, H, N, T or X"));
}

}  // namespace
}  // namespace meltstage::dft
