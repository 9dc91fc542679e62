// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/files/stil.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "asic/dft/files/formats.hpp"
#include "asic/dft/scan/lint.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

using testing::HasSubstr;

// Two chains of two and one cells, one capture and a reset pattern, made by hand.
ScanTest small_test() {
  ScanTest test;
  test.title = "small";
  for (const char* name : {"clk", "rst_n", "se", "si[0]", "si[1]", "d"}) test.signals.push_back({name, true});
  for (const char* name : {"q", "so[0]", "so[1]"}) test.signals.push_back({name, false});
  test.chains = {{"c0", "si[0]", "so[0]", {"u.a", "u.b"}}, {"c1", "si[1]", "so[1]", {"u.c"}}};
  test.clock = "clk";
  test.reset = "rst_n";
  test.scan_enable = "se";
  test.idle_inputs = "010000";
  test.patterns = {{Action::none, {"01", "01"}, {"LH", "HX"}, "", "XXX", "chain test"},
                   {Action::reset, {"11", "01"}, {"LL", "LX"}, "", "XXX", "reset test"},
                   {Action::capture, {"10", "01"}, {"HL", "LX"}, "P10001", "LHX", "pattern 0"}};
  return test;
}

TEST(Stil, ANameThatCannotBeWrittenIsRefused) {
  CycleStream stream;
  stream.signals = {{"a", true}, {"net\"7", true}};
  EXPECT_THAT([&] { flat_stil_text(stream); }, testing::ThrowsMessage<UserError>(testing::HasSubstr(
                                                   "found a quote, expected none that STIL can't write")));
}

TEST(Stil, ReadsBackWhatItWrites) {
  const CycleStream stream = expand(small_test());
  EXPECT_EQ(stream.cycles.size(), 2u + 4u * 3u + 1u + 2u);
  EXPECT_TRUE(same_cycles(parse_stil(stil_text(small_test()), "a.stil"), stream));
  EXPECT_TRUE(same_cycles(parse_stil(flat_stil_text(stream), "b.stil"), stream));
}

TEST(Stil, ChainsAndLabelsSurvive) {
  const CycleStream stream = parse_stil(stil_text(small_test()), "a.stil");
  ASSERT_EQ(stream.chains.size(), 2u);
  EXPECT_EQ(stream.chains[0].cells, (std::vector<std::string>{"u.a", "u.b"}));
  EXPECT_EQ(std::count_if(stream.cycles.begin(), stream.cycles.end(),
                          [](const TestCycle& c) { return c.label == "pattern 0"; }),
            1);
  EXPECT_EQ(stream.cycles[0].label, "test_setup");  // the macro's name
  EXPECT_EQ(stream.cycles[1].label, "");
}

TEST(Stil, AnyChangedBitIsSeen) {
  std::string text = stil_text(small_test());
  const std::size_t at = text.find("=HLX");
  text.replace(text.find("\"so[0]\"=LH"), 10, "\"so[0]\"=LL");
  EXPECT_EQ(at, std::string::npos);
  EXPECT_FALSE(same_cycles(parse_stil(text, "a.stil"), expand(small_test())));
}

struct Defect {
  const char* name;
  const char* find;
  const char* put;
  const char* reason;
};

// Line of the first difference, counted from 1.
std::size_t line_of(const std::string& text, std::size_t at) {
  return static_cast<std::size_t>(
             std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n')) +
         1;
}

TEST(Stil, SeededDefectsAreRejectedWithLineAndReason) {
  const Defect defects[] = {
      {"undefined signal", "\"si[0]\"=01", "\"si[9]\"=01", "signal or group \"si[9]\""},
      {"undefined group", "\"_pi\"=P10001", "\"_px\"=P10001", "signal or group \"_px\""},
      {"undefined WaveformTable", "  W \"_default_WFT_\";\n  Macro", "  W \"_other_\";\n  Macro",
       "WaveformTable \"_other_\""},
      {"undefined procedure", "Call \"multiclock_capture\" {", "Call \"multiclock\" {",
       "procedure \"multiclock\""},
      {"undefined macro", "Macro \"test_setup\";\n  \"chain", "Macro \"setup\";\n  \"chain",
       "macro \"setup\""},
      {"undefined pattern", "PatList { \"_pattern_\"", "PatList { \"_p_\"", "pattern \"_p_\""},
      {"bad time", "Period '100ns'", "Period '100'", "time '100'"},
      {"edge behind the period", "'50ns' U", "'150ns' U", "an edge at"},
      {"bad waveform character", "\"_pi\"=P10001", "\"_pi\"=P100Q1", "waveform character Q"},
      {"bad character in scan data", "\"si[0]\"=01", "\"si[0]\"=0H", "waveform character H"},
      {"vector too short", "\"_pi\"=P10001", "\"_pi\"=P1000", "5 characters"},
      {"vector too long", "\"_po\"=LHX", "\"_po\"=LHXX", "4 characters"},
      {"load too long", "\"si[0]\"=01", "\"si[0]\"=011", "scan data of 3 bits"},
      {"unload too long", "\"so[0]\"=LH", "\"so[0]\"=LHL", "scan data of 3 bits"},
      {"unload too short", "\"so[0]\"=LH", "\"so[0]\"=L", "1 characters for \"so[0]\""},
      {"chain length", "ScanLength 2", "ScanLength 3", "2 cells in ScanChain"},
      {"inversion without a mark", "ScanInversion 0", "ScanInversion 1", "ScanInversion 1 and 0 marks"},
      {"mark without an inversion", "    ScanCells", "    ScanCells !", "ScanInversion 0 and 1 marks"},
      {"missing semicolon", "\"_po\"=LHX; }", "\"_po\"=LHX }", "vector data without an end"},
      {"missing brace", "ScanStructures {", "ScanStructures", "expected"},
      {"unknown statement", "Macro \"test_setup\";\n  \"chain", "Makro \"test_setup\";\n  \"chain",
       "\"Makro\""},
  };
  for (const Defect& defect : defects) {
    std::string text = stil_text(small_test());
    const std::size_t at = text.find(defect.find);
    ASSERT_NE(at, std::string::npos) << defect.name;
    text.replace(at, std::string(defect.find).size(), defect.put);
    try {
      parse_stil(text, "bad.stil");
      ADD_FAILURE() << defect.name << " was taken";
    } catch (const StilError& error) {
      EXPECT_THAT(error.what(), HasSubstr(defect.reason)) << defect.name;
      EXPECT_THAT(error.what(), HasSubstr("bad.stil:" + std::to_string(error.line()) + ":")) << defect.name;
      EXPECT_LE(error.line(), line_of(text, at) + 12) << defect.name << ": " << error.what();
    }
  }
}

TEST(Stil, AByteOrderMarkSaysNothing) {
  EXPECT_TRUE(
      same_cycles(parse_stil("\xEF\xBB\xBF" + stil_text(small_test()), "a.stil"), expand(small_test())));
  const TestFolder folder;
  folder.file("part.stil", "\xEF\xBB\xBF" + stil_text(small_test()));
  EXPECT_TRUE(
      same_cycles(read_stil(folder.file("whole.stil", "\xEF\xBB\xBFSTIL 1.0;\nInclude \"part.stil\";\n")),
                  expand(small_test())));
}

// A number that is too large is told as that, where it stands.
TEST(Stil, LimitsAreToldAsWhatTheyAre) {
  const std::string text = R"(STIL 1.0; Signals { a In; }
Timing { WaveformTable t { Period '100ns'; Waveforms { a { 01 { '0ns' D/U; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
ScanStructures { ScanChain c {
ScanLength 1; } } Pattern main { W t;
Loop 4000000000 { V { a=0; } }
V { a=\r1 1; } })";
  EXPECT_EQ(cycle_count(parse_stil(text, "a.stil")), 4'000'000'001U);
  const auto refused = [&](const std::string& find, const std::string& put, const std::string& said) {
    std::string bad = text;
    bad.replace(bad.find(find), find.size(), put);
    EXPECT_THAT([&] { parse_stil(bad, "a.stil"); }, testing::ThrowsMessage<StilError>(HasSubstr(said)));
  };
  const std::string most = ", expected a whole number of at most 10000000000";
  refused("4000000000", "40000000000", "a.stil:6:6: found Loop \"40000000000\"" + most);
  refused("4000000000", "-4", "a.stil:6:6: found Loop \"-4\"" + most);
  refused("ScanLength 1", "ScanLength 99999999999", "a.stil:5:12: found ScanLength \"99999999999\"" + most);
  for (const char* count : {"4000000000", "99999999999999999999999"})
    refused(
        "\\r1", "\\r" + std::string(count),
        "a.stil:7:5: found more characters behind \\r than this program takes, expected at most 100000000");
}

// IEEE 1450: one of them is chosen, outside of the file.
TEST(Stil, ASecondPatternExecIsRefused) {
  const std::string text = R"(STIL 1.0; Signals { a In; }
Timing { WaveformTable t { Period '100ns'; Waveforms { a { 01 { '0ns' D/U; } } } } }
PatternBurst p { PatList { main; } }
Pattern main { W t; V { a=0; } }
PatternExec { PatternBurst p; }
)";
  EXPECT_EQ(parse_stil(text, "a.stil").cycles.size(), 1U);
  EXPECT_THAT(
      [&] { parse_stil(text + " PatternExec \"x\" { PatternBurst p; }", "a.stil"); },
      testing::ThrowsMessage<StilError>(HasSubstr("a.stil:6:2: found a second PatternExec, expected one")));
  std::string twice = text;
  twice.insert(twice.rfind('}'), "\nPatternBurst p; ");
  EXPECT_THAT([&] { parse_stil(twice, "a.stil"); },
              testing::ThrowsMessage<StilError>(HasSubstr(
                  "a.stil:6:1: found a second PatternBurst \"p\" in the PatternExec, expected one")));
}

TEST(Stil, EventsMayHaveTheirLongNames) {
  const std::string text = R"(STIL 1.0; Signals { a In; y Out; }
Timing { WaveformTable t { Period '100ns'; Waveforms { a { 01 { '0ns' D/U; } } y { LHX { '40ns' L/H/X; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Pattern main { W t; V { a=0; y=L; } V { a=1; y=X; } })";
  std::string named = text;
  named.replace(named.find("D/U"), 3, "ForceDown/ForceUp");
  named.replace(named.find("L/H/X"), 5, "CompareLow/CompareHigh/CompareUnknown");
  EXPECT_TRUE(same_cycles(parse_stil(named, "a.stil"), parse_stil(text, "a.stil")));
  named.replace(named.find("CompareHigh"), 11, "CompareHighs");
  EXPECT_THROW(parse_stil(named, "a.stil"), StilError);
}

// IEEE 1450-1999, 6.10: "q[3..0]" stands for four signals.
TEST(Stil, RangesAreSignals) {
  const std::string text =
      R"(STIL 1.0; Signals { q[1..0] In; y[0..1] Out; } SignalGroups { g = 'q[0..1] + y[0]'; }
Timing { WaveformTable t { Period '100ns'; Waveforms { q[0..1] { 01 { '0ns' D/U; } }
y[0..1] { LHX { '40ns' L/H/X; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Pattern main { W t; V { q[1..0]=01; y[0..1]=LH; } V { g=01H; } })";
  const CycleStream read = parse_stil(text, "a.stil");
  ASSERT_EQ(read.signals.size(), 4U);
  EXPECT_EQ(read.signals[0].name, "q[1]");
  ASSERT_EQ(read.cycles.size(), 2U);
  EXPECT_EQ(read.cycles[0].states, "01LH");
  EXPECT_EQ(read.cycles[1].states, "10HH");
  std::string other = text;
  std::string endless = text;
  endless.replace(endless.find("q[1..0] In"), 10, "q[999999..0] In");
  EXPECT_THAT([&] { parse_stil(endless, "a.stil"); },
              testing::ThrowsMessage<StilError>(HasSubstr("found more signals than this program takes")));
  other.replace(other.find("g=01H"), 5, "q[2..1]=01");
  EXPECT_THAT([&] { parse_stil(other, "a.stil"); }, testing::ThrowsMessage<StilError>(HasSubstr("\"q[2]\"")));
}

// IEEE 1450-1999, 6.16: wherever a signal or group may stand, a quoted expression may.
TEST(Stil, AnExpressionStandsForItsSignals) {
  const std::string text =
      R"(STIL 1.0; Signals { "1" In; "2" In; clk_i In; o Out; } SignalGroups { pi = '"1" + "2" + clk_i'; }
Timing { WaveformTable t { Period '100ns'; Waveforms { 'pi-clk_i' { 01 { '0ns' D/U; } }
clk_i { 01 { '0ns' D/U; } } 'o' { LHX { '40ns' L/H/X; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Procedures { q { W t; V { '"2"+clk_i'=##; 'o'=#; } } }
Pattern main { W t; C { 'pi - "1"'=00; } V { '"1"+o'=1L; } V { 'o + clk_i + "1"+"2"'=H101; }
F { 'pi-"1"-"2"'=1; } Call q { '"2"'=0; 'clk_i+o'=1X; } })";
  const CycleStream read = parse_stil(text, "a.stil");
  std::string states;
  for (const TestCycle& cycle : read.cycles) states += cycle.states + " ";
  EXPECT_EQ(states, "100L 011H 001X ");
  const auto refused = [&](const std::string& find, const std::string& put, const std::string& said) {
    std::string bad = text;
    bad.replace(bad.find(find), find.size(), put);
    EXPECT_THAT([&] { parse_stil(bad, "a.stil"); }, testing::ThrowsMessage<StilError>(HasSubstr(said)));
  };
  refused("'pi-clk_i' {", "'pi-clk' {", "a.stil:2:56: found signal or group \"clk\", expected one that is");
  refused("'\"1\"+o'=1L", "'\"1\"+o'=1", "a.stil:6:46: found 1 characters for \"'\"1\"+o'\", expected 2");
  refused("'pi-clk_i' {", "'pi-pi' {", "a.stil:2:56: found no signal in 'pi-pi', expected at least one");
}

// What would take all memory, all time or the stack is refused.
TEST(Stil, LimitsHold) {
  const std::string head = R"(STIL 1.0; Signals { a In; y Out; } SignalGroups { g = 'a'; }
Timing { WaveformTable t { Period '100ns'; Waveforms { a { 01 { '0ns' D/U; } } y { LHX { '40ns' L/H/X; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
)";
  const auto refuses = [](const std::string& text, const std::string& message) {
    try {
      parse_stil(text, "a.stil", 1000);
      ADD_FAILURE() << "was taken: " << text.substr(0, 400);
    } catch (const StilError& error) {
      EXPECT_THAT(error.what(), HasSubstr(message));
    }
  };
  std::string deep;
  for (int i = 0; i < 30000; ++i) deep += "Loop 2 { ";
  refuses(head + "Pattern main { " + deep, "statements 17 deep, expected at most 16");
  refuses(head + "Pattern main { W t; V { a=0; y=X; } Loop 1000 { V { a=1; } V { a=0; } } }", "more cycles");
  refuses(head + "Pattern main { W t; Loop 99999 { C { a=1; } Loop 99999 { C { a=0; } } } }",
          "more statements");
  refuses(head + "Procedures { q { Loop 99999 { C { a=1; } } } } Pattern main { W t; Call q; }",
          "more statements");
  refuses(head +
              "Pattern main { W t; V { a=\\r9999999 0 \\r9999999 0 \\r9999999 0 \\r9999999 0 \\r9999999 0 "
              "\\r9999999 0 \\r9999999 0 \\r9999999 0 \\r9999999 0 \\r9999999 0 \\r9999999 0; } }",
          "more characters behind \\r");
  std::string doubled = "SignalGroups { g0 = 'a'; ";
  for (int i = 1; i < 40; ++i)
    doubled +=
        "g" + std::to_string(i) + " = 'g" + std::to_string(i - 1) + " + g" + std::to_string(i - 1) + "'; ";
  refuses(head + doubled + "}", "a group of more signals");
  refuses(head + "Signals { b In; }", "Signals after Timing");
  refuses("STIL 1.0; Signals { \"a;b c\" In; }", "a.stil:1:21: found signal \"a;b c\"");
  refuses("STIL 1.0; Signals { \"\x1b[31m\" In; }", "found signal \"\\x1B[31m\"");
  for (const char* time : {"inf", "nan", "1e999", "-1", "0x10", ""})
    refuses("STIL 1.0; Timing { WaveformTable t { Period '" + std::string(time) + "ns'; } }",
            "expected numbers with");
  refuses("STIL 9.9;", "a.stil:1:6: found version 9.9, expected STIL 1.0");
  EXPECT_THROW(parse_stil("", "a.stil"), StilError);
}

std::string with(std::string text, const std::string& find, const std::string& put) {
  std::size_t at = text.find(find);
  EXPECT_NE(at, std::string::npos) << find;
  for (; at != std::string::npos; at = text.find(find, at + put.size())) text.replace(at, find.size(), put);
  return text;
}

// What a cycle of a stream can't say is told with its line, by lint and by whoever runs the file.
TEST(Stil, TimingOfAnotherOrderOrShapeIsTold) {
  struct Change {
    const char *find, *put, *said, *place;
  };
  const char *const high = "H { '0ns'", *const low = "L { '0ns'", *const pulse = "P { '", *const up = "1 { ";
  const Change changes[] = {
      {"'40ns'", "'90ns'",
       "waveform L of \"so[0]\": compared at 90 ns, expected it before the clock's pulse (waveform P of "
       "\"clk\": 50 ns)",
       low},
      {"'40ns'", "'50ns'", "compared at 50 ns, expected it before the clock's pulse", low},
      {"'40ns' H", "'40ns' h", "compared at 100 ns, expected it before the clock's pulse", high},
      {"{ '0ns' U; }", "{ '40ns' U; }",
       "compared at 40 ns, expected it behind the last drive edge (waveform 1 of \"rst_n\": 40 ns)", low},
      {"{ '0ns' U; }", "{ '60ns' U; }",
       "waveform 1 of \"rst_n\": driven at 60 ns, expected it before the clock's pulse", up},
      {"'0ns' D; '50ns' U; '80ns' D;", "'0ns' U; '50ns' D; '80ns' U;",
       "waveform P of \"clk\": U at 0 ns, D at 50 ns, U at 80 ns, expected one pulse: D, U, D", pulse},
      {"'80ns' D;", "'80ns' D; '85ns' U; '90ns' D;", "D at 80 ns, U at 85 ns, D at 90 ns, expected one pulse",
       pulse},
      {"1 { '0ns' U; }", "1 { '0ns' U; '20ns' D; }",
       "\"rst_n\": U at 0 ns, D at 20 ns, expected the high level, U, or one pulse", up},
      {"1 { '0ns' U; }", "1 { }", "waveform 1 of \"rst_n\": no event, expected the high level", up},
      {"'40ns' H;", "'30ns' L; '40ns' H;", "X at 0 ns, L at 30 ns, H at 40 ns, expected one strobe", high},
  };
  for (const Change& change : changes) {
    const std::string text = with(stil_text(small_test()), change.find, change.put);
    const CycleStream stream = parse_stil(text, "a.stil");
    const auto told = testing::Contains(testing::AllOf(
        testing::StartsWith("a.stil:" + std::to_string(line_of(text, text.find(change.place))) +
                            ":15: found"),
        HasSubstr(change.said)));
    EXPECT_THAT(stream.timing_defects, told) << change.put;
    EXPECT_THAT(lint(stream, {}), told) << change.put;
    EXPECT_THROW(require_runnable(stream), UserError) << change.put;
  }
}

// 0, 1, P, H, L and X do what they say; others what their events do. Those that no cycle has may do anything.
TEST(Stil, CharactersMeanTheirEvents) {
  const std::string good = stil_text(small_test());
  const CycleStream stream = expand(small_test());
  const auto defect = [&](const std::string& find, const std::string& put) {
    const std::vector<std::string> told = parse_stil(with(good, find, put), "a.stil").timing_defects;
    return told.empty() ? std::string() : told[0];
  };
  EXPECT_THAT(defect("0 { '0ns' D; }", "0 { '0ns' U; }"),
              HasSubstr("a.stil:28:15: found waveform 0 of \"clk\": U at 0 ns, expected the low level, D"));
  EXPECT_THAT(defect("1 { '0ns' U; }", "1 { '0ns' D; }"),
              HasSubstr("expected the high level, U, or one pulse"));
  EXPECT_THAT(defect("P { '0ns' D; '50ns' U; '80ns' D; }", "P { '0ns' D; }"),
              HasSubstr("expected one pulse: D"));
  EXPECT_THAT(defect("'40ns' H;", "'40ns' L;"),
              HasSubstr("of \"so[1]\": X at 0 ns, L at 40 ns, expected one strobe, H"));
  EXPECT_THAT(defect("'40ns' L;", "'40ns' X;"), HasSubstr("expected one strobe, L"));
  EXPECT_THAT(defect("X { '0ns' X; }", "X { '40ns' L; }"), HasSubstr("expected no strobe"));
  // the driver of the tester's pin goes off before the strobe, as of a pin of both directions; not behind it
  EXPECT_EQ(parse_stil(with(good, "X { '0ns' X; }", "X { '0ns' Z; }"), "a.stil").timing_defects,
            std::vector<std::string>{});
  EXPECT_EQ(defect("H { '0ns' X; '40ns' H; }", "H { '0ns' Z; '40ns' H; }"), "");
  EXPECT_THAT(defect("H { '0ns' X; '40ns' H; }", "H { '0ns' X; '40ns' H; '45ns' Z; }"),
              HasSubstr("expected one strobe, H"));

  const std::string letters =
      with(with(good, "'40ns' L; } }",
                "'40ns' L; } }\n\"_clk\" { 1 { '0ns' D; '50ns' U; '80ns' D; } A { '0ns' U; '9ns' D; } }\n"
                "\"_pi\" { ab { '0ns' D/U; } } \"_po\" { cd { '0ns' X; '40ns' l/h; '45ns' X; } }"),
           "\"_pi\"=P10001; \"_po\"=LHX;", "\"_pi\"=1b0aab; \"_po\"=cdX;");
  EXPECT_EQ(parse_stil(letters, "a.stil").timing_defects, std::vector<std::string>());
  EXPECT_TRUE(same_cycles(parse_stil(letters, "a.stil"), stream));
}

TEST(Stil, WithoutAClockNoneIsNamed) {
  const std::string text = R"(STIL 1.0; Signals { a In; y Out; }
Timing { WaveformTable t { Period '20ns'; Waveforms { a { 01 { '5ns' D/U; } }
y { LH { '3ns' L/H; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Pattern main { W t; V { a=0; y=L; } V { a=1; y=H; } })";
  const CycleStream stream = parse_stil(text, "a.stil");
  EXPECT_THAT(
      lint(stream, {}),
      testing::ElementsAre("a.stil:3:5: found waveform L of \"y\": compared at 3 ns, expected it behind "
                           "the last drive edge (waveform 0 of \"a\": 5 ns)"));
  EXPECT_TRUE(lint(parse_stil(with(text, "'3ns'", "'15ns'"), "a.stil"), {}).empty());
}

// A strobe for high impedance was none, without a word.
TEST(Stil, AStrobeForHighImpedanceIsNotRun) {
  const std::string text = R"(STIL 1.0; Signals { a In; y Out; }
Timing { WaveformTable t { Period '20ns'; Waveforms { a { 01 { '0ns' D/U; } }
y { LHT { '13ns' L/H/T; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Pattern main { W t; V { a=0; y=L; } V { a=1; y=T; } })";
  EXPECT_THAT([&] { require_runnable(parse_stil(text, "a.stil")); },
              testing::ThrowsMessage<UserError>(HasSubstr("cycle 1: found T on y, expected H, L or X")));
  EXPECT_NO_THROW(require_runnable(parse_stil(with(text, "y=T", "y=H"), "a.stil")));
}

TEST(Cycles, TooManyToUnrollAreRefused) {
  CycleStream stream;
  stream.signals = {{"a", true}};
  stream.cycles = {{"0", "", kMostCounted}};
  EXPECT_THROW(unrolled(stream), UserError);
}

// An annotation says nothing, wherever it stands; the block behind it counts.
TEST(Stil, AnnotationsMayStandAnywhere) {
  const std::string plain = R"(STIL 1.0;
@Signals { @a In; b In; y Out; }
@SignalGroups { @all = 'a + b + y'; }
@Timing { @WaveformTable t { @Period '100ns'; @Waveforms { @a { 01 { @'0ns' D/U; } } b { 01 { '0ns' D/U; } }
  y { LHX { '40ns' L/H/X; } } } } }
@ScanStructures { @ScanChain c { @ScanLength 1; ScanIn a; ScanOut y; ScanCells f; } }
@PatternBurst p { @PatList { @main; } }
@PatternExec { @PatternBurst p; }
@Pattern main { @W t; @V { @all = 01H; } @Stop; } @)";
  const auto with = [&](const std::string& note) {
    std::string text = plain;
    for (auto at = text.find('@'); at != std::string::npos; at = text.find('@')) text.replace(at, 1, note);
    return parse_stil(text, "a.stil");
  };
  const CycleStream stream = with("");
  ASSERT_EQ(stream.chains.size(), 1U);
  for (const char* note : {"Ann {* of the {core} *} ", "Ann{**} ", "Ann\n{* a *}\nAnn {* b *}\n"}) {
    const CycleStream annotated = with(note);
    EXPECT_TRUE(same_cycles(annotated, stream)) << note;
    ASSERT_EQ(annotated.chains.size(), 1U) << note;
    EXPECT_EQ(annotated.chains[0].cells, stream.chains[0].cells) << note;
  }
}

// As on Windows, and with tabs.
TEST(Stil, NamesEndAtAnyBlank) {
  const CycleStream stream = parse_stil(
      "STIL 1.0;\r\nSignals { a In; b In; y Out; }\r\nSignalGroups { all = 'a\r\n+\tb\t+ y'; }\r\nTiming { "
      "WaveformTable t { "
      "Period '100ns'; Waveforms { a { 01 { '0ns' D/U; } } b { 01 { '0ns' D/U; } } y { LHX { '40ns' L/H/X; } "
      "} } } }\r\n"
      "PatternBurst p { PatList { main; } }\r\nPatternExec { PatternBurst p; }\r\nPattern main { W t; V { "
      "all = 01H; } }\r\n",
      "a.stil");
  EXPECT_EQ(stream.cycles.at(0).states, "01H");
}

TEST(Stil, OtherShapes) {
  const char* text = R"(STIL 1.0;
Signals { a In; b In; y Out; }
SignalGroups { all = 'a + b + y'; ins = 'all - y'; }
Timing { WaveformTable t { Period '0.1us'; Waveforms {
  ins { 01 { '0ns' D/U; } } y { LHX { '40ns' L/H/X; } } } } }
PatternBurst p { PatList { main; } }
PatternExec { PatternBurst p; }
Pattern main { W t; Loop 3 { V { all = 01H; } } V { a=1; } {* a comment *} Stop; })";
  const CycleStream stream = unrolled(parse_stil(text, "c.stil"));
  ASSERT_EQ(stream.cycles.size(), 4u);
  EXPECT_EQ(stream.cycles[3].states, "11H");
  EXPECT_EQ(stream.timing.period_ns, 100);
  EXPECT_EQ(stream.timing.strobe_ns, 40);
}

// A file of one input and one output, with more blocks and a pattern.
std::string one_pin(const std::string& blocks, const std::string& burst, const std::string& pattern) {
  return R"(STIL 1.0; Signals { a In; y Out; }
Timing { WaveformTable t { Period '100ns'; Waveforms { a { 01 { '0ns' D/U; } } y { LHX { '40ns' L/H/X; } } } } }
)" + blocks +
         "\nPatternBurst p { " + burst + " } PatternExec { PatternBurst p; }\nPattern main { W t; " +
         pattern + " }";
}

std::string states_of(const CycleStream& stream) {
  std::string states;
  for (const TestCycle& cycle : unrolled(stream).cycles) states += cycle.states + " ";
  return states;
}

std::string refusal(const std::string& text) {
  try {
    parse_stil(text, "a.stil");
  } catch (const StilError& error) {
    return error.what();
  }
  return "taken";
}

TEST(Stil, StopEndsTheExecution) {
  const auto played = [](const std::string& pattern) {
    return states_of(parse_stil(one_pin("Procedures { r { W t; V { a=1; y=H; } Stop; V { a=0; y=L; } } }",
                                        "PatList { main; }", pattern),
                                "a.stil"));
  };
  EXPECT_EQ(played("V { a=0; y=L; } Stop; V { a=1; y=H; }"), "0L ");
  EXPECT_EQ(played("Loop 3 { V { a=0; y=L; } V { a=1; y=H; } Stop; } V { a=1; y=H; }"), "0L 1H ");
  EXPECT_EQ(played("Call r; V { a=1; y=H; }"), "1H ");
  EXPECT_EQ(played("V { a=0; y=L; } BreakPoint; Ann {* a note *} IddqTestPoint; V { a=1; y=H; }"), "0L 1H ");
  // whether Stop ends the pattern or all that is executed is then not for this program to say
  EXPECT_THAT(refusal(one_pin("Pattern more { W t; V { a=1; y=H; } }", "PatList { main; more; }",
                              "V { a=0; y=L; } Stop;")),
              HasSubstr("a.stil:5:37: found a Stop with pattern \"more\" still to come"));
}

TEST(Stil, NamedBlocksOfProceduresAreChosenByTheBurst) {
  const std::string blocks =
      "Procedures one { r { W t; V { a=0; y=L; } } } Procedures two { r { W t; V { a=1; y=H; } } }\n"
      "MacroDefs m { s { W t; V { a=0; y=X; } } } MacroDefs n { s { W t; V { a=1; y=X; } } }";
  const std::string pattern = "Call r; Macro s;";
  EXPECT_EQ(states_of(parse_stil(one_pin(blocks, "Procedures one; MacroDefs n; PatList { main; }", pattern),
                                 "a.stil")),
            "0L 1X ");
  EXPECT_EQ(states_of(parse_stil(
                one_pin(blocks, "Procedures one; MacroDefs m; PatList { main { Procedures two; } }", pattern),
                "a.stil")),
            "1H 0X ");
  EXPECT_THAT(refusal(one_pin(blocks, "MacroDefs n; PatList { main; }", pattern)),
              HasSubstr("found procedure \"r\" in more than one named block, expected one that the "
                        "PatternBurst chooses"));
  EXPECT_THAT(refusal(one_pin(blocks, "Procedures three; PatList { main; }", pattern)),
              HasSubstr("Procedures \"three\""));
  // a block without a name is there for all, the only one of a name too
  EXPECT_EQ(states_of(parse_stil(one_pin("Procedures { r { W t; V { a=0; y=L; } } } MacroDefs m { s { W t; "
                                         "V { a=1; y=X; } } }",
                                         "PatList { main; }", pattern),
                                 "a.stil")),
            "0L 1X ");
}

TEST(Stil, NothingIsDefinedTwiceInSilence) {
  const auto twice = [](const std::string& blocks) {
    return refusal(one_pin(blocks, "PatList { main; }", "V { a=0; y=L; }"));
  };
  EXPECT_THAT(twice("Pattern main { W t; V { a=1; y=H; } }"), HasSubstr("found pattern \"main\" again"));
  EXPECT_THAT(twice("PatternBurst p { PatList { main; } }"), HasSubstr("found PatternBurst \"p\" again"));
  EXPECT_THAT(twice("SignalGroups x { g = 'a'; } SignalGroups z { g = 'y'; }"),
              HasSubstr("found group \"g\" again with other signals"));
  EXPECT_THAT(twice("SignalGroups x { g = 'a'; } SignalGroups z { g = 'a'; }"), HasSubstr("taken"));
  EXPECT_THAT(twice("Procedures { r { W t; } } Procedures { r { V { a=1; y=H; } } }"),
              HasSubstr("found procedure \"r\" again"));
  EXPECT_THAT(twice("Timing z { WaveformTable t { Period '50ns'; Waveforms { a { 01 { '0ns' D/U; } } } } }"),
              HasSubstr("found WaveformTable \"t\" again"));
}

TEST(Stil, FixedSignalsStayAsTheyAre) {
  const auto told = [](const std::string& pattern) {
    return refusal(one_pin("Procedures { r { W t; F { a=1; } V { y=H; } } }", "PatList { main; }", pattern));
  };
  EXPECT_EQ(told("F { a=0; } V { y=L; } V { a=0; y=X; }"), "taken");
  EXPECT_THAT(told("F { a=0; } V { y=L; } V { a=1; y=X; }"),
              HasSubstr("found waveform character 1 for \"a\", expected the 0 that an F statement keeps"));
  EXPECT_EQ(told("Call r; V { a=0; y=X; }"), "taken");  // kept to the end of its block
}

TEST(Stil, UnknownWordsAreRefused) {
  const std::string good =
      "ScanStructures { ScanChain c { ScanLength 1; ScanIn a; ScanOut y; ScanInversion 0; "
      "ScanMasterClock a; ScanSlaveClock a; ScanOutLength 1; } }";
  const auto told = [](const std::string& blocks, const std::string& burst) {
    return refusal(one_pin(blocks, burst + " PatList { main; }", "V { a=0; y=L; }"));
  };
  EXPECT_EQ(told(good, ""), "taken");
  std::string wrong = good;
  wrong.replace(wrong.find("ScanInversion"), 13, "ScanInverting");
  EXPECT_THAT(told(wrong, ""), HasSubstr("a.stil:3:67: found \"ScanInverting\""));
  EXPECT_EQ(told("", "SignalGroups g; ScanStructures s; Start main; Termination { a TerminateHigh; }"),
            "taken");
  EXPECT_THAT(told("", "PatSet { main; }"), HasSubstr("found \"PatSet\""));
}

TEST(Stil, TimesMayBeSumsWithBlanks) {
  const auto period = [](const std::string& time) {
    return parse_stil(with(one_pin("", "PatList { main; }", "V { a=0; y=L; }"), "'100ns'", time), "a.stil")
        .timing.period_ns;
  };
  EXPECT_EQ(period("'100 ns'"), 100);
  EXPECT_EQ(period("' 50ns + 0.05 us '"), 100);
  EXPECT_EQ(period("'0.2us-100ns'"), 100);
  EXPECT_EQ(period("'1e-1us'"), 100);
  for (const char* bad : {"''", "'ns'", "'50ns+'", "'+50ns'", "'50ns 50ns'", "'t0+50ns'"})
    EXPECT_THROW(period(bad), StilError) << bad;
}

TEST(Stil, WaveformTablesOfOnePeriodMayTakeTurns) {
  const auto text = [](const std::string& period) {
    return one_pin("Timing z { WaveformTable u { Period '" + period +
                       "'; Waveforms { a { ab { '0ns' D/U; } } y { cdX { '40ns' L/H/X; } } } } }",
                   "PatList { main; }", "V { a=0; y=L; } W u; V { a=b; y=d; } W t; V { a=0; y=X; }");
  };
  EXPECT_EQ(states_of(parse_stil(text("100ns"), "a.stil")), "0L 1H 0X ");
  EXPECT_THAT(refusal(text("50ns")),
              HasSubstr("found WaveformTable \"u\" with a period of 50 ns, expected the "
                        "100 ns of the one before"));
}

TEST(Stil, IncludedFilesAreRead) {
  const TestFolder folder;
  const auto write = [&](const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder.path() / name).parent_path());
    std::ofstream(folder.path() / name) << text;
  };
  const auto told = [&] {
    try {
      return states_of(read_stil(folder.path() / "a.stil"));
    } catch (const UserError& error) {
      return std::string(error.what());
    }
  };
  const std::string text = one_pin("Include \"lib/procedures.stil\";", "PatList { main; }", "Call r;");
  write("a.stil", text);
  EXPECT_THAT(told(), HasSubstr("procedures.stil"));
  EXPECT_THAT(told(), HasSubstr("a.stil:3:9: "));
  write("lib/procedures.stil", "STIL 1.0;\nInclude \"more.stil\" IfNeed;\n");
  write("lib/more.stil", "Procedures { r { W t; V { a=1; y=H; } } }");
  EXPECT_EQ(told(), "1H ");
  write("lib/more.stil", "Procedures {\n r { W t; V { a=2; y=H; } } }");
  EXPECT_THAT(told(), HasSubstr("more.stil:2:15: found waveform character 2"));
  write("lib/more.stil", "Procedures { r { W t;");
  EXPECT_THAT(told(), HasSubstr("more.stil:1:18: found a block left open"));
  write("lib/more.stil", "Include \"more.stil\";");
  EXPECT_THAT(told(), HasSubstr("more.stil:1:9: found Include of \"more.stil\" from within itself"));
  EXPECT_THAT(refusal(text), HasSubstr("a.stil:3:9: found Include \"lib/procedures.stil\""));
}

// The shape of TetraMAX since 2011: a table a procedure, of one period; cells in braces; inputs that are left
// open; attributes; an entry with a block of its own.
TEST(Stil, TetraMaxShape) {
  const std::string table = R"({ Period '100ns'; Waveforms {
   "all_inputs" { 0 { '0ns' D; } } "all_inputs" { 1 { '0ns' U; } } "all_inputs" { N { '0ns' N; } }
   "all_outputs" { X { '0ns' X; '40ns' X; } } "all_outputs" { H { '0ns' X; '40ns' H; } }
   "all_outputs" { L { '0ns' X; '40ns' L; } } "CK" { P { '0ns' D; '45ns' U; '55ns' D; } } } })";
  const std::string text = R"(STIL 1.0 { Design 2005; }
Header { Title "scan"; History { Ann {* some *} } }
Signals { "CK" In; "d" In; "si" In { ScanIn; } "se" In; "q" Out; "so" Out { ScanOut; } }
SignalGroups { "all_inputs" = '"CK" + "d" + "si" + "se"'; "all_outputs" = '"q" + "so"';
  "_si" = '"si"' { ScanIn; } "_so" = '"so"' { ScanOut; } "_clk" = '"CK"'; }
Timing { WaveformTable "_multiclock_capture_WFT_" )" +
                           table + R"( WaveformTable "_default_WFT_" )" + table + R"( }
ScanStructures { ScanChain "1" { ScanLength 2; ScanIn "si"; ScanOut "so"; ScanInversion 1;
   ScanCellType { CellIn "SD"; CellOut "Q"; }
   ScanCells { "top.a_reg" ; ! "top.b_reg" ; } ScanMasterClock "CK" ; } }
PatternBurst "_burst_" { PatList { "_pattern_" {
 }
}}
PatternExec { PatternBurst "_burst_"; }
Procedures {
  "multiclock_capture" { W "_multiclock_capture_WFT_"; C { "all_inputs"=0NNN; "all_outputs"=XX; }
    V { "all_inputs"=####; "all_outputs"=##; } }
  "load_unload" { W "_default_WFT_"; C { "all_inputs"=0NNN; "all_outputs"=XX; }
    "Internal_scan_pre_shift": V { "se"=1; }
    Shift { W "_default_WFT_"; V { "_clk"=P; "_si"=#; "_so"=#; } } } }
MacroDefs { "test_setup" { W "_default_WFT_"; C { "all_inputs"=NNNN; "all_outputs"=XX; } V { "CK"=0; } V { } } }
Pattern "_pattern_" { W "_multiclock_capture_WFT_";
  "precondition all Signals": C { "all_inputs"=0000; "all_outputs"=XX; }
  Macro "test_setup";
  "pattern 0": Call "load_unload" { "si"=01; }
  Call "multiclock_capture" { "all_inputs"=P100; "all_outputs"=LX; }
  "end 0 unload": Call "load_unload" { "so"=LH; } })";
  const CycleStream stream = parse_stil(text, "a.stil");
  EXPECT_EQ(states_of(stream), "0NNNXX 0NNNXX 0NN1XX PN01XX PN11XX P100LX 0NN1XX PNN1XL PNN1XH ");
  EXPECT_EQ(stream.chains[0].cells, (std::vector<std::string>{"top.a_reg", "top.b_reg"}));
  EXPECT_EQ(stream.chains[0].inversions, std::vector<std::size_t>{1});
  EXPECT_THAT(refusal(with(text, "'\"si\"' { ScanIn; }", "'\"si\"' { Base Hex 01; }")),
              HasSubstr("found \"Base\""));
}

std::string with_procedure(const std::string& procedure, const std::string& pattern) {
  return R"(STIL 1.0; Signals { a In; b In; y Out; } SignalGroups { i = 'a + b'; }
Timing { WaveformTable w { Period '100ns'; Waveforms { i { 01 { '0ns' D/U; } } y { LHX { '40ns' L/H/X; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Procedures { c { W w; )" +
         procedure + " } }\nPattern main { W w; " + pattern + " }";
}

// Vectors that are shifted by no data would be lost without a word.
TEST(Stil, AShiftWithoutDataIsRefused) {
  const std::string vectors = "V { i=11; y=H; } Shift { V { i=01; y=H; } }";
  EXPECT_THAT(refusal(with_procedure("V { i=00; y=L; }", vectors)), HasSubstr("found a Shift without data"));
  EXPECT_THAT(refusal(with_procedure(vectors, "Call c;")), HasSubstr("found a Shift without data"));
  EXPECT_THAT(refusal(with_procedure("Shift { V { i=0#; y=X; } }", "Call c;")),
              HasSubstr("found a Shift without data"));
}

TEST(Stil, DataOfAGroupMayBeOfSeveralVectors) {
  EXPECT_EQ(
      states_of(parse_stil(with_procedure("V { i=##; y=X; } V { i=##; y=H; }", "Call c { i=0110; }"), "a")),
      "01X 10H ");
  EXPECT_THAT(refusal(with_procedure("V { i=##; y=X; }", "Call c { i=011; }")),
              HasSubstr("3 characters for \"i\""));
}

// "%" shows the next character and leaves it there.
TEST(Stil, DataMayBeShownWithoutBeingTaken) {
  EXPECT_EQ(states_of(parse_stil(
                with_procedure("V { a=%; b=0; y=X; } V { a=%; b=1; y=#; }", "Call c { a=1; y=H; }"), "a")),
            "10X 11H ");
  EXPECT_THAT(refusal(with_procedure("V { a=%; b=0; y=X; }", "Call c { a=10; }")),
              HasSubstr("2 characters for \"a\""));
}

// A character stays over a W, and the new table says what it does.
TEST(Stil, ACharacterMeansWhatThePresentTableSays) {
  const auto with_tables = [](const std::string& second, const std::string& pattern) {
    return R"(STIL 1.0; Signals { a In; y Out; } Timing {
WaveformTable v { Period '100ns'; Waveforms { a { 01 { '0ns' D/U; } } y { AX { '40ns' H/X; } } } }
WaveformTable w { Period '100ns'; Waveforms { a { 01 { '0ns' D/U; } } y { )" +
           second + R"( } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Procedures { c { W w; V { a=0; y=X; } } }
Pattern main { )" +
           pattern + " }";
  };
  const std::string low = "AX { '40ns' L/X; }", none = "X { '40ns' X; }";
  EXPECT_EQ(states_of(parse_stil(with_tables(low, "W v; V { a=1; y=A; } W w; V { a=1; }"), "a")), "1H 1L ");
  EXPECT_THAT(refusal(with_tables(none, "W v; V { a=1; y=A; } W w; V { a=1; }")),
              HasSubstr("found waveform character A for \"y\", expected one that its WaveformTable defines"));
  EXPECT_EQ(states_of(parse_stil(with_tables(none, "W v; V { a=1; y=A; } W w; V { y=X; }"), "a")), "1H 1X ");
}

// Some tools go on behind a Call as before it, others as it ends.
TEST(Stil, WhatACallLeavesHasToBeSaid) {
  const std::string procedure = "V { a=0; b=0; y=X; }";
  const auto refused = [&](const std::string& pattern) {
    return refusal(with_procedure(procedure, pattern));
  };
  EXPECT_THAT(refused("V { a=1; b=0; y=H; } Call c; V { y=H; }"),
              HasSubstr("found no value of \"a\" since a Call that changes it"));
  EXPECT_EQ(
      states_of(parse_stil(with_procedure(procedure, "V { a=1; b=0; y=H; } Call c; V { a=1; y=H; }"), "a")),
      "10H 00X 10H ");
  EXPECT_EQ(states_of(parse_stil(with_procedure(procedure, "Call c; V { y=H; }"), "a")), "00X 00H ");
}

TEST(Stil, CommentsInDataAreNone) {
  EXPECT_EQ(states_of(parse_stil(with_procedure("V { i=00; y=X; }", "V { i=0 // one; two\n 1; y=H; }"), "a")),
            "01H ");
}

TEST(Stil, ABurstInABurstIsNamed) {
  EXPECT_THAT(
      refusal(R"(STIL 1.0; Signals { a In; } PatternBurst q { PatList { main; } }
PatternBurst p { PatList { q; } } PatternExec { PatternBurst p; } Pattern main { })"),
      HasSubstr(
          "found PatternBurst \"q\", expected a pattern that is defined; bursts in bursts are not read"));
}

TEST(Lint, TesterLimits) {
  const CycleStream good = expand(small_test());
  EXPECT_TRUE(lint(good, {}).empty());
  const auto reason = [&](const std::function<void(CycleStream&, TesterProfile&)>& change) {
    CycleStream stream = good;
    TesterProfile profile;
    change(stream, profile);
    const std::vector<std::string> reasons = lint(stream, profile);
    return reasons.empty() ? std::string() : reasons[0];
  };
  EXPECT_THAT(reason([](CycleStream& s, TesterProfile&) { s.timing.period_ns = 5; }),
              HasSubstr("period of 5 ns"));
  EXPECT_THAT(reason([](CycleStream& s, TesterProfile&) { s.timing.strobe_ns = 40.3; }),
              HasSubstr("strobe at 40.3 ns"));
  EXPECT_THAT(reason([](CycleStream& s, TesterProfile&) { s.timing.strobe_ns = 60; }),
              HasSubstr("before the clock"));
  EXPECT_THAT(reason([](CycleStream& s, TesterProfile&) { s.timing.clock_fall_ns = 52; }),
              HasSubstr("clock pulse of 2 ns"));
  EXPECT_THAT(reason([](CycleStream&, TesterProfile& p) { p.pins = 3; }), HasSubstr("9 pins"));
  EXPECT_THAT(reason([](CycleStream&, TesterProfile& p) { p.vector_memory = 3; }), HasSubstr("vectors"));
  EXPECT_THAT(reason([](CycleStream& s, TesterProfile&) { s.cycles[4].states[0] = 'H'; }),
              HasSubstr("cycle 4: found H on clk, expected 0, 1, P or N"));
  EXPECT_THAT(reason([](CycleStream& s, TesterProfile&) { s.cycles[4].states[8] = 'N'; }),
              HasSubstr("cycle 4: found N on so[1], expected H, L or X"));
}

// Replay fills in what a file leaves open; a tester's limits say nothing against it.
TEST(Lint, AnInputMayBeLeftOpen) {
  const std::string text = R"(STIL 1.0; Signals { a In; y Out; }
Timing { WaveformTable t { Period '100ns'; Waveforms { a { 01NZ { '0ns' D/U/N/Z; } } y { LHX { '40ns' L/H/X; } } } } }
PatternBurst p { PatList { main; } } PatternExec { PatternBurst p; }
Pattern main { W t; V { a=1; y=H; } V { a=N; y=X; } V { a=Z; y=X; } })";
  EXPECT_THAT(lint(parse_stil(text, "a.stil"), {}), testing::IsEmpty());
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + what.size())) ++n;
  return n;
}

// Every cycle is in each format, runs counted.
TEST(Formats, HoldEveryCycle) {
  const CycleStream stream = expand(small_test());
  std::size_t repeated = 0;
  for (std::size_t i = 1; i < stream.cycles.size(); ++i)
    repeated +=
        stream.cycles[i].states == stream.cycles[i - 1].states && stream.cycles[i].label.empty() ? 1 : 0;
  const std::size_t runs = stream.cycles.size() - repeated;
  EXPECT_EQ(count(wgl_text(stream), "vector(tp)"), runs);
  EXPECT_EQ(count(atp_text(stream), "> tp0"), runs);
  EXPECT_EQ(count(avc_text(stream), " tp0 "), runs);
  EXPECT_EQ(count(mem_text(stream), "\n"), stream.cycles.size());
  EXPECT_EQ(count(evcd_text(stream), "$var port"), stream.signals.size());
  std::size_t pulses = 0;
  for (const TestCycle& cycle : stream.cycles) pulses += cycle.states[0] == 'P' ? 1 : 0;
  EXPECT_EQ(count(evcd_text(stream), "pU 0 6 <0\n"), pulses);
  EXPECT_EQ(count(vcd_text(stream), "\n1!\n"), pulses);
}

}  // namespace
}  // namespace meltstage::dft
